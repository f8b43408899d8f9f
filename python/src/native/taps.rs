//! Single taps: arrays in, arrays out.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use vibrissa::api::Tuple;
use vibrissa::error::{Error, InputError};
use vibrissa::evaluate::Input;
use vibrissa::optimise::write;
use vibrissa::scene::{BackendChoice, Precision, RunOptions, Setup};
use vibrissa::spec::{self, Ends};
use vibrissa::taps::refuse;

use super::answers::{Answers, NUMBERS, Told, numbers_of};
use super::error::raise;
use super::held::{Column, Given};
use super::job;
use super::spec::KEYWORDS;

/// Taps that are solved on the thread that asks: they take less than a moment.
const FEW: usize = 256;

/// Taps between two looks at signals.
const PART: usize = 1 << 17;
const PART_OF_GRADIENTS: usize = 1 << 12;

/// Names of inputs, in words.
const INPUTS: &str = "D, d, L_a, x_ss, l, a, theta (or delta), tilt, lean, and of what the model has: hub, pole_radius, mu, E, C10, C01, C20, C30, \
                      nu, clamp, foil.stiffness, foil.length, foil.width, exponent, scale, bore, core.diameter, core.modulus, curvature, curvature_slope, \
                      root.k_theta, root.k_y, root.k_x";

/// Solves taps of one model, as often as it is asked, from any thread.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Taps {
    taps: Arc<vibrissa::api::Taps>,
    threads: Option<usize>,
    /// Whether one tap may take a millisecond.
    slow: bool,
    /// What should be known of the model.
    warnings: Vec<String>,
}

/// Asks `solve` for `n` taps in parts of at most `most`, each from one place on and so many, as long as `go_on` is happy with how many are done.
fn parts(
    n: usize,
    most: usize,
    mut solve: impl FnMut(usize, usize) -> Result<(), Error>,
    mut go_on: impl FnMut(usize) -> bool,
) -> Result<(), Error> {
    let mut done = 0;
    while done < n {
        let more = most.min(n - done);
        solve(done, more)?;
        done += more;
        if !go_on(done) {
            break;
        }
    }
    Ok(())
}

/// What should be known of taps, if anything should.
type Doubts = Option<Vec<String>>;

/// Which of `n` taps were probably meant in another unit.
fn doubts(setup: &Setup, n: usize, ends: Option<Ends>, tap: impl Fn(usize) -> Tuple + Sync) -> Doubts {
    let all = spec::doubts_of_taps(setup.drive, n, ends, tap, |column| write::key(setup, column).to_owned());
    Some(all).filter(|all| !all.is_empty())
}

impl Taps {
    /// Refuses poles of which there is no model with this contact.
    fn allowed(&self, py: Python<'_>, leaning: [bool; 2]) -> PyResult<()> {
        refuse(self.taps.setup(), leaning).map_err(|e| raise(py, e.into()))
    }
}

#[pymethods]
impl Taps {
    /// Of the model that `text`, sections of a spec, describes; on the CPU kernels where its `[run]` says nothing.
    #[new]
    fn new(py: Python<'_>, text: String) -> PyResult<Self> {
        let made = || {
            let mut spec = spec::parse_listed(&format!("strain.{KEYWORDS}"), &text, Path::new(""), None)?;
            let warnings = std::mem::take(&mut spec.warnings);
            let backend = spec.run.backend.unwrap_or(BackendChoice::Cpu);
            // Differences, and fits that take them, find no slope in f32.
            let fine = Some(Precision::F64).filter(|_| backend == BackendChoice::Cpu);
            let precision = spec.run.precision.or(fine);
            let options = RunOptions { backend: Some(backend), precision, ..spec.run };
            let slow = backend == BackendChoice::Reference || spec.study.setup.built.is_some();
            let taps = vibrissa::api::Taps::new(spec.study.setup, &options)?;
            Ok(Self { taps: Arc::new(taps), threads: options.threads, slow, warnings })
        };
        job::here(py, made)?.map_err(|e| raise(py, e))
    }

