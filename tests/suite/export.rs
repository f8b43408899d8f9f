//! What `calibrate --export` writes, compiled and run, against `locate`.

use std::fmt::Write as _;

use crate::common::program::Desk;
use crate::common::random::Random;
use crate::common::robot::{Answer, by_c, by_python, sorted};
use vibrissa::export::{Export, Language};
use vibrissa::locate::{Calibration, Estimator, Locator, estimator, locator::opener};
use vibrissa::measure::zero::{Tared, TaredBy};
use vibrissa::scene::RunOptions;
use vibrissa::status::Status;

/// Readings of each calibration.
const READINGS: usize = 5_000;
/// Largest difference of a distance, mm.
const APART: f64 = 1e-4;
/// Largest relative difference of a standard deviation.
const SIGMA: f64 = 0.01;
/// A reading: drive, signal and zero in the unit of the calibration, each of them a float.
type Reading = [f64; 3];

/// A signal that the data themselves, or else the estimator, expect of a tap.
fn expected([table, own]: [&Locator; 2], a: f64, drive: f64, sign: f64) -> f64 {
    let of_data = table.expected(a, drive, sign);
    if of_data.is_finite() { of_data } else { own.expected(a, drive, sign) }
}

/// Readings of taps in, at the edges of and beyond the calibration, of both signs; some of no tap at all.
fn readings(locator: &Locator, c: &Calibration) -> Vec<Reading> {
    let mut random = Random(7);
    let table = opened(c, Some(estimator::LEARNED));
    let both = [&table, locator];
    let wraps = c.zero.as_ref().is_some_and(|t| t.wraps);
    let float = |x: f64| f64::from(x as f32);
    let factor = locator.rig.setup.gauge.factor;
    let [lo, hi] = c.sides[0].distances_mm;
    let drives = &c.sides[0].drives;
    let [first, last] = [drives[0], drives[drives.len() - 1]];
    let one = |k: usize| {
        let drive = match k % 4 {
            _ if !locator.drive_recorded => 1.0,
            0 => drives[(random.uniform() * drives.len() as f64) as usize],
            1 if k % 100 == 1 => random.between(0.9 * first, 1.1 * last),
            _ => random.between(first, last),
        };
        let drive = float(drive);
        let sign = if k % 10 < 8 { f64::from(c.sides[0].sign) } else { -f64::from(c.sides[0].sign) };
        let a = match k % 20 {
            3 => [lo, hi][k / 20 % 2],
            4 => random.between(0.5 * lo, 1.5 * hi),
            _ => random.between(lo - 0.1 * (hi - lo), hi + 0.1 * (hi - lo)),
        };
        let middle = expected(both, 0.5 * (lo + hi), drive, sign);
        let signal = match k % 20 {
            5 => middle * 10f64.powf(random.between(-3.0, 3.0)),
            _ => expected(both, a, drive, sign),
        };
        let signal = if signal.is_finite() { signal } else { sign * middle.abs() };
        let signal = locator.unit.value(if signal.is_finite() { signal } else { sign * 0.01 }, factor);
        match k {
            _ if k.is_multiple_of(200) => [drive, 0.0, 0.0],
            _ if k % 400 == 101 => [drive, f64::NAN, 0.0],
            _ if k % 400 == 301 => [drive, f64::INFINITY, 0.0],
            // Counts of 16 bits, whose zero may lie anywhere.
            _ if wraps => {
                let zero = random.between(0.0, 65536.0).floor();
                [drive, (signal + zero).round().rem_euclid(65536.0), zero]
            }
            _ if k.is_multiple_of(2) => {
                let zero = float(0.05 * signal * random.between(-1.0, 1.0));
                [drive, float(signal + zero), zero]
            }
            _ => [drive, float(signal), 0.0],
        }
    };
    (0..READINGS).map(one).collect()
}

/// What `locate` says of a reading whose signal is `share` larger.
fn located(locator: &Locator, [drive, signal, zero]: Reading, share: f64) -> Answer {
    let above = locator.unit.strain(signal - zero, locator.rig.setup.gauge.factor) * (1.0 + share);
    let at = locator.locate_above(drive, above, 0.0, 0.0);
    let status = if at.status == Status::OK { String::new() } else { at.status.to_string() };
    Answer(at.distance, at.sigma, sorted(&status))
}

