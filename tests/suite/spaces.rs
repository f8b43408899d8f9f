//! Spaces of designs: which taps are compared, what pays on a device, which candidate is better.

use std::path::Path;

use vibrissa::backend::PAYS;
use vibrissa::census::sample::{ComparedRows, LIMIT, Row, of_list, spread, taps};
use vibrissa::chart::ranges::Wanted;
use vibrissa::optimise::front::{self, figures, hypervolume, nondominated};
use vibrissa::optimise::samples::{deviations, gather, measure};
use vibrissa::optimise::score::{Goal, Limit, Score};
use vibrissa::optimise::session::Found;
use vibrissa::plan::pays::of_study;
use vibrissa::scene::search::{Calibrated, Measure, Robust};
use vibrissa::scene::{COLUMNS, Layout, Listed, Precision, RunOptions, Space, Study, Tuple};
use vibrissa::spec::parse;

/// A study of whiskers with these tips, distances and tap angles, as a spec writes them.
fn study(d: &str, a: &str, theta: &str) -> Study {
    let text = format!(
        "[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}"
    );
    parse("t.toml", &text, Path::new("")).expect("valid spec").study
}

/// Taps of so many whiskers at so many distances each, one distance after the other.
fn listed(whiskers: u64, distances: u64) -> Listed {
    let whisker = Tuple { D: 10.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
    let tuple = |k: u64, i: u64| Tuple {
        d: 2.0 + 1e-3 * k as f64,
        a: 20.0 + i as f64,
        drive: 1.0 + 1e-3 * (k % 7) as f64,
        ..whisker
    };
    (0..distances).flat_map(|i| (0..whiskers).map(move |k| tuple(k, i))).collect()
}

#[test]
fn a_small_space_is_taken_whole() {
    let rows = ComparedRows::of_study(&study("[4, 7]", "[20, 30, 40]", "[1, 2]"));
    assert_eq!((rows.own.len(), rows.spread.len(), taps(&rows.spread)), (0, 4, 12));
    assert!(rows.spread.iter().all(|r| r.reach == [20.0, 40.0]));
    assert!(of_list(&Listed::default(), 0).is_empty());
}

#[test]
fn a_large_space_keeps_its_ends_and_whole_rows() {
    let (rows, total) = spread(&study(
        "{ from = 2, to = 10, steps = 4000 }",
        "{ from = 10, to = 50, steps = 400 }",
        "{ from = 1, to = 9, steps = 80 }",
    ));
    assert_eq!(total, 4000 * 400 * 80);
    assert!((1500..=LIMIT as usize).contains(&taps(&rows)), "{}", taps(&rows));
    assert!(rows.iter().all(|r| (r.distances[0], *r.distances.last().unwrap()) == (10.0, 50.0)));
    assert!([1.0, 9.0].iter().all(|end| rows.iter().any(|r| r.point.drive == *end)));
    let one = study("4", "{ from = 10, to = 50, steps = 40000 }", "{ from = 1, to = 9, steps = 3 }");
    assert_eq!(taps(&spread(&one).0), 1998);
}

#[test]
fn a_large_space_has_its_corners_and_rows_of_its_own() {
    let text = "{ min = 2, max = 9, samples = 100000 }";
    let mut tilted = study(
        text,
        "{ from = 10, to = 50, steps = 100 }",
        "[1, 9]\ntilt = { from = -20, to = 30, steps = 11 }\nlean = 5",
    );
    let rows = ComparedRows::of_study(&tilted);
    for (tilt, d, drive) in [(-20.0, 2.0, 1.0), (-20.0, 9.0, 9.0), (30.0, 2.0, 9.0), (30.0, 9.0, 1.0)] {
        let there = |r: &Row| {
            let t = r.point;
            (t.tilt, t.lean, t.d, t.drive) == (tilt, 5.0, d, drive)
        };
        assert!(rows.spread.iter().any(there), "{tilt} {d} {drive}");
    }
    assert!(taps(&rows.spread) <= 2200 && taps(&rows.own) >= 1024);
    let again = |r: &Row| rows.spread.iter().any(|s| s.point == r.point);
    assert!(rows.own.iter().filter(|r| again(r)).count() * 10 < rows.own.len());
    let Space::Grid(factors) = &mut tilted.space else { panic!("a grid") };
    let layout = Layout::new(factors);
    let boxed = ComparedRows::of_box(&Wanted::of(&layout), &layout);
    let tilts = |rows: &[Row]| [-20.0, 30.0].map(|tilt| rows.iter().filter(|r| r.point.tilt == tilt).count());
    assert!(tilts(&boxed.spread).iter().chain(&tilts(&boxed.own)).all(|n| *n > 20));
    assert!(boxed.spread.iter().all(|r| r.point.lean == 5.0));
}

#[test]
fn a_long_list_is_thinned_in_whole_rows_and_every_column_has_its_ends() {
    for (designs, distances) in [(1000, 10), (5000, 1), (3, 5000)] {
        let rows = of_list(&listed(designs, distances), 0);
        assert!((1000..=LIMIT as usize).contains(&taps(&rows)), "{}", taps(&rows));
        assert!(rows.iter().all(|r| r.distances[0] == 20.0));
    }
    let rows = ComparedRows::of_listed(&listed(1000, 10));
    assert!([2.0, 2.999].iter().all(|end| rows.spread.iter().any(|r| r.point.d == *end)));
    assert!(rows.own.len() > 20);
}

fn work(more: &str, theta: &str, options: &RunOptions) -> f64 {
    let text = format!(
        "[whisker]\nD = {{ min = 8, max = 12, samples = 40000000 }}\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\ntheta = {theta}\n{more}"
    );
    let study = parse("work.toml", &text, Path::new("")).unwrap().study;
    of_study(&study, options)
}

#[test]
fn large_sweeps_pay_and_small_ones_do_not() {
    let four = RunOptions { threads: Some(4), ..RunOptions::default() };
    let ranked = "[output]\ntuples = false\ntop = 100\nby = \"K_sd\"\n";
    let read = work(ranked, "4", &four);
    assert!(read > PAYS && read < 20.0, "{read}");
    let double = RunOptions { precision: Some(Precision::F64), ..four.clone() };
    assert!(work(ranked, "4", &double) > 10.0 * read);
    let friction = format!("[model]\nextension = true\ncontact = {{ coulomb = 0.3 }}\n{ranked}");
    assert!(work(&friction, "4", &double) > work(ranked, "4", &double));
    assert_eq!(work(&format!("[model]\ngeometry = \"linear\"\n{ranked}"), "4", &double), 0.0);
    let gridded = work(ranked, "{ from = 1, to = 10, steps = 10 }", &four);
    assert!(gridded < read, "{gridded} {read}");
}

fn found(sd: f64, distance: f64, strain: f64) -> Found {
    let score = Score { figures: [sd, distance, 0.0], ..score(sd, strain) };
    Found { point: Tuple::default(), score }
}

#[test]
fn only_what_no_other_beats_stays() {
    let all = vec![
        found(3.0, 1.0, -0.1),
        found(1.0, 3.0, -0.1),
        found(2.0, 2.0, -0.1),
        found(2.0, 2.5, -0.1),
        found(2.5, 2.0, -0.1),
        found(0.5, 0.5, 0.1),
        found(0.1, f64::NAN, -0.1),
    ];
    let front: Vec<_> = nondominated(all).iter().map(figures).collect();
    assert_eq!(front, [[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]]);
    assert_eq!(hypervolume(&front, [3.0, 3.0]), 1.0);
    assert_eq!(hypervolume(&front, [4.0, 4.0]), 1.0 + 2.0 + 3.0);
    assert_eq!(front::spread(&front), 0.0);
    assert!(front::spread(&[[0.0, 3.0], [1.0, 1.0], [3.0, 0.0]]) < 1e-12);
    assert!(front::spread(&[[0.0, 4.0], [1.0, 3.0], [4.0, 0.0]]) > 0.4);
}

#[test]
fn the_worst_tenth_takes_its_share_of_the_next_value() {
    let values: Vec<f64> = (1..=25).map(f64::from).collect();
    assert_eq!(measure(Measure::Mean, values.clone()), 13.0);
    // 2.5 values: 25, 24 and half of 23.
    assert!((measure(Measure::Cvar90, values) - (25.0 + 24.0 + 11.5) / 2.5).abs() < 1e-12);
    assert!(measure(Measure::Mean, vec![]).is_nan() && measure(Measure::Cvar90, vec![]).is_nan());
}

#[test]
fn nine_of_ten_samples_keep_the_limits() {
    let robust = Robust {
        sd: [0.0; COLUMNS],
        properties: Vec::new(),
        samples: 10,
        measure: Measure::Mean,
        calibrated: Calibrated::Each,
    };
    let with = |bad: usize| {
        let all: Vec<Score> = (0..10).map(|i| score(1.0, if i < bad { 0.5 } else { -0.5 })).collect();
        gather(&robust, &score(1.0, -0.5), &all).violation()
    };
    assert_eq!((with(0), with(1), with(2)), (0.0, 0.0, 0.5));
}

#[test]
fn samples_are_normal_cut_at_three_sigma() {
    for seed in [0, 1, 7, u64::MAX] {
        let all = deviations(seed, 1024);
        for column in 0..COLUMNS {
            let of = |power: i32| all.iter().map(|s| s[column].powi(power)).sum::<f64>() / 1024.0;
            assert!(all.iter().all(|s| s[column].abs() <= 3.0));
            // Variance of a normal distribution cut at ±3σ: 0.97334.
            assert!(of(1).abs() < 5e-3 && (of(2) - 0.973_34).abs() < 5e-3, "{} {}", of(1), of(2));
        }
    }
    assert_ne!(deviations(1, 2), deviations(2, 2));
}

fn score(sd: f64, strain: f64) -> Score {
    let mut s = Score { figures: [sd, 1.0, 1.0], ..Score::NOTHING };
    s.set(Limit::Strain, strain);
    s
}

#[test]
fn feasibility_comes_before_the_objective() {
    let order = |s: &Score| Goal::Figure(0).order(s);
    let mut outside = score(1e-9, -1.0);
    outside.set(Limit::Reach, 1e-3);
    let ranked = [
        score(0.0, -0.5),
        score(1e-300, -0.5),
        score(1e-7, -0.5),
        score(1.000_000_01e-7, 0.0),
        score(1e9, -0.1),
        score(1e-9, 1e-6),
        score(1e-12, 2.0),
        score(1e-12, f64::INFINITY),
        outside,
    ];
    for w in ranked.windows(2) {
        assert!(order(&w[0]) < order(&w[1]), "{w:?}");
    }
    assert!(order(&score(f64::NAN, -1.0)) > order(&score(1e9, -1.0)));
    assert!(!Goal::Capped(0.5).feasible(&score(0.6, -1.0)));
    assert!(Goal::Capped(0.5).feasible(&score(0.4, -1.0)));
}
