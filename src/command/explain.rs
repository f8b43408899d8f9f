//! `vibrissa sweep SPEC.toml --explain`: what each effect changes, as a table or as JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::aligned::{aligned, header};
use super::{Context, Reply, where_and_why};
use crate::backend::Choice;
use crate::census::explain::{Change, Explained, Explanation, Verdict, explain};
use crate::census::tap_json;
use crate::error::{Error, InputError};
use crate::scene::{BackendChoice, Drive, Precision, RunOptions, Spec};

/// Tolerances judged where none is given.
const LEAVE_OFF: [f64; 3] = [1e-4, 1e-3, 1e-2];

/// Explains `spec`; `leave_off` as typed. Few taps: in f64 on the CPU unless something else is asked for.
pub fn run(
    spec: &Spec,
    options: &RunOptions,
    leave_off: &[f64],
    context: &Context<'_>,
) -> Result<Reply, Error> {
    if spec.study.setup.rigs.is_some() {
        let error = InputError::new("what each effect changes is said of one rig").key("--explain");
        return Err(error.allowed("one number each").into());
    }
    let free = matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none();
    let options = if free {
        let precision = options.precision.or(Some(Precision::F64));
        RunOptions { backend: Some(BackendChoice::Cpu), precision, ..options.clone() }
    } else {
        options.clone()
    };
    let mut choice = Choice::new(&options)?;
    if free {
        choice.backend.reason = "few taps".into();
    }
    let tolerances = tolerances(leave_off, choice.backend.tolerance.unwrap_or(0.0))?;
    let found = explain(&spec.study, &choice, &tolerances)?;
    Ok(Reply {
        text: text(spec, &choice, &found),
        counts: json!({ "taps": found.total, "taps_compared": found.taps }),
        seconds: context.seconds(),
        backend: json!(choice.backend),
        result: result(spec.study.setup.drive, &found),
        quiet: context.is_quiet(),
        ..Reply::default()
    })
}

/// Ascending, each in range and above the error of a comparison of two taps of this accuracy.
fn tolerances(typed: &[f64], accuracy: f64) -> Result<Vec<f64>, InputError> {
    let mut wanted = if typed.is_empty() {
        LEAVE_OFF.into_iter().filter(|t| *t >= 2.0 * accuracy).collect()
    } else {
        typed.to_vec()
    };
    if let Some(bad) = wanted.iter().find(|t| !(**t > 0.0 && **t < 1.0 && **t >= 2.0 * accuracy)) {
        let error = InputError::new("effects cannot be judged at this tolerance").key("--leave-off");
        let allowed = format!("0 < E < 1, and at least twice --tolerance, {accuracy:e}");
        return Err(error.value(bad).allowed(allowed));
    }
    wanted.sort_by(f64::total_cmp);
    wanted.dedup();
    Ok(wanted)
}

/// Percent with three digits.
fn percent(x: f64) -> String {
    let size = x.abs();
    match size {
        0.0 => "0".into(),
        _ if size >= 99.95 => format!("{x:+.0}"),
        _ if size >= 9.995 => format!("{x:+.1}"),
        _ if size >= 0.9995 => format!("{x:+.2}"),
        _ if size >= 0.01 => format!("{x:+.3}"),
        _ => format!("{x:+.1e}"),
    }
}

fn row(e: &Explained, found: &Explanation) -> Vec<String> {
    let mut row = vec![e.effect.name().to_owned(), e.spec.clone(), e.instead.clone()];
    let mut notes = Vec::new();
    match (&e.change, &e.both) {
        (Some(change), Ok(both)) => {
            row.extend(numbers(change));
            let at = found.verdicts.iter().find(|v| v.effects.contains(&e.effect));
            let least = at.map_or_else(|| "no".into(), |v| format!("at {:e}", v.tolerance));
            row.push(if e.on == Some(true) { least } else { String::new() });
            let both: Vec<String> = both.iter().map(|(name, value)| format!("{name} {value}")).collect();
            notes.extend((!both.is_empty()).then(|| format!("both with {}", both.join(", "))));
            let unmatched = || format!("unmatched taps: {} {}", change.unmatched, change.unmatched_status);
            notes.extend((change.unmatched > 0).then(unmatched));
        }
        (_, Err(why)) => notes.push(format!("not compared: {why}")),
        (None, Ok(_)) => notes.push("no tap to compare".into()),
    }
    row.resize(12, String::new());
    row.push(notes.join("; "));
    row
}

