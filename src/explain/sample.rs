//! The taps that an explanation looks at: all of a small study, an even spread of a large one.

use std::collections::{BTreeSet, HashMap};

use crate::error::Error;
use crate::evaluate::Task;
use crate::plan::Layout;
use crate::scene::{Space, Study, Tuple};

/// Taps that are compared at most.
pub const LIMIT: u64 = 2000;

/// Distances and drives of a design that are kept at least, where it has so many.
const LEAST: [u64; 2] = [16, 8];

/// Some taps of a study, in whole rows: a row is a design at one drive, over its distances.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sample {
    /// Designs; distance and drive are not their own.
    pub designs: Vec<Tuple>,
    /// Taps, row after row.
    pub tasks: Vec<Task>,
    /// First tap of every row, and the number of taps.
    pub rows: Vec<usize>,
    /// Taps of the study.
    pub total: u64,
}

impl Sample {
    /// Taps of `study`: all, or about [`LIMIT`] of them, the same ones every time.
    ///
    /// First and last distance and drive are always among them; designs are spread by the golden ratio, which no
    /// period of a grid can meet.
    ///
    /// # Errors
    /// A tuple file that cannot be read again.
    pub fn new(study: &Study) -> Result<Self, Error> {
        Ok(match &study.space {
            Space::Grid(factors) => Self::grid(&Layout::new(factors)),
            Space::List(listed) => Self::list(&listed.iter().collect::<Vec<_>>()),
        })
    }

    /// Tap `i` as a tuple.
    pub fn tuple(&self, i: usize) -> Tuple {
        let Task { design, a, direction, drive } = self.tasks[i];
        Tuple { a, drive, ..self.designs[design as usize].towards(direction) }
    }

    fn grid(layout: &Layout) -> Self {
        let mut sample = Self { total: layout.len(), rows: vec![0], ..Self::default() };
        let (mut distances, mut drives, mut designs) =
            (layout.n_distances, layout.n_drives, layout.n_designs);
        if sample.total > LIMIT {
            (distances, drives) = (distances.min(LEAST[0]), drives.min(LEAST[1]));
            designs = designs.min(LIMIT / (distances * drives));
            drives = layout.n_drives.min(LIMIT / (designs * distances));
            distances = layout.n_distances.min(LIMIT / (designs * drives));
        }
        for k in golden(layout.n_designs, designs) {
            let design = layout.design(k);
            let place = sample.designs.len() as u32;
            sample.designs.push(design);
            for j in even(layout.n_drives, drives) {
                let stroke = layout.stroke(&design, j);
                let row = even(layout.n_distances, distances)
                    .map(|i| Task::of(place, &Tuple { a: layout.distance(i), ..stroke }));
                sample.tasks.extend(row);
                sample.rows.push(sample.tasks.len());
            }
        }
        sample
    }

    /// As [`Self::new`], of listed taps.
    pub fn list(tuples: &[Tuple]) -> Self {
        let mut sample = Self { total: tuples.len() as u64, rows: vec![0], ..Self::default() };
        let (mut at, mut rows) = (HashMap::new(), Vec::<Vec<usize>>::new());
        for (i, t) in tuples.iter().enumerate() {
            let key = Tuple { a: 0.0, ..*t }.to_array().map(|x| (x + 0.0).to_bits());
            let row = *at.entry(key).or_insert_with(|| {
                rows.push(Vec::new());
                rows.len() - 1
            });
            rows[row].push(i);
        }
        let (n, mut longest) = (rows.len() as u64, u64::MAX);
        let mut chosen = n;
        if sample.total > LIMIT {
            longest = LIMIT / n.min(LIMIT / LEAST[0]);
            let mean = rows.iter().map(|r| (r.len() as u64).min(longest)).sum::<u64>().div_ceil(n);
            chosen = n.min(LIMIT / mean);
        }
        for r in golden(n, chosen) {
            let row = &rows[r as usize];
            let n = row.len() as u64;
            let design = sample.designs.len() as u32;
            sample.designs.push(tuples[row[0]]);
            let taps = even(n, n.min(longest)).map(|i| tuples[row[i as usize]]);
            sample.tasks.extend(taps.map(|t| Task::of(design, &t)));
            sample.rows.push(sample.tasks.len());
        }
        sample
    }
}

