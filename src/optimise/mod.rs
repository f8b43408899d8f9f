//! Design search: whisker, gauge and tap with the smallest distance error, within the limits of a rig.
//!
//! A candidate is a design with a drive. Its figures are K_sd and total_rms_mm, or their mean or worst tenth over sampled whiskers. Mostly a limit
//! binds at the optimum, so limits are rules of comparison ([`score`]), not penalties, and the polish models each limit like the objective. Each
//! start ([`global`]) is a particle swarm on the chosen backend, one batch per step, then a polish of its best candidates in f64 ([`mod@polish`]).
//! Starts grow, and end when several agree. The result is a deterministic function of spec and seed. Cost: about 1 000 evaluations in the first
//! start, 9 000 from the fourth on; a polish takes some 15 steps of 2k + k(k − 1)/2 + 3 evaluations for k variables.

pub mod best;
pub mod evaluate;
pub mod front;
pub mod global;
mod judge;
pub mod polish;
pub mod report;
pub mod run;
pub mod score;
pub mod sensitivity;
pub mod session;

pub use evaluate::Scorer;
pub use report::Report;
pub use run::find;
pub use score::{Goal, Limit, Score};
pub use session::{Ended, Found, Halt, Session, Stage, Step, Variables, Watch};
