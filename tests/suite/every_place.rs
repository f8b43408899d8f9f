//! Sweeps on every backend against the reference: cones with their wrench, whiskers as built, solids with foils, very small taps.

use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, REFERENCE, Row, number, sweep};

/// Allowed strain error, relative to the strain or to 1e-3 of the largest strain of the same whisker and drive. Five times as much for forces
/// (relative to the total force), arc and moment.
const CPUS: [(Place, f64); 2] = [(CPU, 1e-5), (CPU_F64, 2e-8)];
const ALL: [(Place, f64); 3] = [CPUS[0], CPUS[1], (GPU, 1e-5)];

/// Fails unless sweeps on `places` have the words and numbers of the reference, and most taps have numbers.
#[track_caller]
fn agrees(text: &str, places: &[(Place, f64)]) {
    let known = sweep(text, REFERENCE).tuples;
    let end = known.columns.iter().position(|c| c == "a_mm").expect("distances");
    let inputs: Vec<&String> = known.columns[..end]
        .iter()
        .chain(known.columns.iter().filter(|c| c.starts_with("theta") || c.starts_with("delta")))
        .collect();
    let read = if known.columns.iter().any(|c| c == "signal") { "signal" } else { "strain" };
    let alike = |row: &Row, other: &Row| inputs.iter().all(|c| row[*c] == other[*c]);
    let size = |row: &Row| number(row, read).map_or(0.0, f64::abs);
    let least: Vec<f64> = known
        .rows
        .iter()
        .map(|row| 1e-3 * known.rows.iter().filter(|other| alike(row, other)).map(size).fold(0.0, f64::max))
        .collect();
    for &(place, bound) in places {
        let found = sweep(text, place).tuples;
        let mut compared = 0;
        for ((row, right), least) in found.rows.iter().zip(&known.rows).zip(&least) {
            let said = || format!("{place:?}\n{text}{row:?}\n{right:?}");
            assert_eq!(
                (&row["status"], &row["contact_state"]),
                (&right["status"], &right["contact_state"]),
                "{}",
                said()
            );
            let at = |row: &Row, column: &str| {
                row.get(column).filter(|x| !x.is_empty()).map(|_| number(row, column).expect("a number"))
            };
            let of = |columns: [&str; 2]| columns.iter().filter_map(|c| at(right, c)).fold(0.0, f64::hypot);
            let (pressed, held) =
                (of(["normal_force_N", "tangential_force_N"]), of(["base_fx_N", "base_fy_N"]));
            for (column, share, scale) in [
                (read, 1.0, size(right).max(*least)),
                ("normal_force_N", 5.0, pressed),
                ("tangential_force_N", 5.0, pressed),
                ("contact_arc_mm", 5.0, 0.0),
                ("base_moment_Nmm", 5.0, 0.0),
                ("base_fx_N", 5.0, held),
                ("base_fy_N", 5.0, held),
                ("strain_2", 1.0, of([read, "strain_2"]).max(*least)),
                ("bending_azimuth_deg", 1.0, 1f64.to_degrees()),
            ] {
                let (Some(x), Some(y)) = (at(row, column), at(right, column)) else {
                    assert_eq!(at(row, column), at(right, column), "{column}: {}", said());
                    continue;
                };
                let error = (x - y).abs() / if scale > 0.0 { scale } else { y.abs() };
                assert!(x == y || error <= share * bound, "{column} by {error:.1e}: {}", said());
                compared += 1;
            }
        }
        assert!(compared > 2 * known.rows.len(), "{compared} numbers are compared: {text}");
    }
}

