//! One result in place of another, in a folder that holds other files too.
//!
//! The new result lies whole and durable in a hidden folder before anything is touched. Renaming that folder to
//! [`PENDING`] decides: before it the old result stands, after it the new one, which the next run puts in place if
//! this one cannot. In between there are only the renames. (Swapping the whole folder would be one step, but would move
//! strangers' files, and whoever works in the folder would find himself in the old one.)

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::claim::{Old, look, refuse};
use super::disk::{Stamp, names_in, open_regular, sync};
use super::record::{Listed, RUN, is_plain};
use super::work::STATE;
use crate::error::Error;

/// A decided replacement that is not yet done.
const PENDING: &str = ".vibrissa-replacing";
/// What is to be done, in the hidden folder.
const MANIFEST: &str = ".manifest";

/// What is to be done.
#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    /// Files of the new result, `run.json` last.
    put: Vec<String>,
    /// Files that give way, as they were found.
    old: Vec<Listed>,
    /// New name of a `run.json` that is kept.
    aside: Option<String>,
}

impl Manifest {
    fn of(names: &[String], old: &Old) -> Self {
        let old_files = old.files.iter().map(|(f, _)| f.clone()).collect();
        Self { put: names.to_vec(), old: old_files, aside: old.aside.clone() }
    }
}

/// Whether anything has come in the way of `names` since `old` was found; what.
pub(super) fn obstacle(target: &Path, names: &[String], old: &Old) -> Option<String> {
    let changed = |name: &str| match (target.join(name).symlink_metadata(), old.holds(name)) {
        (Err(_), _) => false,
        (Ok(m), Some(stamp)) => !m.is_file() || Stamp::of(&m) != *stamp,
        (Ok(m), None) => !(m.is_file() && name == RUN && old.aside.is_some()),
    };
    let listed = old.files.iter().map(|(f, _)| &f.name);
    names.iter().chain(listed).find(|name| changed(name)).cloned()
}

/// Puts the files `names` of the folder `new`, which are durable, in the place of `old`, if they are whole as `check` judges them under their
/// last hidden name; else everything is as before.
pub(super) fn replace(
    target: &Path,
    new: &Path,
    (names, old): (&[String], &Old),
    check: impl FnOnce(&Path) -> Result<(), Error>,
) -> Result<(), Error> {
    let failed = |e| Error::io(target, e);
    decide(target, new, names, old).map_err(failed)?;
    let pending = target.join(PENDING);
    if let Err(e) = check(&pending) {
        fs::rename(&pending, new).and_then(|()| fs::remove_file(new.join(MANIFEST))).map_err(failed)?;
        return Err(e);
    }
    let manifest = Manifest::of(names, old);
    put(target, &manifest).and_then(|()| finish(target)).map_err(failed)
}

/// Renames `new`, with what is to be done in it, to its last hidden name.
fn decide(target: &Path, new: &Path, names: &[String], old: &Old) -> io::Result<()> {
    // One of a run that was killed here, of the same result.
    gone(fs::remove_file(new.join(MANIFEST)))?;
    let mut file = fs::File::create_new(new.join(MANIFEST))?;
    file.write_all(serde_json::to_string(&Manifest::of(names, old))?.as_bytes())?;
    file.sync_all()?;
    sync(new)?;
    fs::rename(new, target.join(PENDING))?;
    sync(target)
}

/// Ends a replacement that was decided and not done.
pub(super) fn recover(target: &Path) -> Result<(), Error> {
    let pending = target.join(PENDING);
    let failed = |e| Error::io(&pending, e);
    match pending.symlink_metadata() {
        Err(_) => return Ok(()),
        Ok(m) if m.is_dir() => {}
        Ok(_) => {
            let why = format!("{} is in the way and no folder of this program", pending.display());
            return Err(refuse(target, why, "another folder; or move this away"));
        }
    }
    let text = match open_regular(&pending.join(MANIFEST), OpenOptions::new().read(true)) {
        // It was done but for the empty folder.
        Err(e) if e.kind() == ErrorKind::NotFound => return clear_away(target).map_err(failed),
        other => io::read_to_string(other.map_err(failed)?).map_err(failed)?,
    };
    let torn = |e: serde_json::Error| {
        let why = format!("{} does not say what a killed run was about to put here: {e}", pending.display());
        let allowed = "another folder; or move this away: it holds files of a result that was not finished";
        refuse(target, why, allowed)
    };
    let manifest: Manifest = serde_json::from_str(&text).map_err(torn)?;
    let names = manifest.put.iter().chain(manifest.old.iter().map(|f| &f.name));
    if let Some(odd) = names.clone().chain(&manifest.aside).find(|name| !is_plain(name)) {
        return Err(failed(io::Error::other(format!("{odd:?} is no name of a result's file"))));
    }
    // The run.json comes last.
    if !pending.join(RUN).exists() {
        return finish(target).map_err(|e| Error::io(target, e));
    }
    for name in names {
        let put = manifest.put.contains(name);
        if put && !pending.join(name).exists() {
            continue;
        }
        let known = manifest.old.iter().find(|f| f.name == *name);
        let kept = name == RUN && manifest.aside.is_some();
        let there = look(&target.join(name))?;
        if there.is_some_and(|(found, _)| !kept && known != Some(&found)) {
            let file = target.join(name);
            let file = file.display();
            let why =
                format!("a run was killed while it replaced the result here, and {file} has changed since");
            let allowed = "the folder without this file (move it away), or another folder";
            return Err(refuse(target, why, allowed));
        }
    }
    put(target, &manifest).and_then(|()| finish(target)).map_err(|e| Error::io(target, e))
}

