//! Tilted poles (model §6): 56 cases of another code on every backend, and symmetries.

use std::collections::HashMap;

use crate::common::cases::{evaluate, rows};
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, REFERENCE};
use vibrissa::evaluate::Outcome;
use vibrissa::scene::{Contact, Drive, Material, Setup, Side, Tuple};

/// A tap and its answer; angles in degrees.
#[derive(Debug, Clone)]
struct Case {
    line: usize,
    setup: Setup,
    tuple: Tuple,
    strain: f64,
    strain_2: f64,
    azimuth: f64,
    force: f64,
    arc: f64,
    slide: f64,
}

fn cases() -> Vec<Case> {
    let case = |(i, row): (usize, HashMap<String, String>)| {
        let get = |column: &str| row[column].parse::<f64>().unwrap_or(f64::NAN);
        let drive = if row["delta_mm"].is_empty() { Drive::Angle } else { Drive::Displacement };
        let rig = Setup { hub: get("hub_mm"), drive, ..Setup::default() };
        let setup = match row["configuration"].as_str() {
            "hooke" => rig,
            "surface" => rig.surface(),
            "pole" => rig.surface().pole_radius(3.0),
            "timoshenko" => rig.shear().extension(),
            "neo" => rig.material(Material::NeoHookean(3.2)).surface().shear().extension(),
            other => panic!("no configuration {other}"),
        };
        let columns =
            ["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "tilt_deg", "lean_deg", drive.column()];
        Case {
            line: i + 3,
            tuple: Tuple::from_array(columns.map(get)),
            setup,
            strain: get("strain"),
            strain_2: get("strain_2"),
            azimuth: get("bending_azimuth_deg"),
            force: get("normal_force_N"),
            arc: get("contact_arc_mm"),
            slide: get("slide_mm"),
        }
    };
    rows("tilt_cases").into_iter().enumerate().map(case).collect()
}

/// Errors: strains relative to the larger, azimuth in rad, force and arc relative, slide relative to the arc.
fn errors(case: &Case, [strain, strain_2, azimuth, force, arc, slide]: [f64; 6]) -> [f64; 6] {
    let larger = case.strain.abs().max(case.strain_2.abs());
    [
        (strain - case.strain) / larger,
        (strain_2 - case.strain_2) / larger,
        azimuth - case.azimuth.to_radians(),
        force / case.force - 1.0,
        arc / case.arc - 1.0,
        (slide - case.slide) / case.arc,
    ]
    .map(f64::abs)
}

const QUANTITIES: [&str; 6] = ["strain", "strain_2", "azimuth", "force", "arc", "slide"];

fn told(worst: &[f64]) -> String {
    QUANTITIES.iter().zip(worst).map(|(name, worst)| format!("{name} {worst:.1e} ")).collect()
}

fn values(o: &Outcome) -> [f64; 6] {
    [o.strain, o.strain_2, o.azimuth, o.normal_force, o.arc, o.slide]
}

fn one(setup: &Setup, place: Place, tuple: Tuple) -> Outcome {
    evaluate(setup, place.open(setup), &[tuple])[0].0
}

fn agrees_with_another_code(place: Place, bound: f64) {
    let (mut worst, cases) = ([0.0f64; 6], cases());
    assert_eq!(cases.len(), 56);
    for case in &cases {
        let mut setup = case.setup.clone();
        setup.gauge.second = true;
        let outcome = one(&setup, place, case.tuple);
        assert!(outcome.status.counts() && !outcome.referred, "line {}: {outcome:?}", case.line);
        let found = errors(case, values(&outcome));
        assert!(found.iter().all(|e| *e <= bound), "line {}: {found:?}", case.line);
        worst = std::array::from_fn(|k| worst[k].max(found[k]));
        // With one gauge the first strain is the same.
        let alone = one(&case.setup, place, case.tuple);
        assert_eq!((alone.strain, alone.arc), (outcome.strain, outcome.arc));
        assert!(alone.strain_2.is_nan() && alone.azimuth == outcome.azimuth);
        let [e1, e2] = [outcome.strain, outcome.strain_2];
        assert!((1.0 + alone.deviation - outcome.strain_linear / e1).abs() < 1e-12);
        assert!((1.0 + outcome.deviation - outcome.strain_linear * e1 / (e1 * e1 + e2 * e2)).abs() < 1e-12);
    }
    println!("{place:?}: {}", told(&worst));
}

#[test]
fn every_backend_answers_tilted_taps() {
    for (place, bound) in [(REFERENCE, 1e-8), (CPU, 1e-5), (CPU_F64, 2e-8), (GPU, 1e-5)] {
        agrees_with_another_code(place, bound);
    }
}

fn rigs() -> [Setup; 5] {
    let rig = Setup { hub: 3.0, ..Setup::default() };
    let neo = rig.clone().material(Material::NeoHookean(3.2)).surface().shear().extension();
    [
        rig.clone(),
        rig.clone().surface().pole_radius(3.0),
        neo.clone(),
        neo.clone().side(Side::Far),
        Setup { drive: Drive::Displacement, ..neo },
    ]
    .map(|mut setup| {
        setup.gauge.second = true;
        setup
    })
}

/// A tap of the prototype; for displacement drive, δ = a θ.
fn tap(setup: &Setup, a: f64, degrees: f64, [tilt, lean]: [f64; 2]) -> Tuple {
    let drive = if setup.drive == Drive::Angle { degrees } else { a * degrees.to_radians() };
    Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, a, tilt, lean, drive, rig: 0 }
}

