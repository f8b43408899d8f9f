//! Taps by the solver of every whisker: all but those of an upright pole whose strain one gauge reads on a cone clamped at its base.

use rayon::prelude::*;

use super::outcome::{Asked, reading, sign};
use super::solve::ROUGH;
use super::{Evaluator, Method, Outcome, Outcomes, Task, referred};
use crate::design::{Design, Shared, radians};
use crate::error::SolveError;
use crate::kernel::Rung;
use crate::kernel::rule::limits::EDGE;
use crate::physics::onset::Grip;
use crate::physics::pole::Pole;
use crate::physics::solid::{Bonded, Held, Soft, is_solid};
use crate::scene::{Contact, Drive, Geometry, Setup};
use crate::status::Status;
use vibrissa_rod::{Effects, Rod, Skin, Solution, Tap, Tilt};

/// Distance, over a, from a corner or the tip within which it is not decided on which side the contact is.
const CLOSE: f64 = 1e-6;

enum Open {
    /// The reference must decide.
    Unsure,
    Ended(Status),
}

/// A solution with the azimuth φ of its plane of bending, rad, and the slide λ along the pole, mm.
type Solved = (Solution, [f64; 2]);

/// The solver of every whisker solves all taps of `setup`.
pub(super) fn asked(setup: &Setup) -> bool {
    let solid = || {
        setup.model.contact == Contact::Frictionless && (is_solid(&setup.model) || setup.gauge.foil.is_some())
    };
    let one = setup.is_plain() && !setup.gauge.second;
    setup.model.geometry == Geometry::Exact && (!one || solid())
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
    /// Outcomes of `tasks`; contacts of `grip`, or as the model says; `expected`: the answers of the reference, if known.
    pub(super) fn rods(
        &mut self,
        designs: &[Design],
        tasks: &[Task],
        grip: Option<Grip>,
        expected: Option<&[Outcome]>,
    ) -> Outcomes {
        let (setup, tolerance) = (self.setup, self.tolerance());
        let (samples, leaves) = (self.samples, self.leaves);
        let mut named = vec![false; designs.len()];
        tasks.iter().for_each(|task| named[task.design as usize] = true);
        let rod = |(design, named): (&Design, bool)| {
            design.shared.as_ref().filter(|_| named).map(|shared| rod(design.setup(setup), shared))
        };
        let rods: Vec<Option<Rod>> = designs.par_iter().zip(named).map(rod).collect();
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
                .filter(|&i| is_plain(&solved[i].0, mu, tolerance) && slides(&solved[i].0))
                .collect();
            for &i in &sliding {
                held[i] = Grip::Slide(mu.copysign(solved[i].0.tangential));
            }
            let those: Vec<Task> = sliding.iter().map(|&i| tasks[i]).collect();
            let grips: Vec<Grip> = sliding.iter().map(|&i| held[i]).collect();
            let again = self.solve_rods((designs, &rods), &those, &grips)?;
            for (&i, (new, plane)) in sliding.iter().zip(again) {
                let sweeps = solved[i].0.sweeps + new.sweeps;
                solved[i] = (Solution { sweeps, ..new }, plane);
            }
            // Sticking must be certain, or the reference decides.
            for ((s, _), grip) in solved.iter_mut().zip(&held) {
                if *grip == Grip::Stick && !is_plain(s, mu, tolerance) {
                    *s = Solution { sweeps: s.sweeps, ..Solution::FAILED };
                }
            }
        }
        solved.iter().filter(|(s, _)| s.sweeps > 0.0).for_each(|(s, _)| self.sweeps.push(s.sweeps));
        let open = |(task, solved): (&Task, &Solved)| {
            check_answer(setup, &designs[task.design as usize], task, &solved.0, tolerance).map(|()| *solved)
        };
        let known: Vec<Result<Solved, Open>> = tasks.par_iter().zip(&solved).map(open).collect();
        let whole = match &self.method {
            Method::Fast { rungs, .. } => rungs.last().and_then(Rung::chart).is_none_or(|chart| chart.whole),
            Method::Reference => true,
        };
        // The status of a tap that the solver leaves open; None where the reference solves it.
        let without = |i: usize| {
            let task = &tasks[i];
            let far = leaves && setup.built.is_none() && task.is_far(&designs[task.design as usize]);
            match () {
                () if grip.is_some() => Some(Status::NOT_CONVERGED),
                () if far && solved[i].0.is_astray() => Some(Status::NOT_CONVERGED),
                () if samples && whole && held[i] == Grip::Slide(0.0) => Some(Status::NOT_CONVERGED),
                () => None,
            }
        };
        if self.spare < usize::MAX {
            let left = |i: &usize| {
                matches!(known[*i], Err(Open::Unsure))
                    && without(*i).is_none()
                    && Asked::new(setup, &designs[tasks[*i].design as usize], &tasks[*i]).is_some()
            };
            let left = (0..tasks.len()).filter(left).count();
            self.spare = self.spare.checked_sub(left).ok_or(SolveError::TooHard)?;
        }
        let stop = self.stop;
        let finish = |i: usize| {
            let task = &tasks[i];
            let design = &designs[task.design as usize];
            let Some(asked) = Asked::new(setup, design, task) else { return Outcome::OUTSIDE };
            match &known[i] {
                Ok((s, [azimuth, slide])) => {
                    let Asked { setup, shared, .. } = asked;
                    // The moment is about the face of the clamp.
                    let [moment, x, y] = s.wrench;
                    let wrench = match setup.built.is_some() || setup.asks_wrench() {
                        true => [moment + shared.start * y, x, y],
                        false => [f64::NAN; 3],
                    };
                    let share = shared.foil.map_or(1.0, |foil| foil.transfer);
                    let (axial, bending) = (share * s.axial, share * (s.strain - s.axial));
                    let (sin, cos) = azimuth.sin_cos();
                    let one = if *azimuth == 0.0 { share * s.strain } else { axial + bending * cos };
                    let strain = reading(setup, wrench, one);
                    let upright = Outcome {
                        strain,
                        deviation: asked.linear / strain - 1.0,
                        normal_force: s.normal,
                        tangential_force: s.tangential,
                        arc: shared.start + s.arc,
                        wrench,
                        sticking: held[i] == Grip::Stick,
                        ..Outcome::NOTHING
                    };
                    let spatial = || Outcome {
                        strain_2: sign(setup) * (axial + bending * sin),
                        azimuth: *azimuth,
                        slide: *slide,
                        axial: sign(setup) * axial,
                        ..upright
                    };
                    let found = if task.is_spatial(setup) { spatial() } else { upright };
                    Outcome { sweeps: s.sweeps as f32, ..asked.outcome(found) }
                }
                Err(Open::Ended(why)) => asked.unsolved(*why),
                Err(Open::Unsure) => match without(i) {
                    Some(why) => asked.unsolved(why),
                    None => {
                        // The solver has no tilted poles of built whiskers: the reference is their only solver.
                        let own = setup.built.is_some() && !task.direction.is_upright();
                        let known = expected.map(|known| &known[i]);
                        Outcome { referred: !own, ..referred(stop, known, (setup, design, task)) }
                    }
                },
            }
        };
        Ok((0..tasks.len()).into_par_iter().map(finish).collect())
    }

    fn solve_rods(
        &mut self,
        (designs, rods): (&[Design], &[Option<Rod>]),
        tasks: &[Task],
        grips: &[Grip],
    ) -> Result<Vec<Solved>, SolveError> {
        let setup = self.setup;
        let lost = (Solution::FAILED, [0.0; 2]);
        let Method::Fast { rungs, tolerance, .. } = &self.method else {
            return Ok(vec![lost; tasks.len()]);
        };
        let model = &setup.model;
        let effects = Effects::of(model, setup.gauge.side, grips.first() == Some(&Grip::Stick));
        let effects = Effects { wrench: setup.asks_wrench(), ..effects };
        let tap = |(task, grip): (&Task, &Grip)| {
            let design = &designs[task.design as usize];
            framed(&Asked::new(setup, design, task)?, rods[task.design as usize].as_ref()?, *grip)
        };
        let framed: Vec<Option<Tap<'_>>> = tasks.par_iter().zip(grips).map(tap).collect();
        let taps: Vec<Tap<'_>> = framed.iter().flatten().copied().collect();
        if taps.is_empty() {
            return Ok(vec![lost; tasks.len()]);
        }
        let chart = rungs.last().and_then(Rung::chart);
        let solved = vibrissa_rod::solve(&taps, effects, *tolerance, chart);
        // Only the reference can roll a contact along a skin whose slope changes.
        let left = |tap: &Tap<'_>| effects.roll && tap.rod.turns(model.surface);
        let told = |(tap, s): (&Tap<'_>, Solution)| {
            let Some(Tilt { pole, .. }) = tap.tilt.filter(|_| !left(tap)) else {
                return if left(tap) { lost } else { (s, [0.0; 2]) };
            };
            let alpha = pole.azimuth(s.turned + normal(setup, tap.rod));
            alpha.map_or(lost, |azimuth| (s, [azimuth, pole.slide(azimuth)]))
        };
        let mut solved = taps.iter().zip(solved).map(told);
        Ok(framed.iter().map(|tap| tap.and_then(|_| solved.next()).unwrap_or(lost)).collect())
    }
}

