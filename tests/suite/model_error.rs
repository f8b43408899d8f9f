//! `--model-error`: results with effects left off against those of the full model.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::Value;

use crate::common::measuring::REAL;
use crate::common::program::{Desk, says};
use crate::common::sweeping::{CPU_F64, Row, Table, number, sweep, tap};
use vibrissa::census::sample::{choosing, choosing_in, taps};
use vibrissa::census::{Taps, needed::Needed};
use vibrissa::chart::ranges::Wanted;
use vibrissa::error::Error;
use vibrissa::plan::Plan;
use vibrissa::progress::Progress;
use vibrissa::scene::{Setup, Space, Study, Tuple};
use vibrissa::spec;
use vibrissa::sweep::{self as sweeps, Target};

fn soft(theta: &str, more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = [4, 7, 10]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
         [tap]\na = {{ from = 21, to = 48, step = 3 }}\ntheta = {theta}\n\
         {REAL}{more}"
    )
}

/// Sweeps in f64; returns tuples.csv and `model_error` of run.json.
fn swept(desk: &Desk, flags: &str, out: &str) -> (Table, Value) {
    desk.ok(format!("sweep spec.toml --backend cpu --precision f64 {flags} --out {out}"));
    (desk.table(format!("{out}/tuples.csv")), desk.whole(out)["model_error"].clone())
}

fn names(told: &Value, list: &str) -> Vec<String> {
    let effects = told[list].as_array().unwrap_or_else(|| panic!("no {list} in {told}"));
    effects.iter().map(|e| e["effect"].as_str().expect("a name").to_owned()).collect()
}

/// 1e-3 θ f_max for a row of tuples.csv.
fn least(setup: &Setup, row: &Row) -> f64 {
    Taps::of(setup, &[tap(row)]).least(0)
}

/// Largest relative change of strain between two tuples.csv of the same taps; status words must agree.
#[track_caller]
fn apart(text: &str, full: &Table, fewer: &Table) -> f64 {
    let setup = spec::parse("spec.toml", text, Path::new("")).expect("a spec").study.setup;
    assert_eq!(full.rows.len(), fewer.rows.len());
    let mut largest = 0.0f64;
    for (a, b) in full.rows.iter().zip(&fewer.rows) {
        ["a_mm", "theta_deg", "d_tip_mm", "status"].iter().for_each(|c| assert_eq!(a[*c], b[*c], "{a:?}"));
        let (Some(x), Some(y)) = (number(a, "strain"), number(b, "strain")) else {
            assert_eq!(a["strain"], b["strain"]);
            continue;
        };
        largest = largest.max((y - x).abs() / x.abs().max(least(&setup, a)));
    }
    largest
}

#[test]
fn the_joint_change_of_what_is_left_off_is_what_run_json_says() {
    let text = soft("0.5", "");
    let desk = Desk::new(&text);
    let (full, _) = swept(&desk, "", "full");
    for (bound, left) in [
        ("1e-2", &["extension", "rubber nonlinearity", "surface"][..]),
        ("1e-3", &["rubber nonlinearity"]),
        ("1e-4", &[]),
    ] {
        let (fewer, told) = swept(&desk, &format!("--model-error {bound}"), bound);
        let mut found = names(&told, "left_off");
        found.sort();
        assert_eq!(found, left, "{told}");
        assert_eq!(left.len() + names(&told, "needed").len(), 4, "{told}");
        let change = apart(&text, &full, &fewer);
        assert!(change <= told["bound"].as_f64().expect("E"));
        match told["spread"]["error"].as_f64() {
            Some(error) => {
                assert!((change - error).abs() <= 1e-6 * error + 2e-8, "{change} {error}");
                assert_eq!(told["spread"]["taps"], 30);
                assert!(error > 0.0 && told["seconds"]["choosing"].is_number());
            }
            None => assert_eq!(full.text, fewer.text),
        }
    }
    // Two effects small alone and large together: rubber and surface change the strain in the same direction, extension opposes them.
    let effect = |told: &Value, list: &str, name: &str| {
        let all = told[list].as_array().expect("parts");
        all.iter().find(|p| p["effect"] == name).unwrap_or_else(|| panic!("{name}: {told}")).clone()
    };
    let (_, all) = swept(&desk, "--model-error 0.02", "all");
    let bound = 1.05 * effect(&all, "left_off", "surface")["alone"]["error"].as_f64().expect("a number");
    let (_, one) = swept(&desk, &format!("--model-error {bound:e}"), "one");
    assert_eq!(names(&one, "left_off"), ["rubber nonlinearity"], "{one}");
    let surface = effect(&one, "needed", "surface");
    let error = |of: &str| surface[of]["error"].as_f64().expect("a number");
    assert!(error("alone") <= bound && error("together") > bound, "{surface}");
}

