//! Specs: a TOML file becomes a [`Spec`], or an [`InputError`] with place and reason. `keys` reads the descriptions in `keys.toml`, `sections`
//! refuses unknown keys, `reader` gives values with their places, `usual` warns about unusual numbers; the other modules read and check a part each.

mod built;
mod channels;
mod curve;
mod fits;
pub mod keys;
mod model;
mod optimise;
mod properties;
mod reader;
mod sections;
mod space;
mod table;
mod tuple_file;
mod usual;

use vibrissa_core::{design, error, physics, scene};
use vibrissa_evaluate::curve as evaluated;
use vibrissa_table::{self as sink, fields, text_file};

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use crate::error::InputError;
use crate::scene::{Drive, Estimate, Gauge, Output, RunOptions, Search, Setup, Signal, Spec, Study, Theory};
use crate::sink::Frame;
use crate::text_file::{Limit, TextFile};
pub use curve::{of_file as material_of_file, of_frame as material_of_curve};
use properties::AxisItem;
use reader::{Document, Result};
pub use reader::{Item, placed};
use sections::{Section, Sections};
pub use usual::of_taps as unusual_taps;

/// Reads the spec at `path`. Paths in the spec are relative to its folder.
pub fn read(path: &Path) -> Result<Spec> {
    parse(&path.display().to_string(), &load(path, "spec")?, path.parent().unwrap_or(Path::new("")))
}

/// [`parse`] for a spec without taps: they are those of `frame`, with the columns of a tuple file, if it is given.
pub fn parse_listed(label: &str, text: &str, base: &Path, frame: Option<&Frame>) -> Result<Spec> {
    parsed(label, text, |document, user| {
        of_user(document, user, base, "", |sections, drive| space::listed(sections, drive, frame))
    })
}

/// Reads a spec from `text`; `label` names it in messages, relative paths start at `base`.
pub fn parse(label: &str, text: &str, base: &Path) -> Result<Spec> {
    parse_with(label, text, base, "")
}

/// [`parse`] with a `fallback`: TOML with values for keys that a sweep requires, in addition to the defaults.
pub fn parse_with(label: &str, text: &str, base: &Path, fallback: &str) -> Result<Spec> {
    parsed(label, text, |document, user| of_table(document.file, document.text, user, base, fallback))
}

/// [`parse_with`] for a spec that is the `user` table in the `text` of a file.
pub fn of_table(label: &str, text: &str, user: &DeTable<'_>, base: &Path, fallback: &str) -> Result<Spec> {
    let document = Document { file: label, text };
    of_user(&document, user, base, fallback, |sections, drive| space::read(sections, drive, base))
}

fn parsed<T>(label: &str, text: &str, f: impl FnOnce(&Document<'_>, &DeTable<'_>) -> Result<T>) -> Result<T> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let document = Document { file: label, text };
    let user = DeTable::parse(text).map_err(|e| syntax(&document, &e))?;
    f(&document, user.get_ref())
}

fn of_user(
    document: &Document<'_>,
    user: &DeTable<'_>,
    base: &Path,
    fallback: &str,
    taps: impl for<'a> FnOnce(&Sections<'a>, Drive) -> Result<space::Read<'a>>,
) -> Result<Spec> {
    let beside = built::beside(document, user, base)?;
    let more = sections::more(&[fallback, &beside], user);
    let sections = &Sections::new(document, user, &more)?;
    if let Some(format) = sections.format() {
        let newer = format!("this spec is of a newer format than this program reads, {}", format.allowed());
        let newer = format.error(newer).allowed("format = 1, or a newer version of the program");
        format.whole().map_err(|e| if e.message.contains("large") { newer } else { e })?;
    }
    let drive = space::drive(sections)?;
    let hub = properties::first(&sections.section("whisker").get("hub")?)?;
    let section = sections.section("gauge");
    let mut gauge: Gauge = section.read()?;
    gauge.noise_strain = section.optional("noise_strain", properties::first)?;
    gauge.foil = section.optional("foil", model::foil)?;
    let (model, fit) = model::read(sections, base)?;
    let estimate: Estimate = sections.section("estimate").read()?;
    let section = sections.section("output");
    let tuples = section.optional("tuples", Item::flag)?;
    let output = Output { by_said: section.written("by").is_some(), tuples, ..section.read()? };
    let mut run: RunOptions = sections.section("run").read()?;
    run.out = run.out.map(|out| base.join(out));
    let space::Read { mut space, directions, leaning, properties, rigs } = taps(sections, drive)?;
    model::leaning(&leaning, &model)?;
    let tilts = leaning.iter().any(Option::is_some);
    if !tilts {
        sections::rankable(sections, &estimate, &output)?;
    }
    if estimate.theory == Theory::Exact && estimate.k.is_some() {
        sections.warn(["[estimate] K is not used with theory = \"exact\"".to_owned()]);
    }
    let (signal, channels) = built::sensor(&sections.section("sensor"), &mut gauge)?;
    if channels.is_some() && gauge.noise_strain.take().is_some_and(|noise| noise != 0.0) {
        let message =
            "noise_strain of [gauge] plays no part: several channels have noise or covariance in [sensor]";
        sections.warn([message.to_owned()]);
    }
    let built = built::whisker(sections, base)?;
    curve::to_arcs(sections, &mut space, built.as_ref(), &properties)?;
    let wrench = sections.section("output").get("wrench")?.flag()?;
    let fixed = built::fixed(&sections.section("sensor"), signal, channels.as_deref())?;
    let built = built.map(Arc::new);
    let setup = Setup { hub, drive, gauge, model, estimate, directions, built, ..Setup::default() };
    let setup = Setup { signal, channels, fixed, wrench, rigs, ..setup };
    properties::allowed_together(sections, &setup, &properties, tilts)?;
    let several = properties.iter().filter(|(_, axis)| axis.axis.len() > 1);
    let stem = Path::new(document.file).file_stem();
    let mut spec = Spec {
        name: stem.map_or_else(|| "spec".into(), |stem| stem.to_string_lossy().into_owned()),
        text: document.text.to_owned(),
        study: Study { setup, space, output },
        material_fit: fit,
        run,
        in_force: sections.in_force(),
        inputs: inputs(sections, base),
        warnings: sections.warnings.take(),
        several: several.map(|(_, axis)| axis.item.error("")).collect(),
    };
    model::fits(sections, &spec)?;
    fits::fits(sections, &spec, &properties)?;
    let unusual = usual::of_spec(sections, |name| name != "optimise");
    let doubts = [fits::doubts(&spec), unusual, model::doubts(sections, &spec)];
    spec.warnings.extend(doubts.into_iter().flatten());
    Ok(spec)
}

