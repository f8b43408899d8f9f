//! One side of the whisker: its K table, its estimators, their errors on distances left out, positions in the wrong order (beyond the peak of a drive,
//! signals fall with the distance), and the choice of the estimator.

use super::{Reason, prepare::Prepared};
use crate::error::{Error, InputError};
use crate::estimator::fit::{Fit, Task};
use crate::estimator::held_out::{HeldOut, Side as Held, held_out};
use crate::estimator::learned::{LearnedRecord, Learnt};
use crate::estimator::simple::{self, FactorRecord, SmoothRecord};
use crate::estimator::taps::{Cell, Tap, grouped};
use crate::estimator::{Estimator, Opener, Parameter, SideRecord, exact::ExactRecord};
use crate::measure::{Data, Groups, Rig};
use crate::reduce::{Errors, range};
use crate::statistics::{DistanceRow, DriveRow, Reduction, Told};
use crate::{estimate::Estimated, evaluate::Outcome, scene::Side, status::Status};
use serde::Serialize;
use vibrissa_learned::rows::rises;

/// Fewest distances for which errors at the ends can be ignored.
const BETWEEN: usize = 5;

/// A calibrated side.
#[derive(Debug, Clone)]
pub struct SideResult {
    /// Number of used taps.
    pub used: usize,
    /// K table of the used taps.
    pub table: KTable,
    /// K table with the suspect taps included.
    pub with_suspects: Option<KTable>,
    /// Record that `locate` reads.
    pub record: SideRecord,
    /// The fit of the model.
    pub fit: Option<Fit>,
    /// Learned model.
    pub learnt: Learnt,
    /// Contradicting positions.
    pub contradictions: Vec<Contradiction>,
    held: Vec<(Estimator, HeldOut)>,
}

/// K and distances by the paper's procedure.
#[derive(Debug, Clone)]
pub struct KTable {
    pub distances: Groups,
    pub drives: Groups,
    /// Cells: means over taps of one distance and drive.
    pub cells: Vec<Cell>,
    pub by_drive: Vec<DriveRow>,
    pub by_distance: Vec<DistanceRow>,
    pub estimates: Vec<Estimated>,
}

impl KTable {
    /// Of the `wanted` taps; `rig` has the measured noise.
    fn new(
        (data, rig, taps): (&Data, &Rig, &[Tap]),
        sign: f64,
        wanted: impl Fn(&Tap) -> bool,
    ) -> Option<Self> {
        let ([distances, drives], cells) = grouped(taps, rig, wanted);
        if cells.is_empty() {
            return None;
        }
        let n = (distances.len(), drives.len());
        let mut reduced = Reduction::new(&rig.setup, &rig.design, distances.ends(), n);
        let limit = if data.unit.is_absolute() { rig.strain_limit() } else { f64::INFINITY };
        let outcome = |c: &Cell| Outcome {
            strain: sign * c.signal,
            strain_linear: sign * c.linear,
            deviation: (c.linear - c.signal) / c.signal,
            status: if c.signal > limit { Status::STRAIN_LIMIT } else { Status::OK },
            ..Outcome::NOTHING
        };
        let outcomes: Vec<Outcome> = cells.iter().map(outcome).collect();
        for (c, o) in cells.iter().zip(&outcomes) {
            reduced.count((c.i, c.j), (c.a, c.drive), o);
        }
        reduced.calibrate();
        let estimate =
            |(c, o): (&Cell, &Outcome)| reduced.estimate((c.i, c.j), (c.a, c.drive), o, Told::Formula);
        let estimates = cells.iter().zip(&outcomes).map(estimate).collect();
        let Reduction { drives: by_drive, distances: by_distance, .. } = reduced;
        Some(Self { distances, drives, cells, by_drive, by_distance, estimates })
    }
}

