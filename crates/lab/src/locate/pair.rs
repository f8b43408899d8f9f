//! Readings of two gauges 90° apart round the whisker: distance, tilt, and where in space the contact is (model §6).
//! With the sign of the first gauge: r₁ = s₁ ε₁, r₂ = s₂ ε(90° + δ), δ the misalignment of the second gauge.

use std::sync::{Mutex, PoisonError};

use super::pairs::{Parts, covariance};
use super::{Calibration, Located, Locator, Reading, calibration::Second};
use crate::curve::both::{self, Inverted, Inverter, TwoReadings, inverse};
use crate::error::{Result, SolveError};
use crate::estimator::{
    Estimator, Extent, Found, Known, ModelError, Opener, SAME, SideRecord, Values, parameter::scene_with,
    surface::continued,
};
use crate::evaluate::{Evaluator, Method, Referral, Task};
use crate::measure::Skin;
use crate::scene::{Direction, Setup};
use crate::{design::Design, status::Status};

#[derive(Debug, Clone)]
pub struct Pair {
    pub setup: Setup,
    designs: [Design; 1],
    /// Offsets added to a labelled distance, mm, and to a labelled drive.
    offsets: [f64; 2],
    /// Lean of the pole, degrees.
    lean: f64,
    reach: [f64; 2],
}

impl Pair {
    /// Model with the parameters `values`, over the distances of `at`, for poles that lean by `lean` degrees.
    pub fn new(values: &Values, at: Extent<'_>, lean: f64) -> Result<Self, ModelError> {
        let rig = at.rig;
        let mut setup = scene_with(&rig.setup, values);
        setup.gauge.side = at.side;
        setup.gauge.second = true;
        let (reach, tuple) = continued(rig, at.reach)?;
        let design = Design::new(&setup, tuple);
        if design.shared.is_none() {
            return Err(ModelError::TooFar);
        }
        Ok(Self { setup, designs: [design], offsets: [values[2], values[1]], lean, reach })
    }

    pub fn tap(&self, a: f64, tilt: f64, drive: f64) -> Task {
        let ([a0, drive0], direction) = (self.offsets, Direction { tilt, lean: self.lean });
        Task { design: 0, a: a + a0, direction, drive: drive + drive0 }
    }

    /// Mean strains of taps: of the centreline, of the first gauge, and 90° further, in the sign of the first; `None` without a solution.
    pub fn strains(
        &self,
        evaluator: &mut Evaluator<'_>,
        taps: &[Task],
    ) -> Result<Vec<Option<[f64; 3]>>, SolveError> {
        let outcomes = evaluator.run(&self.designs, taps)?;
        let strains = outcomes.iter().map(|o| both::strains(&self.setup, o));
        Ok(strains.map(|strains| strains.filter(|[axial, ..]| axial.is_finite())).collect())
    }
}

/// A contact in space. The motor's axis is the origin, x lies along the whisker at first touch, y towards the object, z along the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spatial {
    pub located: Located,
    /// Tilt of the pole, degrees; NaN where there is none.
    pub tilt: f64,
    /// One standard deviation, degrees.
    pub sigma_tilt: f64,
    /// Correlation of the errors of distance and tilt.
    pub correlation: f64,
    /// Where it is, mm.
    pub point: [f64; 3],
    /// Standard deviations, mm.
    pub sigma_point: [f64; 3],
    /// Of two gauges, what the errors of distance and tilt are made of.
    pub(super) parts: Option<Parts>,
}

impl Spatial {
    pub const fn nothing(status: Status) -> Self {
        Self::of(Located::nothing(status))
    }

    pub const fn of(located: Located) -> Self {
        let (tilt, point) = (f64::NAN, [f64::NAN; 3]);
        Self { located, tilt, sigma_tilt: tilt, correlation: tilt, point, sigma_point: point, parts: None }
    }

    /// Its numbers, in the order of tables.
    pub fn numbers(&self) -> [f64; 11] {
        let Located { distance, sigma, .. } = self.located;
        let ([x, y, z], [sx, sy, sz]) = (self.point, self.sigma_point);
        [distance, sigma, self.tilt, self.sigma_tilt, self.correlation, x, y, z, sx, sy, sz]
    }
}

pub(crate) struct Twofold {
    second: Second,
    /// s₁ and s₂, reading per strain.
    factors: [f64; 2],
    skin: Skin,
    /// Place of the side of the gauge among those that are answered.
    pub(super) side: usize,
    /// The model and what solves it, where the estimator inverts it; else tilt and strain come of linear theory.
    model: Option<(Pair, Mutex<Option<Method>>)>,
}

