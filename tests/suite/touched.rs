//! Files of a result removed, and inputs changed, during a run: it fails with a message, and no file gets its final name.
#![cfg(unix)]

use std::fs;

use libc::SIGCONT;
use serde_json::json;
use vibrissa::sink::folder::{Folder, Question, WORK};

use crate::common::program::{Desk, SPEC};
use crate::common::world::{Running, held, program, send, words};

/// A result of one table for `out`, complete but not yet finished.
fn written(desk: &Desk, out: &str) -> Folder {
    let question = Question::new("sweep", "spec", json!({}));
    let mut folder = Folder::open(&desk.path(out), question, &["tuples.csv"], false).unwrap();
    let mut file = folder.file("tuples.csv").unwrap();
    file.write(b"a,b\n1,2\n").unwrap();
    file.close().unwrap();
    folder.run_json(&json!({ "format": 1, "command": "sweep", "seconds": { "total": 0.0 } })).unwrap();
    folder
}

#[test]
fn what_comes_in_the_way_of_a_result_is_kept_and_so_is_the_result() {
    let desk = Desk::new(SPEC);
    let folder = written(&desk, "out");
    desk.write("out/tuples.csv", "mine");
    let error = folder.finish().unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("tuples.csv was changed"), "{error}");
    // Any command in the folder finishes the result once the file is moved away.
    assert!(desk.sweep(&["--out", "out"]).exits(2).stderr.contains("tuples.csv"));
    assert_eq!(desk.read("out/tuples.csv"), "mine");
    fs::remove_file(desk.path("out/tuples.csv")).unwrap();
    desk.write("one.toml", SPEC.replace("[4, 7]", "4"));
    let moved = "the result that an earlier run had finished was put in its place, nothing else was changed";
    desk.refuses("tap one.toml --out out", &["another result", moved]);
    assert_eq!(
        (desk.names("out"), desk.read("out/tuples.csv")),
        (vec!["run.json".into(), "tuples.csv".into()], "a,b\n1,2\n".into())
    );
}

#[test]
fn a_hidden_folder_that_is_taken_away_is_told_in_words() {
    let desk = Desk::new(SPEC);
    let mut folder = written(&desk, "new");
    fs::remove_dir_all(desk.path("new").join(WORK)).unwrap();
    let error = folder.file("designs.csv").unwrap_err().to_string();
    assert!(error.contains(".vibrissa-unfinished/designs.csv: No such file"), "{error}");
    let error = folder.finish().unwrap_err().to_string();
    assert!(error.contains("this file was removed or changed"), "{error}");
}

#[test]
fn a_sweep_whose_table_is_removed_while_it_runs_fails() {
    let large = SPEC.replace("d = [4, 7]", "d = { from = 4, to = 7, steps = 40_000 }");
    for format in ["csv", "parquet"] {
        let desk = Desk::new(&format!("{large}[output]\nformat = \"{format}\"\n"));
        let line = "sweep spec.toml --backend cpu --precision f64 --out out --keep-every 3600";
        let line: Vec<&str> = line.split(' ').collect();
        let table = desk.path("out").join(WORK).join(format!("tuples.{format}"));
        let begin = || {
            let _ = fs::remove_dir_all(desk.path("out"));
            Running::new(&mut program(&desk, &line))
        };
        let child = held(begin, || table.metadata().is_ok_and(|m| m.len() > 0));
        fs::remove_file(&table).unwrap();
        send(&child, SIGCONT);
        let left = child.wait_with_output().unwrap();
        let said = words(&left.stderr);
        assert_eq!(left.status.code(), Some(1), "{format}: {said}");
        assert!(said.contains(&format!("tuples.{format}: this file was removed or changed")), "{said}");
        assert!(!desk.path("out").exists(), "{format}");
    }
}
