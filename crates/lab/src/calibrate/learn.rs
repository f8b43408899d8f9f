//! Statistical model of one side: its rows, the end stop of the sensor, suspect rows; and what it says of the rig.

use std::{collections::BTreeSet, sync::Arc};

use crate::reduce::{distinct, range, sorted};
use serde::Serialize;
use serde_json::{Value, json};
use vibrissa_learned::columns::Term;
use vibrissa_learned::fit::{Fault, Fit, Task};
use vibrissa_learned::rows::{Row, quantum};
use vibrissa_learned::suspects::{Suspect, sound};

use super::Reason;
use crate::error::{Error, InputError};
use crate::estimator::learned::{EVERYWHERE, Learnt, whisker};
use crate::estimator::{Exact, Parameter, taps::Sorted, taps::Tap};
use crate::measure::{Data, group::rounding};
use crate::scene::Drive;

/// Standard deviations by which readings at an end stop are below the expected ones.
const SHORT: f64 = 4.0;
/// Another label explains a row if the signal expected there is within this share.
const CLOSE: f64 = 0.03;
/// Least gain in ln evidence for a drift without zero readings.
const DRIFTS: f64 = 5.0;
const APART: usize = 3;
/// A value in another unit deviates from the median by more than this multiple of the third quartile.
const WILD: f64 = 1e3;
const FEW: usize = 600;

/// Model of the side of this `sign`, of `all` taps where there is no other side. `zero_error`: standard error of a zero from taps of both sides, else
/// infinite.
pub fn side(
    (data, factor): (&Data, f64),
    sorted: &mut Sorted,
    (sign, all): (f64, bool),
    exact: Option<Exact>,
    zero_error: f64,
) -> Result<Learnt, Error> {
    let above = |raw: f64| sign * data.unit.above(raw, sorted.tared.value, factor);
    let row = |(place, raw, u, tap): (usize, f64, f64, Option<usize>)| {
        let (row, y) = (&data.rows[place], above(raw));
        (Row { a: row.a, u, y, run: row.run, t: row.t }, (tap, (place, [row.value, y])))
    };
    let zeros = sorted.zeros.iter().filter(|z| z.reason.is_none());
    let zeros = zeros.map(|z| (z.place, z.signal, 0.0, None));
    let here = |t: &Tap| t.reason.is_none() && (all || t.signal.signum() == sign);
    let of_side = sorted.taps.iter().enumerate().filter(|(_, t)| here(t));
    let all = zeros.chain(of_side.map(|(k, t)| (t.place, t.raw, t.drive, Some(k)))).map(row);
    let (rows, (taps, (lines, recorded))): (Vec<_>, (Vec<_>, (Vec<_>, Vec<_>))) = all.unzip();
    let zero_read = taps.iter().any(Option::is_none);
    let runs: BTreeSet<usize> = rows.iter().map(|r| r.run).collect();
    let apart = 1 + sorted.zeros.windows(2).filter(|w| w[1].place > w[0].place + 1).count();
    let usual = usual(&recorded);
    let width = |k: usize| {
        let [lo, hi] = range(usual.iter().map(|r| r[k]).filter(|x| x.is_finite()));
        hi - lo
    };
    let scale = if width(0) > 0.0 { width(1) / width(0) } else { 0.0 };
    let step = quantum(&usual.iter().map(|r| r[0]).collect::<Vec<_>>()) * scale;
    let drift = zero_read && apart >= APART && apart > runs.len();
    // Taps beyond or near the limit of the model are not of this whisker; if they are many, the model is not used.
    let known =
        |exact: &Exact, a: f64, u: f64| exact.expected(a, u) > 0.0 && exact.expected(a, u).is_finite();
    let reached = |exact: &Exact, r: &Row| {
        !r.touches()
            || [0.998, 1.0, 1.002].iter().all(|f| known(exact, r.a * f, r.u) && known(exact, r.a, r.u * f))
    };
    let missed = |exact: &Exact| rows.iter().filter(|r| !reached(exact, r)).count();
    let exact = exact.filter(|exact| 10 * missed(exact) <= rows.len());
    let mut places: Vec<usize> =
        (0..rows.len()).filter(|k| exact.as_ref().is_none_or(|exact| reached(exact, &rows[*k]))).collect();
    let (known, reach) = exact.map(whisker).map_or((None, EVERYWHERE), |(known, reach)| (Some(known), reach));
    let mut task = Task { rows, known, step, zero: zero_error, drift };
    let no_curve = |why: Fault| nothing(&data.file, why);
    let value = |k: &usize| taps[*k].map_or(f64::NEG_INFINITY, |t| sign * sorted.taps[t].value);
    let stopped = end_stop(&task, &places, value);
    places.retain(|k| !stopped.contains(k));
    let (mut fit, mut suspects) = sound(&task, &places).map_err(no_curve)?;
    if !zero_read && task.rows.len() <= FEW && (task.known.is_some() || repeated(&task.rows)) {
        let moving = Task { drift: true, ..task.clone() };
        if let Ok((other, of)) = sound(&moving, &places)
            && of.len() <= suspects.len()
            && other.evidence > fit.evidence + DRIFTS
        {
            (fit, suspects, task) = (other, of, moving);
        }
    }
    places.retain(|k| !suspects.iter().any(|s| s.place == *k));
    for k in stopped.into_iter().filter_map(|k| taps[k]) {
        sorted.taps[k].reason = Some(Reason::Saturated);
    }
    for s in &suspects {
        match taps[s.place] {
            Some(tap) => sorted.taps[tap].reason = Some(explain(&task, &places, &fit, s)),
            None => {
                let of_row = sorted.zeros.iter_mut().filter(|z| z.place == lines[s.place]);
                of_row.for_each(|z| z.reason = Some(Reason::ZeroOutlier));
            }
        }
    }
    let (fit, runs, zero_known) = (Arc::new(fit), runs.len(), zero_read || zero_error.is_finite());
    Ok(Learnt { task, reach, taps, lines, sign, places, fit, runs, zero_read, zero_known, subtracted: 0.0 })
}

