//! Searches of several machines, each with a seed of its own: the best design of all, and the front of all their fronts.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use super::Report;
use super::checked::Checked;
use super::part::refuse;
use super::stated::Stated;
use crate::error::Error;
use crate::optimise::front::unbeaten;
use crate::sink::folder::{Folder, Listed, Question, Written, read_run};
use crate::sink::frame::Frame;
use crate::sink::read;
use crate::sink::shard::Shard;

/// The file of a front.
const FRONT: &str = "pareto.csv";

/// Counts of a search.
const COUNTS: [&str; 4] =
    ["counts.evaluations", "counts.evaluations_sensitivity", "counts.taps", "counts.starts"];

/// A finished search.
struct Part {
    folder: PathBuf,
    shard: Shard,
    run: Value,
    listed: Vec<Listed>,
    /// Value of the objective of its best design, smaller is better.
    value: f64,
}

/// Whether the part in `folder` is a search.
pub(super) fn is_search(folder: &Path) -> bool {
    read(folder).is_some_and(|run| run["command"] == "optimise")
}

fn read(folder: &Path) -> Option<Value> {
    serde_json::from_str(&read_run(folder).ok()??).ok()
}

/// Joins the searches `found` into `out`.
pub(super) fn run(found: &[(Shard, PathBuf)], out: PathBuf, force: bool) -> Result<Report, Error> {
    let start = Instant::now();
    let parts = found.iter().map(|(shard, folder)| part(*shard, folder)).collect::<Result<Vec<_>, _>>()?;
    for part in &parts[1..] {
        same(&parts[0], part)?;
    }
    let best = parts.iter().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or(&parts[0]);
    let names: Vec<&str> = best.listed.iter().map(|file| file.name.as_str()).collect();
    let files = |p: &Part| {
        let names = p.listed.iter().map(|file| file.name.as_str()).chain(["run.json"]);
        names.map(|name| p.folder.join(name)).collect::<Vec<_>>()
    };
    let inputs = parts.iter().flat_map(files).collect();
    let name = best.run["name"].as_str().unwrap_or_default();
    let question = Question::new("optimise", name, best.run["asked"].clone());
    let question = Question { inputs, in_force: best.run["in_force"].clone(), ..question };
    let mut folder = Folder::open(&out, question, &names, force)?;
    let mut run = best.run.clone();
    for name in &names {
        let bytes = match *name {
            FRONT => {
                let front = front(&parts)?;
                run["result"]["front"] = json!({ "points": front.len() });
                front.csv()?
            }
            _ => bytes(best, name)?,
        };
        folder.put(name, &bytes)?;
    }
    let sum = |key: &str| parts.iter().filter_map(|part| part.run["counts"][key].as_u64()).sum::<u64>();
    for key in COUNTS {
        let key = key.trim_start_matches("counts.");
        run["counts"][key] = sum(key).into();
    }
    let seconds = parts.iter().filter_map(|part| part.run["seconds"]["total"].as_f64()).sum::<f64>();
    run["seconds"] = json!({ "total": seconds + start.elapsed().as_secs_f64() });
    let one = |part: &Part| {
        json!({
            "folder": part.folder.display().to_string(),
            "part": part.shard.to_string(),
            "seed": seed(part),
            "value": part.value,
            "best": std::ptr::eq(part, best),
            "evaluations": part.run["counts"]["evaluations"],
            "seconds": part.run["seconds"]["total"],
            "files": part.listed,
        })
    };
    run["parts"] = parts.iter().map(one).collect();
    folder.run_json(&run)?;
    let Written { files, removed, .. } = folder.finish()?;
    Ok(Report { out, files, removed, run, warnings: Vec::new(), seconds: start.elapsed().as_secs_f64() })
}

