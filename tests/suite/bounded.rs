//! Work that a small input could make endless: it is refused, or done in bounded time and memory.

use std::fmt::Write;
use std::time::Instant;

use crate::common::program::{Desk, SPEC, large};
use crate::common::sweeping::Table;
use crate::common::world::GUARD;

/// Does `f`, which without its bound would take hours: it only must not hang.
#[track_caller]
fn soon<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = f();
    assert!(start.elapsed() < GUARD, "{what} took {:?}", start.elapsed());
    result
}

#[test]
fn a_plan_of_2_to_the_32_points_comes_at_once() {
    const POINTS: &str = "samples = 4294967296 }";
    let designs = format!("D = {{ min = 8, max = 12, {POINTS}");
    let text = SPEC.replace("D = 10", &designs) + "[output]\ntop = 3\n";
    let planned = soon("designs", || Desk::new(&text).sweep(&["--plan", "--json"]).exits(0).json());
    assert_eq!(planned["counts"]["designs_total"], 2u64 << 32);

    let distances = SPEC.replace("a = [21, 33, 48]", &format!("a = {{ min = 20, max = 48, {POINTS}"));
    for arguments in [&["--plan"][..], &[], &["--explain"]] {
        let refused = soon("distances", || Desk::new(&distances).sweep(arguments).exits(2));
        for part in ["spec.toml:10", "tap.a", "4294967296", "4194304"] {
            assert!(refused.stderr.contains(part), "{part} is not in {}", refused.stderr);
        }
    }
    let steps = SPEC.replace("theta = [1, 4]", "theta = { from = 1, to = 4, steps = 1_000_000_000_000 }");
    soon("drives", || Desk::new(&steps).sweep(&["--plan"]).exits(2));
}

/// Rows of many whiskers: `n` of them, `each` with `taps` rows that are `apart` rows from each other.
fn rows(n: usize, taps: usize, shuffled: bool) -> Vec<String> {
    let row = |i: usize, j: usize| {
        let d = 4.0 + 6.0 * (i as f64 / n as f64);
        format!("10,{d:.7},50,5,2,{},{}", 21 + 9 * (j % 3), 1 + j / 3)
    };
    match shuffled {
        false => (0..n).flat_map(|i| (0..taps).map(move |j| row(i, j))).collect(),
        true => (0..taps).flat_map(|j| (0..n).map(move |i| row(i, j))).collect(),
    }
}

/// A desk with `rows` in a tuple file: enough of them that it is not held in memory, with `pad` for every row.
fn listed(rows: &[String], pad: usize, rest: &str) -> Desk {
    let desk = Desk::new(&format!("[gauge]\nnoise_strain = 1e-6\n[tuples]\nfile = \"taps.csv\"\n{rest}"));
    let mut text = String::from("\u{feff}# taps\nD_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,note\n");
    for row in rows {
        let _ = writeln!(text, "{row},{:pad$}", "\"x\n\"");
    }
    desk.write("taps.csv", text);
    desk
}

/// The same rows in a file that is held in memory and in one that is not.
fn held_and_not(shuffled: bool, rest: &str) -> [[Table; 3]; 2] {
    let rows = rows(2_000, 6, shuffled);
    [4, 1000].map(|pad| {
        let desk = listed(&rows, pad, rest);
        let large = desk.path("taps.csv").metadata().expect("a file").len() > 8 << 20;
        assert_eq!(large, pad == 1000);
        let ran = desk.sweep(&["--precision", "f64", "--plan"]).exits(0);
        assert_eq!(ran.stdout.contains("MB of memory"), large, "{}", ran.stdout);
        desk.sweep(&["--precision", "f64"]).exits(0);
        ["tuples.csv", "designs.csv", "distances.csv"]
            .map(|name| Table::read(&desk.path("results/spec").join(name)))
    })
}

