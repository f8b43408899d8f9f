//! GPU drivers, tried first in another process ([`ask_by`]), because one that crashes or hangs takes its process with it. Without [`ask_by`] this
//! process tries them itself.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::error::{Error, InputError};
use crate::kernel::gpu::{self, Adapter, Gpu, clock};
use crate::scene::Precision;

/// Limit for a driver's first calls, and for opening each device.
const PATIENCE: Duration = Duration::from_secs(20);

const DONE: &str = "done";

pub(super) type Seen = (String, String, bool);

/// Adapters that can be opened, hardware first; driver faults in words.
type Found = (Vec<Seen>, Vec<String>);

fn seen(a: &Adapter) -> Seen {
    (a.name.clone(), a.driver.clone(), a.software)
}

type How = Box<dyn Fn() -> Option<Command> + Send + Sync>;

static HOW: OnceLock<How> = OnceLock::new();

/// From now on drivers are tried by the process that `how` describes, which must call [`answer`] with its last argument, the number of the first
/// adapter to open. Only the first call counts.
pub fn ask_by(how: impl Fn() -> Option<Command> + Send + Sync + 'static) {
    let _ = HOW.set(Box::new(how));
}

/// The other process: opens the adapters from number `from` on, each after a line that names it.
pub fn answer(from: usize) {
    // A process that hangs ends with the one that started it.
    #[cfg(target_os = "linux")]
    // SAFETY: only asks for a signal when the parent ends.
    unsafe {
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL)
    };
    for adapter in gpu::adapters().into_iter().skip(from) {
        let _ = writeln!(std::io::stdout(), "{}", serde_json::json!(seen(&adapter)));
        // Failing to open is not a crash; the later open reports the error.
        drop(Gpu::new(adapter, Precision::F32));
    }
    let _ = writeln!(std::io::stdout(), "{DONE}");
}

/// The other process's result, found once; `None` without [`ask_by`], or if it does not start.
pub(super) fn found() -> Option<&'static Found> {
    static FOUND: OnceLock<Option<Found>> = OnceLock::new();
    FOUND.get_or_init(|| HOW.get().and_then(|how| found_by(how, PATIENCE))).as_ref()
}

fn found_by(how: &How, patience: Duration) -> Option<Found> {
    let (mut found, mut from) = (Found::default(), 0);
    loop {
        let mut command = how()?;
        command.arg(from.to_string()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().ok()?;
        let lines = BufReader::new(child.stdout.take()?).lines().map_while(Result::ok);
        let (tell, told) = channel();
        std::thread::spawn(move || lines.into_iter().try_for_each(|line| tell.send(line)));
        // Each line begins a call, each with its time limit; an adapter opens if another line follows.
        let mut opening: Option<Seen> = None;
        let why = loop {
            let line = told.recv_timeout(patience);
            if let Ok(line) = &line {
                from += usize::from(opening.is_some());
                found.0.extend(opening.take());
                opening = serde_json::from_str(line).ok();
            }
            match line {
                Ok(line) if line == DONE => break None,
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => {
                    break Some(format!("did not answer within {} s", patience.as_secs_f64()));
                }
                Err(_) => break child.wait().ok().map(|status| format!("crashed ({status})")),
            }
        };
        // Its drivers may fail or hang at its end.
        let _ = child.kill();
        std::thread::spawn(move || child.wait());
        match (why, opening) {
            (None, _) => return Some(found),
            (Some(why), Some(seen)) => {
                found.1.push(format!("the driver of {} {why} when it was opened", seen.0));
                from += 1;
            }
            (Some(why), None) => {
                found.1.push(format!(
                    "a GPU driver {why} when it was asked for its adapters (VK_DRIVER_FILES names another one)"
                ));
                return Some(found);
            }
        }
    }
}

/// The adapters of this process, only those that the other process could open, and driver faults in words.
pub fn look() -> (Vec<Adapter>, Vec<String>) {
    let (there, faults) = found().cloned().unzip();
    let mut faults: Vec<String> = faults.unwrap_or_default();
    if there.as_ref().is_some_and(Vec::is_empty) {
        return (Vec::new(), faults);
    }
    let looked = clock::within(clock::PATIENCE, "looking for adapters", gpu::adapters);
    let mut all = looked.map_err(|why| faults.push(why)).unwrap_or_default();
    all.retain(|a| there.as_ref().is_none_or(|there| there.contains(&seen(a))));
    (all, faults)
}

/// Adapters of [`look`]; reports driver faults.
/// Errors: a GPU is `needed`, and no adapter works because of a driver fault.
pub fn adapters(needed: bool) -> Result<Vec<Adapter>, Error> {
    let (all, faults) = look();
    if needed && all.is_empty() && !faults.is_empty() {
        let error = InputError::new(faults.join("; ")).key("--backend").value("gpu");
        return Err(error
            .allowed("auto, cpu, reference; or a driver that works (vibrissa devices lists them)")
            .into());
    }
    faults.iter().for_each(|why| gpu::hear(why));
    Ok(all)
}
