//! Linear theory of a built whisker (model §7), by quadrature: the reading of each sensor per unit of drive.
//! A unit force does the work C = ∫ m²/EI ds + …, m(s) = (h − r₀(s)) × n, so that a drive θ with the lever w needs P = w θ/C.

use std::sync::Arc;

use glam::{DMat2, DVec2};

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

/// The end of a panel, and sums over all nodes before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    end: f64,
    place: DVec2,
    sums: Sums,
}

/// Sums over nodes of weight w about a place: Σ w/EI, Σ q w/EI and Σ q qᵀ w/EI with q from the node to that place, for the strain of a gauge times R;
/// and Σ d dᵀ w/kGA with d across the section.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sums {
    whole: f64,
    first: DVec2,
    second: DMat2,
    shear: DMat2,
}

fn outer(p: DVec2, q: DVec2) -> DMat2 {
    DMat2::from_cols(p * q.x, p * q.y)
}

impl Sums {
    const ZERO: Self = Self { whole: 0.0, first: DVec2::ZERO, second: DMat2::ZERO, shear: DMat2::ZERO };

    /// The sums about a place further on; straight whiskers have no terms of different signs.
    fn moved(self, by: DVec2) -> Self {
        let Self { whole, first, second, shear } = self;
        let second = second + outer(by, first) + outer(first, by) + outer(by, by) * whole;
        Self { whole, first: first + by * whole, second, shear }
    }

    fn take(&mut self, body: &Body, place: Place, weight: f64, about: DVec2, (strain, shear): (bool, bool)) {
        let (section, arm) = (body.section(place.s, place.within), about - body.rest(place.s));
        let share = weight / section.bending * if strain { section.radius } else { 1.0 };
        self.whole += share;
        self.first += arm * share;
        self.second += outer(arm, arm) * share;
        if shear {
            let straight = body.built.is_straight();
            let across = if straight { DVec2::Y } else { DVec2::from_angle(body.rest_angle(place.s)).perp() };
            self.shear += outer(across, across) * (weight / section.shear);
        }
    }
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
        let over = |strain: bool, from: f64, to: f64| {
            let mut parts: Vec<Part> = Vec::new();
            body.quadrature(from, to, |node, weight| {
                let before = parts.last().copied();
                if before.is_none_or(|part| part.end < node.end) {
                    let place = body.rest(node.end);
                    let sums = before.map_or(Sums::ZERO, |part| part.sums.moved(place - part.place));
                    parts.push(Part { end: node.end, place, sums });
                }
                let Some(Part { place, sums, .. }) = parts.last_mut() else { return };
                sums.take(&body, node, weight, *place, (strain, shear));
            });
            parts
        };
        let strained = if signal == Signal::Strain { over(true, gauge[0], gauge[1]) } else { Vec::new() };
        let parts = Arc::new([over(false, 0.0, body.reach()), strained]);
        Self { body, signal, gauge, hub, drive, shear, parts }
    }

    fn contact(&self, a: f64) -> Contact {
        let along = DVec2::from_angle(self.body.rest_angle(a));
        Contact { h: self.body.rest(a), n: along.perp(), along, bend: self.body.curvature(a) }
    }

    /// Sums between two arcs about a place, of the work or, where `strain`, of the gauge.
    fn sums(&self, strain: bool, [from, to]: [f64; 2], about: DVec2) -> Sums {
        let parts = &self.parts[usize::from(strain)];
        let whole = parts.partition_point(|part| part.end <= to);
        let (near, mut sums) = match whole.checked_sub(1).map(|last| parts[last]) {
            Some(Part { end, place, sums }) => (end, sums.moved(about - place)),
            None => (from, Sums::ZERO),
        };
        if near < to && whole < parts.len() {
            let shear = self.shear && !strain;
            self.body.panel(near, to, |place, weight| {
                sums.take(&self.body, place, weight, about, (strain, shear));
            });
        }
        sums
    }

    fn unit(&self, a: f64) -> Unit {
        let contact = self.contact(a);
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
        let root = self.body.built.root;
        add(1.0 / root.k_theta, moment);
        add(1.0 / root.k_y, across);
        add(1.0 / root.k_x, length);
        let Sums { first, second, shear, .. } = self.sums(false, [0.0, a], h);
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
        let reads = match self.signal {
            Signal::Strain => {
                let [x1, x2] = self.gauge;
                if a <= x1 {
                    return [0.0; 2];
                }
                let Contact { h, n, along, bend } = self.contact(a);
                let Sums { whole, first, .. } = self.sums(true, [x1, a.min(x2)], h);
                let mean = [along.dot(first), whole - bend * first.dot(n)].map(|x| x / (x2 - x1));
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
