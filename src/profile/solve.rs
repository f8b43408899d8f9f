//! Solves the model at Chebyshev points of pieces that are halved until the ratio is smooth in each.
//!
//! # Cost
//! Where the contact is frictionless or sticks one piece mostly does: 12 taps in f32, 16 in f64, for each design and drive, beside the taps
//! asked for; along a fine axis of drives these are read from a few solved ones as the others are.

use crate::design::{Design, amount};
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Task};
use crate::physics::chebyshev::{coefficients, placed, points};
use crate::scene::{Geometry, Setup, Theory};

use super::{Piece, Profile, Ratio};

/// Tolerance from which a piece has fewer points, and how many it has.
const NODES: (f64, [usize; 2]) = (1e-6, [12, 16]);
/// Size of the last coefficients, relative to the first, that a smooth piece has at most: so small, or a share of the tolerance.
const FINE: (f64, f64) = (1e-9, 0.3);
/// Share of the tolerance below which coefficients are left out: they are noise, which a slope would magnify.
const NOISE: f64 = 0.1;
/// Most halvings of a piece.
const HALVINGS: u32 = 8;
/// Curves that are solved together.
const TOGETHER: usize = 1 << 13;

/// Where a curve is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// Around these distances (smallest and largest, mm) and the range of interest; to the tip where |ε| rises at the smallest.
    Asked([f64; 2]),
    /// The same from before the peak, and to the tip.
    Peak([f64; 2]),
    /// From the gauge to the tip.
    Whole,
}

/// A curve that is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask {
    /// Place of the design among those given.
    pub design: u32,
    /// Degrees or mm.
    pub drive: f64,
    /// Where.
    pub reach: Reach,
}

/// The curves of `asks` and how many taps were solved for them; no curve of what is no whisker, or has no distance beyond its gauge. Nothing
/// is solved, and none comes back, unless distances are told by the model itself. With `drives` the asks come in runs of one design and
/// reach over all of them.
///
/// # Errors
/// A backend that fails.
pub fn solve(
    setup: &Setup,
    evaluator: &mut Evaluator<'_>,
    designs: &[Design],
    asks: &[Ask],
    drives: Option<&[f64]>,
) -> Result<(Vec<Option<Profile>>, u64), SolveError> {
    if setup.estimate.theory != Theory::Exact {
        return Ok((Vec::new(), 0));
    }
    let run = drives.map_or(1, <[f64]>::len).max(1);
    let (mut all, mut taps) = (Vec::with_capacity(asks.len()), 0);
    for asks in asks.chunks((TOGETHER / run).max(1) * run) {
        let mut work = Work::new(setup, evaluator, designs, asks);
        work.run(drives)?;
        taps += work.taps;
        all.extend(work.profiles());
    }
    Ok((all, taps))
}

/// An interval of u in which the model is to be solved.
#[derive(Clone, Copy)]
struct Open {
    ask: usize,
    u: [f64; 2],
    depth: u32,
}

/// Curves under way.
struct Work<'w, 'a> {
    setup: &'w Setup,
    evaluator: &'w mut Evaluator<'a>,
    designs: &'w [Design],
    asks: &'w [Ask],
    nodes: Vec<f64>,
    pieces: Vec<Vec<Piece>>,
    taps: u64,
}

impl<'w, 'a> Work<'w, 'a> {
    fn new(
        setup: &'w Setup,
        evaluator: &'w mut Evaluator<'a>,
        designs: &'w [Design],
        asks: &'w [Ask],
    ) -> Self {
        let (least, [few, many]) = NODES;
        let nodes = points(if evaluator.tolerance() >= least { few } else { many });
        Self { setup, evaluator, designs, asks, nodes, pieces: vec![Vec::new(); asks.len()], taps: 0 }
    }

