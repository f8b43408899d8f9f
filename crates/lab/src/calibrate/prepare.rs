//! Preparation of rows: sorting, taring, grouping, separation of sides, suspects.

use vibrissa_learned::base::power;

use super::{Options, Reason, learn, zero};
use crate::error::{Error, InputError};
use crate::estimator::taps::{Sorted, Tap};
use crate::estimator::{Exact, Extent, Opener, SAME, learned::Learnt, parameter::spec_values};
use crate::fields::plain;
use crate::measure::{Data, Groups, Rig};
use crate::scene::{Drive, Side, Signal};

/// Least share of taps of the other sign that form a separate side.
const MINORITY: f64 = 0.1;
const LOST: f64 = 0.2;
/// A median strain above this is in another unit.
const ABSURD: f64 = 0.5;
/// An unread zero is subtracted if it exceeds this many standard errors.
const CERTAIN: f64 = 3.0;
/// It is unknown if its standard error exceeds this share of a typical signal.
const DETERMINED: f64 = 0.02;
/// A weak tap within this many standard deviations of the noise may have the wrong sign by chance.
const NOISY: f64 = 4.0;
const REPEATS: usize = 3;

pub struct Prepared {
    pub rows: Sorted,
    pub sides: Vec<(Side, Learnt)>,
    pub recorded: bool,
    /// Reason why the model of the spec cannot be fitted, if whisker and drives are known.
    pub no_exact: Option<String>,
}

pub fn prepare(
    data: &Data,
    rig: &mut Rig,
    options: &Options,
    open: Opener<'_>,
    warnings: &mut Vec<String>,
) -> Result<Prepared, Error> {
    let mut rows = crate::estimator::taps::taps(data, rig, options.drive, options.group);
    rig.before = rows.before;
    let rig = &*rig;
    warnings.extend(joined(&rows.groups, rig.setup.drive));
    if rows.tared.wraps {
        warnings.push(format!("{}: counts of 16 bits begin anew; they were joined", data.file));
    }
    if rows.origin != 0.0 {
        let (file, origin) = (&data.file, plain(rows.origin));
        warnings.push(format!(
            "{file}: there is contact at drives ≤ 0, and none up to {origin}: drives are counted from there, those of readings too"
        ));
    }
    absurd(data, &rows.taps)?;
    let recorded = data.drive.is_some() || options.drive.is_some();
    let read = rows.zero.count > 0;
    let between = if read { None } else { zero::between(data, &rows.taps) };
    if let Some(found) = between {
        zero::tare((data, rig), &mut rows, found);
    }
    let known = read || between.is_some();
    let rests: Vec<f64> = rows.zeros.iter().filter(|z| z.reason.is_none()).map(|z| z.signal).collect();
    let signs = signs(data, &mut rows.taps, &rests, [known, rig.known])?;
    let mut no_exact = None;
    let mut sides = Vec::new();
    for &sign in &signs {
        let gauge = gauge_side(data, rig, sign, signs[0]);
        let mut exact = None;
        if recorded && rig.known && no_exact.is_none() {
            let at = super::extent((rig, open), &rows.taps, sign, gauge);
            let model = at.map(|at| Exact::new(spec_values(&rig.setup), Vec::new(), at));
            match (model, at) {
                (Some(Ok(model)), _) => exact = Some(model),
                (Some(Err(why)), Some(Extent { reach: [near, far], .. })) if why.is_of_whisker() => {
                    let here = rows.taps.iter().filter(|t| t.is_of(sign));
                    let last = here.max_by(|s, t| s.drive.total_cmp(&t.drive));
                    let (drive, line) = last.map_or((f64::NAN, 0), |t| (t.recorded(data), t.line));
                    let (kind, drive) = (rig.setup.drive.column(), plain(drive));
                    no_exact = Some(format!(
                        "{why} at distances of {near:.4} … {far:.4} mm and drives up to {kind} = {drive} (line {line})"
                    ));
                }
                (Some(Err(why)), _) => return Err(why.into()),
                (None, _) => no_exact = Some("no tap is usable".to_owned()),
            }
        }
        let zero_error = between.map_or(f64::INFINITY, |[_, error]| error);
        // A single side: residuals of the other sign are noise about the zero.
        let (of, which) = ((data, rig.setup.gauge.factor), (sign, signs.len() == 1));
        sides.push((gauge, learn::side(of, &mut rows, which, exact, zero_error)?));
    }
    warnings
        .extend(sides.iter().filter(|s| s.1.task.drift && !read).map(|s| zero::wandering(data, rig, &s.1)));
    if !known {
        let (gauge, of) = &sides[0];
        let by_model = match no_exact.is_none() && of.task.known.is_some() {
            true => zero::of_model((rig, &rows.taps), (of.sign, *gauge), of.noise(), &options.fit, open)?,
            false => None,
        };
        let [value, error] = by_model.unwrap_or_else(|| of.fit.curve.zero());
        rows.tared.error = error;
        let is_turned = |t: &Tap| t.reason.is_none() && !signs.contains(&t.signal.signum());
        if rows.taps.iter().any(is_turned) || value.abs() > CERTAIN * error {
            zero::tare((data, rig), &mut rows, [of.sign * value, error]);
            let value = rows.tared.value;
            sides.iter_mut().for_each(|(_, of)| (of.subtracted, of.zero_known) = (of.sign * value, true));
        } else if error > DETERMINED * of.fit.curve.unit {
            rows.tared.error = 0.0;
        }
        let weak = weak(&rows.taps, signs[0], &rests);
        let of_other = |t: &Tap| is_turned(t) && !weak.contains(&t.place);
        let (lost, all) = (rows.taps.iter().filter(|t| of_other(t)).count(), rows.taps.len());
        if lost as f64 > LOST * all as f64 {
            let message = "no zero was read, and without it the taps of one side of the whisker cannot be told from those of the other";
            let lost = format!("{lost} of {all} taps are on the other side of the zero that the data say");
            let error = InputError::new(message).at(&data.file, None).key(data.unit.column()).value(lost);
            return Err(error.allowed(format!("rows with {} = 0", rig.setup.drive.column())).into());
        }
        for tap in rows.taps.iter_mut().filter(|t| of_other(t)) {
            tap.reason = Some(Reason::OtherSide);
        }
    }
    warnings.extend(zero::untared(data, rig, &rows.tared));
    Ok(Prepared { rows, sides, recorded, no_exact })
}

