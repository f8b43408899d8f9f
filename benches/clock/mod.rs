//! Times of work on one thread.

#[cfg(unix)]
pub fn now() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the place is valid for the call.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Wall time: this system has no CPU time of a thread.
#[cfg(not(unix))]
pub fn now() -> f64 {
    static BEGUN: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    BEGUN.elapsed().as_secs_f64()
}

/// Seconds of `work`.
pub fn spent(work: impl FnOnce()) -> f64 {
    let before = now();
    work();
    now() - before
}
