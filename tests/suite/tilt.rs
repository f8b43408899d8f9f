//! Poles that are not upright (model §6): what another code says of 56 of them, on every backend, and the symmetries.

use std::collections::HashMap;

use vibrissa::physics::rod::{RodProblem, TiltedTap};
use vibrissa::physics::taper::Taper;
use vibrissa::scene::{Drive, Material, Setup, Tuple};

/// A tap and its answer; angles in degrees.
#[derive(Debug, Clone)]
struct Case {
    line: usize,
    setup: Setup,
    tuple: Tuple,
    direction: [f64; 2],
    strain: f64,
    strain_2: f64,
    azimuth: f64,
    force: f64,
    arc: f64,
    slide: f64,
}

/// All rows of the file.
fn cases() -> Vec<Case> {
    let path = format!("{}/tests/data/tilt_cases.csv", env!("CARGO_MANIFEST_DIR"));
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).expect("the cases are there");
    let case = |(i, row): (usize, Result<HashMap<String, String>, csv::Error>)| {
        let row = row.expect("well formed");
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
        Case {
            line: i + 3,
            tuple: Tuple {
                D: get("D_mm"),
                d: get("d_mm"),
                L_a: get("L_a_mm"),
                x_ss: get("x_ss_mm"),
                l: get("l_mm"),
                a: get("a_mm"),
                drive: get(drive.column()),
                ..Tuple::default()
            },
            setup,
            direction: [get("tilt_deg"), get("lean_deg")],
            strain: get("strain"),
            strain_2: get("strain_2"),
            azimuth: get("bending_azimuth_deg"),
            force: get("normal_force_N"),
            arc: get("contact_arc_mm"),
            slide: get("slide_mm"),
        }
    };
    reader.deserialize().enumerate().map(case).collect()
}

/// What the reference rod says of `case` for a pole of `direction`, degrees.
fn reference(case: &Case, direction: [f64; 2]) -> TiltedTap {
    let Tuple { D, d, L_a, x_ss, l, a, drive, .. } = case.tuple;
    let taper = Taper::new(D, d, L_a);
    let problem = RodProblem {
        taper,
        gauge: taper.gauge(x_ss, l),
        side: case.setup.gauge.side,
        distance: a,
        hub: case.setup.hub,
        drive: case.setup.drive,
        amount: vibrissa::design::amount(case.setup.drive, drive),
        model: &case.setup.model,
    };
    problem.solve_tilted(direction.map(f64::to_radians)).expect("it converges")
}

/// Relative error of strains, azimuth (rad), force, arc and slide: of strains to the larger, of the slide to the arc.
fn errors(case: &Case, tap: &TiltedTap) -> [f64; 6] {
    let larger = case.strain.abs().max(case.strain_2.abs());
    [
        (tap.tap.strain - case.strain) / larger,
        (tap.strain_2 - case.strain_2) / larger,
        tap.azimuth - case.azimuth.to_radians(),
        tap.tap.normal_force / case.force - 1.0,
        tap.tap.contact_arc / case.arc - 1.0,
        (tap.slide - case.slide) / case.arc,
    ]
    .map(f64::abs)
}

#[test]
fn the_reference_is_right_about_tilted_poles() {
    let cases = cases();
    assert_eq!(cases.len(), 56);
    let mut worst = [0.0f64; 6];
    for case in &cases {
        let found = errors(case, &reference(case, case.direction));
        assert!(found.iter().all(|e| *e <= 1e-8), "line {}: {found:?}", case.line);
        worst = std::array::from_fn(|k| worst[k].max(found[k]));
    }
    println!("worst of strain, strain_2, azimuth, force, arc, slide: {worst:?}");
}

#[test]
fn the_reference_mirrors_tilt_and_lean() {
    for case in cases().iter().step_by(5) {
        let [tilt, lean] = case.direction;
        let (one, other) = (reference(case, [tilt, lean]), reference(case, [-tilt, -lean]));
        let near = |x: f64, y: f64, size: f64| assert!((x - y).abs() <= 1e-10 * size.abs(), "{x} {y}");
        near(one.tap.strain, other.tap.strain, case.strain);
        near(one.tap.normal_force, other.tap.normal_force, case.force);
        near(one.tap.contact_arc, other.tap.contact_arc, case.arc);
        near(one.azimuth, -other.azimuth, 1.0);
        near(one.slide, -other.slide, case.arc);
    }
}
