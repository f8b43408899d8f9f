//! Linear theory of a built whisker (model §7), by quadrature: the reading of each sensor per unit of drive.
//! A unit force does the work C = ∫ m²/EI ds + …, m(s) = (h − r₀(s)) × n, so that a drive θ with the lever w needs P = w θ/C.

use std::sync::Arc;

use glam::DVec2;

use super::body::{Body, Place};
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
    parts: Arc<[Vec<Part>; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    end: f64,
    place: DVec2,
    square: DVec2,
    /// w/EI, w R/EI and w/kGA, w the weight of the place.
    shares: [f64; 3],
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
    fn moment(&self, place: DVec2) -> Sloped {
        let arm = self.h - place;
        [arm.perp_dot(self.n), self.bend * arm.perp_dot(self.along) + 1.0]
    }
}

impl Part {
    fn new(body: &Body, Place { s, within, end }: Place, weight: f64) -> Self {
        let section = body.section(s, within);
        let shares = [1.0 / section.bending, section.radius / section.bending, 1.0 / section.shear];
        let square = match body.built.is_straight() {
            true => DVec2::new(0.0, 1.0),
            false => DVec2::from_angle(body.rest_angle(s)).perp(),
        };
        Self { end, place: body.rest(s), square, shares: shares.map(|share| weight * share) }
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
        let over = |from: f64, to: f64| {
            let mut parts = Vec::new();
            body.quadrature(from, to, |place, weight| parts.push(Part::new(&body, place, weight)));
            parts
        };
        let strained = if signal == Signal::Strain { over(gauge[0], gauge[1]) } else { Vec::new() };
        let parts = Arc::new([over(0.0, body.reach()), strained]);
        Self { body, signal, gauge, hub, drive, shear, parts }
    }

    fn contact(&self, a: f64) -> Contact {
        let along = DVec2::from_angle(self.body.rest_angle(a));
        Contact { h: self.body.rest(a), n: along.perp(), along, bend: self.body.curvature(a) }
    }

    fn each(&self, parts: &[Part], from: f64, a: f64, mut add: impl FnMut(&Part)) {
        let whole = parts.partition_point(|part| part.end <= a);
        parts[..whole].iter().for_each(&mut add);
        let near = whole.checked_sub(1).map_or(from, |last| parts[last].end);
        if near < a && whole < parts.len() {
            self.body.panel(near, a, |place, weight| add(&Part::new(&self.body, place, weight)));
        }
    }

    fn unit(&self, a: f64) -> Unit {
        let contact = self.contact(a);
        let Contact { h, n, along, bend } = contact;
        let lever = match self.drive {
            Drive::Angle => {
                let arm = h + DVec2::new(self.hub, 0.0);
                [arm.perp_dot(n), bend * arm.perp_dot(along) + 1.0]
            }
            Drive::Displacement => [n.y, bend * along.y],
        };
        let moment = contact.moment(DVec2::ZERO);
        let (across, length) = ([n.y, bend * along.y], [n.x, bend * along.x]);
        let mut work = [0.0; 2];
        let mut add = |share: f64, of: Sloped| {
            work[0] += share * of[0] * of[0];
            work[1] += share * 2.0 * of[0] * of[1];
        };
        let root = self.body.built.root;
        add(1.0 / root.k_theta, moment);
        add(1.0 / root.k_y, across);
        add(1.0 / root.k_x, length);
        self.each(&self.parts[0], 0.0, a, |part| {
            add(part.shares[0], contact.moment(part.place));
            if self.shear {
                add(part.shares[2], [n.dot(part.square), bend * along.dot(part.square)]);
            }
        });
        if self.shear {
            work[1] += 1.0 / self.body.section(a, a * (1.0 - 1e-12)).shear;
        }
        Unit { lever, work, moment, across }
    }

    /// f, positive, and df/da, per rad (or mm) and mm: strain, N·mm or N.
    pub fn value(&self, a: f64) -> Sloped {
        let reads = match self.signal {
            Signal::Strain => {
                let [x1, x2] = self.gauge;
                let mut mean = [0.0; 2];
                if a <= x1 {
                    return mean;
                }
                let contact = self.contact(a);
                self.each(&self.parts[1], x1, a.min(x2), |part| {
                    let (share, moment) = (part.shares[1] / (x2 - x1), contact.moment(part.place));
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

    /// Wrench on the root per unit of drive: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, a: f64) -> [f64; 3] {
        let (unit, Contact { n, .. }) = (self.unit(a), self.contact(a));
        let force = -unit.lever[0] / unit.work[0];
        [force * unit.moment[0], force * n.x, force * n.y]
    }

    /// Contact force per unit of drive, N/rad or N/mm.
    pub fn force(&self, a: f64) -> f64 {
        let unit = self.unit(a);
        unit.lever[0] / unit.work[0]
    }
}
