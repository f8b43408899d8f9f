//! Figures of answered readings.

use super::answer;
use super::content::{Content, SHOWN, points_of};
use super::quantity;
use super::source::Source;
use crate::error::Error;
use crate::figure::{Figure, Marker, Panel, Path};

const DRAWN: usize = 4000;

pub fn content(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let table = source.table("located.csv")?;
    let zeros = source.run["counts"]["zero_readings"].as_u64().map_or(0, |n| n as usize);
    c.answer = answer::of_readings(&table, zeros)?;
    let (line, distance, sigma) =
        (table.numbers("line")?, table.numbers("distance_mm")?, table.numbers("sigma_mm")?);
    let answered = table.rows(|r| distance[r].is_finite());
    let every = answered.len().div_ceil(DRAWN).max(1);
    let drawn: Vec<usize> = answered.iter().copied().step_by(every).collect();
    let of = |name: &str, colour, fine: bool, marker| {
        let rows: Vec<usize> =
            drawn.iter().copied().filter(|r| (table.word("status", *r) == "ok") == fine).collect();
        let path = Path::new(name, colour, rows.iter().map(|r| (line[*r], distance[*r])));
        points_of(&table, (path, marker), &rows, sigma, |r| table.word("status", r))
    };
    let panel = Panel::new("", quantity::axis("line"), quantity::axis("distance_mm"))
        .with(of("distance ± σ", 0, true, Marker::Circle))
        .with(of("with another word than ok", 1, false, Marker::Cross));
    let left = if every > 1 { format!("; one in {every} is shown") } else { String::new() };
    let caption = format!(
        "Distance of each reading, with its standard deviation; {} of {} readings have one (located.csv){left}.",
        answered.len(),
        table.len().saturating_sub(zeros)
    );
    c.figure(Figure::new("located", "Distances", caption, vec![panel]));
    if answered.is_empty() {
        c.notes.push("no reading has a distance: see their status".to_owned());
    }
    c.first(&table, table.len() <= SHOWN);
    Ok(c)
}
