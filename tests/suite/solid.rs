//! The rod with clamp, indentation, distorting sections and foil against 3D finite elements (model §8), and its kernels against the reference.

use std::collections::HashMap;

use crate::common;
use crate::common::program::Desk;
use vibrissa::physics::driven::Driven;
use vibrissa::physics::rod::{RodProblem, RodTap};
use vibrissa::physics::solid::Bonded;
use vibrissa::physics::taper::Taper;
use vibrissa::scene::{Clamp, Foil, Material, Model, Side};

const E: f64 = 3.2;
const SMALL: f64 = 1e-5;

const ROD: Model =
    Model { surface: true, shear: true, extension: true, material: Material::Hooke(E), ..Model::PLAIN };

type Row = HashMap<String, String>;

fn rows(file: &str) -> Vec<Row> {
    crate::common::cases::rows(&format!("solid/{file}"))
}

fn number(row: &Row, column: &str) -> f64 {
    let text = &row[column];
    if text.is_empty() { f64::NAN } else { text.parse().expect("a number") }
}

fn tap(row: &Row, model: &Model, x_ss: f64, theta: f64, side: Side, foil: Option<Foil>) -> RodTap {
    let get = |column| number(row, column);
    let taper = Taper::new(get("D_mm"), get("d_mm"), 50.0);
    let gauge = taper.gauge(x_ss, get("l_mm"));
    let foil = foil.map(|foil| Bonded::new(&foil, &taper, gauge, E));
    let distance = get("a_mm");
    let driven = Driven::Radians(theta);
    RodProblem { taper, gauge, side, distance, driven, foil, ..common::tap(model, 4.0, distance, 1.0) }
        .solve()
        .unwrap_or_else(|error| panic!("{row:?}: {error}"))
}

/// Largest |found/expected − 1|; also printed.
fn worst(what: &str, pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let errors: Vec<f64> = pairs.map(|(found, expected)| found / expected - 1.0).collect();
    let (least, most) = errors.iter().fold((f64::MAX, f64::MIN), |(l, m), e| (l.min(*e), m.max(*e)));
    println!("{what}: {least:+.2e} … {most:+.2e} of {} cases", errors.len());
    assert!(errors.iter().all(|e| e.is_finite()), "{what}: {errors:?}");
    assert!(!errors.is_empty());
    most.max(-least)
}

#[test]
fn a_bonded_clamp_is_that_of_three_dimensions() {
    let model = Model { clamp: Clamp::Bonded, distorting: true, ..ROD };
    let rigid = Model { clamp: Clamp::Rigid, ..ROD };
    let cases = rows("solid_linear");
    let near = |row: &&Row| number(row, "a_mm") >= 18.0;
    let at = |row: &Row, model: &Model| tap(row, model, number(row, "x_ss_mm"), SMALL, Side::Contact, None);
    let angle = |model: Model| {
        let pair = move |row: &Row| (SMALL / at(row, &model).normal_force, number(row, "theta_rad_per_N"));
        cases.iter().filter(near).map(pair)
    };
    assert!(worst("θ per newton, bonded", angle(model)) < 1.6e-3);
    assert!(worst("θ per newton, rigid", angle(rigid)) > 0.05);
    let clear = |row: &&Row| number(row, "a_mm") - number(row, "x_ss_mm") >= 14.0;
    // Half the difference of both sides: the cases omit the axial strain by the force along a taper.
    let strain = |row: &Row| {
        let of = |side| tap(row, &model, number(row, "x_ss_mm"), SMALL, side, None);
        let [near, far] = [Side::Contact, Side::Far].map(of);
        (0.5 * (near.strain - far.strain) / near.normal_force, number(row, "strain_per_N"))
    };
    assert!(worst("strain per newton", cases.iter().filter(near).filter(clear).map(strain)) < 5e-3);
}

#[test]
fn other_clamps_are_those_of_three_dimensions() {
    for (name, clamp, bound) in [
        ("glued sleeve", Clamp::Glued, 2e-3),
        ("smooth sleeve", Clamp::Socket, 0.02),
        ("bonded face", Clamp::Bonded, 2e-3),
    ] {
        let of = |row: &&Row| row["clamp"].starts_with(name) && number(row, "a_mm") >= 21.0;
        let cases = rows("solid_clamps");
        let pair = |row: &Row| {
            let model = Model { clamp, nu: number(row, "nu"), ..ROD };
            let tap = tap(row, &model, number(row, "x_ss_mm"), SMALL, Side::Contact, None);
            (SMALL / tap.normal_force, number(row, "theta_rad_per_N"))
        };
        assert!(worst(&format!("θ per newton, {name}"), cases.iter().filter(of).map(pair)) < bound);
    }
}

/// Largest error of a tap at a finite angle, and the error in the difference between the sides, as a share of the strain.
fn finite(row: &Row, material: Material) -> [f64; 2] {
    let (clamp, pole_radius) = (Clamp::Bonded, number(row, "pole_radius_mm"));
    let model = Model { clamp, distorting: true, indentation: true, pole_radius, material, ..ROD };
    let (x_ss, theta) = (number(row, "x_ss_mm"), number(row, "theta_deg").to_radians());
    let [near, far] = [Side::Contact, Side::Far].map(|side| tap(row, &model, x_ss, theta, side, None));
    let [on, off, force] = ["strain_contact", "strain_far", "normal_force_N"].map(|c| number(row, c));
    let pairs = [(near.strain, on), (far.strain, off), (near.normal_force, force)];
    let apart = (near.strain + far.strain) / near.strain - (on + off) / on;
    [worst(&format!("{row:?}"), pairs.into_iter()), apart.abs()]
}

