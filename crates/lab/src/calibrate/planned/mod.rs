//! Plan of a calibration: the taps and their order for a wanted accuracy of distances.
//!
//! The whisker is that of the spec; the rig's errors are given or from an earlier calibration; [`vibrissa_learned::plan`] chooses the taps.

mod apart;
mod order;

pub use apart::Apart;
pub use order::Row;
pub use order::like;

use crate::reduce::{distinct, range};
use vibrissa_learned::curve::Spread;
use vibrissa_learned::plan::{Ask, Planner, Tap};

use crate::error::{Error, InputError};
use crate::estimator::{Exact, Extent, Opener, learned::whisker, parameter::spec_values};
use crate::measure::Rig;
use crate::scene::{Axis, Column, Space};

const DISTANCES: usize = 25;
const DRIVES: usize = 12;
/// Fewest taps of a plan: fewer do not determine noise and differences of runs.
pub const LEAST: usize = 8;
/// Most taps of a plan.
pub const MOST: usize = 400;
/// Resolution of a position, mm.
const ROUND: f64 = 0.1;

/// Goal of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanGoal {
    /// RMS error of a distance, mm.
    pub error: f64,
    /// Maximum of positions.
    pub positions: Option<usize>,
    /// Number of runs.
    pub runs: usize,
    /// Standard deviation of a position, mm.
    pub place: f64,
    /// Relative standard deviation of the gain of a run.
    pub gain: f64,
    /// Noise in proportion to the signal, relative.
    pub relative: f64,
    /// Seed of the order of the taps.
    pub seed: u64,
}

/// A plan.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Distances in mm.
    pub distances: Vec<f64>,
    /// Drives of the plan.
    pub drives: Vec<f64>,
    /// Indices of distance and drive, and run, of each tap.
    pub taps: Vec<Tap>,
    /// Lines in order, with zero readings.
    pub rows: Vec<Row>,
    /// Expected RMS of σ, mm.
    pub sigma: f64,
    /// Part of σ from noise, position and run of the reading itself, mm.
    pub floor: f64,
    /// σ in mm of the best plan by number of taps.
    pub path: Vec<(usize, f64)>,
    /// σ in mm of the best even grid by number of taps.
    pub even: Vec<(usize, f64)>,
    /// Numbers that the taps cannot separate.
    pub apart: Vec<Apart>,
    /// Ranges of the distances and drives that may be tapped.
    pub reached: [[f64; 2]; 2],
    /// Number of forbidden pairs of distance and drive, and of all pairs.
    pub forbidden: [usize; 2],
    /// Ranges of distances and drives in the spec.
    pub ends: [[f64; 2]; 2],
    /// Errors of the rig; noise and zero in the unit of the signal.
    pub rig: Spread,
}

impl Planned {
    /// Number of taps of the smallest even grid that is as good.
    pub fn even_as_good(&self) -> Option<usize> {
        self.even.iter().find(|(_, sigma)| *sigma <= self.sigma).map(|(n, _)| *n)
    }

    /// σ of the best even grid with at most as many taps.
    pub fn even_of_its_size(&self) -> Option<f64> {
        let fits = self.even.iter().filter(|(n, _)| *n <= self.taps.len());
        fits.map(|(_, sigma)| *sigma).min_by(f64::total_cmp)
    }

    /// Positions in use, mm (`axis` 0), or drives (1), with the number of taps at each.
    pub fn used(&self, axis: usize) -> Vec<(f64, usize)> {
        let values = if axis == 0 { &self.distances } else { &self.drives };
        let count = |i: usize| self.taps.iter().filter(|t| t[axis] == i).count();
        values.iter().enumerate().map(|(i, x)| (*x, count(i))).filter(|(_, n)| *n > 0).collect()
    }
}

