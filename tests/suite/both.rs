//! Distances from the strains of two gauges by the model itself (`[estimate] theory = "exact"`, `second = true`), against the reference.

use std::collections::HashMap;

use crate::common::measuring::REAL;
use crate::common::searching;
use crate::common::specs;
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, REFERENCE, number, sweep, tap};
use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Task};
use vibrissa::optimise::evaluate::Scorer;
use vibrissa::optimise::score::deviations;
use vibrissa::scene::{COLUMNS, Direction, Setup, Tuple};

const NOISE: f64 = 15e-6;
const EXACT: &str = "[estimate]\ntheory = \"exact\"\n";

fn spec(d: f64, gauge: &str, tap: &str, more: &str) -> String {
    format!(
        "[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nl = 2\nsecond = true\nnoise_strain = {NOISE:e}\n{gauge}\n[tap]\n{tap}\n{more}{EXACT}"
    )
}

/// ε₁ and ε₂ by the reference; the sign is chosen so that ε₁ is positive.
fn strains(setup: &Setup, whisker: Tuple, a: f64, tilt: f64) -> [f64; 2] {
    let designs = [Design::new(setup, whisker)];
    let direction = Direction { tilt, lean: whisker.lean };
    let task = Task { design: 0, a, direction, drive: whisker.drive };
    let found = Evaluator::new(setup, REFERENCE.open(setup)).run(&designs, &[task]).expect("a tap")[0];
    [found.strain, found.strain_2].map(|e| e * found.strain.signum())
}

/// σ_a from the noise of both gauges, by fourth-order differences of the reference.
fn spread(setup: &Setup, whisker: Tuple) -> f64 {
    let slope = |h: f64, at: &dyn Fn(f64) -> [f64; 2]| {
        let [m2, m1, p1, p2] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(k * h));
        [0, 1].map(|k| (m2[k] - 8.0 * m1[k] + 8.0 * p1[k] - p2[k]) / (12.0 * h))
    };
    let by_a = slope(0.01, &|h| strains(setup, whisker, whisker.a + h, whisker.tilt));
    let by_tilt = slope(0.1, &|h| strains(setup, whisker, whisker.a, whisker.tilt + h));
    NOISE * by_tilt[0].hypot(by_tilt[1]) / (by_a[0] * by_tilt[1] - by_a[1] * by_tilt[0]).abs()
}

const FAR: &str = "a = [21, 30, 45]\ntilt = [-50, -15, 0, 1e-6, 30, 50]\nlean = [0, 20]";

#[test]
fn a_tap_is_told_where_it_is() {
    let angles = &format!("{FAR}\ntheta = [1, 8]");
    let displaced = &format!("drive = \"displacement\"\n{FAR}\ndelta = [1, 4]");
    let pole = "[model]\nsurface = true\npole_radius = 3\n";
    let cases = [
        ("tapered", spec(4.0, "x_ss = 5", angles, "")),
        ("cylinder", spec(10.0, "x_ss = 5", angles, pole)),
        ("real", spec(7.0, "x_ss = 5", angles, REAL)),
        ("far side", spec(7.0, "x_ss = 5\nside = \"far\"", angles, REAL)),
        ("displaced", spec(4.0, "x_ss = 5", displaced, REAL)),
        ("linear", spec(4.0, "x_ss = 5", angles, "[model]\ngeometry = \"linear\"\nshear = true\n")),
    ];
    for (name, text) in &cases {
        let setup = specs::parse(text).expect("a spec").study.setup;
        let device = (*name == "real").then_some((GPU, 1e-4));
        // All backends have the same taps: their spread by the reference is computed once.
        let mut spreads = HashMap::new();
        for (place, bound) in [(CPU_F64, 3e-5), (CPU, 1e-4)].into_iter().chain(device) {
            let (mut worst, mut taps) = (0.0f64, 0);
            for row in &sweep(text, place).tuples.rows {
                if ["slipped_off", "not_converged"].iter().any(|word| row["status"].contains(word)) {
                    continue;
                }
                assert_eq!(number(row, "error_mm"), Some(0.0), "{name}: {row:?}");
                assert!(!row["status"].contains("ambiguous"), "{name}: {row:?}");
                let (tap, sigma) = (tap(row), number(row, "sigma_mm").expect("a spread"));
                let key = tap.to_array().map(f64::to_bits);
                let wanted = *spreads.entry(key).or_insert_with(|| spread(&setup, tap));
                (worst, taps) = (worst.max((sigma / wanted - 1.0).abs()), taps + 1);
            }
            println!("{name} {place:?}: σ within {worst:.1e} at {taps} taps");
            assert!(worst < bound && taps >= 50, "{name} {place:?}: {worst} at {taps}");
        }
    }
}

/// At an upright pole, with no centreline strain, the second gauge reads 0: the answer is that of one gauge.
#[test]
fn upright_poles_are_told_as_by_one_gauge() {
    for (d, gauge, a) in [
        (4.0, "x_ss = 5", "{ from = 21, to = 48, step = 9 }"),
        // Taps before the peak of the strain; some have a second distance farther out, some one nearer.
        (10.0, "x_ss = 15", "[20, 25, 31, 40, 48]"),
        (10.0, "x_ss = 15", "[16, 18, 48]"),
    ] {
        let text = spec(d, gauge, &format!("a = {a}\ntheta = [1, 5]"), "");
        for place in [CPU_F64, CPU] {
            let both = sweep(&text, place).tuples.rows;
            let alone = sweep(&text.replace("second = true\n", ""), place).tuples.rows;
            for (both, alone) in both.iter().zip(&alone) {
                let said = format!("{place:?} {both:?} {alone:?}");
                assert_eq!(both["status"], alone["status"], "{said}");
                let close = |column: &str, bound: f64| {
                    let [p, q] = [both, alone].map(|row| number(row, column).expect("a number"));
                    assert!((p - q).abs() <= bound * q.abs(), "{column}: {said}");
                };
                close("distance_mm", 2e-5);
                close("sigma_mm", 1e-3);
            }
        }
    }
}

