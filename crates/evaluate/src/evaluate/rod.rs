//! Taps by the solver of every whisker: built whiskers (model §7) and solids (model §8).

use rayon::prelude::*;

use super::outcome::{Asked, Found, reading};
use super::solve::ROUGH;
use super::{Evaluator, Method, Outcome, Outcomes, Task, referred};
use crate::design::{Design, Shared};
use crate::error::SolveError;
use crate::kernel::rule::limits::EDGE;
use crate::physics::onset::Grip;
use crate::physics::solid::{Bonded, Held, Soft, is_solid};
use crate::scene::{Contact, Drive, Geometry, Material, Precision, Setup, Side};
use crate::status::Status;
use vibrissa_built::{Tap, solve_on};
use vibrissa_rod::{Effects, Rod, Skin, Solution};

/// Distance, over a, from a corner or the tip within which the kernel cannot decide the contact's side.
const CLOSE: f64 = 1e-6;

enum Open {
    /// The reference must decide.
    Unsure,
    Ended(Status),
}

type Known = Option<Result<Solution, Open>>;

pub(super) fn asked(setup: &Setup) -> bool {
    let solid = || {
        setup.model.contact == Contact::Frictionless && (is_solid(&setup.model) || setup.gauge.foil.is_some())
    };
    setup.model.geometry == Geometry::Exact && (setup.built.is_some() || solid())
}

/// The rod of `shared`, which begins where its clamp ends.
fn rod(setup: &Setup, shared: &Shared) -> Rod {
    let start = shared.start;
    let foil = shared.foil.map(|foil| Bonded { span: foil.span.map(|x| x - start), ..foil });
    match shared.body.as_deref().filter(|_| setup.built.is_some()) {
        Some(body) => Rod::built(body, shared.gauge, foil.as_ref()),
        None => {
            let model = &setup.model;
            let gauge = shared.gauge.map(|x| x - start);
            Rod::cone(&shared.taper.from(start), [model.material.e0(), model.nu], gauge, foil.as_ref())
        }
    }
}

