//! Contents of the tables: columns, drives, sides, conventions, statistics, selection.

use crate::common::measuring::REAL;
use crate::common::program::{Desk, SPEC};
use crate::common::recount::check;
use crate::common::sweeping::{
    CPU, CPU_F64, GPU, Place, REFERENCE, Row, Swept, Table, number, sweep, sweep_with,
};
use crate::rigs::{SAMPLED, TWO};

const TUPLES: &str = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,strain,strain_linear,K,K_deviation,distance_mm,\
                      error_mm,sigma_mm,normal_force_N,tangential_force_N,contact_arc_mm,contact_state,status";
const DESIGNS: &str = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,theta_deg,n,K_mean,K_sd,error_rms_mm,error_max_mm,error_mean_mm,\
                       noise_rms_mm,total_rms_mm,strain_max,force_max_N,status";
const DISTANCES: &str = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,a_mm,n,K_mean,K_sd,status";

fn columns(swept: &Swept) -> [String; 3] {
    [&swept.tuples, &swept.designs, &swept.distances].map(|table| table.columns.join(","))
}

#[test]
fn columns_are_those_of_the_interface() {
    let angle = sweep(SPEC, CPU);
    assert_eq!(columns(&angle), [TUPLES, DESIGNS, DISTANCES]);
    check(&angle, false);
    let order: Vec<_> =
        angle.tuples.rows.iter().map(|r| (&r["d_tip_mm"], &r["a_mm"], &r["theta_deg"])).collect();
    assert_eq!(order.len(), 12);
    assert_eq!([order[1].2, order[2].1, order[6].0], ["4", "33", "7"]);

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
        let d = number(short, "d_tip_mm").unwrap();
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
    assert_eq!(swept.designs.values("K_sd"), [0.0; 4]);
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
    assert_eq!(both.designs.values("K_sd"), [0.0; 4]);
}

