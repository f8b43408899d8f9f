//! The result folder: which command may replace which result; files of others stay untouched.

use crate::common::program::{Desk, SPEC, names};
use crate::common::world::program;
use serde_json::{Value, json};

const FILES: [&str; 4] = ["designs.csv", "distances.csv", "run.json", "tuples.csv"];

const RIG: &str = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                   [tap]\na = { from = 21, to = 48, step = 3 }\n";

const AGAIN: &str = "sweep spec.toml --backend cpu --out out";

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
    // Other tuples in a file of the same name are other values.
    desk.write("listed/spec.toml", "[tuples]\nfile = \"list.csv\"\n");
    let list = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n10,4,50,5,2,33,1\n";
    desk.write("listed/list.csv", list);
    let listed = "sweep listed/spec.toml --backend cpu --out out --force";
    desk.ok(listed);
    took_an_hour();
    desk.write("listed/list.csv", list.replace(",33,", ",34,"));
    desk.refuses(listed.trim_end_matches(" --force"), &["tuples"]);
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
fn a_run_json_that_lists_nothing_is_in_the_way() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "out"]).exits(0);
    // Without a list, as older versions wrote it, and with a file outside its folder.
    let mut run: Value = serde_json::from_str(&desk.read("out/run.json")).unwrap();
    for files in [json!(null), json!([{ "name": "../spec.toml", "blake3": "", "bytes": 0 }])] {
        run["files"] = files;
        desk.write("out/run.json", run.to_string());
        for more in ["", " --force"] {
            desk.refuses(
                AGAIN.to_owned() + more,
                &["run.json in this folder lists no files", "move this file away"],
            );
        }
        assert_eq!(desk.read("out/run.json"), run.to_string());
    }
    // Without run.json, its tables belong to no result.
    std::fs::rename(desk.path("out/run.json"), desk.path("out/before.json")).unwrap();
    desk.refuses(AGAIN.to_owned() + " --force", &["no result in this folder says"]);
    std::fs::create_dir(desk.path("out/before")).unwrap();
    for name in FILES.iter().filter(|n| **n != "run.json") {
        std::fs::rename(desk.path(&format!("out/{name}")), desk.path(&format!("out/before/{name}"))).unwrap();
    }
    desk.sweep(&["--out", "out"]).exits(2);
    desk.sweep(&["--out", "out", "--force"]).exits(0);
    desk.whole("out");
}

/// Empty, missing and linked folders, the current folder, folders named in or after a spec; refused where no folder can be.
#[test]
fn results_go_where_they_are_asked_for() {
    let desk = Desk::new(SPEC);
    std::fs::create_dir(desk.path("empty")).unwrap();
    for out in ["empty", "new/and/deep", "./dotted/", "slashed/"] {
        desk.sweep(&["--out", out]).exits(0);
        assert_eq!(desk.names(out), FILES, "{out}");
    }
    assert_eq!(desk.names("new/and"), ["deep"]);
    desk.write("my.whisker.toml", SPEC);
    desk.write("bare", SPEC);
    desk.write("there.toml", format!("{SPEC}[run]\nout = \"kept\"\n"));
    for (spec, out) in
        [("my.whisker.toml", "results/my.whisker"), ("bare", "results/bare"), ("there.toml", "kept")]
    {
        desk.ok(format!("sweep {spec} --backend cpu"));
        assert_eq!(desk.names(out), FILES, "{spec}");
    }
    desk.ok("sweep there.toml --backend cpu --out typed");
    std::fs::create_dir(desk.path("here")).unwrap();
    let mut command = program(&desk, &["sweep", "../spec.toml", "--backend", "cpu", "--out", "."]);
    let ran = command.current_dir(desk.path("here")).output().unwrap();
    assert!(ran.status.success() && desk.names("here") == FILES, "{}", String::from_utf8_lossy(&ran.stderr));
    desk.write("file", "in the way");
    let other = cfg!(target_os = "linux").then_some("/proc/vibrissa");
    for out in ["file/out"].into_iter().chain(other) {
        let ran = desk.sweep(&["--out", out]);
        assert!(matches!(ran.code, 1 | 2) && ran.stderr.contains(&out[..4]), "{}", ran.stderr);
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let mode = |name: &str| std::fs::metadata(desk.path(name)).unwrap().permissions().mode();
        assert!(
            ["empty", "new/and/deep"].iter().all(|out| mode(out) == mode("new/and")),
            "as open as any new folder"
        );
        std::fs::create_dir(desk.path("real")).unwrap();
        symlink("real", desk.path("link")).unwrap();
        symlink("nowhere", desk.path("broken")).unwrap();
        desk.sweep(&["--out", "link"]).exits(0);
        assert_eq!(desk.names("real"), FILES);
        desk.sweep(&["--out", "broken"]).exits(2);
        std::fs::remove_file(desk.path("broken")).unwrap();
    }
    let all = "bare dotted empty file here kept link my.whisker.toml new real results slashed spec.toml there.toml typed";
    let all = if cfg!(unix) { all.to_owned() } else { all.replace("link ", "").replace("real ", "") };
    assert_eq!(desk.names(".").join(" "), all);
}

#[test]
fn every_command_lists_what_it_wrote() {
    let desk = Desk::new(SPEC);
    desk.write("rig.toml", format!("{RIG}theta = [1, 2, 4]\n"));
    desk.write("whisker.toml", RIG);
    let search = "[optimise]\nobjective = \"pareto\"\nbudget = { evaluations = 200 }\nvariables = { theta = [1, 5] }\n";
    desk.write("search.toml", format!("{RIG}{search}"));
    let data = "results/rig-simulate/measurements.csv";
    let calibration = "results/measurements-calibrate/calibration.toml";
    for (arguments, folder) in [
        (&["sweep", "spec.toml", "--backend", "cpu"][..], "spec"),
        (&["simulate", "rig.toml", "--repeats", "2"], "rig-simulate"),
        (&["calibrate", data, "--whisker", "whisker.toml"], "measurements-calibrate"),
        (&["locate", calibration, data], "measurements-locate"),
        (&["tap", "whisker.toml"], "whisker-tap"),
        (&["optimise", "search.toml", "--backend", "cpu"], "search-optimise"),
        (&["verify", "spec.toml", "--backend", "cpu", "--samples", "2"], "spec-verify"),
    ] {
        let ran = desk.run(&[arguments, &["--json"]].concat()).exits(0).json();
        let folder = format!("results/{folder}");
        assert_eq!(ran["out"], folder.as_str());
        let run = desk.whole(&folder);
        let name = folder.trim_start_matches("results/").trim_end_matches(&format!("-{}", arguments[0]));
        assert_eq!((&run["command"], &run["name"]), (&arguments[0].into(), &name.into()));
        let listed = run["files"].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap());
        let mut listed: Vec<&str> = listed.chain(["run.json"]).collect();
        listed.sort_unstable();
        let there = names(&desk.path(&folder));
        assert_eq!(there, listed);
        desk.run(arguments).exits(0);
        desk.whole(&folder);
    }
}
