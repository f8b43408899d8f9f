//! Columns of a table: how they become those of Arrow.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use arrow_array::types::{Float64Type, Int32Type, Int64Type};
use arrow_array::{Array, ArrayRef, BooleanArray, DictionaryArray, PrimitiveArray, StringArray, make_array};
use arrow_buffer::{NullBuffer, ScalarBuffer};
use arrow_schema::{ArrowError, DataType, TimeUnit};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use vibrissa::command::Content;
use vibrissa::measure::Data;
use vibrissa::sink::fact::{Kind, fact};
use vibrissa::sink::frame::Frame;
use vibrissa::sink::values::{Values, Words};

/// The column `name` as Arrow has it; one of the user's own, which is kept as words, by what it holds.
pub fn named(name: &str, values: Values) -> ArrayRef {
    match values {
        Values::Words(words) if fact(name).is_none_or(|fact| fact.kind != Kind::Word) => array(words.typed()),
        values => array(values),
    }
}

pub fn array(values: Values) -> ArrayRef {
    match values {
        Values::Numbers(x) => {
            let nulls =
                x.iter().any(|x| x.is_nan()).then(|| x.iter().map(|x| !x.is_nan()).collect::<NullBuffer>());
            Arc::new(PrimitiveArray::<Float64Type>::new(ScalarBuffer::from(x), nulls))
        }
        // These collect in place.
        Values::Counts(n) => {
            let n: Vec<i64> = n.into_iter().map(u64::cast_signed).collect();
            Arc::new(PrimitiveArray::<Int64Type>::new(ScalarBuffer::from(n), None))
        }
        Values::Words(Words { codes, known, .. }) => {
            // Each word once, as categories are.
            let (mut words, mut places) = (Vec::new(), HashMap::new());
            let mut place = |word: &str| match places.get(word) {
                Some(place) => *place,
                None if word.is_empty() => -1,
                None => {
                    let place = words.len() as i32;
                    words.push(word.to_owned());
                    places.insert(word.to_owned(), place);
                    place
                }
            };
            let of: Vec<i32> = known.iter().map(|word| place(word)).collect();
            let codes = codes.into_iter().map(|code| of[code as usize]).collect();
            dictionary(codes, words).expect("codes are places of words")
        }
    }
}

/// A column of words by their places in `words`, −1 where there is none.
fn dictionary(codes: Vec<i32>, words: Vec<String>) -> Result<ArrayRef, ArrowError> {
    let nulls = codes.contains(&-1).then(|| codes.iter().map(|c| *c >= 0).collect::<NullBuffer>());
    let keys = PrimitiveArray::<Int32Type>::new(ScalarBuffer::from(codes), nulls);
    Ok(Arc::new(DictionaryArray::<Int32Type>::try_new(keys, Arc::new(StringArray::from(words)))?))
}

/// A column as `Table.__getitem__` and `Table.codes` give it.
#[derive(FromPyObject)]
pub enum Given<'py> {
    /// float64.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// int64.
    Counts(PyReadonlyArray1<'py, i64>),
    /// Truth values.
    Flags(PyReadonlyArray1<'py, bool>),
    /// Their bits, and the type of numpy.
    Times(PyReadonlyArray1<'py, i64>, String),
    /// Places in their words, −1 where there is none.
    Words(PyReadonlyArray1<'py, i32>, Vec<String>),
}

pub type TableGiven<'py> = (Vec<String>, Vec<Given<'py>>);

/// A file: the text of one in memory, or the path of measurements; or a table.
#[derive(FromPyObject)]
pub enum FileGiven<'py> {
    Text(String),
    Table(TableGiven<'py>),
}

impl FileGiven<'_> {
    /// Measurements as the library reads them; a table is called `data`.
    pub fn measured(self, py: Python<'_>) -> PyResult<Content> {
        match self {
            Self::Text(path) => {
                let read = Data::load(Path::new(&path)).map(Content::Bytes);
                read.map_err(|e| super::error::raise(py, e.into()))
            }
            Self::Table(table) => Ok(Content::Table(frame(py, "data", table)?)),
        }
    }
}

/// A table of numbers and words for the library, which calls it `file`.
pub fn frame(py: Python<'_>, file: &str, (names, columns): TableGiven<'_>) -> PyResult<Frame> {
    let mut frame = Frame::new(file, &[], &[]);
    for (name, column) in names.into_iter().zip(columns) {
        let values = match column {
            Given::Numbers(x) => Values::Numbers(x.as_array().to_vec()),
            Given::Words(codes, mut words) => {
                // Where there is no word, −1 is the place of the empty one.
                let none = words.len() as u32;
                words.push(String::new());
                let codes =
                    codes.as_array().iter().map(|code| u32::try_from(*code).unwrap_or(none)).collect();
                Values::Words(Words::new(codes, words))
            }
            _ => return Err(super::error::run(py, "a column of numbers or words is needed")),
        };
        frame.add(name, values);
    }
    Ok(frame)
}

impl Given<'_> {
    /// As a column of Arrow.
    ///
    /// # Errors
    /// Codes that are no places of words; no type of times.
    pub fn array(self) -> Result<ArrayRef, ArrowError> {
        Ok(match self {
            Self::Numbers(x) => array(Values::Numbers(x.as_array().to_vec())),
            Self::Counts(n) => {
                array(Values::Counts(n.as_array().iter().map(|n| n.cast_unsigned()).collect()))
            }
            Self::Flags(x) => Arc::new(BooleanArray::from(x.as_array().to_vec())),
            Self::Times(x, kind) => times(x.as_array().to_vec(), &kind)?,
            Self::Words(codes, words) => dictionary(codes.as_array().to_vec(), words)?,
        })
    }
}

/// Types of numpy for moments and spans of time, and those of Arrow.
pub const OF_TIME: [(&str, DataType); 8] = [
    ("M8[s]", DataType::Timestamp(TimeUnit::Second, None)),
    ("M8[ms]", DataType::Timestamp(TimeUnit::Millisecond, None)),
    ("M8[us]", DataType::Timestamp(TimeUnit::Microsecond, None)),
    ("M8[ns]", DataType::Timestamp(TimeUnit::Nanosecond, None)),
    ("m8[s]", DataType::Duration(TimeUnit::Second)),
    ("m8[ms]", DataType::Duration(TimeUnit::Millisecond)),
    ("m8[us]", DataType::Duration(TimeUnit::Microsecond)),
    ("m8[ns]", DataType::Duration(TimeUnit::Nanosecond)),
];

/// Times by their bits; the smallest number stands for none.
fn times(bits: Vec<i64>, kind: &str) -> Result<ArrayRef, ArrowError> {
    let unknown = || ArrowError::InvalidArgumentError(format!("{kind} is no type of times"));
    let (_, of_arrow) = OF_TIME.iter().find(|(of_numpy, _)| *of_numpy == kind).ok_or_else(unknown)?;
    let known = bits.iter().map(|x| *x != i64::MIN).collect::<NullBuffer>();
    let nulls = (known.null_count() > 0).then_some(known);
    let plain = PrimitiveArray::<Int64Type>::new(ScalarBuffer::from(bits), nulls);
    Ok(make_array(plain.into_data().into_builder().data_type(of_arrow.clone()).build()?))
}
