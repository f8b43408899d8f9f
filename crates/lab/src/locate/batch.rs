//! Lines of a stream that are answered together.

use super::Located;
use super::pair::Spatial;
use super::rows::{Answerer, Reading};
use super::stream::{Counts, number};
use crate::error::Error;
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
    /// What stands before the answers, line after line.
    pub asked: Vec<u8>,
    /// Of each line where that ends, its answer, and what follows it.
    pub answers: Vec<(usize, Answer, Option<Vec<u8>>)>,
}

impl Batch {
    /// Writes the lines with their answers into `out`, and forgets them.
    pub fn answer(
        &mut self,
        who: Answerer<'_>,
        interval: bool,
        out: &mut Vec<u8>,
        counts: &mut Counts,
    ) -> Result<(), Error> {
        let answers = std::mem::take(&mut self.answers);
        let (mut taps, mut known) = (Vec::new(), Vec::with_capacity(answers.len()));
        for (to, answer, more) in answers {
            let found = match answer {
                Answer::Known(located) => Some(Spatial { located, ..Spatial::nothing(located.status) }),
                Answer::Contact(found) => Some(*found),
                Answer::UnlocatedTap(tap) => {
                    taps.push(tap);
                    None
                }
            };
            known.push((to, found, more));
        }
        let mut located = who.answer(&taps)?.into_iter();
        let mut from = 0;
        for (to, found, more) in known {
            let found = found.or_else(|| located.next()).unwrap_or(Spatial::nothing(Status::BAD_INPUT));
            counts.combinations.note(found.located.status, 1);
            out.extend_from_slice(&self.asked[from..to]);
            let numbers = found.numbers();
            let (first, more_of_two) = numbers.split_at(2);
            let ends = found.located.interval.iter().filter(|_| interval);
            let of_two = more_of_two.iter().filter(|_| who.is_twofold());
            row(out, first.iter().chain(ends).chain(of_two), found.located.status);
            if let Some(more) = more {
                out.push(b',');
                out.extend(more);
            }
            out.push(b'\n');
            from = to;
        }
        self.asked.clear();
        Ok(())
    }
}

/// One answer; what is missing stays empty.
fn row<'a>(out: &mut Vec<u8>, numbers: impl Iterator<Item = &'a f64>, status: Status) {
    numbers.for_each(|x| number(out, *x));
    if status == Status::OK {
        out.extend(b"ok");
    } else {
        out.extend(status.to_string().bytes());
    }
}
