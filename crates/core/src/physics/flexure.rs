//! Linear theory of a whisker as it is built (model §7), by quadrature: what each sensor shows per unit of drive.
//!
//! A unit force at the contact has the moment m(s) = (h − r₀(s)) × n and does the work C = ∫ m²/EI ds + … on the whisker and its root, so
//! that a drive θ with the lever w needs P = w θ/C.

use std::sync::Arc;

use glam::DVec2;

use super::body::Body;
use crate::scene::model::Drive;
use crate::scene::signal::Signal;

/// A whisker, its sensor and its drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Flexure {
    /// The whisker.
    pub body: Arc<Body>,
    /// What is read.
    pub signal: Signal,
    /// [x1, x2], mm.
    pub gauge: [f64; 2],
    /// r₀, mm; 0 for a displacement drive.
    pub hub: f64,
    /// What is turned or moved.
    pub drive: Drive,
    /// Whether shear counts.
    pub shear: bool,
}

/// A value and its derivative by a.
type Sloped = [f64; 2];

fn times([p, dp]: Sloped, [q, dq]: Sloped) -> Sloped {
    [p * q, dp * q + p * dq]
}

fn over([p, dp]: Sloped, [q, dq]: Sloped) -> Sloped {
    [p / q, (dp - p * dq / q) / q]
}

/// What a unit force at a contact does.
struct Unit {
    /// w.
    lever: Sloped,
    /// C.
    work: Sloped,
    /// m(0).
    moment: Sloped,
    /// n_y.
    across: Sloped,
}

impl Flexure {
    /// h, n, d1 and κ₀ of the contact at `a`.
    fn contact(&self, a: f64) -> (DVec2, DVec2, DVec2, f64) {
        let along = DVec2::from_angle(self.body.rest_angle(a));
        (self.body.rest(a), along.perp(), along, self.body.curvature(a))
    }

    /// m(s) of a unit force at the contact.
    fn moment(&self, (h, n, along, bend): (DVec2, DVec2, DVec2, f64), a: f64, s: f64) -> Sloped {
        if self.body.is_straight() {
            return [a - s, 1.0];
        }
        let arm = h - self.body.rest(s);
        [arm.perp_dot(n), 1.0 + bend * arm.perp_dot(along)]
    }

    fn unit(&self, a: f64) -> Unit {
        let body = &self.body;
        let contact = self.contact(a);
        let (h, n, along, bend) = contact;
        let lever = match self.drive {
            Drive::Angle => {
                let arm = h + DVec2::new(self.hub, 0.0);
                [arm.perp_dot(n), 1.0 + bend * arm.perp_dot(along)]
            }
            Drive::Displacement => [n.y, bend * along.y],
        };
        let moment = self.moment(contact, a, 0.0);
        let (across, length) = ([n.y, bend * along.y], [n.x, bend * along.x]);
        let mut work = [0.0; 2];
        let mut add = |share: f64, of: Sloped| {
            work[0] += share * of[0] * of[0];
            work[1] += 2.0 * share * of[0] * of[1];
        };
        let root = body.root;
        add(1.0 / root.k_theta, moment);
        add(1.0 / root.k_y, across);
        add(1.0 / root.k_x, length);
        body.quadrature(0.0, a, |s, within, weight| {
            let section = body.section(s, within);
            add(weight / section.bending, self.moment(contact, a, s));
            if self.shear {
                let square = DVec2::from_angle(body.rest_angle(s)).perp();
                add(weight / section.shear, [n.dot(square), bend * along.dot(square)]);
            }
        });
        if self.shear {
            work[1] += 1.0 / body.section(a, a * (1.0 - 1e-12)).shear;
        }
        Unit { lever, work, moment, across }
    }

    /// f, positive, and df/da, per rad (or mm) and mm: strain, N·mm or N.
    pub fn value(&self, a: f64) -> Sloped {
        let reads = match self.signal {
            Signal::Strain => {
                let [x1, x2] = self.gauge;
                if a <= x1 {
                    return [0.0; 2];
                }
                let contact = self.contact(a);
                let mut mean = [0.0; 2];
                self.body.quadrature(x1, x2.min(a), |s, within, weight| {
                    let section = self.body.section(s, within);
                    let share = weight * section.radius / (section.bending * (x2 - x1));
                    let moment = self.moment(contact, a, s);
                    mean = [mean[0] + share * moment[0], mean[1] + share * moment[1]];
                });
                let unit = self.unit(a);
                return over(times(unit.lever, mean), unit.work);
            }
            Signal::Moment => |unit: &Unit| unit.moment,
            Signal::Force => |unit: &Unit| unit.across,
        };
        let unit = self.unit(a);
        over(times(unit.lever, reads(&unit)), unit.work)
    }

    /// What the whisker exerts on its root per unit of drive: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, a: f64) -> [f64; 3] {
        let (unit, (_, n, ..)) = (self.unit(a), self.contact(a));
        let force = -unit.lever[0] / unit.work[0];
        [force * unit.moment[0], force * n.x, force * n.y]
    }

    /// Contact force per unit of drive, N/rad or N/mm.
    pub fn force(&self, a: f64) -> f64 {
        let unit = self.unit(a);
        unit.lever[0] / unit.work[0]
    }
}
