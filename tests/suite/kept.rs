//! Sweeps that stop and continue, from every place where they can: the bytes of an undisturbed run. And other files in their folder.

use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use crate::common::program::{Desk, Kept, SPEC, names, says};
use crate::common::sweeping::{CPU, CPU_F64, Place, REFERENCE, ranked};
use vibrissa::error::Error;
use vibrissa::plan::Plan;
use vibrissa::progress::Progress;
use vibrissa::sink::folder::hash_file;
use vibrissa::spec;
use vibrissa::sweep::{self, Report, Target};

const WORK: &str = ".vibrissa-unfinished";

/// Stops the run when a positive multiple of `block` taps is done.
struct Stops<'a> {
    stop: &'a AtomicBool,
    notes: AtomicU64,
    block: u64,
}

impl Progress for Stops<'_> {
    fn at(&mut self, done: u64, _: u64) {
        if done > 0 && done.is_multiple_of(self.block) {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn note(&mut self, words: &str) {
        assert!(words.starts_with("going on: "), "{words}");
        self.notes.fetch_add(1, Ordering::Relaxed);
    }
}

fn sweep(
    text: &str,
    list: &str,
    place: Place,
    out: &Path,
    stopping: Option<u64>,
) -> (Result<Report, Error>, bool) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("list.csv"), list).unwrap();
    let (spec, choice) = (spec::parse("spec.toml", text, folder.path()).unwrap(), place.choice());
    let (plan, stop, never) =
        (Plan::new(&spec.study, &choice).unwrap(), AtomicBool::new(false), AtomicBool::new(false));
    let mut progress = Stops {
        stop: if stopping.is_some() { &stop } else { &never },
        notes: AtomicU64::new(0),
        block: stopping.unwrap_or(1),
    };
    let target = Target { every: Duration::ZERO, ..Target::new(out, &stop) };
    let result = sweep::run(&spec, &plan, &choice, &target, &mut progress);
    (result, progress.notes.load(Ordering::Relaxed) > 0)
}

fn tables(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let names = names(folder).into_iter().filter(|name| name != "run.json");
    names.map(|name| (name.clone(), std::fs::read(folder.join(name)).unwrap())).collect()
}

/// Stops and continues the sweep at every place where it can; returns the number of stops.
pub fn stopped_everywhere(text: &str, list: &str, place: Place) -> u32 {
    stopped_after(text, list, place, 1)
}

/// The same, but stops only after whole blocks of `block` taps.
fn stopped_after(text: &str, list: &str, place: Place, block: u64) -> u32 {
    let folder = tempfile::tempdir().unwrap();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    sweep(text, list, place, &whole, None).0.unwrap();
    let mut stops = 0;
    loop {
        let (result, went_on) = sweep(text, list, place, &out, Some(block));
        assert_eq!(went_on, stops > 0, "it goes on where there is something");
        match result {
            Ok(_) => break,
            Err(e) => {
                assert!(e.exit_code() == 1 && e.to_string().contains("interrupted; "), "{e}");
                assert!(e.to_string().contains(" are kept in "), "{e}");
                assert_eq!(names(&out), [WORK], "nothing half-written under a final name");
            }
        }
        stops += 1;
        assert!(stops < 200, "it does not get on: {text}");
    }
    assert!(tables(&out) == tables(&whole), "other bytes after {stops} stops on {place:?}:\n{text}");
    assert_eq!(names(folder.path()), ["out", "whole"]);
    stops
}

/// Closed forms, so that several chunks are quick; a design each.
fn linear(output: &str) -> String {
    format!(
        "[whisker]\nD = [8, 10]\nd = {{ from = 4, to = 7, steps = 9 }}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
         [tap]\na = {{ from = 21, to = 48, steps = 150 }}\ntheta = {{ from = 1, to = 6, steps = 150 }}\n\
         [model]\ngeometry = \"linear\"\n[output]\n{output}\n"
    )
}

fn go_on_everywhere(cases: &[(String, &str, Place, u32)]) {
    for (text, list, place, least) in cases {
        let stops = stopped_everywhere(text, list, *place);
        assert!(stops >= *least, "{stops} stops on {place:?}: {text}");
    }
}

