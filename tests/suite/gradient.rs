//! Derivatives of taps against extrapolated differences of the reference: every model, every input, hard and random taps.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::built::{case, cases};
use vibrissa::census::cases;
use vibrissa::design::Design;
use vibrissa::evaluate::{self, Evaluator, Gradient, Input, Method, OUTPUTS, Outcome, Task};
use vibrissa::scene::{Clamp, Property, Setup, Tuple};
use vibrissa::spec;

/// Largest allowed error of a derivative, relative to the largest of its column.
const TOLERANCE: f64 = 1e-8;

const NAMES: &str = "D d L_a x_ss l a theta delta tilt lean hub pole_radius mu E C10 C01 C20 C30 nu \
    clamp foil.stiffness foil.length foil.width exponent scale bore core.diameter core.modulus curvature curvature_slope root.k_theta root.k_y root.k_x";

fn solve(setup: &Setup, tuple: Tuple) -> (Design, Task, Outcome) {
    let design = Design::new(setup, tuple);
    let task = Task::of(0, &tuple);
    let mut evaluator = Evaluator::new(setup, Method::Reference);
    let outcome = evaluator.run(std::slice::from_ref(&design), &[task]).expect("the reference runs")[0];
    (design, task, outcome)
}

fn gradient(
    setup: &Setup,
    design: &Design,
    task: &Task,
    outcome: &Outcome,
    inputs: &[Input],
) -> [Vec<f64>; OUTPUTS] {
    let (every, mut slopes): ([usize; OUTPUTS], _) =
        (std::array::from_fn(|k| k), vec![0.0; OUTPUTS * inputs.len()]);
    let tap = (std::slice::from_ref(design), std::slice::from_ref(task), std::slice::from_ref(outcome));
    Gradient::new(setup, inputs, &evaluate::section(setup)).write(tap, &every, &mut slopes);
    std::array::from_fn(|k| slopes[k * inputs.len()..][..inputs.len()].to_vec())
}

fn numbers(o: &Outcome) -> [f64; OUTPUTS] {
    let [pressed, rubbed] = [o.normal_force, o.tangential_force];
    [o.strain, o.strain_linear, o.deviation, pressed, rubbed, o.arc, o.strain_2, o.azimuth, o.slide]
}

fn moved(setup: &Setup, tuple: Tuple, input: Input, step: f64) -> (Setup, Tuple) {
    let (mut setup, mut tuple) = (setup.clone(), tuple);
    match input {
        Input::Tuple(i) => {
            let t = &mut tuple;
            let places = [&mut t.D, &mut t.d, &mut t.L_a, &mut t.x_ss, &mut t.l, &mut t.a];
            let places = places.into_iter().chain([&mut t.tilt, &mut t.lean, &mut t.drive]);
            *places.into_iter().nth(i).expect("a number of a tap") += step;
        }
        Input::Property(Property::Scale) => Property::Scale.set(&mut setup, 1.0 + step),
        Input::Property(Property::Bore | Property::Core) => {
            let mut built = setup.built.as_deref().cloned().expect("a whisker with something inside");
            let inner = built.inner.as_mut().expect("something inside");
            inner.diameter.iter_mut().for_each(|knot| knot[1] += step);
            setup.built = Some(Arc::new(built));
        }
        Input::Property(p) => {
            let value = p.get(&setup) + step;
            p.set(&mut setup, value);
        }
        Input::Modulus(i) => setup.model.material.moduli()[i] += step,
        Input::Clamp => {
            if let Clamp::At(c0) = &mut setup.model.clamp {
                *c0 += step;
            }
        }
        Input::FoilLength => setup.gauge.foil.as_mut().expect("a foil").length += step,
        Input::FoilWidth => setup.gauge.foil.as_mut().expect("a foil").width += step,
    }
    (setup, tuple)
}

/// A step that changes taps by some per cent; smaller for a profile, which may have corners.
fn step(setup: &Setup, t: Tuple, input: Input) -> f64 {
    let share = if setup.built.is_some() { 5e-3 } else { 5e-2 };
    share
        * match input {
            Input::Tuple(3 | 5) => (t.a - t.x_ss).abs().min((t.x_ss + t.l - t.a).abs()).min(t.a),
            Input::Tuple(4) => t.l.min((t.x_ss + t.l - t.a).abs()),
            Input::Tuple(6 | 7) => 10.0,
            Input::Tuple(i) => t.to_array()[i],
            Input::Property(Property::Curvature) => 1.0 / t.a,
            Input::Property(Property::CurvatureSlope) => 1.0 / (t.a * t.a),
            Input::Property(Property::Hub | Property::PoleRadius) => t.a,
            Input::Property(p) => p.get(setup).abs().max(0.1),
            Input::Clamp => 1.0,
            _ => 1.0,
        }
}

