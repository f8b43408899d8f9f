//! Figures of a census of errors.

use indexmap::IndexSet;

use super::answer;
use super::content::Content;
use super::source::Source;
use crate::error::Error;
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path};

/// Everything of the folder of `verify`.
///
/// # Errors
/// A table that is missing or damaged.
pub fn content(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let table = source.table("verify.csv")?;
    c.answer = answer::of_verify(&table)?;
    let place = |r: usize| (table.word("backend", r), table.word("precision", r));
    let places: IndexSet<(String, String)> = (0..table.len()).map(place).collect();
    let mut panels = Vec::new();
    for p in &places {
        let rows = table.rows(|r| place(r) == *p);
        let names = rows.iter().rev().map(|r| table.word("configuration", *r)).collect();
        let (x, y) = (Axis::log("strain error, relative", ""), Axis::words("", names));
        let mut panel = Panel::new(format!("{} {}", p.0, p.1), x, y);
        for (name, column, colour, marker) in [
            ("median", "strain_error_median", 2, Marker::Circle),
            ("99 % of taps below", "strain_error_p99", 0, Marker::Square),
            ("worst tap", "strain_error_worst", 1, Marker::Diamond),
            ("bound", "bound", 4, Marker::Cross),
        ] {
            let values = table.numbers(column)?;
            let points =
                rows.iter().rev().enumerate().map(|(i, r)| (values[*r], i as f64)).filter(|p| p.0 > 0.0);
            panel = panel.with(Mark::points(Path::new(name, colour, points), marker));
        }
        panels.push(panel);
    }
    c.figure(Figure::new("errors", "Errors against the reference", "Strain error of every configuration on every backend, against the f64 reference (verify.csv); an error of 0 has no place on the axis.", panels));
    c.first_rows(source, &["verify.csv"])?;
    Ok(c)
}
