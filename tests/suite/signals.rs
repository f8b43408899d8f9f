//! Ctrl-C, SIGTERM, SIGHUP: handled at any time, ignored where they were ignored at the start; and the files they leave.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Write};
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::Command;
use std::time::Duration;

use crate::common::measuring::REAL;
use crate::common::program::{Desk, SPEC};
use crate::common::world::{
    Running, calibrated, ends, program, send, until, until_it_hears, until_it_works, words,
};
use libc::{SIGHUP, SIGINT, SIGTERM};
use serde_json::Value;

fn pipe(desk: &Desk, name: &str) {
    assert!(Command::new("mkfifo").arg(desk.path(name)).status().unwrap().success());
}

fn start(mut command: Command) -> Running {
    let child = Running::new(&mut command);
    until_it_hears(&child, SIGTERM);
    child
}

fn begun(desk: &Desk) -> bool {
    let writes = |folder: std::path::PathBuf| folder.join(".vibrissa-unfinished").exists();
    let results = desk.names("results").into_iter().map(|name| desk.path("results").join(name));
    results.chain([desk.path("loc")]).any(writes)
}

fn unread(pipe: &impl AsRawFd) -> i32 {
    let mut bytes = 0;
    // SAFETY: only asks for a number, and writes it.
    assert_eq!(unsafe { libc::ioctl(pipe.as_raw_fd(), libc::FIONREAD, &mut bytes) }, 0);
    bytes
}

/// Starts a program with `signal` ignored, as `nohup` and background jobs of scripts do.
fn ignoring(mut command: Command, signal: i32) -> Running {
    // SAFETY: `signal` may be called between fork and exec.
    unsafe {
        command.pre_exec(move || {
            libc::signal(signal, libc::SIG_IGN);
            Ok(())
        })
    };
    Running::new(&mut command)
}

