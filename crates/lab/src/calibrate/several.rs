//! Calibration of a sensor with several channels: of each channel, and the covariance of their residuals.

use serde_json::{Value, json};

use super::coverage::Coverage;
use super::{Calibrated, Options, calibrate, report};
use crate::error::{Error, InputError};
use crate::estimator::fit::Fit;
use crate::locate::{self, Located, Sensor, Several, opener};
use crate::measure::{Data, Names, Rig};
use crate::scene::{Drive, Spec};
use crate::sink::{Field, Frame, LabTable};

/// A calibrated sensor.
pub struct Calibration {
    /// The sensor that `locate` reads.
    pub sensor: Sensor,
    /// Calibration of each channel.
    pub each: Vec<Calibrated>,
    /// Data of each channel.
    pub data: Vec<Data>,
    /// Taps with the distance from all channels together.
    pub taps: Vec<Tap>,
}

/// One tap of the data.
pub struct Tap {
    /// Line of the file.
    pub line: usize,
    /// Labelled distance, mm.
    pub a: f64,
    /// Recorded drive.
    pub drive: f64,
    /// Tared and expected signal of each channel.
    pub signals: Vec<[f64; 2]>,
    /// True if every channel is calibrated from it.
    pub used: bool,
    /// Distance from all channels.
    pub located: Located,
}

impl Calibration {
    /// Errors of used taps.
    fn errors(&self) -> Coverage {
        let used = self.taps.iter().filter(|t| t.used && t.located.distance.is_finite());
        let errors = used.map(|t| [t.located.distance - t.a, t.located.sigma]);
        Coverage::new("", f64::NAN, &errors.collect::<Vec<_>>())
    }

    /// Errors of each channel and of all together, as text.
    pub fn text(&self) -> String {
        let Coverage { rms_mm: rms, within_1: within, n, .. } = self.errors();
        let channel = |(k, (name, c)): (usize, &(String, locate::Calibration))| {
            let used = self.each[k].sides[0].used;
            let held = self.held_out(k).map_or("unknown".to_owned(), |rms| format!("{rms:.3} mm"));
            let fitted: String =
                self.fits(k, report::fitted).concat().iter().map(|p| format!("  {p}\n")).collect();
            format!(
                "{name}: {used} taps, noise {:.3e}; alone it tells left-out distances to {held}\n{fitted}",
                c.noise
            )
        };
        let channels: String = self.sensor.channels.iter().enumerate().map(channel).collect();
        format!(
            "{channels}all channels together tell {n} calibrated taps to {rms:.3} mm (root mean square); {:.0} % lie within one sigma\n",
            100.0 * within
        )
    }

    /// Errors of each channel and of all together, as JSON.
    pub fn result(&self) -> Value {
        let Coverage { rms_mm: rms, within_1: within, n, .. } = self.errors();
        let channel = |(k, (name, c)): (usize, &(String, locate::Calibration))| {
            json!({ "name": name, "signal": c.signal, "parameters": self.fits(k, report::parameters), "estimator": c.estimator, "used": self.each[k].sides[0].used, "noise": c.noise,
                    "held_out_rms_mm": self.held_out(k) })
        };
        let channels: Vec<Value> = self.sensor.channels.iter().enumerate().map(channel).collect();
        json!({ "channels": channels, "covariance": self.sensor.covariance, "rms_mm": rms, "within_sigma": within, "taps": n,
                "warnings": self.warnings() })
    }

    /// Counts of rows.
    pub fn counts(&self) -> Value {
        let used = self.taps.iter().filter(|t| t.used).count();
        json!({ "rows": self.data[0].rows.len(), "taps": self.taps.len(), "used": used })
    }

    /// Warnings of each channel.
    pub fn warnings(&self) -> Vec<String> {
        let here = |text: &str| text.replace("rows.csv says why", "channels.csv marks them");
        let of = |(c, (name, _)): (&Calibrated, &(String, locate::Calibration))| {
            c.warnings.iter().map(|text| format!("{name}: {}", here(text))).collect::<Vec<_>>()
        };
        self.each.iter().zip(&self.sensor.channels).flat_map(of).collect()
    }

    fn fits<T>(&self, k: usize, say: fn(&Fit, Drive, f64) -> T) -> Vec<T> {
        let Calibrated { calibration: c, sides, .. } = &self.each[k];
        let fits = sides.iter().filter_map(|side| side.fit.as_ref());
        fits.map(|fit| say(fit, c.rig.setup.drive, c.zero.unread())).collect()
    }

    fn held_out(&self, k: usize) -> Option<f64> {
        self.each[k].sides[0].rms(self.each[k].winner).0
    }

    /// Table of the taps: labels, signals, expected signals, distance from all channels.
    pub fn table(&self) -> Result<Frame, Error> {
        let drive = self.each[0].calibration.rig.setup.drive.column();
        let of_channel = |(name, _): &(String, _)| [name.clone(), format!("{name}_expected")];
        let mut names = ["line", "a_mm", drive].map(str::to_owned).to_vec();
        names.extend(self.sensor.channels.iter().flat_map(of_channel));
        names.extend(["distance_mm", "sigma_mm", "error_mm", "status", "use"].map(str::to_owned));
        let mut table = Frame::of("channels.csv", names);
        for tap in &self.taps {
            let mut row: Vec<Field> = vec![tap.line.into()];
            let Located { distance, sigma, status, .. } = tap.located;
            let numbers = [tap.a, tap.drive].into_iter().chain(tap.signals.iter().flatten().copied());
            row.extend(numbers.chain([distance, sigma, distance - tap.a]).map(Field::Number));
            let word = if tap.used { "used" } else { "suspect" };
            table.row(row.into_iter().chain([status.into(), word.into()]))?;
        }
        Ok(table)
    }
}

