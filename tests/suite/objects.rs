//! Several taps of one object give one distance; σ counts the error that the taps share once.

use std::sync::LazyLock;

use crate::common::measuring::{REAL, TAPS, prototype};
use crate::common::program::{Desk, Kept};
use crate::common::sweeping::{Row, Table, value as of};

const FRESH: &str = "[tap]\na = { from = 22, to = 46.8, step = 0.4 }\ntheta = [2, 3.5, 5, 7, 9]\n";

/// A calibration whose curve is hardly more accurate than a reading; fresh taps of 63 objects in taps.csv, located in out.
pub fn desk() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let spec = |taps: &str| prototype(4.0, &["noise_strain = 1e-4\n", taps, REAL]);
        let desk = Desk::new(&spec(TAPS));
        desk.write("fresh.toml", spec(FRESH));
        desk.ok("simulate spec.toml --out sim --seed 5");
        desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
        desk.ok("simulate fresh.toml --out new --seed 11");
        desk.write("taps.csv", objects(&desk));
        desk.ok("locate cal/calibration.toml taps.csv --out out");
        desk.keep()
    });
    MADE.desk()
}

fn objects(desk: &Desk) -> String {
    let text = desk.read("new/measurements.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header = lines.next().unwrap();
    let place = header.split(',').position(|name| name == "a_mm").unwrap();
    let named = lines.map(|line| format!("{line},at {}", line.split(',').nth(place).unwrap()));
    std::iter::once(format!("{header},object")).chain(named).map(|line| line + "\n").collect()
}

#[test]
fn intervals_hold_taps_and_objects() {
    let desk = desk();
    desk.ok("locate cal/calibration.toml taps.csv --interval --out intervals");
    let [plain, table] = ["out/located.csv", "intervals/located.csv"].map(|name| desk.table(name));
    for (what, of_what) in [("", 1), ("object_", 5)] {
        let (mut inside, mut n) = (0.0, 0.0);
        for (row, other) in table.rows.iter().zip(&plain.rows) {
            let [a, sigma, lo, hi] = ["distance_mm", "sigma_mm", "from_95_mm", "to_95_mm"]
                .map(|column| of(row, &format!("{what}{column}")));
            assert!(other.get(&format!("{what}from_95_mm")).is_none());
            assert_eq!(row[&format!("{what}distance_mm")], other[&format!("{what}distance_mm")]);
            assert!(lo < a && a < hi && hi - lo > 3.7 * sigma && hi - lo < 5.0 * sigma, "{row:?}");
            inside += f64::from(u8::from(lo < of(row, "a_mm") && of(row, "a_mm") < hi));
            n += 1.0;
        }
        // 99 % interval of a binomial, for the number of independent taps.
        let spread = 2.58 * (0.05 * 0.95 * f64::from(of_what) / n).sqrt();
        assert!((inside / n - 0.95).abs() < spread.max(0.03), "{what}{}", inside / n);
    }
    let row = &table.rows[0];
    let line = format!("{},{}\n", row["theta_deg"], row["strain"]);
    let streamed = desk.stream("locate cal/calibration.toml --same --interval", &line).rows.remove(0);
    for name in ["from_95_mm", "to_95_mm"] {
        assert!((of(&streamed, name) - of(row, name)).abs() < 1e-3, "{streamed:?}");
        assert_eq!(streamed[name], streamed[&format!("object_{name}")]);
    }
}

#[test]
fn taps_of_an_object_add_up() {
    let table = desk().table("out/located.csv");
    let columns = "status,taps,object_distance_mm,object_sigma_mm,apart_line,apart_sigmas,object_status";
    assert!(table.columns.join(",").ends_with(columns), "{:?}", table.columns);
    let (mut within, mut beyond, mut objects) = (0, 0, 0);
    let (mut squares, mut sigmas) = (0.0, 0.0);
    for rows in table.rows.chunk_by(|a, b| a["object"] == b["object"]) {
        let counted: Vec<&str> = rows.iter().map(|row| row["taps"].as_str()).collect();
        assert_eq!(counted, ["1", "2", "3", "4", "5"]);
        // The first tap's answer is its own; each further tap reduces σ, but by less than independence would.
        for (alone, all) in [("distance_mm", "object_distance_mm"), ("sigma_mm", "object_sigma_mm")] {
            assert_eq!(rows[0][alone], rows[0][all]);
        }
        let last = &rows[4];
        let sigma = of(last, "object_sigma_mm");
        let least = rows.iter().map(|row| of(row, "sigma_mm")).fold(f64::INFINITY, f64::min);
        let product = rows.iter().map(|row| of(row, "sigma_mm").powi(-2)).sum::<f64>().powf(-0.5);
        assert!(sigma < 1.02 * least && sigma > 0.95 * product, "{sigma} {least} {product}");
        let z = (of(last, "object_distance_mm") - of(last, "a_mm")) / sigma;
        (within, beyond) = (within + usize::from(z.abs() < 1.0), beyond + usize::from(z.abs() > 3.0));
        (squares, sigmas) = (squares + (z * sigma).powi(2), sigmas + sigma * sigma);
        objects += 1;
    }
    assert_eq!(objects, 63);
    // 99 % interval of a binomial of 63, and of the calibration error, which all objects share.
    assert!((33..=60).contains(&within) && beyond <= 3, "{within} within one sigma, {beyond} beyond three");
    let ratio = (squares / sigmas).sqrt();
    assert!((0.65..1.4).contains(&ratio), "{ratio}");
}

/// `text` with the field `column` of each line mapped by `change`.
fn changed(text: &str, column: &str, change: impl Fn(usize, f64) -> f64) -> String {
    let at = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
    let line = |(k, line): (usize, &str)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(value) = fields[at].parse() {
            fields[at] = change(k, value).to_string();
        }
        fields.join(",") + "\n"
    };
    text.lines().enumerate().map(line).collect()
}

