//! Which taps a calibration should have, before any of them was read: those after which distances are expected to be told best.
//!
//! The model is that of a fit ([`crate::columns`]) with its learned numbers as they are expected. Readings at candidates and at the places that will
//! be asked for have the covariance S = H Λ Hᵀ; a tap at i takes S_·i S_i·/(v_i + S_ii) off it, and gives it back where it is left out. What is
//! least is the mean variance of a distance at the places that will be asked for (A-optimal design; Fedorov 1972 for the exchange).

use nalgebra::DMatrix;

use crate::base::{Base, Whisker};
use crate::columns::{Columns, Effects, FLAT, Scales, Term, terms, values};
use crate::evidence::Problem;
use crate::hyper::{Hyper, Prior};
use crate::rows::{Cell, Row};
use crate::start::{Start, slopes};

/// Largest standard deviation of a coefficient before any reading, in units of the signal: a gain may be twice as large as expected.
const UNKNOWN: f64 = 1.0;
/// A place is asked for where the signal falls with the distance at least by this power of it: next to its peak no reading tells it.
const FALLS: f64 = 0.3;
/// Zero readings of a run.
const ZEROS: f64 = 6.0;
/// Rounds of exchanges.
const ROUNDS: usize = 12;
/// An exchange is made where it lowers the variance by more than this share.
const WORTH: f64 = 1e-4;

/// What a rig adds to the curve of its whisker, as standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rig {
    /// Noise of a reading, in the unit of the signal.
    pub noise: f64,
    /// Noise that goes with the signal, as a share of it.
    pub relative: f64,
    /// Error of a position, as a share of its distance.
    pub position: f64,
    /// The same of one visit only.
    pub visit: f64,
    /// Gain of a run, as a share.
    pub gain: f64,
    /// Zero of a run, in the unit of the signal.
    pub zero: f64,
}

/// What may be tapped, and what will be asked.
#[derive(Clone, Copy)]
pub struct Ask<'a> {
    /// The |signal| of the whisker.
    pub curve: &'a Whisker,
    /// Distances (mm) and drives at which the rig may tap, from the least on.
    pub distances: &'a [f64],
    /// See above.
    pub drives: &'a [f64],
    /// Whether the rig may tap at distance i by drive j.
    pub allowed: &'a dyn Fn(usize, usize) -> bool,
    /// Runs in which it taps.
    pub runs: usize,
    /// Most distances that are used.
    pub positions: usize,
    /// What the rig adds.
    pub rig: Rig,
}

/// A tap: the places of its distance and its drive, and its run.
pub type Tap = [usize; 3];

/// Candidates and the covariance that is left.
#[derive(Clone)]
pub struct Planner {
    /// Candidates.
    taps: Vec<Tap>,
    /// Most distances.
    positions: usize,
    /// Variance of a reading at each candidate.
    noise: Vec<f64>,
    /// Of the readings at candidates, and after them of the curve where it will be asked for.
    covariance: DMatrix<f64>,
    /// Variance in mm² per variance of the signal, over the number of places.
    weights: Vec<f64>,
    /// Mean variance in mm² that no calibration takes away: noise, position, gain of the run of the reading itself.
    floor: f64,
    /// What was chosen: places of candidates.
    chosen: Vec<usize>,
    /// Of these, as many at the beginning stay: they reach the ends of distances and drives.
    pinned: usize,
}

impl Planner {
    /// Before any tap; zeros are read in each run. `None` where no tap is allowed, or the signal tells the distance at none.
    pub fn new(ask: &Ask<'_>) -> Option<Self> {
        let pairs = (0..ask.distances.len()).flat_map(|i| (0..ask.drives.len()).map(move |j| (i, j)));
        let pairs: Vec<(usize, usize)> = pairs.filter(|(i, j)| (ask.allowed)(*i, *j)).collect();
        let taps: Vec<Tap> =
            (0..ask.runs).flat_map(|run| pairs.iter().map(move |(i, j)| [*i, *j, run])).collect();
        let signal = |i: usize, j: usize| (ask.curve)(ask.distances[i], ask.drives[j]);
        let mut sizes: Vec<f64> = pairs.iter().map(|(i, j)| signal(*i, *j)).collect();
        sizes.sort_by(f64::total_cmp);
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
        let slopes = slopes(&cells, &start, &scales);
        let effects = Effects { known: true, zero: Some(FLAT), drift: false };
        let model = Columns::new(&cells, (&base, unit), &slopes, &scales, effects);
        let problem =
            Problem::new(model, &cells, [unit, 0.0, 0.0], (true, Prior::new(Hyper::Position.prior(true))));
        let Rig { noise, relative, position, visit, gain, zero } = ask.rig;
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
        let entry = |i: usize, k: usize| {
            let x = match i < n {
                true => problem.model.matrix[(i, k)],
                false => k.checked_sub(first).map_or(0.0, |k| asked[i - n][k]),
            };
            x * roots[k]
        };
        let scaled = DMatrix::from_fn(n + asked.len(), roots.len(), entry);
        let variances = problem.variances(&at);
        let mut planner = Self {
            noise: variances[..taps.len()].to_vec(),
            taps,
            positions: ask.positions,
            covariance: &scaled * scaled.transpose(),
            weights,
            floor: floor / places,
            chosen: Vec::new(),
            pinned: 0,
        };
        for run in 0..ask.runs {
            let place = planner.taps.len() + run;
            planner.moved(place, variances[place] / ZEROS);
        }
        // The zeros are read: what is left are candidates and places.
        let kept: Vec<usize> =
            (0..n + asked.len()).filter(|k| !(planner.taps.len()..n).contains(k)).collect();
        planner.covariance =
            DMatrix::from_fn(kept.len(), kept.len(), |i, k| planner.covariance[(kept[i], kept[k])]);
        Some(planner)
    }

