//! Ctrl-C, SIGTERM and SIGHUP: the first ends the run in order within two seconds, the second at once. A separate thread waits for them, so that a
//! blocked run is interrupted too. A signal that was ignored at the start (`nohup`, background jobs of a script) stays ignored.

use std::io::Read;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use vibrissa::kernel::gpu::left_behind;
use vibrissa::sink::folder::end_all;

use super::reply;

/// Time for the last message, because stderr may block.
const WORDS: Duration = Duration::from_millis(300);

static STOP: AtomicBool = AtomicBool::new(false);
/// Time for a run to end after a signal, ms; 0 if it does not check the flag.
static GRACE: AtomicU64 = AtomicU64::new(0);
/// Value of [`GRACE`] for a run that writes its results after a signal, however long that takes.
const ENDLESS: u64 = u64::MAX;

/// The flag set by the first signal, for a run that checks it and then ends: without output, or, if it `keeps`, after it has written what it has.
pub fn stop(keeps: bool) -> &'static AtomicBool {
    GRACE.store(if keeps { ENDLESS } else { 1200 }, Ordering::Relaxed);
    &STOP
}

pub fn asked() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// Ends the process at once after a signal, or if a driver has not returned, without closing drivers: a thread may still be inside one.
pub fn end_after_a_signal(code: u8) {
    use std::io::Write;
    if asked() || left_behind() {
        let _ = std::io::stdout().flush();
        signal_hook::low_level::exit(code.into());
    }
}

fn first() {
    STOP.store(true, Ordering::Relaxed);
    std::thread::spawn(|| match GRACE.load(Ordering::Relaxed) {
        ENDLESS => reply::line("stopping, to keep what is there; once more ends it at once"),
        grace => {
            std::thread::sleep(Duration::from_millis(grace));
            end();
        }
    });
}

/// Ends the process without unwinding: other threads may be inside a driver.
fn end() -> ! {
    let (done, wait) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        reply::interrupted(&end_all());
        let _ = done.send(());
    });
    let _ = wait.recv_timeout(WORDS);
    signal_hook::low_level::exit(1)
}

#[cfg(unix)]
pub fn listen() {
    use std::time::Instant;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    /// Signals closer than this count as one: `timeout` signals the process and its group.
    const ONE: Duration = Duration::from_millis(50);

    // With this, a file size limit (`ulimit -f`) is a write error instead of the end of the process.
    // SAFETY: to ignore a signal runs no code of ours.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
    let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|s| !ignored(*s));
    let Ok(mut signals) = Signals::new(heard) else { return };
    std::thread::spawn(move || {
        let mut since: Option<Instant> = None;
        for signal in signals.forever() {
            match since {
                None => {
                    since = Some(Instant::now());
                    first();
                }
                Some(since) if since.elapsed() > ONE => {
                    let _ = signal_hook::low_level::emulate_default_handler(signal);
                }
                Some(_) => {}
            }
        }
    });
}

/// True if the process started with `signal` ignored.
#[cfg(unix)]
fn ignored(signal: i32) -> bool {
    let mut now = std::mem::MaybeUninit::<libc::sigaction>::uninit();
    // SAFETY: without a new action `sigaction` only writes the present one; its return value says if it did.
    unsafe {
        libc::sigaction(signal, std::ptr::null(), now.as_mut_ptr()) == 0
            && now.assume_init().sa_sigaction == libc::SIG_IGN
    }
}

/// Starts to listen: the first Ctrl-C sets the flag, the second ends the process.
#[cfg(not(unix))]
pub fn listen() {
    use std::sync::Arc;

    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::flag;

    let heard = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let _ = flag::register_conditional_shutdown(signal, 1, Arc::clone(&heard));
        let _ = flag::register(signal, Arc::clone(&heard));
    }
    std::thread::spawn(move || {
        while !heard.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(50));
        }
        first();
    });
}

pub struct Patient<R>(pub R);

#[cfg(unix)]
impl<R: Read + std::os::fd::AsRawFd> Read for Patient<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        const STEP: i32 = 100;
        let mut ready = libc::pollfd { fd: self.0.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        while !asked() {
            // SAFETY: one `pollfd`, which lives as long as the call.
            let there = unsafe { libc::poll(&mut ready, 1, STEP) };
            let early = || std::io::Error::last_os_error().kind() == std::io::ErrorKind::Interrupted;
            if there > 0 || (there < 0 && !early()) {
                return self.0.read(buffer);
            }
        }
        Ok(0)
    }
}

#[cfg(not(unix))]
impl<R: Read> Read for Patient<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if asked() { Ok(0) } else { self.0.read(buffer) }
    }
}