#[test]
fn noise_is_reported_only_where_it_is_written() {
    let loud = sweep(SPEC, CPU);
    let silent = sweep(&SPEC.replace("noise_strain = 1e-6", ""), CPU);
    assert_eq!(silent.designs.values("noise_rms_mm"), [0.0; 4]);
    assert_eq!(silent.designs.numbers("total_rms_mm"), silent.designs.numbers("error_rms_mm"));
    assert_eq!(silent.designs.numbers("error_rms_mm"), loud.designs.numbers("error_rms_mm"));
    assert!(loud.designs.values("noise_rms_mm").iter().all(|n| *n > 0.0));
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

/// 40 designs, half of them incomplete, with a tap beyond the tip.
fn many(output: &str) -> String {
    let text = SPEC
        .replace("d = [4, 7]", "d = { from = 1, to = 10.5, steps = 20 }")
        .replace("L_a = 50", "L_a = [50, 47]");
    format!("{text}[output]\n{output}\n")
}

/// With designs that may be incomplete, and with axes of rigs.
#[test]
fn top_keeps_the_best_complete_rows() {
    let two = |output: &str| format!("{TWO}[output]\n{output}\n");
    let (tips, axes) = (["d_tip_mm", "L_a_mm"], ["D_mm", "l_mm", "bore_mm", "hub_mm"]);
    let (all, some) = (
        ["K_sd", "error_rms_mm", "error_max_mm", "noise_rms_mm", "total_rms_mm", "strain_max", "force_max_N"],
        ["total_rms_mm"],
    );
    type Case<'a> = (&'a dyn Fn(&str) -> String, Place, &'a str, usize, &'a [&'a str], &'a [&'a str]);
    let cases: [Case<'_>; 2] = [(&many, REFERENCE, "3", 7, &all, &tips), (&two, CPU, "2", 5, &some, &axes)];
    for (text, place, n, top, ranks, keys) in cases {
        let whole = sweep(&text(""), place);
        if keys == &tips[..] {
            check(&whole, false);
        }
        for (by, per) in ranks.iter().flat_map(|by| ["row", "design"].map(|per| (by, per))) {
            let kept = sweep(&text(&format!("top = {top}\nby = \"{by}\"\nper = \"{per}\"")), place);
            let complete = |r: &&Row| r["n"] == n && !r[*by].is_empty();
            let mut rows: Vec<_> = whole.designs.rows.iter().filter(complete).collect();
            rows.sort_by(|a, b| number(a, by).unwrap().total_cmp(&number(b, by).unwrap()));
            if per == "design" {
                let mut seen = std::collections::HashSet::new();
                rows.retain(|r| seen.insert(keys.iter().map(|key| r[*key].clone()).collect::<Vec<_>>()));
            }
            rows.truncate(top);
            assert_eq!(kept.designs.rows.iter().collect::<Vec<_>>(), rows, "{by} {per}");
            let wanted = |table: &Table, keys: &[&str]| -> Vec<Row> {
                let of = |t: &&Row| rows.iter().any(|r| keys.iter().all(|k| t[*k] == r[*k]));
                table.rows.iter().filter(of).cloned().collect()
            };
            assert_eq!(kept.tuples.rows, wanted(&whole.tuples, &[keys, &["theta_deg"]].concat()));
            assert_eq!(kept.distances.rows, wanted(&whole.distances, keys), "{by} {per}");
        }
    }
}

/// A tuple file with the taps of a grid gives its tables, byte for byte: every status, tilted poles, two gauges, rig axes, channels.
#[test]
fn a_tuple_file_has_the_tables_of_its_grid() {
    let whisker = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n";
    let words = format!("{whisker}[tap]\na = [4, 7.5, 21, 48]\ntheta = [1, 10, 60]\n")
        .replace("L_a = 50", "L_a = [50, 30]");
    let linear = "[model]\ngeometry = \"linear\"\n";
    let tilted = format!(
        "{whisker}second = true\n[tap]\na = [21, 33, 48]\ntilt = [-20, 0, 30]\nlean = 10\ntheta = [1, 4]\n{linear}"
    );
    let sensor = "signal = [\"moment\", \"force\"]\nnoise = [0.02, 0.001]";
    let noise = "[gauge]\nnoise_strain = 1e-6\n";
    let second = format!("{noise}second = true\n{linear}");
    let root = format!("[whisker]\nroot = {{ k_theta = 1000, k_y = 40 }}\n[sensor]\n{sensor}\n");
    let exact = |rest: &str| format!("{rest}{REAL}[estimate]\ntheory = \"exact\"\n");
    let (own, both) = (
        "[tap]\na = [21, 33, 48]\ntheta = [1, 8]\n",
        "second = true\n[tap]\na = [21, 33, 48]\ntilt = [0, 30]\nlean = 0\ntheta = [1, 8]\n",
    );
    let (own, both) = ([whisker, own].concat(), [whisker, both].concat());
    for (grid, rest, place) in [
        (words.as_str(), noise, CPU),
        (&exact(&own), &exact(noise), CPU_F64),
        (&exact(&both), &exact(&format!("{noise}second = true\n")), CPU_F64),
        (&tilted, &second, CPU),
        (&tilted, &second, REFERENCE),
        (SAMPLED, "[gauge]\nnoise_strain = 1e-5\n[model]\nshear = true\n", CPU_F64),
        (&crate::channels::spec(sensor, ""), &root, CPU),
    ] {
        let wanted = sweep(grid, place);
        let table = &wanted.tuples;
        let end = 1 + table.columns.iter().position(|name| name == "theta_deg").expect("a drive");
        let line =
            |row: &Row| table.columns[..end].iter().map(|c| row[c].clone()).collect::<Vec<_>>().join(",");
        let rows = table.rows.iter().map(line).collect::<Vec<_>>().join("\n");
        let list = format!("{}\n{rows}\n", table.columns[..end].join(","));
        let listed = sweep_with(&format!("[tuples]\nfile = \"list.csv\"\n{rest}"), Some(&list), place);
        assert_eq!(listed.tuples.text, wanted.tuples.text, "{grid}");
        assert_eq!(listed.designs.text, wanted.designs.text, "{grid}");
        assert_eq!(listed.distances.text, wanted.distances.text, "{grid}");
        let words = |swept: &Swept| swept.report.counts.combinations.words();
        assert_eq!(words(&listed), words(&wanted), "{grid}");
    }
}

#[test]
fn fewer_complete_rows_than_asked_are_said() {
    let desk = Desk::new(&many("top = 1000"));
    let object = desk.sweep(&["--json"]).exits(0).json();
    assert_eq!((&object["counts"]["complete_rows"], &object["counts"]["designs"]), (&40.into(), &40.into()));
    assert_eq!(desk.whole("results/spec")["counts"]["complete_rows"], 40);
    assert!(desk.sweep(&[]).exits(0).stdout.contains("kept 40 of 40 complete rows (top = 1000)"));
}

#[test]
fn an_empty_parquet_table_has_its_columns() {
    let desk = Desk::new(&format!(
        "{}[output]\nformat = \"parquet\"\ntop = 5\n",
        SPEC.replace("a = [21, 33, 48]", "a = 0.5")
    ));
    desk.sweep(&["--out", "out"]).exits(0);
    let file = std::fs::File::open(desk.path("out/designs.parquet")).unwrap();
    let mut reader = vibrissa::sink::parquet::Reader::new(&desk.path("out/designs.parquet"), file).unwrap();
    assert_eq!(reader.frame().names.last().map(AsRef::as_ref), Some("status"));
    assert!(reader.next_group().unwrap().is_none());
}

/// The paper's results for its three whiskers (model §4). Rows of `sweeps/prototypes.toml` by d; values (θ, K_sd, K_mean, error_rms_mm).
#[test]
fn the_prototypes_behave_as_published() {
    let path = std::path::Path::new(crate::common::ROOT).join("sweeps/prototypes.toml");
    let text = std::fs::read_to_string(path).expect("the paper's sweep");
    for place in [CPU, CPU_F64, GPU] {
        let swept = sweep(&text, place);
        check(&swept, false);
        assert_eq!(swept.tuples.rows.len(), 330);
        let columns = ["theta_deg", "K_sd", "K_mean", "error_rms_mm", "n"];
        let row = |row| columns.map(|column| number(row, column).expect("a value"));
        let rows: Vec<[f64; 5]> = swept.designs.rows.iter().map(row).collect();
        for whisker in rows.chunks(11) {
            assert!(whisker.iter().all(|row| row[4] == 10.0), "{whisker:?}");
            assert!(whisker.windows(2).all(|w| w[0][1] < w[1][1]), "SD grows with the angle: {whisker:?}");
            assert!(whisker.windows(2).all(|w| w[0][2] < w[1][2]), "K grows with the angle: {whisker:?}");
            let best = whisker.iter().min_by(|a, b| a[3].total_cmp(&b[3])).expect("rows");
            assert_eq!(best[0], 0.5, "the best estimate is at half a degree");
        }
        let falls = |i: usize| rows[i][1] > rows[11 + i][1] && rows[11 + i][1] > rows[22 + i][1];
        assert!((0..11).all(falls), "{rows:?}");
    }
}
