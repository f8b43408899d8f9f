//! What an unfinished run needs to go on: values as bytes and back, exactly, with a check of them at the end.

use std::io::{self, Write};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Takes values, and notes the first that could not be written.
pub struct Packer<'a> {
    to: &'a mut dyn Write,
    buffer: Vec<u8>,
    digest: blake3::Hasher,
    failed: Option<io::Error>,
}

/// Bytes that go together.
const BUFFER: usize = 1 << 16;

impl<'a> Packer<'a> {
    /// Writes to `to`.
    pub fn new(to: &'a mut dyn Write) -> Self {
        let buffer = Vec::with_capacity(2 * BUFFER);
        Self { to, buffer, digest: blake3::Hasher::new(), failed: None }
    }

    /// Appends a value.
    pub fn put(&mut self, value: &(impl Serialize + ?Sized)) {
        if let Err(e) = postcard::to_io(value, &mut *self) {
            self.failed.get_or_insert(io::Error::other(e));
        }
    }

    fn send(&mut self) {
        self.digest.update(&self.buffer);
        if self.failed.is_none() {
            self.failed = self.to.write_all(&self.buffer).err();
        }
        self.buffer.clear();
    }

    /// Ends with a check of everything written, [`CHECK`] bytes.
    pub fn finish(mut self) -> io::Result<()> {
        self.send();
        match self.failed {
            Some(e) => Err(e),
            None => self.to.write_all(self.digest.finalize().as_bytes()),
        }
    }
}

impl Write for Packer<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= BUFFER {
            self.send();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Bytes of the check at the end.
pub const CHECK: usize = 32;

/// What [`Packer::finish`] was called on, if `bytes` end with the check of it.
pub fn checked(bytes: &[u8]) -> Option<&[u8]> {
    let (body, check) = bytes.split_at_checked(bytes.len().checked_sub(CHECK)?)?;
    (blake3::hash(body).as_bytes() == check).then_some(body)
}

/// Reads values in the order in which they were packed.
#[derive(Debug, Clone, Copy)]
pub struct Unpacker<'a>(pub &'a [u8]);

impl Unpacker<'_> {
    /// The next value; `None` where the bytes are none of it.
    pub fn take<T: DeserializeOwned>(&mut self) -> Option<T> {
        let (value, rest) = postcard::take_from_bytes(self.0).ok()?;
        self.0 = rest;
        Some(value)
    }
}
