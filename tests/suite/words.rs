//! Each tap has the reference's status and accurate digits, whatever its backend, precision and neighbours.

use rayon::prelude::*;
use vibrissa::census::Taps;
use vibrissa::census::cases::{Configuration, HUB, all as configured};
use vibrissa::chart::ranges::Wanted;
use vibrissa::chart::{ranker::Ranker, reader::Reader};

use vibrissa::evaluate::{Evaluator, Method, Outcome, Referral, Source};
use vibrissa::scene::model::{Contact, Drive, Material, Model, Side};
use vibrissa::scene::sampler::Sampler;
use vibrissa::scene::{Direction, Precision, Setup, Tuple};

use crate::common::cases::Kind;
use crate::common::program::Desk;
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place};
use crate::common::{all_effects, model};

const LAWS: [Material; 6] = [
    Material::Hooke(3.2),
    Material::NeoHookean(3.2),
    Material::MooneyRivlin([0.35, 0.15]),
    Material::Yeoh([0.5, 0.1, 0.02]),
    Material::Yeoh([0.5, -0.08, 0.02]),
    // The tangent modulus vanishes at some strain.
    Material::Yeoh([0.5, -0.3, 0.0]),
];

fn setup(model: Model, side: Side, drive: Drive) -> Setup {
    let mut setup = Kind::Tap.setup();
    (setup.model, setup.gauge.side, setup.drive) = (model, side, drive);
    setup
}

/// One law with every contact: free on the centreline, stretched on the far side, on the surface, against a pole, displaced, sticking, sliding.
fn rigs(material: Material) -> Vec<Setup> {
    let (plain, all) = (model(material), all_effects(material));
    let held = |contact| Model { contact, extension: true, ..plain };
    let angle = |model, side| setup(model, side, Drive::Angle);
    vec![
        angle(plain, Side::Contact),
        angle(Model { extension: true, ..plain }, Side::Far),
        angle(Model { surface: true, ..plain }, Side::Contact),
        angle(Model { surface: true, shear: true, pole_radius: 7.2, ..plain }, Side::Far),
        setup(all, Side::Contact, Drive::Displacement),
        angle(held(Contact::Stick), Side::Contact),
        angle(Model { contact: Contact::Stick, ..all }, Side::Contact),
        angle(held(Contact::Coulomb(0.3)), Side::Contact),
        angle(Model { contact: Contact::Coulomb(0.3), ..all }, Side::Far),
    ]
}

/// Thick and thin whiskers up to large angles, contacts next to the gauge, and gauges and clamps that end 1e-6…1e-2 mm from the contact.
#[allow(non_snake_case)]
fn hard(kind: Drive, n: u32, seed: u64) -> Vec<Tuple> {
    let one = |i: u32| {
        let unit = |axis| f64::from(Sampler::Random.coordinate(seed, axis, i)) / 2f64.powi(32);
        let log = |axis, low: f64, high: f64| low * (high / low).powf(unit(axis));
        let sign = if unit(8) < 0.5 { 1.0 } else { -1.0 };
        let (D, mut L_a, mut x_ss, mut l, mut d) = (10.0, 50.0, 5.0, 2.0, 1.0 + 13.0 * unit(6));
        let (a, theta) = match i % 3 {
            0 => {
                (L_a, x_ss, l) = (log(0, 20.0, 400.0), log(1, 0.05, 15.0), log(2, 0.01, 4.0));
                (x_ss + l * log(3, 1e-2, 1e2), log(4, 1e-3, 60.0))
            }
            1 => {
                (L_a, x_ss) = (20.0 + 100.0 * unit(0), 1.0 + 7.0 * unit(1));
                (x_ss + 0.5 + 10.0 * unit(3), log(4, 0.1, 40.0))
            }
            _ => {
                d = 3.0 + 9.0 * unit(6);
                x_ss = if unit(1) < 0.3 { log(2, 1e-6, 1e-2) } else { x_ss };
                (x_ss + l + sign * log(3, 1e-6, 1e-2), log(4, 0.01, 20.0))
            }
        };
        let a = a.min(L_a);
        let drive = if kind == Drive::Displacement { a * theta.to_radians() } else { theta };
        Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() }
    };
    (0..n).map(one).collect()
}

