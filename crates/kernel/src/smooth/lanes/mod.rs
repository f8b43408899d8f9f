//! Designs in lanes on the CPU: their rows of statistics from the chart of the rod. Twin of `shaders/smooth.wgsl`.
//!
//! # Theory
//! With (K − 1)/t = Σ_k κ_k T_k(t) a Chebyshev series in t = θ², the mean of K over the distances is the series of the mean
//! coefficients, and `SD² = t² Σ_kl Cov(κ_k, κ_l) T_k(t) T_l(t)`: a row costs a few flops however many distances it has.
//! The covariances are centred before they are summed (Welford), so nothing cancels.
//!
//! The estimate f(â) = K̄ε/θ is a quadratic in 1/â. With â = a/(1 + η) and q = K̄/K − 1 it reads `F₀ q = φ η − β η²`,
//! F₀ = (1 − p)(A − β), φ = (A − β) − β(1 − p), A = b1 + b2, β = s1 b1 + s2 b2: the error â − a keeps its relative precision.
//! The far root is the one with the smaller η; there is none above q_peak = φ²/(4βF₀); the near one is within the range of
//! interest between two values of q.

mod estimate;
mod rows;
mod tap;

use super::rod::{MOST, squares};
use super::scope::Scope;
use crate::cpu::pack::Pack;
use estimate::Edges;
use rows::Rows;
use tap::{Tap, Whisker};
use vibrissa_core::design::amount;
use vibrissa_core::physics::chebyshev::{matrix, scaled};
use vibrissa_core::scene::{Drive, Per, RankBy, Tuple};

/// Designs that go together.
pub const LANES: usize = 16;

/// Most terms over t.
const SQUARES: usize = MOST[2];

/// Most terms over s.
const PLACES: usize = MOST[1];

/// Pairs of squares.
const PAIRS: usize = SQUARES * (SQUARES + 1) / 2;

type Lanes<const FMA: bool> = Pack<f32, LANES, FMA>;

/// Constants of a scope in single precision.
#[derive(Debug)]
pub struct Tables {
    /// Points over t, the values there of the polynomials over t, and the way back.
    squares: Vec<f32>,
    at_squares: Vec<[f32; SQUARES]>,
    from_squares: Vec<[f32; SQUARES]>,
    /// Largest t.
    square: f32,
    terms: usize,
    places: usize,
    /// For each term over t: functions (ω, ζ, terms of X), each with its terms over p.
    values: Vec<Vec<Vec<f32>>>,
    /// Scale and shift of 1/(1 − p), and of s.
    stiffness: [f32; 2],
    place: [f32; 2],
    gauge: Vec<(f32, f32)>,
    distances: Vec<Distance>,
    angles: Vec<Angle>,
    strain_limit: f32,
    noise: f32,
    fixed: Option<f32>,
    elongation: bool,
    by: RankBy,
    per: Per,
}

/// A contact distance a, 1/a, and where the range of interest ends in η.
#[derive(Debug, Clone, Copy)]
struct Distance {
    a: f32,
    inverse: f32,
    ends: [f32; 2],
}

/// A drive that all designs share.
#[derive(Debug)]
struct Angle {
    angle: f32,
    square: f32,
    /// T_k.
    basis: [f32; SQUARES],
    /// T_k T_l for k ≤ l, twice off the diagonal.
    products: [f32; PAIRS],
    /// Place in the layout.
    place: u32,
}

/// Best rows and counts of some designs.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Rank, design, drive.
    pub rows: Vec<(f32, u64, u32)>,
    /// Rows that are complete; designs that have one where designs compete.
    pub complete: u64,
    /// Taps per status word.
    pub words: Words,
    /// Designs that must be solved tap by tap.
    pub hard: Vec<u64>,
}

/// Taps per status word.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Words {
    /// No word.
    pub ok: u64,
    /// `slipped_off`.
    pub slipped: u64,
    /// `strain_limit`.
    pub strain: u64,
    /// `no_root`.
    pub rootless: u64,
    /// `ambiguous`.
    pub ambiguous: u64,
    /// `invalid_geometry`.
    pub invalid: u64,
}

impl Words {
    /// Adds `other`.
    pub fn add(&mut self, other: &Self) {
        self.ok += other.ok;
        self.slipped += other.slipped;
        self.strain += other.strain;
        self.rootless += other.rootless;
        self.ambiguous += other.ambiguous;
        self.invalid += other.invalid;
    }
}

impl Found {
    /// Adds `other`.
    pub fn merge(&mut self, other: Self) {
        self.rows.extend(other.rows);
        self.complete += other.complete;
        self.words.add(&other.words);
        self.hard.extend(other.hard);
    }
}

impl Tables {
    /// Tables of `scope`.
    pub fn new(scope: &Scope) -> Self {
        let chart = &scope.chart;
        let narrow = |v: &[f64]| v.iter().map(|&x| x as f32).collect::<Vec<_>>();
        let points = squares(chart.square, chart.values.len());
        let wide = |v: &[f64]| std::array::from_fn(|k| v.get(k).map_or(0.0, |&x| x as f32));
        // x = scale v + shift.
        let affine = |range: [f64; 2]| {
            let shift = scaled(range, 0.0);
            [(scaled(range, 1.0) - shift) as f32, shift as f32]
        };
        let distance = |d: &super::scope::Distance| Distance {
            a: d.a as f32,
            inverse: (1.0 / d.a) as f32,
            ends: d.ends.map(|e| e as f32),
        };
        Self {
            squares: narrow(&points),
            at_squares: points.iter().map(|&t| wide(&chart.basis(t))).collect(),
            from_squares: matrix(points.len()).iter().map(|row| wide(row)).collect(),
            square: chart.square as f32,
            terms: chart.terms,
            places: chart.place_terms,
            values: chart.values.iter().map(|v| v.iter().map(|c| narrow(c)).collect()).collect(),
            stiffness: affine(chart.range.stiffness()),
            place: affine(chart.range.place),
            gauge: scope.gauge.iter().map(|&(x, w)| (x as f32, w as f32)).collect(),
            distances: scope.distances.iter().map(distance).collect(),
            angles: scope.angles.iter().map(Angle::new).collect(),
            strain_limit: scope.strain_limit as f32,
            noise: scope.noise as f32,
            fixed: scope.fixed.map(|k| k as f32),
            elongation: scope.elongation,
            by: scope.rank.by,
            per: scope.rank.per,
        }
    }

