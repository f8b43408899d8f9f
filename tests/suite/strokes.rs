//! Strokes: readings at growing drive, fitted as one curve with its touch.

use std::sync::LazyLock;

use crate::common::measuring::{REAL, TAPS, prototype};
use crate::common::program::{Desk, Kept};
use crate::common::sweeping::{Row, Table, value as of};

/// Strokes of 0.4 … 8° at six distances, simulated as taps.
const FINE: &str = "[tap]\na = [30, 32, 35, 38, 41, 45]\ntheta = { from = 0.4, to = 8, step = 0.4 }\n";
const NOISE: f64 = 2e-5;

fn desk() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let spec = |taps: &str| prototype(4.0, &["noise_strain = 2e-5\n", taps, REAL]);
        let desk = Desk::new(&spec(TAPS));
        desk.write("fine.toml", spec(FINE));
        desk.ok("simulate spec.toml --out sim --seed 5");
        desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
        desk.ok("simulate fine.toml --out new --seed 11");
        desk.keep()
    });
    MADE.desk()
}

fn taps(desk: &Desk) -> Vec<[f64; 3]> {
    let table = desk.table("new/measurements.csv");
    let mut all: Vec<[f64; 3]> =
        table.rows.iter().map(|row| ["a_mm", "theta_deg", "strain"].map(|c| of(row, c))).collect();
    all.retain(|tap| tap[1] > 0.0);
    all.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    all
}

fn noise(k: usize) -> f64 {
    let mixed = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    NOISE
        * (((mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40) as f64 / 2_f64.powi(23) - 1.0)
}

fn touch(k: usize) -> f64 {
    0.6 + 0.4 * k as f64
}

/// Strokes that touch after drive 0; `named` adds a column `stroke`.
fn strokes(desk: &Desk, named: bool, spoil: &dyn Fn(usize, f64, f64) -> f64) -> String {
    let mut text = format!("a_mm,theta_deg,strain{}\n", if named { ",stroke" } else { "" });
    for (k, stroke) in taps(desk).chunk_by(|p, q| p[0] == q[0]).enumerate() {
        let before = (0..(touch(k) / 0.4) as usize).map(|n| (0.4 * (n + 1) as f64 - 0.2, noise(n)));
        let after = stroke.iter().map(|tap| (tap[1] + touch(k), tap[2]));
        for (u, y) in before.chain(after) {
            let end = if named { format!(",{k}") } else { String::new() };
            text += &format!("{},{u},{}{end}\n", stroke[0][0], spoil(k, u, y));
        }
    }
    text
}

fn some(strokes: &str, wanted: &[usize]) -> String {
    let ends = wanted.iter().map(|k| format!(",{k}")).chain(["stroke".to_owned()]).collect::<Vec<_>>();
    let of = |line: &&str| ends.iter().any(|end| line.ends_with(end));
    strokes.lines().filter(of).map(|line| format!("{line}\n")).collect()
}

fn last(table: &Table) -> Vec<&Row> {
    table.rows.chunk_by(|p, q| p["stroke"] == q["stroke"]).map(|rows| &rows[rows.len() - 1]).collect()
}

#[test]
fn strokes_tell_touch_and_distance() {
    let desk = desk();
    let cal = "cal/calibration.toml";
    desk.write("strokes.csv", strokes(&desk, false, &|_, _, y| y));
    desk.ok(format!("locate {cal} strokes.csv --strokes --out out"));
    let table = desk.table("out/located.csv");
    let told = last(&table);
    assert_eq!(told.len(), 6);
    let mut inside = 0;
    for (k, row) in told.iter().enumerate() {
        let (a, from, to) = (of(row, "a_mm"), of(row, "from_95_mm"), of(row, "to_95_mm"));
        inside += usize::from(from < a && a < to);
        assert!(to - from < 1.0, "{row:?}");
        assert!(of(row, "from_68_mm") > from && of(row, "to_68_mm") < to, "{row:?}");
        assert!((of(row, "touch") - touch(k)).abs() < 5.0 * of(row, "touch_sigma"), "{row:?}");
        assert_eq!(row["stroke_status"], "ok", "{row:?}");
        assert!(of(row, "rows") > 15.0);
    }
    assert!(inside >= 4, "{inside} of six 95 % intervals hold the distance");
    let header = "theta_deg,strain\n";
    let text = desk.read("strokes.csv");
    // A stream gives the same answers row by row; tested with two strokes, as it fits again after each row.
    let two = table.rows.iter().filter(|row| ["30", "32"].contains(&row["a_mm"].as_str())).count();
    let lines = text.lines().skip(1).take(two).map(|line| line.split_once(',').unwrap().1.to_owned() + "\n");
    let answers = desk.pipe(&["locate", cal, "--strokes"], &(header.to_owned() + &lines.collect::<String>()));
    let answers = answers.exits(0).stdout;
    let place = answers.lines().next().unwrap().split(',').position(|n| n == "stroke_distance_mm").unwrap();
    let streamed: Vec<&str> = answers.lines().skip(1).map(|l| l.split(',').nth(place).unwrap()).collect();
    let filed: Vec<&str> = table.rows[..two].iter().map(|row| row["stroke_distance_mm"].as_str()).collect();
    assert_eq!(streamed, filed);
    assert_eq!(table.rows[0]["stroke_status"], "no_strain");
}

#[test]
fn strokes_that_fit_no_curve_say_so() {
    let desk = desk();
    let cal = "cal/calibration.toml";
    // The third slips at 5°, the fifth never touches.
    let spoil = |k: usize, u: f64, y: f64| match k {
        2 if u > 5.0 => 0.93 * y,
        4 => noise((100.0 * u) as usize),
        _ => y,
    };
    desk.write("strokes.csv", some(&strokes(&desk, true, &spoil), &[0, 2, 4, 5]));
    desk.ok(format!("locate {cal} strokes.csv --strokes --out out"));
    let table = desk.table("out/located.csv");
    assert_eq!(table.columns.iter().filter(|c| c.as_str() == "stroke").count(), 1);
    let told = last(&table);
    let words: Vec<&str> = told.iter().map(|row| row["stroke_status"].as_str()).collect();
    assert_eq!([words[0], words[2], words[3]], ["ok", "no_strain", "ok"], "{words:?}");
    assert!(words[1].contains("inconsistent"), "{words:?}");
    assert!((of(told[1], "apart_drive") - 5.0).abs() < 1.0, "{:?}", told[1]);
    // Rows with falling drive are ignored, with a warning.
    let text = desk.read("strokes.csv");
    let lines: Vec<&str> = text.lines().collect();
    let own: Vec<&str> = lines[1..].iter().copied().filter(|line| line.ends_with(",0")).collect();
    let there_and_back = own.iter().chain(own.iter().rev().skip(1)).map(|line| format!("{line}\n"));
    desk.write("back.csv", format!("{}\n{}", lines[0], there_and_back.collect::<String>()));
    let ran = desk.ok(format!("locate {cal} back.csv --strokes --out b"));
    assert!(ran.stderr.contains("the drive falls"), "{}", ran.stderr);
    let back = desk.table("b/located.csv");
    assert_eq!(back.rows[own.len()]["stroke_distance_mm"], "");
    assert_eq!(back.rows[own.len() - 1]["stroke_distance_mm"], told[0]["stroke_distance_mm"]);
    // Repeated samples, a jittering drive and a touch before drive 0 change little.
    let moved = |shift: f64, jitter: f64, times: usize| {
        let of = |(k, line): (usize, &&str)| {
            let fields: Vec<&str> = line.split(',').collect();
            let u = fields[1].parse::<f64>().unwrap() + shift + jitter * noise(k) / NOISE;
            format!("{u},{}\n", fields[2]).repeat(times)
        };
        let text = own.iter().enumerate().map(of).collect::<String>();
        let answers = desk.pipe(&["locate", cal, "--strokes"], &format!("theta_deg,strain\n{text}"));
        let answers = answers.exits(0).stdout;
        let names: Vec<&str> = answers.lines().next().unwrap().split(',').collect();
        let place = |name: &str| names.iter().position(|n| *n == name).unwrap();
        let last: Vec<&str> = answers.lines().rfind(|l| !l.ends_with(",,,")).unwrap().split(',').collect();
        (last[place("stroke_distance_mm")].parse::<f64>().unwrap(), last[place("stroke_status")].to_owned())
    };
    let a = of(told[0], "stroke_distance_mm");
    for (shift, jitter, times) in [(0.0, 0.0, 2), (0.0, 0.04, 1), (-1.5, 0.0, 1)] {
        let (there, words) = moved(shift, jitter, times);
        assert!((there - a).abs() < 0.3 && words == "ok", "{shift} {jitter} {times}: {there} {a} {words}");
    }
    let other = own.iter().map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        format!("{},{}\n", fields[1], -fields[2].parse::<f64>().unwrap())
    });
    let text = format!("theta_deg,strain\n{}", other.collect::<String>());
    let answers = desk.pipe(&["locate", cal, "--strokes"], &text).exits(0).stdout;
    assert!(answers.lines().last().unwrap().ends_with("outside_calibration"), "{answers}");
}

