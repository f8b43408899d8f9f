//! Local stage: a trust-region method in f64. Objective and limits are evaluated on a small stencil around the best place and modelled by quadratics
//! ([`Stencil`]). The step that minimises the model within trust region, bounds and limits is tried, also with tightened limits, because a binding
//! limit is only as good as its model. Bounds are met exactly, a binding limit from its inner side to about the square of the last radius.

use nalgebra::{DMatrix, DVector};

use super::{Found, Goal, Halt, Place, Score, Session, Stage};

const LARGEST: f64 = 0.25;
/// Limits are tightened by these multiples of the squared radius.
const MARGINS: [f64; 3] = [0.0, 0.02, 0.3];
/// Limits farther from binding than this are ignored in a step.
const FAR: f64 = -0.9;
const STEPS: u32 = 80;

/// Stage by which a polish scores, and its trust radii at the start and at the end.
#[derive(Debug, Clone, Copy)]
pub struct Radii {
    pub stage: Stage,
    pub first: f64,
    pub last: f64,
}

/// Shortest arm of a stencil in the unit box, by stage: below it the rounding of the scores disturbs the curvature.
const ARM: [f64; 2] = [1e-2, 1e-3];

/// Improves the candidate at `u` (drive `j` of the list); returns the best found.
pub fn run(session: &mut Session<'_>, goal: Goal, (mut u, j): Place, radii: Radii) -> Result<Found, Halt> {
    let (variables, stage) = (session.variables, radii.stage);
    let mut ask = |places: &[Vec<f64>]| {
        let points: Vec<_> = places.iter().map(|u| variables.point(u, j)).collect();
        session.scores(stage, &points)
    };
    let first = |all: &[Score]| (0..all.len()).min_by(|&a, &b| goal.compare(&all[a], &all[b]));
    let mut radius = radii.first;
    let mut here = ask(std::slice::from_ref(&u))?[0];
    for _ in 0..STEPS {
        if radius < radii.last {
            break;
        }
        let stencil = Stencil::new(&u, (0.5 * radius).max(ARM[stage as usize]));
        let mut scores = vec![here];
        scores.extend(ask(&stencil.places[1..])?);
        let steps = steps(goal, radius, &u, &stencil, &scores);
        let tried = ask(&steps)?;
        let (old, near) = (here, first(&scores).unwrap_or_default());
        let stepped = first(&tried).filter(|&i| goal.compare(&tried[i], &scores[near]).is_lt());
        match stepped {
            Some(i) => {
                let length = steps[i].iter().zip(&u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                radius = match length / radius {
                    full if full > 0.99 => (2.0 * radius).min(LARGEST),
                    share => radius * (2.0 * share).clamp(0.25, 1.0),
                };
                (u, here) = (steps[i].clone(), tried[i]);
            }
            None => {
                radius *= if near == 0 { 0.25 } else { 0.5 };
                (u, here) = (stencil.places[near].clone(), scores[near]);
            }
        }
        // Without any gain the radius shrinks faster.
        let (before, after) = (goal.value(&old), goal.value(&here));
        if stepped.is_some() && goal.feasible(&old) && before - after < 1e-11 * before {
            radius *= 0.25;
        }
    }
    Ok(Found { point: variables.point(&u, j), score: here })
}

/// Places to try, from the models around `u`; empty if a value is missing.
fn steps(goal: Goal, radius: f64, u: &[f64], stencil: &Stencil, scores: &[Score]) -> Vec<Vec<f64>> {
    let model = |f: &dyn Fn(&Score) -> f64| stencil.model(&scores.iter().map(f).collect::<Vec<_>>());
    let near = (0..scores[0].limits.len()).filter(|&i| scores[0].limits[i] > FAR);
    let mut limits: Vec<Quadratic> = near.map(|i| model(&|s| s.limits[i])).collect();
    if matches!(goal, Goal::Capped(_)) {
        limits.push(model(&|s| goal.cap(s)));
    }
    let scale = goal.value(&scores[0]).abs();
    let mut aim = model(&|s| goal.value(s) / scale);
    if !aim.is_finite() {
        let k = u.len();
        aim = Quadratic { value: 0.0, slope: DVector::zeros(k), curvature: DMatrix::zeros(k, k) };
    }
    limits.retain(Quadratic::is_finite);
    let lo: Vec<f64> = u.iter().map(|x| (-radius).max(-x)).collect();
    let hi: Vec<f64> = u.iter().map(|x| radius.min(1.0 - x)).collect();
    let mut steps: Vec<Vec<f64>> = Vec::new();
    for margin in MARGINS {
        let drawn = |l: &Quadratic| Quadratic { value: l.value + margin * radius * radius, ..l.clone() };
        let p = step(&aim, &limits.iter().map(drawn).collect::<Vec<_>>(), [&lo, &hi]);
        let place = u.iter().zip(&p).map(|(u, p)| snapped(u + p)).collect();
        if !steps.contains(&place) {
            steps.push(place);
        }
    }
    steps
}

fn snapped(u: f64) -> f64 {
    match u {
        u if u < 1e-9 => 0.0,
        u if u > 1.0 - 1e-9 => 1.0,
        u => u,
    }
}

/// v + gᵀp + ½ pᵀHp.
#[derive(Debug, Clone, PartialEq)]
pub struct Quadratic {
    pub value: f64,
    pub slope: DVector<f64>,
    pub curvature: DMatrix<f64>,
}

impl Quadratic {
    pub fn at(&self, p: &DVector<f64>) -> f64 {
        self.value + self.slope.dot(p) + 0.5 * p.dot(&(&self.curvature * p))
    }

    pub fn is_finite(&self) -> bool {
        self.value.is_finite() && self.slope.iter().chain(self.curvature.iter()).all(|x| x.is_finite())
    }
}

/// Places around `u` in the unit box where functions are evaluated to model them: two per axis, one per pair of axes.
#[derive(Debug, Clone)]
pub struct Stencil {
    axes: Vec<[f64; 2]>,
    pub places: Vec<Vec<f64>>,
}

impl Stencil {
    /// Arms of length `h`; both on the inner side if a bound is nearer than `h`.
    pub fn new(u: &[f64], h: f64) -> Self {
        let arms = |x: &f64| match *x {
            x if x + h > 1.0 => [-h, -2.0 * h],
            x if x - h < 0.0 => [h, 2.0 * h],
            _ => [h, -h],
        };
        let axes: Vec<[f64; 2]> = u.iter().map(arms).collect();
        let moved = |by: &[(usize, f64)]| {
            let mut place = u.to_vec();
            by.iter().for_each(|&(i, t)| place[i] = (place[i] + t).clamp(0.0, 1.0));
            place
        };
        let mut places = vec![u.to_vec()];
        for (i, arm) in axes.iter().enumerate() {
            places.extend(arm.map(|t| moved(&[(i, t)])));
        }
        for (i, a) in axes.iter().enumerate() {
            for (j, b) in axes.iter().enumerate().take(i) {
                places.push(moved(&[(i, a[0]), (j, b[0])]));
            }
        }
        Self { axes, places }
    }

    pub fn model(&self, values: &[f64]) -> Quadratic {
        let k = self.axes.len();
        let (mut slope, mut curvature) = (DVector::zeros(k), DMatrix::zeros(k, k));
        let along = |i: usize| [values[1 + 2 * i] - values[0], values[2 + 2 * i] - values[0]];
        for (i, &[s, t]) in self.axes.iter().enumerate() {
            let [a, b] = along(i);
            let (a, b) = (a / s, b / t);
            curvature[(i, i)] = 2.0 * (a - b) / (s - t);
            slope[i] = a - s * (a - b) / (s - t);
        }
        let mut corner = 1 + 2 * k;
        for i in 0..k {
            for j in 0..i {
                let mixed = values[corner] - values[0] - along(i)[0] - along(j)[0];
                curvature[(i, j)] = mixed / (self.axes[i][0] * self.axes[j][0]);
                curvature[(j, i)] = curvature[(i, j)];
                corner += 1;
            }
        }
        Quadratic { value: values[0], slope, curvature }
    }
}

const UPDATES: usize = 40;
const NEWTON_STEPS: usize = 40;

/// The step p in the box [`lo`, `hi`] that minimises `goal` with all `limits` ≤ 0: augmented Lagrangian, projected Newton steps (D. P. Bertsekas,
/// SIAM J. Control Optim. 20, 1982). If the limits cannot be kept, it violates them little. `goal` and `limits` are of order 1.
pub fn step(goal: &Quadratic, limits: &[Quadratic], [lo, hi]: [&[f64]; 2]) -> DVector<f64> {
    let mut p = DVector::from_fn(lo.len(), |i, _| 0.0f64.clamp(lo[i], hi[i]));
    let mut multipliers = vec![0.0; limits.len()];
    let (mut weight, mut before) = (10.0, f64::INFINITY);
    for _ in 0..UPDATES {
        newton(&mut p, [lo, hi], &|p| lagrangian(goal, limits, &multipliers, weight, p));
        let mut gap: f64 = 0.0;
        for (limit, m) in limits.iter().zip(&mut multipliers) {
            let value = limit.at(&p).max(-*m / weight);
            gap = gap.max(value.abs());
            *m = (*m + weight * value).max(0.0);
        }
        if gap < 1e-13 {
            break;
        }
        if gap > 0.25 * before {
            weight = f64::min(weight * 10.0, 1e9);
        }
        before = gap;
    }
    p
}

/// goal + Σ (max(0, λ + w c)² − λ²)/(2w), as a model around `p`.
fn lagrangian(
    goal: &Quadratic,
    limits: &[Quadratic],
    multipliers: &[f64],
    weight: f64,
    p: &DVector<f64>,
) -> Quadratic {
    let slope_at = |q: &Quadratic| &q.slope + &q.curvature * p;
    let mut all = Quadratic { value: goal.at(p), slope: slope_at(goal), curvature: goal.curvature.clone() };
    for (limit, m) in limits.iter().zip(multipliers) {
        let push = (m + weight * limit.at(p)).max(0.0);
        all.value += (push * push - m * m) / (2.0 * weight);
        if push > 0.0 {
            let g = slope_at(limit);
            all.slope += &g * push;
            all.curvature += &limit.curvature * push + &g * g.transpose() * weight;
        }
    }
    all
}

fn newton(p: &mut DVector<f64>, [lo, hi]: [&[f64]; 2], f: &dyn Fn(&DVector<f64>) -> Quadratic) {
    for _ in 0..NEWTON_STEPS {
        let Quadratic { value, slope, curvature } = f(p);
        let free: Vec<usize> = (0..p.len())
            .filter(|&i| !(p[i] <= lo[i] && slope[i] > 0.0 || p[i] >= hi[i] && slope[i] < 0.0))
            .collect();
        let g = slope.select_rows(&free);
        if g.iter().all(|g| *g == 0.0) {
            return;
        }
        let direction = descent(&g, curvature.select_rows(&free).select_columns(&free));
        // What is gained is less than the rounding of the value.
        if g.dot(&direction).abs() < f64::EPSILON * value.abs() {
            return;
        }
        let mut share = 1.0;
        let next = loop {
            let mut next = p.clone();
            for (&i, d) in free.iter().zip(&direction) {
                next[i] = (p[i] + share * d).clamp(lo[i], hi[i]);
            }
            if f(&next).value < value {
                break next;
            }
            share *= 0.5;
            if share < 1e-9 {
                return;
            }
        };
        let moved = (&next - &*p).amax();
        *p = next;
        if moved < 1e-15 {
            return;
        }
    }
}

/// −H⁻¹g with the eigenvalues of H made positive: Newton where H is positive definite; elsewhere it leads away from a saddle.
fn descent(g: &DVector<f64>, h: DMatrix<f64>) -> DVector<f64> {
    if !g.iter().chain(h.iter()).all(|x| x.is_finite()) {
        return DVector::zeros(g.len());
    }
    let eigen = h.symmetric_eigen();
    let least = eigen.eigenvalues.amax().max(1e-12) * 1e-10;
    let along = eigen.eigenvectors.tr_mul(g);
    let scaled = along.zip_map(&eigen.eigenvalues, |g, l| -g / l.abs().max(least));
    &eigen.eigenvectors * scaled
}
