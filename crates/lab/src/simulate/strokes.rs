//! Synthetic strokes: rows as `contour` reads them, with the true place of each contact beside.

use std::path::PathBuf;

use rayon::prelude::*;

use super::object::Object;
use super::stroke::{Missed, Stroker};
use super::{Counts, PIECE, Recorder, SOURCE, Settings};
use crate::contour::point::Pose;
use crate::error::{Error, InputError};
use crate::measure::Rig;
use crate::reduce::sorted;
use crate::scene::{Axis, Contact as Grip, Drive, Geometry, Signal};
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::values::Field;

pub const FILE: &str = "strokes.csv";

#[derive(Debug, Clone, PartialEq)]
pub struct Strokes {
    pub object: Object,
    /// Where the motor's axis stands, and the heading from which the whisker turns until it touches.
    pub starts: Vec<Pose>,
    /// Standard deviation of the angle at which a touch is noticed, degrees.
    pub touch_noise: f64,
    pub files: Vec<PathBuf>,
}

impl Strokes {
    /// `settings` of the run with what is stroked.
    pub fn described(&self, mut settings: serde_json::Value) -> serde_json::Value {
        settings["object"] = format!("{:?}", self.object).into();
        settings["starts"] = self.starts.len().into();
        settings["touch_noise_deg"] = self.touch_noise.into();
        settings
    }
}

pub fn check(rig: &Rig, settings: &Settings) -> Result<(), InputError> {
    let (setup, model, defaults) = (&rig.setup, &rig.setup.model, Settings::default());
    let of_taps = |key: &'static str, other: bool| {
        (other, key, "this belongs to taps at labelled distances", "nothing, with --object")
    };
    let (moved, linear) = (setup.drive != Drive::Angle, model.geometry != Geometry::Exact);
    let rough = model.contact != Grip::Frictionless;
    let checks = [
        (
            setup.built.is_some() || setup.signal != Signal::Strain,
            "whisker",
            "its whisker is a cone clamped at its base, its signal a strain",
            "D, d, L_a and hub only, read by a gauge",
        ),
        (setup.gauge.second, "gauge.second", "one gauge reads it, at upright edges", "false"),
        (moved, "tap.drive", "the whisker must be turned", "theta (degrees after first touch)"),
        (linear, "model.geometry", "linear theory has no contact that does", "exact"),
        (rough, "model.contact", "with friction it would depend on its path", "frictionless"),
        of_taps("--repeats", settings.repeats != defaults.repeats),
        of_taps("--drift", settings.drift != defaults.drift),
        of_taps("--outliers", settings.outliers != defaults.outliers),
        of_taps("--hysteresis", settings.hysteresis != defaults.hysteresis),
        of_taps("--drive-offset", settings.drive_offset != defaults.drive_offset),
        of_taps("--a-offset", settings.a_offset != defaults.a_offset),
    ];
    let fault = checks.into_iter().find(|check| check.0);
    let Some((_, key, message, allowed)) = fault else { return Ok(()) };
    let error = InputError::new(format!("a stroke slides along an object: {message}"));
    Err(error.key(key).allowed(allowed))
}

/// Simulates a stroke from each start at these drives (degrees after first touch); `miss` gets the number of a start that makes none, and why.
pub fn simulate(
    rig: &Rig,
    strokes: &Strokes,
    drives: &Axis,
    settings: &Settings,
    miss: &mut dyn FnMut(usize, Missed),
    write: &mut dyn FnMut(&Frame) -> Result<(), Error>,
) -> Result<Counts, Error> {
    let degrees = sorted(drives.iter().filter(|d| *d > 0.0));
    let angles: Vec<f64> = degrees.iter().map(|d| d.to_radians()).collect();
    let solve = |start: &Pose| Stroker::new(rig, &strokes.object, start.sense).stroke(*start, &angles);
    let solved: Vec<_> = strokes.starts.par_iter().map(solve).collect();
    let table = heading("strokes").frame(&[settings.unit.column()]);
    let mut recorder = Recorder::new((rig, settings), [false; 2], table, write);
    for (k, solved) in solved.into_iter().enumerate() {
        let (pose, first, contacts) = match solved {
            Ok(found) => found,
            Err(why) => {
                miss(k + 1, why);
                continue;
            }
        };
        // Degrees by which the touch is seen late: heading too large, drive too small.
        let late = strokes.touch_noise * recorder.dice().normal(0)[0];
        recorder.row = recorder.row.wrapping_add(1);
        let heading = pose.heading.to_degrees() + pose.sense * late;
        let before = [(k + 1) as f64, pose.base[0], pose.base[1], heading, pose.sense];
        let row = |table: &mut Frame, rest: [f64; 4], status: &'static str| {
            let numbers = before.iter().chain(&rest).chain(&first).copied().map(Field::Number);
            table.row(numbers.chain([SOURCE.into(), status.into()]))
        };
        for (i, degree) in degrees.iter().enumerate() {
            if recorder.rests() {
                let ([value, _], _) = recorder.record([0.0; 2]);
                recorder.counts.zeros += 1;
                row(&mut recorder.table, [0.0, value, f64::NAN, f64::NAN], "ok")?;
            }
            if *degree <= late {
                continue;
            }
            recorder.counts.taps += 1;
            let contact = contacts.get(i);
            let [value, x, y] = contact.map_or([f64::NAN; 3], |contact| {
                let ([value, _], _) = recorder.record([contact.strain, 0.0]);
                [value, contact.at[0], contact.at[1]]
            });
            recorder.counts.unsolved += u64::from(contact.is_none());
            let status = if contact.is_some() { "ok" } else { "slipped_off" };
            row(&mut recorder.table, [degree - late, value, x, y], status)?;
        }
        recorder.write(PIECE)?;
    }
    if recorder.counts.taps == 0 {
        let error =
            InputError::new("no start leads to a stroke: the whisker misses the object").key("--object");
        return Err(error.allowed("starts from which the whisker's side touches it").into());
    }
    recorder.write(0)?;
    Ok(recorder.counts)
}
