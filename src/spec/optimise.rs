//! `[optimise]`: what is searched for.

use std::fmt::Write;

use super::check::{Domain, LENGTH, PLACE, POSITIVE, STRAIN_LIMIT, TAP_ANGLE, domain};
use super::keys as listed;
use super::properties::variable;
use super::reader::{Item, Result};
use super::schema::Sections;
use super::searched::{self, UNSURE, VARIED, names, vary};
use super::sections::Section;
use crate::error::InputError;
use crate::scene::search::{
    Budget, Calibrated, Limits, Measure, Objective, Places, Quantity, Robust, Search, Variable,
};
use crate::scene::{COLUMNS, Column, Drive, Factor, Space, Spec, Theory};

/// Values in force where `[optimise]` says nothing.
pub(super) const DEFAULTS: &str = "[optimise]\nseed = 1\nweights = { sd = 1.0, distance = 1.0 }\n";

/// Whiskers sampled for each candidate unless the spec says otherwise.
const SAMPLES: u64 = 64;
/// Most of them.
const MOST_SAMPLES: u64 = 1 << 16;

const WEIGHT: Domain = Domain { allowed: "≥ 0", holds: |v| v >= 0.0 };
const DEVIATION: Domain =
    Domain { allowed: "a standard deviation ≥ 0, in the key's unit", holds: |v| v >= 0.0 };
/// Cut at three standard deviations a pole still leans by less than 90°.
const LEANING_DEVIATION: Domain =
    Domain { allowed: "a standard deviation ≥ 0 and < 30 degrees", holds: |v| (0.0..30.0).contains(&v) };
const SECONDS: Domain = Domain { allowed: "> 0 s", holds: |v| v > 0.0 };

const BUDGET: &str = "{ evaluations = 20000 }, { seconds = 30 } or both; each > 0";
const LIMITS: &str = "strain, force_N, unambiguous, tip_not_wider";

/// Section, key, column and domain of everything that can be a variable.
fn keys(drive: Drive) -> [(&'static str, &'static str, Column, Domain); 6] {
    [
        ("whisker", "D", Column::BaseDiameter, LENGTH),
        ("whisker", "d", Column::TipDiameter, LENGTH),
        ("whisker", "L_a", Column::Length, LENGTH),
        ("gauge", "x_ss", Column::GaugePosition, PLACE),
        ("gauge", "l", Column::GridLength, LENGTH),
        match drive {
            Drive::Angle => ("tap", "theta", Column::Drive, TAP_ANGLE),
            Drive::Displacement => ("tap", "delta", Column::Drive, LENGTH),
        },
    ]
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
    let gauge = sections.section("gauge").get("strain_limit")?;
    let (limits, places) = limits(&section, &gauge)?;
    Ok(Search {
        objective: word,
        weights: weights(&section.get("weights")?)?,
        seed: section.get("seed")?.whole(0)?,
        budget: section.optional("budget", budget)?.unwrap_or_default(),
        variables: variables(&section.get("variables")?, drive)?,
        limits,
        robust,
        places,
    })
}

fn weights(item: &Item<'_>) -> Result<[f64; 2]> {
    let allowed = "{ sd = 1.0, distance = 1.0 }, each ≥ 0, one of them > 0";
    item.only(&listed::WEIGHTS.names(), allowed)?;
    let weight = |key| item.child(key).map_or(Ok(1.0), |w| w.within(&WEIGHT));
    let weights = [weight("sd")?, weight("distance")?];
    if weights == [0.0; 2] {
        return item.refuse("both weights are 0: there is nothing to minimise", allowed);
    }
    Ok(weights)
}

fn budget(item: &Item<'_>) -> Result<Budget> {
    item.only(&listed::BUDGET.names(), BUDGET)?;
    let budget = Budget {
        evaluations: item.child("evaluations").map(|e| e.whole(1)).transpose()?,
        seconds: item.child("seconds").map(|s| s.within(&SECONDS)).transpose()?,
    };
    if budget == Budget::default() {
        return item.refuse("this budget says neither evaluations nor seconds", BUDGET);
    }
    Ok(budget)
}

