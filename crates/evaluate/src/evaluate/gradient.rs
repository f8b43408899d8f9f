//! Derivatives of outcomes by the inputs of taps: the solver of every whisker takes dual numbers. What leads from an input to the solver's numbers, and
//! from its solution to an outcome, are closed forms: their derivatives are differences of four taps.

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use super::input::Input;
use super::outcome::{Asked, by_reference, sign};
use super::rod::{Near, Rods};
use super::solve::Question;
use super::{Outcome, Task, closed_gradient, is_closed};
use crate::design::Design;
use crate::kernel::{Ladder, Section};
use crate::scene::{Contact, Geometry, Grip, Precision, Property, Setup, Tuple};
use vibrissa_rod::SLOPES;

/// Outputs with derivatives: strain, strain of linear theory, K − 1, P, T, arc, strain of the second gauge, azimuth (rad) and slide.
pub const OUTPUTS: usize = 9;

/// Step of closed forms and laws over the scale of an input: the fifth derivative and rounding show as some 1e-11 of the first.
const STEP: f64 = 1e-3;

/// Places of the taps next to one, in steps, and their weights in the derivative.
pub(super) const POINTS: [[f64; 2]; EACH] =
    [[2.0, -1.0 / 12.0], [1.0, 8.0 / 12.0], [-1.0, -8.0 / 12.0], [-2.0, 1.0 / 12.0]];
/// Number of these.
pub(super) const EACH: usize = 4;

/// Largest share of the step per distance, over a, at which linear theory has a kink: of the contact or of an end of the gauge from the other, or from a
/// knot of the profile. And its least share: rounding then shows more than the kink.
const ROOM: f64 = 400.0;
const LEAST: f64 = 1e-4;

/// Largest error of the taps, relative to their strain. At 1e-8 the derivatives by inputs of little effect have errors of 4e-8.
const TOLERANCE: f64 = 1e-9;

/// Taps of a thread.
const FEW: usize = 32;

/// Derivatives by `inputs` of taps of `setup`, whose designs have no rigs of other kinds.
pub struct Gradient<'a> {
    setup: &'a Setup,
    inputs: &'a [Input],
    /// The section law.
    section: Section,
    /// For each input that is a modulus of a hyperelastic law: the laws of nearby moduli, with their weights in the derivative by the input over its scale.
    laws: Vec<Vec<(f64, Section)>>,
}

/// An input of a tap, its scale, and the step over that.
struct Moved {
    tap: usize,
    input: usize,
    scale: f64,
    step: f64,
}

/// Inputs of one tap whose derivatives are found together, as places in a list of [`Moved`].
type Group = Range<usize>;

/// Places of the tasks of the group at `place`: its tap, then [`EACH`] next to it for each input.
fn tasks_of(place: usize, group: &Group) -> Range<usize> {
    place + EACH * group.start..place + 1 + EACH * group.end
}

/// The section law of `setup` for [`Gradient`], charted on first use.
pub fn section(setup: &Setup) -> Section {
    Ladder::new(Precision::F64, &setup.model.material, TOLERANCE).section
}

fn tuple(design: &Design, task: &Task) -> Tuple {
    let Task { a, drive, direction, .. } = *task;
    Tuple { a, drive, tilt: direction.tilt, lean: direction.lean, ..design.tuple }
}

/// The numbers of `o` that have derivatives.
pub(super) fn numbers(o: &Outcome) -> [f64; OUTPUTS] {
    let [pressed, rubbed] = [o.normal_force, o.tangential_force];
    [o.strain, o.strain_linear, o.deviation, pressed, rubbed, o.arc, o.strain_2, o.azimuth, o.slide]
}

impl<'a> Gradient<'a> {
    /// By `inputs`; `law` is [`section`] of `setup`.
    pub fn new(setup: &'a Setup, inputs: &'a [Input], law: &Section) -> Self {
        let laws = |input: &Input| {
            let scale = input.scale(setup, &Tuple::default(), 1.0);
            let at = |[point, weight]: &[f64; 2]| {
                Some((weight / STEP, section(&input.moved(setup, point * STEP * scale)?)))
            };
            let hyperelastic = matches!(input, Input::Modulus(_));
            if hyperelastic { POINTS.iter().filter_map(at).collect() } else { Vec::new() }
        };
        Self { setup, inputs, section: law.clone(), laws: inputs.iter().map(laws).collect() }
    }