/// `some` of 0 … `n` − 1, both ends included, ascending.
fn even(n: u64, some: u64) -> impl Iterator<Item = u64> {
    let gaps = some.saturating_sub(1).max(1);
    (0..some).map(move |i| (u128::from(i) * u128::from(n - 1) / u128::from(gaps)) as u64)
}

/// `some` of 0 … `n` − 1, or a few less, without a period, ascending.
fn golden(n: u64, some: u64) -> impl Iterator<Item = u64> {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let all = some >= n;
    let spread = |i: u64| ((i as f64 * RATIO).fract() * n as f64) as u64;
    let chosen: BTreeSet<u64> = (0..some).map(|i| if all { i } else { spread(i).min(n - 1) }).collect();
    chosen.into_iter()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::spec::parse;
    use std::path::Path;

    /// A study of whiskers with these tips, distances and tap angles, as a spec writes them.
    pub fn study(d: &str, a: &str, theta: &str) -> Study {
        let text = format!(
            "[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}"
        );
        parse("t.toml", &text, Path::new("")).expect("valid spec").study
    }

    /// Taps of so many whiskers at so many distances each, one distance after the other.
    pub fn listed(whiskers: u64, distances: u64) -> Vec<Tuple> {
        let whisker = Tuple { D: 10.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
        let tuple = |k: u64, i: u64| Tuple {
            d: 2.0 + 1e-3 * k as f64,
            a: 20.0 + i as f64,
            drive: 1.0 + 1e-3 * (k % 7) as f64,
            ..whisker
        };
        (0..distances).flat_map(|i| (0..whiskers).map(move |k| tuple(k, i))).collect()
    }

    fn sample(d: &str, a: &str, theta: &str) -> Sample {
        Sample::new(&study(d, a, theta)).expect("a grid")
    }

    #[test]
    fn a_small_scene_is_taken_whole() {
        let s = sample("[4, 7]", "[20, 30, 40]", "[1, 2]");
        assert_eq!((s.total, s.tasks.len(), s.rows.as_slice()), (12, 12, [0, 3, 6, 9, 12].as_slice()));
        assert_eq!((s.tuple(11).d, s.tuple(11).a, s.tuple(11).drive), (7.0, 40.0, 2.0));
    }

    #[test]
    fn a_large_scene_keeps_its_ends_and_whole_rows() {
        let s = sample(
            "{ from = 2, to = 10, steps = 4000 }",
            "{ from = 10, to = 50, steps = 400 }",
            "{ from = 1, to = 9, steps = 80 }",
        );
        assert_eq!(s.total, 4000 * 400 * 80);
        assert!((1500..=LIMIT as usize).contains(&s.tasks.len()), "{}", s.tasks.len());
        for row in s.rows.windows(2) {
            let row = &s.tasks[row[0]..row[1]];
            assert_eq!((row[0].a, row[row.len() - 1].a), (10.0, 50.0));
        }
        for end in [1.0, 9.0] {
            assert!(s.tasks.iter().any(|t| t.drive == end));
        }
        let one = sample("4", "{ from = 10, to = 50, steps = 40000 }", "{ from = 1, to = 9, steps = 3 }");
        assert_eq!((one.designs.len(), one.tasks.len()), (1, 1998));
    }

    #[test]
    fn a_long_list_is_thinned_in_whole_rows() {
        for (designs, distances) in [(1000, 10), (5000, 1), (3, 5000)] {
            let s = Sample::list(&listed(designs, distances));
            assert!((1000..=LIMIT as usize).contains(&s.tasks.len()), "{}", s.tasks.len());
            assert!(s.rows.windows(2).all(|r| s.tasks[r[0]].a == 20.0));
        }
        assert!(Sample::list(&[]).tasks.is_empty());
    }
}
