//! Taps by the solver of every whisker: all that the kernel of cones does not solve.

use rayon::prelude::*;

use super::Outcome;
use super::gradient::{EACH, OUTPUTS, POINTS, numbers};
use super::outcome::{Asked, reading, sign};
use super::solve::{Question, Solved};
use crate::design::{Shared, radians};
use crate::kernel::Section;
use crate::physics::number::Number;
use crate::physics::pole::{self, Pole};
use crate::physics::real::Dual;
use crate::physics::solid::{Bonded, Held, Soft, is_solid};
use crate::scene::{Contact, Geometry, Grip, Setup};
use vibrissa_rod::{Effects, Rod, SLOPES, Skin, Solution, Tap, Tilt, slopes, solve};

/// True if the solver of every whisker, on the CPU, solves all taps of `setup`.
pub fn takes_all(setup: &Setup) -> bool {
    let solid = || {
        setup.model.contact == Contact::Frictionless && (is_solid(&setup.model) || setup.gauge.foil.is_some())
    };
    let one = setup.is_plain() && !setup.gauge.second;
    setup.model.geometry == Geometry::Exact && (!one || solid())
}

/// Taps with their whiskers.
pub(super) struct Rods<'a> {
    question: &'a Question<'a>,
    /// Places in the question.
    open: &'a [usize],
    /// The designs of these taps, ascending, and their whiskers.
    designs: Vec<u32>,
    rods: Vec<Option<Rod>>,
}

/// A tap at a place of the question, and as the solver takes it.
struct Framed<'a> {
    place: usize,
    asked: Asked<'a>,
    tap: Tap<'a>,
}

/// A number with its derivatives by the inputs of a group over their scales.
type Slopes = Dual<SLOPES>;

/// Numbers of a tap that have derivatives, and those by the inputs of its group over their scales.
pub(super) type Near = ([f64; OUTPUTS], [[f64; OUTPUTS]; SLOPES]);

/// A tap next to one, the place of the input that differs, and its weight in the derivative.
type Beside<'a> = (&'a Tap<'a>, usize, f64);

/// The first tap of `group` and those next to it; `None` if these have other parts.
fn next<'a>(group: &'a [Framed<'a>], steps: &[f64]) -> Option<(&'a Tap<'a>, Vec<Beside<'a>>)> {
    let weights = steps.iter().enumerate().flat_map(|(k, step)| POINTS.map(|[_, weight]| (k, weight / step)));
    let next = group[1..].iter().zip(weights).map(|(framed, (k, weight))| (&framed.tap, k, weight));
    let here = &group[0].tap;
    let alike = |one: Beside<'a>| (here.is_like(one.0) && here.rod.is_like(one.0.rod)).then_some(one);
    Some((here, next.map(alike).collect::<Option<_>>()?))
}