#[test]
fn a_tap_that_contradicts_the_others_is_named() {
    let desk = desk();
    let wrong = 1 + 3 * 5 + 2;
    let spoilt = changed(&desk.read("taps.csv"), "strain", |k, y| if k == wrong { 1.2 * y } else { y });
    desk.write("wrong.csv", spoilt);
    desk.ok("locate cal/calibration.toml wrong.csv --out wrong");
    for (k, row) in desk.table("wrong/located.csv").rows.iter().enumerate() {
        let expected = (wrong..=wrong + 2).contains(&(k + 1));
        assert_eq!(row["object_status"].contains("inconsistent"), expected, "row {k}: {row:?}");
        if expected && k + 1 > wrong {
            assert_eq!(of(row, "apart_line"), (wrong + 1) as f64, "{row:?}");
            assert!(of(row, "apart_sigmas") > 4.0, "{row:?}");
        }
    }
}

#[test]
fn a_stream_of_one_object_says_so_far() {
    let desk = desk();
    let table = desk.table("taps.csv");
    let taps: Vec<String> =
        table.rows[..5].iter().map(|r| format!("{},{}\n", r["theta_deg"], r["strain"])).collect();
    let answers = desk.stream("locate cal/calibration.toml --same", &taps.concat());
    let names = "theta_deg,strain,distance_mm,sigma_mm,status,taps,object_distance_mm,object_sigma_mm,apart_line,apart_sigmas,object_status";
    assert_eq!((answers.columns.join(",").as_str(), answers.rows.len()), (names, 5));
    let sigmas = answers.numbers("object_sigma_mm");
    assert!(sigmas[4] < sigmas[0], "{sigmas:?}");
    let more = format!("{}nonsense\n0,0\n{}", taps[0], taps[1]);
    let answers = desk.stream("locate cal/calibration.toml --same", &more);
    assert_eq!(answers.column("taps"), ["1", "", "", "2"]);
    let named = taps.iter().zip(["p", "q", "p", "q", "p"]).map(|(tap, o)| format!("{},{o}\n", tap.trim()));
    let text = format!("theta_deg,strain,object\n{}", named.collect::<String>());
    let answers = desk.stream("locate cal/calibration.toml --object object", &text);
    assert_eq!(answers.column("object").join(""), "pqpqp");
    assert_eq!(answers.column("taps").join(""), "11223");
}

#[test]
fn what_tells_each_tap_alone_says_so() {
    let ran = desk().ok("locate cal/calibration.toml taps.csv --out o --estimator paper");
    assert!(ran.stderr.contains("column object is not looked at"), "{}", ran.stderr);
}

fn next(desk: &Desk, more: &[&str]) -> serde_json::Value {
    let own = ["next", "cal/calibration.toml", "--json", "--force", "--out", "n"];
    desk.run(&[&own[..], more].concat()).exits(0).json()["result"].clone()
}

