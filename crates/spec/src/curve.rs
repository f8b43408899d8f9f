//! `material = { curve = "file.csv" }`: a measured stress–strain curve and the law fitted to it.

use std::path::Path;

use super::properties::{RigAxis, searched as is_searched};
use super::table::{self, Columns, Rows, Source};
use super::{Document, Frame, InputError, Item, Limit, Result, Sections, TextFile};
use crate::physics::fit::{STRAIN, STRESS, yeoh};
use crate::physics::{body::rest, inverse::bracketed};
use crate::scene::{Axis, Built, Column, MaterialFit, Property, Space};

const LEAST: usize = 5;

const COLUMNS: Columns<'static> = Columns::all(&[STRAIN, STRESS], allowed);

pub(super) fn read(item: &Item<'_>, base: &Path) -> Result<(MaterialFit, Option<String>)> {
    let (label, text) = table::open(item, base, "curve", Limit::Whole)?;
    of_text(label, &text)
}

/// [`of_frame`] for the file at `path`. Errors: those of [`of_frame`]; the file cannot be read.
pub fn of_file(path: &Path) -> Result<MaterialFit> {
    let text = TextFile::open(path, "curve", Limit::Whole)?.text()?;
    Ok(of_text(path.display().to_string(), &text)?.0)
}

fn of_text(label: String, text: &str) -> Result<(MaterialFit, Option<String>)> {
    let document = Document { file: &label, text };
    let (points, header) = table::read(document, COLUMNS)?;
    Ok((fitted(points, &label, Source::Text(document))?, header.warning(&label)))
}

/// Fits Yeoh's law to a measured curve in memory, with the columns of such a file.
/// Errors: a column is missing, the points are not a stress–strain curve, or the law does not fit them.
pub fn of_frame(frame: &Frame) -> Result<MaterialFit> {
    let mut points = Vec::new();
    table::of_frame(frame, COLUMNS, &mut |row, place| points.push(([row[0], row[1]], place)))?;
    fitted(points, "data", Source::Memory)
}

fn fitted(points: Rows<2>, label: &str, source: Source<'_>) -> Result<MaterialFit> {
    let points = checked(points, source)?;
    let (first, last) = (points[0][0], points[points.len() - 1][0]);
    let (coefficients, rms) = yeoh(&points).map_err(|why| source.whole(why))?;
    Ok(MaterialFit { file: label.to_owned(), points: points.len(), coefficients, rms, range: [first, last] })
}

fn allowed(column: &str) -> &'static str {
    match column {
        STRAIN => "a nominal strain > −1 (0.1 is 10 %), no unit",
        _ => "a nominal stress in MPa, no unit",
    }
}

fn checked(mut points: Rows<2>, source: Source<'_>) -> Result<Vec<[f64; 2]>> {
    let at = |([strain, stress], place): ([f64; 2], usize), column: &str, message: String| {
        let value = if column == STRAIN { strain } else { stress };
        source.placed(InputError::new(message).key(column).value(value), place)
    };
    for &point in &points {
        let [strain, stress] = point.0;
        if strain <= -1.0 {
            let wrong = at(point, STRAIN, "no solid can be compressed to nothing".to_owned());
            return Err(wrong.allowed(allowed(STRAIN)));
        }
        if strain * stress < 0.0 {
            let message = format!("this stress has the sign opposite to its strain, {strain}");
            return Err(at(point, STRESS, message).allowed("stress > 0 in tension, < 0 in compression, MPa"));
        }
    }
    points.sort_by(|p, q| p.0[0].total_cmp(&q.0[0]));
    for pair in points.windows(2) {
        let ([p, q], [less, more]) = ([pair[0], pair[1]], [pair[0].0, pair[1].0]);
        let (earlier, later) = if p.1 < q.1 { (p, q) } else { (q, p) };
        let ([strain, stress], line) = (earlier.0, source.words(earlier.1));
        let other = format!("{stress} MPa at strain {strain} in {line}");
        if less[0] == more[0] && less[1] != more[1] {
            let message = format!("strain {strain} has two stresses: this one, and {other}");
            return Err(at(later, STRESS, message).allowed("one stress for each strain"));
        }
        if less[0] < more[0] && less[1] >= more[1] {
            let message = format!(
                "the stress does not rise with the strain: this is at strain {}, but {other}",
                later.0[0]
            );
            return Err(at(later, STRESS, message).allowed("stress strictly increasing with strain"));
        }
    }
    let mut points: Vec<[f64; 2]> = points.into_iter().map(|p| p.0).collect();
    points.dedup_by_key(|p| p[0]);
    let whole = |message: String| source.whole(InputError::new(message).key(STRAIN));
    if points.len() < LEAST {
        let message = format!("a curve needs {LEAST} points of different strain or more");
        let error = whole(message).value(format!("{} points", points.len()));
        return Err(error.allowed(format!("≥ {LEAST} points")));
    }
    let [most, _] = points[points.len() - 1];
    if most <= 0.0 {
        let wrong = whole("this curve has no tension".to_owned()).value(format!("at most {most}"));
        return Err(wrong.allowed("points with strain > 0; compression is optional"));
    }
    Ok(points)
}

/// With `abscissa = true` turns the distances of `space`, abscissae of the resting whisker `built`, into arcs.
pub(super) fn to_arcs(
    sections: &Sections<'_>,
    space: &mut Space,
    built: Option<&Built>,
    axes: &[RigAxis<'_>],
) -> Result<()> {
    let tap = sections.section("tap");
    if !tap.get("abscissa")?.flag()? {
        return Ok(());
    }
    let item = tap.get("abscissa")?;
    let bends = [Property::Curvature, Property::CurvatureSlope];
    let searched = |property: &Property| is_searched(sections, *property);
    if axes.iter().any(|(property, _)| bends.contains(property)) || bends.iter().any(searched) {
        let allowed = "abscissa = false, or one number for curvature and curvature_slope";
        return item.refuse("an abscissa belongs to one curvature, and here it varies", allowed);
    }
    let Space::Grid(factors) = space else {
        let allowed = "abscissa = false, or a in [tap]";
        return item.refuse("a_mm of a tuple file is the arc of the contact", allowed);
    };
    let Some(built) = built.filter(|built| !built.is_straight()) else { return Ok(()) };
    let longest = factors.iter().flat_map(|factor| &factor.axes);
    let longest = longest.filter(|(column, _)| *column == Column::Length).map(|(_, axis)| axis.max());
    let longest = longest.fold(0.0, f64::max);
    let most = rest(built.curvature, longest).x;
    let distances = factors.iter_mut().flat_map(|factor| &mut factor.axes);
    for (_, axis) in distances.filter(|(column, _)| *column == Column::Distance) {
        if axis.max() > most {
            let why = format!("{} mm lies beyond the tip of the whisker at rest", axis.max());
            let allowed = format!("a ≤ {most:.6}, the abscissa of L_a = {longest} mm");
            return tap.get("a")?.refuse(why, allowed);
        }
        let arc = |x: f64| bracketed(|s| rest(built.curvature, s).x - x, 0.0, longest);
        let arcs: Vec<f64> = axis.iter().map(arc).collect();
        *axis = if let [one] = arcs[..] { Axis::Value(one) } else { Axis::List(arcs) };
    }
    Ok(())
}
