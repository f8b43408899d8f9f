//! `learned`: statistical model of the whisker's curve, the rig and its runs (crate `vibrissa-learned`): its record, its fit, its inversion.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use super::{
    Answers, Exact, Extent, Found, Known, SideRecord, Solver, exact::unsolved, held_out::Side,
    parameter::spec_values,
};
use crate::{error::Error, status::Status};
use vibrissa_learned::base::{Base, Power, Whisker};
use vibrissa_learned::columns::{Scales, Term};
use vibrissa_learned::curve::{Curve, PARTS, Spread, Tails};
use vibrissa_learned::fit::{Fit, From, Task, fit};
use vibrissa_learned::invert::Inverse;
use vibrissa_learned::joint::{Joint, Object, Told};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedRecord {
    /// RMS error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Zero for each drive: σ is that of the model.
    pub bias_mm: Vec<f64>,
    /// Offset of the drive of a known whisker.
    pub whisker_drive_offset: Option<f64>,
    /// [u₀, p, q] of the power law (u + u₀)^p (1/a − κ)^q of an unknown whisker.
    pub power: Option<[f64; 3]>,
    /// κ, 1/mm, unless 0.
    pub power_end: Option<f64>,
    /// True if zeros were read with the taps.
    pub zero_read: bool,
    /// True if the zero is known; else the signal counts as tared, and readings with their own zero are the same as others.
    pub zero_known: bool,
    /// Signal without contact, above the subtracted zero.
    pub zero: f64,
    /// Unit of the signal for everything below, and divisor of the base.
    pub units: [f64; 2],
    /// Middle and half range of ln a and of ln u; a middle distance and the largest drive.
    pub scales: [[f64; 2]; 3],
    /// Offset added to the drive before its logarithm.
    pub drive_shift: f64,
    /// Kind (curve, wave, a, u, zero) and degrees of each term.
    pub terms: Vec<(String, u8, u8)>,
    pub mean: Vec<f64>,
    /// Independent standard deviations of the coefficients.
    pub deviations: Vec<Vec<f64>>,
    pub runs: usize,
    /// Variances of a reading about the curve: independent and proportional noise, position, visit, zero and gain of a run, drift.
    pub spread: [f64; 7],
    /// Covariance of these variances: independent and proportional noise, position, visit, zero and gain of a run.
    pub spread_covariance: Option<[[f64; PARTS]; PARTS]>,
}

impl LearnedRecord {
    /// Record of a fit; `zero` was subtracted from the signals before.
    pub fn new(learnt: &Learnt, held_out_rms_mm: Option<f64>, drives: usize) -> Self {
        let Learnt { fit, runs, zero_read, .. } = learnt;
        let Curve { unit, base_unit, zero, scales, terms, mean, deviations, spread: s, tails } = &fit.curve;
        let word = |t: &Term| match t {
            Term::Curve(j, k) => ("curve".to_owned(), *j, *k),
            Term::Wave(j, k) => ("wave".to_owned(), *j, *k),
            Term::OffsetA => ("a".to_owned(), 0, 0),
            Term::OffsetU => ("u".to_owned(), 0, 0),
            Term::Zero | Term::Local => ("zero".to_owned(), 0, 0),
        };
        Self {
            held_out_rms_mm,
            bias_mm: vec![0.0; drives],
            whisker_drive_offset: fit.power.is_none().then(|| fit.base.offset()),
            power: fit.power.map(|f| [f.power.offset, f.power.p, f.power.q]),
            power_end: fit.power.map(|f| f.power.end).filter(|end| *end > 0.0),
            zero_read: *zero_read,
            zero_known: learnt.zero_known,
            zero: zero - learnt.subtracted,
            units: [*unit, *base_unit],
            scales: [scales.a, scales.u, scales.sizes],
            drive_shift: scales.offset,
            terms: terms.iter().map(word).collect(),
            mean: mean.clone(),
            deviations: deviations.clone(),
            runs: *runs,
            spread: [s.floor, s.relative, s.position, s.visit, s.gain, s.zero, s.drift],
            spread_covariance: tails.0.iter().flatten().any(|c| *c != 0.0).then_some(tails.0),
        }
    }

    fn curve(&self) -> Option<Curve> {
        let term = |(word, j, k): &(String, u8, u8)| match word.as_str() {
            "curve" if *j <= 2 && *k <= 2 => Some(Term::Curve(*j, *k)),
            "wave" if *j < 9 && *k < 4 => Some(Term::Wave(*j, *k)),
            "a" => Some(Term::OffsetA),
            "u" => Some(Term::OffsetU),
            "zero" => Some(Term::Zero),
            _ => None,
        };
        let terms: Vec<Term> = self.terms.iter().map(term).collect::<Option<_>>()?;
        let [floor, relative, position, visit, gain, zero, drift] = self.spread;
        let spread = Spread { floor, relative, position, visit, zero, gain, drift };
        let ([a, u, sizes], [unit, base_unit], zero) = (self.scales, self.units, self.zero);
        let scales = Scales { a, u, sizes, offset: self.drive_shift };
        let (mean, deviations) = (self.mean.clone(), self.deviations.clone());
        let tails = Tails(self.spread_covariance.unwrap_or_default());
        Some(Curve { unit, base_unit, zero, scales, terms, mean, deviations, spread, tails })
    }

