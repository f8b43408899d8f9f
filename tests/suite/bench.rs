//! `vibrissa bench --quick`: its files, its numbers, its figures. Times are never judged.

use crate::common::program::{Desk, SPEC, says};
use crate::common::sweeping::{Row, Table, number};
use serde_json::Value;

const FIGURES: [&str; 2] = ["configurations", "work_precision"];

#[track_caller]
fn positive(table: &Table, columns: &[&str]) {
    for row in &table.rows {
        for column in columns {
            assert!(number(row, column).is_some_and(|x| x > 0.0), "{column}: {row:?}");
        }
    }
}

fn is(row: &Row, pairs: &[(&str, &str)]) -> bool {
    pairs.iter().all(|(column, value)| row[*column] == *value)
}

#[test]
fn a_quick_run_measures_everything_on_the_cpu() {
    let desk = Desk::new(SPEC);
    let reply = desk.json("bench --quick --backend cpu --out out");
    assert_eq!((&reply["ok"], &reply["command"]), (&true.into(), &"bench".into()));

    let mut files: Vec<String> =
        FIGURES.iter().flat_map(|f| [format!("{f}.svg"), format!("{f}.png")]).collect();
    files.extend(["work_precision.csv", "run.json"].map(str::to_owned));
    files.sort();
    assert_eq!(desk.names("out"), files);

    let work = desk.table("out/work_precision.csv");
    let errors = ["strain_error_median", "strain_error_p99", "strain_error_max"];
    positive(&work, &[&["taps", "ns_per_tap", "ns_per_tap_median"][..], &errors].concat());
    let ladder = |c, p| {
        let of = [("configuration", c), ("precision", p), ("kernel", "exact")];
        work.rows.iter().filter(|r| is(r, &of)).count()
    };
    for configuration in ["hooke", "neo"] {
        assert_eq!((ladder(configuration, "f32"), ladder(configuration, "f64")), (2, 1));
    }
    assert_eq!(reply["counts"]["points"], work.rows.len());
    for row in &work.rows {
        let [median, p99, worst] = errors.map(|column| number(row, column).unwrap());
        assert!(median <= p99 && p99 <= worst, "{row:?}");
        let best = number(row, "ns_per_tap").unwrap();
        assert!(best <= number(row, "ns_per_tap_median").unwrap());
        let bound = number(row, "tolerance").unwrap_or(1e-10);
        assert!(worst <= bound, "worse than {bound:e}: {row:?}");
        assert_eq!(number(row, "failed"), Some(0.0), "{row:?}");
    }
    // How much repeats differ is told beside every time, and summed up.
    let spreads: Vec<f64> = work.rows.iter().filter_map(|r| number(r, "spread")).collect();
    let once = work.rows.iter().filter(|r| r["backend"] == "reference").count();
    let rows = work.rows.len();
    assert!(
        spreads.iter().all(|s| *s >= 0.0) && spreads.len() == rows - once && once == 2,
        "{rows} {spreads:?}"
    );
    let largest = spreads.iter().copied().fold(0.0, f64::max);
    assert!((reply["result"]["spread"].as_f64().unwrap() - largest).abs() < 1e-9);

    for figure in FIGURES {
        let svg = desk.read(&format!("out/{figure}.svg"));
        assert!(svg.contains("CPU f32") && svg.contains("CPU f64"), "{figure} has a legend");
    }
    assert!(desk.read("out/work_precision.svg").contains("time per tap (ns)"));

    let run = desk.whole("out");
    assert_eq!((&run["spread"], &run["stopped"]), (&reply["result"]["spread"], &Value::Null));
    assert_eq!(run["backends"].as_array().unwrap().len(), 4);
}

#[test]
fn a_gpu_is_measured_like_the_cpu() {
    let desk = Desk::new(SPEC);
    let ran = desk.ok("bench --quick --backend gpu --precision f32 --tolerance 1e-5 --out out --quiet");
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    let work = desk.table("out/work_precision.csv");
    let exact: Vec<&Row> =
        work.rows.iter().filter(|r| is(r, &[("backend", "gpu"), ("kernel", "exact")])).collect();
    assert_eq!(exact.len(), 2);
    assert!(exact.iter().all(|r| number(r, "strain_error_max").unwrap() <= 1e-5 && !r["adapter"].is_empty()));
}

#[test]
fn a_plan_writes_nothing() {
    let desk = Desk::new(SPEC);
    says(&desk.ok("bench --plan --backend cpu").stdout, &["nothing was run", "mooney-coulomb"]);
    let json = desk.json("bench --plan --quick --backend cpu");
    assert_eq!(json["result"]["configurations"], serde_json::json!(["hooke", "neo"]));
    assert!(json["seconds"]["expected"].as_f64().unwrap() > 0.0);
    let backends = desk.json("bench --plan --quick")["backend"].to_string();
    assert!(!backends.contains("llvmpipe"), "{backends}");
    assert!(desk.names("results").is_empty());
}
