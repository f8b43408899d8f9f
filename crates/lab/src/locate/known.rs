//! Objects that are known, each with its taps.

use std::collections::HashMap;

use vibrissa_learned::joint::Object;

use super::pairs::PairObject;
use super::stream::Ask;

/// Objects that are known at a time; the one that was tapped longest ago goes first.
const MOST: usize = 256;

/// A tap that is in question.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnlocatedTap {
    /// Line of the input.
    pub line: usize,
    /// The drive, as it is recorded.
    pub drive: f64,
    /// The signal above its zero.
    pub signal: f64,
    /// Variance of the zero in units of that of one reading.
    pub share: f64,
    /// Number of zero readings before it: taps with the same one are above the same zero.
    pub zero: u64,
    /// How much nearer to the object the base stands than where its distance is told from, mm; NaN where a row does not say it.
    pub shift: f64,
}

/// The taps of an object, by one gauge or by two.
pub(super) enum Taps {
    /// With the side and taring of its first tap, which others have too.
    One(Object, (usize, bool)),
    Two(PairObject),
}

/// Lines of the taps that are compared, the last at the end.
#[derive(Default)]
pub(super) struct TapLines(Vec<usize>);

impl TapLines {
    /// Adds that of a tap; as many are `compared`.
    pub fn add(&mut self, line: usize, compared: usize) {
        self.0.push(line);
        self.0.drain(..self.0.len().saturating_sub(compared));
    }

    /// That of the tap so long `ago`.
    pub fn ago(&self, ago: usize) -> usize {
        self.0[self.0.len() - 1 - ago]
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }
}

/// What is known of an object.
pub(super) struct Known {
    pub object: Taps,
    pub lines: TapLines,
    seen: u64,
}

impl Known {
    /// What is known of the object `name`, of a new one what `new` makes; the oldest of too many goes.
    pub fn of<'k>(
        all: &'k mut HashMap<String, Self>,
        (name, clock): (&str, u64),
        (warned, ask): (&mut bool, &Ask<'_>),
        new: impl FnOnce() -> Taps,
    ) -> &'k mut Self {
        if !all.contains_key(name) && all.len() == MOST {
            if let Some(oldest) = all.iter().min_by_key(|(_, k)| k.seen).map(|(name, _)| name.clone()) {
                all.remove(&oldest);
            }
            if !std::mem::replace(warned, true) {
                (ask.warn)(&format!(
                    "more than {MOST} objects: of the one that was tapped longest ago, taps that come later are those of another one"
                ));
            }
        }
        let known = all.entry(name.to_owned()).or_insert_with(|| Self {
            object: new(),
            lines: TapLines::default(),
            seen: 0,
        });
        known.seen = clock;
        known
    }
}
