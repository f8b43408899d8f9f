//! The rows that a sweep kept, with their distances, for the check of a model with effects left off.

use std::collections::HashMap;
use std::sync::Arc;

use super::key;
use crate::error::Error;
use crate::needed::Row;
use crate::scene::{Layout, Space, Tuple};

/// The rows of `space` that are `kept`, each a design with its drive.
///
/// # Errors
/// A tuple file that cannot be read again.
pub(super) fn rows(space: &Space, kept: &[Tuple]) -> Result<Vec<Row>, Error> {
    let identity = |t: &Tuple| (key(t), (t.drive + 0.0).to_bits());
    let mut distances: HashMap<_, Vec<f64>> = kept.iter().map(|t| (identity(t), Vec::new())).collect();
    let mut note = |t: &Tuple| distances.get_mut(&identity(t)).into_iter().for_each(|row| row.push(t.a));
    match space {
        _ if kept.is_empty() => {}
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            let all: Arc<[f64]> = (0..layout.n_distances).map(|i| layout.distance(i)).collect();
            return Ok(kept.iter().map(|t| Row::new(*t, all.clone())).collect());
        }
        Space::List(tuples) => tuples.iter().for_each(note),
        Space::File(file) => {
            let mut rows = file.rows().map_err(|e| Error::Run(e.to_string()))?;
            for _ in 0..file.len() {
                note(&rows.next().map_err(|e| Error::Run(e.to_string()))?);
            }
        }
    }
    let row = |t: &Tuple| Row::new(*t, distances[&identity(t)].as_slice().into());
    Ok(kept.iter().map(row).collect())
}
