//! The plan of a sweep as data: `--plan` prints it, `sweep` executes it. Also the estimated duration of a run on all CPU threads, s, to the
//! order of magnitude, which decides if a device is worth using.

use std::time::Instant;

use crate::backend::Choice;
use crate::chart::ranker::{Ranker, Rankers};
use crate::chart::scope::Scope;
use crate::error::InputError;
use crate::evaluate::takes_all;
use crate::scene::{
    Axis, Column, Contact, Geometry, Precision, Property, RunOptions, Search, Setup, Space, Study, Theory,
};
use crate::sink::shard::Shard;

pub use crate::scene::Layout;
pub use vibrissa_evaluate::CHUNK;

/// Largest tuples table that is written by default, bytes.
pub const DEFAULT_TUPLES_LIMIT: f64 = 10e9;

/// Mean bytes of a CSV row, measured on `sweeps/prototypes.toml`.
const ROW_BYTES: [f64; 3] = [250.0, 220.0, 75.0];

vibrissa_core::words! {
    Way {
        Charted = "ranked from a chart",
        Solved = "solved tap by tap",
        Reference = "solved by the reference",
    }
}

#[derive(Debug)]
pub struct Plan {
    pub taps: u64,
    pub designs: u64,
    /// Rows of tuples, designs and distances tables; 0 for a table that is not written.
    pub rows: [u64; 3],
    /// Designs rows that need the exact model's curve for their distances.
    pub curves: u64,
    /// Taps whose distances the exact model estimates from two strains.
    pub both: u64,
    pub bytes: f64,
    pub tuples: bool,
    pub way: Way,
    /// Method for designs outside the chart and for kept rows; the same as `way` without a chart.
    pub solved: Way,
    pub rankers: Option<Rankers>,
    /// Seconds of making charts, with refused ones; `None` if none was tried.
    pub chart: Option<f64>,
    pub seconds: f64,
    /// Taps of a chunk: as many whole designs as fit, at least one. On CPUs few, so that its designs, taps and outcomes fit in a cache.
    pub chunk: u64,
}

const MOST_RIGS: u64 = 64;

/// A chart that was not made counts as tried if it took this many seconds.
pub(crate) const TRIED: f64 = 1e-3;

impl Plan {
    /// The plan of a sweep of `study` on `choice`, with its charts. An error if the default tables would be too large.
    pub fn new(study: &Study, choice: &Choice) -> Result<Self, InputError> {
        let begun = Instant::now();
        let output = &study.output;
        let kept = |n: u64, each: u64| output.top.map_or(n, |top| n.min((top as u64).saturating_mul(each)));
        // Taps, designs, all rows of the tables, and the tuples and distances rows per kept row.
        let (taps, designs, full, [per_row, per_design]) = match &study.space {
            Space::Grid(factors) => {
                let l = Layout::new(factors);
                let each = [l.n_distances, l.n_distances * l.n_directions];
                (l.len(), l.n_designs, [l.len(), l.n_designs * l.n_drives, l.n_designs * each[1]], each)
            }
            Space::List(listed) => {
                let ([designs, strokes, distances], taps) = (listed.groups().counts, listed.len() as u64);
                (taps, designs, [taps, strokes, distances], [1; 2])
            }
        };
        let tuples = output.tuples.unwrap_or(true);
        let rows = [
            if tuples { kept(full[0], per_row) } else { 0 },
            if output.designs { kept(full[1], 1) } else { 0 },
            if output.distances { kept(full[2], per_design) } else { 0 },
        ];
        let bytes: f64 = rows.iter().zip(ROW_BYTES).map(|(&n, b)| n as f64 * b).sum();
        let tuple_bytes = rows[0] as f64 * ROW_BYTES[0];
        if output.tuples.is_none() && tuple_bytes > DEFAULT_TUPLES_LIMIT {
            let size = format!("{} rows, about {:.0} GB", rows[0], tuple_bytes / 1e9);
            let why = format!("the tuples table would hold {size}; say that you want it, or leave it out");
            let error = InputError::new(why).key("output.tuples").value("true (by default)");
            return Err(error.allowed("tuples = true or tuples = false in [output], or top = N"));
        }
        let solved = if choice.backend.tolerance.is_none() { Way::Reference } else { Way::Solved };
        let charting = Instant::now();
        let rankers = rankers(study, choice);
        let charted = charting.elapsed().as_secs_f64();
        let chart = Some(charted).filter(|s| rankers.is_some() || *s > TRIED);
        let own =
            study.setup.estimate.theory == Theory::Exact && study.setup.model.geometry == Geometry::Exact;
        let (curves, both) = match (own, study.setup.gauge.second) {
            (true, false) => (full[1], 0),
            (true, true) => (0, taps),
            (false, _) => (0, 0),
        };
        let way = if rankers.is_some() { Way::Charted } else { solved };
        let seconds = begun.elapsed().as_secs_f64();
        Ok(Self {
            taps,
            designs,
            rows,
            curves,
            both,
            bytes,
            tuples,
            way,
            solved,
            rankers,
            chart,
            seconds,
            chunk: match solved {
                Way::Reference => 1 << 10,
                _ if choice.backend.adapter.is_some() => CHUNK,
                _ => 1 << 13,
            },
        })
    }