/// How answers compare.
#[derive(Debug, Default)]
struct Compared {
    distances: usize,
    /// Largest difference, without and with those next to the peak, mm.
    largest: [f64; 2],
    /// Largest relative difference of sigma, without those.
    sigma: f64,
    /// Readings next to the peak of the signal, where their last digits move the distance.
    at_peak: usize,
    /// Readings next to where the status changes.
    boundary: usize,
    /// Readings next to where `learned` passes from the tangent of its curve to the median of its posterior: there the answer jumps, by less than σ.
    switched: usize,
}

/// Compares, with readings that may be off by a share of `rounding`.
fn compare(locator: &Locator, all: &[Reading], answers: &[Answer], rounding: f64, what: &str) -> Compared {
    assert_eq!(answers.len(), all.len(), "{what}");
    let mut done = Compared::default();
    for (reading, got) in all.iter().zip(answers) {
        let want = located(locator, *reading, 0.0);
        let beside = || [-rounding, rounding].map(|r| located(locator, *reading, r));
        if got.2 != want.2 {
            done.boundary += 1;
            assert!(beside().iter().any(|b| b.2 == got.2), "{what} {reading:?}: {got:?}, not {want:?}");
            continue;
        }
        if got.0.is_nan() {
            // An export gives no distance far beyond the range.
            let beyond = want.2.contains("outside_calibration");
            assert!(want.0.is_nan() || beyond, "{what} {reading:?}: {got:?}, not {want:?}");
            continue;
        }
        // Next to the peak the rounding of the reading itself moves the distance farther than that.
        let spread = |f: &dyn Fn(&Answer) -> f64| beside().iter().map(f).fold(0.0, f64::max);
        let [apart, sigma] = [(got.0 - want.0).abs(), (got.1 / want.1 - 1.0).abs()];
        done.distances += 1;
        done.largest[1] = done.largest[1].max(apart);
        if apart > APART || sigma > SIGMA {
            done.at_peak += 1;
            if what.contains(" learned ") && apart < 0.5 * want.1.min(got.1) {
                done.switched += 1;
                continue;
            }
            let none = beside().iter().any(|b| b.0.is_nan());
            let far = spread(&|b| (b.0 - want.0).abs());
            let unsure = spread(&|b| (b.1 / want.1 - 1.0).abs());
            // Without a distance beside it, it is at the peak itself.
            let close = apart <= APART.max(far) && (none || sigma <= SIGMA.max(unsure));
            assert!(close, "{what} {reading:?}: {got:?}, not {want:?}");
        } else {
            done.largest[0] = done.largest[0].max(apart);
            done.sigma = done.sigma.max(sigma);
        }
    }
    done
}

fn opened(c: &Calibration, asked: Option<&'static dyn Estimator>) -> Locator {
    Locator::new(c, "calibration.toml", asked, &opener(&RunOptions::default())).unwrap()
}

/// Exports `calibration` as answered by `asked`, runs it, compares.
fn check(name: &str, calibration: &Calibration, asked: Option<&'static dyn Estimator>) {
    let c = calibration.clone().sealed();
    let locator = opened(&c, asked);
    let export = Export::new(&locator, &c).unwrap_or_else(|e| panic!("{name}: {e}"));
    let folder = tempfile::tempdir().unwrap();
    let mut sizes = Vec::new();
    for (_, language, _) in Language::ALL {
        let text = export.text(language);
        assert!(
            text.is_ascii() && text.contains(&c.checksum) && text.len() < 200_000,
            "{name}: {}",
            text.len()
        );
        sizes.push(text.len());
        std::fs::write(folder.path().join(language.file()), text).unwrap();
    }
    let all = readings(&locator, &c);
    let mut input = String::new();
    for [drive, signal, zero] in &all {
        writeln!(input, "{drive:?},{signal:?},{zero:?}").unwrap();
    }
    let [double, float] = by_c(folder.path(), &input);
    let python = by_python(folder.path(), &input);
    let who = locator.estimator.name();
    for (answers, kind, rounding) in
        [(double, "double", 1e-7), (float, "float", 2e-6), (python, "python", 1e-7)]
    {
        let what = format!("{name} {who} {kind}");
        let done = compare(&locator, &all, &answers, rounding, &what);
        println!("{what}: {done:?}, bytes {sizes:?}, export says {:.1e} mm", export.error());
        assert!(done.distances > READINGS / 2 && done.boundary < READINGS / 1000, "{what}: {done:?}");
        assert!(done.at_peak < READINGS / 200, "{what}: {done:?}");
        assert!(done.switched < READINGS / 1000, "{what}: {done:?}");
    }
}

