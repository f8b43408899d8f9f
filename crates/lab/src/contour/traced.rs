//! A file of readings as points and a curve: its tables, and what is told of them, wherever they go.

use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};

use super::trace::{Trace, TraceOptions};
use super::truth::{self, Edge};
use super::write;
use crate::error::Error;
use crate::estimator::Estimator;
use crate::locate::stream::Ask;
use crate::locate::table::Readings;
use crate::locate::{Calibration, Locator, SaidZero, locator::opener};
use crate::measure::Names;
use crate::measure::skin::PLACES;
use crate::scene::RunOptions;
use crate::sink::folder::hash;
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::lab::LabTable;
use crate::sink::run_json;

/// What is to be traced, and how.
#[derive(Clone, Copy)]
pub struct Question<'a> {
    /// The whisker, and the name of its file.
    pub calibration: (&'a Calibration, &'a str),
    /// The one that won if not said.
    pub estimator: Option<Estimator>,
    /// Readings and poses, and the name of their file.
    pub data: (LabTable<'a>, &'a str),
    /// What the user said of columns, and as it was said.
    pub columns: (&'a Names, Option<&'a str>),
    /// What the sensor shows without contact, if it was said.
    pub zero: Option<&'a SaidZero>,
    /// Noise, contact, taps or strokes, kind of the curve.
    pub asked: TraceOptions,
    /// The object, where it is known, and the name of its file.
    pub truth: Option<(&'a dyn Edge, &'a str)>,
}

/// What was traced.
pub struct Traced {
    /// Points, strokes and curve.
    pub trace: Trace,
    /// Name of the estimator.
    pub estimator: &'static str,
    /// points.csv.
    pub points: Frame,
    /// curve.csv.
    pub curve: Frame,
    /// Places along the known object, mm; none where it is not known.
    pub outline: Vec<[f64; 2]>,
    /// All that the result depends on.
    pub settings: Value,
    /// Rows, points and words.
    pub counts: Value,
    /// The curve, the strokes, distances from the known object.
    pub result: Value,
    /// Name and checksum.
    calibration: [String; 2],
    /// Name and hash.
    data: [String; 2],
}

impl Traced {
    /// Answers `question`; models are solved as `options` say, `warn` is told what should be known, `stop` is set from outside.
    ///
    /// # Errors
    /// Data that do not fit the calibration, or say no poses; a backend that fails; [`SolveError::Stopped`](crate::error::SolveError::Stopped).
    pub fn new(
        question: &Question<'_>,
        options: &RunOptions,
        warn: &dyn Fn(&str),
        stop: &AtomicBool,
    ) -> Result<Self, Error> {
        let Question {
            calibration: (calibration, label), data: (table, file), columns: (columns, said), ..
        } = *question;
        let Question { estimator, zero, asked, truth, .. } = *question;
        let locator = Locator::new(calibration, label, estimator, &opener(options))?;
        calibration.rig.warnings.iter().for_each(|w| warn(w));
        let of_signals = SaidZero::of(zero, [&locator])?;
        let ask = Ask { zero: of_signals, ..Ask::of_file(file, columns, warn) };
        let readings = Readings::of(&locator, table, &ask, heading("points"))?;
        let trace = Trace::new(&locator, &readings, &asked, stop)?;
        if !trace.on_surface && asked.surface.is_none() && locator.rig.known {
            warn(
                "the model of the calibration has contact on the whisker's centreline, and so are the points: on a real whisker they are off the \
                 object by its radius. --contact surface puts them on its side",
            );
        }
        if !trace.points.iter().any(|point| point.is_there()) {
            warn("no row gives a point; the column status of points.csv says why");
        }
        let digest = table.hash()?;
        let estimator = locator.estimator.name();
        let place = |on: bool| PLACES.iter().find(|(_, surface, _)| *surface == on).map(|(word, ..)| *word);
        let settings = json!({
            "data": digest, "calibration": calibration.checksum, "estimator": estimator, "columns": said, "zero": SaidZero::json(zero),
            "angle_noise_deg": asked.noise.angle, "base_noise_mm": asked.noise.base, "touch_noise_deg": asked.noise.touch,
            "contact": asked.surface.and_then(place), "taps": asked.taps,
            "curve": asked.kind.map(|k| k.word()), "truth": truth.map(|(_, file)| file),
        });
        let mut result = write::described(&trace);
        result["estimator"] = estimator.into();
        if let Some((edge, _)) = truth {
            result["truth"] = truth::compared(&trace, &readings, edge)?;
        }
        Ok(Self {
            estimator,
            points: write::points(&trace, &readings)?,
            curve: write::curve(&trace)?,
            outline: truth.map_or_else(Vec::new, |(edge, _)| truth::outline(edge)),
            settings,
            counts: write::counts(&trace, &readings),
            result,
            calibration: [label.to_owned(), calibration.checksum.clone()],
            data: [file.to_owned(), digest],
            trace,
        })
    }

    /// Word of the curve's kind; empty without a curve.
    pub fn kind(&self) -> &'static str {
        self.trace.curve.as_ref().map_or("", |c| c.kind.word())
    }

    /// run.json, of data with this `name`.
    pub fn document(&self, name: &str, seconds: &Value) -> Value {
        let ([label, checksum], [file, digest]) = (&self.calibration, &self.data);
        let identity = hash(&format!("{digest}\n{checksum}\n{}", self.settings));
        let body = json!({
            "calibration": { "file": label, "checksum": checksum },
            "data": { "file": file, "hash": digest },
            "settings": self.settings, "counts": self.counts, "result": self.result, "seconds": seconds,
        });
        run_json::document("contour", json!({ "name": name, "hash": identity }), body)
    }
}
