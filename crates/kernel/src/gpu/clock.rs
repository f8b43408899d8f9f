//! Calls into a driver that may not return: each runs on a thread and is waited for up to a bound. A thread cannot be killed, so a call
//! that is given up goes on in the background until it returns or the process ends.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::fault::hear;

/// Time after which a user is told what is waited for.
const TOLD_AFTER: Duration = Duration::from_secs(10);

/// Stack of a call, bytes: what a main thread has. Compilers recurse.
const STACK: usize = 8 << 20;

/// Calls that have not returned.
static OUT: AtomicUsize = AtomicUsize::new(0);

/// Whether a call into a driver was given up and has not returned. The driver's own clean-up, at a normal end of the process, would then
/// run under a thread that is still inside it: end such a process with `_exit`.
pub fn left_behind() -> bool {
    OUT.load(Ordering::SeqCst) > 0
}

/// The value of `call`; `None` where it does not return within `limit`. `what` says what is waited for.
pub(super) fn within<T: Send + 'static>(
    limit: Duration,
    what: &str,
    call: impl FnOnce() -> T + Send + 'static,
) -> Option<T> {
    let (tell, told) = channel();
    OUT.fetch_add(1, Ordering::SeqCst);
    let worker = Builder::new().stack_size(STACK).spawn(move || {
        let value = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call));
        OUT.fetch_sub(1, Ordering::SeqCst);
        let _ = tell.send(value);
    });
    let early = limit.min(TOLD_AFTER);
    let value = told.recv_timeout(early).or_else(|e| {
        if e == RecvTimeoutError::Timeout && early < limit {
            hear(&format!(
                "{what} takes more than {} s; it is given up after {} s",
                early.as_secs(),
                limit.as_secs()
            ));
        }
        told.recv_timeout(limit - early)
    });
    match value {
        Ok(Ok(value)) => {
            let _ = worker.map(JoinHandle::join);
            Some(value)
        }
        Ok(Err(panic)) => std::panic::resume_unwind(panic),
        Err(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_that_does_not_return_is_given_up_and_known_to_be_out() {
        assert_eq!(within(Duration::from_secs(60), "a sum", || 2 + 2), Some(4));
        let (end, ended) = channel::<()>();
        assert_eq!(within(Duration::from_millis(20), "nothing", move || ended.recv().is_ok()), None);
        assert!(left_behind());
        end.send(()).unwrap();
        while left_behind() {
            std::thread::yield_now();
        }
    }
}
