//! Shares of variance: the part of a figure's variance over a box that one variable causes, alone and with all others.
//!
//! Lines along a variable, all at the same levels of it, form a two-way table. Its sum of squares splits between and within levels, and between and
//! within lines (R. A. Fisher). The share between levels is the first-order index Var(E[y|x])/Var(y) of I. M. Sobol' (1993); the share within lines
//! is the total index E[Var(y|all others)]/Var(y). Both lie in [0, 1], and are exact if a variable has no effect, or all of it. Missing values are
//! left out. Estimators on pairs of points (A. Saltelli et al., Comput. Phys. Commun. 181, 2010) leave [0, 1] for heavy tails.

use crate::scene::sampler::Sampler;

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
    let found = Squares::of(lines, &whole)?;
    let halves: Vec<Squares> = [&whole[..half(lines)], &whole[half(lines)..]]
        .iter()
        .filter_map(|h| Squares::half(lines, h))
        .collect();
    let resampled: Vec<Squares> =
        (0..RESAMPLES).filter_map(|r| Squares::of(lines, &resample(lines, r))).collect();
    let share = |k: usize| {
        let value = found.shares()[k];
        let mut drawn: Vec<f64> = resampled.iter().map(|s| s.shares()[k]).collect();
        drawn.sort_by(f64::total_cmp);
        let beyond = BEYOND.min(drawn.len().saturating_sub(1) / 2);
        let [low, high] = match drawn.len() {
            0 => [0.0, 1.0],
            n => [drawn[beyond], drawn[n - 1 - beyond]],
        };
        // Resampling overestimates a share next to 0: its mirror image is included. The difference of the halves shows the error from few levels.
        let apart = match halves.as_slice() {
            [a, b] => 0.5 * (a.shares()[k] - b.shares()[k]).abs(),
            _ => 0.0,
        };
        let (low, high) = (low.min(2.0 * value - high), high.max(2.0 * value - low));
        Share { value, interval: [(low - apart).max(0.0), (high + apart).min(1.0)] }
    };
    Some(Shares { first: share(0), total: share(1) })
}

fn half(lines: &[Line]) -> usize {
    lines.len().min(LINES / 2)
}

fn resample(lines: &[Line], r: usize) -> Vec<usize> {
    let drawn = |i: usize| {
        let (from, n) =
            if i < half(lines) { (0, half(lines)) } else { (half(lines), lines.len() - half(lines)) };
        let chance = u64::from(Sampler::Random.coordinate(1, r as u32, i as u32));
        from + ((chance * n as u64) >> 32) as usize
    };
    (0..lines.len()).map(drawn).collect()
}

#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    levels: [f64; 2],
    lines: [f64; 2],
}

impl Squares {
    /// Sums over the lines `chosen`, each half separately; `None` if the values do not vary.
    fn of(lines: &[Line], chosen: &[usize]) -> Option<Self> {
        let (first, second) = chosen.split_at(half(lines));
        let both = [Self::half(lines, first), Self::half(lines, second)];
        both.into_iter().flatten().reduce(|a, b| Self {
            levels: [a.levels[0] + b.levels[0], a.levels[1] + b.levels[1]],
            lines: [a.lines[0] + b.lines[0], a.lines[1] + b.lines[1]],
        })
    }

    fn half(lines: &[Line], chosen: &[usize]) -> Option<Self> {
        let mut squares = Self::default();
        let (mut of_lines, mut of_levels) = (Weighted::default(), Weighted::default());
        let mut levels = [Weighted::default(); LEVELS];
        for i in chosen {
            let mut line = Weighted::default();
            for (x, level) in lines[*i].iter().zip(&mut levels).filter(|(x, _)| x.is_finite()) {
                line.push(*x, 1.0);
                level.push(*x, 1.0);
            }
            of_lines.push(line.mean, line.weight);
            squares.lines[1] += line.squares;
        }
        for level in levels {
            of_levels.push(level.mean, level.weight);
            squares.levels[1] += level.squares;
        }
        (squares.lines[0], squares.levels[0]) = (of_lines.squares, of_levels.squares);
        (squares.lines[0] + squares.lines[1] > 0.0).then_some(squares)
    }

    fn shares(&self) -> [f64; 2] {
        let ([of, rest], [other, within]) = (self.levels, self.lines);
        [of / (of + rest), within / (other + within)]
    }
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
