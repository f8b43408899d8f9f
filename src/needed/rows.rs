//! The taps at which models are compared: whole rows, a whisker at one drive over some of its distances.

use std::sync::Arc;

use crate::chart::ranges::Wanted;
use crate::error::Error;
use crate::explain::Sample;
use crate::scene::sampler::Sampler;
use crate::scene::{COLUMNS, Column, Direction, Layout, Space, Study, Tuple};

/// Distances of a row at most.
const DISTANCES: u64 = 8;
/// Taps beside those of the spread, at least, where there are so many.
const OWN: u64 = 1024;
/// Whiskers inside a box.
const INSIDE: u32 = 96;
/// Seeds of the whiskers of the spread, and of those beside it.
const SEEDS: [u64; 2] = [0, 1];

/// A whisker at one drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// D, d, L_a, x_ss, l in mm and the drive in degrees or mm; its distance is not its own.
    pub point: Tuple,
    /// Contact distances, mm.
    pub distances: Arc<[f64]>,
    /// Smallest and largest distance asked of the whisker, mm.
    pub reach: [f64; 2],
}

impl Row {
    /// Of distances that are all there are.
    pub fn new(point: Tuple, distances: Arc<[f64]>) -> Self {
        let wider = |[lo, hi]: [f64; 2], a: &f64| [lo.min(*a), hi.max(*a)];
        let reach = distances.iter().fold([f64::INFINITY, f64::NEG_INFINITY], wider);
        Self { point, distances, reach }
    }

    /// Tap `i`.
    pub fn tap(&self, i: usize) -> Tuple {
        Tuple { a: self.distances[i], ..self.point }
    }
}

/// Rows by which a model is chosen, and other rows by which the choice is checked.
#[derive(Debug, Clone, Default)]
pub struct ComparedRows {
    /// All of a small space; of a large one a spread with its ends.
    pub spread: Vec<Row>,
    /// Of the same space; none where the spread is all of it.
    pub own: Vec<Row>,
}

impl ComparedRows {
    /// Of the taps of `study`: the spread of [`Sample`] and the corners of the space.
    ///
    /// # Errors
    /// A tuple file that cannot be read again.
    pub fn of_study(study: &Study) -> Result<Self, Error> {
        Ok(match &study.space {
            Space::Grid(factors) => Self::of_grid(study, &Layout::new(factors))?,
            Space::List(listed) => Self::of_list(&listed.iter().collect::<Vec<_>>()),
        })
    }

    fn of_grid(study: &Study, layout: &Layout) -> Result<Self, Error> {
        let sample = Sample::new(study)?;
        let mut spread = of_sample(&sample);
        spread.iter_mut().for_each(|row| row.reach = layout.reach());
        if sample.tasks.len() as u64 == layout.len() {
            return Ok(Self { spread, own: Vec::new() });
        }
        let distances = even(layout);
        for direction in outermost(layout) {
            spread.extend(corners(&Wanted::of(layout), direction, &distances, layout.reach()));
        }
        // M. Roberts' sequence of two dimensions: even, without a period, and other designs than those of the spread.
        let place =
            |i: u64, ratio: f64, n: u64| ((((i as f64 + 1.0) * ratio).fract() * n as f64) as u64).min(n - 1);
        let own = (0..OWN.div_ceil(distances.len() as u64)).map(|i| {
            let design = layout.design(place(i, 0.754_877_666_246_692_7, layout.n_designs));
            let point = layout.stroke(&design, place(i, 0.569_840_290_998_053_3, layout.n_drives));
            Row { point, distances: distances.clone(), reach: layout.reach() }
        });
        Ok(Self { spread, own: own.collect() })
    }

