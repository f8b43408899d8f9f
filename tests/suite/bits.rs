//! The bits of a tap depend on that tap alone: not on parts, order, threads, stops, or the whiskers and poles solved with it.

use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, sweep_into};
use crate::parts::{joined, joined_each, tables};

fn rows(columns: &[(&str, &[f64])]) -> (String, Vec<String>) {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let add = |rows: Vec<String>, values: &[f64]| -> Vec<String> {
        rows.iter().flat_map(|row| values.iter().map(move |x| format!("{row}{x},"))).collect()
    };
    let all = columns.iter().fold(vec![String::new()], |rows, (_, values)| add(rows, values));
    (names.join(","), all.iter().map(|row| row.trim_end_matches(',').to_owned()).collect())
}

/// 27 whiskers at four or five of nine pairs of distance and angle: from hardly bent to slipping off.
fn sizes(more: &[(&str, &[f64])]) -> (String, Vec<String>) {
    let whisker: [(&str, &[f64]); 5] = [
        ("D_mm", &[8.0, 10.0, 12.0]),
        ("d_mm", &[5.0, 6.0, 7.0]),
        ("L_a_mm", &[30.0, 40.0, 60.0]),
        ("x_ss_mm", &[5.0]),
        ("l_mm", &[2.0]),
    ];
    let tap: [(&str, &[f64]); 2] = [("a_mm", &[12.0, 21.0, 27.0]), ("theta_deg", &[5.0, 18.0, 35.0])];
    let (head, all) = rows(&[&whisker[..], more, &tap[..]].concat());
    (head, all.into_iter().step_by(2).collect())
}

fn spec(whisker: &str, model: &str, output: &str) -> String {
    format!(
        "[tuples]\nfile = \"list.csv\"\n[whisker]\n{whisker}\n[gauge]\nnoise_strain = 1e-6\n[model]\n{model}\n[output]\n{output}\n"
    )
}

fn text(head: &str, rows: &[String]) -> String {
    format!("{head}\n{}\n", rows.join("\n"))
}

fn shuffled(rows: &[String]) -> Vec<String> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by_key(|i| i * 7919 % 10_007);
    order.into_iter().map(|i| rows[i].clone()).collect()
}

fn swept(spec: &str, list: &str, place: Place, threads: usize) -> Vec<(String, Vec<u8>)> {
    let out = tempfile::tempdir().expect("a folder");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| sweep_into(out.path(), spec, Some(list), place))
        .unwrap_or_else(|e| panic!("{e}\n{spec}"));
    tables(out.path())
}

fn lines(tables: &[(String, Vec<u8>)]) -> Vec<String> {
    let text = |(name, bytes): &(String, Vec<u8>)| {
        let text = String::from_utf8(bytes.clone()).expect("text");
        text.lines().map(|line| format!("{name}: {line}")).collect::<Vec<_>>()
    };
    let mut all: Vec<String> = tables.iter().flat_map(text).collect();
    all.sort();
    all
}

fn every_way(
    (whisker, model): (&str, &str),
    (head, rows): &(String, Vec<String>),
    place: Place,
    parts: &[u32],
) {
    let (csv, list) = (spec(whisker, model, ""), text(head, rows));
    let whole = swept(&csv, &list, place, 1);
    assert!(whole == swept(&csv, &list, place, 2), "other bytes on two threads, {place:?}:\n{csv}");
    let other = swept(&csv, &text(head, &shuffled(rows)), place, 1);
    let (one, other) = (lines(&whole), lines(&other));
    assert_eq!(one.len(), other.len());
    let apart = one.iter().zip(&other).filter(|(a, b)| a != b).count();
    assert_eq!(apart, 0, "rows of another order on {place:?}, of {}:\n{csv}", one.len());
    let (first, others) = parts.split_at(1);
    joined_each(&csv, &list, place, first);
    if !others.is_empty() {
        joined_each(&spec(whisker, model, "format = \"parquet\""), &list, place, others);
    }
}

const STEPPED: &str = "bore = [[0, 3], [12, 2], [20, 1]]";

