//! Forces, moment and the equations of a planar rod (model §3).

use std::f64::consts::PI;

use glam::DVec2;

use super::RodProblem;
use super::ode::{self, Slope};
use crate::physics::section::{SectionLaw, SectionStrain};
use crate::physics::solid::{Bonded, HALVED, distorted};
use crate::physics::taper::Taper;
use crate::scene::{Material, Model, Side};
use crate::status::Status;

/// A force on the end s = c of a rod, in the contact frame: origin at that end, d1 along it.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndLoad {
    pub arc: f64,
    pub force: DVec2,
    /// Point where the force acts, mm.
    pub point: DVec2,
}

pub(super) struct Whisker<'a> {
    pub problem: &'a RodProblem<'a>,
    pub law: SectionLaw,
    /// 1/(kG), 1/MPa; 0 without shear.
    pub shear_compliance: f64,
    /// The cone from the face of its clamp, and where the rod begins on it, mm.
    pub whole: (Taper, f64),
}

impl Whisker<'_> {
    /// Strain of the skin on the contact side (`sign` 1) or the far side (−1) at `s`, under the rod's strain and shear force, N.
    #[inline(always)]
    fn skin(&self, s: f64, strain: SectionStrain, shear: f64, sign: f64) -> f64 {
        let ((taper, start), material) = (&self.whole, &self.problem.model.material);
        let [bending, by_shear] = distorted(taper, material.e0(), s + start);
        // Loss on both sides, in (κR)².
        let halved = if matches!(material, Material::Hooke(_)) { 0.0 } else { HALVED };
        strain.axial
            - (strain.bending * bending + shear * by_shear) * sign
            - strain.bending * halved * strain.bending
    }

    #[inline(always)]
    fn strain(&self, (s, within): (f64, f64), axial: f64, moment: f64) -> Option<(f64, SectionStrain)> {
        let RodProblem { taper, body, model: Model { extension, .. }, .. } = self.problem;
        if let Some(body) = body.filter(|body| body.built.inner.is_some()) {
            let section = body.section(s, within);
            let axial = if *extension { axial / section.axial } else { 0.0 };
            let bending = moment * section.radius / section.bending;
            return Some((section.radius, SectionStrain { axial, bending }));
        }
        let r = body.map_or_else(|| taper.radius(s), |body| body.radius(s, within));
        let n = if *extension { axial / (r * r) } else { 0.0 };
        let m = moment / (r * r * r);
        Some((r, self.law.deform(n, m)?))
    }

    /// Places where sections change suddenly, ascending.
    fn edges(&self) -> Vec<f64> {
        let foil = self.problem.foil.iter().flat_map(|foil| foil.span);
        self.problem.body.iter().flat_map(|body| body.knots()).copied().chain(foil).collect()
    }

    /// Factor of the curvature on the piece, between [edges](Self::edges), that holds `within`.
    pub fn bends(&self, within: f64) -> f64 {
        let inside = |foil: &Bonded| foil.span[0] < within && within < foil.span[1];
        self.problem.foil.filter(inside).map_or(1.0, |foil| 1.0 - foil.stiffening)
    }
}

/// The rod between its end and a section at the distance σ = c − s from it, in the contact frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bent {
    pub angle: f64,
    /// r(s) + (σ, 0), mm: the position without its straight part, so that a small deflection keeps its digits.
    pub offset: DVec2,
    /// ∫ of the gauge fibre's strain over the gauge, mm.
    pub elongation: f64,
}

impl EndLoad {
    #[inline(always)]
    fn resultants(&self, sigma: f64, bent: &Bent) -> [f64; 3] {
        let d1 = DVec2::from_angle(bent.angle);
        let arm = self.point + DVec2::new(sigma, 0.0) - bent.offset;
        [self.force.dot(d1), self.force.dot(d1.perp()), arm.perp_dot(self.force)]
    }

