//! Designs in lanes: their rows of statistics from the charts of their distances, in f32.
//!
//! A chart gives δ = ε/(θ f) − 1 = 1/K − 1 of a tap as θᵉ times a series over its drive (θ, or δ in mm). At a few points over the shared drives this
//! becomes (K − 1)/θᵉ, again a series Σ_k κ_k T_k: the mean of K over the distances is the series of the mean coefficients, and `SD² = θ²ᵉ Σ_kl
//! Cov(κ_k, κ_l) T_k T_l`. A row costs a few flops for any number of distances. Covariances are centred before they are summed (Welford).
//!
//! The estimate f(â) = K̄ε/θ in â = a/(1 + η), q = K̄/K − 1 reads f(η)/f(0) − 1 = q, a product of growth factors composed as `a + b + ab`: the error
//! â − a keeps its relative precision. Without hub, shear and displacement it is a quadratic.
//!
//! Designs that each have a drive, ranked by the spread of K, get a first look by the largest terms of the charts, and a full one unless no word
//! depends on the error and the spread is above the bound by more. Neighbouring drives (`groups`) and distances (`neighbours`) are decided together.
//!
//! With a foil or at a tilted pole all of this concerns the strain of the chart: K in place of K/T, where T is the share that is read, with limit, noise
//! and a given K scaled alike (`passed`).

// Index loops vectorise over lanes.
#![allow(clippy::needless_range_loop)]

mod best;
mod between;
mod choice;
mod dispatch;
mod distance;
mod edges;
mod estimate;
mod figures;
mod flexed;
mod groups;
mod neighbours;
mod outcome;
mod passed;
mod rank;
mod read;
mod rows;
mod sheet;
mod tally;
mod tap;
mod theory;
mod words;

use between::Between;
use choice::Choice;
use dispatch::Wide;
use distance::{Charted, Distance};
use flexed::Sums;
use groups::Group;
use read::{Basis, Values};
use tap::Taps;

use super::axis::{Map, ORDERS};
use super::distance::DistanceChart;
use super::function::variables;
use super::scope::Scope;
use crate::kernel::cpu::{Pack, Packed, Vectors, WIDEST};
use crate::physics::chebyshev::{basis, matrix, placed, points, scaled};
use crate::physics::linear::shear_length2;
use crate::physics::taper::Taper;
use crate::scene::{Convention, Drive, RankBy, Theory};

pub use crate::kernel::ranking::{Found, Words};
pub use figures::Figures;
pub(crate) use flexed::Flexed;
pub use outcome::Readings;

/// Designs of a pack.
pub const LANES: usize = WIDEST;

/// Relative error of strain and arc allowed in a rough look.
const ROUGH: f64 = 5e-4;

const PAIRS: usize = ORDERS * (ORDERS + 1) / 2;

type Lanes = Pack<f32, LANES, Wide>;

/// Charts of some distances of one rig, which rank its designs or give their rows, with constants in single precision.
#[derive(Debug)]
pub struct Ranker {
    pub(crate) scope: Scope,
    has: Vectors,
    distances: Vec<Distance>,
    /// One per distance, or those that `between` reads.
    charts: Vec<Charted>,
    /// The same with their largest terms only, where rows by the spread of K are ranked at each design's drive.
    rough: Vec<Charted>,
    between: Option<Between>,
    angles: Vec<Angle>,
    /// Groups of the angles: first all, then some at a time.
    groups: Vec<Group>,
    /// Points over the shared drives; 1 where each design has its drive.
    points: usize,
    from_points: Vec<[f32; ORDERS]>,
    grid: Vec<Stroke>,
    /// Scale and shift from θ, or θ² where e = 2, to [−1, 1] over the drives.
    affine: [f32; 2],
    power: i32,
    /// True if series over the drive are over its fourth root.
    fourth: bool,
    /// Drives are shared, but every tap is read separately at each.
    apart: bool,
    choice: Choice,
    theory: EstimateTheory,
    /// 3πE/64, MPa: P per D⁴(1 − τa)(a + r₀)/a³ and radian of the linear theory.
    stiffness: f32,
    /// 1/a of the widened range of interest, its near end first, 1/mm.
    ends: [f32; 2],
    /// S/D² of the model.
    shear: f32,
    strain_limit: f32,
    noise: f32,
    fixed: Option<f32>,
    /// The statistic of the distance errors that ranks; `None` is the spread of K.
    by: Option<RankBy>,
}

