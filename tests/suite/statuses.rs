//! Every status of a sweep, alone and combined, and its effect on the row and on the statistics.

use crate::common::recount::check;
use crate::common::sweeping::{CPU, CPU_F64, GPU, REFERENCE, Swept, number, sweep};

fn spec([length, place, a, theta]: [&str; 4], more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = 4\nL_a = {length}\n[gauge]\nx_ss = {place}\nl = 2\nnoise_strain = 1e-6\n\
         [tap]\na = {a}\ntheta = {theta}\n{more}\n"
    )
}

/// Sweeps on the CPU in f32; checks statistics against rows, and the statuses.
#[track_caller]
fn swept(text: &str, statuses: &[&str]) -> Swept {
    let swept = sweep(text, CPU);
    assert_eq!(swept.tuples.statuses(), statuses);
    check(&swept, text.contains("\nK = "));
    swept
}

const COMPUTED: &str = "strain strain_linear K K_deviation distance_mm error_mm sigma_mm normal_force_N tangential_force_N contact_arc_mm";

/// Fails unless, of the [`COMPUTED`] columns, exactly `columns` have a value in tap `i`.
#[track_caller]
fn holds(swept: &Swept, i: usize, columns: &str) {
    let row = &swept.tuples.rows[i];
    let held: Vec<&str> = COMPUTED.split(' ').filter(|c| number(row, c).is_some()).collect();
    assert_eq!(held.join(" "), columns, "{row:?}");
    assert_eq!(row["contact_state"], if columns.contains("contact_arc_mm") { "slide" } else { "" });
}

#[test]
fn ok_rows_hold_everything() {
    let s = swept(&spec(["50", "5", "[21, 33, 48]", "2"], ""), &["ok"; 3]);
    (0..3).for_each(|i| holds(&s, i, COMPUTED));
    let row = &s.tuples.rows[1];
    let value = |column| number(row, column).unwrap();
    assert!((value("K") / (value("strain_linear") / value("strain")) - 1.0).abs() < 1e-14);
    assert!((value("K_deviation") / (value("K") - 1.0) - 1.0).abs() < 1e-9);
    assert_eq!(value("error_mm"), value("distance_mm") - value("a_mm"));
    assert!(value("sigma_mm") > 0.0 && value("tangential_force_N") == 0.0);
    assert_eq!(s.report.counts.combinations.words()["ok"], 3);
}

/// Checks cells, written as table (T tuples, D designs, L distances), row, column and value; + means any number.
#[track_caller]
fn says(swept: &Swept, cells: &str) {
    for cell in cells.split_whitespace() {
        let at = cell.find(['=', '<', '>']).unwrap_or_else(|| panic!("no value: {cell}"));
        let ((place, column), value) = (cell[..at].split_once('.').expect("a column"), &cell[at + 1..]);
        let table = match &place[..1] {
            "T" => &swept.tuples,
            "D" => &swept.designs,
            _ => &swept.distances,
        };
        let row = &table.rows[place[1..].parse::<usize>().expect("a row")];
        let found = row[column].as_str();
        let number = || found.parse::<f64>().unwrap_or(f64::NAN);
        let bound = || value.parse::<f64>().unwrap_or(f64::NAN);
        let holds = match &cell[at..=at] {
            ">" => number() > bound(),
            "<" => number() < bound(),
            _ if value == "+" => number().is_finite(),
            _ => found == value || number() == bound(),
        };
        assert!(holds, "{cell}: {row:?}");
    }
}

