//! Search for a lag of the readings: gain and time constant by the likelihood of `learned`, where the file has times. The lag is used only if it
//! lowers the error on distances left out.

use std::sync::Arc;

use vibrissa_learned::fit::{Fit, From, Task, fit};
use vibrissa_learned::rows::Row;

use super::{Calibrated, SideResult};
use crate::digits::short;
use crate::estimator::{Estimator, learned::Learnt};
use crate::measure::{Data, Lag, time::MOST};

/// Least gain in ln likelihood for a lag: about 3 for its two numbers, more because the time constant is searched.
const WORTH: f64 = 6.0;
const PRIOR: f64 = 0.1;
const STEP: f64 = 0.03;
const PARABOLAS: usize = 8;
const FACTOR: f64 = 3.0;
const MANY: [usize; 2] = [600, 20_000];

pub fn search(data: &Data, found: &Calibrated) -> Option<Lag> {
    let [cells, rows] = MANY;
    let wraps = found.calibration.zero.wraps;
    let few = found.sides.iter().all(|s| s.learnt.fit.cells.len() <= cells) && data.rows.len() <= rows;
    if !data.timed || wraps || !few || data.beside.second.is_some() {
        return None;
    }
    let mut search = Search::new(data, found);
    let none = search.likelihood(None, true)?.0;
    let peaks = time_constants(data).into_iter().filter_map(|tau_s| search.peak(tau_s, 0.0));
    let (value, mut lag) = peaks.reduce(|best, peak| if peak.0 > best.0 { peak } else { best })?;
    // The noise of a fit without lag includes its effect, so half the gain is enough for a refit.
    if value < search.likelihood(None, false)?.0 + 0.5 * WORTH {
        return None;
    }
    for _ in 0..2 {
        let (_, fits) = search.likelihood(Some(&lag), true)?;
        search.fits = fits;
        lag = search.finer(lag)?;
    }
    let (value, _) = search.likelihood(Some(&lag), true)?;
    (value > none + WORTH).then(|| search.with_errors(lag))
}

/// Refined lag from rows judged and learned without it.
pub fn again(data: &Data, found: &Calibrated, lag: Lag) -> Lag {
    let search = Search::new(data, found);
    search.finer(lag).map_or(lag, |lag| search.with_errors(lag))
}

/// Trial time constants within the resolution of the times, seconds.
fn time_constants(data: &Data) -> Vec<f64> {
    let steps = || data.rows.windows(2).filter(|w| w[0].run == w[1].run).map(|w| w[1].t - w[0].t);
    let mut gaps: Vec<f64> = steps().filter(|dt| *dt > 0.0).collect();
    if gaps.is_empty() {
        return Vec::new();
    }
    let first = 0.5 * crate::reduce::median(&mut gaps);
    let last = 0.5 * gaps.iter().sum::<f64>();
    std::iter::successors(Some(first), |tau| Some(tau * FACTOR)).take_while(|tau| *tau <= last).collect()
}

struct Search<'a> {
    data: &'a Data,
    found: &'a Calibrated,
    fits: Vec<Arc<Fit>>,
}

impl<'a> Search<'a> {
    fn new(data: &'a Data, found: &'a Calibrated) -> Self {
        Self { data, found, fits: found.sides.iter().map(|s| s.learnt.fit.clone()).collect() }
    }

    /// ln likelihood of all readings with `lag`, and the fits of all sides; `learned` fits the learned numbers anew.
    fn likelihood(&self, lag: Option<&Lag>, learned: bool) -> Option<(f64, Vec<Arc<Fit>>)> {
        let settled = lag.map(|lag| lag.settle(self.data));
        let mut sum = lag.map_or(0.0, |lag| -0.5 * (lag.gain / PRIOR).powi(2));
        let mut fits = Vec::new();
        for (SideResult { learnt, .. }, held) in self.found.sides.iter().zip(&self.fits) {
            let rows = settled.as_ref().map_or_else(|| learnt.task.rows.clone(), |s| self.rows(learnt, s));
            let from = if learned { From::Near(held) } else { From::Held(held) };
            let found = fit(&Task { rows, ..learnt.task.clone() }, &learnt.places, from, false).ok()?;
            sum += found.evidence;
            // Jacobian: a reading is a share of its settled value.
            let share = |k: &usize| settled.as_ref().map_or(0.0, |s| (1.0 - s[learnt.lines[*k]].1).ln());
            sum -= learnt.places.iter().map(share).sum::<f64>();
            fits.push(Arc::new(found));
        }
        sum.is_finite().then_some((sum, fits))
    }

    fn rows(&self, learnt: &Learnt, settled: &[(f64, f64)]) -> Vec<Row> {
        let factor = self.found.calibration.rig.setup.gauge.factor;
        let unit = self.data.unit;
        let row = |(row, place): (&Row, &usize)| {
            let row_of = &self.data.rows[*place];
            let [now, then] = [settled[*place].0, row_of.value - row_of.late].map(|x| unit.strain(x, factor));
            Row { y: row.y + learnt.sign * (now - then), ..*row }
        };
        learnt.task.rows.iter().zip(&learnt.lines).map(row).collect()
    }

