//! Taps read from the charts of their distances in place of being solved.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::axis::{AXES, Quantity};
use super::distance::{DistanceChart, power};
use super::function::linear_force;
use super::gauge::asked;
use super::lanes::Readings;
use super::ranges::{NEAREST, Wanted, factors, holds, scaled, shaped};
use crate::design::{Design, tilted};
use crate::error::SolveError;
use crate::evaluate::{Outcome, Source, Task, outcome_of_chart};
use crate::kernel::{Effects, cpu::Vectors};
use crate::progress::NEVER;
use crate::reduce::{Sweeps, range};
use crate::scene::{Contact, Direction, Geometry, Layout, Setup};

/// Taps below which charts do not pay.
pub const LEAST_TAPS: u64 = 1 << 17;

/// Most distances: each has its chart.
pub const MOST_DISTANCES: usize = 64;

const GRAIN: usize = 4096;

/// Charts of some distances of one rig.
#[derive(Debug)]
pub struct Reader {
    charts: Readings,
    /// The second gauge's functions at each of `charts`, if any.
    beside: Option<Readings>,
}

impl Reader {
    /// Charts of `setup` at `distances` mm for whiskers `wanted`, accurate to a tenth of `tolerance`; `None` if not smooth, or not worth it.
    pub fn new(
        setup: &Setup,
        (distances, directions): (&[f64], &[Direction]),
        wanted: &Wanted,
        tolerance: f64,
    ) -> Result<Option<Self>, SolveError> {
        // Contacts that always stick have no chart; the ideal rod in one plane solves as fast as it reads.
        let planar =
            !setup.gauge.second && setup.gauge.foil.is_none() && directions.iter().all(|d| d.is_upright());
        let plain = planar && Effects::new(&setup.model, setup.gauge.side, false).plain();
        let pays = !(setup.model.contact == Contact::Stick || plain && setup.built.is_none());
        let Some(has) = Vectors::found().filter(|_| pays) else { return Ok(None) };
        let charts = charts(setup, (distances, directions), wanted, (tolerance, &NEVER))?;
        let second = || charts.iter().filter_map(DistanceChart::beside).collect();
        let beside = setup.gauge.second.then(|| Readings::new(second(), setup.drive, has));
        Ok((!charts.is_empty()).then(|| Self { charts: Readings::new(charts, setup.drive, has), beside }))
    }

    /// Drive (rad or mm), x1/a, D/a, τa and x2/a of `task`, if it is at the distance and direction of `chart`, within it and within `also`.
    fn numbers(
        setup: &Setup,
        (chart, also): (&DistanceChart, Option<&DistanceChart>),
        designs: &[Design],
        task: &Task,
    ) -> Option<[f64; AXES]> {
        let a = chart.a;
        if task.a != a || task.direction != chart.direction || also.is_some() != setup.gauge.second {
            return None;
        }
        let design = &designs[task.design as usize];
        let shared = design.shared.as_ref().filter(|_| design.admits(setup, a, task.drive))?;
        let [x1, x2] = shared.gauge;
        let drive = task.driven(setup).size();
        let (base, taper) = (design.tuple.D / a, shared.taper.tau * a);
        let scaled = drive * factors(setup.drive, a)[Quantity::Drive as usize];
        let length = if shaped(setup) { design.tuple.L_a / a } else { 0.0 };
        let ends = asked(setup, [x1, x2]).map(|x| [scaled, length, base, taper, x / a]);
        let inside = |chart: &DistanceChart| {
            holds([0.0, chart.gauges.width], (x2 - x1) / a) && ends.iter().all(|q| chart.holds(q))
        };
        (inside(chart) && also.is_none_or(inside)).then_some([drive, x1 / a, base, taper, x2 / a])
    }
}

impl Source for Reader {
    fn read(&self, setup: &Setup, designs: &[Design], tasks: &[Task]) -> Vec<Option<Outcome>> {
        let part = |tasks: &[Task]| {
            let mut out = vec![None; tasks.len()];
            for (i, chart) in self.charts.of.iter().enumerate() {
                let also = self.beside.as_ref().map(|second| &second.of[i]);
                let numbers =
                    |(place, task)| Some((place, Self::numbers(setup, (chart, also), designs, task)?));
                let (places, taps): (Vec<usize>, Vec<[f64; AXES]>) =
                    tasks.iter().enumerate().filter_map(numbers).unzip();
                let found = self.charts.read(i, &taps);
                let second = self.beside.as_ref().map(|second| second.read(i, &taps));
                let [cos, _] = tilted(chart.direction);
                for (k, place) in places.into_iter().enumerate() {
                    let task = &tasks[place];
                    let (design, (functions, share)) = (&designs[task.design as usize], found[k]);
                    let Some(shared) = &design.shared else { continue };
                    let [strain, arc, force] = functions.map(f64::from);
                    let force = linear_force(setup, shared, task.a, task.driven(setup)) * cos * (1.0 + force);
                    let friction = match setup.model.contact {
                        Contact::Coulomb(mu) if mu != 0.0 => f64::from(share) * mu,
                        _ => 0.0,
                    };
                    let sticking = friction != 0.0 && share.abs() < 1.0;
                    let second = second.as_ref().map(|read| read[k].0.map(f64::from));
                    let read = ([strain, arc, force, friction], second);
                    out[place] = outcome_of_chart(setup, design, task, read, sticking);
                }
            }
            out
        };
        tasks.par_chunks(GRAIN).flat_map_iter(part).collect()
    }
}

/// The directions of the poles of `layout`, each charted separately; `None` if they are sampled with the designs.
pub fn directions(layout: &Layout) -> Option<Vec<Direction>> {
    let own = layout.design(0);
    let strokes = (0..layout.n_directions).map(|k| k * layout.drives_each());
    let shared = own.tilt.is_nan() && own.lean.is_nan();
    shared.then(|| strokes.map(|j| layout.stroke(&own, j).direction()).collect())
}

/// The charts that exist at `distances` mm, against poles of `directions`, for whiskers `wanted`, strain accurate to a tenth of `tolerance`.
/// [`SolveError::Stopped`] once `stop` is set.
pub fn charts(
    setup: &Setup,
    (distances, directions): (&[f64], &[Direction]),
    wanted: &Wanted,
    (tolerance, stop): (f64, &AtomicBool),
) -> Result<Vec<DistanceChart>, SolveError> {
    if setup.model.geometry != Geometry::Exact || distances.len() * directions.len() > MOST_DISTANCES {
        return Ok(Vec::new());
    }
    let [_, far] = range(distances.iter().copied());
    let power = power(setup, directions.iter().any(|direction| direction.lean != 0.0));
    let chart = |(a, direction): &(f64, Direction)| {
        let Some((ranges, width)) = wanted.ranges(setup, far, NEAREST * a) else { return Ok(None) };
        let ranges = scaled(setup.drive, &ranges, *a);
        let (asked, job) = ((ranges, width / a, false), (power, tolerance, stop));
        DistanceChart::towards(setup, (*a, *direction), asked, job, &mut Sweeps::default())
    };
    let places: Vec<(f64, Direction)> =
        distances.iter().flat_map(|a| directions.iter().map(move |d| (*a, *d))).collect();
    let charts: Vec<Option<DistanceChart>> =
        places.par_iter().map(chart).collect::<Result<_, SolveError>>()?;
    Ok(charts.into_iter().flatten().collect())
}