/// Sends `text` to a stream and returns the next line of its answers; the first is the header.
fn answer(child: &mut Running, text: &str) -> String {
    child.stdin.as_mut().unwrap().write_all(text.as_bytes()).unwrap();
    let mut line = String::new();
    // A buffer of one byte keeps later answers in the pipe.
    BufReader::with_capacity(1, child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    line
}

#[test]
fn what_was_ignored_stays_ignored() {
    let desk = calibrated();
    for (signal, other) in [(SIGHUP, SIGTERM), (SIGINT, SIGTERM), (SIGTERM, SIGINT)] {
        let mut child = ignoring(program(&desk, &["locate", "cal/calibration.toml"]), signal);
        until_it_hears(&child, other);
        answer(&mut child, "");
        send(&child, signal);
        assert!(answer(&mut child, "4,0.02\n").contains("ok"), "{signal}");
        drop(child.stdin.take());
        assert_eq!(ends(child).status.code(), Some(0), "{signal}");
    }
}

#[test]
fn a_file_that_does_not_open_makes_no_command_deaf() {
    let desk = calibrated();
    pipe(&desk, "pipe");
    let lines: [&[&str]; 11] = [
        &["sweep", "pipe"],
        &["sweep", "pipe", "--explain"],
        &["tap", "pipe"],
        &["optimise", "pipe"],
        &["verify", "pipe"],
        &["simulate", "pipe"],
        &["calibrate", "pipe", "--whisker", "spec.toml"],
        &["calibrate", "sim/measurements.csv", "--whisker", "pipe"],
        &["locate", "pipe"],
        &["locate", "cal/calibration.toml", "pipe", "--out", "out"],
        &["locate", "cal/calibration.toml"],
    ];
    let before = desk.names(".");
    for (signal, json) in [(SIGINT, false), (SIGTERM, true), (SIGHUP, true)] {
        let all: Vec<Running> = lines
            .iter()
            .map(|line| start(program(&desk, &[*line, if json { &["--json"] } else { &[] }].concat())))
            .collect();
        // The signal may come at any point; most commands are waiting for the file.
        std::thread::sleep(Duration::from_millis(100));
        all.iter().for_each(|child| send(child, signal));
        for (child, line) in all.into_iter().zip(lines) {
            let left = ends(child);
            assert_eq!(left.status.code(), Some(1), "{line:?}: {}", words(&left.stderr));
            if json {
                let object: Value = serde_json::from_slice(&left.stdout).unwrap();
                assert_eq!((&object["ok"], &object["command"]), (&false.into(), &line[0].into()));
            } else {
                assert!(words(&left.stderr).contains("interrupted"), "{line:?}: {}", words(&left.stderr));
            }
        }
    }
    // An empty folder may remain.
    let _ = std::fs::remove_dir(desk.path("results"));
    assert_eq!(desk.names("."), before);
}

#[test]
fn every_long_command_ends_at_the_first_signal_and_leaves_nothing_half_done() {
    let huge = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 50_000_000_000 }");
    let desk = Desk::new(&format!("{huge}[output]\ntuples = false\n"));
    desk.write("one.toml", "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n[tap]\na = { from = 10, to = 49, steps = 4_000_000 }\n");
    let taps = "theta = { from = 0.5, to = 9, steps = 1_000 }\n[model]\nmaterial = { neo-hookean = 3.2 }\n";
    desk.write("many.toml", desk.read("one.toml").replace("4_000_000", "1_000") + taps);
    let soft =
        format!("[tap]\na = {{ from = 25, to = 70, steps = 40 }}\n{REAL}[estimate]\ntheory = \"exact\"\n");
    let gauge = "[gauge]\nx_ss = 24\nl = 2\nnoise_strain = 15e-6\n";
    desk.write("soft.toml", format!("[whisker]\nD = 10\nd = 4\nL_a = 80\n{gauge}{soft}"));
    let before = desk.names(".");
    let lines: [&[&str]; 5] = [
        &["sweep", "spec.toml", "--backend", "cpu", "--keep-every", "3600"],
        &["sweep", "spec.toml", "--backend", "reference", "--keep-every", "3600"],
        &["tap", "one.toml"],
        &["tap", "soft.toml", "--backend", "reference"],
        &["simulate", "many.toml", "--repeats", "4000"],
    ];
    for line in lines {
        let child = start(program(&desk, line));
        until(|| begun(&desk), "the run has not begun");
        until_it_works(&child);
        send(&child, SIGINT);
        let left = ends(child);
        let said = words(&left.stderr);
        assert_eq!(left.status.code(), Some(1), "{line:?}: {said}");
        assert!(said.contains("nothing was written") || said.contains("interrupted"), "{line:?}: {said}");
        let _ = std::fs::remove_dir(desk.path("results"));
        assert_eq!(desk.names("."), before, "{line:?}");
    }
}

/// Waits until `child` says `what`.
fn until_it_says(child: &mut Running, what: &str) {
    let mut said = String::new();
    // The pipe stays open for later output.
    let mut stderr = BufReader::with_capacity(1, child.stderr.as_mut().unwrap());
    while !said.contains(what) {
        assert!(stderr.read_line(&mut said).unwrap() > 0, "{said}");
    }
}

/// A search with quick candidates; one with slow candidates, whose sensitivities take minutes, stopped soon and later.
#[test]
fn a_stopped_search_says_what_it_kept_and_fails() {
    let search = |rest: &str| {
        format!(
            "[whisker]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\n{rest}\n\
             [optimise]\nobjective = \"distance\"\nbudget = {{ evaluations = 100000000 }}\nvariables = {{ D = [8, 12], d = [2, 10], theta = [0.5, 10] }}\n"
        )
    };
    let quick = search("") + "robust = { D = 0.05, samples = 4096, calibrated = \"nominal\" }\n";
    let slow =
        search(&format!("{REAL}[estimate]\ntheory = \"exact\"\n")) + "robust = { D = 0.05, samples = 64 }\n";
    for (text, pause) in [(&quick, 0), (&slow, 300), (&slow, 4000)] {
        let desk = Desk::new(text);
        let mut child = start(program(&desk, &["optimise", "spec.toml", "--backend", "cpu", "--json"]));
        until_it_says(&mut child, " evaluations");
        std::thread::sleep(Duration::from_millis(pause));
        send(&child, SIGINT);
        // A debug build takes a while to write.
        let left = if pause == 0 { child.wait_with_output().unwrap() } else { ends(child) };
        let object: Value = serde_json::from_slice(&left.stdout).unwrap();
        assert_eq!((left.status.code(), &object["ok"]), (Some(1), &false.into()), "{object}");
        assert!(object["error"]["message"].as_str().is_some_and(|m| m.contains("best so far")), "{object}");
        assert!(desk.names("results/spec-optimise").contains(&"best.toml".to_owned()));
    }
}

