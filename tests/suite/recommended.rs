//! The row that a sweep recommends: within the strain limit, in the same words in its report, also after a merge.

use serde_json::Value;

use crate::common::program::{Desk, Ran, SPEC};
use crate::common::sweeping::{Row, number};

/// The design study of the documentation, with distances by the model itself.
const EXACT: &str = "[whisker]\nD = 10.0\nd = [2, 4, 6, 8, 10]\nL_a = 80.0\n[gauge]\nx_ss = [5, 10]\nl = 2.0\nnoise_strain = 15e-6\n\
                     [tap]\na = { from = 25, to = 70, steps = 10 }\ntheta = { from = 1, to = 10, step = 1 }\n\
                     [model]\nshear = true\nextension = true\nsurface = true\nmaterial = { neo-hookean = 3.2 }\n\
                     [estimate]\ntheory = \"exact\"\n";

fn with_limit(limit: f64) -> String {
    EXACT.replace("[tap]", &format!("strain_limit = {limit}\n[tap]"))
}

fn first_line(ran: &Ran) -> String {
    ran.stdout.lines().next().unwrap_or_default().to_owned()
}

/// First lines of the sweep of `text` and of its report, and the rows that it lists.
fn told(desk: &Desk, text: &str) -> (String, String, Vec<Value>) {
    desk.write("spec.toml", text);
    let sweep = first_line(&desk.sweep(&["--out", "out"]).exits(0));
    let report = first_line(&desk.ok("report out"));
    let json = desk.sweep(&["--out", "out", "--json"]).exits(0).json();
    (sweep, report, json["result"]["best"].as_array().expect("rows").clone())
}

/// d, x_ss and θ of the row with the smallest total within the strain limit, searched in the table.
fn least(desk: &Desk) -> [f64; 3] {
    let rows = desk.table("out/designs.csv").rows;
    let total = |row: &&Row| number(row, "total_rms_mm").expect("a total");
    let complete = rows.iter().filter(|row| !row["total_rms_mm"].is_empty());
    let within = complete.filter(|row| !row["status"].contains("strain_limit"));
    let best = within.min_by(|a, b| total(a).total_cmp(&total(b))).expect("a row");
    ["d_tip_mm", "x_ss_mm", "theta_deg"].map(|name| number(best, name).expect("a number"))
}

#[test]
fn sweep_and_report_recommend_the_best_row_within_the_strain_limit() {
    let desk = Desk::new("");
    let mut recommended = Vec::new();
    for limit in [0.05, 0.02] {
        let (sweep, report, best) = told(&desk, &with_limit(limit));
        assert_eq!(sweep, report);
        assert!(sweep.contains("tells distance best of those within the strain limit"), "{sweep}");
        assert!(best[0]["strain_max"].as_f64().expect("a strain") <= limit, "{}", best[0]);
        let by_hand = least(&desk);
        let named =
            ["d_tip_mm", "x_ss_mm", "theta_deg"].map(|name| best[0][name].as_f64().expect("a number"));
        assert_eq!(named, by_hand);
        assert!(sweep.contains(&format!("x_ss = {} mm, tapped by θ = {}°", named[1], named[2])), "{sweep}");
        recommended.push(named);
        let beyond: Vec<bool> =
            best.iter().map(|row| row["status"].as_str().expect("words").contains("strain_limit")).collect();
        assert!(beyond.is_sorted(), "{beyond:?}");
        let mut whiskers: Vec<String> =
            best.iter().map(|row| format!("{} {}", row["d_tip_mm"], row["x_ss_mm"])).collect();
        whiskers.sort();
        whiskers.dedup();
        assert_eq!(whiskers.len(), 8, "{best:?}");
    }
    assert_ne!(recommended[0], recommended[1]);
}

#[test]
fn where_no_row_keeps_the_limit_both_say_so() {
    let desk = Desk::new("");
    let (sweep, report, _) = told(&desk, &with_limit(1e-5));
    assert_eq!(sweep, report);
    assert!(sweep.contains("that is beyond its strain limit, and so is every other row"), "{sweep}");
    // The sweep cannot know rows that `top` drops.
    let (sweep, report, best) =
        told(&desk, &(EXACT.to_owned() + "[output]\ntop = 8\nby = \"total_rms_mm\"\n"));
    assert_eq!(sweep, report);
    assert!(sweep.contains("so are all 8 rows that `top` keeps"), "{sweep}");
    let totals: Vec<f64> = best.iter().map(|row| row["total_rms_mm"].as_f64().expect("a total")).collect();
    assert!(totals.is_sorted() && totals.len() == 8, "{totals:?}");
    // Each design keeps its best row, even beyond the limit: another row of it may be the best within.
    let per_design =
        format!("{}[output]\ntop = 8\nper = \"design\"\nby = \"total_rms_mm\"\n", with_limit(0.05));
    let (sweep, report, _) = told(&desk, &per_design);
    assert_eq!(sweep, report);
    assert!(sweep.contains("that `top` keeps"), "{sweep}");
}

#[test]
fn sweep_and_report_rank_by_the_same_column() {
    let quiet = SPEC.replace("noise_strain = 1e-6\n", "");
    for (text, words) in [
        (quiet, "has the steadiest K"),
        (format!("{SPEC}[output]\nby = \"force_max_N\"\n"), "has the least force_max_N"),
    ] {
        let (sweep, report, _) = told(&Desk::new(""), &text);
        assert_eq!(sweep, report);
        assert!(sweep.contains(words), "{sweep}");
    }
}

#[test]
fn merged_parts_recommend_what_the_whole_does() {
    let desk = Desk::new("");
    let (sweep, ..) = told(&desk, &with_limit(0.02));
    for part in ["1/3", "2/3", "3/3"] {
        desk.sweep(&["--out", "parts", "--shard", part]).exits(0);
    }
    assert_eq!(first_line(&desk.ok("merge parts --out joined")), sweep);
    assert_eq!(first_line(&desk.ok("report joined")), sweep);
}
