//! Groups values meant to be equal: 2.15, 2.17 and 2.19 mm are one drive that a motor reached with jitter.

use crate::reduce::{distinct, sorted};

/// Largest gap within a group, as a share of the gaps between groups.
const APART: f64 = 1.0 / 8.0;
/// Largest width of a group, relative to its mean.
const WIDE: f64 = 0.1;
/// The same if fewer than three groups would remain, so that values set close together are kept apart.
const FEW: f64 = 0.01;
/// Most levels of a table.
const LEVELS: usize = 64;
/// Relative difference that counts as rounding: that of single precision.
pub const ROUNDING: f64 = f32::EPSILON as f64;

/// Largest difference that counts as rounding at this `size`.
pub fn rounding(size: f64) -> f64 {
    ROUNDING * size.abs()
}

/// Replaces values that differ only by rounding by the one with the fewest digits, or 0. Rounding is relative to the value or the 90 % quantile.
pub fn rounded(values: &[f64]) -> Vec<f64> {
    let finite = || values.iter().copied().filter(|x| x.is_finite());
    let sizes = sorted(finite().map(f64::abs));
    let usual = sizes.get(9 * sizes.len() / 10).copied().unwrap_or_default();
    let all = distinct(finite());
    let slack = |x: f64| rounding(usual.max(x.abs()));
    let plain = |x: f64| if x.abs() <= slack(0.0) { 0.0 } else { x };
    let (mut firsts, mut shortest, mut rest) = (Vec::new(), Vec::new(), &all[..]);
    while let Some(&first) = rest.first() {
        let (here, after) = rest.split_at(rest.partition_point(|x| x - first <= slack(first)));
        firsts.push(first);
        shortest.extend(here.iter().map(|x| plain(*x)).min_by_key(|x| x.to_string().len()));
        rest = after;
    }
    let place = |x: f64| firsts.partition_point(|first| *first <= x).wrapping_sub(1);
    values.iter().map(|x| shortest.get(place(*x)).copied().filter(|_| x.is_finite()).unwrap_or(*x)).collect()
}

/// Distinct values sorted into groups.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Groups {
    /// Mean of each group, ascending.
    pub centres: Vec<f64>,
    ends: Vec<f64>,
    /// Number of distinct values.
    pub distinct: usize,
    /// Width of the widest group.
    pub width: f64,
}

impl Groups {
    /// Joins values within `width` of their neighbours; by default as the gaps suggest. With `alone`, all values may form one group.
    pub fn of(values: impl Iterator<Item = f64>, width: Option<f64>, alone: bool) -> Self {
        let all = sorted(values.filter(|x| x.is_finite()));
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

    /// Equal values; of more than 64, groups of neighbours that hold about as many values each.
    pub fn levels(values: impl Iterator<Item = f64>) -> Self {
        let all = sorted(values);
        let mut groups = Self::of(all.iter().copied(), Some(0.0), false);
        if groups.len() <= LEVELS {
            return groups;
        }
        (groups.centres, groups.ends) = Default::default();
        let mut from = 0;
        for end in (1..=LEVELS).map(|k| all[k * all.len() / LEVELS - 1]) {
            let to = all.partition_point(|x| *x <= end);
            if to > from {
                groups.centres.push(all[from..to].iter().sum::<f64>() / (to - from) as f64);
                groups.ends.push(end);
                from = to;
            }
        }
        groups
    }

    /// Number of groups.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Means of the first and the last group.
    pub fn ends(&self) -> [f64; 2] {
        [self.centres[0], self.centres[self.len() - 1]]
    }

    /// Index of the group that contains `x`, the last one beyond all.
    pub fn place(&self, x: f64) -> usize {
        self.ends.partition_point(|e| *e < x).min(self.len() - 1)
    }

    /// Mean of the group that contains `x`, or `x` if it is not one of the values.
    pub fn centre(&self, x: f64) -> f64 {
        let place = self.ends.partition_point(|e| *e < x);
        self.centres.get(place).copied().filter(|_| x.is_finite()).unwrap_or(x)
    }
}

/// Exact for equal values.
fn mean(values: &[f64]) -> f64 {
    values[0] + values.iter().map(|x| x - values[0]).sum::<f64>() / values.len() as f64
}

/// Largest gap that counts as jitter, 0 without any: the sorted gaps fall steeply below it, and the groups it makes are narrow relative to their mean
/// and to the larger gaps. Of several such steps the one between the largest gaps counts.
fn jitter(distinct: &[f64], alone: bool) -> f64 {
    let (Some(first), Some(last)) = (distinct.first(), distinct.last()) else { return 0.0 };
    let mut gaps: Vec<f64> = distinct.windows(2).map(|w| w[1] - w[0]).collect();
    gaps.sort_by(|p, q| q.total_cmp(p));
    let narrow = |within: f64, between: f64| {
        let groups = || distinct.chunk_by(|p, q| q - p <= within);
        let wide = if groups().count() < 3 { FEW } else { WIDE };
        groups().all(|g| {
            let width = g[g.len() - 1] - g[0];
            width <= wide * mean(g).abs() && width <= 2.0 * APART * between
        })
    };
    if let Some(step) = gaps.windows(2).find(|w| w[1] <= APART * w[0] && narrow(w[1], w[0])) {
        return step[1];
    }
    let one = alone && distinct.len() > 1 && last - first <= WIDE * mean(distinct).abs();
    if one { last - first } else { 0.0 }
}