/// Median, largest, where it is, what is left, taps.
fn numbers(c: &Change) -> Vec<String> {
    let short = |x: f64| format!("{}", (x * 1e4).round() / 1e4);
    let left = c.left.map_or(String::new(), |l| percent(l).trim_start_matches('+').to_owned());
    let at = [c.at.D, c.at.d, c.at.a, c.at.drive].map(short);
    let mut cells = vec![percent(c.median), percent(c.largest)];
    cells.extend(at);
    cells.extend([left, c.taps.to_string()]);
    cells
}

fn text(spec: &Spec, choice: &Choice, found: &Explanation) -> String {
    let mut text = String::new();
    let part = if found.taps as u64 == found.total { "all" } else { "spread over" };
    let (name, on) = (&spec.name, where_and_why(&choice.backend));
    let Explanation { taps, total, .. } = found;
    let _ = writeln!(
        text,
        "{name}: what each effect changes, in % of strain; {taps} taps ({part} {total}), {on}"
    );
    let drive = spec.study.setup.drive.column();
    let names = format!(
        "effect,spec,instead,median,largest,at D_mm,d_tip_mm,a_mm,{drive},calibrated,taps,leave off,"
    );
    let mut rows = vec![header(&names)];
    rows.extend(found.effects.iter().map(|e| row(e, found)));
    if let Some(change) = &found.linear {
        let mut row = vec!["all effects".to_owned(), "as above".into(), "linear theory".into()];
        row.extend(numbers(change));
        rows.push(row);
    }
    text += &aligned(&rows, &[0, 1, 2, 12]);
    text += "median, largest: change of |strain| when the effect alone is switched from `spec` to `instead`.\n\
             calibrated: what is left after calibration, the relative SD over the distances of a design and drive; worst row.\n";
    for v in &found.verdicts {
        let which = v.together.map_or("nothing".to_owned(), |c| {
            let names: Vec<&str> = v.effects.iter().map(|e| e.name()).collect();
            names.join(", ")
                + &match v.effects.len() {
                    1 => String::new(),
                    _ if c.within(v.tolerance) => format!(" (together {} %)", percent(c.largest)),
                    _ => format!(" (each alone; together {} %, too much)", percent(c.largest)),
                }
        });
        let _ = writeln!(text, "could be left off at {:e}: {which}", v.tolerance);
    }
    text
}

fn changed(drive: Drive, change: Option<&Change>) -> Value {
    change.map_or(Value::Null, |c| {
        json!({
            "median_percent": c.median, "largest_percent": c.largest, "at": tap_json(drive, &c.at), "calibrated_sd_percent": c.left,
            "taps": c.taps, "unmatched": c.unmatched,
            "unmatched_status": c.unmatched_status.to_string(),
        })
    })
}

fn result(drive: Drive, found: &Explanation) -> Value {
    let effect = |e: &Explained| {
        let both = e.both.iter().flatten().map(|(name, value)| json!({ "effect": name, "value": value }));
        json!({
            "effect": e.effect.name(),
            "key": e.effect.key(),
            "on": e.on,
            "spec": e.spec,
            "instead": e.both.is_ok().then_some(&e.instead),
            "both_with": both.collect::<Vec<_>>(),
            "not_compared": e.both.as_ref().err(),
            "change": changed(drive, e.change.as_ref()),
        })
    };
    let verdict = |v: &Verdict| {
        json!({
            "tolerance": v.tolerance,
            "effects": v.effects.iter().map(|e| e.name()).collect::<Vec<_>>(),
            "together": changed(drive, v.together.as_ref()),
        })
    };
    json!({
        "effects": found.effects.iter().map(effect).collect::<Vec<_>>(),
        "all_effects": changed(drive, found.linear.as_ref()),
        "leave_off": found.verdicts.iter().map(verdict).collect::<Vec<_>>(),
    })
}
