//! Strain along a whisker, contact and force, as functions of numbers scaled by the contact distance.

use crate::chart::axis::{AXES, Axis, Quantity};
use crate::chart::build::{Bound, Built, build};
use crate::chart::distance::{lobatto, power};
use crate::chart::{function::variables, ranges::holds};
use crate::error::SolveError;
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::physics::{driven::Driven, inverse::bracketed, solid::is_solid, taper::Taper};
use crate::scene::{Contact, Drive, Grip, Material, Setup, Side, Signal, Theory, Tuple};

use super::Domain;
use super::taps::{Taps, sides, skin};

pub const FUNCTIONS: usize = 5;
/// (1 − x/a) (ε(x)/(θ f(x)) − 1) on the contact side minus [`skin`]; f is the linear limit of the model at a point.
pub const CONTACT: usize = 0;
/// The same on the far side.
pub const FAR: usize = 1;
/// c/a − 1.
pub const ARC: usize = 2;
/// P relative to linear theory, minus 1.
pub const FORCE: usize = 3;
/// Moment or force at the root relative to the linear limit, minus 1; 0 for a strain sensor.
pub const SIGNAL: usize = 4;

/// Axis of r₀/a, or of ρ/a for a pole with a radius.
pub const OFFSET: usize = Quantity::Length as usize;
/// Axis of τa.
pub const TAPER: usize = Quantity::Taper as usize;
/// Axis of x/a.
pub const PLACE: usize = Quantity::Place as usize;

/// Allowed errors of δ/driveᵉ: relative, and absolute where K → 1.
const RELATIVE: f64 = 1e-5;
const SMALL: f64 = 0.02;

/// Most taps of a chart, and of a solid, whose strain changes fast next to the clamp. Each tap is a term, which makes the page larger.
const MOST: [usize; 2] = [9000, 14_000];

/// Axes whose range is cut, in turn, for a chart with too many taps: strains next to the contact, which no gauge reads, then strong tapers.
const CUTS: [usize; 5] = [PLACE, TAPER, TAPER, TAPER, TAPER];

/// Share of the strain's error allowed at the check points of a chart, and of a solid. A solid's worst points are corners of the box without a
/// whisker (largest D/a with smallest ρ/a); at whiskers the census finds 0.2 to 0.9 of the allowed error.
const SHARE: [f64; 2] = [0.2, 2.0];

/// Share of the strain's error allowed for the arc with friction, since the arc selects the T/P that holds the contact.
const HELD: f64 = 0.01;

/// Gauss–Legendre points and weights on [−1, 1], for the mean over a gauge.
pub const GAUSS: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];

#[derive(Debug, Clone)]
pub struct Along {
    /// Exponent e: functions are divided by driveᵉ.
    pub power: i32,
    /// True if the far side mirrors the contact side.
    pub mirrored: bool,
    /// Box, series and check errors: one branch for the model, or one for each of [`Self::ratios`] of a sliding contact, over the same box.
    pub branches: Vec<Built<FUNCTIONS>>,
    /// T/P from −μ to μ of Coulomb friction, ascending; else empty.
    pub ratios: Vec<f64>,
}

/// True if the far side mirrors the contact side: without extension, Hooke's law is symmetric in tension and compression.
fn mirrored(setup: &Setup) -> bool {
    !setup.model.extension && matches!(setup.model.material, Material::Hooke(_))
}

impl Along {
    /// The chart of `setup` over `domain` with strain error `strain`; with friction, for `n` ratios T/P. `None` if it is not smooth enough.
    pub fn new(setup: &Setup, domain: &Domain, strain: f64, n: usize) -> Result<Option<Self>, SolveError> {
        // The leading power of the drive in the deviation from the model's linear limit.
        let mut own = setup.clone();
        own.estimate.theory = if setup.model.shear { Theory::Timoshenko } else { Theory::EulerBernoulli };
        let power = power(&own, false);
        let maps = variables(setup, power);
        let ranges = domain.scaled(setup.drive);
        let axis = |k: usize| Axis { range: ranges[k], map: maps[k], whole: false };
        let mut axes: [Axis; AXES] = std::array::from_fn(axis);
        let ratios: Vec<f64> = match setup.model.contact {
            Contact::Coulomb(mu) if mu > 0.0 => lobatto(n).iter().map(|x| x * mu).collect(),
            _ => Vec::new(),
        };
        let mut branches: Vec<Built<FUNCTIONS>> = Vec::new();
        while branches.len() < ratios.len().max(1) {
            let friction = ratios.get(branches.len()).copied();
            let Some(built) = branch(setup, axes, power, strain, friction)? else { return Ok(None) };
            if built.axes != axes {
                axes = built.axes;
                if !branches.is_empty() {
                    branches.clear();
                    continue;
                }
            }
            branches.push(built);
        }
        Ok(Some(Self { power, mirrored: mirrored(setup), branches, ratios }))
    }

    pub fn axes(&self) -> &[Axis; AXES] {
        &self.branches[0].axes
    }

    pub fn read(&self, signal: Signal) -> impl Iterator<Item = usize> {
        let mirrored = self.mirrored;
        (0..FUNCTIONS).filter(move |f| match *f {
            FAR => !mirrored,
            SIGNAL => signal != Signal::Strain,
            _ => true,
        })
    }

