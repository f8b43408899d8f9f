//! The curve that the model corrects: the whisker's own, or a power of distance and drive.

/// Signal of a tap without any correction, before the gain.
#[derive(Clone, Copy)]
pub enum Base<'a> {
    /// Of a whisker that is known: its |signal| at a (mm) by a drive, and what is added to the drive.
    Known(&'a (dyn Fn(f64, f64) -> f64 + Sync), f64),
    /// (u + u₀)^p a^−q.
    Power(Power),
}

impl Base<'_> {
    /// The signal at a (mm) by the drive u.
    pub fn value(&self, a: f64, u: f64) -> f64 {
        match self {
            Self::Known(curve, offset) => curve(a, u + offset),
            Self::Power(power) => power.value(a, u),
        }
    }

    /// ∂ signal/∂u · u, by central differences.
    pub fn by_drive(&self, a: f64, u: f64) -> f64 {
        const H: f64 = 1e-3;
        (self.value(a, u * (1.0 + H)) - self.value(a, u * (1.0 - H))) / (2.0 * H)
    }

    /// ∂ signal/∂a · a.
    pub fn by_distance(&self, a: f64, u: f64) -> f64 {
        const H: f64 = 1e-3;
        (self.value(a * (1.0 + H), u) - self.value(a * (1.0 - H), u)) / (2.0 * H)
    }
}

/// (u + u₀)^p a^−q.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    /// Offset u₀ of the drive: contact begins at −u₀.
    pub offset: f64,
    /// Exponent of the drive.
    pub p: f64,
    /// Exponent of 1/a.
    pub q: f64,
}

impl Power {
    /// At a (mm) by the drive u.
    pub fn value(&self, a: f64, u: f64) -> f64 {
        (self.p * (u + self.offset).ln() - self.q * a.ln()).exp()
    }
}

/// A fitted power law: signal = zero + factor u^p a^−q.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// The curve.
    pub power: Power,
    /// Its factor.
    pub factor: f64,
    /// The constant.
    pub zero: f64,
    /// Weighted sum of squares.
    pub squares: f64,
}

/// Fits a power law to taps (a, u, y) with the constant `zero`, or a free one: of a free exponent of the drive, or of the exponent 1 and a free
/// offset, whichever is nearer.
pub fn power(taps: &[[f64; 3]], zero: Option<f64>) -> Option<Fitted> {
    let mut drives: Vec<f64> = taps.iter().map(|t| t[1]).collect();
    drives.sort_by(f64::total_cmp);
    drives.dedup();
    let free = with_offset(taps, zero, 0.0, None);
    if drives.len() < 3 {
        return free;
    }
    // The offset by golden sections, of its share in the largest drive.
    let (least, largest) = (drives[0], drives[drives.len() - 1]);
    let at = |share: f64| with_offset(taps, zero, (share * largest).max(-0.9 * least), Some(1.0));
    let tries: Vec<f64> = [-0.5, -0.25, -0.1, -0.03, 0.0, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0].to_vec();
    let of = |share: f64| at(share).map_or(f64::INFINITY, |f| f.squares);
    let sums: Vec<f64> = tries.iter().map(|s| of(*s)).collect();
    let k = (0..tries.len()).min_by(|i, k| sums[*i].total_cmp(&sums[*k])).unwrap_or(0);
    let (mut lo, mut hi) = (tries[k.saturating_sub(1)], tries[(k + 1).min(tries.len() - 1)]);
    for _ in 0..16 {
        let (p, q) = (lo + 0.382 * (hi - lo), lo + 0.618 * (hi - lo));
        if of(p) < of(q) { hi = q } else { lo = p }
    }
    [free, at(0.5 * (lo + hi))].into_iter().flatten().min_by(|f, g| f.squares.total_cmp(&g.squares))
}

