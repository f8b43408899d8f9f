//! Which sweeps the chart of the rod can rank, and the tables that all their designs share.

use super::rod::{Range, RodChart};
use crate::Effects;
use crate::nodes::gauss;
use vibrissa_core::design::{amount, is_whisker};
use vibrissa_core::estimate::WIDENING;
use vibrissa_core::scene::{
    Column, Contact, Convention, Drive, Geometry, Layout, Per, RankBy, Study, Theory, Tuple,
};

/// Taps below which a chart does not pay.
const LEAST_TAPS: u64 = 1 << 17;

/// Most distances, and most drives, of a design.
const MOST_AXIS: u64 = 4096;

/// Largest x2/a of a charted tap: nearer contacts are solved.
const NEAREST: f64 = 0.9;

/// Error of the mean over the gauge that its points may leave, relative to the tolerance of a chart.
const WIDE_GAUGE: [f64; 2] = [0.16, 0.45];

/// A drive that all designs share.
#[derive(Debug, Clone, PartialEq)]
pub struct Angle {
    /// θ, rad.
    pub angle: f64,
    /// Values at θ² of the polynomials over t of the chart.
    pub basis: Vec<f64>,
    /// Place in the layout.
    pub place: u32,
}

/// A contact distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Distance {
    /// a, mm.
    pub a: f64,
    /// a/a_lo − 1 and a/a_hi − 1, of the widened range of interest.
    pub ends: [f64; 2],
}

/// What ranks the rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// Column.
    pub by: RankBy,
    /// Rows or designs compete.
    pub per: Per,
    /// Candidates to bring back: more than asked, because they are solved again before they are ranked.
    pub keep: usize,
}

/// Everything that the designs of a sweep share.
#[derive(Debug, Clone, PartialEq)]
pub struct Scope {
    /// The rod.
    pub chart: RodChart,
    /// Distances of every design.
    pub distances: Vec<Distance>,
    /// Drives of every design, ascending; empty where each design has its own.
    pub angles: Vec<Angle>,
    /// Points and weights of the mean over the gauge, on [0, 1].
    pub gauge: Vec<(f64, f64)>,
    /// Strain limit of the gauge.
    pub strain_limit: f64,
    /// Noise of the gauge in strain.
    pub noise: f64,
    /// K − 1 of a K given in the spec, without unit.
    pub fixed: Option<f64>,
    /// K is multiplied by x2 − x1 in the tables.
    pub elongation: bool,
    /// What is ranked.
    pub rank: Rank,
    /// Smallest and largest distance, mm.
    reach: [f64; 2],
}

/// How a design is dealt with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// Charted.
    Easy,
    /// Tap by tap.
    Hard,
    /// No whisker with a gauge: every tap is `invalid_geometry`.
    Void,
}

impl Scope {
    /// Whether `study` is such that a chart may rank it.
    pub fn fits(study: &Study, layout: &Layout) -> bool {
        let model = &study.setup.model;
        let frictionless = matches!(model.contact, Contact::Frictionless | Contact::Coulomb(0.0));
        let plain = model.geometry == Geometry::Exact
            && frictionless
            && Effects::new(model, study.setup.gauge.side, false).plain()
            && study.setup.hub == 0.0
            && study.setup.drive == Drive::Angle
            && study.setup.estimate.theory == Theory::EulerBernoulli;
        let ranked = !matches!(study.output.by, RankBy::StrainMax | RankBy::ForceMax);
        let sizes = (2..=MOST_AXIS).contains(&layout.n_distances) && layout.n_drives <= MOST_AXIS;
        let few = study.output.top.is_some_and(|top| top <= 1 << 16);
        // With elongation a given K has the unit of each design's gauge.
        let unit =
            study.setup.estimate.convention == Convention::Elongation && study.setup.estimate.k.is_some();
        let planar = layout.is_upright() && !study.setup.gauge.second;
        plain && planar && ranked && sizes && layout.len() >= LEAST_TAPS && few && !unit
    }

