//! What the tables hold: columns, drives, sides, conventions, statistics, selection.

use crate::common::program::{Desk, SPEC};
use crate::common::recount::check;
use crate::common::sweeping::{CPU, CPU_F64, REFERENCE, Swept, number, sweep};

const TUPLES: &str = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,strain,strain_linear,K,K_deviation,distance_mm,\
                      error_mm,sigma_mm,normal_force_N,tangential_force_N,contact_arc_mm,contact_state,status";
const DESIGNS: &str = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,theta_deg,n,K_mean,K_sd,error_rms_mm,error_max_mm,error_mean_mm,\
                       noise_rms_mm,total_rms_mm,strain_max,force_max_N,status";
const DISTANCES: &str = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,n,K_mean,K_sd,status";

fn columns(swept: &Swept) -> [String; 3] {
    [&swept.tuples, &swept.designs, &swept.distances].map(|table| table.columns.join(","))
}

/// All values of a column, none missing.
#[track_caller]
fn all(values: &[Option<f64>]) -> Vec<f64> {
    values.iter().map(|v| v.expect("a value")).collect()
}

#[test]
fn columns_are_those_of_the_interface() {
    let angle = sweep(SPEC, CPU);
    assert_eq!(columns(&angle), [TUPLES, DESIGNS, DISTANCES]);
    check(&angle, false);
    let order: Vec<_> = angle.tuples.rows.iter().map(|r| (&r["d_mm"], &r["a_mm"], &r["theta_deg"])).collect();
    assert_eq!(
        (order.len(), order[1].2.as_str(), order[2].1.as_str(), order[6].0.as_str()),
        (12, "4", "33", "7")
    );

    let moved = SPEC.replace("theta = [1, 4]", "drive = \"displacement\"\ndelta = [0.5, 2]");
    let displaced = sweep(&moved, CPU);
    assert_eq!(columns(&displaced), [TUPLES, DESIGNS, DISTANCES].map(|c| c.replace("theta_deg", "delta_mm")));
    check(&displaced, false);

    let long = sweep(&format!("{SPEC}[estimate]\nconvention = \"elongation\"\n"), CPU);
    let mm = |c: &str| c.replace(",K,", ",K_mm,").replace("K_mean", "K_mean_mm").replace("K_sd", "K_sd_mm");
    assert_eq!(columns(&long), [TUPLES, DESIGNS, DISTANCES].map(mm));
    check(&long, false);
}

#[test]
fn tables_that_are_not_asked_for_are_not_written() {
    for (off, left) in [("tuples", [0, 4, 6]), ("designs", [12, 0, 6]), ("distances", [12, 4, 0])] {
        let swept = sweep(&format!("{SPEC}[output]\n{off} = false\n"), CPU);
        assert_eq!([&swept.tuples, &swept.designs, &swept.distances].map(|t| t.rows.len()), left);
        assert_eq!(swept.report.files.len(), 3);
    }
}

#[test]
fn elongation_multiplies_k_by_the_span_of_the_gauge() {
    let mean = sweep(SPEC, CPU_F64);
    let long = sweep(&format!("{SPEC}[estimate]\nconvention = \"elongation\"\n"), CPU_F64);
    for (short, long) in mean.tuples.rows.iter().zip(&long.tuples.rows) {
        let d = number(short, "d_mm").unwrap();
        let span = 2.0 * ((10.0 - d) / 100.0).atan().cos();
        let ratio = number(long, "K_mm").unwrap() / number(short, "K").unwrap();
        assert!((ratio / span - 1.0).abs() < 1e-14, "{ratio} {span}");
        assert_eq!(long["K_deviation"], "");
        for same in ["strain", "distance_mm", "error_mm", "normal_force_N", "status"] {
            assert_eq!(long[same], short[same], "{same}");
        }
    }
}

#[test]
fn the_far_side_has_the_other_sign_and_the_same_k() {
    let near = sweep(SPEC, CPU);
    let far = sweep(&SPEC.replace("noise", "side = \"far\"\nnoise"), CPU);
    check(&far, false);
    assert_eq!(far.designs.text, near.designs.text);
    for (far, near) in far.tuples.rows.iter().zip(&near.tuples.rows) {
        for column in ["strain", "strain_linear"] {
            let (far, near) = (number(far, column).unwrap(), number(near, column).unwrap());
            assert!(far < 0.0 && far == -near);
        }
        assert_eq!((&far["K"], &far["distance_mm"]), (&near["K"], &near["distance_mm"]));
    }
}

#[test]
fn linear_geometry_has_k_of_one_and_exact_distances() {
    let swept = sweep(&format!("{SPEC}[model]\ngeometry = \"linear\"\n"), CPU);
    check(&swept, false);
    for row in &swept.tuples.rows {
        let value = |column| number(row, column).unwrap();
        assert_eq!((value("K"), value("K_deviation"), value("contact_arc_mm")), (1.0, 0.0, value("a_mm")));
        assert!((value("strain") / value("strain_linear") - 1.0).abs() < 1e-6);
        assert!(value("error_mm").abs() < 1e-4 && value("tangential_force_N") == 0.0);
    }
    assert_eq!(all(&swept.designs.numbers("K_sd")), [0.0; 4]);
}

