//! Every status that a sweep can give so far, alone and joined, and what it does to the row and to the statistics.

use crate::common;

use crate::common::recount::check;
use crate::common::sweeping::{CPU, CPU_F64, GPU, REFERENCE, Swept, number, sweep, sweep_with};

/// A spec: L_a, x_ss, a and theta as TOML, and more lines at the end.
fn spec([length, place, a, theta]: [&str; 4], more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = 4\nL_a = {length}\n[gauge]\nx_ss = {place}\nl = 2\nnoise_strain = 1e-6\n\
         [tap]\na = {a}\ntheta = {theta}\n{more}\n"
    )
}

/// Sweeps on the CPU in f32, checks the statistics against the rows, and the statuses of the rows.
#[track_caller]
fn swept(text: &str, statuses: &[&str]) -> Swept {
    let swept = sweep(text, CPU);
    assert_eq!(swept.tuples.statuses(), statuses);
    check(&swept, text.contains("\nK = "));
    swept
}

/// Columns of tuples.csv that are computed, all numbers.
const COMPUTED: [&str; 10] = [
    "strain",
    "strain_linear",
    "K",
    "K_deviation",
    "distance_mm",
    "error_mm",
    "sigma_mm",
    "normal_force_N",
    "tangential_force_N",
    "contact_arc_mm",
];

/// Asserts which of the [`COMPUTED`] columns of tap `i` hold a value.
#[track_caller]
fn holds(swept: &Swept, i: usize, columns: &[&str]) {
    let row = &swept.tuples.rows[i];
    let held: Vec<&str> = COMPUTED.into_iter().filter(|c| number(row, c).is_some()).collect();
    assert_eq!(held, columns, "{row:?}");
    assert_eq!(row["contact_state"], if columns.contains(&"contact_arc_mm") { "slide" } else { "" });
}

#[test]
fn ok_rows_hold_everything() {
    let s = swept(&spec(["50", "5", "[21, 33, 48]", "2"], ""), &["ok"; 3]);
    (0..3).for_each(|i| holds(&s, i, &COMPUTED));
    let row = &s.tuples.rows[1];
    let value = |column| number(row, column).unwrap();
    assert!((value("K") / (value("strain_linear") / value("strain")) - 1.0).abs() < 1e-14);
    assert!((value("K_deviation") / (value("K") - 1.0) - 1.0).abs() < 1e-9);
    assert_eq!(value("error_mm"), value("distance_mm") - value("a_mm"));
    assert!(value("sigma_mm") > 0.0 && value("tangential_force_N") == 0.0);
    assert_eq!(s.report.counts.status["ok"], 3);
}

#[test]
fn invalid_geometry_has_no_values_and_does_not_count() {
    let s = swept(
        &spec(["[50, 30]", "5", "[21, 29.9, 33]", "[2, 20]"], ""),
        &[
            "ok",
            "strain_limit",
            "ok",
            "strain_limit",
            "ok",
            "strain_limit",
            "ok",
            "strain_limit",
            "ok",
            "slipped_off+strain_limit",
            "invalid_geometry",
            "invalid_geometry",
        ],
    );
    holds(&s, 10, &[]);
    assert_eq!(s.designs.rows[2]["n"], "2");
    assert_eq!(s.designs.statuses()[2..], ["invalid_geometry", "invalid_geometry+slipped_off+strain_limit"]);
    let far = &s.distances.rows[5];
    assert_eq!(
        (far["n"].as_str(), far["K_mean"].as_str(), far["status"].as_str()),
        ("0", "", "invalid_geometry")
    );
}

#[test]
fn a_gauge_beyond_the_whisker_is_invalid() {
    let s = swept(
        &spec(["[50, 40]", "[5, 39]", "[30]", "2"], ""),
        &["ok", "no_strain", "ok", "invalid_geometry"],
    );
    assert_eq!(s.designs.rows[3]["n"], "0");
    assert_eq!(s.designs.rows[3]["strain_max"], "");
}

#[test]
fn no_strain_does_not_count() {
    let s = swept(&spec(["50", "5", "[4, 5, 33]", "2"], ""), &["no_strain", "no_strain", "ok"]);
    let held = ["strain", "strain_linear", "normal_force_N", "tangential_force_N", "contact_arc_mm"];
    (0..2).for_each(|i| holds(&s, i, &held));
    assert_eq!(number(&s.tuples.rows[0], "strain"), Some(0.0));
    let row = &s.designs.rows[0];
    assert_eq!((row["n"].as_str(), row["K_sd"].as_str(), row["error_rms_mm"].as_str()), ("1", "", ""));
}

#[test]
fn no_strain_joins_slipped_off_and_not_converged() {
    let text = spec(["50", "48", "48", "[30, 80]"], "");
    let s = swept(&text, &["no_strain+slipped_off", "no_strain+not_converged"]);
    holds(&s, 1, &["strain_linear"]);
}

