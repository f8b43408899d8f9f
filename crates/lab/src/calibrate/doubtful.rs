//! Data with too many suspect rows: likely causes, each tested by a fit.

use super::prepare::votes;
use super::{Calibrated, Options, Reason, check, named};
use crate::error::{Error, InputError};
use crate::measure::{Data, Rig, Row};
use crate::scene::Drive;

/// Largest share of suspect rows, and number of them that is always allowed.
const MOST: f64 = 0.2;
const SLIPS: usize = 2;
const SEVERAL: usize = 20;
const FITS: f64 = 0.1;
const ROWS: f64 = 120.0;
/// Plausible K of a strain of a known whisker.
const K: std::ops::Range<f64> = 0.33..3.0;
/// Largest error on distances left out, relative to that of the best cause.
const WORSE: f64 = 5.0;

/// What may be wrong, what mends it, and how each row is read then, with the length of the whisker; `None` for another whisker.
type Change = (String, String, Option<fn(&mut Row, f64)>);

/// `found`, unless more than a fifth of its rows are suspect, or its signal grows with the distance and another reading of the columns explains it.
pub fn judged(
    found: Result<Calibrated, Error>,
    (data, rig, options): (&Data, &Rig, &Options),
    settle: impl Fn(&Data, &Rig, &Options) -> Result<Calibrated, Error>,
) -> Result<Calibrated, Error> {
    let size_votes = |of: &Calibrated, fixed| votes(&of.taps, fixed, |t| t.signal.abs());
    let grows = |of: &Calibrated| data.drive.is_some() && size_votes(of, 1) > 0.0;
    let unused = |of: &Calibrated| of.taps.iter().filter(|t| t.reason.is_some()).count() as f64;
    let is_turned =
        |of: &Calibrated| grows(of) && (size_votes(of, 0) < 0.0 || unused(of) > MOST * of.taps.len() as f64);
    let turned = found.as_ref().is_ok_and(is_turned);
    let suspicion = found.as_ref().ok().and_then(|of| suspicion(of, &data.file));
    let suspect = suspicion.is_some();
    let error = match &found {
        Ok(_) => suspicion.or_else(|| {
            let error = InputError::new("the signal grows with the distance");
            turned.then(|| error.at(&data.file, None).key("a_mm"))
        }),
        // A mismatch of data and whisker is already reported.
        Err(Error::Input(e)) => {
            let of_data = e.file.as_ref() == Some(&data.file) && check(data, rig, options).is_ok();
            of_data.then(|| e.clone())
        }
        Err(_) => None,
    };
    let Some(error) = error else { return found };
    let data = thinned(data);
    let mut fits: Vec<(f64, f64, Change)> = Vec::new();
    for change in changes(&data, rig) {
        let mut changed = data.clone();
        let length = rig.design.tuple.L_a;
        change.2.iter().for_each(|of| changed.rows.iter_mut().for_each(|row| of(row, length)));
        // Drive 0 is a zero reading: a column with such rows is a drive.
        let rests = |data: &Data| data.rows.iter().any(|row| row.drive == 0.0);
        if rests(&data) && !rests(&changed) {
            continue;
        }
        let without = Options { fit: Vec::new(), ..options.clone() };
        let tried = match change.2.is_none() || !rig.known {
            true => Rig::of_data(&changed, data.drive)
                .map_err(Error::from)
                .and_then(|(rig, _)| settle(&changed, &rig, &without)),
            false => settle(&changed, rig, options),
        };
        let Ok(tried) = tried else { continue };
        let (lines, of) = suspects(&tried);
        let share = lines.len() as f64 / of.max(1) as f64;
        let most = 2 * of > tried.taps.len();
        if most && share <= FITS && is_sound(&tried, &changed) && !grows(&tried) {
            fits.push((share, left_out(&tried), change));
        }
    }
    let least = fits.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
    fits.retain(|f| f.1 <= WORSE * least || !least.is_finite());
    fits.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
    if fits.is_empty() {
        if !suspect {
            return found;
        }
        let allowed = "what the columns hold; tried, and no better: columns exchanged, distances in centimetres, metres or inches or from the tip, a drive in \
                       radians (57.3) or centimetres, another whisker. With --whisker left out every row may be judged by the others";
        return Err(error.allowed(allowed).into());
    }
    let what =
        |(share, _, (what, ..)): &(f64, f64, Change)| format!("{what} ({:.0} % suspect)", 100.0 * share);
    let what: Vec<String> = fits.iter().take(3).map(what).collect();
    let message = format!("{}; they fit with {}", error.message, what.join(", or "));
    let allowed = [Some(fits[0].2.1.clone()), error.allowed.clone()];
    let allowed = allowed.into_iter().flatten().collect::<Vec<_>>().join("; ");
    Err(InputError { message, ..error }.allowed(allowed).into())
}

fn suspicion(found: &Calibrated, file: &str) -> Option<InputError> {
    let (lines, of) = suspects(found);
    if lines.len() as f64 <= MOST * of as f64 || lines.len() <= SLIPS {
        return None;
    }
    let (n, shown) = (lines.len(), named(&lines));
    let message =
        format!("{n} of {of} rows are suspect (lines {shown}): these are not taps as they are described");
    Some(InputError::new(message).at(file, lines.first().copied()).key("a_mm"))
}