    /// What should be known of the model.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// One tap of D, d, L_a, x_ss, l, a, drive, tilt and lean: strain, that of the estimator's theory, K − 1, P, T, arc, strain of the second gauge,
    /// azimuth (degrees) and slide, only the strain unless `full`; status bits; whether it sticks; what should be known of it.
    #[pyo3(signature = (tap, full, /))]
    #[allow(non_snake_case)]
    fn one(
        &self,
        py: Python<'_>,
        tap: [f64; 9],
        full: bool,
    ) -> PyResult<([f64; NUMBERS], u16, bool, Doubts)> {
        let [D, d, L_a, x_ss, l, a, drive, tilt, lean] = tap;
        self.allowed(py, [tilt != 0.0, lean != 0.0])?;
        let tap = Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive, rig: 0 };
        let (mut found, mut strain) = ([Told::default()], [f64::NAN]);
        let solved = job::here(py, || match full {
            true => self.taps.solve(|_| tap, numbers_of, &mut found),
            false => self.taps.strains(|_| tap, &mut strain),
        })?;
        solved.map_err(|e| raise(py, e))?;
        let [(mut numbers, status, sticks)] = found;
        if !full {
            numbers[0] = strain[0];
        }
        Ok((numbers, status, sticks, doubts(self.taps.setup(), 1, None, |_| tap)))
    }

    /// `n` taps from the columns of [`Given::new`]; the numbers of [`Self::one`], status bits and whether they stick, each as an array, only the strain
    /// unless `full`; the derivatives of these numbers by the inputs `by`, for each number `n` times as many as there are inputs; what should be known.
    ///
    /// # Errors
    /// An input that these taps have not; threads or kernels that fail.
    #[pyo3(signature = (n, columns, full, by = Vec::new(), progress = None))]
    #[allow(clippy::type_complexity)]
    fn many<'py>(
        &self,
        py: Python<'py>,
        n: usize,
        columns: Vec<Column<'py>>,
        full: bool,
        by: Vec<String>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyTuple>, Doubts)> {
        let given = Given::new(py, n, columns)?;
        let leaning = given.leaning(n);
        self.allowed(py, leaning)?;
        let taps = Arc::clone(&self.taps);
        let input = |name: &String| {
            let wrong = |why: String| InputError::new(why).key("grad").value(name).allowed(INPUTS);
            if leaning.contains(&true) && name.starts_with("curvature") {
                let why = "a curved whisker leaves its plane at a pole that is not upright".to_owned();
                return Err(raise(py, wrong(why).into()));
            }
            Input::new(taps.setup(), name).map_err(|why| raise(py, wrong(why).into()))
        };
        let inputs = by.iter().map(input).collect::<PyResult<Vec<Input>>>()?;
        let count = inputs.len();
        let solve = move |go_on: &mut dyn FnMut(usize) -> bool| {
            let every: [usize; NUMBERS] = std::array::from_fn(|k| k);
            let numbers = if full { &every[..] } else { &every[..1] };
            let mut answers = Answers::new(if full { n } else { 0 });
            let (mut strains, mut some) = (vec![f64::NAN; if full { 0 } else { n }], Vec::new());
            let slopes = numbers.iter().filter(|_| count > 0).map(|_| Vec::with_capacity(n * count));
            let mut slopes: Vec<Vec<f64>> = slopes.collect();
            let one = |from: usize, more: usize| {
                let tap = |i: usize| given.tap(from + i);
                match (full, count) {
                    (false, 0) => return taps.strains(tap, &mut strains[from..from + more]),
                    (false, _) => {
                        let begin = slopes[0].len();
                        slopes[0].resize(begin + more * count, f64::NAN);
                        let (strains, slopes) = (&mut strains[from..from + more], &mut slopes[0][begin..]);
                        return taps.strain_gradients(tap, &inputs, strains, slopes);
                    }
                    (true, _) => some.resize(more, Told::default()),
                }
                let mut by = vec![f64::NAN; more * count * NUMBERS];
                match count {
                    0 => taps.solve(tap, numbers_of, &mut some)?,
                    _ => taps.gradients(tap, (&inputs, numbers), numbers_of, &mut some, &mut by)?,
                }
                answers.push(some.iter());
                for (k, row) in by.chunks(count.max(1)).enumerate() {
                    slopes[k % NUMBERS].extend(row);
                }
                Ok(())
            };
            parts(n, if count == 0 { PART } else { PART_OF_GRADIENTS }, one, go_on)?;
            // Azimuths are told in degrees.
            slopes.iter_mut().skip(7).take(1).flatten().for_each(|x| *x = x.to_degrees());
            let doubts = doubts(taps.setup(), n, Some(given.ends(n)), |i| given.tap(i));
            Ok((strains, answers, slopes, doubts))
        };
        let (strains, answers, slopes, doubts) = if n <= FEW && count == 0 && !self.slow {
            job::here(py, || solve(&mut |_| true))?.map_err(|e| raise(py, e))?
        } else {
            job::whole(py, self.threads, progress, move |stop, tell| {
                solve(&mut |done| {
                    tell((done as u64, n as u64));
                    !stop.load(Ordering::Relaxed)
                })
            })?
        };
        let slopes = PyTuple::new(py, slopes.into_iter().map(|column| PyArray1::from_vec(py, column)))?;
        let numbers = match full {
            true => answers.into_arrays(py)?,
            false => PyTuple::new(py, [PyArray1::from_vec(py, strains)])?,
        };
        Ok((numbers, slopes, doubts))
    }

    /// For benches/python: seconds of `repeats` solves of these taps by what the program solves taps with.
    fn seconds(&self, py: Python<'_>, n: usize, columns: Vec<Column<'_>>, repeats: usize) -> PyResult<f64> {
        let given = Given::new(py, n, columns)?;
        let (mut strains, start) = (vec![0.0; n], Instant::now());
        for _ in 0..repeats {
            self.taps.strains(|i| given.tap(i), &mut strains).map_err(|e| raise(py, e))?;
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
