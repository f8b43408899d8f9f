//! Tables as Apache Parquet: the columns of the CSV files, typed and compressed, with units and provenance as metadata. Written without arrow.
//!
//! Each row group but the last has `GROUP` rows, so the bytes depend on the rows alone: stopped sweeps and merged shards give the same bytes. An
//! unfinished file consists of whole row groups; its footer and the rows of the next group are kept separately.

mod read;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::column::writer::{ColumnWriter, get_column_writer};
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::{
    ColumnChunkMetaData, FileMetaData, KeyValue, ParquetMetaDataBuilder, ParquetMetaDataOptions,
    ParquetMetaDataReader, ParquetMetaDataWriter, RowGroupMetaData,
};
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesPtr};
use parquet::file::statistics::Statistics;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::{ColumnDescPtr, ColumnPath, SchemaDescPtr, SchemaDescriptor, Type};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::folder::Output;
use super::heading::{Kind, unit};
use crate::error::Error;
use crate::{Frame, Values};

pub use read::Reader;

const GROUP: usize = 1 << 17;

const VERSION: i32 = 1;

const PROVENANCE: &str = "vibrissa.provenance";

const MAGIC: &[u8] = b"PAR1";
/// Bytes after the metadata: its length and the magic word.
const TAIL: usize = 8;

/// State of an unfinished file besides its bytes: its footer, and the rows of the next group.
pub type More = (Vec<u8>, Vec<Values>);

/// A Parquet file while it is written.
pub struct Writer {
    output: Output,
    schema: SchemaDescPtr,
    properties: WriterPropertiesPtr,
    facts: Vec<KeyValue>,
    groups: Vec<RowGroupMetaData>,
    waiting: Frame,
}

fn failed(e: ParquetError) -> Error {
    Error::Run(format!("writing Parquet: {e}"))
}

fn schema(table: &Frame) -> Result<SchemaDescPtr, ParquetError> {
    let field = |(name, values): (&Cow<'static, str>, &Values)| {
        let (physical, logical) = match values.kind() {
            Kind::Number => (Physical::DOUBLE, None),
            Kind::Count => (Physical::INT64, None),
            Kind::Word => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical);
        let field = field.with_repetition(Repetition::OPTIONAL).with_logical_type(logical);
        field.build().map(Arc::new)
    };
    let fields = table.names.iter().zip(&table.columns).map(field).collect::<Result<_, _>>()?;
    let root = Type::group_type_builder("vibrissa").with_fields(fields).build()?;
    Ok(Arc::new(SchemaDescriptor::new(Arc::new(root))))
}

impl Writer {
    /// Starts the file `output` with the columns of `empty`, or continues it from `more`. `origin`, its provenance, is written to its metadata.
    pub fn new(mut output: Output, empty: &Frame, origin: &str, more: Option<More>) -> Result<Self, Error> {
        let (mut groups, mut waiting) = (Vec::new(), empty.like());
        match more {
            None => output.write(MAGIC)?,
            Some((footer, columns)) => {
                let mut options = ParquetMetaDataOptions::new();
                // Needed so that the statistics are written again in the same form.
                options.set_encoding_stats_as_mask(false);
                let body = &footer[..footer.len().saturating_sub(TAIL)];
                let read = ParquetMetaDataReader::decode_metadata_with_options(body, Some(&options));
                let known = read.and_then(|read| read.row_groups().iter().cloned().map(as_written).collect());
                groups = known.map_err(failed)?;
                waiting.columns = columns;
            }
        }
        let schema = schema(empty).map_err(failed)?;
        let units: serde_json::Map<String, Value> =
            empty.names.iter().map(|name| (name.to_string(), json!(unit(name)))).collect();
        let units = KeyValue::new("vibrissa.units".to_owned(), Value::Object(units).to_string());
        let facts = vec![KeyValue::new(PROVENANCE.to_owned(), origin.to_owned()), units];
        let properties = properties(empty);
        Ok(Self { output, schema, properties, facts, groups, waiting })
    }

    /// The state that a later run needs, besides the file, to continue.
    pub fn more(&self) -> Result<More, Error> {
        Ok((self.footer()?, self.waiting.columns.clone()))
    }

    /// The file being written.
    pub fn output(&mut self) -> &mut Output {
        &mut self.output
    }

    /// Appends the rows `range` of `rows`.
    pub fn write(&mut self, rows: &Frame, mut range: Range<usize>) -> Result<(), Error> {
        while !range.is_empty() {
            let to = range.end.min(range.start + GROUP - self.waiting.len());
            self.waiting.extend(rows, range.start..to)?;
            range.start = to;
            if self.waiting.len() == GROUP {
                self.group()?;
            }
        }
        Ok(())
    }