#[test]
fn taps_at_finite_angles_are_those_of_three_dimensions() {
    for row in rows("solid_finite") {
        let bound = if row["mesh"] == "coarse" { 0.01 } else { 5e-3 };
        assert!(finite(&row, Material::NeoHookean(E))[0] < bound, "{row:?}");
    }
}

/// Taps of results/2026-11-23-solid/finite_laws.csv, on a coarse mesh that is 0.7 to 1 % too stiff at 10° for every law.
#[test]
fn taps_of_other_laws_are_those_of_three_dimensions() {
    for mut row in rows("finite_laws") {
        row.extend([("l_mm", "2"), ("x_ss_mm", "5")].map(|(key, value)| (key.into(), value.into())));
        let share = E / 3.0;
        let material = match row["law"].as_str() {
            "yeoh" => Material::Yeoh([0.5, -0.08, 0.02].map(|c| share * c)),
            _ => Material::MooneyRivlin([0.35, 0.15].map(|c| share * c)),
        };
        // The mesh hardly affects the difference between the sides.
        let [error, apart] = finite(&row, material);
        assert!(error < 0.02 && apart < 3e-3, "{row:?}: {error} {apart}");
    }
}

/// Largest errors of reading per force and of θ per force with the foils of `cases`.
fn foils<'a>(cases: impl Iterator<Item = &'a Row>) -> [f64; 2] {
    let model = Model { clamp: Clamp::Bonded, distorting: true, ..ROD };
    let mut all = [Vec::new(), Vec::new()];
    for row in cases {
        let get = |column| number(row, column);
        let foil = Foil {
            stiffness: get("foil_stiffness_N_per_mm"),
            length: get("foil_length_mm"),
            width: get("foil_width_mm"),
            strain_limit: None,
        };
        let place = get("x_centre_mm") - 0.5 * get("l_mm");
        let [bare, with] = [None, Some(foil)].map(|foil| tap(row, &model, place, SMALL, Side::Contact, foil));
        all[0].push((with.strain / with.normal_force, get("gauge_strain_per_N")));
        all[1].push((bare.normal_force / with.normal_force, 1.0 + get("theta_change_relative")));
    }
    let [reading, angle] = all;
    [worst("reading per newton", reading.into_iter()), worst("θ per newton", angle.into_iter())]
}

/// The foil of the documentation, and those of `benches/solid`, 1.5 and 5 mm wide.
#[test]
fn foils_read_and_stiffen_as_in_three_dimensions() {
    let [reading, angle] = foils(rows("solid_foil").iter().filter(|row| row["mesh"] == "fine"));
    assert!(reading < 0.045 && angle < 0.01, "{reading} {angle}");
    let [reading, angle] = foils(rows("foil_widths").iter());
    assert!(reading < 0.12 && angle < 0.01, "{reading} {angle}");
}

const SPEC: &str = "[whisker]\nD = 10\nd = [4, 10]\nL_a = 50\nhub = HUB\n[gauge]\nx_ss = [5, 8]\nl = 2\nside = \"SIDE\"\nFOIL\n[tap]\nDRIVE\na = [21, 33, 48]\nMODEL\n";

fn spec(hub: &str, side: &str, foil: &str, drive: &str, model: &str) -> String {
    let spec = SPEC.replace("HUB", hub).replace("SIDE", side).replace("FOIL", foil);
    spec.replace("DRIVE", drive).replace("MODEL", model)
}

#[test]
fn a_calibration_tells_where_the_clamp_holds_the_whisker() {
    let rig = |c0: &str| {
        let model = format!("[model]\nclamp = {c0}\nshear = true\nsurface = true");
        spec("0", "contact", "noise_strain = 1e-6", "theta = [2, 6]", &model)
            .replace("[5, 8]", "5")
            .replace("[4, 10]", "4")
            .replace("[21, 33, 48]", "{ from = 21, to = 48, steps = 8 }")
    };
    let desk = Desk::new(&rig("-0.05"));
    desk.ok("simulate spec.toml --out data --quiet");
    desk.write("known.toml", rig("0.054"));
    desk.ok("calibrate data/measurements.csv --whisker known.toml --fit c0 --out c");
    let text = desk.read("c/calibration.toml");
    let found = text.lines().find_map(|line| line.strip_prefix("c0 = ")).expect("c0");
    assert!((found.parse::<f64>().unwrap() + 0.05).abs() < 2e-3, "{found}");
    desk.write("rigid.toml", rig("\"rigid\""));
    desk.refuses("calibrate data/measurements.csv --whisker rigid.toml --fit c0 --out d", &["c0", "0.054"]);
}

#[test]
fn what_a_foil_is_made_of_is_doubted_and_no_page_has_one() {
    let spec = |gauge: &str| {
        format!(
            "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n{gauge}\n[tap]\na = [21, 33]\ntheta = 4\n[model]\npole_radius = 3\n"
        )
    };
    let soft = "foil = { thickness = 0.03, modulus = 3, length = 6.3, width = 2.8 }";
    let ran = Desk::new(&spec(soft)).ok("sweep spec.toml --out out");
    assert!(ran.stderr.contains("GPa"), "{}", ran.stderr);
    let desk = Desk::new(&spec("foil = \"KFGS-2-120\""));
    desk.refuses("explore spec.toml --out p.html", &["spec.toml:8: gauge.foil = \"KFGS-2-120\""]);
}
