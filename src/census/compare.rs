//! One tap on one backend against the reference, and the census of many: how wrong, how often, where.

use super::{Figures, Taps, relative};
use crate::backend::Backend;
use crate::evaluate::Outcome;
use crate::scene::{COLUMNS, Contact, Drive, Setup, Tuple};
use crate::sink::values::Field;
use crate::status::Status;

/// Forces and arcs may be this many times as wrong as strains: the tolerance does not bound them, they follow from it.
pub const FORCE: f64 = 10.0;

/// Largest share of the taps that the reference solves to which a kernel may give no answer, of those far from base and gauge (`Task::is_far`) that it may
/// leave to the reference, and of all taps that it may solve where the reference does not. Near the base no kernel is sure of itself: there the reference answers.
pub const UNSOLVED: f64 = 0.15;

/// Names of the compared quantities. Strain: |ε − ε_ref| / max(|ε_ref|, 1e-3 θ f_max); with a second gauge, the larger of both, whose sizes are √(ε₁² + ε₂²).
/// K: |K − K_ref| / K_ref as a strain error, none where there is no K. Force: the larger of |P − P_ref| and |T − T_ref|, over the size of the reference's force.
/// Arc: |c − c_ref| / c_ref.
pub const QUANTITIES: [&str; 4] = ["strain", "K", "force", "arc"];

/// What may be wrong beside an error of one of the [`QUANTITIES`].
pub const FAULTS: [&str; 4] = ["nothing_compared", "status", "unsolved", "unanswered"];

/// Words that say why there are no values.
const WITHOUT: [Status; 3] = [Status::INVALID_GEOMETRY, Status::NOT_CONVERGED, Status::MATERIAL_LIMIT];

/// Why a tap has no errors, from the least odd to the oddest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Odd {
    /// Neither has an answer, for the same reason.
    Neither,
    /// The kernel left the tap to the reference, which has an answer.
    Referred,
    /// The kernel has an answer, the reference is `not_converged`.
    Unanswered,
    /// The reference has an answer, the kernel says `material_limit` where its section law ends before the material does.
    Unsolved,
    /// The words differ in another way.
    Differ,
}

/// Errors of a tap in the order of [`QUANTITIES`], as far as it has them.
pub(super) type Compared = Result<[Option<f64>; 4], Odd>;

/// Compares `found` with the reference's `expected` of tap `i`; within `bound` of a threshold a word may differ.
pub(super) fn compare(taps: &Taps, i: usize, [expected, found]: [&Outcome; 2], bound: f64) -> Compared {
    // Beyond its tip, and at a knot, a whisker that is more than a cone has no values.
    let without = |o: &Outcome| WITHOUT.into_iter().any(|word| o.status.has(word)) || o.arc.is_nan();
    let same = WITHOUT.into_iter().all(|word| expected.status.has(word) == found.status.has(word));
    match (without(expected), without(found)) {
        (true, true) if same => Err(Odd::Neither),
        (false, true) if !found.status.has(Status::INVALID_GEOMETRY) => Err(Odd::Unsolved),
        (false, false) if found.referred => Err(Odd::Referred),
        (true, false) if expected.status.has(Status::NOT_CONVERGED) => Err(Odd::Unanswered),
        (false, false) if alike(taps, i, [expected, found], bound) => {
            Ok(errors(taps.least(i), expected, found))
        }
        _ => Err(Odd::Differ),
    }
}

/// Whether words and contact state agree, but for those whose threshold is nearer than the bound.
fn alike(taps: &Taps, i: usize, [expected, found]: [&Outcome; 2], bound: f64) -> bool {
    let design = taps.design(i);
    let (length, strain, gauge) = (design.tuple.L_a, expected.magnitude(), &taps.setup.gauge);
    let near = design.shared.as_ref().map_or(0.0, |s| s.gauge[0]);
    let limit = design.shared.as_ref().map_or(gauge.strain_limit, |s| s.strain_limit(gauge));
    let edges = [
        (Status::SLIPPED_OFF, (expected.arc - length).abs() <= bound * length),
        (Status::NO_STRAIN, (expected.arc - near).abs() <= bound * near),
        (Status::STRAIN_LIMIT, (strain - limit).abs() <= bound * strain.max(taps.least(i))),
    ];
    let agree =
        edges.iter().all(|(word, edge)| *edge || expected.status.has(*word) == found.status.has(*word));
    agree && (expected.sticking == found.sticking || at_sliding_edge(&taps.setup, expected, bound))
}

