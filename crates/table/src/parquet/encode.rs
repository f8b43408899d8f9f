//! Encodes the columns of a row group, in parallel.

use std::sync::Arc;

use parquet::basic::{Compression, Encoding};
use parquet::column::writer::{ColumnCloseResult, ColumnWriter, get_column_writer};
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::{ColumnChunkMetaData, RowGroupMetaData};
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesPtr};
use parquet::file::statistics::Statistics;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::{ColumnDescPtr, ColumnPath, SchemaDescPtr};
use rayon::prelude::*;

use crate::fact::Kind;
use crate::frame::Frame;
use crate::values::Values;

/// Inputs of taps: few distinct values, so they get a dictionary. Other columns of numbers use byte-stream split.
const ASKED: [&str; 8] = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "theta_deg", "delta_mm"];

pub(super) fn properties(table: &Frame) -> WriterPropertiesPtr {
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

pub(super) fn group(
    schema: &SchemaDescPtr,
    properties: &WriterPropertiesPtr,
    rows: &Frame,
) -> Result<Vec<(Vec<u8>, ColumnChunkMetaData)>> {
    let one = |(at, values): (usize, &Values)| column(schema.column(at), properties, values);
    rows.columns.par_iter().enumerate().map(one).collect()
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
    let ColumnCloseResult { metadata, .. } = writer.close()?;
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
            let known: Vec<ByteArray> = words
                .codes
                .iter()
                .filter(|code| is(code))
                .map(|code| texts[*code as usize].clone())
                .collect();
            writer.write_batch(&known, Some(&there), None)?;
        }
        _ => return Err(ParquetError::General("a column of two kinds".into())),
    }
    Ok(())
}

pub(super) fn moved(chunk: ColumnChunkMetaData, start: u64) -> Result<ColumnChunkMetaData> {
    let by = |place: i64| place + start as i64;
    let (data, dictionary) = (chunk.data_page_offset(), chunk.dictionary_page_offset());
    let builder = chunk.into_builder().set_data_page_offset(by(data));
    builder.set_dictionary_page_offset(dictionary.map(by)).build()
}

/// A row group from a footer, as before writing: the library writes min and max of integers twice, for old readers, and forgets it on reading.
pub(super) fn as_written(group: RowGroupMetaData) -> Result<RowGroupMetaData> {
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