    fn peak(&self, tau_s: f64, mut at: f64) -> Option<(f64, Lag)> {
        let (mut step, mut best): (f64, Option<(f64, Lag)>) = (STEP, None);
        for _ in 0..PARABOLAS {
            let of = |gain: f64| Lag { gain, sigma_gain: 0.0, tau_s, sigma_tau_s: 0.0 };
            let value = |gain: f64| self.likelihood(Some(&of(gain)), false).map(|l| l.0);
            let [below, here, above] = [value(at - step)?, value(at)?, value(at + step)?];
            let bend = (2.0 * here - below - above) / (step * step);
            if bend.is_nan() || bend <= 0.0 {
                return best;
            }
            let moved = (0.5 * (above - below) / step / bend).clamp(-5.0 * STEP, 5.0 * STEP);
            at = (at + moved).clamp(step - MOST, MOST - step);
            let found = (value(at)?, Lag { sigma_gain: bend.sqrt().recip(), ..of(at) });
            if best.is_none_or(|(most, _)| found.0 >= most) {
                best = Some(found);
            }
            if moved.abs() < 0.1 / bend.sqrt() {
                break;
            }
            step = (3.0 / bend.sqrt()).min(0.5 * STEP);
        }
        best
    }

    fn with_errors(&self, lag: Lag) -> Lag {
        let step = [lag.sigma_gain.max(1e-6), 0.1];
        let at = |i: f64, k: f64| {
            let moved = Lag { gain: lag.gain + i * step[0], tau_s: lag.tau_s * (k * step[1]).exp(), ..lag };
            self.likelihood(Some(&moved), false).map_or(f64::NAN, |l| l.0)
        };
        let here = at(0.0, 0.0);
        let bend = |p: f64, q: f64, h: f64| (2.0 * here - p - q) / (h * h);
        let gg = bend(at(1.0, 0.0), at(-1.0, 0.0), step[0]);
        let tt = bend(at(0.0, 1.0), at(0.0, -1.0), step[1]);
        let gt = -(at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * step[0] * step[1]);
        let det = gg * tt - gt * gt;
        match det > 0.0 && gg > 0.0 {
            true => Lag { sigma_gain: (tt / det).sqrt(), sigma_tau_s: lag.tau_s * (gg / det).sqrt(), ..lag },
            // Curved in one direction only: the time constant is known to its order of magnitude.
            false => Lag { sigma_tau_s: lag.tau_s, ..lag },
        }
    }

    fn finer(&self, lag: Lag) -> Option<Lag> {
        const GOLDEN: f64 = 0.381_966;
        let peak = |x: f64| self.peak(x.exp(), lag.gain);
        let (mut lo, mut hi) = (lag.tau_s.ln() - FACTOR.ln(), lag.tau_s.ln() + FACTOR.ln());
        let mut best = self.peak(lag.tau_s, lag.gain)?;
        let [mut p, mut q] = [lo + GOLDEN * (hi - lo), hi - GOLDEN * (hi - lo)];
        let (mut of_p, mut of_q) = (peak(p)?, peak(q)?);
        for _ in 0..8 {
            best = [of_p, of_q]
                .into_iter()
                .fold(best, |best, found| if found.0 > best.0 { found } else { best });
            if of_p.0 > of_q.0 {
                (hi, q, of_q) = (q, p, of_p);
                p = lo + GOLDEN * (hi - lo);
                of_p = peak(p)?;
            } else {
                (lo, p, of_p) = (p, q, of_q);
                q = hi - GOLDEN * (hi - lo);
                of_q = peak(q)?;
            }
        }
        Some(best.1)
    }
}

pub fn errors(found: &Calibrated) -> Option<f64> {
    let mut errors = crate::reduce::Errors::default();
    for side in &found.sides {
        let held = side.held_out(Estimator::Learned)?;
        held.taps.iter().map(|[e, _]| *e).filter(|e| e.is_finite()).for_each(|e| errors.push(e));
    }
    errors.rms()
}

pub fn settled(data: &Data, lag: &Lag) -> Data {
    let mut data = data.clone();
    let settled = lag.settle(&data);
    data.rows.iter_mut().zip(settled).for_each(|(row, (value, _))| row.late = row.value - value);
    data
}

pub fn warning(data: &Data, lag: &Lag, [without, with]: [f64; 2]) -> String {
    let (file, gain, error) = (&data.file, 100.0 * lag.gain, 200.0 * lag.sigma_gain);
    let [tau, of_tau] = [lag.tau_s, 2.0 * lag.sigma_tau_s].map(short);
    format!(
        "{file}: the readings lag: {gain:.2} % (± {error:.2} %) of a change comes with a time constant of {tau} s (± {of_tau}; two standard errors), or a part \
         of the tap before stays so long. That was taken out (error on distances left out {without:.3} → {with:.3} mm); locate does so too where readings have their t_s, files of --export do not"
    )
}
