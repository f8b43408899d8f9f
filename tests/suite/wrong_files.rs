//! Files of another kind than expected: pipes, links, names elsewhere, damaged tables; and a disk where files cannot grow.
#![cfg(target_os = "linux")]

use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use libc::SIGTERM;
use serde_json::{Value, json};
use vibrissa::sink::parquet::Reader;

use crate::common::program::{Desk, SPEC, names};
use crate::common::world::{Running, calibrated, ends, program, send, shell, until_it_hears, words};

fn swept(more: &str) -> Desk {
    let desk = Desk::new(&format!("{SPEC}{more}"));
    desk.sweep(&["--out", "out"]).exits(0);
    desk
}

fn in_time(desk: &Desk, line: &str) -> (Option<i32>, String) {
    let ran = shell(desk, &format!("PATH=$PATH; exec timeout 20 \"$PROGRAM\" {line}"));
    (ran.status.code(), words(&ran.stderr))
}

#[track_caller]
fn refused_in_time(desk: &Desk, what: &str, lines: &[&str], said: &str) {
    for line in lines {
        let (code, told) = in_time(desk, line);
        assert!(code == Some(2) && told.contains(said), "{what}: {line}: {code:?} {told}");
    }
}

/// Moves the file at `path` to `elsewhere` and puts `what` in its place.
fn replaced(desk: &Desk, path: &Path, what: &str) {
    std::fs::rename(path, desk.path("elsewhere")).unwrap();
    match what {
        "pipe" => assert!(Command::new("mkfifo").arg(path).status().unwrap().success()),
        "folder" => std::fs::create_dir(path).unwrap(),
        "device" => symlink("/dev/zero", path).unwrap(),
        "link" => symlink("../elsewhere", path).unwrap(),
        // A sparse file: nothing is on the disk.
        _ => std::fs::File::create(path).unwrap().set_len(5 << 30).unwrap(),
    }
}

#[test]
fn what_is_no_file_of_a_result_hangs_nothing() {
    for what in ["pipe", "folder", "device", "link", "long"] {
        let desk = swept("");
        replaced(&desk, &desk.path("out/run.json"), what);
        let lines = ["report out", "report out --force", "cite out --force", "report out --plan"];
        refused_in_time(&desk, what, &lines, "run.json");
        if what == "long" {
            refused_in_time(&desk, what, &["sweep spec.toml --out out", "merge out"], "");
        }
    }
    for (what, listed) in [("pipe", true), ("link", true), ("pipe", false), ("link", false), ("long", true)] {
        let desk = swept("");
        if !listed {
            let mut run = desk.whole("out");
            run.as_object_mut().unwrap().remove("files");
            desk.write("out/run.json", run.to_string());
        }
        replaced(&desk, &desk.path("out/designs.csv"), what);
        refused_in_time(&desk, what, &["report out", "report out --force"], "designs.csv");
    }
    let desk = swept("");
    let run = desk.whole("out");
    let there = desk.path("there.csv").display().to_string();
    assert!(Command::new("mkfifo").arg(desk.path("fifo")).status().unwrap().success());
    desk.write("there.csv", "mine");
    for name in ["../there.csv", &there, "../fifo", "sub/../designs.csv", ".", "", "/dev/zero"] {
        let mut run = run.clone();
        run["files"][0]["name"] = json!(name);
        desk.write("out/run.json", run.to_string());
        let lines = ["report out --force", "cite out --force"];
        refused_in_time(&desk, name, &lines, "run.json");
    }
}

fn listed_again(desk: &Desk, folder: &str) {
    let name = format!("{folder}/run.json");
    let mut run: Value = serde_json::from_str(&desk.read(&name)).unwrap();
    for file in run["files"].as_array_mut().unwrap() {
        let bytes = std::fs::read(desk.path(folder).join(file["name"].as_str().unwrap())).unwrap();
        file["bytes"] = bytes.len().into();
        file["blake3"] = vibrissa::sink::folder::hash_file(bytes.as_slice()).unwrap().into();
    }
    desk.write(&name, vibrissa::sink::folder::sealed(run));
}

