//! `vibrissa cite`: how to cite the program, the model and a result.

use std::path::PathBuf;

use clap::Args as Flags;
use serde_json::{Value, json};
use vibrissa::error::Error;
use vibrissa::report::source::Source;

use super::reply::Reply;

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The paper of the model.
const PAPER: &str = "@inproceedings{nguyen2020whisker,\n  \
    title     = {Contact Distance Estimation by a Soft Active Whisker Sensor Based on Morphological Computation},\n  \
    author    = {Nguyen and Ngo and Nguyen and Ho},\n  \
    booktitle = {IEEE RAS/EMBS International Conference for Biomedical Robotics and Biomechatronics (BioRob)},\n  \
    year      = {2020},\n}\n";

/// How to cite the program, the model and a result.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa cite results/prototypes")]
pub struct Cite {
    /// Folder of a result
    pub dir: PathBuf,
    /// Cite also a result whose files were changed since it was written
    #[arg(long)]
    pub force: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &Cite) -> Result<Reply, Error> {
    let source = Source::open(&args.dir, args.force)?;
    let run = &source.run;
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let version = text(&run["version"]).unwrap_or_else(|| VERSION.to_owned());
    let commit = text(&run["commit"]).map_or(String::new(), |commit| format!(", commit {commit}"));
    let backend = &run["backend"];
    let on = ["name", "adapter", "precision"].into_iter().filter_map(|key| text(&backend[key]));
    let on: Vec<String> = on.collect();
    let on = if on.is_empty() { String::new() } else { format!(" on {}", on.join(", ")) };
    let tolerance = backend["tolerance"].as_f64().map_or(String::new(), |t| format!(", tolerance {t:e}"));
    let result = format!(
        "Computed by Vibrissa {version}{commit}: `vibrissa {}` of {}{on}{tolerance}. BLAKE3 of its run.json: {}.",
        source.command, source.name, source.hash
    );
    let program = format!(
        "@software{{vibrissa,\n  title   = {{Vibrissa: sweeps, optimises and calibrates tapered soft whisker sensors}},\n  \
         author  = {{{{The Vibrissa authors}}}},\n  version = {{{version}}},\n  note    = {{{}}},\n}}\n",
        if commit.is_empty() { "MIT or Apache-2.0" } else { commit.trim_start_matches(", ") }
    );
    let notes: String = source.notes.iter().map(|note| format!("note: {note}\n")).collect();
    Ok(Reply {
        text: format!(
            "{notes}{result}\n\nThe program:\n\n{program}\nThe model, which the program corrects and extends:\n\n{PAPER}"
        ),
        out: Some(args.dir.clone()),
        result: json!({ "result": result, "program": program, "model": PAPER, "notes": source.notes }),
        ..Reply::default()
    })
}