/// Whether |T| is μP, within ten times the bound: forces are less accurate than strains.
fn at_sliding_edge(setup: &Setup, o: &Outcome, bound: f64) -> bool {
    let Contact::Coulomb(mu) = setup.model.contact else { return false };
    let (normal, tangential) = (o.normal_force.abs(), o.tangential_force.abs());
    (tangential - mu * normal).abs() <= 10.0 * bound * normal.hypot(tangential)
}

fn errors(least: f64, expected: &Outcome, found: &Outcome) -> [Option<f64>; 4] {
    let size = expected.magnitude().max(least);
    let apart = |of: fn(&Outcome) -> f64| match (of(expected), of(found)) {
        (a, b) if a.is_nan() && b.is_nan() => 0.0,
        (a, b) => (b - a).abs(),
    };
    let (first, second) = (apart(|o| o.strain), apart(|o| o.strain_2));
    let strain = if second.is_nan() || second > first { second } else { first };
    let k = (found.deviation - expected.deviation) / (1.0 + expected.deviation) * expected.strain / size;
    let force = apart(|o| o.normal_force).max(apart(|o| o.tangential_force));
    let whole = expected.normal_force.hypot(expected.tangential_force);
    let k = Some(k.abs()).filter(|k| !k.is_nan());
    let [strain, force, arc] = [(strain, size), (force, whole), (apart(|o| o.arc), expected.arc)]
        .map(|(x, of)| Some(relative(x, of)));
    [strain, k, force, arc]
}

/// One line of the census: a configuration on a backend.
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
    /// Numbers of the other taps, by [`Odd`].
    odd: [usize; 5],
    /// Of the taps far from base and gauge that the reference solves, those that the backend left to it, and all.
    left: [usize; 2],
    /// The first of the oddest taps, and the words of reference and backend; none where they agree.
    odd_at: Option<(Tuple, [Status; 2])>,
    /// Errors in the order of [`QUANTITIES`]; `None` where no tap has them.
    pub errors: [Option<Figures>; 4],
    /// The tap with the largest strain error.
    at: Option<(Tuple, Status)>,
    /// Mean and largest number of kernel sweeps of a tap.
    pub sweeps: [f64; 2],
}

impl Line {
    /// Of `tuples`, compared as `compared` says; what reference and backend say of each is in `answers`.
    pub(super) fn new(
        (configuration, drive): (String, Drive),
        (place, bound): (usize, f64),
        (tuples, far): (&[Tuple], &[bool]),
        compared: &[Compared],
        answers: [&[Outcome]; 2],
    ) -> Self {
        let mut odd = [0; 5];
        compared.iter().filter_map(|c| c.err()).for_each(|kind| odd[kind as usize] += 1);
        let errors = std::array::from_fn(|q| {
            let of = |(i, c): (usize, &Compared)| Some((c.as_ref().ok()?[q]?, i));
            let errors = compared.iter().enumerate().filter_map(of).collect();
            Figures::new(errors, if q < 2 { bound } else { FORCE * bound })
        });
        let solved = |c: &&Compared| matches!(c, Ok(_) | Err(Odd::Referred | Odd::Unsolved));
        let left = compared.iter().zip(far).filter(|(_, far)| **far).map(|(c, _)| c).filter(solved);
        let strange = |(i, c): (usize, &Compared)| Some((c.err().filter(|odd| *odd > Odd::Referred)?, i));
        // Of the oddest the first.
        let oddest = compared.iter().enumerate().rev().filter_map(strange).max_by_key(|(odd, _)| *odd);
        let words = |i: usize| answers.map(|all| all[i].status);
        let sweeps = || answers[1].iter().map(|o| f64::from(o.sweeps));
        Self {
            configuration,
            drive,
            place,
            bound,
            taps: tuples.len(),
            compared: compared.iter().filter(|c| c.is_ok()).count(),
            odd,
            left: [left.clone().filter(|c| **c == Err(Odd::Referred)).count(), left.count()],
            odd_at: oddest.map(|(_, i)| (tuples[i], words(i))),
            at: errors[0].map(|f: Figures| (tuples[f.at], words(f.at)[1])),
            errors,
            sweeps: [sweeps().sum::<f64>() / tuples.len().max(1) as f64, sweeps().fold(0.0, f64::max)],
        }
    }

    /// Number of taps that are odd in this way.
    pub fn odd(&self, kind: Odd) -> usize {
        self.odd[kind as usize]
    }

    /// Taps whose strain error is above the bound.
    pub fn over(&self, quantity: usize) -> usize {
        self.errors[quantity].map_or(0, |f| f.over)
    }

    /// Largest strain error over its bound.
    pub fn excess(&self) -> f64 {
        self.errors[0].map_or(0.0, |f| f.worst / self.bound)
    }

