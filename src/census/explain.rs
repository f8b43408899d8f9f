//! Changes by each effect of the model, in % of strain, for the taps of a spec.
//!
//! Every effect is switched alone: off where the spec has it, on at a stated value where it has not, and the strains
//! of both settings are compared tap by tap. Where the rules of the model do not allow the switch alone, both settings
//! take what it needs, and the result says so. Because the distance estimate is calibrated, a factor common to all
//! distances does no harm: what is left of the change after calibration is told too.

use serde::{Serialize, Serializer};

use super::{At, Effect, Setting, Taps, sample};
use crate::backend::Choice;
use crate::error::Error;
use crate::evaluate::Outcome;
use crate::reduce::{Spread, median};
use crate::scene::{Drive, Study};
use crate::status::Status;

/// Change of |strain| from one setting to another, in %.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// Median over the taps.
    #[serde(rename = "median_percent")]
    pub median: f64,
    /// The change of largest size, with its sign.
    #[serde(rename = "largest_percent")]
    pub largest: f64,
    pub at: At,
    /// Largest relative sample SD of the ratio of the strains over the distances of a design at one drive: what is
    /// left after calibration. `None` where no row has two taps.
    #[serde(rename = "calibrated_sd_percent")]
    pub left: Option<f64>,
    /// Taps compared: those that count in both settings.
    pub taps: usize,
    /// Taps that count in only one of them.
    pub unmatched: usize,
    /// Words of those taps where they do not count.
    #[serde(serialize_with = "words")]
    pub unmatched_status: Status,
}

fn words<S: Serializer>(status: &Status, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(status)
}

/// An effect that both settings of a comparison have other than the spec, and its value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Both {
    pub effect: Effect,
    pub value: String,
}

/// One effect, switched, and what that changes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explained {
    pub effect: Effect,
    pub key: String,
    /// True if the spec has it; `None` for the side.
    pub on: Option<bool>,
    pub spec: String,
    /// The value it is switched to.
    pub instead: Option<String>,
    /// Other effects that had to be switched for both.
    pub both_with: Vec<Both>,
    /// Why nothing is compared, if so.
    pub not_compared: Option<String>,
    /// Change by the switch; `None` where it is not compared, or where no tap counts in both settings.
    pub change: Option<Change>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Taps looked at.
    #[serde(skip)]
    pub taps: usize,
    #[serde(skip)]
    pub total: u64,
    pub effects: Vec<Explained>,
    /// The paper's linear theory in place of all effects of the model; `None` where the spec has fewer than two.
    pub all_effects: Option<Change>,
}

/// Explains `study`, computed by `choice`.
pub fn explain(study: &Study, choice: &Choice) -> Result<Explanation, Error> {
    let (rows, total) = sample::spread(&study.space, sample::LIMIT);
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
        Ok(change(study.setup.drive, &rows, &solve(base)?, &solve(other)?))
    };
    let mut effects = Vec::new();
    for effect in Effect::all().filter(|effect| effect.is_told(&said)) {
        let (on, not_compared, mut both_with) = (effect.is_on(&said), effect.obstacle(&said), Vec::new());
        let (mut instead, mut change) = (None, None);
        if not_compared.is_none() {
            let mut base = said.clone();
            for (other, on) in effect.needs(&said) {
                other.switch(&mut base, on);
                both_with.push(Both { effect: other, value: other.value(&base) });
            }
            let mut other = base.clone();
            effect.switch(&mut other, on != Some(true));
            (instead, change) = (Some(effect.value(&other)), compare(&base, &other)?);
        }
        let (key, spec) = (effect.key(), effect.value(&said));
        effects.push(Explained { effect, key, on, spec, instead, both_with, not_compared, change });
    }
    let in_model = |e: &&Explained| e.on == Some(true) && !e.effect.is_of_rig();
    let all_effects = match effects.iter().filter(in_model).count() {
        0 | 1 => None,
        // The paper's theory: linear, without any effect; rig and gauge stay.
        _ => compare(&said, &said.without(Effect::all().filter(|e| !e.is_of_rig())))?,
    };
    Ok(Explanation { taps: sample::taps(&rows), total, effects, all_effects })
}

/// The change from `base` to `other` at the taps of `rows`; `None` where no tap counts in both.
fn change(drive: Drive, rows: &[sample::Row], base: &[Outcome], other: &[Outcome]) -> Option<Change> {
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
    let at = At(drive, at);
    Some(Change { median, largest, at, left, taps: changes.len(), unmatched, unmatched_status })
}