fn part(shard: Shard, folder: &Path) -> Result<Part, Error> {
    let run = read(folder).unwrap_or_default();
    let value = run["result"]["value"].as_f64().filter(|_| run["command"] == "optimise");
    let again = format!("the result of optimise --shard {shard}");
    let value = value.ok_or_else(|| refuse(folder, "this is not a finished search", &again))?;
    let stated = Stated::of(folder, &run);
    stated.objects(&["counts", "result.front"])?;
    stated.counts(&COUNTS, true)?;
    stated.numbers(&["seconds.total"])?;
    let listed = stated.files(&[])?;
    listed.iter().try_for_each(|file| Checked::open(folder, file)?.end())?;
    Ok(Part { folder: folder.to_owned(), shard, run, listed, value })
}

/// The value in force of a key.
fn in_force(run: &Value) -> Vec<(&str, &str)> {
    let entries = run["in_force"].as_array().into_iter().flatten();
    entries.filter_map(|e| Some((e["key"].as_str()?, e["value"].as_str()?))).collect()
}

/// The seed of a part.
fn seed(part: &Part) -> Option<u64> {
    in_force(&part.run).iter().find(|(key, _)| *key == "optimise.seed")?.1.parse().ok()
}

/// Fails unless both are of one spec, version and backends, with the seeds of their numbers.
fn same(first: &Part, part: &Part) -> Result<(), Error> {
    let free = |key: &str| key == "optimise.seed" || key.starts_with("run.") && key != "run.model_error";
    let values = |part: &Part| -> Vec<(String, String)> {
        let all = in_force(&part.run).into_iter().filter(|(key, _)| !free(key));
        all.map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
    };
    let offset = |part: &Part| seed(part).map(|seed| seed.wrapping_sub(part.shard.index.into()));
    let backend = |part: &Part, key: &str| {
        ["name", "adapter", "precision", "tolerance"].map(|field| part.run[key][field].clone())
    };
    for (equal, what) in [
        (first.run["version"] == part.run["version"], "version of the program"),
        (first.run["spec"]["hash"] == part.run["spec"]["hash"], "spec"),
        (values(first) == values(part), "values in force"),
        (backend(first, "backend") == backend(part, "backend"), "backend"),
        (offset(first) == offset(part), "row of seeds"),
    ] {
        if !equal {
            let why = format!("this part and {} are of another {what}", first.folder.display());
            return Err(refuse(&part.folder, why, "parts of one spec, version and backend"));
        }
    }
    Ok(())
}

fn bytes(part: &Part, name: &str) -> Result<Vec<u8>, Error> {
    let missing = || refuse(&part.folder, format!("its run.json lists no {name}"), "a whole search");
    let listed = part.listed.iter().find(|file| file.name == name).ok_or_else(missing)?;
    Checked::open(&part.folder, listed)?.bytes()
}

/// The points of all fronts that no other beats in both figures, by rising spread.
fn front(parts: &[Part]) -> Result<Frame, Error> {
    let fronts = parts.iter().map(|part| Ok(read::csv(FRONT, bytes(part, FRONT)?.as_slice())?));
    let fronts: Vec<Frame> = fronts.collect::<Result<_, Error>>()?;
    let mut points = Vec::new();
    for (part, front) in parts.iter().zip(&fronts) {
        let sd = front.first(&["K_sd", "K_sd_mm"]);
        let Some(sd) = sd.filter(|_| front.has("total_rms_mm")) else {
            let why = "its front has no K_sd and total_rms_mm";
            return Err(refuse(&part.folder, why, "the front that optimise wrote"));
        };
        let (sd, total) = (front.numbers(sd)?, front.numbers("total_rms_mm")?);
        points.extend((0..front.len()).map(|row| (sd[row], total[row], front, row)));
    }
    points.retain(|point| point.0.is_finite() && point.1.is_finite());
    unbeaten(&mut points, |(sd, total, ..)| [*sd, *total]);
    let mut table = fronts.first().map(Frame::like).unwrap_or_default();
    points.iter().try_for_each(|(.., front, row)| table.extend(front, *row..row + 1))?;
    Ok(table)
}