/// [`parse`] with `[optimise]`, whose variables may be missing from their sections.
pub fn parse_search(label: &str, text: &str, base: &Path) -> Result<(Spec, Search)> {
    parsed(label, text, |document, user| {
        let more = sections::more(&[optimise::SEARCHED], user);
        let sections = &Sections::new(document, user, &more)?;
        let mut search = optimise::read(sections)?;
        let fallback = optimise::fallback(&search);
        let mut spec = of_table(document.file, document.text, user, base, &fallback)?;
        spec.in_force.retain(|(key, _, written)| *written || !optimise::is_variable(&search, key));
        optimise::check(sections, &mut spec, &mut search)?;
        if spec.study.setup.signal != Signal::Strain {
            let limits = sections.section("optimise").written("limits");
            if let Some(strain) = limits.and_then(|limits| limits.child("strain")) {
                let allowed = "force_N, unambiguous, tip_not_wider; or signal = \"strain\" in [sensor]";
                return strain.refuse("this sensor reads no strain, so that none can be limited", allowed);
            }
            search.limits.strain = f64::INFINITY;
        }
        spec.warnings.extend(usual::of_spec(sections, |name| name == "optimise"));
        Ok((spec, search))
    })
}

/// The spec of a command that varies the drive of one whisker, and the ends of its drive; `noisy`: its objective needs the gauge's noise.
pub fn parse_tap(label: &str, text: &str, base: &Path, noisy: bool) -> Result<(Spec, [f64; 2])> {
    parsed(label, text, |document, user| {
        let spec = of_table(document.file, document.text, user, base, optimise::TAP)?;
        spec.one_rig()?;
        let more = sections::more(&[optimise::TAP], user);
        let ends = optimise::check_tap(&Sections::new(document, user, &more)?, &spec, noisy)?;
        Ok((spec, ends))
    })
}

fn inputs(sections: &Sections<'_>, base: &Path) -> Vec<PathBuf> {
    let tuples = sections.section("tuples").written("file");
    let curve = sections.section("model").written("material").and_then(|m| m.need("curve").ok());
    let profile = sections.section("whisker").written("profile");
    let named = [tuples, curve, profile].into_iter().flatten();
    named.filter_map(|item| Some(base.join(item.value.as_str()?))).collect()
}

/// Reads the `text` of another TOML file of users with `f`; `file` names it, and `what` is its key under `[files]` of `keys.toml`.
pub fn described<T>(file: &str, text: &str, what: &str, f: impl FnOnce(&Item<'_>) -> Result<T>) -> Result<T> {
    parsed(file, text, |document, table| {
        let value = DeValue::Table(table.clone());
        let file =
            Item::new(document, String::new(), Some(0..0), &value).of(keys::section("files").key(what));
        file.only_known()?;
        f(&file)
    })
}

/// Name and rows of the CSV file that `item` names, relative to `base`, which must have these columns and may have others.
pub fn columns<const N: usize>(
    item: &Item<'_>,
    base: &Path,
    what: &str,
    names: [&str; N],
    allowed: fn(&str) -> &'static str,
) -> Result<(String, Vec<[f64; N]>)> {
    let (label, text) = table::open(item, base, what, Limit::Whole)?;
    let document = Document { file: &label, text: &text };
    let (rows, _) = table::read(document, table::Columns::all(&names, allowed))?;
    Ok((label, rows.into_iter().map(|(row, _)| row).collect()))
}

/// Text of a file; `what` names its kind.
pub fn load(path: &Path, what: &str) -> Result<String> {
    TextFile::open(path, what, Limit::Whole)?.toml()
}

/// The line of a key with too many parts, whose place the TOML reader does not give.
fn deep_key(text: &str) -> Option<Range<usize>> {
    let deep = |line: &&str| !line.trim_start().starts_with('#') && line.matches('.').count() >= 80;
    let line = text.split('\n').find(deep)?;
    let start = line.as_ptr() as usize - text.as_ptr() as usize;
    Some(start..start + line.len())
}

fn syntax(document: &Document<'_>, error: &toml::de::Error) -> InputError {
    let at = error.span().or_else(|| deep_key(document.text));
    let at = at.unwrap_or(document.text.len()..document.text.len());
    let rest = document.text.get(at.start..).unwrap_or_default();
    let starts_as_number = rest.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    let reason = match error.message().trim() {
        reason if reason.contains("must be quoted") && starts_as_number => {
            "a number must stand without its unit"
        }
        "recursion limit" => "its key has too many parts",
        reason => reason,
    };
    let allowed = "lines such as [whisker], D = 10.0, side = \"contact\", a = [20, 30]; \
                   numbers without unit, words in quotes";
    document.error(Some(at), format!("this line cannot be understood: {reason}")).allowed(allowed)
}