#[test]
fn cones_and_their_wrench() {
    let models = [
        "",
        "surface = true\nshear = true\nextension = true\npole_radius = 3\nmaterial = { neo-hookean = 3.2 }",
        "extension = true\ncontact = \"stick\"",
        "extension = true\nsurface = true\ncontact = { coulomb = 0.3 }",
        "surface = true\nshear = true\nextension = true\npole_radius = 4\ncontact = \"stick\"",
        "surface = true\nshear = true\nextension = true\npole_radius = 4\ncontact = { coulomb = 0.4 }",
        "geometry = \"linear\"\nshear = true",
    ];
    let drives = ["theta = [0.1, 2, 12]", "drive = \"displacement\"\ndelta = [0.1, 1, 4]"];
    for (k, (model, drive)) in models.iter().flat_map(|model| drives.map(|drive| (model, drive))).enumerate()
    {
        for (j, signal) in ["strain", "moment", "force"].into_iter().enumerate() {
            let text = format!(
                "[whisker]\nD = [8, 10]\nd = [2, 10]\nL_a = 50\nhub = 6\n[gauge]\nx_ss = 5\nl = 2\n[sensor]\nsignal = {signal:?}\n\
                 [tap]\na = [12, 25, 40]\n{drive}\n[model]\n{model}\n[output]\nwrench = true\n"
            );
            // A device compiles a kernel for each combination: it gets one signal of each model and drive.
            agrees(&text, if j == k % 3 { &ALL } else { &CPUS });
        }
    }
}

fn built(whisker: &str, gauge: &str, tap: &str, model: &str) -> String {
    let cone = if whisker.contains("profile") { "" } else { "D = 10\nd = 6\nL_a = 50\n" };
    format!("[whisker]\n{cone}{whisker}\n[gauge]\nx_ss = 5\n{gauge}\n[tap]\n{tap}\n[model]\n{model}\n")
}

/// From 1e-4° or 1e-4 mm; drives fall, so that a pack begins with large taps.
#[test]
fn whiskers_as_built_at_small_drives() {
    let falling = |from: f64, step: f64| {
        let large = (0..16).map(|k| from - step * f64::from(k));
        large.chain([1.0, 0.3, 0.1, 0.01, 1e-3, 1e-4]).collect::<Vec<f64>>()
    };
    let turned = format!("a = [33, 15, 45]\ntheta = {:?}", falling(10.0, 0.5));
    let lifted = format!("a = [33, 15, 45]\ndrive = \"displacement\"\ndelta = {:?}", falling(5.0, 0.2));
    let pole = "pole_radius = 20\nextension = true\nsurface = true\nshear = true";
    let law = "material = { yeoh = [0.5, -0.08, 0.02] }\nsurface = true\nnu = 0.45";
    for (whisker, tap, model) in [
        ("bore = 4", &turned, pole),
        ("bore = 4", &lifted, pole),
        ("core = { diameter = 0.5, modulus = 60_000 }", &turned, "surface = true"),
        ("exponent = 0.5", &turned, pole),
        ("exponent = 3", &lifted, "surface = true"),
        ("root = { k_theta = 1000, k_y = 20, k_x = 20 }", &turned, pole),
        ("curvature = 0.008\ncurvature_slope = -0.0003", &turned, pole),
        ("curvature = -0.008", &turned, law),
        ("curvature = 0.004", &lifted, "shear = true\nmaterial = { neo-hookean = 3.2 }"),
        ("exponent = 2\ncurvature = 0.005", &lifted, pole),
        ("exponent = 1.5", &turned, "extension = true\nsurface = true\ncontact = { coulomb = 0.1 }"),
        ("profile = [[0, 10], [12, 7], [50, 5]]", &turned, pole),
    ] {
        agrees(&built(whisker, "l = 2", tap, model), &[(CPU, 1e-5)]);
    }
}

/// Contacts from 10 nm beyond the near end of the gauge; friction along the whisker that cancels the bending strain.
#[test]
fn short_levers_and_cancelling_terms() {
    let bent = "profile = [[0, 14.0], [8, 9.0], [50, 4.0]]";
    let sprung = "root = { k_theta = 942.5, k_y = 20.0 }";
    let tap =
        "a = [5.00001, 5.0001, 5.01, 5.05, 5.1, 5.1001, 5.11, 5.2, 5.35, 12, 30]\ntheta = [0.01, 1, 10]";
    for (whisker, model, side) in [
        (bent, "contact = { coulomb = 0.3 }", "far"),
        (bent, "contact = { coulomb = 0.3 }", "contact"),
        (sprung, "contact = \"stick\"", "contact"),
    ] {
        let gauge = format!("l = 0.1\nside = \"{side}\"");
        agrees(&built(whisker, &gauge, tap, &format!("extension = true\n{model}")), &ALL);
    }
}

