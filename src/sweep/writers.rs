//! The tables of a sweep while they are written.

use super::About;
use crate::error::Error;
use crate::plan::Plan;
use crate::scene::Study;
use crate::sink::folder::{Folder, Mark, Output};
use crate::sink::pack::{Packed, Packer, Unpacker};
use crate::sink::rows::{Rows, TableFormat};
use crate::sink::sheet::{self, Sheet};
use crate::sink::table::Table;

/// Where each row of a part stands in the whole, for `merge`.
pub const PLACES: &str = "places.bin";

/// The open table files; `None` for a table that is not written.
pub(super) struct Writers {
    files: [Option<Sheet>; 3],
    /// Places of the rows of a part, where these do not follow from it.
    places: Option<Output>,
    /// Of rows that are made for these files.
    pub format: TableFormat,
}

/// Which tables are written.
fn wanted(study: &Study, plan: &Plan) -> [bool; 3] {
    [plan.tuples, study.output.designs, study.output.distances]
}

/// Names of the tables that are written.
pub(super) fn tables(study: &Study, plan: &Plan) -> Vec<&'static str> {
    Table::ALL
        .into_iter()
        .zip(wanted(study, plan))
        .filter(|(_, wanted)| *wanted)
        .map(|(t, _)| t.name())
        .collect()
}

/// Names of the files that are written.
pub(super) fn names(study: &Study, plan: &Plan, about: &About) -> Vec<String> {
    let tables = Table::ALL.into_iter().zip(wanted(study, plan)).filter(|(_, wanted)| *wanted);
    let tables = tables.map(|(table, _)| table.file(about.format));
    tables.chain(about.places.then(|| PLACES.to_owned())).collect()
}

impl Writers {
    /// Writes nothing.
    pub fn none() -> Self {
        Self { files: [None, None, None], places: None, format: TableFormat::Csv }
    }

    /// New tables in `folder`.
    pub fn new(study: &Study, plan: &Plan, about: &About, folder: &mut Folder) -> Result<Self, Error> {
        let mut files = [None, None, None];
        for (table, file) in Table::ALL.into_iter().zip(&mut files) {
            if wanted(study, plan)[table as usize] {
                let columns = table.columns(&study.setup);
                *file = Some(Sheet::new(folder, &about.sheet(table, &columns))?);
            }
        }
        let places = about.places.then(|| folder.file(PLACES)).transpose()?;
        Ok(Self { files, places, format: about.format })
    }

    /// Those whose [`Self::pack`] is `state`; `None` where they are not what they were.
    pub fn resume(
        study: &Study,
        plan: &Plan,
        about: &About,
        folder: &mut Folder,
        state: &mut Unpacker<'_>,
    ) -> Result<Option<Self>, Error> {
        let mut files = [None, None, None];
        for (table, file) in Table::ALL.into_iter().zip(&mut files) {
            if wanted(study, plan)[table as usize] {
                let columns = table.columns(&study.setup);
                let Some(sheet) = Sheet::resume(folder, &about.sheet(table, &columns), state)? else {
                    return Ok(None);
                };
                *file = Some(sheet);
            }
        }
        let mut places = None;
        if about.places {
            let Some(mark) = state.take::<Mark>() else { return Ok(None) };
            places = folder.file_again(PLACES, &mark)?;
            if places.is_none() {
                return Ok(None);
            }
        }
        Ok(Some(Self { files, places, format: about.format }))
    }

    /// What [`Self::resume`] needs beside the files as they are now.
    pub fn pack(&mut self, to: &mut Packer<'_>) -> Result<(), Error> {
        self.files.iter_mut().flatten().try_for_each(|file| file.pack(to))?;
        self.places.iter_mut().try_for_each(|file| file.mark().map(|mark| mark.pack(to)))
    }

    /// The files, to make them durable.
    pub fn handles(&mut self) -> Result<Vec<std::fs::File>, Error> {
        let tables = self.files.iter_mut().flatten().map(|sheet| sheet.output().handle());
        tables.chain(self.places.iter().map(Output::handle)).collect()
    }

    pub fn wants(&self, table: Table) -> bool {
        self.files[table as usize].is_some()
    }

    /// Appends rows to a table, if it is written.
    pub fn write(&mut self, table: Table, rows: Rows) -> Result<(), Error> {
        match &mut self.files[table as usize] {
            Some(sheet) => sheet.write(rows),
            None => Ok(()),
        }
    }

    /// Appends places of rows, where they are kept.
    pub fn place(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.places.iter_mut().try_for_each(|file| file.write(bytes))
    }

    pub fn close(self) -> Result<(), Error> {
        self.files.into_iter().flatten().try_for_each(Sheet::close)?;
        self.places.into_iter().try_for_each(Output::close)
    }
}

impl About {
    fn sheet<'a>(&'a self, table: Table, columns: &'a [&'a str]) -> sheet::About<'a> {
        sheet::About { table, columns, format: self.format, provenance: &self.provenance }
    }
}