/// Numbers within the tolerance of two sweeps, all else the same.
#[track_caller]
fn alike(held: &Table, read: &Table, at_all: bool) {
    assert!(held.rows.len() > 1 || !at_all);
    assert_eq!((&held.columns, held.rows.len()), (&read.columns, read.rows.len()));
    for (row, (a, b)) in held.rows.iter().zip(&read.rows).enumerate() {
        for column in &held.columns {
            let (x, y) = (&a[column], &b[column]);
            let near = || {
                let (x, y): (f64, f64) = (x.parse().ok()?, y.parse().ok()?);
                Some((x - y).abs() <= 1e-6 * (x.abs() + 1e-3))
            };
            assert!(x == y || near() == Some(true), "{column} of row {row}: {x} and {y}");
        }
    }
}

#[test]
fn a_large_tuple_file_gives_the_rows_of_a_small_one() {
    for shuffled in [false, true] {
        let [held, read] = held_and_not(shuffled, "");
        assert_eq!(held[0].rows.len(), 12_000);
        for (held, read) in held.iter().zip(&read) {
            match shuffled {
                // The same taps go through together: the same bytes.
                false => assert!(held.text == read.text, "not the same text"),
                true => alike(held, read, true),
            }
        }
    }
}

#[test]
fn a_large_tuple_file_is_ranked_as_a_small_one() {
    for rest in ["[output]\ntop = 5\n", "[output]\ntop = 5\nper = \"design\"\nby = \"total_rms_mm\"\n"] {
        for shuffled in [false, true] {
            let [held, read] = held_and_not(shuffled, rest);
            assert_eq!(held[1].rows.len(), 5);
            held.iter().zip(&read).for_each(|(held, read)| alike(held, read, true));
        }
    }
}

#[test]
fn a_large_tuple_file_is_refused_as_a_small_one() {
    let mut rows = rows(2_000, 6, false);
    rows[11_000] = rows[11_000].replace("10,", "ten,");
    let said =
        [4, 1000].map(|pad| listed(&rows, pad, "").sweep(&["--json"]).exits(2).json()["error"].clone());
    assert_eq!(said[0]["key"], "D_mm");
    for field in ["key", "value", "line", "message", "allowed"] {
        assert_eq!(said[0][field], said[1][field]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn auto_takes_the_cpu_where_the_address_space_is_limited() {
    let desk = Desk::new(&large());
    let program = assert_cmd::cargo::cargo_bin("vibrissa");
    for limit in [600_000, 1_000_000, 3_000_000] {
        let script = format!("ulimit -v {limit}; exec {} sweep spec.toml --plan", program.display());
        let ran = std::process::Command::new("sh")
            .args(["-c", &script])
            .current_dir(desk.path("."))
            .output()
            .expect("a shell");
        let said = [&ran.stdout, &ran.stderr].map(|text| String::from_utf8_lossy(text)).concat();
        assert!(ran.status.success(), "{limit}: {said}");
        assert!(said.contains("on cpu with") && said.contains("the address space is limited to"), "{said}");
    }
}

/// A calibration edited by hand to values that no rig has is refused before the reference is asked for all its taps.
#[test]
fn an_absurd_calibration_is_refused_at_once() {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../examples");
    let desk = Desk::new(SPEC);
    let (data, spec) = (format!("{examples}/prototype-d10.csv"), format!("{examples}/prototype-d10.toml"));
    desk.run(&["calibrate", &data, "--whisker", &spec, "--out", "cal", "--quiet"]).exits(0);
    let text = desk.read("cal/calibration.toml");
    desk.write("readings.csv", "theta_deg,strain\n4,0.02\n");
    for (old, new) in [
        ("pole_radius = 0.0", "pole_radius = 1000.0"),
        ("pole_radius = 0.0", "pole_radius = 1e6"),
        ("D = 10.0", "D = 1000.0"),
        ("d = 10.0", "d = 1000.0"),
    ] {
        assert!(text.contains(old));
        desk.write("edited.toml", text.replacen(old, new, 1));
        let arguments = ["locate", "edited.toml", "readings.csv", "--force", "--json"];
        let error = soon(new, || desk.run(&arguments)).exits(2).json()["error"].clone();
        let value = error["value"].as_str().unwrap_or_default();
        assert!(value.contains(new.split(" = ").next().unwrap()), "{error}");
        assert!(!error["allowed"].is_null() && error["file"] == "edited.toml", "{error}");
    }
}
