//! Solves the model at Chebyshev points of pieces that are halved until the ratio is smooth in each. A frictionless or sticking contact mostly needs
//! one piece: 12 taps in f32, 16 in f64, for each design and drive.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::design::Design;
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Referral, Task};
use crate::physics::chebyshev::{matrix, placed, points};
use crate::physics::driven::Driven;
use crate::scene::{Direction, Geometry, Setup, Theory};

use super::{Curve, LOOKS, NODES, Piece, Ratio, look};

/// Largest last coefficient of a smooth piece, relative to the first: absolute, and as a share of the tolerance.
const FINE: (f64, f64) = (1e-9, 0.3);
/// Share of the tolerance below which coefficients are dropped: they are noise, which a slope would magnify.
const NOISE: f64 = 0.1;
const HALVINGS: u32 = 8;
/// The same of an unrequested piece next to the gauge.
const FEW: u32 = 2;
const TOGETHER: usize = 1 << 13;
/// A piece narrower than this share of its distance is left out.
const NARROW: f64 = 1e-3;

/// Tolerance from which a piece has fewer points, and both numbers of points.
const POINTS: (f64, [usize; 2]) = (1e-6, [12, NODES]);
static TRANSFORMS: LazyLock<[Vec<Vec<f64>>; 2]> = LazyLock::new(|| POINTS.1.map(matrix));

/// The extent of a wanted curve: of distances asked, smallest and largest, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// Around them and the range of interest; to the tip where |ε| rises at the smallest.
    Asked([f64; 2]),
    /// The same, starting before the peak.
    Peak([f64; 2]),
    /// From the gauge to the tip.
    Whole([f64; 2]),
}

impl Reach {
    /// For taps between these distances (mm) at a pole of this direction: readings of a tilted one may lie anywhere on the curve.
    pub fn of(direction: Direction, ends: [f64; 2]) -> Self {
        if direction.is_upright() { Self::Asked(ends) } else { Self::Whole(ends) }
    }

    fn ends(self) -> [f64; 2] {
        match self {
            Self::Asked(ends) | Self::Peak(ends) | Self::Whole(ends) => ends,
        }
    }
}

/// A curve that is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask {
    /// Place of the design among those given.
    pub design: u32,
    /// Degrees or mm.
    pub drive: f64,
    /// Its extent.
    pub reach: Reach,
}

