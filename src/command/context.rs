//! The context of a command: its host, files in memory, and where results go.

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use serde_json::{Value, json};

use super::Common;
use crate::backend::{Backend, Choice};
use crate::census::needed;
use crate::error::{Error, InputError};
use crate::figure::{self, Figure, Format, Style};
use crate::locate::Calibration;
use crate::measure::Data;
use crate::optimise::Watch;
use crate::progress::{Progress, go_on};
use crate::scene::{Column, RunOptions, Spec};
use crate::sink::{Folder, Frame, LabTable, Question, Sheet, TableFormat, free_memory};
use crate::{files, spec};

const OF_FILES: [&str; 5] = ["run.out", "run.force", "run.plan", "run.quiet", "run.json"];

pub trait Host {
    fn begin(&self, _options: &RunOptions) -> Result<(), Error> {
        Ok(())
    }
    fn line(&self, _text: &str) {}
    fn progress(&self, quiet: bool) -> Box<dyn Show + '_>;
    /// The stop flag of the work; `keeps`: the work then keeps its partial results.
    fn stop(&self, keeps: bool) -> &AtomicBool;
}

pub trait Show: Progress + Watch {}

impl<T: Progress + Watch> Show for T {}

pub struct HeldFile {
    /// Its name in requests and messages.
    pub name: PathBuf,
    pub content: Content,
    /// Folder for relative paths in it.
    pub base: PathBuf,
}

#[derive(Clone)]
pub enum Content {
    Bytes(Vec<u8>),
    Table(Frame),
}

impl Content {
    /// Empty for a table.
    pub fn text(&self) -> &str {
        match self {
            Self::Bytes(bytes) => std::str::from_utf8(bytes).unwrap_or_default(),
            Self::Table(_) => "",
        }
    }

    pub fn rows(&self) -> LabTable<'_> {
        match self {
            Self::Bytes(bytes) => LabTable::Text(bytes),
            Self::Table(frame) => LabTable::Frame(frame),
        }
    }
}

pub struct Context<'a> {
    pub host: &'a dyn Host,
    start: Instant,
    /// `None` if results go into folders.
    memory: Option<(Vec<HeldFile>, Option<Frame>)>,
    quiet: Cell<bool>,
    told: RefCell<Vec<String>>,
    inputs: RefCell<Vec<PathBuf>>,
    /// Path and text of the spec, and the options that may come from its `[run]` because they were not typed.
    spec: RefCell<Option<(PathBuf, String, Vec<&'static str>)>>,
}

impl<'a> Context<'a> {
    /// For results in folders; `quiet`: as the user requested.
    pub fn new(host: &'a dyn Host, quiet: bool) -> Self {
        let (told, inputs, spec) = (RefCell::default(), RefCell::default(), RefCell::default());
        Self { host, start: Instant::now(), memory: None, quiet: Cell::new(quiet), told, inputs, spec }
    }

    /// For results in memory, from these inputs; `taps` replace those of a spec.
    pub fn in_memory(host: &'a dyn Host, files: Vec<HeldFile>, taps: Option<Frame>) -> Self {
        Self { memory: Some((files, taps)), ..Self::new(host, true) }
    }