    fn run(&mut self, drives: Option<&[f64]>) -> Result<(), SolveError> {
        let first: Vec<Open> = (0..self.asks.len()).flat_map(|ask| self.first(ask)).collect();
        self.fill(first, drives)?;
        let beyond: Vec<Open> = (0..self.asks.len()).filter_map(|ask| self.beyond(ask)).collect();
        self.fill(beyond, None)
    }

    /// The curve of an ask over `pieces`.
    fn profile(&self, ask: usize, pieces: Vec<Piece>) -> Option<Profile> {
        let Ask { design, drive, .. } = self.asks[ask];
        let shared = self.designs[design as usize].shared.as_ref()?;
        let amount = amount(self.setup.drive, drive);
        (!pieces.is_empty()).then(|| Profile::new(shared.model, amount, pieces))
    }

    fn profiles(self) -> Vec<Option<Profile>> {
        (0..self.asks.len()).map(|ask| self.profile(ask, self.pieces[ask].clone())).collect()
    }

    /// Where an ask begins; a contact on the gauge is another branch of f.
    fn first(&self, ask: usize) -> Vec<Open> {
        let design = &self.designs[self.asks[ask].design as usize];
        let Some([lo, hi]) = domain(self.setup, design, self.asks[ask].reach) else { return Vec::new() };
        let edge = design.shared.as_ref().map_or(f64::NAN, |s| s.gauge[1]);
        let ends = if lo < edge && edge < hi { vec![hi, edge, lo] } else { vec![hi, lo] };
        ends.windows(2).map(|w| Open { ask, u: [1.0 / w[0], 1.0 / w[1]], depth: 0 }).collect()
    }

    /// The rest of the whisker where |ε| rises at the smallest distance asked: a larger one may have the same strain.
    fn beyond(&self, ask: usize) -> Option<Open> {
        let Ask { design, reach, .. } = self.asks[ask];
        let Reach::Asked([least, _]) = reach else { return None };
        let pieces = &self.pieces[ask];
        let near = pieces.iter().map(|p| p.u[1]).fold(0.0, f64::max);
        let far = pieces.iter().map(|p| p.u[0]).fold(f64::INFINITY, f64::min);
        let tip = 1.0 / self.designs[design as usize].tuple.L_a;
        let rises = |p: Profile| p.slope(least.max(1.0 / near)) >= 0.0;
        let wanted = tip < far && self.profile(ask, pieces.clone()).is_some_and(rises);
        wanted.then_some(Open { ask, u: [tip, far], depth: 0 })
    }

