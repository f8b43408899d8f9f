//! Several taps of one object: after each tap, the distance that all of them so far tell.

use std::cell::OnceCell;

use indexmap::IndexMap;

use super::pairs::{PairObject, Parts};
use super::{Answerer, Ask, Located, Locator, Opened, Reading, Spatial, free::Free};
use crate::error::{InputError, nearest};
use crate::{sink::LabCell, status::Status};
use vibrissa_core::normal::quantile;
use vibrissa_learned::joint::{Object, Tap, Told};

/// The column that names the object, where none is said.
pub const NAME: &str = "object";
/// Objects that are known at a time; the one that was tapped longest ago goes first.
const MOST: usize = 256;
/// Chance that sound taps are said to contradict each other.
const CHANCE: f64 = 0.001;

/// The column that says how much nearer to the object the base stood, mm.
pub const SHIFT: &str = "shift_mm";

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum By<'a> {
    /// Not said: in a file, those of one value in its column `object`, if it has one.
    Unsaid,
    Same,
    Column(&'a str),
    /// Not taps, but readings of strokes, which leave this free.
    Strokes(Free),
}

/// The numbers and the status that readings tell together.
pub type Shared = Option<(Vec<f64>, Status)>;

/// An object, and the lines of the taps of it that are compared, the last at the end.
struct Known<'a> {
    /// By one gauge, with the side and taring of its first tap, which others have too.
    one: Option<(Object<'a>, (usize, bool))>,
    two: PairObject,
    lines: Vec<usize>,
}

pub struct Objects<'a> {
    locator: &'a Locator,
    /// Place of the column; none where all readings are of one object.
    pub(super) place: Option<usize>,
    shift: Option<usize>,
    /// By name, the one that was tapped last at the end.
    known: IndexMap<String, Known<'a>>,
    forgets: OnceCell<()>,
    unplaced: OnceCell<()>,
    other_side: OnceCell<()>,
}

impl<'a> Objects<'a> {
    /// Checks that `who` can take taps of one object together, if something that was said (`by`) tells them apart.
    pub fn can(who: Answerer<'_>, by: By<'_>) -> Result<(), InputError> {
        let locator = who.first();
        let two = who.is_twofold() && !matches!(by, By::Strokes(_));
        let learned = who.is_alone() && locator.sides.iter().any(|side| side.learned().is_some());
        if by == By::Unsaid || two || learned {
            return Ok(());
        }
        let key = match by {
            By::Same => "--same",
            By::Strokes(_) => "--strokes",
            _ => "--object",
        };
        let estimator = match who.finds_drives() {
            true => "several channels",
            false if who.is_twofold() => "two gauges",
            false => locator.estimator.word(),
        };
        let message = "readings are taken together by `learned`, of one signal, and taps by two gauges";
        let error = InputError::new(message).key(key).value(estimator);
        Err(error.allowed("a calibration of one signal by learned"))
    }

    /// Of readings of columns with these `names`; `None` where nothing tells them apart.
    pub fn new(who: Answerer<'a>, names: &[String], ask: &Ask<'_>) -> Result<Option<Self>, InputError> {
        let of = |name: &str| names.iter().position(|n| n == name);
        let place = match (ask.by, of(NAME)) {
            (By::Unsaid, None) => return Ok(None),
            (By::Unsaid, Some(_)) if !ask.keep => {
                (ask.warn)(
                    "column object is not looked at; with --object object the taps of each are taken together",
                );
                return Ok(None);
            }
            (By::Unsaid, place) => place,
            (By::Same | By::Strokes(_), _) => None,
            (By::Column(name), _) => Some(of(name).ok_or_else(|| {
                let error = InputError::new("there is no such column").key("--object").value(name);
                error.allowed(names.join(", "))
            })?),
        };
        if let Err(e) = Self::can(who, By::Same) {
            // A column of a file only: --same and --object were refused before the first line.
            (ask.warn)(&format!("column object is not looked at: {}", e.message));
            return Ok(None);
        }
        let (locator, shift, known) = (who.first(), shift_column(names)?, IndexMap::new());
        let (forgets, unplaced, other_side) = Default::default();
        Ok(Some(Self { locator, place, shift, known, forgets, unplaced, other_side }))
    }

