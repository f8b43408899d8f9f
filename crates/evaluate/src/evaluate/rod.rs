//! Taps by the solver of every whisker: all that the kernel of cones does not solve.

use rayon::prelude::*;

use super::Outcome;
use super::gradient::{EACH, POINTS};
use super::outcome::{Asked, reading, sign};
use super::solve::{Question, Solved};
use crate::design::{Shared, radians};
use crate::kernel::Section;
use crate::physics::number::Number;
use crate::physics::pole::{self, Pole};
use crate::physics::real::Dual;
use crate::physics::solid::{Bonded, Held, Soft, is_solid};
use crate::scene::{Contact, Geometry, Grip, Setup};
use vibrissa_rod::{Effects, Rod, Skin, Solution, Tap, Tilt, slopes, solve};

/// True if the solver of every whisker, on the CPU, solves all taps of `setup`.
pub fn takes_all(setup: &Setup) -> bool {
    let solid = || {
        setup.model.contact == Contact::Frictionless && (is_solid(&setup.model) || setup.gauge.foil.is_some())
    };
    let one = setup.is_plain() && !setup.gauge.second;
    setup.model.geometry == Geometry::Exact && (!one || solid())
}

/// A tap as it is asked, and as the solver takes it.
type Framed<'a> = (Asked<'a>, Tap<'a>);

/// Taps with their whiskers.
pub(super) struct Rods<'a> {
    question: &'a Question<'a>,
    /// Places in the question.
    open: &'a [usize],
    /// The designs of these taps, ascending, and their whiskers.
    designs: Vec<u32>,
    rods: Vec<Option<Rod>>,
}

impl<'a> Rods<'a> {
    /// The whiskers of the taps at the places `open`.
    pub fn new(question: &'a Question<'a>, open: &'a [usize]) -> Self {
        let &Question { setup, designs: all, tasks, .. } = question;
        let mut designs: Vec<u32> = open.iter().map(|&i| tasks[i].design).collect();
        designs.sort_unstable();
        designs.dedup();
        let whisker = |&design: &u32| {
            let design = &all[design as usize];
            design.shared.as_ref().map(|shared| whisker(design.setup(setup), shared))
        };
        let rods = designs.par_iter().map(whisker).collect();
        Self { question, open, designs, rods }
    }

    /// The effects of all these taps.
    fn effects(&self) -> Effects {
        let setup = self.question.setup;
        let effects = Effects::of(&setup.model, setup.gauge.side, self.question.stick());
        Effects { wrench: setup.asks_wrench(), ..effects }
    }

