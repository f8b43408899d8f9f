//! The tuples: axes to factors, or a tuple file.

use std::path::Path;
use std::sync::Arc;

use super::properties::RigAxis;
use super::{AxisItem, Frame, Item, Result, Sections, properties, tuple_file};
use crate::scene::{COLUMNS, Column, Drive, Listed, Rigs, Space, space::MOST_TAPS};

pub(super) type ColumnKey = (&'static str, &'static str, Column);

pub(super) fn keys(drive: Drive) -> [ColumnKey; COLUMNS] {
    Column::ALL.map(|column| {
        let section = match column {
            Column::BaseDiameter | Column::TipDiameter | Column::Length => "whisker",
            Column::GaugePosition | Column::GridLength => "gauge",
            Column::Distance | Column::Tilt | Column::Lean | Column::Drive => "tap",
        };
        (section, column.key(drive), column)
    })
}

pub(super) struct Read<'a> {
    pub space: Space,
    pub directions: [bool; 2],
    pub leaning: [Option<Item<'a>>; 2],
    pub properties: Vec<RigAxis<'a>>,
    pub rigs: Option<Arc<Rigs>>,
}

pub(super) fn drive(sections: &Sections<'_>) -> Result<Drive> {
    sections.section("tap").get("drive")?.word(&Drive::WORDS)
}

fn written<'a>(sections: &Sections<'a>, drive: Drive) -> Option<Item<'a>> {
    keys(drive).into_iter().find_map(|(section, key, _)| sections.section(section).written(key))
}

pub(super) fn listed<'a>(sections: &Sections<'a>, drive: Drive, frame: Option<&Frame>) -> Result<Read<'a>> {
    let more = [("tap", "delta"), ("tuples", "file"), ("whisker", "profile")];
    let more = || more.into_iter().find_map(|(section, key)| sections.section(section).written(key));
    if let Some(item) = written(sections, Drive::Angle).or_else(more) {
        return Err(item.error("this comes from the tuples; remove one of the two"));
    }
    if let Some((_, axis)) = properties::axes(sections, &mut 0)?.first() {
        return axis.item.refuse("all taps have one rig here", "one number");
    }
    if let Some(frame) = frame {
        return tuple_file::of_frame(sections, drive, frame);
    }
    let space = Space::List(Listed::default());
    Ok(Read { space, directions: [false; 2], leaning: [None, None], properties: Vec::new(), rigs: None })
}

pub(super) fn read<'a>(sections: &Sections<'a>, drive: Drive, base: &Path) -> Result<Read<'a>> {
    let key = Column::Drive.key(drive);
    let other = Column::Drive.key(if drive == Drive::Angle { Drive::Displacement } else { Drive::Angle });
    let tap = sections.section("tap");
    if let Some(item) = tap.written(other) {
        let message = match drive {
            Drive::Angle => "delta needs drive = \"displacement\" in [tap]",
            _ => "with drive = \"displacement\" the object moves by delta; theta has no meaning",
        };
        return item.refuse(message, format!("{key} in place of {other}"));
    }
    let tuples = sections.section("tuples");
    if tuples.user.is_some() {
        if let Some(item) = written(sections, drive) {
            return Err(item.error("this comes from the tuple file of [tuples]; remove one of the two"));
        }
        if let Some((property, axis)) = properties::axes(sections, &mut 0)?.first() {
            let message = "beside a tuple file this is one number, or a column of the file";
            let allowed = format!("a number, or the column {} in the file", property.about().column);
            return axis.item.refuse(message, allowed);
        }
        return tuple_file::read(sections, &tuples.get("file")?, drive, base);
    }

    let mut sampled = 0;
    let (mut axes, mut properties) = (Vec::with_capacity(COLUMNS), Vec::new());
    for (section, key, column) in keys(drive) {
        if column == Column::Distance {
            properties = properties::axes(sections, &mut sampled)?;
        }
        let read = AxisItem::read(sections.section(section).get(key)?, sampled)?;
        sampled += u32::from(read.axis.points().is_some());
        axes.push(read);
    }
    let axes: [AxisItem<'_>; COLUMNS] = axes.try_into().expect("as many as there are columns");
    satisfiable(&axes)?;
    zipped(&axes, &properties)?;
    short(&axes, properties.iter().any(|(_, axis)| axis.axis.points().is_some()))?;
    let directions = ["tilt", "lean"].map(|key| tap.written(key).is_some());
    let leaning = [Column::Tilt, Column::Lean].map(|column| {
        let AxisItem { item, axis } = &axes[column as usize];
        (axis.min() != 0.0 || axis.max() != 0.0).then(|| item.clone())
    });
    let space = grid(axes, &properties)?;
    let rigs = if let Space::Grid(factors) = &space { Rigs::crossed(factors) } else { None };
    let rigs = rigs.map(Arc::new);
    Ok(Read { space, directions, leaning, properties, rigs })
}

