//! Parts of a sweep and their merge: the tables of the whole, byte for byte, for every output and number of parts; incomplete sets are refused.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::common::program::{Desk, SPEC};
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, REFERENCE};
use proptest::prelude::*;
use serde_json::{Value, json};
use vibrissa::merge;
use vibrissa::plan::Plan;
use vibrissa::progress::Silent;
use vibrissa::sink::shard::Shard;
use vibrissa::spec;
use vibrissa::sweep::{self, Target};

fn sweep_part(text: &str, list: &str, place: Place, shard: Option<Shard>, out: &Path) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("list.csv"), list).unwrap();
    let (spec, choice) = (spec::parse("spec.toml", text, folder.path()).unwrap(), place.choice());
    let (plan, stop) = (Plan::new(&spec.study, &choice).unwrap(), AtomicBool::new(false));
    let out = shard.map_or(out.to_owned(), |shard| out.join(shard.folder()));
    std::fs::create_dir_all(out.parent().unwrap()).unwrap();
    let target = Target { shard, ..Target::new(&out, &stop) };
    sweep::run(&spec, &plan, &choice, &target, &mut Silent).unwrap_or_else(|e| panic!("{e}\n{text}"));
}

pub fn tables(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<(String, Vec<u8>)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "csv" || e == "parquet"))
        .map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(p).unwrap()))
        .collect();
    all.sort();
    all
}

/// Counts that do not depend on the parts, and the mean sweeps of a tap.
fn counted(folder: &Path) -> (Vec<Value>, f64) {
    let run: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("run.json")).unwrap()).unwrap();
    let keys = ["taps", "tuples", "designs", "distances", "status", "complete_rows", "kept_rows"];
    let counts = &run["counts"];
    (keys.iter().map(|key| counts[*key].clone()).collect(), counts["sweeps_mean"].as_f64().unwrap())
}

pub fn joined(text: &str, list: &str, place: Place, parts: u32) {
    joined_each(text, list, place, &[parts]);
}

pub fn joined_each(text: &str, list: &str, place: Place, all: &[u32]) {
    let whole = tempfile::tempdir().unwrap();
    sweep_part(text, list, place, None, &whole.path().join("out"));
    all.iter().for_each(|parts| joins(text, list, place, *parts, &whole.path().join("out")));
}

/// Fails unless `parts` parts, joined, give the bytes of `whole`.
fn joins(text: &str, list: &str, place: Place, parts: u32, whole: &Path) {
    let cut = tempfile::tempdir().unwrap();
    for index in 1..=parts {
        sweep_part(text, list, place, Some(Shard { index, of: parts }), cut.path());
    }
    let report = merge::run(&[cut.path().to_owned()], None, false).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(report.warnings, [""; 0]);
    let (one, other) = (tables(whole), tables(cut.path()));
    let names = |all: &[(String, Vec<u8>)]| all.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert!(!one.is_empty() && names(&one) == names(&other), "{:?} {:?}", names(&one), names(&other));
    for ((name, a), (_, b)) in one.iter().zip(&other) {
        assert!(a == b, "{name} of {parts} parts on {place:?}:\n{text}");
    }
    let ((one, sweeps), (other, joined)) = (counted(whole), counted(cut.path()));
    assert_eq!(one, other, "{text}");
    // The number of sweeps depends on neighbouring taps; ranked parts make their own charts.
    let similar = (joined - sweeps).abs() <= 0.2 * sweeps || text.contains("top = ");
    assert!(similar && joined >= 0.0, "{sweeps} and {joined} sweeps:\n{text}");
}

const GAUGE: &str = "[gauge]\nx_ss = [5, 8]\nl = 2\nnoise_strain = 1e-6\n";
const TAP: &str = "[tap]\na = { from = 15, to = 48, steps = 5 }\ntheta = { from = 1, to = 12, steps = 7 }\n";

