//! `calibration.toml`: the result of `calibrate`, readable, for `locate`.

use std::{ops::Range, path::Path};

use toml::{Table, de::DeTable};

use crate::error::{Error, InputError};
use crate::estimator::{Estimator, Opener};
use crate::locate::calibration::{Calibration, FORMAT, Second};
use crate::locate::{Locator, opener};
use crate::measure::{Lag, Rig, Unit};
use crate::text_file::{Limit, TextFile};
use crate::{scene::RunOptions, sink::folder::hash};

impl Calibration {
    fn check(&self, label: &str) -> Result<(), InputError> {
        let estimators = Estimator::ALL.map(|e| e.word()).join(", ");
        let signals = "strain, microstrain, bridge_mV_per_V, reading";
        let lag = "|gain| ≤ 0.9, sigma_gain and sigma_tau_s ≥ 0, tau_s > 0";
        let second =
            "a factor other than 0, |misalignment_deg| and |lean_deg| < 90, noise and standard errors ≥ 0";
        let noise = self.noise >= 0.0 && self.noise.is_finite();
        let checked = [
            (Estimator::named(&self.estimator).is_some(), "estimator", "unknown estimator", &*estimators),
            (Unit::of_column(&self.signal).is_some(), "signal", "unknown signal", signals),
            (noise, "noise", "this is no standard deviation", "≥ 0"),
            (self.drive_origin.is_finite(), "drive_origin", "this is no drive", "a finite number"),
            (self.lag.as_ref().is_none_or(Lag::is_sound), "lag", "this is no lag", lag),
            (self.second.as_ref().is_none_or(Second::is_sound), "second", "this is no second gauge", second),
            (matches!(self.sides.len(), 1 | 2), "sides", "one or two sides are needed", "1 … 2"),
        ];
        if let Some((_, key, message, allowed)) = checked.into_iter().find(|c| !c.0) {
            return Err(refused(label, key, message).allowed(allowed));
        }
        self.sides.iter().enumerate().try_for_each(|(i, side)| {
            let fault = |[key, message, allowed]: [&str; 3]| {
                refused(label, &format!("sides[{i}].{key}"), message).allowed(allowed)
            };
            side.check().map_err(fault)
        })
    }

    fn text(&self, checksum: String) -> String {
        toml::to_string(&Self { checksum, ..self.clone() }).expect("plain numbers and words are TOML")
    }

    /// Calibration with the checksum of its file.
    pub fn sealed(self) -> Self {
        Self { checksum: hash(&self.text(String::new())), ..self }
    }

    /// Text of the file, with its checksum.
    pub fn to_text(&self) -> String {
        format!(
            "# Calibration of a whisker, written by vibrissa. Lengths in mm, angles in degrees.\n\
             # `vibrissa locate` refuses it where a value was changed by hand; run `vibrissa calibrate` again instead.\n{}",
            self.text(hash(&self.text(String::new())))
        )
    }

    /// Locator from the file's text, opened as `locate` does.
    /// Errors: a calibration that `locate` refuses; a backend that fails.
    pub fn opened(&self, open: Opener<'_>) -> Result<Locator, Error> {
        const NAME: &str = "calibration.toml";
        let read = Self::parse(NAME, &self.to_text(), false).map_err(Error::from);
        let opened = read.and_then(|read| Locator::new(&read, NAME, None, open));
        opened.map_err(|e| match e {
            Error::Input(e) => {
                let message =
                    format!("the calibration that these data give is one that locate refuses: {}", e.message);
                let allowed = "data without the rows that are named above; rows of another kind are suspects";
                InputError { message, snippet: None, ..e }.at(&self.data.file, None).allowed(allowed).into()
            }
            other => other,
        })
    }

    /// Reads the file at `path`; with `trust` also one that was edited by hand.
    /// Errors: a file that is missing, of another format, edited, or contradictory.
    pub fn read(path: &Path, trust: bool) -> Result<Self, InputError> {
        Self::parse(&path.display().to_string(), &Self::load(path)?, trust)
    }

    /// Text of the file at `path`.
    /// Errors: a missing file, or a folder.
    pub fn load(path: &Path) -> Result<String, InputError> {
        if path.is_dir() {
            let error = InputError::new("this is a folder; the calibration file in it is needed");
            let error = error.at(path.display().to_string(), None);
            return Err(error.allowed(path.join("calibration.toml").display().to_string()));
        }
        TextFile::open(path, "calibration", Limit::Whole)?.toml()
    }

