//! Several taps of one object: after each tap, the distance that all of them so far tell.

use std::collections::HashMap;

use vibrissa_core::normal::quantile;
use vibrissa_learned::joint::{Joint, Object, Tap, Told};

use super::free::Free;
pub use super::known::UnlocatedTap;
use super::known::{Known, Taps};
use super::opened::Opened;
use super::pair::Spatial;
use super::pairs::{self, PairObject, Parts};
use super::rows::{Answerer, RowReader};
use super::sequence::{SHIFT, shift_column};
pub use super::several::Together;
use super::stream::Ask;
use super::table::Reading as Row;
use super::{Located, Locator};
use crate::error::InputError;
use crate::estimator::learnt::LearnedCurve;
use crate::sink::heading::heading;
use crate::sink::lab::LabCell;
use crate::status::Status;

/// How many of these there always are but for the object.
pub const COLUMNS: usize = 6;
/// The column that names the object, where none is said.
pub const NAME: &str = "object";
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

/// Objects and their taps.
pub struct Objects<'a> {
    locator: &'a Locator,
    /// Place of the column; none where all readings are of one object.
    place: Option<usize>,
    /// Place of the column [`SHIFT`].
    shift: Option<usize>,
    known: HashMap<String, Known>,
    clock: u64,
    /// Whether it was said that objects are forgotten.
    warned: bool,
    /// Whether it was said that a tap has no place.
    unplaced: bool,
    /// Whether it was said that a tap is of another side than the first.
    other_side: bool,
}

impl<'a> Objects<'a> {
    /// Whether `who` can take taps of one object together, if they are told apart `by` something that was said.
    ///
    /// # Errors
    /// Several signals, and estimators that tell each tap alone.
    pub fn can(who: Answerer<'_>, by: By<'_>) -> Result<(), InputError> {
        let locator = who.first();
        let two = who.is_twofold() && !matches!(by, By::Strokes(_));
        if by == By::Unsaid || two || who.is_alone() && locator.is_learned() {
            return Ok(());
        }
        let key = match by {
            By::Same => "--same",
            By::Strokes(_) => "--strokes",
            _ => "--object",
        };
        let estimator = match who {
            Answerer::Several(_) => "several channels",
            Answerer::One(_) if locator.is_twofold() => "two gauges",
            Answerer::One(_) => locator.estimator.name(),
        };
        let error = InputError::new(
            "readings are taken together by `learned`, of one signal, and taps by two gauges",
        );
        Err(error.key(key).value(estimator).allowed("a calibration of one signal by learned"))
    }

    /// Of readings, where they are told apart.
    ///
    /// # Errors
    /// A column that is not there.
    pub fn new(rows: &RowReader<'a>, ask: &Ask<'_>) -> Result<Option<Self>, InputError> {
        Self::of(rows.who, &rows.names(), ask)
    }

    /// Of readings of these columns.
    ///
    /// # Errors
    /// A column that is not there.
    pub fn of(who: Answerer<'a>, names: &[String], ask: &Ask<'_>) -> Result<Option<Self>, InputError> {
        let of = |name: &str| names.iter().position(|n| n == name);
        let place = match ask.by {
            By::Unsaid if !ask.keep => {
                if of(NAME).is_some() {
                    (ask.warn)(
                        "column object is not looked at; with --object object the taps of each are taken together",
                    );
                }
                return Ok(None);
            }
            By::Unsaid => match of(NAME) {
                Some(place) => Some(place),
                None => return Ok(None),
            },
            By::Same | By::Strokes(_) => None,
            By::Column(name) => match of(name) {
                Some(place) => Some(place),
                None => {
                    let error = InputError::new("there is no such column").key("--object").value(name);
                    return Err(error.allowed(names.join(", ")));
                }
            },
        };
        if let Err(e) = Self::can(who, By::Same) {
            // A column of a file only: --same and --object were refused before the first line.
            (ask.warn)(&format!("column object is not looked at: {}", e.message));
            return Ok(None);
        }
        Ok(Some(Self {
            locator: who.first(),
            place,
            shift: shift_column(names)?,
            known: HashMap::new(),
            clock: 0,
            warned: false,
            unplaced: false,
            other_side: false,
        }))
    }