    pub fn is_sound(&self) -> bool {
        let n = self.terms.len();
        let numbers = self.mean.iter().chain(self.deviations.iter().flatten()).chain(&self.spread);
        let numbers = numbers.chain(self.scales.iter().flatten()).chain(&self.power_end);
        let mut numbers = numbers.chain(self.spread_covariance.iter().flatten().flatten());
        self.mean.len() == n
            && self.deviations.iter().all(|d| d.len() == n)
            && self.units.iter().all(|u| *u > 0.0 && u.is_finite())
            && self.scales[0][1] > 0.0
            && self.scales[1][1] >= 0.0
            && self.power.is_some() != self.whisker_drive_offset.is_some()
            && self.spread.iter().all(|s| *s >= 0.0)
            && self.curve().is_some()
            && numbers.all(|x| x.is_finite())
    }

    pub(super) fn open(&self, of: Solver<'_>, record: &SideRecord) -> Result<Option<LearnedCurve>, Error> {
        let rig = of.0;
        let Some(curve) = self.curve() else { return Ok(None) };
        let base = match self.power {
            Some([offset, p, q]) => {
                (Base::Power(Power { offset, p, q, end: self.power_end.unwrap_or(0.0) }), EVERYWHERE)
            }
            None => {
                let at = Extent::around(of, record.gauge(), record.ranges(), rig.before);
                let exact = Exact::new(spec_values(&rig.setup), Vec::new(), at)
                    .map_err(|why| unsolved(rig, record, why))?;
                let (curve, reach) = whisker(exact);
                (Base::Known(curve, self.whisker_drive_offset.unwrap_or(0.0)), reach)
            }
        };
        Ok(Some(LearnedCurve::new(curve, base, [self.zero_read, self.zero_known], None)))
    }
}

/// Fit without the distances `gone`: a function (cell, drive, |signal|) → distance.
pub fn without<'a>(
    side: &Side<'a>,
    gone: &std::ops::Range<usize>,
) -> Option<impl Fn(usize, f64, f64) -> Option<Found> + use<'a>> {
    let Side { taps, cells, learned: learnt, .. } = *side;
    let left_out = || cells.iter().filter(|c| gone.contains(&c.i));
    let of_taps = || left_out().flat_map(|c| c.taps.iter().copied());
    let drives: Vec<f64> = left_out().map(|c| c.drive).chain(of_taps().map(|t| taps[t].drive)).collect();
    let left: std::collections::HashSet<usize> = of_taps().collect();
    let kept = |k: &&usize| learnt.taps[**k].is_none_or(|tap| !left.contains(&tap));
    let places: Vec<usize> = learnt.places.iter().filter(kept).copied().collect();
    let answers = learnt.without(&places, &drives)?;
    Some(move |k: usize, drive: f64, signal: f64| {
        let of_cell = &cells[k].taps;
        let share = of_cell.iter().map(|t| taps[*t].zero_share()).sum::<f64>() / of_cell.len() as f64;
        answers.find(drive, signal, Known { share, same_run: false }).ok()
    })
}

/// Curve of a known whisker, and the range of distances with value and slope, mm.
pub fn whisker(exact: Exact) -> (Whisker, [f64; 2]) {
    let [near, far] = exact.reach();
    (Arc::new(move |a, u| exact.expected(a, u)), [near * 1.002, far * 0.998])
}

/// Range of distances of a power law, mm.
pub const EVERYWHERE: [f64; 2] = [0.0, f64::INFINITY];

#[derive(Clone)]
pub struct Learnt {
    /// Rows of taps and zero readings in the sign of the side; the whisker if known; the standard error of a zero from taps of both sides.
    pub task: Task,
    /// Range of distances of the whisker or the power law, mm.
    pub reach: [f64; 2],
    pub taps: Vec<Option<usize>>,
    pub lines: Vec<usize>,
    pub sign: f64,
    pub places: Vec<usize>,
    pub fit: Arc<Fit>,
    pub runs: usize,
    pub zero_read: bool,
    pub zero_known: bool,
    /// Zero subtracted from the taps after the fit, in the sign of the side.
    pub subtracted: f64,
}

impl std::fmt::Debug for Learnt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} rows", self.places.len(), self.task.rows.len())
    }
}

