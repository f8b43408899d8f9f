//! Design search: the whisker, the gauge and the tap that tell distance best, within the limits of a rig.
//!
//! # Theory
//! A candidate is a design and its drive; its figures are those of its designs row (K_sd, total_rms_mm), or their mean or worst
//! tenth over sampled whiskers. They are smooth but for limits that bind, which they mostly do: without noise the
//! smallest tap angle is best, with it the strain limit often ends the way to the best. So limits are no penalties
//! but rules of comparison ([`score`]), and the polish models each limit beside the objective.
//!
//! # Practice
//! Several starts ([`global`]): a particle swarm on the asked backend, one step one batch ([`global::swarm`]), then
//! a polish of its best distinct candidates in f64 ([`mod@polish`]). Starts grow, and end when several
//! found the same. Everything is a deterministic function of spec and seed given the scores: a search that was stopped is made anew.
//!
//! # Cost
//! About 1 000 evaluations in the first start, 9 000 in the fourth and later ones; a polish takes some 15 steps of 2k + k(k − 1)/2 + 3
//! evaluations for k variables.

pub mod best;
pub mod blame;
pub mod evaluate;
pub mod front;
pub mod global;
mod judge;
pub mod polish;
pub mod quadratic;
pub mod report;
pub mod run;
pub mod score;
pub mod sensitivity;
pub mod session;
pub mod shares;
pub mod variables;
mod whisker;

pub use report::Report;
pub use run::find;
pub use session::{Ended, Step, Watch};
