//! Reading a sparse series in lanes.

use super::{Lanes, ORDERS};
use crate::adaptive;
use crate::axis::AXES;
use crate::kernel::cpu::Packed;
use crate::series::Series;

/// Most products: any pair of orders, and a power of two, which saves bounds checks.
const MOST_PRODUCTS: usize = 256;
const _: () = assert!(ORDERS * ORDERS <= MOST_PRODUCTS);

/// Polynomials over an axis; longer than any axis has orders, which saves bounds checks.
pub(super) type Basis = [[Lanes; MOST_ORDERS]; AXES];
const MOST_ORDERS: usize = 32;
const _: () = assert!(adaptive::MOST < MOST_ORDERS);

const MOST_POINTS: usize = 8;

/// In place of an order over x/a, for a function of the whole tap; its polynomial is 1.
const WHOLE: u8 = MOST_ORDERS as u8 - 1;

const LONGEST: usize = 8;

/// Values of products, by place in [`Products`]; `points` is scratch for the mean over a gauge.
pub(super) struct Values {
    inner: Box<[Lanes; MOST_PRODUCTS]>,
    outer: Vec<Lanes>,
    pub points: Box<[[Lanes; 4]; MOST_POINTS]>,
}

impl Values {
    #[inline(always)]
    pub fn new<'a>(products: impl Iterator<Item = &'a Products>) -> Self {
        let zero = Lanes::of(0.0);
        let most = products.map(|p| p.outer.len()).max().unwrap_or(0);
        Self {
            inner: Box::new([zero; MOST_PRODUCTS]),
            outer: vec![zero; most],
            points: Box::new([[zero; 4]; MOST_POINTS]),
        }
    }
}

/// Products of polynomials, computed once for all series over the same axes, so that every coefficient is one multiply–add.
#[derive(Debug, Default)]
pub(super) struct Products {
    /// Orders over taper and place.
    inner: Vec<[u8; 2]>,
    /// Orders over drive, width and base.
    outer: Vec<[u8; 3]>,
    /// For each function, the products that it and those before it need.
    pub needs: Vec<Need>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Need {
    products: [usize; 2],
    pub sizes: [usize; AXES],
}

/// A series, its coefficients by place in [`Products`]. Blocks are sorted by their number of terms, so that loop lengths are constant.
#[derive(Debug, Default)]
pub(super) struct Flat {
    /// Number of blocks of 1, 2 … terms.
    lengths: [usize; LONGEST],
    blocks: Vec<Block>,
    terms: Vec<Term>,
    pub orders: usize,
}

/// Terms that share their orders over drive, width and base.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Among the outer products.
    place: u32,
    drive: u8,
}

#[derive(Debug, Clone, Copy)]
struct Term {
    coefficient: f32,
    /// Among the inner products.
    place: u8,
}

fn place_of<T: PartialEq>(all: &mut Vec<T>, one: T) -> usize {
    all.iter().position(|known| *known == one).unwrap_or_else(|| {
        all.push(one);
        all.len() - 1
    })
}

impl Products {
    pub fn add<'a>(&mut self, series: impl Iterator<Item = &'a Series>, point: bool) -> Vec<Flat> {
        let mut sizes = self.needs.last().map_or([1; AXES], |need| need.sizes);
        let mut flat = |series: &Series| {
            for (size, own) in sizes.iter_mut().zip(series.sizes()) {
                *size = own.max(*size);
            }
            Flat::new(series, point, self)
        };
        let flats = series.map(&mut flat).collect();
        self.needs.push(Need { products: [self.inner.len(), self.outer.len()], sizes });
        flats
    }

    /// Values of the products; with `OWN` at each lane's drive, else without the polynomials over it.
    #[inline(always)]
    pub fn fill<const OWN: bool>(&self, need: &Need, basis: &mut Basis, into: &mut Values) {
        let order = |order: u8| usize::from(order) % MOST_ORDERS;
        basis[4][order(WHOLE)] = Lanes::of(1.0);
        let [over_drive, over_width, over_base, over_taper, over_place] = &*basis;
        let [inner, outer] = need.products;
        for ([taper, place], value) in self.inner[..inner].iter().zip(&mut *into.inner) {
            *value = over_taper[order(*taper)] * over_place[order(*place)];
        }
        for ([drive, width, base], value) in self.outer[..outer].iter().zip(&mut into.outer) {
            let mut product = over_base[order(*base)];
            if *width > 0 {
                product = product * over_width[order(*width)];
            }
            if OWN && *drive > 0 {
                product = product * over_drive[order(*drive)];
            }
            *value = product;
        }
    }
}

