//! Numbers of numpy, read where they lie while the interpreter's lock is free.

use std::ptr::NonNull;

use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use vibrissa::scene::Tuple;
use vibrissa::spec::{Ends, NO_ENDS, widened};

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

    /// Least and largest of the first `n`.
    fn ends(&self, n: usize) -> [f64; 2] {
        // Side by side, so that none waits for the one before it.
        let mut all = [NO_ENDS; 4];
        let whole = n - n % 4;
        for i in (0..whole).step_by(4) {
            all.iter_mut().enumerate().for_each(|(k, ends)| *ends = widened(*ends, self.at(i + k)));
        }
        let rest = (whole..n).map(|i| self.at(i));
        all.into_iter().flatten().chain(rest).fold(NO_ENDS, widened)
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

/// Taps as arguments: D, d, L_a, x_ss, l, a and the drive; tilt and lean, or nothing where poles are upright.
pub struct Given {
    seven: [Argument; 7],
    directions: [Option<Argument>; 2],
}

/// A column, or none where it was not given.
pub type Column<'py> = Option<PyReadonlyArray1<'py, f64>>;

impl Given {
    /// `n` taps from contiguous arrays of one or `n` values: seven, and after them tilt and lean, which may both be left out, or one of them be
    /// none. A NaN is a value like others.
    ///
    /// # Errors
    /// Arrays of other lengths.
    pub fn new(py: Python<'_>, n: usize, columns: Vec<Column<'_>>) -> PyResult<Self> {
        let wrong = || super::error::run(py, "arrays of other lengths");
        let one = |column: PyReadonlyArray1<'_, f64>| match column.as_slice().map_err(|_| wrong())? {
            [one] => Ok(Argument::One(*one)),
            values if column.len() == n => {
                let (values, len) = (NonNull::from(values).cast(), values.len());
                Ok(Argument::Each(Held { values, len, _array: (*column).clone().unbind() }))
            }
            _ => Err(wrong()),
        };
        let mut columns = columns.into_iter();
        let seven = columns.by_ref().take(7).flatten().map(one).collect::<PyResult<Vec<_>>>()?;
        let seven = <[Argument; 7]>::try_from(seven).map_err(|_| wrong())?;
        let mut direction = || columns.next().flatten().map(one).transpose();
        let directions = [direction()?, direction()?];
        if columns.next().is_none() { Ok(Self { seven, directions }) } else { Err(wrong()) }
    }

    /// Tap `i`.
    #[allow(non_snake_case)]
    pub fn tap(&self, i: usize) -> Tuple {
        let [D, d, L_a, x_ss, l, a, drive] = std::array::from_fn(|k| self.seven[k].at(i));
        let [tilt, lean] = self.directions.each_ref().map(|column| column.as_ref().map_or(0.0, |c| c.at(i)));
        Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive, rig: 0 }
    }

    /// Least and largest value of each column of the `n` taps; of a tap that has no number it has none.
    #[allow(non_snake_case)]
    pub fn ends(&self, n: usize) -> Ends {
        let of = |column: &Argument| match column {
            Argument::One(x) => widened(NO_ENDS, *x),
            Argument::Each(all) => all.ends(n),
        };
        let [D, d, L_a, x_ss, l, a, drive] = self.seven.each_ref().map(of);
        let [tilt, lean] = self.directions.each_ref().map(|column| column.as_ref().map_or([0.0; 2], of));
        [D, d, L_a, x_ss, l, a, tilt, lean, drive]
    }

    /// Whether poles tilt, and lean, in any of the `n` taps; where it is not known, they do.
    pub fn leaning(&self, n: usize) -> [bool; 2] {
        let some = |column: &Argument| match column {
            Argument::One(x) => *x != 0.0,
            Argument::Each(all) => (0..n).any(|i| all.at(i) != 0.0),
        };
        self.directions.each_ref().map(|column| column.as_ref().is_some_and(some))
    }
}
