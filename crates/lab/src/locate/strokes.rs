//! What readings tell together, taps of one object or the readings of a stroke: a tap that is recorded on its way, told as one curve of the drive.

use std::cell::OnceCell;

use super::object::{self, Shared, hundredths, limit, named};
use super::{Answerer, Ask, By, Locator, Objects, Reading, Spatial, free::Free};
use crate::sink::{Field, LabCell, heading};
use crate::{error::Error, status::Status};
use vibrissa_learned::joint::{Course, Nuisance, Stroke, ToldCourse};

pub struct Group<'a> {
    kind: Kind<'a>,
    pub columns: Vec<&'static str>,
}

enum Kind<'a> {
    Objects(Objects<'a>),
    Strokes(Box<Strokes<'a>>),
}

impl<'a> Group<'a> {
    /// Of readings of columns with these `names`, where any are told together.
    pub fn new(who: Answerer<'a>, names: &[String], ask: &Ask<'_>) -> Result<Option<Self>, Error> {
        let kind = match ask.by {
            By::Strokes(free) => Some(Kind::Strokes(Box::new(Strokes::new(who.first(), names, free)?))),
            _ => {
                let objects = Objects::new(who, names, ask).map_err(|e| e.at(ask.label(), None))?;
                objects.map(Kind::Objects)
            }
        };
        let columns = Self::columns(ask, who.is_twofold(), names);
        Ok(kind.map(|kind| Self { kind, columns }))
    }

    fn all(ask: &Ask<'_>) -> Vec<&'static str> {
        heading(if let By::Strokes(_) = ask.by { "along" } else { "together" }).names_as(&[])
    }

    /// Columns that are added to a file with these `names`; first that of the object or stroke, unless the line keeps it.
    pub fn columns(ask: &Ask<'_>, twofold: bool, names: &[String]) -> Vec<&'static str> {
        let own = ask.keep && names.iter().any(|name| name == NAME);
        let wanted = |name: &&str| match *name {
            NAME => !own,
            object::NAME => !ask.keep && matches!(ask.by, By::Column(_)),
            name if name.starts_with(object::NAME) && name.ends_with("_95_mm") => ask.interval,
            name if name.ends_with("tilt_deg") => twofold,
            _ => true,
        };
        Self::all(ask).into_iter().filter(wanted).collect()
    }

    pub fn rest(&mut self) {
        if let Kind::Strokes(strokes) = &mut self.kind {
            (strokes.now.drives, strokes.now.falling) = (NONE, false);
        }
    }

    /// The columns of a line with these fields: what its `tap`, if it is one, tells with those before it. With a tap comes its own answer.
    pub fn tell(
        &mut self,
        cells: &[LabCell<'_>],
        tap: Option<(&Reading, &Spatial)>,
        ask: &Ask<'_>,
    ) -> Vec<Field> {
        let (told, name) = match &mut self.kind {
            Kind::Objects(objects) => (
                tap.and_then(|(tap, alone)| objects.tell(cells, tap, alone, ask)),
                named(objects.place, cells),
            ),
            Kind::Strokes(strokes) => {
                let told = tap.and_then(|(tap, _)| strokes.tell(cells, tap, ask));
                let number = strokes.number.to_string();
                let name = if strokes.place.is_some() { named(strokes.place, cells) } else { number };
                let name = if told.is_some() { name } else { String::new() };
                (told, name)
            }
        };
        let all = Self::all(ask);
        let (numbers, status) =
            told.map_or((vec![f64::NAN; all.len() - 2], "".into()), |(numbers, s)| (numbers, s.into()));
        let fields = std::iter::once(name.into()).chain(numbers.into_iter().map(Field::from)).chain([status]);
        all.iter().zip(fields).filter(|(name, _)| self.columns.contains(name)).map(|(_, x)| x).collect()
    }
}

pub const NAME: &str = "stroke";
/// A drive that falls by more than this share of the largest calibrated one goes back.
const FALLS: f64 = 0.01;
/// A stroke ends where the drive has gone back by this share of its way; it may stay behind for less.
const ENDS: f64 = 0.5;
/// Readings from which on not each is answered anew, and then the share of new ones that are waited for.
const PATIENT: usize = 32;
/// The whisker touches no earlier than this share of the largest calibrated drive before drive 0, or than the stroke begins.
const EARLY: f64 = 0.03;

/// Variance of a zero that may be anywhere, over the square of the largest signal.
const ANYWHERE: f64 = 100.0;
/// A signal of the other side beyond this multiple of the noise is of a contact.
const BESIDE: f64 = 10.0;
const NONE: [f64; 3] = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY];

pub struct Strokes<'a> {
    locator: &'a Locator,
    /// Place of the column that numbers them; none where the drive tells them apart.
    place: Option<usize>,
    number: u64,
    now: Now,
    falls: OnceCell<()>,
    before: f64,
    /// What is free, and what that changes of the signals of each side.
    free: (Free, Vec<Vec<Nuisance>>),
}

#[derive(Default)]
struct Now {
    name: String,
    /// The least drive since the stroke went back, and the first and the largest of the stroke.
    drives: [f64; 3],
    falling: bool,
    /// Readings, taken with the sign of each side.
    sides: Vec<Option<Side>>,
    signals: [f64; 2],
    /// The last answer, and the readings of which it is.
    far: Option<(usize, Vec<f64>, Status)>,
}

/// Readings as one side of the whisker gives them.
struct Side {
    stroke: Stroke,
    tared: bool,
    largest: f64,
    /// The number that is subtracted, because the zero is free: the first reading.
    first: f64,
}

/// What so many rows of a stroke tell, in the order of the columns; drives are counted from `origin`.
fn numbers(rows: usize, told: Option<ToldCourse>, origin: f64) -> Vec<f64> {
    let nothing = ToldCourse { a: [f64::NAN; 5], touch: [f64::NAN; 2], near: None, apart: [f64::NAN; 2] };
    let ToldCourse { a, touch, apart, .. } = told.unwrap_or(nothing);
    let (touched, drive) = (touch[0] + origin, apart[0] + origin);
    vec![rows as f64, touched, touch[1], a[2], a[1], a[3], a[0], a[4], drive, hundredths(apart[1])]
}

impl<'a> Strokes<'a> {
    /// Of readings of columns with these `names`, which leave this `free`.
    pub fn new(locator: &'a Locator, names: &[String], free: Free) -> Result<Self, Error> {
        let changes = locator.sides.iter().map(|side| free.nuisances(locator, side));
        let changes = changes.collect::<Result<_, _>>()?;
        let place = names.iter().position(|n| n == NAME);
        let (now, falls, before) = (Now { drives: NONE, ..Now::default() }, OnceCell::new(), f64::INFINITY);
        Ok(Self { locator, place, number: 0, now, falls, before, free: (free, changes) })
    }

    /// Begins another stroke where the tap of this line and drive is the first of one; whether it is of one at all.
    fn begins(&mut self, (line, drive): (usize, f64), name: &str, ask: &Ask<'_>) -> bool {
        let slack = FALLS * self.locator.largest_drive();
        let [least, first, largest] = self.now.drives;
        let named = self.place.is_some();
        let behind = drive < largest - slack;
        let ended = self.now.falling && largest - least > ENDS * (largest - first);
        let again = behind && drive <= first + slack || ended && drive > least + slack;
        if !first.is_finite() || if named { name != self.now.name } else { again } {
            let sides = self.locator.sides.iter().map(|_| None).collect();
            let (name, drives) = (name.to_owned(), [f64::INFINITY, drive, drive]);
            self.now = Now { name, drives, sides, ..Now::default() };
            self.number += 1;
            return true;
        }
        self.now.falling = behind;
        if behind {
            self.now.drives[0] = least.min(drive);
            self.falls.get_or_init(|| {
                (ask.warn)(&format!(
                    "line {line}: the drive falls: readings of a stroke count while its drive grows, so that those of the way back tell nothing"
                ))
            });
            return false;
        }
        self.now.drives = [f64::INFINITY, first, largest.max(drive)];
        true
    }

    /// Adds a reading of a line with these fields: the numbers of the columns of what its stroke tells, and the status; `None` where it is of no stroke.
    pub fn tell(&mut self, cells: &[LabCell<'_>], tap: &Reading, ask: &Ask<'_>) -> Shared {
        let (name, signal, share) = (named(self.place, cells), tap.signals[0], tap.shares[0]);
        if self.place.is_some() && name.is_empty() || !tap.drive.is_finite() || !signal.is_finite() {
            return None;
        }
        // Where both sides were calibrated, a drive that goes down from 0 counts by its size.
        let learned = self.locator.sides.iter().filter(|side| side.learned().is_some());
        let down = tap.drive < std::mem::replace(&mut self.before, tap.drive) || name != self.now.name;
        let folded = down && tap.drive < 0.0 && self.locator.drive_origin == 0.0 && learned.count() > 1;
        let drive = if folded { -tap.drive } else { tap.drive };
        if !self.begins((tap.line, drive), &name, ask) {
            return None;
        }
        let locator = self.locator;
        let (drive, signal) = locator.as_calibrated(drive, signal);
        let begun = self.now.sides.iter().flatten().next();
        let first = if self.free.0.zero { begun.map_or(signal, |s| s.first) } else { 0.0 };
        let signal = signal - first;
        let mut status = locator.limit_of(signal);
        for (side, readings) in locator.sides.iter().zip(&mut self.now.sides) {
            let Some(learned) = side.learned() else { continue };
            let (tared, y, _) = learned.read(side.sign * signal, share);
            let new = || Side { stroke: Stroke::default(), tared, largest: f64::NEG_INFINITY, first };
            let own = readings.get_or_insert_with(new);
            if side.sign * signal >= side.end_stop {
                status |= Status::STRAIN_LIMIT;
                continue;
            }
            own.largest = own.largest.max(side.sign * signal);
            own.stroke.add(drive, y);
        }
        let [up, down] = &mut self.now.signals;
        (*up, *down) = (up.max(signal), down.max(-signal));
        let has = |sign: f64| locator.side_of(sign).is_some_and(|side| side.learned().is_some());
        let known = self.now.sides.iter_mut().enumerate().filter_map(|(k, s)| Some((k, s.as_mut()?)));
        let (k, own) = known.max_by(|(_, p), (_, q)| p.largest.total_cmp(&q.largest))?;
        let side = &locator.sides[k];
        let count = own.stroke.count;
        // Without a learned curve a side cannot be read along a stroke.
        let others = self.now.signals[usize::from(side.sign > 0.0)];
        if others > 2.0 * own.largest.max(0.0) && !has(-side.sign) && others > BESIDE * locator.noise {
            return Some((numbers(count, None, locator.drive_origin), status | Status::OUTSIDE_CALIBRATION));
        }
        let recent = |(rows, ..): &&(usize, _, _)| count >= PATIENT && count - rows < count / PATIENT;
        if let Some((_, numbers, before)) = self.now.far.as_ref().filter(recent) {
            return Some((numbers.clone(), *before | status));
        }
        let learned = side.learned()?;
        let joint = learned.joint(own.tared, true);
        let largest = side.ends()[1];
        let known = learned.read(1.0, share).2;
        let course = Course {
            same_run: locator.same_run,
            of_zero: if self.free.0.zero { ANYWHERE * own.largest.powi(2) } else { known },
            least: (-EARLY * largest).min(self.now.drives[1] - locator.drive_origin),
            nuisances: &self.free.1[k],
        };
        let told = own.stroke.told(joint, course);
        status |= match &told {
            None => Status::NO_STRAIN,
            Some(told) => side.doubts(told.a[2], told.near, 0.5 * (told.a[3] - told.a[1])),
        };
        // Runs of four sizes are tested, one of each per bin.
        if told.is_some_and(|told| told.apart[1].abs() > limit(4 * count.min(64))) {
            status |= Status::INCONSISTENT;
        }
        let numbers = numbers(count, told, locator.drive_origin);
        self.now.far = Some((count, numbers.clone(), status));
        Some((numbers, status))
    }
}
