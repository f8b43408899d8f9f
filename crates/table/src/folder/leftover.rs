//! What killed runs left: half-written results, and locks of nobody.

use std::path::Path;

use super::PREFIX;
use super::disk::{names_in, remove_folder};
use super::lock::{Asked, Lock};

/// Removes from `place` what dead runs left there; `mine` is the lock that is held. What cannot be removed stays.
pub(super) fn clear(place: &Path, mine: &Lock) {
    // Without locks, nobody is known to be dead.
    for name in names_in(place).into_iter().flatten().filter(|_| mine.firm) {
        let Some(owner) = name.to_str().and_then(|n| n.strip_prefix(PREFIX)).and_then(owner) else {
            continue;
        };
        // Held until this leftover is gone, so that a live run keeps what it is writing.
        let _lock = match owner == mine.owner && place == mine.place() {
            true => None,
            false => match Lock::ask(place, owner) {
                Ok(Asked::Held(lock)) if lock.firm => Some(lock),
                _ => continue,
            },
        };
        let path = place.join(&name);
        if path.symlink_metadata().is_ok_and(|m| m.is_dir()) {
            let _ = remove_folder(&path);
        }
    }
}

/// Who made `.vibrissa-<rest>`; nobody if it is no lock and no half-written result.
fn owner(rest: &str) -> Option<&str> {
    let is_word = |s: &str| !s.is_empty() && s.bytes().all(|b| b.is_ascii_alphanumeric());
    let is_random = |s: &str| s.len() == 6 && is_word(s);
    let owner = match (rest.strip_suffix(".lock"), rest.split_once('-')) {
        (Some(owner), _) => owner,
        (None, Some((owner, random))) if is_random(random) => owner,
        _ => return None,
    };
    is_word(owner).then_some(owner)
}

#[cfg(test)]
mod tests {
    use super::owner;

    #[test]
    fn only_what_runs_leave_has_an_owner() {
        assert_eq!(owner("result.lock"), Some("result"));
        assert_eq!(owner("result-a1B2c3"), Some("result"));
        for other in ["evaluations", "backup", "replacing", "", ".lock", "a/b.lock", "notes-2024", "-a1B2c3"]
        {
            assert_eq!(owner(other), None, "{other}");
        }
    }
}