#[test]
fn the_next_tap_is_the_one_that_tells_most() {
    let desk = desk();
    let told = next(&desk, &["taps.csv", "--only", "at 30"]);
    assert_eq!(told["taps"], 5);
    assert!((told["distance_mm"].as_f64().unwrap() - 30.0).abs() < 1.0, "{told}");
    let table = desk.table("n/next.csv");
    assert_eq!(table.columns, ["theta_deg", "shift_mm", "expected_signal", "expected_sigma_mm", "status"]);
    let fine = || table.rows.iter().filter(|row| row["status"] == "ok");
    let least = fine().map(|row| of(row, "expected_sigma_mm")).fold(f64::INFINITY, f64::min);
    assert_eq!(told["expected_sigma_mm"].as_f64().unwrap(), least);
    let sigma = |told: &serde_json::Value, key: &str| told[key].as_f64().unwrap();
    assert!(sigma(&told, "least_sigma_mm") < least && least < sigma(&told, "sigma_mm"), "{told}");
    let told = next(&desk, &["taps.csv", "--only", "at 30", "--within", "1,4"]);
    assert!((1.0..=4.0).contains(&told["theta_deg"].as_f64().unwrap()), "{told}");
    // The σ expected for the next tap is the σ found after it.
    let lines: Vec<String> = desk.read("taps.csv").lines().map(str::to_owned).collect();
    let own: Vec<&String> = lines.iter().filter(|line| line.ends_with("at 38")).collect();
    let mut expected: Vec<f64> = Vec::new();
    for n in 1..=4 {
        let drive = own[n].split(',').nth(1).unwrap();
        let text =
            [&lines[0]].into_iter().chain(own[..n].iter().copied()).fold(String::new(), |t, l| t + l + "\n");
        desk.write("some.csv", text);
        let theta = format!("{drive},{drive}");
        let told = next(&desk, &["some.csv", "--within", &theta]);
        if let Some(before) = expected.pop() {
            let found = sigma(&told, "sigma_mm");
            assert!((found / before - 1.0).abs() < 0.15, "{n} taps: {found} for {before}");
        }
        expected.push(sigma(&told, "expected_sigma_mm"));
    }
}

#[test]
fn the_base_may_move() {
    let desk = desk();
    let all = desk.read("taps.csv");
    let of_tap = |a: f64, theta: f64, end: &str| {
        let own = |line: &&str| {
            line.ends_with(&format!(",at {a}")) && line.split(',').any(|f| f == theta.to_string())
        };
        let line = all.lines().find(own).unwrap_or_else(|| panic!("{a} {theta}"));
        format!("{},{end}\n", line.rsplit_once(',').unwrap().0)
    };
    let header = all.lines().next().unwrap().to_owned() + ",shift_mm\n";
    let taps = [(36.0, 3.5, "p,0"), (36.0, 7.0, "p,0"), (28.0, 5.0, "p,8"), (26.0, 9.0, "p,10")];
    let text = taps.iter().fold(header.clone(), |text, (a, theta, end)| text + &of_tap(*a, *theta, end));
    desk.write("moved.csv", &text);
    desk.ok("locate cal/calibration.toml moved.csv --out moved");
    let rows = desk.table("moved/located.csv").rows;
    for row in &rows {
        let off = (of(row, "object_distance_mm") - 36.0) / of(row, "object_sigma_mm");
        assert!(off.abs() < 3.5 && row["object_status"] == "ok", "{row:?}");
    }
    let sigmas: Vec<f64> = rows.iter().map(|row| of(row, "object_sigma_mm")).collect();
    assert!(sigmas[3] < 0.6 * sigmas[1], "{sigmas:?}");
    // An object's distance is measured from the first base position, also if all taps are from nearer ones.
    desk.write("near.csv", header.clone() + &of_tap(28.0, 5.0, "p,8"));
    desk.ok("locate cal/calibration.toml near.csv --out near");
    let row = desk.table("near/located.csv").rows.remove(0);
    assert!((of(&row, "object_distance_mm") - of(&row, "distance_mm") - 8.0).abs() < 1e-9, "{row:?}");
    // One position is wrong by 3 mm, another is not a number.
    let wrong = text.replace("p,10", "p,13").replace("p,8", "p,8 mm");
    desk.write("wrong.csv", &wrong);
    let ran = desk.ok("locate cal/calibration.toml wrong.csv --out wrong");
    assert!(ran.stderr.contains("shift_mm is no number"), "{}", ran.stderr);
    let rows = desk.table("wrong/located.csv").rows;
    assert_eq!((rows[2]["taps"].as_str(), rows[3]["taps"].as_str()), ("", "3"));
    assert!(rows[3]["object_status"].contains("inconsistent"), "{:?}", rows[3]);
    for name in ["shift", "base_shift", "shift_m", "Shift_mm"] {
        desk.write("nearly.csv", text.replace("shift_mm", name));
        for command in ["locate", "next"] {
            let line = format!("{command} cal/calibration.toml nearly.csv --out nearly");
            desk.refuses(line, &[name, "shift_mm, in mm"]);
        }
    }

    let text = taps[..2].iter().fold(header, |text, (a, theta, end)| text + &of_tap(*a, *theta, end));
    desk.write("two.csv", text);
    let next = |more: &[&str]| next(&desk, &[&["two.csv"], more].concat());
    // A motor with a small angle: going nearer helps as the signal grows.
    let (stays, moves) = (next(&["--within", "1,4"]), next(&["--within", "1,4", "--shift", "-4,20"]));
    let number = |told: &serde_json::Value, key: &str| told[key].as_f64().unwrap_or(f64::NAN);
    assert_eq!(number(&stays, "shift_mm"), 0.0);
    let precision = |told: &serde_json::Value, key: &str| number(told, key).powi(-2);
    let brings =
        |told: &serde_json::Value| precision(told, "expected_sigma_mm") - precision(told, "sigma_mm");
    assert!(brings(&moves) > 1.7 * brings(&stays) && number(&moves, "shift_mm") > 8.0, "{stays} {moves}");
    // Positions only where the object is certainly within the calibrated 21 to 48 mm.
    let table = desk.table("n/next.csv");
    let shifts: Vec<f64> = table.rows.iter().map(|row| of(row, "shift_mm")).collect();
    assert!(shifts[0] == -4.0 && !table.statuses().contains(&"outside_calibration"), "{}", table.text);
    assert!((14.5..15.0).contains(&shifts[shifts.len() - 1]) && shifts.len() > 150, "{shifts:?}");
    let far = next(&["--shift", "-4,400"]);
    let near = next(&["--shift", "-4,20"]);
    assert!(number(&far, "expected_sigma_mm") <= number(&near, "expected_sigma_mm") * 1.001);
    let beyond = next(&["--shift", "30,40"]);
    let answer = beyond["answer"].as_str().unwrap();
    assert!(beyond["theta_deg"].is_null() && answer.contains("From nowhere"), "{beyond}");
    let first = ["next", "cal/calibration.toml", "--shift", "-5,5", "--json", "--out", "f"];
    let ran = desk.run(&first).exits(0);
    assert!(ran.stderr.contains("--shift is not looked at before the first tap"), "{}", ran.stderr);
    let first = ran.json()["result"].clone();
    assert_eq!(number(&first, "shift_mm"), 0.0);
    assert_eq!(desk.table("f/next.csv").rows.len(), 33);
}

