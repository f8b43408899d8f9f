//! Checks that the built whiskers of a spec can exist, and warns where their equations are incomplete.

use super::properties::{RigAxis, corners};
use super::{Result, Sections};
use crate::physics::body::Body;
use crate::scene::{Column, Drive, Property, Setup, Spec};

fn largest(spec: &Spec, setup: &Setup, scale: f64) -> Option<(Body, f64)> {
    let most = |column| spec.study.space.axis(column).map(crate::scene::Axis::max);
    let [base, tip, length] = [Column::BaseDiameter, Column::TipDiameter, Column::Length].map(most);
    let diameters = [scale * base?, scale * tip?, length?];
    let body = Body::new(setup.built.as_deref()?, diameters, setup.model.material.e0(), setup.model.nu);
    Some((body, spec.study.space.axis(Column::Distance)?.min()))
}

/// Why no whisker of `setup` can exist, allowed values, and keys to report: an inner part as thick as the skin, or a bend from every contact.
fn misfit(
    spec: &Spec,
    (setup, scale): &(Setup, f64),
    tapped: bool,
) -> Option<(String, &'static str, &'static [&'static str])> {
    let (body, nearest) = largest(spec, setup, *scale)?;
    if let Some((s, inner, outer)) = body.burst() {
        let why = format!("at s = {s} mm it is {inner} mm thick, and the whisker {outer} mm");
        return Some((why, "0 < diameter < D everywhere", &["bore", "core", "profile"]));
    }
    let hub = (setup.drive == Drive::Angle).then_some(setup.hub);
    let why = body.refuses(nearest, setup.model.pole_radius, hub).filter(|_| tapped)?;
    let allowed =
        "|κ_base a + κ_slope a²/2| < π/2, a lever towards the object, and κ > -1/pole_radius everywhere";
    Some((format!("{why} at a = {nearest} mm"), allowed, &["curvature", "curvature_slope"]))
}

pub(super) fn fits(sections: &Sections<'_>, spec: &Spec, properties: &[RigAxis<'_>]) -> Result<()> {
    if sections.section("optimise").written("variables").is_some() {
        return Ok(()); // A search skips designs that are no whiskers.
    }
    let (setup, whisker) = (&spec.study.setup, sections.section("whisker"));
    let tapped = sections.section("tap").written("a").is_some();
    let shapes = |(property, _): &&RigAxis<'_>| {
        use Property::{Bore, Core, Curvature, CurvatureSlope, Exponent, Hub, PoleRadius, Scale};
        [Exponent, Scale, Bore, Core, Curvature, CurvatureSlope, Hub, PoleRadius].contains(property)
    };
    let shaping: Vec<_> = properties.iter().filter(shapes).cloned().collect();
    let wrong = |others: &[RigAxis<'_>], setup: &Setup, scale: f64| {
        let corners = corners(setup, others).into_iter();
        let mut all = corners.map(|(setup, own)| misfit(spec, &(setup, scale * own), tapped));
        let first = all.next()??;
        all.all(|misfit| misfit.is_some()).then_some(first)
    };
    for (k, (property, axis)) in shaping.iter().enumerate() {
        let others = [&shaping[..k], &shaping[k + 1..]].concat();
        let with = |value: f64| {
            let mut one = setup.clone();
            property.set(&mut one, value);
            wrong(&others, &one, if *property == Property::Scale { value } else { 1.0 })
        };
        // A sample is judged with its row.
        if axis.axis.points().is_none()
            && let Some((value, item)) = axis.first_where(0.0, |value| with(value).is_some())
            && let Some((why, allowed, _)) = with(value)
        {
            return item.refuse(why, allowed);
        }
    }
    if let Some((why, allowed, keys)) = wrong(&shaping, setup, 1.0) {
        let item = keys.iter().find_map(|key| whisker.written(key));
        return item.map_or_else(|| whisker.get(keys[0]), Ok)?.refuse(why, allowed);
    }
    Ok(())
}

pub(super) fn doubts(spec: &Spec) -> Vec<String> {
    let Some((body, _)) = largest(spec, &spec.study.setup, 1.0) else { return Vec::new() };
    let bent = [0.0, body.length].map(|s| (body.curvature(s) * body.radius(s, s)).abs());
    let most = bent[0].max(bent[1]);
    let text = format!(
        "[whisker] curvature times R is {most:.2}: sections of a whisker so bent at rest are not those of a straight one, by about as much (docs/model.md §7)"
    );
    (most > 0.05).then_some(text).into_iter().collect()
}
