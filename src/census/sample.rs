//! Taps of a space in rows, a row being a whisker at one drive over distances: an even spread with the ends of the space, its corners, and others
//! that check what these have shown.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::chart::ranges::Wanted;
use crate::scene::sampler::Sampler;
use crate::scene::{COLUMNS, Column, Direction, Layout, Listed, Space, Study, Tuple};

/// Taps of a spread at most.
pub const LIMIT: u64 = 2000;
/// Distances and drives of a design that a spread keeps at least, where there are so many.
const LEAST: [u64; 2] = [16, 8];
/// Distances of a row beside those of the spread at most.
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

    /// Its taps.
    pub fn taps(&self) -> impl Iterator<Item = Tuple> {
        self.distances.iter().map(|a| Tuple { a: *a, ..self.point })
    }
}

/// Number of taps of `rows`.
pub fn taps(rows: &[Row]) -> usize {
    rows.iter().map(|row| row.distances.len()).sum()
}

/// Taps of `study`, and how many it has: all, or about [`LIMIT`] of them, the same ones every time. First and last distance and drive are always
/// among them; designs are spread by the golden ratio, which no period of a grid can meet.
pub fn spread(study: &Study) -> (Vec<Row>, u64) {
    match &study.space {
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            (of_grid(&layout), layout.len())
        }
        Space::List(listed) => (of_list(listed, 0), listed.len() as u64),
    }
}

fn of_grid(layout: &Layout) -> Vec<Row> {
    let (mut distances, mut drives, mut designs) = (layout.n_distances, layout.n_drives, layout.n_designs);
    if layout.len() > LIMIT {
        (distances, drives) = (distances.min(LEAST[0]), drives.min(LEAST[1]));
        designs = designs.min(LIMIT / (distances * drives));
        drives = layout.n_drives.min(LIMIT / (designs * distances));
        distances = layout.n_distances.min(LIMIT / (designs * drives));
    }
    let distances = over(layout, distances);
    let row = |point| Row { point, distances: distances.clone(), reach: layout.reach() };
    let strokes = |k: u64| {
        let design = layout.design(k);
        even(layout.n_drives, drives).map(move |j| layout.stroke(&design, j))
    };
    golden(layout.n_designs, designs).flat_map(strokes).map(row).collect()
}

