//! Files as labs have them: values for missing readings, headers in comments, thousands separators, exchanged columns, signals that are not tared.

use std::sync::LazyLock;

use crate::common::measuring::{data, prototype, table};
use crate::common::program::{Desk, Kept, Ran, says};
use vibrissa::simulate::Settings;

const GRID: &str = "[tap]\na = [25, 30, 35, 40, 45, 48]\ntheta = [2, 4, 6]\n";

fn spec() -> String {
    prototype(10.0, &["noise_strain = 1e-5\n", GRID])
}

/// Distance, drive and strain of a small rig; every fifth row is a rest.
fn rows() -> Vec<[f64; 3]> {
    let settings = Settings { noise: 1e-5, zero_every: Some(4), seed: 3, ..Settings::default() };
    let text = table(&spec(), &settings);
    let rows = data(&text).rows;
    rows.iter().map(|r| [if r.a.is_finite() { r.a } else { 25.0 }, r.drive, r.value]).collect()
}

fn csv(header: &str, rows: &[[f64; 3]]) -> String {
    rows.iter().fold(format!("{header}\n"), |text, [p, q, r]| text + &format!("{p},{q},{r}\n"))
}

/// The rig calibrated in `cal`; readings are 0.5 + 150 × strain.
fn desk() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let desk = Desk::new(&spec());
        let readings: Vec<[f64; 3]> = rows().iter().map(|[a, u, e]| [*a, *u, 0.5 + 150.0 * e]).collect();
        desk.write("readings.csv", csv("a_mm,theta_deg,reading", &readings));
        desk.ok("calibrate readings.csv --whisker spec.toml --out cal");
        desk.keep()
    });
    MADE.desk()
}

fn calibrated(desk: &Desk, name: &str, text: &str) -> Ran {
    let (file, out) = (format!("{name}.csv"), format!("c_{name}"));
    desk.write(&file, text);
    desk.run(&["calibrate", &file, "--whisker", "spec.toml", "--out", &out])
}

/// Distance for a strain of 0.0212 at 4°, with a zero of 0.
fn answer(desk: &Desk, name: &str) -> f64 {
    let calibration = format!("c_{name}/calibration.toml");
    let ran = desk.pipe(&["locate", &calibration, "--zero", "0"], "4,0.0212\n").exits(0);
    ran.stdout.lines().nth(1).unwrap().split(',').nth(2).unwrap().parse().unwrap()
}

fn suspects(desk: &Desk, name: &str) -> Vec<String> {
    let table = desk.table(format!("c_{name}/rows.csv"));
    let suspect = table.rows.iter().filter(|r| r["use"] == "suspect");
    suspect.map(|r| format!("{} {}", r["line"], r["reason"].split(':').next().unwrap())).collect()
}

#[test]
fn values_that_stand_for_none_are_named_and_left_out_of_everything() {
    let (desk, rows) = (Desk::new(&spec()), rows());
    calibrated(&desk, "plain", &csv("a_mm,theta_deg,strain", &rows)).exits(0);
    let right = answer(&desk, "plain");
    let taps: Vec<usize> = (0..rows.len()).filter(|k| rows[*k][1] != 0.0).collect();
    let rest = (0..rows.len()).find(|k| rows[*k][1] == 0.0).unwrap();
    // What else stands for none is in measured.rs. A value of one number is no other side of the whisker.
    for (name, mut places, none, unit) in [
        ("taps", [taps[2], taps[8]], -9999.0, "strain"),
        ("rest", [taps[3], rest], 9.9e37, "strain"),
        ("counts", [taps[2], taps[8]], -1.0, "reading"),
    ] {
        let scale = |x: f64| if unit == "reading" { (1e5 * x).round() } else { x };
        let mut wrong: Vec<[f64; 3]> = rows.iter().map(|[a, u, x]| [*a, *u, scale(*x)]).collect();
        places.iter().for_each(|place| wrong[*place][2] = none);
        let ran = calibrated(&desk, name, &csv(&format!("a_mm,theta_deg,{unit}"), &wrong)).exits(0);
        places.sort_unstable();
        let lines = places.map(|place| place + 2);
        let told = if unit == "strain" { "stands for no value" } else { "2 of 18 rows are suspect" };
        says(&ran.stderr, &[told, &format!("(lines {}, {})", lines[0], lines[1])]);
        assert_eq!(suspects(&desk, name), lines.map(|l| format!("{l} missing_value")), "{none}");
        let at = if unit == "reading" { right } else { answer(&desk, name) };
        assert!((at - right).abs() < 0.05, "{none}: {at}");
        let run = desk.whole(&format!("c_{name}"));
        assert_eq!(run["result"]["sides"].as_array().unwrap().len(), 1, "{none}");
    }
}

