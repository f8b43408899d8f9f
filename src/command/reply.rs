//! What comes of a command.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{Content, Context, Destination, in_force, listed};
use crate::census::needed::Needed;
use crate::error::{Error, InputError};
use crate::report::answer_of;
use crate::scene::Spec;
use crate::sink::folder::Written;
use crate::sink::run_json;

#[derive(Default)]
pub struct Reply {
    /// The result in a sentence or two, with which the text begins; empty where there is none.
    pub answer: String,
    pub text: String,
    pub out: Option<PathBuf>,
    pub files: Vec<PathBuf>,
    /// Files of an older result that `--force` removed.
    pub removed: Vec<PathBuf>,
    /// What is kept in memory in place of a folder, by name.
    pub kept: Vec<(String, Content)>,
    /// run.json of a result in memory.
    pub document: Value,
    /// Numbers of rows, taps and the like; null where a command has none.
    pub counts: Value,
    /// Time taken, or expected.
    pub seconds: Value,
    /// Where taps were solved.
    pub backend: Value,
    pub result: Value,
    pub quiet: bool,
    /// What is wrong although there is a result. Exit code 1.
    pub broken: Option<String>,
    /// What was asked for beside the result and is refused. Exit code 2.
    pub refused: Option<InputError>,
}

impl Reply {
    /// Of a run into `out` that is only planned: `what` would be done.
    pub fn planned(out: PathBuf, what: impl FnOnce(std::path::Display<'_>) -> String) -> Self {
        let text = what(out.display()) + "; nothing was run\n";
        Self { text, out: Some(out), ..Self::default() }
    }

    /// Of a plan for `spec`: also what is left off of its model, if that was asked for, and the values in force.
    pub fn of_spec(self, spec: &Spec, needed: Option<&Needed>) -> Self {
        let left = needed.map_or_else(String::new, Needed::sentence);
        let text = format!("{}{left}values in force:\n{}", self.text, in_force(spec));
        let left = needed.map(|needed| needed.summary(0.0));
        Self { text, result: json!({ "in_force": run_json::in_force(spec), "model_error": left }), ..self }
    }

    /// Begins with what the report of the result in its folder says in a sentence.
    pub fn answered(self) -> Self {
        match &self.out {
            Some(out) => Self { answer: answer_of(out), ..self },
            None => self,
        }
    }

    /// Of a result in the `destination` at `out`, which ends with its run.json, the `document`.
    pub fn filed(
        self,
        destination: Destination,
        document: Value,
        out: PathBuf,
        context: &Context<'_>,
    ) -> Result<Self, Error> {
        match destination {
            Destination::Memory(kept) => Ok(Self { kept, document, ..self }),
            Destination::Folder(mut folder) => {
                folder.run_json(&document)?;
                let Written { files, removed } = folder.finish()?;
                Ok(self.with_files(out, (files, removed), (context.elapsed(), context.is_quiet())))
            }
        }
    }

    /// Of files that were written into the folder `out`, and removed, within so many seconds, with which the text ends.
    pub fn with_files(
        self,
        out: PathBuf,
        (files, removed): (Vec<PathBuf>, Vec<PathBuf>),
        (seconds, quiet): (f64, bool),
    ) -> Self {
        let text = self.text + &format!("wrote {} in {seconds:.2} s\n", listed(&files));
        Self { text, out: Some(out), files, quiet, ..self }.removing(&removed)
    }

    /// Names the files of an older result that `--force` removed.
    pub fn removing(mut self, files: &[PathBuf]) -> Self {
        if !files.is_empty() {
            self.result["removed"] = files.iter().map(|p| p.display().to_string()).collect();
            self.removed = files.to_vec();
        }
        self
    }
}