    /// What is wrong, each as a word of the table and in words for people; empty if nothing is.
    pub fn faults(&self) -> Vec<(&'static str, String)> {
        let odd = match &self.odd_at {
            Some((tuple, _)) => format!(" at {}, {}", self.place_of(tuple), self.other_words()),
            None => String::new(),
        };
        let [neither, referred, unanswered, unsolved, differ] = self.odd;
        let mut faults = Vec::new();
        if self.compared + neither == 0 {
            faults.push((FAULTS[0], "nothing was compared".to_owned()));
        }
        for (q, name) in QUANTITIES.into_iter().enumerate() {
            let Some(f) = self.errors[q].filter(|f| f.over > 0) else { continue };
            let at = self
                .at
                .filter(|_| q == 0)
                .map_or(String::new(), |(t, _)| format!(" at {}", self.place_of(&t)));
            let bound = self.bound * if q < 2 { 1.0 } else { FORCE };
            let (worst, over, of) = (f.worst, f.over, self.compared);
            faults.push((name, format!("{name} error {worst:.2e} > {bound:.1e}, {over} of {of} taps{at}")));
        }
        if differ > 0 {
            faults.push((FAULTS[1], format!("other words on {differ} taps{odd}")));
        }
        let solved = self.compared + unsolved + referred + differ;
        let shares = [
            (FAULTS[2], "no answer to ", [unsolved, solved], "that the reference solves", &*odd),
            (FAULTS[2], "", self.left, "far from base and gauge are left to the reference", ""),
            (FAULTS[3], "answers to ", [unanswered, self.taps], "to which the reference has none", &*odd),
        ];
        let (many, most) = (|[n, of]: [usize; 2]| n as f64 > UNSOLVED * of as f64, 100.0 * UNSOLVED);
        for (word, what, [n, of], which, at) in shares.into_iter().filter(|share| many(share.2)) {
            faults.push((word, format!("{what}{n} of {of} taps {which}, more than {most} %{at}")));
        }
        faults
    }

    /// `ok`, or what is wrong, joined by +.
    pub fn verdict(&self) -> String {
        let mut words: Vec<&str> = self.faults().into_iter().map(|(word, _)| word).collect();
        words.dedup();
        if words.is_empty() { "ok".to_owned() } else { words.join("+") }
    }

    /// What backend and reference say of the tap on which they are furthest apart; empty where they always agree.
    fn other_words(&self) -> String {
        self.odd_at.map_or(String::new(), |(_, [expected, found])| format!("{found} (reference: {expected})"))
    }

    /// `D_mm=10 d_tip_mm=4 …`.
    fn place_of(&self, t: &Tuple) -> String {
        let lengths = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm"].into_iter();
        let names = lengths.chain(["tilt_deg", "lean_deg", self.drive.column()]);
        let upright = |(name, x): &(&str, f64)| *x == 0.0 && ["tilt_deg", "lean_deg"].contains(name);
        let told = names.zip(t.to_array()).filter(|one| !upright(one));
        let parts: Vec<String> = told.map(|(name, x)| format!("{name}={x}")).collect();
        parts.join(" ")
    }

    /// Its row of verify.csv, on this backend.
    pub fn fields(&self, backend: &Backend) -> Vec<Field> {
        let value = |q: usize, f: fn(&Figures) -> f64| Field::from(self.errors[q].as_ref().map(f));
        let mut fields: Vec<Field> = vec![
            self.configuration.clone().into(),
            backend.name.into(),
            backend.precision.into(),
            backend.adapter.clone().unwrap_or_default().into(),
            Field::Number(self.bound),
        ];
        let [neither, referred, unanswered, unsolved, differ] = self.odd;
        let counts = [self.taps, self.compared, neither, unsolved, unanswered, differ, referred];
        fields.extend(counts.map(Field::from));
        fields.extend([value(0, |f| f.worst), value(0, |f| f.median), value(0, |f| f.p99)]);
        fields.push(self.over(0).into());
        fields.extend((1..QUANTITIES.len()).flat_map(|q| [value(q, |f| f.worst), self.over(q).into()]));
        fields.extend(self.sweeps.map(Field::Number));
        let mut at = [f64::NAN; 1 + COLUMNS];
        if let Some((tuple, _)) = &self.at {
            let [before @ .., drive] = tuple.to_array();
            at[..before.len()].copy_from_slice(&before);
            at[before.len() + usize::from(self.drive == Drive::Displacement)] = drive;
        }
        fields.extend(at.map(Field::Number));
        fields.extend([self.verdict().into(), self.other_words().into()]);
        fields.push(self.at.map_or("".into(), |(_, status)| status.into()));
        fields
    }
}