fn grid(designs: usize, output: &str) -> String {
    let whisker =
        format!("[whisker]\nD = [8, 10]\nd = {{ from = 3, to = 9, steps = {designs} }}\nL_a = [40, 50]\n");
    format!("{whisker}{GAUGE}{TAP}[output]\n{output}\n")
}

fn list(rows: usize) -> String {
    let row = |i: usize| {
        let design = i * 7 % 5;
        format!("10,{},50,{},2,{},{}\n", 4 + design, 3 + design % 2, 21 + i % 9, 1 + i * 3 % 4)
    };
    format!("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n{}", (0..rows).map(row).collect::<String>())
}

fn listed(output: &str) -> String {
    format!("[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\n[output]\n{output}\n")
}

/// Every table, ranking and format; ranked from charts (f32), from solved taps (f64), by the reference; more parts than designs; axes of rigs.
#[test]
fn parts_give_the_bytes_of_the_whole() {
    let ranked = "top = 9\nby = \"total_rms_mm\"";
    let rigs = |text: String| text.replace("L_a = [40, 50]", "L_a = 50\nhub = [0, 5]\nexponent = [1, 1.0]");
    for (place, text, parts) in [
        (CPU, grid(5, ""), 3),
        (CPU, grid(2, "tuples = false"), 20),
        (CPU, grid(4, "format = \"parquet\""), 5),
        (CPU, grid(30, ranked), 4),
        (CPU, grid(30, "top = 9\nby = \"K_sd\"\nper = \"design\"\nformat = \"parquet\""), 7),
        (CPU_F64, grid(4, ranked), 3),
        (CPU_F64, grid(4, "top = 9\nby = \"force_max_N\"\nper = \"design\""), 2),
        (CPU_F64, grid(3, "top = 100000\ndistances = false"), 3),
        (GPU, grid(4, ""), 2),
        (GPU, grid(30, ranked), 3),
        (REFERENCE, grid(2, "tuples = false"), 3),
        (CPU, rigs(grid(2, "")), 3),
        (CPU, rigs(grid(900, &format!("{ranked}\ntuples = false"))), 3),
        (CPU_F64, rigs(grid(2, "top = 5\nper = \"design\"")), 2),
    ] {
        joined(&text, "", place, parts);
    }
    let hubs = with_column(&list(80), "hub_mm", |i| i % 3);
    for (output, list, parts) in [
        ("", &list(80), 2),
        ("format = \"parquet\"", &list(80), 4),
        ("top = 6", &list(80), 3),
        ("top = 3\nper = \"design\"\nformat = \"parquet\"", &list(80), 9),
        ("designs = false\ntuples = false", &list(80), 2),
        ("", &hubs, 3),
        ("top = 3\nper = \"design\"\nformat = \"parquet\"", &hubs, 3),
    ] {
        joined(&listed(output), list, CPU, parts);
    }
}

fn with_column(list: &str, name: &str, value: impl Fn(usize) -> usize) -> String {
    let row = |(i, line): (usize, &str)| match i {
        0 => format!("{line},{name}\n"),
        _ => format!("{line},{}\n", value(i)),
    };
    list.lines().enumerate().map(row).collect()
}

/// Directions given by axes, zipped with a whisker or with the drive, and listed.
#[test]
fn parts_of_tilted_taps_give_the_bytes_of_the_whole() {
    let second = |text: &str| text.replace("noise_strain", "second = true\nnoise_strain");
    let axes =
        |output| second(&grid(3, output)).replace("[tap]\n", "[tap]\ntilt = [-10, 0, 20]\nlean = [0, 5]\n");
    let samples = |min: f64, max: f64| format!("{{ min = {min}, max = {max}, samples = 7 }}");
    let zipped = second(&grid(7, "[model]\ngeometry = \"linear\"\n")).replace("[output]\n", "");
    let zipped = zipped.replace("[tap]\n", &format!("[tap]\ntilt = {}\n", samples(-30.0, 30.0)));
    let file = with_column(&list(80), "tilt_deg", |i| i % 3 * 10);
    for (text, list, parts) in [
        (axes(""), "", 3),
        (axes("top = 9\nby = \"error_rms_mm\"\nper = \"design\"\nformat = \"parquet\""), "", 4),
        (zipped.replace("{ from = 3, to = 9, steps = 7 }", &samples(3.0, 9.0)), "", 4),
        (zipped.replace("{ from = 1, to = 12, steps = 7 }", &samples(1.0, 12.0)), "", 3),
        (second(&listed("")), &file, 3),
        (second(&listed("top = 6\nformat = \"parquet\"")), &file, 4),
    ] {
        joined(&text, list, CPU, parts);
    }
}

