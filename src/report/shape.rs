//! Figures of bent whiskers.

use super::designs::{self, Alike, DIRECTIONS, DRIVES, WHISKER};
use super::located::{beside, ellipse};
use super::quantity::{self, told_apart};
use super::{Content, Source, answer};
use crate::digits::short;
use crate::error::{Error, InputError};
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path, series};
use crate::sink::Frame;

/// Most panels; below, most whiskers in a panel.
const PANELS: usize = 6;
const WHISKERS: usize = 4;

pub fn content(source: &Source) -> Result<Content, Error> {
    let mut c = Content::default();
    let (shape, contacts) = (source.table("shape.csv")?, source.table("contacts.csv")?);
    let drive = contacts.one_of(&DRIVES)?;
    c.answer = answer::of_shapes(&contacts, drive)?;
    let taps = taps(&shape, &contacts)?;
    let solved = contacts.rows(|r| contacts.number("contact_x_mm", r).is_finite());
    if solved.is_empty() {
        c.notes.push("no tap has a shape: see their status".to_owned());
    }
    let directions = DIRECTIONS.into_iter().filter(|name| contacts.has(name));
    let names: Vec<&str> = WHISKER.into_iter().chain(["a_mm"]).chain(directions).collect();
    let (shown, of) = designs::alike(&contacts, &names, solved, |_| f64::INFINITY, PANELS)?;
    let left = match of > PANELS {
        true => format!("; {PANELS} of {of} whiskers and distances are shown"),
        false => String::new(),
    };
    let (mut drawn, mut strains) = (Vec::new(), Vec::new());
    let names = told_apart(drive, contacts.numbers(drive)?);
    for Alike { name: title, rows } in shown {
        let n = rows.len().min(WHISKERS);
        let some: Vec<usize> =
            (0..n).map(|i| rows[if n < 2 { 0 } else { i * (rows.len() - 1) / (n - 1) }]).collect();
        drawn.push(whiskers(&title, &shape, &contacts, &taps, &some, &names, source)?);
        let mut panel =
            Panel::new(title, quantity::axis("s_mm"), Axis::new("strain of the contact side", ""));
        for (i, r) in some.iter().enumerate() {
            let nodes = &taps[*r];
            let points = nodes.iter().map(|k| (shape.number("s_mm", *k), shape.number("strain", *k)));
            panel = panel.with(Mark::series(i, names[*r].clone(), points));
        }
        let [x1, x2] = ["gauge_from_mm", "gauge_to_mm"].map(|n| contacts.number(n, rows[0]));
        let most =
            some.iter().flat_map(|r| &taps[*r]).map(|k| shape.number("strain", *k)).fold(0.0, f64::max);
        let gauge = Path::new("gauge", 4, [(x1, 0.0), (x2, 0.0), (x2, most), (x1, most)]);
        panel = panel.with(Mark::Area { path: gauge, outlined: false });
        strains.push(panel);
    }
    c.figure(Figure::new("whisker", "The bent whisker", format!("The whisker to scale at several taps, turned about the motor's axis (+) towards the pole; the thick side is the gauge, the dot the contact, the dashed line the whisker at first touch (shape.csv, contacts.csv){left}."), drawn));
    c.figure(Figure::new("strain_along", "Strain along the whisker", format!("Strain of the side that touches, along the whisker; the span of the gauge is shaded (shape.csv){left}."), strains));
    c.fact("taps", &contacts.len().into());
    c.first(&contacts, false);
    c.first(&shape, false);
    Ok(c)
}

/// Rows of shape.csv for each tap, in the order of contacts.csv.
fn taps(shape: &Frame, contacts: &Frame) -> Result<Vec<Vec<usize>>, InputError> {
    let tap = shape.numbers("tap")?;
    let mut all = vec![Vec::new(); contacts.len()];
    for (k, t) in tap.iter().enumerate() {
        let known = all.get_mut(*t as usize).filter(|_| *t >= 0.0 && t.fract() == 0.0);
        let damaged = || {
            InputError::new("there is no such tap in contacts.csv")
                .at(shape.file.clone(), Some(k + 2))
                .key("tap")
                .value(short(*t))
        };
        known.ok_or_else(damaged)?.push(k);
    }
    Ok(all)
}

/// Outline, gauge, contact and pole of the taps `rows`.
fn whiskers(
    title: &str,
    shape: &Frame,
    contacts: &Frame,
    taps: &[Vec<usize>],
    rows: &[usize],
    names: &[String],
    source: &Source,
) -> Result<Panel, InputError> {
    let mut panel = Panel::new(title, quantity::axis("x_mm"), quantity::axis("y_mm"));
    panel.to_scale = true;
    let [x, y, s, psi] = ["x_mm", "y_mm", "s_mm", "direction_deg"].map(|n| shape.numbers(n));
    let (x, y, s, psi) = (x?, y?, s?, psi?);
    let number = |n: &str, r: usize| contacts.number(n, r);
    // Only whiskers other than cones have this column.
    let wide = shape.has("diameter_mm").then(|| shape.numbers("diameter_mm")).transpose()?;
    let hub = number("hub_mm", rows[0]);
    let length = number("L_a_mm", rows[0]);
    let bent =
        ["whisker.curvature", "whisker.curvature_slope"].iter().any(|key| source.in_force(key).is_some());
    if !bent {
        panel = panel.with(Mark::line(Path::new("at first touch", 7, [(hub, 0.0), (hub + length, 0.0)]), 1));
    }
    for (i, r) in rows.iter().enumerate() {
        let nodes = &taps[*r];
        let (d0, d1) = (number("D_mm", *r), number("d_tip_mm", *r));
        let radius = |k: usize| 0.5 * wide.map_or(d0 + (d1 - d0) * s[k] / length, |wide| wide[k]);
        let side = |k: usize, sign: f64| beside([x[k], y[k]], psi[k], sign * radius(k));
        let upper = nodes.iter().map(|k| side(*k, 1.0));
        let edge = upper.chain(nodes.iter().rev().map(|k| side(*k, -1.0)));
        let name = names[*r].as_str();
        panel = panel.with(Mark::Area { path: Path::new(name, series(i).0, edge), outlined: true });
        let far = source.in_force("gauge.side").is_some_and(|t| t.contains("far"));
        let sign = if far { -1.0 } else { 1.0 };
        let [x1, x2] = ["gauge_from_mm", "gauge_to_mm"].map(|n| number(n, *r));
        let under = nodes.iter().filter(|k| (x1..=x2).contains(&s[**k])).map(|k| side(*k, sign));
        panel = panel.with(Mark::line(Path::new("gauge", 4, under), 0));
    }
    for r in rows {
        let [x, y, radius] = ["pole_x_mm", "pole_y_mm", "pole_radius_mm"].map(|name| number(name, *r));
        if radius > 0.0 {
            let around = ellipse([x, y], [radius; 2], 0.0, 48);
            panel = panel.with(Mark::Area { path: Path::new("pole", 7, around), outlined: true });
        }
    }
    let contact = rows.iter().map(|r| (number("contact_x_mm", *r), number("contact_y_mm", *r)));
    panel = panel.with(Mark::points(Path::new("contact", 4, contact), Marker::Circle));
    Ok(panel.with(Mark::points(Path::new("motor's axis", 4, [(0.0, 0.0)]), Marker::Plus)))
}
