//! What readings tell together: taps of one object, or the readings of a stroke.

use super::Located;
use super::kept::field;
use super::object::{By, Objects, Together, UnlocatedTap};
use super::pair::Spatial;
use super::pairs::Parts;
use super::rows::{Answerer, RowReader};
use super::stream::Ask;
use super::stream::written;
use super::strokes::{Far, Strokes};
use crate::error::Error;

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
        (rows, text): (&RowReader<'_>, Option<&str>),
        at: (usize, u64),
        alone: &(Spatial, Option<Parts>),
        ask: &Ask<'_>,
    ) -> Vec<u8> {
        let mut out = Vec::new();
        if let Self::Objects(objects) = self {
            let fields = rows.fields(text.unwrap_or_default());
            let (name, shift) = (objects.name(&fields), objects.shift(&fields));
            let together = objects.tell_pair(&name, (at.0, at.1, shift), alone, ask);
            self.name((rows, text), ask, &mut out);
            written(&mut out, Together::fields(together.as_ref(), [true, ask.interval]));
        }
        out
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
        (rows, text): (&RowReader<'_>, Option<&str>),
        tap: UnlocatedTap,
        alone: &Located,
        ask: &Ask<'_>,
    ) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Self::Objects(objects) => {
                let fields = rows.fields(text.unwrap_or_default());
                let (name, shift) = (objects.name(&fields), objects.shift(&fields));
                let together = objects.tell(&name, UnlocatedTap { shift, ..tap }, alone, ask);
                self.name((rows, text), ask, &mut out);
                written(&mut out, Together::fields(together.as_ref(), [false, ask.interval]));
            }
            Self::Strokes(strokes) => {
                let name = strokes.name(rows, text);
                let far = strokes.tell(&name, tap, ask);
                if far.is_some() {
                    self.name((rows, text), ask, &mut out);
                } else {
                    self.nameless(rows, ask, &mut out);
                }
                Far::write(far.as_ref(), &mut out);
            }
        }
        out
    }

    /// The columns of a reading that tells nothing.
    pub fn nothing(&self, (rows, text): (&RowReader<'_>, Option<&str>), ask: &Ask<'_>) -> Vec<u8> {
        let mut out = Vec::new();
        match self {
            Self::Objects(_) => {
                self.name((rows, text), ask, &mut out);
                written(&mut out, Together::fields(None, [rows.who.is_twofold(), ask.interval]));
            }
            Self::Strokes(_) => {
                self.nameless(rows, ask, &mut out);
                Far::write(None, &mut out);
            }
        }
        out
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

    fn name(&self, (rows, text): (&RowReader<'_>, Option<&str>), ask: &Ask<'_>, out: &mut Vec<u8>) {
        if self.is_named(rows, ask) {
            match self {
                Self::Objects(objects) => field(out, &objects.name(&rows.fields(text.unwrap_or_default()))),
                Self::Strokes(strokes) => field(out, &strokes.shown(rows, text)),
            }
        }
    }

    fn nameless(&self, rows: &RowReader<'_>, ask: &Ask<'_>, out: &mut Vec<u8>) {
        if self.is_named(rows, ask) {
            out.push(b',');
        }
    }
}
