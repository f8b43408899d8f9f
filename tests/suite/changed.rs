//! What is changed or taken away under a run: inputs while they are read, and the run's own folders. No result is placed that is of two files.
#![cfg(unix)]

use std::fs::{self, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::Output;

use libc::SIGCONT;
use serde_json::json;
use vibrissa::sink::folder::{Folder, Question};

use crate::common::program::{Desk, SPEC, names};
use crate::common::world::{Running, calibrated, held, program, send, shell, words};

/// Whether a run for `out` has begun to write `table`.
fn begun(desk: &Desk, table: &str) -> bool {
    let hidden = names(&desk.path(".")).into_iter().filter(|n| n.starts_with(".vibrissa-"));
    hidden.into_iter().any(|name| desk.path(&name).join(table).metadata().is_ok_and(|m| m.len() > 0))
}

/// Runs `line`, which writes `table` for `out`, and makes `change` in the middle.
fn changed(desk: &Desk, line: &[&str], table: &str, change: impl Fn()) -> Output {
    let begin = || {
        let _ = fs::remove_dir_all(desk.path("out"));
        Running::new(&mut program(desk, line))
    };
    let child = held(begin, || begun(desk, table) && !desk.path("out").exists());
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
fn a_tuple_file_that_changes_while_it_is_swept_gives_no_result() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n[model]\ngeometry = \"linear\"\n");
    let row =
        |i: usize| format!("10,{}.125,50.000,5.000,2.000,{}.1250,1.0000001\n", 3 + i % 5, 21 + i / 5 % 27);
    let rows: String = (0..240_000).map(row).collect();
    desk.write("list.csv", format!("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n{rows}"));
    let line = ["sweep", "spec.toml", "--backend", "cpu", "--out", "out", "--keep-every", "3600"];
    let left = changed(&desk, &line, "tuples.csv", || edit(&desk.path("list.csv"), "2"));
    let said = words(&left.stderr);
    assert_eq!(left.status.code(), Some(1), "{said}");
    assert!(said.contains("list.csv: this tuple file was changed while the run read it"), "{said}");
    assert!(!desk.path("out").exists());
    desk.run(&line).exits(0);
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

/// A folder into which a result of one table was written, up to its end.
fn written(out: &Path) -> Folder {
    let mut folder =
        Folder::open(out, Question::new("sweep", "spec", json!({})), &["tuples.csv"], false).unwrap();
    let mut file = folder.file("tuples.csv").unwrap();
    file.write(b"a,b\n1,2\n").unwrap();
    file.close().unwrap();
    folder.run_json(&json!({ "format": 1, "command": "sweep", "seconds": { "total": 0.0 } })).unwrap();
    folder
}

fn hidden(at: &Path) -> std::path::PathBuf {
    let found = |n: &String| n.starts_with(".vibrissa-") && !n.ends_with(".lock");
    at.join(names(at).into_iter().find(found).expect("a hidden folder"))
}

#[test]
fn what_a_first_run_could_not_place_does_not_hold_up_the_same_command() {
    let desk = Desk::new(SPEC);
    fs::create_dir(desk.path("out")).unwrap();
    let folder = written(&desk.path("out"));
    fs::write(hidden(&desk.path("out")).join("tuples.csv"), "mine").unwrap();
    let error = folder.finish().unwrap_err().to_string();
    assert!(error.contains("out/result-unplaced-"), "{error}");
    desk.sweep(&["--out", "out"]).exits(0);
    assert!(desk.names("out").iter().any(|name| name.starts_with("result-unplaced-")));
    // A folder of another name is somebody else's.
    fs::create_dir_all(desk.path("other/unplaced-results")).unwrap();
    desk.sweep(&["--out", "other"]).exits(2);
}

#[test]
fn a_hidden_folder_that_is_taken_away_is_told_in_words() {
    let desk = Desk::new(SPEC);
    let mut folder = written(&desk.path("out"));
    fs::remove_dir_all(hidden(&desk.path("."))).unwrap();
    let error = folder.file("designs.csv").unwrap_err().to_string();
    assert!(error.contains("the hidden folder of this run is gone"), "{error}");
}

/// No file may grow, as on a full disk.
#[test]
fn a_full_disk_leaves_no_lock() {
    let desk = Desk::new(SPEC);
    let program = assert_cmd::cargo::cargo_bin("vibrissa");
    let line =
        format!("trap '' XFSZ; ulimit -f 0; {} sweep spec.toml --backend cpu --out out", program.display());
    let ran = shell(&desk, &line);
    assert_eq!(ran.status.code(), Some(1), "{}", words(&ran.stderr));
    assert_eq!(names(&desk.path(".")), ["spec.toml"]);
}