/// Two taps have the same two strains: the near one is answered with the far distance and `ambiguous`.
#[test]
fn a_tilted_tap_before_the_peak_is_taken_for_its_farther_twin() {
    let text = spec(10.0, "x_ss = 15", "a = [27, 44]\ntilt = 25\nlean = [0, 15]\ntheta = [1, 5]", REAL);
    let setup = specs::parse(&text).expect("a spec").study.setup;
    let rows = sweep(&text, CPU_F64).tuples.rows;
    let mut seen = 0;
    for row in rows.iter().filter(|row| number(row, "a_mm") == Some(27.0)) {
        let (near, a) = (tap(row), number(row, "distance_mm").expect("a distance"));
        assert!(a > 30.0 && row["status"].contains("ambiguous"), "{row:?}");
        let wanted = strains(&setup, near, near.a, near.tilt);
        let off = |tilt: f64| {
            let [e1, e2] = strains(&setup, near, a, tilt);
            e2 / e1 - wanted[1] / wanted[0]
        };
        let (mut lo, mut hi) = (near.tilt - 5.0, near.tilt + 5.0);
        for _ in 0..40 {
            let mid = 0.5 * (lo + hi);
            if off(mid) < 0.0 { lo = mid } else { hi = mid }
        }
        let found = strains(&setup, near, a, lo);
        assert!((0..2).all(|k| (found[k] / wanted[k] - 1.0).abs() < 1e-5), "{found:?} {wanted:?}");
        seen += 1;
    }
    assert_eq!(seen, 4);
}

const SEARCH: &str = "[whisker]\nL_a = 50\nD = 10\n[gauge]\nx_ss = 5\nl = 2\nsecond = true\nnoise_strain = 0\n[tap]\na = [21, 30, 45]\n\
                      [optimise]\nobjective = \"distance\"\nvariables = { d = [3, 10], theta = [1, 10] }\n";

fn total(robust: &str, place: Place) -> (f64, Setup, Vec<[f64; COLUMNS]>) {
    let (spec, search) = searching::parse(&format!("{SEARCH}robust = {{ {robust} }}\n{REAL}{EXACT}"));
    let (setup, layout) = (&spec.study.setup, searching::layout(&spec));
    let mut scorer = Scorer::new(setup, &layout, &search, place.open(setup));
    let score = scorer.scores(&[NOMINAL]).expect("taps")[0];
    (score.figures[1], setup.clone(), deviations(search.seed, 3))
}

const NOMINAL: Tuple =
    Tuple { D: 10.0, d: 5.0, L_a: 50.0, x_ss: 5.0, l: 2.0, a: 0.0, tilt: 0.0, lean: 0.0, drive: 5.0, rig: 0 };

/// A whisker calibrated itself has no bias at any tilt; otherwise the nominal model inverts the strains of the built whisker.
#[test]
fn tolerances_are_read_with_the_nominal_model() {
    let each = total("tilt = 5, D = 0.05, samples = 3", CPU_F64).0;
    assert!(each < 1e-9, "{each}");
    let (nominal, setup, z) =
        total("D = 0.05, x_ss = 0.1, theta = 0.02, tilt = 5, samples = 3, calibrated = \"nominal\"", CPU_F64);
    let sd = [0.05, 0.0, 0.0, 0.1, 0.0, 0.0, 5.0, 0.0, 0.02];
    let mut wanted = 0.0;
    for z in z {
        let built: [f64; COLUMNS] = std::array::from_fn(|k| NOMINAL.to_array()[k] + sd[k] * z[k]);
        let built = Tuple::from_array(built);
        let squares = [21.0, 30.0, 45.0].map(|a| {
            let shown = strains(&setup, built, a, built.tilt);
            // At each distance, the tilt follows from the ratio of the strains; bisection in the distance matches their size.
            let quotient = |[e1, e2]: [f64; 2]| (e2 / e1).atan().to_degrees();
            let tilt_at = |a: f64| {
                let better = |tilt: f64| tilt + quotient(shown) - quotient(strains(&setup, NOMINAL, a, tilt));
                (0..6).fold(0.0, |tilt, _| better(tilt))
            };
            let (mut lo, mut hi) = (a - 3.0, a + 3.0);
            for _ in 0..22 {
                let mid = 0.5 * (lo + hi);
                let [e1, e2] = strains(&setup, NOMINAL, mid, tilt_at(mid));
                if e1.hypot(e2) > shown[0].hypot(shown[1]) { lo = mid } else { hi = mid }
            }
            (lo - a).powi(2)
        });
        wanted += (squares.iter().sum::<f64>() / 3.0).sqrt() / 3.0;
    }
    println!("{nominal} mm against {wanted}");
    assert!((nominal / wanted - 1.0).abs() < 1e-4, "{nominal} {wanted}");
}
