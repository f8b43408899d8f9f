//! Lines of a stream that are answered together.

use super::Located;
use super::pair::Spatial;
use super::rows::{Answerer, Reading};
use super::stream::Counts;
use crate::error::Error;
use crate::sink::frame::Frame;
use crate::sink::values::Field;
use crate::status::Status;

/// What a line is answered by.
pub(super) enum Answer {
    Known(Located),
    Contact(Box<Spatial>),
    UnlocatedTap(Reading),
}

/// Lines that are answered together.
#[derive(Default)]
pub(super) struct Batch {
    /// Of each line what stands before its answer, the answer, and what follows it.
    pub lines: Vec<(Vec<Field>, Answer, Vec<Field>)>,
}

impl Batch {
    /// Adds the lines with their answers to `table`, and forgets them.
    pub fn answer(
        &mut self,
        who: Answerer<'_>,
        interval: bool,
        table: &mut Frame,
        counts: &mut Counts,
    ) -> Result<(), Error> {
        let (mut taps, mut known) = (Vec::new(), Vec::with_capacity(self.lines.len()));
        for (asked, answer, more) in self.lines.drain(..) {
            let found = match answer {
                Answer::Known(located) => Some(Spatial { located, ..Spatial::nothing(located.status) }),
                Answer::Contact(found) => Some(*found),
                Answer::UnlocatedTap(tap) => {
                    taps.push(tap);
                    None
                }
            };
            known.push((asked, found, more));
        }
        let mut located = who.answer(&taps)?.into_iter();
        for (asked, found, more) in known {
            let found = found.or_else(|| located.next()).unwrap_or(Spatial::nothing(Status::BAD_INPUT));
            counts.combinations.note(found.located.status, 1);
            let numbers = found.numbers();
            let (first, of_two) = numbers.split_at(2);
            let ends = found.located.interval.iter().filter(|_| interval);
            let of_two = of_two.iter().filter(|_| who.is_twofold());
            let numbers = first.iter().chain(ends).chain(of_two).map(|x| Field::Number(*x));
            let status = Field::Status(found.located.status);
            table.row(asked.into_iter().chain(numbers).chain([status]).chain(more))?;
        }
        Ok(())
    }
}