#[test]
fn a_value_of_one_number_is_no_other_side_of_the_whisker() {
    let (desk, rows) = (Desk::new(&spec()), rows());
    // 0 in most cells of one distance, except its first tap.
    let at = |k: &usize| rows[*k][0] == 30.0 && rows[*k][1] != 0.0;
    let at: Vec<usize> = (0..rows.len()).filter(at).skip(1).collect();
    let mut wrong = rows.clone();
    at.iter().for_each(|k| wrong[*k][2] = 0.0);
    calibrated(&desk, "zeros", &csv("a_mm,theta_deg,strain", &wrong)).exits(0);
    let lines: Vec<String> = at.iter().map(|k| format!("{} missing_value", k + 2)).collect();
    assert_eq!(suspects(&desk, "zeros"), lines);
}

#[test]
fn a_comment_that_names_the_columns_is_the_header() {
    let (desk, plain) = (desk(), Desk::new(&spec()));
    let text = csv("a_mm,theta_deg,strain", &rows());
    calibrated(&plain, "plain", &text).exits(0);
    calibrated(&plain, "savetxt", &format!("# rig 3\n# {text}")).exits(0);
    assert_eq!(answer(&plain, "plain"), answer(&plain, "savetxt"));
    // An unknown drive name is reported at the line of the comment.
    let ran = calibrated(&plain, "other", &text.replace("a_mm,theta_deg", "# a_mm,angle")).exits(2);
    assert!(ran.stderr.contains("other.csv:1") && ran.stderr.contains("theta_deg"), "{}", ran.stderr);
    // Readings with their columns in the other order than the default of a stream.
    let taps: Vec<[f64; 3]> = rows().into_iter().filter(|r| r[1] > 0.0).collect();
    let lines: String = taps.iter().map(|[_, u, e]| format!("{},{u}\n", 0.5 + 150.0 * e)).collect();
    let distances = |text: &str| -> Vec<String> {
        text.lines().skip(1).map(|l| l.rsplit(',').nth(2).unwrap().to_owned()).collect()
    };
    let locate = ["locate", "cal/calibration.toml", "--zero", "0.5"];
    let named = desk.pipe(&locate, &format!("reading,theta_deg\n{lines}")).exits(0).stdout;
    assert!(
        distances(&named).iter().zip(&taps).all(|(d, [a, ..])| (d.parse::<f64>().unwrap() - a).abs() < 0.5)
    );
    for comment in [
        "#reading, theta_deg\n# run of 3 May\n",
        "\u{feff}# reading;theta_deg\n",
        "# reading theta_deg\n",
        "# columns: reading, theta_deg\n",
    ] {
        let text = format!("{comment}{lines}");
        assert_eq!(distances(&desk.pipe(&locate, &text).exits(0).stdout), distances(&named), "{comment}");
        desk.write("field.csv", &text);
        desk.run(&[&locate[..], &["field.csv", "--out", "loc", "--force"]].concat()).exits(0);
        assert_eq!(distances(&desk.read("loc/located.csv")), distances(&named), "{comment}");
        let of_one =
            taps.iter().filter(|r| r[0] == 30.0).map(|[_, u, e]| format!("{},{u}\n", 0.5 + 150.0 * e));
        desk.write("one.csv", comment.to_owned() + &of_one.collect::<String>());
        let next = ["next", "cal/calibration.toml", "one.csv", "--zero", "0.5", "--json", "--force"];
        let next = desk.run(&next).exits(0).json();
        assert!((next["result"]["distance_mm"].as_f64().unwrap() - 30.0).abs() < 0.2, "{next}");
    }
    // Names that do not fit the rows, and a comment that renames columns after data.
    for (text, line) in [
        (format!("# reading theta_deg run\n{lines}"), ":1"),
        (format!("theta_deg,reading\n4,2\n# reading,theta_deg\n{lines}"), ":3"),
    ] {
        let ran = desk.pipe(&locate, &text).exits(2);
        assert!(ran.stderr.contains(line) && ran.stderr.contains("comment"), "{}", ran.stderr);
    }
    let remarks =
        "# a note\n# rig 3, 25 degrees\n# worn tip, angle sweep\n#\n# strain of rig 3\n4,2.6\n# the end\n";
    let remarks = desk.pipe(&locate, remarks).exits(0);
    assert_eq!(remarks.stdout, desk.pipe(&locate, "4,2.6\n").exits(0).stdout);
    let poses: String =
        taps.iter().map(|[_, u, e]| format!("0,0,{},{},{u}\n", 10.0 * u, 0.5 + 150.0 * e)).collect();
    desk.write("poses.csv", format!("# base_x_mm,base_y_mm,heading_deg,reading,theta_deg\n{poses}"));
    let contour =
        ["contour", "poses.csv", "--calibration", "cal/calibration.toml", "--zero", "0.5", "--json"];
    assert_eq!(desk.run(&contour).exits(0).json()["counts"]["points"], taps.len());
}