fn damaged(whole: &[u8]) -> Vec<(String, Vec<u8>)> {
    let n = whole.len();
    let mut all: Vec<(String, Vec<u8>)> = [0, 3, 4, 11, n / 2, n - 9, n - 8, n - 4, n - 1]
        .map(|k| (format!("first {k}"), whole[..k].to_vec()))
        .into();
    all.push(("other magic".to_owned(), [b"RAP1", &whole[4..n - 4], b"RAP1"].concat()));
    all.push(("zeros".to_owned(), vec![0; n]));
    all.push(("a table as CSV".to_owned(), b"D_mm,status\n10,ok\n".to_vec()));
    // The footer, its length, and places in the pages.
    for at in (0..n).step_by(1 + n / 24).chain(n - 12..n) {
        for mask in [0xff, 0x01] {
            let mut bytes = whole.to_vec();
            bytes[at] ^= mask;
            all.push((format!("byte {at} ^ {mask}"), bytes));
        }
    }
    all
}

#[test]
fn damaged_parquet_is_refused_in_words() {
    let desk = swept("[output]\nformat = \"parquet\"\n");
    for part in ["1/2", "2/2"] {
        desk.sweep(&["--shard", part, "--out", "parts"]).exits(0);
    }
    let part = names(&desk.path("parts")).into_iter().find(|n| n.starts_with("shard-1")).unwrap();
    let part = format!("parts/{part}");
    for (folder, line) in [("out", "report out --force --plan"), (&part, "merge parts --out whole --force")] {
        let path = desk.path(folder).join("designs.parquet");
        let whole = std::fs::read(&path).unwrap();
        let run = desk.read(&format!("{folder}/run.json"));
        let mut refused = 0;
        for (k, (what, bytes)) in damaged(&whole).into_iter().enumerate() {
            std::fs::write(&path, bytes).unwrap();
            let read = || -> Result<(), String> {
                let file = std::fs::File::open(&path).unwrap();
                let mut reader = Reader::new(&path, file).map_err(|e| e.to_string())?;
                while reader.next_group().map_err(|e| e.to_string())?.is_some() {}
                Ok(())
            };
            let read = read();
            assert!(read.is_err() || what.starts_with("byte"), "{what}: {line}");
            refused += usize::from(read.is_err());
            if what.starts_with("byte") && k % 16 > 0 {
                continue;
            }
            // `merge` checks hashes first: update them.
            listed_again(&desk, folder);
            let ran = desk.line(line);
            assert!(
                ran.code == 2 || ran.code == 0 && read.is_ok(),
                "{what}: {line}: {} {}",
                ran.code,
                ran.stderr
            );
            assert!(!ran.stderr.contains("panicked"), "{what}: {line}: {}", ran.stderr);
            assert!(ran.code == 0 || ran.stderr.contains("designs"), "{what}: {line}: {}", ran.stderr);
        }
        std::fs::write(&path, whole).unwrap();
        desk.write(&format!("{folder}/run.json"), run);
        desk.ok(line);
        assert!(refused > 20, "{refused}");
    }
}

/// The words of this file would take many times its size in memory.
#[test]
fn a_long_table_is_no_spec_and_no_calibration() {
    let desk = Desk::new(SPEC);
    desk.write("rig.csv", "# rig 3\na_mm,theta_deg,strain\n".to_owned() + &"25,4,0.0123\n".repeat(1 << 20));
    for line in ["sweep rig.csv", "optimise rig.csv", "locate rig.csv rig.csv"] {
        let (code, told) = in_time(&desk, line);
        assert!(code == Some(2) && told.contains("rig.csv:2") && told.contains("TOML"), "{line}: {told}");
    }
}