/// The number `x` with its derivatives, from those of taps next to it with the places of their inputs and their weights.
fn sloped(x: f64, next: impl Iterator<Item = (f64, usize, f64)>) -> Slopes {
    let mut sum = Slopes::of(x);
    for (y, k, weight) in next.filter(|(y, ..)| *y != x) {
        sum.slope[k] += weight * (y - x);
    }
    sum
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
        let framed: Vec<Option<Framed<'_>>> = self.open.par_iter().map(|&i| self.framed(i)).collect();
        let taps: Vec<Tap<'_>> = framed.iter().flatten().map(|framed| framed.tap).collect();
        let charts = if taps.is_empty() { Vec::new() } else { section.charts() };
        let mut next = solve(&taps, self.effects(), tolerance, &charts).into_iter();
        let solved: Vec<_> = framed.into_iter().map(|one| Some((one?, next.next()?))).collect();
        let one = |(&i, solved): (&usize, &Option<(Framed<'_>, Solution)>)| {
            let lost = Solved { grip: self.question.grips[i], ..Solved::LOST };
            solved.as_ref().and_then(|(framed, s)| self.told(framed, s)).unwrap_or(lost)
        };
        self.open.par_iter().zip(&solved).map(one).collect()
    }

    /// Values and derivatives of the taps of groups: a tap, then those next to it, at [`POINTS`] of each of the `steps` of its group. `None` where the
    /// solver does not meet the tolerance. `laws`: those of nearby moduli, with their weights in the derivative.
    pub fn beside(
        &self,
        steps: &[Vec<f64>],
        tolerance: f64,
        section: &Section,
        laws: &[(f64, Section)],
    ) -> Vec<Option<Near>> {
        let mut first = 0;
        let frame = |steps: &Vec<f64>| {
            let places = first..first + 1 + EACH * steps.len();
            first = places.end;
            places.map(|i| self.framed(i)).collect()
        };
        let groups: Vec<Option<Vec<Framed<'_>>>> = steps.iter().map(frame).collect();
        let near: Vec<_> =
            groups.iter().zip(steps).map(|(group, steps)| next(group.as_deref()?, steps)).collect();
        let rods = near.iter().map(|near| {
            let (here, next) = near.as_ref()?;
            let others = || next.iter().filter(|(tap, ..)| !std::ptr::eq(tap.rod, here.rod));
            let made = |get: &dyn Fn(&Rod) -> f64| {
                sloped(get(here.rod), others().map(|&(tap, k, w)| (get(tap.rod), k, w)))
            };
            Some(here.rod.made(made))
        });
        let rods: Vec<Option<Rod<Slopes>>> = rods.collect();
        let duals = near.iter().zip(&rods).map(|(near, rod)| {
            let ((here, next), rod) = (near.as_ref()?, rod.as_ref()?);
            Some(here.made(rod, |get| sloped(get(here), next.iter().map(|&(tap, k, w)| (get(tap), k, w)))))
        });
        let duals: Vec<Option<Tap<'_, Slopes>>> = duals.collect();
        let taps: Vec<Tap<'_, Slopes>> = duals.iter().flatten().copied().collect();
        let charts = if taps.is_empty() { Vec::new() } else { section.charts() };
        let laws: Vec<_> = laws.iter().map(|(weight, law)| (*weight, law.charts())).collect();
        if laws.iter().any(|(_, law)| law.len() != charts.len()) {
            return vec![None; steps.len()];
        }
        let mut solved = slopes(&taps, self.effects(), tolerance, &charts, &laws).into_iter();
        let one = |((group, steps), dual): ((&Option<Vec<Framed<'_>>>, &Vec<f64>), &Option<_>)| {
            let s = dual.as_ref().and_then(|_| solved.next()).filter(|s| s.error.value <= tolerance)?;
            self.near(group.as_deref()?, steps, &s)
        };
        groups.iter().zip(steps).zip(&duals).map(one).collect()
    }

    /// The numbers of the first tap of `group`, solved by `s`, and their derivatives.
    fn near(&self, group: &[Framed<'_>], steps: &[f64], s: &Solution<Slopes>) -> Option<Near> {
        let own = &group[0].asked;
        let no_strain = own.unread(own.shared.start + s.arc.value);
        let told = |framed: &Framed<'_>, s: &Solution| {
            let found = self.told(framed, s)?.found;
            Some(numbers(&framed.asked.outcome_where(found, no_strain)))
        };
        let mut slopes = [[0.0; OUTPUTS]; SLOPES];
        for (k, (step, next)) in steps.iter().zip(group[1..].chunks(EACH)).enumerate() {
            let (slope, mut start) = (&mut slopes[k], 0.0);
            for (framed, [point, weight]) in next.iter().zip(POINTS) {
                let all = told(framed, &s.map(|x| x.value + point * step * x.slope[k]))?;
                slope.iter_mut().zip(all).for_each(|(slope, x)| *slope += weight / step * x);
                start += weight / step * framed.asked.shared.start;
            }
            [slope[3], slope[4]] = [s.normal, s.tangential].map(|x| x.slope[k]);
            slope[5] = s.arc.slope[k] + start;
        }
        Some((told(&group[0], &s.map(|x| x.value))?, slopes))
    }

    /// The solution `s` of a tap; `None` outside the domain, where its plane of bending does not touch the pole, and where only the reference
    /// can roll the contact.
    fn told(&self, Framed { place, asked, tap }: &Framed<'_>, s: &Solution) -> Option<Solved> {
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
        let grip = self.question.grips[*place];
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
        Some(Framed { place: i, asked, tap })
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