/// Taps whose word (if `words`) or strain differs from the reference, and the number of taps left to the reference.
fn faults(
    setup: &Setup,
    place: Place,
    tuples: &[Tuple],
    exact: &[Outcome],
    words: bool,
) -> (Vec<String>, usize) {
    let taps = Taps::of(setup, tuples);
    let mut evaluator = Evaluator::new(setup, place.open(setup));
    let found = evaluator
        .run_alike(&taps.designs, &taps.tasks, Referral::ALL, Some(exact))
        .expect("the backend answers");
    let bound = match place.precision {
        Precision::F32 => 1e-5,
        Precision::F64 if words => 1e-8,
        Precision::F64 => 2e-8,
    };
    let fault = |(i, (e, f)): (usize, (&Outcome, &Outcome))| {
        let error = (f.strain - e.strain).abs() / e.strain.abs().max(taps.least(i)).max(f64::MIN_POSITIVE);
        let both = e.strain.is_finite() && (words || f.strain.is_finite()) && e.strain != f.strain;
        let wrong = words && f.status != e.status || both && (error.is_nan() || error > bound);
        wrong.then(|| {
            let (model, t) = (&setup.model, &tuples[i]);
            format!(
                "{place:?}: {} {} instead of {} {}: {model:?} {t:?}",
                f.status, f.strain, e.status, e.strain
            )
        })
    };
    let faults = exact.iter().zip(&found).enumerate().filter_map(fault).collect();
    (faults, found.iter().filter(|f| f.referred).count())
}

fn exact(setup: &Setup, tuples: &[Tuple]) -> Vec<Outcome> {
    Taps::of(setup, tuples).answers(Method::Reference).expect("it answers")
}

/// d/D 0.02…1.5, drives 1e-4…60°, gauges from 1e-4 mm, contacts from next to the clamp to the tip, half of them next to the gauge.
#[allow(non_snake_case)]
fn extreme(c: &Configuration, n: u32, seed: u64) -> Vec<Tuple> {
    let point = |index: u32| {
        let unit = |dimension| f64::from(Sampler::Random.coordinate(seed, dimension, index)) / 2f64.powi(32);
        let log = |dimension, from: f64, to: f64| from * (to / from).powf(unit(dimension));
        let even = index.is_multiple_of(2);
        let wide = log(7, 1.0, 200.0);
        let tip = wide * if even { 0.02 + 1.48 * unit(6) } else { log(6, 0.02, 1.5) };
        let length = wide * log(0, 2.0, 50.0);
        let place = match index {
            _ if index.is_multiple_of(16) => 0.0,
            _ if even => 0.95 * unit(1) * length,
            _ => log(1, 1e-3, 0.95) * length,
        };
        let grid = log(2, 1e-4, 0.5 * length).min(length - place);
        let a = match index % 5 {
            0 | 1 => place + grid * log(3, 1e-2, 1e2),
            2 => place + log(3, 1e-4, 0.1) * length,
            _ => place + unit(3) * (length - place),
        };
        let a = a.clamp(1e-3 * length, length);
        let angle = log(4, 1e-4, 60.0);
        let scale = if c.setup.hub > 0.0 { HUB / (log(5, 0.03, 3.0) * a) } else { 1.0 };
        let [D, d, L_a, x_ss, l, a] = [wide, tip, length, place, grid, a].map(|x| scale * x);
        let drive = if c.setup.drive == Drive::Displacement { a * angle.to_radians() } else { angle };
        Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() }
    };
    (0..n).map(point).collect()
}