    pub fn progress(&self) -> Box<dyn Show + 'a> {
        self.host.progress(self.is_quiet())
    }

    pub fn is_quiet(&self) -> bool {
        self.quiet.get()
    }

    pub fn inputs(&self) -> Vec<PathBuf> {
        self.inputs.borrow().clone()
    }

    pub fn is_in_memory(&self) -> bool {
        self.memory.is_some()
    }

    pub fn elapsed(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    pub fn seconds(&self) -> Value {
        json!({ "total": self.elapsed() })
    }

    /// Merges the options of the command and of its spec, and starts the thread pool.
    pub fn prepared(&self, common: &Common, spec: Option<&mut Spec>) -> Result<RunOptions, Error> {
        let mut options = common.over(spec.as_ref().map_or(&RunOptions::default(), |spec| &spec.run));
        if let (Some(spec), Some(path)) = (&spec, self.inputs.borrow().last()) {
            let typed =
                [("--adapter", common.adapter.is_some()), ("--tolerance", common.tolerance.is_some())];
            let free = typed.into_iter().filter(|(_, typed)| !typed).map(|(option, _)| option).collect();
            *self.spec.borrow_mut() = Some((path.clone(), spec.text.clone(), free));
        }
        if self.is_in_memory() {
            options = RunOptions { out: None, plan: None, quiet: Some(true), ..options };
            spec.into_iter().for_each(leave_files);
        }
        self.quiet.set(options.quiet == Some(true));
        self.host.begin(&options)?;
        Ok(options)
    }

    /// Adds to an `error` about a key of the spec, or about an option from its `[run]`, the place in the spec.
    pub fn placed(&self, error: Error) -> Error {
        let Error::Input(mut e) = error else { return error };
        let spec = self.spec.borrow();
        let (Some((path, text, free)), None, Some(key)) = (&*spec, &e.file, &mut e.key) else {
            return e.into();
        };
        if free.contains(&key.as_str()) {
            *key = key.replacen("--", "run.", 1).replace('-', "_");
        }
        let section = key.split('.').next();
        match spec::keys::sections().any(|s| Some(s.name) == section) {
            true => spec::placed(&path.display().to_string(), text, e).into(),
            false => e.into(),
        }
    }

    /// Like [`Self::prepared`]; also prints the warnings about the spec.
    pub fn begun(&self, common: &Common, spec: &mut Spec) -> Result<RunOptions, Error> {
        let options = self.prepared(common, Some(&mut *spec))?;
        self.warn_all(&spec.warnings);
        Ok(options)
    }

    pub fn line(&self, text: impl AsRef<str>) {
        if !self.is_quiet() {
            self.host.line(text.as_ref());
        }
    }

    pub fn warn(&self, text: &str) {
        self.line(format!("warning: {text}"));
        self.told.borrow_mut().push(text.to_owned());
    }

    pub fn warn_all<T: AsRef<str>>(&self, all: impl IntoIterator<Item = T>) {
        all.into_iter().for_each(|text| self.warn(text.as_ref()));
    }

    pub fn told(&self) -> Vec<String> {
        self.told.borrow().clone()
    }

    fn held(&self, path: &Path) -> Option<&HeldFile> {
        self.memory.as_ref()?.0.iter().find(|file| file.name == path)
    }

    pub fn data(&self, path: &Path) -> Result<Cow<'_, Content>, InputError> {
        self.inputs.borrow_mut().push(path.to_owned());
        match self.held(path) {
            Some(file) => Ok(Cow::Borrowed(&file.content)),
            None => Data::load(path).map(|bytes| Cow::Owned(Content::Bytes(bytes))),
        }
    }

    /// Reads the `what` file at `path` by `parse`, which receives label, text and base folder.
    pub fn read<T>(
        &self,
        path: &Path,
        what: &str,
        parse: impl FnOnce(&str, &str, &Path) -> Result<T, InputError>,
    ) -> Result<T, InputError> {
        self.inputs.borrow_mut().push(path.to_owned());
        let label = path.display().to_string();
        match self.held(path) {
            Some(file) => parse(&label, file.content.text(), &file.base),
            None => parse(&label, &spec::load(path, what)?, path.parent().unwrap_or(Path::new(""))),
        }
    }

    pub fn calibration(&self, path: &Path, trust: bool) -> Result<Calibration, InputError> {
        match path.is_dir() {
            true => Calibration::read(path, trust),
            false => self.read(path, "calibration", |label, text, _| Calibration::parse(label, text, trust)),
        }
    }

    /// The strain change up to which effects may be left off: typed, or from `[run]` of the spec.
    pub fn model_error(&self, said: Option<f64>, spec: &Spec, choice: &Choice) -> Result<Option<f64>, Error> {
        if let (None, Some((_, _, free))) = (said, &mut *self.spec.borrow_mut()) {
            free.push("--model-error");
        }
        needed::bound(said.or(spec.run.model_error), spec, choice)
    }

    pub fn settle(
        &self,
        spec: &mut Spec,
        options: &RunOptions,
        (backend, bound, out): (&Backend, Option<f64>, &Path),
    ) {
        files::settle(spec, options, backend, out);
        spec.in_force.extend(bound.map(|e| ("run.model_error".to_owned(), format!("{e:?}"), true)));
        if self.is_in_memory() {
            leave_files(spec);
        }
    }

    /// The spec at `path`; taps in memory replace its taps.
    pub fn spec(&self, path: &Path) -> Result<Spec, Error> {
        let Some(taps) = self.memory.as_ref().and_then(|(_, taps)| taps.as_ref()) else {
            return Ok(self.read(path, "spec", spec::parse)?);
        };
        let parse = |label: &str, text: &str, base: &Path| spec::parse_listed(label, text, base, Some(taps));
        let mut spec = self.read(path, "spec", parse)?;
        let kind = spec.study.setup.drive;
        let of_tuples = |key: &str| Column::ALL.iter().any(|c| key.ends_with(&format!(".{}", c.key(kind))));
        spec.in_force.retain(|(key, ..)| !of_tuples(key));
        Ok(spec)
    }

    pub fn room(&self, bytes_of_row: u64) -> u64 {
        let memory = self.memory.as_ref().and_then(|_| free_memory());
        memory.map_or(u64::MAX, |bytes| bytes / bytes_of_row)
    }

    /// Opens a result at `out` that answers `question` with files of these `names`; all files read are its inputs.
    pub fn open(
        &self,
        out: &Path,
        mut question: Question,
        names: &[&str],
        force: Option<bool>,
    ) -> Result<Destination<'_>, Error> {
        let (command, out, force, kept) = (question.command, out.to_owned(), force == Some(true), Vec::new());
        let mut destination = Destination { context: self, command, out, force, folder: None, kept };
        if !self.is_in_memory() {
            question.inputs.extend(self.inputs());
            destination.folder = Some(Folder::open(&destination.out, question, names, force)?);
        }
        Ok(destination)
    }

    pub fn go_on(&self) -> Result<(), Error> {
        Ok(go_on(self.host.stop(false))?)
    }
}

