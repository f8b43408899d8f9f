//! Numbers of numpy, read where they lie while the interpreter's lock is free.

use std::ptr::NonNull;

use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use vibrissa::scene::Tuple;

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

/// Taps as seven arguments.
pub struct Given([Argument; 7]);

impl Given {
    /// `n` taps from seven contiguous arrays of one or `n` values.
    ///
    /// # Errors
    /// Arrays of other lengths.
    pub fn new(py: Python<'_>, n: usize, columns: [PyReadonlyArray1<'_, f64>; 7]) -> PyResult<Self> {
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
        all.try_into().map(Self).map_err(|_| wrong())
    }

    /// Tap `i`.
    #[allow(non_snake_case)]
    pub fn tap(&self, i: usize) -> Tuple {
        let [D, d, L_a, x_ss, l, a, drive] = std::array::from_fn(|k| self.0[k].at(i));
        Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() }
    }
}
