//! Warnings about a calibration.

use super::side::{Contradiction, growing};
use super::{Calibrated, Reason, SideResult, named};
use crate::estimator::{Estimator, Parameter, taps::Tap};
use crate::measure::{Data, Rig};
use crate::{error::InputError, fields::plain, scene::Signal};

/// Ratio of errors on distances left out above which an estimator is wrong, not unlucky.
const FAR_WORSE: f64 = 3.0;
/// A factor differs from 1 beyond this many standard errors, and beyond [`ORDINARY`], the usual difference of gauges and their glue.
const ERRORS: f64 = 3.0;
const ORDINARY: f64 = 0.01;
const FACTORS: [(f64, &str); 3] = [
    (180.0 / std::f64::consts::PI, "57.3 degrees are a radian: is the drive in radians?"),
    (1e6, "is it in millionths?"),
    (1e3, "is it in thousandths?"),
];
const NEAR: f64 = 0.05;
/// Misfit of the model, as a share of the signal, that is reported.
const UNEXPLAINED: f64 = 0.01;

pub fn remarks(data: &Data, found: &Calibrated) -> Vec<String> {
    let (taps, rig, file) = (&found.taps, &found.calibration.rig, &data.file);
    let mut all = Vec::new();
    let mut add = |wanted: &dyn Fn(&Tap) -> bool, say: &dyn Fn(usize, String) -> String| {
        let lines: Vec<usize> = taps.iter().filter(|t| wanted(t)).map(|t| t.line).collect();
        if !lines.is_empty() {
            all.push(format!("{file}: {}", say(lines.len(), named(&lines))));
        }
    };
    let of = taps.len();
    add(&|t| t.twin.is_some(), &|n, lines| {
        format!(
            "{n} rows are equal to earlier ones in every field and are used as repeats; if they are copies, the noise \
             is understated (lines {lines})"
        )
    });
    add(&|t| t.reason.as_ref().is_some_and(Reason::is_doubt), &|n, lines| {
        format!("{n} of {of} rows are suspect and not used (lines {lines}); rows.csv says why")
    });
    add(&|t| t.reason == Some(Reason::Tilted), &|n, lines| {
        format!("{n} of {of} rows are of tilted poles and serve the second gauge only (lines {lines})")
    });
    for s in &found.sides {
        if let Some(why) = &s.record.no_exact {
            all.push(format!("{file}: exact is left out: {why}. The other estimators do not need it"));
        }
        let unsolved = s.fit.as_ref().map_or(0, |f| s.table.cells.len() - f.cells.len());
        if unsolved > 0 {
            all.push(format!(
                "{file}: the model of the spec has no solution at {unsolved} of {} distances and drives, which are left out of the fit of exact",
                s.table.cells.len()
            ));
        }
        for Contradiction { a: [p, q], drives, deviations } in &s.contradictions {
            all.push(format!(
                "{file}: the signals at a = {p} and {q} mm are in the wrong order, at {drives} of {} drives, by {deviations:.1} standard deviations: one of \
                 these positions is not what its label says. Which one the data do not tell; both are used",
                s.table.drives.len()
            ));
        }
        let [grows, of] = growing(&s.table.cells, s.table.drives.len(), found.calibration.noise, rig.known);
        if grows > 0 && 2 * grows >= of {
            all.push(format!(
                "{file}: at {grows} of {of} drives signals grow with the distance, where those of a whisker fall: are distances measured from its tip, or is \
                 another column the signal?{}",
                if rig.known { "" } else { " Only those of taps right beside the gauge grow" }
            ));
        }
        all.extend(end_stop(data, taps, s));
        // A foil reads some 5 % of the strain in f.
        let about_one = rig.known && rig.setup.gauge.foil.is_none();
        let about_one = about_one && data.unit.is_absolute() && found.calibration.drive_recorded;
        if let Some(k) = s.mean_k().filter(|k| about_one && !(0.33..3.0).contains(k)) {
            let (signal, drive) = (data.unit.column(), rig.setup.drive.column());
            all.push(format!(
                "K is {k:.3e} where theory expects about 1: check the unit of {signal} and the drive, and that a_mm and {drive} are not swapped"
            ));
        }
        all.extend(other_whisker(data, s, found.calibration.zero.unread()));
    }
    all
}

