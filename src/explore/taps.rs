//! Solves the taps of a page's chart in f64; and those that check it, at whiskers of its domain away from the chart's points.

use rayon::prelude::*;

use super::Domain;
use super::along::{ARC, Along, CONTACT, FAR, FORCE, FUNCTIONS, OFFSET, PLACE, SIGNAL, TAPER, linear};
use crate::census::{self, sample};
use crate::chart::axis::{AXES, POINT, Quantity};
use crate::design::{Design, Shared, is_whisker};
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::kernel::cpu::Cpu;
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::physics::solid::{distorted_linear, is_solid};
use crate::physics::{driven::Driven, inverse::Inverse, taper::Taper};
use crate::scene::{Grip, Precision, Setup, Side, Signal, Tuple};
use crate::status::Status;

/// Contact distance of taps without a length scale, mm.
const UNIT: f64 = 10.0;

const DRIVE: usize = Quantity::Drive as usize;
const BASE: usize = Quantity::Base as usize;

/// `setup` with a gauge on each side, and with the wrench if the sensor reads it.
pub fn sides(setup: &Setup) -> [Setup; 2] {
    let wrench = setup.signal != Signal::Strain;
    [Side::Contact, Side::Far]
        .map(|side| Setup { signal: Signal::Strain, wrench, ..setup.clone() }.side(side))
}

pub struct Taps<'a> {
    setup: &'a Setup,
    /// Contact side and, unless it mirrors, far side.
    sides: Vec<Evaluator<'a>>,
    grip: Grip,
    power: i32,
}

impl<'a> Taps<'a> {
    /// Taps of `setup` with gauges on `sides` and contacts held by `grip`; functions are divided by driveᵖᵒʷᵉʳ.
    pub fn new(setup: &'a Setup, sides: &'a [Setup], grip: Grip, power: i32, tolerance: f64) -> Self {
        let evaluator = |setup| Evaluator::new(setup, f64_method(setup, tolerance));
        Self { setup, sides: sides.iter().map(evaluator).collect(), grip, power }
    }

    /// The functions at `points`, in axis order; `None` without a solution.
    pub fn solve(&mut self, points: &[[f64; AXES]]) -> Result<Vec<Option<[f64; FUNCTIONS]>>, SolveError> {
        let (setup, grip, power) = (self.setup, self.grip, self.power);
        let asked: Vec<(Design, f64, f64)> = points.par_iter().map(|q| tap(setup, q)).collect();
        let tasks: Vec<Task> = (0..)
            .zip(&asked)
            .map(|(design, (_, a, drive))| Task { design, a: *a, drive: *drive, ..Task::default() })
            .collect();
        let designs: Vec<Design> = asked.into_iter().map(|(design, ..)| design).collect();
        let mut found = Vec::new();
        for evaluator in &mut self.sides {
            // A solid has no friction; only `run` includes the motion of its base and its indentation.
            found.push(match is_solid(&setup.model) {
                true => evaluator.run(&designs, &tasks)?,
                false => evaluator.run_gripped(&designs, &tasks, grip, false)?,
            });
        }
        let (contact, far) = (&found[0], found.last().unwrap_or(&found[0]));
        let functions = |i: usize| {
            let scale = points[i][DRIVE].powi(power);
            let linear = force(setup, &designs[i], &tasks[i]);
            let mut f = [0.0; FUNCTIONS];
            f[FORCE] = contact[i].normal_force / linear - 1.0;
            let room = 1.0 - points[i][PLACE];
            let skin = skin(setup, &points[i]) * (1.0 + f[FORCE]);
            f[CONTACT] = room * strain(&contact[i])? - skin;
            f[FAR] = room * strain(&far[i])? - skin;
            f[ARC] = contact[i].arc / tasks[i].a - 1.0;
            if let Some(read) = setup.signal.of(contact[i].wrench) {
                let arm = if setup.signal == Signal::Moment { tasks[i].a } else { 1.0 };
                f[SIGNAL] = read.abs() / (linear * arm) - 1.0;
            }
            Some(f.map(|f| f / scale)).filter(|f| f.iter().all(|f| f.is_finite()))
        };
        Ok((0..points.len()).into_par_iter().map(functions).collect())
    }
}

/// (1 − x/a) times the relative strain change by distorting sections at the point `q`, in the linear limit; at finite drive proportional to the
/// force.
pub fn skin(setup: &Setup, q: &[f64; AXES]) -> f64 {
    if !setup.model.distorting {
        return 0.0;
    }
    // Lengths in units of a.
    let taper = Taper { D: q[BASE], tau: q[TAPER], tan_alpha: 0.5 * q[TAPER] * q[BASE] };
    let [bending, lever] = distorted_linear(&taper, q[PLACE]);
    (1.0 - q[PLACE]) * (bending - 1.0) + lever
}

/// Single f64 taps on the CPU, to `tolerance`.
pub fn f64_method(setup: &Setup, tolerance: f64) -> Method {
    Method::fast(Box::new(Cpu::new(Precision::F64)), Precision::F64, &setup.model.material, tolerance)
}