    fn of_list(tuples: &[Tuple]) -> Self {
        let sample = Sample::list(tuples);
        let mut spread = of_sample(&sample);
        if sample.tasks.len() == tuples.len() {
            return Self { spread, own: Vec::new() };
        }
        for column in 0..COLUMNS {
            let key = |t: &&Tuple| t.to_array()[column];
            let least = tuples.iter().min_by(|a, b| key(a).total_cmp(&key(b)));
            let largest = tuples.iter().max_by(|a, b| key(a).total_cmp(&key(b)));
            spread.extend(least.into_iter().chain(largest).map(|t| Row::new(*t, [t.a].into())));
        }
        // The same rule on the list turned by a third of itself takes other rows.
        let mut turned = tuples.to_vec();
        turned.rotate_left(tuples.len() / 3);
        let mut own = of_sample(&Sample::list(&turned));
        own.truncate(own.len() / 2);
        Self { spread, own }
    }

    /// Of whiskers anywhere in the box `wanted`, over the distances of `layout`.
    pub fn of_box(wanted: &Wanted, layout: &Layout) -> Self {
        let (distances, reach, directions) = (even(layout), layout.reach(), outermost(layout));
        let inside = |seed: u64, n: u32| -> Vec<Row> {
            let share = |k: u32, i: u32| f64::from(Sampler::Sobol.coordinate(seed, k, i)) / 2f64.powi(32);
            let at = |i: u32| {
                let value = |(k, [lo, hi]): (u32, [f64; 2])| lo + (hi - lo) * share(k, i);
                let [big, tip, length, x_ss, grid, drive] =
                    std::array::from_fn(|k| value((k as u32, sides(wanted)[k])));
                let direction = directions[i as usize % directions.len()];
                Row {
                    point: point([big, tip, length, x_ss, grid, drive]).towards(direction),
                    distances: distances.clone(),
                    reach,
                }
            };
            (0..n).map(at).collect()
        };
        let mut spread: Vec<Row> =
            directions.iter().flat_map(|d| corners(wanted, *d, &distances, reach)).collect();
        spread.extend(inside(SEEDS[0], INSIDE));
        Self { spread, own: inside(SEEDS[1], INSIDE / 2) }
    }
}

/// Ranges of D, d, L_a, x_ss, l and the drive.
fn sides(w: &Wanted) -> [[f64; 2]; 6] {
    [w.D, w.d, w.L_a, w.x_ss, w.l, w.drive]
}

#[allow(non_snake_case)]
fn point([D, d, L_a, x_ss, l, drive]: [f64; 6]) -> Tuple {
    Tuple { D, d, L_a, x_ss, l, a: f64::NAN, drive, ..Tuple::default() }
}

/// The directions of poles at the ends of tilt and lean, each once: of a layout with upright poles alone that one.
fn outermost(layout: &Layout) -> Vec<Direction> {
    let [tilts, leans] = [Column::Tilt, Column::Lean].map(|column| layout.bounds(column));
    let all = tilts.into_iter().flat_map(|tilt| leans.map(|lean| Direction { tilt, lean }));
    let mut once: Vec<Direction> = Vec::new();
    all.for_each(|d| {
        if !once.contains(&d) {
            once.push(d)
        }
    });
    once
}

/// The corners of a box against poles of a direction, each once.
fn corners<'a>(
    wanted: &Wanted,
    direction: Direction,
    distances: &'a Arc<[f64]>,
    reach: [f64; 2],
) -> impl Iterator<Item = Row> + use<'a> {
    let sides = sides(wanted);
    let one = move |k: u32| -> Option<Row> {
        let repeated = |i: usize| k >> i & 1 == 1 && sides[i][0] == sides[i][1];
        let values = std::array::from_fn(|i| sides[i][(k >> i & 1) as usize]);
        let row = || Row { point: point(values).towards(direction), distances: distances.clone(), reach };
        (!(0..6).any(repeated)).then(row)
    };
    (0..1 << 6).filter_map(one)
}

/// At most [`DISTANCES`] distances of `layout`, first and last among them.
fn even(layout: &Layout) -> Arc<[f64]> {
    let (n, some) = (layout.n_distances, layout.n_distances.min(DISTANCES));
    let gaps = u128::from(some.saturating_sub(1).max(1));
    (0..some).map(|i| layout.distance((u128::from(i) * u128::from(n - 1) / gaps) as u64)).collect()
}

