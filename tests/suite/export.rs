//! The output of `calibrate --export c`, compiled and run, against `locate`.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::program::Desk;
use crate::common::random::Random;
use vibrissa::export::{Export, FILE, Off};
use vibrissa::locate::{Calibration, Estimator, Locator, locator::opener};
use vibrissa::measure::zero::{Tared, TaredBy};
use vibrissa::scene::RunOptions;
use vibrissa::status::Status;

const HARNESS: &str = include_str!("../data/harness.c");
/// A C++ program that links `locate.c` by its declarations.
const BESIDE: &str = include_str!("../data/beside.cpp");
const STRICT: [&str; 4] = ["-Wall", "-Wextra", "-pedantic", "-Werror"];

const READINGS: usize = 5_000;
/// Largest allowed difference of a distance, mm.
const APART: f64 = 1e-4;
/// Largest allowed relative difference of σ.
const SIGMA: f64 = 0.01;
/// Relative changes that give neighbouring readings.
const NEXT: [f64; 3] = [1e-5, 1e-6, 1e-7];
const LARGEST: usize = 200_000;
/// Drive, signal and zero in the unit of the calibration, each representable as a float.
type Reading = [f64; 3];

/// The signal by the curve of the data; where that is undefined, by the estimator.
fn expected([table, own]: [&Locator; 2], a: f64, drive: f64, sign: f64) -> f64 {
    let of_data = table.expected(a, drive, sign);
    if of_data.is_finite() { of_data } else { own.expected(a, drive, sign) }
}

