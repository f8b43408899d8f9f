//! Modes of a posterior over ln a.

use super::{Joint, Mode, NONE, POINTS, lagrange};

const NOTHING: f64 = 60.0;

/// Modes with fewer steps per standard deviation are described by a parabola, wider ones by all their points.
pub(super) const NARROW: f64 = 2.0;

pub(super) fn at(joint: &Joint, heights: &[f64], x: f64) -> f64 {
    let (k, t) = joint.place(x);
    lagrange(t).iter().zip(&heights[k..]).map(|(w, h)| w * h).sum()
}

pub(super) fn top_of(joint: &Joint, heights: &[f64], k: usize) -> (f64, f64, f64) {
    let step = joint.inverse.grid[1];
    // A parabola is exact for a linear signal, however narrow the mode.
    let m = k.clamp(1, POINTS - 2);
    let [p, q, r] = [m - 1, m, m + 1].map(|i| heights[i]);
    let (slope, bend) = (0.5 * (r - p), 2.0 * q - p - r);
    let t = if bend > 0.0 { (slope / bend).clamp(-1.0, 1.0) } else { k as f64 - m as f64 };
    let sd = if bend > 0.0 { step / bend.sqrt() } else { f64::INFINITY };
    (joint.x(m) + t * step, sd, q + slope * t - 0.5 * bend * t * t)
}

pub(super) fn modes(joint: &Joint, heights: &[f64]) -> Vec<Mode> {
    let step = joint.inverse.grid[1];
    let last = POINTS - 1;
    let higher =
        |k: usize, other: usize| heights[k] > heights[other] || heights[k] == heights[other] && k < other;
    let tops = (0..POINTS).filter(|&k| (k == 0 || higher(k, k - 1)) && (k == last || higher(k, k + 1)));
    let found: Vec<(f64, f64, f64)> =
        tops.map(|k| top_of(joint, heights, k)).filter(|m| m.2.is_finite()).collect();
    let top = found.iter().map(|m| m.2).fold(f64::NEG_INFINITY, f64::max);
    let mut all = Vec::new();
    for (i, &(x, sd, height)) in found.iter().enumerate() {
        let lower = if i > 0 { 0.5 * (x + found[i - 1].0) } else { joint.x(0) };
        let upper = found.get(i + 1).map_or(joint.x(last), |next| 0.5 * (x + next.0));
        let narrow = sd < NARROW * step;
        let mass = if narrow {
            (height - top).exp() * sd * (2.0 * std::f64::consts::PI).sqrt()
        } else {
            let own = (0..POINTS).filter(|k| (lower..=upper).contains(&joint.x(*k)));
            own.map(|k| density(heights[k], top)).sum::<f64>() * step
        };
        let sd = if narrow { sd } else { wide(joint, heights, (lower, upper), top).unwrap_or(step) };
        all.push(Mode { at: x, sd, share: mass });
    }
    let total: f64 = all.iter().map(|mode| mode.share).sum();
    all.iter_mut().for_each(|mode| mode.share /= total);
    all.retain(|mode| mode.share > NONE);
    all.reverse();
    all
}

pub(super) fn density(height: f64, top: f64) -> f64 {
    if height > top - NOTHING { (height - top).exp() } else { 0.0 }
}

fn wide(joint: &Joint, heights: &[f64], (lower, upper): (f64, f64), top: f64) -> Option<f64> {
    let own: Vec<(f64, f64)> = (0..POINTS)
        .filter(|k| (lower..=upper).contains(&joint.x(*k)))
        .map(|k| (joint.x(k), density(heights[k], top)))
        .collect();
    let mass: f64 = own.iter().map(|p| p.1).sum();
    let mean = own.iter().map(|p| p.0 * p.1).sum::<f64>() / mass;
    let variance = own.iter().map(|p| (p.0 - mean).powi(2) * p.1).sum::<f64>() / mass;
    (variance > 0.0).then(|| variance.sqrt())
}

pub(super) fn spread(modes: &[Mode]) -> f64 {
    let mean = modes.iter().map(|m| m.share * m.at.exp()).sum::<f64>();
    let square = |m: &Mode| m.share * ((m.sd * m.at.exp()).powi(2) + (m.at.exp() - mean).powi(2));
    modes.iter().map(square).sum::<f64>().sqrt()
}
