//! Answers of taps compared with those of the reference, and the census of many: how wrong, how often, where.

use serde_json::json;

use super::{At, Taps, relative};
use crate::backend::Backend;
use crate::evaluate::Outcome;
use crate::reduce::percentile;
use crate::scene::{COLUMNS, Contact, Drive, Tuple};
use crate::sink::values::Field;
use crate::status::Status;

/// Forces and arcs may be this many times as wrong as strains: the tolerance does not bound them, they follow from it.
const FORCE: f64 = 10.0;

/// Largest share of the taps solved by the reference to which a kernel may give no answer, of those far from base and gauge (`Task::is_far`) that it may
/// leave to the reference, and of all taps that it may solve where the reference does not.
const UNSOLVED: f64 = 0.15;
/// So few far taps may be left by chance.
const BY_CHANCE: usize = 4;

/// Names of the compared quantities. Strain: |ε − ε_ref| / max(|ε_ref|, 1e-3 θ f_max); with a second gauge, the larger of both, whose sizes are √(ε₁² + ε₂²).
/// K: |K − K_ref| / K_ref as a strain error, none where there is no K. Force: the larger of |P − P_ref| and |T − T_ref|, over the size of the reference's force.
/// Arc: |c − c_ref| / c_ref.
pub const QUANTITIES: [&str; 4] = ["strain", "K", "force", "arc"];

/// Faults other than an error of one of the [`QUANTITIES`].
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

/// Compares what was `found` of the taps with what the reference `expected`; within `bound` of a threshold a word may differ.
pub(super) fn compare(taps: &Taps, expected: &[Outcome], found: &[Outcome], bound: f64) -> Vec<Compared> {
    let pairs = expected.iter().zip(found).enumerate();
    pairs.map(|(i, (expected, found))| compare_tap(taps, i, [expected, found], bound)).collect()
}

