//! What a device can do wrong, and the record of it.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Mutex, MutexGuard, Once, OnceLock, PoisonError};
use std::time::Duration;

use serde::{Serialize, Serializer};
use vibrissa_core::error::SolveError;

/// Most words that are kept of a device.
const MOST_WORDS: usize = 8;

/// What a device did wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The device is gone, or its driver failed; the driver's words.
    #[error("the device failed: {0}")]
    Lost(String),
    /// A dispatch did not end within its time.
    #[error("a dispatch did not end within {} s", .0.as_secs_f64())]
    Late(Duration),
    /// A kernel did not compile within this time; its driver is still at it.
    #[error("compiling a kernel did not end within {} s", .0.as_secs_f64())]
    Slow(Duration),
    /// Its memory does not hold a batch.
    #[error("the device is out of memory")]
    Memory,
    /// Answers that it did not write, or that are not finite: how many, of how many.
    #[error("{0} of {1} answers were not written, or are not finite")]
    Damaged(usize, usize),
    /// Answers that are wrong; the figures.
    #[error("{0}")]
    Wrong(String),
    /// No fault of the device.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

impl From<Fault> for SolveError {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Solve(e) => e,
            other => Self::device(other),
        }
    }
}

/// Called at once with what goes wrong; nothing until a program sets it.
static EAR: OnceLock<fn(&str)> = OnceLock::new();

/// From now on `ear` is called with words on what a device does wrong, and on what is waited for, when it happens; the first call counts.
pub fn tell(ear: fn(&str)) {
    let _ = EAR.set(ear);
}

/// Hands `words` to whoever asked for them by [`tell`].
pub fn hear(words: &str) {
    EAR.get().into_iter().for_each(|ear| ear(words));
}

thread_local! {
    /// Whether a panic of this thread is told by whoever catches it.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// The value of `call`, or the words of its panic, which stderr does not hear: drivers, and wgpu where a device is lost while it is waited
/// for, panic in place of an error.
///
/// # Errors
/// The words of a panic.
pub fn quietly<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let loud = take_hook();
        set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                loud(panic);
            }
        }));
    });
    let before = QUIET.replace(true);
    let done = catch_unwind(AssertUnwindSafe(call));
    QUIET.set(before);
    done.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("the driver panicked").to_owned()
    })
}

/// What was checked of a device, and what it did wrong, so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Told {
    /// Kernels that passed the self-check, in this run or in an earlier one.
    pub self_checked_kernels: u64,
    /// Those of which the verdict of an earlier run was taken.
    pub self_checked_before: u64,
    /// Largest error of the strain in the checks of this run, relative to the tolerance; 0 without a check.
    pub self_check_worst: f64,
    /// Taps of its batches that were compared with the CPU in f64.
    pub compared_taps: u64,
    /// Largest error of the strain of these, relative to the tolerance.
    pub compared_worst: f64,
    /// Times it was opened again.
    pub reopened: u64,
    /// Times that batches were made smaller.
    pub smaller_batches: u64,
    /// Taps whose answers were missing or not finite and were left to the reference.
    pub recomputed_taps: u64,
    /// Taps handed over to the CPU.
    pub handed_over_taps: u64,
    /// What happened, in words; the first ones.
    pub words: Vec<String>,
}

/// A record that everything opened on one device shares.
#[derive(Debug, Clone, Default)]
pub struct Log(Arc<Mutex<Told>>);

impl Log {
    fn told(&self) -> MutexGuard<'_, Told> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What it says now.
    pub fn get(&self) -> Told {
        self.told().clone()
    }

    /// Whether there is nothing to say.
    pub fn is_empty(&self) -> bool {
        *self.told() == Told::default()
    }

    /// Taps that another than the device has answered.
    pub fn others(&self) -> u64 {
        let told = self.told();
        told.recomputed_taps + told.handed_over_taps
    }

    pub(super) fn note(&self, f: impl FnOnce(&mut Told)) {
        f(&mut self.told());
    }

    /// Adds words, if there are not too many.
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
