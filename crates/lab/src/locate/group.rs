//! What readings tell together, taps of one object or the readings of a stroke: the columns behind the status.

use super::object::{By, Objects, Together};
use super::pair::Spatial;
use super::pairs::Parts;
use super::rows::{Answerer, Reading};
use super::stream::Ask;
use super::strokes::Strokes;
use super::{Located, object, strokes};
use crate::error::Error;
use crate::sink::heading::heading;
use crate::sink::lab::LabCell;
use crate::sink::values::Field;
use crate::status::Status;

/// Readings that are told together.
pub struct Group<'a> {
    kind: Kind<'a>,
    /// Those that are added after the status.
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

    /// Columns that are added to readings that have columns of these `names`. The first is the name of the object or stroke where the line does not keep
    /// it.
    pub fn columns(ask: &Ask<'_>, twofold: bool, names: &[String]) -> Vec<&'static str> {
        let own = ask.keep && names.iter().any(|name| name == strokes::NAME);
        let wanted = |name: &&str| match *name {
            strokes::NAME => !own,
            object::NAME => !ask.keep && matches!(ask.by, By::Column(_)),
            name if name.starts_with(object::NAME) && name.ends_with("_95_mm") => ask.interval,
            name if name.ends_with("tilt_deg") => twofold,
            _ => true,
        };
        let table = if let By::Strokes(_) = ask.by { "along" } else { "together" };
        heading(table).names_as(&[]).into_iter().filter(wanted).collect()
    }

    /// The sensor is at rest.
    pub fn rest(&mut self) {
        if let Kind::Strokes(strokes) = &mut self.kind {
            strokes.rest();
        }
    }

    /// The columns of a line with these fields: what its `tap`, if it is one, tells with those before it. With a tap comes its own answer, of two
    /// gauges with what that is made of.
    pub fn tell(
        &mut self,
        cells: &[LabCell<'_>],
        tap: Option<(&Reading, &Spatial, Option<Parts>)>,
        ask: &Ask<'_>,
    ) -> Vec<Field> {
        let (told, name): (Option<(Vec<f64>, Status)>, _) = match &mut self.kind {
            Kind::Objects(objects) => {
                let together =
                    tap.and_then(|(tap, alone, parts)| objects.tell(cells, tap, (alone, parts), ask));
                (
                    together.map(|told| (numbers(&told, &self.columns), told.located.status)),
                    objects.name(cells),
                )
            }
            Kind::Strokes(strokes) => {
                let far = tap.and_then(|(tap, ..)| strokes.tell(cells, tap, ask));
                let name = if far.is_some() { strokes.shown(cells) } else { String::new() };
                (far.map(|far| (far.numbers(), far.status)), name)
            }
        };
        let named = [object::NAME, strokes::NAME].contains(&self.columns[0]);
        let (numbers, status) = match told {
            Some((numbers, status)) => (numbers, status.into()),
            None => (vec![f64::NAN; self.columns.len() - 1 - usize::from(named)], "".into()),
        };
        let name = named.then(|| name.into());
        name.into_iter().chain(numbers.into_iter().map(Field::from)).chain([status]).collect()
    }
}

/// The numbers of these `columns`.
fn numbers(told: &Together, columns: &[&str]) -> Vec<f64> {
    let Located { distance, sigma, interval: [from, to], .. } = told.located;
    let (line, by) = told.apart.map_or((f64::NAN, f64::NAN), |(line, by)| (line as f64, by));
    // More digits than two of a number of standard deviations say nothing.
    let by = (100.0 * by).round() / 100.0 + 0.0;
    let all = [told.taps as f64, distance, sigma, from, to, told.tilt[0], told.tilt[1], line, by];
    let names = heading("together").names_as(&[]).into_iter().skip(1);
    names.zip(all).filter(|(name, _)| columns.contains(name)).map(|(_, x)| x).collect()
}
