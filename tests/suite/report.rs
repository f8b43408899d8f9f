//! `vibrissa report`: figures show the numbers of the tables; every command's result; folders without a result are refused.

use std::sync::LazyLock;

use std::collections::BTreeMap;

use serde_json::Value;

use crate::common::program::{Desk, Kept, SPEC, says};
use crate::common::sweeping::Row;

pub fn data(desk: &Desk, page: &str) -> Value {
    let text = desk.read(page);
    let inside = text.split("id=\"data\">").nth(1).and_then(|t| t.split("</script>").next()).expect("data");
    serde_json::from_str(inside).expect("JSON")
}

/// Fails unless two lists of points agree, except for the last digit, which reading JSON may change.
#[track_caller]
pub fn same(drawn: &[(f64, f64)], told: &[(f64, f64)], what: &str) {
    let equal = |a: f64, b: f64| (a.is_nan() && b.is_nan()) || (a - b).abs() <= 4.0 * f64::EPSILON * b.abs();
    let all = drawn.iter().zip(told).all(|(p, q)| equal(p.0, q.0) && equal(p.1, q.1));
    assert!(drawn.len() == told.len() && all, "{what}: drawn {drawn:?}, told {told:?}");
}

pub fn figure<'a>(data: &'a Value, name: &str) -> &'a Value {
    let all = data["figures"].as_array().expect("figures");
    let names: Vec<_> = all.iter().map(|f| f["name"].as_str().unwrap_or("?")).collect();
    all.iter().find(|f| f["name"] == name).unwrap_or_else(|| panic!("no figure {name} among {names:?}"))
}

pub fn points(mark: &Value) -> Vec<(f64, f64)> {
    let column = |k: &str| {
        mark[k].as_array().unwrap().iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect::<Vec<_>>()
    };
    column("x").into_iter().zip(column("y")).collect()
}

pub fn marks(panel: &Value) -> impl Iterator<Item = &Value> {
    panel["marks"].as_array().unwrap().iter()
}

pub fn number(row: &Row, name: &str) -> f64 {
    row[name].parse().unwrap_or(f64::NAN)
}

pub const PROTOTYPES: &str = "[whisker]\nD = 10\nd = [4, 7, 10]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 2e-5\n\
    [tap]\na = { from = 21, to = 48, step = 3 }\ntheta = [0.5, 1, 2, 4, 7, 10]\n";

pub fn swept() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let desk = Desk::new(PROTOTYPES);
        desk.sweep(&["--out", "out"]).exits(0);
        desk.ok("report out");
        desk.keep()
    });
    MADE.desk()
}

