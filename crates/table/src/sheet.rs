//! Formats of tables, and a table being written in one, also continued after a stop. Each step fails if the file cannot be written. Memory that is
//! available for tables.

use std::fs::read_to_string;

use rayon::prelude::*;

use super::folder::{Listed, Output};
use super::parquet::{self, More};
use crate::Frame;
use crate::error::Error;

const TOGETHER: usize = 32;

/// A table that is being written to its file, or collected in memory.
pub enum Sheet {
    /// Comma-separated text.
    Csv(Box<Output>),
    /// Apache Parquet.
    Parquet(Box<parquet::Writer>),
    /// No file.
    Memory(Frame),
}

impl Sheet {
    /// Starts the file `output` with the columns of `empty`, or continues it (Parquet: from `more`); `provenance` goes to the metadata.
    pub fn new(
        format: TableFormat,
        mut output: Output,
        (empty, provenance): (&Frame, &str),
        more: Option<More>,
    ) -> Result<Self, Error> {
        if format == TableFormat::Parquet {
            return Ok(Self::Parquet(Box::new(parquet::Writer::new(output, empty, provenance, more)?)));
        }
        if output.bytes() == 0 {
            output.write(&empty.header()?)?;
        }
        Ok(Self::Csv(Box::new(output)))
    }

    /// Position in the file, if there is one, and the state that Parquet needs to continue.
    pub fn mark(&mut self) -> Result<Option<(Listed, Option<More>)>, Error> {
        Ok(match self {
            Self::Csv(output) => Some((output.mark()?, None)),
            Self::Parquet(writer) => Some((writer.output().mark()?, Some(writer.more()?))),
            Self::Memory(_) => None,
        })
    }

    /// Appends the rows of `pieces`; their text is made in parallel.
    pub fn write(&mut self, pieces: &[Frame]) -> Result<(), Error> {
        match self {
            Self::Csv(output) => pieces.chunks(TOGETHER).try_for_each(|some| {
                let texts: Vec<Vec<u8>> = some.par_iter().map(Frame::lines).collect::<Result<_, _>>()?;
                texts.iter().try_for_each(|text| output.write(text))
            }),
            Self::Parquet(writer) => pieces.iter().try_for_each(|piece| writer.write(piece, 0..piece.len())),
            Self::Memory(all) => pieces.iter().try_for_each(|piece| all.extend(piece, 0..piece.len())),
        }
    }

    /// Completes and closes the file, or returns the table in memory.
    pub fn close(self) -> Result<Option<Frame>, Error> {
        match self {
            Self::Csv(output) => output.close().map(|()| None),
            Self::Parquet(writer) => writer.close().map(|()| None),
            Self::Memory(all) => Ok(Some(all)),
        }
    }
}

vibrissa_core::words! {
    /// Format of written tables; its word is also the file extension.
    TableFormat {
        /// Comma-separated text.
        Csv = "csv",
        /// Apache Parquet: the same columns, typed and compressed.
        Parquet = "parquet",
    }
}

impl TableFormat {
    /// Approximate size of a table relative to CSV, measured on `sweeps/million.toml`.
    pub fn share(self) -> f64 {
        if self == Self::Csv { 1.0 } else { 0.25 }
    }

    /// The format with this word; CSV for any other word.
    pub fn named(word: &str) -> Self {
        Self::WORDS.iter().find(|(name, _)| *name == word).map_or(Self::Csv, |(_, format)| *format)
    }

    /// The format in force in a spec; CSV by default.
    pub fn of(spec: &crate::scene::Spec) -> Self {
        let value = spec.in_force.iter().find(|(key, ..)| key == "output.format");
        Self::named(value.map_or("csv", |(_, value, _)| value.trim_matches('"')))
    }
}

/// Bytes that the process can still allocate: the lesser of `MemAvailable` (Linux) and `memory.max` less `anon` (cgroup v2). `None` if unknown.
pub fn free_memory() -> Option<u64> {
    let system = read_to_string("/proc/meminfo").ok().and_then(|text| field(&text, "MemAvailable:"));
    let of_container = |name: &str| read_to_string(format!("/sys/fs/cgroup/{name}")).ok();
    let most = of_container("memory.max").and_then(|text| text.trim().parse::<u64>().ok());
    let taken = of_container("memory.stat").and_then(|text| field(&text, "anon "));
    let container = most.map(|most| most.saturating_sub(taken.unwrap_or(0)));
    system.map(|kilobytes| kilobytes.saturating_mul(1024)).into_iter().chain(container).min()
}

fn field(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}