/// The calibration of a file in `examples/` by the program itself.
fn example(desk: &Desk, name: &str, arguments: &[&str]) -> Calibration {
    let file = format!("{}/examples/{name}", crate::common::ROOT);
    let data = format!("{file}.csv");
    desk.run(&[&["calibrate", &data, "--out", "cal"], arguments].concat()).exits(0);
    Calibration::read(&desk.path("cal/calibration.toml"), false).unwrap()
}

/// A prototype by every estimator, and by one that leaves the side that was not calibrated to another.
fn prototype(name: &str) {
    let desk = Desk::new("");
    let whisker = format!("{}/examples/{name}.toml", crate::common::ROOT);
    let calibration = example(&desk, name, &["--whisker", &whisker]);
    for asked in estimator::ALL {
        check(name, &calibration, Some(asked));
    }
    let estimator = estimator::CURVE.name().to_owned();
    check(&format!("{name}, other side by exact"), &Calibration { estimator, ..calibration }, None);
}

#[test]
fn a_cone_is_answered_as_by_locate() {
    prototype("prototype-d4");
}

#[test]
fn a_slender_cone_is_answered_as_by_locate() {
    prototype("prototype-d7");
}

#[test]
fn a_cylinder_is_answered_as_by_locate() {
    prototype("prototype-d10");
}

#[test]
fn a_calibration_without_whisker_is_exported() {
    let desk = Desk::new("");
    let calibration = example(&desk, "prototype-d7", &[]);
    for asked in [estimator::CURVE, estimator::LEARNED] {
        check("no whisker", &calibration, Some(asked));
    }
}

/// One drive, counts of an unknown factor, a distance on both sides of the peak: `reading` and `microstrain`, `bridge_mV_per_V`.
#[test]
fn every_unit_is_taken_as_it_was_recorded() {
    let desk = Desk::new("");
    let signal = |a: f64| 0.3 * (a - 6.0) / (a * a);
    let bridge = |e: f64| 1000.0 * 2.21 * e / (4.0 + 2.0 * 2.21 * e);
    let units: [(&str, &dyn Fn(f64) -> f64); 3] =
        [("reading", &|e| 1e5 * e), ("microstrain", &|e| 1e6 * e), ("bridge_mV_per_V", &bridge)];
    for (unit, value) in units {
        let mut text = format!("a_mm,{unit}\n");
        for k in 0..3 {
            for a in 8..=40 {
                let off = 1.0 + 1e-3 * f64::from((a * 7 + k * 5) % 11 - 5);
                writeln!(text, "{a},{}", value(signal(f64::from(a)) * off)).unwrap();
            }
        }
        desk.write("data.csv", text);
        desk.run(&["calibrate", "data.csv", "--out", unit]).exits(0);
        let calibration = Calibration::read(&desk.path(&format!("{unit}/calibration.toml")), false).unwrap();
        check(unit, &calibration, Some(estimator::LEARNED));
        if unit == "reading" {
            let zero = Tared { from: TaredBy::Fitted, value: 5.0, error: 0.0, until: None, wraps: true };
            let mut counts = Calibration { zero: Some(zero), ..calibration };
            counts.sides[0].end_stop = Some(1100.0);
            check("counts", &counts, Some(estimator::LEARNED));
            let locator = opened(&counts, Some(estimator::LEARNED));
            let text = Export::new(&locator, &counts).unwrap().text(Language::C);
            assert!(text.contains("#define VIBRISSA_ZERO 5e0"));
        }
    }
}

#[test]
fn the_files_belong_to_the_result() {
    let desk = Desk::new("");
    let whisker = format!("{}/examples/prototype-d10.toml", crate::common::ROOT);
    example(&desk, "prototype-d10", &["--whisker", &whisker, "--export", "c,python", "--estimator", "paper"]);
    let listed = desk.whole("cal")["files"].clone();
    for file in ["locate.c", "locate.py"] {
        assert!(listed.as_array().unwrap().iter().any(|f| f["name"] == file), "{listed}");
        assert!(desk.read(&format!("cal/{file}")).contains("estimator: paper"));
    }
    // Run again without it, they are gone with the result they belonged to.
    example(&desk, "prototype-d10", &["--whisker", &whisker]);
    assert!(!desk.names("cal").iter().any(|n| n.starts_with("locate.")), "{:?}", desk.names("cal"));
    let data = format!("{}/examples/prototype-d10.csv", crate::common::ROOT);
    for (flags, word) in [(&["--export", "java"][..], "python"), (&["--estimator", "learned"], "--export")] {
        let ran = desk.run(&[&["calibrate", &data, "--out", "no"], flags].concat()).exits(2);
        assert!(ran.stderr.contains(word), "{}", ran.stderr);
    }
}
