//! `[optimise]`: what is searched for.

use std::fmt::Write;

use super::properties::variable;
use super::reader::{Item, Result};
use super::schema::Sections;
use super::searched::{self, UNSURE, VARIED, names, vary};
use super::sections::Section;
use super::space::{KEYS, drive_key};
use crate::error::InputError;
use crate::scene::search::{
    Budget, Calibrated, Limits, Measure, Objective, Quantity, Robust, Search, Variable,
};
use crate::scene::{COLUMNS, Column, Drive, Factor, Space, Spec, Theory};

/// Says that the defaults of `[optimise]` are in force.
pub(super) const SEARCHED: &str = "[optimise]\n";

/// Whiskers sampled for each candidate unless the spec says otherwise.
const SAMPLES: u64 = 64;

/// Section, key and column of everything that can be a variable.
fn keys(drive: Drive) -> [(&'static str, &'static str, Column); 6] {
    std::array::from_fn(|k| match k {
        5 => ("tap", drive_key(drive), Column::Drive),
        _ => (KEYS[k].0, KEYS[k].1, Column::ALL[k]),
    })
}

/// Keys of the pole's direction, which is no variable: nobody chooses it.
const DIRECTIONS: [(&str, Column); 2] = [("tilt", Column::Tilt), ("lean", Column::Lean)];

/// Reads the section by itself.
pub(super) fn read(sections: &Sections<'_>) -> Result<Search> {
    let drives = [("angle", Drive::Angle), ("displacement", Drive::Displacement)];
    let drive = sections.section("tap").get("drive")?.word(&drives)?;
    if let Some(file) = sections.section("tuples").written("file") {
        return Err(file
            .error("a search varies one whisker; it takes no list of tuples")
            .allowed("axes in [whisker], [gauge] and [tap]"));
    }
    let section = sections.section("optimise");
    let robust = section.optional("robust", |item| robust(item, drive))?;
    let objective = section.get("objective")?;
    let word = objective.word(&Objective::WORDS)?;
    let nominal = robust.as_ref().is_some_and(|r| r.calibrated == Calibrated::Nominal);
    if nominal && word.needs_sd() {
        let calibrated = section.get("robust")?.need("calibrated")?;
        let message = format!(
            "the spread of K is that of each whisker's own K; objective = \"{}\" needs it",
            word.word()
        );
        return calibrated.refuse(message, "calibrated = \"each\", or objective = \"distance\"");
    }
    let leaning = |r: &Robust| {
        r.tilts()
            && r.properties.is_empty()
            && Column::ALL.iter().all(|c| r.sd[*c as usize] == 0.0 || is_direction(*c))
    };
    if word == Objective::Sd && robust.as_ref().is_some_and(leaning) {
        let message = "K and its spread are those of a calibration, which is made at upright poles: a tilt does not change them";
        let allowed = "objective = \"distance\", \"weighted\" or \"pareto\", or a tolerance of the whisker";
        return section.get("robust")?.refuse(message, allowed);
    }
    let of_gauge = sections.section("gauge").get("strain_limit")?.ranged()?;
    Ok(Search {
        objective: word,
        weights: weights(&section.get("weights")?)?,
        seed: section.get("seed")?.whole()?,
        budget: section.optional("budget", budget)?.unwrap_or_default(),
        variables: variables(&section.get("variables")?, drive)?,
        limits: limits(&section, of_gauge)?,
        robust,
    })
}

fn weights(item: &Item<'_>) -> Result<[f64; 2]> {
    item.only_known()?;
    let weights = [item.or("sd", 1.0, Item::ranged)?, item.or("distance", 1.0, Item::ranged)?];
    if weights == [0.0; 2] {
        return item.wrong("both weights are 0: there is nothing to minimise");
    }
    Ok(weights)
}

fn budget(item: &Item<'_>) -> Result<Budget> {
    item.only_known()?;
    let budget = Budget {
        evaluations: item.or("evaluations", None, |e| e.whole().map(Some))?,
        seconds: item.or("seconds", None, |s| s.ranged().map(Some))?,
    };
    if budget == Budget::default() {
        return item.wrong("this budget says neither evaluations nor seconds");
    }
    Ok(budget)
}

