//! What values may be together.

use super::axis::AxisItem;
use super::reader::Result;
use crate::scene::{COLUMNS, Contact, Geometry, Material, Model, TERMS, Term};

/// `part ≤ whole`, up to the rounding of a sum of decimal numbers.
fn fits(part: f64, whole: f64) -> bool {
    part <= whole * (1.0 + 1e-12)
}

/// Refuses values of D, d, L_a, x_ss, l, a that no tuple can satisfy, each judged against the most
/// permissive values of the other axes.
pub(super) fn satisfiable(axes: &[AxisItem<'_>; COLUMNS]) -> Result<()> {
    let [_, _, length, place, grid, distance, ..] = axes;
    let longest = length.axis.max();
    let (nearest, first, shortest) = (distance.axis.min(), place.axis.min(), grid.axis.min());

    if let Some((a, item)) = distance.first_where(nearest, |a| !fits(a, longest)) {
        let message =
            format!("the whisker is too short to be touched at a = {a} mm: its largest L_a is {longest} mm");
        return item.refuse(message, format!("0 < a ≤ {longest} mm"));
    }
    let begins = place.first_where(first, |x| !fits(x + shortest, longest));
    let begins = begins.map(|(x, item)| (x, shortest, item));
    let ends = || grid.first_where(shortest, |l| !fits(first + l, longest));
    if let Some((x, l, item)) = begins.or_else(|| ends().map(|(l, item)| (first, l, item))) {
        let message = format!(
            "the gauge ends beyond the whisker: x_ss + l = {x} + {l} mm, but its largest L_a is {longest} mm"
        );
        return item.refuse(message, format!("x_ss + l ≤ {longest} mm"));
    }
    if let Some((length, item)) = length.first_where(longest, |length| !fits(nearest, length)) {
        let message = format!("a whisker of L_a = {length} mm is shorter than the smallest a, {nearest} mm");
        return item.refuse(message, format!("L_a ≥ {nearest} mm"));
    }
    let gauge_end = first + shortest;
    if let Some((length, item)) = length.first_where(longest, |length| !fits(gauge_end, length)) {
        let message = format!(
            "a whisker of L_a = {length} mm is shorter than the smallest x_ss + l, {first} + {shortest} mm"
        );
        return item.refuse(message, format!("L_a ≥ {gauge_end} mm"));
    }
    Ok(())
}

/// An effect that contradicts another: its key in `[model]`, what is wrong, what is allowed.
pub(super) type Fault = (&'static str, String, String);

/// Refuses combinations of effects that have no meaning.
pub(super) fn consistent(model: &Model) -> std::result::Result<(), Fault> {
    let on = |term: &&Term| (term.get)(model).is_on();
    let rubs = model.contact != Contact::Frictionless;
    if model.geometry == Geometry::Linear {
        let term = TERMS.iter().filter(on).find(|term| !term.linear);
        let wrong = match term {
            Some(term) => Some((term.key, term.off())),
            None if rubs => Some(("contact", "\"frictionless\"")),
            None => (!matches!(model.material, Material::Hooke(_))).then_some(("material", "{ hooke = E }")),
        };
        if let Some((key, instead)) = wrong {
            let why = "geometry = \"linear\" has no such effect; it takes only shear, nu, hub, side and a hooke material";
            return Err((key, why.into(), format!("{instead}, or geometry = \"exact\"")));
        }
    }
    for term in TERMS.iter().filter(on) {
        let Some((other, why)) = term.needs else { continue };
        if TERMS.iter().filter(|term| term.key == other).any(|term| !(term.get)(model).is_on()) {
            let why = format!("{} needs {other}: {why}", term.key);
            return Err((term.key, why, format!("{}, or {other} in [model]", term.off())));
        }
    }
    if rubs && !model.extension {
        let why =
            "friction needs extension = true: an inextensible whisker held at its own arc length cannot bend";
        let allowed = "\"frictionless\", or add extension = true to [model]";
        return Err(("contact", why.into(), allowed.into()));
    }
    if rubs && let Some((term, why)) = TERMS.iter().rev().filter(on).find_map(|t| Some((t, t.frictionless?)))
    {
        let off = format!("{} = {}", term.key, term.off());
        return Err((
            "contact",
            format!("friction needs {off}: {why}"),
            format!("\"frictionless\", or {off} in [model]"),
        ));
    }
    Ok(())
}