/// The range of interest begins between the second roots of the full model and of the model without rubber.
#[test]
fn an_effect_stays_where_a_word_of_the_estimate_would_change() {
    let text = |material: &str, from: f64| {
        let one = soft("0.5", &format!("[estimate]\nrange = [{from:?}, 48]\n")).replace("[4, 7, 10]", "4");
        one.replace("{ from = 21, to = 48, step = 3 }", "[30, 48]").replace("neo-hookean", material)
    };
    let ambiguous = |material: &str, from: f64| {
        sweep(&text(material, from), CPU_F64).tuples.statuses()[0].contains("ambiguous")
    };
    let second_root = |material: &str| {
        let (mut low, mut high) = (5.0, 30.0);
        assert!(ambiguous(material, low) && !ambiguous(material, high));
        while high - low > 1e-7 {
            let middle = 0.5 * (low + high);
            *(if ambiguous(material, middle) { &mut low } else { &mut high }) = middle;
        }
        low
    };
    let (full, hooke) = (second_root("neo-hookean"), second_root("hooke"));
    assert!((full - hooke).abs() > 1e-5, "{full} {hooke}");
    let told = |from: f64| swept(&Desk::new(&text("neo-hookean", from)), "--model-error 1e-3", "out").1;
    assert_eq!(names(&told(10.0), "left_off"), ["rubber nonlinearity"]);
    let edge = told(0.5 * (full + hooke));
    assert!(names(&edge, "left_off").is_empty(), "{edge}");
    let why = edge["needed"][0]["why"].as_str().expect("why");
    assert!(why.contains("a status would change") && why.contains("ambiguous"), "{edge}");
}

/// What is left off is chosen by all taps of a small space, of a large one by at least 2000 with its corners, and the ends of every column of a list.
#[test]
fn a_model_is_chosen_by_2000_taps_and_the_corners() {
    let study = |d: &str, a: &str, theta: &str| {
        let text = format!(
            "[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}"
        );
        spec::parse("t.toml", &text, Path::new("")).expect("a spec").study
    };
    let small = choosing(&study("[4, 7]", "[20, 30, 40]", "[1, 2]"));
    assert_eq!((small.len(), taps(&small)), (4, 12));
    assert!(small.iter().all(|r| r.reach == [20.0, 40.0]));
    let steps = |from: f64, to: f64, steps: u64| match steps {
        1 => from.to_string(),
        _ => format!("{{ from = {from}, to = {to}, steps = {steps} }}"),
    };
    for [d, a, theta] in [[3000, 400, 80], [3100, 1, 1], [1, 40_000, 3], [1, 1, 5000], [40, 10, 10]] {
        let large = study(&steps(2.0, 9.0, d), &steps(10.0, 50.0, a), &steps(1.0, 8.0, theta));
        let rows = choosing(&large);
        assert!((2000..5000).contains(&taps(&rows)), "{} of {d} x {a} x {theta}", taps(&rows));
        let layout = large.space.layout().expect("a grid");
        let ends = [0, layout.n_distances - 1].map(|i| layout.distance(i));
        assert!(rows.iter().all(|r| [r.distances[0], *r.distances.last().expect("one")] == ends));
    }
    let tilts = "[1, 9]\ntilt = { from = -20, to = 30, steps = 11 }\nlean = 5";
    let tilted = study("{ min = 2, max = 9, samples = 100000 }", &steps(10.0, 50.0, 100), tilts);
    let layout = tilted.space.layout().expect("a grid");
    let boxed = choosing_in(&Wanted::of(&layout), &layout);
    assert!((2000..5000).contains(&taps(&boxed)), "{}", taps(&boxed));
    for rows in [choosing(&tilted), boxed] {
        for (tilt, d, drive) in [(-20.0, 2.0, 1.0), (-20.0, 9.0, 9.0), (30.0, 2.0, 9.0), (30.0, 9.0, 1.0)] {
            let corner = |t: &Tuple| (t.tilt, t.lean, t.d, t.drive) == (tilt, 5.0, d, drive);
            assert!(rows.iter().any(|r| corner(&r.point)), "{tilt} {d} {drive}");
        }
    }
    for (whiskers, distances) in [(1000, 10), (5000, 1), (3, 5000)] {
        let tuple = |i: usize| Tuple {
            d: 2.0 + 1e-3 * (i % whiskers) as f64,
            a: 20.0 + (i / whiskers) as f64,
            drive: 1.0,
            ..Tuple::default()
        };
        let listed = Space::List((0..whiskers * distances).map(tuple).collect());
        let rows = choosing(&Study { space: listed, ..tilted.clone() });
        assert!((2000..5000).contains(&taps(&rows)), "{} of {whiskers} x {distances}", taps(&rows));
        let ends = [2.0, 2.0 + 1e-3 * (whiskers - 1) as f64];
        assert!(ends.iter().all(|end| rows.iter().any(|r| r.point.d == *end)));
    }
}

