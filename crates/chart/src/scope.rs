//! Sweeps that charts can rank, and the data their designs share.

use super::axis::{AXES, Quantity};
use super::between::{self, Between};
use super::distance::DistanceChart;
use super::gauge::asked;
use super::lanes::Flexed;
use super::maker::{Maker, Many};
use super::ranges::{NEAREST, Wanted, shaped, slackened};
use crate::design::is_whisker;
use crate::error::SolveError;
use crate::estimate::WIDENING;
use crate::kernel::ranking::Case;
use crate::physics::{driven::Driven, taper::Taper};
use crate::reduce::range;
use crate::scene::{
    Convention, Direction, Drive, Geometry, Layout, Output, RankBy, Setup, Study, Theory, Tuple,
};

/// Taps below which charts do not pay.
const LEAST_TAPS: u64 = 1 << 17;

/// Most distances with a chart each; the second number where a distance has at least `MANY_PAY` taps.
const MOST_DISTANCES: [u64; 2] = [64, 1024];

/// Taps at each distance from which more than 64 charts pay.
const MANY_PAY: u64 = 1 << 14;

const MOST_DRIVES: u64 = 4096;

/// Charts in `run.json`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Charts: one for each distance, or a few between which all distances are read.
    pub charts: usize,
    /// Range of τa.
    pub taper: [f64; 2],
    /// Range of points of gauges over a.
    pub place: [f64; 2],
    /// Range of D/a.
    pub base: [f64; 2],
    /// Largest θ, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta_deg: Option<f64>,
    /// Coefficients of all series.
    pub coefficients: usize,
    /// Largest relative error of the strain at the points that checked the charts.
    pub strain_error: f64,
    /// Taps solved to make and to check them.
    pub solved: u64,
}

impl Summary {
    /// Summary of `charts`.
    pub fn of(charts: &[DistanceChart], kind: Drive) -> Self {
        let widest =
            |quantity: Quantity| range(charts.iter().flat_map(|c| c.axes()[quantity as usize].range));
        let series = charts.iter().flat_map(|c| &c.branches).flat_map(|b| &b.series);
        Self {
            charts: charts.len(),
            taper: widest(Quantity::Taper),
            place: widest(Quantity::Place),
            base: widest(Quantity::Base),
            theta_deg: (kind == Drive::Angle).then(|| widest(Quantity::Drive)[1].to_degrees()),
            coefficients: series.map(|s| s.terms()).sum(),
            strain_error: charts.iter().map(|c| c.error).fold(0.0, f64::max),
            solved: charts.iter().map(|c| c.sweeps.taps).sum(),
        }
    }
}

/// True if rows of `setup` can be read from charts: one gauge, distances by a theory, and a given K, if any, the same for all designs.
fn charted(setup: &Setup) -> bool {
    let unit = setup.estimate.convention == Convention::Elongation && setup.estimate.k.is_some();
    let exact = setup.model.geometry == Geometry::Exact;
    exact && setup.estimate.theory != Theory::Exact && !unit && !setup.gauge.second
}

/// The data that all designs of a sweep share.
#[derive(Debug, Clone)]
pub struct Scope {
    /// Rig and model.
    pub setup: Setup,
    /// Direction of all poles.
    pub direction: Direction,
    /// mm, in the layout's order.
    pub distances: Vec<f64>,
    /// One per distance, or those that `between` reads.
    pub charts: Vec<DistanceChart>,
    /// Reads all distances from a few charts, if present.
    pub between: Option<Between>,
    /// f of built whiskers; `None` for cones clamped at their base.
    pub(crate) flexed: Option<Flexed>,
    /// Ends of the widened range of interest, mm.
    pub ends: [f64; 2],
    /// Shared drives, rad or mm, ascending, each as requested (degrees or mm) and with its place in the layout; empty if each design has its drive.
    pub drives: Vec<(f64, f64, u32)>,
    /// The kept rows, and the statistic that ranks them.
    pub output: Output,
    /// Smallest and largest distance, mm.
    pub(crate) reach: [f64; 2],
    /// Largest x2 − x1, mm.
    pub(crate) width: f64,
    /// Common box of all charts: drive (rad or mm), a length, D, τ, x in mm and 1/mm.
    pub(crate) within: [[f64; 2]; AXES],
    /// `within` and `width` with the slack of [`holds`](super::ranges::holds).
    held: [[f64; 2]; AXES],
    widest: f64,
    shaped: bool,
}

impl Scope {
    /// True if charts may rank `study`.
    pub fn fits(study: &Study, layout: &Layout) -> bool {
        let by = study.output.by;
        let known = !matches!(by, RankBy::StrainMax | RankBy::ForceMax);
        let few = study.output.top.is_some_and(|top| top <= 1 << 16);
        let ranked = known && (study.setup.built.is_none() || by == RankBy::KSd);
        let sizes = (2..=between::MOST).contains(&layout.n_distances) && layout.n_drives <= MOST_DRIVES;
        // Built whiskers at tilted poles have no charts.
        let direction = layout.direction().filter(|of| of.is_upright() || study.setup.built.is_none());
        let alike = direction.is_some() && layout.n_directions == 1;
        charted(&study.setup) && alike && ranked && sizes && layout.len() >= LEAST_TAPS && few
    }

