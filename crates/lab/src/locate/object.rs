//! Several taps of one object: after each tap, the distance that all of them so far tell.

use indexmap::IndexMap;
use vibrissa_core::normal::quantile;
use vibrissa_learned::joint::{Object, Tap, Told};

use super::free::Free;
use super::opened::Opened;
use super::pair::Spatial;
use super::pairs::{self, PairObject, Parts};
use super::rows::{Answerer, Reading};
use super::sequence::{SHIFT, shift_column};
use super::stream::Ask;
use super::tared::Once;
use super::{Located, Locator};
use crate::error::InputError;
use crate::estimator::learned::LearnedCurve;
use crate::sink::lab::LabCell;
use crate::status::Status;

/// The column that names the object, where none is said.
pub const NAME: &str = "object";
/// Objects that are known at a time; the one that was tapped longest ago goes first.
const MOST: usize = 256;
/// One gauge tells no tilt.
const NO_TILT: [f64; 2] = [f64::NAN; 2];
/// Chance that sound taps are said to contradict each other.
const CHANCE: f64 = 0.001;

/// Which readings are of one object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum By<'a> {
    /// Nobody said; in a file a column `object` says it.
    Unsaid,
    /// All of them.
    Same,
    /// Those of one value in this column.
    Column(&'a str),
    /// Not taps, but readings of strokes, which leave this free.
    Strokes(Free),
}

/// What all taps of an object so far tell.
pub(super) struct Together {
    pub taps: usize,
    pub located: Located,
    /// By two gauges the tilt and its standard deviation, degrees.
    pub tilt: [f64; 2],
    /// Line of the tap that is farthest from what the others say, and by how many standard deviations.
    pub apart: Option<(usize, f64)>,
}

/// The taps of an object, by one gauge or by two.
enum Taps {
    /// With the side and taring of its first tap, which others have too.
    One(Object, (usize, bool)),
    Two(PairObject),
}

/// An object, and the lines of the taps of it that are compared, the last at the end.
struct Known {
    object: Taps,
    lines: Vec<usize>,
}

impl Known {
    /// Adds the line of a tap; so many taps are `compared`.
    fn add(&mut self, line: usize, compared: usize) {
        self.lines.push(line);
        self.lines.drain(..self.lines.len().saturating_sub(compared));
    }

    /// With the line of the tap that was so long ago.
    fn line_of(&self, apart: Option<(usize, f64)>) -> Option<(usize, f64)> {
        apart.map(|(ago, by)| (self.lines[self.lines.len() - 1 - ago], by))
    }
}

/// Objects and their taps.
pub struct Objects<'a> {
    locator: &'a Locator,
    /// Place of the column; none where all readings are of one object.
    place: Option<usize>,
    /// Place of the column [`SHIFT`].
    shift: Option<usize>,
    /// By name, the one that was tapped last at the end.
    known: IndexMap<String, Known>,
    forgets: Once,
    unplaced: Once,
    other_side: Once,
}

impl<'a> Objects<'a> {
    /// Whether `who` can take taps of one object together, if they are told apart `by` something that was said.
    ///
    /// # Errors
    /// Several signals, and estimators that tell each tap alone.
    pub fn can(who: Answerer<'_>, by: By<'_>) -> Result<(), InputError> {
        let locator = who.first();
        let two = who.is_twofold() && !matches!(by, By::Strokes(_));
        if by == By::Unsaid
            || two
            || who.is_alone() && locator.sides().iter().any(|side| side.learned().is_some())
        {
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
            false => locator.estimator.name(),
        };
        let error = InputError::new(
            "readings are taken together by `learned`, of one signal, and taps by two gauges",
        );
        Err(error.key(key).value(estimator).allowed("a calibration of one signal by learned"))
    }