/// For each end of gauge and foil: true if the contact lies beyond it.
fn beyond(design: &Design, outcome: &Outcome) -> Vec<bool> {
    let Some(shared) = &design.shared else { return Vec::new() };
    let foil = shared.foil.iter().flat_map(|foil| foil.span);
    shared.gauge.into_iter().chain(foil).map(|place| outcome.arc > place).collect()
}

/// For each output: the derivative, the difference quotient and its uncertainty. Empty where the differences cross a kink.
type Compared = Vec<(usize, [f64; 3])>;

fn compare(setup: &Setup, tuple: Tuple, input: Input) -> Compared {
    let (design, task, here) = solve(setup, tuple);
    if design.shared.is_none() {
        return Vec::new();
    }
    let found = gradient(setup, &design, &task, &here, &[input]);
    let places = beyond(&design, &here);
    let h = step(setup, tuple, input);
    let at = |x: f64| {
        let (setup, tuple) = moved(setup, tuple, input, x);
        let (design, _, outcome) = solve(&setup, tuple);
        let alike = outcome.sticking == here.sticking && outcome.status == here.status;
        (alike && beyond(&design, &outcome) == places).then(|| numbers(&outcome))
    };
    let mut table: Vec<[f64; OUTPUTS]> = Vec::new();
    for k in 0..4 {
        let h = h * 0.5f64.powi(k);
        let (Some(above), Some(below)) = (at(h), at(-h)) else { return Vec::new() };
        table.push(std::array::from_fn(|m| (above[m] - below[m]) / (2.0 * h)));
    }
    let out = |m: usize| {
        let mut row: Vec<f64> = table.iter().map(|r| r[m]).collect();
        let mut last = f64::INFINITY;
        for order in 1..row.len() {
            let power = 4f64.powi(order as i32);
            let next: Vec<f64> = row.windows(2).map(|w| (power * w[1] - w[0]) / (power - 1.0)).collect();
            last = (next[next.len() - 1] - row[row.len() - 1]).abs();
            row = next;
        }
        // The reference is accurate to 1e-11 of each number, and of K, a radian and a; the finest step is h/8.
        let size = [0.0, 0.0, 1.0, 0.0, here.normal_force, tuple.a, here.strain, 1.0, tuple.a][m];
        let noise = 1e-11 * (size.abs() + numbers(&here)[m].abs()) / (h / 8.0);
        (m, [found[m][0], row[0], last + noise])
    };
    let told = (0..OUTPUTS).map(out).filter(|(m, _)| !numbers(&here)[*m].is_nan());
    told.collect()
}

/// Compares the derivatives of `these` taps; returns how many there are and how many are uncertain by less than the tolerance.
fn check(name: &str, setup: &Setup, these: &[Tuple]) -> [usize; 2] {
    let inputs: Vec<(&str, Input)> =
        NAMES.split(' ').filter_map(|n| Some((n, Input::new(setup, n).ok()?))).collect();
    let pairs: Vec<(Tuple, &str, Input)> =
        these.iter().flat_map(|t| inputs.iter().map(|(n, i)| (*t, *n, *i))).collect();
    let compared: Vec<(Tuple, &str, Compared)> =
        pairs.par_iter().map(|(t, n, i)| (*t, *n, compare(setup, *t, *i))).collect();
    let mut largest: BTreeMap<(&str, usize), f64> = BTreeMap::new();
    for (_, n, all) in &compared {
        for (m, [_, difference, unsure]) in all {
            if unsure.is_finite() && *unsure < 1e-3 * difference.abs() {
                let most = largest.entry((n, *m)).or_insert(0.0);
                *most = most.max(difference.abs());
            }
        }
    }
    let (mut told, mut all_of) = (0, 0);
    for (t, n, all) in &compared {
        for (m, [derivative, difference, unsure]) in all {
            let scale = largest.get(&(*n, *m)).copied().unwrap_or(0.0);
            all_of += usize::from(scale > 0.0);
            told += usize::from(scale > 0.0 && *unsure <= TOLERANCE * scale);
            if unsure.is_nan() {
                continue;
            }
            let off = (derivative - difference).abs();
            assert!(
                off <= TOLERANCE * scale + 2.0 * unsure + 1e-13,
                "{name}, output {m} by {n}: {derivative:e} is no {difference:e} ± {unsure:.1e}, of {scale:.1e}: {t:?}"
            );
        }
    }
    println!("{name}: {} inputs, {all_of} derivatives, {told} told to {TOLERANCE:e}", inputs.len());
    [all_of, told]
}

