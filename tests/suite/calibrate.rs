//! From measurements to a calibration: the paper's procedure, the fit of the model, dirty data.

use crate::common;

use std::collections::BTreeSet;

use crate::common::measuring::{
    REAL, TAPS, calibrated, fresh, locator, once, prototype, rewritten, score, table,
};
use crate::common::sweeping::{REFERENCE, number, sweep};
use vibrissa::calibrate::{Options, Reason, calibrate};
use vibrissa::locate::Parameter;
use vibrissa::locate::estimator::Estimator;
use vibrissa::measure::{Row, Unit};
use vibrissa::scene::Side;
use vibrissa::simulate::Settings;

const NOISE: f64 = 1e-5;

fn noisy() -> Settings {
    Settings { repeats: 5, noise: NOISE, ..Settings::default() }
}

#[test]
fn the_papers_procedure_gives_the_rows_of_a_sweep() {
    for (d, model) in [(4.0, ""), (7.0, ""), (10.0, ""), (4.0, REAL), (10.0, REAL)] {
        let spec = prototype(d, &[TAPS, model]);
        let swept = sweep(&spec, REFERENCE);
        let found = once(&swept.tuples.text, &spec);
        assert!(found.taps.iter().all(|t| t.reason.is_none()), "clean data have no suspects");
        let rows = &found.sides[0].table.by_drive;
        assert_eq!(rows.len(), swept.designs.rows.len());
        for (row, expected) in rows.iter().zip(&swept.designs.rows) {
            let same = |value: Option<f64>, column: &str| {
                let (value, expected) = (value.unwrap(), number(expected, column).unwrap());
                assert!((value / expected - 1.0).abs() < 1e-6, "d = {d} {column}: {value} is not {expected}");
            };
            same(row.deviation.mean().map(|m| 1.0 + m), "K_mean");
            same(row.deviation.sd(), "K_sd");
            same(row.figures().error_rms, "error_rms_mm");
            same(row.figures().error_max, "error_max_mm");
            same(row.figures().error_mean, "error_mean_mm");
        }
    }
}

#[test]
fn round_trip_reaches_the_noise_limit_and_knows_its_error() {
    for d in [4.0, 7.0, 10.0] {
        let spec = prototype(d, &["noise_strain = 1e-5\n", TAPS, REAL]);
        let found = once(&table(&spec, &noisy()), &spec);
        let taps = table(&fresh(&spec, [21.0, 48.0], 1000), &Settings { seed: 99, ..noisy() });
        let taps = taps.lines().take(1 + 11_000).collect::<Vec<_>>().join("\n");
        let of = |e| score(&locator(&found, e), &taps, NOISE);
        let default = of(None);
        assert!(default.taps >= 10_000 && default.unanswered == 0, "{default:?}");
        assert!((0.63..0.73).contains(&default.coverage), "d = {d}: {default:?}");
        assert!(default.rms < 1.5 * default.limit, "d = {d}: {default:?}");
        let curve = of(Some(Estimator::Curve));
        assert!((0.60..=0.76).contains(&curve.coverage), "d = {d}: {curve:?}");
    }
}

#[test]
fn the_model_recovers_its_parameters_and_beats_the_paper() {
    let model = "[model]\nshear = true\nsurface = true\nextension = true\nnu = NU\n\
                 material = { mooney-rivlin = [0.35, C01] }\ncontact = { coulomb = MU }\n";
    let with = |nu: &str, c01: &str, mu: &str, hub: &str| {
        let model = model.replace("NU", nu).replace("C01", c01).replace("MU", mu);
        prototype(10.0, &[TAPS, &model]).replace("L_a = 50", &format!("L_a = 50\nhub = {hub}"))
    };
    let truth = with("0.45", "0.15", "0.2", "4.0");
    let guess = with("0.5", "0.0", "0.3", "0.0");
    let settings = Settings { factor: 1.04, drive_offset: 0.15, a_offset: 0.4, ..Settings::default() };
    let all = [Parameter::DistanceOffset, Parameter::Hub, Parameter::Nu, Parameter::Mu, Parameter::Ratio];
    let found = calibrated(&table(&truth, &settings), &guess, &all);
    let fit = found.sides[0].fit.as_ref().unwrap();
    assert!(fit.undetermined.is_empty(), "{:?}", fit.undetermined);
    for (p, expected) in Parameter::ALL.iter().zip([1.04, 0.15, 0.4, 4.0, 0.45, 0.2, 0.15 / 0.35]) {
        let value = fit.exact.values[*p as usize];
        assert!((value / expected - 1.0).abs() < 0.01, "{p:?}: {value} is not {expected}");
    }
    assert_eq!(found.winner, Estimator::Learned);

    let spec = prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL]);
    let found = once(&table(&spec, &noisy()), &spec);
    let taps = table(&fresh(&spec, [21.0, 48.0], 200), &Settings { seed: 3, ..noisy() });
    let [exact, paper] =
        [Estimator::Exact, Estimator::Paper].map(|e| score(&locator(&found, Some(e)), &taps, NOISE));
    assert!(10.0 * exact.rms < paper.rms, "{exact:?} {paper:?}");
}