#[test]
fn not_converged_has_only_the_linear_strain() {
    for place in [CPU, CPU_F64, GPU, REFERENCE] {
        let s = sweep(&spec(["50", "5", "[21, 48]", "[2, 60]"], ""), place);
        assert_eq!(s.tuples.statuses(), ["ok", "strain_limit", "ok", "not_converged"], "{place:?}");
        holds(&s, 3, &["strain_linear"]);
        check(&s, false);
        assert_eq!(s.report.counts.status["not_converged"], 1);
    }
}

#[test]
fn slipped_off_keeps_its_values_but_does_not_count() {
    let s = swept(&spec(["50", "5", "[30, 40, 49.99]", "8"], ""), &["ok", "ok", "slipped_off"]);
    holds(&s, 2, &COMPUTED);
    assert!(number(&s.tuples.rows[2], "contact_arc_mm").unwrap() > 50.0);
    assert_eq!(s.designs.rows[0]["n"], "2");
    assert_eq!(s.designs.rows[0]["status"], "slipped_off");
    assert!(number(&s.designs.rows[0], "error_rms_mm").is_some());
}

#[test]
fn strain_limit_counts_and_joins() {
    let text = spec(["50", "5", "[12, 13, 50]", "20"], "").replace("[tap]", "strain_limit = 0.01\n[tap]");
    let s = swept(&text, &["strain_limit", "strain_limit", "slipped_off+strain_limit"]);
    assert_eq!(s.designs.rows[0]["n"], "2");
    assert!(number(&s.designs.rows[0], "strain_max").unwrap() > 0.1);
}

#[test]
fn ambiguous_counts_and_joins() {
    // The far root of 7.5 mm and the near root of 21 mm both lie in 7.5 … 48 mm.
    let s = swept(
        &spec(["50", "5", "[7.5, 21, 48]", "[1, 10]"], ""),
        &["ambiguous", "strain_limit+ambiguous", "ambiguous", "strain_limit+ambiguous", "ok", "ok"],
    );
    assert_eq!(s.designs.rows[0]["n"], "3");
    assert!(number(&s.tuples.rows[0], "distance_mm").unwrap() > 12.0, "the far root is returned");
    let narrow = spec(["50", "5", "[7.5, 21, 48]", "1"], "[estimate]\nrange = [20, 50]");
    swept(&narrow, &["ok"; 3]);
}

#[test]
fn no_root_counts_but_leaves_the_errors_empty() {
    // K far above 1 pushes the readings near the peak above it.
    let text = spec(["50", "5", "[11, 48]", "[1, 20]"], "[estimate]\nK = 1.5");
    let s = swept(&text, &["no_root", "strain_limit+no_root", "ok", "ok"]);
    let without: Vec<&str> =
        COMPUTED.into_iter().filter(|c| !["distance_mm", "error_mm", "sigma_mm"].contains(c)).collect();
    holds(&s, 0, &without);
    let row = &s.designs.rows[0];
    assert_eq!(row["n"], "2");
    for column in ["error_rms_mm", "error_max_mm", "error_mean_mm", "noise_rms_mm", "total_rms_mm"] {
        assert_eq!(row[column], "", "{column}");
    }
    assert!(number(row, "K_sd").is_some() && number(row, "strain_max").is_some());
}

#[test]
fn one_tap_has_no_spread_and_no_estimate() {
    let s = swept(&spec(["50", "5", "33", "[2, 4]"], ""), &["ok"; 2]);
    let row = &s.designs.rows[0];
    assert_eq!((row["n"].as_str(), row["K_sd"].as_str(), row["total_rms_mm"].as_str()), ("1", "", ""));
    assert!(number(row, "K_mean").is_some() && number(row, "force_max_N").is_some());
    assert_eq!(number(&s.tuples.rows[0], "distance_mm"), None);
    assert!(number(&s.distances.rows[0], "K_sd").is_some());
}

#[test]
fn a_given_calibration_estimates_one_tap() {
    let s = swept(&spec(["50", "5", "33", "2"], "[estimate]\nK = 1"), &["ok"]);
    let error = number(&s.designs.rows[0], "error_rms_mm").unwrap();
    assert!(error > 0.0 && error < 0.1, "{error}");
    assert_eq!(s.designs.rows[0]["K_sd"], "");
}

