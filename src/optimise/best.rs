//! `best.toml`: the best design as a spec. Also judges the best design by the other estimator.

use super::blame::why;
use super::evaluate::Scorer;
use super::report::{Design, Report, key};
use super::run::TOLERANCE;
use super::score::{Goal, Score};
use super::session::Found;

use crate::error::Error;
use crate::evaluate::Method;
use crate::plan::Layout;
use crate::scene::search::{Quantity, Search};
use crate::scene::{Column, Material, Property, Setup, Spec, Theory, Tuple};

pub fn text(spec: &Spec, search: &Search, report: &Report) -> Result<String, Error> {
    let fail = |e: &dyn std::fmt::Display| Error::Run(format!("best.toml: {e}"));
    let mut best: toml::Table = spec.text.parse().map_err(|e| fail(&e))?;
    for section in ["optimise", "output", "run"] {
        best.remove(section);
    }
    let Tuple { D, d, L_a, x_ss, l, drive, .. } = report.best.point;
    let setup = &spec.study.setup;
    let drive_key = key(setup, Column::Drive);
    let profile = best.get("whisker").is_some_and(|whisker| whisker.get("profile").is_some());
    let own = [("D", D), ("d", d), ("L_a", L_a)].into_iter().filter(|_| !profile);
    let rest = [("gauge", "x_ss", x_ss), ("gauge", "l", l), ("tap", drive_key, drive)];
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
    if let (Some(_), Material::Yeoh(c)) = (&spec.material_fit, &spec.study.setup.model.material) {
        // The curve's path is relative to the spec, so the fitted coefficients are written instead.
        let material: toml::Table =
            [("yeoh".to_owned(), toml::Value::from(c.to_vec()))].into_iter().collect();
        if let Some(model) = best.get_mut("model").and_then(toml::Value::as_table_mut) {
            model.insert("material".into(), material.into());
        }
    }
    let b = &report.backends[1];
    let mut run = toml::Table::new();
    run.insert("backend".into(), b.name.into());
    if b.tolerance.is_some() {
        run.insert("precision".into(), "f64".into());
        run.insert("tolerance".into(), TOLERANCE.into());
    }
    best.insert("run".into(), run.into());
    let head = format!(
        "# Best design of {} by objective = \"{}\" ({} evaluations, ended by {}). {}\n# [run] as the search computed it: sweep gives the same figures.\n",
        spec.name,
        search.objective.word(),
        report.evaluations,
        report.ended.word(),
        why(&spec.study.setup, search, report),
    );
    Ok(head + &toml::to_string(&best).map_err(|e| fail(&e))?)
}

/// Number of drives in the first scan (nominal whisker only), and how many of them on each side of the best the next scan covers.
const FIRST: (usize, usize) = (65, 4);
/// Number of drives in each later scan, between the neighbours of the last best one, and number of these scans.
const NEXT: (usize, u32) = (9, 5);

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
    method: Method,
    (point, goal): (&Tuple, Goal),
) -> Result<Other, Error> {
    let theory = setup.estimate.theory.compared();
    let mut setup = setup.clone();
    setup.estimate.theory = theory;
    let mut scorer = Scorer::new(&setup, layout, search, method);
    scorer.evaluator.leaves = true;
    let mut best: Option<Tuple> = None;
    if let Some(v) = search.variables.iter().find(|v| v.quantity == Quantity::Column(Column::Drive)) {
        let between = |ends: [f64; 2], n: usize| -> Vec<f64> {
            let share = |i: usize| i as f64 / (n - 1) as f64;
            (0..n).map(|i| ends[0] * (ends[1] / ends[0]).powf(share(i))).collect()
        };
        let around = |drives: &[f64], at: usize, by: usize| {
            [drives[at.saturating_sub(by)], drives[(at + by).min(drives.len() - 1)]]
        };
        let drives = between([v.min, v.max], FIRST.0);
        let scores = scorer.nominal(&taps(point, &drives), &|| true)?;
        let mut ends = least(&scores, goal).map(|at| around(&drives, at, FIRST.1));
        for _ in 0..NEXT.1 {
            let Some(these) = ends else { break };
            let drives = between(these, NEXT.0);
            let scores = scorer.scores(&taps(point, &drives))?;
            let at = least(&scores, goal);
            best = at.map(|at| Tuple { drive: drives[at], ..*point }).or(best);
            ends = at.map(|at| around(&drives, at, 1));
        }
    } else if layout.n_drives > 1 {
        let drives: Vec<f64> = (0..layout.n_drives).map(|j| layout.drive(point, j)).collect();
        let scores = scorer.scores(&taps(point, &drives))?;
        best = least(&scores, goal).map(|at| Tuple { drive: drives[at], ..*point });
    }
    let mut design = |point: Tuple| {
        let score = scorer.scores(&[point])?[0];
        scorer.design(Found { point, score })
    };
    Ok(Other { theory, here: design(*point)?, best: best.map(design).transpose()? })
}

fn taps(point: &Tuple, drives: &[f64]) -> Vec<Tuple> {
    drives.iter().map(|&drive| Tuple { drive, ..*point }).collect()
}

fn least(scores: &[Score], goal: Goal) -> Option<usize> {
    let allowed = (0..scores.len()).filter(|&i| goal.feasible(&scores[i]));
    allowed.min_by(|&i, &j| goal.value(&scores[i]).total_cmp(&goal.value(&scores[j])))
}