fn suspects(found: &Calibrated) -> (Vec<usize>, usize) {
    use Reason::{Missing, NoStrain, NotANumber, OutsideDomain, Saturated, Tilted};
    let none =
        |r: &Reason| matches!(r, NotANumber | Missing(_) | Tilted | Saturated | OutsideDomain | NoStrain);
    let there = || found.taps.iter().filter(|t| !t.reason.as_ref().is_some_and(none));
    (there().filter(|t| t.reason.is_some()).map(|t| t.line).collect(), there().count())
}

fn left_out(found: &Calibrated) -> f64 {
    let of = |s: &super::SideResult| s.rms(found.winner).0.map_or(f64::INFINITY, |rms| rms / s.span());
    found.sides.iter().map(of).fold(0.0, f64::max)
}

fn is_sound(found: &Calibrated, data: &Data) -> bool {
    let rig = &found.calibration.rig;
    let known = rig.known && data.unit.is_absolute() && rig.setup.gauge.foil.is_none();
    !known || found.sides.iter().all(|s| s.mean_k().is_none_or(|k| K.contains(&k)))
}

fn thinned(data: &Data) -> Data {
    let share = ROWS / data.rows.len() as f64;
    let taken =
        |place: usize| (place as u32).wrapping_mul(2_654_435_761) as f64 <= share * f64::from(u32::MAX);
    let mut thin = data.clone();
    if share < 1.0 {
        let mut places = 0..data.rows.len();
        thin.rows.retain(|_| places.next().is_some_and(taken));
        let mut places = 0..data.rows.len();
        thin.beside.values.retain(|_| places.next().is_some_and(taken));
        thin.missing.clear();
    }
    thin
}

fn changes(data: &Data, rig: &Rig) -> Vec<Change> {
    let (signal, drive) = (data.unit.column(), rig.setup.drive.column());
    let (driven, turns) = (data.drive.is_some(), rig.setup.drive == Drive::Angle);
    let short = if turns { "theta" } else { "delta" };
    let mut all: Vec<Change> = Vec::new();
    let mut add = |may: bool, what: &str, mends: String, row: fn(&mut Row, f64)| {
        all.extend(may.then(|| (what.to_owned(), mends, Some(row))));
    };
    let exchanged = |p: &str, q: &str| format!("{p} and {q} exchanged");
    let names = |how: &str| format!("the names of the columns as they are, {how}");
    let mm = |what: &str, factor: &str| format!("{what} in mm: these times {factor}");
    let mends = format!("--columns 'a={drive},{short}=a_mm'");
    add(driven, &exchanged("a_mm", drive), mends, |r, _| (r.a, r.drive) = (r.drive, r.a));
    let mends = names(&format!("{drive} and {signal} the other way round"));
    add(driven, &exchanged(drive, signal), mends, |r, _| (r.drive, r.value) = (r.value, r.drive));
    let mends = names("which are all in another order");
    let what = format!("the drive in the column a_mm, the signal in {drive}, the distance in {signal}");
    add(driven, &what, mends.clone(), |r, _| (r.drive, r.value, r.a) = (r.a, r.drive, r.value));
    let what = format!("the signal in the column a_mm, the distance in {drive}, the drive in {signal}");
    add(driven, &what, mends, |r, _| (r.value, r.a, r.drive) = (r.a, r.drive, r.value));
    let mends = format!("{drive} in degrees: radians times 57.3");
    let radians = driven && turns;
    add(radians, "the drive in radians, times 57.3", mends, |r, _| r.drive = r.drive.to_degrees());
    let moved = driven && !turns;
    add(moved, "the drive in centimetres", mm(drive, "10"), |r, _| r.drive *= 10.0);
    let mends = mm("both", "10");
    add(moved, "drive and distance in centimetres", mends, |r, _| {
        (r.a, r.drive) = (10.0 * r.a, 10.0 * r.drive)
    });
    add(moved, "drive and distance in metres", mm("both", "1000"), |r, _| {
        (r.a, r.drive) = (1000.0 * r.a, 1000.0 * r.drive);
    });
    let mends = names(&format!("a_mm and {signal} the other way round"));
    add(true, &exchanged("a_mm", signal), mends, |r, _| (r.a, r.value) = (r.value, r.a));
    add(true, "distances in centimetres", mm("a_mm", "10"), |r, _| r.a *= 10.0);
    add(true, "distances in metres", mm("a_mm", "1000"), |r, _| r.a *= 1000.0);
    add(true, "distances in inches", mm("a_mm", "25.4"), |r, _| r.a *= 25.4);
    let mends = "a_mm from the base, as the spec has it".to_owned();
    add(rig.known, "distances from the tip of the whisker", mends, |r, length| r.a = length - r.a);
    let other = ["another whisker than that of the spec", "the whisker that was measured; or no --whisker"];
    let [what, mends] = other.map(str::to_owned);
    all.extend((rig.known && data.rows.len() >= SEVERAL).then_some((what, mends, None)));
    all
}
