//! The chart of one contact distance: strain, arc and force of every tap there, for any model.

use std::sync::atomic::AtomicBool;

use nalgebra::DMatrix;

use super::axis::{AXES, Axis, FIRST_PLACE, Quantity};
use super::build::{Bound, Built, check};
pub use super::function::{FUNCTIONS, Function, power, room, solved};
use super::function::{SHARE, bounds, functions, variables};
use super::gauge::Rule;
use super::ranges::holds;
use super::taps::{Taps, driven};
use super::weight::Weight;
use crate::error::SolveError;
use crate::evaluate::{Outcome, beside_linear};
use crate::physics::inverse::bracketed;
use crate::reduce::Sweeps;
use crate::scene::{Contact, Direction, Grip, Setup, Signal};
use crate::status::Status;

/// Share of the tolerance for the error of the mean over the points of a gauge.
const FOLDED: f64 = 0.02;

/// Share of the tolerance where a contact chooses whether it slides.
const CHOICE: f64 = 0.3;

/// Numbers of friction coefficients to try between −μ and μ.
const NODES: [usize; 2] = [3, 5];

const CHOICES: usize = 128;

/// A chart at one distance.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceChart {
    /// a, mm.
    pub a: f64,
    /// Direction of the pole.
    pub direction: Direction,
    /// Gauges that it serves, and their quadrature points.
    pub gauges: Rule,
    /// e: functions are those of [`Function`] divided by driveᵉ, with which they vanish.
    pub power: i32,
    /// Box and series: of the model, or of a sliding contact with each of the ratios T/P of [`Self::ratios`], over the same box.
    pub branches: Vec<Built<FUNCTIONS>>,
    /// Weights of a gauge's points, for whiskers other than cones of one material.
    pub weight: Option<Weight>,
    /// The functions of the second gauge, if any, over a separate box.
    pub beside: Option<Built<FUNCTIONS>>,
    /// T/P from −μ to μ of Coulomb friction, ascending; empty where a contact does not choose.
    pub ratios: Vec<f64>,
    /// Largest relative error of the strain where the contact chooses; of the series where it does not.
    pub error: f64,
    /// Sweeps of the taps solved to make and to check it.
    pub sweeps: Sweeps,
}

impl DistanceChart {
    /// The chart of taps of `setup` at `a` mm against a pole of `direction` over ranges of quantities and for gauges up to a width over a; strain accurate to
    /// a tenth of `tolerance`. Functions are over driveᵉ, e = `power`; stops when `stop` is set. `sweeps` begins empty and collects the solved
    /// taps. With `all_drives` the range of the drive is not cut. `None` also for friction with a tilted pole or two gauges, and for root moments and
    /// forces. With a foil `width` is that of all gauges.
    pub fn towards(
        setup: &Setup,
        (a, direction): (f64, Direction),
        (mut ranges, width, all_drives): ([[f64; 2]; AXES], f64, bool),
        (power, tolerance, stop): (i32, f64, &AtomicBool),
        sweeps: &mut Sweeps,
    ) -> Result<Option<Self>, SolveError> {
        let spatial = setup.gauge.second || !direction.is_upright();
        if setup.signal != Signal::Strain || setup.channels.is_some() || spatial && setup.built.is_some() {
            return Ok(None);
        }
        let served = |mut chart: Self| {
            chart.weight = Weight::of(setup, a, chart.axes())?;
            chart.gauges = match setup.gauge.foil {
                Some(_) => Rule::middle(width),
                None => Rule::fewest(&chart, width, FOLDED * tolerance)?,
            };
            Some(chart)
        };
        let maps = variables(setup, power);
        ranges[Quantity::Place as usize][0] = ranges[Quantity::Place as usize][0].max(FIRST_PLACE);
        let whole = |k: usize| all_drives && k == Quantity::Drive as usize;
        let axes = std::array::from_fn(|k| Axis { range: ranges[k], map: maps[k], whole: whole(k) });
        let job = (power, tolerance, stop);
        let grip = match setup.model.contact {
            Contact::Coulomb(0.0) if !spatial => Some(Grip::Slide(0.0)),
            Contact::Frictionless | Contact::Coulomb(0.0) => None,
            _ if spatial => return Ok(None),
            Contact::Stick => None,
            // A contact that may roll on a pole depends on its turn, which is not charted.
            Contact::Coulomb(_) if setup.model.pole_radius > 0.0 => return Ok(None),
            Contact::Coulomb(mu) => {
                return Ok(Self::choosing(setup, a, mu, (axes, width), job, sweeps)?.and_then(served));
            }
        };
        let Some(built) = branch(setup, (a, direction, grip), (axes, width), job, sweeps)? else {
            return Ok(None);
        };
        let mut chart = Self::of(a, power, vec![built], Vec::new(), *sweeps);
        if spatial {
            chart.direction = direction;
        }
        if setup.gauge.second {
            let error = SHARE * tolerance / axes[Quantity::Drive as usize].range[1].powi(power);
            let (place, job) = ((a, direction), (power, error, solved(power, false), stop));
            chart.beside = branch_beside(setup, place, *chart.axes(), job, &mut chart.sweeps)?;
        }
        let whole = chart.beside.is_some() == setup.gauge.second;
        Ok(if whole { served(chart) } else { None })
    }