#[test]
fn large_parts_give_the_bytes_of_the_whole() {
    let file = crate::kept::alternating(100_000);
    joined(&listed(""), &file, CPU, 3);
    joined(&listed("top = 20\nformat = \"parquet\""), &file, CPU, 2);
    let wide = "[whisker]\nD = [8, 10, 12]\nd = 5\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = { from = 21, to = 48, steps = 400 }\n\
                theta = { from = 1, to = 6, steps = 400 }\n[model]\ngeometry = \"linear\"\n[output]\nformat = \"parquet\"\n";
    joined(wide, "", CPU, 2);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn any_number_of_parts_of_any_size(
        designs in 2usize..12, parts in 1u32..40, top in prop::option::of(1usize..60), per in any::<bool>(),
        parquet in any::<bool>(), exact in any::<bool>(), list_rows in prop::option::of(1usize..60),
    ) {
        let mut output = top.map_or(String::new(), |n| format!("top = {n}\n"));
        if per { output += "per = \"design\"\n"; }
        if parquet { output += "format = \"parquet\"\n"; }
        let place = if exact { CPU_F64 } else { CPU };
        match list_rows {
            Some(rows) => joined(&listed(&output), &list(rows), place, parts),
            None => joined(&grid(designs, &output), "", place, parts),
        }
    }
}