/// Many designs, all rows written, the limit of the gauge in the middle of their strains.
#[test]
fn in_a_large_table_every_status_is_that_of_the_full_model() {
    let text = "[whisker]\nD = { min = 8, max = 12, samples = 2500 }\nd = { min = 4, max = 9, samples = 2500 }\nL_a = 50\n\
                [gauge]\nx_ss = 5\nl = 2\nstrain_limit = 0.0021\n[tap]\na = [24, 33, 45]\ntheta = 0.5\n\
                [model]\nshear = true\nextension = true\nsurface = true\nmaterial = { neo-hookean = 3.2 }\n";
    let desk = Desk::new(text);
    let ((full, _), (fewer, told)) = (swept(&desk, "", "full"), swept(&desk, "--model-error 1e-2", "fewer"));
    let over = full.statuses().iter().filter(|s| s.contains("strain_limit")).count();
    assert!(over * 10 > full.rows.len() && over * 10 < 9 * full.rows.len(), "{over}");
    assert!(!names(&told, "left_off").is_empty(), "{told}");
    let change = apart(text, &full, &fewer);
    assert!(change <= 1e-2 && change > 1e-4, "{change}");
    let mended = told["taps_by_full_model"].as_u64().expect("taps");
    assert!(mended > 0 && mended < full.rows.len() as u64 / 4, "{told}");
    let same = full.rows.iter().zip(&fewer.rows).filter(|(a, b)| a["strain"] == b["strain"]).count() as u64;
    assert!(same >= mended, "{same} taps are those of the full model: {told}");
    assert!(told["spread"]["taps"].as_u64().expect("taps") >= 2000, "{told}");
}

/// The kept rows of a ranked sweep, solved again with the full model from a tuple file.
#[test]
fn kept_rows_are_within_the_bound_of_the_full_model() {
    let text = format!(
        "[whisker]\nD = {{ min = 8, max = 12, samples = 33000 }}\nd = {{ min = 3, max = 7, samples = 33000 }}\nL_a = 50\n\
         [gauge]\nx_ss = 5\nl = 2\n[tap]\na = [24, 30, 36, 45]\ntheta = {{ min = 0.2, max = 0.6, samples = 33000 }}\n{REAL}\
         [output]\ntop = 50\n"
    );
    let desk = Desk::new(&text);
    desk.sweep(&["--model-error", "1e-2", "--out", "kept"]).exits(0);
    let run = desk.whole("kept");
    let told = &run["model_error"];
    assert!(names(told, "left_off").contains(&"rubber nonlinearity".to_owned()), "{told}");
    assert_eq!(told["rows_kept"]["taps"], 200);
    assert_eq!(told["rows_kept"]["statuses_changed"], 0);
    assert!(run["counts"]["chart"].is_object(), "ranked from a chart of what is left: {}", run["counts"]);

    desk.write("list.csv", desk.read("kept/tuples.csv"));
    desk.write("full.toml", format!("[gauge]\n{REAL}[tuples]\nfile = \"list.csv\"\n"));
    desk.ok("sweep full.toml --backend cpu --precision f64 --out full");
    let change = apart(&text, &desk.table("full/tuples.csv"), &desk.table("kept/tuples.csv"));
    let error = told["rows_kept"]["error"].as_f64().expect("a number");
    assert!(change <= 1e-2 && (change - error).abs() <= 2e-5, "{change} {error}");
}

