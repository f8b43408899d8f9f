//! One side learned: its rows, the end stop of its sensor, the rows that the others do not expect.

use std::sync::Arc;

use vibrissa_learned::base::Base;
use vibrissa_learned::fit::{Fault, Fit};
use vibrissa_learned::rows::{Row, quantum};
use vibrissa_learned::suspects::{Suspect, sound};

use super::Reason;
use crate::error::{Error, InputError};
use crate::estimator::learnt::Learnt;
use crate::estimator::model::exact::Exact;
use crate::estimator::taps::{Tap, ZeroReading};
use crate::measure::group::rounding;
use crate::measure::{Data, Rig};

/// Readings at an end stop fall short of what is expected by so many standard deviations.
const SHORT: f64 = 4.0;
/// A label that explains a row leaves no more than this share of its signal.
const CLOSE: f64 = 0.03;
/// Evidence, in ln, from which a drift that no zero reading shows is believed.
const DRIFTS: f64 = 5.0;
/// Zero readings apart from each other from which their drift is looked for.
const APART: usize = 3;
/// A value is no reading like the others beyond so many times what three quarters of them are off their middle.
const WILD: f64 = 1e3;
/// Most rows of which a drift without zero readings is looked for.
const FEW: usize = 600;

/// What is learned from.
pub struct Ask<'a> {
    /// The file.
    pub data: &'a Data,
    /// The whisker.
    pub rig: &'a Rig,
    /// Every row with a drive.
    pub taps: &'a [Tap],
    /// Every row without contact.
    pub zeros: &'a [ZeroReading],
    /// Mean of the zero readings, or what taps of both sides tell.
    pub mean: f64,
    /// Standard error of the latter; infinite where they tell nothing.
    pub zero_error: f64,
    /// Sign of the signals of this side; all taps where the zero was not read.
    pub sign: f64,
    /// Whether taps of the other sign are of this side too.
    pub all: bool,
    /// The whisker's model, where it is known.
    pub exact: Option<Exact>,
}

/// A side that was learned.
pub struct Side {
    /// What is known of it.
    pub of: Learnt,
    /// Taps that are not used, and why.
    pub reasons: Vec<(usize, Reason)>,
    /// Places in the file of zero readings that are not used.
    pub wrong_zeros: Vec<usize>,
}