    fn group(&mut self) -> Result<(), Error> {
        let n = self.waiting.len();
        let one = |(at, values)| column(self.schema.column(at), &self.properties, values);
        let parts: Result<Vec<_>> = self.waiting.columns.par_iter().enumerate().map(one).collect();
        let (start, mut chunks, mut size) = (self.output.bytes(), Vec::new(), 0);
        for (bytes, chunk) in parts.map_err(failed)? {
            let chunk = moved(chunk, self.output.bytes()).map_err(failed)?;
            size += chunk.uncompressed_size();
            chunks.push(chunk);
            self.output.write(&bytes)?;
        }
        let group = RowGroupMetaData::builder(Arc::clone(&self.schema))
            .set_column_metadata(chunks)
            .set_total_byte_size(size)
            .set_num_rows(n as i64)
            .set_ordinal(self.groups.len() as i32)
            .set_file_offset(start as i64)
            .build();
        self.groups.push(group.map_err(failed)?);
        self.waiting = self.waiting.like();
        Ok(())
    }

    fn footer(&self) -> Result<Vec<u8>, Error> {
        let rows = self.groups.iter().map(RowGroupMetaData::num_rows).sum();
        let by = Some(format!("vibrissa version {}", env!("CARGO_PKG_VERSION")));
        let facts = Some(self.facts.clone());
        let file = FileMetaData::new(VERSION, rows, by, facts, Arc::clone(&self.schema), None);
        let metadata = ParquetMetaDataBuilder::new(file).set_row_groups(self.groups.clone()).build();
        let mut bytes = Vec::new();
        ParquetMetaDataWriter::new(&mut bytes, &metadata).finish().map_err(failed)?;
        Ok(bytes)
    }

    /// Writes the last group and the footer, and closes the file.
    pub fn close(mut self) -> Result<(), Error> {
        if !self.waiting.is_empty() {
            self.group()?;
        }
        let footer = self.footer()?;
        self.output.write(&footer)?;
        self.output.close()
    }
}

/// Inputs of taps: few distinct values, so they get a dictionary. Other columns of numbers use byte-stream split.
const ASKED: [&str; 8] = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "theta_deg", "delta_mm"];

fn properties(table: &Frame) -> WriterPropertiesPtr {
    let mut builder = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true);
    for (name, values) in table.names.iter().zip(&table.columns) {
        if values.kind() == Kind::Number && !ASKED.contains(&&**name) {
            let path = ColumnPath::from(&**name);
            builder = builder.set_column_dictionary_enabled(path.clone(), false);
            builder = builder.set_column_encoding(path, Encoding::BYTE_STREAM_SPLIT);
        }
    }
    Arc::new(builder.build())
}

fn column(
    description: ColumnDescPtr,
    properties: &WriterPropertiesPtr,
    values: &Values,
) -> Result<(Vec<u8>, ColumnChunkMetaData)> {
    let mut bytes = TrackedWrite::new(Vec::new());
    let pages = Box::new(SerializedPageWriter::new(&mut bytes));
    let mut writer = get_column_writer(description, Arc::clone(properties), pages);
    write(&mut writer, values)?;
    let metadata = writer.close()?.metadata;
    Ok((bytes.into_inner()?, metadata))
}

fn write(writer: &mut ColumnWriter<'_>, values: &Values) -> Result<()> {
    match (writer, values) {
        (ColumnWriter::DoubleColumnWriter(writer), Values::Numbers(all)) => {
            let there: Vec<i16> = all.iter().map(|x| i16::from(!x.is_nan())).collect();
            let known: Vec<f64> = all.iter().copied().filter(|x| !x.is_nan()).collect();
            writer.write_batch(&known, Some(&there), None)?;
        }
        (ColumnWriter::Int64ColumnWriter(writer), Values::Counts(all)) => {
            let known: Vec<i64> = all.iter().map(|n| n.cast_signed()).collect();
            writer.write_batch(&known, Some(&vec![1; all.len()]), None)?;
        }
        (ColumnWriter::ByteArrayColumnWriter(writer), Values::Words(words)) => {
            let texts: Vec<ByteArray> = words.known.iter().map(|word| word.as_str().into()).collect();
            let is = |code: &u32| !words.known[*code as usize].is_empty();
            let there: Vec<i16> = words.codes.iter().map(|code| i16::from(is(code))).collect();
            let codes = words.codes.iter().filter(|code| is(code));
            let known: Vec<ByteArray> = codes.map(|code| texts[*code as usize].clone()).collect();
            writer.write_batch(&known, Some(&there), None)?;
        }
        _ => return Err(ParquetError::General("a column of two kinds".into())),
    }
    Ok(())
}

fn moved(chunk: ColumnChunkMetaData, start: u64) -> Result<ColumnChunkMetaData> {
    let by = |place: i64| place + start as i64;
    let (data, dictionary) = (chunk.data_page_offset(), chunk.dictionary_page_offset());
    let builder = chunk.into_builder().set_data_page_offset(by(data));
    builder.set_dictionary_page_offset(dictionary.map(by)).build()
}

/// A row group from a footer, as before writing: the library writes min and max of integers twice, for old readers, and forgets it on reading.
fn as_written(group: RowGroupMetaData) -> Result<RowGroupMetaData> {
    let column = |chunk: &ColumnChunkMetaData| match chunk.statistics() {
        Some(Statistics::Int64(known)) => {
            let known = known.clone().with_backwards_compatible_min_max(true);
            chunk.clone().into_builder().set_statistics(Statistics::Int64(known)).build()
        }
        _ => Ok(chunk.clone()),
    };
    let columns = group.columns().iter().map(column).collect::<Result<_>>()?;
    group.into_builder().set_column_metadata(columns).build()
}
