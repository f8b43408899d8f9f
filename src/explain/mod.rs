//! What each effect of the model changes, in % of strain, for the taps of a spec.
//!
//! Every effect is switched alone: off where the spec has it, on at a stated value where it has not, and the strains
//! of both settings are compared tap by tap. Where the rules of the model do not allow the switch alone, both settings
//! take what it needs, and the result says so. Because the distance estimate is calibrated, a factor common to all
//! distances does no harm: what is left of the change after calibration is told too.

mod sample;
mod setting;
mod switch;

#[cfg(test)]
pub(crate) use sample::tests as samples;
pub use sample::{LIMIT, Sample};
pub use setting::{Aim, Setting};
pub use switch::{Effect, FOIL, FRICTION, HUB, LEAN, Pair, Switch, TILT, without};

use crate::backend::Choice;
use crate::design::Design;
use crate::error::Error;
use crate::evaluate::{Evaluator, Outcome, Task};
use crate::reduce::Spread;
use crate::scene::{Setup, Study, Tuple};
use crate::status::Status;
use rayon::prelude::*;

/// How much |strain| changes from one setting to another; in %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Median over the taps.
    pub median: f64,
    /// The change of largest size, with its sign.
    pub largest: f64,
    /// The tap that has it.
    pub at: Tuple,
    /// Largest relative sample SD of the ratio of the strains over the distances of a design at one drive: what is
    /// left after calibration. `None` where no row has two taps.
    pub left: Option<f64>,
    /// Taps compared: those that count in both settings.
    pub taps: usize,
    /// Taps that count in only one of them.
    pub unmatched: usize,
    /// Words of those taps where they do not count.
    pub unmatched_status: Status,
}

impl Change {
    /// Whether it stays within `tolerance` (1e-3 is 0.1 %) at every tap.
    pub fn within(&self, tolerance: f64) -> bool {
        self.unmatched == 0 && self.largest.abs() <= 100.0 * tolerance
    }
}

/// One effect and what it changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// The effect, switched.
    pub switch: Switch,
    /// What that changes; `None` where it is not compared, or where no tap counts in both settings.
    pub change: Option<Change>,
}

/// Effects that could be left off at one tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Bound on the relative change of strain.
    pub tolerance: f64,
    /// Effects that each could be left off alone.
    pub effects: Vec<Effect>,
    /// What leaving off all of them at once changes; `None` without any.
    pub together: Option<Change>,
}

/// What an explanation tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Taps looked at.
    pub taps: usize,
    /// Taps of the spec.
    pub total: u64,
    /// Every effect.
    pub effects: Vec<Explained>,
    /// The paper's linear theory in place of all effects of the model; `None` where the spec has fewer than two.
    pub linear: Option<Change>,
    /// One per tolerance asked.
    pub verdicts: Vec<Verdict>,
}

/// Explains `study`, computed by `choice`, with a verdict for each of `tolerances`.
pub fn explain(study: &Study, choice: &Choice, tolerances: &[f64]) -> Result<Explanation, Error> {
    let Study { setup, .. } = study;
    let sample = Sample::new(study)?;
    let mut bench = Bench { setup: setup.clone(), choice, sample: &sample, known: Vec::new() };
    let said = Setting::of(setup).asked(&sample.tasks);
    let mut effects = Vec::new();
    for effect in Effect::all().filter(|effect| effect.is_told(&said)) {
        let switch = Switch::new(effect, &said, setup.drive);
        let change = match &switch.pair {
            Ok(pair) => bench.compare(&pair.base, &pair.other)?,
            Err(_) => None,
        };
        effects.push(Explained { switch, change });
    }
    let in_model = |e: &&Explained| e.switch.on == Some(true) && !e.switch.effect.is_of_rig();
    let linear = match effects.iter().filter(in_model).count() {
        0 | 1 => None,
        _ => bench.compare(&said, &said.linear())?,
    };
    let mut verdicts = Vec::new();
    for &tolerance in tolerances {
        let small =
            |e: &&Explained| e.switch.removable() && e.change.is_some_and(|change| change.within(tolerance));
        let needless: Vec<Effect> = effects.iter().filter(small).map(|e| e.switch.effect).collect();
        let together = match needless.as_slice() {
            [] => None,
            some => bench.compare(&said, &without(&said, some))?,
        };
        verdicts.push(Verdict { tolerance, effects: needless, together });
    }
    Ok(Explanation { taps: sample.tasks.len(), total: sample.total, effects, linear, verdicts })
}

/// Evaluates the sample in one setting after the other, each once.
struct Bench<'a> {
    setup: Setup,
    choice: &'a Choice,
    sample: &'a Sample,
    known: Vec<(Setting, Vec<Outcome>)>,
}

impl Bench<'_> {
    fn compare(&mut self, base: &Setting, other: &Setting) -> Result<Option<Change>, Error> {
        let (base, other) = (self.solve(base)?, self.solve(other)?);
        Ok(change(self.sample, &self.known[base].1, &self.known[other].1))
    }

    /// Place of the outcomes of `setting` in `known`.
    fn solve(&mut self, setting: &Setting) -> Result<usize, Error> {
        if let Some(place) = self.known.iter().position(|(s, _)| s == setting) {
            return Ok(place);
        }
        let setup = &mut self.setup;
        setup.model = setting.model;
        setup.hub = setting.hub;
        setup.gauge.side = setting.side;
        setup.gauge.foil = setting.foil;
        setup.built = setting.built.clone();
        // The strain of the first gauge is what is compared, and a solid has no second.
        setup.gauge.second = false;
        let designs: Vec<Design> = self.sample.designs.par_iter().map(|t| Design::new(setup, *t)).collect();
        let method = self.choice.open(&setup.model)?;
        let tasks: Vec<Task> = self.sample.tasks.iter().map(|task| setting.aimed(*task)).collect();
        let outcomes = Evaluator::new(setup, method).run(&designs, &tasks)?;
        self.known.push((setting.clone(), outcomes));
        Ok(self.known.len() - 1)
    }
}

/// The change from `base` to `other`; `None` where no tap counts in both.
fn change(sample: &Sample, base: &[Outcome], other: &[Outcome]) -> Option<Change> {
    let counts = |tap: &Outcome| tap.status.counts() && tap.strain != 0.0;
    let (mut changes, mut left) = (Vec::new(), None::<f64>);
    let (mut unmatched, mut unmatched_status) = (0, Status::OK);
    for row in sample.rows.windows(2) {
        let mut ratios = Spread::default();
        for i in row[0]..row[1] {
            match (counts(&base[i]), counts(&other[i])) {
                (true, true) => {
                    let (from, to) = (base[i].magnitude(), other[i].magnitude());
                    ratios.push(to / from);
                    changes.push((100.0 * (to - from) / from, i));
                }
                (false, false) => {}
                (counts_in_base, _) => {
                    unmatched += 1;
                    unmatched_status |= if counts_in_base { other[i].status } else { base[i].status };
                }
            }
        }
        if let (Some(sd), Some(mean)) = (ratios.sd(), ratios.mean()) {
            left = Some(left.unwrap_or(0.0).max(100.0 * sd / mean));
        }
    }
    // Of equal sizes the first tap is the largest.
    let &(largest, at) = changes.iter().rev().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let taps = changes.len();
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = 0.5 * (changes[(taps - 1) / 2].0 + changes[taps / 2].0);
    Some(Change { median, largest, at: sample.tuple(at), left, taps, unmatched, unmatched_status })
}