fn zipped(axes: &[AxisItem<'_>; COLUMNS], properties: &[RigAxis<'_>]) -> Result<()> {
    let (design, taps) = axes.split_at(Column::Distance as usize);
    let all = design.iter().chain(properties.iter().map(|(_, axis)| axis)).chain(taps);
    let mut sampled = all.filter_map(|a| Some((a, a.axis.points()?)));
    let Some((first, points)) = sampled.next() else { return Ok(()) };
    let is_a = |item: &AxisItem<'_>| item.item.key == axes[5].item.key;
    for (other, others) in sampled {
        let (key, first_key) = (&other.item.key, &first.item.key);
        if is_a(first) || is_a(other) {
            let message =
                format!("{first_key} and {key} are both sampled; a is sampled only if no other axis is");
            return Err(axes[5].item.error(message).allowed("a value, a list or a range for a"));
        }
        let differ = [
            ("samples", others.samples != points.samples),
            ("sampler", others.sampler != points.sampler),
            ("seed", others.seed != points.seed),
        ];
        let Some((differing, _)) = differ.into_iter().find(|(_, differs)| *differs) else { continue };
        let place = other.item.child(differing).unwrap_or_else(|| other.item.clone());
        let message = format!("{first_key} and {key} are sampled together, but differ in {differing}");
        return place.refuse(message, "the same samples, sampler and seed for all sampled axes");
    }
    Ok(())
}

/// Refuses designs with more taps (distances at all tilts, leans and drives that are not sampled with the design) than are held in memory.
fn short(axes: &[AxisItem<'_>; COLUMNS], rigs_sampled: bool) -> Result<()> {
    let [whisker @ .., a, tilt, lean, drive] = axes;
    let sampled = |x: &AxisItem<'_>| x.axis.points().is_some();
    let zipped = rigs_sampled || whisker.iter().any(sampled);
    let (mut taps, mut samples, mut longest) = (a.axis.len(), 1, a);
    for part in [tilt, lean, drive].into_iter().filter(|x| !(zipped && sampled(x))) {
        if sampled(part) {
            samples = part.axis.len();
        } else {
            taps = taps.saturating_mul(part.axis.len());
        }
        longest = if part.axis.len() > longest.axis.len() { part } else { longest };
    }
    let n = taps.saturating_mul(samples);
    let message = format!("one design would have {n} taps, all its distances at all tilts, leans and drives");
    let allowed = format!(
        "{MOST_TAPS} at most: fewer values here, or samples, as in {{ min = …, max = …, samples = N }} for the drive and an axis of the whisker, which belong together"
    );
    longest.item.refuse_if(n > MOST_TAPS, message, allowed)
}

fn grid(axes: [AxisItem<'_>; COLUMNS], properties: &[RigAxis<'_>]) -> Result<Space> {
    let all = axes.iter().chain(properties.iter().map(|(_, axis)| axis));
    let largest = all.max_by_key(|a| a.axis.len()).map(|a| a.item.clone());
    let several = properties.iter().filter(|(_, axis)| axis.axis.len() > 1);
    let several = several.map(|(property, axis)| (*property, axis.axis.clone())).collect();
    Space::with(axes.map(|a| a.axis), several).ok_or_else(|| {
        let message = "all axes together have more than 2^64 tuples; make this axis shorter";
        largest.expect("there are axes").error(message)
    })
}

/// `part ≤ whole`, but for the rounding of a sum of decimal numbers.
fn fits(part: f64, whole: f64) -> bool {
    part <= whole * (1.0 + 1e-12)
}

fn satisfiable(axes: &[AxisItem<'_>; COLUMNS]) -> Result<()> {
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
    let gauge = format!("x_ss + l, {first} + {shortest}");
    for (least, what) in [(nearest, format!("a, {nearest}")), (first + shortest, gauge)] {
        if let Some((length, item)) = length.first_where(longest, |length| !fits(least, length)) {
            let message = format!("a whisker of L_a = {length} mm is shorter than the smallest {what} mm");
            return item.refuse(message, format!("L_a ≥ {least} mm"));
        }
    }
    Ok(())
}
