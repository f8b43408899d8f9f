//! Single taps: arrays in, arrays out.

use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::time::Instant;

use pyo3::types::PyTuple;
use rayon::prelude::*;
use vibrissa::api::{Outcome, Tuple};
use vibrissa::design::{Design, amount};
use vibrissa::error::Error;
use vibrissa::evaluate::Method;
use vibrissa::kernel::tap::{Ask, Frame};
use vibrissa::kernel::{self, Effects};
use vibrissa::physics::onset::Grip;
use vibrissa::plan::CHUNK;
use vibrissa::scene::{BackendChoice, RunOptions, Spec};
use vibrissa::spec;
use vibrissa::status::Status;

use crate::error::raise;
use crate::job::{self, Far};
use crate::spec::Asked;

/// Taps that are solved on the thread that asks: they take less than a moment.
const FEW: usize = 256;

/// A whisker with a tap on it, in place of what a spec of taps given by arrays does not say.
pub const ANY: [&str; 2] = [
    "[whisker]\nD = 10\nd = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 30\ntheta = 1\n",
    "[whisker]\nD = 10\nd = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 30\ndelta = 1\n",
];

/// The spec of taps given by arrays.
///
/// # Errors
/// What is wrong with it.
pub fn shared(asked: &Asked) -> Result<Spec, Error> {
    asked.read(|label, text, base| {
        let table: toml::Table = text.parse().unwrap_or_default();
        let drive = table.get("tap").and_then(|t| t.get("drive")).and_then(toml::Value::as_str);
        spec::parse_with(label, text, base, ANY[usize::from(drive == Some("displacement"))])
    })
}

/// A status as a number: a bit for each word, in the order of the words.
pub fn bits(status: Status) -> u16 {
    if status == Status::OK {
        return 0;
    }
    Status::ALL.iter().enumerate().map(|(k, (word, _))| u16::from(status.has(*word)) << k).sum()
}

/// Solves taps of one model, as often as it is asked, from any thread.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Taps {
    taps: std::sync::Arc<vibrissa::api::Taps>,
    threads: Option<usize>,
}

/// What is told of taps: strain, that of the estimator's theory, K − 1, P, T, arc, and words and grip as numbers.
struct Answers {
    numbers: [Vec<f64>; 6],
    status: Vec<u16>,
    sticking: Vec<bool>,
}

impl Answers {
    fn new(n: usize, full: bool) -> Self {
        let room = |k: usize| Vec::with_capacity(if full || k == 0 { n } else { 0 });
        let words = if full { n } else { 0 };
        Self {
            numbers: std::array::from_fn(room),
            status: Vec::with_capacity(words),
            sticking: Vec::with_capacity(words),
        }
    }

    fn push(&mut self, outcomes: &[Outcome], full: bool) {
        self.numbers[0].extend(outcomes.iter().map(|o| o.strain));
        if !full {
            return;
        }
        let read: [fn(&Outcome) -> f64; 5] =
            [|o| o.strain_linear, |o| o.deviation, |o| o.normal_force, |o| o.tangential_force, |o| o.arc];
        for (column, read) in self.numbers[1..].iter_mut().zip(read) {
            column.extend(outcomes.iter().map(read));
        }
        self.status.extend(outcomes.iter().map(|o| bits(o.status)));
        self.sticking.extend(outcomes.iter().map(|o| o.sticking));
    }

    fn into_arrays(self, py: Python<'_>, full: bool) -> PyResult<Bound<'_, PyTuple>> {
        let mut all: Vec<Bound<'_, PyAny>> = Vec::new();
        for column in self.numbers.into_iter().take(if full { 6 } else { 1 }) {
            all.push(PyArray1::from_vec(py, column).into_any());
        }
        if full {
            all.push(PyArray1::from_vec(py, self.status).into_any());
            all.push(PyArray1::from_vec(py, self.sticking).into_any());
        }
        PyTuple::new(py, all)
    }
}

/// One argument: a value for all taps, or one for each.
enum Given<'a> {
    One(f64),
    Each(&'a [f64]),
}

impl Given<'_> {
    fn at(&self, i: usize) -> f64 {
        match self {
            Self::One(x) => *x,
            Self::Each(all) => all[i],
        }
    }
}

