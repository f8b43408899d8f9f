//! Axes of properties of whisker, rig and object: rows equal those of sweeps with each value, bit for bit; also in searches.

use crate::common::searching::search;
use crate::common::sweeping::{CPU, CPU_F64, Place, REFERENCE, Row, Swept, Table, number};
use crate::common::sweeping::{ranked, sweep, sweep_with};

const TAP: &str = "[tap]\na = [20, 33]\ntheta = [2, 5]\n";
const GAUGE: &str = "[gauge]\nx_ss = 5\nl = 2\n";

fn spec(whisker: &str, gauge: &str, model: &str) -> String {
    format!("[whisker]\n{whisker}\n{GAUGE}{gauge}\n{TAP}[model]\n{model}\n")
}

const CONE: &str = "D = [10, 9]\nd = 4\nL_a = 50\n";

/// Column; spec with `@` for the value; two values.
fn cases() -> Vec<(&'static str, String, [&'static str; 2])> {
    let cone = |key: &str, model: &str| spec(&format!("{CONE}{key}"), "noise_strain = 20e-6", model);
    let read = |gauge: &str| spec(CONE, gauge, "");
    let profile = |knots: &str| spec(&format!("profile = {knots}\nscale = @"), "noise_strain = 20e-6", "");
    let friction =
        "extension = true\nsurface = true\ncontact = { coulomb = @ }\nmaterial = { neo-hookean = 3.2 }";
    let rubbed = "extension = true\ncontact = { coulomb = 0.3 }\npole_radius = @";
    let foil = "noise_strain = 20e-6\nfoil = { stiffness = @, length = 6.3, width = 2.8 }";
    vec![
        ("exponent", cone("exponent = @", ""), ["1", "2"]),
        ("scale", profile("[[0, 14], [8, 9], [50, 4]]"), ["0.8", "1.1"]),
        ("scale", profile("[[0, 12], [50, 4]]"), ["0.8", "1.25"]),
        ("bore_mm", cone("bore = @", ""), ["0", "3"]),
        ("core_mm", cone("core = { diameter = @, modulus = 60000 }", "shear = true"), ["0.5", "1"]),
        ("E_core_MPa", cone("core = { diameter = 0.5, modulus = @ }", ""), ["1000", "60000"]),
        ("kappa_base_per_mm", cone("curvature = @", ""), ["-0.01", "0"]),
        ("kappa_slope_per_mm2", cone("curvature_slope = @", ""), ["0", "1e-4"]),
        ("k_theta_Nmm_per_rad", cone("root = { k_theta = @ }", ""), ["100", "1000"]),
        ("k_y_N_per_mm", cone("root = { k_theta = 500, k_y = @ }", ""), ["20", "50"]),
        ("k_x_N_per_mm", cone("root = { k_x = @ }", "surface = true"), ["2", "30"]),
        ("hub_mm", cone("hub = @", ""), ["0", "5"]),
        ("E_MPa", cone("", "material = { hooke = @ }"), ["1", "3.2"]),
        ("E_MPa", cone("", "material = { neo-hookean = @ }"), ["1.1", "3.2"]),
        ("nu", cone("", "shear = true\nnu = @"), ["0.3", "0.5"]),
        ("pole_radius_mm", cone("", "pole_radius = @"), ["0", "2"]),
        ("pole_radius_mm", cone("", rubbed), ["0", "2"]),
        ("pole_radius_mm", cone("", "solid = true\npole_radius = @"), ["3", "4"]),
        ("mu", cone("", friction), ["0", "0.3"]),
        ("foil_N_per_mm", read(foil), ["50", "100"]),
        ("noise", read("noise_strain = @"), ["1e-5", "5e-5"]),
        ("noise", read("[sensor]\nsignal = \"moment\"\nnoise = @"), ["0.01", "0.9"]),
    ]
}

fn without(row: &Row, column: &str) -> Row {
    let mut row = row.clone();
    row.remove(column);
    row
}

const CURVED: &str = "x_a_mm";

/// Fails unless the rows of `all` with `column` = value are the rows of the sweep with that value.
#[track_caller]
fn same_rows(what: &str, column: &str, all: &Table, each: &[(f64, &Table)]) {
    let place = all.columns.iter().position(|name| name == column);
    assert_eq!(place, Some(5), "{what}: {:?}", all.columns);
    let mut count = 0;
    for (value, one) in each {
        let own: Vec<Row> = all
            .rows
            .iter()
            .filter(|row| number(row, column) == Some(*value))
            .map(|row| without(row, column))
            // The sweep of a straight whisker has no column for the abscissa.
            .map(|row| if one.columns.iter().any(|c| c == CURVED) { row } else { without(&row, CURVED) })
            .collect();
        assert!(!own.is_empty() && own == one.rows, "{what}, {column} = {value}");
        assert!(!one.columns.iter().any(|name| name == column), "{what}: {:?}", one.columns);
        count += own.len();
    }
    assert_eq!(count, all.rows.len(), "{what}");
}

