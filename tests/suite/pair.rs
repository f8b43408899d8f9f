//! Two gauges 90° apart: calibration of the second, and the accuracy of distance, tilt and position.

use std::sync::Arc;

use crate::common::measuring::{REAL, calibrated, data, locator, once, prototype, rig, table};
use crate::common::program::{Desk, says};
use crate::common::sweeping::rms;
use vibrissa::calibrate::Calibrated;
use vibrissa::locate::estimator::Estimator;
use vibrissa::locate::{Locator, Reading, Spatial};
use vibrissa::measure::Data;
use vibrissa::physics::driven::Driven;
use vibrissa::scene::{Drive, Theory};
use vibrissa::simulate::Settings;

const NOISE: f64 = 1e-5;
const SECOND: &str = "second = true\nnoise_strain = 1e-5\n";
const RIG: &str =
    "[tap]\na = { from = 18, to = 48, step = 3 }\ntilt = [-20, 0, 20]\ntheta = [2, 4, 6, 8, 10]\n";
const FRESH: &str = "[tap]\na = { from = 21, to = 45, steps = 50 }\n\
                     tilt = { min = -30, max = 30, samples = 20, sampler = \"random\", seed = 9 }\ntheta = 6\n";

fn noisy(seed: u64, repeats: u64) -> Settings {
    Settings { noise: NOISE, seed, repeats, ..Settings::default() }
}

fn calibration(model: &str) -> Arc<Calibrated> {
    let text = prototype(4.0, &[SECOND, RIG, model]);
    once(&table(&text, &noisy(1, 3)), &text)
}

fn answers(locator: &Locator, data: &Data) -> Vec<Spatial> {
    let readings = |(row, beside): (&vibrissa::measure::Row, &[f64; 2])| Reading {
        drive: row.drive,
        signals: vec![row.value, beside[0]],
        shares: vec![0.0; 2],
        ..Reading::default()
    };
    let all: Vec<_> = data.rows.iter().zip(&data.beside.values).map(readings).collect();
    locator.locate_pairs(&all).unwrap()
}

#[test]
fn a_thousand_taps_are_as_good_as_their_noise_allows() {
    for (name, model) in [("hooke", ""), ("neo", REAL)] {
        let found = calibration(model);
        assert_eq!(found.winner, Estimator::Exact, "{name}: {:?}", found.warnings);
        let fresh = data(&table(&prototype(4.0, &[SECOND, FRESH, model]), &noisy(77, 1)));
        assert_eq!(fresh.rows.len(), 1000);
        let exact = locator(&found, None);
        let two = answers(&exact, &fresh);
        let record = &found.calibration.sides[0];
        let at = record.drives.iter().position(|d| (d - 6.0).abs() < 1e-9).unwrap();
        let k = record.paper.as_ref().unwrap().K[at];
        let curve = exact.rig.curve(Theory::EulerBernoulli, exact.rig.setup.hub);
        let tilts = || fresh.beside.values.iter().map(|v| v[1]);
        // σ_a = K̄ σ_ε/(θ |f′| cos² β), model §6.
        let expected = rms(fresh.rows.iter().zip(tilts()).map(|(row, tilt)| {
            let cos = tilt.to_radians().cos();
            let theta = Driven::of_users(Drive::Angle, row.drive).size();
            k * NOISE / (theta * curve.slope(row.a).abs() * cos * cos)
        }));
        let solved = two.iter().filter(|s| s.located.distance.is_finite()).count();
        let distance = |all: &[Spatial]| {
            let errors = all.iter().zip(&fresh.rows).map(|(s, row)| s.located.distance - row.a);
            rms(errors.filter(|e| e.is_finite()))
        };
        let tilt =
            |all: &[Spatial]| rms(all.iter().zip(tilts()).map(|(s, t)| s.tilt - t).filter(|e| e.is_finite()));
        let scaled = rms(two.iter().zip(tilts()).map(|(s, t)| (s.tilt - t) / s.sigma_tilt));
        let inside =
            |error: &dyn Fn(usize) -> f64| (0..1000).filter(|&i| error(i) <= 1.0).count() as f64 / 1000.0;
        let covered = inside(&|i| ((two[i].located.distance - fresh.rows[i].a) / two[i].located.sigma).abs());
        let tilts_covered =
            inside(&|i| ((two[i].tilt - fresh.beside.values[i][1]) / two[i].sigma_tilt).abs());
        let paper = answers(&locator(&found, Some(Estimator::Paper)), &fresh);
        let lone = fresh.rows.iter().map(|row| exact.locate(row.drive, row.value).distance - row.a);
        let alone = rms(lone.filter(|e| e.is_finite()));
        assert_eq!(solved, 1000, "{name}");
        assert!((distance(&two) / expected - 1.0).abs() < 0.05, "{name}: {} {expected}", distance(&two));
        assert!((0.95..1.05).contains(&scaled), "{name}: {scaled}");
        assert!((0.6..0.76).contains(&covered) && (0.6..0.76).contains(&tilts_covered), "{name}: {covered}");
        // Linear theory is biased at finite rotation; one gauge alone mistakes a tilt for a distance.
        assert!(tilt(&paper) > 4.0 * tilt(&two) && alone > 20.0 * distance(&two), "{name}");
    }
}

