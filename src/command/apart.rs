//! Runs work on a thread that a signal can abandon, even inside a driver or solver, and decides what is kept of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use super::{Context, Destination};
use crate::error::{Error, SolveError};
use crate::sink::folder::Folder;

/// Time to end after a signal; the results must then be written within the rest of two seconds.
const GRACE: Duration = Duration::from_millis(1000);
const STEP: Duration = Duration::from_millis(50);
const STACK: usize = 8 << 20;

/// Runs `work` on a separate thread, with a stop flag and a channel to `take`. After a signal it has [`GRACE`] to end, then it is abandoned.
/// In memory the host handles signals, so no thread is started.
pub fn apart<T: Send + 'static>(
    context: &Context<'_>,
    work: impl FnOnce(&AtomicBool, &mut dyn FnMut(T)) -> Result<(), Error> + Send + 'static,
    mut take: impl FnMut(T),
) -> Result<(), Error> {
    let stop = context.host.stop(true);
    let ended = if context.is_in_memory() {
        work(stop, &mut take)
    } else {
        let (tell, news) = channel();
        let asked = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&asked);
        // The channel closes when the work ends.
        let run = move || work(&flag, &mut |part| drop(tell.send(part)));
        let worker = Builder::new().stack_size(STACK).spawn(run).map_err(|e| Error::Run(e.to_string()))?;
        let mut since: Option<Instant> = None;
        loop {
            match news.recv_timeout(STEP) {
                Ok(part) => take(part),
                Err(RecvTimeoutError::Disconnected) => {
                    break worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
            if stop.load(Ordering::Relaxed) {
                asked.store(true, Ordering::Relaxed);
                if since.get_or_insert_with(Instant::now).elapsed() > GRACE {
                    break Ok(());
                }
            }
        }
    };
    match ended {
        Err(Error::Solve(SolveError::Stopped)) => Ok(()),
        Err(_) if stop.load(Ordering::Relaxed) => Ok(()),
        other => other,
    }
}

/// For `done` of `of` things called `what`: whether they are kept in `destination`, and the message if a signal ended the work early.
/// A partial result replaces a whole older one only if forced.
pub fn cut(([done, of], what): ([u64; 2], &str), destination: &Destination<'_>) -> (bool, Option<String>) {
    if done >= of {
        return (true, None);
    }
    let older = destination.folder.as_ref().and_then(Folder::older);
    let kept = destination.force || !older.is_some_and(|run| run["stopped"].is_null());
    let out = destination.out.display();
    let words = match (done, kept) {
        (0, _) => "interrupted before the first result; nothing was written".to_owned(),
        (_, true) => format!("interrupted; what {done} of {of} {what} show is kept in {out}"),
        (_, false) => format!(
            "interrupted after {done} of {of} {what}; nothing was written: {out} holds a whole result (--force replaces it)"
        ),
    };
    (kept && done > 0, Some(words))
}