/// For each status, alone and combined: the fields of the rows, and whether they count.
#[test]
fn rows_hold_and_statistics_count_what_their_status_says() {
    let all = COMPUTED;
    let without = all.replace("distance_mm error_mm sigma_mm ", "");
    let unstrained = "strain strain_linear normal_force_N tangential_force_N contact_arc_mm";
    let limit = spec(["50", "5", "[12, 13, 50]", "20"], "").replace("[tap]", "strain_limit = 0.01\n[tap]");
    let (near, narrow) = (["50", "5", "[7.5, 21, 48]", "[1, 10]"], ["50", "5", "[7.5, 21, 48]", "1"]);
    type Case<'a> = (String, &'a str, &'a [(usize, &'a str)], &'a str);
    let cases: [Case<'_>; 12] = [
        (
            spec(["[50, 30]", "5", "[21, 29.9, 33]", "[2, 20]"], ""),
            "ok strain_limit ok strain_limit ok strain_limit ok strain_limit ok slipped_off+strain_limit invalid_geometry invalid_geometry",
            &[(10, "")],
            "D2.n=2 D2.status=invalid_geometry D3.status=invalid_geometry+slipped_off+strain_limit L5.n=0 L5.K_mean= L5.status=invalid_geometry",
        ),
        (
            spec(["[50, 40]", "[5, 39]", "[30]", "2"], ""),
            "ok no_strain ok invalid_geometry",
            &[],
            "D3.n=0 D3.strain_max=",
        ),
        (
            spec(["50", "5", "[4, 5, 33]", "2"], ""),
            "no_strain no_strain ok",
            &[(0, unstrained), (1, unstrained)],
            "T0.strain=0 D0.n=1 D0.K_sd= D0.error_rms_mm=",
        ),
        (
            spec(["50", "48", "48", "[30, 80]"], ""),
            "no_strain+slipped_off no_strain+not_converged",
            &[(1, "strain_linear")],
            "",
        ),
        (
            spec(["50", "5", "[30, 40, 49.99]", "8"], ""),
            "ok ok slipped_off",
            &[(2, all)],
            "T2.contact_arc_mm>50 D0.n=2 D0.status=slipped_off D0.error_rms_mm=+",
        ),
        (limit, "strain_limit strain_limit slipped_off+strain_limit", &[], "D0.n=2 D0.strain_max>0.1"),
        // The far root of 7.5 mm, which is returned, and the near root of 21 mm lie in 7.5 … 48 mm.
        (
            spec(near, ""),
            "ambiguous strain_limit+ambiguous ambiguous strain_limit+ambiguous ok ok",
            &[],
            "D0.n=3 T0.distance_mm>12",
        ),
        (spec(narrow, "[estimate]\nrange = [20, 50]"), "ok ok ok", &[], ""),
        // K far above 1 moves readings near the peak above it.
        (
            spec(["50", "5", "[11, 48]", "[1, 20]"], "[estimate]\nK = 1.5"),
            "no_root strain_limit+no_root ok ok",
            &[(0, &without)],
            "D0.n=2 D0.error_rms_mm= D0.error_max_mm= D0.error_mean_mm= D0.noise_rms_mm= D0.total_rms_mm= D0.K_sd=+ D0.strain_max=+",
        ),
        // One tap has no spread; it has an estimate only with a given calibration.
        (
            spec(["50", "5", "33", "[2, 4]"], ""),
            "ok ok",
            &[],
            "D0.n=1 D0.K_sd= D0.total_rms_mm= D0.K_mean=+ D0.force_max_N=+ T0.distance_mm= L0.K_sd=+",
        ),
        (
            spec(["50", "5", "33", "2"], "[estimate]\nK = 1"),
            "ok",
            &[],
            "D0.error_rms_mm>0 D0.error_rms_mm<0.1 D0.K_sd=",
        ),
        // A narrowing whisker's estimate may lie beyond its tip: a far root there has no other word.
        (spec(["50", "5", "[40, 49]", "1"], "[estimate]\nK = 0.95"), "ok ok", &[], "T1.distance_mm>50"),
    ];
    for (text, statuses, held, cells) in cases {
        let found = swept(&text, &statuses.split(' ').collect::<Vec<_>>());
        for (row, columns) in held {
            holds(&found, *row, columns);
        }
        says(&found, cells);
    }
}

#[test]
fn taps_without_an_equilibrium_have_only_the_linear_strain() {
    let soft = "[whisker]\nD = 20\nd = 20\nL_a = 60\n[gauge]\nx_ss = 25\nl = 2\n[tap]\na = [24, 40]\ntheta = [1, 55]\n\
                [model]\nmaterial = { neo-hookean = 3.2 }\nsurface = true\nshear = true\nextension = true\n";
    for (text, words) in [
        (&*spec(["50", "5", "[21, 48]", "[2, 60]"], ""), ["ok", "strain_limit", "ok", "not_converged"]),
        (soft, ["no_strain", "no_strain+material_limit", "ok", "material_limit"]),
    ] {
        for place in [CPU, CPU_F64, GPU, REFERENCE] {
            let s = sweep(text, place);
            assert_eq!(s.tuples.statuses(), words, "{place:?}");
            holds(&s, 3, "strain_linear");
            check(&s, false);
            let taps = words.iter().filter(|word| word.contains(words[3])).count();
            assert_eq!(s.report.counts.combinations.words()[words[3]], taps as u64);
        }
    }
}

/// Twice as wide at the tip as at the base: f levels off above 0; its peak is at 56 mm.
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
            // f(∞) is above the readings of the first six.
            let wanted = ["ok", "ok", "ok", "ok", "ok", "ok", "ambiguous", "ambiguous"];
            assert_eq!(s.tuples.statuses(), wanted, "{place:?} {more}");
            let told: Vec<f64> = s.tuples.rows.iter().filter_map(|row| number(row, "distance_mm")).collect();
            // By f_T, near contacts have a larger K̄.
            let other = more.contains("timoshenko");
            let slack = if other { 0.1 } else { 0.01 };
            assert!(told.iter().zip(near).all(|(d, a)| (d - a).abs() < slack), "{place:?} {more}: {told:?}");
            // The far root of 30 mm; that of 45 mm is nearer.
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
        // One distance, on the whisker or beyond; two distances, both beyond.
        (30, "40", given(1.1, ""), "ok", 40.0..45.0),
        (30, "48", given(1.1, ""), "outside_calibration", 50.5..60.0),
        (30, "48", given(1.6, ""), "outside_calibration", 300.0..f64::INFINITY),
        // Two distances; the near one may lie outside the range of interest.
        (15, "30", given(1.0, "range = [40, 50]"), "outside_calibration", 370.0..383.0),
        (15, "30", given(1.0, "range = [20, 50]"), "ambiguous", 370.0..383.0),
        // A tap before the peak, whose far root is nearer.
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
