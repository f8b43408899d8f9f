//! How a result or an error reaches the user: text, or one JSON object.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use miette::{GraphicalReportHandler, GraphicalTheme};
use serde_json::{Value, json};
use vibrissa::error::{Error, InputError};

/// Version of the JSON object.
const FORMAT: u32 = 1;

/// A finished command.
pub struct Reply {
    /// For people, on stdout.
    pub text: String,
    /// Result folder.
    pub out: Option<PathBuf>,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Counts, seconds, backend, result; null where a command has none.
    pub counts: Value,
    pub seconds: Value,
    pub backend: Value,
    pub result: Value,
    /// The spec asks for silence.
    pub quiet: bool,
}

impl Reply {
    /// Names the files of an older result that `--force` removed.
    pub fn removing(mut self, files: &[PathBuf]) -> Self {
        if !files.is_empty() {
            eprintln!("--force removed {} of an older result", super::listed(files));
            self.result["removed"] = files.iter().map(|p| p.display().to_string()).collect();
        }
        self
    }

    /// Prints it.
    pub fn print(self, command: &str, json: bool, quiet: bool) -> ExitCode {
        self.show(command, json, quiet, None);
        ExitCode::SUCCESS
    }

    /// Prints a result that shows a failure: the result as ever, then what is wrong. Exit code 1.
    pub fn print_broken(self, command: &str, json: bool, quiet: bool, message: &str) -> ExitCode {
        self.show(command, json, quiet, Some(message));
        ExitCode::FAILURE
    }

    fn show(self, command: &str, json: bool, quiet: bool, broken: Option<&str>) {
        let path = |p: &Path| p.display().to_string();
        if json {
            let mut object = json!({
                "format": FORMAT,
                "command": command,
                "version": env!("CARGO_PKG_VERSION"),
                "ok": broken.is_none(),
                "out": self.out.as_deref().map(path),
                "files": self.files.iter().map(|p| path(p)).collect::<Vec<_>>(),
                "counts": self.counts,
                "seconds": self.seconds,
                "backend": self.backend,
                "result": self.result,
            });
            if let Some(message) = broken {
                object["error"] = error_json(&InputError::default(), message);
            }
            write_out(&format!("{object}\n"));
            return;
        }
        if !quiet && !self.quiet {
            write_out(&self.text);
        }
        if let Some(message) = broken {
            eprintln!("error: {message}");
        }
    }
}

/// Writes to stdout; a reader that has gone away is no failure of ours.
fn write_out(text: &str) {
    use std::io::Write;
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// Prints an error: JSON on stdout or, with the offending lines, on stderr.
pub fn failure(command: &str, error: &Error, json: bool) -> ExitCode {
    if json {
        let empty = InputError::default();
        let (e, message) = match error {
            Error::Input(e) => (e, e.message.clone()),
            other => (&empty, other.to_string()),
        };
        print_failure(command, e, &message);
    } else {
        eprintln!("{}", render(error));
    }
    ExitCode::from(error.exit_code())
}

fn print_failure(command: &str, e: &InputError, message: &str) {
    let object = json!({
        "format": FORMAT,
        "command": command,
        "version": env!("CARGO_PKG_VERSION"),
        "ok": false,
        "error": error_json(e, message),
    });
    write_out(&format!("{object}\n"));
}

fn error_json(e: &InputError, message: &str) -> Value {
    json!({ "file": e.file, "line": e.line, "key": e.key, "value": e.value, "allowed": e.allowed, "message": message })
}

fn render(error: &Error) -> String {
    let Error::Input(input) = error else { return format!("error: {error}") };
    if input.snippet.is_none() {
        return format!("error: {error}");
    }
    let color = std::io::IsTerminal::is_terminal(&std::io::stderr());
    let theme = if color { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let mut text = String::new();
    let handler = GraphicalReportHandler::new_themed(theme).with_width(160).without_cause_chain();
    match handler.render_report(&mut text, input) {
        Ok(()) => format!("error: {}", text.trim().trim_start_matches('×').trim_start()),
        Err(_) => format!("error: {error}"),
    }
}

/// A command line that cannot be understood, or a request for help.
pub fn usage(e: &clap::Error, json: bool) -> ExitCode {
    if !e.use_stderr() {
        let _ = e.print();
        return ExitCode::SUCCESS;
    }
    if json {
        let text = e.to_string();
        let message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        let command = std::env::args().nth(1).filter(|a| !a.starts_with('-')).unwrap_or_default();
        print_failure(&command, &InputError::default(), &message);
    } else {
        let _ = e.print();
    }
    ExitCode::from(2)
}
