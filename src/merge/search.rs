//! Joins searches with different seeds: the best design of all, and one front from all fronts.

use serde_json::{Value, json};

use super::part::Part;
use crate::error::Error;
use crate::optimise::front::unbeaten;
use crate::sink::folder::Folder;
use crate::sink::frame::Frame;
use crate::sink::read;

const FRONT: &str = "pareto.csv";

/// Objective of the best design; smaller is better.
fn value(part: &Part) -> f64 {
    part.run["result"]["value"].as_f64().unwrap_or(f64::INFINITY)
}

pub(super) fn best(parts: &[Part]) -> &Part {
    parts.iter().min_by(|a, b| value(a).total_cmp(&value(b))).unwrap_or(&parts[0])
}

pub(super) fn joined(parts: &[Part], best: &Part, folder: &mut Folder, run: &mut Value) -> Result<(), Error> {
    for file in &best.listed {
        let bytes = match &*file.name {
            FRONT => {
                let front = front(parts)?;
                run["result"]["front"] = json!({ "points": front.len() });
                front.csv()?
            }
            name => best.bytes(name)?,
        };
        folder.put(&file.name, &bytes)?;
    }
    Ok(())
}

fn in_force(part: &Part) -> impl Iterator<Item = (&str, &str)> {
    let entries = part.run["in_force"].as_array().into_iter().flatten();
    entries.filter_map(|e| Some((e["key"].as_str()?, e["value"].as_str()?)))
}

/// The values in force that affect a search, without its seed.
pub(super) fn values(part: &Part) -> Vec<(&str, &str)> {
    let free = |key: &str| key == "optimise.seed" || key.starts_with("run.") && key != "run.model_error";
    in_force(part).filter(|(key, _)| !free(key)).collect()
}

pub(super) fn seed(part: &Part) -> Option<u64> {
    in_force(part).find(|(key, _)| *key == "optimise.seed")?.1.parse().ok()
}

/// The seed of the first part, if seeds increase by one per part.
pub(super) fn seed_of_first(part: &Part) -> Option<u64> {
    seed(part).map(|seed| seed.wrapping_sub(part.shard.index.into()).wrapping_add(1))
}

fn front(parts: &[Part]) -> Result<Frame, Error> {
    let read = |part: &Part| {
        let label = part.folder.join(FRONT).display().to_string();
        Ok(read::csv(&label, part.bytes(FRONT)?.as_slice())?)
    };
    let fronts = parts.iter().map(read).collect::<Result<Vec<Frame>, Error>>()?;
    let mut points = Vec::new();
    for front in &fronts {
        let sd = front.numbers(front.one_of(&["K_sd", "K_sd_mm"])?)?;
        let total = front.numbers("total_rms_mm")?;
        points.extend((0..front.len()).map(|row| (sd[row], total[row], front, row)));
    }
    points.retain(|point| point.0.is_finite() && point.1.is_finite());
    unbeaten(&mut points, |(sd, total, ..)| [*sd, *total]);
    let mut table = fronts.first().map(Frame::like).unwrap_or_default();
    points.iter().try_for_each(|(.., front, row)| table.extend(front, *row..row + 1))?;
    Ok(table)
}
