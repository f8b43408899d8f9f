//! `locate`: bad input, streams, files.

use std::sync::LazyLock;

use crate::common::measuring::{REAL, TAPS, prototype, table};
use crate::common::program::{Desk, Kept};
use crate::common::sweeping::Table;
use crate::counted::numbers;
use vibrissa::simulate::Settings;

const HEADER: &str = "theta_deg,strain,distance_mm,sigma_mm,status";

fn calibrated() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let desk = Desk::new(&prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL]));
        desk.ok("simulate spec.toml --repeats 3 --out sim");
        let ran = desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
        assert!(
            !ran.stderr.contains("ignored"),
            "what a simulation writes beside is expected: {}",
            ran.stderr
        );
        desk.keep()
    });
    MADE.desk()
}

#[test]
fn a_header_in_another_encoding_is_refused() {
    let desk = calibrated();
    std::fs::write(desk.path("l.csv"), b"strain,theta_deg,gr\xf6\xdfe\n0.02,4,1\n").unwrap();
    desk.refuses("locate cal/calibration.toml l.csv --out out", &["l.csv:1", "UTF-8"]);
    assert!(!desk.path("out").exists());
}

#[test]
fn the_words_of_located_readings_add_up() {
    let desk = calibrated();
    // The second reading is above the strain limit and out of range: two words.
    desk.write("r.csv", "theta_deg,strain\n4,0.02\n4,0.2\n40,0.2\n4,1e-9\n");
    let ran = desk.ok("locate cal/calibration.toml r.csv --out out");
    let line = ran.stdout.lines().find(|line| line.starts_with("4 readings located")).unwrap();
    let (_, words) = line.rsplit_once(": ").unwrap();
    assert!(numbers(words) == 4 && words.contains('+'), "{words}");
}

fn stream(desk: &Desk, arguments: &[&str], input: &[u8]) -> (i32, Vec<String>, String) {
    let ran = desk.pipe(&[&["locate"], arguments].concat(), input);
    (ran.code, ran.stdout.lines().map(str::to_owned).collect(), ran.stderr)
}

#[test]
fn every_row_comes_back_with_its_reason() {
    let desk = Desk::new(&prototype(10.0, &[TAPS]));
    desk.ok("simulate spec.toml --out sim");
    let mut rows: Vec<String> = desk.read("sim/measurements.csv").lines().map(str::to_owned).collect();
    let more = "33,4,NaN 33,4, 33,-4,0.01 60,4,0.01 3,4,0.01 33,4,0 33,4,20000";
    rows.extend(more.split(' ').map(|row| format!("{row},1,,,ok")));
    rows.push(rows[5].clone());
    desk.write("d.csv", rows.join("\n"));
    let ran = desk.json("calibrate d.csv --whisker spec.toml --out out");
    let table = desk.table("out/rows.csv");
    assert_eq!(table.rows.len(), rows.len() - 1, "nothing is lost");
    let tail: Vec<&str> = table.rows[110..].iter().map(|r| r["reason"].split(':').next().unwrap()).collect();
    let expected = "not_a_number,not_a_number,outside_domain,outside_domain,no_strain,zero_signal,wrong_unit,equal to line 6";
    assert_eq!(tail.join(","), expected);
    assert!(table.rows[..110].iter().all(|r| r["use"] == "used"));
    assert_eq!(ran["counts"]["suspect"]["not_a_number"], 2);
    assert_eq!(ran["counts"]["repeated_lines"], 1);
    assert!(ran["result"]["sides"][0]["with_suspects"].is_object());
    let names = ["K_table.csv", "calibration.toml", "designs.csv", "distances.csv", "rows.csv", "run.json"];
    assert_eq!(desk.names("out"), names);
}

#[test]
fn results_are_replaced_by_the_same_command_on_the_same_data_only() {
    let desk = calibrated();
    desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal --fit nu");
    std::fs::copy(desk.path("sim/measurements.csv"), desk.path("other.csv")).unwrap();
    desk.refuses("calibrate other.csv --whisker spec.toml --out cal", &[]);
    desk.ok("calibrate other.csv --whisker spec.toml --out cal --force");
}

