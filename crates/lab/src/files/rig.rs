//! Rig in TOML: a spec of one whisker, or the `[spec]` of a calibration.

use std::path::Path;

use toml::{Table, Value, de::DeTable};

use super::Mount;
use crate::error::{Checked, InputError, Result};
use crate::locate::{Calibration, Locator, opener};
use crate::scene::built::{Built, Inner, Profile, Root};
use crate::scene::{Amount, Contact, Drive, Material, RunOptions, Setup, Signal, Spec, TERMS};
use crate::{contour::array::Mounted, design::MOST, estimator::Estimator, measure::Rig, spec};

impl Rig {
    /// Reads the whisker of the spec at `path`; `drive` serves a spec without a drive. `[tap]` is optional.
    pub fn read(path: &Path, drive: Option<Drive>) -> Result<Self, InputError> {
        let (label, base) = (path.display().to_string(), path.parent().unwrap_or(Path::new("")));
        Ok(Self::parse_with(&label, &spec::load(path, "spec")?, base, drive)?.0)
    }

    /// Rig and spec from `text` of the file `label`; relative paths start at `base`.
    pub fn parse_with(label: &str, text: &str, base: &Path, drive: Option<Drive>) -> Checked<(Self, Spec)> {
        // Its own drive takes precedence over that of the data.
        let table: Table = text.parse().unwrap_or_default();
        let said = table.get("tap").and_then(|t| t.get("drive")).and_then(Value::as_str);
        let displaced = said.map_or(drive == Some(Drive::Displacement), |word| word == "displacement");
        let drive = if displaced { Drive::Displacement } else { Drive::Angle };
        let spec = spec::parse_with(label, text, base, fallback(drive))?;
        let asked = spec.in_force.iter().any(|(key, value, _)| key == "tap.abscissa" && value == "true");
        if asked && spec.study.setup.is_curved() {
            let message = "a_mm of measurements is the arc of the contact, also of a curved whisker";
            let error = InputError::new(message).key("tap.abscissa").value(true).allowed(
                "abscissa = false, with arcs in the data (a sweep with abscissa = true writes both: a_mm and x_a_mm)",
            );
            return Err(spec::placed(label, &spec.text, error));
        }
        Ok((Self::of_spec(&spec, label)?, spec))
    }

    /// Values in force as a spec of tables that [`Self::of_table`] reads back, without files.
    pub fn to_table(&self) -> Table {
        let (s, t, m) = (&self.setup, &self.design.tuple, &self.setup.model);
        let word = |w: &str| Value::from(w);
        let table = |entries: Vec<(&str, Value)>| Value::Table(named(entries));
        let list = |v: &[f64]| Value::Array(v.iter().map(|x| Value::from(*x)).collect());
        let material = match &m.material {
            Material::Hooke(e) => ("hooke", Value::from(*e)),
            Material::NeoHookean(e) => ("neo-hookean", Value::from(*e)),
            Material::MooneyRivlin(c) => ("mooney-rivlin", list(c)),
            Material::Yeoh(c) => ("yeoh", list(c)),
        };
        let contact = match m.contact {
            Contact::Frictionless => word("frictionless"),
            Contact::Stick => word("stick"),
            Contact::Coulomb(mu) => table(vec![("coulomb", mu.into())]),
        };
        let strains = s.signal == Signal::Strain;
        let places = [("x_ss", t.x_ss.into()), ("l", t.l.into())];
        let mut gauge: Vec<(&str, Value)> = places.into_iter().filter(|_| strains).collect();
        gauge.push(("side", word(s.gauge.side.word())));
        let limit = s.gauge.strain_limit;
        gauge.extend(limit.is_finite().then(|| ("strain_limit", limit.into())));
        gauge.push(("factor", s.gauge.factor.into()));
        gauge.extend(s.gauge.second.then_some(("second", true.into())));
        gauge.extend(s.gauge.foil.map(|foil| {
            let numbers = [("stiffness", foil.stiffness), ("length", foil.length), ("width", foil.width)];
            let limit = foil.strain_limit.map(|limit| ("strain_limit", limit));
            ("foil", table(numbers.into_iter().chain(limit).map(|(key, x)| (key, x.into())).collect()))
        }));
        gauge.extend(s.gauge.noise_strain.filter(|_| strains).map(|n| ("noise_strain", n.into())));
        let words = [("theory", s.estimate.theory.word()), ("convention", s.estimate.convention.word())];
        let mut estimate = words.map(|(key, of)| (key, word(of))).to_vec();
        estimate.extend(s.estimate.range.map(|r| ("range", list(&r))));
        let drive = word(s.drive.word());
        if !self.known {
            let gauge = ["strain_limit", "factor"];
            let gauge = gauge.into_iter().zip([s.gauge.strain_limit.into(), s.gauge.factor.into()]).collect();
            return named([("gauge", table(gauge)), ("tap", table(vec![("drive", drive)]))]);
        }
        let sized = [("D", t.D), ("d", t.d), ("L_a", t.L_a)].map(|(key, x)| (key, x.into()));
        let tabled = s.built.as_ref().is_some_and(|built| matches!(built.profile, Profile::Table(_)));
        let mut whisker = if tabled { Vec::new() } else { sized.to_vec() };
        whisker.push(("hub", s.hub.into()));
        whisker.extend(s.built.iter().flat_map(|built| beyond(built)));
        let terms = TERMS.iter().map(|term| match (term.get)(m) {
            Amount::Flag(on) => (term.key, on.into()),
            Amount::Number(x) => (term.key, x.into()),
            Amount::Word(of) => (term.key, word(of)),
        });
        let rest = [("nu", m.nu.into()), ("contact", contact), ("material", table(vec![material]))];
        let model = [("geometry", word(m.geometry.word()))].into_iter().chain(terms).chain(rest).collect();
        let (tap, of) = (vec![("drive", drive)], ["whisker", "gauge", "tap", "model", "estimate"]);
        let entries = of.into_iter().zip([whisker, gauge, tap, model, estimate].map(table));
        let sensor = (s.signal != Signal::Strain).then(|| {
            let noise = s.gauge.noise_strain.map(|n| ("noise", n.into()));
            let fixed = s.fixed.then(|| ("fixed", true.into()));
            let signal = [("signal", word(s.signal.word()))].into_iter();
            ("sensor", table(signal.chain(noise).chain(fixed).collect()))
        });
        named(entries.into_iter().chain(sensor))
    }