/// Whisker from `read` for the drive of the `table`, else `said`, if its sensor has several channels. Errors of other whiskers are reported later.
/// Errors: As [`Data::parse_named`] and `read`.
pub fn whisker(
    read: impl Fn(Option<Drive>) -> Result<(Rig, Spec), InputError>,
    (label, table, names): (&str, LabTable<'_>, &Names),
    said: Option<Drive>,
) -> Result<Option<(Rig, Spec)>, InputError> {
    let Some((rig, _)) = read(said).ok().filter(|(rig, _)| rig.setup.channels.is_some()) else {
        return Ok(None);
    };
    let first = Data::parse_named(label, table, &names.of_channel(rig.of_channel(0, 1.0)?.1))?;
    read(first.drive.or(said)).map(Some)
}

/// Calibrates each channel of `rig` from the `table` called `label` with the columns `names`.
/// Errors: As [`calibrate`]; a channel without a column.
pub fn several(
    (label, table, names): (&str, LabTable<'_>, &Names),
    rig: &Rig,
    options: &Options,
) -> Result<Calibration, Error> {
    let channels = rig.setup.channels.as_ref().expect("asked of a sensor with several");
    let (mut each, mut data, mut found) = (Vec::new(), Vec::new(), Vec::new());
    for (k, name) in channels.measured().into_iter().enumerate() {
        // A channel that combines readings is calibrated without a whisker.
        let probe = rig.of_channel(k, 1.0)?.1;
        let read = Data::parse_named(label, table, &names.of_channel(probe))?;
        let (one, _) = rig.of_channel(k, read.furthest()?)?;
        let fit: Vec<_> = options.fit.iter().copied().filter(|_| one.known).collect();
        let named = |e: Error| match e {
            Error::Input(e) => InputError { message: format!("channel {name}: {}", e.message), ..e }.into(),
            other => other,
        };
        let of = calibrate(&read, &one, &Options { fit, ..options.clone() }).map_err(named)?;
        found.push((name.to_owned(), of.calibration.clone().sealed()));
        each.push(of);
        data.push(read);
    }
    let n = found.len();
    let identity = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let mut sensor = Sensor { channels: found, covariance: identity };
    let open = opener(&options.run);
    let of_each = Several::new(&sensor, label, &open)?;
    let mut taps = rows(&each, &data, &of_each);
    sensor.covariance = covariance(&taps, &each);
    let together = Several::new(&sensor, label, &open)?;
    for tap in &mut taps {
        let signals: Vec<f64> = tap.signals.iter().map(|s| s[0]).collect();
        let drive = if each[0].calibration.drive_recorded { tap.drive } else { 1.0 };
        tap.located = together.locate(drive, &signals, &vec![0.0; n]).unwrap_or_else(Located::nothing);
    }
    Ok(Calibration { sensor, each, data, taps })
}

fn rows(each: &[Calibrated], data: &[Data], of: &Several) -> Vec<Tap> {
    let mut all = Vec::new();
    for first in &each[0].taps {
        let of_channel = |c: &'_ Calibrated| c.taps.binary_search_by_key(&first.place, |t| t.place).ok();
        let Some(places) = each.iter().map(of_channel).collect::<Option<Vec<_>>>() else { continue };
        let taps = places.into_iter().zip(each).map(|(k, c)| &c.taps[k]);
        let drive = first.recorded(&data[0]);
        let signal = |(t, locator): (&crate::estimator::taps::Tap, &crate::locate::Locator)| {
            [t.signal, locator.expected(t.a, drive, t.signal.signum())]
        };
        let (line, a, used) = (first.line, first.a, taps.clone().all(|t| t.reason.is_none()));
        let signals = taps.zip(&of.locators).map(signal).collect();
        let located = Located::nothing(crate::status::Status::OK);
        all.push(Tap { line, a, drive, signals, used, located });
    }
    all
}

/// Covariance of the residuals; each variance is at least the noise of its channel.
fn covariance(taps: &[Tap], each: &[Calibrated]) -> Vec<Vec<f64>> {
    let n = each.len();
    let rest = |t: &Tap| t.signals.iter().map(|[y, e]| y - e).collect::<Vec<f64>>();
    let used: Vec<Vec<f64>> =
        taps.iter().filter(|t| t.used).map(rest).filter(|r| r.iter().all(|x| x.is_finite())).collect();
    let count = (used.len() as f64).max(1.0);
    let of = |i: usize, j: usize| used.iter().map(|r| r[i] * r[j]).sum::<f64>() / count;
    let size = |k: usize| of(k, k).sqrt();
    let wanted = |k: usize| size(k).max(each[k].calibration.noise).max(f64::MIN_POSITIVE);
    let correlation = |i: usize, j: usize| {
        let r = of(i, j) / (size(i) * size(j));
        if i == j || !r.is_finite() { f64::from(u8::from(i == j)) } else { r.clamp(-0.999, 0.999) }
    };
    (0..n).map(|i| (0..n).map(|j| correlation(i, j) * wanted(i) * wanted(j)).collect()).collect()
}
