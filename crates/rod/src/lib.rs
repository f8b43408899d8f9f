//! The fast solver of taps of every whisker (prototype).
#![allow(missing_docs, clippy::needless_range_loop, clippy::too_many_arguments)]

pub mod lane;
pub mod lanes;
pub mod panel;
pub mod rod;
pub mod rule;

use lane::Lane;
use lanes::{Answer, Fixed, Ground};
pub use rod::{Piece, Rod};
use rule::{Rule, Turns};
use vibrissa_core::physics::nodes::Nodes;
use vibrissa_kernel::Chart;
use vibrissa_kernel::cpu::law::Law;
use vibrissa_kernel::cpu::pack::{AVX2, Pack, Packed, Scalar};

/// Effects of the model and of the whisker, equal for all taps of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Effects {
    pub shear: bool,
    pub extension: bool,
    pub surface: bool,
    pub stick: bool,
    pub law: bool,
    pub far: bool,
    pub curved: bool,
    pub inner: bool,
    pub power: bool,
}

/// One tap; mm, N, rad.
#[derive(Debug, Clone, Copy)]
pub struct Tap<'a, T = f64> {
    pub rod: &'a Rod<T>,
    /// Contact distance a.
    pub a: T,
    pub hub: T,
    /// θ; 0 where the object moves.
    pub turn: T,
    /// δ; 0 where the base turns.
    pub lift: T,
    /// T/P of a sliding contact.
    pub ratio: T,
    /// ρ.
    pub pole: T,
    /// 1/kG over that of model §3.
    pub softer: T,
    /// Least strain that errors are relative to.
    pub least: T,
}

impl<T: Copy> Tap<'_, T> {
    /// `f` of each number, of the whisker `rod`.
    pub fn map<'b, U>(&self, rod: &'b Rod<U>, f: impl Fn(T) -> U) -> Tap<'b, U> {
        let Self { a, hub, turn, lift, ratio, pole, softer, least, .. } = *self;
        Tap { rod, a: f(a), hub: f(hub), turn: f(turn), lift: f(lift), ratio: f(ratio), pole: f(pole), softer: f(softer), least: f(least) }
    }
}

pub fn fixed<T: Scalar, const N: usize, const S: usize>(terms: usize, chart: Option<&Chart>) -> Fixed<T, N, S> {
    let gauge = Nodes::of(N / 2 + 2);
    Fixed {
        rule: Rule::new(),
        slide: Rule::new(),
        turns: Turns::new(terms),
        law: chart.map(Law::new),
        gauge: gauge.points.iter().zip(&gauge.weights).map(|(&p, &w)| (T::of(p), T::of(w))).collect(),
    }
}

#[inline(always)]
pub fn pack<'a, P: Lane<One = f64>, const N: usize, const S: usize>(
    fixed: &Fixed<P::Scalar, N, S>,
    effects: Effects,
    taps: &[Tap<'a>],
    tolerance: f64,
    most: usize,
) -> Answer<P> {
    let mut ground = Ground::<P, N, S>::new(fixed, effects, |i| &taps[if i < taps.len() { i } else { 0 }]);
    ground.solve(fixed, tolerance, most)
}

macro_rules! avx {
    ($name:ident, $t:ty, $l:literal, $n:literal, $s:literal) => {
        /// # Safety
        /// AVX2.
        #[target_feature(enable = "avx2,fma")]
        pub unsafe fn $name(fixed: &Fixed<$t, $n, $s>, effects: Effects, taps: &[Tap<'_>], tolerance: f64, most: usize, out: &mut Vec<[f64; 15]>) {
            for part in taps.chunks($l) {
                let a = pack::<Pack<$t, $l, AVX2>, $n, $s>(fixed, effects, part, tolerance, most);
                for i in 0..part.len() {
                    out.push([a.strain, a.deviation, a.normal, a.tangential, a.arc, a.wrench[0], a.wrench[1], a.wrench[2], a.sweeps, a.tails[0], a.tails[1], a.tails[2], a.shown, a.tails[3], a.tails[4]].map(|x| x.lane(i)));
                }
            }
        }
    };
}
avx!(f64_6, f64, 8, 6, 3);
avx!(f64_8, f64, 8, 8, 4);
avx!(f64_10, f64, 8, 10, 4);
avx!(f64_16, f64, 8, 16, 4);
avx!(f64_24, f64, 8, 24, 6);
avx!(f32_6, f32, 16, 6, 3);

/// # Safety
/// AVX2.
#[target_feature(enable = "avx2,fma")]
pub unsafe fn exact(fixed: &Fixed<f64, 24, 6>, effects: Effects, taps: &[Tap<'_>], tolerance: f64, most: usize, out: &mut Vec<[f64; 15]>) {
    for part in taps.chunks(4) {
        let lifted: Vec<Rod<vibrissa_core::physics::real::Dual<2>>> = part.iter().map(|t| t.rod.map(vibrissa_core::physics::number::Number::of)).collect();
        let own: Vec<_> = part.iter().zip(&lifted).map(|(t, rod)| t.map(rod, vibrissa_core::physics::number::Number::of)).collect();
        let mut ground = Ground::<lane::Dual<Pack<f64, 4, AVX2>, 2>, 24, 6>::new(fixed, effects, |i| &own[if i < own.len() { i } else { 0 }]);
        let a = ground.solve_exactly(fixed, tolerance, most);
        for i in 0..part.len() {
            out.push([a.strain, a.deviation, a.normal, a.tangential, a.arc, a.wrench[0], a.wrench[1], a.wrench[2], a.sweeps, a.tails[0], a.tails[1], a.tails[2], a.shown, a.tails[3], a.tails[4]].map(|x| x.lane(i)));
        }
    }
}