/// Sweeps `text` with both `values` as an axis in place of `@`, and with each: the rows must agree.
#[track_caller]
fn equals_each(what: &str, column: &str, text: &str, values: [&str; 2], place: Place) {
    let all = sweep(&text.replace('@', &format!("[{}]", values.join(", "))), place);
    let each = values.map(|value| (value.parse().unwrap(), sweep(&text.replace('@', value), place)));
    let tables: [fn(&Swept) -> &Table; 3] = [|s| &s.tuples, |s| &s.designs, |s| &s.distances];
    for table in tables {
        same_rows(what, column, table(&all), &each.each_ref().map(|(value, one)| (*value, table(one))));
    }
    let taps: u64 = each.iter().map(|(_, one)| one.report.counts.taps).sum();
    assert_eq!(all.report.counts.taps, taps, "{what}, {column}");
}

fn equals_its_values(place: Place, wanted: impl Fn(&str) -> bool) {
    for (column, text, values) in cases().into_iter().filter(|(column, ..)| wanted(column)) {
        equals_each("", column, &text, values, place);
    }
}

#[test]
fn an_axis_gives_the_rows_of_the_sweeps_of_its_values() {
    equals_its_values(CPU, |_| true);
    equals_its_values(CPU_F64, |column| !column.starts_with('k'));
    equals_its_values(REFERENCE, |column| ["exponent", "E_MPa", "nu", "hub_mm", "noise"].contains(&column));
}

#[test]
fn own_models_and_second_gauges_know_their_rig() {
    for estimate in ["[estimate]\ntheory = \"exact\"\n", "[estimate]\nconvention = \"elongation\"\n"] {
        for (column, key) in [("hub_mm", "hub = @"), ("exponent", "exponent = @")] {
            let text = spec(&format!("{CONE}{key}"), "noise_strain = 1e-5", "") + estimate;
            equals_each(estimate, column, &text, ["1", "2"], CPU);
        }
    }
    let text = spec(&format!("{CONE}hub = @"), "second = true\nnoise_strain = 1e-5", "")
        .replace("theta", "tilt = [0, 20]\ntheta")
        + "[estimate]\ntheory = \"exact\"\n";
    equals_each("two gauges", "hub_mm", &text, ["0", "4"], CPU);
}

/// Two axes of different kinds, besides D and l.
pub const TWO: &str = "[whisker]\nD = [10, 9]\nd = 4\nL_a = 50\nbore = [1, 3]\nhub = { from = 0, to = 4, steps = 2 }\n\
                   [gauge]\nx_ss = 5\nl = [1, 2]\nnoise_strain = 1e-5\n[tap]\na = [20, 33]\ntheta = [2, 5]\n";

#[test]
fn rows_are_nested_after_l_and_before_a() {
    let all = sweep(TWO, CPU);
    let mut wanted = Vec::new();
    for big in [10.0, 9.0] {
        for l in [1.0, 2.0] {
            for bore in [1.0, 3.0] {
                for hub in [0.0, 4.0] {
                    for a in [20.0, 33.0] {
                        wanted.extend([2.0, 5.0].map(|theta| [big, l, bore, hub, a, theta]));
                    }
                }
            }
        }
    }
    let columns = ["D_mm", "l_mm", "bore_mm", "hub_mm", "a_mm", "theta_deg"];
    let rows: Vec<_> = all.tuples.rows.iter().map(|r| columns.map(|c| number(r, c).unwrap())).collect();
    assert_eq!(rows, wanted);
    let head = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,bore_mm,hub_mm,";
    assert!(all.tuples.text.starts_with(&format!("{head}a_mm,theta_deg,strain,")), "{:.90}", all.tuples.text);
    assert!(all.designs.text.starts_with(&format!("{head}theta_deg,n,")), "{:.90}", all.designs.text);
    assert!(all.distances.text.starts_with(&format!("{head}a_mm,n,")), "{:.90}", all.distances.text);
}

/// Sampled axes of four kinds that share one point set.
pub const SAMPLED: &str = "[whisker]\nD = { min = 8, max = 12, samples = 16 }\nd = 4\nL_a = 50\nexponent = { min = 0.5, max = 3, samples = 16 }\n\
                   root = { k_theta = [500, 900] }\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-5\n[tap]\na = [20, 33]\n\
                   theta = { min = 1, max = 4, samples = 16 }\n[model]\nnu = { min = 0.3, max = 0.5, samples = 16 }\nshear = true\n";

