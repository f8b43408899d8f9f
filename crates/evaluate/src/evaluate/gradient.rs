//! Derivatives of outcomes by the inputs of taps. An input is moved by ±h and ±2h; the solver of every whisker solves these four taps with the same
//! nodes and passes, so that their differences are those of a smooth function.

use rayon::prelude::*;

use super::input::Input;
use super::outcome::{Asked, by_reference, sign};
use super::rod::Rods;
use super::solve::Question;
use super::{Outcome, Task, closed_gradient, is_closed};
use crate::design::Design;
use crate::kernel::{Ladder, Section};
use crate::physics::onset::Grip;
use crate::scene::{Contact, Geometry, Precision, Property, Setup, Tuple};
use vibrissa_rod::GROUP;

/// Outputs with derivatives: strain, strain of linear theory, K − 1, P, T, arc, strain of the second gauge, azimuth (rad) and slide.
pub const OUTPUTS: usize = 9;

/// Step of an input over its scale. By four taps, the fifth derivative and rounding each show as some 1e-11 of the first.
const STEP: f64 = 1e-3;

/// Steps at which a tap is solved, and their weights in the derivative.
const POINTS: [f64; GROUP] = [2.0, 1.0, -1.0, -2.0];
const WEIGHTS: [f64; GROUP] = [-1.0 / 12.0, 8.0 / 12.0, -8.0 / 12.0, 1.0 / 12.0];

/// Largest share of the step per distance, over a, of the contact from an end of gauge or foil, where strains have a kink: of inputs that move one
/// against the other, and of others. Its least share: rounding then shows more than the kink.
const ROOM: [f64; 2] = [2.0, 500.0];
const LEAST: [f64; 2] = [1e-4, 1e-2];

/// Largest error of the taps, relative to their strain.
const TOLERANCE: f64 = 1e-9;

/// Taps of a thread.
const FEW: usize = 32;

/// Derivatives by `inputs` of taps of `setup`, whose designs have no rigs of other kinds.
pub struct Gradient<'a> {
    setup: &'a Setup,
    inputs: &'a [Input],
    /// The section law, and for each modulus of a hyperelastic law those at the steps.
    section: Section,
    laws: Vec<Option<[Section; GROUP]>>,
}

/// An input of a tap, moved by steps of this size.
struct Moved {
    tap: usize,
    input: usize,
    step: f64,
}

/// The section law of `setup` for [`Gradient`], charted on first use.
pub fn section(setup: &Setup) -> Section {
    Ladder::new(Precision::F64, &setup.model.material, TOLERANCE).section
}

fn tuple(design: &Design, task: &Task) -> Tuple {
    let Task { a, drive, direction, .. } = *task;
    Tuple { a, drive, tilt: direction.tilt, lean: direction.lean, ..design.tuple }
}

fn numbers(o: &Outcome) -> [f64; OUTPUTS] {
    let [pressed, rubbed] = [o.normal_force, o.tangential_force];
    [o.strain, o.strain_linear, o.deviation, pressed, rubbed, o.arc, o.strain_2, o.azimuth, o.slide]
}

impl<'a> Gradient<'a> {
    /// By `inputs`; `law` is [`section`] of `setup`.
    pub fn new(setup: &'a Setup, inputs: &'a [Input], law: &Section) -> Self {
        let none = Tuple::default();
        let laws = |input: &Input| {
            let step = STEP * input.scale(setup, &none, 1.0);
            let at = |point: f64| section(&input.moved(setup, none, point * step).0);
            matches!(input, Input::Modulus(_)).then(|| POINTS.map(at))
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
            let inside = !here.strain_linear.is_nan();
            let Some(shared) = designs[tap].shared.as_ref().filter(|_| inside) else { continue };
            let setup = designs[tap].setup(self.setup);
            let foil = shared.foil.iter().flat_map(|foil| foil.span);
            let knots: Vec<f64> = shared.body.iter().flat_map(|body| body.knots()).copied().collect();
            let away = |end: f64| (here.arc - end).abs().min((task.a - end).abs()) / task.a;
            let room: Vec<f64> =
                shared.gauge.into_iter().chain(foil).chain(knots.iter().copied()).map(away).collect();
            let apart = |knot: &f64| shared.gauge.map(|end| (end - knot).abs() / task.a);
            let beside = knots.iter().flat_map(apart).fold(1.0, f64::min);
            for (input, by) in self.inputs.iter().enumerate() {
                let gauged = matches!(by, Input::Tuple(3 | 4));
                // The near end stays where only the length of the grid changes.
                let room = if *by == Input::Tuple(4) { &room[1..] } else { &room };
                let room = room.iter().copied().fold(if gauged { beside } else { 1.0 }, f64::min);
                let curved = matches!(by, Input::Property(Property::Curvature | Property::CurvatureSlope));
                let kind = usize::from(!(curved || matches!(by, Input::Tuple(3..=5))));
                // The law of a moved modulus is charted once for all taps.
                let whole = matches!(by, Input::Modulus(_));
                let share = if whole { 1.0 } else { (ROOM[kind] * room).clamp(LEAST[kind], 1.0) };
                let step = share * STEP * by.scale(setup, &tuple(&designs[tap], task), task.a);
                let one = Moved { tap, input, step };
                // Such taps are even in tilt and lean.
                let tilts = matches!(by, Input::Tuple(6 | 7));
                match tilts && task.direction.is_upright() && !setup.gauge.second {
                    true => out.push((one, [0.0; OUTPUTS])),
                    false => moved.push(one),
                }
            }
        }
        let mut those = Vec::with_capacity(GROUP * moved.len());
        for by in &moved {
            for point in POINTS {
                let (other, task) = self.moved(&designs[by.tap], &tasks[by.tap], by, point * by.step);
                let place = if other.is_some() { designs.len() } else { by.tap };
                designs.extend(other);
                those.push(Task { design: place as u32, ..task });
            }
        }
        let here: Vec<&Outcome> = moved.iter().map(|by| &outcomes[by.tap]).collect();
        let found = self.solved(&designs, &those, &moved, &here);
        for (k, by) in moved.into_iter().enumerate() {
            let group = GROUP * k..GROUP * (k + 1);
            let told = found[group.clone()].iter().all(Option::is_some);
            let mut slope = [0.0; OUTPUTS];
            for (i, weight) in group.zip(WEIGHTS) {
                let asked = self.asked(&designs, &those[i]);
                let linear = asked.map_or(f64::NAN, |asked| sign(asked.setup) * asked.linear);
                let solved = match here[k].arc.is_nan() {
                    true => None,
                    false if told => found[i],
                    false => asked.map(by_reference).filter(|o| o.sticking == here[k].sticking),
                };
                let all = numbers(&Outcome { strain_linear: linear, ..solved.unwrap_or(Outcome::NOTHING) });
                slope.iter_mut().zip(all).for_each(|(slope, x)| *slope += weight / by.step * x);
            }
            out.push((by, slope));
        }
        out
    }