const RANKED: &str = "top = 40\nby = \"noise_rms_mm\"";
const PARQUET: &str = "format = \"parquet\"";

/// Grids; strokes with two directions, gauges and hubs; Parquet row groups closed before the stop; designs larger than a chunk.
#[test]
fn grids_go_on_from_every_chunk() {
    let strokes = |output: &str| {
        let text = linear(output)
            .replace("theta = {", "tilt = [0, 20]\ntheta = {")
            .replace("steps = 9", "steps = 5");
        let text = text.replacen("L_a = 50", "L_a = 50\nhub = [0, 5]", 1);
        text.replace("to = 6, steps = 150", "to = 6, steps = 75").replace("l = 2\n", "l = 2\nsecond = true\n")
    };
    let rows = linear("tuples = false\ndistances = false\nformat = \"parquet\"")
        .replace("steps = 9 }", "steps = 40_000 }");
    let rows = rows
        .replace("to = 48, steps = 150", "to = 48, steps = 2")
        .replace("to = 6, steps = 150", "to = 6, steps = 2");
    go_on_everywhere(&[
        (linear("tuples = false"), "", CPU_F64, 3),
        (linear(PARQUET), "", CPU_F64, 3),
        (linear(RANKED), "", CPU_F64, 5),
        (linear(&format!("{PARQUET}\ntop = 7\nby = \"noise_rms_mm\"\nper = \"design\"")), "", CPU_F64, 4),
        (strokes(PARQUET), "", CPU_F64, 3),
        (strokes(RANKED), "", CPU_F64, 3),
        (rows, "", CPU_F64, 2),
    ]);
    let large = linear("distances = false\nformat = \"parquet\"");
    let large = large.replace("steps = 150", "steps = 380").replace("steps = 9", "steps = 2");
    assert!(stopped_after(&large, "", CPU_F64, 380 * 380) >= 3);
}

/// Rankings from charts, one set for each of two hubs; slow taps, with smaller chunks; the reference, with the smallest.
#[test]
fn taps_that_are_solved_go_on() {
    let built = |output: &str| {
        let text = linear(output).replace("L_a = 50", "L_a = 50\nbore = [[0, 3], [12, 2], [20, 1]]");
        let text = text.replace("steps = 9 }", "steps = 4 }").replace("steps = 150", "steps = 60");
        text.replace("geometry = \"linear\"", "extension = true")
    };
    let charts = "[whisker]\nD = [8, 10]\nd = { from = 2, to = 9, steps = 20_000 }\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                  [tap]\na = [15, 28, 41, 48]\ntheta = { from = 1, to = 12, steps = 9 }\n[output]\ntop = 30\nby = \"total_rms_mm\"\n";
    let neo = format!("{}[model]\nmaterial = {{ neo-hookean = 3.2 }}\n", charts.replace("20_000", "6_000"));
    let reference = "[whisker]\nD = 10\nd = { from = 4, to = 7, steps = 5 }\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n\
                     [tap]\na = { from = 21, to = 48, steps = 20 }\ntheta = { from = 1, to = 4, steps = 40 }\n";
    go_on_everywhere(&[
        (charts.to_owned(), "", CPU, 4),
        (neo, "", CPU, 4),
        (ranked(30).replacen("L_a = 50", "L_a = 50\nhub = [0, 5]", 1), "", CPU, 2),
        (built(PARQUET), "", CPU, 3),
        (built("top = 20\nby = \"noise_rms_mm\""), "", CPU, 3),
        (reference.to_owned(), "", REFERENCE, 2),
    ]);
}

