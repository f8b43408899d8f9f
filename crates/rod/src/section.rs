//! Sections of a whisker in packs: disc, ring and bonded core (model §7), for E = 1.

use std::f64::consts::PI;

use vibrissa_kernel::Chart;
use vibrissa_kernel::cpu::pack::{Packed, Scalar};

use super::Effects;
use super::lane::Lane;
use super::rod::Piece;

/// Numbers that all sections of a whisker share.
#[derive(Debug, Clone, Copy)]
pub struct Whisker<P> {
    /// E of the core over that of the skin.
    pub core: P,
    /// ¾ + ν/2.
    pub quarter: P,
    /// κ_base and κ_slope.
    pub curvature: [P; 2],
    /// R(0) − R(L_a), R(L_a), n and 1/L_a.
    pub power: [P; 4],
    /// ψ₀ at a.
    pub rest: P,
    /// 1/kG over that of model §3.
    pub softer: P,
}

/// Charts of a section law from the smallest loads to the largest, then those of laws of nearby moduli, with their weights in its derivative.
pub struct Charted<T>(pub Vec<(T, Vec<Chart<T>>)>);

/// e₀ − t, χ and load of [`Chart::section`]. Each lane takes the first of `charts` whose range holds its load, else the last, whatever its neighbours take.
#[inline(always)]
fn first<P: Packed>(charts: &[Chart<P::Scalar>], t: P, b: P) -> [P; 3] {
    let one = P::of(1.0);
    let mut found = [one; 3];
    for (k, chart) in charts.iter().enumerate() {
        let (next, [extra, chi, load]) = (chart.section(t, b), found);
        found = match k {
            0 => next,
            _ => [
                one.if_less(load, next[0], extra),
                one.if_less(load, next[1], chi),
                one.if_less(load, next[2], load),
            ],
        };
        if found[2].all_at_most(one) {
            break;
        }
    }
    found
}

impl<T: Scalar> Charted<T> {
    /// Largest error of a chart, relative to the strain.
    pub fn error(&self) -> f64 {
        self.0[0].1.iter().map(|chart| chart.error).fold(0.0, f64::max)
    }

    /// e₀ − t, χ and load, with the derivatives by the laws of nearby moduli.
    #[inline(always)]
    pub fn section<P: Lane<Scalar = T>>(&self, t: P, b: P) -> [P; 3] {
        let [mut extra, mut chi, mut load] = [P::of(0.0); 3];
        for (k, (weight, law)) in self.0.iter().enumerate() {
            let found = first(law, t, b);
            if k == 0 {
                [extra, chi, load] = found;
                continue;
            }
            extra = extra.grown(P::splat(*weight) * found[0]);
            chi = chi.grown(P::splat(*weight) * found[1]);
            load = load.max(found[2]);
        }
        [extra, chi, load]
    }
}

/// A section: R, bends/EI, 1/EI, 1/EA and 1/kGA for E = 1.
#[derive(Debug, Clone, Copy, Default)]
pub struct Section<P> {
    pub radius: P,
    pub flex: P,
    pub bare: P,
    pub stretch: P,
    pub slack: P,
}

impl<P: Packed> Whisker<P> {
    /// ψ₀ at `s`, less that at a.
    #[inline(always)]
    pub fn rest_angle(&self, s: P) -> P {
        let [base, rising] = self.curvature;
        P::of(0.0) - (base + P::of(0.5) * rising * s) * s - self.rest
    }
}

impl<P: Lane> Piece<P> {
    /// R at `s`.
    #[inline(always)]
    pub fn radius(&self, effects: &Effects, whisker: &Whisker<P>, s: P) -> P {
        if effects.power {
            let [wider, tip, n, length] = whisker.power;
            let v = P::of(1.0) - s * length;
            return tip + wider * v.max(P::of(0.0)).pow(n);
        }
        self.radius[0] + self.radius[1] * (s - self.near)
    }

    /// The section at `s`.
    #[inline(always)]
    pub fn section(&self, effects: &Effects, whisker: &Whisker<P>, s: P) -> Section<P> {
        let of = P::of;
        let (zero, one) = (of(0.0), of(1.0));
        // A panel without length may lie where the piece would end in a point.
        let radius = self.radius(effects, whisker, s).max(of(1e-9));
        let r2 = radius * radius;
        let thin = one / r2;
        if !effects.inner {
            // k G of a disc, with E = 1: −J = q/4 − 1/24.
            let slack = (of(4.0) * whisker.quarter - of(2.0 / 3.0)) * whisker.softer;
            let bare = of(4.0 / PI) * thin * thin;
            return Section {
                radius,
                flex: bare * self.bends,
                bare,
                stretch: if effects.extension { of(1.0 / PI) * thin } else { zero },
                slack: if effects.shear { of(1.0 / PI) * thin * slack } else { zero },
            };
        }
        let i = self.inner[0] + self.inner[1] * (s - self.near);
        let (i2, g) = (i * i, whisker.core);
        let (p, other) = (i2 * thin, of(PI) * (g - one));
        let area = of(PI) * r2 + other * i2;
        let bare = one / (of(0.25) * (of(PI) * r2 * r2 + other * i2 * i2));
        let mut section = Section { radius, flex: bare * self.bends, bare, stretch: zero, slack: zero };
        if effects.extension {
            section.stretch = one / area;
        }
        if effects.shear {
            let quarter = whisker.quarter;
            let over = zero - (one - g) * quarter * (one - p) / (one + g - (one - g) * p);
            let (b, a) = (p * over, p * over - quarter);
            let j = of(0.25) * a * (one - p * p)
                + of(0.5) * b * (one - p)
                + of(1.0 / 24.0) * (one - p * p * p)
                + g * (of(0.25) * (a + over) * p * p + of(1.0 / 24.0) * p * p * p);
            section.slack = zero - of(PI) * r2 * r2 * r2 * j * bare * bare * whisker.softer;
        }
        section
    }
}
