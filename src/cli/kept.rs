//! What a run that a signal ended keeps, and what it says of that.

use std::path::Path;

use serde_json::Value;

/// Whether an older result is whole: a part of a new one does not take its place, unless that is forced.
pub fn is_whole(older: Option<&Value>) -> bool {
    older.is_some_and(|run| run["stopped"].is_null())
}

/// The last words: `done` of it, such as "3 of 34 taps", was finished; `kept` in `out`, or nothing was, or an older result stays.
pub fn words(done: &str, nothing: bool, kept: bool, out: &Path) -> String {
    let out = out.display();
    match (nothing, kept) {
        (true, _) => "interrupted before the first result; nothing was written".to_owned(),
        (_, true) => format!("interrupted; what {done} show is kept in {out}"),
        (_, false) => {
            format!(
                "interrupted after {done}; nothing was written: {out} holds a whole result (--force replaces it)"
            )
        }
    }
}