impl Evaluator<'_> {
    /// Outcomes of `tasks`, tilted ones by the reference; contacts of `grip`, or as the model says; `expected`: the answers of the reference, if known.
    pub(super) fn rods(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: Option<Grip>,
        expected: Option<&[Outcome]>,
    ) -> Outcomes {
        let (setup, tolerance) = (self.setup, self.tolerance());
        let (samples, leaves) = (self.samples, self.leaves);
        let rods: Vec<Option<Rod>> = designs
            .par_iter()
            .map(|design| design.shared.as_ref().map(|shared| rod(design.setup(setup), shared)))
            .collect();
        let first = match (grip, setup.model.contact) {
            (Some(grip), _) => grip,
            (None, Contact::Frictionless | Contact::Coulomb(0.0)) => Grip::Slide(0.0),
            (None, _) => Grip::Stick,
        };
        let mut held = vec![first; tasks.len()];
        let mut solved = self.solve_rods((designs, &rods), tasks, &held)?;
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
            let again = self.solve_rods((designs, &rods), &those, &grips)?;
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
        solved.iter().flatten().for_each(|s| self.sweeps.push(s.sweeps));
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
                    let Asked { setup, shared, .. } = asked;
                    // The moment is about the face of the clamp.
                    let [moment, x, y] = s.wrench;
                    let wrench = match setup.built.is_some() || setup.asks_wrench() {
                        true => [moment + shared.start * y, x, y],
                        false => [f64::NAN; 3],
                    };
                    let share = shared.foil.map_or(1.0, |foil| foil.transfer);
                    let strain = reading(setup, wrench, share * s.strain);
                    let found = Found {
                        strain,
                        deviation: asked.linear / strain - 1.0,
                        beside: None,
                        wrench,
                        normal: s.normal,
                        tangential: s.tangential,
                        arc: shared.start + s.arc,
                        sticking: *grip == Grip::Stick,
                    };
                    Outcome { sweeps: s.sweeps as f32, ..asked.outcome(found) }
                }
                Some(Err(Open::Ended(why))) => asked.unsolved(*why),
                None => Outcome {
                    referred: false,
                    ..referred(stop, expected.map(|known| &known[i]), (setup, design, task))
                },
                _ if leaves && setup.built.is_none() && task.is_far(design) => {
                    Outcome { status: Status::NOT_CONVERGED, ..Outcome::NOTHING }
                }
                _ if samples && matches!(grip, Grip::Slide(_)) => asked.unsolved(Status::NOT_CONVERGED),
                _ => referred(stop, expected.map(|known| &known[i]), (setup, design, task)),
            }
        };
        Ok(tasks.par_iter().zip(&known).zip(&held).enumerate().map(finish).collect())
    }

    fn solve_rods(
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
        let roll = stick && model.pole_radius > 0.0;
        let effects = Effects {
            shear: model.shear,
            extension: model.extension,
            surface: model.surface,
            stick,
            roll,
            law: !matches!(model.material, Material::Hooke(_)),
            far: setup.gauge.side == Side::Far,
            soft: is_solid(model) && model.contact == Contact::Frictionless,
            distorting: model.distorting,
            ..Effects::default()
        };
        let tap = |(task, grip): (&Task, &Grip)| {
            let Asked { setup, shared, amount, .. } = upright(setup, designs, task)?;
            let model = &setup.model;
            let (turn, lift) = match setup.drive {
                Drive::Angle => (amount, 0.0),
                Drive::Displacement => (0.0, amount),
            };
            let held = Held::new(model);
            let soft = Soft::new(model, &shared.taper, task.a).map_or([0.0; 2], |soft| soft.parts());
            let skin = model.distorting.then(|| Skin::new(model, &shared.taper, shared.start));
            let angle = setup.drive == Drive::Angle;
            let tap = vibrissa_rod::Tap {
                rod: rods[task.design as usize].as_ref()?,
                a: task.a - shared.start,
                hub: if angle { shared.model.hub + shared.start } else { 0.0 },
                turn,
                lift,
                ratio: if let Grip::Slide(friction) = grip { *friction } else { 0.0 },
                pole: model.pole_radius,
                softer: 1.0 / held.shear,
                soft,
                skin,
                least: if shared.model.reads_strain() { 1e-3 * amount * shared.peak } else { 1.0 },
            };
            Some(Tap { tap, force: amount * shared.model.force(model.material.e0(), task.a) })
        };
        let framed: Vec<Option<Tap<'_>>> = tasks.par_iter().zip(grips).map(tap).collect();
        let taps: Vec<Tap<'_>> = framed.iter().flatten().copied().collect();
        let chart = rungs.iter().rev().find_map(|rung| rung.chart());
        let precision = rungs.first().map_or(Precision::F64, |rung| rung.precision());
        let solved = solve_on(solver.as_mut(), &taps, effects, (precision, *tolerance), chart)?;
        // Only the reference can roll a contact along a skin whose slope changes.
        let left = |tap: &Tap<'_>| roll && tap.tap.rod.turns(model.surface);
        let mut solved = taps.iter().zip(solved).map(|(tap, s)| if left(tap) { Solution::FAILED } else { s });
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
    let body = design.shared.as_ref().and_then(|shared| shared.body.as_deref());
    let near = |place: f64| (s.arc - place).abs() <= CLOSE * task.a;
    if !(s.error <= tolerance && (s.load - 1.0).abs() > EDGE) {
        return Err(Open::Unsure);
    }
    if s.load > 1.0 {
        return Err(Open::Ended(Status::MATERIAL_LIMIT));
    }
    let Some(body) = body.filter(|_| setup.built.is_some()) else { return Ok(()) };
    // A blunt tip has no slope: a contact that begins there has no normal.
    let blunt = setup.model.surface && body.power().is_some_and(|[_, _, n]| n < 1.0);
    if near(body.length) || blunt && task.a >= (1.0 - CLOSE) * body.length {
        return Err(Open::Unsure);
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