    fn asked<'b>(&'b self, designs: &'b [Design], task: &'b Task) -> Option<Asked<'b>> {
        Asked::known(self.setup, &designs[task.design as usize], task)
    }

    /// The tap with the input moved by `step`, and its design, if that is another one.
    fn moved(&self, design: &Design, task: &Task, by: &Moved, step: f64) -> (Option<Design>, Task) {
        let (tuple, input) = (tuple(design, task), self.inputs[by.input]);
        if let Input::Tuple(5..) = input {
            return (None, Task::of(task.design, &input.tuple(tuple, step)));
        }
        let (setup, tuple) = input.moved(design.setup(self.setup), tuple, step);
        (Some(design.beside(&setup, tuple)), Task::of(task.design, &tuple))
    }

    /// Outcomes of `those` by the solver of every whisker, or by closed forms.
    fn solved(
        &self,
        designs: &[Design],
        those: &[Task],
        moved: &[Moved],
        here: &[&Outcome],
    ) -> Vec<Option<Outcome>> {
        let setup = self.setup;
        let mut out = vec![None; those.len()];
        if setup.model.geometry == Geometry::Linear {
            return those.iter().map(|task| self.asked(designs, task).map(by_reference)).collect();
        }
        let grip = |i: usize| match designs[those[i].design as usize].setup(setup).model.contact {
            _ if here[i / GROUP].sticking => Grip::Stick,
            Contact::Coulomb(mu) => Grip::Slide(mu.copysign(here[i / GROUP].tangential_force)),
            _ => Grip::Slide(0.0),
        };
        let mut run = |places: Vec<usize>, section: &Section| {
            if places.is_empty() {
                return;
            }
            let tasks: Vec<Task> = places.iter().map(|&i| those[i]).collect();
            let grips: Vec<Grip> = places.iter().map(|&i| grip(i)).collect();
            let question =
                Question { setup, designs, tasks: &tasks, grips: &grips, charted: false, beyond: true };
            let every: Vec<usize> = (0..tasks.len()).collect();
            let found = Rods::new(&question, &every).solve(true, TOLERANCE, section);
            for ((&i, task), s) in places.iter().zip(&tasks).zip(found) {
                let told = s.error <= TOLERANCE;
                out[i] = self.asked(designs, task).filter(|_| told).map(|asked| asked.outcome(s.found));
            }
        };
        for stick in [false, true] {
            let open = |i: &usize| !here[i / GROUP].arc.is_nan() && here[i / GROUP].sticking == stick;
            let law = |i: &usize| self.laws[moved[i / GROUP].input].as_ref();
            let of =
                |keep: &dyn Fn(&usize) -> bool| (0..those.len()).filter(|i| open(i) && keep(i)).collect();
            run(of(&|i| law(i).is_none()), &self.section);
            for (input, laws) in self.laws.iter().enumerate() {
                for (point, section) in laws.iter().flatten().enumerate() {
                    // A group is one tap, four times: neighbours have other effects.
                    let those: Vec<usize> = of(&|i| moved[i / GROUP].input == input && i % GROUP == point);
                    run(those.into_iter().flat_map(|i| [i; GROUP]).collect(), section);
                }
            }
        }
        out
    }
}
