//! A built whisker as a device takes it: pieces along which radii are linear.

use vibrissa_rod::Rod as Whisker;

/// A piece between two places where the profile, the material or the gauge changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Piece {
    /// Its beginning, mm.
    pub near: f64,
    /// Its end, mm; `f64::MAX` for the last piece.
    pub far: f64,
    /// R at its beginning, mm, and R′.
    pub radius: [f64; 2],
    /// The same of the core or bore; 0 without.
    pub inner: [f64; 2],
    /// 1 under the gauge, else 0.
    pub gauge: f64,
    /// Its share of the steps of the whole whisker.
    pub share: f64,
}

impl Piece {
    /// Steps over the piece, of `steps` over the whole whisker.
    pub fn steps(&self, steps: usize) -> usize {
        (steps as f64 * self.share).ceil().max(1.0) as usize
    }
}

/// A built whisker with its gauge.
#[derive(Debug, Clone, PartialEq)]
pub struct Rod {
    /// From the base to the tip.
    pub pieces: Vec<Piece>,
    /// Length L_a, mm.
    pub length: f64,
    /// R(0), R(L_a), mm, and n, where the diameter is a power of the distance from the tip.
    pub power: Option<[f64; 3]>,
    /// κ_base and κ_slope, 1/mm and 1/mm².
    pub curvature: [f64; 2],
    /// Root compliances 1/k_theta, 1/k_x and 1/k_y.
    pub root: [f64; 3],
    /// E of the skin and of the core, MPa.
    pub moduli: [f64; 2],
    /// Poisson's ratio ν.
    pub nu: f64,
    /// Gauge ends x1 and x2, mm.
    pub gauge: [f64; 2],
}

/// Weight of ln(ratio of the end radii) of a piece in its share of the steps; its length over the whisker's has weight 1.
const TAPERED: f64 = 0.15;

impl Rod {
    /// The whisker `rod`, in pieces that end also where the gauge does.
    pub fn of(rod: &Whisker) -> Self {
        let (length, gauge) = (rod.length, rod.gauge);
        let mut edges: Vec<f64> = rod.pieces.iter().map(|piece| piece.near).chain(gauge).collect();
        edges.retain(|s| *s >= 0.0 && *s < length);
        edges.push(length);
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let piece = |ends: &[f64]| {
            let (near, far) = (ends[0], ends[1]);
            let middle = 0.5 * (near + far);
            let after = rod.pieces.partition_point(|piece| piece.near <= middle).max(1);
            let whole = &rod.pieces[after - 1];
            let moved = |[begin, slope]: [f64; 2]| [begin + slope * (near - whole.near), slope];
            let (radius, inner) = (moved(whole.radius), moved(whole.inner));
            let tapered = (1.0 + radius[1] * (far - near) / radius[0]).ln().abs().min(10.0);
            let under = middle > gauge[0] && middle < gauge[1];
            let share = (far - near) / length + TAPERED * tapered;
            Piece { near, far, radius, inner, gauge: f64::from(under), share }
        };
        let mut pieces: Vec<Piece> = edges.windows(2).map(piece).collect();
        let whole: f64 = pieces.iter().map(|piece| piece.share).sum();
        pieces.iter_mut().for_each(|piece| piece.share /= whole);
        if let Some(last) = pieces.last_mut() {
            last.far = f64::MAX;
        }
        let power = rod.power.map(|[base, tip, n, _]| [base, tip, n]);
        let Whisker { curvature, root, moduli, nu, .. } = *rod;
        Self { pieces, length, power, curvature, root, moduli, nu, gauge }
    }

    /// R and R′ at the arc `s`, mm, by the piece that holds `within`; a power by its formula.
    pub fn radius(&self, s: f64, within: f64) -> [f64; 2] {
        if let Some([base, tip, n]) = self.power {
            let v = (1.0 - s / self.length).max(0.0);
            let slope = if v > 0.0 { v.powf(n - 1.0) } else { 0.0 };
            return [tip + (base - tip) * v.powf(n), -(base - tip) * n / self.length * slope];
        }
        let after = self.pieces.partition_point(|piece| piece.near <= within).clamp(1, self.pieces.len());
        let Piece { near, radius: [begin, slope], .. } = self.pieces[after - 1];
        [begin + slope * (s - near), slope]
    }
}
