//! The part of a result that is complete, kept where a run stopped so that the next one goes on from there.
//!
//! The folder [`WORK`] in the result folder holds the files so far and [`STATE`], which says how far they are complete and what the run
//! knows by then. Files only grow, and a state is made durable under another name, after them, before it takes the place of the last one: at
//! any moment the state there is whole, and what it counts on is on the disk. What a file holds beyond it is cut off.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use serde::{Deserialize, Serialize};

use super::claim::{LONG, refuse};
use super::disk::{names_in, open_regular, remove_folder, sync};
use crate::error::Error;
use crate::pack::{Packer, checked};
use crate::unfinished::{self, Unfinished};

/// Where the complete part of a result lies.
pub const WORK: &str = ".vibrissa-unfinished";
/// What is known of it.
pub(super) const STATE: &str = ".state";
/// A state on its way.
const NEXT: &str = ".state-next";

/// The first line of a state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// Version of the format.
    pub format: u32,
    /// Everything of which the bytes of the result are a function, hashed.
    pub identity: String,
    /// What is complete, of how many, in words: "12 of 40 designs".
    pub done: String,
    /// Seconds of work so far.
    pub seconds: f64,
}

/// Version of the states.
const FORMAT: u32 = 1;

/// What a stopped run left.
#[derive(Debug)]
pub struct Left {
    /// What it was, and how far.
    pub head: Head,
    /// What it knew.
    pub state: Vec<u8>,
}

/// What lies in `target` for the run that is `identity`; work of another one gives way if it is short, or by `force`.
///
/// # Errors
/// Work of another run that does not give way, a damaged state, anything else under its name.
pub(super) fn look(target: &Path, identity: &str, force: bool) -> Result<Option<Left>, Error> {
    let work = target.join(WORK);
    match work.symlink_metadata() {
        Err(_) => return Ok(None),
        Ok(m) if m.is_dir() => {}
        Ok(_) => {
            let why = format!("{} is in the way and no folder of this program", work.display());
            return Err(refuse(target, why, "another folder; or move this away"));
        }
    }
    let remove = || remove_folder(&work).map_err(|e| Error::io(&work, e));
    let why = match read(&work) {
        // Nothing was complete.
        Ok(None) => return remove().map(|()| None),
        Ok(Some(left)) if left.head.identity == identity => return Ok(Some(left)),
        Ok(Some(Left { head, .. })) if head.seconds <= LONG => return remove().map(|()| None),
        Ok(Some(Left { head, .. })) => format!(
            "this folder holds an unfinished run of {:.0} s ({}) with other values or on another backend",
            head.seconds, head.done
        ),
        Err(e) => format!("the unfinished run in this folder cannot be read ({e})"),
    };
    if force {
        return remove().map(|()| None);
    }
    Err(refuse(target, why, "the command that began it, --force to discard it, or another folder"))
}

/// The state in the folder `work`, if there is one.
fn read(work: &Path) -> io::Result<Option<Left>> {
    let mut bytes = Vec::new();
    match open_regular(&work.join(STATE), OpenOptions::new().read(true)) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        other => other?.read_to_end(&mut bytes)?,
    };
    let torn = || io::Error::other("its state is damaged");
    let body = checked(&bytes).ok_or_else(torn)?;
    let end = body.iter().position(|b| *b == b'\n').ok_or_else(torn)?;
    let head: Head = serde_json::from_slice(&body[..end]).map_err(|_| torn())?;
    if head.format != FORMAT {
        return Err(io::Error::other("its state is of another version of this program"));
    }
    Ok(Some(Left { head, state: body[end + 1..].to_vec() }))
}

/// The hidden folder in which a result is written. It goes with this, unless something complete is kept in it.
#[derive(Debug)]
pub(super) struct Partial {
    path: PathBuf,
    kept: bool,
    unfinished: Unfinished,
}