fn leave_files(spec: &mut Spec) {
    spec.in_force.retain(|(key, ..)| !OF_FILES.contains(&key.as_str()));
}

/// A result in progress: in the folder `out`, or kept in memory by name.
pub struct Destination<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) command: &'static str,
    pub(super) out: PathBuf,
    pub(super) force: bool,
    pub(super) folder: Option<Folder>,
    pub(super) kept: Vec<(String, Content)>,
}

impl Destination<'_> {
    pub fn put(&mut self, name: &str, bytes: Vec<u8>) -> Result<(), Error> {
        if let Some(folder) = &mut self.folder {
            return folder.put(name, &bytes);
        }
        self.kept.push((name.to_owned(), Content::Bytes(bytes)));
        Ok(())
    }

    pub fn table(&mut self, table: Frame) -> Result<(), Error> {
        if let Some(folder) = &mut self.folder {
            return folder.put(&table.file, &table.csv()?);
        }
        self.keep(table);
        Ok(())
    }

    pub fn rows<T>(
        &mut self,
        empty: Frame,
        make: impl FnOnce(&mut dyn FnMut(&Frame) -> Result<(), Error>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let mut sheet = match &mut self.folder {
            Some(folder) => Sheet::new(TableFormat::Csv, folder.file(&empty.file)?, (&empty, ""), None)?,
            None => Sheet::Memory(empty),
        };
        let made = make(&mut |some| sheet.write(std::slice::from_ref(some)))?;
        sheet.close()?.into_iter().for_each(|table| self.keep(table));
        Ok(made)
    }

    pub fn stream<T>(
        &mut self,
        name: &str,
        make: impl FnOnce(&mut dyn FnMut(&[u8]) -> Result<(), Error>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let folder = self.folder.as_mut().ok_or_else(|| Error::Run(format!("{name} is a file alone")))?;
        let mut file = folder.file(name)?;
        let made = make(&mut |some| file.write(some))?;
        file.close()?;
        Ok(made)
    }

    pub fn keep(&mut self, table: Frame) {
        let name = table.file.trim_end_matches(".csv").to_owned();
        self.kept.push((name, Content::Table(table)));
    }

    /// Writes a figure as SVG into a folder; skipped in memory.
    pub fn draw(&mut self, name: &str, figure: impl FnOnce() -> Result<Figure, Error>) -> Result<(), Error> {
        let Some(folder) = &mut self.folder else { return Ok(()) };
        let drawn = figure::files(&figure()?, &Style::default(), &[Format::Svg])?;
        drawn.iter().try_for_each(|(_, bytes)| folder.put(name, bytes))
    }
}