    /// Writes to `slopes` the derivatives of `wanted` of [`OUTPUTS`], ordered by tap, then number, then input; per mm, degree, or unit of the key. NaN
    /// where the number has no value. At a kink (a contact about to slide or to leave the gauge) they are those of the tap's side.
    pub fn write(
        &self,
        (designs, tasks, outcomes): (&[Design], &[Task], &[Outcome]),
        wanted: &[usize],
        slopes: &mut [f64],
    ) {
        let (count, width) = (self.inputs.len(), wanted.len() * self.inputs.len());
        if width == 0 {
            return;
        }
        let parts = slopes.par_chunks_mut(FEW * width).zip(tasks.par_chunks(FEW));
        parts.zip(outcomes.par_chunks(FEW)).for_each(|((slopes, tasks), outcomes)| {
            slopes.fill(f64::NAN);
            let own = tasks.iter().map(|task| designs[task.design as usize].clone()).collect();
            for (Moved { tap, input, .. }, found) in self.few(own, tasks, outcomes) {
                let here = numbers(&outcomes[tap]);
                for (row, &number) in wanted.iter().enumerate().filter(|(_, number)| !here[**number].is_nan())
                {
                    slopes[tap * width + row * count + input] = found[number];
                }
            }
            // Strains that have a closed form have its derivatives, to the bit.
            let strain = wanted.iter().position(|number| *number == 0).filter(|_| is_closed(self.setup));
            let Some(row) = strain else { return };
            for (slopes, task) in slopes.chunks_mut(width).zip(tasks) {
                let tap = tuple(&designs[task.design as usize], task);
                let mut own = vec![0.0; count];
                if closed_gradient(self.setup, &tap, self.inputs, &mut own).is_some() {
                    slopes[row * count..][..count].copy_from_slice(&own);
                }
            }
        });
    }

    /// The derivatives of some taps; design i is that of tap i.
    fn few(
        &self,
        mut designs: Vec<Design>,
        tasks: &[Task],
        outcomes: &[Outcome],
    ) -> Vec<(Moved, [f64; OUTPUTS])> {
        let (mut out, mut moved) = (Vec::new(), Vec::new());
        for (tap, (task, here)) in tasks.iter().zip(outcomes).enumerate() {
            if here.strain_linear.is_nan() {
                continue;
            }
            let setup = designs[tap].setup(self.setup);
            let Some(shared) = &designs[tap].shared else { continue };
            let [x1, x2] = shared.gauge;
            let knots = shared.body.iter().flat_map(|body| body.knots()).copied();
            let kinks = knots.flat_map(|knot| [task.a - knot, x1 - knot, x2 - knot]).chain([task.a - x2]);
            let far = kinks.map(|kink| kink.abs() / task.a).fold(1.0, f64::min);
            let near = far.min((task.a - x1).abs() / task.a);
            for (input, by) in self.inputs.iter().enumerate() {
                let scale = by.scale(setup, &tuple(&designs[tap], task), task.a);
                let room = match by {
                    Input::Tuple(3 | 5) => near,
                    // These move no contact over the near end of the gauge.
                    Input::Tuple(..=4) | Input::Clamp | Input::FoilLength => far,
                    Input::Property(Property::Scale) => far,
                    _ => 1.0,
                };
                let step = STEP * (ROOM * room).clamp(LEAST, 1.0);
                let one = Moved { tap, input, scale, step };
                // Such taps are even in tilt and lean.
                let tilts = matches!(by, Input::Tuple(6 | 7));
                match tilts && task.direction.is_upright() && !setup.gauge.second {
                    true => out.push((one, [0.0; OUTPUTS])),
                    false => moved.push(one),
                }
            }
        }
        let groups = self.groups(&moved);
        let mut those = Vec::with_capacity((1 + EACH) * moved.len());
        for group in &groups {
            let tap = moved[group.start].tap;
            those.push(Task { design: tap as u32, ..tasks[tap] });
            for by in &moved[group.clone()] {
                for [point, _] in &POINTS {
                    let (other, task) =
                        self.moved(&designs[tap], &tasks[tap], by, point * by.step * by.scale);
                    let place = if other.is_some() { designs.len() } else { tap };
                    designs.extend(other);
                    those.push(Task { design: place as u32, ..task });
                }
            }
        }
        let found = self.solved(&designs, &those, (&moved, &groups), outcomes);
        let mut moved = moved.into_iter();
        for ((place, group), near) in groups.iter().enumerate().zip(found) {
            let next = those[tasks_of(place, group)][1..].chunks(EACH);
            for (k, (next, by)) in next.zip(moved.by_ref()).enumerate() {
                let here = &outcomes[by.tap];
                let (value, slopes, unit) = match &near {
                    Some((value, slopes)) => (*value, slopes[k], by.scale),
                    None => (numbers(here), self.differences(&designs, next, here), by.step * by.scale),
                };
                let mut slope = slopes.map(|slope| slope / unit);
                slope[2] = of_k(&value, &slope);
                out.push((by, slope));
            }
        }
        out
    }

