//! One result in place of another, in a folder that holds other files too.
//!
//! The new result lies whole and durable in the hidden folder before anything is touched. A marker in it, [`FINISHED`], decides: before it the
//! old result stands, after it the new one, which the next run puts in place if this one cannot. In between there are only the renames.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::claim::{Old, look, refuse};
use super::disk::{open_regular, remove_folder, sync};
use super::hidden::LOCK;
use super::record::{Listed, RUN, is_plain};
use crate::error::Error;

/// Name of the marker of a finished result, in the hidden folder. It lists the renames.
pub(super) const FINISHED: &str = ".finished";
/// Name under which the marker is written before it counts.
const NEXT: &str = ".finished-next";

/// Content of the marker.
#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    /// Files of the new result, `run.json` last.
    put: Vec<String>,
    /// Files of the old result, as they were found; they are replaced or removed.
    old: Vec<Listed>,
    /// New name of a `run.json` that is kept.
    aside: Option<String>,
}

/// Marks the result in `hidden`, which consists of the files `names` and takes the place of `old`, as finished.
pub(super) fn decide(hidden: &Path, names: &[String], old: &Old) -> io::Result<()> {
    let manifest = Manifest { put: names.to_vec(), old: old.files.clone(), aside: old.aside.clone() };
    let _ = fs::remove_file(hidden.join(NEXT));
    let mut file = fs::File::create_new(hidden.join(NEXT))?;
    file.write_all(serde_json::to_string(&manifest)?.as_bytes())?;
    file.sync_all()?;
    fs::rename(hidden.join(NEXT), hidden.join(FINISHED))?;
    sync(hidden)
}

/// Puts a finished result in its place, if there is one: the renames, the `run.json` last; any number of them may have been done before.
///
/// # Errors
/// A file that has changed since it was found, or come in the way; what the system says.
pub(super) fn recover(target: &Path, hidden: &Path) -> Result<(), Error> {
    let marker = hidden.join(FINISHED);
    let text = match open_regular(&marker, OpenOptions::new().read(true)) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        other => other.and_then(io::read_to_string).map_err(|e| Error::io(&marker, e))?,
    };
    let odd = |why: String| {
        let why = format!("{} does not say what a run was about to put here: {why}", marker.display());
        refuse(target, why, "another folder; or move this away: it holds files of a result")
    };
    let manifest: Manifest = serde_json::from_str(&text).map_err(|e| odd(e.to_string()))?;
    let names = manifest.put.iter().chain(manifest.old.iter().map(|f| &f.name));
    if let Some(name) = names.clone().chain(&manifest.aside).find(|name| !is_plain(name)) {
        return Err(odd(format!("{name:?} is no name of a result's file")));
    }
    let to_come = |name: &str| is_there(&hidden.join(name));
    let aside = manifest.aside.as_ref().map(|name| target.join(name));
    if let Some(aside) = aside.filter(|aside| to_come(RUN) && is_there(aside) && is_there(&target.join(RUN)))
    {
        let why = format!(
            "{} is in the way: the run.json that is there is to be kept under this name",
            aside.display()
        );
        return Err(refuse(target, why, "the folder without this file: move it away"));
    }
    // If the run.json has been moved, which comes last, all is done.
    for name in names.filter(|_| to_come(RUN)) {
        if manifest.put.contains(name) && !to_come(name) {
            continue;
        }
        let known = manifest.old.iter().find(|f| f.name == *name);
        let kept = name == RUN && manifest.aside.is_some();
        if look(&target.join(name))?.is_some_and(|found| !kept && known != Some(&found)) {
            let why = format!(
                "{} was changed while the result was computed; the new result is kept, and the next run in this folder puts it in its place",
                target.join(name).display()
            );
            return Err(refuse(target, why, "the folder without this file: move it away, or remove it"));
        }
    }
    put(target, hidden, &manifest).map_err(|e| Error::io(target, e))
}

fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

fn put(target: &Path, hidden: &Path, manifest: &Manifest) -> io::Result<()> {
    // A step that an earlier run has done already is no error.
    let gone = |done: io::Result<()>| match done {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    };
    // The run.json was moved last: nothing is left but to clear up.
    if !is_there(&hidden.join(RUN)) {
        sync(target)?;
        return gone(remove_state(hidden));
    }
    if let Some(aside) = manifest.aside.as_ref().filter(|a| !is_there(&target.join(a))) {
        gone(fs::rename(target.join(RUN), target.join(aside)))?;
    }
    for file in manifest.old.iter().filter(|f| !manifest.put.contains(&f.name)) {
        gone(fs::remove_file(target.join(&file.name)))?;
    }
    for name in &manifest.put {
        gone(fs::rename(hidden.join(name), target.join(name)))?;
    }
    sync(target)?;
    gone(remove_state(hidden))
}

/// The marker goes last: until then the state of the run that is finished would be taken for one to go on with.
fn remove_state(hidden: &Path) -> io::Result<()> {
    for name in super::names_in(hidden)?.iter().filter(|name| *name != FINISHED && *name != LOCK) {
        let path = hidden.join(name);
        fs::remove_file(&path).or_else(|_| remove_folder(&path))?;
    }
    fs::remove_file(hidden.join(FINISHED))
}