/// δ = ε/(θ f) − 1, if the tap has a strain.
fn strain(o: &Outcome) -> Option<f64> {
    (!o.status.has(Status::NO_READING)).then(|| -o.deviation / (1.0 + o.deviation))
}

/// P by the model's linear theory, N.
fn force(setup: &Setup, design: &Design, task: &Task) -> f64 {
    let curve = design.shared.as_ref().map(|s| s.theory.curve().force(setup.model.material.e0(), task.a));
    curve.unwrap_or(f64::NAN) * task.driven(setup).size()
}

/// A whisker longer than any contact with a point gauge, its contact distance (mm) and drive, from `q`. Its theory is the linear limit of the model,
/// with shear if the model has it.
#[allow(non_snake_case)]
fn tap(setup: &Setup, q: &[f64; AXES]) -> (Design, f64, f64) {
    let pole = setup.model.pole_radius;
    let a = if pole > 0.0 { pole / q[OFFSET] } else { UNIT };
    let hub = if pole > 0.0 { 0.0 } else { a * q[OFFSET] };
    let D = a * q[BASE];
    let reach = if q[TAPER] > 0.0 { (0.5 + 0.5 / q[TAPER]).min(1.5) } else { 1.5 };
    let (L_a, d) = (a * reach, D * (1.0 - q[TAPER] * reach));
    let taper = Taper::new(D, d, L_a);
    let gauge = [-0.5, 0.5].map(|end| a * (q[PLACE] + end * POINT));
    let shear = if setup.model.shear { shear_length2(&taper, setup.model.nu) } else { 0.0 };
    let theory = Inverse::new(StrainCurve::new(taper, gauge, hub, setup.drive, shear));
    let (x_ss, l, none) = (gauge[0], a * POINT, f64::NAN);
    let tuple = Tuple { D, d, L_a, x_ss, l, a: none, drive: none, ..Tuple::default() };
    let shared = Shared { theory, ..Shared::new(setup, (taper, L_a), None, (gauge, hub), None) };
    let drive = Driven::of_chart(setup.drive, q[DRIVE], a).to_users();
    (Design { shared: Some(shared), ..Design::nothing(tuple) }, a, drive)
}

const WHISKERS: usize = 600;

#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Census {
    pub taps: usize,
    /// Number of taps outside the chart.
    pub outside: usize,
    /// Largest relative error of the signal: strain, moment or force.
    pub strain: f64,
    /// Largest error of s/(θ f) − 1 relative to it, or to 1e-7 if it is smaller; s is the signal, f the linear limit of the model.
    pub deviation: f64,
}

impl Census {
    pub fn take(setup: &Setup, domain: &Domain, chart: &Along) -> Result<Self, SolveError> {
        let mut census = Self::default();
        for hub in hubs(domain) {
            let own = setup.clone().hub(hub);
            let mut taps = Vec::new();
            for i in 0..WHISKERS / hubs(domain).len() {
                let t = whisker(domain, i, hub);
                if !is_whisker(&t) || t.a > t.L_a {
                    continue;
                }
                match chart.signal(setup, hub, &t) {
                    Some(delta) => taps.push((t, delta)),
                    None => census.outside += 1,
                }
            }
            let tuples: Vec<Tuple> = taps.iter().map(|(t, _)| *t).collect();
            let found = census::Taps::of(&own, &tuples).answers(f64_method(&own, 1e-10))?;
            for ((t, delta), o) in taps.iter().zip(&found).filter(|(_, o)| o.strain.is_finite()) {
                // K − 1 refers to the estimator's theory; convert it to the linear limit in closed form.
                let theory = o.strain_linear.abs();
                let limit = Driven::of_users(setup.drive, t.drive).size() * linear(setup, hub, t);
                let ratio = if theory == limit { 1.0 } else { theory / limit };
                let known = ((ratio - 1.0) - o.deviation) / (1.0 + o.deviation);
                let error = (delta - known).abs();
                census.taps += 1;
                census.strain = census.strain.max(error / (1.0 + known));
                census.deviation = census.deviation.max(error / known.abs().max(1e-7));
            }
        }
        Ok(census)
    }
}

fn hubs(domain: &Domain) -> Vec<f64> {
    let [lo, hi] = domain.hub;
    if hi > lo { [0.0, 0.37, 1.0].map(|x| lo + x * (hi - lo)).to_vec() } else { vec![lo] }
}

/// Whisker `i` of `domain`, by a low-discrepancy sequence (Weyl).
fn whisker(domain: &Domain, i: usize, hub: f64) -> Tuple {
    // Powers of 1/x, x the root of x⁸ = x + 1.
    const ROOT: f64 = 1.096_981_557_798_560_7;
    let at =
        |k: i32, [lo, hi]: [f64; 2]| lo + (hi - lo) * (0.5 + hub + (i + 1) as f64 * ROOT.powi(-k)).fract();
    let whisker = sample::sides(&domain.whiskers);
    // The distance stands between the lengths and the drive.
    let values = std::array::from_fn(|k| at([1, 2, 3, 4, 5, 7][k], whisker[k]));
    Tuple { a: at(6, domain.a), ..sample::point(values) }
}
