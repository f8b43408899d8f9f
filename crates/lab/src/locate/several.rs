//! Readings of several channels of one sensor: the most likely distance given all of them (model §7).
//!
//! Every channel has a calibration of its own, which says what is expected of a tap; their noise goes together as the covariance of what
//! these leave. Where the drive is not known it is found with the distance: two channels tell both.

use nalgebra::DMatrix;

use super::calibration::Calibration;
use super::likely::{ChannelTap, Response};
use super::locator::{Located, Locator};
use super::object::COLUMNS;
use crate::error::Error;
use crate::estimator::least::Minimum;
use crate::estimator::model::exact::Opener;
use crate::measure::names::Channel;
use crate::scene::Signal;
use crate::sink::values::Field;
use crate::status::Status;

/// Squared misfit of one degree of freedom, in units of noise, above which channels contradict each other.
pub(crate) const CONTRADICTORY: f64 = 36.0;
/// Excess of the squared misfit, in units of noise, below which another distance fits as well.
const ALIKE: f64 = 1.0;
/// And below which nothing tells them apart: where there are as many unknowns as channels, each of several distances may fit to the last digit.
pub(crate) const EQUAL: f64 = 1e-3;

/// What a calibration of several channels holds.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// Of each the name of its column and its calibration.
    pub channels: Vec<(String, Calibration)>,
    /// Covariance of the noise of one reading, in the units of the channels' calibrations.
    pub covariance: Vec<Vec<f64>>,
}

/// Answers readings of several channels.
pub struct Several {
    /// What answers each of them alone.
    pub locators: Vec<Locator>,
    /// The names of their columns.
    pub names: Vec<String>,
    pub(super) columns: Vec<Channel>,
    pub(crate) covariance: DMatrix<f64>,
}

impl Several {
    /// Of a calibration in the file `label`; `open` solves models.
    pub fn new(sensor: &Sensor, label: &str, open: Opener<'_>) -> Result<Self, Error> {
        let locator = |(_, c): &(String, Calibration)| {
            let mut locator = Locator::new(c, label, None, open)?;
            locator.of_several = true;
            Ok::<_, Error>(locator)
        };
        let n = sensor.channels.len();
        let locators: Vec<Locator> = sensor.channels.iter().map(locator).collect::<Result<_, _>>()?;
        let columns =
            sensor.channels.iter().zip(&locators).map(|((name, _), l)| column(name, l.unit.signal()));
        Ok(Self {
            columns: columns.collect(),
            names: sensor.channels.iter().map(|(name, _)| name.clone()).collect(),
            covariance: DMatrix::from_fn(n, n, |i, j| sensor.covariance[i][j]),
            locators,
        })
    }

    /// The distance of a tap by `drive` (degrees or mm; NaN where it is not known) with these tared signals; of each zero the variance in
    /// units of that of one reading. A channel without a reading is left out.
    pub fn locate(&self, drive: f64, signals: &[f64], shares: &[f64]) -> Located {
        let channels: Vec<&dyn Response> = self.locators.iter().map(|l| l as &dyn Response).collect();
        together((&channels, &self.covariance), drive, signals, shares)
    }
}

