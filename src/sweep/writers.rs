//! The tables of a sweep while they are written, or gathered in memory.

use super::About;
use crate::error::Error;
use crate::plan::Plan;
use crate::scene::Study;
use crate::sink::columns::Columns;
use crate::sink::folder::{Folder, Mark, Output};
use crate::sink::memory;
use crate::sink::pack::{Packed, Packer, Unpacker};
use crate::sink::rows::{Form, Rows};
use crate::sink::sheet::{self, Sheet};
use crate::sink::table::Table;

/// Where each row of a part stands in the whole, for `merge`.
pub const PLACES: &str = "places.bin";

/// Where a table goes.
enum Goal {
    File(Box<Sheet>),
    Memory(Columns),
}

/// Where the tables go; `None` for a table that nobody asked for.
pub(super) struct Writers {
    goals: [Option<Goal>; 3],
    /// Places of the rows of a part, where these do not follow from it.
    places: Option<Output>,
    /// Of rows that are made for them.
    pub form: Form,
}

/// Tuples, designs and distances in memory; `None` for a table that was not asked for.
pub type Tables = [Option<Columns>; 3];

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
        Self { goals: [const { None }; 3], places: None, form: Form::Text }
    }

    /// Gathers tables in memory, with room for all rows of `plan`.
    ///
    /// # Errors
    /// More rows than there is memory for.
    pub fn in_memory(study: &Study, plan: &Plan) -> Result<Self, Error> {
        let mut goals = [const { None }; 3];
        let bytes = wanted(study, plan).map(|table| {
            let width = table.columns(&study.setup).len() as u64;
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
            let columns = Columns::with_room(&table.columns(&study.setup), plan.rows[table as usize])?;
            goals[table as usize] = Some(Goal::Memory(columns));
        }
        Ok(Self { goals, places: None, form: Form::Columns })
    }

    /// New tables in `folder`.
    pub fn new(study: &Study, plan: &Plan, about: &About, folder: &mut Folder) -> Result<Self, Error> {
        let mut goals = [const { None }; 3];
        for table in wanted(study, plan) {
            let columns = table.columns(&study.setup);
            let sheet = Sheet::new(folder, &about.sheet(table, &columns))?;
            goals[table as usize] = Some(Goal::File(Box::new(sheet)));
        }
        let places = about.places.then(|| folder.file(PLACES)).transpose()?;
        Ok(Self { goals, places, form: about.format.form() })
    }

    /// Those whose [`Self::pack`] is `state`; `None` where they are not what they were.
    pub fn resume(
        study: &Study,
        plan: &Plan,
        about: &About,
        folder: &mut Folder,
        state: &mut Unpacker<'_>,
    ) -> Result<Result<Self, String>, Error> {
        let mut goals = [const { None }; 3];
        for table in wanted(study, plan) {
            let columns = table.columns(&study.setup);
            let Some(sheet) = Sheet::resume(folder, &about.sheet(table, &columns), state)? else {
                return Ok(Err(table.file(about.format)));
            };
            goals[table as usize] = Some(Goal::File(Box::new(sheet)));
        }
        let mut places = None;
        if about.places {
            places = match state.take::<Mark>() {
                Some(mark) => folder.file_again(PLACES, &mark)?,
                None => None,
            };
            if places.is_none() {
                return Ok(Err(PLACES.to_owned()));
            }
        }
        Ok(Ok(Self { goals, places, form: about.format.form() }))
    }

    /// What [`Self::resume`] needs beside the files as they are now.
    pub fn pack(&mut self, to: &mut Packer<'_>) -> Result<(), Error> {
        self.files().try_for_each(|file| file.pack(to))?;
        self.places.iter_mut().try_for_each(|file| file.mark().map(|mark| mark.pack(to)))
    }

    fn files(&mut self) -> impl Iterator<Item = &mut Sheet> {
        self.goals.iter_mut().flatten().filter_map(|goal| match goal {
            Goal::File(sheet) => Some(&mut **sheet),
            Goal::Memory(_) => None,
        })
    }

    pub fn wants(&self, table: Table) -> bool {
        self.goals[table as usize].is_some()
    }

    /// Appends rows to a table, if it is written.
    pub fn write(&mut self, table: Table, rows: Rows) -> Result<(), Error> {
        match (&mut self.goals[table as usize], rows) {
            (None, _) => Ok(()),
            (Some(Goal::File(sheet)), rows) => sheet.write(rows),
            // Rows of which there are none have no width.
            (Some(Goal::Memory(_)), Rows::Columns(none)) if none.is_empty() => Ok(()),
            (Some(Goal::Memory(all)), Rows::Columns(more)) => all.extend(&more, 0..more.len()),
            (Some(Goal::Memory(_)), Rows::Text(_)) => Err(Error::Run("rows of another format".into())),
        }
    }

    /// Appends places of rows, where they are kept.
    pub fn place(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.places.iter_mut().try_for_each(|file| file.write(bytes))
    }

    /// Ends the files; what was gathered in memory.
    pub fn close(self) -> Result<Tables, Error> {
        let mut tables = Tables::default();
        for (goal, table) in self.goals.into_iter().zip(&mut tables) {
            match goal {
                Some(Goal::File(sheet)) => sheet.close()?,
                Some(Goal::Memory(columns)) => *table = Some(columns),
                None => {}
            }
        }
        self.places.into_iter().try_for_each(Output::close)?;
        Ok(tables)
    }
}

impl About {
    fn sheet<'a>(&'a self, table: Table, columns: &'a [&'a str]) -> sheet::About<'a> {
        sheet::About { table, columns, format: self.format, provenance: &self.provenance }
    }
}