fn variables<'a>(item: &Item<'a>, drive: Drive) -> Result<Vec<Variable>> {
    let keys = keys(drive);
    let names = [&keys.map(|(_, key, ..)| key)[..], &names(VARIED)].concat();
    let all = format!("some of {}, each [min, max]", names.join(", "));
    if let Some(a) = item.child("a") {
        return Err(a
            .error("the distances are given, not searched: every candidate is judged over all a of [tap]")
            .allowed(all));
    }
    searched::known(item, &names, &all)?;
    let mut variables = Vec::new();
    let columns = keys.map(|(_, key, column, domain)| (item.child(key), Quantity::Column(column), domain));
    let properties = VARIED.into_iter().map(|property| {
        let (words, holds) = property.about().allowed;
        (variable(item, property), Quantity::Property(property), domain(words, holds))
    });
    // The drive comes last.
    let (design, drive) = columns.split_at(5);
    let columns = |part: &[(Option<Item<'a>>, Quantity, Domain)]| part.to_vec();
    for (bounds, quantity, domain) in columns(design).into_iter().chain(properties).chain(columns(drive)) {
        let Some(bounds) = bounds else { continue };
        let allowed = format!("[min, max] with min < max, {}", domain.allowed);
        let [min, max] = bounds.numbers(&allowed)?;
        if !(domain.holds)(min) || !(domain.holds)(max) {
            return bounds.refuse("these bounds are out of range", allowed);
        }
        if min > max {
            return bounds.refuse("these bounds are inverted: min is larger than max", allowed);
        }
        if min == max {
            let message = "these bounds have no width; a value that is given belongs into its own section";
            return bounds.refuse(message, allowed);
        }
        variables.push(Variable { quantity, min, max, start: None });
    }
    if variables.is_empty() {
        return item.refuse("there is nothing to search over", all);
    }
    Ok(variables)
}

fn limits(section: &Section<'_>, gauge: &Item<'_>) -> Result<(Limits, Places)> {
    let blank = |item: &Item<'_>| item.error("");
    let variables = blank(&section.get("variables")?);
    let strain = gauge.within(&STRAIN_LIMIT)?;
    let mut limits = Limits { strain, force: None, unambiguous: false, tip_not_wider: false };
    let mut places = Places { strain: blank(gauge), variables, ..Places::default() };
    let Some(item) = section.written("limits") else { return Ok((limits, places)) };
    item.only(&listed::LIMITS.names(), LIMITS)?;
    if let Some(strain) = item.child("strain") {
        (limits.strain, places.strain) = (strain.within(&STRAIN_LIMIT)?, blank(&strain));
    }
    if let Some(force) = item.child("force_N") {
        let newtons = Domain { allowed: "> 0 N", ..POSITIVE };
        (limits.force, places.force) = (Some(force.within(&newtons)?), blank(&force));
    }
    if let Some(flag) = item.child("unambiguous") {
        (limits.unambiguous, places.unambiguous) = (flag.flag()?, blank(&flag));
    }
    if let Some(flag) = item.child("tip_not_wider") {
        (limits.tip_not_wider, places.tip_not_wider) = (flag.flag()?, blank(&flag));
    }
    Ok((limits, places))
}

fn robust(item: &Item<'_>, drive: Drive) -> Result<Robust> {
    let keys = keys(drive);
    let mut known = keys.map(|(_, key, ..)| key).to_vec();
    known.extend(DIRECTIONS.map(|(key, _)| key));
    known.extend(["samples", "measure", "calibrated"]);
    known.extend(names(UNSURE));
    searched::known(item, &known, &known.join(", "))?;
    let mut sd = [0.0; COLUMNS];
    let directions = DIRECTIONS.map(|(key, column)| (key, column, LEANING_DEVIATION));
    for (key, column, domain) in
        keys.map(|(_, key, column, _)| (key, column, DEVIATION)).into_iter().chain(directions)
    {
        sd[column as usize] = item.or(key, 0.0, |value| value.within(&domain))?;
    }
    let mut properties = Vec::new();
    for property in UNSURE {
        if let Some(value) = variable(item, property) {
            properties.push((property, value.within(&DEVIATION)?));
        }
    }
    properties.retain(|(_, sd)| *sd > 0.0);
    if sd == [0.0; COLUMNS] && properties.is_empty() {
        let message = "no standard deviation is larger than zero: nothing to be robust against";
        return item.refuse(message, known.join(", "));
    }
    let samples = item.or("samples", SAMPLES, |s| match s.whole(2)? {
        n @ ..=MOST_SAMPLES => Ok(n),
        _ => s.refuse("this number is too large", format!("2 … {MOST_SAMPLES}")),
    })? as u32;
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

/// Values for the variables that are not written in their sections, chosen so that a spec that can be met at all is valid, and
/// the defaults of the section.
pub(super) fn fallback(search: &Search) -> String {
    let mut text = DEFAULTS.to_owned();
    for section in ["whisker", "gauge", "tap"] {
        let _ = writeln!(text, "[{section}]");
        // A drive that the spec does not have does no harm in a fallback.
        for (_, key, column, _) in keys(Drive::Angle).into_iter().filter(|k| k.0 == section) {
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
    for (section, key, column, _) in keys(spec.study.setup.drive) {
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
        return Err(InputError {
            message,
            allowed: Some(format!("d ≤ {} mm in reach, or tip_not_wider = false", base[1])),
            ..search.places.tip_not_wider.clone()
        });
    }
    Ok(())
}

/// An objective that has no meaning without noise.
pub(super) fn noise_missing(objective: &Item<'_>) -> InputError {
    objective
        .error("total_rms_mm holds the gauge's noise, and noise_strain is not written")
        .allowed("noise_strain = 20e-6 in [gauge] (0 for the bias alone), noise in [sensor] for another signal, or objective = \"sd\"")
}
