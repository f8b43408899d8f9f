//! The rod next to its clamp: the base moved by a foil, and the skin strain under the gauge.

use super::turned;
use crate::design::Shared;
use crate::kernel::Chart;
use crate::physics::section::SectionLaw;
use crate::physics::solid::{FADES, HALVED, Held, distorted};
use crate::physics::taper::Taper;
use crate::scene::{Material, Setup, Side};

/// Longest steps: under a gauge at the clamp, over D, and elsewhere, over the distance of the object; times these factors at [`COARSE`] tolerances.
const STEPS: [f64; 2] = [1.0 / 200.0, 1.0 / 36.0];
const COARSE: (f64, [f64; 2]) = (1e-6, [5.0, 2.0]);

/// Mean strain under the gauge as read, positive as on the contact side; None if it is the rod's.
pub(super) type Seen = Option<f64>;

/// The base of the real rod, seen from that of the rod without foil with the same outer part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base {
    /// Rad, counterclockwise.
    angle: f64,
    /// Displacement, mm.
    place: [f64; 2],
}

pub(super) struct Load {
    /// P, N.
    pub force: f64,
    /// ψ(0), rad.
    pub angle: f64,
    /// The contact, mm from where the rod begins.
    pub arc: f64,
    /// A point of the contact's normal, mm from there.
    pub through: [f64; 2],
    /// Mean strain of the rod's fibre under the gauge, positive as on the contact side.
    pub strain: f64,
    /// True if the skin strain is wanted, not only the base.
    pub fine: bool,
}

/// ψ, x, y, and ∫ ds of the rod's fibre strain, of the same as the skin shows it, and of the skin's additional strain.
type State = [f64; 6];

struct Loaded<'a> {
    setup: &'a Setup,
    taper: Taper,
    start: f64,
    /// The whisker from the face of its clamp.
    whole: Taper,
    law: SectionLaw,
    chart: Option<&'a Chart>,
    /// Force, N.
    force: [f64; 2],
    /// A point of its line of action, mm.
    through: [f64; 2],
    side: f64,
    halved: f64,
    /// 1/(kG), 1/MPa.
    compliance: f64,
    /// Longest steps under the gauge and elsewhere, mm.
    steps: [f64; 2],
}

impl Base {
    pub(super) const UNMOVED: Self = Self { angle: 0.0, place: [0.0; 2] };

    pub(super) fn turned(&self) -> f64 {
        self.angle
    }

    /// Displacement of `point` by the base's motion times `share`.
    pub(super) fn moved(&self, point: [f64; 2], share: f64) -> [f64; 2] {
        let [x, y] = turned(point, share * self.angle);
        [share * self.place[0] + x, share * self.place[1] + y]
    }

    /// The base and the skin strain of a rod under `load`. `None` where the material ends, or the rod has no contact.
    pub(super) fn reached(
        setup: &Setup,
        shared: &Shared,
        (chart, tolerance): (Option<&Chart>, f64),
        &Load { force, angle, arc, through, strain, fine }: &Load,
    ) -> Option<(Self, Seen)> {
        let (model, foil) = (&setup.model, shared.foil);
        if arc <= 0.0 || arc.is_nan() {
            return None; // The rod's contact lies behind its base.
        }
        if foil.is_none() && !model.distorting {
            return Some((Self::UNMOVED, None));
        }
        let alpha = if model.surface { shared.taper.tan_alpha.atan() } else { 0.0 };
        let (sin, cos) = (alpha + angle).sin_cos();
        let rubber = !matches!(model.material, Material::Hooke(_));
        let rod = Loaded {
            setup,
            taper: shared.taper.from(shared.start),
            start: shared.start,
            whole: shared.taper,
            law: SectionLaw::new(&model.material),
            chart,
            force: [-force * sin, -force * cos],
            through,
            side: if setup.gauge.side == Side::Far { -1.0 } else { 1.0 },
            halved: if rubber && model.distorting { HALVED } else { 0.0 },
            compliance: Held::new(model).shear_compliance(model),
            steps: {
                let [under, elsewhere] = if tolerance >= COARSE.0 { COARSE.1 } else { [1.0; 2] };
                let elsewhere = elsewhere * STEPS[1] * through[0];
                // The error goes as e^(−px/D) and the fourth power of the step.
                let room = (0.25 * FADES * shared.gauge[0] / shared.taper.D).exp();
                let under = under * STEPS[0] * shared.taper.D * room;
                [if fine { under.min(elsewhere) } else { elsewhere }, elsewhere]
            },
        };
        let width = shared.gauge[1] - shared.gauge[0];
        let gauge = shared.gauge.map(|x| (x - shared.start).min(arc));
        // The rod's strain is more accurate than this integral, most of all next to the contact: only their ratio is used.
        let told = |plain: f64, [shown, beside]: [f64; 2]| {
            let [plain, shown, beside] = [plain, shown, beside].map(|x| rod.side * x / width);
            let ratio = strain / plain;
            beside + if (0.5..2.0).contains(&ratio) { shown * ratio } else { strain + shown - plain }
        };
        let Some(foil) = foil else {
            // Only a chart has a gauge that begins behind the rod: the part before it does not count in the mean.
            let [angle, x, y, ..] = rod.along([0.0; 6], &[0.0, gauge[0]], gauge, None)?;
            let near = [angle, x, y, 0.0, 0.0, 0.0];
            let [.., plain, shown, beside] = rod.along(near, &gauge, gauge, None)?;
            return Some((Self::UNMOVED, Some(told(plain, [shown, beside]))));
        };
        let span = foil.span.map(|x| (x - shared.start).clamp(0.0, arc));
        let far = span[1].max(gauge[1]);
        let mut places = [far, span[1], gauge[1], gauge[0], span[0], 0.0];
        places.sort_by(|p, q| q.total_cmp(p));
        let outward: Vec<f64> = places.iter().rev().copied().collect();
        let [angle, x, y, plain, ..] = rod.along([0.0; 6], &outward, gauge, None)?;
        let start = [angle, x, y, 0.0, 0.0, 0.0];
        let [angle, x, y, _, shown, beside] =
            rod.along(start, &places, gauge, Some((span, foil.stiffening)))?;
        let mean = foil.transfer * told(plain, [-shown, -beside]);
        Some((Self { angle, place: [x, y] }, Some(mean)))
    }
}