/// Readings of taps inside, at the edges of and beyond the calibration, of both signs; some are no taps.
fn readings(locator: &Locator, c: &Calibration) -> Vec<Reading> {
    let mut random = Random(7);
    let table = opened(c, Some(Estimator::Learned));
    let both = [&table, locator];
    let wraps = c.zero.wraps;
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
            // 16-bit counts that wrap, with any zero.
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

#[derive(Debug, Clone)]
struct Answer(f64, f64, String);

fn words(code: u8) -> String {
    let all = ["no_strain", "strain_limit", "no_root", "ambiguous", "outside_calibration", "bad_input"];
    let said = all.iter().enumerate().filter(|(bit, _)| code >> bit & 1 == 1).map(|(_, w)| *w);
    sorted(&said.collect::<Vec<_>>().join("+"))
}

fn sorted(words: &str) -> String {
    let mut all: Vec<&str> = words.split('+').filter(|w| !w.is_empty() && *w != "ok").collect();
    all.sort_unstable();
    all.join("+")
}

#[track_caller]
fn ran(folder: &Path, program: &str, arguments: &[&str], input: &str) -> String {
    let mut command = Command::new(program);
    command.current_dir(folder).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child =
        command.spawn().unwrap_or_else(|e| panic!("{program} does not start, and is needed here: {e}"));
    let (mut stdin, input) = (child.stdin.take().unwrap(), input.to_owned());
    let feed = std::thread::spawn(move || drop(stdin.write_all(input.as_bytes())));
    let out = child.wait_with_output().unwrap();
    feed.join().unwrap();
    assert!(out.status.success(), "{program} {arguments:?}: {}", out.status);
    String::from_utf8(out.stdout).unwrap()
}

fn by_c(folder: &Path, input: &str) -> [Vec<Answer>; 2] {
    std::fs::write(folder.join("harness.c"), HARNESS).unwrap();
    let flags = ["-std=c99", "-O1", "-o", "harness", "harness.c", "-lm"];
    ran(folder, "cc", &[&STRICT[..], &flags].concat(), "");
    let out = ran(folder, folder.join("harness").to_str().unwrap(), &[], input);
    let number = |field: &str| field.parse().unwrap_or(f64::NAN);
    let fields: Vec<Vec<&str>> = out.lines().map(|l| l.split(',').collect()).collect();
    [0, 3].map(|at| {
        let answer =
            |f: &Vec<&str>| Answer(number(f[at]), number(f[at + 1]), words(f[at + 2].parse().unwrap()));
        fields.iter().map(answer).collect()
    })
}

/// The answer of `locate` with the signal larger by `share`.
fn located(locator: &Locator, [drive, signal, zero]: Reading, share: f64) -> Answer {
    let above = locator.unit.strain(signal - zero, locator.rig.setup.gauge.factor) * (1.0 + share);
    let at = locator.locate_above(drive, above, 0.0, 0.0);
    let status = if at.status == Status::OK { String::new() } else { at.status.to_string() };
    Answer(at.distance, at.sigma, sorted(&status))
}

#[derive(Debug, Default)]
struct Compared {
    distances: usize,
    off: Off,
    boundary: usize,
    /// Readings outside the range or with a wide σ that exceed the stated error, which is measured on other readings.
    beyond: usize,
}

/// Compares answers with `locate` and with the `stated` error. Next to a change of status, the answer of a reading [`NEXT`] to it counts too.
fn compare(locator: &Locator, all: &[Reading], answers: &[Answer], stated: Off, what: &str) -> Compared {
    assert_eq!(answers.len(), all.len(), "{what}");
    let mut done = Compared::default();
    for (reading, got) in all.iter().zip(answers) {
        let want = located(locator, *reading, 0.0);
        let beside = || NEXT.into_iter().flat_map(|r| [-r, r]).map(|r| located(locator, *reading, r));
        let said = format!("{what} {reading:?}: {got:?}, not {want:?}");
        let outside = want.2.contains("outside_calibration");
        if got.2 != want.2 {
            done.boundary += 1;
            assert!(beside().any(|b| b.2 == got.2), "{said}");
            continue;
        }
        if got.0.is_nan() {
            // An export gives no distance far beyond the range.
            assert!(want.0.is_nan() || outside, "{said}");
            continue;
        }
        let far = beside().map(|b| (b.0 - want.0).abs()).fold(0.0, f64::max);
        let [apart, sigma] = [(got.0 - want.0).abs(), (got.1 / want.1 - 1.0).abs()];
        done.distances += 1;
        if outside || want.1 > 0.05 * want.0 {
            assert!(apart <= 0.05 * want.1 + far, "{said}");
            let peak = located(locator, *reading, 2e-3).0.is_nan();
            let more = apart > 1.1 * stated.rest[0] * want.1 + far || sigma > 1.1 * stated.rest[1] + 1e-3;
            done.beyond += usize::from(more && !peak);
            done.off.rest = [done.off.rest[0].max(apart / want.1), done.off.rest[1].max(sigma)];
        } else {
            assert!(apart <= APART.max(1.1e-3 * want.1) + far && sigma <= SIGMA, "{said}");
            if apart > 1.1e-3 * want.1 {
                done.off.distance = done.off.distance.max(apart);
            }
            done.off.sigma = done.off.sigma.max(sigma);
        }
    }
    done
}

fn opened(c: &Calibration, asked: Option<Estimator>) -> Locator {
    Locator::new(c, "calibration.toml", asked, &opener(&RunOptions::default())).unwrap()
}

fn check(name: &str, calibration: &Calibration, asked: Option<Estimator>) {
    let c = calibration.clone().sealed();
    let locator = opened(&c, asked);
    let export = Export::new(&locator, &c).unwrap_or_else(|e| panic!("{name}: {e}"));
    let folder = tempfile::tempdir().unwrap();
    let text = export.text();
    let bytes = text.len();
    assert!(text.is_ascii() && text.contains(&c.checksum) && bytes < LARGEST, "{name}: {bytes}");
    std::fs::write(folder.path().join(FILE), text).unwrap();
    let all = readings(&locator, &c);
    let mut input = String::new();
    for [drive, signal, zero] in &all {
        writeln!(input, "{drive:?},{signal:?},{zero:?}").unwrap();
    }
    let [double, float] = by_c(folder.path(), &input);
    let who = locator.estimator.word();
    for (answers, kind) in [(double, "double"), (float, "float")] {
        let what = format!("{name} {who} {kind}");
        let done = compare(&locator, &all, &answers, export.off, &what);
        println!("{what}: {done:?}, {bytes} bytes, export says {:?}", export.off);
        assert!(done.distances > READINGS / 2 && done.boundary < READINGS / 1000, "{what}: {done:?}");
        assert!(done.beyond < READINGS / 500, "{what}: {done:?}");
        assert!(kind == "float" || done.off.distance <= 1.5 * export.off.distance + 1e-5, "{what}: {done:?}");
    }
}

fn example(desk: &Desk, name: &str, arguments: &[&str]) -> Calibration {
    let file = format!("{}/examples/{name}", crate::common::ROOT);
    let data = format!("{file}.csv");
    desk.run(&[&["calibrate", &data, "--out", "cal"], arguments].concat()).exits(0);
    Calibration::read(&desk.path("cal/calibration.toml"), false).unwrap()
}

/// A prototype by every estimator, and by one that does not cover the uncalibrated side.
fn prototype(name: &str) {
    let desk = Desk::new("");
    let whisker = format!("{}/examples/{name}.toml", crate::common::ROOT);
    let calibration = example(&desk, name, &["--whisker", &whisker]);
    for asked in Estimator::ALL {
        check(name, &calibration, Some(asked));
    }
    let estimator = Estimator::Curve.word().to_owned();
    check(&format!("{name}, other side by exact"), &Calibration { estimator, ..calibration }, None);
}

#[test]
fn a_cone_is_answered_as_by_locate() {
    prototype("prototype-d4");
}

#[test]
fn a_cylinder_is_answered_as_by_locate() {
    prototype("prototype-d10");
}

#[test]
fn a_calibration_without_whisker_is_exported() {
    let desk = Desk::new("");
    let calibration = example(&desk, "prototype-d7", &[]);
    for asked in [Estimator::Curve, Estimator::Learned] {
        check("no whisker", &calibration, Some(asked));
    }
}

/// One drive, counts of an unknown factor, distances on both sides of the peak: `reading`, `microstrain` and `bridge_mV_per_V`.
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
        check(unit, &calibration, Some(Estimator::Learned));
        if unit == "reading" {
            let zero = Tared { from: TaredBy::Fitted, value: 5.0, error: 0.0, until: None, wraps: true };
            let mut counts = Calibration { zero, ..calibration };
            counts.sides[0].end_stop = Some(1100.0);
            check("counts", &counts, Some(Estimator::Learned));
            let locator = opened(&counts, Some(Estimator::Learned));
            let text = Export::new(&locator, &counts).unwrap().text();
            assert!(text.contains("#define VIBRISSA_ZERO 5e0"));
        }
    }
}

