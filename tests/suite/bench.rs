//! `vibrissa bench --quick`: its files, its numbers, its figures. Times are never judged.

use std::collections::HashSet;

use crate::common::program::{Desk, SPEC};
use crate::common::sweeping::{Row, Table, number};
use serde_json::Value;

const TABLES: [&str; 3] = ["scaling.csv", "threads.csv", "work_precision.csv"];
const FIGURES: [&str; 4] = ["configurations", "scaling", "threads", "work_precision"];

/// A quick run on the CPU, and its reply.
fn bench(desk: &Desk, more: &[&str]) -> Value {
    let base = ["bench", "--quick", "--backend", "cpu", "--out", "out", "--json"];
    desk.run(&[&base, more].concat()).exits(0).json()
}

fn table(desk: &Desk, name: &str) -> Table {
    Table::read(&desk.path("out").join(name))
}

/// Every number of a column is there, finite and above zero.
#[track_caller]
fn positive(table: &Table, columns: &[&str]) {
    for row in &table.rows {
        for column in columns {
            assert!(number(row, column).is_some_and(|x| x > 0.0), "{column}: {row:?}");
        }
    }
}

/// Width and height of a PNG whose pixels are not all the same, judged by their size when packed.
fn picture(bytes: &[u8]) -> (u32, u32) {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!(&bytes[bytes.len() - 8..bytes.len() - 4], b"IEND");
    assert!(bytes.len() > 10_000, "{} bytes", bytes.len());
    let word = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("4 bytes"));
    (word(16), word(20))
}

fn is(row: &Row, pairs: &[(&str, &str)]) -> bool {
    pairs.iter().all(|(column, value)| row[*column] == *value)
}