#[test]
fn tuple_files_give_the_same_statuses() {
    let grid = spec(["[50, 30]", "5", "[4, 7.5, 21, 48]", "[1, 10, 60]"], "");
    let wanted = sweep(&grid, CPU);
    check(&wanted, false);
    let columns = ["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "theta_deg"];
    let line = |row: &common::sweeping::Row| columns.map(|c| row[c].as_str()).join(",");
    let list: Vec<String> = wanted.tuples.rows.iter().map(line).collect();
    let list = format!("{}\n{}\n", columns.join(","), list.join("\n"));
    let text = "[gauge]\nnoise_strain = 1e-6\n[tuples]\nfile = \"list.csv\"\n";
    let listed = sweep_with(text, Some(&list), CPU);
    assert_eq!(listed.tuples.text, wanted.tuples.text);
    assert_eq!(listed.designs.text, wanted.designs.text);
    assert_eq!(listed.distances.text, wanted.distances.text);
    assert_eq!(listed.report.counts.status, wanted.report.counts.status);
}

#[test]
fn material_limit_has_only_the_linear_strain_and_joins_no_strain() {
    let text = "[whisker]\nD = 20\nd = 20\nL_a = 60\n[gauge]\nx_ss = 25\nl = 2\n[tap]\na = [24, 40]\ntheta = [1, 55]\n\
                [model]\nmaterial = { neo-hookean = 3.2 }\nsurface = true\nshear = true\nextension = true\n";
    for place in [CPU, CPU_F64, GPU, REFERENCE] {
        let s = sweep(text, place);
        let expected = ["no_strain", "no_strain+material_limit", "ok", "material_limit"];
        assert_eq!(s.tuples.statuses(), expected, "{place:?}");
        holds(&s, 3, &["strain_linear"]);
        check(&s, false);
    }
}

/// A whisker twice as wide at its tip as at its base, whose f levels off above 0; its peak lies at 56 mm.
fn widening(place: u32, a: &str, more: &str) -> String {
    format!(
        "[whisker]\nD = 7\nd = 14\nL_a = 50\n[gauge]\nx_ss = {place}\nl = 6\n[tap]\na = {a}\ntheta = 0.05\n{more}\n"
    )
}

#[test]
fn a_widening_whisker_is_ambiguous_only_where_a_second_distance_exists() {
    let near = [17.0, 18.0, 19.0, 20.0, 21.0, 22.0];
    for place in [CPU, CPU_F64, GPU, REFERENCE] {
        for more in ["", "[model]\ngeometry = \"linear\"", "[estimate]\ntheory = \"timoshenko\""] {
            let s = sweep(&widening(15, "[17, 18, 19, 20, 21, 22, 30, 45]", more), place);
            // f(∞) lies above the readings of the first six.
            let wanted = ["ok", "ok", "ok", "ok", "ok", "ok", "ambiguous", "ambiguous"];
            assert_eq!(s.tuples.statuses(), wanted, "{place:?} {more}");
            let told: Vec<f64> = s.tuples.rows.iter().filter_map(|row| number(row, "distance_mm")).collect();
            // By f_T the readings of near contacts have a larger K̄.
            let other = more.contains("timoshenko");
            let slack = if other { 0.1 } else { 0.01 };
            assert!(told.iter().zip(near).all(|(d, a)| (d - a).abs() < slack), "{place:?} {more}: {told:?}");
            // The far root of 30 mm; that of 45 mm lies nearer.
            if !other {
                assert!((told[6] - 376.7).abs() < 2.0 && told[7] > 60.0, "{place:?} {more}: {told:?}");
            }
        }
    }
}

#[test]
fn an_only_distance_beyond_the_whisker_says_so() {
    let given = |k: f64, more: &str| format!("[estimate]\nK = {k}\n{more}");
    let cases = [
        // One distance, on the whisker and beyond it; two distances, both beyond it.
        (30, "40", given(1.1, ""), "ok", 40.0..45.0),
        (30, "48", given(1.1, ""), "outside_calibration", 50.5..60.0),
        (30, "48", given(1.6, ""), "outside_calibration", 300.0..f64::INFINITY),
        // Two distances, of which the near one is none of interest.
        (15, "30", given(1.0, "range = [40, 50]"), "outside_calibration", 370.0..383.0),
        (15, "30", given(1.0, "range = [20, 50]"), "ambiguous", 370.0..383.0),
        // The same of a tap before the peak, whose far root lies nearer.
        (15, "45", given(1.0, "range = [46, 50]"), "outside_calibration", 60.0..100.0),
    ];
    for place in [CPU, CPU_F64, GPU, REFERENCE] {
        for (x_ss, a, more, status, within) in &cases {
            let s = sweep(&widening(*x_ss, a, more), place);
            assert_eq!(s.tuples.statuses(), [*status], "{place:?} {x_ss} {a} {more}");
            assert_eq!(s.designs.rows[0]["status"], *status);
            let told = number(&s.tuples.rows[0], "distance_mm").unwrap();
            assert!(within.contains(&told), "{place:?} {x_ss} {a} {more}: {told}");
            assert!(number(&s.designs.rows[0], "error_rms_mm").is_some());
        }
    }
}

/// Contacts of a narrowing whisker may be told beyond its tip: its far root has no other word there.
#[test]
fn a_narrowing_whisker_tells_its_far_root_beyond_the_tip() {
    let s = swept(&spec(["50", "5", "[40, 49]", "1"], "[estimate]\nK = 0.95"), &["ok"; 2]);
    assert!(number(&s.tuples.rows[1], "distance_mm").unwrap() > 50.0);
}