/// What was `done` to a file, which may have been done before.
fn gone(done: io::Result<()>) -> io::Result<()> {
    done.or_else(|e| if e.kind() == ErrorKind::NotFound { Ok(()) } else { Err(e) })
}

/// The renames, the `run.json` last; any number of them may have been done before.
fn put(target: &Path, manifest: &Manifest) -> io::Result<()> {
    let pending = target.join(PENDING);
    if let Some(aside) = manifest.aside.as_ref().filter(|a| !target.join(a).exists()) {
        gone(fs::rename(target.join(RUN), target.join(aside)))?;
    }
    for file in manifest.old.iter().filter(|f| !manifest.put.contains(&f.name)) {
        gone(fs::remove_file(target.join(&file.name)))?;
    }
    for name in &manifest.put {
        gone(fs::rename(pending.join(name), target.join(name)))?;
    }
    Ok(())
}

/// The end of a replacement whose renames are done.
fn finish(target: &Path) -> io::Result<()> {
    let pending = target.join(PENDING);
    sync(target)?;
    gone(fs::remove_file(pending.join(STATE)))?;
    fs::remove_file(pending.join(MANIFEST))?;
    clear_away(target)
}

/// Removes the folder of a replacement that is done. What others put there meanwhile (a file manager's `.DS_Store`, NFS's `.nfs…`) moves out
/// of it, into the result folder.
fn clear_away(target: &Path) -> io::Result<()> {
    let pending = target.join(PENDING);
    for name in names_in(&pending)? {
        // A run.json of others is none of the result's.
        let first = u32::from(name == RUN);
        let free = |n: u32| match n {
            0 => target.join(&name),
            _ => target.join(format!("{}-{n}", name.to_string_lossy())),
        };
        let to = (first..=u32::MAX).map(free).find(|to| to.symlink_metadata().is_err());
        // A file that is open on NFS goes by itself, its folder with the next run.
        let _ = to.map(|to| fs::rename(pending.join(&name), to));
    }
    fs::remove_dir(&pending)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The steps of a replacement at which it may be killed: all before the decision, one after each rename.
    fn killed_after(renames: usize, aside: bool) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let (target, new) = (folder.path(), folder.path().join(".vibrissa-result-a1B2c3"));
        for name in ["a.csv", "b.csv", "notes.txt", RUN] {
            fs::write(target.join(name), format!("old {name}")).unwrap();
        }
        fs::create_dir(&new).unwrap();
        let put = ["b.csv".to_owned(), "c.csv".to_owned(), RUN.to_owned()];
        for name in &put {
            fs::write(new.join(name), format!("new {name}")).unwrap();
        }
        let given = if aside { &["a.csv", "b.csv"][..] } else { &["a.csv", "b.csv", RUN] };
        let old: Vec<Listed> =
            given.iter().map(|name| look(&target.join(name)).unwrap().unwrap().0).collect();
        let manifest = Manifest { put: put.to_vec(), old, aside: aside.then(|| "run.old.json".to_owned()) };
        fs::write(new.join(MANIFEST), serde_json::to_string(&manifest).unwrap()).unwrap();
        fs::rename(new, target.join(PENDING)).unwrap();
        let mut steps: Vec<(String, Option<String>)> = Vec::new();
        steps.extend(manifest.aside.map(|a| (RUN.to_owned(), Some(a))));
        steps.push(("a.csv".to_owned(), None));
        steps.extend(put.iter().map(|name| (format!("{PENDING}/{name}"), Some(name.clone()))));
        steps.push((format!("{PENDING}/{MANIFEST}"), None));
        for (from, to) in steps.into_iter().take(renames) {
            match to {
                Some(to) => fs::rename(target.join(from), target.join(to)).unwrap(),
                None => fs::remove_file(target.join(from)).unwrap(),
            }
        }
        folder
    }

    fn texts(folder: &Path) -> Vec<(String, String)> {
        let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
        let mut all: Vec<_> = entries
            .map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), fs::read_to_string(p).unwrap()))
            .collect();
        all.sort();
        all
    }

    #[test]
    fn a_replacement_killed_at_any_step_is_carried_through() {
        for (aside, renames) in
            [(false, 0..=5), (true, 0..=6)].into_iter().flat_map(|(a, n)| n.map(move |n| (a, n)))
        {
            let folder = killed_after(renames, aside);
            recover(folder.path()).unwrap_or_else(|e| panic!("{renames}: {e}"));
            let mut expected: Vec<(String, String)> =
                ["new b.csv", "new c.csv", "old notes.txt", "new run.json"]
                    .map(|text| (text[4..].to_owned(), text.to_owned()))
                    .to_vec();
            if aside {
                expected.push(("run.old.json".to_owned(), "old run.json".to_owned()));
            }
            assert_eq!(texts(folder.path()), expected, "after {renames}");
            recover(folder.path()).unwrap();
        }
    }

    #[test]
    fn a_run_killed_before_the_decision_does_not_hold_up_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let new = folder.path().join(".vibrissa-unfinished");
        fs::create_dir(&new).unwrap();
        for (name, text) in
            [(MANIFEST, "{ \"put\": [\"a.csv\""), (STATE, "state"), ("a.csv", "new"), (RUN, "new")]
        {
            fs::write(new.join(name), text).unwrap();
        }
        let names = ["a.csv".to_owned(), RUN.to_owned()];
        let (path, old) = (folder.path(), Old::default());
        // What is touched when the names are about to change is not put there.
        let touched = |_: &Path| Err(Error::Run("touched".into()));
        replace(path, &new, (&names, &old), touched).unwrap_err();
        assert!(new.join("a.csv").exists() && !path.join(PENDING).exists() && !path.join(RUN).exists());
        replace(path, &new, (&names, &old), |_| Ok(())).unwrap();
        assert_eq!(
            texts(folder.path()),
            [("a.csv".to_owned(), "new".to_owned()), (RUN.to_owned(), "new".to_owned())]
        );
    }

    #[test]
    fn what_others_put_into_the_hidden_folder_is_kept() {
        for renames in 0..=5 {
            let folder = killed_after(renames, false);
            let pending = folder.path().join(PENDING);
            fs::write(pending.join(".nfs0001"), "theirs").unwrap();
            fs::create_dir(pending.join("theirs")).unwrap();
            fs::write(pending.join("notes.txt"), "theirs too").unwrap();
            recover(folder.path()).unwrap_or_else(|e| panic!("{renames}: {e}"));
            let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
            assert!(!pending.exists() && folder.path().join("theirs").is_dir());
            assert_eq!(
                [text(".nfs0001"), text("notes.txt"), text("notes.txt-1")],
                ["theirs", "old notes.txt", "theirs too"]
            );
            assert_eq!([text("b.csv"), text(RUN)], ["new b.csv", "new run.json"]);
        }
    }

    #[test]
    fn a_run_json_of_others_is_not_the_results() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join(PENDING)).unwrap();
        fs::write(folder.path().join(PENDING).join(RUN), "theirs").unwrap();
        recover(folder.path()).unwrap();
        assert_eq!(texts(folder.path()), [("run.json-1".to_owned(), "theirs".to_owned())]);
    }

    #[test]
    fn what_changed_since_the_kill_is_kept() {
        for (name, renames) in [("a.csv", 0), ("b.csv", 1), ("c.csv", 2), (RUN, 3)] {
            let folder = killed_after(renames, false);
            let path = folder.path().join(name);
            fs::write(&path, "mine").unwrap();
            assert_eq!(recover(folder.path()).unwrap_err().exit_code(), 2, "{name}");
            assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
            fs::remove_file(&path).unwrap();
            recover(folder.path()).unwrap();
            assert!(!folder.path().join(PENDING).exists());
        }
    }

    #[test]
    fn a_planted_replacement_reaches_no_other_folder() {
        let folder = killed_after(0, false);
        let manifest = folder.path().join(PENDING).join(MANIFEST);
        let text = fs::read_to_string(&manifest).unwrap();
        fs::write(&manifest, text.replace("a.csv", "../a.csv")).unwrap();
        recover(folder.path()).unwrap_err();
        let link = tempfile::tempdir().unwrap();
        fs::write(link.path().join(PENDING), "mine").unwrap();
        assert_eq!(recover(link.path()).unwrap_err().exit_code(), 2);
    }
}