#[test]
fn thousands_are_asked_for_where_they_are_not_certain() {
    let counts: Vec<[f64; 3]> = rows().iter().map(|[a, u, e]| [*a, *u, (412.0 + 6e4 * e).round()]).collect();
    let grouped = |x: f64, mark: &str| match x >= 1000.0 {
        true => format!("{}{mark}{:03}", (x / 1000.0).floor(), x % 1000.0),
        false => x.to_string(),
    };
    let text = |field: &dyn Fn(f64) -> String| {
        counts.iter().fold("a_mm,theta_deg,reading\n".to_owned(), |t, [a, u, x]| {
            t + &format!("{a},{u},{}\n", field(*x))
        })
    };
    let desk = desk();
    let comma = text(&|x| format!("\"{}\"", grouped(x, ",")));
    says(&calibrated(&desk, "comma", &comma).exits(2).stderr, &["thousands", "reading"]);
    assert!(!desk.path("c_comma/calibration.toml").exists());
    // A time with three decimals is in ms; a cell that a spreadsheet turned into a date is refused.
    let plain = text(&|x| x.to_string());
    let times = |(k, line): (usize, &str)| match k {
        0 => format!("{line},t_s\n"),
        _ if k % 2 == 0 => format!("{line},{k}\n"),
        _ => format!("{line},{k}.500\n"),
    };
    calibrated(&desk, "times", &plain.lines().enumerate().map(times).collect::<String>()).exits(0);
    for (field, is_date) in [
        ("04. Feb", true),
        ("4-Feb", true),
        ("Dez 24", true),
        ("2026-02-04 10:00", true),
        ("4/2/2026", true),
        ("04.02.2026", true),
        ("1.234.567", false),
        ("-5 mm", false),
        ("Mean", false),
        ("1e-3x", false),
        ("3-40", false),
    ] {
        let ran = calibrated(&desk, "date", &plain.replacen(",4,", &format!(",{field},"), 1)).exits(2);
        assert!(ran.stderr.contains(field) && ran.stderr.contains("a date") == is_date, "{}", ran.stderr);
    }
    let clear = text(&|x| (x / 1000.0).to_string())
        .replace("a_mm,theta_deg,reading\n", "a_mm,theta_deg,reading\n25.0,0,0.412\n");
    calibrated(&desk, "volts", &clear).exits(0);
    desk.write("some.csv", "theta_deg,reading\n2,\"412\"\n4,\"1,367\"\n");
    desk.refuses("locate cal/calibration.toml some.csv", &["some.csv:3", "thousands"]);
    for (rows, clear) in [
        (&["2,\"1,412\"", "4,\"1,367\""][..], false),
        (&["2,412", "4,1.367"], false),
        (&["2;412", "4;-1.367"], false),
        (&["2;412", "4;1,367", "4;1,36"], true),
        (&["2.0,412", "4.0,1.367"], true),
        (&["2.0,412", "4.0,\"1,367\""], false),
        (&["2;1,412", "4;1,367"], true),
        (&["2,0.412", "4,1.367", "6,2"], true),
        (&["2,412", "4,1367"], true),
        (&["2,412", "4,1.367e3"], true),
    ] {
        let mark = if rows[0].contains(';') { ";" } else { "," };
        desk.write("some.csv", format!("theta_deg{mark}reading\n{}\n", rows.join("\n")));
        let ran = desk.run(&["locate", "cal/calibration.toml", "some.csv", "--out", "some", "--force"]);
        assert_eq!(ran.stderr.contains("thousands"), !clear, "{rows:?}: {}", ran.stderr);
    }
    let ran =
        desk.pipe(&["locate", "cal/calibration.toml"], "theta_deg,reading\n2,412\n4,\"1,367\"\n").exits(0);
    says(&ran.stderr, &["thousands"]);
    assert!(ran.stdout.ends_with("bad_input\n"), "{}", ran.stdout);
    let samples: String =
        (0..60).map(|k| format!("{k},{}\n", if k % 20 < 10 { "412" } else { "\"1,367\"" })).collect();
    desk.write("raw.csv", format!("t_s,reading\n{samples}"));
    desk.refuses("taps raw.csv", &["raw.csv:12", "thousands"]);
}

