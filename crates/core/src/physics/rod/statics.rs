//! Forces, moment and the equations of a planar rod (model §3).

use glam::DVec2;

use super::RodProblem;
use super::ode::{self, Ended, Slope};
use crate::physics::body::Body;
use crate::physics::section::{SectionLaw, SectionStrain};
use crate::physics::solid::{Bonded, HALVED, Held, distorted};
use crate::physics::taper::Taper;
use crate::scene::model::{Material, Side};

/// A force on the end s = c of a rod, in the contact frame: origin at that end, d1 along it.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndLoad {
    /// c, mm.
    pub arc: f64,
    /// N.
    pub force: DVec2,
    /// Where the force acts, mm.
    pub point: DVec2,
}

/// Deformation of the rod at one section.
pub(super) struct Deformation {
    /// Strain of the centreline.
    pub stretch: f64,
    /// κ, 1/mm.
    pub curvature: f64,
    /// γ.
    pub shear: f64,
    /// Strain of the gauge's fibre.
    pub fibre: f64,
    /// |e₀| + |κR|: a nonlinear law tells each of them from sums over the section of numbers of this size.
    pub size: f64,
    /// R, mm.
    pub radius: f64,
}

/// What a section does under axial force N, shear force Q (N) and moment M (N mm); `None` if it cannot bear them.
pub(super) trait Response {
    /// Of a section at `s`; `within` is a place between the same [edges](Self::edges).
    fn deform(&self, at: (f64, f64), axial: f64, shear: f64, moment: f64) -> Option<Deformation>;

    /// Places at which they change suddenly, rising.
    fn edges(&self) -> Vec<f64> {
        Vec::new()
    }

    /// How much a section between two of these places bends, where it is not as it deforms.
    fn bends(&self, _within: f64) -> f64 {
        1.0
    }

    /// κ₀ of the resting rod.
    fn rest(&self, _s: f64) -> f64 {
        0.0
    }
}

/// A whisker's sections.
pub(super) struct Whisker<'a> {
    pub taper: Taper,
    /// What is no cone.
    pub body: Option<&'a Body>,
    pub law: SectionLaw,
    pub extension: bool,
    /// 1/(kG), 1/MPa; 0 without shear.
    pub shear_compliance: f64,
    pub side: Side,
    /// A foil under the gauge.
    pub foil: Option<Bonded>,
    /// Where sections distort.
    pub skin: Option<Skin>,
}

/// The skin of a whisker whose sections distort.
pub(super) struct Skin {
    /// The whisker from the face of its clamp.
    pub taper: Taper,
    /// Where its rod begins, mm.
    pub start: f64,
    /// E, MPa.
    pub modulus: f64,
    /// What both sides lose, in (κR)².
    pub halved: f64,
}

impl Skin {
    /// Of the rod `problem`, which begins where its clamp holds it.
    pub fn new(problem: &RodProblem<'_>) -> Option<Self> {
        let model = problem.model;
        let (taper, start) = Self::whisker(problem);
        model.distorting.then(|| Self {
            taper,
            start,
            modulus: model.material.e0(),
            halved: if matches!(model.material, Material::NeoHookean(_)) { HALVED } else { 0.0 },
        })
    }

    /// The whisker from the face of its clamp, and where its rod, that of `problem`, begins, mm from there.
    pub fn whisker(problem: &RodProblem<'_>) -> (Taper, f64) {
        let (c0, taper) = (Held::new(problem.model).c0, problem.taper);
        // D' = D − 2 tan α c₀ D.
        let start = c0 * taper.D / (1.0 - 2.0 * taper.tan_alpha * c0);
        (taper.from(-start), start)
    }

    /// Strain of the skin on the side `sign` (1: of the contact) at `s` of the rod, under its axial and bending strain and its shear force, N.
    fn strain(&self, s: f64, strain: SectionStrain, shear: f64, sign: f64) -> f64 {
        let [bending, by_shear] = distorted(&self.taper, self.modulus, s + self.start);
        strain.axial
            - sign * (strain.bending * bending + shear * by_shear)
            - self.halved * strain.bending * strain.bending
    }
}

