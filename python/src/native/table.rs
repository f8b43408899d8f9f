//! A table whose columns Arrow, numpy and data frames read without a copy.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use arrow_array::types::{Float64Type, Int32Type, Int64Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, PrimitiveArray, RecordBatch, RecordBatchIterator,
    StringArray, make_array,
};
use arrow_array::{ffi::FFI_ArrowSchema, ffi_stream::FFI_ArrowArrayStream};
use arrow_buffer::{NullBuffer, ScalarBuffer};
use arrow_schema::{ArrowError, DataType, Field, Schema, TimeUnit};
use numpy::{Element, PyArray1, PyReadonlyArray1, ndarray::ArrayView1};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyCapsule, PyList};
use vibrissa::command::Content;
use vibrissa::error::Error;
use vibrissa::measure::Data;
use vibrissa::scene::{Column, Drive, RankBy};
use vibrissa::sink::heading::{Kind, fact};
use vibrissa::sink::{Frame, Values, values::Words};

/// Columns of equal length with their names. numpy, pandas, polars, pyarrow and whatever else knows the Arrow PyCapsule interface read them
/// without a copy: `table["strain"]`, `table.to_pandas()`, `pyarrow.table(table)`, `polars.DataFrame(table)`. A missing number is NaN
/// (null in Arrow), a missing word None, a missing time NaT.
///
/// What needs nothing of Rust, as `to_pandas` and pickling, `vibrissa/_frames.py` adds.
#[pyclass(frozen, module = "vibrissa")]
pub struct Table {
    batch: RecordBatch,
    /// The user's own columns as a frame of pandas with its index, where they came so.
    own: Option<Py<PyAny>>,
}

impl Table {
    pub fn new(frame: Frame) -> Result<Self, Error> {
        let names: Vec<&str> = frame.names.iter().map(AsRef::as_ref).collect();
        let array = |(name, values): (&&str, Values)| match values {
            Values::Words(words) if fact(name).is_none_or(|fact| fact.kind != Kind::Word) => {
                array(words.typed())
            }
            values => array(values),
        };
        let arrays = names.iter().zip(frame.columns).map(array).collect();
        Self::of_arrays(&names, arrays, None).map_err(|e| Error::Run(e.to_string()))
    }

    fn of_arrays(names: &[&str], arrays: Vec<ArrayRef>, own: Option<Py<PyAny>>) -> Result<Self, ArrowError> {
        if names.len() != arrays.len() {
            return Err(ArrowError::InvalidArgumentError("as many names as columns are needed".into()));
        }
        let field = |(name, array): (&&str, &ArrayRef)| Field::new(*name, array.data_type().clone(), true);
        let schema = Schema::new(names.iter().zip(&arrays).map(field).collect::<Vec<_>>());
        Ok(Self { batch: RecordBatch::try_new(Arc::new(schema), arrays)?, own })
    }

    /// A column; the bias also by its other name.
    fn at(&self, name: &str) -> PyResult<&ArrayRef> {
        let same = if name == RankBy::BIAS { RankBy::ErrorRms.word() } else { name };
        let found = self.batch.column_by_name(name).or_else(|| self.batch.column_by_name(same));
        found.ok_or_else(|| {
            let names: Vec<&str> =
                self.batch.schema_ref().fields().iter().map(|f| f.name().as_str()).collect();
            let now = if name == Column::TipDiameter.name(Drive::Angle) { " (it is d_tip_mm)" } else { "" };
            PyKeyError::new_err(format!("no column {name:?}{now}; there are {}", names.join(", ")))
        })
    }
}