    /// The scope of `study` at `tolerance`; `None` if its taps must be solved one by one.
    pub fn new(study: &Study, layout: &Layout, tolerance: f64) -> Result<Option<Self>, SolveError> {
        if !Self::fits(study, layout) {
            return Ok(None);
        }
        let setup = &study.setup;
        let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
        let many = layout.len() / layout.n_distances >= MANY_PAY;
        let listed = layout.drives().into_iter().flat_map(|axis| axis.iter().zip(0..));
        let size = |drive: f64| Driven::of_users(setup.drive, drive).size();
        let mut drives: Vec<(f64, f64, u32)> =
            listed.map(|(drive, place)| (size(drive), drive, place)).collect();
        drives.sort_by(|a, b| a.0.total_cmp(&b.0));
        let shared: Vec<f64> = drives.iter().map(|d| d.0).collect();
        let bounds = (tolerance, MOST_DISTANCES[usize::from(many)]);
        let place = (distances.as_slice(), layout.direction().unwrap_or_default());
        let (made, _) = Self::over(setup, place, &shared, &Wanted::of(layout), bounds)?;
        let Some(mut scope) = made else { return Ok(None) };
        scope.drives = drives;
        scope.output = study.output;
        Ok(Some(scope))
    }

    /// For rows of whiskers as `wanted`, each at its own drive, with the number of taps solved; `None` if rows must be reduced from taps.
    pub fn tried(
        setup: &Setup,
        distances: &[f64],
        wanted: &Wanted,
        tolerance: f64,
    ) -> Result<(Option<Self>, u64), SolveError> {
        // Lanes cannot estimate distances of built whiskers.
        if !charted(setup)
            || setup.built.is_some()
            || !(2..=between::MOST).contains(&(distances.len() as u64))
        {
            return Ok((None, 0));
        }
        Self::over(setup, (distances, Direction::UPRIGHT), &[], wanted, (tolerance, MOST_DISTANCES[0]))
    }

    /// Charts for all of `distances` that hold all of `drives` (rad or mm), and the taps solved; at most `most` distances have a chart each.
    fn over(
        setup: &Setup,
        (distances, direction): (&[f64], Direction),
        drives: &[f64],
        wanted: &Wanted,
        (tolerance, most): (f64, u64),
    ) -> Result<(Option<Self>, u64), SolveError> {
        let [near, far] = range(distances.iter().copied());
        let [lo, hi] = setup.estimate.range.unwrap_or([near, far]);
        let gauge_end = NEAREST * near.min(lo);
        let Some((asked, width)) = wanted.ranges(setup, far, gauge_end) else { return Ok((None, 0)) };
        let ends = [lo * (1.0 - WIDENING), hi * (1.0 + WIDENING)];
        let flexed = Flexed::new(setup, wanted, distances, ends, gauge_end);
        if flexed.is_none() && setup.built.is_some() {
            return Ok((None, 0));
        }
        let mut maker = Maker { setup, direction, asked, width, drives, tolerance, taps: 0 };
        let many = match between::fits(setup, distances) {
            true => maker.between(distances)?,
            false => Many::Rough,
        };
        let made = match many {
            Many::Made(charts, between) => Some((charts, Some(between))),
            Many::Refused => None,
            Many::Rough if distances.len() as u64 > most => None,
            Many::Rough => maker.at(distances)?.map(|charts| (charts, None)),
        };
        let taps = maker.taps;
        let Some((charts, between)) = made else { return Ok((None, taps)) };
        let within = maker.within(&charts);
        let scope = Self {
            setup: setup.clone(),
            direction,
            distances: distances.to_vec(),
            ends,
            within,
            held: within.map(slackened),
            widest: slackened([0.0, width])[1],
            shaped: shaped(setup),
            charts,
            between,
            flexed,
            drives: Vec::new(),
            output: Output { by: RankBy::TotalRms, ..Output::default() },
            reach: [near, far],
            width,
        };
        Ok((Some(scope), taps))
    }

    /// Easy if charts serve the design `t`, hard if it must be solved, void if it is invalid.
    pub fn case(&self, t: &Tuple) -> Case {
        if !is_whisker(t) {
            return Case::Void;
        }
        let taper = Taper::new(t.D, t.d, t.L_a);
        // Shared drives lie within.
        let drive = if self.drives.is_empty() {
            Driven::of_users(self.setup.drive, t.drive).size()
        } else {
            self.within[Quantity::Drive as usize][0]
        };
        let length = if self.shaped { t.L_a } else { 0.0 };
        // A design may leave its direction to its strokes.
        let Direction { tilt, lean } = self.direction;
        let elsewhere = (t.tilt - tilt).abs() > 0.0 || (t.lean - lean).abs() > 0.0;
        let [rest @ .., places] = &self.held;
        let holds = |[x1, x2]: [f64; 2]| {
            x2 - x1 <= self.widest
                && asked(&self.setup, [x1, x2]).iter().all(|x| places[0] <= *x && *x <= places[1])
        };
        // A gauge ends no later than on a cylinder, which needs no root.
        let on_cylinder = self.setup.gauge.foil.is_none() && holds([t.x_ss, t.x_ss + t.l]);
        let inside = !elsewhere
            && rest.iter().zip([drive, length, t.D, taper.tau]).all(|([lo, hi], q)| *lo <= q && q <= *hi)
            && (on_cylinder || holds(taper.gauge(t.x_ss, t.l)));
        if inside && self.reach[1] <= t.L_a { Case::Easy } else { Case::Hard }
    }

    /// Summary of the charts for `run.json`.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::of(&self.charts, self.setup.drive);
        if let Some(between) = &self.between {
            summary.strain_error = summary.strain_error.max(between.error);
        }
        summary
    }
}