/// `n` taps from seven contiguous arrays of one or `n` values; `None` where one is of neither length.
pub fn tuples(n: usize, columns: &[PyReadonlyArray1<'_, f64>; 7]) -> Option<Vec<Tuple>> {
    let mut given = Vec::with_capacity(7);
    for column in columns {
        given.push(match (column.as_slice().ok()?, column.len()) {
            (values, len) if len == n => Given::Each(values),
            ([one], _) => Given::One(*one),
            _ => return None,
        });
    }
    let row = |i: usize| Tuple::from_array(std::array::from_fn(|k| given[k].at(i)));
    Some(if n < FEW {
        (0..n).map(row).collect()
    } else {
        (0..n).into_par_iter().with_min_len(4096).map(row).collect()
    })
}

#[pymethods]
impl Taps {
    /// Of the model that `text`, sections of a spec, describes; on the CPU kernels where its `[run]` says nothing.
    #[new]
    fn new(py: Python<'_>, text: String) -> PyResult<Self> {
        let made = || {
            let spec = shared(&Asked::new(None, text, "strain")?)?;
            let backend = spec.run.backend.unwrap_or(BackendChoice::Cpu);
            let options = RunOptions { backend: Some(backend), ..spec.run };
            let taps = vibrissa::api::Taps::new(spec.study.setup, &options)?;
            Ok(Self { taps: std::sync::Arc::new(taps), threads: options.threads })
        };
        made().map_err(|e| raise(py, e))
    }

    /// One tap: strain, that of the estimator's theory, K − 1, P, T, arc, status bits, whether it sticks.
    #[pyo3(signature = (D, d, L_a, x_ss, l, a, drive, /))]
    #[allow(non_snake_case, clippy::too_many_arguments, clippy::type_complexity)]
    fn one(
        &self,
        py: Python<'_>,
        D: f64,
        d: f64,
        L_a: f64,
        x_ss: f64,
        l: f64,
        a: f64,
        drive: f64,
    ) -> PyResult<(f64, f64, f64, f64, f64, f64, u16, bool)> {
        let mut found = Outcome::NOTHING;
        let mut each = |o: &[Outcome]| {
            found = o[0];
            true
        };
        let solved = self.taps.solve(&[Tuple { D, d, L_a, x_ss, l, a, drive }], &mut each);
        solved.map_err(|e| raise(py, e))?;
        let o = found;
        let numbers = (o.strain, o.strain_linear, o.deviation, o.normal_force, o.tangential_force, o.arc);
        let (strain, linear, deviation, normal, tangential, arc) = numbers;
        Ok((strain, linear, deviation, normal, tangential, arc, bits(o.status), o.sticking))
    }

    /// `n` taps from seven contiguous arrays of one or `n` values each; the numbers of [`Self::one`], each as an array. Only the strain
    /// unless `full`.
    #[pyo3(signature = (n, columns, full, progress = None))]
    fn many<'py>(
        &self,
        py: Python<'py>,
        n: usize,
        columns: [PyReadonlyArray1<'py, f64>; 7],
        full: bool,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let lengths = || crate::error::run(py, "arrays of other lengths");
        let tuples = tuples(n, &columns).ok_or_else(lengths)?;
        drop(columns);
        let taps = std::sync::Arc::clone(&self.taps);
        let mut answers = Answers::new(n, full);
        if n <= FEW {
            let solved = taps.solve(&tuples, &mut |some| {
                answers.push(some, full);
                true
            });
            solved.map_err(|e| raise(py, e))?;
            return answers.into_arrays(py, full);
        }
        let work = move |stop: &std::sync::atomic::AtomicBool, tell: &mut dyn FnMut(Far)| {
            let mut done = 0;
            taps.solve(&tuples, &mut |some| {
                answers.push(some, full);
                done += some.len() as u64;
                tell((done, n as u64));
                !stop.load(std::sync::atomic::Ordering::Relaxed)
            })?;
            Ok(answers)
        };
        let (answers, interrupt) = job::run(py, self.threads, work, job::shown(progress))?;
        interrupt.map_or(Ok(()), Err)?;
        answers.into_arrays(py, full)
    }

    /// For benches/python: seconds of `repeats` solves of these taps by the kernel alone, framed in its own units and nothing told of them, or,
    /// with `engine`, by what the program solves taps with.
    fn seconds(
        &self,
        py: Python<'_>,
        n: usize,
        columns: [PyReadonlyArray1<'_, f64>; 7],
        engine: bool,
        repeats: usize,
    ) -> PyResult<f64> {
        let tuples = tuples(n, &columns).ok_or_else(|| crate::error::run(py, "arrays of other lengths"))?;
        let setup = self.taps.setup();
        let method = self.taps.method().map_err(|e| raise(py, e))?;
        let Method::Fast { mut solver, rungs, tolerance } = method else { return Ok(f64::NAN) };
        let framed = |t: &Tuple| {
            let (grip, design) = (Grip::Slide(0.0), Design::new(setup, *t));
            let shared = design.shared.as_ref().filter(|_| design.admits(setup.drive, t.a, t.drive))?;
            let (model, side, curve, peak) = (&setup.model, setup.gauge.side, &shared.model, shared.peak);
            let amount = amount(setup.drive, t.drive);
            Frame::new(&Ask { model, side, curve, peak, a: t.a, amount, grip }).map(|frame| *frame.tap())
        };
        let taps: Vec<_> = tuples.par_iter().filter_map(framed).collect();
        let effects = Effects::new(&setup.model, setup.gauge.side, false);
        let (mut solutions, start) = (Vec::new(), Instant::now());
        for _ in 0..repeats {
            if engine {
                self.taps.solve(&tuples, &mut |_| true).map_err(|e| raise(py, e))?;
                continue;
            }
            for some in taps.chunks(CHUNK as usize) {
                let solved = kernel::solve(solver.as_mut(), effects, &rungs, tolerance, some, &mut solutions);
                solved.map_err(|e| raise(py, e.into()))?;
            }
        }
        Ok(start.elapsed().as_secs_f64())
    }

    /// Where taps are solved, as JSON.
    fn backend(&self) -> String {
        serde_json::json!(self.taps.backend()).to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Taps on {}>", self.taps.backend().name)
    }
}