impl Whisker<'_> {
    /// R, mm, and what a section does under an axial force and a moment.
    fn strain(&self, (s, within): (f64, f64), axial: f64, moment: f64) -> Option<(f64, SectionStrain)> {
        if let Some(body) = self.body {
            return body.deform((&self.law, self.extension), (s, within), [axial, moment]);
        }
        let r = self.taper.radius(s);
        let n = if self.extension { axial / (r * r) } else { 0.0 };
        Some((r, self.law.deform(n, moment / (r * r * r))?))
    }
}

impl Response for Whisker<'_> {
    fn deform(&self, at: (f64, f64), axial: f64, shear: f64, moment: f64) -> Option<Deformation> {
        let (r, strain) = self.strain(at, axial, moment)?;
        let sign = if self.side == Side::Far { -1.0 } else { 1.0 };
        let fibre = match &self.skin {
            Some(skin) => skin.strain(at.0, strain, shear, sign),
            None => strain.axial - sign * strain.bending,
        };
        let slide = match self.body {
            Some(_) if self.shear_compliance == 0.0 => 0.0,
            Some(body) => shear / body.section(at.0, at.1).shear,
            None => shear * self.shear_compliance / (std::f64::consts::PI * r * r),
        };
        Some(Deformation {
            stretch: if self.extension { strain.axial } else { 0.0 },
            curvature: strain.bending / r,
            shear: slide,
            fibre,
            size: strain.axial.abs() + strain.bending.abs(),
            radius: r,
        })
    }

    fn edges(&self) -> Vec<f64> {
        let foil = self.foil.iter().flat_map(|foil| foil.span);
        self.body.iter().flat_map(|body| body.knots()).copied().chain(foil).collect()
    }

    fn bends(&self, within: f64) -> f64 {
        let under = self.foil.filter(|foil| foil.span[0] < within && within < foil.span[1]);
        under.map_or(1.0, |foil| 1.0 - foil.stiffening)
    }

    fn rest(&self, s: f64) -> f64 {
        self.body.map_or(0.0, |body| body.curvature(s))
    }
}

/// Sections that only bend; the function gives EI(s), N mm².
pub(super) struct Bending<F>(pub F);

impl<F: Fn(f64) -> f64> Response for Bending<F> {
    fn deform(&self, (s, _): (f64, f64), _: f64, _: f64, moment: f64) -> Option<Deformation> {
        let curvature = moment / (self.0)(s);
        Some(Deformation {
            stretch: 0.0,
            curvature,
            shear: 0.0,
            fibre: 0.0,
            size: curvature.abs(),
            radius: 1.0,
        })
    }
}

/// The rod between its end and a section at the distance σ = c − s from it, in the contact frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Bent {
    /// ψ.
    pub angle: f64,
    /// r(s) + (σ, 0), mm: the position without its straight part, so that a small deflection keeps its digits.
    pub offset: DVec2,
    /// ∫ of the gauge fibre's strain over the gauge, mm.
    pub elongation: f64,
}

impl Bent {
    /// What errors are measured by on a rod of length `arc`. The shortening, of second order, may be so small that its digits
    /// are noise: of the deflection, and next to the contact of the bending strain, from which a nonlinear law has the stretch.
    fn scale(arc: f64, y: &[f64; 4]) -> [f64; 4] {
        let [angle, along, across, elongation] = y.map(f64::abs);
        [angle, along.max(1e-3 * across).max(1e-4 * arc * angle), across, elongation]
    }
}

impl EndLoad {
    /// N, Q and M at the distance `sigma` from the end.
    fn resultants(&self, sigma: f64, bent: &Bent) -> [f64; 3] {
        let d1 = DVec2::from_angle(bent.angle);
        let arm = self.point + DVec2::new(sigma, 0.0) - bent.offset;
        [self.force.dot(d1), self.force.dot(d1.perp()), arm.perp_dot(self.force)]
    }