#[test]
fn what_is_drawn_of_a_sweep_is_what_its_tables_say() {
    let desk = swept();
    let data = data(&desk, "out/report/report.html");
    let (designs, tuples) = (desk.table("out/designs.csv").rows, desk.table("out/tuples.csv").rows);
    let of = |rows: &[Row], d: f64, keep: &dyn Fn(&Row) -> bool, x: &str, y: &str| -> Vec<(f64, f64)> {
        rows.iter()
            .filter(|r| number(r, "d_tip_mm") == d && keep(r))
            .map(|r| (number(r, x), number(r, y)))
            .collect()
    };
    // The paper's Fig. 7.
    let sd = figure(&data, "sd");
    for mark in marks(&sd["panels"][0]) {
        let d = [4.0, 7.0, 10.0].into_iter().find(|d| mark["name"] == format!("d = {d} mm")).unwrap();
        same(&points(mark), &of(&designs, d, &|_| true, "theta_deg", "K_sd"), "sd");
    }
    assert_eq!(sd["panels"][0]["y"]["log"], true);
    // The paper's Figs. 5, 6 and 8, a panel for each whisker.
    for (i, d) in [4.0, 7.0, 10.0].into_iter().enumerate() {
        let title = format!("d = {d} mm");
        let mut seen = 0;
        for (name, other, x) in
            [("strain_drive", "a_mm", "theta_deg"), ("strain_distance", "theta_deg", "a_mm")]
        {
            let panel = &figure(&data, name)["panels"][i];
            assert_eq!(panel["title"], title);
            let all: Vec<&Value> = marks(panel).collect();
            // The line of linear theory is drawn below the exact points of the same taps.
            for pair in all.chunks(2) {
                let name = pair[1]["name"].as_str().unwrap();
                let at = name.split("= ").nth(1).unwrap().trim_end_matches(" mm").trim_end_matches('°');
                let at: f64 = at.parse().unwrap();
                assert_eq!(pair[0]["name"], "linear theory");
                for (mark, y) in pair.iter().zip(["strain_linear", "strain"]) {
                    same(&points(mark), &of(&tuples, d, &|r| number(r, other) == at, x, y), name);
                    seen += 1;
                }
            }
        }
        assert_eq!(seen, 20);
        let cells = &figure(&data, "K")["panels"][i]["marks"][0];
        let drawn: Vec<f64> = cells["z"].as_array().unwrap().iter().map(|z| z.as_f64().unwrap()).collect();
        let mut told: Vec<(f64, f64, f64)> = tuples
            .iter()
            .filter(|r| number(r, "d_tip_mm") == d)
            .map(|r| (number(r, "theta_deg"), number(r, "a_mm"), number(r, "K")))
            .collect();
        told.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
        let [drawn, told] = [drawn, told.iter().map(|t| t.2).collect()]
            .map(|v: Vec<f64>| v.into_iter().map(|k| (0.0, k)).collect::<Vec<_>>());
        same(&drawn, &told, "K");
        let panel = &figure(&data, "distance")["panels"][i];
        let angles: Vec<&Value> = marks(panel).filter(|m| m["name"] != "â = a").collect();
        assert_eq!(angles.len(), 5);
        for mark in angles {
            let name = mark["name"].as_str().unwrap();
            let theta: f64 = name.trim_start_matches("θ = ").trim_end_matches('°').parse().unwrap();
            let told = of(&tuples, d, &|r| number(r, "theta_deg") == theta, "a_mm", "distance_mm");
            same(&points(mark), &told, "distance");
        }
        let budget = &figure(&data, "budget")["panels"][i];
        let ring = points(marks(budget).find(|m| m["name"] == "least total").unwrap())[0];
        let total = of(&designs, d, &|r| r["status"] == "ok", "theta_deg", "total_rms_mm");
        same(&[ring], &[*total.iter().min_by(|p, q| p.1.total_cmp(&q.1)).unwrap()], "least total");
    }
    let table = &data["tables"].as_array().unwrap().iter().find(|t| t["file"] == "designs.csv").unwrap();
    assert_eq!(table["rows"].as_array().unwrap().len(), designs.len());
    for (shown, row) in table["rows"].as_array().unwrap().iter().zip(&designs) {
        for (column, value) in table["columns"].as_array().unwrap().iter().zip(shown.as_array().unwrap()) {
            let text = &row[column["name"].as_str().unwrap()];
            match value {
                Value::Null => assert_eq!(text, ""),
                Value::Number(x) => {
                    same(&[(0.0, x.as_f64().unwrap())], &[(0.0, text.parse().unwrap())], text)
                }
                other => assert_eq!(other.as_str(), Some(text.as_str())),
            }
        }
    }
}

pub fn size(png: &[u8]) -> [u32; 2] {
    assert_eq!(&png[1..4], b"PNG");
    [16, 20].map(|i| u32::from_be_bytes(png[i..i + 4].try_into().unwrap()))
}