/// Taps of each model; the variable VIBRISSA_GRADIENT_TAPS sets more.
fn count() -> u32 {
    std::env::var("VIBRISSA_GRADIENT_TAPS").ok().and_then(|n| n.parse().ok()).unwrap_or(1)
}

#[test]
fn derivatives_are_those_of_the_reference() {
    let (mut all, mut told) = (0, 0);
    let wanted = std::env::var("VIBRISSA_GRADIENT_MODEL").ok();
    for one in cases::all().iter().filter(|c| wanted.as_ref().is_none_or(|w| w == c.name)) {
        let setup = one.setup.clone();
        // The first tap's gauge begins at the clamp, which a solid does not allow.
        let mut these = cases::random(setup.drive, setup.hub > 0.0, 1 + count(), 3).split_off(1);
        if count() > 1 {
            these.extend(cases::hard(&setup));
        }
        if setup.gauge.foil.is_some() {
            // Few random whiskers are long enough for a foil.
            let whisker = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
            these.push(Tuple { a: 33.0, drive: 4.0, ..whisker });
        }
        if setup.gauge.second {
            cases::tilt(&mut these, 5);
        }
        let [n, k] = check(one.name, &setup, &these);
        (all, told) = (all + n, told + k);
    }
    assert!(wanted.is_some() || 4 * told > all && all > 2000, "{told} of {all}");
}

#[test]
fn derivatives_of_built_whiskers_are_those_of_the_reference() {
    let every = if count() > 1 { 1 } else { 5 };
    for (k, row) in cases().iter().enumerate().filter(|(k, _)| k % every == 0) {
        let spec = spec::parse("case", &case(row, "contact"), std::path::Path::new(".")).expect("a spec");
        let study = spec.study;
        let tuple = study.space.layout().expect("axes").tuple(0);
        check(&format!("built {k} {}", row["config"]), &study.setup, &[tuple]);
    }
}

fn named(name: &str) -> Setup {
    cases::all().iter().find(|c| c.name == name).expect("a model").setup.clone()
}

/// Derivatives of strain and K of a cylinder, whose contact is at `a`, by x_ss, l, a and D.
fn of_cylinder(setup: &Setup, a: f64) -> [Vec<f64>; 2] {
    let whisker = Tuple { D: 10.0, d: 10.0, L_a: 50.0, x_ss: 10.0, l: 5.0, ..Tuple::default() };
    let (design, task, outcome) = solve(setup, Tuple { a, drive: 3.0, ..whisker });
    let inputs = ["x_ss", "l", "a", "D"].map(|name| Input::new(setup, name).expect("an input"));
    let [strain, _, k, ..] = gradient(setup, &design, &task, &outcome, &inputs);
    [strain, k]
}

#[test]
fn derivatives_of_a_contact_at_an_end_of_the_gauge_are_those_next_to_it() {
    for name in ["timoshenko", "surface"] {
        let setup = named(name);
        let (at, next) = (of_cylinder(&setup, 15.0), of_cylinder(&setup, 15.0 * (1.0 + 1e-7)));
        for (at, next) in at.iter().zip(&next) {
            let largest = next.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
            for (at, next) in at.iter().zip(next) {
                let off = (at - next).abs();
                assert!(off <= 1e-3 * largest, "{name}: {at} at the end, {next} next to it");
            }
        }
        let silent = of_cylinder(&setup, 10.0);
        assert!(silent[0].iter().all(|slope| *slope == 0.0), "{name}: a silent gauge, {silent:?}");
    }
}

#[test]
fn k_does_not_depend_on_the_length_of_a_gauge_that_the_contact_barely_reaches() {
    for name in ["timoshenko", "shear", "neo-alone"] {
        let setup = named(name);
        let l = Input::new(&setup, "l").expect("an input");
        for share in [2e-5, 1e-4] {
            let whisker = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
            let tuple = Tuple { a: 5.0 * (1.0 + share), drive: 0.5, ..whisker };
            let (design, task, outcome) = solve(&setup, tuple);
            assert!(outcome.strain > 0.0, "{name}");
            let slopes = gradient(&setup, &design, &task, &outcome, &[l]);
            let off = (slopes[2][0] / (1.0 + outcome.deviation)).abs() * tuple.l;
            assert!(off <= TOLERANCE, "{name}, {share}: {off:e}");
        }
    }
}

