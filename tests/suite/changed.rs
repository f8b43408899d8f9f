//! What is changed or taken away under a run: inputs while they are read, and the run's own folders. No result is placed that is of two files.
#![cfg(unix)]

use std::fs::{self, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::Output;

use vibrissa::sink::folder::WORK;

use crate::common::program::Desk;
use crate::common::world::{Running, calibrated, held, program, send, words};
use libc::SIGCONT;

/// Whether a run for `out` has begun to write `table`.
fn begun(desk: &Desk, table: &str) -> bool {
    desk.path("out").join(WORK).join(table).metadata().is_ok_and(|m| m.len() > 0)
}

/// Runs `line`, which writes `table` for `out`, and makes `change` in the middle.
fn changed(desk: &Desk, line: &[&str], table: &str, change: impl Fn()) -> Output {
    let begin = || {
        let _ = fs::remove_dir_all(desk.path("out"));
        Running::new(&mut program(desk, line))
    };
    let child = held(begin, || begun(desk, table));
    change();
    send(&child, SIGCONT);
    child.wait_with_output().unwrap()
}

/// Writes `digit` over the last digit of the file at `path`.
fn edit(path: &Path, digit: &str) {
    let file = OpenOptions::new().write(true).open(path).unwrap();
    let end = file.metadata().unwrap().len() - 2;
    file.write_all_at(digit.as_bytes(), end).unwrap();
}

#[test]
fn readings_that_change_while_they_are_located_give_no_result() {
    let desk = calibrated();
    let rows: String = (0..400_000).map(|i| format!("4,{}e-7\n", 3000 + i % 900)).collect();
    desk.write("many.csv", format!("theta_deg,strain\n{rows}4,0.0003\n"));
    let line = ["locate", "cal/calibration.toml", "many.csv", "--out", "out"];
    let left = changed(&desk, &line, "located.csv", || edit(&desk.path("many.csv"), "4"));
    let said = words(&left.stderr);
    assert_eq!(left.status.code(), Some(1), "{said}");
    assert!(said.contains("many.csv: these readings were changed while they were read"), "{said}");
    assert!(!desk.path("out").exists());
}
