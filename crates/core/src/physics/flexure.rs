//! Linear theory of a built whisker (model §7), by quadrature: the reading of each sensor per unit of drive.
//! A unit force does the work C = ∫ m²/EI ds + …, m(s) = (h − r₀(s)) × n, so that a drive θ with the lever w needs P = w θ/C.

use std::sync::Arc;

use super::body::{Body, Place};
use super::real::{Real, Vector};
use crate::scene::channels::Signal;
use crate::scene::model::Drive;

/// A whisker, its sensor and its drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Flexure<T = f64> {
    /// The whisker.
    pub body: Arc<Body<T>>,
    /// The quantity that is read.
    pub signal: Signal,
    gauge: [T; 2],
    hub: T,
    drive: Drive,
    shear: bool,
    parts: Arc<[Vec<Part<T>>; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Part<T> {
    end: T,
    place: Vector<T>,
    square: Vector<T>,
    /// w/EI, w R/EI and w/kGA, w the weight of the place.
    shares: [T; 3],
}

/// A value and its derivative by a.
type Sloped<T = f64> = [T; 2];

fn times<T: Real>([p, dp]: Sloped<T>, [q, dq]: Sloped<T>) -> Sloped<T> {
    [p * q, dp * q + p * dq]
}

fn over<T: Real>([p, dp]: Sloped<T>, [q, dq]: Sloped<T>) -> Sloped<T> {
    [p / q, (dp - p * dq / q) / q]
}

/// The contact of the resting whisker: h, n, d1 and κ₀.
#[derive(Clone, Copy)]
struct Contact<T> {
    h: Vector<T>,
    n: Vector<T>,
    along: Vector<T>,
    bend: T,
}

impl<T: Real> Contact<T> {
    fn moment(&self, place: Vector<T>) -> Sloped<T> {
        let arm = self.h - place;
        [arm.perp_dot(self.n), self.bend * arm.perp_dot(self.along) + 1.0]
    }
}

impl<T: Real> Part<T> {
    fn new(body: &Body<T>, Place { s, within, end }: Place<T>, weight: T) -> Self {
        let section = body.section(s, within);
        let one = T::of(1.0);
        let shares = [one / section.bending, section.radius / section.bending, one / section.shear];
        let square = match body.is_straight() {
            true => Vector::of(0.0, 1.0),
            false => Vector::from_angle(body.rest_angle(s)).perp(),
        };
        Self { end, place: body.rest(s), square, shares: shares.map(|share| weight * share) }
    }
}

struct Unit<T> {
    lever: Sloped<T>,
    work: Sloped<T>,
    moment: Sloped<T>,
    across: Sloped<T>,
}

impl<T: Real> Flexure<T> {
    /// Lengths in mm.
    pub fn new(
        body: Arc<Body<T>>,
        signal: Signal,
        gauge: [T; 2],
        (hub, drive): (T, Drive),
        shear: bool,
    ) -> Self {
        let over = |from: T, to: T| {
            let mut parts = Vec::new();
            body.quadrature(from, to, |place, weight| parts.push(Part::new(&body, place, weight)));
            parts
        };
        let strained = if signal == Signal::Strain { over(gauge[0], gauge[1]) } else { Vec::new() };
        let parts = Arc::new([over(T::of(0.0), body.reach()), strained]);
        Self { body, signal, gauge, hub, drive, shear, parts }
    }

    fn contact(&self, a: T) -> Contact<T> {
        let along = Vector::from_angle(self.body.rest_angle(a));
        Contact { h: self.body.rest(a), n: along.perp(), along, bend: self.body.curvature(a) }
    }

    fn each(&self, parts: &[Part<T>], from: T, a: T, mut add: impl FnMut(&Part<T>)) {
        let whole = parts.partition_point(|part| part.end.value() <= a.value());
        parts[..whole].iter().for_each(&mut add);
        let near = whole.checked_sub(1).map_or(from, |last| parts[last].end);
        if near.value() < a.value() && whole < parts.len() {
            self.body.panel(near, a, |place, weight| add(&Part::new(&self.body, place, weight)));
        }
    }

    fn unit(&self, a: T) -> Unit<T> {
        let contact = self.contact(a);
        let Contact { h, n, along, bend } = contact;
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let lever = match self.drive {
            Drive::Angle => {
                let arm = h + Vector::new(self.hub, zero);
                [arm.perp_dot(n), bend * arm.perp_dot(along) + 1.0]
            }
            Drive::Displacement => [n.y, bend * along.y],
        };
        let moment = contact.moment(Vector::of(0.0, 0.0));
        let (across, length) = ([n.y, bend * along.y], [n.x, bend * along.x]);
        let mut work = [zero; 2];
        let mut add = |share: T, of: Sloped<T>| {
            work[0] = work[0] + share * of[0] * of[0];
            work[1] = work[1] + share * 2.0 * of[0] * of[1];
        };
        let root = self.body.built.root;
        add(one / root.k_theta, moment);
        add(one / root.k_y, across);
        add(one / root.k_x, length);
        self.each(&self.parts[0], zero, a, |part| {
            add(part.shares[0], contact.moment(part.place));
            if self.shear {
                add(part.shares[2], [n.dot(part.square), bend * along.dot(part.square)]);
            }
        });
        if self.shear {
            work[1] = work[1] + one / self.body.section(a, a.value() * (1.0 - 1e-12)).shear;
        }
        Unit { lever, work, moment, across }
    }

    /// f, positive, and df/da, per rad (or mm) and mm: strain, N·mm or N.
    pub fn value(&self, a: T) -> Sloped<T> {
        let reads = match self.signal {
            Signal::Strain => {
                let [x1, x2] = self.gauge;
                let mut mean = [T::of(0.0); 2];
                if a.value() <= x1.value() {
                    return mean;
                }
                let contact = self.contact(a);
                self.each(&self.parts[1], x1, Real::min(a, x2), |part| {
                    let (share, moment) = (part.shares[1] / (x2 - x1), contact.moment(part.place));
                    mean = [mean[0] + share * moment[0], mean[1] + share * moment[1]];
                });
                let unit = self.unit(a);
                return over(times(unit.lever, mean), unit.work);
            }
            Signal::Moment => |unit: &Unit<T>| unit.moment,
            Signal::Force => |unit: &Unit<T>| unit.across,
        };
        let unit = self.unit(a);
        over(times(unit.lever, reads(&unit)), unit.work)
    }

    /// Wrench on the root per unit of drive: M₀, N mm, F_x and F_y, N.
    pub fn wrench(&self, a: T) -> [T; 3] {
        let (unit, Contact { n, .. }) = (self.unit(a), self.contact(a));
        let force = -unit.lever[0] / unit.work[0];
        [force * unit.moment[0], force * n.x, force * n.y]
    }

    /// Contact force per unit of drive, N/rad or N/mm.
    pub fn force(&self, a: T) -> T {
        let unit = self.unit(a);
        unit.lever[0] / unit.work[0]
    }
}