fn end_stop(data: &Data, taps: &[Tap], side: &SideResult) -> Option<String> {
    let stopped = |t: &&Tap| t.reason == Some(Reason::Saturated) && t.signal.signum() == side.learnt.sign;
    let first = taps.iter().find(stopped)?;
    let (file, n, column) = (&data.file, taps.iter().filter(stopped).count(), data.unit.column());
    let (value, line) = (plain(first.value), first.line);
    Some(format!(
        "{file}: {n} rows read {column} = {value}, beyond which there is no reading, where more is expected (the first in line {line}): this is taken as the end \
         stop of the sensor; these rows are not used, and locate answers no reading there"
    ))
}

/// Signs that the measured whisker is not that of the spec; `unread` is the standard error of an unread zero.
fn other_whisker(data: &Data, side: &SideResult, unread: f64) -> Option<String> {
    let fit = side.fit.as_ref()?;
    let mut found = Vec::new();
    let [factor, error] = [fit.exact.values[Parameter::Factor as usize], fit.errors(unread)[0]];
    if data.unit.is_absolute() && (factor - 1.0).abs() > (ERRORS * error).max(ORDINARY) {
        let read = data.unit.signal().map_or("signal", Signal::word);
        let known =
            FACTORS.iter().find(|(x, _)| [factor, 1.0 / factor].iter().any(|f| (f / x - 1.0).abs() < NEAR));
        let known = known.map_or(String::new(), |(_, what)| format!(" ({what})"));
        found.push(format!(
            "the {read} is {factor:.3} ± {error:.1e} times what the model of the spec gives{known}"
        ));
    }
    let both = side.common_errors(&[Estimator::Exact, Estimator::Curve]);
    if let [(_, (Some(exact), _)), (_, (Some(curve), _))] = both[..]
        && exact > FAR_WORSE * curve
    {
        found.push(format!("on distances left out exact is wrong by {exact:.3} mm, curve by {curve:.3} mm"));
    }
    if fit.misfit > UNEXPLAINED {
        found.push(format!(
            "the model of the spec leaves {:.1} % of the signal unexplained (χ² per degree of freedom {:.3})",
            100.0 * fit.misfit,
            fit.chi2
        ));
    }
    let of_gauge = data.unit.signal() == Some(Signal::Strain);
    let more = if of_gauge { ", x_ss and l, gauge.factor" } else { ", the modulus" };
    let (file, column, what) = (&data.file, data.unit.column(), found.join("; "));
    (!found.is_empty()).then(|| {
        format!(
            "{file}: {what}. Is this the whisker that was measured? Check D, d, L_a{more}, from where a_mm is measured, the unit \
             of {column} and the drive; then how the base is held: a root that gives way ([whisker] root, --fit k_theta), [model] clamp; then material, \
             contact or --fit"
        )
    })
}

pub fn nothing_known(data: &Data, rig: &Rig, sides: &[SideResult]) -> InputError {
    let of = |s: &SideResult| {
        let each = Estimator::ALL.into_iter().filter(|e| s.has(*e)).map(|e| match s.rms(e).0 {
            Some(rms) => format!("{} is wrong by {rms:.3} mm", e.word()),
            None => format!("{} answers nothing", e.word()),
        });
        let ([first, last], n) = (s.record.distances_mm.map(plain), s.table.distances.len());
        format!("{n} distances, {first} … {last} mm: {}", each.collect::<Vec<_>>().join(", "))
    };
    InputError::new("no estimator tells a distance that it was not calibrated on")
        .at(&data.file, None)
        .key("a_mm")
        .value(sides.iter().map(of).collect::<Vec<_>>().join("; "))
        .allowed(format!(
            "three distances or more, at which the signal differs; are a_mm and {} swapped, or is the whisker another one?",
            rig.setup.drive.column()
        ))
}
