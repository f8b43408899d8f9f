//! Ranges of a page's sliders: those of the spec, or a range around a single number.

use crate::chart::axis::{AXES, FIRST_PLACE};
use crate::design::amount;
use crate::error::InputError;
use crate::plan::Layout;
use crate::scene::{Axis, Column, Drive, Setup, Tuple};

/// Largest x/a of the chart; beyond it the page extrapolates the strain.
const LAST_PLACE: f64 = 0.95;

/// Largest τa: the solution is not smooth next to the virtual apex.
const LAST_TAPER: f64 = 0.92;

/// Ranges, lengths in mm, and the start of the page.
#[derive(Debug, Clone, PartialEq)]
#[allow(non_snake_case)]
pub struct Domain {
    pub D: [f64; 2],
    pub d: [f64; 2],
    pub L_a: [f64; 2],
    pub x_ss: [f64; 2],
    pub l: [f64; 2],
    /// r₀; a single value with a displacement drive, which it does not affect, and with a pole radius.
    pub hub: [f64; 2],
    pub pole: f64,
    pub a: [f64; 2],
    /// θ, degrees, or δ, mm.
    pub drive: [f64; 2],
    /// The first design of the spec, at a middle drive.
    pub start: Tuple,
    pub reach: [f64; 2],
    pub distances: u64,
}

/// [lo, hi], or a range of these factors around a single number.
fn around([lo, hi]: [f64; 2], factors: [f64; 2]) -> [f64; 2] {
    if hi > lo { [lo, hi] } else { factors.map(|f| lo * f) }
}

impl Domain {
    /// Domain of the designs of `layout`.
    ///
    /// # Errors
    /// A pole radius together with a hub: the chart has one axis for both.
    pub fn new(setup: &Setup, layout: &Layout) -> Result<Self, InputError> {
        let pole = setup.model.pole_radius;
        let angle = setup.drive == Drive::Angle;
        if pole > 0.0 && setup.hub > 0.0 && angle {
            let error = InputError::new("a page holds a hub or an object with a radius, not both");
            let error = error.key("model.pole_radius").value(pole);
            return Err(error.allowed("0, or hub = 0 in [whisker]"));
        }
        let drives = layout.bounds(Column::Drive);
        let [base, tip, length, x_ss, grid] = std::array::from_fn(|k| layout.bounds(Column::ALL[k]));
        let reach = layout.reach();
        let mut drive = around(drives, [0.5, 2.0]);
        if angle {
            drive[1] = drive[1].min(60.0).max(drives[1]);
        }
        let largest = base[1];
        Ok(Self {
            D: around(base, [0.8, 1.2]),
            d: around(tip, [0.8, 1.2]),
            L_a: around(length, [0.8, 1.2]),
            x_ss: if x_ss[1] > 0.0 { around(x_ss, [0.5, 2.0]) } else { [0.0, 0.5 * largest] },
            l: around(grid, [0.5, 2.0]),
            hub: match setup.hub {
                _ if !angle || pole > 0.0 => [0.0; 2],
                0.0 => [0.0, largest],
                hub => [0.0, 2.0 * hub],
            },
            pole,
            a: around(reach, [0.7, 1.4]),
            drive,
            start: Tuple { drive: middle(layout, drives), ..layout.design(0) },
            reach,
            distances: layout.n_distances,
        })
    }

    /// The box of the chart: drive, (r₀ or ρ)/a, D/a, τa, x/a.
    pub fn scaled(&self, kind: Drive) -> [[f64; 2]; AXES] {
        let [near, far] = self.a;
        let over_a = |[lo, hi]: [f64; 2]| [lo / far, hi / near];
        let drive = self.drive.map(|drive| amount(kind, drive));
        let reach = [near / self.L_a[1], (far / self.L_a[0]).min(1.0)];
        let lost = [1.0 - self.d[1] / self.D[0], 1.0 - self.d[0] / self.D[1]];
        let least = lost[0] * if lost[0] < 0.0 { reach[1] } else { reach[0] };
        let most = lost[1] * if lost[1] < 0.0 { reach[0] } else { reach[1] };
        [
            if kind == Drive::Angle { drive } else { over_a(drive) },
            if self.pole > 0.0 { over_a([self.pole; 2]) } else { over_a(self.hub) },
            over_a(self.D),
            [least.max(-1.0), most.min(LAST_TAPER)],
            [FIRST_PLACE, LAST_PLACE],
        ]
    }
}

fn middle(layout: &Layout, [lo, hi]: [f64; 2]) -> f64 {
    let half = 0.5 * (lo + hi);
    let nearest = |axis: &Axis| {
        axis.iter().min_by(|a, b| (a - half).abs().total_cmp(&(b - half).abs())).unwrap_or(half)
    };
    layout.drives().filter(|axis| axis.len() < 10_000).map_or(half, nearest)
}