#[cfg(test)]
mod tests {
    use super::super::WORK;
    use super::*;

    const PUT: [&str; 3] = ["b.csv", "c.csv", RUN];

    /// A folder with an older result and a finished one, whose renames were stopped after `renames`.
    fn killed_after(renames: usize, aside: bool) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let (target, hidden) = (folder.path(), folder.path().join(WORK));
        for name in ["a.csv", "b.csv", "notes.txt", RUN] {
            fs::write(target.join(name), format!("old {name}")).unwrap();
        }
        fs::create_dir(&hidden).unwrap();
        PUT.iter().for_each(|name| fs::write(hidden.join(name), format!("new {name}")).unwrap());
        fs::write(hidden.join(".state"), "how far it was").unwrap();
        let given = if aside { &["a.csv", "b.csv"][..] } else { &["a.csv", "b.csv", RUN] };
        let files = given.iter().map(|name| look(&target.join(name)).unwrap().unwrap()).collect();
        let old = Old { files, aside: aside.then(|| "run.old.json".to_owned()), ..Old::default() };
        decide(&hidden, &PUT.map(str::to_owned), &old).unwrap();
        let mut steps: Vec<(String, Option<&str>)> = Vec::new();
        steps.extend(aside.then(|| (RUN.to_owned(), Some("run.old.json"))));
        steps.push(("a.csv".to_owned(), None));
        steps.extend(PUT.iter().map(|name| (format!("{WORK}/{name}"), Some(*name))));
        steps.push((format!("{WORK}/.state"), None));
        for (from, to) in steps.into_iter().take(renames) {
            match to {
                Some(to) => fs::rename(target.join(from), target.join(to)).unwrap(),
                None => fs::remove_file(target.join(from)).unwrap(),
            }
        }
        folder
    }

    fn texts(folder: &Path) -> Vec<(String, String)> {
        let files = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_file());
        let mut all: Vec<_> = files
            .map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), fs::read_to_string(p).unwrap()))
            .collect();
        all.sort();
        all
    }

    #[test]
    fn a_replacement_killed_at_any_step_is_carried_through() {
        for (aside, renames) in [false, true].into_iter().flat_map(|a| (0..=6).map(move |n| (a, n))) {
            let folder = killed_after(renames, aside);
            let hidden = folder.path().join(WORK);
            recover(folder.path(), &hidden).unwrap_or_else(|e| panic!("{renames}: {e}"));
            let mut expected: Vec<(String, String)> =
                ["new b.csv", "new c.csv", "old notes.txt", "new run.json"]
                    .map(|text| (text[4..].to_owned(), text.to_owned()))
                    .to_vec();
            expected.extend(aside.then(|| ("run.old.json".to_owned(), "old run.json".to_owned())));
            assert_eq!(texts(folder.path()), expected, "after {renames}");
            assert_eq!(texts(&hidden), [], "after {renames}");
            recover(folder.path(), &hidden).unwrap();
        }
    }

    #[test]
    fn what_changed_since_it_was_found_is_kept() {
        for (name, renames) in [("a.csv", 0), ("b.csv", 1), ("c.csv", 2), (RUN, 3)] {
            let folder = killed_after(renames, false);
            let (path, hidden) = (folder.path().join(name), folder.path().join(WORK));
            fs::write(&path, "mine").unwrap();
            assert_eq!(recover(folder.path(), &hidden).unwrap_err().exit_code(), 2, "{name}");
            assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
            fs::remove_file(&path).unwrap();
            recover(folder.path(), &hidden).unwrap();
            assert_eq!(fs::read_to_string(folder.path().join(RUN)).unwrap(), "new run.json");
        }
    }

    #[test]
    fn a_replacement_that_is_done_is_not_begun_again() {
        let folder = killed_after(6, false);
        fs::write(folder.path().join("a.csv"), "mine").unwrap();
        recover(folder.path(), &folder.path().join(WORK)).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("a.csv")).unwrap(), "mine");
    }

    #[test]
    fn a_record_that_is_to_be_kept_is_not_lost_where_its_new_name_is_taken() {
        let folder = killed_after(0, true);
        fs::write(folder.path().join("run.old.json"), "mine").unwrap();
        assert_eq!(recover(folder.path(), &folder.path().join(WORK)).unwrap_err().exit_code(), 2);
        assert_eq!(fs::read_to_string(folder.path().join(RUN)).unwrap(), "old run.json");
    }

    #[test]
    fn a_planted_marker_reaches_no_other_folder() {
        let folder = killed_after(0, false);
        let hidden = folder.path().join(WORK);
        let text = fs::read_to_string(hidden.join(FINISHED)).unwrap();
        fs::write(hidden.join(FINISHED), text.replace("a.csv", "../a.csv")).unwrap();
        assert_eq!(recover(folder.path(), &hidden).unwrap_err().exit_code(), 2);
    }
}