/// The curves of `asks` and the number of taps solved. Empty unless distances come from the model itself, with one gauge.
pub fn solve(
    setup: &Setup,
    (evaluator, referral): (&mut Evaluator<'_>, Referral),
    designs: &[Design],
    asks: &[Ask],
) -> Result<(Vec<Option<Curve>>, u64), SolveError> {
    if setup.estimate.theory != Theory::Exact || setup.gauge.second {
        return Ok((Vec::new(), 0));
    }
    evaluator.unguarded(|evaluator| {
        let (mut all, mut taps) = (Vec::with_capacity(asks.len()), 0);
        for asks in asks.chunks(TOGETHER) {
            let mut work = Work::new(setup, (evaluator, referral), designs, asks);
            work.run()?;
            taps += work.taps;
            all.extend(work.curves());
        }
        Ok((all, taps))
    })
}

#[derive(Clone, Copy)]
struct Open {
    ask: usize,
    u: [f64; 2],
    depth: u32,
}

struct Work<'w, 'a> {
    setup: &'w Setup,
    evaluator: &'w mut Evaluator<'a>,
    referral: Referral,
    designs: &'w [Design],
    asks: &'w [Ask],
    nodes: Vec<f64>,
    transform: &'static [Vec<f64>],
    pieces: Vec<Vec<Piece>>,
    taps: u64,
}

impl<'w, 'a> Work<'w, 'a> {
    fn new(
        setup: &'w Setup,
        (evaluator, referral): (&'w mut Evaluator<'a>, Referral),
        designs: &'w [Design],
        asks: &'w [Ask],
    ) -> Self {
        let transform: &[Vec<f64>] = &TRANSFORMS[usize::from(evaluator.tolerance() < POINTS.0)];
        let (nodes, pieces) = (points(transform.len()), vec![Vec::new(); asks.len()]);
        Self { setup, evaluator, referral, designs, asks, nodes, transform, pieces, taps: 0 }
    }

    fn run(&mut self) -> Result<(), SolveError> {
        let first: Vec<Open> = (0..self.asks.len()).flat_map(|ask| self.first(ask)).collect();
        self.fill(first)?;
        let beyond: Vec<Open> = (0..self.asks.len()).filter_map(|ask| self.beyond(ask)).collect();
        // Beyond the request a contact may find no equilibrium: the tip flicks past.
        self.referral.far = false;
        self.fill(beyond)
    }

    fn curves(self) -> Vec<Option<Curve>> {
        let Self { setup, designs, asks, pieces, .. } = self;
        let made = |(ask, mut pieces): (&Ask, Vec<Piece>)| {
            let shared = designs[ask.design as usize].shared.as_ref().filter(|_| !pieces.is_empty())?;
            let (of, driven) = (shared.model.clone(), Driven::of_users(setup.drive, ask.drive));
            pieces.sort_by(|p, q| p.u[0].total_cmp(&q.u[0]));
            let f = |p: &Piece| std::array::from_fn(|k| of.at_inverse(look(p.u, k)).0);
            let f: Vec<[f64; LOOKS + 1]> = pieces.iter().map(f).collect();
            Some(Curve::new(of, driven, pieces.into_iter().zip(&f), 0.0))
        };
        asks.par_iter().zip(pieces).map(made).collect()
    }

    fn first(&self, ask: usize) -> Vec<Open> {
        let Ask { design, reach, .. } = self.asks[ask];
        let ends = ends(self.setup, &self.designs[design as usize], reach);
        // Next to the gauge taps are hard, and needed only for readings that no distance beyond the peak gives.
        let [least, _] = reach.ends();
        let rough = |far: f64| matches!(reach, Reach::Whole(_)) && far < least;
        let depth = |far| if rough(far) { HALVINGS - FEW } else { 0 };
        let open = |w: &[f64]| Open { ask, u: [1.0 / w[0], 1.0 / w[1]], depth: depth(w[0]) };
        ends.windows(2).map(open).collect()
    }

    /// The rest of the whisker, if |ε| rises at the smallest requested distance: a larger one may have the same strain.
    fn beyond(&self, ask: usize) -> Option<Open> {
        let Ask { design, reach, .. } = self.asks[ask];
        let [least, _] = reach.ends();
        let pieces = &self.pieces[ask];
        let near = pieces.iter().map(|p| p.u[1]).fold(0.0, f64::max);
        let far = pieces.iter().map(|p| p.u[0]).fold(f64::INFINITY, f64::min);
        let tip = 1.0 / self.designs[design as usize].tuple.L_a;
        let shared = self.designs[design as usize].shared.as_ref()?;
        let u = near.min(1.0 / least);
        let rises = |p: &Piece| p.strain(&shared.model, 1.0, u).1 <= 0.0;
        let wanted = tip < far && pieces.iter().any(|p| p.u[0] <= u && u <= p.u[1] && rises(p));
        wanted.then_some(Open { ask, u: [tip, far], depth: 0 })
    }

    fn fill(&mut self, mut open: Vec<Open>) -> Result<(), SolveError> {
        if self.setup.model.geometry == Geometry::Linear {
            // The closed form is the curve.
            open.drain(..).for_each(|o| self.put(&o, Ratio::smooth(&[1.0])));
        }
        while !open.is_empty() {
            let ratios = self.ratios(&open)?;
            let mut next = Vec::new();
            let (n, tolerance, transform) = (self.nodes.len(), self.evaluator.tolerance(), self.transform);
            let fits: Vec<Option<Vec<f64>>> =
                ratios.par_chunks(n).map(|ratios| smooth(transform, tolerance, ratios)).collect();
            for ((o, ratios), fit) in open.iter().zip(ratios.chunks(n)).zip(fits) {
                match fit {
                    Some(c) => self.put(o, Ratio::smooth(&c)),
                    None if o.depth < HALVINGS && ratios.iter().any(|r| r.is_finite()) => {
                        let depth = o.depth + 1;
                        let middle = 0.5 * (o.u[0] + o.u[1]);
                        for (u, lost) in [[o.u[0], middle], [middle, o.u[1]]].into_iter().zip(lost(ratios)) {
                            match lost {
                                true => self.put(o, Ratio::Rough(vec![(0.5 * (u[0] + u[1]), f64::NAN)])),
                                false => next.push(Open { u, depth, ..*o }),
                            }
                        }
                    }
                    None => {
                        let places = self.nodes.iter().map(|x| placed(o.u, *x));
                        self.put(o, Ratio::Rough(places.zip(ratios.iter().copied()).collect()));
                    }
                }
            }
            open = next;
        }
        Ok(())
    }

    fn put(&mut self, o: &Open, ratio: Ratio) {
        self.pieces[o.ask].push(Piece { u: o.u, ratio });
    }

    /// ε/(θ f) at the nodes of every interval; NaN without a solution.
    fn ratios(&mut self, open: &[Open]) -> Result<Vec<f64>, SolveError> {
        let task = |o: &Open, x: f64| {
            let Ask { design, drive, .. } = self.asks[o.ask];
            Task { design, a: 1.0 / placed(o.u, x), drive, ..Task::default() }
        };
        let tasks: Vec<Task> =
            open.iter().flat_map(|o| self.nodes.iter().map(move |x| task(o, *x))).collect();
        let outcomes = self.evaluator.read(self.designs, &tasks, self.referral)?;
        self.taps += tasks.len() as u64;
        Ok(tasks.iter().zip(&outcomes).map(|(t, o)| self.ratio(t, o.strain)).collect())
    }

    fn ratio(&self, task: &Task, strain: f64) -> f64 {
        let Some(shared) = &self.designs[task.design as usize].shared else { return f64::NAN };
        let linear = task.driven(self.setup).size() * shared.model.value(task.a);
        // A contact that slid onto the gauge's near end shows nothing.
        if strain == 0.0 { f64::NAN } else { strain.abs() / linear }
    }
}

/// Halves of an interval to drop: no tap of the half, nor the next beyond the middle, has a solution. `ratios`: at its nodes, ascending.
fn lost(ratios: &[f64]) -> [bool; 2] {
    let middle = ratios.len() / 2;
    [&ratios[..=middle], &ratios[ratios.len() - middle - 1..]].map(|half| half.iter().all(|r| r.is_nan()))
}

/// Coefficients of the ratio from its values at the nodes, without noise; `None` if it is not smooth.
fn smooth(transform: &[Vec<f64>], tolerance: f64, ratios: &[f64]) -> Option<Vec<f64>> {
    if !ratios.iter().all(|r| r.is_finite()) {
        return None;
    }
    let coefficient = |row: &Vec<f64>| row.iter().zip(ratios).map(|(m, r)| m * r).sum();
    let mut c: Vec<f64> = transform.iter().map(coefficient).collect();
    let ((least, share), size) = (FINE, c[0].abs());
    let tail: f64 = c[c.len() - 2..].iter().map(|c| c.abs()).sum();
    if tail > least.max(share * tolerance) * size {
        return None;
    }
    let heard = c.iter().rposition(|c| c.abs() > NOISE * tolerance * size).unwrap_or(0);
    c.truncate(heard + 1);
    Some(c)
}

/// Ends of the first pieces of the curve of `design`, mm, falling; a little beyond the request, as a polynomial's slopes are poor at its ends.
fn ends(setup: &Setup, design: &Design, reach: Reach) -> Vec<f64> {
    let Some(shared) = &design.shared else { return Vec::new() };
    let ([x1, x2], tip) = (shared.gauge, design.tuple.L_a);
    let start = x1 + 0.02 * (x2 - x1);
    let [least, most] = reach.ends();
    let [from, to] = setup.estimate.range.unwrap_or([least, most]);
    let (least, most) = (least.min(from).max(start), most.max(to).min(tip));
    let whole = matches!(reach, Reach::Whole(_));
    let hi = if whole { tip } else { most.max(1.2 * least).min(tip) };
    // A contact on the gauge is another branch of f.
    let clear = |a: f64| if least > x2 { a.max(0.5 * (x2 + least)).min(least) } else { least };
    let mut ends = vec![hi, clear(0.7 * hi)];
    if !matches!(reach, Reach::Asked(_)) {
        ends.push(x2 + 0.5 * (shared.theory.peak().0 - x2));
    }
    if whole {
        ends.push(start);
    }
    ends.retain(|a| (start..=tip).contains(a));
    ends.sort_by(|p, q| q.total_cmp(p));
    if let Some(place) = ends.windows(2).position(|w| w[1] < x2 && x2 < w[0]) {
        ends.insert(place + 1, x2);
    }
    ends.dedup_by(|next, last| *next > *last * (1.0 - NARROW));
    ends
}