#[test]
fn what_the_data_do_not_determine_is_named_and_held() {
    let one_angle = "[tap]\na = { from = 21, to = 48, step = 3 }\ntheta = 4\n";
    let spec = prototype(10.0, &["noise_strain = 1e-5\n", one_angle, REAL]);
    let found = calibrated(&table(&spec, &noisy()), &spec, &[Parameter::Ratio]);
    let fit = found.sides[0].fit.as_ref().unwrap();
    // With one angle, factor and offset cannot be distinguished.
    assert!(fit.undetermined.contains(&Parameter::DriveOffset));
    for p in &fit.undetermined {
        assert_eq!(fit.exact.values[*p as usize], 0.0, "{p:?} is held at its spec value");
        assert!(!fit.exact.fitted.contains(p));
    }
    assert!((fit.exact.values[0] - 1.0).abs() < 1e-3);
    let errors: Vec<f64> = (0..fit.exact.fitted.len()).map(|i| fit.exact.covariance[i][i]).collect();
    assert!(errors.iter().all(|v| *v > 0.0));
}

#[test]
fn every_planted_fault_is_found_and_nothing_else() {
    let spec = prototype(7.0, &["noise_strain = 1e-5\n", TAPS, REAL]);
    for (repeats, faults) in [(5, 0.08), (1, 0.05)] {
        let settings = Settings { repeats, outliers: faults, saturate: Some(0.045), ..noisy() };
        let text = table(&spec, &settings);
        let planted: BTreeSet<usize> = (2..)
            .zip(text.lines().skip(1))
            .filter(|(_, l)| !l.ends_with(",synthetic,,ok") && !l.contains(",synthetic,,"))
            .map(|(i, _)| i)
            .collect();
        let found = once(&text, &spec);
        let flagged: BTreeSet<usize> =
            found.taps.iter().filter(|t| t.reason.is_some()).map(|t| t.line).collect();
        let missed: Vec<_> = planted.difference(&flagged).collect();
        let wrong: Vec<_> = flagged.difference(&planted).collect();
        assert!(planted.len() > 20 / repeats as usize);
        assert!(missed.is_empty() && wrong.is_empty(), "missed {missed:?}, wrongly flagged {wrong:?}");
        assert!(found.sides[0].with_suspects.is_some(), "results with the suspects too");
        assert!(found.taps.iter().any(|t| t.reason == Some(Reason::Saturated)));
        let sigma = (found.calibration.noise / NOISE - 1.0).abs();
        assert!(sigma < 0.15, "noise {}", found.calibration.noise);
    }
}

#[test]
fn a_drifting_zero_is_taken_out() {
    let spec = prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL]);
    let fresh_taps = table(&fresh(&spec, [21.0, 48.0], 300), &Settings { seed: 4, ..noisy() });
    for zero_every in [Some(7), None] {
        let text = table(&spec, &Settings { drift: 1e-6, zero_every, ..noisy() });
        let found = once(&text, &spec);
        assert!(found.sides[0].learnt.task.drift, "zero readings tell, and without them the repeats");
        let score = score(&locator(&found, None), &fresh_taps, NOISE);
        if zero_every.is_some() {
            assert!(score.rms < 1.2 * score.limit && (0.62..0.74).contains(&score.coverage), "{score:?}");
        } else {
            // A reading without a zero may come at any time of the drift: σ includes it.
            assert!(
                score.coverage > 0.62 && found.warnings.iter().any(|w| w.contains("drifted")),
                "{score:?}"
            );
        }
    }
    let clean = once(&table(&spec, &noisy()), &spec);
    assert!(!clean.sides[0].learnt.task.drift || clean.zeros.len() > 2);
}

