//! Distance from strain: the roots of f(â) = reading, two, or none above the peak (model §2). In u = 1/a the plain case (tap angle,
//! no hub, no shear, contact clear of the gauge) is a quadratic with a closed form; others are solved on the monotone pieces of f.

use std::sync::OnceLock;

use super::linear::StrainCurve;
use crate::reduce::distinct;
use crate::scene::model::Drive;

/// The inverse of f over u = 1/a.
#[derive(Debug, Clone)]
pub struct Inverse {
    curve: StrainCurve,
    cut: OnceLock<Cut>,
}

#[derive(Debug, Clone)]
struct Cut {
    /// Ends of monotone pieces, ascending; empty where the roots have a closed form.
    ends: Vec<End>,
    peak: (f64, f64),
    /// f for a → ∞; 0 if it has no limit.
    farthest: f64,
}

/// u, f and df/du.
type End = [f64; 3];

/// Distances at which the linear theory gives a reading, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roots {
    /// The largest.
    pub far: f64,
    /// The next one, if any.
    pub near: Option<f64>,
    /// True if there is a larger one, beyond the farthest contact of which f is known.
    pub unseen: bool,
    /// True if f levels off above 0 far out, as for a widening whisker.
    pub levels_off: bool,
}

/// Places at which the sign of the slope is checked, beyond the gauge and on it; f has a few extrema, far apart on this scale.
const SAMPLES: [usize; 2] = [24, 8];

impl Cut {
    fn new(curve: &StrainCurve) -> Self {
        let [x1, x2] = curve.gauge;
        let farthest = Some(curve.farthest()).filter(|f| f.is_finite()).unwrap_or(0.0);
        let lo = curve.end().map_or(curve.taper.tau.max(0.0), |end| 1.0 / end);
        let hi = match curve.end() {
            // Moments and forces are defined for contacts near the base too.
            Some(end) if !curve.reads_strain() => 1e3 / end,
            _ if x1 > 0.0 => 1.0 / x1,
            _ => 1e9 / x2,
        };
        if plain(curve) {
            let [b1, b2] = curve.b;
            let (s, t) = (b1 + b2, x1 * b1 + x2 * b2);
            let peak = Some(0.5 * (s / t + curve.taper.tau)).filter(|peak| *peak > lo && *peak < hi);
            let places = [Some(lo), peak, Some(hi)].into_iter().flatten();
            let peak = highest(lo, places.map(|u| (u, curve.at_inverse(u).0)));
            return Self { ends: Vec::new(), peak, farthest };
        }
        // Quadratic spacing resolves the steep rise next to the apex.
        let mid = hi.min(1.0 / x2);
        let [beyond, on] = SAMPLES;
        let first = (0..beyond).map(|i| lo + (mid - lo) * (i as f64 / beyond as f64).powi(2));
        let second = (0..=on).map(|i| mid + (hi - mid) * (i as f64 / on as f64).powi(3));
        // f has kinks next to those of the whisker.
        let knots = curve.knots().iter().map(|s| 1.0 / s).filter(|u| lo < *u && *u < hi);
        let mut ends: Vec<End> = Vec::with_capacity(2 * (beyond + on));
        for u in distinct(first.chain(second).chain(knots)) {
            add(&mut ends, curve, end(curve, u), 1);
        }
        let peak = highest(lo, ends.iter().map(|&[u, f, _]| (u, f)));
        Self { ends, peak, farthest }
    }
}

impl Inverse {
    /// The inverse of `curve`, which is cut on first use.
    pub fn new(curve: StrainCurve) -> Self {
        Self { curve, cut: OnceLock::new() }
    }

    fn cut(&self) -> &Cut {
        self.cut.get_or_init(|| Cut::new(&self.curve))
    }

    /// The curve that is inverted.
    pub fn curve(&self) -> &StrainCurve {
        &self.curve
    }

    /// Distance (mm) and value of the largest strain per unit of drive; infinitely far if f only falls with u.
    pub fn peak(&self) -> (f64, f64) {
        let (u, f) = self.cut().peak;
        (1.0 / u, f)
    }

