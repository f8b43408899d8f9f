//! Single taps: arrays in, arrays out.

use std::path::Path;
use std::sync::{Arc, atomic::Ordering};
use std::time::Instant;

use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use vibrissa::api::Outcome;
use vibrissa::error::InputError;
use vibrissa::evaluate::{Input, OUTPUTS};
use vibrissa::scene::{BackendChoice, COLUMNS, Precision, RunOptions, Setup, Tuple};
use vibrissa::spec;
use vibrissa::taps::refuse;

use super::error::raise;
use super::job;
use super::spec::KEYWORDS;

/// Up to this number taps are solved on the calling thread, because they take less than a moment.
const FEW: usize = 256;

const PART: usize = 1 << 17;
const PART_OF_GRADIENTS: usize = 1 << 12;

const INPUTS: &str = "D, d, L_a, x_ss, l, a, theta (or delta), tilt, lean, and of what the model has: hub, pole_radius, mu, E, C10, C01, C20, C30, \
                      nu, clamp, foil.stiffness, foil.length, foil.width, exponent, scale, bore, core.diameter, core.modulus, curvature, curvature_slope, \
                      root.k_theta, root.k_y, root.k_x";

/// Solves taps of one model, as often as it is asked, from any thread.
#[pyclass(frozen, module = "vibrissa._native")]
pub struct Taps {
    taps: Arc<vibrissa::api::Taps>,
    threads: Option<usize>,
    /// True if one tap may take a millisecond.
    slow: bool,
    warnings: Vec<String>,
}

/// Strain, strain of the estimator's theory, K − 1, P, T, arc, strain of the second gauge, azimuth (degrees), slide; status bits; sticking.
type Told = ([f64; OUTPUTS], u16, bool);

fn told(o: &Outcome) -> Told {
    let upright = [o.strain, o.strain_linear, o.deviation, o.normal_force, o.tangential_force, o.arc];
    let [strain, linear, deviation, normal, tangential, arc] = upright;
    let azimuth = o.azimuth.to_degrees();
    let numbers = [strain, linear, deviation, normal, tangential, arc, o.strain_2, azimuth, o.slide];
    (numbers, o.status.bits(), o.sticking)
}

/// The warnings about taps of which the columns have these `largest` values.
fn unusual(setup: &Setup, largest: [f64; COLUMNS]) -> Vec<String> {
    spec::unusual_taps(setup.drive, largest, |column, what| {
        InputError::new(what).key(column.key(setup.drive))
    })
}

impl Taps {
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
            // Finite differences and fits need f64.
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
    fn one(
        &self,
        py: Python<'_>,
        tap: [f64; 9],
        full: bool,
    ) -> PyResult<([f64; OUTPUTS], u16, bool, Vec<String>)> {
        let tap = tuple(tap);
        self.allowed(py, [tap.tilt, tap.lean].map(|x| x != 0.0))?;
        let (mut found, mut strain) = ([Told::default()], [f64::NAN]);
        let solved = job::here(py, || match full {
            true => self.taps.solve(|_| tap, told, &mut found),
            false => self.taps.strains(|_| tap, &mut strain),
        })?;
        solved.map_err(|e| raise(py, e))?;
        let [(mut numbers, status, sticks)] = found;
        if !full {
            numbers[0] = strain[0];
        }
        Ok((numbers, status, sticks, unusual(self.taps.setup(), tap.to_array())))
    }