/// Extreme rows of every configuration are within tolerance or have a word. `rows`: counts for slow and quick configurations.
fn extremes(places: &[Place], rows: [u32; 2], seed: u64) {
    let mut over = Vec::new();
    for c in &configured() {
        let setup = c.setup.clone();
        let quick = matches!(c.setup.model.contact, Contact::Frictionless | Contact::Coulomb(0.0));
        let tuples = extreme(c, rows[usize::from(quick)], seed);
        let exact = exact(&setup, &tuples);
        for &place in places {
            let told = faults(&setup, place, &tuples, &exact, false).0;
            over.extend(told.into_iter().map(|fault| format!("{} {fault}", c.name)));
        }
    }
    assert!(over.is_empty(), "{} rows\n{}", over.len(), over.join("\n"));
}

#[test]
fn few_extreme_rows_are_all_within_their_tolerance() {
    // Shaders take long to compile: the long run and `verify` cover the GPU.
    extremes(&[CPU, CPU_F64], [4, 30], 1);
}

#[test]
#[ignore = "half an hour: 100 000 rows"]
fn extreme_rows_are_all_within_their_tolerance() {
    extremes(&[CPU, CPU_F64, GPU], [700, 3900], 2);
}

#[test]
fn hard_taps_of_every_law_and_contact_have_the_words_of_the_reference() {
    let cases: Vec<(usize, Setup)> = LAWS.into_iter().flat_map(rigs).enumerate().collect();
    let answered: Vec<(Vec<Tuple>, Vec<Outcome>)> = cases
        .par_iter()
        .map(|(i, setup)| {
            let tuples = hard(setup.drive, 9, 100 + *i as u64);
            let exact = exact(setup, &tuples);
            (tuples, exact)
        })
        .collect();
    let words = |word: &str| {
        let of =
            |outcomes: &Vec<Outcome>| outcomes.iter().filter(|o| o.status.to_string().contains(word)).count();
        answered.iter().map(|(_, exact)| of(exact)).sum::<usize>()
    };
    assert!(words("ok") > 100 && words("strain_limit") > 50 && words("material_limit") > 20);
    let mut all = Vec::new();
    for ((i, setup), (tuples, exact)) in cases.iter().zip(&answered) {
        // Shaders take long to compile: the GPU gets the rubber models.
        let gpu = (9..18).contains(i).then_some(GPU);
        for place in [CPU, CPU_F64].into_iter().chain(gpu) {
            all.extend(faults(setup, place, tuples, exact, true).0);
        }
    }
    assert!(all.is_empty(), "{} faults\n{}", all.len(), all.join("\n"));
}

/// Far-side taps whose strain crosses zero next to the contact, and taps at their material limit: kernels leave many of them to the reference.
#[test]
fn what_a_kernel_leaves_open_has_the_word_of_the_reference() {
    let rubber = Model { surface: true, shear: true, pole_radius: 7.2, ..model(LAWS[1]) };
    let crossing = [0.1, 1.0, 5.0].map(|theta| {
        Tuple::from_array([28.161887, 11.377557, 120.0, 34.369753, 11.379821, 36.0, 0.0, 0.0, theta])
    });
    let ends: Vec<Tuple> = [4.0, 10.0]
        .into_iter()
        .flat_map(|d| [6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0].map(|a| (d, a)))
        .flat_map(|(d, a)| [10.0, 20.0, 30.0].map(|drive| (d, a, drive)))
        .map(|(d, a, drive)| Tuple { D: 10.0, d, L_a: 50.0, x_ss: 2.0, l: 2.0, a, drive, ..Tuple::default() })
        .collect();
    let mut referred = 0;
    for (setup, tuples) in [
        (setup(rubber, Side::Far, Drive::Angle), crossing.to_vec()),
        (setup(Model { surface: true, ..model(LAWS[3]) }, Side::Contact, Drive::Angle), ends),
    ] {
        let exact = exact(&setup, &tuples);
        for place in [CPU, CPU_F64, GPU] {
            let (faults, left) = faults(&setup, place, &tuples, &exact, true);
            assert!(faults.is_empty(), "{}", faults.join("\n"));
            referred += left;
        }
    }
    assert!(referred > 0, "no kernel left anything open");
}

