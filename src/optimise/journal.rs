//! Every evaluation of a search in the order in which it was made, so that a search that was stopped continues exactly.
//!
//! A search is a deterministic function of its spec, its seed and the scores it gets. `--resume` runs it again from the start and
//! takes the scores of the journal while there are any: the same swarms, the same polishes, then on from where it
//! stopped. A record is the bits of a [`Score`] behind a check of what was scored; a torn last record, or
//! a torn last batch, is dropped and evaluated again.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::score::{Limit, Score};
use crate::error::{Error, InputError};
use crate::scene::Tuple;
use crate::sink::folder::{JOURNAL, hash, open_regular};

/// Numbers of a record behind its check.
const NUMBERS: usize = 3 + Limit::WORDS.len();
/// Bytes of a record.
const RECORD: usize = 8 * (1 + NUMBERS);

/// A journal that is read to its end, then written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    old: Vec<u8>,
    at: usize,
    /// Bytes of the file that hold.
    end: u64,
    /// Evaluations of an older journal that gave way to this one although no result holds them.
    pub discarded: u64,
}

impl Journal {
    /// In folder `out`, for the search that `identity` describes; with `resume` an older journal of the same search is
    /// continued. Without it the search begins anew: an older journal of the same search gives way, with `force` any.
    ///
    /// # Errors
    /// Nothing to resume, an older journal of another search, a file that cannot be read or written.
    pub fn new(out: &Path, identity: &str, resume: bool, force: bool) -> Result<Self, Error> {
        let path = out.join(JOURNAL);
        let header = format!("vibrissa search 1 {}\n", hash(identity));
        let mut old = Vec::new();
        if resume {
            let refuse = |why: &str| {
                InputError::new(why)
                    .key("--resume")
                    .value(out.display())
                    .allowed("the folder of an unfinished search of the same spec, seed and backend")
            };
            open_regular(&path, OpenOptions::new().read(true))
                .and_then(|mut f| f.read_to_end(&mut old))
                .map_err(|_| refuse("this folder holds no unfinished search"))?;
            if !old.starts_with(header.as_bytes()) {
                return Err(refuse("the unfinished search in this folder is another one").into());
            }
            old.drain(..header.len());
            old.truncate(old.len() / RECORD * RECORD);
        }
        let fail = |e| Error::io(&path, e);
        let (file, discarded) = match resume {
            true => (open_regular(&path, OpenOptions::new().write(true)).map_err(fail)?, 0),
            false => begin(&path, out, &header, force)?,
        };
        let end = (header.len() + old.len()) as u64;
        Ok(Self { path, file, old, at: 0, end, discarded })
    }

    /// Evaluations that are known from before.
    pub fn known(&self) -> u64 {
        (self.old.len() / RECORD) as u64
    }

    /// The scores of `points` if all of them are known.
    pub fn replay(&mut self, stage: u64, points: &[Tuple]) -> Result<Option<Vec<Score>>, Error> {
        let end = self.at + points.len() * RECORD;
        if self.at == self.old.len() {
            return Ok(None);
        }
        if end > self.old.len() {
            self.end -= (self.old.len() - self.at) as u64;
            self.old.truncate(self.at);
            return Ok(None);
        }
        let mut scores = Vec::with_capacity(points.len());
        for (record, point) in self.old[self.at..end].chunks_exact(RECORD).zip(points) {
            let mut words =
                record.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().expect("eight bytes")));
            if words.next() != Some(check(stage, point)) {
                let why = "does not belong to this search; start again without --resume";
                return Err(Error::Run(format!("{} {why}", self.path.display())));
            }
            let mut numbers = words.map(f64::from_bits);
            let mut next = || numbers.next().expect("as many numbers as a score has");
            scores.push(Score {
                figures: std::array::from_fn(|_| next()),
                limits: std::array::from_fn(|_| next()),
            });
        }
        self.at = end;
        Ok(Some(scores))
    }

    /// Appends a batch that was evaluated.
    pub fn append(&mut self, stage: u64, points: &[Tuple], scores: &[Score]) -> Result<(), Error> {
        let mut bytes = Vec::with_capacity(points.len() * RECORD);
        for (point, score) in points.iter().zip(scores) {
            bytes.extend(check(stage, point).to_le_bytes());
            for x in score.figures.iter().chain(&score.limits) {
                bytes.extend(x.to_bits().to_le_bytes());
            }
        }
        let fail = |e| Error::io(&self.path, e);
        // What stands behind the known records is torn.
        self.file.set_len(self.end).map_err(fail)?;
        self.file.seek(SeekFrom::Start(self.end)).map_err(fail)?;
        self.file.write_all(&bytes).map_err(fail)?;
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// The search is finished: nothing is left to resume.
    pub fn remove(self) -> Result<(), Error> {
        drop(self.file);
        match std::fs::remove_file(&self.path) {
            // Somebody else has: the search is whole without it.
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
            done => done.map_err(|e| Error::io(&self.path, e)),
        }
    }
}

