//! Taps of built whiskers (model §7) by their kernel.

use rayon::prelude::*;

use super::outcome::{Asked, Found, reading};
use super::solve::ROUGH;
use super::{Evaluator, Method, Outcome, Outcomes, Task, referred};
use crate::design::Design;
use crate::error::SolveError;
use crate::kernel::rule::limits::EDGE;
use crate::physics::onset::Grip;
use crate::scene::{Contact, Drive, Geometry, Material, Precision, Setup, Side};
use crate::status::Status;
use vibrissa_built::{Effects, Rod, Solution, Tap, solve_on};

/// Distance, over a, from a corner or the tip within which the kernel cannot decide the contact's side.
const CLOSE: f64 = 1e-6;

enum Open {
    /// The reference must decide.
    Unsure,
    Ended(Status),
}

type Known = Option<Result<Solution, Open>>;

pub(super) fn asked(setup: &Setup) -> bool {
    setup.built.is_some() && setup.model.geometry == Geometry::Exact
}

impl Evaluator<'_> {
    /// Outcomes of `tasks`, tilted ones by the reference; contacts of `grip`, or as the model says; `expected`: the answers of the reference, if known.
    pub(super) fn built(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: Option<Grip>,
        expected: Option<&[Outcome]>,
    ) -> Outcomes {
        let (setup, tolerance, samples) = (self.setup, self.tolerance(), self.samples);
        let rods: Vec<Option<Rod>> = designs
            .par_iter()
            .map(|design| {
                let shared = design.shared.as_ref()?;
                Some(Rod::new(shared.body.as_deref()?, shared.gauge))
            })
            .collect();
        let first = match (grip, setup.model.contact) {
            (Some(grip), _) => grip,
            (None, Contact::Frictionless | Contact::Coulomb(0.0)) => Grip::Slide(0.0),
            (None, _) => Grip::Stick,
        };
        let mut held = vec![first; tasks.len()];
        let mut solved = self.shots((designs, &rods), tasks, &held)?;
        if let (None, Contact::Coulomb(mu)) = (grip, setup.model.contact)
            && mu != 0.0
        {
            let slides = |s: &Solution| s.tangential.abs() > mu * s.normal;
            let sliding: Vec<usize> = (0..tasks.len())
                .filter(|&i| solved[i].as_ref().is_some_and(|s| is_plain(s, mu, tolerance) && slides(s)))
                .collect();
            for &i in &sliding {
                held[i] = Grip::Slide(mu.copysign(solved[i].map_or(0.0, |s| s.tangential)));
            }
            let those: Vec<Task> = sliding.iter().map(|&i| tasks[i]).collect();
            let grips: Vec<Grip> = sliding.iter().map(|&i| held[i]).collect();
            let again = self.shots((designs, &rods), &those, &grips)?;
            for (&i, new) in sliding.iter().zip(again) {
                solved[i] = new;
            }
            // Sticking must be certain, or the reference decides.
            for (s, grip) in solved.iter_mut().zip(&held) {
                if let Some(s) = s.as_mut().filter(|s| *grip == Grip::Stick && !is_plain(s, mu, tolerance)) {
                    *s = Solution::FAILED;
                }
            }
        }
        solved.iter().flatten().for_each(|s| self.sweeps.push(s.shots));
        let open = |(task, s): (&Task, &Option<Solution>)| {
            let s = s.as_ref()?;
            Some(check_answer(setup, &designs[task.design as usize], task, s, tolerance).map(|()| *s))
        };
        let known: Vec<Known> = tasks.par_iter().zip(&solved).map(open).collect();
        if self.spare < usize::MAX {
            let left = known.iter().filter(|k| matches!(k, Some(Err(Open::Unsure)))).count();
            self.spare = self.spare.checked_sub(left).ok_or(SolveError::TooHard)?;
        }
        let stop = self.stop;
        let finish = |(i, ((task, known), grip)): (usize, ((&Task, &Known), &Grip))| {
            let design = &designs[task.design as usize];
            let Some(asked) = Asked::new(setup, design, task) else { return Outcome::OUTSIDE };
            match known {
                Some(Ok(s)) => {
                    let strain = reading(asked.setup, s.wrench, s.strain);
                    let found = Found {
                        strain,
                        deviation: asked.linear / strain - 1.0,
                        beside: None,
                        wrench: s.wrench,
                        normal: s.normal,
                        tangential: s.tangential,
                        arc: s.arc,
                        sticking: *grip == Grip::Stick,
                    };
                    Outcome { sweeps: s.shots as f32, ..asked.outcome(found) }
                }
                Some(Err(Open::Ended(why))) => asked.unsolved(*why),
                None => Outcome {
                    referred: false,
                    ..referred(stop, expected.map(|known| &known[i]), (setup, design, task))
                },
                _ if samples && matches!(grip, Grip::Slide(_)) => asked.unsolved(Status::NOT_CONVERGED),
                _ => referred(stop, expected.map(|known| &known[i]), (setup, design, task)),
            }
        };
        Ok(tasks.par_iter().zip(&known).zip(&held).enumerate().map(finish).collect())
    }

    fn shots(
        &mut self,
        (designs, rods): (&[Design], &[Option<Rod>]),
        tasks: &[Task],
        grips: &[Grip],
    ) -> Result<Vec<Option<Solution>>, SolveError> {
        let setup = self.setup;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok(vec![None; tasks.len()]);
        };
        let stick = grips.first() == Some(&Grip::Stick);
        let model = &setup.model;
        if stick && model.pole_radius > 0.0 {
            // Only the reference can roll a contact.
            return Ok(tasks
                .iter()
                .map(|task| upright(setup, designs, task).map(|_| Solution::FAILED))
                .collect());
        }
        let effects = Effects {
            shear: model.shear,
            extension: model.extension,
            surface: model.surface,
            stick,
            law: !matches!(model.material, Material::Hooke(_)),
            far: setup.gauge.side == Side::Far,
        };
        let tap = |(task, grip): (&Task, &Grip)| {
            let Asked { setup, shared, amount, .. } = upright(setup, designs, task)?;
            let model = &setup.model;
            let (turn, lift) = match setup.drive {
                Drive::Angle => (amount, 0.0),
                Drive::Displacement => (0.0, amount),
            };
            Some(Tap {
                rod: rods[task.design as usize].as_ref()?,
                a: task.a,
                hub: if setup.drive == Drive::Angle { setup.hub } else { 0.0 },
                turn,
                lift,
                ratio: if let Grip::Slide(friction) = grip { *friction } else { 0.0 },
                force: amount * shared.model.force(model.material.e0(), task.a),
                least: if shared.model.reads_strain() { 1e-3 * amount * shared.peak } else { 1.0 },
                pole: model.pole_radius,
            })
        };
        let framed: Vec<Option<Tap<'_>>> = tasks.par_iter().zip(grips).map(tap).collect();
        let taps: Vec<Tap<'_>> = framed.iter().flatten().copied().collect();
        let chart = rungs.iter().rev().find_map(|rung| rung.chart());
        let precision = rungs.first().map_or(Precision::F64, |rung| rung.precision());
        let solved = solve_on(solver.as_mut(), &taps, effects, (precision, *tolerance), chart)?;
        let mut solved = solved.into_iter();
        Ok(framed.iter().map(|tap| tap.as_ref().and_then(|_| solved.next())).collect())
    }
}

