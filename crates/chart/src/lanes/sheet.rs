//! Charts as numbers for a device: [`Ranker`] in the order that `shaders/ranking` reads.

use std::fmt::Write;

use super::rows::MOST;
use super::{Charted, Distance, Ranker};
use crate::axis::{AXES, Quantity};
use crate::distance::{Function, lobatto, matrix_at};
use crate::estimate::FAR;
use crate::kernel::ranking::{BEYOND, FARTHEST, Sheet};
use crate::physics::driven::Driven;
use crate::scene::{Per, RankBy};
use crate::series::Series;

/// Numbers of a distance before the points of its gauge, by their names in the shader: factor of the functions, largest arc over driveᵉ, number of
/// branches, where their matrix begins after CHOICE, scale and shift of drive, D/a, τa and x/a, a and 1/a.
const HEAD: [&str; 14] = crate::kernel::names![
    SCALE MOST_ARC COUNT CHOICE_OF DRIVE_AXIS DRIVE_SHIFT BASE_AXIS BASE_SHIFT TAPER_AXIS TAPER_SHIFT
    PLACE_AXIS PLACE_SHIFT A INVERSE
];

const GROUP: usize = 4;

/// Numbers kept of a tap besides the series of its K.
const KEPT: usize = 2;

const SLACK: f64 = 1e-6;

const RANKED: [Function; 2] = [Function::Strain, Function::Arc];

#[derive(Default)]
struct Written {
    shape: Vec<u32>,
    rows: Vec<[f32; GROUP]>,
}

impl Written {
    /// Writes `series`: its terms by group of orders over the drive, by place, by taper, by base.
    fn push(&mut self, series: &Series, groups: usize) {
        let mut terms: Vec<([usize; AXES], f64)> = Vec::new();
        for row in &series.rows {
            let [drive, length, base, taper] = row.orders;
            let of_row = row.coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0);
            terms.extend(of_row.map(|(place, c)| ([drive, length, base, taper, place], *c)));
        }
        let [drive, base, taper, place] =
            [Quantity::Drive, Quantity::Base, Quantity::Taper, Quantity::Place].map(|q| q as usize);
        let orders =
            |of: &[([usize; AXES], f64)], axis: usize| of.iter().map(|(o, _)| o[axis] + 1).max().unwrap_or(0);
        for group in 0..groups {
            let own: Vec<_> = terms.iter().filter(|(o, _)| o[drive] / GROUP == group).copied().collect();
            let places = orders(&own, place);
            self.shape.push(places as u32);
            for n in 0..places {
                let own: Vec<_> = own.iter().filter(|(o, _)| o[place] == n).copied().collect();
                let tapers = orders(&own, taper);
                self.shape.push(tapers as u32);
                for m in 0..tapers {
                    let own: Vec<_> = own.iter().filter(|(o, _)| o[taper] == m).copied().collect();
                    let mut rows = vec![[0.0f32; GROUP]; orders(&own, base)];
                    own.iter().for_each(|(o, c)| rows[o[base]][o[drive] % GROUP] = *c as f32);
                    self.shape.push(rows.len() as u32);
                    self.rows.extend(rows);
                }
            }
        }
    }
}

