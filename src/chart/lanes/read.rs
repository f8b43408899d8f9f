//! Reading a sparse series in lanes.

use super::{Lanes, ORDERS};
use crate::chart::axis::AXES;
use crate::chart::series::Series;
use crate::kernel::cpu::Pack;

/// Series over the same axes, flat: the products of polynomials over taper and place are made once, and every coefficient is then one
/// multiply–add, in blocks that share their orders over drive, width and base.
#[derive(Debug, Default)]
pub(super) struct Products {
    /// Orders over taper and place.
    pairs: Vec<[u8; 2]>,
}

/// A series, its coefficients by place in [`Products`].
#[derive(Debug, Default)]
pub(super) struct Flat {
    blocks: Vec<Block>,
    terms: Vec<(u32, f32)>,
}

/// Terms that share their orders over drive, width and base.
#[derive(Debug)]
struct Block {
    orders: [u8; 3],
    terms: u32,
}

impl Products {
    /// Products there are.
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    fn place(&mut self, pair: [u8; 2]) -> u32 {
        let at = self.pairs.iter().position(|p| *p == pair).unwrap_or_else(|| {
            self.pairs.push(pair);
            self.pairs.len() - 1
        });
        at as u32
    }

    /// Their values.
    #[inline(always)]
    pub fn fill<const FMA: bool>(&self, basis: &[Vec<Lanes<FMA>>; AXES], into: &mut [Lanes<FMA>]) {
        for ([taper, place], value) in self.pairs.iter().zip(into) {
            *value = basis[3][usize::from(*taper)] * basis[4][usize::from(*place)];
        }
    }
}

impl Flat {
    pub fn new(series: &Series, products: &mut Products) -> Self {
        let mut flat = Self::default();
        for row in &series.rows {
            let [orders @ .., taper] = row.orders.map(|k| k as u8);
            if flat.blocks.last().is_none_or(|block| block.orders != orders) {
                flat.blocks.push(Block { orders, terms: 0 });
            }
            for (place, c) in row.coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                flat.terms.push((products.place([taper, place as u8]), *c as f32));
                if let Some(block) = flat.blocks.last_mut() {
                    block.terms += 1;
                }
            }
        }
        flat
    }

    /// Orders over the drive.
    pub fn orders(&self) -> usize {
        self.blocks.last().map_or(1, |block| usize::from(block.orders[0]) + 1)
    }

    /// Its coefficients over the drive.
    #[inline(always)]
    pub fn read<const FMA: bool>(
        &self,
        basis: &[Vec<Lanes<FMA>>; AXES],
        products: &[Lanes<FMA>],
    ) -> [Lanes<FMA>; ORDERS] {
        let mut out = [Lanes::<FMA>::of(0.0); ORDERS];
        let [_, width, base, ..] = basis;
        let mut terms = self.terms.as_slice();
        for block in &self.blocks {
            let (these, rest) = terms.split_at(block.terms as usize);
            terms = rest;
            // Two sums, so that one need not wait for the other.
            let mut sums = [Lanes::<FMA>::of(0.0); 2];
            let pairs = these.chunks_exact(2);
            let last = pairs.remainder();
            for pair in pairs {
                for (sum, (at, c)) in sums.iter_mut().zip(pair) {
                    *sum = products[*at as usize].mul_add(Pack::splat(*c), *sum);
                }
            }
            if let [(at, c)] = last {
                sums[0] = products[*at as usize].mul_add(Pack::splat(*c), sums[0]);
            }
            let [drive, w, b] = block.orders.map(usize::from);
            out[drive] = (sums[0] + sums[1]).mul_add(width[w] * base[b], out[drive]);
        }
        out
    }
}

/// T_0(x) … into `into`.
#[inline(always)]
pub(super) fn polynomials<const FMA: bool>(x: Lanes<FMA>, n: usize, into: &mut [Lanes<FMA>]) {
    into[0] = Lanes::<FMA>::of(1.0);
    into[1] = x;
    let twice = x + x;
    for k in 2..n {
        into[k] = twice * into[k - 1] - into[k - 2];
    }
}

/// Σ of values over the drive times its polynomials.
#[inline(always)]
pub(super) fn dot<const FMA: bool>(values: &[Lanes<FMA>; ORDERS], basis: &[Lanes<FMA>]) -> Lanes<FMA> {
    let mut sum = Lanes::<FMA>::of(0.0);
    for (value, t) in values.iter().zip(basis) {
        sum = value.mul_add(*t, sum);
    }
    sum
}