#[test]
fn a_stream_answers_every_line_and_goes_on() {
    let desk = calibrated();
    let long = "1".repeat(100_000);
    let input = format!(
        "\u{feff}4,0.02\r\n4,0.02,1\n\nhello\n4;0.02\n4,-0.02\n0.1,0.02\n11,0.02\n4,0\n4,0.9\n4,1e-9\nNaN,0.02\n{long}\n\"4\",\"0.02\"\n4,0.02"
    );
    let mut bytes = input.into_bytes();
    bytes.extend(b"\n\xff\xfe,1\n4,0.03");
    let (code, lines, stderr) = stream(&desk, &["cal/calibration.toml"], &bytes);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(lines[0], HEADER);
    let status: Vec<&str> = lines[1..].iter().map(|l| l.rsplit(',').next().unwrap()).collect();
    let expected = "ok bad_input bad_input bad_input ok ok outside_calibration outside_calibration no_strain \
                    strain_limit+no_root outside_calibration bad_input bad_input ok ok bad_input ok";
    assert_eq!(status.join(" "), expected);
    assert!(lines[1..].iter().all(|l| l.split(',').count() == 5));
    let distance = |l: &String| l.split(',').nth(2).unwrap().parse::<f64>().unwrap();
    let (contact, far) = (distance(&lines[1]), distance(&lines[6]));
    assert!((contact - far).abs() < 2.0 && contact != far, "{contact} {far}");
}

#[test]
fn files_are_answered_into_a_folder() {
    let desk = calibrated();
    let ran = desk.json("locate cal/calibration.toml sim/measurements.csv --out loc");
    assert_eq!(ran["counts"]["readings"], 330);
    let (table, truth) = (desk.table("loc/located.csv"), desk.table("sim/measurements.csv"));
    let own = truth.columns.join(",").replace("status", "given_status");
    assert_eq!(table.columns.join(","), format!("line,{own},zero,distance_mm,sigma_mm,status"));
    for (at, row) in table.rows.iter().zip(&truth.rows) {
        let error = at["distance_mm"].parse::<f64>().unwrap() - row["a_mm"].parse::<f64>().unwrap();
        assert!(error.abs() < 5.0 * at["sigma_mm"].parse::<f64>().unwrap(), "{at:?} {row:?}");
    }
    desk.ok("locate cal/calibration.toml sim/measurements.csv --out loc --estimator paper");
    desk.refuses("locate cal/calibration.toml sim/measurements.csv --out cal", &[]);
}

#[test]
fn an_edited_calibration_is_read_when_forced_and_a_commented_one_always() {
    let desk = calibrated();
    let text = desk.read("cal/calibration.toml");
    let answer = |text: &str, more: &[&str]| {
        desk.write("c.toml", text);
        stream(&desk, &[&["c.toml"], more].concat(), b"4,0.02\n")
    };
    let short = text.lines().take(30).collect::<Vec<_>>().join("\n");
    let (code, _, stderr) = answer(&short, &[]);
    assert!(code == 2 && stderr.contains("c.toml") && stderr.contains("no calibration"), "{stderr}");
    assert_eq!(answer(&text.replacen("noise = ", "noise = 1", 1), &["--force"]).0, 0);
    assert_eq!(answer(&format!("# my note\n{text}"), &[]).0, 0, "comments change nothing");
}

#[test]
fn synthetic_data_say_so_and_repeat_with_their_seed() {
    let spec = prototype(4.0, &["noise_strain = 1e-5\n", TAPS]);
    let desk = Desk::new(&spec);
    let run = |more: &str| {
        desk.ok(format!("simulate spec.toml --out a --force {more}"));
        desk.table("a/measurements.csv")
    };
    let (a, b, c) = (run(""), run(""), run("--seed 2"));
    assert_eq!(a, b);
    assert_ne!(a, c);
    assert!(a.rows.iter().all(|r| r["source"] == "synthetic"));
    let made = |noise: f64, more: Settings| Table::parse(table(&spec, &Settings { noise, ..more }));
    let often = |zero_every| Settings { repeats: 40, zero_every, ..Settings::default() };
    let (clean, noisy) = (made(0.0, often(None)), made(1e-5, often(Some(5))));
    let strains = |t: &Table| -> Vec<f64> {
        t.rows.iter().filter(|r| r["theta_deg"] != "0").map(|r| r["strain"].parse().unwrap()).collect()
    };
    let off: Vec<f64> = strains(&clean).iter().zip(strains(&noisy)).map(|(x, y)| (y - x) / 1e-5).collect();
    let (n, mean) = (off.len() as f64, off.iter().sum::<f64>() / off.len() as f64);
    let sd = (off.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
    assert!(off.len() == 4400 && mean.abs() < 0.06 && (sd - 1.0).abs() < 0.04, "{mean} {sd}");
    let slow = made(0.0, Settings { hysteresis: 0.01, ..Settings::default() });
    assert_ne!(strains(&slow), strains(&made(0.0, Settings::default())));
    for bad in ["--noise -1", "--outliers 2", "--signal volts", "--factor 0"] {
        desk.refuses(format!("simulate spec.toml --out h {bad}"), &[]);
    }
}
