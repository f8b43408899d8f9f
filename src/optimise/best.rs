//! `best.toml`: the best design as a spec. Also judges the best design by the other estimator.

use super::TOLERANCE;
use super::report::{Design, why};
use super::{Found, Goal, Report, Score, Scorer};
use crate::backend::Choice;
use crate::error::Error;
use crate::plan::Layout;
use crate::scene::{Column, Material, Property, Quantity, Search, Setup, Spec, Theory, Tuple};

pub fn text(spec: &Spec, search: &Search, report: &Report) -> Result<String, Error> {
    let fail = |e: &dyn std::fmt::Display| Error::Run(format!("best.toml: {e}"));
    let mut best: toml::Table = spec.text.parse().map_err(|e| fail(&e))?;
    for section in ["optimise", "output", "run"] {
        best.remove(section);
    }
    let Tuple { D, d, L_a, x_ss, l, drive, .. } = report.best.point;
    let setup = &spec.study.setup;
    let profile = best.get("whisker").is_some_and(|whisker| whisker.get("profile").is_some());
    let own = [("D", D), ("d", d), ("L_a", L_a)].into_iter().filter(|_| !profile);
    let rest = [("gauge", "x_ss", x_ss), ("gauge", "l", l), ("tap", Column::Drive.key(setup.drive), drive)];
    let columns = own.map(|(key, value)| ("whisker", key, value)).chain(rest);
    let properties = setup.rigs.iter().flat_map(|rigs| {
        rigs.properties.iter().map(|property| {
            let key = match (property, setup.model.material) {
                (Property::Modulus, Material::NeoHookean(_)) => "material.neo-hookean",
                (Property::Modulus, _) => "material.hooke",
                _ => property.about().key,
            };
            (property.about().section, key, rigs.value(report.best.point.rig, *property))
        })
    });
    for (section, key, value) in columns.chain(properties) {
        let mut table = &mut best;
        let mut path: Vec<&str> = std::iter::once(section).chain(key.split('.')).collect();
        let name = path.pop().unwrap_or_default();
        for part in path {
            let inner = table.entry(part).or_insert_with(|| toml::Table::new().into());
            table = inner.as_table_mut().ok_or_else(|| fail(&format!("{part} is no table")))?;
        }
        table.insert(name.into(), value.into());
    }
    if let Some(fitted) = fitted(spec)
        && let Some(model) = best.get_mut("model").and_then(toml::Value::as_table_mut)
    {
        model.insert("material".into(), fitted);
    }
    let b = &report.backends[1];
    let mut run = toml::Table::new();
    run.insert("backend".into(), b.name.into());
    if b.tolerance.is_some() {
        run.insert("precision".into(), "f64".into());
        run.insert("tolerance".into(), TOLERANCE.into());
    }
    best.insert("run".into(), run.into());
    let (name, objective, n) = (&spec.name, search.objective.word(), report.evaluations);
    let (ended, why) = (report.ended.word(), why(&spec.study.setup, search, report));
    let head = format!(
        "# Best design of {name} by objective = \"{objective}\" ({n} evaluations, ended by {ended}). {why}\n# [run] as the search computed it: sweep gives the same figures.\n"
    );
    Ok(head + &toml::to_string(&best).map_err(|e| fail(&e))?)
}

/// The fitted material in place of a measured curve, whose path is relative to the spec.
pub(crate) fn fitted(spec: &Spec) -> Option<toml::Value> {
    let (Some(_), Material::Yeoh(c)) = (&spec.material_fit, &spec.study.setup.model.material) else {
        return None;
    };
    Some(toml::Table::from_iter([("yeoh".to_owned(), c.to_vec().into())]).into())
}

/// Number of drives in the first scan (nominal whisker only), and how many of them on each side of the best the second scan covers.
const FIRST: (usize, usize) = (65, 4);
/// Number of drives in the second scan, and relative width to which its best is narrowed down.
const SECOND: (usize, f64) = (9, 1e-4);

#[derive(Debug)]
pub struct Other {
    pub theory: Theory,
    pub here: Design,
    /// At the best of the drives searched or listed; `None` if there is one drive only, or no drive keeps the limits.
    pub best: Option<Design>,
}