/// By least squares, with Huber's weights so that single wrong rows do not turn it.
fn with_offset(taps: &[[f64; 3]], zero: Option<f64>, offset: f64, exponent: Option<f64>) -> Option<Fitted> {
    let several = exponent.is_none() && taps.iter().any(|t| t[1] != taps[0][1]);
    let mut weights = vec![1.0; taps.len()];
    let mut best: Option<Fitted> = None;
    for _ in 0..3 {
        let at = |p: f64, q: f64| linear(taps, &weights, Power { offset, p, q }, zero);
        let mut found: Option<Fitted> = None;
        let better = |f: Option<Fitted>, found: &mut Option<Fitted>| {
            if let Some(f) = f.filter(|f| found.is_none_or(|g| f.squares < g.squares)) {
                *found = Some(f);
            }
        };
        let ps: Vec<f64> = if several { (2..=12).map(|k| 0.2 * f64::from(k)).collect() } else { vec![1.0] };
        for p in &ps {
            (1..=20).for_each(|k| better(at(*p, 0.4 * f64::from(k)), &mut found));
        }
        let (mut dp, mut dq) = (if several { 0.1 } else { 0.0 }, 0.2);
        for _ in 0..40 {
            let Some(f) = found else { break };
            let Power { p, q, .. } = f.power;
            for (sp, sq) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 1.0), (-1.0, -1.0)] {
                let (p, q) = ((p + sp * dp).clamp(0.05, 5.0), (q + sq * dq).clamp(0.02, 12.0));
                better(at(p, q), &mut found);
            }
            if found == Some(f) {
                (dp, dq) = (0.5 * dp, 0.5 * dq);
            }
        }
        let found = found?;
        let residual = |t: &[f64; 3]| t[2] - found.zero - found.factor * found.power.value(t[0], t[1]);
        let mut sizes: Vec<f64> = taps.iter().map(|t| residual(t).abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let limit = 2.5 * 1.4826 * sizes[sizes.len() / 2];
        weights = taps.iter().map(|t| (limit / residual(t).abs()).min(1.0)).collect();
        weights.iter_mut().filter(|w| !w.is_finite()).for_each(|w| *w = 1.0);
        best = Some(found);
    }
    best
}

/// Factor and constant of a power law by weighted least squares; `None` where the factor is not positive.
fn linear(taps: &[[f64; 3]], weights: &[f64], power: Power, zero: Option<f64>) -> Option<Fitted> {
    let b: Vec<f64> = taps.iter().map(|t| power.value(t[0], t[1])).collect();
    let sum = |f: &dyn Fn(usize) -> f64| (0..taps.len()).map(|i| weights[i] * f(i)).sum::<f64>();
    let (n, sb, sy) = (sum(&|_| 1.0), sum(&|i| b[i]), sum(&|i| taps[i][2]));
    let (factor, zero) = match zero {
        Some(zero) => (sum(&|i| b[i] * (taps[i][2] - zero)) / sum(&|i| b[i] * b[i]), zero),
        None => {
            let (mb, my) = (sb / n, sy / n);
            let factor = sum(&|i| (b[i] - mb) * (taps[i][2] - my)) / sum(&|i| (b[i] - mb).powi(2));
            (factor, my - factor * mb)
        }
    };
    let squares = sum(&|i| (taps[i][2] - zero - factor * b[i]).powi(2));
    (factor > 0.0 && squares.is_finite()).then_some(Fitted { power, factor, zero, squares })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_with_and_without_its_constant() {
        let tap = |a: f64, u: f64| [a, u, 3.0 + 40.0 * u.powf(1.1) * a.powf(-1.3)];
        let mut taps: Vec<_> = (10..20).flat_map(|a| (1..5).map(move |u| tap(f64::from(a), f64::from(u)))).collect();
        taps[7][2] *= 1.5;
        let found = power(&taps, None).unwrap();
        assert!((found.power.p - 1.1).abs() < 0.02 && (found.power.q - 1.3).abs() < 0.05, "{found:?}");
        assert!((found.zero - 3.0).abs() < 0.2, "{found:?}");
        let tared: Vec<_> = taps.iter().map(|t| [t[0], t[1], t[2] - 3.0]).collect();
        let found = power(&tared, Some(0.0)).unwrap();
        assert!((found.power.p - 1.1).abs() < 0.02 && (found.power.q - 1.3).abs() < 0.05, "{found:?}");
    }
}
