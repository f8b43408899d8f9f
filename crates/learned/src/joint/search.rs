//! Search for the modes of a stroke's posterior.

use super::course::{COARSE, Mode, Place, Task};

const STEPS: usize = 80;
const VALLEYS: usize = 3;

impl Task<'_> {
    pub fn starts(&self) -> Vec<Place> {
        let grid = |k: usize, n: usize, i: usize| {
            let [lo, hi] = self.ends[k];
            lo + (hi - lo) * i as f64 / (n - 1) as f64
        };
        let touches = if self.course.touch.is_some() { 1 } else { COARSE[2] };
        let of = |i: usize| {
            let x = grid(0, COARSE[1], i);
            let across = self.across(x);
            let value = |c: f64| self.value_of(&across, [x, c]);
            let values: Vec<f64> =
                (0..touches).map(|k| value(grid(1, touches.max(2), k.min(touches - 1)))).collect();
            // A valley may lie between two readings: refine around each of the lowest.
            let narrowed = |k: usize| {
                let (mut at, mut least) = (grid(1, touches.max(2), k), values[k]);
                let mut step = 0.5 * (self.ends[1][1] - self.ends[1][0]) / touches as f64;
                for _ in 0..if touches > 1 { 9 } else { 0 } {
                    for c in [at - step, at + step] {
                        let there = value(c);
                        if there < least {
                            (at, least) = (c, there);
                        }
                    }
                    step *= 0.5;
                }
                (at, least)
            };
            let all = valleys(&values).into_iter().take(VALLEYS).map(narrowed);
            let (at, least) =
                all.min_by(|p, q| p.1.total_cmp(&q.1)).unwrap_or((self.ends[1][0], f64::INFINITY));
            ([x, at], least)
        };
        let all: Vec<(Place, f64)> = (0..COARSE[1]).map(of).collect();
        let least: Vec<f64> = all.iter().map(|place| place.1).collect();
        let found = valleys(&least).into_iter().filter(|i| least[*i].is_finite());
        found.take(3).map(|i| all[i].0).collect()
    }

    /// Mode reached from `start`; `near` is the size of the first simplex, as a share of the ranges.
    pub fn mode(&self, start: Place, near: f64) -> Option<Mode> {
        let scale = [0, 1].map(|k| self.ends[k][1] - self.ends[k][0]);
        let free = if scale[1] > 0.0 { 2 } else { 1 };
        let size = scale.map(|s| near * s);
        let (mut at, mut value) = (start, self.value(start));
        // Nelder-Mead, restarted while it gains: a simplex may collapse in a narrow valley.
        let mut idle = 0;
        for share in [1.0, 0.2, 1.0, 0.04, 0.2, 1.0, 0.04, 0.2] {
            let before = value;
            (at, value) = simplex(&|p| self.value(p), at, size.map(|s| share * s), free);
            idle = if before - value < 1e-2 { idle + 1 } else { 0 };
            if idle == 2 {
                break;
            }
        }
        if !value.is_finite() {
            return None;
        }
        let step = |k: usize| {
            let mut h = 1e-3 * scale[k];
            for _ in 0..40 {
                let sides = [-h, h].map(|h| {
                    let mut p = at;
                    p[k] += h;
                    self.value(p) - value
                });
                let known: Vec<f64> = sides.into_iter().filter(|rise| rise.is_finite()).collect();
                let rise = known.iter().sum::<f64>() / known.len() as f64;
                if !rise.is_finite() || rise > 3.0 {
                    h *= 0.5;
                } else if rise < 0.3 && h < 0.2 * scale[k] {
                    h *= 1.9;
                } else {
                    break;
                }
            }
            h
        };
        let h = [step(0), if free > 1 { step(1) } else { 0.0 }];
        let moved = |i: f64, k: f64| {
            let p = [at[0] + i * h[0], at[1] + k * h[1]];
            self.value(p).min(value + 50.0)
        };
        let second = |i: f64, k: f64| 0.5 * (moved(i, k) + moved(-i, -k) - 2.0 * value).max(1e-6);
        let [xx, cc] = [second(1.0, 0.0), second(0.0, 1.0)];
        if free == 1 {
            return Some(Mode { at, value, shape: [h[0] / xx.sqrt(), 0.0, 0.0] });
        }
        let xc = 0.25 * (second(1.0, 1.0) - second(1.0, -1.0));
        // −2 ln p ≈ xx p² + 2 xc p q + cc q², p and q in steps.
        let xc = xc.clamp(-0.999_999 * (xx * cc).sqrt(), 0.999_999 * (xx * cc).sqrt());
        let alone = (xx - xc * xc / cc).max(1e-9);
        Some(Mode { at, value, shape: [h[0] / alone.sqrt(), -xc / cc * h[1] / h[0], h[1] / cc.sqrt()] })
    }
}

fn valleys(values: &[f64]) -> Vec<usize> {
    let beside = |k: Option<usize>, own: f64| k.and_then(|k| values.get(k)).is_none_or(|v| *v >= own);
    let is_low = |k: &usize| beside(k.checked_sub(1), values[*k]) && beside(Some(k + 1), values[*k]);
    let mut low: Vec<usize> = (0..values.len()).filter(is_low).collect();
    low.sort_by(|i, k| values[*i].total_cmp(&values[*k]));
    low
}

fn simplex(value: &dyn Fn(Place) -> f64, start: Place, size: [f64; 2], free: usize) -> (Place, f64) {
    let mut all: Vec<(Place, f64)> = (0..=free)
        .map(|k| {
            let mut p = start;
            if k > 0 {
                p[k - 1] += size[k - 1];
            }
            if !value(p).is_finite() && k > 0 {
                p[k - 1] -= 2.0 * size[k - 1];
            }
            (p, value(p))
        })
        .collect();
    let between = |p: Place, q: Place, t: f64| [0, 1].map(|k| p[k] + t * (q[k] - p[k]));
    for _ in 0..STEPS {
        all.sort_by(|p, q| p.1.total_cmp(&q.1));
        let (best, worst) = (all[0], all[free]);
        if worst.1 - best.1 < 1e-3 {
            break;
        }
        let middle = [0, 1].map(|k| all[..free].iter().map(|p| p.0[k]).sum::<f64>() / free as f64);
        let tried = |t: f64| {
            let p = between(worst.0, middle, t);
            (p, value(p))
        };
        let mirrored = tried(2.0);
        let next = if mirrored.1 < best.1 {
            let further = tried(3.0);
            if further.1 < mirrored.1 { further } else { mirrored }
        } else if mirrored.1 < all[free - 1].1 || (free == 1 && mirrored.1 < worst.1) {
            mirrored
        } else {
            let inner = if mirrored.1 < worst.1 { tried(1.5) } else { tried(0.5) };
            if inner.1 < worst.1.min(mirrored.1) {
                inner
            } else {
                for other in &mut all[1..] {
                    let p = between(best.0, other.0, 0.5);
                    *other = (p, value(p));
                }
                continue;
            }
        };
        all[free] = next;
    }
    all.sort_by(|p, q| p.1.total_cmp(&q.1));
    all[0]
}
