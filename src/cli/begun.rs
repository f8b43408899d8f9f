//! How a command begins: what spec and command line ask of it.

use vibrissa::error::Error;
use vibrissa::scene::{RunOptions, Spec};

use super::args::Common;
use super::{reply, say};

/// Sets the number of CPU threads that was asked for.
pub(super) fn threads(options: &RunOptions) -> Result<(), Error> {
    let Some(n) = options.threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new().num_threads(n).build_global().map_err(|e| Error::Run(e.to_string()))
}

/// Options of spec and command line; starts the threads they ask for, and JSON if they ask for it.
pub(super) fn prepared(common: &Common, spec: &Spec) -> Result<RunOptions, Error> {
    let options = common.over(&spec.run);
    reply::in_json(options.json == Some(true));
    threads(&options)?;
    Ok(options)
}

/// As [`prepared`], and tells the warnings about `spec`; whether the command is to be quiet.
pub(super) fn begun(common: &Common, spec: &Spec) -> Result<(RunOptions, bool), Error> {
    let options = prepared(common, spec)?;
    let quiet = options.quiet == Some(true);
    say::warnings(quiet, &spec.warnings);
    Ok((options, quiet))
}