#[test]
fn run_json_counts_the_taps_left_to_the_reference() {
    let text = "[whisker]\nD = 10\nd = [4, 10]\nL_a = 50\n[gauge]\nx_ss = 2\nl = 2\n[tap]\na = { from = 6, to = 12, step = 1 }\n\
                theta = [10, 20, 30]\n[model]\nsurface = true\nmaterial = { yeoh = [0.5, 0.1, 0.02] }\n";
    let counts = |backend: &str| {
        let ran = Desk::new(text).run(&["sweep", "spec.toml", "--json", "--backend", backend]);
        ran.exits(0).json()["counts"].clone()
    };
    let (kernel, reference) = (counts("cpu"), counts("reference"));
    assert_eq!(kernel["status"], reference["status"]);
    assert!(kernel["referred"].as_u64().unwrap() > 0, "{kernel}");
    assert_eq!(reference["referred"], 0);
    assert_eq!([&reference["sweeps_mean"], &reference["sweeps_max"]], [0.0; 2]);
}

#[test]
fn a_tap_read_from_a_chart_has_the_same_digits_beside_any_neighbours() {
    let setup = setup(
        Model { extension: true, contact: Contact::Coulomb(0.3), ..model(LAWS[0]) },
        Side::Contact,
        Drive::Angle,
    );
    let distances = [30.0, 45.0];
    let wanted = Wanted {
        D: [8.0, 12.0],
        d: [2.0, 7.0],
        L_a: [50.0; 2],
        x_ss: [3.0, 9.0],
        l: [2.0; 2],
        drive: [0.5, 10.0],
    };
    let one = |i: u32| {
        let of = |axis, [low, high]: [f64; 2]| {
            low + (high - low) * f64::from(Sampler::Random.coordinate(3, axis, i)) / 2f64.powi(32)
        };
        let (d, x_ss, drive) = (of(1, wanted.d), of(2, wanted.x_ss), of(3, wanted.drive));
        let a = distances[i as usize % 2];
        Tuple::from_array([of(0, wanted.D), d, 50.0, x_ss, 2.0, a, 0.0, 0.0, drive])
    };
    let tuples: Vec<Tuple> = (0..400).map(one).collect();
    let Taps { designs, tasks, .. } = Taps::of(&setup, &tuples);
    let at = (&distances[..], &[Direction::UPRIGHT][..]);
    let reader = Reader::new(&setup, at, &wanted, 1e-5).expect("it solves").expect("there are charts");
    let together = reader.read(&setup, &designs, &tasks);
    let read: Vec<&Outcome> = together.iter().flatten().collect();
    assert!(read.len() > 300);
    let sticking = read.iter().filter(|o| o.sticking).count();
    assert!(sticking > 50 && sticking < read.len() - 50, "{sticking} of {} stick", read.len());
    for (i, tap) in together.iter().enumerate() {
        let alone = &reader.read(&setup, &designs, &tasks[i..=i])[0];
        assert_eq!(format!("{tap:?}"), format!("{alone:?}"), "{:?}", tuples[i]);
    }
    let rows =
        Ranker::of_rows(&setup, &distances, &wanted, 1e-5).expect("it solves").expect("there are charts");
    let together = rows.figures(&tuples);
    assert!(together.iter().flatten().count() > 300);
    for (i, row) in together.iter().enumerate() {
        let alone = rows.figures(&tuples[i..=i]);
        assert_eq!(format!("{row:?}"), format!("{:?}", alone[0]), "{:?}", tuples[i]);
    }
}