#[test]
fn the_program_makes_parts_and_joins_them() {
    let desk = Desk::new(SPEC);
    desk.sweep(&["--out", "whole"]).exits(0);
    let ran = desk.sweep(&["--out", "out", "--shard", "2/3"]).exits(0);
    assert!(ran.stdout.contains("out/shard-2-of-3/tuples.csv"), "{}", ran.stdout);
    let ran = desk.line("merge out").exits(2);
    assert!(ran.stderr.contains("2 of 3 parts are missing: 1, 3"), "{}", ran.stderr);
    for task in ["3", "1"] {
        let slurm = [("ID", task), ("COUNT", "3"), ("MIN", "1"), ("MAX", "3")];
        let slurm = slurm.map(|(name, value)| (format!("SLURM_ARRAY_TASK_{name}"), value));
        let slurm = slurm.each_ref().map(|(name, value)| (name.as_str(), *value));
        desk.run_with(
            &["sweep", "spec.toml", "--backend", "cpu", "--out", "out", "--shard", "slurm"],
            &slurm,
        )
        .exits(0);
    }
    let merged = desk.json("merge out");
    assert_eq!(
        (&merged["ok"], &merged["out"], &merged["counts"]["taps"]),
        (&true.into(), &"out".into(), &12.into())
    );
    for table in ["tuples.csv", "designs.csv", "distances.csv"] {
        assert_eq!(desk.read(&format!("out/{table}")), desk.read(&format!("whole/{table}")));
    }
    let run = desk.whole("out");
    assert_eq!(run["parts"].as_array().map(Vec::len), Some(3));
    assert!(run["shard"].is_null() && run["parts"][1]["part"] == "2/3", "{run}");
    // The same sweep may replace a merged result, and a merge may replace it again.
    desk.sweep(&["--out", "out"]).exits(0);
    desk.ok("merge out/shard-1-of-3 out/shard-2-of-3 out/shard-3-of-3");
    desk.ok("merge out --out elsewhere --quiet");
    assert_eq!(desk.read("elsewhere/tuples.csv"), desk.read("whole/tuples.csv"));
    desk.line("report-nothing").exits(2);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let desk = Desk::new(SPEC);
    for part in ["1/2", "2/2"] {
        desk.sweep(&["--out", "out", "--shard", part]).exits(0);
    }
    let refused = |words: &str| {
        let ran = desk.line("merge out --out joined").exits(2);
        assert!(ran.stderr.contains(words), "{words}: {}", ran.stderr);
        assert!(!desk.path("joined").exists());
    };
    let again = || desk.sweep(&["--out", "out", "--shard", "2/2", "--force"]).exits(0);
    // Edited, torn, other values, other precision, another program's folder, a part twice, another count.
    let table = desk.read("out/shard-2-of-2/designs.csv");
    desk.write("out/shard-2-of-2/designs.csv", table.replacen("10,7,", "10,8,", 1));
    refused("designs.csv is not what was written");
    again();
    std::fs::remove_file(desk.path("out/shard-2-of-2/designs.csv")).unwrap();
    refused("designs.csv is missing");
    again();
    // A part made from another text of the spec is refused, even if the values are the same.
    desk.write("spec.toml", format!("# once more\n{SPEC}"));
    again();
    refused("of another text of the spec, though its values are the same");
    desk.write("spec.toml", SPEC);
    again();
    #[cfg(unix)]
    for (name, why) in
        [("designs.csv", "designs.csv: this is a link"), ("run.json", "run.json: this is a link")]
    {
        let path = desk.path(&format!("out/shard-2-of-2/{name}"));
        std::fs::rename(&path, desk.path("moved")).unwrap();
        std::os::unix::fs::symlink(desk.path("moved"), &path).unwrap();
        refused(why);
        std::fs::remove_file(&path).unwrap();
        std::fs::rename(desk.path("moved"), &path).unwrap();
    }
    desk.write("out/shard-2-of-2/run.json", "{ \"command\": \"sweep\" ");
    refused("its run.json is not that of part 2/2");
    std::fs::remove_dir_all(desk.path("out/shard-2-of-2")).unwrap();
    desk.write("spec.toml", SPEC.replace("theta = [1, 4]", "theta = [1, 5]"));
    again();
    refused("of another spec");
    desk.write("spec.toml", SPEC);
    desk.sweep(&["--out", "out", "--shard", "2/2", "--precision", "f64"]).exits(0);
    refused("of another precision");
    desk.sweep(&["--out", "out", "--shard", "2/2", "--tolerance", "1e-4"]).exits(0);
    refused("of another tolerance");
    again();
    desk.sweep(&["--out", "out", "--shard", "3/4"]).exits(0);
    refused("parts of 2 and of 4");
    std::fs::remove_dir_all(desk.path("out/shard-3-of-4")).unwrap();
    let both = ["merge", "out", "out/shard-1-of-2", "--out", "joined"];
    assert!(desk.run(&both).exits(2).stderr.contains("part 1/2 is there twice"));
    std::fs::rename(desk.path("out/shard-2-of-2"), desk.path("out/kept")).unwrap();
    std::fs::create_dir_all(desk.path("out/shard-2-of-2/.vibrissa-unfinished")).unwrap();
    refused("this part is unfinished (2/2)");
}

