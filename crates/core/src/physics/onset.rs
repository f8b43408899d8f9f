//! The linear limit of the exact model: force, arc and strain to first order in the drive, in closed form.
//!
//! Unit of length is the contact distance, of force EI₀/a². With a contact on the surface, friction or shear the limit of
//! K is not 1 (extension, or a pole, alone leaves it there); kernels carry the deviation from this solution, so that nothing cancels at small drives.
//!
//! W and H are the contact force across and along the whisker at the contact, X₀ and Y₀ the pole centre from the motor's
//! axis, a₁, a₀ (b₁, b₀) what a unit of W and of H does to the closure across (along) that line, and f the
//! stretch by a unit of H. The closure, to first order in θ, W, H and x = c − 1:
//!
//! - W a₁ + H a₀ + x (Y₀ + X₀ tan α) + Y₀ H f = θ (X₀² + Y₀²)
//! - (X₀ − Y₀ tan α) x + X₀ H f + Y₀ (W b₁ + H b₀) = ζ

/// Dimensionless numbers of a tap; lengths in units of the contact distance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Groups {
    /// τa.
    pub taper: f64,
    /// 1 − τa.
    pub rest: f64,
    /// Tap angle θ, rad.
    pub angle: f64,
    /// r₀; 0 for a displaced object.
    pub hub: f64,
    /// ζ: half the growth of the squared distance to the pole; 0 for a tap angle.
    pub pull: f64,
    /// Base radius.
    pub radius: f64,
    /// tan α for contact on the surface, else 0.
    pub slope: f64,
    /// Contact on the surface.
    pub surface: bool,
    /// Radius of the pole.
    pub pole: f64,
    /// EI₀/(k G A₀); 0 without shear.
    pub shear: f64,
    /// EI₀/(E A₀) where the centreline stretches, else 0.
    pub stretch: f64,
    /// EI₀/(E A₀): gauge strain of a unit axial force, 0 where N is taken as 0 in the section law.
    pub axial_strain: f64,
    /// 1 − x1, 1 − x2, and x2 − x1.
    pub gauge: [f64; 3],
    /// +1 for a gauge on the contact side, −1 on the far side.
    pub side: f64,
}

/// What limits the contact force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// T = μP, sign included; 0 is frictionless.
    Slide(f64),
    /// The contact stays at its arc length.
    Stick,
}

/// The first-order solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Onset {
    /// W.
    pub across: f64,
    /// H.
    pub along: f64,
    /// x = c − 1.
    pub arc: f64,
    /// Unsigned gauge strain.
    pub strain: f64,
}

/// cos α and sin α of a slope.
pub fn direction(slope: f64) -> (f64, f64) {
    if slope == 0.0 {
        return (1.0, slope);
    }
    let c = 1.0 / slope.hypot(1.0);
    (c, slope * c)
}

impl Groups {
    /// Pole centre from the motor's axis before the tap, (X₀, Y₀).
    pub fn pole_centre(&self) -> (f64, f64) {
        let (cos, sin) = direction(self.slope);
        let (radius, pole) =
            if self.surface { (self.radius * self.rest, self.pole) } else { (0.0, self.pole) };
        (1.0 + pole * sin + self.hub, radius + pole * cos)
    }

    /// H/W of a sliding contact.
    pub fn force_ratio(&self, friction: f64) -> f64 {
        let (cos, sin) = direction(self.slope);
        (-sin + friction * cos) / (cos + friction * sin)
    }

    /// The first-order solution for the contact `grip`.
    pub fn onset(&self, grip: Grip) -> Onset {
        let v = self.rest;
        let (x0, y0) = self.pole_centre();
        let contact_radius = if self.surface { self.radius * v } else { 0.0 };
        let (psi1, psi0) =
            ((1.0 + 2.0 * v) / (6.0 * v * v), contact_radius * (1.0 + v + v * v) / (3.0 * v.powi(3)));
        let (eta1, eta0) =
            (1.0 / (6.0 * v * v) - self.shear / v, contact_radius * (2.0 + v) / (6.0 * v.powi(3)));
        let f = self.stretch / v;
        let square = x0 * x0 + y0 * y0;
        let turn = square - self.hub * x0;
        let (a1, a0) = (turn * psi1 - x0 * eta1, turn * psi0 - x0 * eta0);
        let (b1, b0) = (eta1 + self.hub * psi1, eta0 + self.hub * psi0);
        let (right, zeta) = (self.angle * square, self.pull);
        let (across, along, arc) = match grip {
            Grip::Slide(friction) => {
                let ratio = self.force_ratio(friction);
                let (m11, m12) = (a1 + ratio * (a0 + y0 * f), y0 + x0 * self.slope);
                let (m21, m22) = (ratio * x0 * f + y0 * (b1 + ratio * b0), x0 - y0 * self.slope);
                let det = m11 * m22 - m12 * m21;
                let across = (right * m22 - m12 * zeta) / det;
                (across, ratio * across, (m11 * zeta - m21 * right) / det)
            }
            Grip::Stick => {
                let (m11, m12) = (a1, a0 + y0 * f);
                let (m21, m22) = (y0 * b1, x0 * f + y0 * b0);
                let det = m11 * m22 - m12 * m21;
                ((right * m22 - m12 * zeta) / det, (m11 * zeta - m21 * right) / det, 0.0)
            }
        };
        let [lever, section, area] = self.gauge_means(0.0);
        let strain = self.radius * (across * lever + along * contact_radius * section)
            + self.side * self.axial_strain * along * area;
        Onset { across, along, arc, strain }
    }

    /// Means over the gauge, for a contact at 1 + `x`, of (c − s)₊/(1 − τs)³, 1/(1 − τs)³ and 1/(1 − τs)², the last two
    /// over the bent part.
    pub fn gauge_means(&self, x: f64) -> [f64; 3] {
        let [near, far, width] = self.gauge;
        let (c1, c2) = (near + x, far + x);
        let g2 = self.rest - self.taper * x;
        let b1 = 1.0 / (self.taper * near + self.rest);
        if c2 >= 0.0 {
            let b2 = 1.0 / (self.taper * far + self.rest);
            return [0.5 * b1 * b2 * (c1 * b1 + c2 * b2), 0.5 * b1 * b2 * (b1 + b2), b1 * b2];
        }
        let bent = c1.max(0.0) / width;
        let end = 1.0 / g2;
        [0.5 * bent * c1.max(0.0) * b1 * b1 * end, 0.5 * bent * b1 * end * (b1 + end), bent * b1 * end]
    }
}
