//! The result folder: who may replace what, and that nothing of anybody else is touched.

use crate::common::program::{Desk, SPEC};
use crate::common::world::program;
use serde_json::{Value, json};

const FILES: [&str; 4] = ["designs.csv", "distances.csv", "run.json", "tuples.csv"];

/// The sweep of the spec into the folder of most tests.
const AGAIN: &str = "sweep spec.toml --backend cpu --out out";

/// The spec with other values, and without a distances table.
fn edited() -> String {
    format!("{}[output]\ndistances = false\n", SPEC.replace("theta = [1, 4]", "theta = [1, 5]"))
}

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
fn an_edited_spec_replaces_exactly_what_it_wrote() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    // Names that this program writes, but not here.
    for name in ["rows.csv", "best.toml", "history.csv"] {
        desk.write(&format!("out/{name}"), "mine");
    }
    desk.write("spec.toml", edited());
    let ran = desk.sweep(&["--out", "out"]).exits(0);
    assert!(!ran.stderr.contains("removed"), "{}", ran.stderr);
    let names = ["best.toml", "designs.csv", "history.csv", "rows.csv", "run.json", "tuples.csv"];
    assert_eq!(desk.names("out"), names, "no table of the older result is left, and nothing else is gone");
    assert_eq!(desk.read("out/rows.csv"), "mine");
    desk.whole("out");
}

#[test]
fn another_spec_or_command_is_refused_unless_forced() {
    let desk = Desk::new(SPEC);
    desk.write("other.toml", SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    let first = desk.read("out/run.json");
    let rig = SPEC.replace("d = [4, 7]", "d = 4");
    desk.write("rig/spec.toml", rig);
    for line in ["sweep other.toml", "simulate rig/spec.toml", "verify spec.toml --samples 1"] {
        desk.refuses(format!("{line} --backend cpu --out out"), &["--out", "--force", "sweep of spec"]);
        assert_eq!(desk.read("out/run.json"), first);
        desk.whole("out");
    }
    let forced = ["simulate", "rig/spec.toml", "--out", "out", "--force", "--json"];
    let ran = desk.run(&forced).exits(0);
    let gone = ["out/designs.csv", "out/distances.csv", "out/tuples.csv", "out/run.json"];
    assert_eq!(ran.json()["result"]["removed"], json!(gone));
    assert!(gone.iter().all(|name| ran.stderr.contains(name)), "{}", ran.stderr);
    assert_eq!(desk.names("out"), ["measurements.csv", "run.json"]);
}

#[test]
fn a_long_result_gives_way_to_the_same_values_only() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    let took_an_hour = || {
        let mut run: Value = serde_json::from_str(&desk.read("out/run.json")).unwrap();
        run["seconds"]["total"] = json!(3600.0);
        desk.write("out/run.json", run.to_string());
    };
    took_an_hour();
    desk.write("spec.toml", format!("# A comment is no value.\n{SPEC}"));
    desk.sweep(&["--out", "./out/", "--threads", "1", "--quiet"]).exits(0);
    took_an_hour();
    desk.write("spec.toml", edited());
    desk.refuses(AGAIN, &["3600 s", "tap.theta"]);
    assert_eq!(desk.names("out"), FILES);
    let ran = desk.sweep(&["--out", "out", "--force"]).exits(0);
    assert!(ran.stderr.contains("removed") && ran.stderr.contains("out/distances.csv"), "{}", ran.stderr);
}

#[test]
fn other_tuples_under_the_same_name_are_other_values() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    let list = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n10,4,50,5,2,33,1\n";
    desk.write("list.csv", list);
    desk.sweep(&["--out", "out"]).exits(0);
    let run = desk.read("out/run.json").replace("\"total\": 0", "\"total\": 610");
    desk.write("out/run.json", run);
    desk.write("list.csv", list.replace(",33,", ",34,"));
    desk.refuses(AGAIN, &["tuples"]);
}

#[test]
fn an_edited_table_is_kept_unless_forced() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    let mine = desk.read("out/designs.csv").replacen(",4,", ",5,", 1);
    desk.write("out/designs.csv", &mine);
    desk.refuses(AGAIN, &["out/designs.csv was edited"]);
    assert_eq!(desk.read("out/designs.csv"), mine);
    let ran = desk.sweep(&["--out", "out", "--force"]).exits(0);
    assert!(ran.stderr.contains("out/designs.csv"), "{}", ran.stderr);
    std::fs::remove_file(desk.path("out/designs.csv")).unwrap();
    desk.sweep(&["--out", "out"]).exits(0);
    desk.whole("out");
}