    /// Approximate number of taps of a part, from the mean per design.
    pub fn taps_of(&self, shard: Option<Shard>) -> u64 {
        let Some(designs) = shard.map(|shard| shard.designs(self.designs)) else { return self.taps };
        let share = u128::from(self.taps) * u128::from(designs.end - designs.start);
        (share / u128::from(self.designs.max(1))) as u64
    }
}

/// A ranker for each rig of `study`; `None` if all designs are solved.
fn rankers(study: &Study, choice: &Choice) -> Option<Rankers> {
    let tolerance = choice.chart_tolerance()?;
    // Errors are reported by the sweep itself.
    let one = |study: &Study| Ranker::new(study, &study.space.layout()?, tolerance).ok().flatten();
    let all: Vec<Option<Ranker>> = match &study.setup.rigs {
        None => vec![one(study)],
        Some(_) => of_rigs(study).iter().map(one).collect(),
    };
    all.iter().any(Option::is_some).then_some(Rankers(all))
}

/// One study per rig of a grid; empty if there are too many rigs, or if rigs are sampled together with axes of designs.
fn of_rigs(study: &Study) -> Vec<Study> {
    let (Some(rigs), Space::Grid(factors)) = (&study.setup.rigs, &study.space) else { return Vec::new() };
    if rigs.count() > MOST_RIGS || factors.iter().any(|f| !f.properties.is_empty() && !f.axes.is_empty()) {
        return Vec::new();
    }
    let one = |rig| {
        let base = || Setup { rigs: None, ..study.setup.clone() };
        let setup = rigs.setup(&study.setup, rig).unwrap_or_else(base);
        let scale = if study.setup.varies(Property::Scale) { rigs.value(rig, Property::Scale) } else { 1.0 };
        let own = factors.iter().filter(|f| f.properties.is_empty()).cloned().map(|mut factor| {
            for (column, axis) in &mut factor.axes {
                if let (Column::BaseDiameter | Column::TipDiameter, Axis::Value(d)) = (column, axis) {
                    *d *= scale;
                }
            }
            factor
        });
        Study { setup, space: Space::Grid(own.collect()), output: study.output }
    };
    (0..rigs.count()).map(one).collect()
}

/// CPU seconds of one thread per tap: solved in f32 without friction; read from charts with one drive per design; or with shared drives.
const SOLVED: f64 = 1.5e-6;
const READ: f64 = 6e-8;
const READ_TOGETHER: f64 = 1.5e-9;

/// Cost factors of friction and of f64 for a solved tap.
const FRICTION: f64 = 4.0;
const DOUBLE: f64 = 2.0;

const SEARCHED: f64 = 2e4;

/// Seconds of a sweep of `study`; `None` if no device takes part, because the CPU solves all taps, or ranks built whiskers or taps at tilted poles.
pub fn of_study(study: &Study, options: &RunOptions) -> Option<f64> {
    let taps = study.space.tuples().0 as f64;
    let charted = |layout: &Layout| options.precision != Some(Precision::F64) && Scope::fits(study, layout);
    let Some(layout) = study.space.layout().filter(charted) else {
        return solved(taps, &study.setup, options);
    };
    let each = if layout.drives().is_some_and(|axis| axis.len() > 1) { READ_TOGETHER } else { READ };
    (study.setup.built.is_none() && layout.is_upright()).then(|| shared(taps * each, options))
}

/// The same of a search.
pub fn of_search(search: &Search, space: &Space, setup: &Setup, options: &RunOptions) -> Option<f64> {
    let distances = space.layout().map_or(1, |layout| layout.n_distances);
    let samples = search.robust.as_ref().map_or(0, |robust| robust.samples);
    let taps = SEARCHED * (1.0 + samples as f64) * distances as f64;
    solved(taps, setup, options)
}

fn solved(taps: f64, setup: &Setup, options: &RunOptions) -> Option<f64> {
    let rubs = matches!(setup.model.contact, Contact::Stick | Contact::Coulomb(f64::MIN_POSITIVE..));
    let friction = if rubs { FRICTION } else { 1.0 };
    let double = if options.precision == Some(Precision::F64) { DOUBLE } else { 1.0 };
    // Closed forms are fast on any backend.
    let each = if setup.model.geometry == Geometry::Linear { 0.0 } else { SOLVED * friction * double };
    // The effect that is left off may be the one that only the CPU solves.
    let served = !takes_all(setup) || options.model_error.is_some();
    served.then(|| shared(taps * each, options))
}

fn shared(seconds: f64, options: &RunOptions) -> f64 {
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads);
    seconds / threads.max(1) as f64
}