#[derive(Debug, Clone, Copy)]
struct EstimateTheory {
    /// r₀, mm.
    hub: f32,
    displaced: bool,
    shear: f32,
    plain: bool,
}

#[derive(Debug)]
struct Stroke {
    /// rad or mm.
    drive: f32,
    power: f32,
    basis: [f32; ORDERS],
}

#[derive(Debug)]
struct Angle {
    /// Degrees or mm.
    asked: f64,
    stroke: Stroke,
    /// T_k T_l for k ≤ l, twice off the diagonal.
    products: [f32; PAIRS],
    place: u32,
}

/// Scale and shift of the variable between `ends` to [−1, 1].
fn affine(ends: [f64; 2]) -> [f32; 2] {
    let shift = scaled(ends, 0.0);
    [(scaled(ends, 1.0) - shift) as f32, shift as f32]
}

fn narrow<const N: usize>(v: &[f64]) -> [f32; N] {
    std::array::from_fn(|k| v.get(k).map_or(0.0, |&x| x as f32))
}

impl Ranker {
    /// `None` where the drives of `scope` need more orders than lanes have, and on a CPU without lanes.
    pub(crate) fn over(scope: Scope) -> Option<Self> {
        let has = Vectors::found()?;
        let setup = &scope.setup;
        let by = Some(scope.output.by).filter(|by| *by != RankBy::KSd);
        let power = scope.charts.first()?.power;
        // Taps that may stick have no series over the drive.
        let chooses = scope.charts.iter().any(|c| !c.ratios.is_empty());
        let own = scope.drives.is_empty() || chooses;
        let orders = scope.charts.iter().flat_map(|c| &c.branches).map(|b| b.series[0].sizes()[0]).max()?;
        let n = if own { 1 } else { (orders + 1).min(ORDERS) };
        if orders > ORDERS {
            return None;
        }
        let ends = [scope.drives.first(), scope.drives.last()].map(|d| d.map_or(f64::NAN, |d| d.0));
        let [map, ..] = variables(setup, power);
        let common = ends.map(|d| map.of(d));
        let drives: Vec<f64> = points(n).into_iter().map(|x| map.back(placed(common, x))).collect();
        let shared = if own { Vec::new() } else { drives.clone() };
        let charted = |chart: &DistanceChart| Charted::new(chart, setup.drive, &shared);
        let roughly = scope.drives.is_empty() && scope.between.is_none() && by.is_none();
        let charts: Vec<Charted> = scope.charts.iter().map(charted).collect();
        let rough = |(chart, exact)| Charted::roughly(chart, exact, setup.drive, ROUGH);
        let stroke = |drive: f64, t: &[f64]| Stroke {
            drive: drive as f32,
            power: drive.powi(power) as f32,
            basis: narrow(t),
        };
        let angle = |&(drive, asked, place): &(f64, f64, u32)| {
            let t = basis(n, scaled(common, map.of(drive)));
            let mut products = [0.0; PAIRS];
            let mut at = 0;
            for k in 0..n {
                for l in k..n {
                    products[at] = (t[k] * t[l] * if k == l { 1.0 } else { 2.0 }) as f32;
                    at += 1;
                }
            }
            Angle { asked, stroke: stroke(drive, &t), products, place }
        };
        let distance = |a: &f64| Distance { a: *a as f32, inverse: (1.0 / a) as f32 };
        let angles: Vec<Angle> = scope.drives.iter().map(angle).collect();
        let unit = Taper { D: 1.0, tau: 0.0, tan_alpha: 0.0 };
        let with_shear = setup.estimate.theory == Theory::Timoshenko;
        let shear = if with_shear { shear_length2(&unit, setup.model.nu) as f32 } else { 0.0 };
        let displaced = setup.drive == Drive::Displacement;
        let hub = if displaced { 0.0 } else { setup.hub as f32 };
        Some(Self {
            distances: scope.distances.iter().map(distance).collect(),
            rough: if roughly { scope.charts.iter().zip(&charts).map(rough).collect() } else { Vec::new() },
            charts,
            between: scope.between.as_ref().map(|between| Between::new(between, &scope.distances)),
            groups: Group::of(if own { &[] } else { &angles }),
            angles,
            points: n,
            from_points: matrix(n).iter().map(|row| narrow(row)).collect(),
            grid: drives.iter().zip(points(n)).map(|(d, x)| stroke(*d, &basis(n, x))).collect(),
            affine: affine(common),
            power,
            fourth: map == Map::Fourth,
            apart: chooses && !scope.drives.is_empty(),
            choice: Choice::new(),
            theory: EstimateTheory { hub, displaced, shear, plain: !displaced && hub == 0.0 && shear == 0.0 },
            stiffness: (3.0 * std::f64::consts::PI * setup.model.material.e0() / 64.0) as f32,
            ends: scope.ends.map(|a| (1.0 / a) as f32),
            shear: if setup.model.shear { shear_length2(&unit, setup.model.nu) as f32 } else { 0.0 },
            strain_limit: setup.gauge.strain_limit as f32,
            noise: setup.gauge.noise_strain.unwrap_or(0.0) as f32,
            fixed: setup.estimate.k.map(|k| (k - 1.0) as f32),
            by,
            has,
            scope,
        })
    }

