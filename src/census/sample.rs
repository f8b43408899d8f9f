//! Taps of a space in rows, a row being a whisker at one drive over distances: an even spread with the ends of the space, and its corners; and random
//! taps.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::chart::ranges::Wanted;
use crate::design::Design;
use crate::estimate::{Estimated, Estimator};
use crate::evaluate::Outcome;
use crate::reduce::range;
use crate::scene::{COLUMNS, Column, Direction, Layout, Listed, Sampler, Setup, Space, Study, Tuple};
use crate::statistics::{Reduction, Told};

/// Taps of a spread at most.
pub const LIMIT: u64 = 2000;
/// The same where a model is chosen by them: at least two thirds of these are there.
const CHOOSING: u64 = 3000;
/// Distances and drives of a design that a spread keeps at least, where there are so many.
const LEAST: [u64; 2] = [16, 8];
/// Distances of a corner, and of a whisker inside a box, at most.
const DISTANCES: u64 = 8;

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

/// The calibration of another whisker: its estimator, K̄ and drive.
pub type Given<'d> = (Estimator<'d>, Option<f64>, f64);

impl Row {
    /// Of distances that are all there are.
    pub fn new(point: Tuple, distances: Arc<[f64]>) -> Self {
        let reach = range(distances.iter().copied());
        Self { point, distances, reach }
    }

    /// Rows over `some` distances of `layout`, or all, first and last among them.
    pub fn over(layout: &Layout, some: u64) -> impl Fn(Tuple) -> Self {
        let some = even(layout.n_distances, some.min(layout.n_distances));
        let (distances, reach): (Arc<[f64]>, _) =
            (some.map(|i| layout.distance(i)).collect(), layout.reach());
        move |point| Self { point, distances: distances.clone(), reach }
    }

    pub fn taps(&self) -> impl Iterator<Item = Tuple> {
        self.distances.iter().map(|a| Tuple { a: *a, ..self.point })
    }

    /// The statistics of its `design` and the estimate of each of its solved `taps`; `told` converts the strain of each, by the calibration of
    /// another whisker if it is `given`.
    pub fn reduced<'d, 't>(
        &self,
        setup: &Setup,
        design: &'d Design,
        taps: &[Outcome],
        told: impl Fn(usize) -> Told<'t>,
        given: Option<Given<'d>>,
    ) -> (Reduction<'d>, Vec<Estimated>) {
        let own = || Some(Estimator::new(design.setup(setup), design.shared.as_ref()?, self.reach));
        let estimator = given.map_or_else(own, |(estimator, ..)| Some(estimator));
        let mut reduced = Reduction::with(setup, design, estimator, (taps.len(), 1));
        let at = |i: usize, drive: f64| (self.distances[i], drive);
        taps.iter().enumerate().for_each(|(i, tap)| reduced.count((i, 0), at(i, self.point.drive), tap));
        match given {
            Some((_, k, _)) => reduced.drives.iter_mut().for_each(|row| row.k = k),
            None => reduced.calibrate(),
        }
        let drive = given.map_or(self.point.drive, |(.., drive)| drive);
        let estimate = |(i, tap): (usize, &Outcome)| reduced.estimate((i, 0), at(i, drive), tap, told(i));
        let estimates = taps.iter().enumerate().map(estimate).collect();
        (reduced, estimates)
    }
}

pub fn taps(rows: &[Row]) -> usize {
    rows.iter().map(|row| row.distances.len()).sum()
}

/// Taps of `space`, and how many it has: all, or about `limit` of them, the same ones every time. First and last distance and drive are always
/// among them; designs are spread by the golden ratio, which no period of a grid can meet.
pub fn spread(space: &Space, limit: u64) -> (Vec<Row>, u64) {
    match space {
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            (of_grid(&layout, limit), layout.len())
        }
        Space::List(listed) => (of_list(listed, limit), listed.len() as u64),
    }
}

fn of_grid(layout: &Layout, limit: u64) -> Vec<Row> {
    let (mut distances, mut drives, mut designs) = (layout.n_distances, layout.n_drives, layout.n_designs);
    if layout.len() > limit {
        (distances, drives) = (distances.min(LEAST[0]), drives.min(LEAST[1]));
        designs = designs.min(limit / (distances * drives));
        drives = layout.n_drives.min(limit / (designs * distances));
        distances = layout.n_distances.min(limit / (designs * drives));
    }
    let strokes = |k: u64| {
        let design = layout.design(k);
        even(layout.n_drives, drives).map(move |j| layout.stroke(&design, j))
    };
    golden(layout.n_designs, designs).flat_map(strokes).map(Row::over(layout, distances)).collect()
}

