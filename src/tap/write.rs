//! The files of `tap`, its result as JSON, and the sentence about the limit.

use serde_json::{Value, json};

use super::{LimitedBy, Report, Sample};
use crate::error::Error;
use crate::optimise::report;
use crate::scene::{Convention, Drive, Foil, Objective, Setup, Study, Theory};
use crate::sink::{Field, Frame, drive_unit, heading, values::named};

pub fn unit(setup: &Setup) -> (&'static str, &'static str) {
    let name = if setup.drive == Drive::Angle { "tap angle" } else { "displacement" };
    (name, drive_unit(setup.drive).1)
}

fn k_unit(study: &Study) -> f64 {
    study.space.whisker().map_or(1.0, |whisker| report::unit(&study.setup, &whisker))
}

pub fn k_names(setup: &Setup) -> [&'static str; 2] {
    match setup.estimate.convention {
        Convention::Mean => ["K_mean", "K_sd"],
        Convention::Elongation => ["K_mean_mm", "K_sd_mm"],
    }
}

fn fields(s: &Sample, unit: f64) -> impl Iterator<Item = Field> {
    let row = s.row.figures();
    let (mean, sd) = (row.mean.map(|m| (1.0 + m) * unit), row.sd.map(|sd| sd * unit));
    let [error, total] = [row.error_rms, row.total_rms()];
    let numbers = [Some(s.drive), mean, sd, error, row.noise_rms, total, row.strain_max, error];
    numbers.map(Field::from).into_iter().chain([row.status.into()])
}

fn point(setup: &Setup, s: &Sample, unit: f64) -> Value {
    let mut point = named(heading("tap").names(setup), fields(s, unit));
    point["force_max_N"] = s.row.figures().force_max.into();
    point
}

pub fn result(study: &Study, report: &Report) -> Value {
    let unit = k_unit(study);
    let other = report.other.as_ref().map(|other| {
        let optimum = other.optimum.as_ref();
        json!({
            "estimator": other.theory.estimator(),
            "optimum": optimum.ok().map(|s| point(&study.setup, s, unit)),
            "at_bound": other.at_bound,
            "why_not": optimum.err(),
        })
    });
    json!({
        "optimum": point(&study.setup, &report.optimum, unit),
        "unconstrained": point(&study.setup, &report.unconstrained, unit),
        "limited_by": report.limited_by.word(),
        "at_bound": report.at_bound,
        "why": report.why,
        "estimator": study.setup.estimate.theory.estimator(),
        "other": other,
    })
}

pub fn table(study: &Study, report: &Report) -> Result<Frame, Error> {
    let unit = k_unit(study);
    let mut table = heading("tap").frame_for(&study.setup);
    report.curve.iter().try_for_each(|s| table.row(fields(s, unit)))?;
    Ok(table)
}

pub fn why(setup: &Setup, report: &Report, ends: [f64; 2], objective: Objective) -> String {
    let Report { optimum, unconstrained, limited_by: by, at_bound, .. } = report;
    let (name, unit) = unit(setup);
    let [from, to] = ends.map(|end| (optimum.drive - end).abs());
    let end = if from <= to { "smallest" } else { "largest" };
    // The exact model has no bias, unless it mistakes a tap before the peak for one beyond it.
    let exact = setup.estimate.theory == Theory::Exact && optimum.row.figures().error_rms == Some(0.0);
    let trend = match (objective, end) {
        (Objective::Distance, _) if exact && optimum.row.figures().total_rms() == Some(0.0) => {
            "without bias and noise none is better than another"
        }
        (Objective::Distance, "smallest") if exact => "the noise grows with it",
        (Objective::Distance, _) if exact => "the noise still falls there",
        (Objective::Sd, "smallest") => "the spread of K only grows with it",
        (Objective::Sd, _) => "the spread of K still falls there",
        (_, "smallest") => "the bias grows with it faster than the noise falls",
        _ => "the noise still falls faster than the bias grows",
    };
    let mut text = match by {
        LimitedBy::Bound => format!("The {end} {name} of the interval is best: {trend}."),
        LimitedBy::Strain => format!(
            "The strain limit of {} binds at {:.4}{unit}; without it {:.4}{unit}{} would be best.",
            match setup.gauge.foil {
                Some(Foil { strain_limit: Some(own), .. }) => {
                    format!("{} (of the skin) or {own} (of the foil)", setup.gauge.strain_limit)
                }
                Some(_) => format!("{} (of the skin; the foil reads less)", setup.gauge.strain_limit),
                None => setup.gauge.strain_limit.to_string(),
            },
            optimum.drive,
            unconstrained.drive,
            if ends.contains(&unconstrained.drive) { ", where the interval ends," } else { "" }
        ),
        LimitedBy::Friction => format!(
            "At {:.4}{unit} a contact turns from sticking to sliding, and the {} has a kink there: it grows on both sides.",
            optimum.drive,
            if objective == Objective::Sd { "spread of K" } else { "total error" }
        ),
        LimitedBy::CompleteRows => format!("Beyond {:.4}{unit} a tap has no distance or slips off.", optimum.drive),
        LimitedBy::Bias | LimitedBy::Noise if objective == Objective::Sd => {
            format!("The spread of K has a minimum inside the interval, at {:.4}{unit}.", optimum.drive)
        }
        LimitedBy::Noise if exact => {
            format!("The noise is least at {:.4}{unit}: a quieter gauge, or averaged taps, would help.", optimum.drive)
        }
        LimitedBy::Bias if setup.estimate.theory == Theory::Exact => "Taps before the peak of the strain are taken for farther ones: larger distances, or a gauge nearer to the clamp, would help most.".to_owned(),
        LimitedBy::Bias => "Bias and noise balance, and the bias is the larger part: a better model of the whisker, or a calibration by distance, would help more than a quieter gauge.".to_owned(),
        LimitedBy::Noise => "Bias and noise balance, and the noise is the larger part: a quieter gauge, or averaged taps, would help most.".to_owned(),
    };
    if *at_bound && *by != LimitedBy::Bound {
        text += &format!(" It is also the {end} {name} of the interval.");
    }
    if exact && objective == Objective::Distance {
        text += " The bias is 0 by construction: the model inverts its own strains.";
    }
    text
}
