//! `vibrissa.contour`.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use serde_json::json;
use vibrissa::contour::curve::Kind;
use vibrissa::contour::point::Noise;
use vibrissa::contour::trace::TraceOptions;
use vibrissa::contour::traced::{Question, Traced};
use vibrissa::contour::truth::Edge;
use vibrissa::error::{Error, InputError};
use vibrissa::locate::{Calibration, SaidZero};
use vibrissa::measure::Names;
use vibrissa::measure::skin::PLACES;
use vibrissa::scene::RunOptions;
use vibrissa::simulate::strokes::Strokes;
use vibrissa::sink::columns::{Columns, Values};

use super::error::keywords;
use super::job;
use super::locate::estimator;
use super::search::{Tables, named};
use super::spec::KEYWORDS;
use super::table::Table;
use super::words::meant;

/// What a user says of a contour beside data and calibration.
#[derive(FromPyObject)]
pub struct Said {
    estimator: Option<String>,
    angle_noise: f64,
    base_noise: f64,
    touch_noise: Option<f64>,
    contact: Option<String>,
    taps: bool,
    curve: Option<String>,
    /// The path of a file, or its text.
    truth: Option<(Option<PathBuf>, String)>,
    zero: Option<Vec<f64>>,
    columns: Option<String>,
    trust: bool,
    threads: Option<usize>,
}

/// What stands beside a word that was said in `words`.
fn beside<T: Copy>(
    key: &str,
    said: Option<&str>,
    words: &[(&str, T, &str)],
) -> Result<Option<T>, InputError> {
    let meant = |said| meant(("word", key), said, words.iter().map(|(word, value, _)| (*word, *value)));
    said.map(meant).transpose()
}

/// What a sensor shows without contact, as numbers.
///
/// # Errors
/// Numbers that are none of it.
pub fn zero(said: Option<Vec<f64>>) -> Result<Option<SaidZero>, InputError> {
    let Some(values) = said else { return Ok(None) };
    let value = values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let wrong = || InputError::new("this is no zero of such a signal").key("zero").value(value);
    let zero = SaidZero::new(values);
    zero.map(Some).ok_or_else(|| wrong().allowed("a number, or one for each of two signals"))
}

/// What is told while work goes on, with keywords in place of flags.
#[derive(Default)]
pub struct Told(Mutex<Vec<String>>);

impl Told {
    /// One more.
    pub fn push(&self, text: &str) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(keywords(text));
    }

    /// All of it, in its order.
    pub fn into_texts(self) -> Vec<String> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Traces `data`, the bytes of a CSV file that `label` names, by a calibration, its name and text: points, curve, the outline of a known
/// object; run.json; what should be known.
#[pyfunction]
pub fn contour(
    py: Python<'_>,
    label: String,
    data: Vec<u8>,
    calibration: (String, String),
    said: Said,
) -> PyResult<(Tables, String, Vec<String>)> {
    let threads = said.threads;
    job::whole(py, threads, None, move |stop, _| {
        let start = std::time::Instant::now();
        let asked = TraceOptions {
            noise: Noise::said(said.angle_noise, said.base_noise, said.touch_noise)?,
            surface: beside("contact", said.contact.as_deref(), &PLACES)?,
            taps: said.taps,
            kind: beside("curve", said.curve.as_deref(), &Kind::WORDS)?,
        };
        let columns = said.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
        let truth = said.truth.map(|(path, text)| {
            let label = format!("truth.{KEYWORDS}");
            let read = match &path {
                Some(path) => Strokes::read(path),
                None => Strokes::parse(&label, &text, Path::new("")),
            };
            let strokes = read.map_err(|e| InputError { key: e.key.or(Some("truth".into())), ..e })?;
            Ok::<_, Error>((strokes.object, path.map_or(label, |path| path.display().to_string())))
        });
        let truth = truth.transpose()?;
        let (name, text) = &calibration;
        let zero = zero(said.zero)?;
        let question = Question {
            calibration: (&Calibration::parse(name, text, said.trust)?, name),
            estimator: estimator(said.estimator)?,
            data: (&data, &label),
            columns: (&columns, said.columns.as_deref()),
            zero: zero.as_ref(),
            asked,
            truth: truth.as_ref().map(|(object, path)| (object as &dyn Edge, path.as_str())),
        };
        let told = Told::default();
        let traced = Traced::new(&question, &RunOptions::default(), &|text| told.push(text), stop)?;
        let mut tables =
            named(&[("points.csv", traced.points.clone()), ("curve.csv", traced.curve.clone())])?;
        if truth.is_some() {
            let axis = |k: usize| Values::Numbers(traced.outline.iter().map(|place| place[k]).collect());
            tables.push(("outline", Table::new(&["x_mm", "y_mm"], Columns(vec![axis(0), axis(1)]))?));
        }
        let seconds = json!({ "total": start.elapsed().as_secs_f64() });
        let stem = Path::new(&label).file_stem().map_or_else(|| "data".into(), |s| s.to_string_lossy());
        Ok((tables, traced.document(&stem, &seconds).to_string(), told.into_texts()))
    })
}