    /// Columns that are added after the status, and before them the object where the line does not keep it.
    pub fn columns(by: By<'_>, keep: bool, [twofold, interval]: [bool; 2]) -> Vec<&'static str> {
        let named = !keep && matches!(by, By::Column(_));
        let wanted = |name: &&str| match *name {
            NAME => named,
            name if name.ends_with("_95_mm") => interval,
            name if name.ends_with("tilt_deg") => twofold,
            _ => true,
        };
        heading("together").names_as(&[]).into_iter().filter(wanted).collect()
    }

    /// The object of a line with these fields.
    pub fn name(&self, cells: &[LabCell<'_>]) -> String {
        self.place.and_then(|place| cells.get(place)).map(LabCell::to_string).unwrap_or_default()
    }

    /// How much nearer to the object the base stood; NaN where no number says it.
    pub fn shift(&self, cells: &[LabCell<'_>]) -> f64 {
        self.shift.map_or(0.0, |place| cells.get(place).and_then(LabCell::number).unwrap_or(f64::NAN))
    }

    /// Adds a tap of the object `name`, whose own answer is `alone`; `None` where it tells nothing.
    pub fn tell(
        &mut self,
        name: &str,
        tap: UnlocatedTap,
        alone: &Located,
        ask: &Ask<'_>,
    ) -> Option<Together> {
        // A tap that has no distance of its own, at an end stop or beyond any, tells none together with others either.
        if self.is_nameless(name) || alone.distance.is_nan() || self.is_unplaced(tap.line, tap.shift, ask) {
            return None;
        }
        let asked = self.locator.asked(tap.drive, tap.signal).ok()?;
        let learned = self.locator.sides()[asked.side].answers.learned()?;
        let (tared, y, of_zero) = learned.read(asked.signal, tap.share);
        let kind = (asked.side, tared);
        let same_run = self.locator.same_run;
        let new = |joint: &Joint| Taps::One(Object::new(joint), kind);
        let joint = learned.joint(tared);
        self.clock += 1;
        let known = Known::of(&mut self.known, (name, self.clock), (&mut self.warned, ask), || new(joint));
        let Taps::One(object, its_kind) = &mut known.object else { return None };
        if *its_kind != kind {
            if !std::mem::replace(&mut self.other_side, true) {
                (ask.warn)(&format!(
                    "line {}: an object is told by taps of one side, above zeros of one kind, those of its first tap; such a tap is told alone",
                    tap.line
                ));
            }
            let (side, tared) = (&self.locator.sides()[its_kind.0], its_kind.1);
            let located = side.answers.learned().and_then(|learned| {
                let told = object.told(learned.joint(tared))?;
                let known = ask.interval.then_some((learned, tared, same_run));
                Some(located(object, &told, known, doubts(side, object, &told)))
            });
            let located = located.unwrap_or(Located::nothing(Status::NO_ROOT));
            return Some(Together { taps: object.count(), located, tilt: NO_TILT, apart: None });
        }
        let UnlocatedTap { zero, shift, .. } = tap;
        object.add(joint, Tap { u: asked.drive, y, of_zero, zero, shift }, same_run);
        known.lines.add(tap.line, object.compared());
        let taps = object.count();
        if taps == 1 {
            let interval = alone.interval.map(|end| end + tap.shift);
            let located = Located { distance: alone.distance + tap.shift, interval, ..*alone };
            return Some(Together { taps, located, tilt: NO_TILT, apart: None });
        }
        let Some(told) = object.told(joint) else {
            let located = Located::nothing(Status::NO_ROOT);
            return Some(Together { taps, located, tilt: NO_TILT, apart: None });
        };
        let apart = object.apart(joint, told.a, same_run);
        let apart = apart.map(|(ago, by)| (known.lines.ago(ago), by));
        let mut status = doubts(&self.locator.sides()[asked.side], object, &told);
        if apart.is_some_and(|(_, by)| by.abs() > limit(known.lines.len())) {
            status |= Status::INCONSISTENT;
        }
        let located = located(object, &told, ask.interval.then_some((learned, tared, same_run)), status);
        Some(Together { taps, located, tilt: NO_TILT, apart })
    }

    /// The same of a tap by two gauges, `alone` its own answer and of what that is made; its line, and the number of zero readings before it.
    pub(super) fn tell_pair(
        &mut self,
        name: &str,
        (line, zero, shift): (usize, u64, f64),
        (alone, parts): &(Spatial, Option<Parts>),
        ask: &Ask<'_>,
    ) -> Option<Together> {
        let parts = parts.filter(|_| !self.is_nameless(name) && alone.located.distance.is_finite())?;
        if self.is_unplaced(line, shift, ask) {
            return None;
        }
        let parts = parts.moved(shift);
        self.clock += 1;
        let new = || Taps::Two(PairObject::new());
        let known = Known::of(&mut self.known, (name, self.clock), (&mut self.warned, ask), new);
        let Taps::Two(object) = &mut known.object else { return None };
        if !object.add(parts, zero) {
            return None;
        }
        known.lines.add(line, object.compared());
        let taps = object.count();
        let Some(told) = object.told().filter(|_| taps > 1) else {
            let tilt = [alone.tilt, alone.sigma_tilt];
            let located = Located::normal(parts.at[0], alone.located.sigma, alone.located.status);
            return Some(Together { taps, located, tilt, apart: None });
        };
        let apart = object.apart().map(|(ago, by)| (known.lines.ago(ago), by));
        let mut status = self.locator.doubts_together(told.at[0] - shift, told.sigma[0]);
        if apart.is_some_and(|(_, by)| by > pairs::limit(known.lines.len(), CHANCE)) {
            status |= Status::INCONSISTENT;
        }
        let located = Located::normal(told.at[0], told.sigma[0], status);
        Some(Together { taps, located, tilt: [told.at[1], told.sigma[1]].map(f64::to_degrees), apart })
    }

    /// The same of a row of a file, after `zeros` zero readings.
    pub fn tell_row(&mut self, row: &Row, zeros: u64, ask: &Ask<'_>) -> Option<Together> {
        let (name, shift) = (self.name(&row.fields), self.shift(&row.fields));
        let Row { line, drive, signal, share, .. } = *row;
        match &row.pair {
            _ if row.rests => None,
            Some(alone) => self.tell_pair(&name, (line, zeros, shift), alone, ask),
            None => {
                let tap = UnlocatedTap { line, drive, signal, share, zero: zeros, shift };
                self.tell(&name, tap, &row.located, ask)
            }
        }
    }

    /// Whether a tap is of a base that stands nobody knows where, which is said once.
    fn is_unplaced(&mut self, line: usize, shift: f64, ask: &Ask<'_>) -> bool {
        if shift.is_nan() && !std::mem::replace(&mut self.unplaced, true) {
            (ask.warn)(&format!("line {line}: {SHIFT} is no number: such a tap tells nothing of its object"));
        }
        shift.is_nan()
    }

    /// Whether a tap is of no object.
    fn is_nameless(&self, name: &str) -> bool {
        self.place.is_some() && name.is_empty()
    }
}

/// What the taps of an object tell, with the interval where it is asked for: by the curve and the kind of signal that `known` names.
fn located(
    object: &Object,
    told: &Told,
    known: Option<(&LearnedCurve, bool, bool)>,
    status: Status,
) -> Located {
    let normal = Located::normal(told.a, told.sigma, status);
    let interval = known.map(|(learned, tared, same_run)| learned.ends(object, told, tared, same_run));
    Located { interval: interval.unwrap_or(normal.interval), ..normal }
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
