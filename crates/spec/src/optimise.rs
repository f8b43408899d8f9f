//! `[optimise]`.

use super::properties::{known, names, unsure, variable, varied, vary};
use super::space::{self, ColumnKey, keys};
use super::{Item, Result, Section, Sections};
use crate::scene::{
    Budget, COLUMNS, Calibrated, Column, Drive, Limits, Measure, Objective, Quantity, Robust, Search, Spec,
    Theory, Variable,
};

pub(super) const SEARCHED: &str = "[optimise]\n";

const NOISELESS: &str = "total_rms_mm holds the gauge's noise, and noise_strain is not written";

fn columns(drive: Drive) -> impl Iterator<Item = ColumnKey> {
    keys(drive).into_iter().filter(|key| key.2 < Column::Distance || key.2 == Column::Drive)
}

pub(super) fn read(sections: &Sections<'_>) -> Result<Search> {
    let drive = space::drive(sections)?;
    if let Some(file) = sections.section("tuples").written("file") {
        let why = "a search varies one whisker; it takes no list of tuples";
        return file.refuse(why, "axes in [whisker], [gauge] and [tap]");
    }
    let section = sections.section("optimise");
    let robust = section.optional("robust", |item| robust(item, drive))?;
    let objective = section.get("objective")?;
    let word = objective.word(&Objective::WORDS)?;
    let nominal = robust.as_ref().is_some_and(|r| r.calibrated == Calibrated::Nominal);
    if nominal && word.needs_sd() {
        let calibrated = section.get("robust")?.need("calibrated")?;
        let asked = format!("objective = \"{}\"", word.word());
        let message = format!("the spread of K is that of each whisker's own K; {asked} needs it");
        return calibrated.refuse(message, "calibrated = \"each\", or objective = \"distance\"");
    }
    let leaning = |r: &Robust| {
        let mut others = Column::ALL.into_iter().filter(|c| ![Column::Tilt, Column::Lean].contains(c));
        r.tilts() && r.properties.is_empty() && others.all(|c| r.sd[c as usize] == 0.0)
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
    item.wrong_if(weights == [0.0; 2], "both weights are 0: there is nothing to minimise").map(|()| weights)
}

fn budget(item: &Item<'_>) -> Result<Budget> {
    let budget: Budget = item.read()?;
    let empty = budget == Budget::default();
    item.wrong_if(empty, "this budget says neither evaluations nor seconds").map(|()| budget)
}

fn variables(item: &Item<'_>, drive: Drive) -> Result<Vec<Variable>> {
    if let Some(a) = item.child("a") {
        let message = "the distances are given, not searched: every candidate is judged over all a of [tap]";
        return a.refuse(message, item.allowed());
    }
    known(item, &columns(drive).map(|(_, key, _)| key).chain(names(varied())).collect::<Vec<_>>())?;
    let own = columns(drive).map(|(_, key, column)| (item.child(key), Quantity::Column(column)));
    let mut all: Vec<_> = own.collect();
    let properties = varied().map(|property| (variable(item, property), Quantity::Property(property)));
    let drive = all.len() - 1;
    all.splice(drive..drive, properties);
    let mut variables = Vec::new();
    for (bounds, quantity) in all.into_iter().filter_map(|(bounds, of)| Some((bounds?, of))) {
        let [min, max] = bounds.numbers()?;
        let outside = bounds.interval().is_some_and(|range| !range.holds(min) || !range.holds(max));
        bounds.wrong_if(outside, "these bounds are out of range")?;
        bounds.wrong_if(min > max, "these bounds are inverted: min is larger than max")?;
        let message = "these bounds have no width; a value that is given belongs into its own section";
        bounds.wrong_if(min == max, message)?;
        variables.push(Variable { quantity, min, max, start: None });
    }
    item.wrong_if(variables.is_empty(), "there is nothing to search over").map(|()| variables)
}

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
    let mut columns = keys(drive).to_vec();
    columns.retain(|key| key.2 != Column::Distance);
    columns.sort_by_key(|key| matches!(key.2, Column::Tilt | Column::Lean));
    let others = ["samples", "measure", "calibrated"];
    let all = columns.iter().map(|(_, key, _)| *key).chain(others).chain(names(unsure()));
    known(item, &all.collect::<Vec<_>>())?;
    let mut sd = [0.0; COLUMNS];
    for (_, key, column) in columns {
        sd[column as usize] = item.or(key, 0.0, Item::ranged)?;
    }
    let read = |property| Some(variable(item, property)?.ranged().map(|sd| (property, sd)));
    let mut properties = unsure().filter_map(read).collect::<Result<Vec<_>>>()?;
    properties.retain(|(_, sd)| *sd > 0.0);
    let idle = sd == [0.0; COLUMNS] && properties.is_empty();
    item.wrong_if(idle, "no standard deviation is larger than zero: nothing to be robust against")?;
    let samples = item.or("samples", 64, Item::whole)? as u32;
    let measure = item.or("measure", Measure::Mean, |m| m.word(&Measure::WORDS))?;
    let calibrated = item.or("calibrated", Calibrated::Each, |c| c.word(&Calibrated::WORDS))?;
    Ok(Robust { sd, properties, samples, measure, calibrated })
}

