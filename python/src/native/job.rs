//! Runs long work on a separate thread, without the interpreter's lock, so that Ctrl-C and callbacks work meanwhile.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use vibrissa::error::Error;

use super::error;

/// Time for the work to end after an interrupt; then it is abandoned. Interrupts are answered within two seconds.
const GRACE: Duration = Duration::from_millis(1500);
const STEP: Duration = Duration::from_millis(50);
const STACK: usize = 8 << 20;

pub type Ended<T> = (T, Option<PyErr>);

/// Runs `work` with `threads` (default: all cores), a stop flag and a progress channel; `hear` gets the progress and returns false to stop. After an
/// interrupt, work that ends in time returns what it has.
pub fn run<N: Send + 'static, T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool, &mut dyn FnMut(N)) -> Result<T, Error> + Send + 'static,
    mut hear: impl FnMut(N) -> PyResult<bool>,
) -> PyResult<Ended<T>> {
    check(py)?;
    let pool = own_pool(threads).map_err(|e| error::raise(py, e))?;
    let stop = Arc::new(AtomicBool::new(false));
    let (tell, news) = channel();
    let news = Mutex::new(news);
    let asked = Arc::clone(&stop);
    // The channel closes when the work ends.
    let whole = move || {
        let work = move || work(&asked, &mut |part| drop(tell.send(part)));
        WORKING.fetch_add(1, Ordering::SeqCst);
        let end = catch_unwind(AssertUnwindSafe(|| match pool {
            Some(pool) => pool.install(work),
            None => work(),
        }));
        WORKING.fetch_sub(1, Ordering::SeqCst);
        end.unwrap_or_else(|panic| resume_unwind(panic))
    };
    let worker = Builder::new().stack_size(STACK).spawn(whole);
    let worker = worker.map_err(|e| error::run(py, &e.to_string()))?;
    let mut interrupt: Option<(PyErr, Instant)> = None;
    loop {
        let mut heard = Ok(true);
        let next = py.detach(|| news.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(STEP));
        match next {
            Ok(part) if interrupt.is_none() => heard = hear(part),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return match (worker.join(), interrupt) {
                    (Ok(Ok(value)), interrupt) => Ok((value, interrupt.map(|(e, _)| e))),
                    (Ok(Err(_)), Some((e, _))) => Err(e),
                    (Ok(Err(e)), None) => Err(error::raise(py, e)),
                    (Err(panic), _) => {
                        let text = panic.downcast_ref::<String>().map(String::as_str);
                        let why = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a thread ended");
                        Err(error::run(py, &format!("this should not have happened: {why}")))
                    }
                };
            }
        }
        if interrupt.is_none() {
            let more = heard.and_then(|more| py.check_signals().map(|()| more));
            stop.fetch_or(!matches!(more, Ok(true)), Ordering::Relaxed);
            interrupt = more.err().map(|e| (e, Instant::now()));
        }
        if let Some((e, _)) = interrupt.take_if(|(_, since)| since.elapsed() > GRACE) {
            return Err(e);
        }
    }
}

/// Runs the short task `f` on the calling thread; in a forked process in a separate pool.
pub fn here<T: Send>(py: Python<'_>, f: impl FnOnce() -> T + Send) -> PyResult<T> {
    if !is_forked() {
        return Ok(py.detach(f));
    }
    check(py)?;
    let pool = own_pool(None).map_err(|e| error::raise(py, e))?;
    Ok(py.detach(|| match pool {
        Some(pool) => pool.install(f),
        None => f(),
    }))
}

static POOLS: Mutex<Option<HashMap<usize, Arc<ThreadPool>>>> = Mutex::new(None);

/// A pool for an explicit number of threads (0: all cores), shared by callers with the same number, or for a forked process; `None`: the global pool.
fn own_pool(threads: Option<usize>) -> Result<Option<Arc<ThreadPool>>, Error> {
    let Some(n) = threads.or(is_forked().then_some(0)) else { return Ok(None) };
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_default();
    if let Some(pool) = pools.get(&n) {
        return Ok(Some(pool.clone()));
    }
    let pool = ThreadPoolBuilder::new().num_threads(n).build().map_err(|e| Error::Run(e.to_string()))?;
    Ok(Some(pools.entry(n).or_insert(Arc::new(pool)).clone()))
}

pub type Far = (u64, u64);

/// Like [`run`], with calls of `progress(done, total)`; an interrupt discards the result.
pub fn whole<T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&AtomicBool, &mut dyn FnMut(Far)) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let hear = |far: Far| progress.map_or(Ok(true), |progress| progress.call1(far).map(|_| true));
    let (found, interrupt) = run(py, threads, work, hear)?;
    interrupt.map_or(Ok(found), Err)
}

const WHOLE: u8 = 0;
/// Forked while no work was running.
const FORKED: u8 = 1;
/// Forked during work: its locks stay locked forever.
const AMID: u8 = 2;

static PROCESS: AtomicU8 = AtomicU8::new(WHOLE);
static WORKING: AtomicUsize = AtomicUsize::new(0);

pub fn is_forked() -> bool {
    PROCESS.load(Ordering::Relaxed) != WHOLE
}

pub fn check(py: Python<'_>) -> PyResult<()> {
    if PROCESS.load(Ordering::Relaxed) != AMID {
        return Ok(());
    }
    let why = "this process was forked while vibrissa computed in another thread, and cannot compute";
    Err(error::run(py, &format!("{why}; start it by spawn: multiprocessing.get_context(\"spawn\")")))
}

/// For `os.register_at_fork`, in the child. Devices that `kept` holds are not closed here: their driver's threads are gone.
#[pyfunction]
pub fn forked(kept: Bound<'_, PyAny>) {
    std::mem::forget(kept.unbind());
    std::mem::forget(POOLS.lock().unwrap_or_else(PoisonError::into_inner).take());
    let amid = WORKING.swap(0, Ordering::SeqCst) > 0 || PROCESS.load(Ordering::Relaxed) == AMID;
    PROCESS.store(if amid { AMID } else { FORKED }, Ordering::SeqCst);
}
