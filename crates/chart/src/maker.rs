//! Makes the charts that all designs of a sweep share.

use rayon::prelude::*;

use super::axis::{AXES, FIRST_PLACE, Quantity};
use super::between::{Between, NODES, nodes, weights};
use super::build::check;
use super::distance::DistanceChart;
use super::function::{FUNCTIONS, Function, bounds, functions, power, room, solved};
use super::ranges::{factors, holds, scaled};
use super::taps::Taps;
use crate::error::SolveError;
use crate::progress::NEVER;
use crate::reduce::{Sweeps, range};
use crate::scene::{Direction, Setup};

const CHECKS: usize = 160;

/// Inverse of the golden ratio: its multiples fill an interval evenly.
const GOLDEN: f64 = 0.618_033_988_75;

/// Safety factor on the error of a chart: values between charts sum the errors of several.
const SUMMED: f64 = 3.0;

pub(super) struct Maker<'a> {
    pub setup: &'a Setup,
    /// Direction of all poles.
    pub direction: Direction,
    /// Ranges of drive (rad or mm), a length, D, τ and x, mm and 1/mm.
    pub asked: [[f64; 2]; AXES],
    /// Largest x2 − x1, mm.
    pub width: f64,
    /// Drives that every chart must hold, rad or mm.
    pub drives: &'a [f64],
    pub tolerance: f64,
    pub taps: u64,
}

/// a, mm; drive, a length, D, τ and x, in the units of [`Maker::asked`]; and the functions there.
type Check = (f64, [f64; AXES], [f64; FUNCTIONS]);

pub(super) enum Many {
    Made(Vec<DistanceChart>, Between),
    Refused,
    /// Values between charts are not smooth enough: each distance needs a chart.
    Rough,
}