#[test]
fn samples_run_together() {
    let all = sweep(SAMPLED, CPU_F64);
    assert_eq!(all.tuples.rows.len(), 16 * 2 * 2);
    let of = |column: &str| -> Vec<f64> {
        all.designs.rows.iter().step_by(2).map(|row| number(row, column).unwrap()).collect()
    };
    // Sobol dimensions follow the order of the columns: D, exponent, nu, theta.
    use vibrissa::scene::sampler::Sampler;
    for (dimension, column, [min, max]) in [
        (0, "D_mm", [8.0, 12.0]),
        (1, "exponent", [0.5, 3.0]),
        (2, "nu", [0.3, 0.5]),
        (3, "theta_deg", [1.0, 4.0]),
    ] {
        for (i, value) in of(column).into_iter().enumerate() {
            let x = (f64::from(Sampler::Sobol.coordinate(0, dimension, i as u32)) + 0.5) / 4_294_967_296.0;
            assert_eq!(value, min + (max - min) * x, "{column} {i}");
        }
    }
}

#[test]
fn a_tuple_file_has_rows_outside_the_domain() {
    let file = "[tuples]\nfile = \"list.csv\"\n[whisker]\ncore = { diameter = 1, modulus = 60000 }\n";
    let rows = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,core_mm,nu\n10,4,50,5,2,33,5,0.5,0.4\n10,4,50,5,2,33,5,0.5,0.6\n\
                10,4,50,5,2,33,5,11,0.4\n10,4,50,5,2,33,5,0,0.4\n";
    let swept = sweep_with(file, Some(rows), CPU);
    assert_eq!(swept.tuples.statuses(), ["ok", "invalid_geometry", "invalid_geometry", "ok"]);
    let plain = sweep(
        "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 33\ntheta = 5\n",
        CPU,
    );
    assert_eq!(swept.tuples.rows[3]["strain"], plain.tuples.rows[0]["strain"]);
}

#[test]
fn each_rig_has_the_charts_of_its_own_sweep() {
    let ranked = ranked(20).replace("6_000", "1_000");
    let with = |text: &str, hub: &str| text.replacen("L_a = 50", &format!("L_a = 50\nhub = {hub}"), 1);
    let all = sweep(&with(&ranked, "[0, 6]"), CPU);
    let mut rows: Vec<Row> = ["0", "6"]
        .into_iter()
        .flat_map(|hub| {
            let one = sweep(&with(&ranked, hub), CPU);
            assert!(one.report.counts.chart.is_some());
            let hub = ("hub_mm".to_owned(), hub.to_owned());
            one.designs.rows.into_iter().map(move |row| row.into_iter().chain([hub.clone()]).collect())
        })
        .collect();
    rows.sort_by(|p, q| number(p, "total_rms_mm").partial_cmp(&number(q, "total_rms_mm")).unwrap());
    rows.truncate(20);
    assert_eq!(all.designs.rows, rows);
    assert!(all.report.counts.chart.is_some() && all.report.counts.interpolated > 0);
}

/// K_sd over three distances, minimised over exponent and root.
const SEARCHED: &str = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-5\n[tap]\na = [20, 30, 40]\ntheta = 4\n";

#[test]
fn a_search_finds_the_best_of_a_dense_axis() {
    let dense = SEARCHED.replace("[gauge]", "exponent = { from = 0.3, to = 3, steps = 109 }\n[gauge]");
    let swept = sweep(&dense, CPU_F64);
    let best = |column: &str| {
        let rows = swept.designs.rows.iter();
        rows.map(|r| (number(r, column).unwrap(), number(r, "exponent").unwrap()))
            .min_by(|p, q| p.0.total_cmp(&q.0))
            .unwrap()
    };
    for (objective, column) in [("sd", "K_sd"), ("distance", "total_rms_mm")] {
        let text = format!(
            "{SEARCHED}[optimise]\nobjective = \"{objective}\"\nvariables = {{ exponent = [0.3, 3] }}\nbudget = {{ evaluations = 400 }}\n\
             limits = {{ strain = 1 }}\n"
        );
        let found = search(&text, CPU_F64);
        let (value, exponent) = best(column);
        let ratio = found.value / value;
        // Strains to 1e-8 give a spread that is 4e-4 of K to 1e-5; seen were 1e-8.
        assert!(ratio <= 1.0 + 1e-7 && ratio > 0.98, "{objective}: {ratio} of {value} at {exponent}");
    }
}