impl Loaded<'_> {
    /// `state` integrated from the first of `places` to the last, by the classic Runge–Kutta method.
    fn along(
        &self,
        mut state: State,
        places: &[f64],
        gauge: [f64; 2],
        foil: Option<([f64; 2], f64)>,
    ) -> Option<State> {
        for ends in places.windows(2) {
            let (from, length) = (ends[0], ends[1] - ends[0]);
            if length == 0.0 {
                continue;
            }
            let middle = from + 0.5 * length;
            let over = |[near, far]: [f64; 2]| near < middle && middle < far;
            let under = over(gauge);
            let bends = foil.filter(|(span, _)| over(*span)).map_or(1.0, |(_, less)| 1.0 - less);
            let step = self.steps[usize::from(!under)];
            let n = (length.abs() / step).ceil();
            let h = length / n;
            for k in 0..n as usize {
                let s = from + h * k as f64;
                let slope = |ds: f64, by: &State, of: f64| {
                    let at = std::array::from_fn(|i| state[i] + of * by[i]);
                    self.slope(s + ds, &at, under, bends)
                };
                let first = self.slope(s, &state, under, bends)?;
                let second = slope(0.5 * h, &first, 0.5 * h)?;
                let third = slope(0.5 * h, &second, 0.5 * h)?;
                let last = slope(h, &third, h)?;
                state = std::array::from_fn(|i| {
                    state[i] + h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + last[i])
                });
            }
        }
        Some(state)
    }

    /// d/ds of a state at `s`, with the skin strain if `under` the gauge; the rod bends `bends` times as much as without foil.
    fn slope(&self, s: f64, [angle, x, y, ..]: &State, under: bool, bends: f64) -> Option<State> {
        let model = &self.setup.model;
        let ([fx, fy], (sin, cos)) = (self.force, angle.sin_cos());
        let (axial, shear) = (fx * cos + fy * sin, fy * cos - fx * sin);
        let moment = (self.through[0] - x) * fy - (self.through[1] - y) * fx;
        let r = self.taper.radius(s);
        let n = if model.extension { axial / (r * r) } else { 0.0 };
        let strain = self.deform(n, moment / (r * r * r))?;
        let stretch = if model.extension { strain[0] } else { 0.0 };
        let e = model.material.e0();
        let slide = shear * self.compliance / (std::f64::consts::PI * r * r);
        let [plain, shown, beside] = match (under, model.distorting) {
            (false, _) => [0.0; 3],
            (true, false) => [strain[0] - self.side * strain[1]; 3],
            (true, true) => {
                let [bending, by_shear] = distorted(&self.whole, e, s + self.start);
                let of_rod = |factor: f64| strain[0] - self.side * strain[1] * factor;
                let beside = -self.side * shear * by_shear - self.halved * strain[1] * strain[1];
                [of_rod(1.0), of_rod(bending), beside]
            }
        };
        let beside = if model.distorting { beside } else { 0.0 };
        let (along, across) = (1.0 + stretch, slide);
        Some([
            bends * strain[1] / r,
            along * cos - across * sin,
            along * sin + across * cos,
            plain,
            shown,
            beside,
        ])
    }

    /// e₀ and κR under n and m, MPa: from the kernel's chart, or beyond it by the law itself.
    fn deform(&self, n: f64, m: f64) -> Option<[f64; 2]> {
        let unit = std::f64::consts::PI * self.setup.model.material.e0();
        let charted = self.chart.and_then(|chart| chart.at(n / unit, 4.0 * m.abs() / unit));
        if let Some([axial, bending]) = charted {
            return Some([axial, bending.copysign(m)]);
        }
        self.law.deform(n, m).map(|strain| [strain.axial, strain.bending])
    }
}