#[test]
fn factor_and_misalignment_are_found_back() {
    let (factor, angle) = (1.05, 2f64.to_radians());
    let changed = |text: &str| {
        let mut lines = text.lines();
        let header = lines.next().unwrap();
        let places = ["strain", "strain_2"].map(|name| header.split(',').position(|c| c == name).unwrap());
        let row = |line: &str| {
            let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
            let [first, second] = places.map(|p| fields[p].parse::<f64>().unwrap());
            // Hooke's whisker without extension: no centreline strain.
            fields[places[1]] = (factor * (second * angle.cos() - first * angle.sin())).to_string();
            fields.join(",") + "\n"
        };
        format!("{header}\n{}", lines.map(row).collect::<String>())
    };
    let text = prototype(4.0, &[SECOND, RIG]);
    let made = changed(&table(&text, &noisy(3, 2)));
    let found = calibrated(&made, &text, &[]);
    let second = found.calibration.second.as_ref().unwrap();
    println!("{second:?}");
    assert_eq!(second.fitted, ["factor", "misalignment"]);
    assert!((second.factor - factor).abs() < 4.0 * second.sigma_factor, "{second:?}");
    assert!((second.misalignment_deg - 2.0).abs() < 4.0 * second.sigma_misalignment_deg, "{second:?}");
    assert!(second.sigma_factor < 1e-3 && second.sigma_misalignment_deg < 0.02, "{second:?}");
    assert!((0.9..1.2).contains(&(second.noise / NOISE)), "{second:?}");
    // Tilted rows affect only the second gauge's calibration.
    let upright = |l: &&str| l.starts_with('a') || l.split(',').nth(1) == Some("0");
    let upright: String = made.lines().filter(upright).map(|l| format!("{l}\n")).collect();
    let lone = calibrated(&upright, &text, &[]);
    assert_eq!(lone.calibration.noise, found.calibration.noise);
    assert_eq!(lone.calibration.sides[0], found.calibration.sides[0]);
    // Upright rows determine the misalignment, with the factor of the first gauge.
    let second = lone.calibration.second.as_ref().unwrap();
    assert_eq!(second.fitted, ["misalignment"]);
    assert!((second.misalignment_deg - 2.0 * factor).abs() < 0.02, "{second:?}");
    let told = |w: &String| w.contains("its factor is taken to be that of");
    assert!(lone.warnings.iter().any(told), "{:?}", lone.warnings);
    // Readings are answered with factor and misalignment.
    let readings = |a: f64, tilt: f64| {
        let tap = format!("[tap]\na = {a}\ntilt = {tilt}\ntheta = 6\n");
        data(&changed(&table(&prototype(4.0, &[SECOND, &tap]), &Settings::default())))
    };
    let locator = locator(&found, Some(Estimator::Exact));
    for (a, tilt) in [(33.0, 20.0), (40.0, -35.0), (25.0, 0.0)] {
        let at = answers(&locator, &readings(a, tilt))[0];
        assert!((at.located.distance - a).abs() < 4.0 * at.located.sigma, "{at:?}");
        assert!((at.tilt - tilt).abs() < 4.0 * at.sigma_tilt, "{at:?}");
    }
}

