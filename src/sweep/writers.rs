//! The tables of a sweep while they are written, or gathered in memory.

use super::about::{About, Place};
use crate::error::Error;
use crate::plan::Plan;
use crate::scene::Study;
use crate::sink::folder::{Folder, Listed, Output, pack};
use crate::sink::frame::Frame;
use crate::sink::memory;
use crate::sink::parquet::More;
use crate::sink::sheet::Sheet;
use crate::sink::table::Table;

/// Where each row of a part stands in the whole, for `merge`.
pub const PLACES: &str = "places.bin";

/// Where a table goes.
enum Goal {
    File(Sheet),
    Memory(Frame),
}

/// Where the tables go; `None` for a table that nobody asked for.
pub(super) struct Writers {
    goals: [Option<Goal>; 3],
    /// Places of the rows of a part, where these do not follow from it.
    pub places: Option<Output>,
}

/// Tuples, designs and distances in memory; `None` for a table that was not asked for.
pub type Tables = [Option<Frame>; 3];

/// Which tables are written.
fn wanted(study: &Study, plan: &Plan) -> impl Iterator<Item = Table> {
    let wanted = [plan.tuples, study.output.designs, study.output.distances];
    Table::ALL.into_iter().filter(move |table| wanted[*table as usize])
}

/// Names of the tables that are written.
pub(super) fn tables(study: &Study, plan: &Plan) -> Vec<&'static str> {
    wanted(study, plan).map(Table::name).collect()
}

/// Names of the files that are written.
pub(super) fn names(study: &Study, plan: &Plan, about: &About) -> Vec<String> {
    let tables = wanted(study, plan).map(|table| table.file(about.format));
    tables.chain(about.places.then(|| PLACES.to_owned())).collect()
}

impl Writers {
    /// Writes nothing.
    pub fn none() -> Self {
        Self { goals: [const { None }; 3], places: None }
    }

    /// Gathers tables in memory, with room for all rows of `plan`.
    pub fn in_memory(study: &Study, plan: &Plan) -> Result<Self, Error> {
        let mut goals = [const { None }; 3];
        let bytes = wanted(study, plan).map(|table| {
            let width = table.heading().names(&study.setup).len() as u64;
            plan.rows[table as usize].saturating_mul(8 * width)
        });
        let bytes = bytes.fold(0, u64::saturating_add);
        if let Some(room) = memory::available().filter(|room| bytes > *room) {
            let [bytes, room] = [bytes, room].map(|bytes| bytes as f64 / 1e9);
            let why = format!("the tables take {bytes:.1} GB, and there are {room:.1} GB of memory");
            let help = "leave out output.tuples, say output.top, or write files";
            return Err(Error::Run(format!("{why}: {help}")));
        }
        for table in wanted(study, plan) {
            let mut frame = table.heading().frame_for(&study.setup);
            frame.reserve(plan.rows[table as usize])?;
            goals[table as usize] = Some(Goal::Memory(frame));
        }
        Ok(Self { goals, places: None })
    }

    /// The tables in `folder`, new, or as far as a stopped run came, with `more` of each.
    pub fn new(
        (study, plan): (&Study, &Plan),
        about: &About,
        folder: &mut Folder,
        more: Vec<Option<More>>,
    ) -> Result<Self, Error> {
        let (mut goals, mut more) = ([const { None }; 3], more.into_iter());
        for table in wanted(study, plan) {
            let output = folder.file(&table.file(about.format))?;
            let empty = table.heading().frame_for(&study.setup);
            let what = (&empty, about.provenance.as_str());
            let sheet = Sheet::new(about.format, output, what, more.next().flatten())?;
            goals[table as usize] = Some(Goal::File(sheet));
        }
        let places = about.places.then(|| folder.file(PLACES)).transpose()?;
        Ok(Self { goals, places })
    }

    /// The files so far, and what [`Self::new`] needs beside them to go on.
    pub fn marks(&mut self) -> Result<(Vec<Listed>, Vec<Option<More>>), Error> {
        let sheets = self.goals.iter_mut().flatten().filter_map(|goal| match goal {
            Goal::File(sheet) => Some(sheet.mark()),
            Goal::Memory(_) => None,
        });
        let (mut files, more): (Vec<_>, _) = sheets.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        files.extend(self.places.as_mut().map(Output::mark).transpose()?);
        Ok((files, more))
    }

    pub fn wants(&self, table: Table) -> bool {
        self.goals[table as usize].is_some()
    }

    /// Appends the rows of `pieces` to a table, if it is written.
    pub fn write(&mut self, table: Table, pieces: &[Frame]) -> Result<(), Error> {
        match &mut self.goals[table as usize] {
            None => Ok(()),
            Some(Goal::File(sheet)) => sheet.write(pieces),
            Some(Goal::Memory(all)) => pieces.iter().try_for_each(|piece| all.extend(piece, 0..piece.len())),
        }
    }

    /// Appends places of rows, where they are kept.
    pub fn place(&mut self, mut places: impl Iterator<Item = Place>) -> Result<(), Error> {
        let Some(file) = &mut self.places else { return Ok(()) };
        places.try_for_each(|place| file.write(&pack(&place).map_err(|e| Error::Run(e.to_string()))?))
    }

    /// Ends the files; what was gathered in memory.
    pub fn close(self) -> Result<Tables, Error> {
        let mut tables = Tables::default();
        for (goal, table) in self.goals.into_iter().zip(&mut tables) {
            match goal {
                Some(Goal::File(sheet)) => sheet.close()?,
                Some(Goal::Memory(frame)) => *table = Some(frame),
                None => {}
            }
        }
        self.places.into_iter().try_for_each(Output::close)?;
        Ok(tables)
    }
}
