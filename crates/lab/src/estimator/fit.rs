//! Least-squares fit of the parameters of `exact` to cells, with standard errors and a test of which parameters the data determine.

use std::{collections::HashMap, ops::Range};

use nalgebra::{DMatrix, DVector};

use super::parameter::{spec_values, width};
use super::{held_out::Side, least, taps::Cell};
use crate::estimator::{Exact, Extent, ModelError, Parameter, Values};
use crate::physics::solid::is_solid;
use vibrissa_learned::fit::lowest;

/// A parameter is determined if its standard error is below this share of its width, and with errors of [`MODEL`] only, below [`SOLVABLE`].
const DETERMINED: f64 = 0.1;
/// Relative accuracy of solved strains, with a margin.
const MODEL: f64 = 1e-7;
const SOLVABLE: f64 = 2e-3;
/// A cell counts if the model also has a solution at drives larger by this share of the largest: an offset leads there.
const ROOM: f64 = 0.02;
/// Relative change of χ², or of all parameters, below which a fit ends.
const SETTLED: f64 = 1e-14;
/// Limit for a solid, whose taps are accurate to about 1e-9: smaller steps would follow their noise.
const SETTLED_SOLID: f64 = 1e-10;
/// Range of misfits, relative to the signal.
const MISFITS: [f64; 2] = [1e-8, 1.0];
/// Least fall of −2 ln likelihood for a misfit: without one it occurs by chance in 1 of 200.
const BEYOND_NOISE: f64 = 6.6;
const ENOUGH: f64 = 0.5;

#[derive(Debug, Clone)]
pub struct Fit {
    pub exact: Exact,
    /// Requested parameters that the data do not determine: held at the spec's value.
    pub undetermined: Vec<Parameter>,
    /// Standard deviation of a cell beyond noise, relative to its signal.
    pub misfit: f64,
    /// χ² per degree of freedom with noise alone; NaN without noise or freedom.
    pub chi2: f64,
    /// Indices of the fitted cells: those for which the model has solutions.
    pub cells: Vec<usize>,
    /// d reading/dp of the fitted cells.
    pub slopes: DMatrix<f64>,
    /// Measured − expected reading of the fitted cells.
    pub residuals: DVector<f64>,
    pub deviations: DVector<f64>,
}

impl Fit {
    /// Standard errors of the fitted parameters, with that of the subtracted `zero`.
    pub fn errors(&self, zero: f64) -> Vec<f64> {
        let weights = self.deviations.map(|d| 1.0 / (d * d));
        let pulled = self.slopes.tr_mul(&weights);
        let c = &self.exact.covariance;
        let shift = |i: usize| zero * c[i].iter().zip(pulled.iter()).map(|(c, p)| c * p).sum::<f64>();
        (0..c.len()).map(|i| c[i][i].max(0.0).sqrt().hypot(shift(i))).collect()
    }

    /// Change of the expected readings of the fitted cells without the distances `gone`, by one Gauss-Newton step of the parameters.
    pub fn shifts(&self, side: &Side<'_>, gone: &Range<usize>) -> Option<HashMap<usize, f64>> {
        let m = self.slopes.ncols();
        let (mut n, mut b) = (DMatrix::<f64>::zeros(m, m), DVector::<f64>::zeros(m));
        for (k, _) in self.cells.iter().enumerate().filter(|(_, cell)| !gone.contains(&side.cells[**cell].i))
        {
            let row = self.slopes.row(k) / self.deviations[k];
            n += row.transpose() * &row;
            b += row.transpose() * (self.residuals[k] / self.deviations[k]);
        }
        let step = least::solve(&n, &b)?.0;
        Some(self.cells.iter().copied().zip((&self.slopes * step).iter().copied()).collect())
    }
}

#[derive(Clone, Copy)]
pub struct Task<'a> {
    pub at: Extent<'a>,
    pub cells: &'a [Cell],
    pub noise: f64,
    /// True if the zero of the signal is fitted; else it is already subtracted or 0.
    pub sought: bool,
}

