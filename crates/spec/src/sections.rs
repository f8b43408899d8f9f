//! `[gauge]`, `[estimate]`, `[output]` and `[run]`.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::properties::first;
use super::reader::{Document, Item, Result};
use super::schema::Sections;
use super::{keys, solid};
use crate::error::InputError;
use crate::scene::{
    BackendChoice, Convention, Estimate, Gauge, Output, Per, Precision, RankBy, RunOptions, Side, Theory,
};
use crate::sink::format::TableFormat;

/// `[gauge]` apart from x_ss and l.
pub(super) fn gauge(section: &Section<'_>) -> Result<Gauge> {
    Ok(Gauge {
        side: section.get("side")?.word(&[("contact", Side::Contact), ("far", Side::Far)])?,
        noise_strain: section.optional("noise_strain", first)?,
        strain_limit: section.get("strain_limit")?.ranged()?,
        factor: section.get("factor")?.ranged()?,
        second: section.get("second")?.flag()?,
        foil: section.optional("foil", solid::foil)?,
    })
}

pub(super) fn estimate(section: &Section<'_>) -> Result<Estimate> {
    let conventions = [("mean", Convention::Mean), ("elongation", Convention::Elongation)];
    Ok(Estimate {
        theory: section.get("theory")?.word(&Theory::WORDS)?,
        convention: section.get("convention")?.word(&conventions)?,
        range: section.optional("range", range)?,
        k: section.optional("K", Item::ranged)?,
    })
}

fn range(item: &Item<'_>) -> Result<[f64; 2]> {
    let [min, max] = item.numbers()?;
    match 0.0 < min && min < max {
        true => Ok([min, max]),
        false => item.wrong("this is not a range of distances"),
    }
}

/// What of `[estimate]` plays no part.
pub(super) fn idle(estimate: &Estimate) -> Option<String> {
    let idle = estimate.theory == Theory::Exact && estimate.k.is_some();
    idle.then(|| "[estimate] K is not used with theory = \"exact\"".to_owned())
}

/// Refuses to rank by an error that the model does not make with its own strains.
pub(super) fn rankable(sections: &Sections<'_>, estimate: &Estimate, output: &Output) -> Result<()> {
    let robust = sections.section("optimise").written("robust");
    let calibrated = robust.and_then(|robust| robust.child("calibrated"));
    let nominal = calibrated.is_some_and(|c| c.text().is_ok_and(|word| word == "nominal"));
    let error = matches!(output.by, RankBy::ErrorRms | RankBy::ErrorMax);
    if estimate.theory != Theory::Exact || !error || nominal {
        return Ok(());
    }
    let others = RankBy::ALL.iter().map(|by| by.name()).filter(|name| !name.starts_with("error_"));
    let message = "with theory = \"exact\" the model inverts its own strains: beyond the peak there is no error to rank by";
    let allowed = others.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    sections.section("output").get("by")?.refuse(message, allowed)
}

/// A column to rank by, also by the other name of the bias.
fn rank_by(by: &Item<'_>) -> Result<RankBy> {
    match by.text() {
        Ok(RankBy::BIAS) => Ok(RankBy::ErrorRms),
        _ => by.word(&RankBy::ALL.map(|by| (by.name(), by))),
    }
}

pub(super) fn output(section: &Section<'_>) -> Result<Output> {
    section.get("format")?.word(&TableFormat::WORDS)?;
    let top = |v: &Item<'_>| {
        let n = v.whole()?;
        usize::try_from(n).map_err(|_| v.error("this number is too large for this machine"))
    };
    Ok(Output {
        tuples: section.optional("tuples", Item::flag)?,
        designs: section.get("designs")?.flag()?,
        distances: section.get("distances")?.flag()?,
        top: section.optional("top", top)?,
        by: rank_by(&section.get("by")?)?,
        by_said: section.written("by").is_some(),
        per: section.get("per")?.word(&[("row", Per::Row), ("design", Per::Design)])?,
    })
}

/// `[run]`; paths are relative to `base`.
pub(super) fn run(section: &Section<'_>, base: &Path) -> Result<RunOptions> {
    let backends = BackendChoice::WORDS.map(|(word, backend, _)| (word, backend));
    let precisions = Precision::WORDS.map(|(word, precision, _)| (word, precision));
    Ok(RunOptions {
        out: section.optional("out", |v| Ok(base.join(v.text()?)))?,
        force: section.optional("force", Item::flag)?,
        backend: section.optional("backend", |v| v.word(&backends))?,
        adapter: section.optional("adapter", |v| Ok(v.text()?.to_owned()))?,
        precision: section.optional("precision", |v| v.word(&precisions))?,
        tolerance: section.optional("tolerance", Item::ranged)?,
        model_error: section.optional("model_error", Item::ranged)?,
        threads: section.optional("threads", |v| Ok(v.whole()? as usize))?,
        plan: section.optional("plan", Item::flag)?,
        quiet: section.optional("quiet", Item::flag)?,
        json: section.optional("json", Item::flag)?,
    })
}

/// One `[section]`: what the user wrote, and what stands behind it.
#[derive(Debug, Clone)]
pub(super) struct Section<'a> {
    pub document: &'a Document<'a>,
    pub known: &'static keys::Section,
    pub span: Option<Range<usize>>,
    pub user: Option<&'a DeTable<'a>>,
    pub more: Option<&'a DeTable<'a>>,
}

impl<'a> Section<'a> {
    pub fn dotted(&self, key: &str) -> String {
        format!("{}.{key}", self.known.name)
    }

    /// The user's value of `key`.
    pub fn written(&self, key: &str) -> Option<Item<'a>> {
        let item = Item::written(self.document, self.dotted(key), self.user?.get(key)?);
        Some(item.of(self.known.key(key)))
    }

    /// What stands for `key` where the user says nothing. Defaults of a search are those of a command that searches.
    pub fn default(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        let usual = self.known.key(key).filter(|_| self.known.name != "optimise" || self.more.is_some());
        self.more.and_then(|more| more.get(key)).or_else(|| usual?.default)
    }

    /// The user's value of `key`, or the default.
    pub fn get(&self, key: &str) -> Result<Item<'a>> {
        if let Some(item) = self.written(key) {
            return Ok(item);
        }
        match self.default(key) {
            Some(value) => Ok(Item::default(self.document, self.dotted(key), value).of(self.known.key(key))),
            None => Err(self.missing(key)),
        }
    }

    /// What the user wrote under `key`, if anything, read by `read`.
    pub fn optional<T>(&self, key: &str, read: impl FnOnce(&Item<'a>) -> Result<T>) -> Result<Option<T>> {
        self.written(key).as_ref().map(read).transpose()
    }

    fn missing(&self, key: &str) -> InputError {
        let (name, known) = (self.known.name, self.known.key(key).cloned().unwrap_or_default());
        let unit = if known.unit.is_empty() { "" } else { ", " };
        let line = format!("{key} = {} ({}{unit}{})", known.example, known.what, known.unit);
        let message = match self.user {
            Some(_) => format!("{key} is missing from [{name}]; add a line such as {line}"),
            None => format!("[{name}] with {key} is missing; add [{name}] and a line such as {line}"),
        };
        self.document.error(self.span.clone(), message).key(self.dotted(key))
    }
}
