//! Which curve: each kind drawn robustly, judged by what is left out.

use indexmap::IndexMap;

use super::{Arc, Curve, Kind, Sample, Smooth, Spot};
use vibrissa_core::reduce::median;

/// A point farther off than so many of its standard deviations, where those are as large as the points say, is an outlier.
pub const OFF: f64 = 4.0;
/// Points looked at, and curves tried, for a start.
const LOOKS: usize = 300;
const TRIES: usize = 600;
/// Standard deviation over the median distance from the middle of a normal distribution in the plane.
const PLANE: f64 = 0.849_322;
/// √(2πe): a normal density says as much as an even one over so many of its standard deviations.
const ENTROPY: f64 = 4.132_731;
/// Places by which the length of a curve is told.
const PLACES: usize = 61;
/// Passes in which outliers settle.
const PASSES: usize = 12;
/// Most groups that are left out one by one; more are joined.
const GROUPS: usize = 200;
/// Loss per point that a less simple curve must be better by at least: a tenth of the density.
const WORTH: f64 = 0.1;
/// Share of points that may lie anywhere, in the loss.
const ANYWHERE: f64 = 0.02;
/// Stiffness of smooth curves that are tried: powers of ten.
const STIFFNESS: [f64; 17] =
    [-4.0, -3.5, -3.0, -2.5, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0];

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Nothing {
    #[error("a curve takes three points or more")]
    TooFew,
    #[error("the points are one place within their uncertainty")]
    OnePlace,
    #[error("such a curve is not determined by these points")]
    Undetermined,
}

/// What a kind is worth, as run.json has it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Judged {
    pub kind: Kind,
    /// Mean loss of a point that was left out: −ln of the density that was foretold where it lies, 1/mm².
    pub loss: f64,
    /// Root mean square distance of points that were left out; outliers of the kind not counted.
    pub left_out_rms_mm: f64,
    pub outliers: usize,
    pub loss_more_than_best: f64,
    pub loss_more_se: f64,
}

/// A curve, how it was found, and what it says of each point.
#[derive(Debug, Clone)]
pub struct Chosen {
    pub kind: Kind,
    pub curve: Curve,
    /// How many times larger than said the points' standard deviations are, at least 1.
    pub scale: f64,
    /// Distance to the left of each point (mm), over its standard deviation as said, and whether it is an outlier.
    pub off: Vec<(f64, f64, bool)>,
    /// All kinds that could be drawn, the simplest first; none before it was chosen.
    pub judged: Vec<Judged>,
    /// Loss of each group that was left out, and square distances of what counts.
    losses: Vec<f64>,
    squares: [f64; 2],
}

impl Chosen {
    fn loss(&self) -> f64 {
        self.losses.iter().sum()
    }
}

/// Groups of samples, at most [`GROUPS`].
fn groups(samples: &[Sample]) -> Vec<Vec<usize>> {
    let mut all: IndexMap<usize, Vec<usize>> = IndexMap::new();
    samples.iter().enumerate().for_each(|(i, s)| all.entry(s.group).or_default().push(i));
    let n = all.len().min(GROUPS);
    let mut joined = vec![Vec::new(); n];
    for (k, members) in all.into_values().enumerate() {
        joined[k % n].extend(members);
    }
    joined
}

/// Distance to the left (mm) and over the point's own standard deviation.
fn off(curve: &Curve, s: &Sample) -> (f64, f64) {
    let (d, across) = curve.off(s.at);
    match curve {
        Curve::Point(spot) => (d, spot.deviations(s)),
        _ => (d, d / s.covariance.of(across).sqrt()),
    }
}

/// How many times larger than said deviations are: the median of those that are there, as of a normal distribution.
fn spread(curve: &Curve, samples: &[Sample], free: f64) -> f64 {
    let mut sizes: Vec<f64> = samples.iter().map(|s| off(curve, s).1.abs()).collect();
    // Fitted parameters reduce the residuals.
    let room = (samples.len() as f64 / (samples.len() as f64 - free).max(1.0)).sqrt();
    let usual = if let Curve::Point(_) = curve { PLANE } else { 1.4826 };
    usual * median(&mut sizes) * room
}