    /// Adds a `tap`, whose own answer is `alone`; the numbers and the status that all taps of its object tell. `None` of a tap without object, shift or distance.
    pub fn tell(&mut self, cells: &[LabCell<'_>], tap: &Reading, alone: &Spatial, ask: &Ask<'_>) -> Shared {
        let (name, line) = (named(self.place, cells), tap.line);
        if self.place.is_some() && name.is_empty() || alone.located.distance.is_nan() {
            return None;
        }
        let said = |place| cells.get(place).and_then(LabCell::number).unwrap_or(f64::NAN);
        let shift = self.shift.map_or(0.0, said);
        if shift.is_nan() {
            let told = format!("line {line}: {SHIFT} is no number: such a tap tells nothing of its object");
            self.unplaced.get_or_init(|| (ask.warn)(&told));
            return None;
        }
        let (locator, same_run) = (self.locator, self.locator.same_run);
        // The tap's own answer, from where the base stands without shift.
        let Located { distance, interval, .. } = alone.located;
        let interval = interval.map(|end| end + shift);
        let mut located = Located { distance: distance + shift, interval, ..alone.located };
        let mut tilt = [alone.tilt, alone.sigma_tilt];
        let (lines, count, compared, apart) = if let Some(parts) = alone.parts {
            let Known { two: object, lines, .. } = self.known(&name, ask);
            if !object.add(Parts { at: [parts.at[0] + shift, parts.at[1]], ..parts }, tap.zeros) {
                return None;
            }
            let count = object.count;
            if let Some([[a, tilted], [sigma, sigma_tilt]]) = object.told().filter(|_| count > 1) {
                let side = &locator.sides[locator.twofold.as_ref()?.side];
                located = Located::normal(a, sigma, side.doubts(a - shift, None, sigma));
                tilt = [tilted, sigma_tilt].map(f64::to_degrees);
            }
            (lines, count, object.taps.len(), object.apart())
        } else {
            let asked = locator.asked(tap.drive, tap.signals[0]).ok()?;
            let learned = locator.sides[asked.side].learned()?;
            let (tared, y, of_zero) = learned.read(asked.signal, tap.shares[0]);
            let kind = (asked.side, tared);
            let joint = learned.joint(tared, false);
            let Known { one, lines, .. } = self.known(&name, ask);
            let (object, its_kind) = one.get_or_insert_with(|| (Object::new(joint, same_run), kind));
            let (side, other) = (&locator.sides[its_kind.0], *its_kind != kind);
            if !other {
                object.add(Tap { u: asked.drive, y, of_zero, zero: tap.zeros, shift });
            }
            let count = object.count;
            let told = if count > 1 || other { object.told() } else { None };
            if count > 1 || other {
                located = told.as_ref().map_or(Located::nothing(Status::NO_ROOT), |told| {
                    let normal = Located::normal(told.a, told.sigma, doubts(side, object, told));
                    let of = side.learned().filter(|_| ask.interval);
                    let interval = of.map(|of| of.ends(object, told, its_kind.1, same_run));
                    Located { interval: interval.unwrap_or(normal.interval), ..normal }
                });
            }
            if other {
                let numbers = numbers(count, &located, [f64::NAN; 2], None);
                self.other_side.get_or_init(|| {
                    (ask.warn)(&format!(
                        "line {line}: an object is told by taps of one side, above zeros of one kind, those of its first tap; such a tap is told alone"
                    ))
                });
                return Some((numbers, located.status));
            }
            let apart = told.as_ref().and_then(|told| object.apart(told.a));
            (lines, count, object.taps.len(), apart)
        };
        lines.push(line);
        lines.drain(..lines.len().saturating_sub(compared));
        let apart = apart.map(|(ago, by)| (lines[lines.len() - 1 - ago], by));
        // Distance and tilt together are never negative.
        let of_two = (2.0 * (lines.len() as f64 / CHANCE).ln()).sqrt();
        let limit = if alone.parts.is_some() { of_two } else { limit(lines.len()) };
        if apart.is_some_and(|(_, by)| by.abs() > limit) {
            located.status |= Status::INCONSISTENT;
        }
        Some((numbers(count, &located, tilt, apart), located.status))
    }

    /// The object `name`, else a new one in place of the oldest of too many.
    fn known(&mut self, name: &str, ask: &Ask<'_>) -> &mut Known<'a> {
        let known = self.known.shift_remove(name);
        if known.is_none() && self.known.len() == MOST {
            self.known.shift_remove_index(0);
            self.forgets.get_or_init(|| {
                (ask.warn)(&format!(
                    "more than {MOST} objects: of the one that was tapped longest ago, taps that come later are those of another one"
                ))
            });
        }
        let known = known.unwrap_or_else(|| Known { one: None, two: PairObject::new(), lines: Vec::new() });
        self.known.entry(name.to_owned()).or_insert(known)
    }
}

/// What a column at this place says; empty without one.
pub(super) fn named(place: Option<usize>, cells: &[LabCell<'_>]) -> String {
    place.and_then(|place| cells.get(place)).map_or_else(String::new, |cell| cell.text().into_owned())
}

/// The numbers in the order of the columns; tilt with its standard deviation, degrees; `apart`: line of the farthest tap, and its standard deviations.
fn numbers(taps: usize, located: &Located, tilt: [f64; 2], apart: Option<(usize, f64)>) -> Vec<f64> {
    let Located { distance, sigma, interval: [from, to], .. } = *located;
    let (line, by) = apart.map_or((f64::NAN, f64::NAN), |(line, by)| (line as f64, hundredths(by)));
    vec![taps as f64, distance, sigma, from, to, tilt[0], tilt[1], line, by]
}

/// A number of standard deviations: more digits than two say nothing.
pub(super) fn hundredths(by: f64) -> f64 {
    (100.0 * by).round() / 100.0 + 0.0
}

pub(super) fn doubts(side: &Opened, object: &Object<'_>, told: &Told) -> Status {
    object.seen(told.a).into_iter().fold(Status::OK, |all, a| {
        // The other distance is judged as seen from the same base.
        all | side.doubts(a, told.near.map(|near| near - told.a + a), told.sigma)
    })
}

/// Standard deviations beyond which the farthest of `n` sound taps is but by [`CHANCE`] (Bonferroni).
pub(crate) fn limit(n: usize) -> f64 {
    quantile(1.0 - 0.5 * CHANCE / n as f64)
}

pub fn shift_column(names: &[String]) -> Result<Option<usize>, InputError> {
    let found = names.iter().position(|n| n == SHIFT);
    let known = |part: &str| ["base", "shift", "mm", "cm", "m"].contains(&part);
    let like = |n: &&String| {
        let (near, lower) = (nearest(n, &[SHIFT]).is_some(), n.to_lowercase());
        near || lower.split('_').all(known) && lower.split('_').any(|part| part == "shift")
    };
    let Some(name) = names.iter().find(like).filter(|_| found.is_none()) else { return Ok(found) };
    let message = "this is nearly the column of the shift of the base, and would not be looked at";
    Err(InputError::new(message).key(name).allowed(format!("{SHIFT}, in mm; or a name unlike it")))
}