#[test]
fn figures_have_the_formats_and_sizes_that_were_asked_for() {
    let desk = swept();
    let run = desk.whole("out/report");
    assert_eq!(run["asked"]["drawn"].as_str().map(str::len), Some(64));
    let names = desk.names("out/report");
    for ending in ["svg", "png", "pdf"] {
        for name in ["sd", "K", "strain_drive", "distance", "budget", "parallel", "front"] {
            assert!(names.contains(&format!("{name}.{ending}")), "{name}.{ending} of {names:?}");
        }
    }
    let bytes = |name: &str| std::fs::read(desk.path("out/report").join(name)).unwrap();
    // One column of 88 mm, and 181 mm for two with their gap, at 300 dpi.
    assert_eq!(size(&bytes("sd.png"))[0], 1040);
    assert_eq!(size(&bytes("K.png"))[0], 2138);
    let pdf = bytes("sd.pdf");
    assert!(pdf.starts_with(b"%PDF-") && pdf.trim_ascii_end().ends_with(b"%%EOF"));
    let svg = desk.read("out/report/sd.svg");
    says(&svg, &["tap angle θ (°)", "d = 10 mm", "width=\"249.45pt\""]);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    desk.ok("report out --figures svg --width 60 --font-size 6 --out narrow");
    assert!(desk.read("narrow/sd.svg").contains("width=\"170.08pt\""));
    assert!(desk.read("narrow/sd.svg").contains("font-size=\"6.00\""));
    assert!(desk.names("narrow").iter().all(|n| !n.ends_with("png") && !n.ends_with("pdf")));
}

#[test]
fn the_same_result_gives_the_same_bytes() {
    let desk = swept();
    for out in ["one", "two"] {
        desk.ok(format!("report out --out {out}"));
    }
    for name in desk.names("one").iter().filter(|n| *n != "run.json") {
        let [one, two] = ["one", "two"].map(|f| std::fs::read(desk.path(f).join(name)).unwrap());
        assert!(one == two, "{name}");
    }
    desk.ok("report out");
    desk.ok("report out --figures svg");
    desk.sweep(&["--out", "out"]).exits(0);
    assert!(desk.names("out").contains(&"report".to_owned()));
    desk.ok("report out");
    desk.whole("out/report");
}

#[test]
fn a_page_asks_for_nothing_from_elsewhere() {
    let desk = swept();
    let page = desk.read("out/report/report.html");
    let elsewhere: Vec<&str> = page
        .match_indices("http")
        .map(|(i, _)| &page[i..(i + 40).min(page.len())])
        .filter(|t| !t.starts_with("http://www.w3.org/2000/svg") && !t.starts_with("http-equiv"))
        .collect();
    assert_eq!(elsewhere, Vec::<&str>::new());
    assert!(page.contains("default-src 'none'") && !page.contains("src=\"") && !page.contains("import("));
    let data = data(&desk, "out/report/report.html");
    let made: BTreeMap<&str, &str> = data["made"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| (p[0].as_str().unwrap(), p[1].as_str().unwrap()))
        .collect();
    assert_eq!(made["command"], "vibrissa sweep spec");
    assert!(made["version"].starts_with(env!("CARGO_PKG_VERSION")), "{made:?}");
    assert!(made["computed on"].starts_with("cpu, f32"), "{made:?}");
    let hash = vibrissa::sink::folder::hash_file(desk.read("out/run.json").as_bytes()).unwrap();
    assert_eq!(made["BLAKE3 of run.json"], hash);
    assert_eq!(data["spec"], PROTOTYPES);
}

pub fn calibrated(desk: &Desk) {
    let data = data(desk, "calibrated/report/report.html");
    let table = desk.table("calibrated/rows.csv").rows;
    let used: Vec<_> =
        table.iter().filter(|r| r["use"] == "used" && number(r, "distance_mm").is_finite()).collect();
    for (name, y) in [("residuals", "residual"), ("held_out", "held_out_error_mm")] {
        let mark = marks(&figure(&data, name)["panels"][0])
            .find(|m| m["kind"] == "points" && m["colour"] == 0)
            .unwrap();
        let drawn = points(mark);
        let told: Vec<(f64, f64)> = used.iter().map(|r| (number(r, "a_mm"), number(r, y))).collect();
        same(&drawn, &told, name);
    }
    let normal = marks(&figure(&data, "coverage")["panels"][0]).find(|m| m["name"] == "normal distribution");
    let at = points(normal.unwrap()).into_iter().find(|p| p.0 == 1.0).unwrap();
    assert!((at.1 - 0.682_689).abs() < 1e-5, "{at:?}");
}

