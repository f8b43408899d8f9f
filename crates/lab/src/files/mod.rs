//! TOML files besides the [`spec`](crate::spec): rigs, calibrations, arrays, strokes, values in force of a run; here `calibration.toml` of a sensor with
//! several channels: calibrations of the channels as text, and the covariance of their noise.

mod calibration;
mod rig;
mod strokes;

pub use strokes::{Array, Mount};

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, InputError};
use crate::locate::{Calibration, Sensor, calibration::FORMAT};
use crate::scene::{BackendChoice, Precision, RunOptions, Spec};
use crate::{backend::Backend, estimator::Opener, sink::folder::hash};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    format: u32,
    checksum: String,
    covariance: Vec<Vec<f64>>,
    channels: Vec<Channel>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Channel {
    name: String,
    calibration: String,
}

impl Sensor {
    /// True if `text` has several channels.
    pub fn is_text(text: &str) -> bool {
        text.parse::<toml::Table>().is_ok_and(|t| t.contains_key("channels"))
    }

    /// Text of the file.
    pub fn to_text(&self) -> String {
        let channel =
            |(name, c): &(String, Calibration)| Channel { name: name.clone(), calibration: c.to_text() };
        let channels = self.channels.iter().map(channel).collect();
        let checksum = self.sum();
        let written = Written { format: FORMAT, checksum, covariance: self.covariance.clone(), channels };
        format!(
            "# Calibration of a sensor with several channels, written by vibrissa: of each the calibration, and the covariance of their noise.\n{}",
            toml::to_string(&written).expect("plain numbers and words are TOML")
        )
    }

    /// Refuses a calibration that `locate` would not open.
    pub fn check(&self, open: Opener<'_>) -> Result<(), Error> {
        self.channels.iter().try_for_each(|(_, calibration)| calibration.opened(open).map(drop))?;
        Ok(Self::parse("calibration.toml", &self.to_text(), false).map(drop)?)
    }

    fn sum(&self) -> String {
        let calibrations = self.channels.iter().map(|(name, c)| format!("{name} {}", c.checksum));
        hash(&format!("{:?} {:?}", self.covariance, calibrations.collect::<Vec<_>>()))
    }

    /// Parses `text` of the file `label`; with `trust` also calibrations that were edited by hand.
    /// Errors: a text that is not such a file; errors of its calibrations.
    pub fn parse(label: &str, text: &str, trust: bool) -> Result<Self, InputError> {
        let again = "a calibration.toml as `vibrissa calibrate` wrote it";
        let broken = |message: &str| InputError::new(message).at(label, None).allowed(again);
        let written: Written = toml::from_str(text)
            .map_err(|e| broken(&format!("this is no calibration of several channels: {}", e.message())))?;
        let n = written.channels.len();
        let square = written.covariance.len() == n && written.covariance.iter().all(|row| row.len() == n);
        if written.format != FORMAT {
            let error = broken("this calibration is of another format; run `vibrissa calibrate` again");
            return Err(error.key("format").value(written.format).allowed(format!("format = {FORMAT}")));
        }
        if n < 2 || !square || !written.covariance.iter().flatten().all(|x| x.is_finite()) {
            return Err(broken("the covariance is no number for each pair of channels").key("covariance"));
        }
        let channel = |c: Channel| {
            let of = format!("{label}, channel {}", c.name);
            Ok((c.name, Calibration::parse(&of, &c.calibration, trust)?))
        };
        let channels = written.channels.into_iter().map(channel).collect::<Result<_, InputError>>()?;
        let sensor = Self { channels, covariance: written.covariance };
        if sensor.sum() != written.checksum && !trust {
            let error = broken("this calibration was edited by hand: its checksum does not fit its values");
            return Err(error.key("checksum").value(written.checksum));
        }
        let n = sensor.channels.len();
        if nalgebra::DMatrix::from_fn(n, n, |i, j| sensor.covariance[i][j]).cholesky().is_none() {
            let error = broken("this is the covariance of no noise: it is not positive definite");
            return Err(error.key("covariance"));
        }
        Ok(sensor)
    }
}

/// Writes the `[run]` values in force into `spec`: those of `options`, else of `backend`. Only a value typed as it stands counts as written.
pub fn settle(spec: &mut Spec, options: &RunOptions, backend: &Backend, out: &Path) {
    let text = |s: &str| toml::Value::from(s).to_string();
    let typed = |choice: Option<BackendChoice>| choice.is_some_and(|c| c != BackendChoice::Auto);
    let precision = options.precision.map(|p| if p == Precision::F32 { "f32" } else { "f64" });
    let flag = |f: Option<bool>| Some((f.unwrap_or(false).to_string(), f.is_some()));
    let run = [
        ("out", Some((text(&out.display().to_string()), options.out.is_some()))),
        ("force", flag(options.force)),
        ("backend", Some((text(backend.name), typed(options.backend)))),
        ("adapter", backend.adapter.as_deref().map(|a| (text(a), options.adapter.is_some()))),
        ("precision", Some((text(backend.precision), precision == Some(backend.precision)))),
        ("tolerance", backend.tolerance.map(|t| (format!("{t:?}"), options.tolerance.is_some()))),
        ("threads", Some((backend.threads.to_string(), options.threads == Some(backend.threads)))),
        ("plan", flag(options.plan)),
        ("quiet", flag(options.quiet)),
        ("json", flag(options.json)),
    ];
    spec.in_force.retain(|(key, ..)| !key.starts_with("run."));
    let entries = run.into_iter().filter_map(|(key, entry)| Some((key, entry?)));
    spec.in_force.extend(entries.map(|(key, (value, written))| (format!("run.{key}"), value, written)));
}