pub(super) fn judge(
    (setup, layout): (&Setup, &Layout),
    search: &Search,
    choice: &Choice,
    (point, goal): (&Tuple, Goal),
) -> Result<Other, Error> {
    let theory = setup.estimate.theory.compared();
    let mut setup = setup.clone();
    setup.estimate.theory = theory;
    let mut scorer = Scorer::new(&setup, layout, search, choice.open(&setup.model)?);
    scorer.referral.far = false;
    let taps = |drives: &[f64]| drives.iter().map(|&drive| Tuple { drive, ..*point }).collect::<Vec<_>>();
    let found = |points: Vec<Tuple>, scores: Vec<Score>| -> Vec<Found> {
        points.into_iter().zip(scores).map(|(point, score)| Found { point, score }).collect()
    };
    let value = |f: &Found| if goal.feasible(&f.score) { goal.value(&f.score) } else { f64::INFINITY };
    let least = |all: &[Found]| {
        let allowed = (0..all.len()).filter(|&i| value(&all[i]).is_finite());
        allowed.min_by(|&i, &j| value(&all[i]).total_cmp(&value(&all[j])))
    };
    let around = |at: usize, by: usize, n: usize| [at.saturating_sub(by), (at + by).min(n - 1)];
    let between = |ends: [f64; 2], n: usize| -> Vec<f64> {
        let share = |i: usize| i as f64 / (n - 1) as f64;
        (0..n).map(|i| ends[0] * (ends[1] / ends[0]).powf(share(i))).collect()
    };
    let variable = search.variables.iter().find(|v| v.quantity == Quantity::Column(Column::Drive));
    let mut drives: Vec<f64> = (0..layout.n_drives).map(|j| layout.stroke(point, j).drive).collect();
    if let Some(v) = variable {
        let first = between([v.min, v.max], FIRST.0);
        let scores = scorer.nominal(&taps(&first), &|| true)?;
        let ends = least(&found(taps(&first), scores)).map(|at| around(at, FIRST.1, FIRST.0));
        drives = ends.map_or_else(Vec::new, |ends| between(ends.map(|i| first[i]), SECOND.0));
    } else if drives.len() == 1 {
        drives.clear();
    }
    let mut ask = |drives: &[f64]| -> Result<Vec<Found>, Error> {
        Ok(found(taps(drives), scorer.scores(&taps(drives))?))
    };
    let (here, all) = (ask(&[point.drive])?[0], ask(&drives)?);
    let best = match (least(&all), variable) {
        (Some(at), Some(_)) => {
            let [before, after] = around(at, 1, all.len()).map(|i| all[i]);
            let drive = |f: &Found| f.point.drive;
            Some(narrowed([before, all[at], after], SECOND.1, drive, &value, ask)?)
        }
        (at, _) => at.map(|at| all[at]),
    };
    let mut design = |found: Found| scorer.design(found);
    Ok(Other { theory, here: design(here)?, best: best.map(design).transpose()? })
}

/// The best near the middle of three samples: the interval around the best is halved until its relative width is `width`. `value` is smaller where
/// better, infinite where nothing is allowed: a minimum at the edge of that is found too.
pub fn narrowed<T: Copy>(
    mut around: [T; 3],
    width: f64,
    drive: fn(&T) -> f64,
    value: &dyn Fn(&T) -> f64,
    mut ask: impl FnMut(&[f64]) -> Result<Vec<T>, Error>,
) -> Result<T, Error> {
    let mut best = around[1];
    loop {
        let [low, middle, high] = around.each_ref().map(drive);
        if high - low <= width * high {
            return Ok(best);
        }
        let between = ask(&[0.5 * (low + middle), 0.5 * (middle + high)])?;
        let all = [around[0], between[0], around[1], between[1], around[2]];
        // Of equal ones the middle, which at an end of the interval is there twice.
        let order = |i: &usize, j: &usize| value(&all[*i]).total_cmp(&value(&all[*j]));
        let at = [2, 1, 3, 0, 4].into_iter().min_by(order).unwrap_or(2);
        around = [all[at.saturating_sub(1)], all[at], all[(at + 1).min(4)]];
        if value(&all[at]) < value(&best) {
            best = all[at];
        }
    }
}