fn of_list(listed: &Listed, limit: u64) -> Vec<Row> {
    let groups = listed.groups();
    let mut rows = vec![Vec::new(); groups.counts[1] as usize];
    groups.strokes.iter().enumerate().for_each(|(i, stroke)| rows[*stroke as usize].push(i));
    let (n, mut longest) = (rows.len() as u64, u64::MAX);
    let mut chosen = n;
    if listed.len() as u64 > limit {
        longest = limit / n.min(limit / LEAST[0]);
        let mean = rows.iter().map(|r| (r.len() as u64).min(longest)).sum::<u64>().div_ceil(n);
        chosen = n.min(limit / mean);
    }
    let row = |r: u64| {
        let row = &rows[r as usize];
        let n = row.len() as u64;
        let distances = even(n, n.min(longest)).map(|i| listed.tuple(row[i as usize]).a);
        Row::new(listed.tuple(row[0]), distances.collect())
    };
    golden(n, chosen).map(row).collect()
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

/// About `samples` random taps of `space`, in its order, none twice; all of them where there are no more.
pub fn random(space: &Space, samples: u32, seed: u64) -> Vec<Tuple> {
    let (len, at) = space.tuples();
    if len <= u64::from(samples) {
        return (0..len).map(at).collect();
    }
    let index = |k: u32| {
        let [high, low] = [0, 1].map(|dimension| Sampler::Random.coordinate(seed, dimension, k));
        let fraction = u128::from(high) << 32 | u128::from(low);
        ((fraction * u128::from(len)) >> 64) as u64
    };
    let mut chosen = BTreeSet::new();
    for k in 0..4 * u64::from(samples) {
        if chosen.len() == samples as usize {
            break;
        }
        chosen.insert(index(k as u32));
    }
    chosen.into_iter().map(at).collect()
}

/// The rows of `study` by which a model is chosen: all of a small space; of a large one at least 2000 taps spread over it, and its corners.
pub fn choosing(study: &Study) -> Vec<Row> {
    let (mut rows, total) = spread(&study.space, CHOOSING);
    if taps(&rows) as u64 == total {
        return rows;
    }
    match &study.space {
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            rows.extend(corners(&Wanted::of(&layout), &layout));
        }
        Space::List(listed) => {
            for column in 0..COLUMNS {
                let key = |t: &Tuple| t.to_array()[column];
                let least = listed.iter().min_by(|a, b| key(a).total_cmp(&key(b)));
                let largest = listed.iter().max_by(|a, b| key(a).total_cmp(&key(b)));
                rows.extend(least.into_iter().chain(largest).map(|t| Row::new(t, [t.a].into())));
            }
        }
    }
    rows
}

/// The rows by which a model is chosen for whiskers anywhere in the box `wanted`, over the distances of `layout`: at least 2000 taps, and the corners.
pub fn choosing_in(wanted: &Wanted, layout: &Layout) -> Vec<Row> {
    let (directions, sides, mut rows) = (outermost(layout), sides(wanted), corners(wanted, layout));
    let inside = |i: u32| {
        let share = |k: usize| f64::from(Sampler::Sobol.coordinate(0, k as u32, i)) / 2f64.powi(32);
        let value = |k: usize| sides[k][0] + (sides[k][1] - sides[k][0]) * share(k);
        point(std::array::from_fn(value)).towards(directions[i as usize % directions.len()])
    };
    let count = LIMIT.div_ceil(layout.n_distances.min(DISTANCES)) as u32;
    rows.extend((0..count).map(inside).map(Row::over(layout, DISTANCES)));
    rows
}

/// Ranges of D, d, L_a, x_ss, l and the drive.
pub fn sides(w: &Wanted) -> [[f64; 2]; 6] {
    [w.D, w.d, w.L_a, w.x_ss, w.l, w.drive]
}

/// The tuple of D, d, L_a, x_ss, l and the drive.
#[allow(non_snake_case)]
pub fn point([D, d, L_a, x_ss, l, drive]: [f64; 6]) -> Tuple {
    Tuple { D, d, L_a, x_ss, l, a: f64::NAN, drive, ..Tuple::default() }
}

/// The directions of poles at the ends of tilt and lean, each once: of a layout with upright poles alone that one.
fn outermost(layout: &Layout) -> Vec<Direction> {
    let [tilts, leans] = [Column::Tilt, Column::Lean].map(|column| layout.bounds(column));
    let mut once: Vec<Direction> = Vec::new();
    for direction in tilts.into_iter().flat_map(|tilt| leans.map(|lean| Direction { tilt, lean })) {
        if !once.contains(&direction) {
            once.push(direction);
        }
    }
    once
}

/// The corners of a box against the outermost poles of `layout`, each once, over its distances.
fn corners(wanted: &Wanted, layout: &Layout) -> Vec<Row> {
    let sides = sides(wanted);
    let once = |k: &u32| (0..6).all(|i| k >> i & 1 == 0 || sides[i][0] != sides[i][1]);
    let corner = |k: u32| point(std::array::from_fn(|i| sides[i][(k >> i & 1) as usize]));
    let poles = outermost(layout).into_iter();
    let points = poles.flat_map(|d| (0..1 << 6).filter(once).map(move |k| corner(k).towards(d)));
    points.map(Row::over(layout, DISTANCES)).collect()
}
