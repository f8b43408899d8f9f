//! Several runs on one folder, some killed: the old or the new result is whole, and no temporary files remain.
#![cfg(unix)]

use std::os::unix::fs::symlink;
use std::process::Stdio;

use serde_json::json;
use vibrissa::sink::folder::{Folder, Question, WORK, hash_file};

use crate::common::program::{Desk, SPEC};
use crate::common::world::{Running, program, until};

fn endless() -> String {
    let huge = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 50_000_000_000 }");
    format!("{huge}[output]\ntuples = false\n")
}

const NOT_BEGUN: &str = "the run has not begun";

fn start(desk: &Desk, arguments: &[&str]) -> Running {
    let mut command = program(desk, arguments);
    command.args(["--backend", "cpu", "--quiet"]).stdout(Stdio::null()).stderr(Stdio::null());
    Running::new(&mut command)
}

fn hidden(desk: &Desk, folder: &str) -> Vec<String> {
    desk.names(folder).into_iter().filter(|name| name.starts_with(".vibrissa-")).collect()
}

fn begun(desk: &Desk, folder: &str) -> bool {
    std::fs::read_dir(desk.path(folder).join(WORK)).is_ok_and(|names| names.count() > 1)
}

#[test]
fn the_second_run_on_a_folder_is_refused() {
    let desk = Desk::new(&endless());
    let small = SPEC.replace("d = [4, 7]", "d = 4").replace("theta = [1, 4]", "");
    desk.write("small.toml", &small);
    desk.write(
        "search.toml",
        small + "[optimise]\nobjective = \"distance\"\nvariables = { theta = [1, 5] }\n",
    );
    std::fs::create_dir(desk.path("there")).unwrap();
    for out in ["new", "there"] {
        let mut child = start(&desk, &["sweep", "spec.toml", "--out", out]);
        until(|| begun(&desk, out), NOT_BEGUN);
        for (command, spec) in [
            ("sweep", "spec.toml"),
            ("tap", "small.toml"),
            ("optimise", "search.toml"),
            ("verify", "spec.toml"),
        ] {
            let ran = desk.run(&[command, spec, "--backend", "cpu", "--out", out]).exits(2);
            let process = format!("process {}", child.id());
            assert!(ran.stderr.contains(&process) && ran.stderr.contains(out), "{}", ran.stderr);
        }
        desk.write("quick.toml", SPEC);
        desk.ok("sweep quick.toml --backend cpu --out beside");
        assert!(child.try_wait().unwrap().is_none() && begun(&desk, out), "the first goes on");
        child.kill().unwrap();
        child.wait().unwrap();
        desk.ok(format!("sweep quick.toml --backend cpu --out {out}"));
        assert_eq!(desk.names(out), ["designs.csv", "distances.csv", "run.json", "tuples.csv"]);
        assert_eq!(hidden(&desk, "."), [""; 0]);
    }
}

#[test]
fn what_killed_runs_left_is_removed() {
    let desk = Desk::new(&endless());
    desk.write("small.toml", SPEC);
    std::fs::create_dir(desk.path("there")).unwrap();
    for out in ["a", "there"] {
        let mut child = start(&desk, &["sweep", "spec.toml", "--out", out]);
        until(|| begun(&desk, out), NOT_BEGUN);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(begun(&desk, out));
    }
    desk.write("mine/notes.txt", "mine");
    symlink("../mine", desk.path("there/.vibrissa-a1B2c3")).unwrap();
    desk.write("there/.vibrissa-else", "of something else");
    desk.write(".vibrissa-backup/notes", "mine");
    for out in ["a", "there"] {
        desk.ok(format!("sweep small.toml --backend cpu --out {out}"));
        desk.whole(out);
    }
    assert_eq!(
        (hidden(&desk, "a"), hidden(&desk, "there")),
        (vec![], vec![".vibrissa-a1B2c3".into(), ".vibrissa-else".into()])
    );
    symlink("../mine", desk.path("a").join(WORK)).unwrap();
    desk.refuses("sweep small.toml --backend cpu --out a", &[WORK]);
    assert_eq!(
        (desk.names("mine"), desk.names(".vibrissa-backup")),
        (vec!["notes.txt".into()], vec!["notes".into()])
    );
}