    /// The scope of `study` at `tolerance`; `None` where its taps must be solved one by one.
    pub fn new(study: &Study, layout: &Layout, tolerance: f64) -> Option<Self> {
        if !Self::fits(study, layout) {
            return None;
        }
        let (top, by) = (study.output.top?, study.output.by);
        let [near, far] = layout.reach();
        let [lo, hi] = study.setup.estimate.range.unwrap_or([near, far]);
        let gauge_end = NEAREST * near.min(lo);
        let range = range(layout, gauge_end)?;
        let chart = RodChart::new(range, tolerance)?;
        let distance = |i: u64| {
            let a = layout.distance(i);
            Distance { a, ends: [a / (lo * (1.0 - WIDENING)) - 1.0, a / (hi * (1.0 + WIDENING)) - 1.0] }
        };
        let mut angles: Vec<Angle> = match layout.drives() {
            Some(axis) => (0..)
                .zip(axis.iter())
                .map(|(place, degrees)| {
                    let angle = amount(Drive::Angle, degrees);
                    Angle { angle, basis: chart.basis(angle * angle), place }
                })
                .collect(),
            None => Vec::new(),
        };
        angles.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        let widest = layout.bounds(Column::GridLength)[1] / near;
        let points = 2 + WIDE_GAUGE.iter().filter(|w| widest > **w).count();
        let (places, weights) = gauss(points);
        let elongation = study.setup.estimate.convention == Convention::Elongation;
        Some(Self {
            distances: (0..layout.n_distances).map(distance).collect(),
            angles,
            gauge: places.into_iter().zip(weights).collect(),
            strain_limit: study.setup.gauge.strain_limit,
            noise: study.setup.gauge.noise_strain.unwrap_or(0.0),
            fixed: study.setup.estimate.k.map(|k| k - 1.0),
            elongation,
            rank: Rank { by, per: study.output.per, keep: 2 * top + 64 },
            reach: [near, far],
            chart,
        })
    }

    /// How the design `t` is dealt with.
    pub fn case(&self, t: &Tuple) -> Case {
        let Tuple { D, d, L_a, x_ss, l, .. } = *t;
        if !is_whisker(t) {
            return Case::Void;
        }
        let [near, far] = self.reach;
        let tau = (D - d) / (D * L_a);
        let [lo, hi] = self.chart.range.taper;
        let [first, last] = self.chart.range.place;
        let charted = far <= L_a
            && (tau * far).max(tau * near) <= hi + 1e-9
            && (tau * far).min(tau * near) >= lo - 1e-9
            && x_ss / far >= first - 1e-9
            && (x_ss + l) / near <= last + 1e-9;
        if charted { Case::Easy } else { Case::Hard }
    }

    /// Smallest and largest distance, mm.
    pub fn reach(&self) -> [f64; 2] {
        self.reach
    }

    /// Whether estimates are ranked.
    pub fn estimates(&self) -> bool {
        self.rank.by != RankBy::KSd
    }
}

/// What p, s and θ can be, of designs that are not solved one by one anyway; `None` where there are none.
fn range(layout: &Layout, gauge_end: f64) -> Option<Range> {
    let [near, far] = layout.reach();
    let [base, tip, length] =
        [Column::BaseDiameter, Column::TipDiameter, Column::Length].map(|c| layout.bounds(c));
    let [place, grid] = [Column::GaugePosition, Column::GridLength].map(|c| layout.bounds(c));
    let longest = length[0].max(far);
    // τa is monotonic in each of D, d, L_a and a.
    let mut taper = [f64::INFINITY, f64::NEG_INFINITY];
    for big in base {
        for small in tip {
            for length in [longest, length[1].max(longest)] {
                for a in [near, far] {
                    let p = (1.0 - small / big) * a / length;
                    taper = [taper[0].min(p), taper[1].max(p)];
                }
            }
        }
    }
    taper[0] = taper[0].max(-1.0);
    taper[1] = taper[1].min(0.99);
    let place = [place[0] / far, ((place[1] + grid[1]).min(gauge_end)) / near];
    let widest = layout.bounds(Column::Drive)[1];
    let angle = amount(Drive::Angle, widest);
    (taper[0] <= taper[1] && place[0] < place[1]).then_some(Range { taper, place, angle })
}
