//! How much each parameter matters: at the optimum, and over the whole box.

use std::sync::atomic::{AtomicBool, Ordering};

use super::evaluate::Scorer;
use super::score::Score;
use super::variables::Variables;
use crate::error::Error;
use crate::reduce::Spread;
use crate::scene::sampler::Sampler;
use crate::scene::{Column, Tuple};

/// Base samples of the global indices.
const SAMPLES: u32 = 2048;
/// Relative step of the local derivatives.
const STEP: f64 = 1e-3;
/// The parameters, in row order.
pub const PARAMETERS: [Column; 6] = [
    Column::BaseDiameter,
    Column::TipDiameter,
    Column::Length,
    Column::GaugePosition,
    Column::GridLength,
    Column::Drive,
];

/// Values for K_sd and for total_rms_mm; `None` where they could not be computed.
pub type Pair = [Option<f64>; 2];

/// Sensitivities of the nominal whisker, whatever its tolerances.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Elasticities ∂ln F/∂ln p at the optimum, in % per %.
    pub local: Vec<(Column, Pair)>,
    /// First and total Sobol' indices of each variable over its bounds.
    pub global: Vec<(Column, Pair, Pair)>,
    /// Base samples of the global indices: fewer where the search was asked to stop.
    pub samples: u32,
    /// Those of them that have K_sd, and that have total_rms_mm, in all their evaluations; the indices are over these.
    pub complete: [u32; 2],
    /// Evaluations spent.
    pub evaluations: u64,
}

/// Around `best` by `local`, over the box of `variables` by `global`, as far as that is there when `stop` is set.
pub fn run(
    [global, local]: [&mut Scorer<'_>; 2],
    variables: &Variables,
    best: &Tuple,
    seed: u64,
    stop: &AtomicBool,
) -> Result<Sensitivity, Error> {
    let mut s =
        Sensitivity { local: Vec::new(), global: Vec::new(), samples: 0, complete: [0; 2], evaluations: 0 };
    elasticities(local, best, &mut s)?;
    indices(global, variables, best, (seed, stop), &mut s)?;
    Ok(s)
}

fn elasticities(scorer: &mut Scorer<'_>, best: &Tuple, out: &mut Sensitivity) -> Result<(), Error> {
    let moved = |column: Column, share: f64| {
        let mut values = best.to_array();
        values[column as usize] *= 1.0 + share;
        Tuple::from_array(values)
    };
    let points: Vec<Tuple> =
        PARAMETERS.iter().flat_map(|&c| [moved(c, STEP), moved(c, -STEP)]).chain([*best]).collect();
    let scores = scorer.nominal(&points)?;
    out.evaluations += points.len() as u64;
    let here = scores[points.len() - 1].figures;
    for (i, &column) in PARAMETERS.iter().enumerate() {
        let (up, down) = (scores[2 * i].figures, scores[2 * i + 1].figures);
        let slope = |f: usize| {
            // One side is enough where the other is no whisker.
            let rise = match (up[f].is_finite(), down[f].is_finite()) {
                (true, true) => (up[f] - down[f]) / 2.0,
                (true, false) => up[f] - here[f],
                _ => here[f] - down[f],
            };
            let elasticity = rise / STEP / here[f];
            Some(elasticity).filter(|e| e.is_finite() && best.to_array()[column as usize] != 0.0)
        };
        out.local.push((column, [slope(0), slope(1)]));
    }
    Ok(())
}

/// First-order indices after A. Saltelli et al., Comput. Phys. Commun. 181 (2010), total ones after M. J. W. Jansen (1999), on
/// scrambled Sobol points.
fn indices(
    scorer: &mut Scorer<'_>,
    variables: &Variables,
    best: &Tuple,
    (seed, stop): (u64, &AtomicBool),
    out: &mut Sensitivity,
) -> Result<(), Error> {
    let k = variables.len();
    let (_, drive) = variables.place(best);
    let seed = seed.wrapping_mul(2).wrapping_add(1);
    let coordinate =
        |i: u32, c: usize| (f64::from(Sampler::Sobol.coordinate(seed, c as u32, i)) + 0.5) / 4_294_967_296.0;
    // For each base sample: A, B, and A with one column of B.
    let points: Vec<Tuple> = (0..SAMPLES)
        .flat_map(|i| (0..k + 2).map(move |m| (i, m)))
        .map(|(i, m)| {
            let from_b = |c: usize| m == 1 || m >= 2 && m - 2 == c;
            let u: Vec<f64> = (0..k).map(|c| coordinate(i, if from_b(c) { k + c } else { c })).collect();
            variables.point(&u, drive)
        })
        .collect();
    let scores = until(stop, scorer, &points, k + 2)?;
    out.evaluations += scores.len() as u64;
    out.samples = (scores.len() / (k + 2)) as u32;
    out.global = variables.list().iter().map(|v| (v.column, [None; 2], [None; 2])).collect();
    for f in 0..2 {
        let complete = |row: &&[Score]| row.iter().all(|s| s.figures[f].is_finite());
        let rows: Vec<Vec<f64>> = scores
            .chunks(k + 2)
            .filter(complete)
            .map(|row| row.iter().map(|s| s.figures[f]).collect())
            .collect();
        out.complete[f] = rows.len() as u32;
        let mut all = Spread::default();
        rows.iter().for_each(|r| r[..2].iter().for_each(|x| all.push(*x)));
        let (Some(mean), Some(sd)) = (all.mean(), all.sd().filter(|sd| *sd > 0.0)) else { continue };
        let (n, variance) = (rows.len() as f64, sd * sd);
        for (c, (_, first, total)) in out.global.iter_mut().enumerate() {
            let together: f64 = rows.iter().map(|r| (r[1] - mean) * (r[2 + c] - r[0])).sum();
            let apart: f64 = rows.iter().map(|r| (r[0] - r[2 + c]).powi(2)).sum();
            first[f] = Some(together / n / variance);
            total[f] = Some(apart / (2.0 * n) / variance);
        }
    }
    Ok(())
}

/// Scores of `points`, `each` of which belong together, as far as they are there when `stop` is set.
fn until(
    stop: &AtomicBool,
    scorer: &mut Scorer<'_>,
    points: &[Tuple],
    each: usize,
) -> Result<Vec<Score>, Error> {
    let mut scores = scorer.nominal_while(points, &|| !stop.load(Ordering::Relaxed))?;
    scores.truncate(scores.len() / each * each);
    Ok(scores)
}