#[test]
fn a_file_of_somebody_else_is_kept_even_with_force() {
    let desk = Desk::new(&edited());
    desk.sweep(&["--out", "out"]).exits(0);
    desk.write("out/distances.csv", "mine");
    desk.write("spec.toml", SPEC);
    for more in ["", " --force"] {
        desk.refuses(AGAIN.to_owned() + more, &["out/distances.csv is in the way"]);
    }
    assert_eq!(desk.read("out/distances.csv"), "mine");
    desk.whole("out");
}

#[test]
fn a_folder_in_the_way_is_found_before_the_work() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    std::fs::remove_file(desk.path("out/designs.csv")).unwrap();
    std::fs::create_dir(desk.path("out/designs.csv")).unwrap();
    let (run, names) = (desk.read("out/run.json"), desk.names("out"));
    for more in ["", " --force"] {
        desk.refuses(AGAIN.to_owned() + more, &["out/designs.csv"]);
    }
    assert_eq!((desk.read("out/run.json"), desk.names("out")), (run, names));
    std::fs::remove_dir(desk.path("out/designs.csv")).unwrap();
    desk.sweep(&["--out", "out"]).exits(0);
    desk.whole("out");
}

#[test]
fn a_foreign_folder_is_refused() {
    let desk = Desk::new(SPEC);
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
fn force_keeps_a_run_json_that_lists_nothing_under_another_name() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    // As versions without a list wrote it, and as a file that points out of its folder.
    let mut run: Value = serde_json::from_str(&desk.read("out/run.json")).unwrap();
    run["files"] = json!([{ "name": "../spec.toml", "blake3": "", "bytes": 0 }]);
    desk.write("out/run.json", run.to_string());
    desk.sweep(&["--out", "out"]).exits(2);
    run.as_object_mut().unwrap().remove("files");
    desk.write("out/run.json", run.to_string());
    desk.sweep(&["--out", "out"]).exits(2);
    let ran = desk.sweep(&["--out", "out", "--force"]).exits(2);
    assert!(ran.stderr.contains("no result in this folder says"), "{}", ran.stderr);
    std::fs::create_dir(desk.path("out/before")).unwrap();
    for name in FILES.iter().filter(|n| **n != "run.json") {
        std::fs::rename(desk.path(&format!("out/{name}")), desk.path(&format!("out/before/{name}"))).unwrap();
    }
    desk.sweep(&["--out", "out"]).exits(2);
    desk.sweep(&["--out", "out", "--force"]).exits(0);
    assert_eq!(desk.read("out/run.old.json"), run.to_string());
    assert_eq!(desk.names("out/before"), ["designs.csv", "distances.csv", "tuples.csv"]);
    desk.whole("out");
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
    #[cfg(unix)]
    for out in ["empty", "new/and/deep"] {
        use std::os::unix::fs::PermissionsExt;
        let mode = |name: &str| std::fs::metadata(desk.path(name)).unwrap().permissions().mode();
        assert_eq!(mode(out), mode("new/and"), "{out} is as open as any new folder");
    }
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
fn the_current_folder_can_hold_the_result() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("here")).unwrap();
    let mut command = program(&desk, &["sweep", "../spec.toml", "--backend", "cpu", "--out", "."]);
    let ran = command.current_dir(desk.path("here")).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(desk.names("here"), FILES);
    assert_eq!(desk.names("."), ["here", "spec.toml"]);
}

#[test]
fn an_unusable_place_leaves_nothing() {
    let desk = Desk::new(SPEC);
    desk.write("file", "in the way");
    let other = cfg!(target_os = "linux").then_some("/proc/vibrissa");
    for out in ["file/out"].into_iter().chain(other) {
        let ran = desk.sweep(&["--out", out]);
        assert!(matches!(ran.code, 1 | 2) && ran.stderr.contains(&out[..4]), "{}", ran.stderr);
    }
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
        desk.ok(format!("sweep {spec} --backend cpu"));
        assert_eq!(desk.names(out), FILES, "{spec}");
    }
}
