//! The state of a run: how far its files are complete, and what the run knows by then. The same command continues from it.
//!
//! Files only grow. A state is written under another name, after all files are durable, and then takes the place of the last one. So at any
//! moment the state is whole, and what it counts on is on the disk.

use std::fs::OpenOptions;
use std::io::{self, Read};
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::files::{commit, names_in, open_regular};
use super::hash::hash_bytes;
use super::work::completing;

/// Name of the state in the hidden folder.
pub(super) const STATE: &str = ".state";
/// Version of the states.
const FORMAT: u32 = 2;
/// Characters of the hash with which a state begins.
const HASH: usize = 64;

/// What a stopped run left. All but the bytes is a line of JSON in the file, behind the hash of what follows.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Left {
    format: u32,
    /// Everything of which the bytes of the result are a function, hashed.
    pub identity: String,
    /// What is complete, of how many, in words: "12 of 40 designs".
    pub done: String,
    /// Seconds of work so far.
    pub seconds: f64,
    /// The rest, as [`pack`] made it.
    #[serde(skip)]
    state: Vec<u8>,
}

/// A value as bytes, exactly.
pub fn pack(value: &impl Serialize) -> io::Result<Vec<u8>> {
    postcard::to_stdvec(value).map_err(io::Error::other)
}

/// The values that were packed, one behind the other; `None` where the bytes are something else.
pub fn unpack<T: DeserializeOwned>(mut bytes: &[u8]) -> Option<Vec<T>> {
    let mut all = Vec::new();
    while !bytes.is_empty() {
        let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
        // A value without bytes would come for ever.
        if rest.len() == bytes.len() {
            return None;
        }
        all.push(value);
        bytes = rest;
    }
    Some(all)
}

impl Left {
    /// Of the run `identity`, which knows `state`.
    pub fn new(identity: &str, done: String, seconds: f64, state: &impl Serialize) -> io::Result<Self> {
        Ok(Self { format: FORMAT, identity: identity.to_owned(), done, seconds, state: pack(state)? })
    }

    /// What the run knew.
    pub fn state<T: DeserializeOwned>(&self) -> Option<T> {
        unpack(&self.state)?.pop()
    }

    /// What the hidden folder `work` holds, if anything.
    pub(super) fn read(work: &Path) -> io::Result<Option<Self>> {
        let mut bytes = Vec::new();
        match open_regular(&work.join(STATE), OpenOptions::new().read(true)) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            other => other?.read_to_end(&mut bytes)?,
        };
        let left = || {
            let (check, body) = bytes.split_at_checked(HASH)?;
            let end = body.iter().position(|b| *b == b'\n')?;
            let left: Self = serde_json::from_slice(&body[..end]).ok()?;
            (hash_bytes(body).as_bytes() == check).then(|| Self { state: body[end + 1..].to_vec(), ..left })
        };
        match left() {
            Some(left) if left.format == FORMAT => Ok(Some(left)),
            Some(_) => Err(io::Error::other("its state is of another version of this program")),
            None => Err(io::Error::other("its state is damaged")),
        }
    }

    /// Makes the files in `work` durable as they are, and then this their state.
    pub(super) fn write(&self, work: &Path) -> io::Result<()> {
        for path in names_in(work)?.iter().map(|name| work.join(name)) {
            // Folders and links that were put there are not of this run.
            if path.symlink_metadata().is_ok_and(|there| there.is_file()) {
                OpenOptions::new().write(true).open(path)?.sync_data()?;
            }
        }
        let body = [&serde_json::to_vec(self)?[..], b"\n", &self.state].concat();
        let whole = [hash_bytes(&body).as_bytes(), &body].concat();
        completing(false, || commit(work, STATE, &whole))
    }

    /// What is kept in the folder `target`, in words.
    pub(super) fn words(&self, target: &Path) -> String {
        format!("{} are kept in {}, and the same command goes on with them", self.done, target.display())
    }
}