impl Task<'_> {
    /// Fits factor, drive offset and the `asked` parameters to the cells for which the model has solutions.
    pub fn fit(&self, asked: &[Parameter]) -> Result<Fit, ModelError> {
        let task = Self { at: Extent { hard: [usize::MAX; 2], ..self.at }, ..*self };
        let mut start = spec_values(&self.at.rig.setup);
        let exact = Exact::new(start, Vec::new(), task.at)?;
        let room = ROOM * self.at.drives[1];
        let ratio = |c: &Cell| c.signal / exact.expected(c.a, c.drive);
        let known = |c: &Cell| ratio(c).is_finite() && exact.expected(c.a, c.drive + room).is_finite();
        let places: Vec<usize> = (0..self.cells.len()).filter(|&k| known(&self.cells[k])).collect();
        let cells: Vec<Cell> = places.iter().map(|&k| self.cells[k].clone()).collect();
        let one_distance = cells.windows(2).all(|w| w[0].i == w[1].i);
        if one_distance || (cells.len() as f64) < ENOUGH * self.cells.len() as f64 {
            return Err(ModelError::FewTaps { found: cells.len(), of: self.cells.len() });
        }
        start[0] = crate::reduce::median(&mut cells.iter().map(ratio).collect::<Vec<_>>());
        let task = Task { cells: &cells, ..task };
        let mut free = vec![Parameter::Factor, Parameter::DriveOffset];
        free.extend(asked.iter().filter(|p| !free.contains(p)).copied().collect::<Vec<_>>());
        free.extend(self.sought.then_some(Parameter::Zero));
        let mut undetermined: Vec<Parameter> = Vec::new();
        let model = loop {
            let model = task.minimise(start, &free, 0.0)?;
            let Some(worst) = task.worst(&model, &free) else { break model };
            undetermined.push(free.remove(worst));
            if undetermined.last() == Some(&Parameter::Zero) && !asked.contains(&Parameter::DriveOffset) {
                let offset = free.iter().position(|p| *p == Parameter::DriveOffset);
                undetermined.extend(offset.map(|i| free.remove(i)));
            }
            undetermined.sort_by_key(|p| *p as usize);
        };
        let misfit = task.misfit(&model);
        let model = if misfit <= MODEL { model } else { task.minimise(model.values, &free, misfit)? };
        let covariance = task.covariance(&model, |c| task.deviation(c, misfit));
        let m = model.fitted.len();
        let slopes = task.slopes(&model, &vec![1.0; m], &vec![1.0; task.cells.len()]);
        let covariance = covariance.map(|c| &c + &c * task.of_zeros(&slopes, misfit) * &c);
        let covariance = covariance.unwrap_or(DMatrix::zeros(m, m));
        let covariance = covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
        let of_cells =
            |f: &dyn Fn(&Cell) -> f64| DVector::from_iterator(task.cells.len(), task.cells.iter().map(f));
        let residuals = of_cells(&|c| c.signal - model.expected(c.a, c.drive));
        let deviations = of_cells(&|c| task.deviation(c, misfit));
        let freedom = task.cells.len() as f64 - m as f64;
        let of_noise = |(c, e): (&Cell, &f64)| e * e / (c.share * task.noise * task.noise);
        let chi2: f64 = task.cells.iter().zip(residuals.iter()).map(of_noise).sum();
        let chi2 = if freedom > 0.0 && task.noise > 0.0 { chi2 / freedom } else { f64::NAN };
        let exact = Exact { covariance, ..model };
        Ok(Fit { exact, undetermined, misfit, chi2, cells: places, slopes, residuals, deviations })
    }

    fn widths(&self, values: &Values, parameters: &[Parameter]) -> Vec<f64> {
        let size = crate::reduce::median(&mut self.cells.iter().map(|c| c.signal).collect::<Vec<_>>());
        let one = |p: &Parameter| width(*p, values, self.at.drives, [size, self.at.rig.before]);
        parameters.iter().map(one).collect()
    }

    fn deviation(&self, c: &Cell, misfit: f64) -> f64 {
        let noise = self.noise * self.noise * c.share;
        (noise + (misfit * c.signal).powi(2) + (MODEL * c.signal).powi(2)).sqrt()
    }

    /// Most likely relative deviation beyond noise, if significant. A mean of relative squares would be dominated by the noise of the weakest taps.
    fn misfit(&self, model: &Exact) -> f64 {
        let of = |c: &Cell| {
            let e = c.signal - model.expected(c.a, c.drive);
            e.is_finite().then_some([e * e, self.noise * self.noise * c.share, c.signal * c.signal])
        };
        let cells: Vec<[f64; 3]> = self.cells.iter().filter_map(of).collect();
        let unlikely = |m: f64| -> f64 {
            let one = |[e2, noise, s2]: &[f64; 3]| {
                let v = noise + (m * m + MODEL * MODEL) * s2;
                v.ln() + e2 / v
            };
            cells.iter().map(one).sum()
        };
        let at = |k: f64| MISFITS[0] * (MISFITS[1] / MISFITS[0]).powf(k);
        let best = at(lowest(|k| unlikely(at(k)), [0.0, 1.0], 64));
        if unlikely(0.0) - unlikely(best) > BEYOND_NOISE { best } else { 0.0 }
    }

    fn minimise(&self, values: Values, free: &[Parameter], misfit: f64) -> Result<Exact, ModelError> {
        let scale = self.widths(&values, free);
        let exact = Exact::new(values, free.to_vec(), self.at)?;
        let deviations: Vec<f64> = self.cells.iter().map(|c| self.deviation(c, misfit)).collect();
        let bounds: Vec<[f64; 2]> =
            free.iter().zip(&scale).map(|(p, s)| p.domain().map(|end| end / s)).collect();
        let setup = &self.at.rig.setup;
        let solid = is_solid(&setup.model) || setup.gauge.foil.is_some();
        let settled = if solid { SETTLED_SOLID } else { SETTLED };
        let x = free.iter().zip(&scale).map(|(p, s)| values[*p as usize] / s);
        let x = DVector::from_iterator(free.len(), x);
        let model = |x: &DVector<f64>, near: &Exact| {
            let mut values = near.values;
            for ((p, x), s) in free.iter().zip(x.iter()).zip(&scale) {
                let [lo, hi] = p.domain();
                values[*p as usize] = (x * s).clamp(lo, hi);
            }
            near.with(values, self.at)
        };
        let residuals = |exact: &Exact| {
            let residual = |(c, s): (&Cell, &f64)| (exact.expected(c.a, c.drive) - c.signal) / s;
            let all = self.cells.iter().zip(&deviations).map(residual);
            let r = DVector::from_iterator(self.cells.len(), all);
            r.iter().all(|r| r.is_finite()).then_some(r)
        };
        let slopes = |exact: &mut Exact| {
            exact.look_beside(self.at)?;
            let j = self.slopes(exact, &scale, &deviations);
            Ok(j.iter().all(|x| x.is_finite()).then_some(j))
        };
        let problem = least::Problem { model: &model, residuals: &residuals, slopes: &slopes };
        let mut found = least::minimise(&problem, x, exact, &bounds, settled)?;
        found.look_beside(self.at)?;
        Ok(found)
    }

    fn slopes(&self, model: &Exact, scale: &[f64], deviations: &[f64]) -> DMatrix<f64> {
        let of_cell = |(c, deviation): (&Cell, &f64)| {
            let gradient = model.gradient(c.a, c.drive).into_iter().zip(scale);
            gradient.map(|(slope, scale)| slope * (scale / deviation)).collect::<Vec<f64>>()
        };
        let rows: Vec<f64> = self.cells.iter().zip(deviations).flat_map(of_cell).collect();
        DMatrix::from_row_slice(self.cells.len(), model.fitted.len(), &rows)
    }

    /// Covariance for cells with these standard deviations; `None` if it is singular.
    fn covariance(&self, model: &Exact, deviation: impl Fn(&Cell) -> f64) -> Option<DMatrix<f64>> {
        let scale = self.widths(&model.values, &model.fitted);
        let deviations: Vec<f64> = self.cells.iter().map(deviation).collect();
        let j = self.slopes(model, &scale, &deviations);
        if j.nrows() < j.ncols() {
            return None;
        }
        let svd = least::values(j, false)?;
        let v = svd.v_t?.transpose();
        let largest = svd.singular_values.max();
        if svd.singular_values.min().partial_cmp(&(largest * 1e-11)) != Some(std::cmp::Ordering::Greater) {
            return None;
        }
        let inverse = DMatrix::from_diagonal(&svd.singular_values.map(|s| 1.0 / (s * s)));
        let c = &v * inverse * v.transpose();
        Some(DMatrix::from_fn(scale.len(), scale.len(), |i, k| c[(i, k)] * scale[i] * scale[k]))
    }

    /// Shared part of the information: Jᵀ D⁻¹ (Σ − D) D⁻¹ J, with the covariance Σ of means above the same zero readings.
    fn of_zeros(&self, slopes: &DMatrix<f64>, misfit: f64) -> DMatrix<f64> {
        let mut runs = std::collections::BTreeMap::<usize, DVector<f64>>::new();
        let mut shared = DMatrix::zeros(slopes.ncols(), slopes.ncols());
        for (i, c) in self.cells.iter().enumerate() {
            let pull = slopes.row(i).transpose() / self.deviation(c, misfit).powi(2);
            for (run, weight, share) in &c.zeros {
                let of_run = &pull * (weight * share.sqrt() * self.noise);
                shared -= &of_run * of_run.transpose();
                *runs.entry(*run).or_insert_with(|| DVector::zeros(slopes.ncols())) += of_run;
            }
        }
        runs.values().fold(shared, |sum, of_run| sum + of_run * of_run.transpose())
    }

    /// Parameter that the data determine least, if they do not determine it.
    fn worst(&self, model: &Exact, free: &[Parameter]) -> Option<usize> {
        let judged = |limit: f64, deviation: &dyn Fn(&Cell) -> f64| {
            let Some(c) = self.covariance(model, deviation) else {
                return (0..free.len()).map(|i| if i > 0 { f64::INFINITY } else { 0.0 }).collect::<Vec<_>>();
            };
            let widths = self.widths(&model.values, free).into_iter().enumerate();
            widths.map(|(i, width)| c[(i, i)].sqrt() / width / limit).collect()
        };
        let misfit = self.misfit(model);
        let noisy = judged(DETERMINED, &|c| self.deviation(c, misfit));
        let clean = judged(SOLVABLE, &|c| MODEL * c.signal);
        // The gauge factor is always fitted: it carries the size of the signal.
        let shares = noisy.iter().zip(&clean).map(|(a, b)| a.max(*b)).enumerate().skip(1);
        shares.filter(|(_, s)| s.is_nan() || *s > 1.0).max_by(|x, y| x.1.total_cmp(&y.1)).map(|(i, _)| i)
    }
}
