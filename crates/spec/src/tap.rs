//! What `tap` asks of a spec: one whisker, two distances or more, and an interval of drives.

use super::reader::{Item, Result};
use super::schema::Sections;
use super::space::{KEYS, drive_key};
use crate::evaluated::both;
use crate::scene::{Axis, Column, Contact, Drive, Estimate, Factor, Gauge, Model, Space, Spec, Theory};

/// Interval of tap angles where the spec has none, degrees.
pub(super) const FALLBACK: &str = "[tap]\ntheta = [0.1, 10.0]\n";

/// Smallest and largest drive of `spec`, which must hold one whisker; `noisy`: the objective needs the noise.
pub(super) fn check(sections: &Sections<'_>, spec: &Spec, noisy: bool) -> Result<[f64; 2]> {
    let Space::Grid(factors) = &spec.study.space else {
        let file = sections.section("tuples").get("file")?;
        return Err(file
            .error("this takes one whisker, no list of tuples")
            .allowed("one number each for D, d, L_a, x_ss, l"));
    };
    let axis = |column: Column| -> &Axis {
        let mut axes = factors.iter().flat_map(|f: &Factor| &f.axes);
        &axes.find(|(c, _)| *c == column).expect("a grid has every column").1
    };
    for ((section, key), column) in KEYS.into_iter().zip(Column::ALL).take(5) {
        if axis(column).len() > 1 {
            let item = sections.section(section).get(key)?;
            return item.refuse("this takes one whisker", "one number; optimise searches over whiskers");
        }
    }
    for (key, column) in [("tilt", Column::Tilt), ("lean", Column::Lean)] {
        if axis(column).len() > 1 {
            let item = sections.section("tap").get(key)?;
            return item.refuse("this takes one direction of the object's edge", "one number");
        }
    }
    let estimate = &spec.study.setup.estimate;
    // The model itself needs no K.
    let told = estimate.k.is_some() || noisy && estimate.theory == Theory::Exact;
    if axis(Column::Distance).len() < 2 && !told {
        let a = sections.section("tap").get("a")?;
        return a.refuse("K has no spread and no mean over one distance", "two distances or more");
    }
    let drive = axis(Column::Drive);
    let ends = [drive.min(), drive.max()];
    if ends[0] >= ends[1] {
        let item = sections.section("tap").get(drive_key(spec.study.setup.drive))?;
        return item.refuse(
            "one value leaves nothing to choose",
            match spec.study.setup.drive {
                Drive::Angle => "two values or a range: the ends of the interval; or none, which is 0.1 … 10",
                Drive::Displacement => "two values or a range: the ends of the interval",
            },
        );
    }
    if noisy && spec.study.setup.is_noisy().is_none() {
        let section = sections.section("gauge");
        let error = section.document.error(
            section.span.clone(),
            "total_rms_mm holds the gauge's noise, and noise_strain is not written",
        );
        return Err(error
            .key("gauge.noise_strain")
            .allowed("noise_strain = 20e-6 (0 for the bias alone), noise in [sensor] for another signal, or --objective sd"));
    }
    Ok(ends)
}

/// Refuses contacts for which there is no model at the poles that tilt, and lean, where `leaning` says.
pub(super) fn allowed(leaning: &[Option<Item<'_>>; 2], model: &Model) -> Result<()> {
    let [tilt, lean] = leaning;
    let why = model.forbids([tilt.is_some(), lean.is_some()]);
    match tilt.as_ref().or(lean.as_ref()).zip(why) {
        Some((item, why)) if model.contact == Contact::Frictionless => {
            item.refuse(why, "0, or that effect off in [model]")
        }
        Some((item, why)) => item.refuse(why, "0, or contact = \"frictionless\" in [model]"),
        None => Ok(()),
    }
}

/// Refuses to invert the model of two strains for contacts at which they do not tell the tilt.
pub(super) fn check_second_gauge(
    sections: &Sections<'_>,
    gauge: &Gauge,
    estimate: &Estimate,
    model: &Model,
) -> Result<()> {
    let why = both::forbids(model.contact).filter(|_| gauge.second && estimate.theory == Theory::Exact);
    let Some(why) = why else { return Ok(()) };
    let theory = sections.section("estimate").get("theory")?;
    theory.refuse(why, "\"euler-bernoulli\" or \"timoshenko\"; second = false in [gauge]; or contact = \"frictionless\" in [model]")
}