#[test]
fn tuple_files_go_on() {
    let listed = |output: &str| {
        format!(
            "[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\n[model]\ngeometry = \"linear\"\n[output]\n{output}\n"
        )
    };
    let (alternate, long) = (alternating(60_000), alternating(140_000));
    let mut lines: Vec<&str> = long.lines().collect();
    lines[1..].sort_unstable();
    let ordered = lines.join("\n");
    go_on_everywhere(&[
        (listed(""), &alternate, CPU_F64, 1),
        (listed(PARQUET), &ordered, CPU_F64, 2),
        (listed("top = 50\nby = \"noise_rms_mm\""), &alternate, CPU_F64, 2),
        (
            listed(&format!("{PARQUET}\ntop = 5\nby = \"noise_rms_mm\"\nper = \"design\"")),
            &ordered,
            CPU_F64,
            2,
        ),
    ]);
}

pub fn alternating(rows: usize) -> String {
    let row = |i: usize| {
        let design = i * 7919 % 97;
        let (d, x) = (4.0 + 0.05 * (design % 20) as f64, 3.0 + 0.05 * (design / 20) as f64);
        format!("10,{d:.2},50,{x:.2},2,{},{}\n", 21 + i % 27, 1.0 + 0.5 * (i % 3) as f64)
    };
    format!("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n{}", (0..rows).map(row).collect::<String>())
}

fn stopped() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let desk = Desk::new(&linear("tuples = false"));
        let ran = run_limited(&desk);
        assert_eq!(ran.0, 1, "{}", ran.1);
        says(&ran.1, &[" of 18 designs are kept in out, and the same command goes on with them"]);
        assert_eq!(desk.names("out"), [WORK]);
        desk.keep()
    });
    MADE.desk()
}

/// Runs the sweep with files of at most some kilobytes, as on a full disk; exit code and words.
fn run_limited(desk: &Desk) -> (i32, String) {
    let program = assert_cmd::cargo::cargo_bin("vibrissa");
    let line = "trap '' XFSZ; ulimit -f 300; exec \"$0\" sweep spec.toml --backend cpu --precision f64 --out out --keep-every 0";
    let mut command = std::process::Command::new("bash");
    command.current_dir(desk.path(".")).args(["-c", line]).arg(program);
    let ran = command.output().unwrap();
    (ran.status.code().unwrap(), String::from_utf8(ran.stderr).unwrap())
}

fn go_on(desk: &Desk, more: &[&str]) -> crate::common::program::Ran {
    let line = ["sweep", "spec.toml", "--backend", "cpu", "--precision", "f64", "--out", "out"];
    desk.run(&[&line[..], more].concat())
}

/// The state as if it had taken longer.
fn as_if_long(desk: &Desk) {
    let path = desk.path("out").join(WORK).join(".state");
    let bytes = &std::fs::read(&path).unwrap()[64..];
    let (head, rest) = bytes.split_at(bytes.iter().position(|b| *b == b'\n').unwrap());
    let mut head: serde_json::Value = serde_json::from_slice(head).unwrap();
    head["seconds"] = 4000.0.into();
    let bytes = [head.to_string().as_bytes(), rest].concat();
    std::fs::write(&path, [hash_file(bytes.as_slice()).unwrap().as_bytes(), &bytes].concat()).unwrap();
}

#[cfg(unix)]
#[test]
fn long_work_of_other_values_gives_way_to_force_alone() {
    let desk = stopped();
    let spec = desk.read("spec.toml");
    let other = spec.replace("noise_strain = 1e-6", "noise_strain = 2e-6");
    as_if_long(&desk);
    for (text, more) in [
        (&other, &[][..]),
        (&spec, &["--precision", "f32"]),
        (&spec, &["--precision", "f64", "--tolerance", "1e-7"]),
    ] {
        desk.write("spec.toml", text);
        let line = [&["sweep", "spec.toml", "--backend", "cpu", "--out", "out"], more].concat();
        let ran = desk.run(&line).exits(2);
        says(&ran.stderr, &["an unfinished run of 4000 s", "--force"]);
    }
    desk.write("rig.toml", SPEC.replace("d = [4, 7]", "d = 4"));
    let ran = desk.line("simulate rig.toml --out out").exits(2);
    says(&ran.stderr, &["an unfinished run of 4000 s", "of another command"]);
    // Changed comments or threads are no change.
    desk.write("spec.toml", format!("# A comment\n{spec}"));
    assert!(go_on(&desk, &["--threads", "1"]).exits(0).stderr.contains("going on"));
    let desk = stopped();
    as_if_long(&desk);
    desk.write("spec.toml", &other);
    let ran = go_on(&desk, &["--force"]).exits(0);
    assert!(!ran.stderr.contains("going on"), "{}", ran.stderr);
    let desk = stopped();
    desk.write("spec.toml", &other);
    assert!(!go_on(&desk, &[]).exits(0).stderr.contains("going on"));
    assert_eq!(desk.names("out"), ["designs.csv", "distances.csv", "run.json"]);
}