fn joined([distances, drives]: &[Groups; 2], kind: Drive) -> Vec<String> {
    let say = |g: &Groups, what: &str, unit: &str| {
        (g.len() < g.distinct).then(|| {
            let (distinct, width, n) = (g.distinct, g.width, g.len());
            format!(
                "{distinct} values of {what} lie within {width:.3} {unit} of each other and are taken as {n}: --group sets the width, 0 takes each \
                 as its own"
            )
        })
    };
    let unit = if kind == Drive::Angle { "degrees" } else { "mm" };
    [say(distances, "a_mm", "mm"), say(drives, kind.column(), unit)].into_iter().flatten().collect()
}

fn absurd(data: &Data, taps: &[Tap]) -> Result<(), InputError> {
    let mut sizes: Vec<f64> = taps.iter().map(|t| t.signal.abs()).filter(|s| s.is_finite()).collect();
    if sizes.is_empty() {
        let message = "no row has a distance, a drive other than zero and a signal";
        return Err(InputError::new(message).at(&data.file, None));
    }
    let middle = crate::reduce::median(&mut sizes);
    if data.unit.signal() == Some(Signal::Strain) && middle > ABSURD {
        let message = format!("half of all strains are above {middle:.3e}: this is another unit");
        let error = InputError::new(message).at(&data.file, None).key(data.unit.column());
        let allowed = "strain (0.001 is 0.1 %), microstrain, bridge_mV_per_V, or reading for any other unit";
        return Err(error.allowed(allowed));
    }
    Ok(())
}

/// Sign of all taps if an unread zero turns it, by the slope of the signals or because one curve above a constant follows both signs best.
fn turned(taps: &[Tap], raw: bool) -> Option<f64> {
    let own: Vec<&Tap> = taps.iter().filter(|t| t.reason.is_none()).collect();
    let by_drive = votes(taps, 0, |t| t.signal);
    let sign = if by_drive == 0.0 { -votes(taps, 1, |t| t.signal) } else { by_drive }.signum();
    let against = own.iter().filter(|t| t.signal * sign < 0.0).count();
    match against {
        0 => None,
        n if n == own.len() => (by_drive != 0.0 || raw).then_some(sign),
        _ => is_one_curve(&own, sign).then_some(sign),
    }
}

