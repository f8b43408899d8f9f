//! Searches of several machines, each with a seed of its own: the best design of all, and the front of all their fronts.

use serde_json::{Value, json};

use super::part::{Part, refuse};
use crate::error::Error;
use crate::optimise::front::unbeaten;
use crate::sink::folder::Folder;

/// The file of a front.
const FRONT: &str = "pareto.csv";

/// Value of the objective of its best design; smaller is better.
fn value(part: &Part) -> f64 {
    part.run["result"]["value"].as_f64().unwrap_or(f64::INFINITY)
}

/// The search with the best design.
pub(super) fn best(parts: &[Part]) -> &Part {
    parts.iter().min_by(|a, b| value(a).total_cmp(&value(b))).unwrap_or(&parts[0])
}

/// Writes the files of the `best` search, with the front of all.
pub(super) fn joined(parts: &[Part], best: &Part, folder: &mut Folder, run: &mut Value) -> Result<(), Error> {
    for file in &best.listed {
        let bytes = match &*file.name {
            FRONT => {
                let (bytes, points) = front(parts)?;
                run["result"]["front"] = json!({ "points": points });
                bytes
            }
            name => best.bytes(name)?,
        };
        folder.put(&file.name, &bytes)?;
    }
    Ok(())
}

/// The entries of `in_force`, by key and value.
fn in_force(part: &Part) -> impl Iterator<Item = (&str, &str)> {
    let entries = part.run["in_force"].as_array().into_iter().flatten();
    entries.filter_map(|e| Some((e["key"].as_str()?, e["value"].as_str()?)))
}

/// The values in force on which a search depends, but its seed.
pub(super) fn values(part: &Part) -> Vec<(&str, &str)> {
    let free = |key: &str| key == "optimise.seed" || key.starts_with("run.") && key != "run.model_error";
    in_force(part).filter(|(key, _)| !free(key)).collect()
}

/// The seed of a search.
pub(super) fn seed(part: &Part) -> Option<u64> {
    in_force(part).find(|(key, _)| *key == "optimise.seed")?.1.parse().ok()
}

/// The seed that the first part has, if seeds rise by one from part to part.
pub(super) fn seed_of_first(part: &Part) -> Option<u64> {
    seed(part).map(|seed| seed.wrapping_sub(part.shard.index.into()).wrapping_add(1))
}

/// The points of all fronts that no other beats in both figures, by rising spread, and how many.
fn front(parts: &[Part]) -> Result<(Vec<u8>, usize), Error> {
    let (mut header, mut points) = (String::new(), Vec::new());
    for part in parts {
        let text = String::from_utf8(part.bytes(FRONT)?).unwrap_or_default();
        let mut lines = text.lines();
        header = lines.next().unwrap_or_default().to_owned();
        let at = |name: &str| header.split(',').position(|column| column.starts_with(name));
        let Some(places) = at("K_sd").zip(at("total_rms_mm")) else {
            let why = "its front has no K_sd and total_rms_mm";
            return Err(refuse(&part.folder, why, "the front that optimise wrote"));
        };
        for line in lines {
            let number = |at: usize| line.split(',').nth(at).and_then(|x| x.parse::<f64>().ok());
            let figures = number(places.0).zip(number(places.1));
            points.extend(figures.map(|(sd, total)| (sd, total, line.to_owned())));
        }
    }
    unbeaten(&mut points, |(sd, total, _)| [*sd, *total]);
    let lines = points.iter().map(|(.., line)| line.as_str());
    let text: String = std::iter::once(header.as_str()).chain(lines).flat_map(|line| [line, "\n"]).collect();
    Ok((text.into_bytes(), points.len()))
}
