//! One tap on one backend against the reference.

use crate::evaluate::Outcome;
use crate::scene::{Contact, Setup};
use crate::status::Status;

/// Errors of one tap that both solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// |ε − ε_ref| / max(|ε_ref|, 1e-3 θ f_max); with a second gauge, the larger of both, whose sizes are √(ε₁² + ε₂²).
    pub strain: f64,
    /// Error of K as a strain error: |K − K_ref| / K_ref · |ε_ref| / max(|ε_ref|, 1e-3 θ f_max); NaN where there is no K.
    pub k: f64,
    /// Larger of |P − P_ref| and |T − T_ref|, over the size of the reference's force.
    pub force: f64,
    /// |c − c_ref| / c_ref.
    pub arc: f64,
}

/// What comparing a tap shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compared {
    /// Both have an answer and the same words.
    Both(Errors),
    /// Neither has an answer, for the same reason.
    Neither,
    /// The reference has an answer, the kernel says `material_limit` where its section law ends before the material does.
    Unsolved,
    /// The kernel left the tap to the reference, which has an answer.
    Referred,
    /// The kernel has an answer, the reference is `not_converged`.
    Unanswered,
    /// The words differ in another way.
    Differ,
}

/// What belongs to a tap besides its outcomes.
#[derive(Debug, Clone, Copy)]
pub struct TapScale {
    /// 1e-3 θ f_max: strain to which errors refer at least.
    pub least: f64,
    /// L_a, mm.
    pub length: f64,
    /// x1, mm.
    pub near: f64,
    /// Largest |reading| of the gauge.
    pub limit: f64,
}

/// Words that say why there are no values.
const WITHOUT: [Status; 3] = [Status::INVALID_GEOMETRY, Status::NOT_CONVERGED, Status::MATERIAL_LIMIT];

/// Compares `found` with the reference's `expected`; within `bound` of a threshold a word may differ.
pub fn compare(setup: &Setup, tap: &TapScale, expected: &Outcome, found: &Outcome, bound: f64) -> Compared {
    // Beyond its tip, and at a knot, a whisker that is more than a cone has no values.
    let without = |o: &Outcome| WITHOUT.into_iter().any(|word| o.status.has(word)) || o.arc.is_nan();
    let unsure = |o: &Outcome| o.status.has(Status::NOT_CONVERGED);
    let invalid = |o: &Outcome| o.status.has(Status::INVALID_GEOMETRY);
    let same = WITHOUT.into_iter().all(|word| expected.status.has(word) == found.status.has(word));
    match (without(expected), without(found)) {
        (true, true) if same => Compared::Neither,
        (false, true) if !invalid(found) => Compared::Unsolved,
        (false, false) if found.referred => Compared::Referred,
        (true, false) if unsure(expected) => Compared::Unanswered,
        (false, false) if alike(setup, tap, expected, found, bound) => {
            Compared::Both(errors(tap, expected, found))
        }
        _ => Compared::Differ,
    }
}

/// Whether words and contact state agree, but for those whose threshold is nearer than the bound.
fn alike(setup: &Setup, tap: &TapScale, expected: &Outcome, found: &Outcome, bound: f64) -> bool {
    let limit = tap.limit;
    let strain = expected.magnitude();
    let edges = [
        (Status::SLIPPED_OFF, (expected.arc - tap.length).abs() <= bound * tap.length),
        (Status::NO_STRAIN, (expected.arc - tap.near).abs() <= bound * tap.near),
        (Status::STRAIN_LIMIT, (strain - limit).abs() <= bound * strain.max(tap.least)),
    ];
    let agree =
        edges.iter().all(|(word, edge)| *edge || expected.status.has(*word) == found.status.has(*word));
    agree && (expected.sticking == found.sticking || at_sliding_edge(setup, expected, bound))
}

/// Whether |T| is μP, within ten times the bound: forces are less accurate than strains.
fn at_sliding_edge(setup: &Setup, o: &Outcome, bound: f64) -> bool {
    let Contact::Coulomb(mu) = setup.model.contact else { return false };
    let (normal, tangential) = (o.normal_force.abs(), o.tangential_force.abs());
    (tangential - mu * normal).abs() <= 10.0 * bound * normal.hypot(tangential)
}

fn errors(tap: &TapScale, expected: &Outcome, found: &Outcome) -> Errors {
    let size = expected.magnitude().max(tap.least);
    let off = |a: f64, b: f64| if a.is_nan() && b.is_nan() { 0.0 } else { (a - b).abs() };
    let second = off(found.strain_2, expected.strain_2);
    let force = expected.normal_force.hypot(expected.tangential_force);
    let normal = (found.normal_force - expected.normal_force).abs();
    let tangential = (found.tangential_force - expected.tangential_force).abs();
    let k = (found.deviation - expected.deviation) / (1.0 + expected.deviation) * expected.strain / size;
    Errors {
        strain: relative((found.strain - expected.strain).abs().max(second), size),
        k: k.abs(),
        force: relative(normal.max(tangential), force),
        arc: relative((found.arc - expected.arc).abs(), expected.arc),
    }
}

/// `error` over `size`, 0 where there is none.
fn relative(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}