    /// Rows of the designs `ks`, all easy, that rank below `bound`; [`LANES`] at a time.
    pub fn rank(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        #[cfg(target_arch = "x86_64")]
        if crate::cpu::fused() {
            // SAFETY: the CPU has just been found to have both features.
            unsafe { self.rank_avx2(ks, tuples, bound, found) };
            return;
        }
        self.rank_lanes::<{ cfg!(target_arch = "aarch64") }>(ks, tuples, bound, found);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn rank_avx2(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        self.rank_lanes::<true>(ks, tuples, bound, found);
    }

    #[inline(always)]
    fn rank_lanes<const FMA: bool>(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        let mut scratch = Scratch::<FMA>::new(self);
        for (ks, tuples) in ks.chunks(LANES).zip(tuples.chunks(LANES)) {
            if self.angles.is_empty() {
                let rows = Rows::new::<true>(self, ks, tuples, &mut scratch);
                rows.count_and_rank::<true>(self, ks, bound, (&scratch.taps, &mut scratch.edges), found);
            } else {
                let rows = Rows::new::<false>(self, ks, tuples, &mut scratch);
                rows.count_and_rank::<false>(self, ks, bound, (&scratch.taps, &mut scratch.edges), found);
            }
        }
    }

    /// K − 1 of taps of easy designs, each with the place of its distance, as the rows are made of them.
    pub fn deviations(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        #[cfg(target_arch = "x86_64")]
        if crate::cpu::fused() {
            // SAFETY: the CPU has just been found to have both features.
            return unsafe { self.deviations_avx2(taps) };
        }
        self.deviations_lanes::<{ cfg!(target_arch = "aarch64") }>(taps)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn deviations_avx2(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        self.deviations_lanes::<true>(taps)
    }

    #[inline(always)]
    fn deviations_lanes<const FMA: bool>(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        let mut scratch = Scratch::<FMA>::new(self);
        let mut found = Vec::with_capacity(taps.len());
        for taps in taps.chunks(LANES) {
            let tuples: Vec<Tuple> = taps.iter().map(|(tuple, _)| *tuple).collect();
            let ks = vec![0; taps.len()];
            let own = self.angles.is_empty();
            let rows = match own {
                true => Rows::new::<true>(self, &ks, &tuples, &mut scratch),
                false => Rows::new::<false>(self, &ks, &tuples, &mut scratch),
            };
            for (lane, (tuple, i)) in taps.iter().enumerate() {
                let kappa = scratch.taps[*i].kappa.map(|k| k.0[lane]);
                let angle = amount(Drive::Angle, tuple.drive) as f32;
                let shared = self.angles.iter().find(|a| a.angle == angle);
                let deviation = match shared {
                    Some(a) => a.square * kappa.iter().zip(&a.basis).map(|(k, t)| k * t).sum::<f32>(),
                    None if own => rows.own[1].0[lane] * kappa[0],
                    None => f32::NAN,
                };
                found.push(f64::from(deviation));
            }
        }
        found
    }

    /// Terms over t that are carried: those of the chart, or one at each design's own angle.
    #[inline(always)]
    fn carried<const OWN: bool>(&self) -> usize {
        if OWN { 1 } else { self.squares.len() }
    }
}

impl Angle {
    fn new(a: &super::scope::Angle) -> Self {
        let m = a.basis.len();
        let mut products = [0.0; PAIRS];
        let mut at = 0;
        for k in 0..m {
            for l in k..m {
                products[at] = (a.basis[k] * a.basis[l] * if k == l { 1.0 } else { 2.0 }) as f32;
                at += 1;
            }
        }
        Self {
            angle: a.angle as f32,
            square: (a.angle * a.angle) as f32,
            basis: std::array::from_fn(|k| a.basis.get(k).map_or(0.0, |&x| x as f32)),
            products,
            place: a.place,
        }
    }
}

/// Memory of a pack, used again by the next.
struct Scratch<const FMA: bool> {
    /// The chart at each lane's own square.
    own: Vec<Lanes<FMA>>,
    /// Chebyshev polynomials over 1/(1 − p).
    basis: Vec<Lanes<FMA>>,
    /// A tap per distance.
    taps: Vec<Tap<Lanes<FMA>>>,
    /// Where its words begin.
    edges: Vec<Edges<Lanes<FMA>>>,
}

impl<const FMA: bool> Scratch<FMA> {
    #[inline(always)]
    fn new(tables: &Tables) -> Self {
        Self {
            own: vec![Pack::default(); (2 + tables.places) * tables.terms],
            basis: vec![Pack::default(); tables.terms],
            taps: vec![Tap::default(); tables.distances.len()],
            edges: Vec::with_capacity(tables.distances.len()),
        }
    }
}