fn stopped_bench(desk: &Desk, more: &[&str]) -> std::process::Output {
    let line = [&["bench", "--quick", "--backend", "cpu", "--out", "out"], more].concat();
    let mut child = start(program(desk, &line));
    until_it_says(&mut child, "[  4 of");
    send(&child, SIGINT);
    let left = ends(child);
    assert_eq!(left.status.code(), Some(1), "{}", words(&left.stderr));
    left
}

#[test]
fn a_stopped_benchmark_keeps_what_it_measured() {
    let desk = Desk::new(SPEC);
    let left = stopped_bench(&desk, &[]);
    assert!(words(&left.stderr).contains("is kept in out"), "{}", words(&left.stderr));
    let run = desk.whole("out");
    let (steps, of) = (run["stopped"]["steps"].as_u64().unwrap(), run["stopped"]["of"].as_u64().unwrap());
    assert!((3..of).contains(&steps), "{steps} of {of}");
    assert!(desk.read("out/work_precision.csv").lines().count() > 3);
    assert!(desk.names(".").iter().all(|name| !name.starts_with('.')));

    // A partial result may replace a partial one; to replace a whole one it needs --force.
    assert!(words(&stopped_bench(&desk, &[]).stderr).contains("is kept in out"));
    let mut run = desk.whole("out");
    run["stopped"] = Value::Null;
    desk.write("out/run.json", run.to_string());
    let left = stopped_bench(&desk, &[]);
    assert!(words(&left.stderr).contains("holds a whole result"), "{}", words(&left.stderr));
    assert_eq!(desk.read("out/run.json"), run.to_string());
    let left = stopped_bench(&desk, &["--force"]);
    assert!(words(&left.stderr).contains("is kept in out"), "{}", words(&left.stderr));
    assert!(desk.whole("out")["stopped"].is_object());
}

#[test]
fn a_stopped_census_keeps_its_lines_but_does_not_replace_a_whole_one() {
    let neo = format!("{SPEC}[model]\nmaterial = {{ neo-hookean = 3.2 }}\nsurface = true\n");
    let desk = Desk::new(&neo.replace("d = [4, 7]", "d = { from = 4, to = 7, steps = 100_000 }"));
    let stopped = |wait: u64| {
        let line = ["verify", "spec.toml", "--samples", "1000000", "--backend", "cpu", "--out", "out"];
        let child = start(program(&desk, &line));
        std::thread::sleep(Duration::from_secs(wait));
        send(&child, SIGTERM);
        let left = ends(child);
        assert_eq!(left.status.code(), Some(1), "{}", words(&left.stderr));
        words(&left.stderr)
    };
    let kept = [1, 3, 9, 27, 81, 243].into_iter().any(|wait| {
        let said = stopped(wait);
        let kept = said.contains("is kept in out");
        assert!(kept || said.contains("nothing was written"), "{said}");
        kept
    });
    assert!(kept, "no part was done in 243 s");
    let run = desk.whole("out");
    let (taps, of) = (run["stopped"]["taps"].as_u64().unwrap(), run["stopped"]["of"].as_u64().unwrap());
    assert!(taps > 0 && taps < of, "{taps} of {of}");
    assert_eq!(desk.read("out/verify.csv").lines().count(), 3);
    assert_eq!(run["census"][0]["taps"], taps);

    let few = ["verify", "spec.toml", "--samples", "5", "--backend", "cpu", "--out", "out"];
    desk.run(&few).exits(0);
    let whole = desk.read("out/run.json");
    let said = stopped(3);
    assert!(said.contains("holds a whole result") || said.contains("before the first result"), "{said}");
    assert_eq!(desk.read("out/run.json"), whole);
    desk.whole("out");
}

