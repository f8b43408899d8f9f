//! Reading an axis: a value, a list, a range or samples.

use toml::de::DeValue;

use super::keys::Key;
use super::{Item, Result, sections};
use crate::scene::Axis;
use crate::scene::axis::Points;
use crate::scene::sampler::Sampler;

const SCALES: [(&str, bool); 2] = [("linear", false), ("log", true)];
const RANGE_KEYS: [&str; 4] = ["from", "to", "steps", "step"];
const SAMPLE_KEYS: [&str; 5] = ["min", "max", "samples", "sampler", "seed"];
const FORMS: &str =
    "a number, a list [4, 7, 10], { from, to, steps }, { from, to, step } or { min, max, samples }";

#[derive(Debug, Clone)]
pub(super) struct AxisItem<'a> {
    pub item: Item<'a>,
    pub axis: Axis,
}

impl<'a> AxisItem<'a> {
    pub fn read(item: Item<'a>, dimension: u32) -> Result<Self> {
        let Some(known) = item.known else { return item.refuse("no axis is asked for", "a number") };
        let axis = match item.value {
            DeValue::Array(_) => Axis::List(list(&item)?),
            DeValue::Table(_) => {
                item.only_known().map_err(|e| e.allowed(FORMS))?;
                let found = |keys: &[&str]| keys.iter().find_map(|key| item.child(key));
                match (found(&RANGE_KEYS), found(&SAMPLE_KEYS)) {
                    (Some(_), Some(other)) => {
                        return other.refuse("this belongs to samples, but the axis is a range", FORMS);
                    }
                    (None, Some(_)) => samples(&item, known, dimension)?,
                    _ => range(&item, known)?,
                }
            }
            DeValue::Integer(_) | DeValue::Float(_) | DeValue::String(_) => Axis::Value(item.ranged()?),
            _ => return item.refuse("this must be a number or an axis", FORMS),
        };
        Ok(Self { item, axis })
    }

    /// The first value that is `bad`, and its place. Ranges are judged by their ends, samples by the single value `best`.
    pub fn first_where(&self, best: f64, bad: impl Fn(f64) -> bool) -> Option<(f64, Item<'a>)> {
        let ends = || {
            let places = [(self.axis.min(), "from"), (self.axis.max(), "to")];
            let (value, key) = places.into_iter().find(|(value, _)| bad(*value))?;
            Some((value, self.item.child(key)?))
        };
        match &self.axis {
            Axis::Value(value) => bad(*value).then(|| (*value, self.item.clone())),
            Axis::List(values) => {
                values.iter().copied().zip(self.item.elements()?).find(|(value, _)| bad(*value))
            }
            Axis::Even(_) | Axis::Log { .. } => ends(),
            Axis::Samples { .. } => bad(best).then(|| (best, self.item.clone())),
        }
    }
}

fn list(item: &Item<'_>) -> Result<Vec<f64>> {
    let values: Vec<f64> =
        item.elements().into_iter().flatten().map(|e| e.ranged()).collect::<Result<_>>()?;
    if values.is_empty() {
        return item.refuse("this list is empty; at least one value is needed", FORMS);
    }
    Ok(values)
}

fn end(item: &Item<'_>, key: &str, known: &'static Key) -> Result<f64> {
    item.need(key)?.of(Some(known)).ranged()
}

fn range(item: &Item<'_>, known: &'static Key) -> Result<Axis> {
    let from = end(item, "from", known)?;
    let last = item.need("to")?.of(Some(known));
    let to = last.number()?;
    let log = scale(item)?;
    let axis = match (item.child("steps"), item.child("step")) {
        (Some(steps), None) => {
            let steps = steps.whole()?;
            if log { Axis::log_steps(from, to, steps) } else { Axis::steps(from, to, steps) }
        }
        (None, Some(step)) if log => return Err(step.error("a logarithmic scale needs steps, not step")),
        (None, Some(step)) => Axis::step(from, to, step.number()?),
        (Some(_), Some(step)) => {
            return Err(step.error("steps and step contradict each other; keep one of them"));
        }
        (None, None) => {
            return item.refuse("steps (the number of values) or step (their distance) is missing", FORMS);
        }
    };
    let axis = axis.map_err(|e| item.place(e))?;
    // `to` itself need not be a value of the axis.
    if known.form.interval().is_none_or(|interval| interval.holds(axis.max())) {
        return Ok(axis);
    }
    last.wrong(format!("the last value, {}, is out of range", axis.max()))
}

fn samples(item: &Item<'_>, known: &'static Key, dimension: u32) -> Result<Axis> {
    let (min, max) = (end(item, "min", known)?, end(item, "max", known)?);
    let samples = item.need("samples")?.whole()?;
    let sampler = item.child("sampler").map_or(Ok(Sampler::Sobol), |s| s.word(&Sampler::WORDS))?;
    let seed = item.child("seed").map_or(Ok(sections::SEED), |s| s.whole())?;
    let log = scale(item)?;
    Axis::samples(min, max, log, Points { samples, sampler, seed }, dimension).map_err(|e| item.place(e))
}

fn scale(item: &Item<'_>) -> Result<bool> {
    item.child("scale").map_or(Ok(false), |s| s.word(&SCALES))
}