    /// `n` taps from the columns of [`Given::new`]: their strains; or, if `full`, the numbers of [`Self::one`], a row for each tap, status bits and
    /// whether they stick. The derivatives by the inputs `by`, for each tap and each of its numbers as many as there are inputs; what should be known.
    /// Errors: an input that these taps have not; threads or kernels that fail.
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
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyArray1<f64>>, Vec<String>)> {
        let given = Given::new(py, n, columns)?;
        let leaning = given.leaning();
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
            let every: [usize; OUTPUTS] = std::array::from_fn(|k| k);
            let width = if full { OUTPUTS * count } else { count };
            let [strain, row] = if full { [0, n] } else { [n, 0] };
            let (mut strains, mut rows) = (vec![f64::NAN; strain], vec![Told::default(); row]);
            let mut slopes = vec![f64::NAN; n * width];
            let part = if count == 0 { PART } else { PART_OF_GRADIENTS };
            for from in (0..n).step_by(part) {
                let more = part.min(n - from);
                let (tap, range) = (|i: usize| given.tap(from + i), from..from + more);
                let by = &mut slopes[from * width..][..more * width];
                match (full, count) {
                    (false, 0) => taps.strains(tap, &mut strains[range]),
                    (false, _) => taps.strain_gradients(tap, &inputs, &mut strains[range], by),
                    (true, 0) => taps.solve(tap, told, &mut rows[range]),
                    (true, _) => taps.gradients(tap, (&inputs, &every), told, &mut rows[range], by),
                }?;
                if !go_on(from + more) {
                    break;
                }
            }
            if full && count > 0 {
                let azimuths = slopes.chunks_mut(width).flat_map(|tap| &mut tap[7 * count..8 * count]);
                azimuths.for_each(|x| *x = x.to_degrees());
            }
            let unusual = unusual(taps.setup(), given.largest());
            Ok((strains, rows, slopes, unusual))
        };
        let (strains, rows, slopes, unusual) = if n <= FEW && count == 0 && !self.slow {
            job::here(py, || solve(&mut |_| true))?.map_err(|e| raise(py, e))?
        } else {
            job::whole(py, self.threads, progress, move |stop, tell| {
                solve(&mut |done| {
                    tell((done as u64, n as u64));
                    !stop.load(Ordering::Relaxed)
                })
            })?
        };
        let found = match full {
            false => PyTuple::new(py, [PyArray1::from_vec(py, strains)])?,
            true => {
                let numbers = rows.iter().flat_map(|row| row.0).collect();
                let status = PyArray1::from_iter(py, rows.iter().map(|row| row.1)).into_any();
                let sticks = PyArray1::from_iter(py, rows.iter().map(|row| row.2)).into_any();
                PyTuple::new(py, [PyArray1::from_vec(py, numbers).into_any(), status, sticks])?
            }
        };
        Ok((found, PyArray1::from_vec(py, slopes), unusual))
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
}

#[allow(non_snake_case)]
fn tuple([D, d, L_a, x_ss, l, a, drive, tilt, lean]: [f64; 9]) -> Tuple {
    Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive, rig: 0 }
}

/// Columns of taps: D, d, L_a, x_ss, l, a, drive, tilt, lean; each of one value, or of a value for each tap.
pub struct Given([Vec<f64>; 9]);

pub type Column<'py> = Option<PyReadonlyArray1<'py, f64>>;

impl Given {
    /// Columns of length 1 or `n`: seven, then optionally tilt and lean. NaN is allowed.
    pub fn new(py: Python<'_>, n: usize, columns: Vec<Column<'_>>) -> PyResult<Self> {
        let wrong = || super::error::run(py, "arrays of other lengths");
        let one = |(k, column): (usize, Column<'_>)| match &column {
            None if k >= 7 => Ok(vec![0.0]),
            Some(values) if [1, n].contains(&values.len()) => {
                values.as_slice().map(<[f64]>::to_vec).map_err(|_| wrong())
            }
            _ => Err(wrong()),
        };
        let upright = (columns.len()..9).map(|_| None);
        let all = columns.into_iter().chain(upright).enumerate().map(one).collect::<PyResult<Vec<_>>>()?;
        all.try_into().map(Self).map_err(|_| wrong())
    }

    pub fn tap(&self, i: usize) -> Tuple {
        tuple(self.0.each_ref().map(|column| column[if column.len() == 1 { 0 } else { i }]))
    }

    /// Largest value of each column of the taps; NaN without a number.
    pub fn largest(&self) -> [f64; COLUMNS] {
        tuple(self.0.each_ref().map(|column| column.iter().copied().fold(f64::NAN, f64::max))).to_array()
    }

    /// True for tilt, and for lean, if any tap has one; NaN counts as such.
    pub fn leaning(&self) -> [bool; 2] {
        [7, 8].map(|k| self.0[k].iter().any(|x| *x != 0.0))
    }
}
