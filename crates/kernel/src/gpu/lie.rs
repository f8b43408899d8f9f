//! Adapters that lie, for tests: what a broken device does, done on purpose next to the hardware.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// What it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Turns a bit in every so many words of what comes back.
    Flip(usize),
    /// Brings back what it brought back before; zeros at first.
    Stale,
    /// Leaves out every other workgroup.
    Skip,
    /// Computes with numbers 1 % off.
    Wrong,
    /// Computes one number of each answer 1 % off, that of this place.
    Off(usize),
    /// Brings back what is no number as the strain of every so many taps.
    NotANumber(usize),
    /// Is lost before a dispatch.
    Lose,
    /// Is lost while it is waited for, at which its driver's library panics.
    Panic,
    /// Does not end in time.
    Hang,
    /// Does not compile in time; `when` then counts kernels, not dispatches.
    Slow,
    /// Has no memory for more than so many taps.
    Room(usize),
}

/// A lie told at some of the dispatches.
#[derive(Debug)]
pub struct Lie {
    kind: Kind,
    when: Range<u64>,
    dispatches: AtomicU64,
    kernels: AtomicU64,
    before: Mutex<Vec<u8>>,
}

impl Lie {
    /// Of this kind at the dispatches `when`, counted from 0 over all devices opened on the adapter.
    pub fn new(kind: Kind, when: Range<u64>) -> Self {
        Self {
            kind,
            when,
            dispatches: AtomicU64::new(0),
            kernels: AtomicU64::new(0),
            before: Mutex::default(),
        }
    }

    /// Dispatches so far.
    pub fn dispatches(&self) -> u64 {
        self.dispatches.load(Ordering::Relaxed)
    }

    /// The next dispatch; what is done wrong at it.
    pub(super) fn next(&self) -> Option<Kind> {
        let at = self.dispatches.fetch_add(1, Ordering::Relaxed);
        (self.when.contains(&at) && self.kind != Kind::Slow).then_some(self.kind)
    }

    /// Whether the next kernel does not compile in time.
    pub(super) fn stalls(&self) -> bool {
        self.kind == Kind::Slow && self.when.contains(&self.kernels.fetch_add(1, Ordering::Relaxed))
    }

    /// What is computed in place of a number of an answer, at this place in it.
    pub(super) fn off(kind: Option<Kind>, place: usize, x: f64) -> f64 {
        if kind == Some(Kind::Off(place)) { 1.01 * x + 0.01 } else { x }
    }

    /// What comes back in place of `bytes`; a workgroup has `group` of them, `word` each number.
    pub(super) fn spoil(&self, kind: Option<Kind>, bytes: &mut [u8], group: usize, word: usize) {
        let mut before = self.before.lock().unwrap_or_else(PoisonError::into_inner);
        let most = bytes.len().max(before.len());
        before.resize(most, 0);
        let honest = bytes.to_vec();
        match kind {
            Some(Kind::Flip(every)) => {
                bytes
                    .chunks_mut(4)
                    .step_by(every)
                    .enumerate()
                    .for_each(|(i, word)| word[i % 4] ^= 1 << (i % 7));
            }
            Some(Kind::NotANumber(every)) => {
                // The fourth number of an answer.
                let answer = group / 64;
                bytes.chunks_mut(answer).step_by(every).for_each(|a| a[3 * word..4 * word].fill(0xff));
            }
            Some(Kind::Stale) => bytes.copy_from_slice(&before[..honest.len()]),
            Some(Kind::Skip) => {
                let groups = bytes.chunks_mut(group).zip(before.chunks(group)).step_by(2);
                groups.for_each(|(now, before)| now.copy_from_slice(&before[..now.len()]));
            }
            _ => {}
        }
        before[..honest.len()].copy_from_slice(&honest);
    }
}
