//! `[tap] abscissa`: contact distances of a curved whisker, measured along its base tangent (model §7).

use super::axis::AxisItem;
use super::properties;
use super::reader::Result;
use super::schema::Sections;
use crate::physics::body::rest;
use crate::physics::root::bracketed;
use crate::scene::built::Built;
use crate::scene::{Axis, Column, Property, Space};

/// With `abscissa = true` the distances of `space` are abscissae of the whisker `built` at rest: makes them arcs.
pub(super) fn to_arcs(
    sections: &Sections<'_>,
    space: &mut Space,
    built: Option<&Built>,
    axes: &[(Property, AxisItem<'_>)],
) -> Result<()> {
    let tap = sections.section("tap");
    if !tap.get("abscissa")?.flag()? {
        return Ok(());
    }
    let item = tap.get("abscissa")?;
    let bends = [Property::Curvature, Property::CurvatureSlope];
    let searched = |property: &Property| properties::searched(sections, *property);
    if axes.iter().any(|(property, _)| bends.contains(property)) || bends.iter().any(searched) {
        let error = item.error("an abscissa belongs to one curvature, and here it varies");
        return Err(error.allowed("abscissa = false, or one number for curvature and curvature_slope"));
    }
    let Space::Grid(factors) = space else {
        let error = item.error("a_mm of a tuple file is the arc of the contact");
        return Err(error.allowed("abscissa = false, or a in [tap]"));
    };
    let Some(built) = built.filter(|built| !built.is_straight()) else { return Ok(()) };
    let longest = factors.iter().flat_map(|factor| &factor.axes);
    let longest = longest.filter(|(column, _)| *column == Column::Length).map(|(_, axis)| axis.max());
    let longest = longest.fold(0.0, f64::max);
    let most = rest(built.curvature, longest).x;
    let distances = factors.iter_mut().flat_map(|factor| &mut factor.axes);
    for (_, axis) in distances.filter(|(column, _)| *column == Column::Distance) {
        if axis.max() > most {
            let error =
                tap.get("a")?.error(format!("{} mm lies beyond the tip of the whisker at rest", axis.max()));
            return Err(error.allowed(format!("a ≤ {most:.6}, the abscissa of L_a = {longest} mm")));
        }
        let arc = |x: f64| bracketed(|s| rest(built.curvature, s).x - x, 0.0, longest);
        let arcs: Vec<f64> = axis.iter().map(arc).collect();
        *axis = if let [one] = arcs[..] { Axis::Value(one) } else { Axis::List(arcs) };
    }
    Ok(())
}