/// One row that the sampled spread misses needs shear more than all others, and has the least strain.
#[test]
fn a_kept_row_that_does_not_keep_the_bound_brings_the_full_model_back() {
    let mut list = String::from("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n");
    let mut row = |big: f64, a: [f64; 2], theta: f64| {
        a.iter().for_each(|a| list += &format!("{big},4,100,5,2,{a},{theta}\n"));
    };
    row(11.0, [44.0, 48.0], 1.0);
    row(4.0, [14.0, 40.0], 0.04);
    for i in 0..2500 {
        row(4.0 + 1e-4 * f64::from(i), [30.0, 40.0], 1.0 + 1e-4 * f64::from(i));
        if i == 1234 {
            row(10.0, [15.0, 20.0], 0.05);
        }
    }
    let desk = Desk::new(
        "[gauge]\n[model]\nshear = true\nmaterial = { neo-hookean = 3.2 }\n[tuples]\nfile = \"list.csv\"\n[output]\ntop = 2\nby = \"strain_max\"\n",
    );
    desk.write("list.csv", &list);
    let ran = desk.sweep(&["--model-error", "0.1", "--out", "out"]).exits(0);
    let run = desk.whole("out");
    let told = &run["model_error"];
    assert_eq!(told["fallbacks"], 1, "{told}");
    assert!(names(told, "needed").contains(&"shear".to_owned()), "{told}");
    assert!(names(told, "left_off").is_empty() && told["rows_kept"].is_null(), "{told}");
    assert!(ran.stdout.contains("leaves off nothing"), "{}", ran.stdout);
    desk.sweep(&["--out", "full"]).exits(0);
    assert_eq!(desk.read("out/designs.csv"), desk.read("full/designs.csv"));
}

struct Stops<'a>(&'a AtomicBool, bool);

impl Progress for Stops<'_> {
    fn at(&mut self, done: u64, _: u64) {
        self.0.store(self.1 && done > 0, Ordering::Relaxed);
    }
}

/// A sweep with effects left off, stopped at once if `stopping`; returns its `model_error`.
fn needed(text: &str, out: &Path, stopping: bool) -> Result<Value, Error> {
    let mut spec = spec::parse("spec.toml", text, Path::new("")).expect("a spec");
    let choice = CPU_F64.choice();
    let rows = choosing(&spec.study);
    let mut needed = Needed::new(&spec.study.setup, &rows, 1e-2).expect("a model");
    assert!(!needed.left().is_empty());
    spec.study.setup = needed.setup.clone();
    let plan = Plan::new(&spec.study, &choice).expect("a plan");
    let stop = AtomicBool::new(false);
    let target = Target { every: Duration::ZERO, ..Target::new(out, &stop) };
    let mut stops = Stops(&stop, stopping);
    let asked = (&target, &mut stops as &mut dyn Progress);
    let (report, _) = sweeps::run_needed(&mut spec, plan, &choice, asked, Some(&mut needed))?;
    Ok(report.model_error.expect("what is left off"))
}