/// Angle of the contact's normal against the whisker's, rad.
fn normal(setup: &Setup, rod: &Rod) -> f64 {
    if setup.model.surface { -rod.pieces[0].radius[1].atan() } else { 0.0 }
}

/// The tap as the solver takes it; `None` where only the reference can decide.
fn framed<'a>(asked: &Asked<'_>, rod: &'a Rod, grip: Grip) -> Option<Tap<'a>> {
    let Asked { setup, shared, amount, task, .. } = *asked;
    let (model, angle) = (&setup.model, setup.drive == Drive::Angle);
    let hub = if angle { shared.model.hub + shared.start } else { 0.0 };
    let (mut a, mut turn, mut lift) = (task.a - shared.start, 0.0, amount);
    if angle {
        (turn, lift) = (amount, 0.0);
    }
    let mut tilt = None;
    // A contact that sticks on an edge stays in the plane of rotation. One that would roll along the pole too, or slide with friction, is not modelled.
    if !(task.direction.is_upright() || grip == Grip::Stick && model.pole_radius == 0.0) {
        if grip != Grip::Slide(0.0) || model.indentation || setup.built.is_some() {
            return None;
        }
        let (taper, drive) = (shared.taper.from(shared.start), (setup.drive, hub));
        let pole = Pole::new(&taper, model, drive, radians(task.direction), (a, amount));
        let azimuth = pole.azimuth(normal(setup, rod))?;
        let planar = pole.planar(azimuth)?;
        (a, turn, lift) = (planar.distance, planar.angle, 0.0);
        tilt = Some(Tilt { pole, azimuth });
    }
    Some(Tap {
        rod,
        a,
        hub,
        turn,
        lift,
        ratio: if let Grip::Slide(friction) = grip { friction } else { 0.0 },
        pole: model.pole_radius,
        softer: 1.0 / Held::new(model).shear,
        soft: Soft::new(model, &shared.taper, task.a).map_or([0.0; 2], |soft| soft.parts()),
        skin: model.distorting.then(|| Skin::new(model, &shared.taper, shared.start)),
        tilt,
        least: if shared.model.reads_strain() { 1e-3 * amount * shared.peak } else { 1.0 },
    })
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