fn view<'py, T: Element>(of: &Bound<'py, Table>, values: &[T]) -> PyResult<Bound<'py, PyAny>> {
    // SAFETY: the values belong to `of`, which is frozen and lives as long as the array; the array cannot be written to.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(values), of.clone().into_any()) };
    array.call_method("setflags", (), Some(&[("write", false)].into_py_dict(of.py())?))?;
    Ok(array.into_any())
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema_ref().fields().iter().map(|f| f.name().clone()).collect()
    }

    /// Rows.
    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        name.extract::<&str>().is_ok_and(|name| self.batch.column_by_name(name).is_some())
    }

    /// A table of columns as they are read of another: of numbers (float64), of counts (int64), of flags (bool), bits (int64) of times with their
    /// type, or codes (int32) with their words; `own` are the user's own as a frame of pandas.
    #[staticmethod]
    #[pyo3(signature = (names, columns, own = None))]
    fn _of_columns(
        py: Python<'_>,
        names: Vec<String>,
        columns: Vec<Given<'_>>,
        own: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let arrays = columns.into_iter().map(Given::array).collect::<Result<_, _>>();
        arrays.and_then(|arrays| Self::of_arrays(&names, arrays, own)).map_err(|e| failed(py, &e))
    }

    /// The user's own columns as a frame of pandas with its index, where they came so.
    #[getter]
    fn _own(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.own.as_ref().map(|own| own.clone_ref(py))
    }

    fn __repr__(&self) -> String {
        format!("<Table of {} rows: {}>", self.batch.num_rows(), self.columns().join(", "))
    }

    /// A column as a numpy array: of numbers without a copy and read-only, of words as an array of objects.
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let Ok(name) = name.extract::<&str>() else {
            let what = format!("a table is asked for a column by its name, not for {}", name.repr()?);
            return Err(PyKeyError::new_err(what));
        };
        let (py, column) = (slf.py(), slf.get().at(name)?);
        if let Some(x) = column.as_any().downcast_ref::<PrimitiveArray<Float64Type>>() {
            return view(slf, x.values());
        }
        if let Some(n) = column.as_any().downcast_ref::<PrimitiveArray<Int64Type>>() {
            return view(slf, n.values());
        }
        if let Some(flags) = column.as_any().downcast_ref::<BooleanArray>() {
            return Ok(PyArray1::from_iter(py, flags.iter().flatten()).into_any());
        }
        if let Some((kind, _)) = OF_TIME.iter().find(|(_, of_arrow)| of_arrow == column.data_type()) {
            // The column, which the view keeps alive, owns these bits.
            let bits = column.to_data();
            return view(slf, bits.buffers()[0].typed_data::<i64>())?.call_method1("view", (*kind,));
        }
        let (codes, words) = Self::codes(slf, name)?;
        py.import("vibrissa._frames")?.call_method1("words", (codes, words))
    }

    /// A column of words as its codes (int32, −1 where there is none; without a copy) and the different words.
    fn codes<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyList>)> {
        let column = slf.get().at(name)?;
        let Some(words) = column.as_any().downcast_ref::<DictionaryArray<Int32Type>>() else {
            return Err(PyKeyError::new_err(format!("{name:?} is a column of numbers")));
        };
        let all = words.values().as_any().downcast_ref::<StringArray>();
        let all: Vec<&str> = all.into_iter().flatten().flatten().collect();
        Ok((view(slf, words.keys().values())?, PyList::new(slf.py(), all)?))
    }

    /// Kind of each column: "number", "count", "flag", "time" or "words".
    fn kinds(&self) -> Vec<&'static str> {
        let kind = |f: &Arc<Field>| match f.data_type() {
            DataType::Float64 => "number",
            DataType::Int64 => "count",
            DataType::Boolean => "flag",
            DataType::Timestamp(..) | DataType::Duration(_) => "time",
            _ => "words",
        };
        self.batch.schema_ref().fields().iter().map(kind).collect()
    }

    /// The Arrow PyCapsule interface: types of the columns.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema =
            FFI_ArrowSchema::try_from(self.batch.schema_ref().as_ref()).map_err(|e| failed(py, &e))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// The Arrow PyCapsule interface: the columns. Another schema is not made; whoever asks for one must cast.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let schema = self.batch.schema();
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}