impl Ranker {
    /// The charts as a device reads them, one for each distance; `None` where it cannot: between charts, with a foil, of built whiskers or at tilted poles.
    pub(crate) fn sheet(&self) -> Option<Sheet> {
        let (scope, charts) = (&self.scope, &self.scope.charts);
        let all = scope.setup.gauge.foil.is_none() && scope.direction.is_upright();
        if self.between.is_some() || !all || scope.setup.built.is_some() {
            return None;
        }
        let branches = charts.iter().map(|chart| chart.branches.len()).max().unwrap_or(1);
        let all = || {
            let built = charts.iter().flat_map(|chart| &chart.branches);
            built.flat_map(|b| RANKED.map(|f| &b.series[f as usize]))
        };
        let most =
            |axis: Quantity| all().map(|series| series.sizes()[axis as usize]).max().unwrap_or(1).max(1);
        let groups = most(Quantity::Drive).max(self.points.min(GROUP)).div_ceil(GROUP);
        let heads = 2 * RANKED.len() * branches * charts.len();
        let mut written = Written { shape: vec![0; heads], rows: Vec::new() };
        for (n, chart) in charts.iter().enumerate() {
            for (b, branch) in chart.branches.iter().enumerate() {
                for (k, function) in RANKED.into_iter().enumerate() {
                    let at = 2 * (RANKED.len() * (n * branches + b) + k);
                    written.shape[at] = written.shape.len() as u32;
                    written.shape[at + 1] = written.rows.len() as u32;
                    written.push(&branch.series[function as usize], groups);
                }
            }
        }
        let at_points = written.rows.len();
        for chart in &self.charts {
            for t in &chart.at_points {
                let at = |k: usize| t.get(k).copied().unwrap_or(0.0);
                written.rows.extend((0..groups).map(|g| std::array::from_fn(|k| at(GROUP * g + k))));
            }
        }
        let kinds = [3, 5].map(|n: usize| matrix_at(&lobatto(n)).concat());
        let gauge = self.charts.iter().map(|c| c.gauge.len()).max().unwrap_or(1);
        let mut numbers = Vec::new();
        for (distance, chart) in self.distances.iter().zip(&self.charts) {
            numbers.extend(head(distance, chart, kinds[0].len()));
            let points = chart.gauge.iter().copied().chain(std::iter::repeat([0.0; 2]));
            numbers.extend(points.take(gauge).flatten());
        }
        let mut place = |part: Vec<f32>| {
            numbers.extend(&part);
            numbers.len() - part.len()
        };
        let drives_at = place(self.angles.iter().map(|angle| angle.stroke.drive).collect());
        let choice = place(kinds.concat().into_iter().map(|x| x as f32).collect());
        let back = place(self.from_points.iter().flat_map(|row| row[..self.points].to_vec()).collect());
        let powers = place(self.grid.iter().map(|stroke| stroke.power).collect());
        let (n, points, places) = (charts.len(), self.points, most(Quantity::Place));
        let (drives, pairs) = (self.angles.len().max(1), points * (points + 1) / 2);
        let own = self.angles.is_empty() || self.apart;
        let counts = [
            ("HEAD", HEAD.len()),
            ("DISTANCES", n),
            ("DRIVES", drives),
            ("ROW_DRIVES", if own { 1 } else { drives }),
            ("DRIVE_BITS", drives.ilog2() as usize + 1),
            ("POINTS", points),
            ("PAIRS", pairs),
            ("GROUPS", groups),
            ("PLACES", places),
            ("GAUGE", gauge),
            ("BRANCHES", branches),
            ("POWER", self.power as usize),
            ("DISTANCE", HEAD.len() + 2 * gauge),
            ("KEPT", points + KEPT),
            ("KEPT_ALL", (points + KEPT) * n),
            ("DRIVES_AT", drives_at),
            ("CHOICE", choice),
            ("BACK", back),
            ("POWERS", powers),
            ("AT_POINTS", at_points),
        ];
        let switches = [
            ("OWN", own),
            ("FOURTH", self.fourth),
            ("APART", own && !self.angles.is_empty()),
            ("PLAIN", self.theory.plain),
            ("DISPLACED", self.theory.displaced),
            ("ESTIMATES", self.by.is_some()),
            ("PER_DESIGN", scope.output.per == Per::Design),
            ("ELONGATION", self.elongation()),
            ("FIXED_GIVEN", self.fixed.is_some()),
        ];
        let [below, above] = [-SLACK, SLACK].map(|slack| move |x: f64| x + slack * x.abs());
        let [drive, _, base, tau, x] = scope.within;
        let [least, most] = BEYOND[usize::from(!own)];
        let reals = [
            ("REACH", scope.reach[1]),
            ("D_LO", below(base[0])),
            ("D_HI", above(base[1])),
            ("TAU_LO", below(tau[0])),
            ("TAU_HI", above(tau[1])),
            ("X_LO", below(x[0])),
            ("X_HI", above(x[1])),
            ("DRIVE_LO", below(drive[0])),
            ("DRIVE_HI", above(drive[1])),
            ("WIDTH", above(scope.width)),
            ("END_LO", self.ends[0].into()),
            ("END_HI", self.ends[1].into()),
            ("HUB", self.theory.hub.into()),
            ("SHEAR", self.theory.shear.into()),
            ("STRAIN_LIMIT", self.strain_limit.into()),
            ("NOISE", self.noise.into()),
            ("FIXED", self.fixed.unwrap_or(0.0).into()),
            ("MOST_DEVIATION", if own { MOST } else { self.largest() }.into()),
            ("FARTHEST", FARTHEST),
            ("FAR", FAR),
            ("BEYOND_LO", least),
            ("BEYOND_HI", most),
            ("COMMON_SCALE", self.affine[0].into()),
            ("COMMON_SHIFT", self.affine[1].into()),
        ];
        // `squares` and `noises` are the mean squares of errors and of noise, `largest` the largest absolute error.
        let rank = match self.by {
            Some(RankBy::ErrorMax) => "largest",
            Some(RankBy::NoiseRms) => "sqrt(noises)",
            Some(RankBy::TotalRms) => "sqrt(squares + noises)",
            _ => "sqrt(squares)",
        };
        let mut constants =
            format!("fn rank_of(squares: f32, largest: f32, noises: f32) -> f32 {{ return {rank}; }}\n");
        for (name, n) in HEAD.into_iter().zip(0..).chain(counts) {
            let _ = writeln!(constants, "const {name} = {n}u;");
        }
        for (name, on) in switches {
            let _ = writeln!(constants, "const {name} = {on};");
        }
        for (name, x) in reals {
            // A number beyond single precision is as good as the largest.
            let x = (x as f32).clamp(-f32::MAX, f32::MAX);
            let _ = writeln!(constants, "const {name}: f32 = {x:?}f;");
        }
        let tap = points * (points + 8) + gauge * places + 2 * places + 64;
        let read = written.shape.len() + at_points + n * tap;
        let ranked = drives * (2 * pairs + n * (points + 8));
        Some(Sheet {
            constants,
            numbers,
            shape: written.shape,
            rows: written.rows,
            kept: (points + KEPT) * n,
            rounds: if own { drives * (read + n * 16) } else { read + ranked },
            unit: Driven::of_users(scope.setup.drive, 1.0).size() as f32,
        })
    }
}

/// Numbers of a distance; `five`: start of the matrix of five branches, after that of three.
fn head(distance: &Distance, chart: &Charted, five: usize) -> [f32; HEAD.len()] {
    let [drive, _, base, taper, place] = chart.affine;
    let branches = chart.functions[0].len();
    let choice = if branches == 5 { five } else { 0 };
    let whole = [branches as f32, choice as f32];
    let parts = [[chart.scale, chart.most_arc], whole, drive, base, taper, place];
    let head = [parts.as_flattened(), &[distance.a, distance.inverse]].concat();
    std::array::from_fn(|k| head[k])
}