#[test]
fn rows_that_are_not_what_they_are_named_are_refused_with_what_fits() {
    let (desk, rows) = (Desk::new(&spec()), rows());
    let changed = |f: &dyn Fn([f64; 3]) -> [f64; 3]| rows.iter().map(|r| f(*r)).collect::<Vec<_>>();
    for (name, rows, fits) in [
        ("exchanged", changed(&|[a, u, e]| [u, a, e]), "a_mm and theta_deg exchanged"),
        ("signal", changed(&|[a, u, e]| [a, e, u]), "theta_deg and strain exchanged"),
        ("centimetres", changed(&|[a, u, e]| [0.1 * a, u, e]), "centimetres"),
        ("metres", changed(&|[a, u, e]| [1e-3 * a, u, e]), "metres"),
        ("tip", changed(&|[a, u, e]| [50.0 - a, u, e]), "from the tip"),
    ] {
        let ran = calibrated(&desk, name, &csv("a_mm,theta_deg,strain", &rows)).exits(2);
        let first = ran.stderr.split("they fit with").nth(1).and_then(|t| t.split(" suspect)").next());
        assert!(first.is_some_and(|first| first.contains(fits)), "{name}: {}", ran.stderr);
        assert!(!desk.path(&format!("c_{name}/calibration.toml")).exists());
    }
    desk.write(
        "turned.csv",
        csv("a_mm,theta_deg,strain", &changed(&|[a, u, e]| [u, if u == 0.0 { 0.0 } else { a }, e])),
    );
    let ran = desk.line("calibrate turned.csv").exits(2);
    assert!(ran.stderr.contains("a_mm and theta_deg exchanged"), "{}", ran.stderr);
    // Two distances cannot predict a third: the columns are not doubted for that.
    let far = rows.iter().map(|r| r[0]).fold(0.0, f64::max);
    let two: Vec<[f64; 3]> = rows.iter().copied().filter(|r| r[1] == 0.0 || r[0] > far - 4.0).collect();
    desk.write("two.csv", csv("a_mm,theta_deg,strain", &two));
    let ran = desk.line("calibrate two.csv").exits(2);
    assert!(!ran.stderr.contains("they fit"), "{}", ran.stderr);
    // Taps beyond the whisker do not raise the warning, nor do two outliers among a few rows, which are named.
    let beyond =
        [[55.0, 2.0, 1e-5], [55.0, 4.0, -1e-5], [60.0, 2.0, 2e-5], [60.0, 4.0, 1e-5], [60.0, 6.0, 1e-5]];
    calibrated(&desk, "beyond", &csv("a_mm,theta_deg,strain", &[&rows[..], &beyond].concat())).exits(0);
    let mut few: Vec<[f64; 3]> = rows.iter().copied().filter(|r| r[1] == 4.0 || r[1] == 0.0).collect();
    let taps: Vec<usize> = (0..few.len()).filter(|k| few[*k][1] != 0.0).collect();
    [taps[1], taps[4]].into_iter().for_each(|k| few[k][2] *= 10.0);
    calibrated(&desk, "few", &csv("a_mm,theta_deg,strain", &few)).exits(0);
    let lines: Vec<String> =
        suspects(&desk, "few").iter().map(|s| s.split(' ').next().unwrap().to_owned()).collect();
    assert_eq!(lines, [taps[1] + 2, taps[4] + 2].map(|line| line.to_string()));
    let radians = changed(&|[a, u, e]| [a, u.to_radians(), e]);
    let ran = calibrated(&desk, "radians", &csv("a_mm,theta_deg,strain", &radians)).exits(0);
    assert!(ran.stderr.contains("57.3") && ran.stderr.contains("radian"), "{}", ran.stderr);
}