#[test]
fn both_sides_and_the_side_that_was_not_calibrated() {
    let near = prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL]);
    let far = near.replace("l = 2", "l = 2\nside = \"far\"");
    let (contact, other) = (table(&near, &noisy()), table(&far, &Settings { seed: 2, ..noisy() }));
    let lines = |t: &str| t.lines().skip(1).collect::<Vec<_>>().join("\n");
    let both = once(&format!("{contact}{}\n", lines(&other)), &near);
    assert_eq!(both.sides.iter().map(|s| s.record.gauge()).collect::<Vec<_>>(), [Side::Contact, Side::Far]);
    let one = once(&contact, &near);
    let taps = table(&fresh(&far, [21.0, 48.0], 200), &Settings { seed: 8, ..noisy() });
    for found in [&both, &one] {
        let score = score(&locator(found, None), &taps, NOISE);
        assert!(score.unanswered == 0 && score.rms < 1.2 * score.limit, "{score:?}");
    }
    let paper = locator(&one, Some(Estimator::Paper)).locate(4.0, -0.02);
    assert_eq!((paper.distance.is_nan(), paper.status.to_string().as_str()), (true, "outside_calibration"));
    let stray = contact.replacen("\n21,4,0", "\n21,4,-0", 1);
    let found = once(&stray, &near);
    let reasons: Vec<_> = found.taps.iter().filter_map(|t| t.reason.as_ref()).collect();
    assert_eq!(reasons, [&Reason::OtherSide]);
}

#[test]
fn other_signals_and_other_drives() {
    let spec = prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL]);
    let passive = prototype(
        4.0,
        &[
            "noise_strain = 1e-5\n[tap]\ndrive = \"displacement\"\na = { from = 21, to = 48, step = 3 }\ndelta = [0.5, 1, 2, 3]\n",
            REAL,
        ],
    );
    let cases = [
        (&spec, Settings { unit: Unit::Microstrain, ..noisy() }, 1.0),
        (&spec, Settings { unit: Unit::Bridge, ..noisy() }, 1.0),
        (&spec, Settings { unit: Unit::Reading, factor: -340.0, ..noisy() }, 340.0),
        (&passive, noisy(), 1.0),
    ];
    for (spec, settings, factor) in cases {
        let found = once(&table(spec, &settings), spec);
        assert_eq!(found.winner, Estimator::Learned);
        let value = found.sides[0].fit.as_ref().unwrap().exact.values[0];
        assert!((value / factor - 1.0).abs() < 1e-3, "{value}");
        let fresh = fresh(spec, [21.0, 48.0], 200);
        let taps =
            table(&fresh, &Settings { seed: 9, unit: settings.unit, factor: settings.factor, ..noisy() });
        let locator = locator(&found, None);
        let drive = taps.split(',').nth(1).unwrap();
        let signal = if settings.unit == Unit::Reading { "reading" } else { "strain" };
        let strain =
            |row: &Row| if signal == "reading" { row.value } else { settings.unit.strain(row.value, 2.21) };
        let taps =
            rewritten(&taps, &format!("a_mm,{drive},{signal}"), |_, row| [row.a, row.drive, strain(row)]);
        let score = score(&locator, &taps, NOISE * factor);
        assert!(
            score.rms < 1.2 * score.limit && (0.62..0.74).contains(&score.coverage),
            "{settings:?} {score:?}"
        );
    }
}

#[test]
fn a_rig_that_never_recorded_its_angle() {
    let tap = "[tap]\na = { from = 21, to = 48, step = 3 }\ntheta = 4\n";
    let spec = prototype(10.0, &["noise_strain = 1e-5\n", tap, REAL]);
    let text = table(&spec, &noisy());
    let blind = rewritten(&text, "a_mm,strain", |_, row| [row.a, row.value]);
    let found = once(&blind, &spec);
    let held: Vec<&str> =
        Estimator::ALL.into_iter().filter(|e| found.sides[0].has(*e)).map(|e| e.word()).collect();
    assert_eq!(held, ["paper", "curve", "learned"]);
    let at = locator(&found, None).locate(1.0, 0.02);
    let said = {
        let options = Options { drive: Some(4.0), ..Options::default() };
        let found =
            calibrate(&common::measuring::data(&blind), &common::measuring::rig(&spec), &options).unwrap();
        locator(&found, None).locate(4.0, 0.02)
    };
    assert!((at.distance - said.distance).abs() < 0.2, "{at:?} {said:?}");
}

