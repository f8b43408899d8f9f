//! Numbers of numpy, read where they lie while the interpreter's lock is free.

use std::ptr::NonNull;

use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use vibrissa::scene::{DirectionColumns, Tuple};

/// An array of contiguous numbers that lives at least as long as this.
pub struct Held {
    values: NonNull<f64>,
    len: usize,
    _array: Py<PyArray1<f64>>,
}

// SAFETY: the numbers are only read; they belong to an array that is referenced, which numpy neither frees nor resizes.
unsafe impl Send for Held {}
// SAFETY: as above.
unsafe impl Sync for Held {}

impl Held {
    fn at(&self, i: usize) -> f64 {
        assert!(i < self.len);
        // SAFETY: within the array. Who writes into it meanwhile gets taps of what was there or of what is there, as from numpy itself.
        unsafe { self.values.add(i).read_volatile() }
    }
}

/// One argument: a value for all taps, or one for each.
enum Argument {
    One(f64),
    Each(Held),
}

impl Argument {
    fn at(&self, i: usize) -> f64 {
        match self {
            Self::One(x) => *x,
            Self::Each(all) => all.at(i),
        }
    }
}

impl Argument {
    /// NaN for all taps stands for what was not given.
    fn is_missing(&self) -> bool {
        matches!(self, Self::One(x) if x.is_nan())
    }
}

/// Taps as arguments: D, d, L_a, x_ss, l, a and the drive, and where poles need not be upright, tilt and lean.
pub struct Given(Vec<Argument>);

impl Given {
    /// `n` taps from seven contiguous arrays of one or `n` values, or from nine.
    ///
    /// # Errors
    /// Arrays of other lengths.
    pub fn new(py: Python<'_>, n: usize, columns: Vec<PyReadonlyArray1<'_, f64>>) -> PyResult<Self> {
        let wrong = || crate::error::run(py, "arrays of other lengths");
        let one = |column: PyReadonlyArray1<'_, f64>| match column.as_slice().map_err(|_| wrong())? {
            [one] => Ok(Argument::One(*one)),
            values if column.len() == n => {
                let (values, len) = (NonNull::from(values).cast(), values.len());
                Ok(Argument::Each(Held { values, len, _array: (*column).clone().unbind() }))
            }
            _ => Err(wrong()),
        };
        let all = columns.into_iter().map(one).collect::<PyResult<Vec<_>>>()?;
        if [7, 9].contains(&all.len()) { Ok(Self(all)) } else { Err(wrong()) }
    }

    /// Tap `i`.
    #[allow(non_snake_case)]
    pub fn tap(&self, i: usize) -> Tuple {
        let [D, d, L_a, x_ss, l, a, drive] = std::array::from_fn(|k| self.0[k].at(i));
        let given = |k: usize| self.0.get(k).filter(|column| !column.is_missing());
        let [tilt, lean] = [7, 8].map(|k| given(k).map_or(0.0, |column| column.at(i)));
        Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive }
    }

    /// Whether poles tilt, and lean, in any of the `n` taps.
    pub fn leaning(&self, n: usize) -> [bool; 2] {
        let some = |column: &Argument| match column {
            Argument::One(x) => !x.is_nan() && *x != 0.0,
            Argument::Each(all) => (0..n).any(|i| all.at(i) != 0.0),
        };
        [7, 8].map(|k| self.0.get(k).is_some_and(some))
    }

    /// Which of tilt and lean were given.
    pub fn directions(&self) -> DirectionColumns {
        let [tilt, lean] = [7, 8].map(|k| self.0.get(k).is_some_and(|column| !column.is_missing()));
        DirectionColumns { tilt, lean }
    }
}
