//! Taps of a chart as whiskers, solved in f64.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::axis::{AXES, Axis, POINT, Quantity};
use super::build::{Bound, Built, MOST, ROUGH, build};
use super::ranges::shaped;
use crate::design::{Design, Shared};
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Method, Outcome, Referral, Task};
use crate::kernel::cpu::Cpu;
use crate::physics::{body::Body, driven::Driven, inverse::Inverse, linear::StrainCurve, taper::Taper};
use crate::reduce::Sweeps;
use crate::scene::{Direction, Grip, Precision, Setup, Tuple};

/// Solves the taps of a chart at one distance.
pub struct Taps<'a> {
    setup: &'a Setup,
    evaluator: Evaluator<'a>,
    /// a, mm.
    a: f64,
    /// Contact; None: the model's.
    grip: Option<Grip>,
    direction: Direction,
    /// Length of the grid, mm, if a foil makes it more than a point.
    grid: Option<f64>,
    /// Sweeps spent on them.
    pub sweeps: Sweeps,
}

impl<'a> Taps<'a> {
    /// Taps of `setup` at `a` mm with contact `grip` on poles of `direction`, to `tolerance`; with grids of `l` mm, if the setup has a
    /// foil, in place of points. They end once `stop` is set.
    pub fn new(
        setup: &'a Setup,
        (a, direction, grip): (f64, Direction, Option<Grip>),
        l: Option<f64>,
        (tolerance, stop): (f64, &'a AtomicBool),
    ) -> Self {
        let cpu = Box::new(Cpu::new(Precision::F64));
        let method = Method::fast(cpu, Precision::F64, &setup.model.material, tolerance);
        let evaluator = Evaluator::new(setup, method).stopping(stop);
        let (grid, sweeps) = (l.filter(|_| setup.gauge.foil.is_some()), Sweeps::default());
        Self { setup, evaluator, a, grip, direction, grid, sweeps }
    }

    /// Box and series over `axes`, within `bounds`, of `value` of quantities and their tap; sets `sweeps` to those spent.
    pub fn built<const F: usize>(
        mut self,
        axes: [Axis; AXES],
        bounds: &[Bound; F],
        value: impl Fn(&[f64; AXES], &Outcome) -> Option<[f64; F]>,
        sweeps: &mut Sweeps,
    ) -> Result<Option<Built<F>>, SolveError> {
        let value =
            |(q, o): (&[f64; AXES], &Outcome)| value(q, o).filter(|v| v.iter().all(|v| v.is_finite()));
        let mut ask = |q: &[[f64; AXES]]| Ok(q.iter().zip(&self.solve(q)?).map(value).collect());
        let built = build(axes, bounds, (MOST, &ROUGH), &mut ask)?;
        sweeps.merge(&self.sweeps);
        Ok(built)
    }

    /// Outcomes at `points`, quantities in the order of [`Quantity`].
    pub fn solve(&mut self, points: &[[f64; AXES]]) -> Result<Vec<Outcome>, SolveError> {
        let points: Vec<(f64, [f64; AXES])> = points.iter().map(|q| (self.a, *q)).collect();
        self.solve_at(&points)
    }

    /// The same, each at its distance, mm.
    pub fn solve_at(&mut self, points: &[(f64, [f64; AXES])]) -> Result<Vec<Outcome>, SolveError> {
        let designs: Vec<Design> =
            points.par_iter().map(|(a, q)| design(self.setup, self.grid, *a, q)).collect();
        let task = |(design, (a, q)): (u32, &(f64, [f64; AXES]))| {
            let (direction, drive) = (self.direction, driven(self.setup, *a, q).to_users());
            Task { design, a: *a, direction, drive }
        };
        let tasks: Vec<Task> = (0..).zip(points).map(task).collect();
        let outcomes = match self.grip {
            Some(grip) => self.evaluator.run_gripped(&designs, &tasks, grip, true)?,
            None => self.evaluator.run_referring(&designs, &tasks, Referral::SAMPLES)?,
        };
        self.sweeps.merge(&self.evaluator.take_sweeps());
        Ok(outcomes)
    }
}

/// The drive of a tap at `a` mm with the quantities `q`.
pub(super) fn driven(setup: &Setup, a: f64, q: &[f64; AXES]) -> Driven {
    Driven::of_chart(setup.drive, q[Quantity::Drive as usize], a)
}

/// A whisker, longer than any contact, with a point gauge, or a grid of `grid` mm and its foil, for a tap at `a` mm with the quantities `q`. The foil
/// passes on all of the strain here: each design applies its share T later.
#[allow(non_snake_case)]
pub(super) fn design(setup: &Setup, grid: Option<f64>, a: f64, q: &[f64; AXES]) -> Design {
    let of = |quantity: Quantity| a * q[quantity as usize];
    let (D, place) = (of(Quantity::Base), of(Quantity::Place));
    let p = q[Quantity::Taper as usize];
    let reach = match () {
        () if shaped(setup) => q[Quantity::Length as usize],
        () if p > 0.0 => (0.5 + 0.5 / p).min(1.5),
        () => 1.5,
    };
    let L_a = a * reach;
    let d = D * (1.0 - p * reach);
    let taper = Taper::new(D, d, L_a);
    let width = grid.map_or(a * POINT, |l| l * taper.cos_alpha());
    let gauge = [place - 0.5 * width, place + 0.5 * width];
    let body = setup
        .built
        .as_deref()
        .map(|built| Arc::new(Body::new(built, [D, d, L_a], setup.model.material.e0(), setup.model.nu)));
    // Errors are relative to the peak where there is next to no strain; a built whisker uses that of its cone.
    let cone = Inverse::new(StrainCurve::new(taper, gauge, setup.hub, setup.drive, 0.0));
    let mut shared = Shared::new(setup, (taper, L_a), body, (gauge, setup.hub), Some(cone.peak().1));
    shared.foil.iter_mut().for_each(|foil| foil.transfer = 1.0);
    let tuple = Tuple {
        D,
        d,
        L_a,
        x_ss: gauge[0],
        l: width / taper.cos_alpha(),
        a: f64::NAN,
        drive: f64::NAN,
        ..Tuple::default()
    };
    Design { shared: Some(shared), ..Design::nothing(tuple) }
}
