//! Long work on a thread of its own, without the interpreter's lock, so that Ctrl-C and callbacks are served while it runs.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use vibrissa::error::Error;

use super::error;

/// Time in which the work may end by itself after an interrupt; then it is left behind. Interrupts are answered within two seconds.
const GRACE: Duration = Duration::from_millis(1500);
const STEP: Duration = Duration::from_millis(50);
const STACK: usize = 8 << 20;

enum News<N, T> {
    Part(N),
    End(Result<T, Error>),
}

/// What work came to, and the interrupt that it ended by, if one did.
pub type Ended<T> = (T, Option<PyErr>);

/// Does `work` with `threads` (all cores where nobody says), which is handed a flag that asks it to stop and a way to tell how far it is;
/// `hear` is told, and says whether to go on. After an interrupt, work that ends by itself in time gives what it has.
pub fn run<N: Send + 'static, T: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool, &mut dyn FnMut(N)) -> Result<T, Error> + Send + 'static,
    mut hear: impl FnMut(N) -> PyResult<bool>,
) -> PyResult<Ended<T>> {
    check(py)?;
    let pool = own_pool(threads).map_err(|e| error::raise(py, e))?;
    let working = Working::new();
    let stop = Arc::new(AtomicBool::new(false));
    let (tell, news) = channel();
    let news = Mutex::new(news);
    let asked = Arc::clone(&stop);
    let whole = move || {
        let told = tell.clone();
        let work = move || {
            work(&asked, &mut |part| {
                let _ = told.send(News::Part(part));
            })
        };
        let end = match pool {
            Some(pool) => pool.install(work),
            None => work(),
        };
        drop(working);
        let _ = tell.send(News::End(end));
    };
    let worker = Builder::new().stack_size(STACK).spawn(whole);
    let worker = worker.map_err(|e| error::run(py, &e.to_string()))?;
    let mut interrupt: Option<(PyErr, Instant)> = None;
    loop {
        let mut heard = Ok(true);
        let next = py.detach(|| news.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(STEP));
        match next {
            Ok(News::Part(part)) if interrupt.is_none() => heard = hear(part),
            Ok(News::Part(_)) | Err(RecvTimeoutError::Timeout) => {}
            Ok(News::End(end)) => {
                return match (end, interrupt) {
                    (Ok(value), interrupt) => Ok((value, interrupt.map(|(e, _)| e))),
                    (Err(_), Some((e, _))) => Err(e),
                    (Err(e), None) => Err(error::raise(py, e)),
                };
            }
            Err(RecvTimeoutError::Disconnected) => {
                let why = worker.join().err().map(|panic| {
                    let text = panic.downcast_ref::<String>().map(String::as_str);
                    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a thread ended").to_owned()
                });
                let why = why.unwrap_or_else(|| "a thread ended".to_owned());
                return Err(error::run(py, &format!("this should not have happened: {why}")));
            }
        }
        if interrupt.is_none() {
            if let Err(e) =
                heard.as_ref().map(drop).map_err(|e| e.clone_ref(py)).and_then(|()| py.check_signals())
            {
                stop.store(true, Ordering::Relaxed);
                interrupt = Some((e, Instant::now()));
            } else if matches!(heard, Ok(false)) {
                stop.store(true, Ordering::Relaxed);
            }
        }
        if let Some((e, _)) = interrupt.take_if(|(_, since)| since.elapsed() > GRACE) {
            return Err(e);
        }
    }
}

/// Does `f`, which takes less than a moment, on the thread that asks; in a forked process on its own.
///
/// # Errors
/// Threads that do not start; a process that cannot compute.
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

/// Threads of their own for whoever says how many (0: all cores), the same for all who ask for as many, and for forked processes; others share those
/// of the library.
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

pub fn forget_pools() {
    std::mem::forget(POOLS.lock().unwrap_or_else(PoisonError::into_inner).take());
}

/// How far work is: taps done, of how many.
pub type Far = (u64, u64);

/// As [`run`], with `progress(done, total)` called, if there is any; after an interrupt there is nothing.
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

/// No fork, or none since the package was imported.
const WHOLE: u8 = 0;
/// Forked while nothing was computed.
const FORKED: u8 = 1;
/// Forked amid work: what that work held is held for ever.
const AMID: u8 = 2;

static PROCESS: AtomicU8 = AtomicU8::new(WHOLE);
static WORKING: AtomicUsize = AtomicUsize::new(0);

pub struct Working(());

impl Working {
    pub fn new() -> Self {
        WORKING.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        WORKING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Whether threads of the library are those of another process.
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
    forget_pools();
    let amid = WORKING.swap(0, Ordering::SeqCst) > 0 || PROCESS.load(Ordering::Relaxed) == AMID;
    PROCESS.store(if amid { AMID } else { FORKED }, Ordering::SeqCst);
}