/// Calibrates every estimator that the data allow, of a side of the gauge; `rig` has the measured noise, `fitted` are further parameters.
pub(super) fn calibrate(
    (data, rig, prepared): (&Data, &Rig, &Prepared),
    (gauge, learnt): (Side, Learnt),
    noise: f64,
    fitted: &[Parameter],
    open: Opener<'_>,
) -> Result<SideResult, Error> {
    let (taps, sign) = (&prepared.rows.taps[..], learnt.sign);
    let of = (data, rig, taps);
    let table =
        KTable::new(of, sign, |t| t.is_of(sign)).filter(|t| t.distances.len() >= 2).ok_or_else(|| {
            let message = "after suspect rows are left out, fewer than two distances remain";
            let n = taps.iter().filter(|t| t.reason.as_ref().is_some_and(Reason::is_doubt)).count();
            InputError::new(message).at(&data.file, None).key("a_mm").value(format!("{n} suspect rows"))
        })?;
    let upright = |t: &Tap| t.reason != Some(Reason::Tilted);
    let signal = |t: &Tap| upright(t) && t.signal.is_finite() && t.signal.signum() == sign && t.signal != 0.0;
    let labelled = |t: &Tap| t.a > rig.shared().gauge[0] && rig.design.admits(&rig.setup, t.a, t.drive);
    let changed = |t: &Tap| t.reason.is_some() && signal(t) && labelled(t);
    let with_suspects = taps.iter().any(changed).then(|| KTable::new(of, sign, |t| signal(t) && labelled(t)));
    let with_suspects = with_suspects.flatten();
    let KTable { distances, drives, cells, .. } = &table;
    let (drive_centres, n) = (&drives.centres, distances.len());
    let held_side = Held { rig, taps, cells, drives: drive_centres, distances: n, noise, learned: &learnt };
    let mut no_exact = prepared.no_exact.clone();
    let mut fit = None;
    if prepared.recorded && rig.known && no_exact.is_none() {
        let at = super::extent((rig, open), taps, sign, gauge).expect("there are cells");
        match (Task { at, cells, noise, sought: false }).fit(fitted) {
            Ok(found) => fit = Some(found),
            Err(why) if why.is_of_whisker() => no_exact = Some(why.to_string()),
            Err(why) => return Err(why.into()),
        }
    }
    let drive_ends = reached(taps, cells, drives.len());
    let stopped = |t: &&Tap| t.reason == Some(Reason::Saturated) && t.signal.signum() == sign;
    let mut record = SideRecord {
        sign: sign as i8,
        gauge_side: gauge.word().to_owned(),
        distances_mm: distances.ends(),
        drives: drives.centres.clone(),
        drive_ends: Some(drive_ends).filter(|r| *r != drives.ends()),
        end_stop: taps.iter().filter(stopped).map(|t| t.signal.abs()).reduce(f64::min),
        no_exact,
        ..SideRecord::default()
    };
    let contradictions = contradictions(cells, [distances, drives], noise);
    let mut held = Vec::new();
    let allowed = |e: &Estimator| match e {
        // At one drive, f needs only the shape 1/a: K absorbs the rest.
        Estimator::Paper => rig.known || drives.len() == 1,
        Estimator::Exact => rig.known && prepared.recorded,
        Estimator::Curve | Estimator::Learned => true,
    };
    for e in Estimator::ALL.into_iter().filter(allowed) {
        let unseen = held_out(&held_side, e, fit.as_ref());
        // At the first and last distance a curve is extrapolated: errors there do not count.
        let of = if e == Estimator::Curve && n >= BETWEEN { 1..n - 1 } else { 0..n };
        let bias = unseen.as_ref().map_or(vec![0.0; drives.len()], |h| h.bias(cells, drives.len(), &of));
        let rms = unseen.as_ref().and_then(|h| h.rms(|_| true).0);
        match e {
            Estimator::Paper => {
                let all = FactorRecord::of(&held_side, |_| true);
                record.paper = all.map(|r| FactorRecord { held_out_rms_mm: rms, bias_mm: bias, ..r });
            }
            Estimator::Exact => {
                let of = |fit: &Fit| ExactRecord::calibrated(rig, &fit.exact, rms, bias);
                record.exact = fit.as_ref().map(of);
            }
            Estimator::Curve => {
                let fit = simple::form(&held_side).and_then(|form| simple::curve(&held_side, form, None));
                record.curve = fit.map(|fit| SmoothRecord { held_out_rms_mm: rms, bias_mm: bias, fit });
            }
            Estimator::Learned => record.learned = Some(LearnedRecord::new(&learnt, rms, drives.len())),
        }
        held.extend(unseen.map(|h| (e, h)));
    }
    let used = cells.iter().map(|c| c.taps.len()).sum();
    Ok(SideResult { used, table, with_suspects, record, fit, learnt, contradictions, held })
}

/// Range of answered drives: a tap at an end of the range scatters as those of the calibration do.
fn reached(taps: &[Tap], cells: &[Cell], drives: usize) -> [f64; 2] {
    let of =
        |j: usize| range(cells.iter().filter(|c| c.j == j).flat_map(|c| &c.taps).map(|k| taps[*k].drive));
    let ([a, b], [c, d]) = (of(0), of(drives - 1));
    [a - (0.5 * (b - a)).min(0.5 * a), d + 0.5 * (d - c)]
}