/// Taps on a foil, where axial and bending strain nearly cancel; also taps of 1e-6°.
#[test]
fn solids_and_foils() {
    let angle = "a = [21, 33, 48]\ntheta = [0.05, 0.5, 5, 12]";
    let moved = "a = [21, 33, 48]\ndrive = \"displacement\"\ndelta = [0.02, 0.3, 3]";
    let near = |theta: &str| format!("a = [5.5, 8.3, 8.5, 9, 12, 21]\ntheta = {theta}");
    let foil = "foil = { stiffness = 100, length = 6.3, width = 2.8 }";
    let solid = "solid = true\npole_radius = 3\nmaterial = { neo-hookean = 3.2 }";
    let rubs =
        "clamp = \"glued\"\nshear = true\nextension = true\nsurface = true\ncontact = { coulomb = 0.3 }";
    let glued =
        "clamp = \"glued\"\nshear = true\nsurface = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";
    let tilted = "a = [21, 33, 48]\ntheta = [1, 5]\ntilt = [0, 30]";
    let fine = [(CPU, 1e-5), (CPU_F64, 1e-7)];
    for (hub, side, foil, tap, model, places) in [
        (0, "contact", "", angle, solid, CPUS),
        (7, "far", "", angle, solid, CPUS),
        (7, "contact", foil, angle, solid, CPUS),
        (0, "far", foil, moved, solid, CPUS),
        (0, "contact", foil, angle, "", CPUS),
        (0, "contact", "", angle, "clamp = \"bonded\"\nshear = true", CPUS),
        (3, "contact", "", angle, "section = \"distorting\"\nsurface = true", CPUS),
        (0, "contact", "", moved, "indentation = true\npole_radius = 1", CPUS),
        (5, "contact", "", angle, rubs, CPUS),
        (0, "contact", "", angle, "clamp = -0.9\nsurface = true", CPUS),
        (2, "contact", "", tilted, "clamp = \"socket\"\nsurface = true", CPUS),
        (7, "far", "", &near("[2, 5, 10]"), glued, fine),
        (0, "contact", "", &near("[0.5, 5]"), solid, fine),
        (0, "contact", "", &near("1e-6"), solid, fine),
    ] {
        let text = format!(
            "[whisker]\nD = 10\nd = [2, 4, 10]\nL_a = 50\nhub = {hub}\n[gauge]\nx_ss = [5, 8]\nl = 2\nside = \"{side}\"\n{foil}\n[tap]\n{tap}\n[model]\n{model}\n"
        );
        agrees(&text, &places);
    }
}

#[test]
fn poles_that_are_not_upright() {
    let neo = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";
    let (turned, moved) = ("theta = [0.2, 3, 11]", "drive = \"displacement\"\ndelta = [0.1, 1.5, 5]");
    for (side, drive, model) in [
        ("contact", turned, ""),
        ("contact", turned, "surface = true\npole_radius = 3"),
        ("contact", turned, neo),
        ("far", turned, neo),
        ("contact", moved, neo),
    ] {
        let text = format!(
            "[whisker]\nD = 10\nd = [2, 6, 10]\nL_a = 50\nhub = 3\n[gauge]\nx_ss = 5\nl = 2\nsecond = true\nside = \"{side}\"\n\
             [tap]\na = [14, 25, 40]\ntilt = [-50, -5, 0, 20]\nlean = [-25, 10]\n{drive}\n[model]\n{model}\n"
        );
        agrees(&text, &CPUS);
    }
}
