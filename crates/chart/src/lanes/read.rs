//! Reading a sparse series in lanes.

use super::{Lanes, ORDERS};
use crate::axis::AXES;
use crate::kernel::cpu::Pack;
use crate::series::Series;

/// Most products: any pair of orders, and a power of two, so that a place needs no check.
const MOST_PRODUCTS: usize = 256;
const _: () = assert!(ORDERS * ORDERS <= MOST_PRODUCTS);

/// In place of an order over x/a: of a function of the whole tap, which knows none.
const WHOLE: u8 = u8::MAX;

/// Values of products, by place.
pub(super) type Values<const FMA: bool> = [Lanes<FMA>; MOST_PRODUCTS];

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
    terms: Vec<Term>,
}

/// Terms that share their orders over drive, width and base.
#[derive(Debug)]
struct Block {
    orders: [u8; 3],
    terms: u32,
}

#[derive(Debug, Clone, Copy)]
struct Term {
    coefficient: f32,
    place: u8,
}

impl Products {
    /// No values yet.
    #[inline(always)]
    pub fn values<const FMA: bool>() -> Box<Values<FMA>> {
        Box::new([Lanes::<FMA>::of(0.0); MOST_PRODUCTS])
    }

    fn place(&mut self, pair: [u8; 2]) -> u8 {
        let at = self.pairs.iter().position(|p| *p == pair).unwrap_or_else(|| {
            self.pairs.push(pair);
            self.pairs.len() - 1
        });
        at as u8
    }

    /// Their values.
    #[inline(always)]
    pub fn fill<const FMA: bool>(&self, basis: &[Vec<Lanes<FMA>>; AXES], into: &mut Values<FMA>) {
        for ([taper, place], value) in self.pairs.iter().zip(into) {
            let taper = basis[3][usize::from(*taper)];
            *value = if *place == WHOLE { taper } else { taper * basis[4][usize::from(*place)] };
        }
    }
}

impl Flat {
    /// Of `series`, a function of the `point` at which the strain is asked, or of the whole tap.
    pub fn new(series: &Series, point: bool, products: &mut Products) -> Self {
        let mut flat = Self::default();
        for row in &series.rows {
            let [orders @ .., taper] = row.orders.map(|k| k as u8);
            if flat.blocks.last().is_none_or(|block| block.orders != orders) {
                flat.blocks.push(Block { orders, terms: 0 });
            }
            let orders = if point { row.coefficients.len() } else { 1 };
            for (place, c) in row.coefficients[..orders].iter().enumerate().filter(|(_, c)| **c != 0.0) {
                let place = products.place([taper, if point { place as u8 } else { WHOLE }]);
                flat.terms.push(Term { coefficient: *c as f32, place });
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
        products: &Values<FMA>,
    ) -> [Lanes<FMA>; ORDERS] {
        let zero = Lanes::<FMA>::of(0.0);
        let mut out = [zero; ORDERS];
        let [_, width, base, ..] = basis;
        let mut terms = self.terms.as_slice();
        for block in &self.blocks {
            let (these, rest) = terms.split_at(block.terms as usize);
            terms = rest;
            // Two sums, so that one need not wait for the other.
            let (mut even, mut odd) = (zero, zero);
            let pairs = these.chunks_exact(2);
            let last = pairs.remainder();
            for pair in pairs {
                let [a, b] = [pair[0], pair[1]];
                even = products[usize::from(a.place)].mul_add(Pack::splat(a.coefficient), even);
                odd = products[usize::from(b.place)].mul_add(Pack::splat(b.coefficient), odd);
            }
            if let [a] = last {
                even = products[usize::from(a.place)].mul_add(Pack::splat(a.coefficient), even);
            }
            let [drive, w, b] = block.orders.map(usize::from);
            out[drive] = (even + odd).mul_add(width[w] * base[b], out[drive]);
        }
        out
    }
}

/// T_0(x) … into `into`, at least two: those of even and of odd order apart, T_{k+2} = 2 T_2 T_k − T_{k−2}, so that one need not wait for the other.
#[inline(always)]
pub(super) fn polynomials<const FMA: bool>(x: Lanes<FMA>, n: usize, into: &mut [Lanes<FMA>]) {
    let one = Lanes::<FMA>::of(1.0);
    let double = x + x;
    let second = double * x - one;
    let twice = second + second;
    let (mut even, mut odd) = ([one, second], [x, double * second - x]);
    (into[0], into[1]) = (one, x);
    for pair in into[..n.max(2)][2..].chunks_mut(2) {
        pair[0] = even[1];
        even = [even[1], twice * even[1] - even[0]];
        if let Some(value) = pair.get_mut(1) {
            *value = odd[1];
            odd = [odd[1], twice * odd[1] - odd[0]];
        }
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