/// The front is pareto.csv; the chosen design is the best of run.json.
pub fn searched(desk: &Desk) {
    let data = data(desk, "searched/report/report.html");
    let front = &figure(&data, "front")["panels"][0];
    let table = desk.table("searched/pareto.csv").rows;
    let mut told: Vec<(f64, f64)> =
        table.iter().map(|r| (number(r, "K_sd"), number(r, "total_rms_mm"))).collect();
    told.sort_by(|p, q| p.0.total_cmp(&q.0));
    let line = points(marks(front).find(|m| m["kind"] == "line").unwrap());
    same(&line, &told, "front");
    let convergence = &figure(&data, "convergence")["panels"][0];
    assert_eq!(convergence["y"]["label"], "total error, rms");
    let history = desk.table("searched/history.csv").rows;
    let kept = |r: &&Row| number(r, "start") == 0.0 && number(r, "violation") == 0.0;
    let told: Vec<_> =
        history.iter().filter(kept).map(|r| (number(r, "evaluations"), number(r, "total_rms_mm"))).collect();
    let falls = points(marks(convergence).find(|m| m["name"] == "start 0").unwrap());
    same(&falls, &told, "convergence");
    assert!(falls.windows(2).all(|w| w[1].1 <= w[0].1), "{falls:?}");
    let run: Value = serde_json::from_str(&desk.read("searched/run.json")).unwrap();
    let best = &run["result"]["best"];
    let ring = points(marks(front).find(|m| m["name"] == "chosen design").unwrap());
    same(&ring, &[(best["K_sd"].as_f64().unwrap(), best["total_rms_mm"].as_f64().unwrap())], "chosen");
    let lines = &figure(&data, "parallel")["parallel"];
    assert_eq!(lines["values"].as_array().unwrap().len(), table.len());
}

#[test]
fn what_is_no_result_is_refused_and_said() {
    let desk = swept();
    let refused = |line: &str, words: &[&str]| {
        desk.refuses(line, words);
        assert!(!desk.path("out/report").exists());
    };
    std::fs::remove_dir_all(desk.path("out/report")).unwrap();
    std::fs::create_dir(desk.path("empty")).unwrap();
    refused("report empty", &["empty"]);
    desk.write("torn/run.json", &desk.read("out/run.json")[..200]);
    refused("report torn", &["torn/run.json:", "not the run.json"]);
    let whole = desk.read("out/designs.csv");
    std::fs::remove_file(desk.path("out/designs.csv")).unwrap();
    refused("report out", &["designs.csv", "not there"]);
    desk.write("out/designs.csv", whole.replacen("0.5", "0.6", 1));
    refused("report out", &["designs.csv", "changed", "--force"]);
    desk.write("out/designs.csv", &whole[..whole.len() - 40]);
    refused("report out --force", &["designs.csv:", "damaged"]);
    desk.write("out/designs.csv", whole.replacen("4,50", "four,50", 1));
    refused("report out --force", &["not a number", "four"]);
    desk.write("out/designs.csv", whole.replacen("ok", "ok+edited", 1));
    desk.ok("report out --force --figures svg");
    let notes = data(&desk, "out/report/report.html")["notes"].to_string();
    assert!(notes.contains("designs.csv was changed"), "{notes}");
}

