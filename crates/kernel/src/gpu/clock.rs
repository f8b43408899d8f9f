//! Calls into a driver that may not return, or panic: one clock for all of them. Each runs on a thread and is waited for up to a bound. A thread
//! cannot be killed, so a call that is given up goes on in the background until it returns or the process ends.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Once, OnceLock};
use std::thread::Builder;
use std::time::Duration;

/// Bound on the time of a call: thousands of times what a dispatch takes, and far more than lavapipe needs for its slowest kernel on two busy cores.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Time after which a user hears what is waited for.
const TOLD_AFTER: Duration = Duration::from_secs(10);

/// Stack of a call, bytes: what a main thread has. Compilers recurse.
const STACK: usize = 8 << 20;

/// Calls that have not returned.
static OUT: AtomicUsize = AtomicUsize::new(0);

/// Called at once with what goes wrong; nothing until a program sets it.
static EAR: OnceLock<fn(&str)> = OnceLock::new();

/// From now on `ear` is called with words on what a device does wrong, and on what is waited for, when it happens; the first call counts.
pub fn tell(ear: fn(&str)) {
    let _ = EAR.set(ear);
}

/// Passes `words` to the function that was set by [`tell`].
pub fn hear(words: &str) {
    EAR.get().into_iter().for_each(|ear| ear(words));
}

/// Whether a call into a driver was given up and has not returned. The driver's own clean-up, at a normal end of the process, would then
/// run under a thread that is still inside it: end such a process with `_exit`.
pub fn left_behind() -> bool {
    OUT.load(Ordering::SeqCst) > 0
}

thread_local! {
    /// Whether panics of this thread are caught and reported in words.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// The value of `call`, or the words of its panic, which do not go to stderr.
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

/// The value of `call`; `what` says what is waited for.
///
/// # Errors
/// A call that does not return within `limit`; the words of its panic: drivers panic in place of an error, and so does wgpu where a device is lost
/// while it is waited for.
pub fn within<T: Send + 'static>(
    limit: Duration,
    what: &str,
    call: impl FnOnce() -> T + Send + 'static,
) -> Result<T, String> {
    let (tell, told) = channel();
    OUT.fetch_add(1, Ordering::SeqCst);
    let worker = Builder::new().stack_size(STACK).spawn(move || {
        let value = quietly(call);
        OUT.fetch_sub(1, Ordering::SeqCst);
        let _ = tell.send(value);
    });
    if let Err(e) = worker {
        OUT.fetch_sub(1, Ordering::SeqCst);
        return Err(format!("{what}: {e}"));
    }
    let late = |_| format!("{what} did not end within {} s", limit.as_secs_f64());
    let early = limit.min(TOLD_AFTER);
    if let Ok(value) = told.recv_timeout(early) {
        return value;
    }
    if early < limit {
        let (begun, most) = (early.as_secs(), limit.as_secs());
        hear(&format!("{what} takes more than {begun} s; it is given up after {most} s"));
    }
    told.recv_timeout(limit - early).map_err(late)?
}
