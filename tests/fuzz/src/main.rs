//! Feeds bytes from libFuzzer to a reader, which must answer or give an error with a message, in bounded work. READER names it; see `tests/fuzz/run`.

#![no_main]

mod desk;
mod folders;
mod texts;

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

type Reader = fn(&[u8]);

const READERS: [(&str, Reader); 9] = [
    ("spec", texts::spec),
    ("tuples", texts::tuples),
    ("curve", texts::curve),
    ("measurements", texts::measurements),
    ("record", texts::record),
    ("calibration", texts::calibration),
    ("state", folders::state),
    ("folder", folders::folder),
    ("merge", folders::merge),
];

static READER: LazyLock<Reader> = LazyLock::new(|| {
    let wanted = std::env::var("READER").unwrap_or_default();
    let names = READERS.map(|(name, _)| name).join(", ");
    READERS.iter().find(|(name, _)| *name == wanted).unwrap_or_else(|| panic!("READER is one of {names}")).1
});

fuzz_target!(|data: &[u8]| READER(data));

/// Fails if an error has no message.
fn told<T>(result: Result<T, impl std::fmt::Display>) -> Option<T> {
    result.map_err(|e| assert!(!e.to_string().trim().is_empty(), "an error without words")).ok()
}
