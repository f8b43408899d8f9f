//! Values as bytes and back, exactly: what an unfinished run needs to go on, in little-endian words.

use std::collections::BTreeMap;
use std::io::{self, Write};

use crate::evaluate::Outcome;
use crate::scene::{Direction, Tuple};
use crate::statistics::Figures;
use crate::status::Status;

/// Takes bytes, and notes the first that could not be written.
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

    /// Appends bytes as they are.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= BUFFER {
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.digest.update(&self.buffer);
        if self.failed.is_none() {
            self.failed = self.to.write_all(&self.buffer).err();
        }
        self.buffer.clear();
    }

    /// Ends with a check of everything written, [`CHECK`] bytes.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush();
        match self.failed {
            Some(e) => Err(e),
            None => self.to.write_all(self.digest.finalize().as_bytes()),
        }
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

impl<'a> Unpacker<'a> {
    /// The next `n` bytes; `None` where there are fewer.
    pub fn raw(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(head)
    }

    /// The next value.
    pub fn take<T: Packed>(&mut self) -> Option<T> {
        T::unpack(self)
    }
}

/// What can be written as bytes and read back, bit for bit.
pub trait Packed: Sized {
    /// Appends it.
    fn pack(&self, to: &mut Packer<'_>);
    /// Reads it; `None` where the bytes are none of it.
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self>;
}

macro_rules! words {
    ($($t:ty),*) => {$(
        impl Packed for $t {
            fn pack(&self, to: &mut Packer<'_>) {
                to.raw(&self.to_le_bytes());
            }
            fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
                from.raw(size_of::<Self>()).map(|b| Self::from_le_bytes(b.try_into().expect("as many bytes")))
            }
        }
    )*};
}
words!(u8, u16, u32, u64, f32, f64);

macro_rules! tuples {
    ($(($($t:ident $i:tt),*)),*) => {$(
        impl<$($t: Packed),*> Packed for ($($t,)*) {
            fn pack(&self, to: &mut Packer<'_>) {
                $(self.$i.pack(to);)*
            }
            fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
                Some(($($t::unpack(from)?,)*))
            }
        }
    )*};
}
tuples!((A 0, B 1), (A 0, B 1, C 2), (A 0, B 1, C 2, D 3));

/// Packs structs as their fields, in this order.
#[macro_export]
macro_rules! packed {
    ($($t:ty { $($field:ident),* })*) => {$(
        impl $crate::pack::Packed for $t {
            fn pack(&self, to: &mut $crate::pack::Packer<'_>) {
                $($crate::pack::Packed::pack(&self.$field, to);)*
            }
            fn unpack(from: &mut $crate::pack::Unpacker<'_>) -> Option<Self> {
                Some(Self { $($field: from.take()?),* })
            }
        }
    )*};
}
pub use packed;
packed! {
    Direction { tilt, lean }
    Tuple { D, d, L_a, x_ss, l, a, tilt, lean, drive, rig }
    Figures { n, mean, sd, error_rms, error_max, error_mean, noise_rms, strain_max, force_max, status }
    Outcome {
        strain, strain_2, strain_linear, deviation, normal_force, tangential_force, arc, wrench, azimuth, slide, axial,
        sticking, sweeps, referred, status
    }
}

impl Packed for bool {
    fn pack(&self, to: &mut Packer<'_>) {
        u8::from(*self).pack(to);
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        match from.take::<u8>()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl<T: Packed> Packed for Option<T> {
    fn pack(&self, to: &mut Packer<'_>) {
        self.is_some().pack(to);
        self.iter().for_each(|x| x.pack(to));
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        Some(if from.take()? { Some(from.take()?) } else { None })
    }
}

impl<T: Packed> Packed for Vec<T> {
    fn pack(&self, to: &mut Packer<'_>) {
        (self.len() as u64).pack(to);
        self.iter().for_each(|x| x.pack(to));
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        // As long as it says, and no longer than the bytes last.
        let n: u64 = from.take()?;
        (0..n).map(|_| from.take()).collect()
    }
}

impl<T: Packed + Copy + Default, const N: usize> Packed for [T; N] {
    fn pack(&self, to: &mut Packer<'_>) {
        self.iter().for_each(|x| x.pack(to));
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let mut all = [T::default(); N];
        for x in &mut all {
            *x = from.take()?;
        }
        Some(all)
    }
}

impl Packed for String {
    fn pack(&self, to: &mut Packer<'_>) {
        (self.len() as u64).pack(to);
        to.raw(self.as_bytes());
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let n = usize::try_from(from.take::<u64>()?).ok()?;
        Self::from_utf8(from.raw(n)?.to_vec()).ok()
    }
}

impl<K: Packed + Ord, V: Packed> Packed for BTreeMap<K, V> {
    fn pack(&self, to: &mut Packer<'_>) {
        (self.len() as u64).pack(to);
        for (key, value) in self {
            key.pack(to);
            value.pack(to);
        }
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let n: u64 = from.take()?;
        (0..n).map(|_| from.take::<(K, V)>()).collect()
    }
}

impl Packed for Status {
    fn pack(&self, to: &mut Packer<'_>) {
        let bit = |(i, (word, _)): (usize, (Self, _))| u16::from(self.has(word)) << i;
        Self::ALL.into_iter().enumerate().map(bit).sum::<u16>().pack(to);
    }
    fn unpack(from: &mut Unpacker<'_>) -> Option<Self> {
        let bits: u16 = from.take()?;
        let words = Self::ALL.into_iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1);
        (bits >> Self::ALL.len() == 0).then(|| words.fold(Self::OK, |all, (_, (word, _))| all | word))
    }
}
