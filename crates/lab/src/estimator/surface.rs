//! Strain of a whisker over (a, θ) as piecewise polynomials of the exact model.
//! ε/(θ f), smooth and near 1, is interpolated in u = 1/a and the drive, at Chebyshev points of pieces that are halved until they are fine. f is a
//! closed form, so its peak and its kink at the gauge's far end need no pieces.

use super::{Extent, ModelError, Values, parameter::scene_with};
use crate::curve::{self, Curve, LOOKS, Ratio, look};
use crate::design::Design;
use crate::evaluate::{Evaluator, Referral, Task};
use crate::physics::chebyshev::{coefficients, placed, points, scaled, series, transpose, twice};
use crate::scene::{Drive, Tuple};
use crate::{
    error::SolveError,
    measure::Rig,
    physics::{driven::Driven, linear::StrainCurve},
};

const NODES: [usize; 2] = [curve::NODES, 10];
/// Relative size of the last coefficients of a fine piece.
const FINE: f64 = 1e-8;
/// Maximum of halvings in u and in the drive: a boundary between sticking and sliding never converges.
const HALVINGS: [u32; 2] = [4, 3];
const STEPS: usize = 128;

/// |ε| over contact distance and drive.
#[derive(Debug, Clone)]
pub struct Surface {
    curve: StrainCurve,
    kind: Drive,
    /// True if polynomials are in the fourth root of the drive: a yielding skin gives the ratio a part in drive^(−1/3).
    yields: bool,
    pub reach: [f64; 2],
    pub drives: [f64; 2],
    strips: Vec<Strip>,
    /// Relative error: sum of the last coefficients of the worst piece.
    pub error: f64,
}

#[derive(Debug, Clone)]
struct Strip {
    drives: [f64; 2],
    pieces: Vec<Piece>,
    /// Smallest u with a solution; 0 if all have one.
    end: f64,
}

#[derive(Debug, Clone)]
struct Piece {
    u: [f64; 2],
    /// A column for each order in the drive, over all orders in u.
    columns: Vec<[f64; NODES[0]]>,
    /// f at the looks of a curve, equal for all drives.
    looks: [f64; LOOKS + 1],
    tails: [f64; 2],
}

impl Surface {
    /// Solves the model with these values over `at`. Beyond the tip the taper is continued; the reach ends at the gauge's
    /// near end, short of the apex, and, at large drives, where a thin tip slips off.
    pub fn build(values: &Values, at: Extent<'_>) -> Result<Self, ModelError> {
        let Extent { rig, open, side, reach, drives, hard } = at;
        let mut setup = scene_with(&rig.setup, values);
        setup.gauge.side = side;
        // Upright poles, first gauge.
        setup.gauge.second = false;
        let (reach, tuple) = continued(rig, reach)?;
        let design = Design::new(&setup, tuple);
        let curve = design.shared.as_ref().map(|s| s.model.clone()).ok_or(ModelError::TooFar)?;
        // A contact on the gauge is another branch of f.
        let edge = 1.0 / curve.gauge[1];
        let (kind, yields, strips) = (setup.drive, setup.model.indentation, Vec::new());
        let surface = Self { curve, kind, yields, reach, drives, strips, error: 0.0 };
        let evaluator = Evaluator::new(&setup, open(&setup.model)?);
        let referral = Referral { most: hard[0], ..Referral::SAMPLES };
        let mut solver = Solve { surface, designs: [design], evaluator, referral, spare: hard[1] };
        let whole = [1.0 / reach[1], 1.0 / reach[0]];
        let [first, last] = whole;
        let cut = if edge > first && edge < last { vec![[first, edge], [edge, last]] } else { vec![whole] };
        let mut open = vec![(drives, 0)];
        while let Some((drives, depth)) = open.pop() {
            let may = depth < HALVINGS[1] && drives[0] < drives[1];
            let end = solver.end(whole, drives[1])?;
            let strip = if end > 0.0 && may { None } else { Some(solver.pieces(&cut, end, drives)?) };
            match strip.filter(|pieces| !may || pieces.iter().all(|p| p.tails[1] <= FINE)) {
                Some(pieces) => solver.surface.strips.push(Strip { drives, pieces, end }),
                None => {
                    let mid = solver.surface.drive_at(drives, 0.0);
                    open.extend([([mid, drives[1]], depth + 1), ([drives[0], mid], depth + 1)]);
                }
            }
        }
        let surface = solver.surface;
        if surface.strips.iter().all(|s| s.pieces.is_empty()) {
            return Err(ModelError::Solve(SolveError::TooHard));
        }
        let tails = surface.strips.iter().flat_map(|s| &s.pieces).map(|p| p.tails[0] + p.tails[1]);
        let error = tails.filter(|t| t.is_finite()).fold(0.0, f64::max);
        Ok(Self { error, ..surface })
    }

