//! The reference solver of the exact planar rod (model §3), which judges the kernels and shares no method with them: Gragg–Bulirsch–Stoer
//! extrapolation and shooting. Answers are accurate to 1e-12 … 1e-11, relative.

mod ode;
mod shoot;
mod statics;
mod tilted;

use glam::DVec2;

use crate::physics::section::SectionStrain;
use crate::physics::solid::{Bonded, Held};
use crate::physics::taper::Taper;
use crate::physics::{body::Body, driven::Driven};
use crate::scene::{Contact, Grip, Model, Side};
use crate::status::Status;
use shoot::{Shooter, Shot, Stopped};
use statics::Bent;
pub use tilted::TiltedTap;

const RANGE_PARTS: u32 = 64;

/// Outputs of gauge and contact of one tap.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RodTap {
    /// Mean strain over the gauge, tension positive.
    pub strain: f64,
    /// Force P on the object, N. Negative if a contact that sticks would have to pull.
    pub normal_force: f64,
    /// Friction T on the whisker along its surface, N; positive towards the tip.
    pub tangential_force: f64,
    /// Arc length c of the contact from the clamp, mm. It exceeds L_a when the whisker has slipped off.
    pub contact_arc: f64,
    /// True if the contact has not slipped: it stayed in place, or rolled on a pole.
    pub sticking: bool,
    /// Angle ψ(0) between the whisker at its clamp and at the contact, rad.
    pub base_angle: f64,
    /// Wrench on the root in the motor's frame: M₀, N mm, counterclockwise, and F_x and F_y, N.
    pub wrench: [f64; 3],
}

/// One tap, or one displacement of the object. Lengths in mm.
#[derive(Debug, Clone, Copy)]
pub struct RodProblem<'a> {
    /// The whisker; it continues beyond its tip.
    pub taper: Taper,
    /// Span [x1, x2] of the gauge, 0 ≤ x1 < x2.
    pub gauge: [f64; 2],
    /// Side of the whisker that carries the gauge.
    pub side: Side,
    /// Distance a > 0 of the object along the undeformed whisker.
    pub distance: f64,
    /// Distance r₀ of the motor's axis behind the clamp; a displacement ignores it.
    pub hub: f64,
    /// The drive, ≥ 0.
    pub driven: Driven,
    /// A foil that stiffens the rod under the gauge.
    pub foil: Option<Bonded>,
    /// A built whisker; `taper` then has its D, d and L_a only.
    pub body: Option<&'a Body>,
    /// Effects and material; [`Model::geometry`] is ignored. [`Contact::Stick`] and [`Contact::Coulomb`] need `extension`.
    pub model: &'a Model,
}