#[test]
fn the_file_belongs_to_the_result_and_links_with_cpp() {
    let desk = Desk::new("");
    let whisker = format!("{}/examples/prototype-d10.toml", crate::common::ROOT);
    example(&desk, "prototype-d10", &["--whisker", &whisker, "--export", "c", "--estimator", "paper"]);
    let listed = desk.whole("cal")["files"].clone();
    assert!(listed.as_array().unwrap().iter().any(|f| f["name"] == FILE), "{listed}");
    assert!(desk.read(&format!("cal/{FILE}")).contains("estimator: paper"));
    desk.write("cal/beside.cpp", BESIDE);
    desk.write("cal/whole.cpp", BESIDE.replace("#define VIBRISSA_DECLARATIONS_ONLY\n", ""));
    let folder = desk.path("cal");
    ran(&folder, "cc", &[&STRICT[..], &["-std=c99", "-c", FILE, "-o", "locate.o"]].concat(), "");
    ran(&folder, "c++", &[&STRICT[..], &["beside.cpp", "locate.o", "-o", "beside"]].concat(), "");
    ran(&folder, "c++", &[&STRICT[..], &["whole.cpp", "-o", "whole"]].concat(), "");
    let answers = ["beside", "whole"].map(|name| ran(&folder, folder.join(name).to_str().unwrap(), &[], ""));
    let distance: f64 = answers[0].split(' ').next().unwrap().parse().unwrap();
    assert!(answers[0] == answers[1] && (35.0..45.0).contains(&distance), "{answers:?}");
    example(&desk, "prototype-d10", &["--whisker", &whisker]);
    assert!(!desk.names("cal").contains(&FILE.to_owned()), "{:?}", desk.names("cal"));
    let data = format!("{}/examples/prototype-d10.csv", crate::common::ROOT);
    for (flags, word) in [("--export java", "possible values: c"), ("--estimator learned", "--export")] {
        desk.refuses(format!("calibrate {data} --out no {flags}"), &[word]);
    }
}