    /// The chart of contacts with friction `mu` that choose whether they slide, over `axes` or a part of them.
    fn choosing(
        setup: &Setup,
        a: f64,
        mu: f64,
        (mut axes, width): ([Axis; AXES], f64),
        job: (i32, f64, &AtomicBool),
        sweeps: &mut Sweeps,
    ) -> Result<Option<Self>, SolveError> {
        let (power, tolerance, stop) = job;
        let mut known: Vec<(f64, Built<FUNCTIONS>)> = Vec::new();
        for nodes in NODES {
            let ratios: Vec<f64> = lobatto(nodes).into_iter().map(|x| x * mu).collect();
            while let Some(ratio) = ratios.iter().find(|r| known.iter().all(|(known, _)| known != *r)) {
                let grip = Some(Grip::Slide(*ratio));
                let Some(built) = branch(setup, (a, Direction::UPRIGHT, grip), (axes, width), job, sweeps)?
                else {
                    return Ok(None);
                };
                if built.axes != axes {
                    axes = built.axes;
                    known.clear();
                }
                known.push((*ratio, built));
            }
            known.sort_by(|a, b| a.0.total_cmp(&b.0));
            let branches = known.iter().map(|(_, built)| built.clone()).collect();
            let mut chart = Self::of(a, power, branches, ratios, *sweeps);
            chart.error = chart.choice(setup, stop)?;
            if chart.error <= CHOICE * tolerance {
                return Ok(Some(chart));
            }
            *sweeps = chart.sweeps;
        }
        Ok(None)
    }

    fn of(a: f64, power: i32, branches: Vec<Built<FUNCTIONS>>, ratios: Vec<f64>, sweeps: Sweeps) -> Self {
        let error =
            |b: &Built<FUNCTIONS>| b.errors[0] * b.axes[Quantity::Drive as usize].range[1].powi(power);
        let error = branches.iter().map(error).fold(0.0, f64::max);
        let (direction, beside) = (Direction::UPRIGHT, None);
        let gauges = Rule { width: 0.0, points: Vec::new(), centred: false };
        let weight = None;
        Self { a, direction, gauges, power, branches, weight, beside, ratios, error, sweeps }
    }

    /// The box where it holds.
    pub fn axes(&self) -> &[Axis; AXES] {
        &self.branches[0].axes
    }

    /// True if it holds at the quantities `q`. A gauge that begins at the clamp has its points behind it.
    pub fn holds(&self, q: &[f64; AXES]) -> bool {
        let inside = |k: usize| match k == Quantity::Place as usize {
            true => holds([self.axes()[k].range[0] - FIRST_PLACE, self.axes()[k].range[1]], q[k]),
            false => holds(self.axes()[k].range, q[k]),
        };
        (0..AXES).all(inside)
    }

    fn choice(&mut self, setup: &Setup, stop: &AtomicBool) -> Result<f64, SolveError> {
        let mut taps = Taps::new(setup, (self.a, Direction::UPRIGHT, None), None, (1e-8, stop));
        let flat = self.axes().map(|axis| axis.is_point());
        let point = |x: [f64; AXES]| std::array::from_fn(|k| self.axes()[k].at(x[k]));
        let points: Vec<[f64; AXES]> = (0..CHOICES).map(|i| point(check(i, &flat))).collect();
        let found = taps.solve(&points)?;
        self.sweeps.merge(&taps.sweeps);
        let error = |(q, o): (&[f64; AXES], &Outcome)| {
            let [strain, ..] = self.at(q);
            let own = room(q) * o.deviation / (1.0 + o.deviation);
            o.deviation.is_finite().then(|| (strain + own).abs() / room(q))
        };
        Ok(points.iter().zip(&found).filter_map(error).fold(0.0, f64::max))
    }

