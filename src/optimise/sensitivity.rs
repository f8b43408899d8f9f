//! Sensitivity to each parameter: at the optimum, and over the whole box.

use super::evaluate::Scorer;
use super::score::Score;
use super::shares::{self, LEVELS, LINES, Line, Shares};
use super::variables::{Variables, value};
use crate::error::Error;
use crate::scene::sampler::Sampler;
use crate::scene::search::Quantity;
use crate::scene::{Column, Property, Tuple};

const STEP: f64 = 1e-3;

/// Values for K_sd and for total_rms_mm; `None` if not computable.
pub type Pair = [Option<f64>; 2];

/// Sensitivities of the nominal whisker, without tolerances.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Elasticities ∂ln F/∂ln p at the optimum, % per %.
    pub local: Vec<(Quantity, Pair)>,
    /// Sobol' indices: shares of the variance of ln K_sd and of ln total_rms_mm due to each variable over its bounds.
    pub global: Vec<(Quantity, [Option<Shares>; 2])>,
    /// Number of evaluated points: fewer after a stop or if time ran out.
    pub samples: u32,
    /// Points with K_sd > 0 and with total_rms_mm > 0; the shares use these.
    pub complete: [u32; 2],
    pub evaluations: u64,
}

fn elasticities(scorer: &mut Scorer<'_>, best: &Tuple) -> Result<Vec<(Quantity, Pair)>, Error> {
    let setup = scorer.judge.setup;
    let rigs = setup.rigs.as_deref();
    let properties = rigs.map_or(&[][..], |rigs| &rigs.properties).iter().copied().map(Quantity::Property);
    // Order of rows: properties of the rig come before the drive.
    let whisker =
        Column::ALL.into_iter().take_while(|column| *column != Column::Distance).map(Quantity::Column);
    let parameters: Vec<Quantity> =
        whisker.chain(properties).chain([Quantity::Column(Column::Drive)]).collect();
    let moved = |quantity: Quantity, share: f64| match (quantity, rigs) {
        (Quantity::Property(property), Some(rigs)) => {
            let values = rigs.properties.iter().zip(rigs.values(best.rig));
            let by = |own: Property| if own == property { 1.0 + share } else { 1.0 };
            let values: Vec<f64> = values.map(|(own, value)| value * by(*own)).collect();
            let scale = by(Property::Scale);
            Tuple { D: scale * best.D, d: scale * best.d, rig: rigs.number(&values), ..*best }
        }
        (Quantity::Property(_), None) => *best,
        (Quantity::Column(column), _) => {
            let mut values = best.to_array();
            values[column as usize] *= 1.0 + share;
            Tuple::from_array(values).of_rig(best.rig)
        }
    };
    let points: Vec<Tuple> =
        parameters.iter().flat_map(|&q| [moved(q, STEP), moved(q, -STEP)]).chain([*best]).collect();
    let scores = scorer.nominal(&points, &|| true)?;
    let here = scores[points.len() - 1].figures;
    let pair = |(i, &quantity): (usize, &Quantity)| {
        let (up, down) = (scores[2 * i].figures, scores[2 * i + 1].figures);
        let slope = |f: usize| {
            // One-sided if the other side is not a valid whisker.
            let rise = match (up[f].is_finite(), down[f].is_finite()) {
                (true, true) => (up[f] - down[f]) / 2.0,
                (true, false) => up[f] - here[f],
                _ => here[f] - down[f],
            };
            let elasticity = rise / STEP / here[f];
            Some(elasticity).filter(|e| e.is_finite() && value(setup, best, quantity) != 0.0)
        };
        (quantity, [slope(0), slope(1)])
    };
    Ok(parameters.iter().enumerate().map(pair).collect())
}

/// Elasticities around `best` by `local`; shares over the box of `variables` by `global`, from the points scored until `on` returns false.
/// Shares refer to logarithms: next to a fold total_rms_mm grows as 1/|x − x₀|, so that it has no variance, while its logarithm has one.
pub fn run(
    [global, local]: &mut [Scorer<'_>; 2],
    variables: &Variables,
    best: &Tuple,
    seed: u64,
    on: &dyn Fn() -> bool,
) -> Result<Sensitivity, Error> {
    let local = elasticities(local, best)?;
    let k = variables.list.len();
    let (_, drive) = variables.place(best);
    let seed = seed.wrapping_mul(2).wrapping_add(1);
    let coordinate = |i: usize, c: usize| {
        (f64::from(Sampler::Sobol.coordinate(seed, c as u32, i as u32)) + 0.5) / 4_294_967_296.0
    };
    let point = |i: usize, along: usize, j: usize| {
        let at = |c: usize| if c == along { shares::level(i, j) } else { coordinate(i, c) };
        variables.point(&(0..k).map(at).collect::<Vec<_>>(), drive)
    };
    let lines = (0..LINES).flat_map(|i| (0..k).map(move |c| (i, c)));
    let points: Vec<Tuple> = lines.flat_map(|(i, c)| (0..LEVELS).map(move |j| point(i, c, j))).collect();
    let mut scores = global.nominal(&points, on)?;
    // Only complete sets of lines count.
    scores.truncate(scores.len() / (k * LEVELS) * (k * LEVELS));
    let mut found = Sensitivity {
        evaluations: (2 * local.len() + 1 + scores.len()) as u64,
        samples: scores.len() as u32,
        complete: [0; 2],
        global: variables.list.iter().map(|v| (v.quantity, [None; 2])).collect(),
        local,
    };
    for f in 0..2 {
        let value = |s: &Score| Some(s.figures[f].ln()).filter(|y| y.is_finite()).unwrap_or(f64::NAN);
        let lines: Vec<Line> =
            scores.chunks(LEVELS).map(|line| std::array::from_fn(|j| value(&line[j]))).collect();
        found.complete[f] = lines.iter().flatten().filter(|y| y.is_finite()).count() as u32;
        for (c, (_, shares)) in found.global.iter_mut().enumerate() {
            let along: Vec<Line> = lines.iter().skip(c).step_by(k).copied().collect();
            shares[f] = shares::shares(&along);
        }
    }
    Ok(found)
}