/// Learns one side.
///
/// # Errors
/// Rows that no curve follows.
pub fn side(ask: &Ask<'_>) -> Result<Side, Error> {
    let factor = ask.rig.setup.gauge.factor;
    let above = |raw: f64| ask.sign * ask.data.unit.above(raw, ask.mean, factor);
    let mut of = (Vec::new(), Vec::new(), Vec::new());
    let mut recorded = Vec::new();
    let mut add = |place: usize, raw: f64, u: f64, tap: Option<usize>| {
        let row = &ask.data.rows[place];
        of.0.push(Row { a: row.a, u, y: above(raw), run: row.run, t: row.t });
        of.1.push(tap);
        of.2.push(place);
        recorded.push([row.value, above(raw)]);
    };
    for z in ask.zeros.iter().filter(|z| z.reason.is_none()) {
        add(z.place, z.signal, 0.0, None);
    }
    for (k, t) in ask.taps.iter().enumerate() {
        if t.reason.is_none() && (ask.all || t.signal.signum() == ask.sign) {
            add(t.place, t.raw, t.drive, Some(k));
        }
    }
    let (rows, taps, lines) = of;
    let zero_read = taps.iter().any(Option::is_none);
    let mut runs: Vec<usize> = rows.iter().map(|r| r.run).collect();
    runs.sort_unstable();
    runs.dedup();
    let places_of_zeros = ask.zeros.iter().map(|z| z.place).collect::<Vec<_>>();
    let apart = 1 + places_of_zeros.windows(2).filter(|w| w[1] > w[0] + 1).count();
    let usual = usual(&recorded);
    let step = quantum(&usual.iter().map(|r| r[0]).collect::<Vec<_>>()) * scale(&usual);
    let drift = zero_read && apart >= APART && apart > runs.len();
    // Taps that the model does not reach, or only just, are no taps of this whisker; of most of them it is no base.
    let known =
        |exact: &Exact, a: f64, u: f64| exact.expected(a, u) > 0.0 && exact.expected(a, u).is_finite();
    let reached = |exact: &Exact, r: &Row| {
        !r.touches()
            || [0.998, 1.0, 1.002].iter().all(|f| known(exact, r.a * f, r.u) && known(exact, r.a, r.u * f))
    };
    let missed = |exact: &Exact| rows.iter().filter(|r| !reached(exact, r)).count();
    let exact = ask.exact.clone().filter(|exact| 10 * missed(exact) <= rows.len());
    let all: Vec<usize> =
        (0..rows.len()).filter(|k| exact.as_ref().is_none_or(|exact| reached(exact, &rows[*k]))).collect();
    let mut learnt = Learnt {
        rows,
        taps,
        lines,
        sign: ask.sign,
        places: all,
        fit: Arc::new(Fit::empty()),
        exact,
        step,
        drift,
        runs: runs.len(),
        zero_read,
        subtracted: 0.0,
        zero_known: zero_read || ask.zero_error.is_finite(),
        zero_error: ask.zero_error,
    };
    let no_curve = |why: Fault| nothing(ask, why);
    let mut reasons = Vec::new();
    let stopped = end_stop(&learnt, ask).map_err(no_curve)?;
    if !stopped.is_empty() {
        learnt.places.retain(|k| !stopped.contains(k));
        reasons.extend(stopped.iter().filter_map(|k| Some((learnt.taps[*k]?, Reason::Saturated))));
    }
    let places = learnt.places.clone();
    let (mut fitted, mut suspects) = learnt.task(|task| sound(task, &places, true)).map_err(no_curve)?;
    let wanders =
        !zero_read && learnt.rows.len() <= FEW && (learnt.exact.is_some() || repeated(&learnt.rows));
    if wanders {
        let moving = Learnt { drift: true, ..learnt.clone() };
        if let Ok((other, of)) = moving.task(|task| sound(task, &places, true))
            && of.len() <= suspects.len()
            && other.evidence > fitted.evidence + DRIFTS
        {
            (fitted, suspects, learnt) = (other, of, moving);
        }
    }
    learnt.places.retain(|k| !suspects.iter().any(|s| s.place == *k));
    let mut wrong_zeros = Vec::new();
    for s in &suspects {
        match learnt.taps[s.place] {
            Some(tap) => reasons.push((tap, explain(&learnt, &fitted, s))),
            None => wrong_zeros
                .push(ask.zeros.iter().filter(|z| z.reason.is_none()).nth(s.place).map_or(0, |z| z.place)),
        }
    }
    learnt.fit = Arc::new(fitted);
    Ok(Side { of: learnt, reasons, wrong_zeros })
}

/// Those of the `recorded` values of which none is [`WILD`]: a row in another unit, so large that steps of the others are nothing beside it, says nothing of
/// the converter.
fn usual(recorded: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let middle = crate::reduce::median(&mut recorded.iter().map(|r| r[0]).collect::<Vec<_>>());
    let mut off: Vec<f64> = recorded.iter().map(|r| (r[0] - middle).abs()).collect();
    off.sort_by(f64::total_cmp);
    let most = WILD * off.get(3 * off.len() / 4).copied().unwrap_or(f64::INFINITY);
    recorded.iter().copied().filter(|r| most == 0.0 || (r[0] - middle).abs() <= most).collect()
}

/// Signal per recorded value.
fn scale(recorded: &[[f64; 2]]) -> f64 {
    let range = |k: usize| {
        let all = recorded.iter().map(|r| r[k]).filter(|x| x.is_finite());
        let [lo, hi] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
        hi - lo
    };
    if range(0) > 0.0 { range(1) / range(0) } else { 0.0 }
}