impl Maker<'_> {
    fn held(&self, chart: &DistanceChart) -> [[f64; 2]; AXES] {
        let mut ranges = chart.axes().map(|axis| axis.range);
        ranges[Quantity::Place as usize][0] -= FIRST_PLACE;
        let factors = factors(self.setup.drive, chart.a);
        std::array::from_fn(|k| ranges[k].map(|x| x / factors[k]))
    }

    pub fn within(&self, charts: &[DistanceChart]) -> [[f64; 2]; AXES] {
        let mut within = self.asked;
        for chart in charts {
            for (within, range) in within.iter_mut().zip(self.held(chart)) {
                *within = [within[0].max(range[0]), within[1].min(range[1])];
            }
        }
        within
    }

    fn power(&self) -> i32 {
        power(self.setup, self.direction.lean != 0.0)
    }

    fn chart(&self, a: f64) -> Result<(Option<DistanceChart>, u64), SolveError> {
        let (setup, drives) = (self.setup, self.drives);
        let (ranges, job) = (scaled(setup.drive, &self.asked, a), (self.power(), self.tolerance, &NEVER));
        let (mut spent, place) = (Sweeps::default(), (a, self.direction));
        let asked = (ranges, self.width / a, !drives.is_empty());
        let chart = DistanceChart::towards(setup, place, asked, job, &mut spent)?;
        let all = |chart: &DistanceChart| {
            drives.iter().all(|drive| holds(self.held(chart)[Quantity::Drive as usize], *drive))
        };
        Ok((chart.filter(all), spent.taps))
    }

    /// Charts at all of `distances`, or None if one has none. The farthest, next to the apex, and the nearest, next to the gauge, come first.
    pub fn at(&mut self, distances: &[f64]) -> Result<Option<Vec<DistanceChart>>, SolveError> {
        let [near, far] = range(distances.iter().copied());
        let others: Vec<f64> = distances.iter().copied().filter(|a| *a != far && *a != near).collect();
        let ends = if far == near { vec![vec![far]] } else { vec![vec![far], vec![near]] };
        let mut charts: Vec<DistanceChart> = Vec::new();
        for part in ends.into_iter().chain([others]) {
            let made = part.par_iter().map(|a| self.chart(*a)).collect::<Result<Vec<_>, SolveError>>()?;
            self.taps += made.iter().map(|(_, taps)| taps).sum::<u64>();
            let count = charts.len() + made.len();
            charts.extend(made.into_iter().filter_map(|(chart, _)| chart));
            if charts.len() < count {
                return Ok(None);
            }
        }
        let of = |a: &f64| charts.iter().find(|chart| chart.a == *a).cloned();
        Ok(distances.iter().map(of).collect())
    }

    pub fn between(&mut self, distances: &[f64]) -> Result<Many, SolveError> {
        let ends = range(distances.iter().copied());
        let mut charts: Vec<DistanceChart> = Vec::new();
        let mut checks = None;
        for n in NODES.into_iter().filter(|n| *n < distances.len()) {
            let at = nodes(ends, n);
            let Some(more) = self.at(&at[charts.len()..])? else { return Ok(Many::Refused) };
            charts.extend(more);
            if checks.is_none() {
                checks = self.checks(distances, &charts)?;
            }
            let Some(checks) = &checks else { return Ok(Many::Rough) };
            if let Some(error) = self.passed(&charts, checks) {
                return Ok(Many::Made(charts, Between::new(&at, distances, error)));
            }
        }
        Ok(Many::Rough)
    }

    /// Solved taps at some of `distances`, over the corners and the inside of the charts' common box; `None` if one has no solution.
    fn checks(
        &mut self,
        distances: &[f64],
        charts: &[DistanceChart],
    ) -> Result<Option<Vec<Check>>, SolveError> {
        let within = self.within(charts);
        let points = within.map(|[lo, hi]| hi <= lo);
        let power = self.power();
        let [_, farthest] = range(charts.iter().map(|chart| chart.a));
        let point = |i: usize| {
            let a = distances[((i as f64 * GOLDEN).fract() * distances.len() as f64) as usize];
            let x = check(i, &points);
            let mut numbers: [f64; AXES] =
                std::array::from_fn(|k| within[k][0] + 0.5 * (1.0 + x[k]) * (within[k][1] - within[k][0]));
            let place = &mut numbers[Quantity::Place as usize];
            *place = place.max(FIRST_PLACE * farthest);
            (a, numbers)
        };
        let all: Vec<(f64, [f64; AXES])> = (0..CHECKS).map(point).collect();
        let asked: Vec<(f64, [f64; AXES])> =
            all.iter().map(|(a, numbers)| (*a, quantities(self.setup, numbers, *a))).collect();
        let contact = (farthest, self.direction, None);
        let mut taps = Taps::new(self.setup, contact, Some(self.width), (solved(power, false), &NEVER));
        let found = taps.solve_at(&asked)?;
        self.taps += taps.sweeps.taps;
        let told = |i: usize| {
            let ((a, numbers), (_, q)) = (all[i], asked[i]);
            Some((a, numbers, functions(self.setup, (a, self.direction), &q, &found[i])?))
        };
        Ok((0..CHECKS).map(told).collect())
    }

    /// Largest error of the strain at `checks` as read between `charts`; `None` if a function exceeds its bound.
    fn passed(&self, charts: &[DistanceChart], checks: &[Check]) -> Option<f64> {
        let power = self.power();
        let nodes: Vec<f64> = charts.iter().map(|chart| chart.a).collect();
        let mut worst = 0.0f64;
        for (a, numbers, wanted) in checks {
            let q = quantities(self.setup, numbers, *a);
            let mut read = [0.0; FUNCTIONS];
            for (chart, weight) in charts.iter().zip(weights(&nodes, *a)) {
                let own = quantities(self.setup, numbers, chart.a);
                let mut values = chart.at(&own);
                let rooms = room(&q) / room(&own);
                let like_strain = if chart.gauges.centred { FUNCTIONS } else { 1 };
                values[..like_strain].iter_mut().for_each(|value| *value *= rooms);
                read.iter_mut().zip(values).for_each(|(read, value)| *read += weight * value);
            }
            let drive = q[Quantity::Drive as usize];
            let scale = drive.powi(power);
            let ends = [drive, q[Quantity::Place as usize]];
            let bounds = bounds(self.setup, ends, (power, self.tolerance), false);
            for ((bound, read), value) in bounds.iter().zip(read).zip(*wanted) {
                if bound.share(value / scale, (read - value).abs() / scale) > SUMMED {
                    return None;
                }
            }
            let strain = Function::Strain as usize;
            worst = worst.max((read[strain] - wanted[strain]).abs());
        }
        Some(worst)
    }
}

fn quantities(setup: &Setup, numbers: &[f64; AXES], a: f64) -> [f64; AXES] {
    let factors = factors(setup.drive, a);
    std::array::from_fn(|k| numbers[k] * factors[k])
}