/// Length of a curve along those of `samples` that are no outliers, mm; 0 of a point.
fn length(curve: &Curve, samples: &[Sample], off: &[(f64, f64, bool)]) -> f64 {
    let near: Vec<Sample> = samples.iter().zip(off).filter(|(_, off)| !off.2).map(|(s, _)| *s).collect();
    let places = curve.traced(&near, PLACES);
    places.windows(2).map(|w| (w[1].0[0] - w[0].0[0]).hypot(w[1].0[1] - w[0].0[1])).sum()
}

/// The arc with the least median distance among those through so many of the points: two for a line, three for a circle.
fn start(samples: &[Sample], places: usize) -> Option<Arc> {
    let every = samples.len().div_ceil(LOOKS).max(1);
    let looked: Vec<&Sample> = samples.iter().step_by(every).collect();
    let n = looked.len();
    // A linear congruence (Knuth's MMIX) is random enough.
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let mut best: Option<(f64, Arc)> = None;
    for _ in 0..TRIES {
        let chosen: Vec<[f64; 2]> = (0..places).map(|_| looked[draw()].at).collect();
        let Some(arc) = Arc::through(&chosen) else { continue };
        let curve = Curve::Arc(arc.clone());
        let mut sizes: Vec<f64> = looked.iter().map(|s| off(&curve, s).1.abs()).collect();
        let middle = median(&mut sizes);
        if middle.is_finite() && best.as_ref().is_none_or(|(least, _)| middle < *least) {
            best = Some((middle, arc));
        }
    }
    best.map(|(_, arc)| arc)
}

/// Loss of a point that a curve has not seen. Along the curve it may lie anywhere on `length`, or within its own uncertainty.
fn loss(curve: &Curve, scale: f64, s: &Sample, (extent, length): (f64, f64)) -> (f64, f64) {
    let (d, [x, y]) = curve.off(s.at);
    let density = if let Curve::Point(spot) = curve {
        spot.density(s, scale)
    } else {
        let variance = scale * scale * (s.covariance.of([x, y]) + curve.deviation(s.at).powi(2));
        let along = length.max(ENTROPY * scale * s.covariance.of([-y, x]).sqrt());
        (-0.5 * d * d / variance).exp() / (std::f64::consts::TAU * variance).sqrt() / along
    };
    (-((1.0 - ANYWHERE) * density + ANYWHERE / (extent * extent)).ln(), d)
}

/// What curves are drawn to, and judged by.
struct Judge<'a> {
    samples: &'a [Sample],
    groups: &'a [Vec<usize>],
    /// Length within which a point may lie anywhere, mm.
    extent: f64,
}

impl Judge<'_> {
    /// Weights of samples: their shares, 0 of outliers.
    fn weights(&self, off: &[(f64, f64, bool)]) -> Vec<f64> {
        self.samples.iter().zip(off).map(|(s, (.., outlier))| if *outlier { 0.0 } else { s.share }).collect()
    }

    /// The curve of a kind that is drawn from `first` on, until its outliers settle; judged by the curves without each of the groups. `free`: its parameters.
    fn drawn(&self, kind: Kind, first: Curve, free: f64) -> Option<Chosen> {
        let samples = self.samples;
        let judge = |curve: &Curve| -> (f64, Vec<(f64, f64, bool)>) {
            let scale = spread(curve, samples, free).max(1.0);
            let of = |s: &Sample| {
                let (d, z) = off(curve, s);
                (d, z, z.abs() > OFF * scale)
            };
            (scale, samples.iter().map(of).collect())
        };
        let (mut curve, mut outliers) = (first, Vec::new());
        for _ in 0..PASSES {
            let off = judge(&curve).1;
            let next: Vec<bool> = off.iter().map(|off| off.2).collect();
            if next == outliers {
                break;
            }
            outliers = next;
            curve = curve.fit(samples, &self.weights(&off))?;
        }
        let (scale, off) = judge(&curve);
        let size = (self.extent, length(&curve, samples, &off));
        let (mut losses, mut squares) = (Vec::new(), [0.0, 0.0]);
        let all = curve.without(samples, &self.weights(&off), self.groups)?;
        for (group, unseen) in self.groups.iter().zip(all) {
            let mut sum = 0.0;
            for &i in group {
                let (loss, d) = loss(&unseen, scale, &samples[i], size);
                sum += samples[i].share * loss;
                if !off[i].2 {
                    squares[0] += samples[i].share * d * d;
                    squares[1] += samples[i].share;
                }
            }
            losses.push(sum);
        }
        let sound = losses.iter().all(|l| l.is_finite());
        sound.then_some(Chosen { kind, curve, scale, off, judged: Vec::new(), losses, squares })
    }

    /// The smooth curve beside `base` whose stiffness tells best what it has not seen.
    fn smooth(&self, base: &Arc) -> Option<Chosen> {
        let all: Vec<f64> = self.samples.iter().map(|s| s.share).collect();
        let of = |power: &f64| {
            let flat = Smooth::beside(base, self.samples, self.groups.len(), 10f64.powf(*power))?;
            self.drawn(Kind::Smooth, Curve::Smooth(flat.fit(self.samples, &all)?), 0.0)
        };
        // Of equals the least stiff.
        let all = STIFFNESS.iter().filter_map(of);
        all.min_by(|a, b| a.loss().total_cmp(&b.loss()))
    }
}