/// Values for variables that are missing from their sections, chosen so that a spec that can be met is valid.
pub(super) fn fallback(search: &Search) -> String {
    // A drive that the spec does not have is harmless here.
    let keys = columns(Drive::Angle).chain([("tap", "delta", Column::Drive)]);
    let line = |(section, key, column)| {
        let v = of(search, column)?;
        let roomiest = if column == Column::Length { v.max } else { v.min };
        Some(format!("{section}.{key} = {roomiest:?}\n"))
    };
    keys.filter_map(line).collect::<String>() + SEARCHED
}

fn of(search: &Search, column: Column) -> Option<&Variable> {
    search.variables.iter().find(|v| v.quantity == Quantity::Column(column))
}

pub(super) fn is_variable(search: &Search, key: &str) -> bool {
    let mut all = columns(Drive::Angle).chain(columns(Drive::Displacement));
    all.any(|(section, name, column)| key == format!("{section}.{name}") && of(search, column).is_some())
}

pub(super) fn check(sections: &Sections<'_>, spec: &mut Spec, search: &mut Search) -> Result<()> {
    vary(sections, spec, search)?;
    let objective = sections.section("optimise").get("objective")?;
    if search.objective.needs_distance() && spec.study.setup.is_noisy().is_none() {
        let allowed = "noise_strain = 20e-6 in [gauge] (0 for the bias alone), noise in [sensor] for another signal, or objective = \"sd\"";
        return objective.refuse(NOISELESS, allowed);
    }
    let estimate = &spec.study.setup.estimate;
    let needs_mean = estimate.k.is_none() && estimate.theory != Theory::Exact;
    if search.objective.needs_sd() || needs_mean {
        two_distances(sections, spec)?;
    }
    let axis = |column: Column| spec.study.space.axis(column);
    for (section, key, column) in keys(spec.study.setup.drive) {
        let Some((item, axis)) = sections.section(section).written(key).zip(axis(column)) else { continue };
        let one = axis.len() == 1;
        if column == Column::Tilt || column == Column::Lean {
            item.refuse_if(!one, "a search needs one direction of the object's edge", "one number")?;
            let tilts = axis.at(0) != 0.0 && search.robust.as_ref().is_some_and(Robust::tilts);
            let why = "with a tilt or lean in [optimise] robust the object's edge is upright but for that";
            item.refuse_if(tilts, why, "0, or nothing")?;
            continue;
        }
        match search.variables.iter_mut().find(|v| v.quantity == Quantity::Column(column)) {
            Some(v) if one => v.start = Some(axis.at(0)),
            Some(_) => {
                let message = "this is a variable of [optimise]: here stands its first start";
                return item.refuse(message, "one number, or nothing");
            }
            None if !one && column != Column::Drive && column != Column::Distance => {
                let message = "a search needs one number here, or bounds for it in [optimise] variables";
                return item
                    .refuse(message, "one number; only a, and a theta that is no variable, may be lists");
            }
            None if axis.points().is_some() && column == Column::Drive => {
                let message = "tap angles to choose from are listed, not sampled";
                return item.refuse(message, "a value, a list or a range");
            }
            None => {}
        }
    }
    if let Some(robust) = &search.robust {
        let leaning = [Column::Tilt, Column::Lean].map(|column| robust.sd[column as usize] > 0.0);
        if let Some(why) = spec.study.setup.forbids(leaning) {
            let item = sections.section("optimise").get("robust")?;
            return item.refuse(why, "no tilt and lean in it, or contact = \"frictionless\" in [model]");
        }
    }
    let fixed = |column| axis(column).map_or([f64::NAN; 2], |a| [a.at(0); 2]);
    let ends = |column| of(search, column).map_or_else(|| fixed(column), |v| [v.min, v.max]);
    let (base, tip) = (ends(Column::BaseDiameter), ends(Column::TipDiameter));
    if search.limits.tip_not_wider && tip[0] > base[1] {
        let message =
            format!("no tip is that thin: the smallest d is {} mm, the largest D {} mm", tip[0], base[1]);
        let item = sections.section("optimise").get("limits")?.need("tip_not_wider")?;
        return item.refuse(message, format!("d ≤ {} mm in reach, or tip_not_wider = false", base[1]));
    }
    Ok(())
}