/// A stream whose answers are not read: after `pause` ms the pipe should be full and block it.
fn flooded(desk: &Desk, pause: u64) -> (Running, std::thread::JoinHandle<()>) {
    let mut child = start(program(desk, &["locate", "cal/calibration.toml"]));
    answer(&mut child, "");
    let mut stdin = child.stdin.take().unwrap();
    let feed = std::thread::spawn(move || while stdin.write_all(b"4,0.02\n").is_ok() {});
    std::thread::sleep(Duration::from_millis(pause));
    (child, feed)
}

#[test]
fn the_second_signal_ends_it_at_once() {
    let desk = calibrated();
    for signal in [SIGINT, SIGTERM] {
        // Exit status after repeated signals, `pause` ms after the first reading.
        let ended = |pause: u64| {
            let (mut child, feed) = flooded(&desk, pause);
            // Signals close together merge: send until the second is handled.
            let status = loop {
                send(&child, signal);
                std::thread::sleep(Duration::from_millis(150));
                if let Some(status) = child.try_wait().unwrap() {
                    break status;
                }
            };
            feed.join().unwrap();
            status
        };
        // If the pipe was not yet full, the first signal ended it: try again with a longer pause.
        let full = [300, 3_000, 30_000].into_iter().map(ended).find(|status| status.code() != Some(1));
        assert_eq!(full.expect("the pipe is full in 30 s").signal(), Some(signal));
    }
}

#[test]
fn one_signal_ends_a_stream_whose_answers_nobody_takes() {
    let desk = calibrated();
    let (child, feed) = flooded(&desk, 300);
    send(&child, SIGTERM);
    assert_eq!(ends(child).status.code(), Some(1));
    feed.join().unwrap();
}

#[test]
fn a_stream_that_is_stopped_keeps_its_answers() {
    let desk = calibrated();
    pipe(&desk, "pipe");
    for (signal, from) in [(SIGTERM, "-"), (SIGINT, "pipe")] {
        let arguments = ["locate", "cal/calibration.toml", from, "--out", "loc", "--force"];
        let mut child = Running::new(&mut program(&desk, &arguments));
        let mut feed = std::fs::File::from(match from {
            "-" => OwnedFd::from(child.stdin.take().unwrap()),
            name => std::fs::File::options().write(true).open(desk.path(name)).unwrap().into(),
        });
        until(|| begun(&desk), "the stream has not begun");
        feed.write_all(b"4,0.02\n4,0.021\nnonsense\n4,0.0").unwrap();
        // Complete lines that were read are answered first.
        until(|| unread(&feed) == 0, "the readings are not read");
        send(&child, signal);
        let left = ends(child);
        assert_eq!(left.status.code(), Some(1));
        assert!(words(&left.stderr).contains("3 readings are kept in loc"), "{}", words(&left.stderr));
        assert_eq!(desk.read("loc/located.csv").lines().count(), 4);
        let run: Value = serde_json::from_str(&desk.read("loc/run.json")).unwrap();
        assert_eq!((&run["interrupted"], &run["counts"]["readings"]), (&true.into(), &3.into()));
    }
}

#[test]
fn a_stream_answers_whole_lines_at_once_and_says_how_far_it_came() {
    let desk = calibrated();
    for stopped in [true, false] {
        let mut child = start(program(&desk, &["locate", "cal/calibration.toml"]));
        answer(&mut child, "4,0.02\n4,0.021\n4,0.0");
        assert!((0..2).all(|_| answer(&mut child, "").contains("ok")));
        if stopped {
            send(&child, SIGINT);
        } else {
            drop(child.stdin.take());
        }
        let left = ends(child);
        assert_eq!(left.status.code(), Some(i32::from(stopped)));
        let said = words(&left.stderr);
        assert_eq!(said.contains("2 readings were answered"), stopped, "{said}");
    }
}