/// Adds blocks of `N` terms each: to the sum, or to that of their order over the drive.
#[inline(always)]
fn add_blocks<const N: usize, const OWN: bool>(
    blocks: &[Block],
    terms: &[Term],
    values: &Values,
    sums: &mut [Lanes; ORDERS],
) {
    let mut sum = sums[0];
    for (block, terms) in blocks.iter().zip(terms.as_chunks::<N>().0) {
        let mut value = values.inner[usize::from(terms[0].place)] * Lanes::splat(terms[0].coefficient);
        for term in &terms[1..] {
            value = values.inner[usize::from(term.place)].mul_add(Lanes::splat(term.coefficient), value);
        }
        let outer = values.outer[block.place as usize];
        if OWN {
            sum = value.mul_add(outer, sum);
        } else {
            let sum = &mut sums[usize::from(block.drive)];
            *sum = value.mul_add(outer, *sum);
        }
    }
    if OWN {
        sums[0] = sum;
    }
}

impl Flat {
    /// `point`: a function of the point of the strain, else of the whole tap.
    fn new(series: &Series, point: bool, products: &mut Products) -> Self {
        let mut parts: Vec<([u8; 3], Vec<Term>)> = Vec::new();
        for row in &series.rows {
            let [orders @ .., taper] = row.orders.map(|k| k as u8);
            let n = if point { row.coefficients.len() } else { 1 };
            for (place, c) in row.coefficients[..n].iter().enumerate().filter(|(_, c)| **c != 0.0) {
                let pair = [taper, if point { place as u8 } else { WHOLE }];
                let term = Term { coefficient: *c as f32, place: place_of(&mut products.inner, pair) as u8 };
                match parts.last_mut() {
                    Some((own, terms)) if *own == orders && terms.len() < LONGEST => terms.push(term),
                    _ => parts.push((orders, vec![term])),
                }
            }
        }
        parts.sort_by_key(|(_, terms)| terms.len());
        let mut flat = Self { orders: series.sizes()[0], ..Self::default() };
        for (orders, terms) in parts {
            flat.lengths[terms.len() - 1] += 1;
            let place = place_of(&mut products.outer, orders) as u32;
            flat.blocks.push(Block { place, drive: orders[0] });
            flat.terms.extend(terms);
        }
        flat
    }

    /// With `OWN` its value at each lane's drive, else its coefficients over the drive.
    #[inline(always)]
    pub fn sums<const OWN: bool>(&self, values: &Values) -> [Lanes; ORDERS] {
        let mut sums = [Lanes::of(0.0); ORDERS];
        let (mut blocks, mut terms) = (self.blocks.as_slice(), self.terms.as_slice());
        macro_rules! of_length {
            ($($n:literal)*) => {$(
                let (these, others) = blocks.split_at(self.lengths[$n - 1]);
                let (own, rest) = terms.split_at($n * these.len());
                (blocks, terms) = (others, rest);
                add_blocks::<$n, OWN>(these, own, values, &mut sums);
            )*};
        }
        of_length!(1 2 3 4 5 6 7 8);
        debug_assert!(blocks.is_empty() && terms.is_empty());
        sums
    }

    #[inline(always)]
    pub fn at(&self, values: &Values) -> Lanes {
        self.sums::<true>(values)[0]
    }
}

/// T_0(x) … into `into`, at least two; even and odd orders are independent chains, T_{k+2} = 2 T_2 T_k − T_{k−2}, and overlap.
#[inline(always)]
pub(super) fn polynomials(x: Lanes, n: usize, into: &mut [Lanes]) {
    let one = Lanes::of(1.0);
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