/// A new journal in place of an older one of the same search, with `force` of any, and the evaluations that are lost with that. Whatever else has its
/// name is refused, and what other names lead to is not written to.
fn begin(path: &Path, out: &Path, header: &str, force: bool) -> Result<(File, u64), Error> {
    let refuse = |why: String, allowed: &str| {
        let error = InputError::new(format!("{why}; nothing was changed"));
        error.key("--out").value(out.display()).allowed(allowed)
    };
    let mut lost = 0;
    match path.symlink_metadata() {
        Err(_) => {}
        Ok(m) if m.is_file() => {
            lost = m.len().saturating_sub(header.len() as u64) / RECORD as u64;
            if lost > 0 && !force && !is_of(path, header) {
                let why = format!(
                    "this folder holds an unfinished search of {lost} evaluations with other values or on another backend"
                );
                return Err(refuse(why, "--force to discard it, or another folder").into());
            }
            std::fs::remove_file(path).map_err(|e| Error::io(path, e))?;
        }
        Ok(_) => {
            let why = format!("{} is in the way and no regular file", path.display());
            return Err(refuse(why, "another folder; or move this away").into());
        }
    }
    let mut file = File::create_new(path).map_err(|e| Error::io(path, e))?;
    file.write_all(header.as_bytes()).map_err(|e| Error::io(path, e))?;
    Ok((file, lost))
}

/// Whether the file at `path` begins with this header.
fn is_of(path: &Path, header: &str) -> bool {
    let mut text = Vec::new();
    let read = open_regular(path, OpenOptions::new().read(true))
        .and_then(|file| file.take(header.len() as u64).read_to_end(&mut text));
    read.is_ok() && text == header.as_bytes()
}

/// FNV-1a of what is scored.
fn check(stage: u64, point: &Tuple) -> u64 {
    let rig = (point.rig > 0).then_some(point.rig);
    let words = std::iter::once(stage).chain(point.to_array().map(f64::to_bits)).chain(rig);
    words
        .flat_map(u64::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(d: f64) -> Tuple {
        Tuple { d, ..Tuple::default() }
    }

    fn score(x: f64) -> Score {
        Score { figures: [x; 3], ..Score::NOTHING }
    }

    #[test]
    fn what_was_evaluated_comes_back_and_torn_batches_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let new = |search: &str, resume, force| Journal::new(folder.path(), search, resume, force);
        let open = |resume| new("search", resume, false);
        let mut journal = open(false).unwrap();
        journal.append(0, &[point(1.0), point(2.0)], &[score(1.0), score(2.0)]).unwrap();
        journal.append(1, &[point(3.0), point(4.0)], &[score(3.0), score(4.0)]).unwrap();
        drop(journal);
        let path = folder.path().join(JOURNAL);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 5]).unwrap();

        let mut journal = open(true).unwrap();
        assert_eq!(journal.known(), 3);
        assert_eq!(journal.replay(0, &[point(1.0), point(2.0)]).unwrap(), Some(vec![score(1.0), score(2.0)]));
        assert_eq!(journal.replay(1, &[point(3.0), point(4.0)]).unwrap(), None);
        journal.append(1, &[point(3.0), point(4.0)], &[score(3.0), score(4.0)]).unwrap();
        drop(journal);
        assert_eq!(std::fs::read(&path).unwrap(), whole);

        assert!(open(true).unwrap().replay(0, &[point(7.0)]).is_err(), "another point");
        assert_eq!(new("another search", true, true).unwrap_err().exit_code(), 2);
        let kept = new("another search", false, false).unwrap_err();
        assert!(kept.exit_code() == 2 && kept.to_string().contains("other values"), "{kept}");
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        assert_eq!(open(false).unwrap().discarded, 4, "the same search begins anew");
        std::fs::write(&path, &whole).unwrap();
        assert_eq!(new("another search", false, true).unwrap().discarded, 4);
        assert_eq!(open(false).unwrap().discarded, 0, "an empty one is no work");
        open(true).unwrap().remove().unwrap();
        assert_eq!(open(true).unwrap_err().exit_code(), 2);
    }
}
