//! The first things a reader of a report sees, and whether figures are legible.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;

use serde_json::Value;

use crate::common::program::Desk;
use crate::common::sweeping::Row;
use crate::report::{PROTOTYPES, calibrated, data, figure, marks, number, searched, size};

const RIG: &str = "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 2e-5\n\
    [tap]\na = { from = 21, to = 48, step = 3 }\ntheta = { from = 0.5, to = 10, steps = 8 }\n";

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
        all.push((format!("{}/results/2026-11-21-{kept}", crate::common::ROOT), ""));
    }
    (desk, all)
}

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
        // One sentence that contains a number and no identifiers.
        let body = answer.strip_suffix('.').unwrap_or_else(|| panic!("no sentence: {answer}"));
        assert!(!body.contains(". ") && !body.chars().next().is_some_and(char::is_lowercase), "{answer}");
        assert!(!told(&answer).is_empty() && !body.contains("NaN") && !body.contains('–'), "{answer}");
        assert!(["_rms", "_mm", "_deg", "null", "K_sd"].iter().all(|word| !body.contains(word)), "{answer}");
        looked_at(&page, folder);
        answers.insert(folder.rsplit('/').next().unwrap().to_owned(), answer);
    }
    calibrated(&desk);
    searched(&desk);
    // Outliers beyond the axis are counted on paper too.
    let page = data(&desk, "calibrated/report/report.html");
    let beyond = figure(&page, "residuals")["panels"][0]["beyond"].as_str().unwrap().to_owned();
    let words = beyond.split(',').next().unwrap();
    assert!(
        beyond.contains("taps") && desk.read("calibrated/report/residuals.svg").contains(words),
        "{beyond}"
    );
    desk.refuses("report data", &["simulate", "calibrate"]);
    let least = |file: &str, keep: &dyn Fn(&Row) -> bool, by: &str| {
        let kept = desk.table(file).rows.into_iter().filter(|r| keep(r) && number(r, by).is_finite());
        kept.min_by(|p, q| number(p, by).total_cmp(&number(q, by))).unwrap()
    };
    let best = least("swept/designs.csv", &|r| r["status"] == "ok", "total_rms_mm");
    for column in ["d_tip_mm", "theta_deg", "total_rms_mm"] {
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

/// Lines and points of a panel differ in marker, for greyscale print; each name has one marker.
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
