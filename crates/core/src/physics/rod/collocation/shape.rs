//! The shape of a bent rod under its load at given nodes, by Newton's method.

use std::array::from_fn;
use std::f64::consts::PI;

use super::rule::{MANY, Table, add, add_each, follow, largest, less};
use super::{Shape, Stiffness, TAIL, pair};
use crate::physics::number::Number;
use crate::physics::real::{Dual, Vector};
use crate::physics::rod::gradient::Traced;
use crate::physics::rod::statics::{EndLoad, Whisker};
use crate::physics::section::SectionStrain;

type Local = Dual<2>;

/// Newton stops after a relative change of the shape below this: the next would be its square.
const SETTLED: f64 = 1e-7;

const BEGUN: f64 = 1e-4;

const MOST_STEPS: usize = 8;

impl EndLoad<Traced> {
    #[inline(always)]
    fn straight<const FMA: bool, const N: usize>(
        &self,
        table: &Table<N>,
        rod: &Whisker<'_, Traced>,
        places: &[[Traced; 2]; N],
    ) -> Shape<N> {
        let (arc, modulus) = (self.arc.value, rod.law.modulus().value);
        let (force, point) = (self.force.map(|x| x.value), self.point.map(|x| x.value));
        let (taper, still) = (rod.taper.map(|x| x.value), [0.0; N]);
        let mut at = [still; 5];
        let mut rate = still;
        for j in 0..N {
            let [sigma, weight] = places[j].map(|x| x.value);
            let radius = taper.radius(arc - sigma);
            let moment = Vector::new(point.x + sigma, point.y).perp_dot(force);
            at[4][j] = moment * 4.0 / (PI * modulus * radius.powi(3));
            rate[j] = -at[4][j] / radius * weight;
        }
        [at[0]] = table.integrate::<FMA, 1>([&rate], &still);
        let [shorter, lower] = [|psi: f64| 0.5 * psi * psi, |psi: f64| -psi]
            .map(|of| from_fn(|j| of(at[0][j]) * places[j][1].value));
        [at[1], at[2]] = table.integrate::<FMA, 2>([&shorter, &lower], &still);
        at
    }

    #[inline(always)]
    pub(super) fn settled<const FMA: bool, const N: usize>(
        &self,
        table: &Table<N>,
        rod: &Whisker<'_, Traced>,
        places: &[[Traced; 2]; N],
        begun: Option<Shape<N>>,
    ) -> Option<(Shape<N>, Stiffness<N>)> {
        let load = EndLoad {
            arc: Local::of(self.arc.value),
            force: self.force.map(|x| Local::of(x.value)),
            point: self.point.map(|x| Local::of(x.value)),
        };
        let bare = rod.map(|x| Local::of(x.value))?;
        let ratio = self.force.x.value / self.force.y.value;
        let mut at = begun.unwrap_or_else(|| self.straight::<FMA, N>(table, rod, places));
        let mut last = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let (mut rates, mut by, before) = ([[0.0; N]; 4], [[[0.0; N]; 2]; 4], at[4]);
            for j in 0..N {
                let (psi, x) = (Local::seed(at[0][j], 0, 1.0), Local::seed(at[1][j], 1, 1.0));
                let (sigma, weight) = (places[j][0].value, places[j][1].value);
                let part = (true, 0.0, self.arc.value - sigma, Local::of(1.0));
                let state = [psi, x, Local::of(at[2][j]), Local::of(0.0)];
                bare.near.set(Some(SectionStrain { axial: at[3][j], bending: at[4][j] }));
                let slope = load.slope(&bare, part, Local::of(sigma), &state)?;
                let near = bare.near.get()?;
                (at[3][j], at[4][j]) = (near.axial, near.bending);
                for c in 0..4 {
                    rates[c][j] = slope.rate[c].value * weight;
                    by[c][0][j] = slope.rate[c].slope[0] * weight;
                    by[c][1][j] = slope.rate[c].slope[1] * weight;
                }
            }
            if last <= SETTLED {
                // Series of derivatives converge later than those of values.
                let doubtful = rod.skin.is_none() && N < MANY && table.tail(&rates[3]) > 0.2 * TAIL;
                return (!doubtful).then_some((at, by));
            }
            let (leaves, u) = (less(&rates[1], ratio, &rates[2]), less(&at[1], ratio, &at[2]));
            let pushed = [[rates[0], leaves]];
            let [apart] = follow::<FMA, N, 1>(table, &pair(&by, ratio), &pushed, [&at[0], &u], BEGUN)?;
            last = largest(&less(&at[4], 1.0, &before)) / largest(&at[4]).max(f64::MIN_POSITIVE);
            for c in 0..3 {
                add_each::<FMA, N>(&mut rates[c], &by[c][0], &apart[0]);
                add_each::<FMA, N>(&mut rates[c], &by[c][1], &apart[1]);
                let [change] = table.integrate::<FMA, 1>([&rates[c]], &at[c]);
                add::<false, N>(&mut at[c], 1.0, &change);
                let (change, size) = (largest(&change), largest(&at[c]));
                last = last.max(if change > 0.0 { change / size } else { change });
            }
        }
        None
    }
}
