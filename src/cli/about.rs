//! `vibrissa help`, `completions`, `man`, `devices`, and `cite`: how to cite the program, the model and a result.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::{Args as Flags, CommandFactory, Parser};
use serde_json::{Value, json};
use vibrissa::backend::{self, Choice, listed};
use vibrissa::error::{Error, InputError, nearest};
use vibrissa::kernel::cpu::Cpu;
use vibrissa::reference::{self, Topic};
use vibrissa::report::Source;
use vibrissa::scene::{BackendChoice, RunOptions};

use super::args::{Args, Common};
use super::reply::{self, Reply};

const ALL: &str = "reference";

pub fn help(topic: Option<&str>, part: Option<&str>) -> u8 {
    let told = match topic {
        None => return of_clap(&["--help"]),
        Some(command) if commands().iter().any(|c| c == command) => return of_clap(&[command, "--help"]),
        Some(topic) => tell(topic, part),
    };
    match told {
        Ok(text) => reply::print(Reply { text, ..Reply::default() }, false),
        Err(e) => reply::failure(&e.into()),
    }
}

fn of_clap(arguments: &[&str]) -> u8 {
    let typed = std::iter::once(&"vibrissa").chain(arguments);
    Args::try_parse_from(typed).map_or_else(|e| reply::usage(&e), |_| 0)
}

fn tell(topic: &str, part: Option<&str>) -> Result<String, InputError> {
    if topic == ALL {
        return Ok(reference::page());
    }
    let Some((_, asked, _)) = Topic::WORDS.into_iter().find(|(word, ..)| *word == topic) else {
        let topics = Topic::WORDS.iter().map(|(word, ..)| (*word).to_owned());
        return Err(unknown("topic", topic, topics.chain([ALL.to_owned()]).chain(commands()).collect()));
    };
    let text = asked.plain(part);
    match part {
        Some(part) if text.is_empty() => Err(unknown("part", part, asked.titles())),
        _ => Ok(text),
    }
}

fn unknown(what: &str, word: &str, known: Vec<String>) -> InputError {
    let names: Vec<&str> = known.iter().map(String::as_str).collect();
    let hint = nearest(word, &names).map_or_else(String::new, |name| format!("; did you mean {name}?"));
    let error = InputError::new(format!("there is no such {what}{hint}")).key("help");
    error.value(word).allowed(names.join(", "))
}

fn commands() -> Vec<String> {
    Args::command().get_subcommands().map(|c| c.get_name().to_owned()).collect()
}

pub fn completions(shell: clap_complete::Shell) -> Reply {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "vibrissa", &mut script);
    Reply { text: String::from_utf8_lossy(&script).into_owned(), ..Reply::default() }
}

pub fn man(out: Option<&Path>) -> Result<Reply, Error> {
    let Some(folder) = out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(Args::command()).render(&mut page).map_err(|e| Error::Run(e.to_string()))?;
        return Ok(Reply { text: String::from_utf8_lossy(&page).into_owned(), ..Reply::default() });
    };
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Args::command(), folder))
        .map_err(|e| Error::io(folder, e))?;
    Ok(Reply { text: format!("wrote the manual pages into {}\n", folder.display()), ..Reply::default() })
}

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

pub fn cite(args: &Cite) -> Result<Reply, Error> {
    let source = Source::open(&args.dir, args.force)?;
    let cite = &source.run;
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let version = text(&cite["version"]).unwrap_or_else(|| VERSION.to_owned());
    let commit = text(&cite["commit"]).map_or(String::new(), |commit| format!(", commit {commit}"));
    let backend = &cite["backend"];
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

/// Lists adapters, faults of drivers, and the choice of `auto` or of another `--backend`.
pub fn devices(common: &Common) -> Result<Reply, Error> {
    let (adapters, faults) = backend::look();
    let options = common.over(&RunOptions::default());
    let choice = Choice::new(&options)?;
    let mut text = String::new();
    for a in &adapters {
        let kind = if a.software { "software" } else { "hardware" };
        let _ = writeln!(text, "{}  ({kind}, {})", a.name, a.api);
        let _ = writeln!(text, "    driver        {}", a.driver);
        let (size, groups) = (a.max_binding >> 20, a.max_workgroups);
        let _ = writeln!(text, "    largest binding {size} MiB, {groups} workgroups a dimension");
        let _ = writeln!(text, "    features      {}", a.features.join(", "));
    }
    text.extend(faults.iter().map(|why| format!("{why}\n")));
    if adapters.is_empty() && faults.is_empty() {
        text += "no Vulkan, Metal or DirectX 12 adapter (Debian: apt install mesa-vulkan-drivers)\n";
    }
    let (threads, instructions) = (rayon::current_num_threads(), Cpu::instructions());
    let _ = writeln!(text, "CPU kernels  ({threads} threads, {instructions})");
    let b = &choice.backend;
    let name = b.adapter.as_deref().unwrap_or(match b.name {
        "reference" => "the reference",
        _ => "CPU kernels",
    });
    let word = options.backend.unwrap_or(BackendChoice::Auto).word();
    let _ = writeln!(text, "--backend {word} takes: {name} ({})", b.reason);

    let (counts, result) = (json!({ "adapters": adapters.len() }), listed(&adapters, &faults));
    Ok(Reply { text, counts, backend: json!(b), result, ..Reply::default() })
}