/// The most likely distance of a tap by `drive`, given the signals of `channels`, whose noise has this covariance; as [`Several::locate`].
pub(crate) fn together(
    (channels, covariance): (&[&dyn Response], &DMatrix<f64>),
    drive: f64,
    signals: &[f64],
    shares: &[f64],
) -> Located {
    let used: Vec<usize> =
        (0..signals.len()).filter(|k| signals[*k].is_finite() && signals[*k] != 0.0).collect();
    let unknowns = if drive.is_finite() { 1 } else { 2 };
    // What is infinite is no number; what is NaN is not known.
    if drive.is_infinite() || signals.iter().any(|x| x.is_infinite()) {
        return Located::nothing(Status::BAD_INPUT);
    }
    if used.len() < unknowns {
        let none = signals.iter().all(|x| *x == 0.0);
        return Located::nothing(if none { Status::NO_STRAIN } else { Status::BAD_INPUT });
    }
    let mut status = Status::OK;
    let mut noise = DMatrix::from_fn(used.len(), used.len(), |i, j| covariance[(used[i], used[j])]);
    for (i, k) in used.iter().enumerate() {
        noise[(i, i)] *= 1.0 + shares[*k];
        status |= channels[*k].of().limit_of(signals[*k]);
    }
    // No tap pulls one channel to its one side and another to its other.
    let gauge = |k: &usize| {
        let of = channels[*k].of();
        of.sides().iter().find(|s| s.sign == signals[*k].signum() && of.rig.known).map(|s| s.gauge)
    };
    let mut gauges = used.iter().filter_map(gauge);
    if let Some(first) = gauges.next()
        && gauges.any(|other| other != first)
    {
        return Located::nothing(status | Status::NO_ROOT);
    }
    let readings = used.iter().map(|k| (channels[*k], signals[*k])).collect();
    let Some(tap) = ChannelTap::new(readings, drive, &noise) else {
        return Located::nothing(status | Status::OUTSIDE_CALIBRATION);
    };
    let side = channels[used[0]].of().sides().iter().find(|s| s.sign == signals[used[0]].signum());
    let Some(side) = side else { return Located::nothing(status | Status::OUTSIDE_CALIBRATION) };
    let found = chosen(tap.refined(&tap.starts()), side.distances);
    let Some(first) = found.first() else { return Located::nothing(status | Status::NO_ROOT) };
    // What the calibrations leave, where the tap is.
    let [a, u] = tap.place(&first.at);
    for (i, k) in used.iter().enumerate() {
        noise[(i, i)] += channels[*k].left(a, u, signals[*k].signum());
    }
    let starts: Vec<Vec<f64>> = found.into_iter().map(|m| m.at).collect();
    let Some(tap) = tap.with_noise(&noise) else { return Located::nothing(status | Status::NO_ROOT) };
    let found = chosen(tap.refined(&starts), side.distances);
    let Some((best, others)) = found.split_first() else {
        return Located::nothing(status | Status::NO_ROOT);
    };
    // Channels that no distance explains together have none; where less is left unexplained the answer is less certain.
    // A drive at the end of the calibrated ones is none that was free to follow: beyond it the misfit would be less.
    let at_end = tap.at_end(&best.at);
    let (misfit, freedom) = (best.chi2(), (used.len() - unknowns + usize::from(at_end)) as f64);
    if freedom > 0.0 && misfit > CONTRADICTORY + 4.0 * freedom {
        return Located::nothing(status | if at_end { Status::OUTSIDE_CALIBRATION } else { Status::NO_ROOT });
    }
    let wider = if freedom > 0.0 { (misfit / freedom).sqrt().max(1.0) } else { 1.0 };
    let (a, sigma) = (best.at[0], best.covariance[(0, 0)].sqrt() * wider);
    let alike = |m: &&Minimum| m.chi2() - misfit < ALIKE && (m.at[0] - a).abs() > 3.0 * sigma;
    let other = others.iter().find(alike).map(|m| m.at[0]);
    status |= side.doubts(a, other, sigma);
    // What tells none of the calibrated distances from another tells none.
    if sigma > side.distances[1] - side.distances[0] {
        status |= Status::AMBIGUOUS;
    }
    Located::normal(a, sigma, status)
}

/// `found`, best first, with that one at the head which is told where several fit equally well: the farthest of the calibrated ones, or of all.
fn chosen(mut found: Vec<Minimum>, [first, last]: [f64; 2]) -> Vec<Minimum> {
    let Some(least) = found.first().map(Minimum::chi2) else { return found };
    let rank = |m: &Minimum| ((first..=last).contains(&m.at[0]), m.at[0]);
    let best = (0..found.len()).filter(|k| found[*k].chi2() <= least + EQUAL).max_by(|p, q| {
        let (p, q) = (rank(&found[*p]), rank(&found[*q]));
        p.0.cmp(&q.0).then(p.1.total_cmp(&q.1))
    });
    let head = found.remove(best.unwrap_or(0));
    found.insert(0, head);
    found
}

/// The column of the channel `name`, which shows `signal`.
fn column(name: &str, signal: Option<Signal>) -> Channel {
    let numbered = crate::scene::channels::numbered(name);
    match (numbered, signal) {
        (Some(name), _) => Channel::Named(name),
        (None, signal) => Channel::Of(signal.unwrap_or(Signal::Strain)),
    }
}

/// What all taps of an object so far tell.
pub struct Together {
    pub(super) taps: usize,
    pub(super) located: Located,
    /// By two gauges the tilt and its standard deviation, degrees.
    pub(super) tilt: [f64; 2],
    pub(super) apart: Option<(usize, f64)>,
}

impl Together {
    /// Its columns, with those of two gauges and with the interval or without.
    pub fn fields(this: Option<&Self>, more: [bool; 2]) -> Vec<Field> {
        let [twofold, interval] = more;
        let Some(Self { taps, located, tilt, apart }) = this else {
            let status = COLUMNS + 2 * usize::from(twofold) + 2 * usize::from(interval) - 1;
            return (0..status).map(|_| f64::NAN.into()).chain(["".into()]).collect();
        };
        let (line, by) = apart.map_or((f64::NAN, f64::NAN), |(line, by)| (line as f64, by));
        // More digits than two of a number of standard deviations say nothing.
        let apart = [line, (100.0 * by).round() / 100.0 + 0.0];
        let distance = [*taps as f64, located.distance, located.sigma].into_iter();
        let ends = located.interval.iter().filter(|_| interval).chain(tilt.iter().filter(|_| twofold));
        distance.chain(ends.copied()).chain(apart).map(Field::from).chain([located.status.into()]).collect()
    }
}
