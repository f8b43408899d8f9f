//! Programs that `calibrate --export` wrote, compiled and run.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// Reads lines of drive, signal, zero; writes distance, sigma and status by both precisions.
const HARNESS: &str = r#"
#include "locate.c"
#include <stdio.h>
int main(void)
{
    double drive, signal, zero, a, sigma;
    float af, sigmaf;
    int status, statusf;
    while (scanf("%lf,%lf,%lf", &drive, &signal, &zero) == 3) {
        status = vibrissa_locate(drive, signal, zero, &a, &sigma);
        statusf = vibrissa_locatef((float)drive, (float)signal, (float)zero, &af, &sigmaf);
        printf("%.17g,%.17g,%d,%.9g,%.9g,%d\n", a, sigma, status, af, sigmaf, statusf);
    }
    return 0;
}
"#;

/// What was answered: distance, sigma, words.
#[derive(Debug, Clone)]
pub struct Answer(pub f64, pub f64, pub String);

fn words(code: u8) -> String {
    let all = [
        (1, "no_strain"),
        (2, "strain_limit"),
        (4, "no_root"),
        (8, "ambiguous"),
        (16, "outside_calibration"),
        (32, "bad_input"),
        (64, "inconsistent"),
    ];
    sorted(&all.iter().filter(|(bit, _)| code & bit != 0).map(|(_, w)| *w).collect::<Vec<_>>().join("+"))
}

/// Words in one order.
pub fn sorted(words: &str) -> String {
    let mut all: Vec<&str> = words.split('+').filter(|w| !w.is_empty() && *w != "ok").collect();
    all.sort_unstable();
    all.join("+")
}

/// What a program says that is given `input`.
#[track_caller]
fn ran(command: &mut Command, input: &str) -> String {
    let name = format!("{command:?}");
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("{name} does not start, and is needed here: {e}"));
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    let feed = std::thread::spawn(move || drop(stdin.write_all(input.as_bytes())));
    let out = child.wait_with_output().unwrap();
    feed.join().unwrap();
    assert!(out.status.success(), "{name}: {}", out.status);
    String::from_utf8(out.stdout).unwrap()
}

fn number(field: &str) -> f64 {
    if field.is_empty() { f64::NAN } else { field.parse().unwrap_or(f64::NAN) }
}

/// Reads lines of drive and signals; writes the same.
const OF_CHANNELS: &str = r#"
#include "locate.c"
#include <stdio.h>
int main(void)
{
    double drive, signals[VIBRISSA_CHANNELS], zeros[VIBRISSA_CHANNELS] = {0}, a, sigma, found;
    float few[VIBRISSA_CHANNELS], none[VIBRISSA_CHANNELS] = {0}, af, sigmaf, foundf;
    int status, statusf, k;
    while (scanf("%lf", &drive) == 1) {
        for (k = 0; k < VIBRISSA_CHANNELS; k++) {
            if (scanf(",%lf", signals + k) != 1) {
                return 1;
            }
            few[k] = (float)signals[k];
        }
        status = vibrissa_locate(drive, signals, zeros, &a, &sigma, &found);
        statusf = vibrissa_locatef((float)drive, few, none, &af, &sigmaf, &foundf);
        printf("%.17g,%.17g,%d,%.9g,%.9g,%d\n", a, sigma, status, af, sigmaf, statusf);
    }
    return 0;
}
"#;

/// Reads lines of the signals of the taps of one object.
const OF_TAPS: &str = r#"
#include "locate.c"
#include <stdio.h>
int main(void)
{
    double signals[VIBRISSA_TAPS], a, sigma;
    float few[VIBRISSA_TAPS], af, sigmaf;
    int status, statusf, k;
    while (scanf("%lf", signals) == 1) {
        few[0] = (float)signals[0];
        for (k = 1; k < VIBRISSA_TAPS; k++) {
            if (scanf(",%lf", signals + k) != 1) {
                return 1;
            }
            few[k] = (float)signals[k];
        }
        status = vibrissa_taps(signals, VIBRISSA_ZERO, &a, &sigma);
        statusf = vibrissa_tapsf(few, VIBRISSA_ZERO, &af, &sigmaf);
        printf("%.17g,%.17g,%d,%.9g,%.9g,%d\n", a, sigma, status, af, sigmaf, statusf);
    }
    return 0;
}
"#;

/// The same in Python.
const TAPS_IN_PYTHON: &str = "
import sys
sys.path.insert(0, '.')
import locate
for line in sys.stdin:
    a, sigma, said = locate.locate_taps([float(x) for x in line.split(',')])
    print('' if a is None else repr(a), '' if sigma is None else repr(sigma), locate.words(said), sep=',')
";

/// Answers of `locate.c` at both precisions, and of `locate.py`, to taps of one object.
pub fn together(folder: &Path, input: &str) -> [Vec<Answer>; 3] {
    let [double, float] = compiled(folder, OF_TAPS, input);
    let mut python = Command::new("python3");
    python.current_dir(folder).args(["-I", "-W", "error", "-c", TAPS_IN_PYTHON]);
    [double, float, spoken(&ran(&mut python, input))]
}

/// Answers of `locate.c` at both precisions.
pub fn by_c(folder: &Path, input: &str) -> [Vec<Answer>; 2] {
    compiled(folder, HARNESS, input)
}

/// The same of several channels.
pub fn by_c_of(folder: &Path, input: &str) -> [Vec<Answer>; 2] {
    compiled(folder, OF_CHANNELS, input)
}

fn compiled(folder: &Path, harness: &str, input: &str) -> [Vec<Answer>; 2] {
    std::fs::write(folder.join("harness.c"), harness).unwrap();
    let flags =
        ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O1", "-o", "harness", "harness.c", "-lm"];
    ran(Command::new("cc").current_dir(folder).args(flags), "");
    let out = ran(&mut Command::new(folder.join("harness")), input);
    let fields: Vec<Vec<&str>> = out.lines().map(|l| l.split(',').collect()).collect();
    [0, 3].map(|at| {
        let answer =
            |f: &Vec<&str>| Answer(number(f[at]), number(f[at + 1]), words(f[at + 2].parse().unwrap()));
        fields.iter().map(answer).collect()
    })
}

/// Answers of `locate.py`.
pub fn by_python(folder: &Path, input: &str) -> Vec<Answer> {
    let out =
        ran(Command::new("python3").current_dir(folder).args(["-I", "-W", "error", "locate.py"]), input);
    spoken(&out)
}

/// Lines of distance, sigma and words.
fn spoken(out: &str) -> Vec<Answer> {
    let answer = |l: &str| {
        let fields: Vec<&str> = l.split(',').collect();
        Answer(number(fields[0]), number(fields[1]), sorted(fields[2]))
    };
    out.lines().map(answer).collect()
}