/// Whether a distance and a drive were tapped twice, with others between: only then a drift is no curve.
fn repeated(rows: &[Row]) -> bool {
    let mut last = std::collections::HashMap::new();
    let again = |(k, r): (usize, &Row)| {
        last.insert([r.a.to_bits(), r.u.to_bits()], k).is_some_and(|before| k > before + 1)
    };
    rows.iter().enumerate().map(again).filter(|x| *x).count() >= 5
}

/// Why nothing can be learned.
fn nothing(ask: &Ask<'_>, why: Fault) -> Error {
    let (message, allowed) = match why {
        Fault::OnePosition => {
            ("all usable taps are at one distance: a calibration needs two or more", "two distances or more")
        }
        Fault::NoCurve | Fault::Overflow => (
            "the signal does not grow with the drive and fall with the distance: no curve of a whisker is in these data",
            "taps of which larger drives give larger signals; are the columns swapped?",
        ),
    };
    InputError::new(message).at(&ask.data.file, None).key("a_mm").allowed(allowed).into()
}

/// Rows at the end stop of the sensor: those of the most extreme reading, where those below it expect more in two cells or more.
fn end_stop(learnt: &Learnt, ask: &Ask<'_>) -> Result<Vec<usize>, Fault> {
    let value = |k: usize| learnt.taps[k].map_or(f64::NEG_INFINITY, |t| ask.sign * ask.taps[t].value);
    let largest = (0..learnt.rows.len()).map(value).fold(f64::NEG_INFINITY, f64::max);
    let at_end = |k: &usize| largest - value(*k) <= rounding(largest.abs());
    let (ends, below): (Vec<usize>, Vec<usize>) = learnt.places.iter().partition(|k| at_end(k));
    let label = |k: &usize| [learnt.rows[*k].a.to_bits(), learnt.rows[*k].u.to_bits()];
    if ends.windows(2).all(|w| label(&w[0]) == label(&w[1])) {
        return Ok(Vec::new());
    }
    let Ok((fitted, _)) = learnt.task(|task| sound(task, &below, true)) else { return Ok(Vec::new()) };
    let short = |k: &&usize| {
        let row = &learnt.rows[**k];
        let e =
            learnt.task(|task| fitted.base(task, |base| fitted.curve.expected(base, row.a, row.u, false)));
        let sd = (e.of_noise + e.of_curve + e.of_position + e.of_run).sqrt();
        e.signal + fitted.curve.zero - row.y > SHORT * sd
    };
    let beyond: std::collections::BTreeSet<_> = ends.iter().filter(short).map(label).collect();
    Ok(if beyond.len() >= 2 { ends } else { Vec::new() })
}

/// What a row that is not expected most likely is.
fn explain(learnt: &Learnt, fitted: &Fit, suspect: &Suspect) -> Reason {
    let row = &learnt.rows[suspect.place];
    let signal = suspect.expected + suspect.off;
    let share = suspect.off / suspect.expected;
    let decade = (signal / suspect.expected).abs().log10();
    if (decade.abs() - 6.0).abs() < 0.5 || (decade.abs() - 3.0).abs() < 0.3 {
        return Reason::Unit(decade.round() as i32);
    }
    let distinct = |f: fn(&Row) -> f64| {
        let mut all: Vec<f64> =
            learnt.places.iter().map(|k| &learnt.rows[*k]).filter(|r| r.touches()).map(f).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let explained = |base: &Base<'_>| {
        let miss = |a: f64, u: f64| (fitted.curve.expected(base, a, u, true).signal / signal - 1.0).abs();
        let of_a = distinct(|r| r.a).into_iter().map(|a| (miss(a, row.u), Reason::LooksLikeDistance(a)));
        let of_u = distinct(|r| r.u).into_iter().map(|u| (miss(row.a, u), Reason::LooksLikeDrive(u)));
        let best = of_a.chain(of_u).min_by(|x, y| x.0.total_cmp(&y.0));
        best.filter(|(miss, _)| *miss < CLOSE).map_or(Reason::Off(share), |(_, reason)| reason)
    };
    learnt.task(|task| fitted.base(task, explained))
}
