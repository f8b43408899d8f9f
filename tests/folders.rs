//! The result folder: who may replace what, and that nothing half-written is left.

mod common;

use common::program::{Desk, SPEC};

const FILES: [&str; 4] = ["designs.csv", "distances.csv", "run.json", "tuples.csv"];

#[test]
fn the_same_spec_replaces_its_result() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    let first = desk.read("out/tuples.csv");
    desk.write("out/notes.txt", "mine");
    desk.sweep(&["--out", "out", "--precision", "f64"]).exits(0);
    assert_ne!(desk.read("out/tuples.csv"), first);
    assert_eq!(desk.read("out/notes.txt"), "mine");
    assert_eq!(desk.names("."), ["out", "spec.toml"]);
}

#[test]
fn another_spec_is_refused_unless_forced() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    let first = desk.read("out/run.json");
    desk.write("spec.toml", format!("{SPEC}[output]\ndistances = false\n"));
    let ran = desk.sweep(&["--out", "out"]).exits(2);
    assert!(ran.stderr.contains("--out") && ran.stderr.contains("--force"), "{}", ran.stderr);
    assert_eq!(desk.read("out/run.json"), first);
    desk.sweep(&["--out", "out", "--force"]).exits(0);
    assert_eq!(
        desk.names("out"),
        ["designs.csv", "run.json", "tuples.csv"],
        "no table of the older result is left"
    );
}

#[test]
fn a_foreign_folder_is_refused() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("out")).unwrap();
    desk.write("out/thesis.tex", "three years");
    desk.sweep(&["--out", "out"]).exits(2);
    desk.write("out/run.json", "{ \"spec\": 3 }");
    desk.sweep(&["--out", "out"]).exits(2);
    assert_eq!(desk.names("out"), ["run.json", "thesis.tex"]);
    desk.sweep(&["--out", "spec.toml"]).exits(2);
    assert_eq!(desk.read("spec.toml"), SPEC);
    assert_eq!(desk.names("."), ["out", "spec.toml"]);
}

#[test]
fn empty_and_missing_folders_are_used() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("empty")).unwrap();
    for out in ["empty", "new/and/deep", "./dotted/", "slashed/"] {
        desk.sweep(&["--out", out]).exits(0);
        assert_eq!(desk.names(out), FILES, "{out}");
    }
    assert_eq!(desk.names("."), ["dotted", "empty", "new", "slashed", "spec.toml"]);
    assert_eq!(desk.names("new/and"), ["deep"]);
}

#[cfg(unix)]
#[test]
fn links_are_followed_if_they_lead_somewhere() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("real")).unwrap();
    std::os::unix::fs::symlink("real", desk.path("link")).unwrap();
    std::os::unix::fs::symlink("nowhere", desk.path("broken")).unwrap();
    desk.sweep(&["--out", "link"]).exits(0);
    assert_eq!(desk.names("real"), FILES);
    desk.sweep(&["--out", "broken"]).exits(2);
    assert_eq!(desk.names("."), ["broken", "link", "real", "spec.toml"]);
}

#[test]
fn what_a_killed_run_left_is_no_obstacle() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir_all(desk.path("out/.vibrissa-x1Y2z3")).unwrap();
    desk.sweep(&["--out", "out"]).exits(0);
}

/// SIGTERM, as from a batch system.
#[cfg(target_os = "linux")]
#[test]
fn a_stopped_run_leaves_nothing() {
    use std::process::{Command, Stdio};
    let huge = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 50_000_000 }");
    let desk = Desk::new(&format!("{huge}[output]\ntuples = false\n"));
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("vibrissa"))
        .current_dir(desk.path("."))
        .args(["sweep", "spec.toml", "--backend", "cpu", "--out", "out", "--quiet"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let started = || desk.names(".").iter().any(|name| name.starts_with(".vibrissa-"));
    let until = std::time::Instant::now() + std::time::Duration::from_secs(20);
    while !started() && std::time::Instant::now() < until {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(started(), "the run has not begun");
    let killed = Command::new("sh").args(["-c", &format!("kill -TERM {}", child.id())]).status().unwrap();
    assert!(killed.success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert_eq!(desk.names("."), ["spec.toml"]);
}

#[test]
fn the_current_folder_can_hold_the_result() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("here")).unwrap();
    let ran = assert_cmd::Command::cargo_bin("vibrissa")
        .unwrap()
        .current_dir(desk.path("here"))
        .args(["sweep", "../spec.toml", "--backend", "cpu", "--out", "."])
        .output()
        .unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(desk.names("here"), FILES);
    assert_eq!(desk.names("."), ["here", "spec.toml"]);
}

#[test]
fn an_unusable_place_leaves_nothing() {
    let desk = Desk::new(SPEC);
    desk.write("file", "in the way");
    let ran = desk.sweep(&["--out", "file/out"]);
    assert!(matches!(ran.code, 1 | 2), "{}", ran.stderr);
    assert!(ran.stderr.contains("file"), "{}", ran.stderr);
    assert_eq!(desk.names("."), ["file", "spec.toml"]);
}

#[test]
fn the_spec_may_name_the_folder() {
    let desk = Desk::new(&format!("{SPEC}[run]\nout = \"kept\"\n"));
    desk.sweep(&[]).exits(0);
    desk.sweep(&["--out", "typed"]).exits(0);
    assert_eq!(desk.names("."), ["kept", "spec.toml", "typed"]);
}

#[test]
fn specs_are_named_without_surprise() {
    let desk = Desk::new(SPEC);
    desk.write("my.whisker.toml", SPEC);
    desk.write("bare", SPEC);
    for (spec, out) in [("my.whisker.toml", "results/my.whisker"), ("bare", "results/bare")] {
        desk.run(&["sweep", spec, "--backend", "cpu"]).exits(0);
        assert_eq!(desk.names(out), FILES, "{spec}");
    }
}