    /// True if no other contact, however far out, gives the reading of one at `a` mm.
    pub fn alone(&self, a: f64) -> bool {
        let alone = |roots: Roots| roots.levels_off && roots.near.is_none() && !roots.unseen;
        self.roots(self.curve.value(a)).is_some_and(alone)
    }

    /// Roots of f(a) = `reading` > 0 (strain per rad or mm); `None` above the peak. Below f(∞) a widening whisker has its near root only.
    pub fn roots(&self, reading: f64) -> Option<Roots> {
        self.roots_in(reading, [0.0, f64::INFINITY])
    }

    /// The same; outside of the `range`, mm, the near root is only known to lie outside.
    pub fn roots_in(&self, reading: f64, [least, most]: [f64; 2]) -> Option<Roots> {
        let crossed = |ends: &&[End]| {
            let [[from, lo, _], [to, hi, _]] = [ends[0], ends[1]];
            (lo == reading || (lo - reading) * (hi - reading) < 0.0) && from.max(to) > 0.0
        };
        let [far, near] = match plain(&self.curve) {
            true => self.plain_roots(reading),
            false => {
                let mut pieces = self.cut().ends.windows(2).filter(crossed);
                let root = |ends: &[End]| Some(self.root(reading, [ends[0], ends[1]])).filter(|u| *u > 0.0);
                let told = |ends: &[End]| match ends[0][0] * least <= 1.0 && ends[1][0] * most >= 1.0 {
                    true => root(ends),
                    false => Some(ends[1][0]),
                };
                [pieces.find_map(root), pieces.find_map(told)]
            }
        };
        let Cut { peak: (peak, _), farthest, .. } = *self.cut();
        far.map(|far| {
            let unseen = peak > 0.0 && far > peak && reading >= farthest;
            Roots { far: 1.0 / far, near: near.map(|u| 1.0 / u), unseen, levels_off: farthest > 0.0 }
        })
    }

    /// Root of f = `reading` between the ends of a monotone piece: by inverse cubics through both ends of the bracket, or where these would leave it
    /// by Newton's method or a halving.
    fn root(&self, reading: f64, [mut from, mut to]: [End; 2]) -> f64 {
        let line = from[0] + (to[0] - from[0]) * (reading - from[1]) / (to[1] - from[1]);
        let mut u = cubic(reading, from, to).unwrap_or(line);
        for _ in 0..100 {
            let here = end(&self.curve, u);
            let [_, f, slope] = here;
            let replaced = if (f > reading) == (from[1] > reading) { &mut from } else { &mut to };
            let left = (u - replaced[0]).abs();
            *replaced = here;
            let (step, rounding) = ((f - reading) / slope, f64::EPSILON * u.abs());
            if f == reading || step.abs() <= 2.0 * rounding || from[0] == to[0] {
                return u;
            }
            let inside = |next: &f64| *next > from[0].min(to[0]) && *next < from[0].max(to[0]);
            let by_cubic = cubic(reading, from, to).filter(inside);
            // The error of the next cubic, from that of this one and the shortest way to an end.
            let width = left.min((to[0] - from[0]).abs()).min(u.abs());
            match by_cubic.or(Some(u - step).filter(inside)) {
                Some(next) if by_cubic.is_some() && step.abs().powi(3) <= rounding * width * width => {
                    return next;
                }
                next => u = next.unwrap_or(0.5 * (from[0] + to[0])),
            }
        }
        u
    }

