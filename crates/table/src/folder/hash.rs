//! Hashes: SHA-256 of what is read, BLAKE3 of what is written.

use std::io;

use sha2::{Digest, Sha256};

/// Hex SHA-256 of a text.
pub fn hash(text: &str) -> String {
    hex(Sha256::digest(text.as_bytes()))
}

/// What is read, hashed on the way.
#[derive(Debug)]
pub struct Hashing<R> {
    reader: R,
    digest: Sha256,
}

impl<R: io::Read> Hashing<R> {
    /// Nothing of `reader` yet.
    pub fn new(reader: R) -> Self {
        Self { reader, digest: Sha256::new() }
    }

    /// Hex SHA-256 of all that was read, and of what is left, in constant memory.
    pub fn end(mut self) -> io::Result<String> {
        io::copy(&mut self, &mut io::sink())?;
        Ok(hex(self.digest.finalize()))
    }
}

impl<R: io::Read> io::Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.reader.read(buffer)?;
        self.digest.update(&buffer[..n]);
        Ok(n)
    }
}

/// Hex SHA-256 of everything that `reader` gives.
pub fn hash_all(reader: &mut impl io::Read) -> io::Result<String> {
    Hashing::new(reader).end()
}

/// Hex SHA-256 of the bytes of `numbers`.
pub fn hash_numbers(numbers: impl Iterator<Item = f64>) -> String {
    let mut digest = Sha256::new();
    numbers.for_each(|x| digest.update(x.to_le_bytes()));
    hex(digest.finalize())
}

/// Hex BLAKE3 of a result file: SHA-256 without the CPU's own instructions took half as long again as the sweep of `sweeps/million.toml`.
pub fn hash_file(file: impl io::Read) -> io::Result<String> {
    let mut digest = blake3::Hasher::new();
    digest.update_reader(file)?;
    Ok(digest.finalize().to_hex().to_string())
}

/// The same of `bytes`.
pub fn hash_bytes(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// A digest as it is written.
fn hex(digest: impl AsRef<[u8]>) -> String {
    digest.as_ref().iter().map(|b| format!("{b:02x}")).collect()
}
