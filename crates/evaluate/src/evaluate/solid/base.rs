//! The rod next to its clamp: how a foil moves the base, and what the skin under the gauge shows.

use super::turned;
use crate::design::Shared;
use crate::kernel::Chart;
use crate::physics::section::SectionLaw;
use crate::physics::solid::{FADES, HALVED, Held, distorted};
use crate::physics::taper::Taper;
use crate::scene::{Material, Setup, Side};

/// Longest steps of the integration: under a gauge at the clamp, over D, and elsewhere, over the way to the object; at tolerances from [`COARSE`] on
/// so many times as long.
const STEPS: [f64; 2] = [1.0 / 200.0, 1.0 / 36.0];
const COARSE: (f64, [f64; 2]) = (1e-6, [5.0, 2.0]);

/// Mean strain under the gauge as it is read, positive as on the contact side; none where that is the rod's own.
pub(super) type Seen = Option<f64>;

/// Where the base of the real rod stands, seen from that of the rod without a foil whose outer part is the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base {
    /// Rad, counterclockwise.
    angle: f64,
    /// mm.
    place: [f64; 2],
}

/// What bends a rod.
pub(super) struct Load {
    /// P, N.
    pub force: f64,
    /// ψ(0), rad.
    pub angle: f64,
    /// Where the contact is, mm from where the rod begins.
    pub arc: f64,
    /// A point of the contact's normal, mm from there.
    pub through: [f64; 2],
    /// Mean strain of the rod's fibre under the gauge, positive as on the contact side.
    pub strain: f64,
    /// Whether the strain of the skin is asked for, not only where the base stands.
    pub fine: bool,
}

/// Direction and place, ψ, x, y, and ∫ ds of the rod's fibre, of it as the skin shows it, and of what the skin shows beside it.
type State = [f64; 6];

/// The rod under the load of a tap.
struct Loaded<'a> {
    setup: &'a Setup,
    taper: Taper,
    start: f64,
    /// The whisker from the face of its clamp.
    whole: Taper,
    law: SectionLaw,
    chart: Option<&'a Chart>,
    /// N.
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
    /// Without a foil.
    pub(super) const UNMOVED: Self = Self { angle: 0.0, place: [0.0; 2] };

    /// How far the real base is turned, rad.
    pub(super) fn turned(&self) -> f64 {
        self.angle
    }

    /// How far `point`, seen from the real base, is from there as seen from that of the rod without a foil; the base's motion times `share`.
    pub(super) fn moved(&self, point: [f64; 2], share: f64) -> [f64; 2] {
        let [x, y] = turned(point, share * self.angle);
        [share * self.place[0] + x, share * self.place[1] + y]
    }

    /// The base, and what the skin shows, of a rod under `load`. `None` where the material ends, or the rod has no contact.
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
        // Nothing is bent beyond the contact.
        let gauge = shared.gauge.map(|x| (x - shared.start).min(arc));
        // The strain of the rod is better known than what is integrated here, most of all next to the contact: what counts is their ratio.
        let told = |plain: f64, [shown, beside]: [f64; 2]| {
            let [plain, shown, beside] = [plain, shown, beside].map(|x| rod.side * x / width);
            let ratio = strain / plain;
            beside + if (0.5..2.0).contains(&ratio) { shown * ratio } else { strain + shown - plain }
        };
        let Some(foil) = foil else {
            // Only a chart asks for a gauge that begins behind the rod: what is passed on the way there is no part of its mean.
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
    /// `state` carried from the first of `places` to the last, by the classic Runge–Kutta method.
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

    /// d/ds of a state at `s`, the strain of the skin where it is `under` the gauge, where the rod bends `bends` times as much as without a foil.
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

    /// e₀ and κR under n and m, MPa: as the kernel's chart has them, or beyond it the law itself.
    fn deform(&self, n: f64, m: f64) -> Option<[f64; 2]> {
        let unit = std::f64::consts::PI * self.setup.model.material.e0();
        let charted = self.chart.and_then(|chart| chart.at(n / unit, 4.0 * m.abs() / unit));
        if let Some([axial, bending]) = charted {
            return Some([axial, bending.copysign(m)]);
        }
        self.law.deform(n, m).map(|strain| [strain.axial, strain.bending])
    }
}