/// The tap, unless it is tilted or outside the domain.
fn upright<'a>(setup: &'a Setup, designs: &'a [Design], task: &'a Task) -> Option<Asked<'a>> {
    let asked = Asked::new(setup, &designs[task.design as usize], task);
    asked.filter(|_| !task.is_spatial(setup))
}

/// True if it is certain whether the sticking contact of `s` would slide at `mu`.
fn is_plain(s: &Solution, mu: f64, tolerance: f64) -> bool {
    let spare = (mu * s.normal - s.tangential.abs()).abs();
    s.error <= tolerance && spare > ROUGH * s.error * s.tangential.abs().max(s.normal.abs())
}

fn check_answer(
    setup: &Setup,
    design: &Design,
    task: &Task,
    s: &Solution,
    tolerance: f64,
) -> Result<(), Open> {
    let Some(body) = design.shared.as_ref().and_then(|shared| shared.body.as_deref()) else {
        return Err(Open::Unsure);
    };
    let near = |place: f64| (s.arc - place).abs() <= CLOSE * task.a;
    let sure = s.error <= tolerance && (s.load - 1.0).abs() > EDGE;
    // A blunt tip has no slope: a contact that begins there has no normal.
    let blunt = setup.model.surface && body.power().is_some_and(|[_, _, n]| n < 1.0);
    if !sure || near(body.length) || blunt && task.a >= (1.0 - CLOSE) * body.length {
        return Err(Open::Unsure);
    }
    if s.load > 1.0 {
        return Err(Open::Ended(Status::MATERIAL_LIMIT));
    }
    if s.arc > body.length {
        // Beyond the tip of a power the diameter stays constant: the path may have ended before.
        if body.power().is_some() {
            return Err(Open::Unsure);
        }
        return Err(Open::Ended(Status::SLIPPED_OFF));
    }
    if setup.model.surface {
        let [begin, end] = body.piece(task.a);
        match () {
            () if near(begin) && begin > 0.0 || near(end) => return Err(Open::Unsure),
            () if !(begin..=end).contains(&s.arc) => return Err(Open::Ended(Status::AT_KNOT)),
            () => {}
        }
    }
    Ok(())
}