/// Several chunks with taps near the strain limit: after each stop no tap of the full model is lost or counted twice. Kept rows are not continued.
#[test]
fn a_stopped_sweep_goes_on_with_what_is_left_off() {
    let text = "[whisker]\nD = { from = 8, to = 12, steps = 300 }\nd = { from = 4, to = 9, steps = 30 }\nL_a = 50\n\
                [gauge]\nx_ss = 5\nl = 2\nstrain_limit = 0.0021\n[tap]\na = { from = 24, to = 45, steps = 40 }\ntheta = 0.5\n\
                [model]\nsurface = true\nmaterial = { neo-hookean = 3.2 }\n[output]\ntuples = false\n";
    let folder = tempfile::tempdir().expect("a folder");
    let [whole, out, top] = ["whole", "out", "top"].map(|name| folder.path().join(name));
    let told = needed(text, &whole, false).expect("a sweep");
    let mut stops = 0;
    let again = loop {
        match needed(text, &out, true) {
            Ok(told) => break told,
            Err(e) => assert!(e.to_string().contains(" are kept in "), "{e}"),
        }
        stops += 1;
        assert!(stops < 100);
    };
    assert!(stops >= 2, "{stops}");
    let read = |folder: &Path| std::fs::read(folder.join("designs.csv")).expect("a table");
    assert!(read(&whole) == read(&out));
    assert!(told["taps_by_full_model"].as_u64().expect("taps") > 0, "{told}");
    assert_eq!(told["taps_by_full_model"], again["taps_by_full_model"]);

    let kept = format!("{text}top = 5\nby = \"K_sd\"\n");
    let error = needed(&kept, &top, true).expect_err("stopped").to_string();
    assert!(error.contains("nothing was written") && !top.exists(), "{error}");
    needed(&kept, &top, false).expect("a sweep");
}

#[test]
fn friction_and_a_pole_may_go_and_the_hub_stays() {
    let base = "[whisker]\nD = 10\nd = [4, 7]\nL_a = 50\nhub = 5\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [24, 36, 48]\ntheta = [1, 3]\n[model]\n";
    for (model, left) in [
        ("extension = true\ncontact = { coulomb = 1e-6 }\n", &["friction"][..]),
        ("extension = true\ncontact = { coulomb = 0.3 }\n", &[]),
        ("pole_radius = 1e-3\n", &["pole radius"]),
        ("geometry = \"linear\"\nshear = true\n", &[]),
        ("", &[]),
    ] {
        let text = format!("{base}{model}");
        let desk = Desk::new(&text);
        let ((full, _), (fewer, told)) =
            (swept(&desk, "", "full"), swept(&desk, "--model-error 1e-4", "fewer"));
        assert_eq!(names(&told, "left_off"), left, "{model}: {told}");
        assert!(!names(&told, "needed").contains(&"hub".to_owned()));
        assert!(apart(&text, &full, &fewer) <= 1e-4);
    }
}

#[test]
fn distances_told_by_the_model_are_told_by_what_is_left_of_it() {
    let text = soft("[0.3, 0.5]", "[estimate]\ntheory = \"exact\"\n");
    let desk = Desk::new(&text);
    let ((full, _), (fewer, told)) = (swept(&desk, "", "full"), swept(&desk, "--model-error 1e-2", "fewer"));
    assert!(!names(&told, "left_off").is_empty());
    assert!(apart(&text, &full, &fewer) <= 1e-2);
    for (a, b) in full.rows.iter().zip(&fewer.rows) {
        assert_eq!(number(a, "error_mm"), number(b, "error_mm"), "0 at the true root of either");
        let [x, y] = [a, b].map(|row| number(row, "sigma_mm").expect("noise"));
        assert!((x - y).abs() < 0.03 * x, "{x} {y}");
    }
}

#[test]
fn a_bound_is_a_value_in_force_and_a_bad_one_is_told_with_its_range() {
    let desk = Desk::new(&soft("0.5", "[run]\nmodel_error = 1e-3\n"));
    let in_force = |reply: &Value| {
        let list = reply["result"]["in_force"].as_array().expect("a list").iter();
        list.filter(|e| e["key"] == "run.model_error").cloned().collect::<Vec<_>>()
    };
    let plan = desk.sweep(&["--plan", "--json"]).exits(0).json();
    assert_eq!(in_force(&plan)[0]["value"], "0.001");
    assert_eq!(names(&plan["result"]["model_error"], "left_off"), ["rubber nonlinearity"]);
    assert!(plan["seconds"]["expected_full"].is_number(), "{plan}");
    let typed = desk.sweep(&["--plan", "--json", "--model-error", "1e-2"]).exits(0).json();
    assert_eq!((in_force(&typed).len(), &in_force(&typed)[0]["value"]), (1, &Value::from("0.01")));
    assert_eq!(names(&typed["result"]["model_error"], "left_off").len(), 3);

    desk.write("spec.toml", soft("0.5", ""));
    let plain = desk.sweep(&["--plan", "--json"]).exits(0).json();
    assert!(in_force(&plain).is_empty() && plain["result"]["model_error"].is_null());
    desk.sweep(&["--out", "plain"]).exits(0);
    assert!(desk.whole("plain").get("model_error").is_none());

    desk.sweep(&["--model-error", "1e-6", "--precision", "f64", "--out", "fine"]).exits(0);
}