fn of_sample(sample: &Sample) -> Vec<Row> {
    let row = |ends: &[usize]| {
        let tasks = &sample.tasks[ends[0]..ends[1]];
        let design = sample.designs[tasks[0].design as usize];
        Row::new(
            Tuple { drive: tasks[0].drive, ..design.towards(tasks[0].direction) },
            tasks.iter().map(|t| t.a).collect(),
        )
    };
    sample.rows.windows(2).filter(|ends| ends[1] > ends[0]).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explain::samples::{listed, study};

    #[test]
    fn a_small_space_is_compared_whole() {
        let rows = ComparedRows::of_study(&study("[4, 7]", "[20, 30, 40]", "[1, 2]")).expect("a grid");
        assert!(rows.own.is_empty());
        assert_eq!(rows.spread.iter().map(|r| r.distances.len()).sum::<usize>(), 12);
        assert!(rows.spread.iter().all(|r| r.reach == [20.0, 40.0]));
    }

    #[test]
    fn a_large_space_has_its_corners_and_rows_of_its_own() {
        let rows = ComparedRows::of_study(&study(
            "{ min = 2, max = 9, samples = 100000 }",
            "{ from = 10, to = 50, steps = 100 }",
            "{ from = 1, to = 9, steps = 80 }",
        ))
        .expect("a grid");
        for (d, drive) in [(2.0, 1.0), (2.0, 9.0), (9.0, 1.0), (9.0, 9.0)] {
            assert!(rows.spread.iter().any(|r| r.point.d == d && r.point.drive == drive), "{d}, {drive}");
        }
        let taps = |rows: &[Row]| rows.iter().map(|r| r.distances.len()).sum::<usize>();
        assert!(taps(&rows.spread) <= 2100 && taps(&rows.own) >= 1024);
        let again = |r: &Row| rows.spread.iter().any(|s| s.point == r.point);
        assert!(rows.own.iter().filter(|r| again(r)).count() * 10 < rows.own.len());
    }

    #[test]
    fn corners_are_those_of_every_outermost_pole() {
        let text = "{ min = 2, max = 9, samples = 100000 }";
        let mut tilted = study(
            text,
            "{ from = 10, to = 50, steps = 100 }",
            "[1, 9]\ntilt = { from = -20, to = 30, steps = 11 }\nlean = 5",
        );
        let rows = ComparedRows::of_study(&tilted).expect("a grid");
        for (tilt, d, drive) in [(-20.0, 2.0, 1.0), (-20.0, 9.0, 9.0), (30.0, 2.0, 9.0), (30.0, 9.0, 1.0)] {
            let there = |r: &Row| {
                let t = r.point;
                (t.tilt, t.lean, t.d, t.drive) == (tilt, 5.0, d, drive)
            };
            assert!(rows.spread.iter().any(there), "{tilt} {d} {drive}");
        }
        let Space::Grid(factors) = &mut tilted.space else { panic!("a grid") };
        let layout = Layout::new(factors);
        let boxed = ComparedRows::of_box(&Wanted::of(&layout), &layout);
        let tilts =
            |rows: &[Row]| [-20.0, 30.0].map(|tilt| rows.iter().filter(|r| r.point.tilt == tilt).count());
        assert!(tilts(&boxed.spread).iter().chain(&tilts(&boxed.own)).all(|n| *n > 20));
        assert!(boxed.spread.iter().all(|r| r.point.lean == 5.0));
    }

    #[test]
    fn of_a_long_list_every_column_has_its_ends() {
        let rows = ComparedRows::of_list(&listed(1000, 10));
        for end in [2.0, 2.999] {
            assert!(rows.spread.iter().any(|r| r.point.d == end), "{end}");
        }
        assert!(rows.own.len() > 20);
    }
}
