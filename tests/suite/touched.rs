//! Files of a result that somebody removes, cuts or replaces while a run writes them: the run fails in words, and nothing gets a final name.
#![cfg(unix)]

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use libc::SIGCONT;
use serde_json::json;
use vibrissa::sink::folder::{Folder, Question};

use crate::common::program::{Desk, SPEC, names};
use crate::common::world::{Running, held, program, send, words};

/// What is done to a file that is being written, and what the run says of it.
const ALL: [(&str, &str); 7] = [
    ("removed", "tuples.csv: this file is gone"),
    ("moved", "tuples.csv: this file is gone"),
    ("folder moved", "tuples.csv: this file is gone"),
    ("replaced", "tuples.csv: this file was replaced by another one"),
    ("linked", "tuples.csv: this was replaced while the run wrote it, by what is no regular file"),
    ("cut", "tuples.csv: this file was changed by something else"),
    ("overwritten", "tuples.csv: this file was changed by something else"),
];

fn touch(file: &Path, what: &str) {
    let (folder, aside) = (file.parent().unwrap(), file.with_extension("aside"));
    match what {
        "removed" => fs::remove_file(file).unwrap(),
        "moved" => fs::rename(file, aside).unwrap(),
        "folder moved" => fs::rename(folder, folder.with_file_name("moved")).unwrap(),
        "replaced" => {
            // The same bytes in another file: what the run still writes would not be in it.
            fs::copy(file, &aside).unwrap();
            fs::rename(aside, file).unwrap();
        }
        "linked" => {
            fs::rename(file, &aside).unwrap();
            std::os::unix::fs::symlink(aside, file).unwrap();
        }
        "cut" => OpenOptions::new().write(true).open(file).unwrap().set_len(0).unwrap(),
        _ => OpenOptions::new().write(true).open(file).unwrap().write_all(b"?").unwrap(),
    }
}

/// The hidden folder in which a result for `out` is written.
fn hidden(desk: &Desk, out: &str) -> PathBuf {
    let folders = [desk.path(out), desk.path(".")];
    let all = folders.iter().flat_map(|at| names(at).into_iter().map(move |name| at.join(name)));
    let found = |path: &PathBuf| {
        path.is_dir() && path.file_name().unwrap().to_string_lossy().starts_with(".vibrissa-")
    };
    all.into_iter().find(found).unwrap_or_default()
}

/// A result of two tables for `out`, written up to its end.
fn written(out: &Path, forced: bool) -> Folder {
    let question = Question::new("sweep", "spec", json!({}));
    let mut folder = Folder::open(out, question, &["tuples.csv", "designs.csv"], forced).unwrap();
    for name in ["tuples.csv", "designs.csv"] {
        let mut file = folder.file(name).unwrap();
        file.write(b"a,b\n1,2\n").unwrap();
        file.close().unwrap();
    }
    folder.run_json(&json!({ "format": 1, "command": "sweep", "seconds": { "total": 0.0 } })).unwrap();
    folder
}

#[test]
fn what_a_first_run_could_not_place_does_not_hold_up_the_same_command() {
    let desk = Desk::new(SPEC);
    fs::create_dir(desk.path("out")).unwrap();
    let folder = written(&desk.path("out"), false);
    fs::write(hidden(&desk, "out").join("tuples.csv"), "mine").unwrap();
    let error = folder.finish().unwrap_err().to_string();
    assert!(error.contains("out/result-unplaced-"), "{error}");
    desk.sweep(&["--out", "out"]).exits(0);
    assert!(desk.names("out").iter().any(|name| name.starts_with("result-unplaced-")));
    // A folder of another name is somebody else's.
    fs::create_dir_all(desk.path("other/unplaced-results")).unwrap();
    desk.sweep(&["--out", "other"]).exits(2);
    // The hidden folder itself may be taken away.
    let mut folder = written(&desk.path("new"), false);
    fs::remove_dir_all(hidden(&desk, "new")).unwrap();
    let error = folder.file("designs.csv").unwrap_err().to_string();
    assert!(error.contains("the hidden folder of this run is gone"), "{error}");
}

/// Every command writes its result through the same folder.
#[test]
fn a_file_that_is_touched_before_it_has_its_final_name_is_no_result() {
    for ((what, why), old) in ALL.iter().flat_map(|each| [false, true].map(|old| (each, old))) {
        let desk = Desk::new(SPEC);
        if old {
            desk.sweep(&["--out", "out"]).exits(0);
        }
        let before = (desk.names("out"), old.then(|| desk.whole("out")));
        let folder = written(&desk.path("out"), old);
        touch(&hidden(&desk, "out").join("tuples.csv"), what);
        let error = folder.finish().unwrap_err();
        assert!(error.exit_code() == 1 && error.to_string().contains(why), "{what}: {error}");
        // What is left is kept under a name that is no result's.
        let aside = ["out/result-unplaced-", "out-unplaced-"][usize::from(!old)];
        assert!(*what == "folder moved" || error.to_string().contains(aside), "{what}: {error}");
        let there: Vec<String> =
            desk.names("out").into_iter().filter(|n| !n.contains("unplaced") && n != "moved").collect();
        assert_eq!((there, old.then(|| desk.whole("out"))), before, "{what}");
        let is_result = |n: &String| desk.path(n).join("run.json").exists();
        assert!(desk.names(".").iter().all(|n| !is_result(n) || n == "out" || n == "moved"), "{what}");
        // The same command is not held up by it.
        desk.sweep(&["--out", "out", "--force"]).exits(0);
    }
}

#[test]
fn a_sweep_whose_table_is_removed_or_cut_while_it_runs_fails() {
    let large = SPEC.replace("d = [4, 7]", "d = { from = 4, to = 7, steps = 40_000 }");
    for (format, what) in [("csv", "removed"), ("csv", "cut"), ("parquet", "removed"), ("parquet", "cut")] {
        let desk = Desk::new(&format!("{large}[output]\nformat = \"{format}\"\n"));
        let line = "sweep spec.toml --backend cpu --precision f64 --out out --keep-every 3600";
        let line: Vec<&str> = line.split(' ').collect();
        let table = || hidden(&desk, "out").join(format!("tuples.{format}"));
        let begin = || {
            let _ = fs::remove_dir_all(desk.path("out"));
            Running::new(&mut program(&desk, &line))
        };
        let child = held(begin, || table().metadata().is_ok_and(|m| m.len() > 0));
        touch(&table(), what);
        send(&child, SIGCONT);
        let left = child.wait_with_output().unwrap();
        let said = words(&left.stderr);
        assert_eq!(left.status.code(), Some(1), "{format} {what}: {said}");
        let why = if what == "cut" { "was changed by something else" } else { "this file is gone" };
        assert!(said.contains(&format!("tuples.{format}: this file")) && said.contains(why), "{said}");
        assert!(!desk.path("out").exists(), "{format} {what}");
    }
}
