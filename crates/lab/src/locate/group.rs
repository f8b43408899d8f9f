//! What readings tell together, taps of one object or the readings of a stroke: the columns behind the status.

use super::object::{self, By, Objects};
use super::pair::Spatial;
use super::rows::{Answerer, Reading};
use super::stream::Ask;
use super::strokes::{self, Strokes};
use crate::error::Error;
use crate::sink::heading::heading;
use crate::sink::lab::LabCell;
use crate::sink::values::Field;

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
        let own = ask.keep && names.iter().any(|name| name == strokes::NAME);
        let wanted = |name: &&str| match *name {
            strokes::NAME => !own,
            object::NAME => !ask.keep && matches!(ask.by, By::Column(_)),
            name if name.starts_with(object::NAME) && name.ends_with("_95_mm") => ask.interval,
            name if name.ends_with("tilt_deg") => twofold,
            _ => true,
        };
        Self::all(ask).into_iter().filter(wanted).collect()
    }

    pub fn rest(&mut self) {
        if let Kind::Strokes(strokes) = &mut self.kind {
            strokes.rest();
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
            Kind::Objects(objects) => {
                (tap.and_then(|(tap, alone)| objects.tell(cells, tap, alone, ask)), objects.name(cells))
            }
            Kind::Strokes(strokes) => {
                let told = tap.and_then(|(tap, _)| strokes.tell(cells, tap, ask));
                let name = if told.is_some() { strokes.shown(cells) } else { String::new() };
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
