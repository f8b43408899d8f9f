//! The tables of a sweep, written to files or collected in memory.

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

/// Position of each row of a part in the whole, for `merge`.
pub const PLACES: &str = "places.bin";

enum Goal {
    File(Sheet),
    Memory(Frame),
}

pub(super) struct Writers {
    goals: [Option<Goal>; 3],
    pub places: Option<Output>,
}

/// Tuples, designs and distances in memory; `None` for a table not requested.
pub type Tables = [Option<Frame>; 3];

fn wanted(study: &Study, plan: &Plan) -> impl Iterator<Item = Table> {
    let wanted = [plan.tuples, study.output.designs, study.output.distances];
    Table::ALL.into_iter().filter(move |table| wanted[*table as usize])
}

pub(super) fn tables(study: &Study, plan: &Plan) -> Vec<&'static str> {
    wanted(study, plan).map(Table::name).collect()
}

pub(super) fn names(study: &Study, plan: &Plan, about: &About) -> Vec<String> {
    let tables = wanted(study, plan).map(|table| table.file(about.format));
    tables.chain(about.places.then(|| PLACES.to_owned())).collect()
}

impl Writers {
    pub fn none() -> Self {
        Self { goals: [const { None }; 3], places: None }
    }

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

    /// The files until now, and the data that [`Self::new`] needs to continue them.
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

    pub fn write(&mut self, table: Table, pieces: &[Frame]) -> Result<(), Error> {
        match &mut self.goals[table as usize] {
            None => Ok(()),
            Some(Goal::File(sheet)) => sheet.write(pieces),
            Some(Goal::Memory(all)) => pieces.iter().try_for_each(|piece| all.extend(piece, 0..piece.len())),
        }
    }

    pub fn place(&mut self, mut places: impl Iterator<Item = Place>) -> Result<(), Error> {
        let Some(file) = &mut self.places else { return Ok(()) };
        places.try_for_each(|place| file.write(&pack(&place).map_err(|e| Error::Run(e.to_string()))?))
    }

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
