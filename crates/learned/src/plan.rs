//! Plan of a calibration: the taps, chosen before any reading, that minimise the mean variance of distances (A-optimal; exchange: Fedorov 1972).
//! Readings at candidates and places of later use have the covariance S = H Λ Hᵀ; a tap at i subtracts S_·i S_i·/(v_i + S_ii), its removal adds it.

use std::collections::BTreeSet;

use nalgebra::DMatrix;
use vibrissa_core::reduce::sorted;

use crate::base::{Base, Whisker};
use crate::columns::{Columns, Effects, FLAT, Scales, Term, terms, values};
use crate::evidence::{Hyper, Prior, Problem};
use crate::rows::{Cell, Row};
use crate::{curve::Spread, fit::Start};

/// Largest prior standard deviation of a coefficient, in units of the signal: a gain may be twice as large as expected.
const UNKNOWN: f64 = 1.0;
/// A place is of use if the signal falls at least with this power of the distance: near its peak, no reading determines the distance.
const FALLS: f64 = 0.3;
const ZEROS: f64 = 6.0;
const ROUNDS: usize = 12;
/// An exchange must lower the variance by more than this share.
const WORTH: f64 = 1e-4;

/// Candidates of taps and the whisker's signal.
#[derive(Clone, Copy)]
pub struct Ask<'a> {
    /// |signal| of the whisker.
    pub curve: &'a Whisker,
    /// Distances at which the rig may tap, in mm, ascending.
    pub distances: &'a [f64],
    /// Drives at which the rig may tap, ascending.
    pub drives: &'a [f64],
    /// True if the rig may tap at distance i by drive j.
    pub allowed: &'a dyn Fn(usize, usize) -> bool,
    /// Number of runs.
    pub runs: usize,
    /// Maximum of distances in use.
    pub positions: usize,
    /// Effects of the rig; noise and zero in the unit of the signal. It does not drift.
    pub rig: Spread,
}

/// Indices of a tap: distance, drive, run.
pub type Tap = [usize; 3];

/// Candidates, the chosen taps, and the remaining covariance.
#[derive(Clone)]
pub struct Planner {
    taps: Vec<Tap>,
    positions: usize,
    noise: Vec<f64>,
    /// Covariance of the readings at candidates, followed by the curve at the places of later use.
    covariance: DMatrix<f64>,
    /// Variance in mm² per variance of the signal, over the number of places.
    weights: Vec<f64>,
    /// Mean variance in mm² that no calibration removes: noise, position, gain of the run of the reading.
    floor: f64,
    chosen: Vec<usize>,
    /// The first `pinned` of these stay: they reach the ends of distances and drives.
    pinned: usize,
}

