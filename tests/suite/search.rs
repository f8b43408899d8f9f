//! Searches against dense sweeps with local refinement: these find no better design. The ignored tests compare with 10⁷ designs and ten seeds.

use crate::common::searching::{brute, dense, search};
use crate::common::sweeping::{CPU, GPU, Place};
use nalgebra::{DMatrix, DVector};
use vibrissa::optimise::polish::{Quadratic, Stencil, step};
use vibrissa::optimise::score::{Goal, Limit, Score};

const TAPS: &str = "[tap]\na = { from = 21, to = 48, step = 3 }\n";

type Problem = (&'static str, Goal, String);

fn problems() -> Vec<Problem> {
    let spec = |gauge: &str, model: &str, optimise: &str| {
        format!("[whisker]\nL_a = 50\n[gauge]\n{gauge}\n{TAPS}{model}\n[optimise]\n{optimise}\n")
    };
    let five = "variables = { D = [8, 12], d = [2, 10], x_ss = [3, 15], l = [1, 4], theta = [0.5, 10] }";
    vec![
        (
            "noise, strain and force limits",
            Goal::Figure(1),
            spec(
                "noise_strain = 20e-6",
                "",
                &format!(
                    "objective = \"distance\"\n{five}\nlimits = {{ force_N = 1.0, unambiguous = true, tip_not_wider = true }}"
                ),
            ),
        ),
        (
            "no noise",
            Goal::Figure(0),
            spec("", "", &format!("objective = \"sd\"\n{five}\nlimits = {{ tip_not_wider = true }}")),
        ),
        (
            "noise, shear and surface",
            Goal::Figure(1),
            spec(
                "noise_strain = 50e-6",
                "[model]\nshear = true\nextension = true\nsurface = true",
                &format!("objective = \"distance\"\n{five}\nlimits = {{ force_N = 0.8 }}"),
            ),
        ),
        (
            "weighted, shear, Timoshenko's theory, hub",
            Goal::Figure(2),
            format!(
                "[whisker]\nD = 10\nL_a = 50\nhub = 6\n[gauge]\nl = 2\nnoise_strain = 20e-6\n{TAPS}[model]\nshear = true\nextension = true\n[estimate]\ntheory = \"timoshenko\"\n\
                 [optimise]\nobjective = \"weighted\"\nweights = {{ sd = 1, distance = 2 }}\nvariables = {{ d = [2, 10], x_ss = [3, 15], theta = [0.5, 10] }}\n\
                 limits = {{ strain = 0.02, unambiguous = true }}"
            ),
        ),
    ]
}

/// Fails if the best of any seed exceeds the best of [`brute`] by more than `allowed`, relative.
fn compare(dense: (u32, usize), seeds: u64, place: Place, allowed: f64) {
    for (name, goal, text) in problems() {
        let begun = std::time::Instant::now();
        let dense = goal.value(&brute(&text, goal, dense, place).score);
        let dense_seconds = begun.elapsed().as_secs_f64();
        let reports: Vec<_> =
            (1..=seeds).map(|seed| search(&format!("{text}\nseed = {seed}\n"), place)).collect();
        let excess = reports.iter().map(|r| r.value / dense - 1.0).fold(f64::NEG_INFINITY, f64::max);
        let evaluations: Vec<u64> = reports.iter().map(|r| r.evaluations).collect();
        let seconds = reports.iter().map(|r| r.seconds[1]).sum::<f64>() / seeds as f64;
        println!(
            "| {name} | {dense:.6e} | {dense_seconds:.0} | {excess:+.1e} | {}…{} | {seconds:.2} |",
            evaluations.iter().min().unwrap(),
            evaluations.iter().max().unwrap(),
        );
        assert!(excess <= allowed, "{name}: a seed is {excess:e} worse than the dense sweep's {dense}");
        for r in &reports {
            assert!(goal.feasible(&r.best.score), "{name}: {:?}", r.best.score);
        }
    }
}

#[test]
fn no_seed_loses_to_a_dense_sweep() {
    compare((1 << 14, 3), 2, CPU, 1e-3);
}

#[test]
#[ignore = "takes minutes: 10⁷ designs, ten seeds"]
fn no_seed_of_ten_loses_to_ten_million_designs() {
    compare((10_000_000, 10), 10, GPU, 1e-3);
}

/// The largest relative margin, in both figures, by which a design of a dense sweep dominates a point of the front.
fn beaten((text, least): &(String, usize), designs: u32, place: Place) -> f64 {
    let report = search(text, place);
    let found = report.front.expect("a front");
    let front: Vec<[f64; 2]> =
        found.points.iter().map(|p| [p.score.figures[0], p.score.figures[1]]).collect();
    // None of its points beats another; the area that they beat.
    assert!(front.windows(2).all(|w| w[0][0] < w[1][0] && w[0][1] > w[1][1]), "{front:?}");
    let area: f64 = front.windows(2).map(|w| (w[1][0] - w[0][0]) * (front[0][1] - w[0][1])).sum();
    assert!((found.hypervolume - area).abs() <= 1e-9 * area, "{} {area}", found.hypervolume);
    assert!(front.len() >= *least, "{}", front.len());
    let (mut worst, mut kept) = (f64::NEG_INFINITY, 0u64);
    dense(text, designs, place, &mut |scores| {
        for s in scores.iter().filter(|s| s.violation() == 0.0 && s.figures[1].is_finite()) {
            kept += 1;
            let margin = |f: &[f64; 2]| (1.0 - s.figures[0] / f[0]).min(1.0 - s.figures[1] / f[1]);
            worst = front.iter().map(margin).fold(worst, f64::max);
        }
    });
    assert!(kept > u64::from(designs) / 200, "only {kept} designs keep the limits");
    println!("| {} | {} | {kept} | {worst:+.1e} |", front.len(), report.evaluations);
    worst
}

/// Problems with two objectives, and the smallest size of their front. With the surface on, a theory without it makes one design best in both.
fn fronts() -> Vec<(String, usize)> {
    let problems = problems();
    let of = |i: usize, word: &str| problems[i].2.replace(word, "\"pareto\"");
    vec![(of(0, "\"distance\""), 100), (of(3, "\"weighted\""), 50), (of(2, "\"distance\""), 1)]
}

#[test]
fn no_point_of_a_front_loses_to_a_dense_sweep() {
    assert!(fronts().iter().map(|front| beaten(front, 1 << 16, CPU)).all(|worst| worst < 5e-3));
}

#[test]
#[ignore = "takes minutes: 10⁶ designs"]
fn no_point_of_a_front_loses_to_a_million_designs() {
    assert!(fronts().iter().map(|front| beaten(front, 1_000_000, GPU)).all(|worst| worst < 5e-3));
}

/// What polishes read of functions, also next to bounds, and where they go: to the end of box and limits, or, where these cannot be kept, as near as can be.
#[test]
fn quadratics_are_read_exactly_and_steps_keep_to_bounds_and_limits() {
    let of = |value, slope: &[f64], curvature: &[f64]| Quadratic {
        value,
        slope: DVector::from_row_slice(slope),
        curvature: DMatrix::from_row_slice(slope.len(), slope.len(), curvature),
    };
    let truth = of(0.7, &[1.0, -2.0, 0.3], &[2.0, 0.5, -1.0, 0.5, 3.0, 0.2, -1.0, 0.2, -4.0]);
    for u in [[0.5, 0.5, 0.5], [0.0, 1.0, 0.99], [1.0, 0.003, 0.0]] {
        let stencil = Stencil::new(&u, 0.01);
        let from = |x: &Vec<f64>| DVector::from_fn(3, |i, _| x[i] - u[i]);
        let values: Vec<f64> = stencil.places.iter().map(|x| truth.at(&from(x))).collect();
        let model = stencil.model(&values);
        let numbers = |q: &Quadratic| [q.slope.as_slice(), q.curvature.as_slice()].concat();
        assert!(numbers(&model).iter().zip(numbers(&truth)).all(|(a, b)| (a - b).abs() < 1e-9), "{model:?}");
    }
    // min (x − 2)² + (y − 1)² in the box with x² + y² ≤ 1 and x + y ≤ 1.2; a limit that the box does not keep; a saddle.
    let goal = of(5.0, &[-4.0, -2.0], &[2.0, 0.0, 0.0, 2.0]);
    let disc = of(-1.0, &[0.0; 2], &[2.0, 0.0, 0.0, 2.0]);
    let edge = of(-1.2, &[1.0; 2], &[0.0; 4]);
    let far = of(3.0, &[-1.0, 0.0], &[0.0; 4]);
    let saddle = of(0.0, &[0.1, 0.0], &[2.0, 0.0, 0.0, -2.0]);
    for (goal, limits, x, y) in [
        (&goal, vec![], 1.0, Some(1.0)),
        (&goal, vec![disc.clone()], 0.8f64.sqrt(), Some(0.2f64.sqrt())),
        (&goal, vec![disc, edge], 0.6 + 0.14f64.sqrt(), Some(0.6 - 0.14f64.sqrt())),
        (&goal, vec![far], 1.0, None),
        (&saddle, vec![], -0.05, None),
    ] {
        let p = step(goal, &limits, [&[-1.0; 2], &[1.0; 2]]);
        assert!((p[0] - x).abs() < 1e-8 && y.is_none_or(|y| (p[1] - y).abs() < 1e-8), "{p:?} for {x} {y:?}");
    }
}

#[test]
fn feasibility_comes_before_the_objective() {
    let score = |sd: f64, strain: f64| {
        let mut s = Score { figures: [sd, 1.0, 1.0], ..Score::NOTHING };
        s.set(Limit::Strain, strain);
        s
    };
    let order = |s: &Score| Goal::Figure(0).order(s);
    let mut outside = score(1e-9, -1.0);
    outside.set(Limit::Reach, 1e-3);
    let kept = [(0.0, -0.5), (1e-300, -0.5), (1e-7, -0.5), (1.000_000_01e-7, 0.0), (1e9, -0.1)];
    let broken = [(1e-9, 1e-6), (1e-12, 2.0), (1e-12, f64::INFINITY)];
    let ranked: Vec<Score> =
        kept.into_iter().chain(broken).map(|(sd, strain)| score(sd, strain)).chain([outside]).collect();
    assert!(ranked.windows(2).all(|w| order(&w[0]) < order(&w[1])));
    assert!(!Goal::Capped(0.5).feasible(&score(0.6, -1.0)) && Goal::Capped(0.5).feasible(&score(0.4, -1.0)));
}
