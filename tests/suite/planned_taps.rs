//! `plan`: calibration taps that reach an error with fewer taps than an even grid; and impossible plans.

use std::fmt::Write as _;

use crate::common::measuring::{data, table};
use crate::common::program::{Desk, says};
use crate::common::random::Random;
use crate::common::sweeping::{rms, value};
use vibrissa::simulate::Settings;

const WHISKER: &str = "[whisker]\nD = 10\nd = 4\nL_a = 60\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n";
const TAP: &str = "[tap]\na = { from = 20, to = 50, steps = 11 }\ntheta = [2, 4, 6]\n";
const MODEL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n";
/// The plan's model lacks this friction of the rig.
const FRICTION: &str = "contact = { coulomb = 0.3 }\n";

fn spec(model: &str) -> String {
    [WHISKER, TAP, model].concat()
}

fn truth(taps: &[(f64, f64)]) -> Vec<f64> {
    let list = |f: fn(&(f64, f64)) -> f64| {
        let mut all: Vec<f64> = taps.iter().map(f).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let (distances, angles) = (list(|t| t.0), list(|t| t.1));
    let text = |all: &[f64]| all.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ");
    let tap = format!("[tap]\na = [{}]\ntheta = [{}]\n", text(&distances), text(&angles));
    let rows = data(&table(&[WHISKER, &tap, MODEL, FRICTION].concat(), &Settings::default())).rows;
    let of = |t: &(f64, f64)| rows.iter().find(|r| r.a == t.0 && r.drive == t.1).map(|r| r.value);
    taps.iter().map(|t| of(t).expect("it was solved")).collect()
}

/// Readings of a rig at (run, a, θ), θ = 0 without contact: an angle offset, a drift, noise, gain and zero of each run, positions set to 0.05 mm.
fn record(rows: &[(usize, f64, f64)], random: &mut Random) -> Vec<f64> {
    let mut places: Vec<(f64, f64)> = Vec::new();
    let mut at = Vec::new();
    for (_, a, _) in rows {
        if !places.iter().any(|p| p.0 == *a) {
            places.push((*a, a + 0.05 * random.normal()));
        }
        at.push(places.iter().find(|p| p.0 == *a).unwrap().1);
    }
    let of_runs: Vec<[f64; 2]> =
        (0..64).map(|_| [1.0 + 0.003 * random.normal(), 20e-6 * random.normal()]).collect();
    let taps: Vec<(f64, f64)> =
        rows.iter().zip(&at).filter(|(r, _)| r.2 > 0.0).map(|(r, a)| (*a, r.2 + 0.1)).collect();
    let mut strains = truth(&taps).into_iter();
    let mut row = |(k, (run, _, u)): (usize, &(usize, f64, f64))| {
        let [gain, zero] = of_runs[*run];
        let clean =
            if *u > 0.0 { gain * strains.next().unwrap() * (1.0 + 1e-3 * random.normal()) } else { 0.0 };
        clean + zero + 2e-4 + 2e-7 * k as f64 + 20e-6 * random.normal()
    };
    rows.iter().enumerate().map(&mut row).collect()
}

/// rms error of fresh taps in other runs, mm, after a calibration with `rows`.
fn error(desk: &Desk, rows: &[(usize, f64, f64)], seed: u64) -> f64 {
    let mut random = Random(seed);
    let mut text = String::from("run,a_mm,theta_deg,strain\n");
    for ((run, a, u), y) in rows.iter().zip(record(rows, &mut random)) {
        writeln!(text, "{run},{a},{u},{y:e}").unwrap();
    }
    desk.write("d.csv", text);
    desk.ok("calibrate d.csv --whisker spec.toml --out cal --force");
    let mut fresh = Vec::new();
    for run in 0..12 {
        fresh.extend([(run, 30.0, 0.0); 4]);
        let tap = |random: &mut Random| (run, random.between(20.0, 50.0), [2.0, 4.0, 6.0][random.below(3)]);
        fresh.extend((0..5).map(|_| tap(&mut random)));
    }
    let mut text = String::from("theta_deg,strain\n");
    for ((_, _, u), y) in fresh.iter().zip(record(&fresh, &mut random)) {
        writeln!(text, "{u},{y:e}").unwrap();
    }
    let answers = desk.pipe(&["locate", "cal/calibration.toml", "--quiet"], &text).exits(0).stdout;
    let of = |(line, (_, a, u)): (&str, &(usize, f64, f64))| {
        let distance: f64 = line.split(',').nth(2)?.parse().ok()?;
        (*u > 0.0).then_some(distance - a)
    };
    let errors: Vec<f64> = answers.lines().skip(1).zip(&fresh).filter_map(of).collect();
    assert!(errors.len() > 55, "{answers}");
    rms(errors)
}

#[test]
fn planned_taps_reach_their_error_with_fewer_than_an_even_grid() {
    let desk = Desk::new(&spec(MODEL));
    let told = desk.ok("plan spec.toml --error 0.15 --out plan").stdout;
    let rows: Vec<(usize, f64, f64)> = desk
        .table("plan/plan.csv")
        .rows
        .iter()
        .map(|r| {
            assert!(r["strain"].is_empty());
            (r["run"].parse().unwrap(), value(r, "a_mm"), value(r, "theta_deg"))
        })
        .collect();
    let result = desk.whole("plan")["result"].clone();
    let taps = rows.iter().filter(|r| r.2 > 0.0).count();
    assert_eq!(result["taps"], taps);
    // Each run begins and ends at rest, and rests after twelve taps at the latest.
    for run in rows.chunk_by(|p, q| p.0 == q.0) {
        assert!(run[0].2 == 0.0 && run[run.len() - 1].2 == 0.0, "{run:?}");
        assert!(run.split(|r| r.2 == 0.0).all(|taps| taps.len() <= 12), "{run:?}");
    }
    assert!(told.starts_with(&format!("{taps} taps at ")), "{told}");
    assert!(result["sigma_mm"].as_f64().unwrap() <= 0.15);
    // `even_taps` is the best of many even grids, with their drives chosen too.
    assert!(result["even_taps"].as_u64().unwrap() as usize * 4 >= 5 * taps, "{result}");
    let reached = rms((0..8).map(|seed| error(&desk, &rows, 40 + seed)));
    println!("{taps} planned taps {reached:.3} mm; {result}");
    assert!(reached < 1.25 * 0.15, "{reached}");
}

#[test]
fn what_the_taps_cannot_tell_is_named_with_the_tap_that_would() {
    let desk = Desk::new(&spec(&[MODEL, FRICTION].concat()));
    let told = desk.ok("plan spec.toml --error 0.16 --out plan").stdout;
    says(&told, &["cannot tell gain and a_offset apart", "would bring it to"]);
    let result = desk.whole("plan")["result"].clone();
    let of = result["not_told_apart"].as_array().unwrap().iter().find(|a| a["name"] == "a_offset").unwrap();
    let [before, after] = [&of["standard_error"], &of["tap"]["standard_error"]].map(|x| x.as_f64().unwrap());
    assert!(after < 0.5 * before && of["correlation"].as_f64().unwrap().abs() > 0.95, "{of}");
    // A root too stiff for the taps to determine.
    desk.write("stiff.toml", spec(MODEL).replace("L_a = 60", "L_a = 60\nroot = { k_theta = 2e5 }"));
    let told = desk.ok("plan stiff.toml --error 0.3 --out stiff").stdout;
    assert!(told.contains("do not determine k_theta"), "{told}");
    for name in ["plan.csv", "plan_errors.csv", "plan.svg", "run.json"] {
        assert!(desk.path("plan").join(name).exists());
    }
    // The plan taps both ends of each range, since estimates do not extrapolate.
    for (what, key, [least, largest]) in
        [("positions", "a_mm", [20.0, 50.0]), ("drives", "theta_deg", [2.0, 6.0])]
    {
        let of = |x: &serde_json::Value| x[key].as_f64().unwrap();
        let all = result[what].as_array().unwrap();
        assert!(all.first().map(of) == Some(least) && all.last().map(of) == Some(largest), "{what}: {all:?}");
    }
    desk.ok("plan spec.toml --error 0.2 --positions 4 --out four");
    assert!(desk.whole("four")["result"]["positions"].as_array().unwrap().len() <= 4);
    let settings = Settings { repeats: 2, noise: 20e-6, ..Settings::default() };
    let measured = table(&spec(&[MODEL, FRICTION].concat()), &settings);
    desk.write("d.csv", measured);
    desk.ok("calibrate d.csv --whisker spec.toml --out cal");
    desk.ok("plan spec.toml --error 0.3 --like cal/calibration.toml --out like");
    let rig = desk.whole("like")["result"]["rig"].clone();
    assert!((5e-6..8e-5).contains(&rig["noise"].as_f64().unwrap()) && rig["gain"] == 0.003, "{rig}");
    let sensor = "[sensor]\nsignal = \"moment\"\nnoise = 0.1\n";
    desk.write("moment.toml", spec(MODEL).replace("noise_strain = 20e-6", "") + sensor);
    desk.refuses("plan moment.toml --error 1 --like cal/calibration.toml --out no", &["another signal"]);
    desk.write("limit.toml", spec(MODEL).replace("noise_strain", "strain_limit = 0.02\nnoise_strain"));
    let told = desk.ok("plan limit.toml --error 0.4 --out limit").stdout;
    assert!(told.contains("are left out") && told.contains("the plan is for"), "{told}");
}