    /// The functions at quantities `q`, in the order of [`Function`].
    pub fn at(&self, q: &[f64; AXES]) -> [f64; FUNCTIONS] {
        let x = std::array::from_fn(|k| self.axes()[k].place(q[k]));
        let scale = q[Quantity::Drive as usize].powi(self.power);
        let read =
            |b: &Built<FUNCTIONS>| -> [f64; FUNCTIONS] { std::array::from_fn(|f| b.series[f].at(x) * scale) };
        if self.ratios.is_empty() {
            return read(&self.branches[0]);
        }
        let values: Vec<[f64; FUNCTIONS]> = self.branches.iter().map(read).collect();
        let back = matrix_at(&lobatto(values.len()));
        let over = |f: usize| -> Vec<f64> {
            back.iter().map(|row| row.iter().zip(&values).map(|(m, v)| m * v[f]).sum()).collect()
        };
        let [first, .., last] = values.as_slice() else { return read(&self.branches[0]) };
        let arc = Function::Arc as usize;
        // Tangential forces that pull the whisker outwards shorten the arc.
        let share = match () {
            () if last[arc] >= 0.0 => 1.0,
            () if first[arc] <= 0.0 => -1.0,
            () => bracketed(|x| polynomial(&over(arc), x), -1.0, 1.0),
        };
        std::array::from_fn(|f| polynomial(&over(f), share))
    }

    /// The second gauge's functions as a separate chart; None without a second gauge.
    pub fn beside(&self) -> Option<Self> {
        let built = self.beside.clone()?;
        Some(Self { branches: vec![built], ratios: Vec::new(), beside: None, ..self.clone() })
    }
}

fn polynomial(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// n Chebyshev–Lobatto points from −1 to 1.
pub fn lobatto(n: usize) -> Vec<f64> {
    let at = |k: usize| 2 * k as i64 - (n as i64 - 1);
    (0..n).map(|k| (0.5 * std::f64::consts::PI * at(k) as f64 / (n - 1) as f64).sin()).collect()
}

/// Powers of x from values at `points`: the row of each power.
pub fn matrix_at(points: &[f64]) -> Vec<Vec<f64>> {
    let n = points.len();
    let vandermonde = DMatrix::from_fn(n, n, |i, k| points[i].powi(k as i32));
    let inverse = vandermonde.try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
    (0..n).map(|k| (0..n).map(|i| inverse[(k, i)]).collect()).collect()
}

/// Box and series of taps at `a` mm with contact `grip`; with a foil, for gauges of `width` over a.
fn branch(
    setup: &Setup,
    (a, direction, grip): (f64, Direction, Option<Grip>),
    (axes, width): ([Axis; AXES], f64),
    (power, tolerance, stop): (i32, f64, &AtomicBool),
    sweeps: &mut Sweeps,
) -> Result<Option<Built<FUNCTIONS>>, SolveError> {
    let chooses = matches!(grip, Some(Grip::Slide(friction)) if friction != 0.0 || setup.model.contact != Contact::Coulomb(0.0));
    let ends = [Quantity::Drive, Quantity::Place].map(|k| axes[k as usize].range[1]);
    let bounds = bounds(setup, ends, (power, tolerance), chooses);
    let taps = Taps::new(setup, (a, direction, grip), Some(width * a), (solved(power, chooses), stop));
    let value = |q: &[f64; AXES], o: &Outcome| {
        let scale = q[Quantity::Drive as usize].powi(power);
        Some(functions(setup, (a, direction), q, o)?.map(|v| v / scale))
    };
    taps.built(axes, &bounds, value, sweeps)
}

/// Charts the functions of a tilted pole or a second gauge (model §6) over `axes`: the second gauge's strain, φ and λ, each less its value in linear theory, divided by driveᵉ, e = `power`, each to `error`.
fn branch_beside(
    setup: &Setup,
    (a, direction): (f64, Direction),
    axes: [Axis; AXES],
    (power, error, solved, stop): (i32, f64, f64, &AtomicBool),
    sweeps: &mut Sweeps,
) -> Result<Option<Built<FUNCTIONS>>, SolveError> {
    let known = beside_linear(direction);
    let value = |q: &[f64; AXES], o: &Outcome| -> Option<[f64; FUNCTIONS]> {
        let found =
            [o.strain_2 / o.strain_linear, o.azimuth, o.slide / driven(setup, a, q).path(a + setup.hub)];
        let (rooms, scale) = ([room(q), 1.0, 1.0], q[Quantity::Drive as usize].powi(power));
        let values = std::array::from_fn(|f| rooms[f] * (found[f] - known[f]) / scale);
        (!o.status.has(Status::NO_READING)).then_some(values)
    };
    let taps = Taps::new(setup, (a, direction, None), None, (solved, stop));
    taps.built(axes, &[Bound::of(error); FUNCTIONS], value, sweeps)
}