#[test]
fn the_place_is_that_of_first_touch() {
    let found = calibration(REAL);
    let locator = locator(&found, Some(Estimator::Exact));
    let tap = "[tap]\na = 33\ntilt = 25\ntheta = 6\n";
    let one = data(&table(&prototype(4.0, &[SECOND, tap, REAL]), &Settings::default()));
    let at = answers(&locator, &one)[0];
    let rig = rig(&prototype(4.0, &[SECOND, tap, REAL]));
    let taper = rig.shared().taper;
    let (sin, cos) = 25f64.to_radians().sin_cos();
    let expected = [33.0 + rig.setup.hub, taper.radius(33.0) * cos, taper.radius(33.0) * sin];
    for k in 0..3 {
        assert!((at.point[k] - expected[k]).abs() < 4.0 * at.sigma_point[k] + 1e-9, "{at:?} {expected:?}");
    }
    assert!(at.sigma_point.iter().all(|s| *s > 0.0 && *s < 0.2) && at.correlation.abs() <= 1.0, "{at:?}");
}

#[test]
fn the_commands_take_two_signals() {
    let text = prototype(4.0, &[SECOND, RIG]);
    let desk = Desk::new(&text);
    desk.ok("simulate spec.toml --noise 1e-5 --zero-every 25 --signal microstrain --out sim");
    let ran = desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
    assert!(ran.stderr.contains("serve the second gauge only"), "{}", ran.stderr);
    assert!(desk.read("cal/calibration.toml").contains("[second]"));
    let used = desk.table("cal/rows.csv").rows;
    let second = used.iter().filter(|r| r["use"] == "second" && r["reason"].starts_with("tilted"));
    assert_eq!(second.count(), 110);
    desk.ok("locate cal/calibration.toml sim/measurements.csv --out loc");
    let located = desk.table("loc/located.csv").rows;
    let mut taps = 0;
    for row in located.iter().filter(|r| r["theta_deg"] != "0") {
        let number = |name: &str| row[name].parse::<f64>().unwrap_or_else(|_| panic!("{name}: {row:?}"));
        assert!((number("distance_mm") - number("a_mm")).abs() < 5.0 * number("sigma_mm"), "{row:?}");
        let found = number("tilt_deg");
        assert!((found - number("given_tilt_deg")).abs() < 5.0 * number("sigma_tilt_deg"), "{row:?}");
        assert!((number("x_mm") - number("distance_mm")).abs() < 1e-9, "{row:?}");
        taps += 1;
    }
    assert_eq!(taps, 165);
    let header = "theta_deg,strain,strain_2,distance_mm,sigma_mm,tilt_deg,sigma_tilt_deg,corr,x_mm,y_mm,z_mm,sigma_x_mm,sigma_y_mm,sigma_z_mm,status";
    let input = "0,1,2\n6,20000,4000\n6,20000\n6,x,1\n6,1,2\n6,1,3000\n";
    let out = desk.pipe(&["locate", "cal/calibration.toml", "--quiet"], input).exits(0).stdout;
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!((lines[0], lines.len()), (header, 7));
    assert!(lines[1].ends_with("no_strain") && lines[2].ends_with(",ok"), "{out}");
    // A line of another shape leaves its fields empty.
    assert!(lines[3].starts_with(",,,") && lines[3].ends_with("bad_input"), "{out}");
    assert!(lines[4].starts_with("6,,") && lines[4].ends_with("bad_input"), "{out}");
    assert!(lines[5].ends_with("no_strain") && lines[6].ends_with("outside_calibration"), "{out}");
    let paper = desk.stream(
        "locate cal/calibration.toml --quiet --estimator paper",
        "theta_deg,strain_2,strain\n6,4e-3,2e-2\n",
    );
    let tilt = paper.numbers("tilt_deg")[0].unwrap();
    assert!((tilt - 0.2f64.atan().to_degrees()).abs() < 0.2, "{tilt}");
}