/// Plans the calibration of `rig` within the axes of `space`.
/// Errors: a spec without noise, with one distance, or with taps beyond the gauge's limit; a model without solution; an unreachable error.
pub fn plan(
    rig: &Rig,
    space: &Space,
    asked: &PlanGoal,
    like: Option<Spread>,
    open: Opener<'_>,
) -> Result<Planned, Error> {
    let (distances, drives) = (distances(space)?, drives(space)?);
    let ends = |all: &[f64]| [all[0], all[all.len() - 1]];
    let [first, last] = ends(&distances);
    let guess = (last - first) / 12.0_f64.sqrt();
    if guess <= asked.error {
        let message = format!(
            "without any calibration a guess of the middle of the distances {first} … {last} mm is as good"
        );
        let error = InputError::new(message).key("--error").value(asked.error);
        return Err(error.allowed(format!("< {guess:.3} mm, or distances farther apart")).into());
    }
    let noise = rig.setup.gauge.noise_strain.filter(|noise| *noise > 0.0);
    let spread = match (like, noise) {
        (Some(spread), _) => spread,
        (None, Some(noise)) => {
            let [floor, relative, position, gain] =
                [noise, asked.relative, asked.place / (first * last).sqrt(), asked.gain].map(|sd| sd * sd);
            Spread { floor, relative, position, gain, zero: floor, ..Spread::default() }
        }
        (None, None) => {
            let error = InputError::new("how good a calibration is depends on the noise of a reading");
            let allowed = "noise_strain in [gauge], noise in [sensor] for another signal; or --like CAL.toml";
            return Err(error.key("gauge.noise_strain").allowed(allowed).into());
        }
    };
    let at = Extent::around((rig, open), rig.setup.gauge.side, [[first, last], ends(&drives)], 0.0);
    let exact = Exact::new(spec_values(&rig.setup), apart::parameters(rig), at);
    let exact = exact.map_err(|why| {
        let message = format!("the model cannot be solved over these distances and drives: {why}");
        let error = InputError::new(message).key("tap").allowed("nearer distances, smaller drives");
        if why.is_of_whisker() { Error::from(error) } else { why.into() }
    })?;
    let (curve, _) = whisker(exact.clone());
    let limit = rig.strain_limit();
    let near = rig.shared().gauge[1];
    let allowed = |a: f64, u: f64| {
        let signal = curve(a, u);
        let measured = signal > 0.0 && signal <= limit && signal.is_finite();
        a > near && rig.design.admits(&rig.setup, a, u) && measured
    };
    let at = [distances.as_slice(), &drives];
    let may = |i: usize, j: usize| allowed(at[0][i], at[1][j]);
    let (runs, positions) = (asked.runs, asked.positions.unwrap_or(usize::MAX));
    let ask =
        Ask { curve: &curve, distances: at[0], drives: at[1], allowed: &may, runs, positions, rig: spread };
    let Some(mut planner) = Planner::new(&ask) else {
        let message = "no tap of this spec tells a distance: two distances or more are needed beyond the gauge, within strain_limit, at which the signal falls";
        return Err(InputError::new(message).key("tap").allowed("other a and theta (delta) in [tap]").into());
    };
    let even = order::even(&planner, &distances, &drives, asked.runs);
    planner.pin();
    let mut path = Vec::new();
    while (planner.sigma() > asked.error || planner.count() < LEAST) && planner.count() < MOST {
        planner.grow();
        path.push((planner.count(), planner.sigma()));
    }
    if planner.sigma() > asked.error {
        let (sigma, floor) = (planner.sigma(), planner.floor());
        let error = InputError::new(format!(
            "no calibration of {MOST} taps reaches this: they leave {sigma:.3} mm, of which {floor:.3} mm are the noise, the position and the run of the \
             reading itself"
        ));
        let allowed =
            format!("> {sigma:.3} mm; larger drives, a smaller --place, or several taps of one object");
        return Err(error.key("--error").value(asked.error).allowed(allowed).into());
    }
    planner.exchange();
    loop {
        let mut fewer = planner.clone();
        fewer.shrink();
        fewer.exchange();
        if fewer.count() < LEAST || fewer.sigma() > asked.error {
            break;
        }
        planner = fewer;
    }
    let (sigma, floor, taps) = (planner.sigma(), planner.floor(), planner.chosen());
    path.retain(|(n, _)| *n < taps.len());
    path.push((taps.len(), sigma));
    for _ in 0..taps.len().min(MOST - taps.len()) {
        planner.grow();
        path.push((planner.count(), planner.sigma()));
    }
    let pairs: Vec<_> = distances.iter().flat_map(|a| drives.iter().map(move |u| (*a, *u))).collect();
    let fine: Vec<&(f64, f64)> = pairs.iter().filter(|(a, u)| allowed(*a, *u)).collect();
    Ok(Planned {
        rows: order::rows(&taps, asked.runs, asked.seed),
        apart: apart::apart(rig.setup.drive, &exact, &taps, at, &spread, &allowed),
        reached: [range(fine.iter().map(|p| p.0)), range(fine.iter().map(|p| p.1))],
        forbidden: [pairs.len() - fine.len(), pairs.len()],
        ends: at.map(ends),
        rig: spread,
        distances,
        drives,
        taps,
        sigma,
        floor,
        path,
        even,
    })
}

/// Candidate positions, even over the distances of the spec, rounded to 0.1 mm.
fn distances(space: &Space) -> Result<Vec<f64>, InputError> {
    let axis = axis(space, Column::Distance, "tap.a")?;
    let (lo, hi) = (axis.min(), axis.max());
    let round = |x: f64| (x / ROUND).round() * ROUND;
    let at = |k: usize| round(lo + (hi - lo) * k as f64 / (DISTANCES - 1) as f64).clamp(lo, hi);
    let mut all: Vec<f64> = (0..DISTANCES).map(at).collect();
    all.dedup();
    if all.len() < 2 {
        let error = InputError::new("a calibration needs two distances or more").key("tap.a").value(lo);
        return Err(error.allowed("the range that the rig can go: a = { from = 20, to = 50, steps = 7 }"));
    }
    Ok(all)
}

/// Drives of the spec, thinned to [`DRIVES`].
fn drives(space: &Space) -> Result<Vec<f64>, InputError> {
    let axis = axis(space, Column::Drive, "tap.theta")?;
    let all = distinct(axis.iter().take(1 << 20));
    let n = all.len();
    let few = n.min(DRIVES);
    Ok((0..few).map(|k| all[k * (n - 1) / (few - 1).max(1)]).collect())
}

fn axis<'a>(space: &'a Space, column: Column, key: &str) -> Result<&'a Axis, InputError> {
    space.axis(column).ok_or_else(|| {
        let error = InputError::new("a plan needs distances and drives in [tap], not a list of tuples");
        error.key(key).allowed("a = { from = 20, to = 50, steps = 7 } and theta = [2, 4, 6]")
    })
}