#[test]
fn an_array_tells_objects_too() {
    let desk = desk();
    let all = desk.read("taps.csv");
    let header = format!("whisker,{}\n", all.lines().next().unwrap());
    let mut files = [header.clone(), header.clone(), header.clone()];
    for (k, line) in all.lines().skip(1).enumerate() {
        for name in if k % 3 == 0 { ["right", "left"] } else { ["left", "right"] } {
            let row = format!("{name},{line}\n");
            files[usize::from(name == "right")] += &row;
            files[2] += &row;
        }
    }
    let mount = |name: &str, y: i32| {
        format!(
            "[[whisker]]\nname = \"{name}\"\ncalibration = \"cal/calibration.toml\"\nx = 0\ny = {y}\nheading = 0\n"
        )
    };
    desk.write("array.toml", mount("left", 40) + &mount("right", -40));
    for (name, text) in ["left", "right", "both"].iter().zip(&files) {
        desk.write(&format!("{name}.csv"), text);
    }
    desk.ok("locate --array array.toml both.csv --out both");
    let both = desk.table("both/located.csv");
    let told = ["taps", "object_distance_mm", "object_sigma_mm", "apart_sigmas", "object_status"];
    for name in ["left", "right"] {
        desk.ok(format!("locate cal/calibration.toml {name}.csv --out {name}"));
        let alone = desk.table(format!("{name}/located.csv"));
        let own = both.rows.iter().filter(|row| row["whisker"] == name);
        assert_eq!(own.clone().count(), alone.rows.len());
        for (row, alone) in own.zip(&alone.rows) {
            told.iter().for_each(|column| assert_eq!(row[*column], alone[*column], "{column} of {row:?}"));
        }
    }
    let run = |more: &str| desk.line(format!("locate --array array.toml both.csv --out more --force {more}"));
    run("--same").exits(0);
    let last = desk.table("more/located.csv").rows.pop().unwrap();
    assert_eq!(last["taps"], (files[0].lines().count() - 1).to_string());
    assert!(run("--object pole").exits(2).stderr.contains("there is no such column"));
    assert!(run("--object object --estimator paper").exits(2).stderr.contains("learned"));
}