    /// `moved` in groups: up to [`SLOPES`] inputs of a tap, and moduli of a hyperelastic law alone.
    fn groups(&self, moved: &[Moved]) -> Vec<Group> {
        let alone = |i: usize| !self.laws[moved[i].input].is_empty();
        let mut groups: Vec<Group> = Vec::with_capacity(moved.len());
        for i in 0..moved.len() {
            let joins = |last: &Group| last.len() < SLOPES && moved[last.start].tap == moved[i].tap;
            match groups.last_mut() {
                Some(last) if joins(last) && !alone(i) && !alone(last.start) => last.end += 1,
                _ => groups.push(i..i + 1),
            }
        }
        groups
    }

    /// Derivatives of a tap by the step from the outcomes `next` to it, where only the reference or a closed form has them.
    fn differences(&self, designs: &[Design], next: &[Task], here: &Outcome) -> [f64; OUTPUTS] {
        let mut slope = [0.0; OUTPUTS];
        for (task, [_, weight]) in next.iter().zip(POINTS) {
            let asked = Asked::known(self.setup, &designs[task.design as usize], task, f64::NAN);
            let linear = asked.map_or(f64::NAN, |asked| sign(asked.setup) * asked.linear);
            let solved = asked.filter(|_| !here.arc.is_nan()).map(by_reference);
            let solved = solved.filter(|o| o.sticking == here.sticking).unwrap_or(Outcome::NOTHING);
            let all = numbers(&Outcome { strain_linear: linear, ..solved });
            slope.iter_mut().zip(all).for_each(|(slope, x)| *slope += weight * x);
        }
        slope
    }

    /// The tap with the input moved by `step`, and its design, if that is another one.
    fn moved(&self, design: &Design, task: &Task, by: &Moved, step: f64) -> (Option<Design>, Task) {
        let input = self.inputs[by.input];
        let tuple = input.tuple(tuple(design, task), step);
        let whisker = || design.beside(self.setup, tuple, input.moved(design.setup(self.setup), step));
        let same = matches!(input, Input::Tuple(5..));
        ((!same).then(whisker), Task::of(task.design, &tuple))
    }

    /// Values and derivatives of the taps of `groups`, where the solver has them, else `None`. `tasks`: those of each group in turn.
    fn solved(
        &self,
        designs: &[Design],
        tasks: &[Task],
        (moved, groups): (&[Moved], &[Group]),
        outcomes: &[Outcome],
    ) -> Vec<Option<Near>> {
        let mut out = vec![None; groups.len()];
        let setup = self.setup;
        if setup.model.geometry == Geometry::Linear {
            return out;
        }
        let here = |group: &Group| &outcomes[moved[group.start].tap];
        let grip =
            |task: &Task, here: &Outcome| match designs[task.design as usize].setup(setup).model.contact {
                _ if here.sticking => Grip::Stick,
                Contact::Coulomb(mu) => Grip::Slide(mu.copysign(here.tangential_force)),
                _ => Grip::Slide(0.0),
            };
        let laws = |group: &Group| self.laws[moved[group.start].input].as_slice();
        let mut classes: BTreeMap<(bool, Option<usize>), Vec<usize>> = BTreeMap::new();
        for (place, group) in groups.iter().enumerate().filter(|(_, group)| !here(group).arc.is_nan()) {
            let law = (!laws(group).is_empty()).then_some(moved[group.start].input);
            classes.entry((here(group).sticking, law)).or_default().push(place);
        }
        for places in classes.values() {
            let (mut those, mut grips, mut steps) = (Vec::new(), Vec::new(), Vec::new());
            for &place in places {
                let group = &groups[place];
                let own = &tasks[tasks_of(place, group)];
                those.extend_from_slice(own);
                grips.extend(own.iter().map(|task| grip(task, here(group))));
                steps.push(moved[group.clone()].iter().map(|by| by.step).collect());
            }
            let (tasks, grips) = (&those, &grips);
            let question =
                Question { setup, designs, tasks, grips, charted: false, samples: false, beyond: true };
            let every: Vec<usize> = (0..those.len()).collect();
            let laws = laws(&groups[places[0]]);
            let found = Rods::new(&question, &every).beside(&steps, TOLERANCE, &self.section, laws);
            for (&place, found) in places.iter().zip(found) {
                out[place] = found;
            }
        }
        out
    }
}

/// The derivative of K − 1, K = θ f ε₁/(ε₁² + ε₂²), from those of the strains: close to an end of the gauge K changes faster than they do.
fn of_k(value: &[f64; OUTPUTS], slope: &[f64; OUTPUTS]) -> f64 {
    let [first, linear, _, _, _, _, second, ..] = *value;
    let (both, turned) = match second.is_nan() {
        true => (first * first, first * slope[0]),
        false => (first * first + second * second, first * slope[0] + second * slope[6]),
    };
    let k = linear * first / both;
    k * (slope[1] / linear + slope[0] / first - 2.0 * turned / both)
}