    /// Derivatives with respect to σ, within `length` of where the segment begins: −dψ/ds, −dr/ds + (1, 0) and, over the gauge, the fibre's strain.
    fn slope(
        &self,
        rod: &impl Response,
        (over_gauge, length, within, bends): (bool, f64, f64, f64),
        sigma: f64,
        y: &[f64; 4],
    ) -> Option<Slope<4>> {
        let bent = Bent::from(*y);
        let [axial, shear, moment] = self.resultants(sigma, &bent);
        let s = self.arc - sigma;
        let section = rod.deform((s, within), axial, shear, moment)?;
        let rest = rod.rest(s);
        let (sin, cos) = bent.angle.sin_cos();
        let half = (0.5 * bent.angle).sin();
        let (stretched, over) = (f64::from(section.stretch != 0.0), f64::from(over_gauge));
        // The angle is no better known than the curvature that it is summed of.
        let (turn, bend) =
            (sin.abs() + length * section.size / section.radius, section.size / section.radius + rest.abs());
        let slide = section.shear.abs();
        Some(Slope {
            rate: [
                rest - section.curvature * bends,
                2.0 * half * half - section.stretch * cos + section.shear * sin,
                -(1.0 + section.stretch) * sin - section.shear * cos,
                over * section.fibre,
            ],
            size: [
                bend,
                turn * turn + stretched * section.size + slide * turn,
                turn + slide,
                over * section.size,
            ],
        })
    }

    fn carry(
        &self,
        rod: &impl Response,
        over_gauge: bool,
        from: Bent,
        start: f64,
        length: f64,
    ) -> Result<Bent, Ended> {
        let end = start + length;
        let inside = |sigma: &f64| start < *sigma && *sigma < end;
        let places = rod.edges().into_iter().rev().map(|s| self.arc - s).filter(inside).chain([end]);
        let (mut y, mut at) = (from.into(), start);
        for place in places {
            let within = self.arc - 0.5 * (at + place);
            let over = (over_gauge, length, within, rod.bends(within));
            let slope = |sigma, y: &[f64; 4]| self.slope(rod, over, sigma, y);
            // As a difference a short length would lose its digits.
            let part = if at == start && place == end { length } else { place - at };
            y = ode::integrate(slope, |y: &[f64; 4]| Bent::scale(self.arc, y), y, at, part)?;
            at = place;
        }
        Ok(Bent::from(y))
    }

    /// The clamped end of the rod, with the gauge over [x1, x2].
    pub fn bend(&self, rod: &impl Response, gauge: [f64; 2]) -> Result<Bent, Ended> {
        let [x1, x2] = gauge.map(|x| x.clamp(0.0, self.arc));
        let beyond = self.carry(rod, false, Bent::default(), 0.0, self.arc - x2)?;
        let under = self.carry(rod, true, beyond, self.arc - x2, x2 - x1)?;
        self.carry(rod, false, under, self.arc - x1, x1)
    }

    /// Whether every fibre of `whisker`, looked at in `parts` + 1 equally spaced sections, is in range.
    pub fn is_in_range(&self, whisker: &Whisker<'_>, parts: u32) -> Result<bool, Ended> {
        let length = self.arc / f64::from(parts);
        let mut bent = Bent::default();
        for i in 0..=parts {
            let sigma = length * f64::from(i);
            if i > 0 {
                bent = self.carry(whisker, false, bent, sigma - length, length)?;
            }
            let [axial, _, moment] = self.resultants(sigma, &bent);
            let s = self.arc - sigma;
            let (_, strain) = whisker.strain((s, s), axial, moment).ok_or(Ended::NoValue)?;
            if !strain.is_in_range() {
                return Ok(false);
            }
        }
        Ok(true)
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