/// Tilted poles, two gauges: distance and tilt of an object come from all its taps, and a wrong tap is named.
#[test]
fn two_gauges_tell_an_object_together() {
    const RIG: &str =
        "[tap]\na = { from = 18, to = 48, step = 3 }\ntilt = [-20, 0, 20]\ntheta = [2, 4, 6, 8, 10]\n";
    const POLES: &str =
        "[tap]\na = { from = 21.5, to = 44.5, step = 1 }\ntilt = [-15, 5, 22]\ntheta = [3, 4.5, 6, 8]\n";
    let spec = |taps: &str| prototype(4.0, &["second = true\nnoise_strain = 3e-5\n", taps, REAL]);
    let desk = Desk::new(&spec(RIG));
    desk.write("fresh.toml", spec(POLES));
    desk.ok("simulate spec.toml --out sim --seed 5 --repeats 3");
    desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
    desk.ok("simulate fresh.toml --out new --seed 11");
    let mut made = desk.table("new/measurements.csv");
    made.rows.retain(|tap| of(tap, "theta_deg") > 0.0);
    let key = |tap: &Row| format!("{} {}", tap["a_mm"], tap["tilt_deg"]);
    made.rows.sort_by_key(key);
    let line = |tap: &Row| {
        let fields: Vec<&str> = made.columns.iter().map(|name| tap[name].as_str()).collect();
        format!("{},{}\n", fields.join(","), key(tap))
    };
    let header = format!("{},object\n", made.columns.join(","));
    desk.write("taps.csv", header + &made.rows.iter().map(line).collect::<String>());
    desk.ok("locate cal/calibration.toml taps.csv --out out");
    let table = desk.table("out/located.csv");
    let (mut objects, mut within) = (0.0, [[0.0; 2]; 2]);
    let mut narrower = 0.0;
    for rows in table.rows.chunk_by(|p, q| p["object"] == q["object"]) {
        assert_eq!((rows.len(), &*rows[3]["taps"]), (4, "4"));
        let last = &rows[3];
        let pairs = [("distance_mm", "object_distance_mm"), ("tilt_deg", "object_tilt_deg")];
        assert_eq!(rows[0]["sigma_mm"], rows[0]["object_sigma_mm"]);
        pairs.iter().for_each(|(alone, all)| assert_eq!(rows[0][*alone], rows[0][*all]));
        let off = [
            (of(last, "object_distance_mm") - of(last, "a_mm")).abs() / of(last, "object_sigma_mm"),
            (of(last, "object_tilt_deg") - of(last, "given_tilt_deg")).abs()
                / of(last, "object_sigma_tilt_deg"),
        ];
        for (k, off) in off.into_iter().enumerate() {
            (1..3).for_each(|n| within[k][n - 1] += f64::from(u8::from(off < n as f64)));
        }
        let best = rows.iter().map(|row| of(row, "sigma_mm")).fold(f64::INFINITY, f64::min);
        assert!(of(last, "object_sigma_mm") <= best * 1.001, "{last:?}");
        narrower += of(last, "object_sigma_mm") / best;
        objects += 1.0;
    }
    assert!(objects > 60.0 && narrower / objects < 0.95);
    for [one, two] in within {
        assert!((0.5..0.9).contains(&(one / objects)) && two / objects > 0.88, "{within:?} of {objects}");
    }
    let inconsistent = |table: &Table| {
        table.rows.iter().skip(3).step_by(4).filter(|r| r["object_status"].contains("inconsistent")).count()
    };
    assert!(inconsistent(&table) < 3);
    let share = |k: usize, y: f64| if k % 4 == 2 { 1.1 * y } else { y };
    desk.write("wrong.csv", changed(&desk.read("taps.csv"), "strain", share));
    desk.ok("locate cal/calibration.toml wrong.csv --out wrong");
    let wrong = desk.table("wrong/located.csv");
    assert!(inconsistent(&wrong) as f64 > 0.9 * objects);
    let first: Vec<String> = table.rows[..4]
        .iter()
        .map(|r| format!("{},{},{}\n", r["theta_deg"], r["strain"], r["strain_2"]))
        .collect();
    let told = desk.stream("locate cal/calibration.toml --same", &first.concat());
    assert!(told.numbers("object_sigma_tilt_deg").last().is_some_and(|s| *s > Some(0.0)), "{}", told.text);
    desk.refuses("locate cal/calibration.toml taps.csv --strokes --out no", &["--strokes"]);
}
