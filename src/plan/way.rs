//! How the taps of a sweep are found.

use super::CHUNK;
use crate::backend::Choice;
use crate::chart::{
    between,
    ranges::Wanted,
    ranker::Ranker,
    reader::{LEAST_TAPS, MOST_DISTANCES, Reader, directions},
    rows::RowReader,
};
use crate::curve::{self, Reach};
use crate::design::Design;
use crate::kernel::drives::DriveAxis;
use crate::scene::{Column, Contact, Direction, Geometry, Layout, Study, Theory, Tuple};

/// Curves of a sweep from which on charts at the places of their taps pay, without and with friction: each chart asks about one or three thousand
/// taps in f64, each curve at most one at each place in f32. Development builds took 0.62 of the CPU time for 16 500 curves, 0.78 for 60 000 with
/// friction, and longer for 16 500 with friction. The curves of all parts count, so that parts have the bytes of the whole.
const PAYS_CURVES: [u64; 2] = [1 << 14, 1 << 16];

/// So many times more curves make charts next to the tip pay: these ask more taps, and half of the curves have none there.
const PAYS_BEYOND: u64 = 8;

/// How taps are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Rows are ranked from charts; those kept are solved.
    Charted,
    /// Taps are read from charts, and those outside them solved.
    Read,
    /// Along the drives of a distance some taps are solved and the others read.
    OverDrives,
    /// Every tap is solved by a kernel.
    TapByTap,
    /// Every tap is solved by the reference.
    Reference,
}

impl Way {
    /// The way of taps that no chart ranks.
    pub(super) fn solved(study: &Study, layout: Option<&Layout>, choice: &Choice) -> Self {
        if choice.backend.tolerance.is_none() {
            return Self::Reference;
        }
        let over = |layout: &Layout| {
            study.setup.model.geometry == Geometry::Exact
                && planar(study, layout)
                && layout.drives().is_some_and(|axis| DriveAxis::pays(axis.len()))
                && layout.block() <= CHUNK
        };
        if layout.is_some_and(over) { Self::OverDrives } else { Self::TapByTap }
    }

    /// What ranks the designs of a sweep, where charts can.
    pub(super) fn charted(study: &Study, layout: &Layout, choice: &Choice) -> Option<Ranker> {
        // Where taps cannot be solved the sweep itself says why.
        Ranker::new(study, layout, choice.chart_tolerance()?).ok().flatten()
    }

    /// What reads the taps of a sweep in place of solving them, where charts can and it pays.
    pub(super) fn read(study: &Study, layout: &Layout, choice: &Choice) -> Option<Reader> {
        let charts = layout.n_distances * layout.n_directions;
        if layout.len() < LEAST_TAPS * layout.n_directions || charts > MOST_DISTANCES as u64 {
            return None;
        }
        let mut distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
        let directions = directions(layout)?;
        let tolerance = choice.chart_tolerance()?;
        distances.extend(of_curves(study, layout, tolerance));
        Reader::towards(&study.setup, (&distances, &directions), &Wanted::of(layout), tolerance)
            .ok()
            .flatten()
    }

    /// What reads the rows of a sweep in place of reducing them from taps, where charts can and it pays.
    pub(super) fn read_rows(study: &Study, layout: &Layout, choice: &Choice) -> Option<RowReader> {
        if !planar(study, layout) || layout.len() < LEAST_TAPS || layout.n_distances > between::MOST {
            return None;
        }
        let distances: Vec<f64> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
        let tolerance = choice.chart_tolerance()?;
        RowReader::new(&study.setup, &distances, &Wanted::of(layout), tolerance).ok().flatten()
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Charted => "ranked from a chart",
            Self::Read => "read from charts",
            Self::OverDrives => "solved at some drives, read at the others",
            Self::TapByTap => "solved tap by tap",
            Self::Reference => "solved by the reference",
        }
    }
}

/// Distances whose charts serve the model's own curves of a sweep that tells distances by them; none where curves are few.
fn of_curves(study: &Study, layout: &Layout, tolerance: f64) -> Vec<f64> {
    let rows = layout.len() / layout.n_distances;
    let own = study.setup.estimate.theory == Theory::Exact;
    let slides = matches!(study.setup.model.contact, Contact::Coulomb(mu) if mu != 0.0);
    let least = PAYS_CURVES[usize::from(slides)];
    if !own || !planar(study, layout) || rows < least {
        return Vec::new();
    }
    let [shortest, longest] = layout.bounds(Column::Length);
    // Whiskers whose gauges end nearest and farthest, and that are shortest and longest: where their places are the same, so are those of all between.
    let at = |k: usize| {
        let [x_ss, l] = [Column::GaugePosition, Column::GridLength].map(|column| layout.bounds(column)[k]);
        let tuple = Tuple { x_ss, l, L_a: if k == 0 { longest } else { shortest }, ..layout.design(0) };
        let reach = Reach::of(Direction::UPRIGHT, layout.reach());
        curve::distances(&study.setup, &Design::new(&study.setup, tuple), reach, tolerance)
    };
    let ([first, mut beyond, halves], [same, ..]) = (at(0), at(1));
    if first != same {
        return Vec::new();
    }
    if shortest < longest || rows < PAYS_BEYOND * least {
        beyond.clear();
    }
    let mut all = Vec::new();
    for more in [first, beyond, halves] {
        if all.len() + more.len() + layout.n_distances as usize <= MOST_DISTANCES {
            all.extend(more);
        }
    }
    all
}

/// Whether every tap is one of the plane of rotation, and told by one gauge: what charts know.
fn planar(study: &Study, layout: &Layout) -> bool {
    layout.is_upright() && !study.setup.gauge.second
}