fn compare_tap(taps: &Taps, i: usize, [expected, found]: [&Outcome; 2], bound: f64) -> Compared {
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

/// True if words and contact state agree, but for those whose threshold is nearer than the bound.
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
    // Whether |T| is μP, as far as forces are known.
    let sliding = || {
        let Contact::Coulomb(mu) = taps.setup.model.contact else { return false };
        let (normal, tangential) = (expected.normal_force.abs(), expected.tangential_force.abs());
        (tangential - mu * normal).abs() <= FORCE * bound * normal.hypot(tangential)
    };
    agree && (expected.sticking == found.sticking || sliding())
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

/// Statistics of many errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// Largest; NaN if any is not a number.
    pub worst: f64,
    pub median: f64,
    /// 99 of 100 are not larger ([`percentile`]).
    pub p99: f64,
    /// Number above the bound.
    pub over: usize,
    /// Place of the worst among the taps.
    at: usize,
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

/// One line of the census: a configuration on a backend.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name of the configuration, or of the spec.
    pub configuration: String,
    drive: Drive,
    /// Place of the backend among those compared.
    pub place: usize,
    bound: f64,
    pub taps: usize,
    /// Taps that both solved, whose errors are below.
    pub compared: usize,
    /// Numbers of the other taps, by [`Odd`].
    pub odd: [usize; 5],
    /// Far taps that the reference solves: those left to it, and all.
    far: [usize; 2],
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
    /// Of `taps`, compared as `compared` says, within `bound` at `place`; what reference and backend say of each is in `answers`.
    pub(super) fn new(
        configuration: String,
        (place, bound): (usize, f64),
        taps: &Taps,
        compared: &[Compared],
        answers: [&[Outcome]; 2],
    ) -> Self {
        let mut odd = [0; 5];
        compared.iter().filter_map(|c| c.err()).for_each(|kind| odd[kind as usize] += 1);
        let is_far = |i: &usize| taps.tasks[*i].is_far(taps.design(*i));
        let solved = |i: &usize| !matches!(compared[*i], Err(Odd::Neither | Odd::Unanswered));
        let far: Vec<usize> = (0..compared.len()).filter(is_far).filter(solved).collect();
        let left = far.iter().filter(|i| compared[**i] == Err(Odd::Referred)).count();
        let errors = std::array::from_fn(|q| {
            let of = |(i, c): (usize, &Compared)| Some((c.as_ref().ok()?[q]?, i));
            let errors = compared.iter().enumerate().filter_map(of).collect();
            Figures::new(errors, if q < 2 { bound } else { FORCE * bound })
        });
        let strange = |(i, c): (usize, &Compared)| Some((c.err().filter(|odd| *odd > Odd::Referred)?, i));
        // Of the oddest the first.
        let oddest = compared.iter().enumerate().rev().filter_map(strange).max_by_key(|(odd, _)| *odd);
        let words = |i: usize| answers.map(|all| all[i].status);
        let sweeps = || answers[1].iter().map(|o| f64::from(o.sweeps));
        let n = compared.len();
        Self {
            configuration,
            drive: taps.setup.drive,
            place,
            bound,
            taps: n,
            compared: compared.iter().filter(|c| c.is_ok()).count(),
            odd,
            far: [left, far.len()],
            odd_at: oddest.map(|(_, i)| (taps.tuple(i), words(i))),
            at: errors[0].map(|f: Figures| (taps.tuple(f.at), words(f.at)[1])),
            errors,
            sweeps: [sweeps().sum::<f64>() / n.max(1) as f64, sweeps().fold(0.0, f64::max)],
        }
    }

    /// The faults, in words of the table; empty without one.
    pub fn faults(&self) -> Vec<&'static str> {
        let [neither, referred, unanswered, unsolved, differ] = self.odd;
        let solved = self.compared + unsolved + referred + differ;
        let many = |n: usize, of: usize| n as f64 > UNSOLVED * of as f64;
        let over = |q: usize| self.errors[q].is_some_and(|f| f.over > 0);
        let of_errors = (0..QUANTITIES.len()).filter(|q| over(*q)).map(|q| QUANTITIES[q]);
        let left = self.far[0] > BY_CHANCE && many(self.far[0], self.far[1]);
        let others = [
            self.compared + neither == 0,
            differ > 0,
            many(unsolved, solved) || left,
            many(unanswered, self.taps),
        ];
        of_errors.chain((0..FAULTS.len()).filter(|k| others[*k]).map(|k| FAULTS[k])).collect()
    }

    /// Its row of verify.csv, on this backend.
    pub fn fields(&self, backend: &Backend) -> Vec<Field> {
        let value = |q: usize, f: fn(&Figures) -> f64| Field::from(self.errors[q].as_ref().map(f));
        let over = |q: usize| Field::from(self.errors[q].map_or(0, |f| f.over));
        let mut fields: Vec<Field> = vec![self.configuration.clone().into()];
        fields.extend(of_backend(backend));
        fields.push(Field::Number(self.bound));
        let [neither, referred, unanswered, unsolved, differ] = self.odd;
        let counts = [self.taps, self.compared, neither, unsolved, unanswered, differ, referred];
        fields.extend(counts.map(Field::from));
        fields.extend([value(0, |f| f.worst), value(0, |f| f.median), value(0, |f| f.p99), over(0)]);
        fields.extend((1..QUANTITIES.len()).flat_map(|q| [value(q, |f| f.worst), over(q)]));
        fields.extend(self.sweeps.map(Field::Number));
        let mut at = [f64::NAN; 1 + COLUMNS];
        if let Some((tuple, _)) = &self.at {
            let [before @ .., drive] = tuple.to_array();
            at[..before.len()].copy_from_slice(&before);
            at[before.len() + usize::from(self.drive == Drive::Displacement)] = drive;
        }
        fields.extend(at.map(Field::Number));
        let faults = self.faults().join("+");
        fields.push(if faults.is_empty() { "ok".into() } else { faults.into() });
        let odd = |(t, [expected, found]): (Tuple, [Status; 2])| {
            format!("{found} (reference: {expected}) at {}", json!(At(self.drive, t)))
        };
        fields.push(self.odd_at.map_or(String::new(), odd).into());
        fields.push(self.at.map_or("".into(), |(_, status)| status.into()));
        fields
    }
}

/// The columns backend, precision and adapter.
pub(super) fn of_backend(backend: &Backend) -> [Field; 3] {
    let adapter = backend.adapter.clone().unwrap_or_default();
    [backend.name.into(), backend.precision.into(), adapter.into()]
}
