//! The rod next to its clamp: how a foil moves the base, and what the skin under the gauge shows.

use crate::design::Shared;
use crate::kernel::Chart;
use crate::physics::section::SectionLaw;
use crate::physics::solid::{HALVED, distorted};
use crate::physics::taper::Taper;
use crate::scene::{Material, Setup, Side};

/// Longest steps of the integration, over D: under the gauge, and elsewhere; at tolerances from [`COARSE`] on twice as long.
const STEPS: [f64; 2] = [1.0 / 60.0, 0.05];
const COARSE: f64 = 1e-6;

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

/// Direction, place and elongation of the skin: ψ, x, y, ∫ ε ds.
type State = [f64; 4];

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
    steps: [f64; 2],
}

impl Base {
    /// Without a foil.
    pub(super) const UNMOVED: Self = Self { angle: 0.0, place: [0.0; 2] };

    /// How far the real base is turned, rad.
    pub(super) fn turned(&self) -> f64 {
        self.angle
    }

    /// `point`, seen from the real base, from that of the rod without a foil; its motion times `share`.
    pub(super) fn seen(&self, [x, y]: [f64; 2], share: f64) -> [f64; 2] {
        let (sin, cos) = (share * self.angle).sin_cos();
        [share * self.place[0] + x * cos - y * sin, share * self.place[1] + x * sin + y * cos]
    }

    /// The base, and what the skin shows, of a rod with the contact force P, N, and the angle ψ(0), rad, whose contact's normal goes through
    /// `through`, mm from where the rod begins. `None` where the material ends.
    pub(super) fn reached(
        setup: &Setup,
        shared: &Shared,
        (chart, tolerance): (Option<&Chart>, f64),
        [force, angle]: [f64; 2],
        through: [f64; 2],
    ) -> Option<(Self, Seen)> {
        let (model, foil) = (&setup.model, shared.foil);
        if foil.is_none() && !model.distorting {
            return Some((Self::UNMOVED, None));
        }
        let alpha = if model.surface { shared.taper.tan_alpha.atan() } else { 0.0 };
        let (sin, cos) = (alpha + angle).sin_cos();
        let neo = matches!(model.material, Material::NeoHookean(_));
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
            halved: if neo && model.distorting { HALVED } else { 0.0 },
            steps: STEPS.map(|step| step * if tolerance >= COARSE { 2.0 } else { 1.0 }),
        };
        let gauge = shared.gauge.map(|x| x - shared.start);
        let Some(foil) = foil else {
            let end = rod.along([0.0; 4], &[0.0, gauge[0], gauge[1]], gauge, None)?;
            return Some((Self::UNMOVED, Some(rod.side * end[3] / (gauge[1] - gauge[0]))));
        };
        let span = foil.span.map(|x| (x - shared.start).max(0.0));
        let far = span[1].max(gauge[1]);
        let [angle, x, y, _] = rod.along([0.0; 4], &[0.0, far], gauge, None)?;
        let mut places = [far, span[1], gauge[1], gauge[0], span[0], 0.0];
        places.sort_by(|p, q| q.total_cmp(p));
        let end = rod.along([angle, x, y, 0.0], &places, gauge, Some((span, foil.stiffening)))?;
        let mean = -rod.side * foil.transfer * end[3] / (gauge[1] - gauge[0]);
        Some((Self { angle: end[0], place: [end[1], end[2]] }, Some(mean)))
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
            let under = over(gauge) && (foil.is_some() || places.len() > 2);
            let bends = foil.filter(|(span, _)| over(*span)).map_or(1.0, |(_, less)| 1.0 - less);
            let step = self.steps[usize::from(!under)] * self.whole.D;
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
    fn slope(&self, s: f64, [angle, x, y, _]: &State, under: bool, bends: f64) -> Option<State> {
        let model = &self.setup.model;
        let ([fx, fy], (sin, cos)) = (self.force, angle.sin_cos());
        let (axial, shear) = (fx * cos + fy * sin, fy * cos - fx * sin);
        let moment = (self.through[0] - x) * fy - (self.through[1] - y) * fx;
        let r = self.taper.radius(s);
        let n = if model.extension { axial / (r * r) } else { 0.0 };
        let strain = self.deform(n, moment / (r * r * r))?;
        let stretch = if model.extension { strain[0] } else { 0.0 };
        let e = model.material.e0();
        let slide =
            if model.shear { shear * self.shear_compliance() / (std::f64::consts::PI * r * r) } else { 0.0 };
        let fibre = match (under, model.distorting) {
            (false, _) => 0.0,
            (true, false) => strain[0] - self.side * strain[1],
            (true, true) => {
                let [bending, by_shear] = distorted(&self.whole, e, s + self.start);
                strain[0]
                    - self.side * (strain[1] * bending + shear * by_shear)
                    - self.halved * strain[1] * strain[1]
            }
        };
        let (along, across) = (1.0 + stretch, slide);
        Some([bends * strain[1] / r, along * cos - across * sin, along * sin + across * cos, fibre])
    }

    fn shear_compliance(&self) -> f64 {
        let model = &self.setup.model;
        let k =
            crate::physics::solid::Held::new(model).shear * 6.0 * (1.0 + model.nu) / (7.0 + 6.0 * model.nu);
        2.0 * (1.0 + model.nu) / (k * model.material.e0())
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