/// A passive pole moved next to the clamp is nearer than any straight whisker allows: tilted poles have no tap there.
#[test]
fn derivatives_next_to_the_clamp_are_told_of_an_upright_pole() {
    for name in ["neo-passive", "pole-far-passive"] {
        let setup = named(name);
        let tuple = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 0.0, l: 0.01, a: 0.5, ..Tuple::default() };
        let tuple = Tuple { drive: 0.5 * 0.5_f64.to_radians(), ..tuple };
        let (design, task, outcome) = solve(&setup, tuple);
        assert!(outcome.strain != 0.0, "{name}");
        let inputs = ["a", "delta", "tilt", "lean"].map(|n| Input::new(&setup, n).expect("an input"));
        let alone = gradient(&setup, &design, &task, &outcome, &inputs[..2]);
        let with = gradient(&setup, &design, &task, &outcome, &inputs);
        for m in [0, 1, 2, 3, 5] {
            for i in 0..2 {
                let off = (with[m][i] - alone[m][i]).abs();
                assert!(off <= 1e-10 * alone[m][i].abs(), "{name}, output {m}: {with:?}, {alone:?}");
            }
            // The outputs are even in tilt and lean.
            assert_eq!(with[m][2..], [0.0; 2], "{name}, output {m}");
        }
    }
}

#[test]
fn derivatives_of_a_batch_are_those_of_its_taps() {
    for (name, names) in [("mooney-alone", ["C10", "a", "theta"]), ("neo-tilted", ["nu", "tilt", "d"])] {
        let setup = named(name);
        let inputs = names.map(|n| Input::new(&setup, n).expect("an input"));
        let whisker = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, drive: 4.0, ..Tuple::default() };
        // A tap outside the domain among them.
        let taps = [(30.0, 0.0), (25.0, 10.0), (0.0, 0.0), (6.5, 20.0), (30.0, 30.0)];
        let taps = taps.map(|(a, tilt)| solve(&setup, Tuple { a, tilt, ..whisker }));
        let designs: Vec<Design> = taps.iter().map(|(design, ..)| design.clone()).collect();
        let tasks: Vec<Task> =
            taps.iter().enumerate().map(|(i, (_, task, _))| Task { design: i as u32, ..*task }).collect();
        let outcomes: Vec<Outcome> = taps.iter().map(|(.., outcome)| *outcome).collect();
        let mut all = vec![0.0; taps.len() * inputs.len()];
        let section = evaluate::section(&setup);
        Gradient::new(&setup, &inputs, &section).write((&designs, &tasks, &outcomes), &[0], &mut all);
        for ((design, task, outcome), all) in taps.iter().zip(all.chunks(inputs.len())) {
            let [alone, ..] = gradient(&setup, design, task, outcome, &inputs);
            for (alone, here) in alone.iter().zip(all) {
                assert_eq!(alone.is_nan(), outcome.strain.is_nan(), "{name}: {task:?}");
                let off = (alone - here).abs();
                assert!(off.is_nan() || off <= 1e-9 * alone.abs(), "{name}: {alone} {here} {task:?}");
            }
        }
    }
}

/// There the foil begins on the whisker for only some of the neighbouring taps.
#[test]
fn derivatives_next_to_an_end_of_the_domain_are_told() {
    let foil = named("foil");
    let l = foil.gauge.foil.expect("a foil").length;
    let whisker = Tuple { D: 10.0, d: 10.0, L_a: 50.0, l: 2.0, a: 33.0, drive: 4.0, ..Tuple::default() };
    let (setup, tuple) = (foil, Tuple { x_ss: 0.5 * (l - 2.0), ..whisker });
    let inputs = ["x_ss", "l", "foil.length", "D"].map(|n| Input::new(&setup, n).expect("an input"));
    let (design, task, outcome) = solve(&setup, tuple);
    assert!(outcome.strain > 0.0, "{outcome:?}");
    let [slopes, ..] = gradient(&setup, &design, &task, &outcome, &inputs);
    assert!(slopes.iter().all(|slope| slope.is_finite()), "{slopes:?}");
}
