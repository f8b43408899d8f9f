//! Taps read from the charts of their distances in place of being solved.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::axis::{AXES, Quantity};
use super::distance::{DistanceChart, power};
use super::function::linear_force;
use super::gauge::asked;
use super::lanes::{Readings, has_lanes};
use super::ranges::{NEAREST, Wanted, factors, holds, scaled, shaped};
use crate::design::{Design, amount, radians};
use crate::error::SolveError;
use crate::evaluate::{Outcome, Source, Task, outcome_of_chart};
use crate::kernel::Effects;
use crate::progress::NEVER;
use crate::reduce::Sweeps;
use crate::scene::{Contact, Direction, Geometry, Layout, Setup};

/// Taps below which charts do not pay.
pub const LEAST_TAPS: u64 = 1 << 17;

/// Most distances: each has its chart.
pub const MOST_DISTANCES: usize = 64;

const GRAIN: usize = 4096;

/// Charts of some distances of one rig.
#[derive(Debug)]
pub struct Reader {
    charts: Vec<DistanceChart>,
    /// Places of the charts at a distance, by its bits.
    at: FxHashMap<u64, Vec<usize>>,
    readings: Readings,
    /// The second gauge's functions, of the same charts; empty without a second gauge.
    beside: (Vec<DistanceChart>, Option<Readings>),
    contact: Contact,
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
        let sticks = setup.model.contact == Contact::Stick;
        let planar =
            !setup.gauge.second && setup.gauge.foil.is_none() && directions.iter().all(|d| d.is_upright());
        let plain = planar && Effects::new(&setup.model, setup.gauge.side, sticks).plain();
        if sticks || plain && setup.built.is_none() || !has_lanes() {
            return Ok(None);
        }
        let charts = charts(setup, (distances, directions), wanted, (tolerance, &NEVER))?;
        let readings = Readings::new(&charts, setup.drive);
        let besides: Vec<DistanceChart> = charts.iter().filter_map(DistanceChart::beside).collect();
        let of_besides = (!besides.is_empty()).then(|| Readings::new(&besides, setup.drive));
        let (contact, beside) = (setup.model.contact, (besides, of_besides));
        let mut at: FxHashMap<u64, Vec<usize>> = FxHashMap::default();
        charts.iter().enumerate().for_each(|(i, chart)| at.entry(chart.a.to_bits()).or_default().push(i));
        Ok((!charts.is_empty()).then_some(Self { charts, at, readings, beside, contact }))
    }

    /// Outcomes of `tasks`; `None` outside the charts.
    pub fn read(&self, setup: &Setup, designs: &[Design], tasks: &[Task]) -> Vec<Option<Outcome>> {
        let part = |tasks: &[Task]| {
            let mut out = vec![None; tasks.len()];
            let (mut places, mut taps, mut found) = (Vec::new(), Vec::new(), Vec::new());
            let mut found_beside = Vec::new();
            let mut at: Vec<Vec<usize>> = vec![Vec::new(); self.charts.len()];
            for (place, task) in tasks.iter().enumerate() {
                let charts = self.at.get(&task.a.to_bits()).into_iter().flatten();
                charts.for_each(|i| at[*i].push(place));
            }
            for (i, chart) in self.charts.iter().enumerate() {
                places.clear();
                taps.clear();
                found.clear();
                found_beside.clear();
                let also = self.beside.0.get(i);
                for &place in &at[i] {
                    let task = &tasks[place];
                    let Some(numbers) = self.numbers(setup, (chart, also), designs, task) else { continue };
                    places.push(place);
                    taps.push(numbers);
                }
                self.readings.read(i, &taps, &mut found);
                if let Some(beside) = &self.beside.1 {
                    beside.read(i, &taps, &mut found_beside);
                }
                let cos = radians(chart.direction)[0].cos();
                for (k, ((place, read), q)) in places.iter().zip(&found).zip(&taps).enumerate() {
                    let task = &tasks[*place];
                    let design = &designs[task.design as usize];
                    let Some(shared) = &design.shared else { continue };
                    let linear = linear_force(setup, shared, task.a, q[0]);
                    let force = linear * cos * (1.0 + f64::from(read.functions[2]));
                    let friction = match self.contact {
                        Contact::Coulomb(mu) if mu != 0.0 => f64::from(read.share) * mu,
                        _ => 0.0,
                    };
                    let sticking = friction != 0.0 && read.share.abs() < 1.0;
                    let [strain, arc, _] = read.functions.map(f64::from);
                    let beside = found_beside.get(k).map(|read| read.functions.map(f64::from));
                    out[*place] = outcome_of_chart(
                        setup,
                        design,
                        task,
                        ([strain, arc, force, friction], beside),
                        sticking,
                    );
                }
            }
            out
        };
        tasks.par_chunks(GRAIN).flat_map_iter(part).collect()
    }

    /// Drive (rad or mm), x1/a, D/a, τa and x2/a of `task`, if it is at the distance and direction of `chart`, within it and within `also`.
    fn numbers(
        &self,
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
        let drive = amount(setup.drive, task.drive);
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
        Self::read(self, setup, designs, tasks)
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
    let far = distances.iter().copied().fold(0.0, f64::max);
    // With a lean taps depend on the sign of the drive.
    let leans = directions.iter().any(|direction| direction.lean != 0.0);
    let power = if leans { power(setup).min(1) } else { power(setup) };
    let chart = |(a, direction): &(f64, Direction)| {
        let Some((ranges, width)) = wanted.ranges(setup, far, NEAREST * a) else { return Ok(None) };
        let ranges = scaled(setup.drive, &ranges, *a);
        let job = (power, tolerance, stop);
        DistanceChart::towards(
            setup,
            (*a, *direction),
            (ranges, width / a, false),
            job,
            &mut Sweeps::default(),
        )
    };
    let places: Vec<(f64, Direction)> =
        distances.iter().flat_map(|a| directions.iter().map(move |d| (*a, *d))).collect();
    let charts: Vec<Option<DistanceChart>> =
        places.par_iter().map(chart).collect::<Result<_, SolveError>>()?;
    Ok(charts.into_iter().flatten().collect())
}
