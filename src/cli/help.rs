//! `vibrissa help`, `vibrissa completions`, `vibrissa man`.

use std::path::PathBuf;

use clap::{Args as Flags, CommandFactory, Parser};
use vibrissa::error::{Error, InputError, nearest};
use vibrissa::reference::{self, Topic};

use super::args::Args;
use super::reply::{self, Reply};

const ALL: &str = "reference";

/// Help, or the reference.
#[derive(Debug, Flags)]
pub struct Help {
    /// A command; or spec, columns, statuses; or reference: all three as Markdown
    pub topic: Option<String>,
    /// Only this section ([gauge], axis, optimise.limits), table (rows.csv) or list (status)
    pub part: Option<String>,
}

/// Shell completions.
#[derive(Debug, Flags)]
pub struct Completions {
    /// The shell
    pub shell: clap_complete::Shell,
}

/// Manual pages.
#[derive(Debug, Flags)]
pub struct Man {
    /// Write the page of the program and one of each command into this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

pub fn run(help: &Help) -> u8 {
    let told = match help.topic.as_deref() {
        None => return of_clap(&["--help"]),
        Some(command) if commands().iter().any(|c| c == command) => return of_clap(&[command, "--help"]),
        Some(topic) => tell(topic, help.part.as_deref()),
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

pub fn completions(asked: &Completions) -> Result<Reply, Error> {
    let mut script = Vec::new();
    clap_complete::generate(asked.shell, &mut Args::command(), "vibrissa", &mut script);
    Ok(Reply { text: text(script)?, ..Reply::default() })
}

pub fn man(asked: &Man) -> Result<Reply, Error> {
    let Some(folder) = &asked.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(Args::command()).render(&mut page).map_err(|e| Error::Run(e.to_string()))?;
        return Ok(Reply { text: text(page)?, ..Reply::default() });
    };
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Args::command(), folder))
        .map_err(|e| Error::io(folder, e))?;
    Ok(Reply { text: format!("wrote the manual pages into {}\n", folder.display()), ..Reply::default() })
}

fn text(bytes: Vec<u8>) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(|e| Error::Run(e.to_string()))
}
