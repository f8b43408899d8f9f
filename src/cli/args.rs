//! The command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use vibrissa::command::{self, Context, Reply, array::LocateRequest};
pub use vibrissa::command::{Asked, Common};
use vibrissa::error::Error;

use super::about::{self, Cite};
use super::{locate, new};

const AFTER: &str = "A first sweep: vibrissa sweep sweeps/prototypes.toml\n\
    The reference: vibrissa help spec (every key), help columns (every table), help statuses (every word)\n\
    Exit codes: 0 done, 1 the run failed or was interrupted, 2 bad usage, bad spec or bad data";
const SCHEMA: &str = "An editor with TOML support (Taplo, Even Better TOML) reads a first line `#:schema ./spec.schema.json` in a spec.\n\
    Example: vibrissa schema > spec.schema.json";

/// Sweeps, optimises and calibrates tapered soft whisker sensors.
#[derive(Debug, Parser)]
#[command(name = "vibrissa", version, about, max_term_width = 100, arg_required_else_help = true)]
#[command(disable_help_subcommand = true)]
#[command(after_help = AFTER)]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

/// One question each.
#[derive(Debug, Subcommand)]
pub enum Command {
    #[command(flatten)]
    Library(command::Command),
    /// Distances from readings, with their uncertainty: a file, or stdin line by line
    // Before taps.
    #[command(display_order = 3)]
    Locate(Asked<LocateRequest>),
    /// List adapters, their limits and features, and which one `--backend auto` uses
    Devices(Common),
    /// Write a first spec, commented: five questions, or flags
    New(new::New),
    /// How to cite the program, the model and a result
    Cite(Cite),
    /// The JSON Schema of specs, by which editors complete and check them
    #[command(after_help = SCHEMA)]
    Schema,
    /// The help of a command, or the reference: spec (keys), columns (of tables), statuses
    Help {
        /// A command; or spec, columns, statuses; or reference: all three as Markdown
        topic: Option<String>,
        /// Only this section ([gauge], axis, optimise.limits), table (rows.csv) or list (status)
        part: Option<String>,
    },
    /// A shell script that completes commands and flags
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// The manual page, on stdout; or the pages of all commands, into a folder
    Man {
        /// Write the page of the program and one of each command into this folder
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

impl Command {
    pub fn run(&self, context: &Context<'_>) -> Result<Reply, Error> {
        match self {
            Self::Library(command) => command.run(context),
            Self::Locate(locate) => locate::run(locate, context),
            Self::Devices(common) => about::devices(common),
            Self::New(new) => new::run(new),
            Self::Cite(cite) => about::cite(cite),
            Self::Schema => Ok(Reply { text: vibrissa::reference::schema::text(), ..Default::default() }),
            Self::Completions { shell } => Ok(about::completions(*shell)),
            Self::Man { out } => about::man(out.as_deref()),
            // Handled before, with clap's output.
            Self::Help { .. } => Ok(Reply::default()),
        }
    }
}