#[test]
fn linear_geometry_with_shear_is_read_by_either_theory() {
    // k = 6 (1 + ν)/(7 + 6 ν), G = E/(2 (1 + ν)): S = 3 E D²/(16 k G) = 62.5 mm² for D = 10, ν = 0.5.
    let shear = format!("{SPEC}[model]\ngeometry = \"linear\"\nshear = true\n");
    let plain = sweep(&shear, CPU_F64);
    check(&plain, false);
    for row in &plain.tuples.rows {
        let a = number(row, "a_mm").unwrap();
        let expected = 62.5 / (a * a);
        assert!((number(row, "K_deviation").unwrap() / expected - 1.0).abs() < 1e-12, "{row:?}");
    }
    let both = sweep(&format!("{shear}[estimate]\ntheory = \"timoshenko\"\n"), CPU_F64);
    assert_eq!(all(&both.designs.numbers("K_sd")), [0.0; 4]);
}

#[test]
fn every_backend_fills_linear_tables_alike() {
    let text = format!("{SPEC}[model]\ngeometry = \"linear\"\nshear = true\n");
    let (cpu, reference) = (sweep(&text, CPU_F64), sweep(&text, REFERENCE));
    for column in ["strain", "K", "distance_mm", "sigma_mm", "normal_force_N", "contact_arc_mm"] {
        for (a, b) in all(&cpu.tuples.numbers(column)).iter().zip(all(&reference.tuples.numbers(column))) {
            assert!((a / b - 1.0).abs() < 1e-12, "{column}: {a} {b}");
        }
    }
}

#[test]
fn noise_is_reported_only_where_it_is_written() {
    let loud = sweep(SPEC, CPU);
    let silent = sweep(&SPEC.replace("noise_strain = 1e-6", ""), CPU);
    assert_eq!(all(&silent.designs.numbers("noise_rms_mm")), [0.0; 4]);
    assert_eq!(silent.designs.numbers("total_rms_mm"), silent.designs.numbers("error_rms_mm"));
    assert_eq!(silent.designs.numbers("error_rms_mm"), loud.designs.numbers("error_rms_mm"));
    assert!(all(&loud.designs.numbers("noise_rms_mm")).iter().all(|n| *n > 0.0));
    let row = &loud.tuples.rows[0];
    let value = |column| number(row, column).unwrap();
    // σ_a = K̄ σ/(θ |f′(â)|), f′ from f at â ± h.
    let f = |a: f64| {
        let tau = 0.6 / 50.0;
        let (x1, x2) = (5.0, 5.0 + 2.0 * (0.06f64).atan().cos());
        let r = |x: f64| (a - x) / (1.0 - tau * x);
        7.5 / (a * a) * (r(x1) * r(x1) - r(x2) * r(x2)) / (x2 - x1)
    };
    let (at, h) = (value("distance_mm"), 1e-4);
    let slope = (f(at + h) - f(at - h)) / (2.0 * h);
    let mean = number(&loud.designs.rows[0], "K_mean").unwrap();
    let expected = mean * 1e-6 / (1f64.to_radians() * slope.abs());
    assert!((value("sigma_mm") / expected - 1.0).abs() < 1e-6);
}

/// 40 designs, half of them incomplete: one of their taps lies beyond the tip.
fn many(output: &str) -> String {
    let text = SPEC
        .replace("d = [4, 7]", "d = { from = 1, to = 10.5, steps = 20 }")
        .replace("L_a = 50", "L_a = [50, 47]");
    format!("{text}[output]\n{output}\n")
}

#[test]
fn top_keeps_the_best_complete_rows() {
    let whole = sweep(&many(""), REFERENCE);
    check(&whole, false);
    for by in
        ["K_sd", "error_rms_mm", "error_max_mm", "noise_rms_mm", "total_rms_mm", "strain_max", "force_max_N"]
    {
        for per in ["row", "design"] {
            let kept = sweep(&many(&format!("top = 7\nby = \"{by}\"\nper = \"{per}\"")), REFERENCE);
            let mut rows: Vec<_> =
                whole.designs.rows.iter().filter(|r| r["n"] == "3" && !r[by].is_empty()).collect();
            rows.sort_by(|a, b| number(a, by).unwrap().total_cmp(&number(b, by).unwrap()));
            if per == "design" {
                let mut seen = std::collections::HashSet::new();
                rows.retain(|r| seen.insert((&r["d_mm"], &r["L_a_mm"])));
            }
            rows.truncate(7);
            assert_eq!(kept.designs.rows.iter().collect::<Vec<_>>(), rows, "{by} {per}");
            let wanted = |table: &str, keys: &[&str]| -> Vec<_> {
                let all = if table == "tuples" { &whole.tuples } else { &whole.distances };
                all.rows
                    .iter()
                    .filter(|t| rows.iter().any(|r| keys.iter().all(|k| t[*k] == r[*k])))
                    .cloned()
                    .collect()
            };
            assert_eq!(kept.tuples.rows, wanted("tuples", &["d_mm", "L_a_mm", "theta_deg"]), "{by} {per}");
            assert_eq!(kept.distances.rows, wanted("distances", &["d_mm", "L_a_mm"]), "{by} {per}");
        }
    }
}

#[test]
fn fewer_complete_rows_than_asked_are_said() {
    let desk = Desk::new(&many("top = 1000"));
    let object = desk.sweep(&["--json"]).exits(0).json();
    assert_eq!((&object["counts"]["complete_rows"], &object["counts"]["designs"]), (&40.into(), &40.into()));
    let run: serde_json::Value = serde_json::from_str(&desk.read("results/spec/run.json")).unwrap();
    assert_eq!(run["counts"]["complete_rows"], 40);
    assert!(desk.sweep(&[]).exits(0).stdout.contains("kept 40 of 40 complete rows (top = 1000)"));
}
