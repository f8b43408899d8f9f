//! What ends a batch of evaluations before it is done: a request to stop, or the seconds of the budget. One evaluation of a whisker that is next to
//! where no equilibrium is can take seconds.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks.
const EVERY: Duration = Duration::from_millis(20);

/// Rings once a search is to end.
#[derive(Debug, Default)]
pub struct Alarm {
    /// Set when it rings.
    pub rings: AtomicBool,
    /// Whether anything has been scored: however slow the machine, there is an answer.
    pub scored: AtomicBool,
    done: AtomicBool,
}

/// Ends the thread that looks, also where what it watches panics.
struct Done<'a>(&'a AtomicBool);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Does `f` beside a thread that rings once `stop` is set, or `seconds` have passed and something has been scored.
pub fn watched<R>(stop: &AtomicBool, seconds: Option<f64>, f: impl FnOnce(&Alarm) -> R) -> R {
    let (alarm, begun) = (Alarm::default(), Instant::now());
    let look = || {
        while !alarm.done.load(Ordering::Relaxed) {
            let late = seconds.is_some_and(|s| begun.elapsed().as_secs_f64() >= s);
            if stop.load(Ordering::Relaxed) || late && alarm.scored.load(Ordering::Relaxed) {
                alarm.rings.store(true, Ordering::Relaxed);
            }
            std::thread::park_timeout(EVERY);
        }
    };
    std::thread::scope(|scope| {
        let looking = scope.spawn(look);
        let done = Done(&alarm.done);
        let value = f(&alarm);
        drop(done);
        looking.thread().unpark();
        value
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_rings_when_asked_or_late_and_not_before_there_is_an_answer() {
        let wait = |alarm: &Alarm| {
            let begun = Instant::now();
            while !alarm.rings.load(Ordering::Relaxed) && begun.elapsed() < Duration::from_secs(300) {
                std::thread::sleep(Duration::from_millis(1));
            }
            alarm.rings.load(Ordering::Relaxed)
        };
        assert!(watched(&AtomicBool::new(true), None, wait));
        let late = |alarm: &Alarm| {
            std::thread::sleep(4 * EVERY);
            let early = alarm.rings.load(Ordering::Relaxed);
            alarm.scored.store(true, Ordering::Relaxed);
            (early, wait(alarm))
        };
        assert_eq!(watched(&AtomicBool::new(false), Some(0.0), late), (false, true));
        assert!(!watched(&AtomicBool::new(false), None, |a| a.rings.load(Ordering::Relaxed)));
    }
}
