//! Output of a sweep: its tables, in files or in memory; identity of the result, and what `merge` needs about the rows of a part.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::Kept;
use crate::backend::Choice;
use crate::chart::ranker::Rankers;
use crate::error::Error;
use crate::plan::Plan;
use crate::scene::{Space, Spec, Study};
use crate::sink::folder::{Listed, Output, pack};
use crate::sink::{
    Folder, Frame, Question, Shard, Sheet, Table, TableFormat, free_memory, hash, parquet::More, run_json,
};

#[derive(Debug)]
pub(super) struct About {
    pub designs: Range<u64>,
    pub format: TableFormat,
    /// True if the places of the rows in the whole are written: in a part whose rows do not simply follow those of the part before.
    pub places: bool,
    pub provenance: String,
    pub question: Question,
    /// Hash of the whole sweep: equal for all parts, with any driver and CPU instructions.
    pub whole: String,
}

impl About {
    /// For a `shard`, or for the whole with effects left off within `bound`.
    pub fn new(spec: &Spec, plan: &Plan, choice: &Choice, shard: Option<Shard>, bound: Option<f64>) -> Self {
        let (format, b) = (TableFormat::of(spec), &choice.backend);
        let listed = !matches!(spec.study.space, Space::Grid(_));
        let places = shard.is_some() && (listed || spec.study.output.top.is_some());
        let backend = json!({
            "name": b.name, "adapter": b.adapter, "driver": b.driver, "precision": b.precision, "tolerance": b.tolerance,
        });
        let mut question = Question::of_scene("sweep", spec, Value::Null);
        let body = json!({ "in_force": question.lasting(), "backend": backend });
        let provenance = run_json::document("sweep", run_json::spec(spec), body).to_string();
        let study = &spec.study;
        let space = if listed { String::new() } else { format!("{:?}", study.space) };
        let whole = json!([
            env!("CARGO_PKG_VERSION"),
            format!("{:?} {:?} {space}", study.setup, study.output),
            question.lasting(),
            question.asked,
            (b.name, &b.adapter, b.precision, b.tolerance),
            format!("{:?} {:?} {} {bound:?}", plan.way, plan.solved, plan.chunk),
            format.word(),
        ]);
        let whole = hash(&whole.to_string());
        let part = shard.map(|s| s.to_string());
        let identity = json!([whole, crate::sink::COMMIT, b.driver, b.instructions, part]).to_string();
        question.identity = Some(hash(&identity));
        if let Some(part) = part {
            question.asked["shard"] = part.into();
        }
        let designs = shard.unwrap_or(Shard::WHOLE).designs(plan.designs);
        Self { designs, format, places, provenance, question, whole }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    pub table: Table,
    /// Number of its design and stroke; for a distances row only of its design.
    pub of: (u64, u32),
    /// Sort key of the rows of a table: ranked value of a kept row, then design or row of the tuple file, then place in the design.
    pub order: (u64, u64, u32),
    /// Rank value from a chart; NaN without one.
    pub charted: f32,
}

impl Place {
    pub(super) fn of(row: &Kept, number: u64) -> Self {
        let (first, stroke) = row.index;
        let order = (ordered(row.rank), first, stroke);
        Self { table: Table::Designs, of: (number, stroke), order, charted: row.charted }
    }
}

/// A number with the same order as `x` by `total_cmp`.
pub fn ordered(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

pub(super) fn description(shard: Shard, study: &Study, plan: &Plan, about: &About) -> Value {
    json!({
        "index": shard.index,
        "of": shard.of,
        "designs": { "from": about.designs.start, "to": about.designs.end, "of": plan.designs },
        "format": about.format.word(),
        "top": study.output.top,
        "candidates": plan.rankers.as_ref().map(Rankers::keep),
        "tables": wanted(study, plan).map(Table::word).collect::<Vec<_>>(),
        "whole": about.whole,
    })
}

/// Position of each row of a part in the whole, for `merge`.
pub const PLACES: &str = "places.bin";

#[derive(Default)]
pub(super) struct Writers {
    sheets: [Option<Sheet>; 3],
    pub places: Option<Output>,
}

/// Tuples, designs and distances in memory; `None` for a table not requested.
pub type Tables = [Option<Frame>; 3];

fn wanted(study: &Study, plan: &Plan) -> impl Iterator<Item = Table> {
    let wanted = [plan.tuples, study.output.designs, study.output.distances];
    Table::ALL.into_iter().filter(move |table| wanted[*table as usize])
}

pub(super) fn names(study: &Study, plan: &Plan, about: &About) -> Vec<String> {
    let tables = wanted(study, plan).map(|table| table.file(about.format));
    tables.chain(about.places.then(|| PLACES.to_owned())).collect()
}

impl Writers {
    /// In `folder`, where the files may have `more` rows; in memory without one.
    pub fn new(
        (study, plan): (&Study, &Plan),
        about: &About,
        mut folder: Option<&mut Folder>,
        more: Vec<Option<More>>,
    ) -> Result<Self, Error> {
        let bytes = wanted(study, plan).map(|table| {
            let width = table.heading().names(&study.setup).len() as u64;
            plan.rows[table as usize].saturating_mul(8 * width)
        });
        let bytes = bytes.fold(0, u64::saturating_add);
        let room = if folder.is_none() { free_memory() } else { None };
        if let Some(room) = room.filter(|room| bytes > *room) {
            let [bytes, room] = [bytes, room].map(|bytes| bytes as f64 / 1e9);
            let why = format!("the tables take {bytes:.1} GB, and there are {room:.1} GB of memory");
            let help = "leave out output.tuples, say output.top, or write files";
            return Err(Error::Run(format!("{why}: {help}")));
        }
        let (mut all, mut more) = (Self::default(), more.into_iter());
        for table in wanted(study, plan) {
            let mut empty = table.heading().frame_for(&study.setup);
            all.sheets[table as usize] = Some(match &mut folder {
                Some(folder) => {
                    let (output, what) =
                        (folder.file(&table.file(about.format))?, (&empty, &*about.provenance));
                    Sheet::new(about.format, output, what, more.next().flatten())?
                }
                None => {
                    empty.reserve(plan.rows[table as usize])?;
                    Sheet::Memory(empty)
                }
            });
        }
        all.places = folder.filter(|_| about.places).map(|folder| folder.file(PLACES)).transpose()?;
        Ok(all)
    }

    /// The files until now, and the data that [`Self::new`] needs to continue them.
    pub fn marks(&mut self) -> Result<(Vec<Listed>, Vec<Option<More>>), Error> {
        let sheets = self.sheets.iter_mut().flatten().filter_map(|sheet| sheet.mark().transpose());
        let (mut files, more): (Vec<_>, _) = sheets.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        files.extend(self.places.as_mut().map(Output::mark).transpose()?);
        Ok((files, more))
    }

    pub fn wants(&self, table: Table) -> bool {
        self.sheets[table as usize].is_some()
    }

    pub fn write(&mut self, table: Table, pieces: &[Frame]) -> Result<(), Error> {
        self.sheets[table as usize].as_mut().map_or(Ok(()), |sheet| sheet.write(pieces))
    }

    pub fn place(&mut self, mut places: impl Iterator<Item = Place>) -> Result<(), Error> {
        let Some(file) = &mut self.places else { return Ok(()) };
        places.try_for_each(|place| file.write(&pack(&place).map_err(|e| Error::Run(e.to_string()))?))
    }

    pub fn close(self) -> Result<Tables, Error> {
        let mut tables = Tables::default();
        for (sheet, table) in self.sheets.into_iter().zip(&mut tables) {
            *table = sheet.map_or(Ok(None), Sheet::close)?;
        }
        self.places.into_iter().try_for_each(Output::close)?;
        Ok(tables)
    }
}