/// Stepped bores, power profiles, curved whiskers and soft roots, with the options that change how they are solved.
#[test]
fn a_built_tap_has_the_same_bits_whatever_is_beside_it() {
    every_way((STEPPED, ""), &sizes(&[]), CPU, &[2, 3, 7]);
    every_way((STEPPED, "surface = true\nshear = true\npole_radius = 2"), &sizes(&[]), CPU_F64, &[7, 3]);
    for (whisker, model) in [
        ("exponent = 1.7", "extension = true"),
        ("exponent = 0.6\ncurvature = 0.004", "surface = true"),
        ("curvature = 0.01\ncurvature_slope = -1e-4\nroot = { k_theta = 500, k_y = 20 }", "shear = true"),
        ("exponent = 1.3", "extension = true\nsurface = true\nmaterial = { neo-hookean = 3.2 }"),
        ("core = { diameter = 0.5, modulus = 60000 }", "extension = true\ncontact = { coulomb = 0.3 }"),
    ] {
        every_way((whisker, model), &sizes(&[]), CPU, &[3]);
    }
}

/// Cones: Hooke's rod, rubber with every effect, and friction.
#[test]
fn a_tap_of_a_cone_has_the_same_bits_whatever_is_beside_it() {
    let all = "surface = true\nshear = true\nextension = true\n";
    let coulomb = format!("{all}contact = {{ coulomb = 0.3 }}");
    for model in ["", &format!("{all}material = {{ neo-hookean = 3.2 }}"), &coulomb] {
        for place in [CPU, CPU_F64, GPU] {
            every_way(("", model), &sizes(&[]), place, &[3]);
        }
    }
}

#[test]
fn a_built_tap_has_the_same_bits_on_a_device_whatever_is_beside_it() {
    every_way((STEPPED, ""), &sizes(&[]), GPU, &[2, 3]);
}

/// Straight and curved, solid and hollow whiskers, cones and power profiles in one file.
#[test]
fn a_tap_has_the_same_bits_beside_whiskers_of_other_shapes() {
    let shapes: [(&str, &[f64]); 4] = [
        ("exponent", &[1.0, 1.5]),
        ("bore_mm", &[0.0, 2.0]),
        ("kappa_base_per_mm", &[0.0, 0.005]),
        ("hub_mm", &[0.0, 3.0]),
    ];
    let (head, all) = sizes(&shapes);
    let some: Vec<String> = all.into_iter().step_by(7).collect();
    for place in [CPU, GPU] {
        every_way(("", "extension = true"), &(head.clone(), some.clone()), place, &[3, 2]);
    }
}

#[test]
fn an_upright_tap_has_the_same_bits_beside_tilted_ones() {
    let (head, all) = sizes(&[("tilt_deg", &[0.0, 15.0])]);
    let some: Vec<String> = all.into_iter().step_by(9).collect();
    every_way((STEPPED, ""), &(head, some), CPU, &[3]);
    let (head, all) = sizes(&[("tilt_deg", &[0.0, 15.0])]);
    every_way(("", "extension = true"), &(head, all), CPU, &[3]);
}

#[test]
fn a_solid_tap_has_the_same_bits_whatever_is_beside_it() {
    every_way(("", "solid = true\npole_radius = 2"), &sizes(&[]), CPU, &[2, 7]);
}

fn grid(whisker: &str, output: &str) -> String {
    format!(
        "[whisker]\nD = [8, 10, 12]\nd = [5, 6, 7]\nL_a = [30, 40, 60]\n{whisker}\n[gauge]\nx_ss = [4, 5]\nl = 2\nnoise_strain = 1e-6\n\
         [tap]\na = [12, 21, 27]\ntheta = {{ from = 1, to = 35, steps = 18 }}\n[output]\n{output}\n"
    )
}

/// Solved and ranked grids, also with axes of the whisker's shape, in as many parts as threads and in more.
#[test]
fn grids_of_built_whiskers_have_the_same_bytes_in_parts() {
    let shapes = "exponent = [1, 1.4]\ncurvature = [0, 0.005]\nbore = [0, 2]\nhub = [0, 3]";
    for (whisker, output, parts) in [
        (STEPPED, "", 7),
        (STEPPED, "format = \"parquet\"\ntuples = false", 2),
        (STEPPED, "top = 9\nby = \"total_rms_mm\"", 3),
        ("exponent = [0.7, 1.6]", "top = 9\nper = \"design\"", 3),
    ] {
        joined(&grid(whisker, output), "", CPU, parts);
    }
    let few = grid(shapes, "").replace("steps = 18", "steps = 2").replace("x_ss = [4, 5]", "x_ss = 4");
    joined(&few, "", CPU, 3);
    joined(&few.replace("[output]", "[model]\nsurface = true\n[output]\ntop = 20"), "", CPU_F64, 2);
}