    /// Their solutions; `section`: the law of the material, where it is not Hooke's.
    pub fn solve(&self, tolerance: f64, section: &Section) -> Vec<Solved> {
        let framed: Vec<_> = self.open.par_iter().map(|&i| self.framed(i)).collect();
        let taps: Vec<Tap<'_>> = framed.iter().flatten().map(|(_, tap)| *tap).collect();
        let section = if taps.is_empty() { None } else { section.chart() };
        let mut next = solve(&taps, self.effects(), tolerance, section).into_iter();
        let solved: Vec<_> = framed.into_iter().map(|tap| Some((tap?, next.next()?))).collect();
        let one = |(&i, solved): (&usize, &Option<(Framed<'_>, Solution)>)| {
            let grip = self.question.grips[i];
            let told = solved.as_ref().and_then(|(tap, s)| self.told(grip, tap, s));
            told.unwrap_or(Solved { grip, ..Solved::LOST })
        };
        self.open.par_iter().zip(&solved).map(one).collect()
    }

    /// Outcomes of taps in groups of [`EACH`], to the first order: a tap, and those next to it at [`POINTS`] of one of `steps`. `None` where the solver does
    /// not meet the tolerance. With the derivatives of P, T and the arc from where the rod begins, by the
    /// input over its scale. `laws`: those of nearby moduli, with their weights in the derivative.
    pub fn beside(
        &self,
        steps: &[f64],
        tolerance: f64,
        section: &Section,
        laws: &[(f64, Section)],
    ) -> Vec<Option<([Outcome; EACH], [f64; 3])>> {
        let framed: Vec<Option<Framed<'_>>> = self.open.par_iter().map(|&i| self.framed(i)).collect();
        let sum = |step: f64, weight: f64| {
            move |sum: Dual<1>, x: f64| match x == sum.value {
                true => sum,
                false => Dual { slope: [sum.slope[0] + weight / step * (x - sum.value)], ..sum },
            }
        };
        let group = |k: usize| -> Option<[Tap<'_>; EACH]> {
            let mut group = [framed[EACH * k]?.1; EACH];
            for (tap, framed) in group.iter_mut().zip(&framed[EACH * k..]) {
                *tap = (*framed)?.1;
            }
            Some(group)
        };
        let rod = |k: usize| {
            let group = group(k)?;
            if group.iter().all(|tap| std::ptr::eq(tap.rod, group[0].rod)) {
                return Some(group[0].rod.map(Dual::of));
            }
            group.iter().zip(POINTS).try_fold(group[0].rod.map(Dual::of), |rod, (tap, [_, weight])| {
                rod.with(tap.rod, sum(steps[k], weight))
            })
        };
        let rods: Vec<Option<Rod<Dual<1>>>> = (0..steps.len()).map(rod).collect();
        let tap = |k: usize| {
            let (group, rod) = (group(k)?, rods[k].as_ref()?);
            group.iter().zip(POINTS).try_fold(group[0].map(rod, Dual::of), |all, (tap, [_, weight])| {
                all.with(tap, rod, sum(steps[k], weight))
            })
        };
        let duals: Vec<Option<Tap<'_, Dual<1>>>> = (0..steps.len()).map(tap).collect();
        let taps: Vec<Tap<'_, Dual<1>>> = duals.iter().flatten().copied().collect();
        let chart = if taps.is_empty() { None } else { section.chart() };
        let charts: Option<Vec<_>> = laws.iter().map(|(weight, law)| Some((*weight, law.chart()?))).collect();
        let Some(laws) = charts else { return vec![None; steps.len()] };
        let mut solved = slopes(&taps, self.effects(), tolerance, chart, &laws).into_iter();
        let one = |(k, dual): (usize, &Option<Tap<'_, Dual<1>>>)| {
            let s = dual.and_then(|_| solved.next()).filter(|s| s.error.value <= tolerance)?;
            let mut out = [Outcome::NOTHING; EACH];
            let (own, _) = framed[EACH * k]?;
            let no_strain = own.unread(own.shared.start + s.arc.value);
            for (m, (out, [point, _])) in out.iter_mut().zip(POINTS).enumerate() {
                let i = EACH * k + m;
                let near = s.map(|x| x.value + point * steps[k] * x.slope[0]);
                let found = self.told(self.question.grips[i], &framed[i]?, &near)?.found;
                *out = framed[i]?.0.outcome_where(found, no_strain);
            }
            Some((out, [s.normal, s.tangential, s.arc].map(|x| x.slope[0])))
        };
        duals.iter().enumerate().map(one).collect()
    }

    /// The solution `s` of a tap held by `grip`; `None` outside the domain, where its plane of bending does not touch the pole, and where only the reference
    /// can roll the contact.
    fn told(&self, grip: Grip, (asked, tap): &Framed<'_>, s: &Solution) -> Option<Solved> {
        let Asked { setup, shared, task, linear, .. } = *asked;
        let effects = self.effects();
        // Only the reference can roll a contact along a skin whose slope changes.
        if effects.roll && tap.rod.turns(setup.model.surface) {
            return None;
        }
        let (mut azimuth, mut slide) = (0.0, 0.0);
        if let Some(Tilt { point, along, .. }) = tap.tilt {
            azimuth = pole::azimuth(along, s.turned + normal(setup, tap.rod))?;
            slide = pole::slide(point, along, azimuth);
        }
        // The moment is about the face of the clamp.
        let [moment, x, y] = s.wrench;
        let wrench = match setup.built.is_some() || setup.asks_wrench() {
            true => [moment + shared.start * y, x, y],
            false => [f64::NAN; 3],
        };
        let share = shared.foil.map_or(1.0, |foil| foil.transfer);
        let (axial, bending) = (share * s.axial, share * (s.strain - s.axial));
        let (sin, cos) = azimuth.sin_cos();
        let one = if azimuth == 0.0 { share * s.strain } else { axial + bending * cos };
        let strain = reading(setup, wrench, one);
        let mut found = Outcome {
            strain,
            strain_linear: linear,
            deviation: linear / strain - 1.0,
            normal_force: s.normal,
            tangential_force: s.tangential,
            arc: shared.start + s.arc,
            wrench,
            sticking: grip == Grip::Stick,
            ..Outcome::NOTHING
        };
        if task.is_spatial(setup) {
            let strain_2 = sign(setup) * (axial + bending * sin);
            found = Outcome { strain_2, azimuth, slide, axial: sign(setup) * axial, ..found };
        }
        Some(Solved {
            found,
            grip,
            moved: s.arc / tap.a - 1.0,
            error: s.error / self.question.share(linear, strain),
            load: s.load,
            astray: s.is_astray(),
            unsure: false,
            sweeps: s.sweeps,
        })
    }

    /// The tap at place `i` as the solver takes it; `None` outside the domain, and where only the reference can decide.
    fn framed(&self, i: usize) -> Option<Framed<'_>> {
        let asked = self.question.asked(i)?;
        let Asked { setup, shared, driven, task, .. } = asked;
        let (place, grip) = (self.designs.binary_search(&task.design).ok()?, self.question.grips[i]);
        let rod = self.rods[place].as_ref()?;
        let (model, hub) = (&setup.model, driven.if_turned(shared.model.hub + shared.start));
        let (mut a, [mut turn, mut lift]) = (task.a - shared.start, driven.turn_and_lift());
        let mut tilt = None;
        // A contact that sticks on an edge stays in the plane of rotation. One that would roll along the pole too, or slide with friction, is not modelled.
        // Taps next to an upright one may be tilted: they have one form.
        let upright = task.direction.is_upright() && !(self.question.beyond && setup.gauge.second);
        if !(upright || grip == Grip::Stick && model.pole_radius == 0.0) {
            if grip != Grip::Slide(0.0) || model.indentation || setup.built.is_some() {
                return None;
            }
            let taper = shared.taper.from(shared.start);
            let pole = Pole::new(&taper, model, radians(task.direction), (a, hub, driven));
            let azimuth = pole::azimuth(pole.along, normal(setup, rod))?;
            let planar = pole.planar(azimuth)?;
            (a, turn, lift) = (planar.distance, planar.angle, 0.0);
            tilt = Some(Tilt { point: pole.point, along: pole.along, azimuth });
        }
        let tap = Tap {
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
            least: if shared.model.reads_strain() { 1e-3 * driven.size() * shared.peak } else { 1.0 },
        };
        Some((asked, tap))
    }
}

/// The rod of `shared`, which begins where its clamp ends.
fn whisker(setup: &Setup, shared: &Shared) -> Rod {
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

/// Angle of the contact's normal against the whisker's, rad.
fn normal(setup: &Setup, rod: &Rod) -> f64 {
    if setup.model.surface { -rod.pieces[0].radius[1].atan() } else { 0.0 }
}