/// A tilt of 1e-6° changes only the odd quantities, in proportion, also near 9°, where the pole's centre crosses the tangent at the base.
#[test]
fn tiny_tilts_are_no_singularity() {
    for setup in rigs() {
        for degrees in [0.1, 3.0, 7.0, 8.5, 9.0, 9.5, 12.0] {
            for (place, bound) in [(REFERENCE, 1e-9), (CPU_F64, 1e-8)] {
                let at = |tilt| one(&setup, place, tap(&setup, 36.0, degrees, [tilt, 0.0]));
                let (upright, tiny, small) = (at(0.0), at(1e-6), at(1e-2));
                for (tiny, upright) in [(tiny.strain, upright.strain), (tiny.arc, upright.arc)] {
                    assert!((tiny / upright - 1.0).abs() < bound, "{degrees}: {tiny} {upright}");
                }
                let ratio = |o: &Outcome, of: f64| o.azimuth / of.to_radians();
                assert!(
                    (ratio(&tiny, 1e-6) / ratio(&small, 1e-2) - 1.0).abs() < 1e-3,
                    "{degrees}: {tiny:?} {small:?}"
                );
                assert!((tiny.slide / small.slide - 1e-4).abs() < 1e-7);
            }
        }
    }
}

#[test]
fn sticking_contacts_do_not_know_the_tilt() {
    let mut setup = Setup::default().shear().extension().contact(Contact::Stick);
    for (place, bound) in [(REFERENCE, 0.0), (CPU_F64, 1e-8), (CPU, 1e-5)] {
        setup.gauge.second = false;
        let upright = one(&setup, place, tap(&setup, 30.0, 5.0, [0.0; 2]));
        setup.gauge.second = true;
        let tilted = one(&setup, place, tap(&setup, 30.0, 5.0, [30.0, -10.0]));
        // Two gauges are for another solver than one.
        for (one, other) in [(upright.strain, tilted.strain), (upright.arc, tilted.arc)] {
            assert!((other / one - 1.0).abs() <= bound, "{upright:?}, {tilted:?}");
        }
        assert_eq!((tilted.azimuth, tilted.slide), (0.0, 0.0));
        // Only the stretch of the centreline: positive, and far below the bending strain.
        assert!(tilted.strain_2 > 0.0 && tilted.strain_2 < 0.2 * tilted.strain, "{tilted:?}");
    }
}

#[test]
fn a_second_gauge_leaves_the_first_as_it_is() {
    for (place, bound) in [(CPU, 1e-5), (CPU_F64, 1e-8), (REFERENCE, 0.0)] {
        for mut setup in rigs() {
            let tuples: Vec<Tuple> = (1..40)
                .map(|k| tap(&setup, 20.0 + 0.5 * f64::from(k), 0.25 * f64::from(k), [0.0; 2]))
                .collect();
            let both = evaluate(&setup, place.open(&setup), &tuples);
            setup.gauge.second = false;
            let alone = evaluate(&setup, place.open(&setup), &tuples);
            for ((both, _), (alone, _)) in both.iter().zip(&alone) {
                for (both, alone) in [
                    (both.strain, alone.strain),
                    (both.normal_force, alone.normal_force),
                    (both.arc, alone.arc),
                ] {
                    assert!((both / alone - 1.0).abs() <= bound, "{both} {alone}");
                }
                assert_eq!(both.tangential_force, alone.tangential_force);
                assert!(alone.azimuth.is_nan() && alone.slide.is_nan() && alone.strain_2.is_nan());
                assert_eq!((both.azimuth, both.slide), (0.0, 0.0));
            }
        }
    }
}