/// As [`spread`], of listed taps, whose rows are counted from number `first` on.
fn of_list(listed: &Listed, first: usize) -> Vec<Row> {
    let groups = listed.groups();
    let mut rows = vec![Vec::new(); groups.counts[1] as usize];
    groups.strokes.iter().enumerate().for_each(|(i, stroke)| rows[*stroke as usize].push(i));
    rows.rotate_left(first);
    let (n, mut longest) = (rows.len() as u64, u64::MAX);
    let mut chosen = n;
    if listed.len() as u64 > LIMIT {
        longest = LIMIT / n.min(LIMIT / LEAST[0]);
        let mean = rows.iter().map(|r| (r.len() as u64).min(longest)).sum::<u64>().div_ceil(n);
        chosen = n.min(LIMIT / mean);
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

/// `some` distances of `layout`, or all, first and last among them.
fn over(layout: &Layout, some: u64) -> Arc<[f64]> {
    even(layout.n_distances, some.min(layout.n_distances)).map(|i| layout.distance(i)).collect()
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
    let (len, at): (u64, Box<dyn Fn(u64) -> Tuple>) = match space {
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            (layout.len(), Box::new(move |i| layout.tuple(i)))
        }
        Space::List(listed) => (listed.len() as u64, Box::new(|i| listed.tuple(i as usize))),
    };
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

/// Rows by which a model is chosen, and other rows by which the choice is checked.
#[derive(Debug, Clone, Default)]
pub struct ComparedRows {
    /// All of a small space; of a large one a spread with its ends.
    pub spread: Vec<Row>,
    /// Of the same space; none where the spread is all of it.
    pub own: Vec<Row>,
}

impl ComparedRows {
    /// Of the taps of `study`: its [`spread`] and the corners of the space.
    pub fn of_study(study: &Study) -> Self {
        match &study.space {
            Space::Grid(factors) => Self::of_layout(&Layout::new(factors)),
            Space::List(listed) => Self::of_listed(listed),
        }
    }

    fn of_layout(layout: &Layout) -> Self {
        let mut spread = of_grid(layout);
        if taps(&spread) as u64 == layout.len() {
            return Self { spread, own: Vec::new() };
        }
        spread.extend(corners(&Wanted::of(layout), layout));
        // M. Roberts' sequence of two dimensions: even, without a period, and other designs than those of the spread.
        let place =
            |i: u64, ratio: f64, n: u64| ((((i as f64 + 1.0) * ratio).fract() * n as f64) as u64).min(n - 1);
        let distances = over(layout, DISTANCES);
        let own = (0..OWN.div_ceil(distances.len() as u64)).map(|i| {
            let design = layout.design(place(i, 0.754_877_666_246_692_7, layout.n_designs));
            let point = layout.stroke(&design, place(i, 0.569_840_290_998_053_3, layout.n_drives));
            Row { point, distances: distances.clone(), reach: layout.reach() }
        });
        Self { spread, own: own.collect() }
    }

    fn of_listed(listed: &Listed) -> Self {
        let mut spread = of_list(listed, 0);
        if taps(&spread) == listed.len() {
            return Self { spread, own: Vec::new() };
        }
        for column in 0..COLUMNS {
            let key = |t: &Tuple| t.to_array()[column];
            let least = listed.iter().min_by(|a, b| key(a).total_cmp(&key(b)));
            let largest = listed.iter().max_by(|a, b| key(a).total_cmp(&key(b)));
            spread.extend(least.into_iter().chain(largest).map(|t| Row::new(t, [t.a].into())));
        }
        // The same rule from another row on takes other rows.
        let mut own = of_list(listed, listed.groups().counts[1] as usize / 3);
        own.truncate(own.len() / 2);
        Self { spread, own }
    }

    /// Of whiskers anywhere in the box `wanted`, over the distances of `layout`.
    pub fn of_box(wanted: &Wanted, layout: &Layout) -> Self {
        let (distances, directions, sides) = (over(layout, DISTANCES), outermost(layout), sides(wanted));
        let inside = |seed: u64, n: u32| -> Vec<Row> {
            let share = |k: u32, i: u32| f64::from(Sampler::Sobol.coordinate(seed, k, i)) / 2f64.powi(32);
            let at = |i: u32| {
                let value = |k: usize| sides[k][0] + (sides[k][1] - sides[k][0]) * share(k as u32, i);
                let direction = directions[i as usize % directions.len()];
                let point = point(std::array::from_fn(value)).towards(direction);
                Row { point, distances: distances.clone(), reach: layout.reach() }
            };
            (0..n).map(at).collect()
        };
        let mut spread = corners(wanted, layout);
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
    let (sides, distances) = (sides(wanted), over(layout, DISTANCES));
    let once = |k: &u32| (0..6).all(|i| k >> i & 1 == 0 || sides[i][0] != sides[i][1]);
    let corner = |k: u32| point(std::array::from_fn(|i| sides[i][(k >> i & 1) as usize]));
    let poles = outermost(layout).into_iter();
    let points = poles.flat_map(|d| (0..1 << 6).filter(once).map(move |k| corner(k).towards(d)));
    points.map(|point| Row { point, distances: distances.clone(), reach: layout.reach() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::parse;
    use std::path::Path;

    /// A study of whiskers with these tips, distances and tap angles, as a spec writes them.
    fn study(d: &str, a: &str, theta: &str) -> Study {
        let text = format!(
            "[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}"
        );
        parse("t.toml", &text, Path::new("")).expect("valid spec").study
    }

    /// Taps of so many whiskers at so many distances each, one distance after the other.
    fn listed(whiskers: u64, distances: u64) -> Listed {
        let whisker = Tuple { D: 10.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
        let tuple = |k: u64, i: u64| Tuple {
            d: 2.0 + 1e-3 * k as f64,
            a: 20.0 + i as f64,
            drive: 1.0 + 1e-3 * (k % 7) as f64,
            ..whisker
        };
        (0..distances).flat_map(|i| (0..whiskers).map(move |k| tuple(k, i))).collect()
    }

    #[test]
    fn a_small_space_is_taken_whole() {
        let rows = ComparedRows::of_study(&study("[4, 7]", "[20, 30, 40]", "[1, 2]"));
        assert_eq!((rows.own.len(), rows.spread.len(), taps(&rows.spread)), (0, 4, 12));
        assert!(rows.spread.iter().all(|r| r.reach == [20.0, 40.0]));
        assert!(of_list(&Listed::default(), 0).is_empty());
    }

    #[test]
    fn a_large_space_keeps_its_ends_and_whole_rows() {
        let (rows, total) = spread(&study(
            "{ from = 2, to = 10, steps = 4000 }",
            "{ from = 10, to = 50, steps = 400 }",
            "{ from = 1, to = 9, steps = 80 }",
        ));
        assert_eq!(total, 4000 * 400 * 80);
        assert!((1500..=LIMIT as usize).contains(&taps(&rows)), "{}", taps(&rows));
        assert!(rows.iter().all(|r| (r.distances[0], *r.distances.last().unwrap()) == (10.0, 50.0)));
        assert!([1.0, 9.0].iter().all(|end| rows.iter().any(|r| r.point.drive == *end)));
        let one = study("4", "{ from = 10, to = 50, steps = 40000 }", "{ from = 1, to = 9, steps = 3 }");
        assert_eq!(taps(&spread(&one).0), 1998);
    }

    #[test]
    fn a_large_space_has_its_corners_and_rows_of_its_own() {
        let text = "{ min = 2, max = 9, samples = 100000 }";
        let mut tilted = study(
            text,
            "{ from = 10, to = 50, steps = 100 }",
            "[1, 9]\ntilt = { from = -20, to = 30, steps = 11 }\nlean = 5",
        );
        let rows = ComparedRows::of_study(&tilted);
        for (tilt, d, drive) in [(-20.0, 2.0, 1.0), (-20.0, 9.0, 9.0), (30.0, 2.0, 9.0), (30.0, 9.0, 1.0)] {
            let there = |r: &Row| {
                let t = r.point;
                (t.tilt, t.lean, t.d, t.drive) == (tilt, 5.0, d, drive)
            };
            assert!(rows.spread.iter().any(there), "{tilt} {d} {drive}");
        }
        assert!(taps(&rows.spread) <= 2200 && taps(&rows.own) >= 1024);
        let again = |r: &Row| rows.spread.iter().any(|s| s.point == r.point);
        assert!(rows.own.iter().filter(|r| again(r)).count() * 10 < rows.own.len());
        let Space::Grid(factors) = &mut tilted.space else { panic!("a grid") };
        let layout = Layout::new(factors);
        let boxed = ComparedRows::of_box(&Wanted::of(&layout), &layout);
        let tilts =
            |rows: &[Row]| [-20.0, 30.0].map(|tilt| rows.iter().filter(|r| r.point.tilt == tilt).count());
        assert!(tilts(&boxed.spread).iter().chain(&tilts(&boxed.own)).all(|n| *n > 20));
        assert!(boxed.spread.iter().all(|r| r.point.lean == 5.0));
    }

    #[test]
    fn a_long_list_is_thinned_in_whole_rows_and_every_column_has_its_ends() {
        for (designs, distances) in [(1000, 10), (5000, 1), (3, 5000)] {
            let rows = of_list(&listed(designs, distances), 0);
            assert!((1000..=LIMIT as usize).contains(&taps(&rows)), "{}", taps(&rows));
            assert!(rows.iter().all(|r| r.distances[0] == 20.0));
        }
        let rows = ComparedRows::of_listed(&listed(1000, 10));
        assert!([2.0, 2.999].iter().all(|end| rows.spread.iter().any(|r| r.point.d == *end)));
        assert!(rows.own.len() > 20);
    }
}
