//! `vibrissa report`: limits, names and groups of what is drawn.

use std::fmt::Write;

use serde_json::Value;

use crate::common::program::{Desk, SPEC, says};
use crate::report::{PROTOTYPES, data, figure, marks, number, points, same};

fn drawn(spec: &str) -> (Desk, Value) {
    let desk = Desk::new(spec);
    desk.sweep(&["--out", "out"]).exits(0);
    desk.ok("report out --figures svg");
    let data = data(&desk, "out/report/report.html");
    (desk, data)
}

#[test]
fn the_ring_keeps_the_limits() {
    let limited = |limit: &str| PROTOTYPES.replace("l = 2", &format!("l = 2\nstrain_limit = {limit}"));
    let (desk, page) = drawn(&limited("0.01"));
    let designs = desk.table("out/designs.csv").rows;
    for (i, d) in [4.0, 7.0, 10.0].into_iter().enumerate() {
        let total = |word: &str| -> Vec<(f64, f64)> {
            let of = designs
                .iter()
                .filter(|r| number(r, "d_tip_mm") == d && (r["status"] == "ok") == (word == "ok"));
            of.map(|r| (number(r, "theta_deg"), number(r, "total_rms_mm"))).collect()
        };
        let panel = &figure(&page, "budget")["panels"][i];
        let named = |name: &str| points(marks(panel).find(|m| m["name"] == name).unwrap());
        let (ok, broken) = (total("ok"), total("strain_limit"));
        let least = |all: &[(f64, f64)]| *all.iter().min_by(|p, q| p.1.total_cmp(&q.1)).unwrap();
        assert!(least(&broken).1 < least(&ok).1, "the limit binds");
        same(&named("least total"), &[least(&ok)], "ring");
        same(&named("a limit is broken"), &broken, "crosses");
    }
    let (_, page) = drawn(&limited("1e-4"));
    let budget = figure(&page, "budget");
    assert!(marks(&budget["panels"][0]).all(|m| m["name"] != "least total" && m["kind"] != "note"));
    says(budget["caption"].as_str().unwrap(), &["3 of 3 whiskers shown keep"]);
}

#[test]
fn two_distances_for_a_reading_break_no_limit() {
    let desk = Desk::new(PROTOTYPES);
    desk.sweep(&["--out", "out"]).exits(0);
    desk.write("out/designs.csv", desk.read("out/designs.csv").replace(",ok\n", ",ambiguous\n"));
    desk.ok("report out --force --figures svg");
    let page = data(&desk, "out/report/report.html");
    let designs = desk.table("out/designs.csv").rows;
    let others = designs.iter().filter(|r| r["status"] != "ambiguous").count();
    let front = &figure(&page, "front")["panels"][0];
    let broken: usize =
        marks(front).filter(|m| m["name"] == "a limit is broken").map(|m| points(m).len()).sum();
    assert!(designs.len() > others && broken == others, "{broken} {others}");
    assert!(marks(front).any(|m| m["name"] == "front"));
}

#[test]
fn whiskers_are_named_by_all_that_varies() {
    let spec =
        PROTOTYPES.replace("D = 10", "D = [9, 10, 10.0000000001]").replace("x_ss = 5", "x_ss = [3, 5, 7]");
    let (_, page) = drawn(&spec);
    for name in ["strain_drive", "K", "budget"] {
        let panels = figure(&page, name)["panels"].as_array().unwrap();
        let titles: Vec<&str> = panels.iter().map(|p| p["title"].as_str().unwrap()).collect();
        for (i, title) in titles.iter().enumerate() {
            assert!(["D = ", ", d = ", ", x_ss = "].iter().all(|part| title.contains(part)), "{title}");
            assert!(!titles[..i].contains(title), "{titles:?}");
        }
    }
}

/// Readings whose distances and drives scatter by some hundredths around round values.
fn jittered() -> String {
    let mut text = "a_mm,delta_mm,reading\n".to_owned();
    for (i, a) in [110.0, 120.0, 130.0, 140.0, 150.0].into_iter().enumerate() {
        writeln!(text, "{a},0,0").unwrap();
        for (k, drive) in [2.0, 4.0, 6.0].into_iter().enumerate() {
            let (a, drive) = (a + 0.02 * k as f64, drive + 0.03 * i as f64);
            for scatter in [-20.0, 15.0, 5.0] {
                writeln!(text, "{a:.2},{drive:.2},{:.1}", 3e7 * drive / (a * a) + scatter).unwrap();
            }
        }
    }
    text
}

#[test]
fn drives_that_are_meant_to_be_one_are_one_curve() {
    let desk = Desk::new(SPEC);
    desk.write("data.csv", jittered());
    desk.write(
        "bare.csv",
        "a_mm,reading\n100,900\n100,904\n110,800\n110,806\n120,690\n120,697\n130,600\n130,604\n",
    );
    let curves = |file: &str, out: &str| {
        desk.ok(format!("calibrate {file} --out {out}"));
        desk.ok(format!("report {out} --figures svg"));
        figure(&data(&desk, &format!("{out}/report/report.html")), "curves")["panels"][0].clone()
    };
    let panel = curves("data.csv", "calibrated");
    let mut names: Vec<&str> = marks(&panel).map(|m| m["name"].as_str().unwrap()).collect();
    names.dedup();
    assert_eq!(names, ["δ ≈ 2.06 mm", "δ ≈ 4.06 mm", "δ ≈ 6.06 mm"]);
    let cells = desk.table("calibrated/K_table.csv").rows;
    for (k, name) in names.iter().enumerate() {
        let named: Vec<&Value> = marks(&panel).filter(|m| m["name"] == *name).collect();
        assert_eq!((named.len(), named[0]["kind"].as_str()), (2, Some("line")));
        assert!(points(named[0]).len() >= 5, "the fitted line goes through all distances");
        let mut told: Vec<(f64, f64)> = cells
            .iter()
            .filter(|r| (number(r, "delta_mm") - (2.06 + 2.0 * k as f64)).abs() < 0.5)
            .map(|r| (number(r, "a_mm"), number(r, "reading")))
            .collect();
        told.sort_by(|p, q| p.0.total_cmp(&q.0));
        assert_eq!(told.len(), 5);
        same(&points(named[1]), &told, name);
    }
    let panel = curves("bare.csv", "unrecorded");
    let kinds: Vec<_> =
        marks(&panel).map(|m| (m["kind"].as_str().unwrap(), m["name"].as_str().unwrap())).collect();
    assert_eq!(kinds, ["line", "points"].map(|k| (k, "one drive (not recorded)")));
    assert_eq!(points(marks(&panel).next().unwrap()).len(), 4);
}
