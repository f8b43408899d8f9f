//! Sensitivity to each parameter: at the optimum, and over the whole box as the part of a figure's variance that one variable causes, alone and with
//! all others.
//!
//! Lines along a variable, all at the same levels of it, form a two-way table. Its sum of squares splits between and within levels, and between and
//! within lines (R. A. Fisher). The share between levels is the first-order index Var(E[y|x])/Var(y) of I. M. Sobol' (1993); the share within lines
//! is the total index E[Var(y|all others)]/Var(y). Both lie in [0, 1], and are exact if a variable has no effect, or all of it. Missing values are
//! left out. Estimators on pairs of points (A. Saltelli et al., Comput. Phys. Commun. 181, 2010) leave [0, 1] for heavy tails.

use super::session::{quantities, value};
use super::{Score, Scorer, Variables};
use crate::error::Error;
use crate::scene::{Property, Quantity, Sampler, Tuple};

const STEP: f64 = 1e-3;

/// Values for K_sd and for total_rms_mm; `None` if not computable.
pub type Pair = [Option<f64>; 2];

/// Sensitivities of the nominal whisker, without tolerances.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Elasticities ∂ln F/∂ln p at the optimum, % per %.
    pub local: Vec<(Quantity, Pair)>,
    /// Sobol' indices: shares of the variance of ln K_sd and of ln total_rms_mm due to each variable over its bounds.
    pub global: Vec<(Quantity, [Option<Shares>; 2])>,
    /// Number of evaluated points: fewer after a stop or if time ran out.
    pub samples: u32,
    /// Points with K_sd > 0 and with total_rms_mm > 0; the shares use these.
    pub complete: [u32; 2],
    pub evaluations: u64,
}

fn elasticities(scorer: &mut Scorer<'_>, best: &Tuple) -> Result<Vec<(Quantity, Pair)>, Error> {
    let setup = scorer.judge.setup;
    let rigs = setup.rigs.as_deref();
    let parameters: Vec<Quantity> = quantities(setup).collect();
    let moved = |quantity: Quantity, share: f64| match (quantity, rigs) {
        (Quantity::Property(property), Some(rigs)) => {
            let values = rigs.properties.iter().zip(rigs.values(best.rig));
            let by = |own: Property| if own == property { 1.0 + share } else { 1.0 };
            let values: Vec<f64> = values.map(|(own, value)| value * by(*own)).collect();
            let scale = by(Property::Scale);
            Tuple { D: scale * best.D, d: scale * best.d, rig: rigs.number(&values), ..*best }
        }
        (Quantity::Property(_), None) => *best,
        (Quantity::Column(column), _) => {
            let mut values = best.to_array();
            values[column as usize] *= 1.0 + share;
            Tuple::from_array(values).of_rig(best.rig)
        }
    };
    let points: Vec<Tuple> =
        parameters.iter().flat_map(|&q| [moved(q, STEP), moved(q, -STEP)]).chain([*best]).collect();
    let scores = scorer.nominal(&points, &|| true)?;
    let here = scores[points.len() - 1].figures;
    let pair = |(i, &quantity): (usize, &Quantity)| {
        let (up, down) = (scores[2 * i].figures, scores[2 * i + 1].figures);
        let slope = |f: usize| {
            // One-sided if the other side is not a valid whisker.
            let rise = match (up[f].is_finite(), down[f].is_finite()) {
                (true, true) => (up[f] - down[f]) / 2.0,
                (true, false) => up[f] - here[f],
                _ => here[f] - down[f],
            };
            let elasticity = rise / STEP / here[f];
            Some(elasticity).filter(|e| e.is_finite() && value(setup, best, quantity) != 0.0)
        };
        (quantity, [slope(0), slope(1)])
    };
    Ok(parameters.iter().enumerate().map(pair).collect())
}

/// Elasticities around `best` by `local`; shares over the box of `variables` by `global`, from the points scored until `on` returns false.
/// Shares refer to logarithms: next to a fold total_rms_mm grows as 1/|x − x₀|, so that it has no variance, while its logarithm has one.
pub fn run(
    [global, local]: &mut [Scorer<'_>; 2],
    variables: &Variables,
    best: &Tuple,
    seed: u64,
    on: &dyn Fn() -> bool,
) -> Result<Sensitivity, Error> {
    let local = elasticities(local, best)?;
    let k = variables.list.len();
    let (_, drive) = variables.place(best);
    let seed = seed.wrapping_mul(2).wrapping_add(1);
    let coordinate = |i: usize, c: usize| Sampler::Sobol.uniform(seed, c as u32, i as u32);
    let point = |i: usize, along: usize, j: usize| {
        let at = |c: usize| if c == along { level(i, j) } else { coordinate(i, c) };
        variables.point(&(0..k).map(at).collect::<Vec<_>>(), drive)
    };
    let lines = (0..LINES).flat_map(|i| (0..k).map(move |c| (i, c)));
    let points: Vec<Tuple> = lines.flat_map(|(i, c)| (0..LEVELS).map(move |j| point(i, c, j))).collect();
    let mut scores = global.nominal(&points, on)?;
    // Only complete sets of lines count.
    scores.truncate(scores.len() / (k * LEVELS) * (k * LEVELS));
    let mut found = Sensitivity {
        evaluations: (2 * local.len() + 1 + scores.len()) as u64,
        samples: scores.len() as u32,
        complete: [0; 2],
        global: variables.list.iter().map(|v| (v.quantity, [None; 2])).collect(),
        local,
    };
    for f in 0..2 {
        let value = |s: &Score| Some(s.figures[f].ln()).filter(|y| y.is_finite()).unwrap_or(f64::NAN);
        let lines: Vec<Line> =
            scores.chunks(LEVELS).map(|line| std::array::from_fn(|j| value(&line[j]))).collect();
        found.complete[f] = lines.iter().flatten().filter(|y| y.is_finite()).count() as u32;
        for (c, (_, both)) in found.global.iter_mut().enumerate() {
            let along: Vec<Line> = lines.iter().skip(c).step_by(k).copied().collect();
            both[f] = shares(&along);
        }
    }
    Ok(found)
}

/// Lines along each variable: two halves with interleaved levels.
pub const LINES: usize = 128;
pub const LEVELS: usize = 16;
/// Bootstrap samples of the confidence intervals, and how many lie beyond each end (95 % lie within).
const RESAMPLES: usize = 200;
const BEYOND: usize = 5;
pub const CONFIDENCE: f64 = 0.95;

/// Values along one line; NaN is missing.
pub type Line = [f64; LEVELS];

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    pub value: f64,
    pub interval: [f64; 2],
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// First-order index.
    pub first: Share,
    /// Total index.
    pub total: Share,
}

