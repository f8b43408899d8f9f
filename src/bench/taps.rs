//! What is solved: the same well-spread taps in every configuration.

use rayon::prelude::*;

use crate::design::{Design, amount};
use crate::error::Error;
use crate::evaluate::Task;
use crate::scene::axis::Points;
use crate::scene::sampler::Sampler;
use crate::scene::{Axis, Output, Setup, Space, Study, Tuple};
use crate::verify::configuration::{self, Configuration};

/// Distances at which every whisker is tapped.
pub const DISTANCES: usize = 8;

/// The configurations of model §5, all effects off to all on.
const EXACT: [&str; 8] =
    ["hooke", "surface", "timoshenko", "neo", "mooney-coulomb", "stick", "pole-far", "yeoh"];

/// The configurations of the exact rod, from the simplest to everything on.
pub fn exact() -> Vec<Configuration> {
    EXACT.into_iter().filter_map(named).collect()
}

/// The paper's closed forms.
pub fn linear() -> Configuration {
    configuration::all()[0]
}

fn named(name: &str) -> Option<Configuration> {
    configuration::all().into_iter().find(|c| c.name == name)
}

/// The study of `c` on whiskers of L_a = 50 mm with a gauge of 2 mm at 5 mm, of these D, d, a and θ; only the best designs are written.
fn study(c: &Configuration, [big, tip, a, theta]: [Axis; 4]) -> Study {
    let [length, place, grid] = [50.0, 5.0, 2.0].map(Axis::Value);
    let space = Space::grid([big, tip, length, place, grid, a, theta]).expect("few enough to count");
    let output = Output { tuples: Some(false), distances: false, top: Some(100), ..Output::default() };
    Study { setup: c.setup(), space, output }
}

/// `samples` whiskers, spread over D 8–12 mm, d 2–7 mm and θ 0.5–10° by Sobol points, each tapped at [`DISTANCES`] distances from 20 to
/// 48 mm.
///
/// # Errors
/// No sample, or more than there are.
pub fn independent(c: &Configuration, samples: u64) -> Result<Study, Error> {
    let points = Points { samples, sampler: Sampler::Sobol, seed: 1 };
    let axis = |min: f64, max: f64, dimension| Axis::samples(min, max, false, points, dimension);
    let a = Axis::steps(20.0, 48.0, DISTANCES as u64)?;
    Ok(study(c, [axis(8.0, 12.0, 0)?, axis(2.0, 7.0, 1)?, a, axis(0.5, 10.0, 2)?]))
}

/// About `taps` taps on a grid of D, d and 100 tap angles at 10 distances.
///
/// # Errors
/// More values than an axis can have.
pub fn gridded(c: &Configuration, taps: u64) -> Result<Study, Error> {
    let (angles, distances) = if taps >= 10_000 { (100, 10) } else { (10, 10) };
    let side = ((taps as f64 / (angles * distances) as f64).sqrt().round() as u64).max(1);
    let axis = |from: f64, to: f64, steps: u64| match steps {
        1 => Ok(Axis::Value(from)),
        _ => Axis::steps(from, to, steps),
    };
    let axes = [
        axis(8.0, 12.0, side)?,
        axis(2.0, 7.0, side)?,
        axis(21.0, 48.0, distances)?,
        axis(0.5, 10.0, angles)?,
    ];
    Ok(study(c, axes))
}

/// A setup with designs and taps.
#[derive(Debug)]
pub struct Taps {
    /// What is computed.
    pub setup: Setup,
    /// Whiskers.
    pub designs: Vec<Design>,
    /// Taps, those of one whisker after another.
    pub tasks: Vec<Task>,
}

impl Taps {
    /// About `count` independent taps of `c`: a whole number of whiskers, one at least.
    ///
    /// # Errors
    /// None for the configurations above.
    pub fn new(c: &Configuration, count: usize) -> Result<Self, Error> {
        let Study { setup, space, .. } = independent(c, count.div_ceil(DISTANCES).max(1) as u64)?;
        let layout = space.layout().expect("the taps of a benchmark are a grid");
        let tuples: Vec<_> = (0..layout.n_designs).map(|k| layout.design(k)).collect();
        let mut tasks = Vec::with_capacity(layout.len() as usize);
        for (design, tuple) in (0..).zip(&tuples) {
            for i in 0..layout.n_distances {
                tasks.push(Task::of(design, &Tuple { a: layout.distance(i), ..layout.stroke(tuple, 0) }));
            }
        }
        let designs = tuples.par_iter().map(|t| Design::new(&setup, *t)).collect();
        Ok(Self { designs, tasks, setup })
    }

    /// 1e-3 θ f_max of tap `i`: below it an error is no longer relative to the strain.
    pub fn least(&self, i: usize) -> f64 {
        let task = &self.tasks[i];
        let peak = self.designs[task.design as usize].shared.as_ref().map_or(0.0, |s| s.peak);
        1e-3 * peak * amount(self.setup.drive, task.drive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spec_is_valid_and_as_large_as_asked() {
        assert_eq!((exact().len(), linear().name), (EXACT.len(), "linear"));
        for c in exact().iter().chain([&linear()]) {
            let taps = Taps::new(c, 41).unwrap();
            assert_eq!((taps.designs.len(), taps.tasks.len()), (6, 48), "{}", c.name);
            assert!((0..48).all(|i| taps.least(i) > 0.0));
            for n in [1_000, 10_000, 1_000_000, 100_000_000] {
                let taps = gridded(c, n).unwrap().space.layout().unwrap().len();
                assert!((taps as f64 / n as f64 - 1.0).abs() < 0.15, "{taps} of {n}");
            }
        }
    }

    #[test]
    fn more_taps_begin_with_the_same_ones() {
        let hooke = exact()[0];
        let (few, many) = (Taps::new(&hooke, 40).unwrap(), Taps::new(&hooke, 400).unwrap());
        assert_eq!(few.tasks, many.tasks[..40]);
        assert!(
            few.designs
                .iter()
                .zip(&many.designs)
                .all(|(a, b)| (a.tuple.D, a.tuple.d) == (b.tuple.D, b.tuple.d))
        );
        assert!(few.tasks.iter().all(|t| (20.0..=48.0).contains(&t.a) && (0.5..=10.0).contains(&t.drive)));
    }
}