    /// Derivatives by σ within `length` of the segment's start: −dψ/ds, −dr/ds + (1, 0) and, over the gauge, the fibre's strain.
    #[inline(always)]
    pub fn slope(
        &self,
        rod: &Whisker<'_>,
        (over_gauge, length, within, bends): (bool, f64, f64, f64),
        sigma: f64,
        y: &[f64; 4],
    ) -> Option<Slope<4>> {
        let bent = Bent::from(*y);
        let [axial, shear, moment] = self.resultants(sigma, &bent);
        let s = self.arc - sigma;
        let (r, strain) = rod.strain((s, within), axial, moment)?;
        let RodProblem { side, model, body, .. } = *rod.problem;
        let sign = if side == Side::Far { -1.0 } else { 1.0 };
        let fibre = match model.distorting {
            true => rod.skin(s, strain, shear, sign),
            false => strain.axial - strain.bending * sign,
        };
        let slide = match body {
            _ if rod.shear_compliance == 0.0 => 0.0,
            Some(body) => shear / body.section(s, within).shear,
            None => shear * rod.shear_compliance / (r * PI * r),
        };
        let stretch = if model.extension { strain.axial } else { 0.0 };
        let rest = body.map_or(0.0, |body| body.curvature(s));
        let (sin, cos) = bent.angle.sin_cos();
        // 1 − cos ψ without loss of digits.
        let versine = if cos > 0.0 { sin * sin / (cos + 1.0) } else { 1.0 - cos };
        // |e₀| + |κR|, scale of the rounding: both come from section sums of this size.
        let size = strain.axial.abs() + strain.bending.abs();
        let (stretched, over) = (f64::from(stretch != 0.0), f64::from(over_gauge));
        // The angle is as uncertain as the curvature that it sums.
        let turn = sin.abs() + length * size / r;
        let sheared = slide.abs();
        Some(Slope {
            rate: [
                rest - strain.bending / r * bends,
                versine - stretch * cos + slide * sin,
                -(stretch + 1.0) * sin - slide * cos,
                fibre * over,
            ],
            size: [
                size / r + rest.abs(),
                turn * turn + stretched * size + sheared * turn,
                turn + sheared,
                over * size,
            ],
        })
    }

    pub fn carry(
        &self,
        rod: &Whisker<'_>,
        over_gauge: bool,
        from: Bent,
        start: f64,
        length: f64,
    ) -> Result<Bent, Status> {
        let end = start + length;
        let inside = |sigma: &f64| start < *sigma && *sigma < end;
        let places: Vec<f64> =
            rod.edges().into_iter().rev().map(|s| self.arc - s).filter(inside).chain([end]).collect();
        let (mut y, mut at) = (from.into(), start);
        let whole = places.len() == 1;
        for place in places {
            let within = self.arc - 0.5 * (at + place);
            // A difference would lose the digits of a short length.
            let part = if whole { length } else { place - at };
            let over = (over_gauge, length, within, rod.bends(within));
            let slope = |sigma, y: &[f64; 4]| self.slope(rod, over, sigma, y);
            // The shortening is of second order and may be noise: it is measured by deflection and bending strain.
            let scale = |y: &[f64; 4]| {
                let [angle, along, across, elongation] = y.map(f64::abs);
                [angle, along.max(1e-3 * across).max(1e-4 * self.arc * angle), across, elongation]
            };
            y = ode::integrate(slope, scale, y, at, part)?;
            at = place;
        }
        Ok(Bent::from(y))
    }

    pub fn bend(&self, rod: &Whisker<'_>, gauge: [f64; 2]) -> Result<Bent, Status> {
        let [x1, x2] = gauge.map(|x| x.max(0.0).min(self.arc));
        let beyond = self.carry(rod, false, Bent::default(), 0.0, self.arc - x2)?;
        let under = self.carry(rod, true, beyond, self.arc - x2, x2 - x1)?;
        self.carry(rod, false, under, self.arc - x1, x1)
    }

    /// Calls `see` with number, rod and strain of the sections between equal `parts` of `length` from the contact, until it says false.
    pub fn walk(
        &self,
        whisker: &Whisker<'_>,
        length: f64,
        parts: u32,
        mut see: impl FnMut(u32, &Bent, SectionStrain) -> bool,
    ) -> Result<(bool, Bent), Status> {
        let (part, mut bent) = (length / f64::from(parts), Bent::default());
        for i in 0..=parts {
            let sigma = part * f64::from(i);
            if i > 0 {
                bent = self.carry(whisker, false, bent, sigma - part, part)?;
            }
            let [axial, _, moment] = self.resultants(sigma, &bent);
            let s = self.arc - sigma;
            let (_, strain) = whisker.strain((s, s), axial, moment).ok_or(Status::MATERIAL_LIMIT)?;
            if !see(i, &bent, strain) {
                return Ok((false, bent));
            }
        }
        Ok((true, bent))
    }
}

impl From<[f64; 4]> for Bent {
    fn from([angle, x, y, elongation]: [f64; 4]) -> Self {
        Self { angle, offset: DVec2::new(x, y), elongation }
    }
}

impl From<Bent> for [f64; 4] {
    fn from(bent: Bent) -> Self {
        [bent.angle, bent.offset.x, bent.offset.y, bent.elongation]
    }
}
