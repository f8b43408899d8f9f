//! Values that are meant to be one: 2.15, 2.17 and 2.19 mm are one drive that a motor reached with jitter.

/// Gaps within a group are at most this share of the gaps between groups.
const APART: f64 = 1.0 / 8.0;
/// A group is at most this wide, relative to its mean.
const WIDE: f64 = 0.1;

/// Distinct values sorted into groups.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Groups {
    /// Means of the groups over all values, ascending.
    pub centres: Vec<f64>,
    /// Largest value of each.
    ends: Vec<f64>,
    /// Number of distinct values.
    pub distinct: usize,
    /// Width of the widest group.
    pub width: f64,
}

impl Groups {
    /// Values within `width` of their neighbours are one; by default what the gaps of the data say, with 0 only equal ones. With
    /// `alone`, values that have no gap between them may be one group.
    pub fn of(values: impl Iterator<Item = f64>, width: Option<f64>, alone: bool) -> Self {
        let mut all: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        let mut distinct = all.clone();
        distinct.dedup();
        let within = width.unwrap_or_else(|| jitter(&distinct, alone));
        let mut groups = Self { distinct: distinct.len(), ..Self::default() };
        for group in all.chunk_by(|p, q| q - p <= within) {
            groups.centres.push(mean(group));
            groups.ends.push(group[group.len() - 1]);
            groups.width = groups.width.max(group[group.len() - 1] - group[0]);
        }
        groups
    }

    /// Mean of the group of `x`, which is one of the values; itself where it is none.
    pub fn centre(&self, x: f64) -> f64 {
        let place = self.ends.partition_point(|e| *e < x);
        self.centres.get(place).copied().filter(|_| x.is_finite()).unwrap_or(x)
    }

    /// Whether any group holds more than one distinct value.
    pub fn joined(&self) -> bool {
        self.centres.len() < self.distinct
    }
}

/// Mean; exactly the value of equal ones.
fn mean(values: &[f64]) -> f64 {
    values[0] + values.iter().map(|x| x - values[0]).sum::<f64>() / values.len() as f64
}

/// Largest gap that is jitter: between the sizes of gaps there is a step, and what the small ones join is narrow beside its value and
/// beside the gaps that remain; 0 where there is no such step.
fn jitter(distinct: &[f64], alone: bool) -> f64 {
    let (Some(first), Some(last)) = (distinct.first(), distinct.last()) else { return 0.0 };
    let mut gaps: Vec<f64> = distinct.windows(2).map(|w| w[1] - w[0]).collect();
    gaps.sort_by(|p, q| q.total_cmp(p));
    let narrow = |within: f64, between: f64| {
        distinct.chunk_by(|p, q| q - p <= within).all(|g| {
            let width = g[g.len() - 1] - g[0];
            width <= WIDE * mean(g).abs() && width <= 2.0 * APART * between
        })
    };
    let step = gaps.windows(2).filter(|w| w[1] <= APART * w[0] && narrow(w[1], w[0]));
    if let Some(best) = step.max_by(|v, w| (v[0] / v[1]).total_cmp(&(w[0] / w[1]))) {
        return best[1];
    }
    let one = alone && distinct.len() > 1 && last - first <= WIDE * mean(distinct).abs();
    if one { last - first } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn centres(values: &[f64], width: Option<f64>) -> Vec<f64> {
        let groups = Groups::of(values.iter().copied(), width, false);
        groups.centres.iter().map(|x| (x * 1e3).round() / 1e3).collect()
    }

    #[test]
    fn jitter_is_told_from_steps() {
        assert_eq!(centres(&[2.15, 2.17, 2.19, 4.15, 4.17, 6.15], None), [2.17, 4.16, 6.15]);
        assert_eq!(centres(&[144.105, 144.115, 139.6, 139.61, 135.1], None), [135.1, 139.605, 144.11]);
        // Steps of a plan are no jitter, however they grow.
        for plan in [
            vec![20.0, 25.0, 30.0, 35.0],
            vec![0.5, 1.0, 2.0, 5.0, 10.0],
            vec![0.5, 1.0, 1.5, 2.0, 2.5, 60.0],
            vec![20.0, 22.5, 26.0, 31.0, 38.0],
            vec![40.0, 41.0],
            vec![7.0],
        ] {
            assert_eq!(centres(&plan, None), plan);
        }
        assert_eq!(centres(&[2.15, 2.17, 4.15], Some(0.0)), [2.15, 2.17, 4.15]);
        assert_eq!(centres(&[2.0, 2.5, 4.0], Some(0.5)), [2.25, 4.0]);
        let one = Groups::of([4.0, 4.02, 4.1].into_iter(), None, true);
        assert!(one.joined() && one.centres.len() == 1 && one.centre(4.02) == one.centres[0]);
        assert_eq!(Groups::of([40.0, 41.0, 42.0].into_iter(), None, false).centres.len(), 3);
    }
}