/// Position in [0, 1] of level `j` on line `i`: alternating around the middle of its cell, so that the mean of all is 1/2.
pub fn level(i: usize, j: usize) -> f64 {
    (j as f64 + if (i < LINES / 2) == j.is_multiple_of(2) { 0.25 } else { 0.75 }) / LEVELS as f64
}

/// Shares of the variable along which `lines` lie; `None` if the values do not vary.
pub fn shares(lines: &[Line]) -> Option<Shares> {
    let whole: Vec<usize> = (0..lines.len()).collect();
    let parts = whole.split_at(lines.len().min(LINES / 2));
    let parts = [parts.0, parts.1];
    let found = ratios(lines, &parts)?;
    let halves = parts.map(|part| ratios(lines, &[part]));
    let drawn = |r: usize| ratios(lines, &parts.map(|part| resample(part, r)));
    let resampled: Vec<[f64; 2]> = (0..RESAMPLES).filter_map(drawn).collect();
    let share = |k: usize| {
        let value = found[k];
        let mut drawn: Vec<f64> = resampled.iter().map(|shares| shares[k]).collect();
        drawn.sort_by(f64::total_cmp);
        let beyond = BEYOND.min(drawn.len().saturating_sub(1) / 2);
        let [low, high] = match drawn.len() {
            0 => [0.0, 1.0],
            n => [drawn[beyond], drawn[n - 1 - beyond]],
        };
        // Resampling overestimates a share next to 0: its mirror image is included. The difference of the halves shows the error from few levels.
        let apart = match halves {
            [Some(a), Some(b)] => 0.5 * (a[k] - b[k]).abs(),
            _ => 0.0,
        };
        let (low, high) = (low.min(2.0 * value - high), high.max(2.0 * value - low));
        Share { value, interval: [(low - apart).max(0.0), (high + apart).min(1.0)] }
    };
    Some(Shares { first: share(0), total: share(1) })
}

/// Lines of `part` drawn at random, as many as it has.
fn resample(part: &[usize], r: usize) -> Vec<usize> {
    let drawn = |i: &usize| {
        let chance = u64::from(Sampler::Random.coordinate(1, r as u32, *i as u32));
        part[((chance * part.len() as u64) >> 32) as usize]
    };
    part.iter().map(drawn).collect()
}

/// First-order and total share, from the sums over the lines of each part; `None` if the values do not vary.
fn ratios(lines: &[Line], parts: &[impl AsRef<[usize]>]) -> Option<[f64; 2]> {
    let sums = parts.iter().filter_map(|part| squares(lines, part.as_ref()));
    let [of, rest, other, within] = sums.reduce(|a, b| std::array::from_fn(|i| a[i] + b[i]))?;
    Some([of / (of + rest), within / (other + within)])
}

/// Sums of squares between levels, within levels, between lines and within lines; `None` if the values do not vary.
fn squares(lines: &[Line], part: &[usize]) -> Option<[f64; 4]> {
    let (mut of_lines, mut of_levels, mut within) = (Weighted::default(), Weighted::default(), [0.0; 2]);
    let mut levels = [Weighted::default(); LEVELS];
    for i in part {
        let mut line = Weighted::default();
        for (x, level) in lines[*i].iter().zip(&mut levels).filter(|(x, _)| x.is_finite()) {
            line.push(*x, 1.0);
            level.push(*x, 1.0);
        }
        of_lines.push(line.mean, line.weight);
        within[1] += line.squares;
    }
    for level in levels {
        of_levels.push(level.mean, level.weight);
        within[0] += level.squares;
    }
    (of_lines.squares + within[1] > 0.0).then_some([
        of_levels.squares,
        within[0],
        of_lines.squares,
        within[1],
    ])
}

/// Weighted mean and sum of squared deviations (B. P. Welford 1962; D. H. D. West 1979).
#[derive(Debug, Clone, Copy, Default)]
struct Weighted {
    weight: f64,
    mean: f64,
    squares: f64,
}

impl Weighted {
    fn push(&mut self, x: f64, weight: f64) {
        if weight > 0.0 {
            self.weight += weight;
            let from_old = x - self.mean;
            self.mean += from_old * weight / self.weight;
            self.squares += weight * from_old * (x - self.mean);
        }
    }
}