fn failed(py: Python<'_>, e: &ArrowError) -> PyErr {
    super::error::run(py, &e.to_string())
}

fn array(values: Values) -> ArrayRef {
    match values {
        Values::Numbers(x) => {
            let nulls =
                x.iter().any(|x| x.is_nan()).then(|| x.iter().map(|x| !x.is_nan()).collect::<NullBuffer>());
            Arc::new(PrimitiveArray::<Float64Type>::new(ScalarBuffer::from(x), nulls))
        }
        Values::Counts(n) => {
            let n: Vec<i64> = n.into_iter().map(u64::cast_signed).collect();
            Arc::new(PrimitiveArray::<Int64Type>::new(ScalarBuffer::from(n), None))
        }
        Values::Words(Words { codes, known, .. }) => {
            // Categories need distinct words.
            let (mut words, mut places) = (Vec::new(), HashMap::new());
            let place = |word: String| match word.is_empty() {
                true => -1,
                false => *places.entry(word).or_insert_with_key(|word| {
                    words.push(word.clone());
                    words.len() as i32 - 1
                }),
            };
            let of: Vec<i32> = known.into_iter().map(place).collect();
            let codes = codes.into_iter().map(|code| of[code as usize]).collect();
            dictionary(codes, words).expect("codes are places of words")
        }
    }
}

/// A column of words from indices into `words`; −1 is missing.
fn dictionary(codes: Vec<i32>, words: Vec<String>) -> Result<ArrayRef, ArrowError> {
    let nulls = codes.contains(&-1).then(|| codes.iter().map(|c| *c >= 0).collect::<NullBuffer>());
    let keys = PrimitiveArray::<Int32Type>::new(ScalarBuffer::from(codes), nulls);
    Ok(Arc::new(DictionaryArray::<Int32Type>::try_new(keys, Arc::new(StringArray::from(words)))?))
}

#[derive(FromPyObject)]
pub enum Given<'py> {
    /// Values are float64.
    Numbers(PyReadonlyArray1<'py, f64>),
    /// Values are int64.
    Counts(PyReadonlyArray1<'py, i64>),
    Flags(PyReadonlyArray1<'py, bool>),
    /// Bits (int64), and the numpy type.
    Times(PyReadonlyArray1<'py, i64>, String),
    /// Indices into the words; −1 is missing.
    Words(PyReadonlyArray1<'py, i32>, Vec<String>),
}

pub type TableGiven<'py> = (Vec<String>, Vec<Given<'py>>);

/// A file: its text if in memory, or the path of measurements; or a table.
#[derive(FromPyObject)]
pub enum FileGiven<'py> {
    Text(String),
    Table(TableGiven<'py>),
}

impl FileGiven<'_> {
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

pub fn frame(py: Python<'_>, file: &str, (names, columns): TableGiven<'_>) -> PyResult<Frame> {
    let mut frame = Frame::of(file, [""; 0]);
    for (name, column) in names.into_iter().zip(columns) {
        let values = match column {
            Given::Numbers(x) => Values::Numbers(x.as_array().to_vec()),
            Given::Words(codes, mut words) => {
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

/// numpy types of times and time spans, and their Arrow types.
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

/// Times from their bits; i64::MIN (NaT) is missing.
fn times(bits: Vec<i64>, kind: &str) -> Result<ArrayRef, ArrowError> {
    let unknown = || ArrowError::InvalidArgumentError(format!("{kind} is no type of times"));
    let (_, of_arrow) = OF_TIME.iter().find(|(of_numpy, _)| *of_numpy == kind).ok_or_else(unknown)?;
    let known = bits.iter().map(|x| *x != i64::MIN).collect::<NullBuffer>();
    let nulls = (known.null_count() > 0).then_some(known);
    let plain = PrimitiveArray::<Int64Type>::new(ScalarBuffer::from(bits), nulls);
    Ok(make_array(plain.into_data().into_builder().data_type(of_arrow.clone()).build()?))
}
