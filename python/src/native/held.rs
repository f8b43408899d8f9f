//! Taps as columns of numpy.

use numpy::{PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use vibrissa::scene::Tuple;
use vibrissa::spec::{Ends, NO_ENDS, widened};

/// One argument: a value for all taps, or one for each.
enum Argument {
    One(f64),
    Each(Vec<f64>),
}

impl Argument {
    fn at(&self, i: usize) -> f64 {
        match self {
            Self::One(x) => *x,
            Self::Each(all) => all[i],
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
            values if column.len() == n => Ok(Argument::Each(values.to_vec())),
            _ => Err(wrong()),
        };
        let mut columns = columns.into_iter();
        let seven = columns.by_ref().take(7).flatten().map(one).collect::<PyResult<Vec<_>>>()?;
        let seven = <[Argument; 7]>::try_from(seven).map_err(|_| wrong())?;
        let mut direction = || columns.next().flatten().map(one).transpose();
        let directions = [direction()?, direction()?];
        if columns.next().is_none() { Ok(Self { seven, directions }) } else { Err(wrong()) }
    }

    #[allow(non_snake_case)]
    pub fn tap(&self, i: usize) -> Tuple {
        let [D, d, L_a, x_ss, l, a, drive] = std::array::from_fn(|k| self.seven[k].at(i));
        let [tilt, lean] = self.directions.each_ref().map(|column| column.as_ref().map_or(0.0, |c| c.at(i)));
        Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive, rig: 0 }
    }

    /// Least and largest value of each column of the taps; of a tap that has no number it has none.
    #[allow(non_snake_case)]
    pub fn ends(&self) -> Ends {
        let of = |column: &Argument| match column {
            Argument::One(x) => widened(NO_ENDS, *x),
            Argument::Each(all) => all.iter().copied().fold(NO_ENDS, widened),
        };
        let [D, d, L_a, x_ss, l, a, drive] = self.seven.each_ref().map(of);
        let [tilt, lean] = self.directions.each_ref().map(|column| column.as_ref().map_or([0.0; 2], of));
        [D, d, L_a, x_ss, l, a, tilt, lean, drive]
    }

    /// Whether poles tilt, and lean, in any of the taps; where it is not known, they do.
    pub fn leaning(&self) -> [bool; 2] {
        let some = |column: &Argument| match column {
            Argument::One(x) => *x != 0.0,
            Argument::Each(all) => all.iter().any(|x| *x != 0.0),
        };
        self.directions.each_ref().map(|column| column.as_ref().is_some_and(some))
    }
}
