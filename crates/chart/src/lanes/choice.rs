//! Contacts with friction slide where the whisker moves along the object against the friction; else they stick at the T/P that holds the arc. The
//! sliding solutions at a few T/P between −μ and μ, smooth in T/P, give both.

use super::Lanes;
use super::read::{Flat, Values};
use crate::distance::{FUNCTIONS, lobatto, matrix_at};
use crate::kernel::cpu::Packed;

const MOST_BRANCHES: usize = 5;

/// For each number of branches: powers of T/(μP) from values at them.
#[derive(Debug)]
pub(super) struct Choice {
    powers: Vec<Vec<[f32; MOST_BRANCHES]>>,
}

impl Choice {
    pub fn new() -> Self {
        let powers = |n: usize| match n {
            0..3 => Vec::new(),
            n => matrix_at(&lobatto(n)).iter().map(|row| super::narrow(row)).collect(),
        };
        Self { powers: (0..=MOST_BRANCHES).map(powers).collect() }
    }

    /// δ, c/a − 1 and, with `FORCE`, the force over driveᵉ at each lane's drive; and T/(μP): ±1 where it slides. Of a contact that does not choose the
    /// arc is 0 unless `with_arc`.
    #[inline(always)]
    pub fn read<const FORCE: bool>(
        &self,
        functions @ [_, arcs, _]: &[Vec<Flat>; FUNCTIONS],
        with_arc: bool,
        at: &Values,
    ) -> ([Lanes; FUNCTIONS], Lanes) {
        let of = Lanes::of;
        let (zero, n) = (of(0.0), arcs.len());
        if n == 1 {
            let arc = if with_arc { arcs[0].at(at) } else { zero };
            return (rest::<FORCE>(functions, 0, arc, at), of(1.0));
        }
        let high = arcs[n - 1].at(at);
        if zero.all_at_most(high) {
            return (rest::<FORCE>(functions, n - 1, high, at), of(1.0));
        }
        let low = arcs[0].at(at);
        // 1 and −1 where a lane slides: it takes its branch's value, since the polynomial's rounding would make a tap depend on its neighbours.
        let side = high.if_less(zero, zero.if_less(low, zero, of(-1.0)), of(1.0));
        if side.all_at_most(of(-1.0)) {
            return (rest::<FORCE>(functions, 0, low, at), of(-1.0));
        }
        let mut ends = [[zero; FUNCTIONS]; 2];
        let mut powers = [[zero; FUNCTIONS]; MOST_BRANCHES];
        for k in 0..n {
            let arc = match k {
                0 => low,
                k if k == n - 1 => high,
                k => arcs[k].at(at),
            };
            let values = rest::<FORCE>(functions, k, arc, at);
            ends[usize::from(k > 0)] = values;
            for (row, power) in self.powers[n].iter().zip(&mut powers) {
                let m = Lanes::splat(row[k]);
                for (power, value) in power.iter_mut().zip(values) {
                    *power = m.mul_add(value, *power);
                }
            }
        }
        // The arc falls monotonically with T.
        let mut share = (low + high) / (low - high);
        for _ in 0..4 {
            let (value, slope) = polynomial(&powers[..n], 1, share);
            share = (share - value / slope).max(of(-1.0)).min(of(1.0));
        }
        let slides = share.abs().if_less(of(1.0), zero, of(1.0));
        let strain = polynomial(&powers[..n], 0, share).0;
        let arc = of(0.5).if_less(slides, polynomial(&powers[..n], 1, share).0, zero);
        let force = polynomial(&powers[..n], 2, share).0;
        let mut all = [strain, arc, force];
        for f in 0..FUNCTIONS {
            all[f] = by_side(side, ends[0][f], all[f], ends[1][f]);
        }
        (all, by_side(side, of(-1.0), share, of(1.0)))
    }
}

#[inline(always)]
fn by_side(side: Lanes, back: Lanes, between: Lanes, out: Lanes) -> Lanes {
    let half = Lanes::of(0.5);
    half.if_less(side, out, side.if_less(-half, back, between))
}

// Functions, not closures: code that is not inlined would not be compiled for the instruction set of its caller.

#[inline(always)]
fn rest<const FORCE: bool>(
    [strains, _, forces]: &[Vec<Flat>; FUNCTIONS],
    k: usize,
    arc: Lanes,
    at: &Values,
) -> [Lanes; FUNCTIONS] {
    let force = if FORCE { forces[k].at(at) } else { Lanes::of(0.0) };
    [strains[k].at(at), arc, force]
}

#[inline(always)]
fn polynomial(powers: &[[Lanes; FUNCTIONS]], f: usize, x: Lanes) -> (Lanes, Lanes) {
    let n = powers.len();
    let (mut value, mut slope) = (powers[n - 1][f], Lanes::of(0.0));
    for power in powers[..n - 1].iter().rev() {
        slope = slope.mul_add(x, value);
        value = value.mul_add(x, power[f]);
    }
    (value, slope)
}