impl Planner {
    /// State before any tap, with zeros read in each run. `None` if no tap is allowed, or no signal determines a distance.
    pub fn new(ask: &Ask<'_>) -> Option<Self> {
        let pairs = (0..ask.distances.len()).flat_map(|i| (0..ask.drives.len()).map(move |j| (i, j)));
        let pairs: Vec<(usize, usize)> = pairs.filter(|(i, j)| (ask.allowed)(*i, *j)).collect();
        let taps: Vec<Tap> =
            (0..ask.runs).flat_map(|run| pairs.iter().map(move |(i, j)| [*i, *j, run])).collect();
        let signal = |i: usize, j: usize| (ask.curve)(ask.distances[i], ask.drives[j]);
        let sizes = sorted(pairs.iter().map(|(i, j)| signal(*i, *j)));
        let unit = *sizes.get(sizes.len() / 2)?;
        let row = |a: f64, u: f64, y: f64, run: usize| Row { a, u, y, run, t: 0.0 };
        let cell = |row: Row| Cell { row, n: 1.0, squares: 0.0, rows: Vec::new() };
        let of_tap = |[i, j, run]: &Tap| cell(row(ask.distances[*i], ask.drives[*j], signal(*i, *j), *run));
        let mut cells: Vec<Cell> = taps.iter().map(of_tap).collect();
        cells.extend((0..ask.runs).map(|run| cell(row(ask.distances[0], 0.0, 0.0, run))));
        let scales = Scales::of(&cells, 0.0);
        if !(scales.a[1] > 0.0 && scales.a[1].is_finite() && unit > 0.0) {
            return None;
        }
        let base = Base::Known(ask.curve.clone(), 0.0);
        let start = Start { base: base.clone(), power: None, numbers: [unit, 0.0, unit], labels: None };
        let effects = Effects { known: true, zero: Some(FLAT), drift: false };
        let model = Columns::new(&cells, &start, &scales, effects);
        let problem = Problem::new(model, &cells, &start, 0.0, Prior::new(Hyper::Position.prior(true)));
        let Spread { floor, relative, position, visit, gain, zero, .. } = ask.rig;
        let [noise, relative, position, visit, gain, zero] =
            [floor, relative, position, visit, gain, zero].map(f64::sqrt);
        let at = |h: &Hyper| match h {
            Hyper::Floor => (noise / unit).ln(),
            Hyper::Relative => relative.ln(),
            Hyper::Position => position.ln(),
            Hyper::Visit => visit.ln(),
            Hyper::RunGain => gain.ln(),
            Hyper::RunZero => (zero / unit).ln(),
            other => other.prior(true)[0],
        };
        let at: Vec<f64> = problem.model.hypers.iter().map(at).map(|x| x.max(-40.0)).collect();
        let roots = problem.roots(&at).map(|x| x.min(UNKNOWN));
        let terms = terms(true, scales.u[1] > 0.0);
        let mut asked: Vec<Vec<f64>> = Vec::new();
        let (mut weights, mut floor) = (Vec::new(), 0.0);
        for (i, j) in &pairs {
            let (a, u) = (ask.distances[*i], ask.drives[*j]);
            let about = base.about(unit, a, u);
            let (m, slope) = (about.value, about.by_distance);
            if !(m.is_finite() && -slope > FALLS * m) {
                continue;
            }
            let row = values(&about, &scales, &terms, a, u);
            asked.push(terms.iter().zip(row).map(|(t, x)| if *t == Term::Zero { 0.0 } else { x }).collect());
            let per = (a / slope).powi(2);
            weights.push(per);
            let of_reading = (noise / unit).powi(2) + (m * relative).powi(2) + (m * gain).powi(2);
            floor += per * of_reading + a * a * (position * position + visit * visit);
        }
        let places = asked.len() as f64;
        if asked.is_empty() {
            return None;
        }
        weights.iter_mut().for_each(|w| *w /= places);
        let n = cells.len();
        let first = problem.model.places(&terms).start;
        let later = |i: usize, k: usize| k.checked_sub(first).map_or(0.0, |k| asked[i][k]);
        let entry = |i: usize, k: usize| {
            roots[k] * if i < n { problem.model.matrix[(i, k)] } else { later(i - n, k) }
        };
        let scaled = DMatrix::from_fn(n + asked.len(), roots.len(), entry);
        let variances = problem.variances(&at);
        let (noise, covariance) = (variances[..taps.len()].to_vec(), &scaled * scaled.transpose());
        let (positions, floor, chosen) = (ask.positions, floor / places, Vec::new());
        let mut planner = Self { taps, positions, noise, covariance, weights, floor, chosen, pinned: 0 };
        for run in 0..ask.runs {
            let place = planner.taps.len() + run;
            planner.moved(place, variances[place] / ZEROS);
        }
        let first = planner.taps.len();
        planner.covariance = planner.covariance.remove_rows(first, ask.runs).remove_columns(first, ask.runs);
        Some(planner)
    }

    /// Adds a reading of this variance at `place`; a negative variance removes it.
    fn moved(&mut self, place: usize, variance: f64) {
        let column = self.covariance.column(place).clone_owned();
        self.covariance.ger(-1.0 / (variance + column[place]), &column, &column, 1.0);
    }

    fn add(&mut self, place: usize) {
        self.moved(place, self.noise[place]);
        self.chosen.push(place);
    }

    fn remove(&mut self, k: usize) -> usize {
        let place = self.chosen.remove(k);
        self.moved(place, -self.noise[place]);
        place
    }

    fn variance(&self) -> f64 {
        let first = self.taps.len();
        self.weights.iter().enumerate().map(|(q, w)| w * self.covariance[(first + q, first + q)]).sum()
    }

