//! Work that a signal may end at any time although it is deep in a driver or a solver, and what is kept of it then.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use super::{Context, Destination};
use crate::error::{Error, SolveError};
use crate::sink::folder::Folder;

/// Time in which the work may end by itself after a signal. What it has must then be written within the rest of two seconds.
const GRACE: Duration = Duration::from_millis(1000);
/// Between two looks at the signal.
const STEP: Duration = Duration::from_millis(50);
const STACK: usize = 8 << 20;

/// Does `work` on a thread of its own, and gives `take` what it tells. `work` is handed a flag that asks it to stop. After a signal it has [`GRACE`]
/// to end by itself; then it is left behind, and the process ends without it. In memory, where the host itself sees to that, there is no such thread.
pub fn apart<T: Send + 'static>(
    context: &Context<'_>,
    work: impl FnOnce(&AtomicBool, &mut dyn FnMut(T)) -> Result<(), Error> + Send + 'static,
    mut take: impl FnMut(T),
) -> Result<(), Error> {
    let stop = context.host().stop(true);
    let ended = if context.is_in_memory() {
        work(stop, &mut take)
    } else {
        let (tell, news) = channel();
        let asked = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&asked);
        let run = move || {
            let end = work(&flag, &mut |part| {
                let _ = tell.send(ControlFlow::Continue(part));
            });
            let _ = tell.send(ControlFlow::Break(end));
        };
        let worker = Builder::new().stack_size(STACK).spawn(run).map_err(|e| Error::Run(e.to_string()))?;
        let mut since: Option<Instant> = None;
        loop {
            match news.recv_timeout(STEP) {
                Ok(ControlFlow::Continue(part)) => take(part),
                Ok(ControlFlow::Break(end)) => break end,
                Err(RecvTimeoutError::Disconnected) => match worker.join() {
                    Err(panic) => std::panic::resume_unwind(panic),
                    Ok(()) => break Ok(()),
                },
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

/// Of `done` things of so many, called `what`: whether they are kept in `destination`, and what to say where a signal ended the work before all were done. A
/// part does not take the place of a whole older result in `out`, unless that is forced.
pub fn cut(
    ([done, of], what): ([u64; 2], &str),
    destination: &Destination,
    (force, out): (Option<bool>, &Path),
) -> (bool, Option<String>) {
    if done >= of {
        return (true, None);
    }
    let older = destination.folder.as_ref().and_then(Folder::older);
    let kept = force == Some(true) || !older.is_some_and(|run| run["stopped"].is_null());
    let out = out.display();
    let words = match (done, kept) {
        (0, _) => "interrupted before the first result; nothing was written".to_owned(),
        (_, true) => format!("interrupted; what {done} of {of} {what} show is kept in {out}"),
        (_, false) => format!(
            "interrupted after {done} of {of} {what}; nothing was written: {out} holds a whole result (--force replaces it)"
        ),
    };
    (kept && done > 0, Some(words))
}