/// Number of groups with equal distance (`fixed` 0) or drive (1) in which the signal rises, less those in which it falls. One row in another unit
/// spoils only its group.
pub(super) fn votes(taps: &[Tap], fixed: usize, signal: fn(&Tap) -> f64) -> f64 {
    let mut groups = std::collections::BTreeMap::<u64, Vec<[f64; 2]>>::new();
    for t in taps.iter().filter(|t| t.reason.is_none()) {
        let x = if fixed == 0 { t.drive } else { t.a };
        groups.entry(t.group[fixed].to_bits()).or_default().push([x, signal(t)]);
    }
    let slope = |all: &Vec<[f64; 2]>| {
        let n = all.len() as f64;
        let [x, y] = [0, 1].map(|k| all.iter().map(|p| p[k]).sum::<f64>() / n);
        let [xy, xx] = [1, 0].map(|k| all.iter().map(|p| (p[0] - x) * (p[k] - [x, y][k])).sum::<f64>());
        if xy != 0.0 && xx > n * (SAME * x).powi(2) { xy.signum() } else { 0.0 }
    };
    groups.values().map(slope).sum()
}

/// True if one power law above a constant fits signals of both signs better than one law for each sign.
fn is_one_curve(taps: &[&Tap], sign: f64) -> bool {
    let points = |of: f64| taps.iter().map(move |t| [t.group[0], t.group[1], of * t.signal]);
    let one: Vec<[f64; 3]> = points(sign).collect();
    let mut sides = [1.0, -1.0].map(|of| points(of).filter(|p| p[2] > 0.0).collect::<Vec<_>>());
    sides.sort_by_key(Vec::len);
    let left = |taps: &[[f64; 3]], zero: Option<f64>| {
        let f = power(taps, zero, false)?;
        let expected = |p: &[f64; 3]| f.zero + f.factor * f.power.value(p[0], p[1]);
        Some(taps.iter().map(|p| (p[2] - expected(p)).abs()).sum::<f64>())
    };
    let Some(alone) = left(&one, None) else { return false };
    // Too few taps to contradict any law.
    let few = left(&sides[0], Some(0.0)).unwrap_or(0.0);
    left(&sides[1], Some(0.0)).is_none_or(|most| alone < most + few)
}

/// Signs of the sides, most taps first. Stray taps are excluded unless `rests` show noise. Without a `whisker`, a side needs three distances.
fn signs(
    data: &Data,
    taps: &mut [Tap],
    rests: &[f64],
    [read, whisker]: [bool; 2],
) -> Result<Vec<f64>, InputError> {
    if let Some(sign) = if read { None } else { turned(taps, data.unit.signal().is_none()) } {
        return Ok(vec![sign]);
    }
    let with = |sign: f64| move |t: &&Tap| t.is_of(sign);
    let [plus, minus] = [1.0, -1.0].map(|sign| taps.iter().filter(with(sign)).count());
    let (most, least) = if plus >= minus { (1.0, -1.0) } else { (-1.0, 1.0) };
    let weak = weak(taps, most, rests);
    let of = |sign: f64| {
        let weak = &weak;
        move |t: &&Tap| with(sign)(t) && (sign == most || !weak.contains(&t.place))
    };
    let count = |sign: f64| taps.iter().filter(of(sign)).count();
    let distances = |sign: f64| Groups::levels(taps.iter().filter(of(sign)).map(|t| t.group[0])).len();
    if plus + minus == 0 {
        if let Some(tap) = taps.iter().find(|t| t.drive < 0.0).filter(|_| !taps.iter().any(|t| t.drive > 0.0))
        {
            let column = data.drive.map_or("drive", |kind| kind.column());
            let error = InputError::new("all taps have drives below 0").at(&data.file, Some(tap.line));
            let error = error.key(column).value(plain(tap.drive));
            return Err(error.allowed("the size of the drive, > 0, where all taps are to one side"));
        }
        let mut why: Vec<&str> = taps.iter().filter_map(|t| Some(t.reason.as_ref()?.word())).collect();
        why.sort_unstable();
        why.dedup();
        let error = InputError::new("no row can be used").at(&data.file, None).value(why.join(", "));
        return Err(error.allowed(
            "rows with a_mm beyond the gauge and within the whisker, a drive > 0 and a signal that is not zero",
        ));
    }
    if distances(most) < 2 {
        let a = taps.iter().find(of(most)).map_or(f64::NAN, |t| t.a);
        let message = "all usable taps are at one distance: a calibration needs two or more";
        let error = InputError::new(message).at(&data.file, None).key("a_mm").value(plain(a));
        return Err(error.allowed("two distances or more"));
    }
    // Taps at several places never have one value: it means "missing".
    let mut values: Vec<f64> = taps.iter().filter(of(least)).map(|t| t.value).collect();
    values.dedup();
    let missing = values.len() == 1 && count(least) > 1;
    let both = count(least) as f64 >= MINORITY * count(most) as f64
        && distances(least) >= if whisker { 2 } else { 3 };
    if both && !missing {
        return Ok(vec![most, least]);
    }
    let reason = if missing { Reason::Missing(values[0]) } else { Reason::OtherSide };
    taps.iter_mut().filter(|t| of(least)(&&**t)).for_each(|t| t.reason = Some(reason.clone()));
    Ok(vec![most])
}

