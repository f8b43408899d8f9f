//! The end of a result folder: all files in their place, or nothing changed and what was written kept aside.

use std::fs;
use std::path::Path;

use super::record::RUN;
use super::{Folder, RESULT, UNPLACED, Written, disk, replace, work};
use crate::error::Error;
use crate::unfinished;

impl Folder {
    /// Puts all files in their final place, at once or, where a folder is there, by renames that are always carried through.
    pub fn finish(mut self) -> Result<Written, Error> {
        self.kept()?;
        let at = |name: &String| self.target.join(name);
        let removed = self.old.files.iter().filter(|_| self.old.forced).map(|(f, _)| at(&f.name)).collect();
        let files = self.names.iter().map(at).collect();
        let durable = self.closed.sync().map_err(|e| Error::io(&self.target, e));
        if let Err(e) = self.closed.check(self.partial.path(), Some(true)) {
            return Err(self.broken(&e));
        }
        self.partial.keep();
        unfinished::placing();
        let placed = durable.and_then(|()| if self.inside { self.replace() } else { self.place() });
        match placed {
            Ok(()) => {
                self.closed.check(&self.target, None).map(|()| Written { files, removed, _lock: self.lock })
            }
            Err(e) => {
                let here = self.partial.path();
                let whole = !here.exists() || self.closed.check(here, Some(false)).is_ok();
                Err(if whole { self.set_aside(&e) } else { self.broken(&e) })
            }
        }
    }

    fn replace(&self) -> Result<(), Error> {
        if let Some(name) = replace::obstacle(&self.target, &self.names, &self.old) {
            let error = std::io::Error::other("this was changed while the result was computed");
            return Err(Error::io(self.target.join(name), error));
        }
        let check = |at: &Path| self.closed.check(at, Some(false));
        replace::replace(&self.target, self.partial.path(), (&self.names, &self.old), check)
    }

    fn place(&self) -> Result<(), Error> {
        let (from, failed) = (self.partial.path(), |e| Error::io(&self.target, e));
        disk::sync(from).and_then(|()| fs::rename(from, &self.target)).map_err(failed)?;
        if let Err(e) = self.closed.check(&self.target, Some(false)) {
            fs::rename(&self.target, from).map_err(failed)?;
            return Err(e);
        }
        disk::sync(self.lock.place()).map_err(failed)
    }

    /// Keeps the files that are left of a result of which one was touched, under another name; they are no result.
    fn broken(self, why: &Error) -> Error {
        let folder = self.partial.path();
        for name in [RUN, work::STATE] {
            let _ = fs::remove_file(folder.join(name));
        }
        // One that is empty goes.
        match fs::remove_dir(folder).is_ok() || !folder.exists() {
            true => Error::Run(why.to_string()),
            false => self.set_aside(why),
        }
    }

    /// Keeps a whole result that found something in its way, under another name.
    fn set_aside(self, why: &Error) -> Error {
        let from = self.partial.path();
        if !from.exists() {
            return Error::Run(format!("{why}; the next run in this folder puts the new result in place"));
        }
        let random = from.file_name().unwrap_or_default().to_string_lossy();
        let random = random.rsplit('-').next().unwrap_or_default();
        let name = match self.inside {
            true => RESULT.into(),
            false => self.target.file_name().unwrap_or_default().to_string_lossy(),
        };
        let kept = self.lock.place().join(format!("{name}{UNPLACED}{random}"));
        match fs::rename(from, &kept) {
            Ok(()) => Error::Run(format!("{why}; what was written is kept in {}", kept.display())),
            Err(_) => Error::Run(why.to_string()),
        }
    }
}
