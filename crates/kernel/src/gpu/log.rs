//! Record of the checks and faults of a device.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Serialize, Serializer};

use super::check::Passed;
use super::clock::hear;

const MOST_WORDS: usize = 8;

/// The record so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Told {
    /// Taps of its batches that were compared with the CPU in f64.
    pub compared_taps: u64,
    /// Largest error of the strain of these, relative to the tolerance.
    pub compared_worst: f64,
    /// Taps that the CPU solved in place of the device.
    pub handed_over_taps: u64,
    /// Faults in words; the first ones.
    pub words: Vec<String>,
}

/// A record shared by everything opened on one device.
#[derive(Debug, Clone, Default)]
pub struct Log(Arc<Mutex<Told>>);

impl Log {
    fn told(&self) -> MutexGuard<'_, Told> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The record now.
    pub fn get(&self) -> Told {
        self.told().clone()
    }

    /// True if nothing was recorded.
    pub fn is_empty(&self) -> bool {
        *self.told() == Told::default()
    }

    pub(super) fn agreed(&self, (taps, worst): Passed) {
        let mut told = self.told();
        told.compared_taps += taps as u64;
        told.compared_worst = told.compared_worst.max(worst);
    }

    pub(super) fn handed_over(&self, taps: usize) {
        self.told().handed_over_taps += taps as u64;
    }

    /// Adds words, up to a limit.
    pub fn say(&self, words: String) {
        let mut told = self.told();
        if told.words.len() < MOST_WORDS {
            hear(&words);
            told.words.push(words);
        }
    }
}

/// Two records of the same words are equal.
impl PartialEq for Log {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.get() == other.get()
    }
}

impl Serialize for Log {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.get().serialize(to)
    }
}
