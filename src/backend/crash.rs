//! What is told where the process ends by a signal such as SIGSEGV while GPU drivers are loaded in it: such a crash says nothing by itself.
//!
//! Another process first tries whether a driver opens. It does not compile and dispatch too: every start would pay for that. So from then on a
//! crash is told, not prevented.

use std::ffi::c_int;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Signals of crashes, and their names.
pub(super) const CRASHES: [(c_int, &str); 5] = [
    (libc::SIGSEGV, " SIGSEGV"),
    (libc::SIGABRT, " SIGABRT"),
    (libc::SIGBUS, " SIGBUS"),
    (libc::SIGILL, " SIGILL"),
    (libc::SIGFPE, " SIGFPE"),
];

static WANTED: AtomicBool = AtomicBool::new(false);
/// What is said, for each signal; made beforehand, because a process that has crashed can make nothing.
static WORDS: OnceLock<Vec<(c_int, String)>> = OnceLock::new();

/// From now on a crash with a GPU driver loaded is told on stderr. For a program: a library leaves signals to whoever loads it.
pub fn tell_crashes() {
    WANTED.store(true, Ordering::Relaxed);
}

/// Drivers of the adapters `names` are loaded.
pub(super) fn loaded<'a>(names: impl Iterator<Item = &'a str>) {
    let names: Vec<&str> = names.collect();
    if !WANTED.load(Ordering::Relaxed) || names.is_empty() || WORDS.get().is_some() {
        return;
    }
    let words = |(signal, name)| {
        let why = format!(
            "error: the program crashed (signal {signal}{name}) with the GPU driver of {} loaded, most likely in it; no result was put in place. \
             --backend cpu does without the driver (vibrissa devices lists what there is)\n",
            names.join(", ")
        );
        (signal, why)
    };
    let _ = WORDS.set(CRASHES.map(words).into());
    for (signal, _) in CRASHES {
        let handler: extern "C" fn(c_int) = crashed;
        // SAFETY: a zeroed action is a valid one, and the handler makes only calls that are allowed in one.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = handler as libc::sighandler_t;
            action.sa_flags = libc::SA_ONSTACK;
            libc::sigaction(signal, &raw const action, std::ptr::null_mut());
        }
    }
}

/// Says what was made for this, and lets the signal do what it does to any program.
extern "C" fn crashed(signal: c_int) {
    let words = WORDS.get().and_then(|all| all.iter().find(|(s, _)| *s == signal));
    // SAFETY: `write`, `signal` and `raise` may be called in a handler; the words live as long as the process.
    unsafe {
        if let Some((_, text)) = words {
            libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len());
        }
        libc::signal(signal, libc::SIG_DFL);
        libc::raise(signal);
    }
}