const TAP: &str = "[whisker]\nD = 9\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 15e-6\n\
                   [tap]\na = { from = 21, to = 48, step = 9 }\ntheta = { min = 0.1, max = 2, samples = 2 }\n";

#[test]
fn the_best_tap_is_found_with_what_is_needed() {
    let text = TAP.replace("{ min = 0.1, max = 2, samples = 2 }", "{ from = 0.2, to = 2, steps = 2 }") + REAL;
    let desk = Desk::new(&text);
    let tap = |flags: &str, out: &str| {
        desk.ok(format!("tap spec.toml --out {out} {flags}"));
        desk.whole(out)
    };
    let (full, fewer) = (tap("", "full"), tap("--model-error 1e-2", "fewer"));
    let told = &fewer["model_error"];
    assert_eq!(names(told, "left_off"), ["rubber nonlinearity", "surface", "extension"], "{told}");
    assert!(told["rows_kept"]["taps"].as_u64().expect("taps") >= 4 * 4, "{told}");
    let [a, b] =
        [&full, &fewer].map(|run| run["result"]["optimum"]["total_rms_mm"].as_f64().expect("a total"));
    assert!((a - b).abs() < 0.05 * a && a != b, "{a} {b}");
    let (x, y) = (desk.table("full/tap.csv"), desk.table("fewer/tap.csv"));
    assert_eq!(x.statuses(), y.statuses());
    for (p, q) in x.values("strain_max").into_iter().zip(y.values("strain_max")) {
        assert!((p - q).abs() <= 1e-2 * p, "{p} {q}");
    }
    // The strain limit lies within the bound of the optimum: the drive at which it binds is that of the full model.
    desk.write("spec.toml", text.replace("l = 2\n", "l = 2\nstrain_limit = 0.004\n"));
    let (full, fewer) = (tap("", "full"), tap("--model-error 1e-2", "fewer"));
    assert_eq!(full["result"]["limited_by"], fewer["result"]["limited_by"]);
    assert_eq!(desk.table("full/tap.csv").statuses(), desk.table("fewer/tap.csv").statuses());
    let plan = desk.ok("tap spec.toml --model-error 1e-2 --plan");
    says(&plan.stdout, &["leaves off rubber nonlinearity (hooke in place of neo-hookean), surface"]);
}

const SEARCH: &str = "[whisker]\nL_a = 50\nD = 10\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n\
                      [tap]\na = [24, 36, 48]\n[model]\nextension = true\nsurface = true\nshear = true\nmaterial = { neo-hookean = 3.2 }\n\
                      [optimise]\nobjective = \"distance\"\nvariables = { d = [3, 9], theta = [0.2, 0.8] }\n";

#[test]
fn a_search_reports_the_figures_of_the_full_model() {
    let desk = Desk::new(SEARCH);
    let find = |flags: &str, out: &str| {
        desk.ok(format!("optimise spec.toml --backend cpu --out {out} {flags}"));
        desk.whole(out)
    };
    let (full, fewer) = (find("", "full"), find("--model-error 1e-2", "fewer"));
    let told = &fewer["model_error"];
    assert!(names(told, "left_off").contains(&"rubber nonlinearity".to_owned()), "{told}");
    assert!(told["rows_kept"]["error"].as_f64().expect("checked at the best") <= 1e-2, "{told}");
    let best = |run: &Value, key: &str| run["result"]["best"][key].as_f64().expect("a figure");
    let [a, b] = [&full, &fewer].map(|run| best(run, "total_rms_mm"));
    assert!((a - b).abs() <= 1e-4 * a, "{a} {b}");
    let plan = desk.ok("optimise spec.toml --model-error 1e-4 --plan");
    assert!(plan.stdout.contains("leaves off nothing: without "), "{}", plan.stdout);
    desk.ok("sweep fewer/best.toml --out again");
    let again = desk.table("again/designs.csv");
    let swept = number(&again.rows[0], "total_rms_mm").expect("a total");
    assert!((swept - b).abs() <= 1e-7 * b, "{swept} {b}");
}
