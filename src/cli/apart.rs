//! Long work on a thread of its own, so that a signal is answered in time although the work is deep in a driver or a solver.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use vibrissa::error::Error;

use super::interrupt;

/// Time in which the work may end by itself after a signal. What it has must then be written within the rest of two seconds.
const GRACE: Duration = Duration::from_millis(1000);
/// Between two looks at the signal.
const STEP: Duration = Duration::from_millis(50);
/// As the main thread has it.
const STACK: usize = 8 << 20;

/// What comes from the work.
enum News<T, R> {
    Part(T),
    End(R),
}

/// Does `work`, which hands over its parts as they are done, and gives them to `take`. After a signal the work has [`GRACE`] to end by itself;
/// then it is left behind, there is no answer, and the process ends without it.
pub fn apart<T: Send + 'static, R: Send + 'static>(
    work: impl FnOnce(&mut dyn FnMut(T)) -> R + Send + 'static,
    mut take: impl FnMut(T),
) -> Result<Option<R>, Error> {
    let (tell, news) = channel();
    let run = move || {
        let end = work(&mut |part| {
            let _ = tell.send(News::Part(part));
        });
        let _ = tell.send(News::End(end));
    };
    let worker = Builder::new().stack_size(STACK).spawn(run).map_err(|e| Error::Run(e.to_string()))?;
    let mut asked: Option<Instant> = None;
    loop {
        match news.recv_timeout(STEP) {
            Ok(News::Part(part)) => take(part),
            Ok(News::End(end)) => return Ok(Some(end)),
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => return Ok(None),
            },
            Err(RecvTimeoutError::Timeout) => {}
        }
        if interrupt::asked() && asked.get_or_insert_with(Instant::now).elapsed() > GRACE {
            interrupt::leave_behind();
            return Ok(None);
        }
    }
}