#[test]
fn what_a_killed_benchmark_left_is_removed() {
    let desk = Desk::new(SPEC);
    for kept in ["out", "tmp"] {
        std::fs::create_dir(desk.path(kept)).unwrap();
    }
    let mut command = program(&desk, &["bench", "--backend", "cpu", "--quiet", "--out", "out"]);
    command.env("TMPDIR", desk.path("tmp")).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = Running::new(&mut command);
    until(|| desk.path("out").join(WORK).exists(), NOT_BEGUN);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(desk.names("tmp"), [""; 0]);
    desk.ok("sweep spec.toml --backend cpu --out out");
    assert_eq!(hidden(&desk, "out"), [""; 0]);
}

/// The steps by which a new result takes the place of an old one: a table that the new one lacks goes, the files are moved, the state goes.
const STEPS: [(&str, Option<&str>); 5] = [
    ("a.csv", None),
    (".vibrissa-unfinished/b.csv", Some("b.csv")),
    (".vibrissa-unfinished/c.csv", Some("c.csv")),
    (".vibrissa-unfinished/run.json", Some("run.json")),
    (".vibrissa-unfinished/.state", None),
];

/// A folder with an old and a finished new result, killed after `steps` steps.
fn killed_after(steps: usize) -> Desk {
    let (desk, hidden) = (Desk::new(SPEC), |name: &str| format!("out/{WORK}/{name}"));
    for name in ["a.csv", "b.csv", "notes.txt", "run.json"] {
        desk.write(&format!("out/{name}"), "old");
    }
    for name in ["b.csv", "c.csv", "run.json", ".state"] {
        desk.write(&hidden(name), "new");
    }
    let blake3 = hash_file(&b"old"[..]).unwrap();
    let old =
        ["a.csv", "b.csv", "run.json"].map(|name| json!({ "name": name, "blake3": blake3, "bytes": 3 }));
    let marker = json!({ "put": ["b.csv", "c.csv", "run.json"], "old": old });
    desk.write(&hidden(".finished"), marker.to_string());
    let at = |name: &str| desk.path("out").join(name);
    for (from, to) in &STEPS[..steps] {
        match to {
            Some(to) => std::fs::rename(at(from), at(to)).unwrap(),
            None => std::fs::remove_file(at(from)).unwrap(),
        }
    }
    desk
}

/// Opening the folder completes the replacement; the command itself is refused, since this run.json is not its result.
fn next(desk: &Desk) -> String {
    let question = Question::new("tap", "other", json!({}));
    let error = Folder::open(&desk.path("out"), question, &["taps.csv"], false).unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}

#[test]
fn a_replacement_killed_at_any_step_is_carried_through() {
    for steps in 0..=STEPS.len() {
        let desk = killed_after(steps);
        next(&desk);
        assert_eq!(desk.names("out"), ["b.csv", "c.csv", "notes.txt", "run.json"], "after {steps}");
        let texts = ["b.csv", "c.csv", "notes.txt", "run.json"].map(|name| desk.read(&format!("out/{name}")));
        assert_eq!(texts, ["new", "new", "old", "new"], "after {steps}");
    }
    // After the last rename nothing more is removed; a marker does not reach other folders.
    let desk = killed_after(5);
    desk.write("out/a.csv", "mine");
    next(&desk);
    assert_eq!(desk.read("out/a.csv"), "mine");
    let (desk, marker) = (killed_after(0), format!("out/{WORK}/.finished"));
    desk.write("a.csv", "old");
    desk.write(&marker, desk.read(&marker).replace("a.csv", "../a.csv"));
    assert!(next(&desk).contains("does not say what a run was about to put here"));
    assert_eq!(desk.read("a.csv"), "old");
}

#[test]
fn what_changed_since_it_was_found_is_kept() {
    for (name, steps) in [("a.csv", 0), ("b.csv", 1), ("c.csv", 2), ("run.json", 3)] {
        let (desk, name) = (killed_after(steps), format!("out/{name}"));
        desk.write(&name, "mine");
        assert!(next(&desk).contains("was changed while the result was computed"), "{name}");
        assert_eq!(desk.read(&name), "mine");
        std::fs::remove_file(desk.path(&name)).unwrap();
        next(&desk);
        assert_eq!(desk.read("out/run.json"), "new", "{name}");
    }
}