    /// Of readings of columns with these `names`; `None` where nothing tells them apart.
    pub(super) fn new(
        who: Answerer<'a>,
        names: &[String],
        ask: &Ask<'_>,
    ) -> Result<Option<Self>, InputError> {
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

    /// The object of a line with these fields.
    pub fn name(&self, cells: &[LabCell<'_>]) -> String {
        self.place.and_then(|place| cells.get(place)).map(LabCell::to_string).unwrap_or_default()
    }

    /// Adds a `tap` of a line with these fields, which `alone` is its own answer, of two gauges made of `parts`. `None` where it tells nothing: it is
    /// of no object, its base stands where nothing says, or it has no distance of its own, at an end stop or beyond any.
    pub(super) fn tell(
        &mut self,
        cells: &[LabCell<'_>],
        tap: &Reading,
        (alone, parts): (&Spatial, Option<Parts>),
        ask: &Ask<'_>,
    ) -> Option<Together> {
        let name = self.name(cells);
        if self.place.is_some() && name.is_empty() || alone.located.distance.is_nan() {
            return None;
        }
        // How much nearer to the object the base stood.
        let said = |place| cells.get(place).and_then(LabCell::number).unwrap_or(f64::NAN);
        let shift = self.shift.map_or(0.0, said);
        if shift.is_nan() {
            let line = tap.line;
            let told =
                || format!("line {line}: {SHIFT} is no number: such a tap tells nothing of its object");
            self.unplaced.warn(ask, told);
            return None;
        }
        match parts {
            Some(parts) => self.tell_pair(&name, (tap, shift), alone, parts.moved(shift), ask),
            None => self.tell_one(&name, (tap, shift), &alone.located, ask),
        }
    }

    /// The object `name`, else one that `new` makes in place of the oldest of too many.
    fn known(&mut self, name: &str, ask: &Ask<'_>, new: impl FnOnce() -> Taps) -> &mut Known {
        let known = self.known.shift_remove(name);
        if known.is_none() && self.known.len() == MOST {
            self.known.shift_remove_index(0);
            self.forgets.warn(ask, || {
                format!(
                    "more than {MOST} objects: of the one that was tapped longest ago, taps that come later are those of another one"
                )
            });
        }
        let known = known.unwrap_or_else(|| Known { object: new(), lines: Vec::new() });
        self.known.entry(name.to_owned()).or_insert(known)
    }

    fn tell_one(
        &mut self,
        name: &str,
        (tap, shift): (&Reading, f64),
        alone: &Located,
        ask: &Ask<'_>,
    ) -> Option<Together> {
        let locator = self.locator;
        let asked = locator.asked(tap.drive, tap.signals[0]).ok()?;
        let learned = locator.sides()[asked.side].learned()?;
        let (tared, y, of_zero) = learned.read(asked.signal, tap.shares[0]);
        let kind = (asked.side, tared);
        let known = self.known(name, ask, || Taps::One(Object::new(learned.joint(tared)), kind));
        let Taps::One(object, its_kind) = &mut known.object else { return None };
        let together = |object: &Object, located, apart| {
            Some(Together { taps: object.count(), located, tilt: NO_TILT, apart })
        };
        if *its_kind != kind {
            let (side, tared) = (&locator.sides()[its_kind.0], its_kind.1);
            let told = side
                .learned()
                .and_then(|learned| located(side, learned, (object, tared), ask, locator.same_run));
            let found = together(object, told.map_or(Located::nothing(Status::NO_ROOT), |told| told.0), None);
            let line = tap.line;
            self.other_side.warn(ask, || {
                format!(
                    "line {line}: an object is told by taps of one side, above zeros of one kind, those of its first tap; such a tap is told alone"
                )
            });
            return found;
        }
        let joint = learned.joint(tared);
        object.add(joint, Tap { u: asked.drive, y, of_zero, zero: tap.zeros, shift }, locator.same_run);
        let compared = object.compared();
        known.add(tap.line, compared);
        let Taps::One(object, _) = &known.object else { return None };
        if object.count() == 1 {
            let interval = alone.interval.map(|end| end + shift);
            let located = Located { distance: alone.distance + shift, interval, ..*alone };
            return together(object, located, None);
        }
        let side = &locator.sides()[asked.side];
        let Some((mut located, told)) = located(side, learned, (object, tared), ask, locator.same_run) else {
            return together(object, Located::nothing(Status::NO_ROOT), None);
        };
        let apart = known.line_of(object.apart(joint, told.a, locator.same_run));
        if apart.is_some_and(|(_, by)| by.abs() > limit(known.lines.len())) {
            located.status |= Status::INCONSISTENT;
        }
        together(object, located, apart)
    }

    fn tell_pair(
        &mut self,
        name: &str,
        (tap, shift): (&Reading, f64),
        alone: &Spatial,
        parts: Parts,
        ask: &Ask<'_>,
    ) -> Option<Together> {
        let locator = self.locator;
        let known = self.known(name, ask, || Taps::Two(PairObject::new()));
        let Taps::Two(object) = &mut known.object else { return None };
        if !object.add(parts, tap.zeros) {
            return None;
        }
        let (taps, compared, apart) = (object.count(), object.compared(), object.apart());
        let told = object.told().filter(|_| taps > 1);
        known.add(tap.line, compared);
        let Some(told) = told else {
            let tilt = [alone.tilt, alone.sigma_tilt];
            let located = Located::normal(parts.at[0], alone.located.sigma, alone.located.status);
            return Some(Together { taps, located, tilt, apart: None });
        };
        let apart = known.line_of(apart);
        let side = &locator.sides()[locator.twofold.as_ref()?.side];
        let mut status = side.doubts(told.at[0] - shift, None, told.sigma[0]);
        if apart.is_some_and(|(_, by)| by > pairs::limit(known.lines.len(), CHANCE)) {
            status |= Status::INCONSISTENT;
        }
        let located = Located::normal(told.at[0], told.sigma[0], status);
        Some(Together { taps, located, tilt: [told.at[1], told.sigma[1]].map(f64::to_degrees), apart })
    }
}

/// What the taps of an `object` of one `side` tell, whose zeros are of one kind or not (`tared`), with the interval where it is asked for.
fn located(
    side: &Opened,
    learned: &LearnedCurve,
    (object, tared): (&Object, bool),
    ask: &Ask<'_>,
    same_run: bool,
) -> Option<(Located, Told)> {
    let told = object.told(learned.joint(tared))?;
    let normal = Located::normal(told.a, told.sigma, doubts(side, object, &told));
    let interval = ask.interval.then(|| learned.ends(object, &told, tared, same_run));
    Some((Located { interval: interval.unwrap_or(normal.interval), ..normal }, told))
}

/// Words of warning of what the taps of an object tell.
pub(super) fn doubts(side: &Opened, object: &Object, told: &Told) -> Status {
    object.seen(told.a).into_iter().fold(Status::OK, |all, a| {
        // Of another distance what counts is where it would be seen from the same base.
        all | side.doubts(a, told.near.map(|near| near - told.a + a), told.sigma)
    })
}

/// Standard deviations beyond which the farthest of `n` sound taps is but by [`CHANCE`] (Bonferroni).
pub(crate) fn limit(n: usize) -> f64 {
    quantile(1.0 - 0.5 * CHANCE / n as f64)
}