impl RodProblem<'_> {
    fn held(&self) -> (Self, f64) {
        let start = Held::new(self.model).start(&self.taper);
        if start == 0.0 {
            return (*self, start);
        }
        let foil = self.foil.map(|foil| Bonded { span: foil.span.map(|x| x - start), ..foil });
        let held = Self {
            taper: self.taper.from(start),
            gauge: self.gauge.map(|x| x - start),
            distance: self.distance - start,
            hub: self.hub + start,
            foil,
            ..*self
        };
        (held, start)
    }

    /// The tap at equilibrium, on the path that starts unloaded.
    /// Errors: `not_converged` without an equilibrium on the path from the unloaded whisker: the contact slides away, the path folds back, or the integration
    /// is inaccurate; `material_limit` if a fibre leaves the range of the law, or a section's tangent vanishes on the path; `at_knot` if the contact
    /// leaves the piece of the profile on which it began; `slipped_off` if it runs past the tip of a whisker that ends there.
    pub fn solve(&self) -> Result<RodTap, Status> {
        let (held, start) = self.held();
        held.tap().map(|tap| RodTap { contact_arc: tap.contact_arc + start, ..tap })
    }

    fn tap(&self) -> Result<RodTap, Status> {
        if self.driven.size() == 0.0 {
            return Ok(RodTap {
                contact_arc: self.distance,
                sticking: self.model.contact != Contact::Frictionless,
                base_angle: self.body.map_or(0.0, |body| -body.rest_angle(self.distance)),
                ..RodTap::default()
            });
        }
        match self.model.contact {
            Contact::Frictionless => self.shoot(Grip::Slide(0.0)),
            Contact::Stick => self.shoot(Grip::Stick),
            Contact::Coulomb(mu) => {
                let shooter = Shooter::new(self, Grip::Stick);
                let sticks = |shot: &Shot| shot.tangential.abs() <= mu * shot.normal;
                // T of the sticking contact, or at the farthest drive at which it sticks.
                let tangential = match shooter.continuation() {
                    Ok(shot) if sticks(&shot) => return self.read(&shooter, shot),
                    Ok(shot) => shot.tangential,
                    Err(Stopped { why, farthest }) => match farthest.ok_or(why)? {
                        // The material ends before the contact slides.
                        shot if why == Status::MATERIAL_LIMIT && sticks(&shot) => return Err(why),
                        shot => shot.tangential,
                    },
                };
                self.shoot(Grip::Slide(mu.copysign(tangential)))
            }
        }
    }

    fn shoot(&self, unknowns: Grip) -> Result<RodTap, Status> {
        let shooter = Shooter::new(self, unknowns);
        let shot = shooter.continuation().map_err(|stopped| stopped.why)?;
        self.read(&shooter, shot)
    }

    fn read(&self, shooter: &Shooter<'_>, shot: Shot) -> Result<RodTap, Status> {
        if !shooter.is_in_range(&shot)? {
            return Err(Status::MATERIAL_LIMIT);
        }
        if let Some(body) = self.body {
            let [near, far] = body.piece(self.distance);
            if self.model.surface && !(near..=far).contains(&shot.load.arc) {
                return Err(Status::AT_KNOT);
            }
        }
        let [x1, x2] = self.gauge;
        Ok(RodTap {
            strain: self.foil.map_or(1.0, |foil| foil.transfer) * shot.bent.elongation / (x2 - x1),
            normal_force: shot.normal,
            tangential_force: shot.tangential,
            contact_arc: shot.load.arc,
            sticking: shooter.unknowns == Grip::Stick,
            base_angle: shot.bent.angle,
            wrench: shooter.wrench(&shot.load, &shot.bent),
        })
    }
}

/// A section of a bent rod, in the frame of its contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BentSection {
    /// Arc s from the face of the clamp, mm.
    pub arc: f64,
    /// ψ: its direction, rad.
    pub angle: f64,
    /// Its place, mm.
    pub place: DVec2,
    /// Strain of the fibre on the touching side.
    pub strain: f64,
}

/// A rod bent by the force on its contact, in the frame of that contact.
#[derive(Debug, Clone, PartialEq)]
pub struct BentRod {
    /// From the contact to the clamp, or to its face where the rod is clamped behind it.
    pub sections: Vec<BentSection>,
    /// The clamped section.
    pub clamp: BentSection,
    /// Move of the base by its springs, mm, and rotation of the contact against the base at rest, rad.
    pub base: (DVec2, f64),
    /// Point of the force, mm.
    pub point: DVec2,
    /// Unit vector towards the centre of the pole.
    pub normal: DVec2,
}

impl RodProblem<'_> {
    /// The rod bent by `force`, [P, T] in N, on the contact at the arc `arc`, mm; in `parts` equal parts. `None` if the material cannot bear it.
    pub fn bent(&self, arc: f64, force: [f64; 2], parts: u32) -> Option<BentRod> {
        let (held, start) = self.held();
        let shooter = Shooter::with(&held, Grip::Stick);
        let load = shooter.load(arc - start, force);
        let end = start.max(0.0);
        let (length, mut sections) = (arc - end, Vec::new());
        let section = |s: f64, bent: &Bent, strain: f64| {
            let place = bent.offset - DVec2::new(arc - s, 0.0);
            BentSection { arc: s, angle: bent.angle, place, strain }
        };
        let see = |i: u32, bent: &Bent, strain: SectionStrain| {
            let s = if i == 0 { arc } else { end + length * (1.0 - f64::from(i) / f64::from(parts)) };
            sections.push(section(s, bent, strain.axial - strain.bending));
            true
        };
        let (_, rod) = load.walk(&shooter.whisker, length, parts, see).ok()?;
        let rod = load.carry(&shooter.whisker, false, rod, length, end - start).ok()?;
        let (clamp, base) = (section(start, &rod, 0.0), shooter.base(&load, &rod));
        Some(BentRod { sections, clamp, base, point: load.point, normal: shooter.tilt(load.arc) })
    }
}
