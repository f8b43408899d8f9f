//! Linear theory of a built whisker (model §7), by series of its sums (`cumulative.rs`): the reading of each sensor per unit of drive.
//! A unit force does the work C = ∫ m²/EI ds + …, m(s) = (h − r₀(s)) × n, so that a drive θ with the lever w needs P = w θ/C.

use std::sync::Arc;

use glam::DVec2;

use super::body::Body;
use super::cumulative::{Cumulative, Of, Sums};
use crate::scene::built::Root;
use crate::scene::channels::Signal;
use crate::scene::model::Drive;

/// A whisker, its sensor and its drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Flexure {
    /// The whisker.
    pub body: Arc<Body>,
    /// The quantity that is read.
    pub signal: Signal,
    gauge: [f64; 2],
    hub: f64,
    drive: Drive,
    shear: bool,
    /// Compliance of the root: of its turn, and along and across.
    root: [f64; 3],
    /// The work over the whisker, and the strain over the gauge.
    sums: Arc<[Cumulative; 2]>,
}

/// A value and its derivative by a.
type Sloped = [f64; 2];

fn times([p, dp]: Sloped, [q, dq]: Sloped) -> Sloped {
    [p * q, dp * q + p * dq]
}

fn over([p, dp]: Sloped, [q, dq]: Sloped) -> Sloped {
    [p / q, (dp - p * dq / q) / q]
}

/// The contact of the resting whisker: h, n, d1 and κ₀.
#[derive(Clone, Copy)]
struct Contact {
    h: DVec2,
    n: DVec2,
    along: DVec2,
    bend: f64,
}

impl Contact {
    /// Moment of a unit force, at a place this far from the contact.
    fn moment(&self, arm: DVec2) -> Sloped {
        [arm.dot(self.along), 1.0 - self.bend * arm.dot(self.n)]
    }
}

struct Unit {
    lever: Sloped,
    work: Sloped,
    moment: Sloped,
    across: Sloped,
}

impl Flexure {
    /// Lengths in mm.
    pub fn new(
        body: Arc<Body>,
        signal: Signal,
        gauge: [f64; 2],
        (hub, drive): (f64, Drive),
        shear: bool,
    ) -> Self {
        let read = if signal == Signal::Strain { gauge } else { [0.0; 2] };
        let of = |strain, span| Cumulative::new(&body, Of { strain, shear: shear && !strain }, span);
        let sums = Arc::new([of(false, [0.0, body.reach()]), of(true, read)]);
        let Root { k_theta, k_x, k_y } = body.built.root;
        Self { body, signal, gauge, hub, drive, shear, root: [k_theta, k_x, k_y].map(|k| 1.0 / k), sums }
    }

    fn contact(&self, a: f64) -> Contact {
        if self.body.built.is_straight() {
            return Contact { h: DVec2::new(a, 0.0), n: DVec2::Y, along: DVec2::X, bend: 0.0 };
        }
        let along = DVec2::from_angle(self.body.rest_angle(a));
        Contact { h: self.body.rest(a), n: along.perp(), along, bend: self.body.curvature(a) }
    }

    fn unit(&self, a: f64, contact: Contact) -> Unit {
        let Contact { h, n, along, bend } = contact;
        let lever = match self.drive {
            Drive::Angle => contact.moment(h + DVec2::new(self.hub, 0.0)),
            Drive::Displacement => [n.y, bend * along.y],
        };
        let moment = contact.moment(h);
        let (across, length) = ([n.y, bend * along.y], [n.x, bend * along.x]);
        let mut work = [0.0; 2];
        let mut add = |share: f64, of: Sloped| {
            work[0] += share * of[0] * of[0];
            work[1] += share * 2.0 * of[0] * of[1];
        };
        let [by_turn, by_x, by_y] = self.root;
        add(by_turn, moment);
        add(by_y, across);
        add(by_x, length);
        let Sums { first, second, shear, .. } = self.sums[0].to(&self.body, a, h);
        work[0] += along.dot(second * along);
        work[1] += 2.0 * (along.dot(first) - bend * along.dot(second * n));
        if self.shear {
            work[0] += n.dot(shear * n);
            work[1] +=
                2.0 * bend * along.dot(shear * n) + 1.0 / self.body.section(a, a * (1.0 - 1e-12)).shear;
        }
        Unit { lever, work, moment, across }
    }

    /// f, positive, and df/da, per rad (or mm) and mm: strain, N·mm or N.
    pub fn value(&self, a: f64) -> Sloped {
        let ([x1, x2], contact) = (self.gauge, self.contact(a));
        if self.signal == Signal::Strain && a <= x1 {
            return [0.0; 2];
        }
        let unit = self.unit(a, contact);
        let read = match self.signal {
            Signal::Strain => {
                let Contact { h, n, along, bend } = contact;
                let Sums { whole, first, .. } = self.sums[1].to(&self.body, a, h);
                [along.dot(first), whole - bend * first.dot(n)].map(|x| x / (x2 - x1))
            }
            Signal::Moment => unit.moment,
            Signal::Force => unit.across,
        };
        over(times(unit.lever, read), unit.work)
    }

    /// Wrench on the root per unit of drive: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, a: f64) -> [f64; 3] {
        let contact = self.contact(a);
        let (unit, n) = (self.unit(a, contact), contact.n);
        let force = -unit.lever[0] / unit.work[0];
        [force * unit.moment[0], force * n.x, force * n.y]
    }

    /// Contact force per unit of drive, N/rad or N/mm.
    pub fn force(&self, a: f64) -> f64 {
        let unit = self.unit(a, self.contact(a));
        unit.lever[0] / unit.work[0]
    }
}
