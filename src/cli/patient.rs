//! Input that may not come for long: it is waited for in steps, between which a signal is heard.

use std::io::Read;

use super::interrupt;

/// Reads from `input`; after a signal there is no more.
pub struct Patient<R>(pub R);

#[cfg(unix)]
impl<R: Read + std::os::fd::AsRawFd> Read for Patient<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        /// Between two looks, ms.
        const STEP: i32 = 100;
        let mut ready = libc::pollfd { fd: self.0.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        while !interrupt::asked() {
            // SAFETY: one `pollfd`, which lives as long as the call.
            let there = unsafe { libc::poll(&mut ready, 1, STEP) };
            let early = || std::io::Error::last_os_error().kind() == std::io::ErrorKind::Interrupted;
            // What else fails here, fails in `read` with its reason.
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
        if interrupt::asked() { Ok(0) } else { self.0.read(buffer) }
    }
}