#[test]
fn parquet_draws_what_csv_draws() {
    let figures = |text: &str| {
        let desk = Desk::new(text);
        desk.sweep(&["--out", "out"]).exits(0);
        desk.ok("report out");
        (data(&desk, "out/report/report.html")["figures"].clone(), desk)
    };
    let csv = figures(PROTOTYPES).0;
    assert!(csv.as_array().is_some_and(|all| all.len() > 3), "{csv}");
    let (parquet, desk) = figures(&format!("{PROTOTYPES}[output]\nformat = \"parquet\"\n"));
    assert_eq!(csv, parquet);
    desk.write("out/designs.parquet", "PAR1 no more");
    let torn = desk.line("report out --force");
    assert!(torn.stderr.contains("designs.parquet"), "{}", torn.stderr);
}

#[test]
fn a_sweep_without_values_is_still_a_page() {
    let desk = Desk::new(&SPEC.replace("a = [21, 33, 48]", "a = [0.5, 1]").replace("x_ss = 5", "x_ss = 20"));
    desk.sweep(&["--out", "out"]).exits(0);
    desk.ok("report out");
    let data = data(&desk, "out/report/report.html");
    // No tap has a strain or a distance: no spread and no error can be drawn.
    let names: Vec<_> =
        data["figures"].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap()).collect();
    assert!(!names.contains(&"sd") && !names.contains(&"distance"), "{names:?}");
}

#[test]
fn many_rows_become_a_small_page() {
    let desk = swept();
    let header = desk.read("out/designs.csv").lines().next().unwrap().to_owned();
    let names: Vec<&str> = header.split(',').collect();
    let (mut text, mut best) = (header.clone() + "\n", Vec::new());
    for i in 0..60_000u32 {
        let hash = f64::from(i.wrapping_mul(2_654_435_761)) / 4_294_967_296.0;
        let (d, x) = (2.0 + 8.0 * hash, 3.0 + f64::from(i % 97) / 10.0);
        let sd = 1e-6 * (1.0 + 40.0 * hash * hash + f64::from(i % 89));
        let total = 1e-2 * (2.0 - hash + f64::from(i % 13));
        best.push(total);
        let known = [("D_mm", 10.0), ("d_tip_mm", d), ("L_a_mm", 50.0), ("x_ss_mm", x), ("l_mm", 2.0)];
        let told = [("theta_deg", 4.0), ("n", 10.0), ("K_sd", sd), ("total_rms_mm", total)];
        let row = names.iter().map(|name| match known.iter().chain(&told).find(|(n, _)| n == name) {
            Some((_, value)) => value.to_string(),
            None => if *name == "status" { "ok" } else { "0.01" }.to_owned(),
        });
        text += &(row.collect::<Vec<_>>().join(",") + "\n");
    }
    desk.write("out/designs.csv", &text);
    desk.ok("report out --force --figures svg");
    let page = desk.read("out/report/report.html");
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    let data = data(&desk, "out/report/report.html");
    assert!(data["notes"].to_string().contains("designs.csv: 1500 of 60000 rows"), "{}", data["notes"]);
    let table = data["tables"].as_array().unwrap().iter().find(|t| t["file"] == "designs.csv").unwrap();
    let at = names.iter().position(|n| *n == "total_rms_mm").unwrap();
    let shown: Vec<f64> = table["rows"].as_array().unwrap().iter().map(|r| r[at].as_f64().unwrap()).collect();
    best.sort_by(f64::total_cmp);
    assert_eq!(shown.len(), 1500);
    let mut ranked: Vec<(f64, f64)> = shown.iter().map(|t| (0.0, *t)).collect();
    ranked.sort_by(|p, q| p.1.total_cmp(&q.1));
    same(&ranked[..750], &best[..750].iter().map(|t| (0.0, *t)).collect::<Vec<_>>(), "the best are shown");
    assert!(shown.iter().any(|s| *s > best[59_000]), "and some of the worst");
    let cells = &figure(&data, "map_total_rms_mm")["panels"][0]["marks"][0]["z"];
    let least = cells.as_array().unwrap().iter().filter_map(Value::as_f64).fold(f64::INFINITY, f64::min);
    same(&[(0.0, least)], &[(0.0, best[0])], "the least of the map");
}