    /// Σ w S², with S the covariance of a tap at `place` with the curve at the places of later use.
    fn squares(&self, place: usize) -> f64 {
        let column = self.covariance.column(place);
        self.weights.iter().zip(column.iter().skip(self.taps.len())).map(|(w, s)| w * s * s).sum()
    }

    fn gain(&self, place: usize) -> f64 {
        self.squares(place) / (self.noise[place] + self.covariance[(place, place)])
    }

    /// Best candidate; only at distances in use once their maximum is reached.
    fn best(&self) -> Option<usize> {
        let used: BTreeSet<usize> = self.chosen.iter().map(|k| self.taps[*k][0]).collect();
        let full = used.len() >= self.positions;
        let free = (0..self.taps.len()).filter(|k| !full || used.contains(&self.taps[*k][0]));
        free.map(|k| (k, self.gain(k))).max_by(|p, q| p.1.total_cmp(&q.1)).map(|p| p.0)
    }

    /// Number of chosen taps.
    pub fn count(&self) -> usize {
        self.chosen.len()
    }

    /// Expected RMS standard deviation of a distance over the places of later use, in mm, for a tap in another run.
    pub fn sigma(&self) -> f64 {
        (self.floor + self.variance().max(0.0)).sqrt()
    }

    /// Part of [`Self::sigma`] that no calibration removes, mm.
    pub fn floor(&self) -> f64 {
        self.floor.sqrt()
    }

    /// Chosen taps by run, distance and drive.
    pub fn chosen(&self) -> Vec<Tap> {
        let mut all: Vec<Tap> = self.chosen.iter().map(|k| self.taps[*k]).collect();
        all.sort_unstable_by_key(|[i, j, run]| [*run, *i, *j]);
        all
    }

    /// Adds taps at the least and largest distance and drive, which stay: answers end at the calibrated range.
    pub fn pin(&mut self) {
        for axis in [0, 1] {
            let values = || self.taps.iter().map(|t| t[axis]);
            let (Some(least), Some(largest)) = (values().min(), values().max()) else { return };
            for end in [least, largest] {
                if self.chosen.iter().any(|k| self.taps[*k][axis] == end) {
                    continue;
                }
                let used =
                    |k: &usize| axis == 0 || self.chosen.iter().any(|c| self.taps[*c][0] == self.taps[*k][0]);
                let best = |among: &dyn Fn(&usize) -> bool| {
                    let all = (0..self.taps.len()).filter(|k| self.taps[*k][axis] == end && among(k));
                    all.max_by(|p, q| self.gain(*p).total_cmp(&self.gain(*q)))
                };
                if let Some(place) = best(&used).or_else(|| best(&|_| true)) {
                    self.add(place);
                    self.pinned += 1;
                }
            }
        }
    }

    /// Adds the best tap.
    pub fn grow(&mut self) {
        self.best().into_iter().for_each(|place| self.add(place));
    }

    /// Removes the tap with the least information.
    pub fn shrink(&mut self) {
        let worth = |k: &usize| {
            let place = self.chosen[*k];
            let left = self.noise[place] - self.covariance[(place, place)];
            self.squares(place) / left.max(f64::MIN_POSITIVE)
        };
        let least = (self.pinned..self.chosen.len()).min_by(|i, k| worth(i).total_cmp(&worth(k)));
        least.map(|k| self.remove(k));
    }

    /// Replaces taps one by one by better ones until none is better.
    pub fn exchange(&mut self) {
        for _ in 0..ROUNDS {
            let before = self.variance();
            for _ in self.pinned..self.chosen.len() {
                let place = self.remove(self.pinned);
                let best = self.best().filter(|best| self.gain(*best) > self.gain(place) * (1.0 + WORTH));
                self.add(best.unwrap_or(place));
            }
            if self.variance() > before * (1.0 - WORTH) {
                break;
            }
        }
    }

    /// Copy with these taps only.
    pub fn with(&self, taps: impl IntoIterator<Item = Tap>) -> Self {
        let mut other = self.clone();
        other.pinned = 0;
        (0..self.chosen.len()).for_each(|_| _ = other.remove(0));
        let places = taps.into_iter().filter_map(|tap| self.taps.iter().position(|t| *t == tap));
        places.for_each(|place| other.add(place));
        other
    }
}