#[test]
fn a_quick_run_measures_everything_on_the_cpu() {
    let desk = Desk::new(SPEC);
    let reply = bench(&desk, &[]);
    assert_eq!((&reply["ok"], &reply["command"]), (&true.into(), &"bench".into()));

    let mut files: Vec<String> =
        FIGURES.iter().flat_map(|f| [format!("{f}.svg"), format!("{f}.png")]).collect();
    files.extend(TABLES.map(str::to_owned));
    files.push("run.json".into());
    files.sort();
    assert_eq!(desk.names("out"), files);
    let listed: HashSet<String> =
        reply["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().to_owned()).collect();
    assert_eq!(listed, files.iter().map(|f| format!("out/{f}")).collect());

    // Two configurations and the linear theory, in two precisions.
    let work = table(&desk, "work_precision.csv");
    positive(
        &work,
        &[
            "taps",
            "ns_per_tap",
            "ns_per_tap_median",
            "strain_error_median",
            "strain_error_p99",
            "strain_error_max",
        ],
    );
    let ladder = |c, p| {
        work.rows
            .iter()
            .filter(|r| is(r, &[("configuration", c), ("precision", p), ("kernel", "exact")]))
            .count()
    };
    for configuration in ["hooke", "neo"] {
        assert_eq!((ladder(configuration, "f32"), ladder(configuration, "f64")), (2, 1));
    }
    assert_eq!(reply["counts"]["points"], work.rows.len());
    for row in &work.rows {
        let [median, p99, worst] =
            ["median", "p99", "max"].map(|q| number(row, &format!("strain_error_{q}")).unwrap());
        assert!(median <= p99 && p99 <= worst, "{row:?}");
        let best = number(row, "ns_per_tap").unwrap();
        assert!(best <= number(row, "ns_per_tap_median").unwrap());
        if let Some(kernel) = number(row, "kernel_ns_per_tap") {
            assert!(kernel > 0.0 && kernel <= best * 1.000_001, "a part is not more than the whole: {row:?}");
        }
        let bound = match (row["kernel"].as_str(), row["configuration"].as_str(), row["precision"].as_str()) {
            ("exact", ..) => number(row, "tolerance").unwrap(),
            ("reference", ..) => 1e-10,
            // What leaving out the rod costs: percents, at these angles.
            ("linear", ..) => 0.2,
            _ => continue,
        };
        assert!(worst <= bound, "worse than {bound:e}: {row:?}");
        assert_eq!(number(row, "failed"), Some(0.0), "{row:?}");
        if row["kernel"] == "linear" {
            assert!(worst > 1e-3, "the linear theory is no exact rod: {row:?}");
        }
    }
    // More nodes, less error.
    let nodes: Vec<(f64, f64)> = work
        .rows
        .iter()
        .filter(|r| is(r, &[("configuration", "hooke"), ("precision", "f64"), ("kernel", "exact-nodes")]))
        .map(|r| (number(r, "nodes").unwrap(), number(r, "strain_error_p99").unwrap()))
        .collect();
    assert_eq!(nodes.iter().map(|n| n.0).collect::<Vec<_>>(), [10.0, 16.0, 24.0]);
    assert!(nodes[0].1 > 10.0 * nodes[1].1 && nodes[1].1 <= 1e-10, "{nodes:?}");

    let scaling = table(&desk, "scaling.csv");
    positive(&scaling, &["taps", "solved", "seconds", "taps_per_second", "ns_per_tap"]);
    assert!(scaling.rows.iter().all(|r| r["failed"] == "0"), "a sweep that fails is no speed");
    let sizes: Vec<f64> = scaling
        .rows
        .iter()
        .filter(|r| is(r, &[("shape", "independent"), ("precision", "f32")]))
        .map(|r| number(r, "taps").unwrap())
        .collect();
    assert_eq!(sizes, [1e3, 1e4, 1e5]);

    let threads = table(&desk, "threads.csv");
    positive(&threads, &["threads", "ns_per_tap", "speedup"]);
    assert!(threads.rows.iter().filter(|r| r["threads"] == "1").all(|r| r["speedup"] == "1"));

    // How much repeats differ is told beside every time, and summed up.
    let spreads: Vec<f64> = [&work, &scaling, &threads]
        .into_iter()
        .flat_map(|t| &t.rows)
        .filter_map(|r| number(r, "spread"))
        .collect();
    // The reference is timed once for each configuration.
    let once = work.rows.iter().filter(|r| r["backend"] == "reference").count();
    let rows: usize = [&work, &scaling, &threads].into_iter().map(|t| t.rows.len()).sum();
    assert!(
        spreads.iter().all(|s| *s >= 0.0) && spreads.len() == rows - once && once == 2,
        "{rows} {spreads:?}"
    );
    let noise = &reply["result"]["noise"];
    let bound = noise["bound"].as_f64().unwrap();
    assert_eq!(bound, 0.15);
    assert_eq!(noise["measurements"], spreads.len());
    assert_eq!(noise["beyond"], spreads.iter().filter(|s| **s > bound).count());
    let worst = spreads.iter().copied().fold(0.0, f64::max);
    assert!(
        (noise["worst"].as_f64().unwrap() - worst).abs() < 1e-9 && noise["worst_of"].is_string(),
        "{noise}"
    );

    for figure in FIGURES {
        let png = std::fs::read(desk.path("out").join(format!("{figure}.png"))).unwrap();
        let (wide, high) = picture(&png);
        assert!((400..4000).contains(&wide) && (300..4000).contains(&high), "{figure}: {wide} x {high}");
        let svg = desk.read(&format!("out/{figure}.svg"));
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{figure}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{figure}");
        assert!(svg.contains("CPU f32") && svg.contains("CPU f64"), "{figure} has a legend");
    }
    assert!(desk.read("out/work_precision.svg").contains("time per tap (ns)"));

    let run: Value = serde_json::from_str(&desk.read("out/run.json")).unwrap();
    assert_eq!((&run["command"], &run["format"]), (&"bench".into(), &1.into()));
    assert!(run["machine"]["cores"].as_u64().unwrap() > 0);
    assert_eq!(run["settings"]["quick"], true);
    assert_eq!((&run["noise"]["worst"], &run["stopped"]), (&noise["worst"], &Value::Null));
    assert_eq!(run["backends"].as_array().unwrap().len(), 3);
    // Another command does not replace it.
    let ran = desk.sweep(&["--out", "out"]).exits(2);
    assert!(ran.stderr.contains("--out"), "{}", ran.stderr);
    assert_eq!(desk.names("out"), files);
}

#[test]
fn a_gpu_is_measured_like_the_cpu() {
    let desk = Desk::new(SPEC);
    let args = [
        "bench",
        "--quick",
        "--backend",
        "gpu",
        "--precision",
        "f32",
        "--tolerance",
        "1e-5",
        "--out",
        "out",
        "--quiet",
    ];
    let ran = desk.run(&args).exits(0);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    let work = table(&desk, "work_precision.csv");
    let exact: Vec<&Row> =
        work.rows.iter().filter(|r| is(r, &[("backend", "gpu"), ("kernel", "exact")])).collect();
    assert_eq!(exact.len(), 2);
    assert!(exact.iter().all(|r| number(r, "strain_error_max").unwrap() <= 1e-5 && !r["adapter"].is_empty()));
}

#[test]
fn the_plan_runs_nothing() {
    let desk = Desk::new(SPEC);
    let ran = desk.run(&["bench", "--plan", "--backend", "cpu"]).exits(0);
    assert!(
        ran.stdout.contains("nothing was run") && ran.stdout.contains("mooney-coulomb"),
        "{}",
        ran.stdout
    );
    let json = desk.run(&["bench", "--plan", "--quick", "--backend", "cpu", "--json"]).exits(0).json();
    assert_eq!(json["result"]["sizes"], serde_json::json!([1000, 10000, 100000]));
    assert!(json["seconds"]["expected"].as_f64().unwrap() > 0.0);
    let json = desk.run(&["bench", "--plan", "--quick", "--json"]).exits(0).json();
    let backends = json["backend"].as_array().unwrap();
    let software = |b: &&Value| b["adapter"].as_str().is_some_and(|a| a.contains("llvmpipe"));
    assert!(!backends.iter().any(|b| software(&b)), "{backends:?}");
    assert!(desk.names("results").is_empty());
}

#[test]
fn bad_usage_is_refused() {
    let desk = Desk::new(SPEC);
    for (args, word) in [
        (["--tolerance", "1e-20"], "--tolerance"),
        (["--tolerance", "2"], "--tolerance"),
        (["--adapter", "no such thing"], "--adapter"),
    ] {
        let ran = desk.run(&[&["bench", "--quick"], &args[..]].concat()).exits(2);
        assert!(ran.stderr.contains(word) && ran.stderr.contains("allowed"), "{}", ran.stderr);
    }
    let ran = desk.run(&["bench", "--quick", "--precision", "f32", "--tolerance", "1e-9"]).exits(2);
    assert!(ran.stderr.contains("1e-6"), "{}", ran.stderr);
    assert!(desk.names("results").is_empty());
}