impl Partial {
    /// A new one.
    pub fn new((folder, unfinished): (tempfile::TempDir, Unfinished)) -> Self {
        Self { path: folder.keep(), kept: false, unfinished }
    }

    /// That of the run which is gone on with.
    pub fn again(target: &Path) -> Self {
        let path = target.join(WORK);
        // A state that was being written when the run was stopped: it would be a stranger in the folder that goes at the end.
        let _ = fs::remove_file(path.join(NEXT));
        let unfinished = Unfinished::new(&path);
        unfinished.settle();
        Self { path, kept: true, unfinished }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it has the name under which the next run looks for it.
    pub fn is_work(&self) -> bool {
        self.path.ends_with(WORK)
    }

    /// Gives it that name, in `target`.
    pub fn rename(&mut self, target: &Path) -> io::Result<()> {
        let work = target.join(WORK);
        fs::rename(&self.path, &work)?;
        self.path = work;
        Ok(())
    }

    /// It is to stay.
    pub fn keep(&mut self) {
        self.unfinished.settle();
        self.kept = true;
    }

    /// Removes what is in it.
    pub fn clear(&self) -> io::Result<()> {
        names_in(&self.path)?.iter().try_for_each(|name| fs::remove_file(self.path.join(name)))
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        let complete = || self.is_work() && self.path.join(STATE).exists();
        if !self.kept && !complete() {
            let _ = remove_folder(&self.path);
        }
    }
}

/// A folder that goes again if nothing came into it.
#[derive(Debug)]
pub(super) struct Made(pub Option<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        let _ = self.0.as_ref().map(fs::remove_dir);
    }
}

/// States on their way to the disk, one at a time, while the run goes on.
#[derive(Debug, Default)]
pub(super) struct Saving(Option<JoinHandle<io::Result<String>>>);

impl Drop for Saving {
    fn drop(&mut self) {
        let _ = self.wait();
    }
}

impl Saving {
    /// Whether one is under way.
    pub fn busy(&self) -> bool {
        self.0.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Waits for it; what is kept then, in words, if there was one.
    pub fn wait(&mut self) -> io::Result<Option<String>> {
        let Some(thread) = self.0.take() else { return Ok(None) };
        thread.join().unwrap_or_else(|_| Err(io::Error::other("saving panicked"))).map(Some)
    }

    /// Writes a state into `work` and makes it durable after `files`, in a thread of its own.
    pub fn start(
        &mut self,
        work: &Path,
        head: &Head,
        files: Vec<File>,
        fill: impl FnOnce(&mut Packer<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let next = work.join(NEXT);
        let failed = |e| Error::io(&next, e);
        let mut file = BufWriter::new(File::create(&next).map_err(failed)?);
        let mut packer = Packer::new(&mut file);
        packer.raw(&serde_json::to_vec(head).map_err(|e| Error::Run(e.to_string()))?);
        packer.raw(b"\n");
        fill(&mut packer)?;
        packer.finish().map_err(failed)?;
        file.flush().map_err(failed)?;
        let file = file.into_inner().map_err(|e| failed(e.into_error()))?;
        let words = head.words(work.parent().unwrap_or(Path::new(".")));
        let work = work.to_owned();
        self.0 = Some(std::thread::spawn(move || {
            files.iter().try_for_each(File::sync_data)?;
            file.sync_all()?;
            fs::rename(work.join(NEXT), work.join(STATE))?;
            sync(&work)?;
            unfinished::keeping(words.clone());
            Ok(words)
        }));
        Ok(())
    }
}

impl Head {
    /// What is kept in `target`, in words.
    pub(super) fn words(&self, target: &Path) -> String {
        format!("{} are kept in {}, and the same command goes on with them", self.done, target.display())
    }

    /// Of the run `identity`.
    pub fn new(identity: &str, done: String, seconds: f64) -> Self {
        Self { format: FORMAT, identity: identity.to_owned(), done, seconds }
    }
}
