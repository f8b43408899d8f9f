//! One result in place of another, in a folder that holds other files too.
//!
//! The new result lies whole and durable in the hidden folder before anything is touched. A marker in it, [`FINISHED`], decides: before it the
//! old result stands, after it the new one, which the next run puts in place if this one cannot. In between there are only the renames.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::claim::refuse;
use super::files::{Listed, RUN, commit, is_plain, look, open_of_result, sync};
use super::work::clear;
use crate::error::Error;

/// Name of the marker of a finished result, in the hidden folder. It lists the renames.
pub(super) const FINISHED: &str = ".finished";

/// Content of the marker.
#[derive(Debug, Serialize, Deserialize)]
struct Marker {
    /// Files of the new result, `run.json` last.
    put: Vec<String>,
    /// Files of the old result, as they were found; they are replaced or removed.
    old: Vec<Listed>,
}

/// Marks the result in the hidden folder `work`, which consists of the files `put` and takes the place of `old`, as finished.
pub(super) fn decide(work: &Path, put: &[Listed], old: &[Listed]) -> io::Result<()> {
    let put = put.iter().map(|file| file.name.clone()).collect();
    commit(work, FINISHED, &serde_json::to_vec(&Marker { put, old: old.to_vec() })?)
}

/// Puts a finished result in its place, if there is one, which is given: the renames, the `run.json` last; any number of them may have been done before.
pub(super) fn carry_through(target: &Path, work: &Path) -> Result<bool, Error> {
    let path = work.join(FINISHED);
    let Some(file) = open_of_result(&path)? else { return Ok(false) };
    let text = io::read_to_string(file).map_err(|e| Error::io(&path, e))?;
    let marker = serde_json::from_str(&text).ok().filter(|Marker { put, old }| {
        put.iter().chain(old.iter().map(|file| &file.name)).all(|name| is_plain(name))
    });
    let Some(Marker { put, old }) = marker else {
        let why = format!("{} does not say what a run was about to put here", path.display());
        return Err(refuse(target, why, "another folder; or move this away: it holds files of a result"));
    };
    let waits = |name: &str| work.join(name).symlink_metadata().is_ok();
    let gone: Vec<&str> =
        old.iter().map(|file| &*file.name).filter(|name| !put.iter().any(|n| n == name)).collect();
    // Where the run.json has been moved, which comes last, all is done.
    if waits(RUN) {
        for name in gone.iter().copied().chain(put.iter().map(|name| &**name).filter(|name| waits(name))) {
            let known = old.iter().find(|file| file.name == name);
            if look(target, name)?.is_some_and(|found| known != Some(&found)) {
                let why = format!(
                    "{} was changed while the result was computed; the new result is kept, and the next run in this folder puts it in its place",
                    target.join(name).display()
                );
                return Err(refuse(target, why, "the folder without this file: move it away, or remove it"));
            }
        }
        let removed = gone.iter().map(|name| fs::remove_file(target.join(name)));
        let moved = put.iter().map(|name| fs::rename(work.join(name), target.join(name)));
        // A step that an earlier run has done already is no error.
        let done =
            removed.chain(moved).find_map(|step| step.err().filter(|e| e.kind() != ErrorKind::NotFound));
        done.map_or(Ok(()), Err).map_err(|e| Error::io(target, e))?;
    }
    sync(target).and_then(|()| clear(work)).map(|()| true).map_err(|e| Error::io(target, e))
}