    /// Solves the model in `open`, and in the halves of what is not smooth.
    fn fill(&mut self, mut open: Vec<Open>, drives: Option<&[f64]>) -> Result<(), SolveError> {
        if self.setup.model.geometry == Geometry::Linear {
            // The closed form is the curve.
            open.drain(..).for_each(|o| self.put(&o, Ratio::Smooth(vec![1.0])));
        }
        let mut drives = drives;
        while !open.is_empty() {
            let ratios = self.ratios(&open, drives.take())?;
            let mut next = Vec::new();
            for (o, ratios) in open.iter().zip(ratios.chunks(self.nodes.len())) {
                match self.smooth(ratios) {
                    Some(c) => self.put(o, Ratio::Smooth(c)),
                    None if o.depth < HALVINGS && ratios.iter().any(|r| r.is_finite()) => {
                        let (mid, depth) = (0.5 * (o.u[0] + o.u[1]), o.depth + 1);
                        next.extend([[o.u[0], mid], [mid, o.u[1]]].map(|u| Open { u, depth, ..*o }));
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

    /// Coefficients of the ratio, without those that are noise; `None` where it is not smooth.
    fn smooth(&self, ratios: &[f64]) -> Option<Vec<f64>> {
        if !ratios.iter().all(|r| r.is_finite()) {
            return None;
        }
        let mut c = coefficients(ratios);
        let ((least, share), tolerance) = (FINE, self.evaluator.tolerance());
        let size = c[0].abs();
        let tail: f64 = c[c.len() - 2..].iter().map(|c| c.abs()).sum();
        if tail > least.max(share * tolerance) * size {
            return None;
        }
        let heard = c.iter().rposition(|c| c.abs() > NOISE * tolerance * size).unwrap_or(0);
        c.truncate(heard + 1);
        Some(c)
    }

    /// ε/(θ f) at the nodes of every interval; NaN where there is none. With `drives` the intervals come in runs over all of them.
    fn ratios(&mut self, open: &[Open], drives: Option<&[f64]>) -> Result<Vec<f64>, SolveError> {
        let n = self.nodes.len();
        let task = |o: &Open, x: f64| {
            let Ask { design, drive, .. } = self.asks[o.ask];
            Task { design, a: 1.0 / placed(o.u, x), drive }
        };
        let tasks: Vec<Task> =
            open.iter().flat_map(|o| self.nodes.iter().map(move |x| task(o, *x))).collect();
        let Some(drives) = drives else {
            self.taps += tasks.len() as u64;
            let outcomes = self.evaluator.run(self.designs, &tasks)?;
            return Ok(tasks.iter().zip(&outcomes).map(|(t, o)| self.ratio(t, o.strain)).collect());
        };
        // Taps of a design at all drives come next to each other here, and drive by drive there.
        let same = |p: &Open, q: &Open| self.asks[p.ask].design == self.asks[q.ask].design;
        let mut order = Vec::with_capacity(tasks.len());
        let mut from = 0;
        for open in open.chunk_by(same) {
            let taps = n * open.len() / drives.len();
            order.extend((0..taps).flat_map(|k| (0..drives.len()).map(move |j| from + j * taps + k)));
            from += n * open.len();
        }
        let runs: Vec<Task> = order.iter().map(|&t| tasks[t]).collect();
        let (outcomes, solved) = self.evaluator.run_over_drives(self.designs, &runs, drives)?;
        self.taps += solved;
        let mut ratios = vec![f64::NAN; tasks.len()];
        for (&t, o) in order.iter().zip(&outcomes) {
            ratios[t] = self.ratio(&tasks[t], o.strain);
        }
        Ok(ratios)
    }

    fn ratio(&self, task: &Task, strain: f64) -> f64 {
        let Some(shared) = &self.designs[task.design as usize].shared else { return f64::NAN };
        let linear = amount(self.setup.drive, task.drive) * shared.model.value(task.a);
        // A contact that slid onto the gauge's near end shows nothing.
        if strain == 0.0 { f64::NAN } else { strain.abs() / linear }
    }
}

/// Smallest and largest distance over which the curve of `design` is solved, mm. A little more than what was asked: a polynomial tells slopes
/// badly at its ends and over a narrow range.
fn domain(setup: &Setup, design: &Design, reach: Reach) -> Option<[f64; 2]> {
    let shared = design.shared.as_ref()?;
    let ([x1, x2], tip) = (shared.gauge, design.tuple.L_a);
    let start = x1 + 0.02 * (x2 - x1);
    let (Reach::Asked([least, most]) | Reach::Peak([least, most])) = reach else {
        return (start < tip).then_some([start, tip]);
    };
    let [from, to] = setup.estimate.range.unwrap_or([least, most]);
    let (least, most) = (least.min(from).max(start), most.max(to).min(tip));
    let hi = most.max(1.2 * least).min(tip);
    let clear = |a: f64| if least > x2 { a.max(0.5 * (x2 + least)).min(least) } else { least };
    let lo = clear(0.7 * hi);
    match reach {
        Reach::Asked(_) => (lo < hi).then_some([lo, hi]),
        _ => {
            let before = x2 + 0.5 * (shared.theory.peak().0 - x2);
            let lo = if before > start { lo.min(before) } else { lo };
            (lo < tip).then_some([lo, tip])
        }
    }
}