/// Recorded values without those in another unit, which would hide the steps of the converter.
fn usual(recorded: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let middle = crate::reduce::median(&mut recorded.iter().map(|r| r[0]).collect::<Vec<_>>());
    let off = sorted(recorded.iter().map(|r| (r[0] - middle).abs()));
    let most = WILD * off.get(3 * off.len() / 4).copied().unwrap_or(f64::INFINITY);
    recorded.iter().copied().filter(|r| most == 0.0 || (r[0] - middle).abs() <= most).collect()
}

/// True if taps were repeated with others between: otherwise drift and curve are indistinguishable.
fn repeated(rows: &[Row]) -> bool {
    let mut last = std::collections::HashMap::new();
    let again = |(k, r): (usize, &Row)| {
        last.insert([r.a.to_bits(), r.u.to_bits()], k).is_some_and(|before| k > before + 1)
    };
    rows.iter().enumerate().map(again).filter(|x| *x).count() >= 5
}

fn nothing(file: &str, why: Fault) -> Error {
    let (message, allowed) = match why {
        Fault::OnePosition => {
            ("all usable taps are at one distance: a calibration needs two or more", "two distances or more")
        }
        Fault::NoCurve => (
            "the signal does not grow with the drive and fall with the distance: no curve of a whisker is in these data",
            "taps of which larger drives give larger signals; are the columns swapped?",
        ),
    };
    InputError::new(message).at(file, None).key("a_mm").allowed(allowed).into()
}

/// Rows at the end stop: those with the most extreme `value`, if the fit below it expects more in two cells at least.
fn end_stop(task: &Task, places: &[usize], value: impl Fn(&usize) -> f64) -> Vec<usize> {
    let largest = (0..task.rows.len()).map(|k| value(&k)).fold(f64::NEG_INFINITY, f64::max);
    let at_end = |k: &usize| largest - value(k) <= rounding(largest.abs());
    let (ends, below): (Vec<usize>, Vec<usize>) = places.iter().partition(|k| at_end(k));
    let label = |k: &usize| [task.rows[*k].a.to_bits(), task.rows[*k].u.to_bits()];
    if ends.windows(2).all(|w| label(&w[0]) == label(&w[1])) {
        return Vec::new();
    }
    let Ok((fitted, _)) = sound(task, &below) else { return Vec::new() };
    let short = |k: &&usize| {
        let row = &task.rows[**k];
        let e = fitted.curve.expected(&fitted.base, row.a, row.u, false);
        let sd = (e.of_noise + e.of_curve + e.of_position + e.of_run).sqrt();
        e.signal + fitted.curve.zero - row.y > SHORT * sd
    };
    let beyond: BTreeSet<_> = ends.iter().filter(short).map(label).collect();
    if beyond.len() >= 2 { ends } else { Vec::new() }
}

fn explain(task: &Task, places: &[usize], fitted: &Fit, suspect: &Suspect) -> Reason {
    let row = &task.rows[suspect.place];
    let signal = suspect.expected + suspect.off;
    let decade = (signal / suspect.expected).abs().log10();
    if (decade.abs() - 6.0).abs() < 0.5 || (decade.abs() - 3.0).abs() < 0.3 {
        return Reason::Unit(decade.round() as i32);
    }
    let distinct =
        |f: fn(&Row) -> f64| distinct(places.iter().map(|k| &task.rows[*k]).filter(|r| r.touches()).map(f));
    let miss = |a: f64, u: f64| (fitted.curve.expected(&fitted.base, a, u, true).signal / signal - 1.0).abs();
    let of_a = distinct(|r| r.a).into_iter().map(|a| (miss(a, row.u), Reason::LooksLikeDistance(a)));
    let of_u = distinct(|r| r.u).into_iter().map(|u| (miss(row.a, u), Reason::LooksLikeDrive(u)));
    let best = of_a.chain(of_u).min_by(|x, y| x.0.total_cmp(&y.0));
    let off = Reason::Off(suspect.off / suspect.expected);
    best.filter(|(miss, _)| *miss < CLOSE).map_or(off, |(_, reason)| reason)
}