#[cfg(unix)]
#[test]
fn damaged_work_is_told_and_begun_anew() {
    let desk = stopped();
    let read = |name: &str| std::fs::read(desk.path("out").join(WORK).join(name)).unwrap();
    let (good, rows) = (read(".state"), read("designs.csv"));
    let flipped = |bytes: &[u8], at: usize| {
        let mut bytes = bytes.to_vec();
        bytes[at] ^= 4;
        bytes
    };
    for (bytes, table_bytes) in [
        (&good[..good.len() - 1], &rows[..]),
        (&flipped(&good, 3), &rows),
        (&flipped(&good, good.len() / 2), &rows),
        (&[], &rows),
        (&good, &flipped(&rows, 100)),
        (&good, &rows[..1000]),
    ] {
        let desk = stopped();
        std::fs::write(desk.path("out").join(WORK).join(".state"), bytes).unwrap();
        std::fs::write(desk.path("out").join(WORK).join("designs.csv"), table_bytes).unwrap();
        let ran = go_on(&desk, &[]).exits(0);
        assert!(ran.stderr.contains("begins anew") && !ran.stderr.contains("going on"), "{}", ran.stderr);
        let warnings = desk.whole("out")["warnings"].to_string();
        assert!(
            warnings.contains("the unfinished run in out ") && warnings.contains("begins anew"),
            "{warnings}"
        );
    }
}

#[cfg(unix)]
#[test]
fn what_is_no_work_is_left_alone() {
    use std::os::unix::fs::symlink;
    let desk = Desk::new(SPEC);
    desk.write("mine/notes.txt", "mine");
    std::fs::create_dir(desk.path("out")).unwrap();
    let work = desk.path("out").join(WORK);
    let refused = || {
        for more in [&[][..], &["--force"]] {
            let ran = desk.sweep(&[&["--out", "out"], more].concat()).exits(2);
            assert!(ran.stderr.contains(WORK), "{}", ran.stderr);
        }
        assert_eq!(
            (desk.names("out"), desk.names("mine")),
            (vec![WORK.to_owned()], vec!["notes.txt".to_owned()])
        );
    };
    std::fs::write(&work, "mine").unwrap();
    refused();
    std::fs::remove_file(&work).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&work).status().unwrap().success());
    refused();
    std::fs::remove_file(&work).unwrap();
    // Links and pipes in it are not followed; a state that is a pipe counts as absent.
    std::fs::create_dir(&work).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(work.join(".state")).status().unwrap().success());
    symlink("../../mine", work.join("designs.csv")).unwrap();
    symlink("../../spec.toml", work.join("tuples.csv")).unwrap();
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    assert!(ran.stderr.contains("cannot be gone on with"), "{}", ran.stderr);
    assert_eq!((desk.read("mine/notes.txt").as_str(), desk.read("spec.toml").as_str()), ("mine", SPEC));
    assert_eq!(desk.names("out"), ["designs.csv", "distances.csv", "run.json", "tuples.csv"]);
    // A table that was replaced by a link is not written through.
    let desk = stopped();
    let table = desk.path("out").join(WORK).join("designs.csv");
    std::fs::rename(&table, desk.path("mine.csv")).unwrap();
    symlink("../../mine.csv", &table).unwrap();
    let before = desk.read("mine.csv");
    let ran = go_on(&desk, &[]).exits(1);
    assert!(ran.stderr.contains("designs.csv"), "{}", ran.stderr);
    assert_eq!(desk.read("mine.csv"), before);
}