#[test]
fn readings_of_two_signals_are_answered_together() {
    let desk = Desk::new(&prototype(4.0, &[SECOND, RIG, REAL]));
    desk.ok("simulate spec.toml --noise 1e-5 --out sim");
    desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
    let locate = |more: &[&str], input: &str| {
        desk.pipe(&[&["locate", "cal/calibration.toml", "--quiet"], more].concat(), input)
    };
    let lines = "6,0.02,0.004 6,nan,0.004 x 8,0.03,-0.01 6,0.02, 6,0.02,inf 5,0.02,0.5 6,-0.02,0.004"
        .split(' ')
        .collect::<Vec<_>>();
    let together = locate(&[], &(lines.join("\n") + "\n")).exits(0).stdout;
    let alone = |line: &str| locate(&[], line).exits(0).stdout.lines().nth(1).unwrap().to_owned();
    let words = "ok bad_input bad_input ok bad_input bad_input strain_limit+no_root outside_calibration";
    assert_eq!(together.lines().count(), 1 + lines.len());
    for ((found, line), word) in together.lines().skip(1).zip(lines).zip(words.split(' ')) {
        assert_eq!(found, alone(line));
        assert!(found.ends_with(&format!(",{word}")), "{found}");
    }
    // `--zero` is subtracted from both signals.
    let numbers =
        |line: &str| -> Vec<f64> { line.split(',').skip(3).take(11).map(|x| x.parse().unwrap()).collect() };
    let shifted = locate(&["--zero", "-0.001,0.002"], "6,0.019,0.006\n").exits(0).stdout;
    let wanted = numbers(together.lines().nth(1).unwrap());
    for (x, y) in numbers(shifted.lines().nth(1).unwrap()).into_iter().zip(wanted) {
        assert!((x - y).abs() <= 1e-6 * y.abs(), "{x} {y}");
    }
    let one = locate(&["--zero", "0.001"], "6,0.02,0.004\n").exits(2).stderr;
    assert!(one.contains("--zero = 0.001") && one.contains("two numbers: X,Y"), "{one}");
    assert!(locate(&["--zero", "1,2,3"], "").exits(2).stderr.contains("X,Y"));
    let export = "calibrate sim/measurements.csv --whisker spec.toml --export c --out cal2";
    desk.refuses(export, &["--export", "[second]"]);
    let text = prototype(4.0, &["noise_strain = 1e-5\n"]);
    desk.write("one.toml", text);
    desk.ok("calibrate sim/measurements.csv --whisker one.toml --out one");
    let two = ["locate", "one/calibration.toml", "--quiet", "--zero", "0,0"];
    says(&desk.pipe(&two, "6,0.02\n").exits(2).stderr, &["one number"]);
}

#[test]
fn contacts_that_do_not_tell_the_tilt_calibrate_one_gauge() {
    for (contact, why) in
        [("\"stick\"", "tell no more than one"), ("{ coulomb = 0.2 }", "no model of tilted edges")]
    {
        let model = format!("[model]\nextension = true\ncontact = {contact}\n");
        let desk =
            Desk::new(&prototype(4.0, &[SECOND, "[tap]\na = [21, 30, 40, 48]\ntheta = [2, 4, 6]\n", &model]));
        desk.ok("simulate spec.toml --out sim");
        let ran = desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
        says(&ran.stderr, &["second gauge is not calibrated", why]);
        assert!(!desk.read("cal/calibration.toml").contains("[second]"));
    }
}

#[test]
fn one_gauge_ignores_the_columns_of_a_second() {
    let desk = Desk::new(&prototype(4.0, &["noise_strain = 1e-5\n"]));
    desk.write(
        "d.csv",
        "a_mm,tilt_deg,theta_deg,strain,reading_2\n21,0,4,0.03,x\n30,95,4,0.024,1\n39,0,4,0.019,1\n",
    );
    let ran = desk.ok("calibrate d.csv --whisker spec.toml --out cal");
    assert!(ran.stderr.contains("ignored columns reading_2, tilt_deg"), "{}", ran.stderr);
}