    /// Both roots of C (u − τ)(A − B u) = f, or of C₁ (1 − x1 u)² = f where the contact would be on the gauge.
    fn plain_roots(&self, reading: f64) -> [Option<f64>; 2] {
        let ([x1, x2], [b1, b2]) = (self.curve.gauge, self.curve.b);
        let (tau, s, t) = (self.curve.taper.tau, b1 + b2, x1 * b1 + x2 * b2);
        let y = reading / (0.75 * self.curve.taper.D * b1 * b2);
        let half_gap2 = (s - tau * t).powi(2) - 4.0 * t * y;
        if half_gap2.is_nan() || half_gap2 < 0.0 {
            return [None; 2];
        }
        let (sum, gap) = (s + tau * t, half_gap2.sqrt());
        let (small, large) = if sum >= 0.0 {
            (2.0 * (tau * s + y) / (sum + gap), (sum + gap) / (2.0 * t))
        } else {
            ((sum - gap) / (2.0 * t), 2.0 * (tau * s + y) / (sum - gap))
        };
        let on_gauge = || {
            let y1 = reading * (x2 - x1) / (0.75 * self.curve.taper.D * b1 * b1);
            (x1 > 0.0 && y1 <= 1.0).then(|| (1.0 - y1.sqrt()) / x1)
        };
        let valid = |u: f64| u > 0.0 && u * x2 <= 1.0;
        let far = valid(small).then_some(small);
        let near = if valid(large) { Some(large) } else { on_gauge().filter(|u| u * x2 > 1.0) };
        match far {
            Some(_) => [far, near],
            None => [near, None],
        }
    }
}

fn end(curve: &StrainCurve, u: f64) -> End {
    let (f, slope) = curve.at_inverse(u);
    [u, f, slope]
}

/// Adds the place `next` to the ends of monotone pieces: after an extremum between, or after a halving where there may be two.
fn add(ends: &mut Vec<End>, curve: &StrainCurve, next: End, halvings: u32) {
    if let Some(&last) = ends.last() {
        let turns = last[2] > 0.0 && next[2] < 0.0 || last[2] < 0.0 && next[2] > 0.0;
        if turns {
            ends.push(end(curve, bracketed(|u| curve.at_inverse(u).1, last[0], next[0])));
        } else if halvings > 0 && cubic(last[1], last, next).is_none() {
            add(ends, curve, end(curve, 0.5 * (last[0] + next[0])), halvings - 1);
            return add(ends, curve, next, halvings - 1);
        }
    }
    ends.push(next);
}

/// u where f is `reading`, by the cubic in f through two places and their slopes; `None` where it may not be monotone, as next to an extremum.
fn cubic(reading: f64, [from, lo, by_lo]: End, [to, hi, by_hi]: End) -> Option<f64> {
    let (t, width) = ((reading - lo) / (hi - lo), to - from);
    let [p, q] = [by_lo, by_hi].map(|by| (hi - lo) / (width * by));
    let share = t * (t * (3.0 - 2.0 * t) + (1.0 - t) * (p * (1.0 - t) - q * t));
    (p <= 3.0 && q <= 3.0 && p >= 0.0 && q >= 0.0).then_some(from + width * share)
}

fn highest(lo: f64, places: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    places.fold((lo, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best })
}

fn plain(curve: &StrainCurve) -> bool {
    curve.drive == Drive::Angle && curve.hub == 0.0 && curve.shear == 0.0 && curve.is_plain()
}

/// Root of `f` in [`lo`, `hi`], where its sign changes, to the spacing of f64: Anderson and Björck (BIT 13, 1973), with bisections.
pub fn bracketed(mut f: impl FnMut(f64) -> f64, mut lo: f64, mut hi: f64) -> f64 {
    let (mut f_lo, mut f_hi) = (f(lo), f(hi));
    if f_lo == 0.0 {
        return lo;
    }
    if f_hi == 0.0 {
        return hi;
    }
    for step in 0..200 {
        let width = hi - lo;
        let mut x = hi - f_hi * width / (f_hi - f_lo);
        if step % 3 == 2 || !(x > lo.min(hi) && x < lo.max(hi)) {
            x = lo + 0.5 * width;
        }
        if x == lo || x == hi {
            break;
        }
        let fx = f(x);
        if fx == 0.0 {
            return x;
        }
        if (fx > 0.0) == (f_hi > 0.0) {
            let keep = 1.0 - fx / f_hi;
            f_lo *= if keep > 0.0 { keep } else { 0.5 };
        } else {
            (lo, f_lo) = (hi, f_hi);
        }
        (hi, f_hi) = (x, fx);
        if (hi - lo).abs() <= 4.0 * f64::EPSILON * hi.abs() {
            break;
        }
    }
    hi
}