fn variables(item: &Item<'_>, drive: Drive) -> Result<Vec<Variable>> {
    let keys = keys(drive);
    let all = [&keys.map(|(_, key, _)| key)[..], &names(VARIED)].concat();
    if let Some(a) = item.child("a") {
        let message = "the distances are given, not searched: every candidate is judged over all a of [tap]";
        return a.refuse(message, item.allowed());
    }
    searched::known(item, &all)?;
    let columns = keys.map(|(_, key, column)| (item.child(key), Quantity::Column(column)));
    let properties = VARIED.map(|property| (variable(item, property), Quantity::Property(property)));
    let mut variables = Vec::new();
    // The drive comes last.
    let (design, drive) = columns.split_at(5);
    for (bounds, quantity) in [design, &properties, drive].concat() {
        let Some(bounds) = bounds else { continue };
        let [min, max] = bounds.numbers()?;
        if bounds.interval().is_some_and(|range| !range.holds(min) || !range.holds(max)) {
            return bounds.wrong("these bounds are out of range");
        }
        if min > max {
            return bounds.wrong("these bounds are inverted: min is larger than max");
        }
        if min == max {
            let message = "these bounds have no width; a value that is given belongs into its own section";
            return bounds.wrong(message);
        }
        variables.push(Variable { quantity, min, max, start: None });
    }
    if variables.is_empty() {
        return item.wrong("there is nothing to search over");
    }
    Ok(variables)
}

/// `limits`; `strain` is that of the gauge.
fn limits(section: &Section<'_>, strain: f64) -> Result<Limits> {
    let strain_key = "gauge.strain_limit";
    let free = Limits { strain, strain_key, force: None, unambiguous: false, tip_not_wider: false };
    let Some(item) = section.written("limits") else { return Ok(free) };
    item.only_known()?;
    Ok(Limits {
        strain: item.or("strain", strain, Item::ranged)?,
        strain_key: item.child("strain").map_or(strain_key, |_| "optimise.limits.strain"),
        force: item.child("force_N").map(|force| force.ranged()).transpose()?,
        unambiguous: item.or("unambiguous", false, Item::flag)?,
        tip_not_wider: item.or("tip_not_wider", false, Item::flag)?,
    })
}

fn robust(item: &Item<'_>, drive: Drive) -> Result<Robust> {
    let columns = keys(drive).map(|(_, key, column)| (key, column)).into_iter().chain(DIRECTIONS);
    let others = ["samples", "measure", "calibrated"];
    let known = columns.clone().map(|(key, _)| key).chain(others).chain(names(UNSURE));
    searched::known(item, &known.collect::<Vec<_>>())?;
    let mut sd = [0.0; COLUMNS];
    for (key, column) in columns {
        sd[column as usize] = item.or(key, 0.0, Item::ranged)?;
    }
    let mut properties = Vec::new();
    for property in UNSURE {
        if let Some(value) = variable(item, property) {
            properties.push((property, value.ranged()?));
        }
    }
    properties.retain(|(_, sd)| *sd > 0.0);
    if sd == [0.0; COLUMNS] && properties.is_empty() {
        return item.wrong("no standard deviation is larger than zero: nothing to be robust against");
    }
    let samples = item.or("samples", SAMPLES, Item::whole)? as u32;
    let measures = [("mean", Measure::Mean), ("cvar90", Measure::Cvar90)];
    let measure = item.or("measure", Measure::Mean, |m| m.word(&measures))?;
    let of = [("each", Calibrated::Each), ("nominal", Calibrated::Nominal)];
    let calibrated = item.or("calibrated", Calibrated::Each, |c| c.word(&of))?;
    Ok(Robust { sd, properties, samples, measure, calibrated })
}

/// Whether a column is one of the pole's direction.
fn is_direction(column: Column) -> bool {
    DIRECTIONS.iter().any(|(_, c)| *c == column)
}

/// Values for the variables that are not written in their sections, chosen so that a spec that can be met at all is valid.
pub(super) fn fallback(search: &Search) -> String {
    let mut text = SEARCHED.to_owned();
    for section in ["whisker", "gauge", "tap"] {
        let _ = writeln!(text, "[{section}]");
        // A drive that the spec does not have does no harm in a fallback.
        for (_, key, column) in keys(Drive::Angle).into_iter().filter(|k| k.0 == section) {
            let Some(v) = of(search, column) else { continue };
            let roomiest = if column == Column::Length { v.max } else { v.min };
            let _ = writeln!(text, "{key} = {roomiest:?}");
            if column == Column::Drive {
                let _ = writeln!(text, "delta = {roomiest:?}");
            }
        }
    }
    text
}

/// The variable that is this column.
fn of(search: &Search, column: Column) -> Option<&Variable> {
    search.variables.iter().find(|v| v.quantity == Quantity::Column(column))
}