impl Twofold {
    pub(crate) fn new(c: &Calibration, estimator: Estimator, open: Opener<'_>) -> Result<Option<Self>> {
        let rig = &c.rig;
        let side = c.sides.iter().position(|s| s.gauge() == rig.setup.gauge.side);
        let (Some(second), Some(side)) = (c.second.clone(), side) else { return Ok(None) };
        let record: &SideRecord = &c.sides[side];
        let factor = record.exact.as_ref().and_then(|r| r.factor(rig.setup.drive)).unwrap_or(1.0);
        let model = match record.exact.as_ref().filter(|_| estimator == Estimator::Exact) {
            Some(exact) => {
                let at = Extent::around((rig, open), record.gauge(), record.ranges(), 0.0);
                let pair = Pair::new(&exact.values(rig), at, second.lean_deg)?;
                let method = open(&pair.setup.model)?;
                Some((pair, Mutex::new(Some(method))))
            }
            None => None,
        };
        let factors = [factor, second.factor];
        Ok(Some(Self { second, factors, skin: Skin::new(rig, None), side, model }))
    }

    /// The taps of the model that give the readings of `asked`, looked for first where these are; one thread after the other. Nothing without a model.
    fn invert(&self, asked: &[Result<Solved, Status>]) -> Result<Vec<Option<Inverted>>, SolveError> {
        let Some((pair, method)) = &self.model else { return Ok(Vec::new()) };
        let mut held = method.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(method) = held.take() else { return Ok(Vec::new()) };
        let mut evaluator = Evaluator::new(&pair.setup, method);
        let start = |s: &Solved| (pair.tap(s.found.a, s.tilt.to_degrees(), s.drive), s.readings);
        let asked: Vec<TwoReadings> = asked.iter().flatten().map(start).collect();
        // Of the strains of the centreline, of the first gauge and 90° further.
        let reading: both::Reading<'_> = &|[axial, first, second]| {
            let (sin, cos) = self.second.misalignment_deg.to_radians().sin_cos();
            let strain_2 = axial + (second - axial) * cos - (first - axial) * sin;
            [self.factors[0] * first, self.factors[1] * strain_2]
        };
        let (setup, designs) = (&pair.setup, &pair.designs);
        let referral = Referral::ALL;
        let mut inverter = Inverter { setup, evaluator: &mut evaluator, referral, designs, reading, taps: 0 };
        let found = inverter.invert(&asked, &|_| pair.reach);
        *held = Some(evaluator.into_method());
        let mut found = found?;
        found.iter_mut().flatten().for_each(|one| one.task.a -= pair.offsets[0]);
        Ok(found)
    }

    /// Linear theory: tilt tan β̂ = ε₂/ε₁ (rad), reading (ε₁² + ε₂²)/ε₁ of an upright pole at the same distance, and d(reading, β̂)/d(r₁, r₂).
    fn linear(&self, readings: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let ([s1, s2], misalignment) = (self.factors, self.second.misalignment_deg.to_radians());
        // Without the strain of the centreline.
        let (e1, (sin, cos)) = (readings[0] / s1, misalignment.sin_cos());
        let e2 = (readings[1] / s2 + e1 * sin) / cos;
        let (t, square) = (e2 / e1, e1 * e1 + e2 * e2);
        // d e₂ = d r₂/(s₂ cos δ) + tan δ d r₁/s₁.
        let (by_1, by_2) = (misalignment.tan() / s1, 1.0 / (s2 * misalignment.cos()));
        let of_reading = [(1.0 - t * t) + s1 * 2.0 * t * by_1, s1 * 2.0 * t * by_2];
        let of_tilt = [(e1 * by_1 - e2 / s1) / square, e1 * by_2 / square];
        ([t.atan(), s1 * square / e1], [of_reading, of_tilt])
    }
}

/// Distance and tilt from the two readings of one tap, before they are judged.
struct Solved {
    /// Positive on the side that is calibrated.
    readings: [f64; 2],
    drive: f64,
    status: Status,
    /// By linear theory; with the distance of the model, if that was inverted.
    found: Found,
    /// rad.
    tilt: f64,
    /// d(a, β)/d(r₁, r₂).
    inverse: [[f64; 2]; 2],
    /// True if strain grows with distance there: the root is the near one.
    rising: bool,
}

impl Locator {
    pub fn is_twofold(&self) -> bool {
        self.twofold.is_some()
    }

    /// Distance, tilt and place of taps of two readings. Without a second gauge there is nothing.
    pub fn locate_pairs(&self, readings: &[Reading]) -> Result<Vec<Spatial>> {
        let Some(two) = &self.twofold else {
            return Ok(vec![Spatial::nothing(Status::OUTSIDE_CALIBRATION); readings.len()]);
        };
        // Linear theory gives the start of the model's inverse.
        let mut all: Vec<_> = readings.iter().map(|reading| self.by_theory(two, reading)).collect();
        let inverted = two.invert(&all)?;
        for (one, found) in all.iter_mut().filter(|one| one.is_ok()).zip(inverted) {
            let Ok(solved) = one else { continue };
            match found.and_then(|found| Some((found, inverse(found.slopes)?))) {
                Some((Inverted { task, slopes }, inverse)) => {
                    (solved.found.a, solved.tilt) = (task.a, task.direction.tilt.to_radians());
                    (solved.inverse, solved.rising) = (inverse, slopes[0][0] > 0.0);
                }
                None => *one = Err(solved.status | Status::NO_ROOT),
            }
        }
        let judged = |(one, reading): (Result<Solved, Status>, &Reading)| {
            one.and_then(|solved| self.judged(two, reading, &solved)).unwrap_or_else(Spatial::nothing)
        };
        Ok(all.into_iter().zip(readings).map(judged).collect())
    }