#[test]
fn zero_friction_and_tilt_of_a_stroke_may_be_free() {
    let desk = desk();
    let cal = "cal/calibration.toml";
    let ask = |file: &str, more: &[&str]| {
        desk.run(&[&["locate", cal, file, "--strokes", "--out", "out", "--force"], more].concat()).exits(0);
        let table = desk.table("out/located.csv");
        last(&table).into_iter().cloned().collect::<Vec<Row>>()
    };
    let width = |row: &Row| of(row, "to_68_mm") - of(row, "from_68_mm");
    let inside = |row: &Row| of(row, "from_95_mm") < of(row, "a_mm") && of(row, "a_mm") < of(row, "to_95_mm");
    // The zero is far from the calibration's: no fit with a fixed zero, a fit with a free one.
    desk.write("away.csv", some(&strokes(&desk, true, &|_, _, y| y + 3e-3), &[0, 1]));
    let away = ask("away.csv", &["--free", "zero"]);
    assert!(away.len() == 2 && away.iter().all(inside), "{away:?}");
    assert!(away.iter().all(|row| row["stroke_status"] == "ok"), "{away:?}");
    let fixed = ask("away.csv", &[]);
    assert!(fixed.iter().all(|row| row["stroke_status"] != "ok"), "{fixed:?}");
    desk.write("strokes.csv", some(&strokes(&desk, true, &|_, _, y| y), &[1]));
    let known = ask("strokes.csv", &[]);
    for free in ["friction=0.2", "zero, tilt=10"] {
        let found = ask("strokes.csv", &["--free", free]);
        for (row, known) in found.iter().zip(&known) {
            assert!(inside(row) && width(row) > 1.1 * width(known), "{free} {row:?}");
        }
    }
    desk.ok("calibrate sim/measurements.csv --out alone");
    desk.refuses("locate alone/calibration.toml strokes.csv --strokes --free tilt=5", &["--whisker"]);
}