/// Whether the dotted `key` is that of a variable.
pub(super) fn is_variable(search: &Search, key: &str) -> bool {
    let all = keys(Drive::Angle).into_iter().chain(keys(Drive::Displacement));
    all.filter(|k| of(search, k.2).is_some()).any(|k| key == format!("{}.{}", k.0, k.1))
}

/// Judges the section together with the rest of the spec; fills in the first start, and the rigs of the candidates.
pub(super) fn check(sections: &Sections<'_>, spec: &mut Spec, search: &mut Search) -> Result<()> {
    vary(sections, spec, search)?;
    let objective = sections.section("optimise").get("objective")?;
    if search.objective.needs_distance() && spec.study.setup.is_noisy().is_none() {
        return Err(noise_missing(&objective));
    }
    let Space::Grid(factors) = &spec.study.space else { return Err(objective.error("a search needs axes")) };
    let axis = |column: Column| {
        factors.iter().flat_map(|f: &Factor| &f.axes).find(|(c, _)| *c == column).map(|(_, axis)| axis)
    };
    let estimate = &spec.study.setup.estimate;
    let needs_mean = estimate.k.is_none() && estimate.theory != Theory::Exact;
    if axis(Column::Distance).is_some_and(|a| a.len() < 2) && (search.objective.needs_sd() || needs_mean) {
        let a = sections.section("tap").get("a")?;
        return a.refuse("K has no spread and no mean over one distance", "two distances or more");
    }
    for (section, key, column) in keys(spec.study.setup.drive) {
        let variable = search.variables.iter_mut().find(|v| v.quantity == Quantity::Column(column));
        let Some(item) = sections.section(section).written(key) else { continue };
        let Some(axis) = axis(column) else { continue };
        match variable {
            Some(_) if axis.len() > 1 => {
                return Err(item
                    .error("this is a variable of [optimise]: here stands its first start")
                    .allowed("one number, or nothing"));
            }
            Some(v) => v.start = Some(axis.at(0)),
            None if axis.len() > 1 && column != Column::Drive => {
                let message = "a search needs one number here, or bounds for it in [optimise] variables";
                return Err(item
                    .error(message)
                    .allowed("one number; only a, and a theta that is no variable, may be lists"));
            }
            None if axis.points().is_some() => {
                return Err(item
                    .error("tap angles to choose from are listed, not sampled")
                    .allowed("a value, a list or a range"));
            }
            None => {}
        }
    }
    for (key, column) in DIRECTIONS {
        let Some(item) = sections.section("tap").written(key) else { continue };
        let axis = axis(column).filter(|axis| axis.len() > 1 || axis.at(0) != 0.0);
        if axis.is_some_and(|axis| axis.len() > 1) {
            return item.refuse("a search needs one direction of the object's edge", "one number");
        }
        if axis.is_some() && search.robust.as_ref().is_some_and(Robust::tilts) {
            let message =
                "with a tilt or lean in [optimise] robust the object's edge is upright but for that";
            return item.refuse(message, "0, or nothing");
        }
    }
    if let Some(robust) = &search.robust {
        let leaning = [Column::Tilt, Column::Lean].map(|column| robust.sd[column as usize] > 0.0);
        if let Some(why) = spec.study.setup.forbids(leaning) {
            let item = sections.section("optimise").get("robust")?;
            return item.refuse(why, "no tilt and lean in it, or contact = \"frictionless\" in [model]");
        }
    }
    let ends = |column: Column| {
        of(search, column)
            .map_or_else(|| axis(column).map_or([f64::NAN; 2], |a| [a.at(0); 2]), |v| [v.min, v.max])
    };
    let (base, tip) = (ends(Column::BaseDiameter), ends(Column::TipDiameter));
    if search.limits.tip_not_wider && tip[0] > base[1] {
        let message =
            format!("no tip is that thin: the smallest d is {} mm, the largest D {} mm", tip[0], base[1]);
        let item = sections.section("optimise").get("limits")?.need("tip_not_wider")?;
        return item.refuse(message, format!("d ≤ {} mm in reach, or tip_not_wider = false", base[1]));
    }
    Ok(())
}

/// An objective that has no meaning without noise.
pub(super) fn noise_missing(objective: &Item<'_>) -> InputError {
    objective
        .error("total_rms_mm holds the gauge's noise, and noise_strain is not written")
        .allowed("noise_strain = 20e-6 in [gauge] (0 for the bias alone), noise in [sensor] for another signal, or objective = \"sd\"")
}