    /// Strain at a (mm) and drive; NaN without a solution.
    pub fn value(&self, a: f64, drive: f64) -> f64 {
        let drive = drive.clamp(self.drives[0], self.drives[1]);
        let (u, strip) = (1.0 / a, self.strip(drive));
        let Some(piece) = strip.piece(u) else { return f64::NAN };
        let c = piece.at(self.place_of(strip.drives, drive), false);
        self.driven(drive).size() * self.curve.value(a) * series(&c, scaled(piece.u, u)).0
    }

    /// Derivatives of the strain by a, 1/mm, and by the drive, per degree or mm (0 where it is clamped); NaN without a solution.
    pub fn slopes(&self, a: f64, drive: f64) -> [f64; 2] {
        let [first, last] = self.drives;
        let at = drive.clamp(first, last);
        let (u, strip) = (1.0 / a, self.strip(at));
        let Some(piece) = strip.piece(u) else { return [f64::NAN; 2] };
        // Scaled drive, and its derivative by the drive.
        let [lo, hi] = strip.drives.map(|end| self.base(end));
        let by_root = if self.yields { 0.25 * self.base(at) / at } else { 1.0 };
        let (y, dy) = (self.place_of(strip.drives, at), 2.0 * by_root / (hi - lo));
        let (x, dx) = (scaled(piece.u, u), 2.0 / (piece.u[1] - piece.u[0]));
        let (ratio, ratio_x) = series(&piece.at(y, false), x);
        let ((f, f_u), size) = (self.curve.at_inverse(u), self.driven(at).size());
        let by_a = -u * u * size * (f_u * ratio + f * ratio_x * dx);
        let moves = first < last && at == drive;
        let by_drive = self.driven(1.0).size() * f * ratio + size * f * series(&piece.at(y, true), x).0 * dy;
        [by_a, if moves { by_drive } else { 0.0 }]
    }

    fn driven(&self, drive: f64) -> Driven {
        Driven::of_users(self.kind, drive)
    }

    fn base(&self, drive: f64) -> f64 {
        if self.yields { drive.sqrt().sqrt() } else { drive }
    }

    /// Drive scaled to −1 … 1 between `ends`.
    fn place_of(&self, ends: [f64; 2], drive: f64) -> f64 {
        scaled(ends.map(|end| self.base(end)), self.base(drive))
    }

    fn drive_at(&self, ends: [f64; 2], place: f64) -> f64 {
        let base = placed(ends.map(|end| self.base(end)), place);
        if self.yields { base.powi(4) } else { base }
    }

    fn strip(&self, drive: f64) -> &Strip {
        self.strips.iter().find(|s| drive <= s.drives[1]).unwrap_or(&self.strips[self.strips.len() - 1])
    }

    /// Curve over a at one drive, clamped to [`Self::drives`].
    pub fn at(&self, drive: f64) -> Curve {
        let drive = drive.clamp(self.drives[0], self.drives[1]);
        let strip = self.strip(drive);
        let y = self.place_of(strip.drives, drive);
        let cuts = strip
            .pieces
            .iter()
            .map(|p| (curve::Piece { u: p.u, ratio: Ratio::Smooth(p.at(y, false)) }, &p.looks));
        Curve::new(self.curve.clone(), self.driven(drive), cuts, strip.end)
    }
}

impl Strip {
    fn piece(&self, u: f64) -> Option<&Piece> {
        let piece = self.pieces.iter().find(|p| u <= p.u[1]).or(self.pieces.last());
        piece.filter(|_| u >= self.end)
    }
}

impl Piece {
    /// Coefficients in u at the scaled drive y; with `slope` their derivatives by y.
    fn at(&self, y: f64, slope: bool) -> [f64; NODES[0]] {
        let mut sums = [0.0; NODES[0]];
        // T₋₁ = T₁; T'ₙ = n Uₙ₋₁, U₋₁ = 0.
        let (mut before, mut t) = (if slope { 0.0 } else { y }, 1.0);
        for (n, column) in self.columns.iter().enumerate().skip(usize::from(slope)) {
            let t_n = if slope { n as f64 * t } else { t };
            sums.iter_mut().zip(column).for_each(|(sum, c)| *sum += t_n * c);
            (before, t) = (t, 2.0 * y * t - before);
        }
        sums
    }
}

/// Distances of `reach` at which the whisker of `rig` can be tapped, and the whisker with its taper continued.
pub(crate) fn continued(rig: &Rig, reach: [f64; 2]) -> Result<([f64; 2], Tuple), ModelError> {
    let shared = rig.shared();
    let tau = shared.taper.tau;
    let apex = match shared.model.end() {
        Some(end) => end,
        None if tau > 0.0 => 0.98 / tau,
        None => f64::INFINITY,
    };
    let reach = [reach[0].max(shared.gauge[0] * 1.02 + 1e-3), reach[1].min(apex)];
    if reach[0].partial_cmp(&reach[1]) != Some(std::cmp::Ordering::Less) {
        return Err(ModelError::InsideGauge);
    }
    let t = rig.design.tuple;
    let length = t.L_a.max(reach[1]);
    let tuple = if length > t.L_a { Tuple { L_a: length, d: t.D * (1.0 - tau * length), ..t } } else { t };
    Ok((reach, tuple))
}

