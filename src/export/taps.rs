//! Several taps of one object, by drives that are known when the file is written: what they tell together.

use super::c::Real;
use super::python::{list, rows};
use super::text::{digits, number};
use super::{Export, Form};
use crate::error::InputError;
use crate::locate::object::limit;
use vibrissa_learned::joint::{Combined, FREE, NEAR, NONE, SECOND, WINDOW};

const HEAD: &str = include_str!("template/taps_head.c");
const C: &str = include_str!("template/taps.c");
const PYTHON: &str = include_str!("template/taps.py");

/// Numbers of taps that are told together.
const COUNTS: [usize; 2] = [2, 12];
/// Digits of what covariances are made of.
const DIGITS: usize = 10;

/// Taps that are told together.
pub(super) struct Taps {
    drives: Vec<f64>,
    /// Of each side that was learned.
    sides: Vec<Combined>,
}

impl Export<'_> {
    /// With what answers taps of one object by `drives`, in this order, together.
    ///
    /// # Errors
    /// Too few or too many; drives that were not calibrated, or not recorded; sides that were not learned.
    pub fn with_taps(self, drives: &[f64]) -> Result<Self, InputError> {
        let error = |message: &str, value: String, allowed: String| {
            Err(InputError::new(message).key("--taps").value(value).allowed(allowed))
        };
        let [least, most] = COUNTS;
        let said = || drives.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        if !(least..=most).contains(&drives.len()) {
            return error("so many taps are not told together", said(), format!("{least} to {most} drives"));
        }
        if !self.locator.drive_recorded {
            let allowed = "a calibration whose drives were recorded".to_owned();
            return error("drives were not recorded, so that taps by several are not known", said(), allowed);
        }
        let mut sides = Vec::new();
        for side in &self.sides {
            let Form::Learned { .. } = side.form else { continue };
            let origin = self.locator.drive_origin;
            if let Some(drive) = drives.iter().find(|u| !side.of.admits(*u - origin)) {
                let [first, last] = [side.of.drives[0], side.of.drives[side.of.drives.len() - 1]];
                let allowed = format!("{} ... {}", first + origin, last + origin);
                return error("this drive was not calibrated", drive.to_string(), allowed);
            }
            let learned = side.of.answers.shape().learned();
            let own: Vec<f64> = drives.iter().map(|u| u - origin).collect();
            match learned.and_then(|l| l.joint(l.plain_is_tared()).combined(&own)) {
                Some(combined) => sides.push(combined),
                None => return error("these taps have no covariance", said(), "other drives".to_owned()),
            }
        }
        if sides.is_empty() {
            let allowed = "--estimator learned".to_owned();
            return error("only learned tells several taps of one object together", said(), allowed);
        }
        Ok(Self { taps: Some(Taps { drives: drives.to_vec(), sides }), ..self })
    }
}

impl Taps {
    fn drives(&self) -> String {
        self.drives.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
    }

    /// What the file in C declares.
    pub(super) fn c_head(&self) -> String {
        HEAD.replace("@TAPS", &self.drives.len().to_string()).replace("@DRIVES", &self.drives())
    }

    /// Its tables and functions of one number type, its roots with the first.
    pub(super) fn c(&self, real: Real) -> String {
        let n = |x: f64| real.number(x);
        let signals = self.sides.iter().flat_map(|s| s.signals.iter().flatten()).map(|x| digits(*x, 14));
        let tables = [
            ("together_drives", real.list(self.drives.iter().copied())),
            ("together_heights", real.list(self.sides.iter().flat_map(|s| s.heights.iter().copied()))),
            ("together_signals", real.list(signals)),
        ];
        let mut out = String::from("\n");
        if !real.is_float() {
            let roots = self.sides.iter().flat_map(|s| s.roots.iter().flatten()).copied();
            let roots = super::c::REALS[1].list(roots);
            out += &format!("static const float together_roots[] = {{\n{roots}\n}};\n\n");
        }
        for (name, rows) in tables {
            out += &format!("static const REAL {name}_F[] = {{\n{rows}\n}};\n\n");
        }
        let taps = self.drives.len();
        out += &C
            .replace("@ROOT_TAU", &n(std::f64::consts::TAU.sqrt()))
            .replace("@ROOT", &(taps * (taps + 1) / 2).to_string())
            .replace("@TAPS", &taps.to_string())
            .replace("@NEAR", &NEAR.to_string())
            .replace("@NONE", &n(NONE))
            .replace("@SECOND", &n(SECOND))
            .replace("@WINDOW", &n(WINDOW))
            .replace("@FREE", &n(FREE))
            .replace("@APART", &n(limit(taps)));
        out
    }

    /// What the table of the `k`-th learned side holds in Python.
    pub(super) fn python_table(&self, k: usize) -> String {
        let side = &self.sides[k];
        let counted = |all: &[Vec<f64>], n: usize| {
            rows(&all.iter().map(|row| row.iter().map(|x| digits(*x, n)).collect()).collect::<Vec<_>>())
        };
        format!(
            "        # Of several taps over ln a: signals, ln of the posterior in their middle, the inverse of the root of their covariance.\n        \
             \"together\": (\n            {},\n            {},\n            {},\n        ),\n",
            counted(&side.signals, 14),
            list(&side.heights),
            counted(&side.roots, DIGITS),
        )
    }

    /// Its functions in Python.
    pub(super) fn python(&self) -> String {
        PYTHON
            .replace("@ROOT_TAU", &number(std::f64::consts::TAU.sqrt()))
            .replace("@DRIVES", &list(&self.drives))
            .replace("@NEAR", &NEAR.to_string())
            .replace("@NONE", &number(NONE))
            .replace("@SECOND", &number(SECOND))
            .replace("@WINDOW", &number(WINDOW))
            .replace("@FREE", &number(FREE))
            .replace("@APART", &number(limit(self.drives.len())))
    }
}