fn sharp(theta: &str, effects: &str) -> String {
    let taps = format!("[tap]\na = {{ from = 21, to = 48, step = 3 }}\ntheta = {theta}\n");
    prototype(0.5, &["noise_strain = 1e-5\n", &taps, effects])
}

#[test]
fn taps_that_the_model_does_not_follow_are_left_out_of_its_fit() {
    let spec = sharp("[0.5, 2, 4, 6, 8, 10]", "");
    let found = once(&table(&spec, &noisy()), &spec);
    let side = &found.sides[0];
    let fit = side.fit.as_ref().unwrap();
    assert!(fit.cells.len() < side.table.cells.len());
    assert!(found.warnings.iter().any(|w| w.contains("left out of the fit")));
    let factor = fit.exact.values[0];
    assert!((factor - 1.0).abs() < 1e-3, "{factor}");
    let (rms, answered) = side.held_out(Estimator::Exact).unwrap().rms(|_| true);
    assert!(rms.unwrap() < 0.1 && 10 * answered > 9 * side.used, "{rms:?} of {answered}");
    // Every estimator is scored on held-out data; the winner must not be far worse than the curve.
    assert!(
        [Estimator::Paper, Estimator::Curve, Estimator::Learned].iter().all(|e| side.held_out(*e).is_some())
    );
    let won = side.held_out(found.winner).unwrap().rms(|_| true).0.unwrap();
    let best = side.held_out(Estimator::Curve).unwrap().rms(|_| true).0.unwrap();
    assert!(won < 3.0 * best, "{:?}: {won} {best}", found.winner);
    let located = locator(&found, Some(Estimator::Exact));
    let beyond = located.locate(10.0, located.expected(39.0, 10.0, 1.0));
    assert!((beyond.distance - 39.0).abs() < 1e-6, "{beyond:?}");
    assert!(located.expected(50.0, 10.0, 1.0).is_nan());
}

#[test]
fn at_every_drive_a_distance_is_the_farthest_that_the_model_expects_its_reading_from() {
    for spec in [prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL]), sharp("[0.5, 2, 4, 6, 8, 10]", "")]
    {
        let located = locator(&once(&table(&spec, &noisy()), &spec), Some(Estimator::Exact));
        let mut found = 0;
        for (a, k) in (0..28).flat_map(|i| (0..40).map(move |k| (21.0 + f64::from(i), k))) {
            let drive = 0.5 + 9.5 * f64::from(k) / 39.0;
            let reading = located.expected(a, drive, 1.0);
            if !reading.is_finite() {
                continue;
            }
            let at = located.locate(drive, reading);
            let again = located.expected(at.distance, drive, 1.0);
            assert!((again / reading - 1.0).abs() < 1e-9, "{a} mm, {drive}°: {at:?}, {again} of {reading}");
            assert!(at.distance > a * (1.0 - 1e-9), "{a} mm, {drive}°: {at:?}");
            let beyond = located.expected(at.distance + 0.5, drive, 1.0);
            assert!(beyond.is_nan() || beyond < reading, "{a} mm, {drive}°: {at:?}");
            found += 1;
        }
        assert!(found > 500, "{found}");
    }
}

#[test]
fn without_its_model_a_whisker_is_calibrated_on_its_data() {
    // The data are of a stout whisker; the spec describes one that has a solution at few of these taps.
    let theta = "[30, 40, 50, 60, 70]";
    let wrong = sharp(theta, "");
    let measured = table(&wrong.replace("d = 0.5", "d = 10"), &noisy());
    let found = once(&measured, &wrong);
    let side = &found.sides[0];
    assert!(side.record.no_exact.is_some() && side.record.exact.is_none(), "{:?}", side.record.no_exact);
    assert!(
        found.winner == Estimator::Learned
            && [Estimator::Paper, Estimator::Curve, Estimator::Learned].iter().all(|e| side.has(*e))
    );
}