impl SideResult {
    /// Name of the side: contact or far.
    pub fn name(&self) -> &'static str {
        self.record.gauge().word()
    }

    /// Range of its distances, mm.
    pub(super) fn span(&self) -> f64 {
        self.record.distances_mm[1] - self.record.distances_mm[0]
    }

    /// True if `estimator` is calibrated.
    pub fn has(&self, estimator: Estimator) -> bool {
        estimator.bias_mm(&self.record).is_some()
    }

    /// Errors of `estimator` on distances left out.
    pub fn held_out(&self, estimator: Estimator) -> Option<&HeldOut> {
        self.held.iter().find(|(e, _)| *e == estimator).map(|(_, h)| h)
    }

    /// RMS error of `estimator` on distances left out, mm, and the number of taps that it answers.
    pub fn rms(&self, estimator: Estimator) -> (Option<f64>, usize) {
        self.held_out(estimator).map_or((None, 0), |h| h.rms(|_| true))
    }

    /// RMS error in mm of each of `estimators` on distances left out, over the taps that all answer, and their number.
    pub fn common_errors(&self, estimators: &[Estimator]) -> Vec<(Estimator, (Option<f64>, usize))> {
        let held = || estimators.iter().filter_map(|e| Some((*e, self.held_out(*e)?)));
        let shared = |k: usize| held().all(|(_, h)| h.taps[k][0].is_finite());
        held().map(|(e, h)| (e, h.rms(shared))).collect()
    }

    /// RMS error of `estimator` on distances left out at each drive, mm.
    pub fn rms_by_drive(&self, estimator: Estimator) -> Option<Vec<Option<f64>>> {
        let (held, mut errors) =
            (self.held_out(estimator)?, vec![Errors::default(); self.table.drives.len()]);
        for cell in &self.table.cells {
            let known = cell.taps.iter().map(|k| held.taps[*k][0]).filter(|e| e.is_finite());
            known.for_each(|e| errors[cell.j].push(e));
        }
        Some(errors.iter().map(Errors::rms).collect())
    }

    /// Mean of K̄ over the drives.
    pub fn mean_k(&self) -> Option<f64> {
        let k = &self.record.paper.as_ref()?.K;
        Some(k.iter().sum::<f64>() / k.len() as f64)
    }
}

/// Two neighbouring positions, one of which is mislabelled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contradiction {
    #[serde(rename = "a_mm")]
    pub a: [f64; 2],
    /// Number of drives at which their signals are in the wrong order.
    pub drives: usize,
    /// Largest deviation over these drives, in standard deviations.
    pub deviations: f64,
}

/// Contradictions among the positions of `cells`; `noise` is that of a single reading. The data do not show which of two positions is wrong.
fn contradictions(cells: &[Cell], [distances, drives]: [&Groups; 2], noise: f64) -> Vec<Contradiction> {
    let mut found: Vec<Contradiction> = Vec::new();
    for j in 0..drives.len() {
        let cells: Vec<&Cell> = cells.iter().filter(|c| c.j == j).collect();
        let deviation = |c: &&Cell, d: &&Cell| noise * (c.share + d.share).sqrt();
        for (k, deviations) in rises(&cells, |c| c.signal, deviation) {
            let a = [k, k + 1].map(|k| distances.centres[cells[k].i]);
            match found.iter_mut().find(|c| c.a == a) {
                Some(c) => (c.drives, c.deviations) = (c.drives + 1, c.deviations.max(deviations)),
                None => found.push(Contradiction { a, drives: 1, deviations }),
            }
        }
    }
    found
}

/// Least rise of a signal that counts as growing, in standard deviations.
const SURE: f64 = 6.0;

/// Number of drives with a signal that grows with the distance against the theory (unknown whisker: away from its gauge), and of drives compared.
pub(super) fn growing(cells: &[Cell], drives: usize, noise: f64, known: bool) -> [usize; 2] {
    let mut found = [0; 2];
    for j in 0..drives {
        let mut cells: Vec<&Cell> = cells.iter().filter(|c| c.j == j).collect();
        cells.sort_by(|c, d| c.a.total_cmp(&d.a));
        let [near, _, .., far] = cells[..] else { continue };
        let sd = noise * (near.share + far.share).sqrt();
        let grows = far.signal - near.signal > SURE * sd && (!known || far.linear < near.linear);
        let between = cells.iter().all(|c| c.signal >= near.signal && c.signal <= far.signal);
        found = [found[0] + usize::from(grows && between), found[1] + 1];
    }
    found
}

const MANY: usize = 5;
/// Error of always answering the middle, as a share of the range.
const GUESS: f64 = 0.29;
/// `learned` loses with an error above this share of the range if another estimator has less than [`FAR`] of that error.
const WRONG: f64 = 0.1;
const FAR: f64 = 0.1;
/// The winner's error must be below this share of that of `learned`.
const BETTER: f64 = 1.0 / 3.0;

/// `learned`, unless on a side it fails and an estimator of all sides is much better. Estimators that answer less than half of the taps do not count.
pub(super) fn winner(sides: &[SideResult]) -> Estimator {
    let rms = |s: &SideResult, e: Estimator| {
        let (rms, answered) = s.rms(e);
        rms.filter(|_| 2 * answered >= s.used).unwrap_or(f64::INFINITY)
    };
    let lost = |s: &&SideResult| {
        let own = rms(s, Estimator::Learned);
        let beaten = || own > WRONG * s.span() && Estimator::ALL.iter().any(|e| rms(s, *e) < FAR * own);
        s.table.distances.len() >= MANY && (own > GUESS * s.span() || beaten())
    };
    let Some(side) = sides.iter().find(lost) else { return Estimator::Learned };
    let fit = |e: &Estimator| {
        let on = |s: &SideResult| s.has(*e) && rms(s, *e) < GUESS * s.span();
        sides.iter().all(on) && rms(side, *e) < BETTER * rms(side, Estimator::Learned)
    };
    let total = |e: Estimator| sides.iter().map(|s| rms(s, e) / s.span()).sum::<f64>();
    let best = Estimator::ALL.into_iter().filter(fit).min_by(|d, e| total(*d).total_cmp(&total(*e)));
    best.unwrap_or(Estimator::Learned)
}