    /// Takes a reading of this variance at `place`; gives it back where that is negative.
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

    /// Mean variance of the calibration, mm².
    fn variance(&self) -> f64 {
        let first = self.taps.len();
        self.weights.iter().enumerate().map(|(q, w)| w * self.covariance[(first + q, first + q)]).sum()
    }

    /// Σ w S², S the covariance of a tap at `place` with the curve where it will be asked for.
    fn squares(&self, place: usize) -> f64 {
        let column = self.covariance.column(place);
        self.weights.iter().zip(column.iter().skip(self.taps.len())).map(|(w, s)| w * s * s).sum()
    }

    /// By how much a tap at `place` lowers the variance.
    fn gain(&self, place: usize) -> f64 {
        self.squares(place) / (self.noise[place] + self.covariance[(place, place)])
    }

    /// By how much the tap at `place`, which is chosen, lowers it.
    fn worth(&self, place: usize) -> f64 {
        let left = self.noise[place] - self.covariance[(place, place)];
        self.squares(place) / left.max(f64::MIN_POSITIVE)
    }

    /// The best candidate: of the distances that are used, where there may be no other ones.
    fn best(&self) -> Option<usize> {
        let mut used: Vec<usize> = self.chosen.iter().map(|k| self.taps[*k][0]).collect();
        used.sort_unstable();
        used.dedup();
        let full = used.len() >= self.positions;
        let free = (0..self.taps.len()).filter(|k| !full || used.contains(&self.taps[*k][0]));
        free.map(|k| (k, self.gain(k))).max_by(|p, q| p.1.total_cmp(&q.1)).map(|p| p.0)
    }

    /// Number of taps.
    pub fn len(&self) -> usize {
        self.chosen.len()
    }

    /// Whether there is no tap.
    pub fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// Root mean square of the standard deviation of a distance, over the places that will be asked for, mm: of a tap in another run.
    pub fn sigma(&self) -> f64 {
        (self.floor + self.variance().max(0.0)).sqrt()
    }

    /// What of it no calibration takes away.
    pub fn floor(&self) -> f64 {
        self.floor.sqrt()
    }

    /// The taps.
    pub fn chosen(&self) -> Vec<Tap> {
        let mut all: Vec<Tap> = self.chosen.iter().map(|k| self.taps[*k]).collect();
        all.sort_unstable_by_key(|[i, j, run]| [*run, *i, *j]);
        all
    }

    /// Taps at the least and the largest distance and drive, which stay: what lies beyond the calibrated ones has no answer.
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

    /// One tap more, the best one.
    pub fn grow(&mut self) {
        if let Some(place) = self.best() {
            self.add(place);
        }
    }

    /// Without the tap that tells least.
    pub fn shrink(&mut self) {
        let least = (self.pinned..self.chosen.len())
            .min_by(|i, k| self.worth(self.chosen[*i]).total_cmp(&self.worth(self.chosen[*k])));
        least.map(|k| self.remove(k));
    }

    /// Takes taps out one by one for better ones, until none is better.
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

    /// With these taps and no others.
    pub fn with(&self, taps: impl IntoIterator<Item = Tap>) -> Self {
        let mut other = self.clone();
        other.pinned = 0;
        while !other.is_empty() {
            other.remove(0);
        }
        for tap in taps {
            if let Some(place) = other.taps.iter().position(|t| *t == tap) {
                other.add(place);
            }
        }
        other
    }
}