#[test]
fn readings_that_are_not_tared_are_told_wherever_that_is_read() {
    let desk = desk();
    desk.write("field.csv", "theta_deg,reading\n4,4.69\n");
    let is_told = |texts: &serde_json::Value| {
        texts.as_array().unwrap().iter().any(|t| t.as_str().unwrap().contains("every distance is wrong"))
    };
    for command in ["locate", "next"] {
        let asked = [command, "cal/calibration.toml", "field.csv", "--json", "--quiet", "--out", command];
        let ran = desk.run(&asked).exits(0);
        let said = [ran.json()["result"]["warnings"].clone(), desk.whole(command)["warnings"].clone()];
        assert!(said.iter().all(is_told), "{command}");
        let zero = desk.run(&[&asked[..], &["--zero", "0.5", "--force"]].concat()).exits(0);
        assert!(!is_told(&zero.json()["result"]["warnings"]) && !is_told(&desk.whole(command)["warnings"]));
    }
    let stream = desk.pipe(&["locate", "cal/calibration.toml"], "4,4.69\n").exits(0);
    assert!(stream.stderr.contains("every distance is wrong"), "{}", stream.stderr);
    // A reading of 0 is not a rest where the zero is 0.5.
    desk.write("zeros.csv", "theta_deg,reading\n0,0.5\n0,0\n4,4.69\n0,0.5\n");
    let distance = |zero: &[&str], file: &str| {
        desk.run(&[&["locate", "cal/calibration.toml", file, "--out", "loc", "--force"], zero].concat())
            .exits(0);
        desk.table("loc/located.csv").rows.iter().rev().find_map(|r| r["distance_mm"].parse::<f64>().ok())
    };
    assert_eq!(
        distance(&[], "zeros.csv").map(|d| (1e3 * d).round()),
        distance(&["--zero", "0.5"], "field.csv").map(|d| (1e3 * d).round())
    );
    let zeroed = desk.pipe(&["locate", "cal/calibration.toml"], "0,0.5\n4,4.69\n").exits(0);
    assert!(!zeroed.stderr.contains("every distance"), "{}", zeroed.stderr);
}
