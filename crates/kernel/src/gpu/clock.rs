//! Calls into a driver that may not return, or panic. Each runs on a thread that is waited for up to a limit; it cannot be killed, so an abandoned
//! call runs on in the background.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Once, OnceLock};
use std::thread::Builder;
use std::time::Duration;

/// Limit of a call: thousands of times a dispatch, and far more than lavapipe needs for its slowest kernel on two busy cores.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Time after which a message reports the wait.
const TOLD_AFTER: Duration = Duration::from_secs(10);

/// Stack of a call, bytes, as of a main thread. Compilers recurse.
const STACK: usize = 8 << 20;

static OUT: AtomicUsize = AtomicUsize::new(0);

/// Hook for device faults; unset by default.
static EAR: OnceLock<fn(&str)> = OnceLock::new();

/// Sets the hook that is called with words on device faults and long waits; only the first call counts.
pub fn tell(ear: fn(&str)) {
    let _ = EAR.set(ear);
}

/// Passes `words` to the hook set by [`tell`].
pub fn hear(words: &str) {
    EAR.get().into_iter().for_each(|ear| ear(words));
}

/// True if a call into a driver was abandoned and has not returned. The driver's clean-up at a normal exit would run under that thread: end such a
/// process with `_exit`.
pub fn left_behind() -> bool {
    OUT.load(Ordering::SeqCst) > 0
}

thread_local! {
    /// True while panics of this thread are caught and returned as text.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// The value of `call`, or the text of its panic, which is kept off stderr.
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

/// The value of `call`; `what` names it in messages.
/// Errors: no return within `limit`; or a panic, with its text: drivers panic in place of an error, as does wgpu if a device is lost during a wait.
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