    /// True if K is an elongation per unit of drive, mm.
    fn elongation(&self) -> bool {
        self.scope.setup.estimate.convention == Convention::Elongation
    }

    /// Coefficients of a series over the drive.
    #[inline(always)]
    fn orders<const OWN: bool>(&self) -> usize {
        if OWN { 1 } else { self.points }
    }

    /// Drives of a design.
    #[inline(always)]
    fn drives<const OWN: bool>(&self) -> usize {
        if OWN { 1 } else { self.angles.len() }
    }

    #[inline(always)]
    fn over_drives(&self, drive: Lanes) -> (Lanes, Lanes) {
        let [scale, shift] = self.affine.map(Lanes::splat);
        let power = powered(drive, self.power);
        let variable = match self.power {
            _ if self.fourth => drive.sqrt().sqrt(),
            2 => power,
            _ => drive,
        };
        (variable.mul_add(scale, shift), power)
    }
}

/// driveᵉ, e = `power`.
#[inline(always)]
fn powered(drive: Lanes, power: i32) -> Lanes {
    match power {
        0 => Lanes::of(1.0),
        1 => drive,
        _ => drive * drive,
    }
}

struct Scratch {
    pub basis: Box<Basis>,
    pub products: Values,
    pub taps: Taps,
    pub charts: Taps,
    /// First drives above the strain limit and slipped off, of each tap.
    pub edges: Vec<[Lanes; 2]>,
    /// 1 at each drive at which a tap has no distance, where distances are estimated.
    pub rootless: Vec<Lanes>,
    pub flexed: Box<Sums>,
}

impl Scratch {
    #[inline(always)]
    pub fn new(ranker: &Ranker) -> Self {
        let charts = if ranker.between.is_some() { ranker.charts.len() } else { 0 };
        Self {
            basis: Box::new([[Lanes::default(); _]; _]),
            products: Values::new(ranker.charts.iter().chain(&ranker.rough).map(|chart| &chart.products)),
            taps: Taps::new(ranker.distances.len(), ranker.points),
            charts: Taps::new(charts, ranker.points),
            edges: Vec::with_capacity(ranker.distances.len()),
            rootless: Vec::new(),
            flexed: Box::new([[Lanes::default(); _]; _]),
        }
    }
}