struct Solve<'a> {
    surface: Surface,
    designs: [Design; 1],
    evaluator: Evaluator<'a>,
    referral: Referral,
    /// Taps that may still stay without a solution.
    spare: usize,
}

impl Solve<'_> {
    /// Smallest u of a range with a solution at `drive`: 0 if all have one, infinite if none has.
    fn end(&mut self, range: [f64; 2], drive: f64) -> Result<f64, ModelError> {
        let mut solved = |us: &[f64]| -> Result<Vec<bool>, ModelError> {
            let tasks: Vec<Task> = us.iter().map(|u| Task { a: 1.0 / u, drive, ..Task::default() }).collect();
            let outcomes = self.evaluator.run_referring(&self.designs, &tasks, self.referral)?;
            Ok(outcomes.iter().map(|o| o.strain.is_finite()).collect())
        };
        if solved(&range[..1])?[0] {
            return Ok(0.0);
        }
        let step = (range[1] - range[0]) / STEPS as f64;
        let us: Vec<f64> = (0..=STEPS).map(|k| range[1] - step * k as f64).collect();
        let found = us.iter().zip(solved(&us)?).take_while(|(_, solved)| *solved).last();
        Ok(found.map_or(f64::INFINITY, |(u, _)| *u))
    }

    /// Pieces over the intervals `cut` of u, ascending, from `end` on, halved until they are fine.
    fn pieces(&mut self, cut: &[[f64; 2]], end: f64, drives: [f64; 2]) -> Result<Vec<Piece>, ModelError> {
        let mut done = Vec::new();
        let left = cut.iter().filter(|u| u[1] > end).map(|u| [u[0].max(end), u[1]]);
        let mut open: Vec<_> = left.map(|u| (u, 0)).collect();
        while !open.is_empty() {
            let solved = self.solve(&open.iter().map(|(u, _)| *u).collect::<Vec<_>>(), drives)?;
            let mut next = Vec::new();
            for (piece, (u, depth)) in solved.into_iter().zip(open) {
                if piece.tails[0] <= FINE || depth >= HALVINGS[0] {
                    done.push(piece);
                } else {
                    let mid = 0.5 * (u[0] + u[1]);
                    next.extend([([u[0], mid], depth + 1), ([mid, u[1]], depth + 1)]);
                }
            }
            open = next;
        }
        done.sort_by(|p, q| p.u[0].total_cmp(&q.u[0]));
        Ok(done)
    }

    fn solve(&mut self, us: &[[f64; 2]], drives: [f64; 2]) -> Result<Vec<Piece>, ModelError> {
        let columns = if drives[0] < drives[1] { NODES[1] } else { 1 };
        let (xs, ys) = (points(NODES[0]), points(columns));
        let ys: Vec<f64> = ys.into_iter().map(|y| self.surface.drive_at(drives, y)).collect();
        let mut tasks = Vec::with_capacity(us.len() * NODES[0] * columns);
        for u in us {
            for x in &xs {
                let a = 1.0 / placed(*u, *x);
                tasks.extend(ys.iter().map(|drive| Task { a, drive: *drive, ..Task::default() }));
            }
        }
        let outcomes = self.evaluator.run_referring(&self.designs, &tasks, self.referral)?;
        let unsolved = outcomes.iter().filter(|o| o.strain.is_nan()).count();
        self.spare = self.spare.checked_sub(unsolved).ok_or(ModelError::Solve(SolveError::TooHard))?;
        let (surface, curve) = (&self.surface, &self.surface.curve);
        let linear = |t: &Task| surface.driven(t.drive).size() * curve.value(t.a);
        let ratios: Vec<f64> = outcomes.iter().zip(&tasks).map(|(o, t)| o.strain.abs() / linear(t)).collect();
        let piece = |(u, ratios): (&[f64; 2], &[f64])| {
            let rows: Vec<Vec<f64>> = ratios.chunks(columns).map(<[f64]>::to_vec).collect();
            let c = transpose(&twice(coefficients, &rows));
            let size = |x: &f64| x.abs();
            let along: f64 = c.iter().flat_map(|column| &column[NODES[0] - 2..]).map(size).sum();
            let across: f64 = c[columns.saturating_sub(2).max(1)..].iter().flatten().map(size).sum();
            let scale = c[0][0].abs();
            let columns = c.iter().map(|column| std::array::from_fn(|i| column[i])).collect();
            let looks = std::array::from_fn(|k| curve.at_inverse(look(*u, k)).0);
            Piece { u: *u, columns, looks, tails: [along / scale, across / scale] }
        };
        Ok(us.iter().zip(ratios.chunks(NODES[0] * columns)).map(piece).collect())
    }
}
