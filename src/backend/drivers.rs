//! GPU drivers, asked from outside first: one that crashes or hangs takes its process with it, so another process makes the first calls.
//!
//! The program starts itself once more for it, Python its interpreter with the native module alone ([`ask_by`] says how). A process of which
//! that is not known asks its drivers itself, as every program does that uses Vulkan.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::error::{Error, InputError};
use crate::kernel::gpu::{self, Adapter, Gpu, quietly};
use crate::scene::Precision;

/// Time that a driver has for its first calls, and for each device that is opened.
const PATIENCE: Duration = Duration::from_secs(20);

/// Time that the other process has to end, once it has said all it will say.
const LAST: Duration = Duration::from_millis(500);

/// What the other process says, a line of JSON each.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    /// The adapters there are.
    Adapters(Vec<Seen>),
    /// The adapter of this number is being opened.
    Opens(usize),
    /// The calls panicked; the words.
    Failed(String),
    /// Every call has returned.
    Done,
}

/// An adapter that another process has seen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seen {
    /// Its name.
    pub name: String,
    /// Driver and version.
    driver: String,
    /// Whether it runs on the CPU.
    pub software: bool,
}

impl Seen {
    fn of(a: &Adapter) -> Self {
        Self { name: a.name.clone(), driver: a.driver.clone(), software: a.software }
    }
}

/// What is known of the drivers.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Adapters that can be opened, hardware first.
    pub adapters: Vec<Seen>,
    /// What drivers did wrong, in words.
    pub faults: Vec<String>,
}

type How = Box<dyn Fn() -> Option<Command> + Send + Sync>;

static HOW: OnceLock<How> = OnceLock::new();
static FOUND: OnceLock<Option<Found>> = OnceLock::new();

/// From now on drivers are asked by the process that `how` describes, which is to call [`answer`]; the number of the first adapter to be
/// opened is added as its last argument. The first call counts.
pub fn ask_by(how: impl Fn() -> Option<Command> + Send + Sync + 'static) {
    let _ = HOW.set(Box::new(how));
}

/// The other process: asks the drivers for their adapters and opens those from number `from` on. It says on stdout what it does next, so that
/// what a crash cuts off is known.
pub fn answer(from: usize) {
    // A process that hangs ends with the one that started it.
    #[cfg(target_os = "linux")]
    // SAFETY: only asks for a signal when the parent ends.
    unsafe {
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL)
    };
    let say = |line: &Line| {
        let text = serde_json::to_string(line).unwrap_or_default();
        let _ = writeln!(std::io::stdout(), "{text}");
    };
    let asked = quietly(|| {
        let all = gpu::adapters();
        say(&Line::Adapters(all.iter().map(Seen::of).collect()));
        for (i, adapter) in all.into_iter().enumerate().skip(from) {
            say(&Line::Opens(i));
            // That it does not open is no crash: whoever opens it hears why.
            drop(Gpu::new(adapter, Precision::F32));
        }
    });
    say(&asked.map_or_else(Line::Failed, |()| Line::Done));
}

/// What another process found of the drivers, asked once; `None` where nobody has said how one is started, or it does not start.
pub fn found() -> Option<&'static Found> {
    FOUND.get_or_init(|| HOW.get().and_then(|how| found_by(how, PATIENCE))).as_ref()
}

fn found_by(how: &How, patience: Duration) -> Option<Found> {
    let (mut found, mut broken, mut from) = (Found::default(), Vec::new(), 0);
    loop {
        let mut command = how()?;
        command.arg(from.to_string());
        let (lines, end) = said(command, patience)?;
        let mut last = None;
        for line in lines {
            match line {
                Line::Adapters(all) => found.adapters = all,
                Line::Opens(i) => last = Some(i),
                Line::Failed(why) => found.faults.push(format!("asking the GPU drivers failed: {why}")),
                Line::Done => {}
            }
        }
        match (end, last) {
            (None, _) => break,
            (Some(why), Some(i)) if i < found.adapters.len() && i >= from => {
                found
                    .faults
                    .push(format!("the driver of {} {why} when it was opened", found.adapters[i].name));
                broken.push(i);
                from = i + 1;
            }
            (Some(why), _) => {
                let other = "VK_DRIVER_FILES names another one";
                found.faults.push(format!("a GPU driver {why} when it was asked for its adapters ({other})"));
                break;
            }
        }
    }
    let mut i = 0;
    found.adapters.retain(|_| (!broken.contains(&i), i += 1).0);
    Some(found)
}

