//! `vibrissa sweep SPEC.toml --explain`: what each effect changes, as a table or as JSON.

use serde_json::json;

use super::reply::aligned;
use super::{Context, Reply, where_and_why};
use crate::backend::Choice;
use crate::census::At;
use crate::census::explain::{Change, Explained, Explanation, explain};
use crate::error::{Error, InputError};
use crate::scene::{BackendChoice, RunOptions, Spec};
use crate::tap::few;

/// Explains `spec`. Few taps: in f64 on the CPU unless something else is asked for.
pub fn run(spec: &Spec, options: &RunOptions, context: &Context<'_>) -> Result<Reply, Error> {
    if let Some(rigs) = &spec.study.setup.rigs {
        let why =
            format!("what each effect changes is said of one rig, and {} have several values", rigs.names());
        return Err(InputError::new(why).key("--explain").allowed("one number each").into());
    }
    let free = matches!(options.backend, None | Some(BackendChoice::Auto)) && options.adapter.is_none();
    let choice = if free { few(options) } else { Choice::new(options) }?;
    let found = explain(&spec.study, &choice)?;
    let text = text(spec, &choice, &found);
    let counts = json!({ "taps": found.total, "taps_compared": found.taps });
    let (seconds, backend, result) = (context.seconds(), json!(choice.backend), json!(found));
    Ok(Reply { text, counts, seconds, backend, result, quiet: context.is_quiet(), ..Reply::default() })
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

fn row(e: &Explained) -> Vec<String> {
    let mut row = vec![e.effect.name().to_owned(), e.spec.clone(), e.instead.clone().unwrap_or_default()];
    let mut notes: Vec<String> = e.not_compared.iter().map(|why| format!("not compared: {why}")).collect();
    if let Some(change) = &e.change {
        row.extend(numbers(change));
        let both: Vec<String> =
            e.both_with.iter().map(|b| format!("{} {}", b.effect.name(), b.value)).collect();
        notes.extend((!both.is_empty()).then(|| format!("both with {}", both.join(", "))));
        let unmatched = || format!("unmatched taps: {} {}", change.unmatched, change.unmatched_status);
        notes.extend((change.unmatched > 0).then(unmatched));
    } else if notes.is_empty() {
        notes.push("no tap to compare".into());
    }
    row.resize(11, String::new());
    row.push(notes.join("; "));
    row
}

/// Median, largest, where it is, what is left, taps.
fn numbers(c: &Change) -> Vec<String> {
    let short = |x: f64| format!("{}", (x * 1e4).round() / 1e4);
    let left = c.left.map_or(String::new(), |l| percent(l).trim_start_matches('+').to_owned());
    let At(_, t) = c.at;
    let at = [t.D, t.d, t.a, t.drive].map(short);
    let mut cells = vec![percent(c.median), percent(c.largest)];
    cells.extend(at);
    cells.extend([left, c.taps.to_string()]);
    cells
}

fn text(spec: &Spec, choice: &Choice, found: &Explanation) -> String {
    let (name, drive, on) = (&spec.name, spec.study.setup.drive.column(), where_and_why(&choice.backend));
    let Explanation { taps, total, effects, all_effects } = found;
    let part = if *taps as u64 == *total { "all" } else { "spread over" };
    let names = format!("effect,spec,instead,median,largest,at D_mm,d_tip_mm,a_mm,{drive},calibrated,taps,");
    let together = all_effects.iter().map(|change| {
        let names = ["all effects", "as above", "linear theory"].map(str::to_owned);
        names.into_iter().chain(numbers(change)).collect()
    });
    format!(
        "{name}: what each effect changes, in % of strain; {taps} taps ({part} {total}), {on}\n{}\
         median, largest: change of |strain| when the effect alone is switched from `spec` to `instead`.\n\
         calibrated: what is left after calibration, the relative SD over the distances of a design and drive; worst row.\n\
         `--plan --model-error E` says which effects may be left off together for a strain within E.\n",
        aligned(&names, effects.iter().map(row).chain(together))
    )
}