impl Learnt {
    /// Standard deviation of a typical reading.
    pub fn noise(&self) -> f64 {
        let curve = &self.fit.curve;
        curve.unit * (curve.spread.floor + curve.spread.relative).sqrt()
    }

    /// Model for readings at `drives`, from the rows at `places` only; the learned numbers are kept.
    pub fn without(&self, places: &[usize], drives: &[f64]) -> Option<LearnedCurve> {
        let fit = fit(&self.task, places, From::Held(&self.fit), true).ok()?;
        let curve = Curve { zero: fit.curve.zero - self.subtracted, ..fit.curve };
        let zero = [self.zero_read, self.zero_known];
        Some(LearnedCurve::new(curve, (fit.base, self.reach), zero, Some(drives)))
    }
}

pub struct LearnedCurve {
    curve: Curve,
    base: Base,
    /// Inverses for readings above the zero of the calibration, and above their own.
    inverse: [Option<Inverse>; 2],
    zero_read: bool,
    /// Models of several taps, and of strokes, made on first use.
    joints: [[OnceLock<Joint>; 2]; 2],
}

impl LearnedCurve {
    /// For any drive, or for these alone; the base is known within `reach`.
    pub(super) fn new(
        curve: Curve,
        (base, reach): (Base, [f64; 2]),
        [zero_read, zero_known]: [bool; 2],
        drives: Option<&[f64]>,
    ) -> Self {
        let new = |tared: bool| Inverse::new(&curve, &base, (tared, reach), drives);
        let inverse = [(!zero_read).then(|| new(false)), (zero_read || zero_known).then(|| new(true))];
        Self { inverse, curve, base, zero_read, joints: Default::default() }
    }

    /// For a reading whose zero has this `share`: true if it counts above its own zero; the signal that counts; variance of the zero.
    pub fn read(&self, reading: f64, share: f64) -> (bool, f64, f64) {
        let tared = self.inverse[1].is_some() && (self.zero_read || share > 0.0);
        let of_zero = share * self.curve.spread.floor * self.curve.unit.powi(2);
        (tared, if tared || self.zero_read { reading } else { reading - self.curve.zero }, of_zero)
    }

    fn of(&self, tared: bool) -> &Inverse {
        let made = self.inverse[usize::from(tared)].as_ref();
        made.unwrap_or_else(|| self.plain().0)
    }

    /// Model of several taps, or of `strokes`.
    pub fn joint(&self, tared: bool, strokes: bool) -> &Joint {
        let new = || Joint::new(&self.curve, &self.base, tared, self.of(tared), strokes);
        self.joints[usize::from(strokes)][usize::from(tared)].get_or_init(new)
    }

    /// 95 % interval of the distance of an object, mm.
    pub fn ends(&self, object: &Object<'_>, told: &Told, tared: bool, same_run: bool) -> [f64; 2] {
        let variance = (told.sigma / (told.a - object.frame)).powi(2);
        let longer = object.weights(told.a);
        let longer = longer.map_or(1.0, |weights| self.curve.longer(&weights, variance, tared, same_run));
        stretched(told.a, told.ends, longer)
    }

    /// Inverse for readings without their own zero, and the zero of the calibration.
    pub fn plain(&self) -> (&Inverse, f64) {
        let inverse = self.inverse[usize::from(self.zero_read)].as_ref().expect("it was made");
        (inverse, if self.zero_read { 0.0 } else { self.curve.zero })
    }
}

impl Answers for LearnedCurve {
    fn find(&self, drive: f64, reading: f64, Known { share, same_run }: Known) -> Result<Found, Status> {
        let (tared, y, of_zero) = self.read(reading, share);
        let inverse = self.of(tared);
        let found = inverse.at(drive, same_run).find(y, of_zero)?;
        let alone = [[1.0, y, found.slope * found.a, share]];
        let longer = self.curve.longer(&alone, (found.sigma * found.slope).powi(2), tared, same_run);
        Ok(Found { ends: stretched(found.a, found.ends, longer), ..found })
    }

    fn expected(&self, a: f64, drive: f64) -> f64 {
        let (inverse, zero) = self.plain();
        let [near, far] = inverse.reach();
        let signal = || self.curve.expected(&self.base, a, drive, self.zero_read).signal + zero;
        if (near..=far).contains(&a) { signal() } else { f64::NAN }
    }

    fn variance(&self, a: f64, drive: f64, same_run: bool) -> f64 {
        self.plain().0.at(drive, same_run).at(a.ln())[2]
    }

    fn learned(&self) -> Option<&LearnedCurve> {
        Some(self)
    }
}

fn stretched(a: f64, ends: [f64; 2], longer: f64) -> [f64; 2] {
    ends.map(|end| a + longer * (end - a))
}