    /// Whisker of the spec in `table` of the `text` of file `label`, as written by [`Self::to_table`]. Without a whisker: an unknown one that
    /// taps up to `furthest` mm.
    /// Errors: an invalid spec, with the place in `text`.
    pub fn of_table(label: &str, text: &str, table: &DeTable<'_>, furthest: f64) -> Result<Self, InputError> {
        let drive = table.get("tap").and_then(|t| t.get_ref().get("drive")?.get_ref().as_str());
        let drive = if drive == Some("displacement") { Drive::Displacement } else { Drive::Angle };
        if table.get("whisker").is_none() {
            let gauge = |key: &str| {
                table.get("gauge")?.get_ref().get(key)?.get_ref().as_float()?.as_str().parse().ok()
            };
            let mut setup = Setup { drive, ..Setup::default() };
            setup.gauge.factor = gauge("factor").unwrap_or(setup.gauge.factor);
            setup.gauge.strain_limit = gauge("strain_limit").unwrap_or(setup.gauge.strain_limit);
            return Self::unknown(setup, furthest);
        }
        let spec = spec::of_table(label, text, table, Path::new(""), fallback(drive))?;
        Self::of_spec(&spec, label)
    }
}

/// Values for the keys of `[tap]` that a rig does not need, valid for every whisker.
fn fallback(drive: Drive) -> &'static str {
    match drive {
        Drive::Angle => "[tap]\na = 1e-6\ntheta = 1\n",
        Drive::Displacement => "[tap]\ndrive = \"displacement\"\na = 1e-6\ndelta = 1\n",
    }
}

fn named<'k>(entries: impl IntoIterator<Item = (&'k str, Value)>) -> Table {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// Keys of `[whisker]` beyond D, d, L_a and hub.
fn beyond(built: &Built) -> Vec<(&'static str, Value)> {
    let pairs = |all: &[[f64; 2]]| {
        Value::Array(all.iter().map(|pair| Value::Array(pair.map(Value::from).to_vec())).collect())
    };
    let mut all = Vec::new();
    match &built.profile {
        Profile::Power(n) if *n == 1.0 => {}
        Profile::Power(n) => all.push(("exponent", (*n).into())),
        Profile::Table(table) => all.push(("profile", pairs(table))),
    }
    if let Some(Inner { modulus, diameter }) = &built.inner {
        let diameter = match diameter[..] {
            [[_, first], [end, last]] if first == last && end == MOST => first.into(),
            _ => pairs(diameter),
        };
        all.push(match *modulus == 0.0 {
            true => ("bore", diameter),
            false => {
                let core = [("diameter", diameter), ("modulus", (*modulus).into())];
                ("core", Value::Table(named(core)))
            }
        });
    }
    let bends = ["curvature", "curvature_slope"].into_iter().zip(built.curvature);
    all.extend(bends.filter(|(_, x)| *x != 0.0).map(|(key, x)| (key, x.into())));
    let Root { k_theta, k_y, k_x } = built.root;
    let springs = [("k_theta", k_theta), ("k_y", k_y), ("k_x", k_x)];
    let springs = springs.into_iter().filter(|(_, k)| k.is_finite());
    let springs = named(springs.map(|(key, k)| (key, k.into())));
    if !springs.is_empty() {
        all.push(("root", Value::Table(springs)));
    }
    all
}

impl Mount {
    /// Opens the whisker by its `calibration`, with the chosen estimator unless one is `asked` for.
    /// Errors: an estimator that is not in the calibration; a backend that fails.
    pub fn open(&self, c: &Calibration, asked: Option<Estimator>, options: &RunOptions) -> Result<Mounted> {
        let label = self.calibration.display().to_string();
        let locator = Locator::new(c, &label, asked, &opener(options))?;
        Ok(Mounted { name: self.name.clone(), locator, pose: self.pose })
    }
}
