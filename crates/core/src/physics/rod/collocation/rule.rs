//! Functions by their values at Gauss's nodes: integrals, series, and a linear equation for two of them.

use std::array::from_fn;
use std::sync::LazyLock;

use crate::physics::nodes::Nodes;

pub type Row<const N: usize> = [f64; N];

const FOLLOWED: f64 = 1e-14;

const MOST_SWEEPS: usize = 40;

pub struct Table<const N: usize> {
    pub points: Row<N>,
    pub weights: Row<N>,
    /// Transposed against [`Nodes`]: row j is the part of node j in the integral to each node.
    integral: [Row<N>; N],
    legendre: [Row<N>; N],
}

/// Numbers of nodes, tried in turn; multiples of four.
pub const FEW: usize = 16;
pub const MANY: usize = 24;

pub static OF_FEW: LazyLock<Table<FEW>> = LazyLock::new(Table::new);
pub static OF_MANY: LazyLock<Table<MANY>> = LazyLock::new(Table::new);

impl<const N: usize> Table<N> {
    fn new() -> Self {
        let Nodes { points, weights, integral, legendre } = Nodes::of(N);
        let row = |of: &dyn Fn(usize) -> f64| from_fn(of);
        Self {
            points: row(&|i| points[i]),
            weights: row(&|i| weights[i]),
            integral: from_fn(|j| row(&|i| integral[i][j])),
            legendre: from_fn(|k| row(&|j| legendre[k][j])),
        }
    }

    /// ∫ of each of `rates` from 0 to each node, less `from`; interleaved, because a sum waits for its last term.
    #[inline(always)]
    pub fn integrate<const FMA: bool, const M: usize>(
        &self,
        rates: [&Row<N>; M],
        from: &Row<N>,
    ) -> [Row<N>; M] {
        let mut sums = [[0.0; N]; M];
        for (j, column) in self.integral.iter().enumerate() {
            for (sum, rate) in sums.iter_mut().zip(rates) {
                add::<FMA, N>(sum, rate[j], column);
            }
        }
        sums.iter_mut().for_each(|sum| add::<false, N>(sum, -1.0, from));
        sums
    }

    #[inline(always)]
    pub fn interpolate<const FMA: bool>(&self, w: f64) -> [Row<N>; 2] {
        let x = 2.0 * w - 1.0;
        let (mut before, mut now) = (1.0, x);
        let mut weights = [self.legendre[0], [0.0; N]];
        add::<FMA, N>(&mut weights[1], w, &self.legendre[0]);
        for k in 1..N {
            let kf = k as f64;
            let next = ((2.0 * kf + 1.0) * x * now - kf * before) / (kf + 1.0);
            add::<FMA, N>(&mut weights[0], now, &self.legendre[k]);
            add::<FMA, N>(&mut weights[1], (next - before) * 0.5 / (2.0 * kf + 1.0), &self.legendre[k]);
            (before, now) = (now, next);
        }
        weights
    }

    #[inline(always)]
    pub fn tail(&self, rate: &Row<N>) -> f64 {
        let last = dot(&self.legendre[N - 1], rate).abs() + dot(&self.legendre[N - 2], rate).abs();
        let size = largest(rate);
        if size > 0.0 { last / size } else { size }
    }
}

#[inline(always)]
pub fn add<const FMA: bool, const N: usize>(to: &mut Row<N>, factor: f64, x: &Row<N>) {
    for (to, x) in to.iter_mut().zip(x) {
        *to = if FMA { factor.mul_add(*x, *to) } else { factor * *x + *to };
    }
}

#[inline(always)]
pub fn add_each<const FMA: bool, const N: usize>(to: &mut Row<N>, factor: &Row<N>, x: &Row<N>) {
    for ((to, x), factor) in to.iter_mut().zip(x).zip(factor) {
        *to = if FMA { factor.mul_add(*x, *to) } else { factor * *x + *to };
    }
}

#[inline(always)]
pub fn dot<const N: usize>(x: &Row<N>, y: &Row<N>) -> f64 {
    let mut sums = [0.0; 4];
    for k in (0..N).step_by(4) {
        for i in 0..4 {
            sums[i] += x[k + i] * y[k + i];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

#[inline(always)]
pub fn largest<const N: usize>(x: &Row<N>) -> f64 {
    let mut most = [0.0_f64; 4];
    for k in (0..N).step_by(4) {
        for i in 0..4 {
            let size = x[k + i].abs();
            most[i] = if size > most[i] { size } else { most[i] };
        }
    }
    most[0].max(most[1]).max(most[2]).max(most[3])
}

/// Distances of pairs of functions from `from`, with rates `rates` there and derivatives `by`; accurate to `share` of the first change.
#[inline(always)]
pub fn follow<const FMA: bool, const N: usize, const M: usize>(
    table: &Table<N>,
    by: &[[Row<N>; 2]; 2],
    rates: &[[Row<N>; 2]; M],
    from: [&Row<N>; 2],
    share: f64,
) -> Option<[[Row<N>; 2]; M]> {
    let mut apart = [[[0.0; N]; 2]; M];
    let (mut turns, mut first) = (from_fn(|m| rates[m][0]), [f64::NAN; M]);
    for sweep in 0..MOST_SWEEPS {
        let turned = table.integrate::<FMA, M>(turns.each_ref(), from[0]);
        let mut leaves: [Row<N>; M] = from_fn(|m| rates[m][1]);
        for m in 0..M {
            add_each::<FMA, N>(&mut leaves[m], &by[1][0], &turned[m]);
            add_each::<FMA, N>(&mut leaves[m], &by[1][1], &apart[m][1]);
        }
        let left = table.integrate::<FMA, M>(leaves.each_ref(), from[1]);
        let mut done = true;
        for m in 0..M {
            apart[m] = [turned[m], left[m]];
            let mut next = rates[m][0];
            add_each::<FMA, N>(&mut next, &by[0][0], &apart[m][0]);
            add_each::<FMA, N>(&mut next, &by[0][1], &apart[m][1]);
            let size = largest(&next);
            add::<false, N>(&mut turns[m], -1.0, &next);
            let change = largest(&turns[m]);
            if sweep == 0 {
                first[m] = change;
            }
            done &= change <= FOLLOWED * size || change <= share * first[m];
            turns[m] = next;
        }
        if done {
            return Some(apart);
        }
    }
    None
}

#[inline(always)]
pub fn less<const N: usize>(x: &Row<N>, ratio: f64, y: &Row<N>) -> Row<N> {
    let mut u = *x;
    add::<false, N>(&mut u, -ratio, y);
    u
}
