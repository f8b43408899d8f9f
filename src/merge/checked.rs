//! Files of a part, hashed while they are read: what goes into the whole is what the part's run.json lists, whatever happens to the file meanwhile.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};

use super::part::refuse;
use crate::error::Error;
use crate::sink::folder::{Listed, open_regular};

/// An open file of a part.
pub(super) struct Checked {
    file: File,
    digest: blake3::Hasher,
    wanted: String,
    folder: PathBuf,
    pub path: PathBuf,
}

impl Checked {
    /// Opens what `listed` names in `folder`.
    pub fn open(folder: &Path, listed: &Listed) -> Result<Self, Error> {
        let path = folder.join(&listed.name);
        let file = open_regular(&path, OpenOptions::new().read(true)).map_err(|e| match e.kind() {
            ErrorKind::NotFound => edited(folder, &path, "is missing"),
            _ if path.symlink_metadata().is_ok_and(|m| !m.is_file()) => {
                edited(folder, &path, "is a link, a folder or a pipe, not the file that was written")
            }
            _ => Error::io(&path, e),
        })?;
        let (digest, wanted) = (blake3::Hasher::new(), listed.blake3.clone());
        Ok(Self { file, digest, wanted, folder: folder.to_owned(), path })
    }

    /// The same open file, for who reads it in another order; [`Self::again`] then hashes it.
    pub fn handle(&self) -> Result<File, Error> {
        self.file.try_clone().map_err(|e| Error::io(&self.path, e))
    }

    /// Reads it anew from its start, and fails as [`Self::end`] does.
    pub fn again(mut self) -> Result<(), Error> {
        self.file.rewind().map_err(|e| Error::io(&self.path, e))?;
        self.digest.reset();
        self.end()
    }

    /// Reads what is left, and fails unless all that was read is what was written.
    pub fn end(mut self) -> Result<(), Error> {
        self.digest.update_reader(&self.file).map_err(|e| Error::io(&self.path, e))?;
        match self.digest.finalize().to_hex().as_str() == self.wanted {
            true => Ok(()),
            false => Err(edited(&self.folder, &self.path, "is not what was written")),
        }
    }

    /// All its bytes, which are what was written.
    pub fn bytes(mut self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let path = self.path.clone();
        self.read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
        self.end().map(|()| bytes)
    }
}

impl Read for Checked {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.file.read(buffer)?;
        self.digest.write_all(&buffer[..n])?;
        Ok(n)
    }
}

fn edited(folder: &Path, path: &Path, why: &str) -> Error {
    let again = "the part as it was written; the command that made it makes it again with --force";
    refuse(folder, format!("{} {why}", path.display()), again)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_changes_while_it_is_merged_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tuples.csv");
        let text = "a\n1\n2\n".to_owned();
        let blake3 = blake3::hash(text.as_bytes()).to_hex().to_string();
        let listed = Listed { name: "tuples.csv".into(), blake3, bytes: text.len() as u64 };
        let opened = || {
            std::fs::write(&path, &text).unwrap();
            let mut file = Checked::open(folder.path(), &listed).unwrap();
            file.read_exact(&mut [0; 2]).unwrap();
            file
        };
        assert_eq!((opened().end().is_ok(), opened().again().is_ok()), (true, true));
        for end in [Checked::end, Checked::again, |file: Checked| file.bytes().map(drop)] {
            let file = opened();
            std::fs::write(&path, "a\n1\n3\n").unwrap();
            let error = end(file).unwrap_err();
            assert!(
                error.exit_code() == 2 && error.to_string().contains("is not what was written"),
                "{error}"
            );
        }
    }
}
