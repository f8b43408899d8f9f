//! What each effect of the model changes, in % of strain, for the taps of a spec.
//!
//! Every effect is switched alone: off where the spec has it, on at a stated value where it has not, and the strains
//! of both settings are compared tap by tap. Where the rules of the model do not allow the switch alone, both settings
//! take what it needs, and the result says so. Because the distance estimate is calibrated, a factor common to all
//! distances does no harm: what is left of the change after calibration is told too.

use super::effect::{Effect, Setting};
use super::{Taps, sample};
use crate::backend::Choice;
use crate::error::Error;
use crate::evaluate::Outcome;
use crate::reduce::{Spread, median};
use crate::scene::{Study, Tuple};
use crate::status::Status;

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

/// One effect, switched, and what that changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Which.
    pub effect: Effect,
    /// Whether the spec has it; `None` for the side.
    pub on: Option<bool>,
    /// Its value in the spec.
    pub spec: String,
    /// The value it is switched to; empty where it is not.
    pub instead: String,
    /// What both settings have other than the spec, name and value; or why nothing is compared.
    pub both: Result<Vec<(&'static str, String)>, String>,
    /// What the switch changes; `None` where it is not compared, or where no tap counts in both settings.
    pub change: Option<Change>,
}

impl Explained {
    /// Whether the spec may do without it for this `tolerance`: it is on, and nothing else has to change for that.
    fn is_needless(&self, tolerance: f64) -> bool {
        let pole = matches!(self.effect, Effect::Tilt | Effect::Lean) || self.effect.is_of_shape();
        let alone = self.both.as_ref().is_ok_and(Vec::is_empty);
        !pole && self.on == Some(true) && alone && self.change.is_some_and(|c| c.within(tolerance))
    }
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
    let (rows, total) = sample::spread(study);
    let said = Setting::of(&study.setup, rows.iter().map(|row| row.point.direction()));
    // Each setting is solved once.
    let mut known: Vec<(Setting, Vec<Outcome>)> = Vec::new();
    let mut solve = |setting: &Setting| -> Result<Vec<Outcome>, Error> {
        if let Some((_, outcomes)) = known.iter().find(|(s, _)| s == setting) {
            return Ok(outcomes.clone());
        }
        let mut setup = setting.setup.clone();
        // The strain of the first gauge is what is compared, and a solid has no second.
        setup.gauge.second = false;
        let mut taps = Taps::of_rows(&setup, &rows);
        taps.tasks.iter_mut().for_each(|task| *task = setting.aimed(*task));
        let outcomes = taps.answers(choice.open(&setup.model)?)?;
        known.push((setting.clone(), outcomes.clone()));
        Ok(outcomes)
    };
    let mut compare = |base: &Setting, other: &Setting| -> Result<Option<Change>, Error> {
        Ok(change(&rows, &solve(base)?, &solve(other)?))
    };
    let mut effects = Vec::new();
    for effect in Effect::all().filter(|effect| effect.is_told(&said)) {
        let (on, spec) = (effect.is_on(&said), effect.value(&said));
        let mut one =
            Explained { effect, on, spec, instead: String::new(), both: Ok(Vec::new()), change: None };
        if let Some(why) = effect.obstacle(&said) {
            one.both = Err(why);
        } else {
            let (needs, mut base) = (effect.needs(&said), said.clone());
            needs.iter().for_each(|(e, on)| e.switch(&mut base, *on));
            one.both = Ok(needs.iter().map(|(e, _)| (e.name(), e.value(&base))).collect());
            let mut other = base.clone();
            effect.switch(&mut other, on != Some(true));
            (one.instead, one.change) = (effect.value(&other), compare(&base, &other)?);
        }
        effects.push(one);
    }
    let in_model = |e: &&Explained| e.on == Some(true) && !e.effect.is_of_rig();
    let linear = match effects.iter().filter(in_model).count() {
        0 | 1 => None,
        _ => compare(&said, &said.linear())?,
    };
    let mut verdicts = Vec::new();
    for &tolerance in tolerances {
        let needless = effects.iter().filter(|e| e.is_needless(tolerance)).map(|e| e.effect);
        let needless: Vec<Effect> = needless.collect();
        let together = match needless.as_slice() {
            [] => None,
            some => compare(&said, &said.without(some.iter().copied()))?,
        };
        verdicts.push(Verdict { tolerance, effects: needless, together });
    }
    Ok(Explanation { taps: sample::taps(&rows), total, effects, linear, verdicts })
}

/// The change from `base` to `other` at the taps of `rows`; `None` where no tap counts in both.
fn change(rows: &[sample::Row], base: &[Outcome], other: &[Outcome]) -> Option<Change> {
    let counts = |tap: &Outcome| tap.status.counts() && tap.strain != 0.0;
    let (mut changes, mut left) = (Vec::new(), None::<f64>);
    let (mut unmatched, mut unmatched_status) = (0, Status::OK);
    let mut pairs = base.iter().zip(other);
    for row in rows {
        let mut ratios = Spread::default();
        for (tap, (base, other)) in row.taps().zip(pairs.by_ref()) {
            match (counts(base), counts(other)) {
                (true, true) => {
                    let (from, to) = (base.magnitude(), other.magnitude());
                    ratios.push(to / from);
                    changes.push((100.0 * (to - from) / from, tap));
                }
                (false, false) => {}
                (counts_in_base, _) => {
                    unmatched += 1;
                    unmatched_status |= if counts_in_base { other.status } else { base.status };
                }
            }
        }
        if let (Some(sd), Some(mean)) = (ratios.sd(), ratios.mean()) {
            left = Some(left.unwrap_or(0.0).max(100.0 * sd / mean));
        }
    }
    // Of equal sizes the first tap is the largest.
    let &(largest, at) = changes.iter().rev().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let median = median(&mut changes.iter().map(|c| c.0).collect::<Vec<_>>());
    Some(Change { median, largest, at, left, taps: changes.len(), unmatched, unmatched_status })
}
