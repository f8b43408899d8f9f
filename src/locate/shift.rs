//! The column that says where the base stood.

use crate::error::{InputError, nearest};

/// The column that says how much nearer to the object the base stood, mm.
pub const SHIFT: &str = "shift_mm";

/// Place of the column [`SHIFT`] among `names`.
///
/// # Errors
/// A column that is nearly called so.
pub fn shift_column(names: &[String]) -> Result<Option<usize>, InputError> {
    let found = names.iter().position(|n| n == SHIFT);
    let parts = |n: &str| n.to_lowercase().split('_').map(str::to_owned).collect::<Vec<_>>();
    let known = |part: &String| ["base", "shift", "mm", "cm", "m"].contains(&part.as_str());
    let like = |n: &&String| {
        let parts = parts(n);
        nearest(n, &[SHIFT]).is_some() || parts.iter().all(known) && parts.iter().any(|part| part == "shift")
    };
    match names.iter().find(like).filter(|_| found.is_none()) {
        Some(name) => {
            let error = InputError::new(
                "this is nearly the column of the shift of the base, and would not be looked at",
            );
            Err(error.key(name).allowed(format!("{SHIFT}, in mm; or a name unlike it")))
        }
        None => Ok(found),
    }
}