/// The effects left off depend on the whole spec, so parts leave off the same; with `top`, no part knows the kept rows.
#[test]
fn parts_with_effects_left_off_give_the_bytes_of_the_whole() {
    let text = SPEC.replace("d = [4, 7]", "d = [4, 5, 6, 7]") + "[model]\nshear = true\nextension = true\n";
    let desk = Desk::new(&text);
    let asked = ["--model-error", "0.01", "--quiet"];
    desk.sweep(&[&asked[..], &["--out", "whole"]].concat()).exits(0);
    let left = |run: &Value| run["model_error"]["left_off"].clone();
    let whole = desk.whole("whole");
    assert!(left(&whole).as_array().is_some_and(|all| !all.is_empty()), "{whole}");
    for part in ["1/3", "2/3", "3/3"] {
        desk.sweep(&[&asked[..], &["--out", "cut", "--shard", part]].concat()).exits(0);
    }
    desk.ok("merge cut --quiet");
    assert!(tables(&desk.path("whole")) == tables(&desk.path("cut")));
    let merged = desk.whole("cut");
    assert_eq!(
        (left(&merged), &merged["model_error"]["taps_by_full_model"]),
        (left(&whole), &whole["model_error"]["taps_by_full_model"])
    );
    desk.write("spec.toml", text + "[output]\ntop = 2\nby = \"K_sd\"\n");
    let no_part = "which no part knows";
    desk.refuses("sweep spec.toml --model-error 0.01 --out ranked --shard 1/3", &["--shard", no_part]);
    desk.write("spec.toml", desk.read("spec.toml") + "[run]\nmodel_error = 0.01\n");
    for line in
        ["sweep spec.toml --shard 1/2 --out ranked", "cluster slurm spec.toml --shards 2 --out ranked"]
    {
        desk.refuses(line, &["--shard", no_part]);
    }
    assert!(!desk.path("ranked").exists());
}

/// A run.json changed in any field is refused, also where the value is plausible.
#[test]
fn a_part_whose_record_was_changed_is_refused() {
    let desk = Desk::new(SPEC);
    for part in ["1/2", "2/2"] {
        desk.sweep(&["--out", "out", "--shard", part]).exits(0);
    }
    let (text, honest) = (desk.read("out/shard-2-of-2/run.json"), desk.whole("out/shard-2-of-2"));
    let hash = "0".repeat(64);
    for (at, value) in [
        ("/files", json!([])),
        ("/files", json!(5)),
        ("/files/0/name", json!("../x")),
        ("/files/0/name", json!("run.json")),
        ("/files/0/name", honest["files"][1]["name"].clone()),
        ("/files/0/blake3", json!(hash)),
        ("/blake3", json!(hash)),
        ("/blake3", json!(7)),
        ("/counts/taps", json!(-1)),
        ("/counts/taps", json!(honest["counts"]["taps"].as_u64().unwrap() + 1)),
        ("/counts/solved", json!(u64::MAX)),
        ("/counts/referred", Value::Null),
        ("/counts/status", json!({ "ok": 1.5 })),
        ("/counts", json!(7)),
        ("/seconds/total", json!(0.5)),
        ("/shard/candidates", json!("all")),
        ("/material_fit", json!(true)),
    ] {
        let mut run = honest.clone();
        *run.pointer_mut(at).unwrap() = value;
        desk.write("out/shard-2-of-2/run.json", format!("{run:#}\n"));
        let ran = desk.line("merge out --out joined --json").exits(2);
        let error = ran.json()["error"].clone();
        let told = |field: &str| error[field].as_str().unwrap_or_default().to_owned();
        assert_eq!(
            (told("key"), told("value")),
            ("merge".into(), "out/shard-2-of-2".into()),
            "{at}: {error}"
        );
        assert!(told("message").contains("out/shard-2-of-2/run.json is not what"), "{at}: {error}");
        assert!(told("allowed").contains("--force") && !desk.path("joined").exists(), "{at}: {error}");
    }
    let mut run = honest.clone();
    run.as_object_mut().unwrap().remove("blake3");
    desk.write("out/shard-2-of-2/run.json", format!("{run:#}\n"));
    assert!(desk.line("merge out --out joined").exits(2).stderr.contains("this version of the program"));
    desk.write("out/shard-2-of-2/run.json", text);
    desk.ok("merge out --out joined");
}