/// The curve of `samples`; `asked`: of this kind, whatever the others are worth.
pub fn choose(samples: &[Sample], asked: Option<Kind>) -> Result<Chosen, Nothing> {
    if samples.len() < 3 {
        return Err(Nothing::TooFew);
    }
    let side = |k: usize| {
        let of = |f: fn(f64, f64) -> f64| samples.iter().map(|s| s.at[k]).reduce(f).unwrap_or(f64::NAN);
        of(f64::max) - of(f64::min)
    };
    let extent = side(0).hypot(side(1));
    let mut sizes: Vec<f64> = samples.iter().map(|s| s.covariance.ellipse().0[1]).collect();
    let spread = median(&mut sizes);
    let one_place = extent <= 4.0 * spread || extent.is_nan();
    if one_place && asked.is_some_and(|kind| kind != Kind::Point) {
        return Err(Nothing::OnePlace);
    }
    let groups = groups(samples);
    let judge = Judge { samples, groups: &groups, extent: 2.0 * extent.max(spread) };
    let mut all: Vec<Chosen> = Vec::new();
    for (kind, free) in [(Kind::Point, 1), (Kind::Line, 2), (Kind::Circle, 3)] {
        let first = match kind {
            _ if groups.len() <= free => None,
            Kind::Point => Some(Curve::Point(Spot::middle(samples))),
            _ if one_place => None,
            _ => start(samples, free).map(Curve::Arc),
        };
        all.extend(first.and_then(|first| judge.drawn(kind, first, free as f64)));
    }
    let arcs = all.iter().filter(|d| matches!(d.curve, Curve::Arc(_)));
    let base = arcs.min_by(|a, b| a.loss().total_cmp(&b.loss()));
    if let (Some(Curve::Arc(base)), true) = (base.map(|d| d.curve.clone()), groups.len() >= 6) {
        all.extend(judge.smooth(&base));
    }
    let nothing = if one_place { Nothing::OnePlace } else { Nothing::Undetermined };
    let least = all.iter().min_by(|a, b| a.loss().total_cmp(&b.loss())).ok_or(nothing)?;
    let shares: f64 = samples.iter().map(|s| s.share).sum();
    let judged = |d: &Chosen| {
        let n = groups.len() as f64;
        let differences: Vec<f64> = d.losses.iter().zip(&least.losses).map(|(a, b)| a - b).collect();
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let (loss, outliers) = (d.loss() / shares, d.off.iter().filter(|off| off.2).count());
        let left_out_rms_mm = (d.squares[0] / d.squares[1]).sqrt();
        let (loss_more_than_best, loss_more_se) = (n * mean / shares, (n * variance).sqrt() / shares);
        Judged { kind: d.kind, loss, left_out_rms_mm, outliers, loss_more_than_best, loss_more_se }
    };
    let judged: Vec<Judged> = all.iter().map(judged).collect();
    let place = match asked {
        Some(kind) => all.iter().position(|d| d.kind == kind),
        None => judged.iter().position(|j| j.loss_more_than_best <= j.loss_more_se.max(WORTH)),
    };
    let mut chosen = all.swap_remove(place.ok_or(Nothing::Undetermined)?);
    chosen.curve.scale(chosen.scale * chosen.scale);
    Ok(Chosen { judged, ..chosen })
}
