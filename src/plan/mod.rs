//! What will run, as data: `--plan` prints it, `sweep` executes it.

use std::time::Instant;

pub mod pays;

pub use crate::scene::Layout;
pub use vibrissa_evaluate::CHUNK;

use crate::backend::Choice;
use crate::chart::{ranker::Ranker, scope::Summary};
use crate::error::InputError;
use crate::kernel::ranking::{Case, Charts};
use crate::scene::{Axis, Column, Geometry, Property, Setup, Space, Study, Theory, Tuple};
use crate::sink::shard::Shard;

/// Largest tuples table that is written without being asked for, bytes.
pub const DEFAULT_TUPLES_LIMIT: f64 = 10e9;

/// Mean bytes of a CSV row, measured on `sweeps/prototypes.toml`.
const ROW_BYTES: [f64; 3] = [250.0, 220.0, 75.0];

/// How the rows of a sweep are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Rows are ranked from charts; those kept are solved.
    Charted,
    /// Every tap is solved by a kernel.
    Solved,
    /// Every tap is solved by the reference.
    Reference,
}

impl Way {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Charted => "ranked from a chart",
            Self::Solved => "solved tap by tap",
            Self::Reference => "solved by the reference",
        }
    }
}

/// Sizes of a sweep, and how it goes.
#[derive(Debug)]
pub struct Plan {
    /// Taps to evaluate.
    pub taps: u64,
    /// Designs (D, d, L_a, x_ss, l).
    pub designs: u64,
    /// Rows of tuples, designs and distances tables; 0 for a table that is not written.
    pub rows: [u64; 3],
    /// Designs rows of which the model's own curve is solved too, for distances are told by it.
    pub curves: u64,
    /// Taps around which the model is solved too, for their distances are told by it from two strains.
    pub both: u64,
    /// Estimated bytes of the tables.
    pub bytes: f64,
    /// Whether tuples are written.
    pub tuples: bool,
    /// How its rows are found.
    pub way: Way,
    /// How the taps of designs outside the chart, and of the rows kept, are found; the same as `way` without a chart.
    pub solved: Way,
    /// What ranks the rows, with [`Way::Charted`].
    pub rankers: Option<Rankers>,
    /// Seconds it took to make charts, also those that were refused; `None` where none was tried.
    pub chart: Option<f64>,
    /// Seconds of the whole plan, the charts' among them.
    pub seconds: f64,
    /// Taps of a chunk: as many whole designs as have no more, or one. What of a sweep is complete is known in whole chunks.
    pub chunk: u64,
}

/// Rigs that have charts of their own at most.
const MOST_RIGS: u64 = 64;

/// Seconds from which on a chart that did not come about was tried.
pub(crate) const TRIED: f64 = 1e-3;

impl Plan {
    /// What a sweep of `study` on `choice` does, its chart included. An error where its default tables would be too large to write.
    pub fn new(study: &Study, choice: &Choice) -> Result<Self, InputError> {
        let begun = Instant::now();
        let output = &study.output;
        let kept = |n: u64, each: u64| output.top.map_or(n, |top| n.min((top as u64).saturating_mul(each)));
        // Taps, designs, all rows of the tables, and rows of tuples and distances of a row that is kept.
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
        let rankers = Rankers::new(study, choice);
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
            chunk: chunk(solved, study, choice),
        })
    }

    /// Taps of a part, about: where designs differ in their taps, those of a mean one.
    pub fn taps_of(&self, shard: Option<Shard>) -> u64 {
        let Some(designs) = shard.map(|shard| shard.designs(self.designs)) else { return self.taps };
        let share = u128::from(self.taps) * u128::from(designs.end - designs.start);
        (share / u128::from(self.designs.max(1))) as u64
    }
}

/// What ranks the designs of each rig; nothing of a rig whose designs are all solved.
#[derive(Debug)]
pub struct Rankers(pub Vec<Option<Ranker>>);

impl Rankers {
    /// Of `study` on `choice`; `None` where no design is ranked.
    fn new(study: &Study, choice: &Choice) -> Option<Self> {
        let tolerance = choice.chart_tolerance()?;
        // Where taps cannot be solved the sweep itself says why.
        let one = |study: &Study| Ranker::new(study, &study.space.layout()?, tolerance).ok().flatten();
        let all: Vec<Option<Ranker>> = match &study.setup.rigs {
            None => vec![one(study)],
            Some(_) => of_rigs(study).iter().map(one).collect(),
        };
        all.iter().any(Option::is_some).then_some(Self(all))
    }

    /// All that there are.
    pub fn all(&self) -> impl Iterator<Item = &Ranker> {
        self.0.iter().flatten()
    }

    /// Candidates to bring back.
    pub fn keep(&self) -> usize {
        self.all().map(Ranker::keep).max().unwrap_or(0)
    }

    /// What `run.json` says of the first of the charts.
    pub fn summary(&self) -> Option<Summary> {
        self.all().next().map(Ranker::summary)
    }

    /// How a design is ranked.
    pub fn case(&self, t: &Tuple) -> Case {
        let ranker = self.0.get(t.rig as usize).and_then(Option::as_ref);
        ranker.map_or(Case::Hard, |ranker| ranker.case(t))
    }
}

/// Taps of a chunk: fewer where each takes long, so that a chunk takes about a second of one thread. A device has many at once.
fn chunk(solved: Way, study: &Study, choice: &Choice) -> u64 {
    let setup = &study.setup;
    match () {
        () if solved == Way::Reference => 1 << 10,
        () if choice.backend.adapter.is_some() => CHUNK,
        () if setup.built.is_some() && setup.model.geometry == Geometry::Exact => 1 << 13,
        () => 1 << 16,
    }
}

/// The study of each rig of a grid alone; none where there are many, or where rigs are sampled together with a design's axes.
fn of_rigs(study: &Study) -> Vec<Study> {
    let (Some(rigs), Space::Grid(factors)) = (&study.setup.rigs, &study.space) else { return Vec::new() };
    if rigs.len() > MOST_RIGS || factors.iter().any(|f| !f.properties.is_empty() && !f.axes.is_empty()) {
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
    (0..rigs.len()).map(one).collect()
}