    /// Parses `text` as [`Self::read`] does.
    pub fn parse(label: &str, text: &str, trust: bool) -> Result<Self, InputError> {
        let again = "a calibration.toml as `vibrissa calibrate` wrote it";
        let line =
            |at: usize| 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|b| **b == b'\n').count();
        let broken = |e: &toml::de::Error| {
            let at = e.span().unwrap_or(0..0);
            let error = misfit(text, &at, e.message().lines().next().unwrap_or_default(), again);
            error.at(label, e.span().map(|s| line(s.start)))
        };
        let mut table: Table = toml::from_str(text).map_err(|e| broken(&e))?;
        let none = || refused(label, "format", "this is no calibration: it has no format").allowed(again);
        let format = table.get("format").ok_or_else(none)?;
        if format.as_integer() != Some(i64::from(FORMAT)) {
            let message = "this calibration was written by another version of the program, in a format it does not know; \
                           run `vibrissa calibrate` again";
            let error = refused(label, "format", message).value(format);
            return Err(error.allowed(format!("format = {FORMAT}")));
        }
        if table.contains_key("channels") {
            let message =
                "this calibration is of a sensor with several channels, which only `vibrissa locate` reads";
            return Err(refused(label, "channels", message).allowed("a calibration of one signal"));
        }
        let sides = table.get("sides").and_then(|s| s.as_array()).into_iter().flatten();
        let gone = sides.filter_map(|s| GONE.into_iter().find(|name| s.get(*name).is_some())).next();
        if let Some(name) = gone {
            let message = "this calibration was written by an older program, with estimators that are no more; run `vibrissa calibrate` again \
                           on its data, and learned answers in their place";
            return Err(refused(label, &format!("sides.{name}"), message).allowed(again));
        }
        let mut read: Self = toml::from_str(text).map_err(|e| broken(&e))?;
        table.insert("checksum".to_owned(), "".into());
        if hash(&toml::to_string(&table).unwrap_or_default()) != read.checksum && !trust {
            let message = "this calibration was edited by hand: its checksum does not fit its values";
            let error = refused(label, "checksum", message).value(&read.checksum);
            let allowed = "the file as `vibrissa calibrate` wrote it; or --force to use it as it is";
            return Err(error.allowed(allowed));
        }
        read.check(label)?;
        // The spec is checked again with the places of its values.
        let placed = DeTable::parse(text).map_err(|e| broken(&e))?;
        let spec = placed.get_ref().get("spec").and_then(|s| s.get_ref().as_table());
        let furthest = read.sides.iter().map(|s| s.distances_mm[1]).fold(0.0, f64::max);
        read.rig = Rig::of_table(label, text, spec.expect("a table has been read"), furthest)?;
        Ok(read)
    }
}

fn refused(label: &str, key: &str, message: &str) -> InputError {
    InputError::new(message).at(label, None).key(key)
}

const GONE: [&str; 2] = ["timoshenko", "table"];

/// Error of the TOML reader at bytes `at` of `text`, in the words of this program.
fn misfit(text: &str, at: &Range<usize>, complaint: &str, again: &str) -> InputError {
    let named = complaint.split('`').nth(1).unwrap_or_default();
    let above = text.get(..at.end).unwrap_or(text);
    let header = above.lines().rev().find(|line| line.starts_with('['));
    let header = header.map(|line| line.trim_matches(['[', ']', ' ']));
    let full = |key: &str| header.map_or_else(|| key.to_owned(), |header| format!("{header}.{key}"));
    if complaint.starts_with("missing field") {
        return InputError::new("this is no calibration: a value is missing").key(full(named)).allowed(again);
    }
    if complaint.starts_with("unknown field") {
        let allowed = complaint.split_once("expected ").map_or(again, |(_, all)| all);
        let error = InputError::new("this is no calibration: no calibration has this key");
        return error.key(full(named)).allowed(allowed.trim_start_matches("one of ").replace('`', ""));
    }
    if !complaint.starts_with("invalid") && !complaint.starts_with("expected") || at.is_empty() {
        return InputError::new(format!("this is no calibration: {complaint}")).allowed(again);
    }
    let wanted = complaint.rsplit_once("expected ").map_or("", |(_, wanted)| wanted);
    let allowed = match wanted {
        "f64" => "a number",
        "a boolean" => "true or false",
        "a string" => "a text in quotes",
        _ if wanted.starts_with(['u', 'i']) => "a whole number",
        _ if wanted.contains("array") || wanted.contains("sequence") => "a list of numbers",
        _ => again,
    };
    let start = text[..at.start].rfind('\n').map_or(0, |i| i + 1);
    let key = text[start..].split('=').next().unwrap_or_default().trim();
    let error = InputError::new("this is no calibration: the value is of another kind");
    error.key(full(key)).value(&text[at.clone()]).allowed(allowed)
}

impl Locator {
    /// Opens the calibration file at `path` with the chosen estimator.
    /// Errors: a file that cannot be used; a backend that fails.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let calibration = Calibration::read(path, false)?;
        Self::new(&calibration, &path.display().to_string(), None, &opener(&RunOptions::default()))
    }
}
