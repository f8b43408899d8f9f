//! The state of a run: how far its files are complete, and what it knows by then, so that the same command goes on from there.
//!
//! Files only grow, and a state is made durable under another name, after them, before it takes the place of the last one: at any moment the state
//! there is whole, and what it counts on is on the disk.

use std::fs::{self, OpenOptions};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use serde::{Deserialize, Serialize};

use super::files::{create, names_in, open_regular};
use super::place::sync;
use super::work::completing;
use crate::error::Error;
use crate::pack::{Packer, checked};

/// Name of the state in the hidden folder.
pub(super) const STATE: &str = ".state";
/// Name under which it is written before it counts.
const NEXT: &str = ".state-next";
/// Version of the states.
const FORMAT: u32 = 1;

/// What a stopped run left. All but the bytes is the first line of the file.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Left {
    format: u32,
    /// Everything of which the bytes of the result are a function, hashed.
    pub identity: String,
    /// What is complete, of how many, in words: "12 of 40 designs".
    pub done: String,
    /// Seconds of work so far.
    pub seconds: f64,
    /// The rest, as the sweep packed it.
    #[serde(skip)]
    pub state: Vec<u8>,
    /// The result folder.
    #[serde(skip)]
    target: PathBuf,
}

impl Left {
    /// Of the run `identity`, whose bytes are not packed yet.
    pub fn new(identity: &str, done: String, seconds: f64) -> Self {
        let (format, identity) = (FORMAT, identity.to_owned());
        Self { format, identity, done, seconds, state: Vec::new(), target: PathBuf::new() }
    }

    /// What the hidden folder `work` holds, if anything.
    pub(super) fn read(work: &Path) -> io::Result<Option<Self>> {
        let mut bytes = Vec::new();
        match open_regular(&work.join(STATE), OpenOptions::new().read(true)) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            other => other?.read_to_end(&mut bytes)?,
        };
        let left = || {
            let body = checked(&bytes)?;
            let end = body.iter().position(|b| *b == b'\n')?;
            let left = serde_json::from_slice(&body[..end]).ok()?;
            let target = work.parent()?.to_owned();
            Some(Self { state: body[end + 1..].to_vec(), target, ..left })
        };
        match left() {
            Some(left) if left.format == FORMAT => Ok(Some(left)),
            Some(_) => Err(io::Error::other("its state is of another version of this program")),
            None => Err(io::Error::other("its state is damaged")),
        }
    }

    /// What is kept, in words.
    pub(super) fn words(&self) -> String {
        format!("{} are kept in {}, and the same command goes on with them", self.done, self.target.display())
    }
}

/// Writes states to the disk in a thread of its own, one at a time, while the run continues.
#[derive(Debug, Default)]
pub(super) struct Saving(Option<JoinHandle<io::Result<()>>>);

impl Saving {
    /// True while a state is being written.
    pub fn busy(&self) -> bool {
        self.0.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Waits for the state that is being written, if any.
    pub fn wait(&mut self) -> io::Result<()> {
        let Some(thread) = self.0.take() else { return Ok(()) };
        thread.join().unwrap_or_else(|_| Err(io::Error::other("saving panicked")))
    }

    /// Writes into `work` the state that begins with `head` and goes on as `fill` says, and makes it durable after all other files there.
    pub fn start(
        &mut self,
        work: &Path,
        head: &Left,
        fill: impl FnOnce(&mut Packer<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let next = work.join(NEXT);
        let failed = |e| Error::io(&next, e);
        let mut file = BufWriter::new(create(&next).map_err(failed)?);
        let mut packer = Packer::new(&mut file);
        serde_json::to_writer(&mut packer, head).map_err(|e| failed(e.into()))?;
        packer.write_all(b"\n").map_err(failed)?;
        fill(&mut packer)?;
        packer.finish().map_err(failed)?;
        drop(file.into_inner().map_err(|e| failed(e.into_error()))?);
        let work = work.to_owned();
        self.0 = Some(std::thread::spawn(move || {
            for name in names_in(&work)? {
                // What else was put there is no work of this run.
                let path = work.join(name);
                if path.symlink_metadata().is_ok_and(|there| there.is_file()) {
                    OpenOptions::new().write(true).open(path)?.sync_data()?;
                }
            }
            completing(false, || fs::rename(&next, work.join(STATE)))?;
            sync(&work)
        }));
        Ok(())
    }
}

impl Drop for Saving {
    fn drop(&mut self) {
        let _ = self.wait();
    }
}
