//! Runs the program as a shell does: redirections, pipes, signals.

use std::ffi::OsStr;
use std::ops::{Deref, DerefMut};
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use super::measuring::{REAL, prototype};
use super::program::{Desk, Kept};

/// Guards a test against hanging; no test depends on a shorter time.
pub const GUARD: Duration = Duration::from_secs(300);
/// CPU time (s per core) that the program may use after a signal. Unlike wall time it does not depend on the load of the machine.
#[cfg(target_os = "linux")]
const PROMPT: f64 = 2.0;

pub fn program(desk: &Desk, arguments: &[impl AsRef<OsStr>]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("vibrissa"));
    command.current_dir(desk.path(".")).args(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    hearing(&mut command);
    command
}

/// Resets the signals that the tests were started to ignore: a background job ignores SIGINT, `nohup` SIGHUP.
#[cfg(unix)]
pub fn hearing(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    // SAFETY: `signal` may be called between fork and exec.
    unsafe {
        command.pre_exec(|| {
            for signal in [libc::SIGINT, libc::SIGQUIT, libc::SIGTERM, libc::SIGHUP] {
                libc::signal(signal, libc::SIG_DFL);
            }
            Ok(())
        })
    };
}

#[cfg(not(unix))]
pub fn hearing(_: &mut Command) {}

/// A started program, killed when dropped.
pub struct Running(Option<Child>);

impl Running {
    pub fn new(command: &mut Command) -> Self {
        Self(Some(command.spawn().expect("it starts")))
    }

    pub fn wait_with_output(mut self) -> std::io::Result<Output> {
        self.0.take().expect("there until it is waited for").wait_with_output()
    }
}

impl Deref for Running {
    type Target = Child;

    fn deref(&self) -> &Child {
        self.0.as_ref().expect("there until it is waited for")
    }
}

impl DerefMut for Running {
    fn deref_mut(&mut self) -> &mut Child {
        self.0.as_mut().expect("there until it is waited for")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Runs a shell line on `desk`, in which `vibrissa` runs the program.
pub fn shell(desk: &Desk, line: &str) -> Output {
    let program = assert_cmd::cargo::cargo_bin("vibrissa");
    let script = format!("vibrissa() {{ \"$PROGRAM\" \"$@\"; }}\n{line}");
    let mut command = Command::new("sh");
    command.current_dir(desk.path(".")).env("PROGRAM", program).args(["-c", &script]);
    hearing(&mut command);
    command.stdin(Stdio::null()).output().expect("a shell")
}

/// A whisker in spec.toml, its data in sim, its calibration in cal: few taps, so that it is made quickly.
pub fn calibrated() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let taps = "[tap]\na = { from = 21, to = 45, step = 6 }\ntheta = [1, 4, 8]\n";
        let desk = Desk::new(&prototype(10.0, &["noise_strain = 1e-5\n", taps, REAL]));
        desk.ok("simulate spec.toml --repeats 2 --out sim");
        desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
        desk.keep()
    });
    MADE.desk()
}

#[cfg(unix)]
pub fn send(child: &Child, signal: i32) {
    let id = i32::try_from(child.id()).expect("a process id");
    // SAFETY: only sends a signal, to a child that was not yet waited for.
    assert_eq!(unsafe { libc::kill(id, signal) }, 0);
}

#[cfg(target_os = "linux")]
pub fn until_it_hears(child: &Child, signal: i32) {
    let heard = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).unwrap_or("0");
        u64::from_str_radix(mask.trim(), 16).is_ok_and(|m| m >> (signal - 1) & 1 == 1)
    };
    until(heard, "the program does not listen");
}

#[track_caller]
pub fn until(condition: impl Fn() -> bool, otherwise: &str) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < GUARD, "{otherwise}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(target_os = "linux")]
fn work(child: &Child) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).expect("not waited for yet");
    // The name in brackets may contain spaces and brackets.
    let fields: Vec<&str> = stat[stat.rfind(')').expect("a name")..].split(' ').collect();
    let ticks = |k: usize| fields[k].parse::<f64>().expect("ticks of user and system");
    // SAFETY: only asks for a number.
    (ticks(12) + ticks(13)) / unsafe { libc::sysconf(libc::_SC_CLK_TCK) } as f64
}

/// Waits until `child` has computed for another 0.3 s.
#[cfg(target_os = "linux")]
pub fn until_it_works(child: &Child) {
    let before = work(child);
    let deep = || {
        assert_eq!(state(child), 0, "it ended by itself");
        work(child) > before + 0.3
    };
    until(deep, "it does not work");
}

/// Waits for the end of `child` after a signal; fails if it continues working.
#[cfg(target_os = "linux")]
#[track_caller]
pub fn ends(mut child: Running) -> Output {
    let (begun, before) = (Instant::now(), work(&child));
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    loop {
        let after = work(&child) - before;
        if child.try_wait().expect("a child").is_some() {
            break;
        }
        assert!(after < PROMPT * cores as f64, "it goes on: {after} s of CPU time after the signal");
        assert!(begun.elapsed() < GUARD, "it neither works nor ends");
        std::thread::sleep(Duration::from_millis(10));
    }
    child.wait_with_output().expect("its words")
}

/// State of `child`: exited, killed, stopped, or 0 while it runs. Does not reap it.
#[cfg(unix)]
fn state(child: &Child) -> i32 {
    let mut info = std::mem::MaybeUninit::<libc::siginfo_t>::zeroed();
    let how = libc::WEXITED | libc::WSTOPPED | libc::WNOHANG | libc::WNOWAIT;
    // SAFETY: only looks at a child, and writes what it sees.
    unsafe {
        assert_eq!(libc::waitid(libc::P_PID, child.id(), info.as_mut_ptr(), how), 0);
        info.assume_init().si_code
    }
}

/// Starts a run and stops it (SIGSTOP) while `amid` is true; tries again if it ended before.
#[cfg(unix)]
#[track_caller]
pub fn held(begin: impl Fn() -> Running, amid: impl Fn() -> bool) -> Running {
    for _ in 0..20 {
        let child = begin();
        until(|| amid() || state(&child) != 0, "it does not come so far");
        send(&child, libc::SIGSTOP);
        until(|| state(&child) != 0, "it is not stopped");
        if state(&child) == libc::CLD_STOPPED && amid() {
            return child;
        }
    }
    panic!("twenty runs ended before one could be stopped");
}

pub fn words(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}