const ALIKE: f64 = 0.95;

#[derive(Serialize)]
struct Number {
    #[serde(skip)]
    name: &'static str,
    value: f64,
    standard_error: f64,
    unit: &'static str,
    /// Tap that would separate it from the gain, if these data cannot.
    #[serde(skip)]
    alike: Option<&'static str>,
}

fn numbers(learnt: &Learnt, kind: Drive) -> Vec<Number> {
    let Fit { curve: c, base, .. } = &*learnt.fit;
    let place = |term| c.terms.iter().position(|t| *t == term);
    let product = |i: usize, k: usize| c.deviations.iter().map(|d| d[i] * d[k]).sum::<f64>();
    let known = learnt.task.known.is_some();
    let gain = place(Term::Curve(0, 0)).filter(|_| known);
    let correlated = |gain: usize, k: usize| {
        k != gain && product(gain, k).abs() > ALIKE * (product(gain, gain) * product(k, k)).sqrt()
    };
    let ([size_a, size_u], offset) = (c.scales.sizes, Parameter::DriveOffset);
    let (of_gain, of_drive) = ([c.unit / c.base_unit, 0.0], [size_u, base.offset()]);
    // Term, factor of its coefficient and what is added to it, unit, and the tap that tells it from the gain.
    let all = [
        ("gain", Term::Curve(0, 0), of_gain, "signal over that of the spec", ""),
        (offset.name(kind), Term::OffsetU, of_drive, offset.unit(kind), "taps at a drive half as large"),
        ("a_offset", Term::OffsetA, [size_a, 0.0], "mm", "taps nearer to the base"),
        ("zero", Term::Zero, [c.unit, c.zero], "signal", "zero readings"),
    ];
    let number = |(name, term, [scale, more], unit, tells): (_, _, [f64; 2], _, _)| {
        let [x, sd] = c.coefficient(term).filter(|_| known || term == Term::Zero)?;
        let alike = gain.zip(place(term)).is_some_and(|(gain, k)| correlated(gain, k)).then_some(tells);
        Some(Number { name, value: x * scale + more, standard_error: sd * scale, unit, alike })
    };
    all.into_iter().filter_map(number).collect()
}

/// Parts of σ in the middle of the data, as relative standard deviations of the signal.
fn budget(learnt: &Learnt) -> [(&'static str, f64); 4] {
    let Fit { curve, base, .. } = &*learnt.fit;
    let (a, u) = (curve.scales.a[0].exp(), curve.scales.u[0].exp() - curve.scales.offset);
    let e = curve.expected(base, a, u, true);
    let share = |variance: f64| (variance / (e.signal * e.signal)).sqrt();
    let parts =
        [("noise", e.of_noise), ("calibration", e.of_curve), ("position", e.of_position), ("run", e.of_run)];
    parts.map(|(name, variance)| (name, share(variance)))
}

pub fn json(learnt: &Learnt, kind: Drive) -> Value {
    let numbers = numbers(learnt, kind);
    let each: Value = numbers.iter().map(|n| (n.name, json!(n))).collect();
    let budget: Value = budget(learnt).into_iter().collect();
    let learned = learnt.fit.hypers.iter().zip(&learnt.fit.at);
    let learned: Value = learned.map(|(h, x)| (format!("{h:?}").to_lowercase(), x.exp())).collect();
    let alike = |n: &Number| Some(json!({ "gain_and": n.name, "tells": n.alike? }));
    let alike: Vec<Value> = numbers.iter().filter_map(alike).collect();
    json!({
        "numbers": each,
        "not_told_apart": alike,
        "runs": learnt.runs,
        "drift": learnt.task.drift,
        "share_of_signal": budget,
        "learned_numbers": learned,
    })
}

pub fn text(learnt: &Learnt, kind: Drive) -> Vec<String> {
    let numbers = numbers(learnt, kind);
    let told = numbers.iter().filter(|n| n.name != "zero" || !learnt.zero_read);
    let number = |Number { name, value, standard_error: sd, unit, .. }: &Number| {
        format!("learned {name:<13} {value:.6e} ± {:.1e} {unit}", 2.0 * sd)
    };
    let mut lines: Vec<String> = told.map(number).collect();
    let shares = budget(learnt).into_iter().filter(|(_, share)| *share > 0.0);
    let shares: Vec<String> = shares.map(|(name, share)| format!("{name} {:.2} %", 100.0 * share)).collect();
    lines.push(format!("σ of a reading in the middle, in shares of its signal: {}", shares.join(", ")));
    let alike =
        |n: &Number| Some(format!("these data cannot tell gain and {} apart: {} would", n.name, n.alike?));
    lines.extend(numbers.iter().filter_map(alike));
    let one =
        "one run: σ holds for it; a second (column run) would tell how zero and gain change between runs";
    lines.extend((learnt.runs < 2).then(|| one.to_owned()));
    lines
}