/// What `command` says, and how it ended before it was done; `None` where it does not start.
fn said(mut command: Command, patience: Duration) -> Option<(Vec<Line>, Option<String>)> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().ok()?;
    let stdout = child.stdout.take()?;
    let (tell, told) = channel();
    std::thread::spawn(move || {
        let lines = BufReader::new(stdout).lines().map_while(Result::ok);
        lines.filter_map(|line| serde_json::from_str(&line).ok()).try_for_each(|line: Line| tell.send(line))
    });
    let mut lines = Vec::new();
    // Each line begins a call, which has its own time.
    while let Ok(line) = told.recv_timeout(patience) {
        let ended = matches!(line, Line::Done | Line::Failed(_));
        lines.push(line);
        if ended {
            // What its drivers do at its end does not matter.
            let _ = ended_within(&mut child, LAST);
            let _ = child.kill();
            let _ = ended_within(&mut child, LAST);
            return Some((lines, None));
        }
    }
    let end = match ended_within(&mut child, LAST) {
        Some(status) => format!("crashed ({})", in_words(status)),
        None => format!("did not answer within {} s", patience.as_secs_f64()),
    };
    let _ = child.kill();
    let _ = ended_within(&mut child, LAST);
    Some((lines, Some(end)))
}

/// How `child` ended, if it does within `time`. One inside a driver may not even end when it is killed.
fn ended_within(child: &mut Child, time: Duration) -> Option<ExitStatus> {
    let begun = Instant::now();
    loop {
        match child.try_wait() {
            Ok(None) if begun.elapsed() < time => std::thread::sleep(Duration::from_millis(2)),
            other => return other.ok().flatten(),
        }
    }
}

fn in_words(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        let name =
            super::crash::CRASHES.iter().find(|(number, _)| *number == signal).map_or("", |(_, name)| name);
        return format!("signal {signal}{name}");
    }
    status.to_string()
}

/// The adapters, opened by this process: those that another one could open, where one was asked, and what drivers did wrong.
pub fn look() -> (Vec<Adapter>, Vec<String>) {
    let asked = found();
    let mut faults = asked.map_or_else(Vec::new, |found| found.faults.clone());
    if asked.is_some_and(|found| found.adapters.is_empty()) {
        return (Vec::new(), faults);
    }
    let mut all = quietly(gpu::adapters).unwrap_or_else(|why| {
        faults.push(format!("looking for adapters failed: {why}"));
        Vec::new()
    });
    all.retain(|a| asked.is_none_or(|found| found.adapters.contains(&Seen::of(a))));
    #[cfg(unix)]
    super::crash::loaded(all.iter().map(|a| a.name.as_str()));
    (all, faults)
}

/// As [`look`], for a command that needs a GPU (`needed`) or takes those there are; what drivers did wrong is told.
///
/// # Errors
/// No adapter, because of what a driver did, where one is needed.
pub fn adapters(needed: bool) -> Result<Vec<Adapter>, Error> {
    let (all, faults) = look();
    match faults.is_empty() {
        false if needed && all.is_empty() => return Err(unusable(&faults)),
        _ => faults.iter().for_each(|why| gpu::hear(why)),
    }
    Ok(all)
}

/// No GPU where one was asked for.
fn unusable(faults: &[String]) -> Error {
    let error = InputError::new(faults.join("; ")).key("--backend").value("gpu");
    error.allowed("auto, cpu, reference; or a driver that works (vibrissa devices lists them)").into()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// For a process that answers: only so that a test does not hang.
    const LONG: Duration = Duration::from_secs(300);

    /// What is found where the other process is `script`, which has the number of the first adapter as $1.
    fn found_by_script(script: &'static str, limit: Duration) -> Found {
        let how = move || {
            let mut command = Command::new("sh");
            command.args(["-c", script, "sh"]);
            Some(command)
        };
        found_by(&(Box::new(how) as How), limit).unwrap()
    }

    const TWO: &str = r#"echo '{"adapters":[{"name":"A","driver":"","software":false},{"name":"B","driver":"","software":true}]}'"#;

    #[test]
    fn a_driver_that_crashes_or_hangs_is_told_in_words() {
        for (script, limit, fault) in [
            ("kill -SEGV $$", LONG, "crashed (signal 11 SIGSEGV) when it was asked"),
            ("exec sleep 600", Duration::from_millis(400), "did not answer within 0.4 s"),
            (r#"echo '{"failed":"no room"}'"#, LONG, "no room"),
        ] {
            let found = found_by_script(script, limit);
            assert!(found.adapters.is_empty() && found.faults[0].contains(fault), "{found:?}");
        }
    }

    #[test]
    fn an_adapter_that_crashes_when_it_is_opened_leaves_the_others() {
        let script = format!(
            r#"{TWO}; [ "$1" = 0 ] && echo '{{"opens":0}}' && kill -ABRT $$; echo '{{"opens":1}}'; echo '"done"'"#
        );
        let found = found_by_script(Box::leak(script.into_boxed_str()), LONG);
        assert_eq!(found.adapters.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), ["B"]);
        assert!(
            found.faults.len() == 1 && found.faults[0].contains("the driver of A crashed (signal 6 SIGABRT)"),
            "{found:?}"
        );
    }
}