    pub fn coefficients(&self, signal: Signal) -> usize {
        self.branches.iter().map(|b| self.read(signal).map(|f| b.series[f].terms()).sum::<usize>()).sum()
    }

    /// δ = s/(θ f) − 1 of the signal s of `t`, f the linear limit of the model; `None` outside the chart.
    pub fn signal(&self, setup: &Setup, hub: f64, t: &Tuple) -> Option<f64> {
        let taper = Taper::new(t.D, t.d, t.L_a);
        let [x1, x2] = taper.gauge(t.x_ss, t.l);
        let side = if setup.gauge.side == Side::Contact { CONTACT } else { FAR };
        let driven = Driven::of_users(setup.drive, t.drive);
        let own = driven.size() / if driven.kind() == Drive::Angle { 1.0 } else { t.a };
        let offset = if setup.model.pole_radius > 0.0 { setup.model.pole_radius } else { hub };
        let at = |x: f64| {
            let q = [own, offset / t.a, t.D / t.a, taper.tau * t.a, x / t.a];
            let inside = self.axes().iter().zip(q).all(|(axis, q)| holds(axis.range, q));
            let place = || std::array::from_fn::<f64, AXES, _>(|k| self.axes()[k].place(q[k]));
            inside.then(|| (place(), skin(setup, &q)))
        };
        let (middle, _) = at(0.5 * (x1 + x2))?;
        let arcs: Vec<f64> = self.branches.iter().map(|b| b.series[ARC].at(middle)).collect();
        let shares = shares(&arcs);
        let read = |of: usize, place: [f64; AXES]| -> f64 {
            let held: f64 = self.branches.iter().zip(&shares).map(|(b, s)| s * b.series[of].at(place)).sum();
            held * own.powi(self.power)
        };
        if setup.signal != Signal::Strain {
            return Some(read(SIGNAL, middle));
        }
        let (mut sum, mut linear) = (0.0, 0.0);
        for [x, weight] in GAUSS {
            let x = 0.5 * (x1 + x2) + 0.5 * (x2 - x1) * x;
            let (place, skin) = at(x)?;
            let weight = weight / (1.0 - taper.tau * x).powi(3);
            sum += weight * (read(side, place) + skin * (1.0 + read(FORCE, place)));
            linear += weight * (1.0 - x / t.a);
        }
        Some(sum / linear)
    }
}

/// Weights of the branches by their c/a − 1: the last if even T/P = μ lets the contact slide outwards, the first if even −μ lets it slide inwards,
/// else polynomial interpolation at the T/P that holds it.
fn shares(arcs: &[f64]) -> Vec<f64> {
    let nodes = lobatto(arcs.len().max(2));
    let at = |x: f64| -> Vec<f64> {
        let factor = |i: usize, j: usize| (x - nodes[j]) / (nodes[i] - nodes[j]);
        let share = |i| (0..nodes.len()).filter(|j| *j != i).map(|j| factor(i, j)).product();
        (0..nodes.len()).map(share).collect()
    };
    let arc = |x: f64| arcs.iter().zip(at(x)).map(|(arc, share)| arc * share).sum::<f64>();
    match arcs {
        [_] => vec![1.0],
        [.., last] if *last >= 0.0 => at(1.0),
        [first, ..] if *first <= 0.0 => at(-1.0),
        _ => at(bracketed(arc, -1.0, 1.0)),
    }
}

/// Box and series for contacts that slide with T/P = `friction`, or as in the model.
fn branch(
    setup: &Setup,
    axes: [Axis; AXES],
    power: i32,
    strain: f64,
    friction: Option<f64>,
) -> Result<Option<Built<FUNCTIONS>>, SolveError> {
    let solid = usize::from(is_solid(&setup.model));
    let error = SHARE[solid] * strain / axes[0].range[1].powi(power);
    let of_strain = match power {
        0 => Bound::of(error),
        _ => Bound { error, relative: RELATIVE, small: SMALL },
    };
    let mut bounds = [of_strain; FUNCTIONS];
    bounds[ARC] = Bound::of(if friction.is_some() { HELD * strain } else { error });
    bounds[FORCE] = Bound::of(10.0 * error);
    if setup.signal == Signal::Strain {
        bounds[SIGNAL] = Bound::of(f64::INFINITY);
    }
    let on_sides = &sides(setup)[..if mirrored(setup) { 1 } else { 2 }];
    let solved = if power == 0 && friction.is_none() { 1e-9 } else { 1e-10 };
    let grip = Grip::Slide(friction.unwrap_or(0.0));
    let mut taps = Taps::new(setup, on_sides, grip, power, solved);
    build(axes, &bounds, (MOST[solid], &CUTS), &mut |q| taps.solve(q))
}

/// The signal of `t` in the linear limit of the model, per unit of drive.
pub fn linear(setup: &Setup, hub: f64, t: &Tuple) -> f64 {
    let taper = Taper::new(t.D, t.d, t.L_a);
    let shear = if setup.model.shear { shear_length2(&taper, setup.model.nu) } else { 0.0 };
    let curve = StrainCurve::new(taper, taper.gauge(t.x_ss, t.l), hub, setup.drive, shear);
    let wrench = curve.wrench(setup.model.material.e0(), t.a);
    setup.signal.of(wrench).map_or_else(|| curve.value(t.a), f64::abs)
}
