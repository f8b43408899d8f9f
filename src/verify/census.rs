//! The census of one configuration on one backend: how wrong, how often, where.

use crate::evaluate::Outcome;
use crate::reduce::percentile;
use crate::scene::{Drive, Tuple};
use crate::status::Status;

use super::compare::{Compared, Errors};

/// Forces and arcs may be this many times as wrong as strains: the tolerance does not bound them, they follow from it.
pub const FORCE: f64 = 10.0;

/// Largest share of the taps that the reference solves on which a kernel may give up, and of all taps which it may solve where
/// the reference does not.
pub const UNSOLVED: f64 = 0.15;

/// Errors of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// Largest; NaN if any is not a number.
    pub worst: f64,
    /// Middle one.
    pub median: f64,
    /// 99 of 100 are not larger ([`percentile`]).
    pub p99: f64,
    /// Number above the bound.
    pub over: usize,
    /// Place of the worst among the taps.
    pub at: usize,
}

impl Figures {
    /// Of (error, place) pairs against `bound`; `None` of nothing.
    fn new(mut errors: Vec<(f64, usize)>, bound: f64) -> Option<Self> {
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let &(worst, at) = errors.last()?;
        let rank = |percent| errors[percentile(errors.len(), percent)].0;
        let over = errors.iter().filter(|(e, _)| e.is_nan() || *e > bound).count();
        Some(Self { worst, median: rank(50), p99: rank(99), over, at })
    }
}

/// One line of the census.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name of the configuration, or of the spec.
    pub configuration: String,
    /// What moves.
    pub drive: Drive,
    /// Place of the backend among those verified.
    pub place: usize,
    /// Bound on strain errors.
    pub bound: f64,
    /// Taps asked for.
    pub taps: usize,
    /// Taps that both solved, whose errors are below.
    pub compared: usize,
    /// Taps that neither solved.
    pub neither: usize,
    /// Taps that the reference solved and the backend did not.
    pub unsolved: usize,
    /// Taps that the backend left to the reference, whose answer they have.
    pub referred: usize,
    /// Whether it may leave any number of them: the kernel of built whiskers leaves contacts next to the base, which hard cases are full of.
    pub leaves: bool,
    /// Taps that the backend solved and the reference did not.
    pub unanswered: usize,
    /// Taps whose words differ.
    pub differ: usize,
    /// The first of them, or of the unsolved ones.
    pub odd: Option<(Tuple, Status, Status)>,
    /// Errors of strain, K, force, arc; `None` where no tap has them.
    pub errors: [Option<Figures>; 4],
    /// The tap with the largest strain error.
    pub at: Option<(Tuple, Status)>,
    /// Mean and largest number of kernel sweeps of a tap.
    pub sweeps: (f64, f64),
}

/// Names of the compared quantities, in the order of [`Line::errors`].
pub const QUANTITIES: [&str; 4] = ["strain", "K", "force", "arc"];

impl Line {
    /// What is wrong, one word each; empty if nothing is.
    pub fn faults(&self) -> Vec<&'static str> {
        let over = |k: usize| self.errors[k].is_some_and(|f| f.over > 0);
        let many = |n: usize, of: usize| n as f64 > UNSOLVED * of as f64;
        let checks = [
            (self.compared + self.neither == 0, "nothing_compared"),
            (over(0), QUANTITIES[0]),
            (over(1), QUANTITIES[1]),
            (over(2), QUANTITIES[2]),
            (over(3), QUANTITIES[3]),
            (self.differ > 0, "status"),
            (
                many(
                    self.unsolved + if self.leaves { 0 } else { self.referred },
                    self.compared + self.unsolved + self.referred + self.differ,
                ),
                "unsolved",
            ),
            (many(self.unanswered, self.taps), "unanswered"),
        ];
        checks.into_iter().filter(|(wrong, _)| *wrong).map(|(_, word)| word).collect()
    }
}

/// Takes the taps of one configuration on one backend.
#[derive(Debug, Default)]
pub struct Census {
    taps: usize,
    counts: [usize; 5],
    odd: Option<(usize, usize)>,
    errors: [Vec<(f64, usize)>; 4],
    sweeps: (f64, f64),
}

impl Census {
    /// Takes tap number `self.taps`.
    pub fn push(&mut self, compared: Compared, sweeps: f32) {
        let at = self.taps;
        self.taps += 1;
        self.sweeps.0 += f64::from(sweeps);
        self.sweeps.1 = self.sweeps.1.max(f64::from(sweeps));
        let slot = match compared {
            Compared::Both(Errors { strain, k, force, arc }) => {
                self.errors[0].push((strain, at));
                if !k.is_nan() {
                    self.errors[1].push((k, at));
                }
                self.errors[2].push((force, at));
                self.errors[3].push((arc, at));
                return;
            }
            Compared::Neither => 0,
            Compared::Referred => 1,
            Compared::Unanswered => 2,
            Compared::Unsolved => 3,
            Compared::Differ => 4,
        };
        self.counts[slot] += 1;
        if slot > self.odd.map_or(1, |(worst, _)| worst) {
            self.odd = Some((slot, at));
        }
    }

    /// Takes tap number `self.taps`, of which only the strain is known; NaN where it is not read.
    pub fn push_strain(&mut self, error: Option<f64>) {
        match error {
            Some(error) => self.errors[0].push((error, self.taps)),
            None => self.counts[0] += 1,
        }
        self.taps += 1;
    }

    /// The line; `tuples` are the taps in the order in which they came, with what reference and backend made of them.
    pub fn close(
        self,
        configuration: &str,
        (drive, leaves): (Drive, bool),
        (place, bound): (usize, f64),
        tuples: &[Tuple],
        (expected, found): (&[Outcome], &[Outcome]),
    ) -> Line {
        let compared = self.errors[0].len();
        let [neither, referred, unanswered, unsolved, differ] = self.counts;
        let [strain, k, force, arc] = self.errors;
        let errors = [(strain, 1.0), (k, 1.0), (force, FORCE), (arc, FORCE)]
            .map(|(errors, share)| Figures::new(errors, share * bound));
        Line {
            configuration: configuration.to_owned(),
            drive,
            place,
            bound,
            taps: self.taps,
            compared,
            neither,
            unsolved,
            referred,
            leaves,
            unanswered,
            differ,
            odd: self.odd.map(|(_, i)| (tuples[i], expected[i].status, found[i].status)),
            at: errors[0].map(|f| (tuples[f.at], found[f.at].status)),
            errors,
            sweeps: (self.sweeps.0 / self.taps.max(1) as f64, self.sweeps.1),
        }
    }
}