#[test]
fn words_of_a_file_move_no_cursor() {
    let desk = calibrated();
    let head = "\u{1b}[31mX\u{7}";
    desk.write(
        "rig.csv",
        format!("a_mm,theta_deg,strain,{head}\n25,4,0.016,1\n30,4,0.014,1\n35,4,0.0125,1\n"),
    );
    desk.write("bad.csv", format!("a_mm,theta_deg,strain\n25,{head},0.016\n"));
    for line in ["calibrate rig.csv", "calibrate bad.csv", "sweep bad.csv", &format!("report '{head}'")] {
        let (_, told) = in_time(&desk, line);
        let harmful = |c: char| c.is_control() && c != '\n';
        assert!(told.contains("[31mX") && !told.contains(harmful), "{line}: {told:?}");
    }
}

#[test]
fn a_line_of_readings_without_an_end_is_refused() {
    let desk = calibrated();
    let long = "7".repeat(2 << 20);
    let text = format!("theta_deg,strain\n4,0.02\n{long}\n4,0.02\n");
    desk.write("readings.csv", &text);
    let filed = desk.line("locate cal/calibration.toml readings.csv --out loc").exits(2);
    assert!(filed.stderr.contains("readings.csv:3") && !desk.path("loc").exists(), "{}", filed.stderr);
    let streamed = desk.pipe(&["locate", "cal/calibration.toml"], &text).exits(2);
    assert!(streamed.stderr.contains("stdin:3") && streamed.stdout.contains("ok"), "{}", streamed.stderr);
}

#[test]
fn a_signal_is_heard_while_data_are_read() {
    let desk = calibrated();
    for line in [
        &["calibrate", "/dev/stdin", "--whisker", "spec.toml", "--out", "new"][..],
        &["taps", "/dev/stdin", "--out", "new"],
        &["sweep", "listed.toml", "--out", "new"],
    ] {
        desk.write("listed.toml", "[tuples]\nfile = \"/dev/stdin\"\n");
        let mut command = program(&desk, line);
        command.stdin(Stdio::piped());
        let mut child = Running::new(&mut command);
        until_it_hears(&child, SIGTERM);
        let mut stdin = child.stdin.take().unwrap();
        let feed = std::thread::spawn(move || {
            let head = b"D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,strain,t_s\n";
            let mut ok = stdin.write_all(head).is_ok();
            while ok {
                std::thread::sleep(std::time::Duration::from_millis(5));
                ok = stdin.write_all(b"10,4,50,5,2,33,1,0.01,1\n").is_ok();
            }
        });
        std::thread::sleep(std::time::Duration::from_millis(400));
        send(&child, SIGTERM);
        let left = ends(child);
        assert_eq!(left.status.code(), Some(1), "{line:?}: {}", words(&left.stderr));
        feed.join().unwrap();
        assert!(!desk.path("new").exists());
    }
}

#[test]
fn a_file_that_may_not_grow_is_an_error_of_writing() {
    let desk = calibrated();
    desk.write("swept.toml", SPEC);
    let before = names(&desk.path("."));
    for line in [
        "sweep swept.toml --backend cpu --out new",
        "simulate spec.toml --out new",
        "calibrate sim/measurements.csv --whisker spec.toml --out new",
        "locate cal/calibration.toml sim/measurements.csv --out new > told",
        "help columns > told",
    ] {
        for blocks in [0, 1] {
            let ran = shell(&desk, &format!("ulimit -f {blocks}; exec \"$PROGRAM\" {line}"));
            let told = words(&ran.stderr);
            assert_eq!(ran.status.code(), Some(1), "{line}, {blocks} blocks: {:?} {told}", ran.status);
            assert!(told.contains("File too large") || told.contains("file size"), "{line}: {told}");
            let _ = std::fs::remove_file(desk.path("told"));
            assert_eq!(names(&desk.path(".")), before, "{line}");
        }
    }
}
