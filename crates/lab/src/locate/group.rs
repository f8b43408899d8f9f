//! What readings tell together: taps of one object, or the readings of a stroke.

use super::Located;
use super::object::{By, Objects, Together, UnlocatedTap};
use super::pair::Spatial;
use super::pairs::Parts;
use super::rows::{Answerer, RowReader};
use super::stream::Ask;
use super::strokes::{Far, Strokes};
use crate::error::Error;
use crate::sink::lab::LabCell;
use crate::sink::values::Field;

/// Readings that are told together.
pub enum Group<'a> {
    /// Taps of objects.
    Objects(Objects<'a>),
    /// Readings of strokes.
    Strokes(Strokes<'a>),
}

impl<'a> Group<'a> {
    /// Of readings, where any are told together.
    pub fn new(rows: &RowReader<'a>, ask: &Ask<'_>) -> Result<Option<Self>, Error> {
        Ok(match ask.by {
            By::Strokes(free) => Some(Self::Strokes(Strokes::new(rows, free)?)),
            _ => {
                let objects =
                    Objects::new(rows, ask).map_err(|e| e.at(ask.label.unwrap_or("stdin"), None))?;
                objects.map(Self::Objects)
            }
        })
    }

    /// Columns that are added after the status of readings that are told together `by` this; `rows` of a file, whose columns are kept.
    pub fn columns(
        (by, interval): (By<'_>, bool),
        who: Answerer<'_>,
        rows: Option<&RowReader<'_>>,
    ) -> Vec<&'static str> {
        match by {
            By::Strokes(_) => Strokes::columns(rows),
            _ => Objects::columns(by, rows.is_some(), [who.is_twofold(), interval]),
        }
    }

    /// The columns of a tap by two gauges, as in [`Self::tell`].
    pub(super) fn tell_pair(
        &mut self,
        (rows, cells): (&RowReader<'_>, &[LabCell<'_>]),
        at: (usize, u64),
        alone: &(Spatial, Option<Parts>),
        ask: &Ask<'_>,
    ) -> Vec<Field> {
        let Self::Objects(objects) = self else { return Vec::new() };
        let (name, shift) = (objects.name(cells), objects.shift(cells));
        let together = objects.tell_pair(&name, (at.0, at.1, shift), alone, ask);
        let told = Together::fields(together.as_ref(), [true, ask.interval]);
        self.named((rows, cells), ask, told)
    }

    /// The sensor is at rest.
    pub fn rest(&mut self) {
        if let Self::Strokes(strokes) = self {
            strokes.rest();
        }
    }

    /// The columns of a reading: what it tells with those before it.
    pub fn tell(
        &mut self,
        (rows, cells): (&RowReader<'_>, &[LabCell<'_>]),
        tap: UnlocatedTap,
        alone: &Located,
        ask: &Ask<'_>,
    ) -> Vec<Field> {
        let told = match self {
            Self::Objects(objects) => {
                let (name, shift) = (objects.name(cells), objects.shift(cells));
                let together = objects.tell(&name, UnlocatedTap { shift, ..tap }, alone, ask);
                Together::fields(together.as_ref(), [false, ask.interval])
            }
            Self::Strokes(strokes) => match strokes.tell(&strokes.name(cells), tap, ask) {
                Some(far) => Far::fields(Some(&far)),
                None => return self.nothing((rows, cells), ask),
            },
        };
        self.named((rows, cells), ask, told)
    }

    /// The columns of a reading that tells nothing.
    pub fn nothing(&self, (rows, cells): (&RowReader<'_>, &[LabCell<'_>]), ask: &Ask<'_>) -> Vec<Field> {
        match self {
            Self::Objects(_) => {
                let told = Together::fields(None, [rows.who.is_twofold(), ask.interval]);
                self.named((rows, cells), ask, told)
            }
            Self::Strokes(_) => {
                let name = self.is_named(rows, ask).then(|| "".into());
                name.into_iter().chain(Far::fields(None)).collect()
            }
        }
    }

    /// Whether a column with the name stands before the others.
    fn is_named(&self, rows: &RowReader<'_>, ask: &Ask<'_>) -> bool {
        match self {
            Self::Objects(_) => !ask.keep && matches!(ask.by, By::Column(_)),
            Self::Strokes(_) => {
                Strokes::columns(ask.keep.then_some(rows)).first() == Some(&super::strokes::NAME)
            }
        }
    }

    /// What a reading has `told`, after the name of its object or stroke where the line does not keep it.
    fn named(
        &self,
        (rows, cells): (&RowReader<'_>, &[LabCell<'_>]),
        ask: &Ask<'_>,
        told: Vec<Field>,
    ) -> Vec<Field> {
        let name = || match self {
            Self::Objects(objects) => objects.name(cells),
            Self::Strokes(strokes) => strokes.shown(cells),
        };
        let name = self.is_named(rows, ask).then(|| name().into());
        name.into_iter().chain(told).collect()
    }
}