    /// Distance and tilt of two readings by linear theory, or why there are none.
    fn by_theory(&self, two: &Twofold, reading: &Reading) -> Result<Solved, Status> {
        let side = &self.sides[two.side];
        let drive = self.beyond_origin(reading.drive);
        let readings = [0, 1].map(|k| side.sign * reading.signals[k]);
        if !drive.is_finite() || !readings.iter().all(|x| x.is_finite()) {
            return Err(Status::BAD_INPUT);
        }
        if readings == [0.0; 2] {
            return Err(Status::NO_STRAIN);
        }
        let per_strain = if self.unit.is_absolute() { [1.0; 2] } else { two.factors };
        let beyond =
            (readings[0] / per_strain[0]).hypot(readings[1] / per_strain[1]) > self.rig.strain_limit();
        let status = if beyond { Status::STRAIN_LIMIT } else { Status::OK };
        // No strain in the first gauge would mean a tilt of 90° or more.
        if readings[0] <= 0.0 || !side.admits(drive) {
            return Err(status | Status::OUTSIDE_CALIBRATION);
        }
        if readings[0] >= side.end_stop * (1.0 - SAME) {
            return Err(status | Status::STRAIN_LIMIT);
        }
        let ([tilt, upright], [of_a, of_tilt]) = two.linear(readings);
        let known = Known { share: reading.shares[0], same_run: self.same_run };
        let found = side.answers.find(drive, upright, known).map_err(|why| status | why)?;
        let inverse = [of_a.map(|x| x / found.slope), of_tilt];
        Ok(Solved { readings, drive, status, found, tilt, inverse, rising: false })
    }

    /// The answer, with what it is worth: J⁻¹ N J⁻ᵀ, and the bias on held-out distances.
    fn judged(&self, two: &Twofold, reading: &Reading, solved: &Solved) -> Result<Spatial, Status> {
        let side = &self.sides[two.side];
        let Second { factor, noise, sigma_factor, sigma_misalignment_deg, .. } = &two.second;
        let noises = [self.noise, *noise];
        let zeros = [0, 1].map(|k| noises[k] * reading.shares[k].sqrt());
        let Found { a, near, variance, .. } = solved.found;
        let of_model = (variance * solved.tilt.cos().powi(4)).sqrt();
        let of_factor = solved.readings[1] * sigma_factor / factor;
        let ratio = factor / two.factors[0];
        let of_misalignment = solved.readings[0] * ratio * sigma_misalignment_deg.to_radians();
        // Change of distance and tilt with an error of one gauge.
        let moved = |gauge: usize, error: f64| solved.inverse.map(|by| by[gauge] * error);
        let [zero, model] = [self.of_zero.sqrt(), of_model].map(|error| moved(0, error));
        let [factor, misalignment] = [of_factor, of_misalignment].map(|error| moved(1, error));
        let bias = [side.bias_at(solved.drive), 0.0];
        let parts = Parts {
            at: [a, solved.tilt],
            own: covariance(&[0, 1].map(|k| moved(k, noises[k]))),
            moved: [zero, model, factor, misalignment, bias, moved(0, zeros[0]), moved(1, zeros[1])],
        };
        let [[aa, at], [_, tt]] = parts.with(&parts.moved);
        let (sigma, sigma_tilt) = (aa.sqrt(), tt.sqrt());
        if !(sigma.is_finite() && sigma_tilt.is_finite()) {
            return Err(solved.status | Status::NO_ROOT);
        }
        let more = || !self.rig.shared().theory.alone(a);
        let ambiguous = if solved.rising && more() { Status::AMBIGUOUS } else { Status::OK };
        let status = solved.status | ambiguous | side.doubts(a, near, sigma);
        let (sin, cos) = solved.tilt.sin_cos();
        let [x, out] = two.skin.place(a);
        let [along, narrower] = two.skin.slope();
        // Gradients of x, y, z over a and β.
        let by = [[along, 0.0], [narrower * cos, -out * sin], [narrower * sin, out * cos]];
        let spread = |[p, q]: [f64; 2]| (p * p * aa + 2.0 * p * q * at + q * q * tt).max(0.0).sqrt();
        Ok(Spatial {
            located: Located::normal(a, sigma, status),
            tilt: solved.tilt.to_degrees(),
            sigma_tilt: sigma_tilt.to_degrees(),
            correlation: at / (sigma * sigma_tilt),
            point: [x, out * cos, out * sin],
            sigma_point: by.map(spread),
            parts: Some(parts),
        })
    }
}
