//! What a reader of a report sees first, and whether its figures can be read.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;

use serde_json::Value;

use crate::common::program::Desk;
use crate::common::sweeping::Row;
use crate::report::{PROTOTYPES, calibrated, data, figure, marks, number, points, searched, size};

const RIG: &str = "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 2e-5\n\
    [tap]\na = { from = 21, to = 48, step = 3 }\ntheta = { from = 0.5, to = 10, steps = 8 }\n";

/// Folders of results of every command that is drawn, and some of their figures.
fn results() -> (Desk, Vec<(String, &'static str)>) {
    let desk = Desk::new(PROTOTYPES);
    desk.sweep(&["--out", "swept"]).exits(0);
    desk.write("rig.toml", RIG);
    desk.ok("tap rig.toml --out tap");
    desk.ok("simulate rig.toml --noise 2e-5 --repeats 2 --outliers 0.05 --out data");
    desk.ok("calibrate data/measurements.csv --whisker rig.toml --out calibrated");
    desk.write("readings.csv", "theta_deg,strain\n4,0.02\n4,0.01\n4,0.9\n2,0.008\n");
    desk.ok("locate calibrated/calibration.toml readings.csv --zero 0 --out located");
    let mut poses = "base_x_mm,base_y_mm,heading_deg,theta_deg,strain\n".to_owned();
    (0..8).for_each(|i| writeln!(poses, "{},0,90,4,{}", 5 * i, 0.02 + 1e-5 * f64::from(i % 3)).unwrap());
    desk.write("poses.csv", poses);
    desk.ok("contour poses.csv --calibration calibrated/calibration.toml --zero 0 --out contour");
    desk.ok("verify rig.toml --samples 20 --backend cpu --out verified");
    desk.ok("shape rig.toml --out shape --nodes 21");
    let search = "[optimise]\nobjective = \"pareto\"\nvariables = { d = [4, 9], x_ss = [3, 10] }\nbudget = { evaluations = 3000 }\n";
    desk.write("search.toml", RIG.replace("{ from = 0.5, to = 10, steps = 8 }", "[2, 4]") + search);
    desk.ok("optimise search.toml --backend cpu --out searched");
    let mut all: Vec<(String, &str)> = [
        ("swept", "sd"),
        ("tap", "budget sd strain"),
        ("calibrated", "curves residuals held_out coverage sd"),
        ("located", "located"),
        ("contour", "contour"),
        ("verified", "errors"),
        ("shape", "whisker strain_along"),
        ("searched", "front parallel convergence sensitivity split"),
    ]
    .map(|(folder, figures)| (folder.to_owned(), figures))
    .into();
    for kept in ["bench", "search/design", "search/pareto"] {
        all.push((format!("{}/results/2026-11-21-{kept}", env!("CARGO_MANIFEST_DIR")), ""));
    }
    (desk, all)
}

/// Numbers of `answer`, as they are written.
fn told(answer: &str) -> Vec<f64> {
    let words = answer.split(|c: char| c.is_whitespace() || "();:,°".contains(c));
    words.filter_map(|w| w.trim_end_matches('.').replace('−', "-").parse().ok()).collect()
}

#[track_caller]
fn tells(answer: &str, value: f64) {
    let near = told(answer).into_iter().any(|x| (x - value).abs() <= 0.006 * value.abs());
    assert!(near, "{value} is not in: {answer}");
}

#[test]
fn every_report_begins_with_its_answer_and_has_its_figures() {
    let (desk, folders) = results();
    let mut answers = BTreeMap::new();
    for (folder, figures) in &folders {
        let out = format!("{}/report", folder.rsplit('/').next().unwrap());
        let formats = if figures.is_empty() { "--figures svg" } else { "" };
        let ran = desk.ok(format!("report {folder} --out {out} {formats}"));
        let page = data(&desk, &format!("{out}/report.html"));
        for name in figures.split_whitespace() {
            figure(&page, name);
            assert!(
                size(&std::fs::read(desk.path(&format!("{out}/{name}.png"))).unwrap())[1] > 200,
                "{name}"
            );
        }
        let answer = page["answer"].as_str().unwrap().to_owned();
        assert_eq!(ran.stdout.lines().next(), Some(answer.as_str()));
        assert_eq!(desk.whole(&out)["answer"], page["answer"]);
        // One sentence with a number in it and no word that only a program knows.
        let body = answer.strip_suffix('.').unwrap_or_else(|| panic!("no sentence: {answer}"));
        assert!(!body.contains(". ") && !body.chars().next().is_some_and(char::is_lowercase), "{answer}");
        assert!(!told(&answer).is_empty() && !body.contains("NaN") && !body.contains('–'), "{answer}");
        assert!(["_rms", "_mm", "_deg", "null", "K_sd"].iter().all(|word| !body.contains(word)), "{answer}");
        looked_at(&page, folder);
        answers.insert(folder.rsplit('/').next().unwrap().to_owned(), answer);
    }
    calibrated(&desk);
    searched(&desk);
    desk.refuses("report data", &["simulate", "calibrate"]);
    let least = |file: &str, keep: &dyn Fn(&Row) -> bool, by: &str| {
        let kept = desk.table(file).rows.into_iter().filter(|r| keep(r) && number(r, by).is_finite());
        kept.min_by(|p, q| number(p, by).total_cmp(&number(q, by))).unwrap()
    };
    let best = least("swept/designs.csv", &|r| r["status"] == "ok", "total_rms_mm");
    for column in ["d_mm", "theta_deg", "total_rms_mm"] {
        tells(&answers["swept"], number(&best, column));
    }
    tells(&answers["swept"], 100.0 * number(&best, "strain_max"));
    let result = |folder: &str| desk.whole(folder)["result"].clone();
    let optimum = result("tap")["optimum"].clone();
    tells(&answers["tap"], optimum["theta_deg"].as_f64().unwrap());
    tells(&answers["tap"], optimum["total_rms_mm"].as_f64().unwrap());
    let calibration = result("calibrated");
    let name = calibration["estimator"].as_str().unwrap();
    assert!(answers["calibrated"].contains(name));
    let error = &calibration["sides"][0]["estimators"][name]["held_out_rms_mm"];
    tells(&answers["calibrated"], error.as_f64().unwrap());
    let located = desk.table("located/located.csv").rows;
    let answered = located.iter().map(|r| number(r, "distance_mm")).filter(|x| x.is_finite());
    tells(&answers["located"], answered.fold(f64::NEG_INFINITY, f64::max));
    let worst = desk.table("verified/verify.csv").rows.len();
    tells(&answers["verified"], worst as f64);
    assert!(answers["verified"].contains("keeps its bounds"), "{}", answers["verified"]);
    let forces = desk.table("shape/contacts.csv").rows.into_iter().map(|r| number(&r, "normal_force_N"));
    tells(&answers["shape"], forces.fold(0.0, f64::max));
    assert!(answers["contour"].contains("8 points"), "{}", answers["contour"]);
    assert!(answers["pareto"].contains("front") && answers["design"].contains("x_ss = 3 mm"), "{answers:?}");
}

/// Names of a panel's lines and points differ in marker, so that grey paper tells them apart; and each name has one.
fn looked_at(page: &Value, folder: &str) {
    for f in page["figures"].as_array().unwrap() {
        for panel in f["panels"].as_array().unwrap() {
            let mut looks: BTreeMap<&str, (u64, &str)> = BTreeMap::new();
            for m in marks(panel) {
                let (Some(name), Some(marker)) = (m["name"].as_str(), m["marker"].as_str()) else { continue };
                let mine = (m["colour"].as_u64().unwrap(), marker);
                let before = looks.insert(name, mine).unwrap_or(mine);
                assert_eq!(before, mine, "{folder}, {}: {name}", f["name"]);
            }
            let different: HashSet<_> = looks.values().map(|(_, marker)| marker).collect();
            let most = looks.len().min(8);
            assert!(different.len() >= most, "{folder}, {}: {looks:?}", f["name"]);
            let pairs: HashSet<_> = looks.values().collect();
            assert_eq!(pairs.len(), looks.len(), "{folder}, {}: {looks:?}", f["name"]);
        }
    }
}

#[test]
fn series_beside_each_other_have_their_own_colours_and_markers() {
    // More whiskers than are drawn.
    let desk = Desk::new(&PROTOTYPES.replace("d = [4, 7, 10]", "d = { from = 3, to = 10, steps = 8 }"));
    desk.sweep(&["--out", "out"]).exits(0);
    desk.ok("report out --figures svg");
    let page = data(&desk, "out/report/report.html");
    let of = |part: &str| -> Vec<String> {
        marks(&figure(&page, "sd")["panels"][0]).map(|m| m[part].to_string()).collect()
    };
    for part in ["colour", "marker", "name"] {
        let all = of(part);
        assert_eq!(all.iter().collect::<HashSet<_>>().len(), all.len(), "{part}: {all:?}");
        assert!(all.len() >= 5);
    }
    let [light, dark] = ["light", "dark"].map(|theme| page["colours"][theme].as_array().unwrap());
    assert_eq!((light.len(), dark.len()), (8, 8));
    assert!(light.iter().zip(dark).all(|(a, b)| a != b), "{light:?} {dark:?}");
}

#[test]
fn outliers_do_not_flatten_the_residuals() {
    let desk = Desk::new(RIG);
    desk.ok("simulate spec.toml --noise 2e-5 --repeats 3 --out data");
    // Three readings are grossly wrong.
    let mut lines: Vec<String> = desk.read("data/measurements.csv").lines().map(str::to_owned).collect();
    let strain = lines[0].split(',').position(|name| name == "strain").expect("a strain");
    for at in [17, 71, 140] {
        let mut fields: Vec<String> = lines[at].split(',').map(str::to_owned).collect();
        fields[strain] = format!("{}", 5.0 * fields[strain].parse::<f64>().unwrap() + 0.1);
        lines[at] = fields.join(",");
    }
    desk.write("wild.csv", lines.join("\n") + "\n");
    desk.ok("calibrate wild.csv --whisker spec.toml --out out");
    desk.ok("report out --figures svg");
    let page = data(&desk, "out/report/report.html");
    let panel = &figure(&page, "residuals")["panels"][0];
    let [low, high] = [0, 1].map(|i| panel["y"]["ends"][i].as_f64().expect("a cut axis"));
    let residuals: Vec<f64> =
        marks(panel).filter(|m| m["kind"] == "points").flat_map(points).map(|p| p.1).collect();
    let beyond = residuals.iter().filter(|y| **y < low || **y > high).count();
    assert!(
        (3..residuals.len() / 10).contains(&beyond),
        "{beyond} of {} beyond {low} … {high}",
        residuals.len()
    );
    // The bulk takes most of the axis.
    let mut within: Vec<f64> = residuals.iter().copied().filter(|y| (low..=high).contains(y)).collect();
    within.sort_by(f64::total_cmp);
    let n = within.len();
    assert!(within[n * 9 / 10] - within[n / 10] > 0.2 * (high - low), "{low} … {high}");
    let said = panel["beyond"].as_str().unwrap();
    assert!(said.contains(&format!("{beyond} taps")), "{said}");
    // Long words of a key have more lines on paper.
    let words = said.split(',').next().unwrap();
    assert!(desk.read("out/report/residuals.svg").contains(words), "the key of the paper says {words}");
    // A sweep with clean data has no cut axis.
    desk.ok("calibrate data/measurements.csv --whisker spec.toml --out clean");
    desk.ok("report clean --figures svg");
    let page = data(&desk, "clean/report/report.html");
    assert_eq!(figure(&page, "residuals")["panels"][0]["beyond"], "");
}

#[test]
fn a_map_of_three_values_has_three_bands() {
    let spec =
        PROTOTYPES.replace("x_ss = 5", "x_ss = [3, 5, 9]").replace("[0.5, 1, 2, 4, 7, 10]", "[2, 3.5, 8]");
    let desk = Desk::new(&spec);
    desk.sweep(&["--out", "out"]).exits(0);
    desk.ok("report out --figures svg");
    let page = data(&desk, "out/report/report.html");
    let map = &figure(&page, "map_total_rms_mm")["panels"][0];
    let words = |axis: &str| {
        map[axis]["words"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!((words("x"), words("y")), (vec!["4", "7", "10"], vec!["3", "5", "9"]));
    let cells = &map["marks"][0];
    assert_eq!((&cells["x"], &cells["y"]), (&serde_json::json!([-0.5, 0.5, 1.5, 2.5]), &cells["x"]));
    let k = &figure(&page, "K")["panels"][0];
    assert_eq!(
        (k["x"]["words"].as_array().unwrap().len(), k["y"]["words"].as_array().unwrap().len()),
        (0, 3)
    );
    // On paper there is free space between bands, and each is named where it lies.
    let svg = desk.read("out/report/map_total_rms_mm.svg");
    assert!([">4<", ">7<", ">10<", ">9<"].iter().all(|word| svg.contains(word)), "{svg}");
}