fn two_distances(sections: &Sections<'_>, spec: &Spec) -> Result<()> {
    if spec.study.space.axis(Column::Distance).is_none_or(|a| a.len() > 1) {
        return Ok(());
    }
    let why = "K has no spread and no mean over one distance";
    sections.section("tap").get("a")?.refuse(why, "two distances or more")
}

pub(super) const TAP: &str = "[tap]\ntheta = [0.1, 10.0]\n";

/// Smallest and largest drive of a spec for `tap`, which takes one whisker; `noisy`: its objective needs the noise.
pub(super) fn check_tap(sections: &Sections<'_>, spec: &Spec, noisy: bool) -> Result<[f64; 2]> {
    let setup = &spec.study.setup;
    for (section, key, column) in keys(setup.drive) {
        let Some(axis) = spec.study.space.axis(column) else {
            let file = sections.section("tuples").get("file")?;
            let why = "this takes one whisker, no list of tuples";
            return file.refuse(why, "one number each for D, d, L_a, x_ss, l");
        };
        let (why, instead) = match column {
            Column::Distance | Column::Drive => continue,
            Column::Tilt | Column::Lean => ("this takes one direction of the object's edge", "one number"),
            _ => ("this takes one whisker", "one number; optimise searches over whiskers"),
        };
        if axis.len() > 1 {
            return sections.section(section).get(key)?.refuse(why, instead);
        }
    }
    // The model itself needs no K.
    if setup.estimate.k.is_none() && !(noisy && setup.estimate.theory == Theory::Exact) {
        two_distances(sections, spec)?;
    }
    let ends = spec.study.space.axis(Column::Drive).map_or([0.0; 2], |drive| [drive.min(), drive.max()]);
    if ends[0] >= ends[1] {
        let none = if setup.drive == Drive::Angle { "; or none, which is 0.1 … 10" } else { "" };
        let allowed = format!("two values or a range: the ends of the interval{none}");
        let item = sections.section("tap").get(Column::Drive.key(setup.drive))?;
        return item.refuse("one value leaves nothing to choose", allowed);
    }
    if noisy && setup.is_noisy().is_none() {
        let section = sections.section("gauge");
        let error = section.document.error(section.span.clone(), NOISELESS).key("gauge.noise_strain");
        let allowed = "noise_strain = 20e-6 (0 for the bias alone), noise in [sensor] for another signal, or --objective sd";
        return Err(error.allowed(allowed));
    }
    Ok(ends)
}
