//! `learned`: statistical model of the whisker's curve, the rig and its runs (crate `vibrissa-learned`).

use serde::{Deserialize, Serialize};
use vibrissa_learned::base::{Base, Power};
use vibrissa_learned::columns::{Scales, Term};
use vibrissa_learned::curve::{Curve, Spread};
use vibrissa_learned::tails::{PARTS, Tails};

use super::held_out::Side;
use super::learnt::{EVERYWHERE, LearnedCurve, Learnt, whisker};
use super::{Known, SideRecord};
use crate::error::Error;
use crate::estimator::exact::unsolved;
use crate::estimator::model::Found;
use crate::estimator::model::exact::{Exact, Extent, Opener, spec_values};
use crate::measure::Rig;

/// Learned curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedRecord {
    /// RMS error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Zero for each drive: σ is that of the model.
    pub bias_mm: Vec<f64>,
    /// Offset of the drive of a known whisker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whisker_drive_offset: Option<f64>,
    /// [u₀, p, q] of the power law (u + u₀)^p (1/a − κ)^q of an unknown whisker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<[f64; 3]>,
    /// κ, 1/mm, unless 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
    /// Coefficients of the terms.
    pub mean: Vec<f64>,
    /// Independent standard deviations of the coefficients.
    pub deviations: Vec<Vec<f64>>,
    /// Number of runs in the data.
    pub runs: usize,
    /// Variances of a reading about the curve: independent and proportional noise, position, visit, zero and gain of a run, drift.
    pub spread: [f64; 7],
    /// Covariance of these variances: independent and proportional noise, position, visit, zero and gain of a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
        let [a, u, sizes] = self.scales;
        Some(Curve {
            unit: self.units[0],
            base_unit: self.units[1],
            zero: self.zero,
            scales: Scales { a, u, sizes, offset: self.drive_shift },
            terms,
            mean: self.mean.clone(),
            deviations: self.deviations.clone(),
            spread: Spread { floor, relative, position, visit, zero, gain, drift },
            tails: Tails(self.spread_covariance.unwrap_or_default()),
        })
    }

    /// True if its values are consistent.
    pub fn is_sound(&self) -> bool {
        let n = self.terms.len();
        let mut numbers = self
            .mean
            .iter()
            .chain(self.deviations.iter().flatten())
            .chain(&self.spread)
            .chain(self.scales.iter().flatten())
            .chain(&self.power_end)
            .chain(self.spread_covariance.iter().flatten().flatten());
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

    pub(super) fn open(
        &self,
        rig: &Rig,
        record: &SideRecord,
        open: Opener<'_>,
    ) -> Result<Option<LearnedCurve>, Error> {
        let Some(curve) = self.curve() else { return Ok(None) };
        let base = match self.power {
            Some([offset, p, q]) => {
                (Base::Power(Power { offset, p, q, end: self.power_end.unwrap_or(0.0) }), EVERYWHERE)
            }
            None => {
                let at = Extent::around(rig, record.gauge(), record.distances_mm, record.ends(), rig.before);
                let exact = Exact::new(rig, spec_values(&rig.setup), Vec::new(), Vec::new(), at, open)
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