/// Taps of the other sign than `most` that are within [`NOISY`] noise of the law of the others; none if several are farther off: then it is a side.
fn weak(taps: &[Tap], most: f64, rests: &[f64]) -> Vec<usize> {
    let sound = || taps.iter().filter(|t| t.reason.is_none());
    let point = |t: &Tap| [t.group[0], t.group[1], most * t.signal];
    let scatter = |of: &[f64]| {
        let mean = of.iter().sum::<f64>() / of.len() as f64;
        of.iter().map(|x| (x - mean).powi(2)).sum::<f64>()
    };
    let strong: Vec<[f64; 3]> = sound().map(point).filter(|p| p[2] > 0.0).collect();
    if strong.len() == sound().count() {
        return Vec::new();
    }
    let Some(law) = power(&strong, Some(0.0), false) else { return Vec::new() };
    let expected = |p: &[f64; 3]| law.factor * law.power.value(p[0], p[1]);
    let mut off: Vec<[f64; 2]> = strong.iter().map(|p| [expected(p), (p[2] - expected(p)).abs()]).collect();
    off.sort_by(|p, q| p[0].total_cmp(&q[0]));
    let mut weakest: Vec<f64> = off[..off.len().div_ceil(3)].iter().map(|p| p[1]).collect();
    let mut noise = 1.4826 * crate::reduce::median(&mut weakest);
    if rests.len() >= REPEATS {
        noise = noise.min((scatter(rests) / (rests.len() - 1) as f64).sqrt());
    }
    let weak = off[off.len().div_ceil(3) - 1][0];
    let mut cells = std::collections::BTreeMap::<[u64; 2], Vec<f64>>::new();
    for p in strong.iter().filter(|p| expected(p) <= weak) {
        cells.entry([p[0].to_bits(), p[1].to_bits()]).or_default().push(p[2]);
    }
    let (squares, freedom) =
        cells.values().fold((0.0, 0), |(sum, n), all| (sum + scatter(all), n + all.len() - 1));
    if freedom >= REPEATS {
        noise = noise.min((squares / freedom as f64).sqrt());
    }
    let off = |t: &Tap| expected(&point(t)) - most * t.signal;
    let (near, far): (Vec<&Tap>, Vec<&Tap>) =
        sound().filter(|t| most * t.signal <= 0.0).partition(|t| off(t) <= NOISY * noise);
    if far.len() >= REPEATS { Vec::new() } else { near.iter().map(|t| t.place).collect() }
}

/// Side of the gauge for `sign`: tension is the contact side. For an unknown unit, most taps are on the side named in the spec.
fn gauge_side(data: &Data, rig: &Rig, sign: f64, most: f64) -> Side {
    let strain = data.unit.signal() == Some(Signal::Strain);
    let far = if strain { sign < 0.0 } else { (rig.setup.gauge.side == Side::Far) == (sign == most) };
    if far { Side::Far } else { Side::Contact }
}
