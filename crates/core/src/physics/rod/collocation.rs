//! The bent rod with derivatives by collocation, for whiskers without edges: Newton's method for the shape in f64, one evaluation of the equations
//! in [`Traced`] numbers per node, and a linear equation for the change of the shape.
//! Gauss's nodes in w, from the contact to the clamp, with (1 − τs)^(−½) linear in w: there the curvature of a cone is almost a polynomial. The
//! moment depends on the offset by u = x − ρ y alone, ρ = F_x/F_y, so that a node has two unknowns, ψ and u.

mod rule;
mod shape;

use std::array::from_fn;

use super::gradient::{INPUTS, Traced, UNKNOWNS};
use super::statics::{Bent, EndLoad, Whisker};
use crate::physics::number::Number;
use crate::physics::real::Real;
use crate::physics::section::SectionStrain;
use rule::{FEW, MANY, OF_FEW, OF_MANY, Row, Table, add_each, dot, follow, less};

type Shape<const N: usize> = [Row<N>; 5];

pub(super) type Shapes = (Option<Shape<FEW>>, Option<Shape<MANY>>);

const LANES: usize = UNKNOWNS + INPUTS;

/// Derivatives of the rates of ψ, x, y and the gauge's elongation, per w, by ψ and by u.
type Stiffness<const N: usize> = [[Row<N>; 2]; 4];

/// Largest last coefficients, relative to the largest value: of the gauge's rates; of rates integrated over the whole rod; or over a part.
const TAIL: f64 = 3e-10;
const WHOLE: f64 = 1e-7;
const PART: f64 = 3e-10;

/// The contact must be beyond the start of the gauge by this share of the rod: elongation goes as the square of that distance.
const BARELY: f64 = 1e-2;

#[inline(always)]
fn until<const FMA: bool, const N: usize>(
    table: &Table<N>,
    w: Traced,
    (values, slopes): (&[Row<N>; 4], &[[Row<N>; 4]; LANES]),
    c: usize,
) -> Traced {
    let [here, before] = table.interpolate::<FMA>(w.value);
    let mut sum = w * dot(&here, &values[c]);
    sum.value = dot(&before, &values[c]);
    for (slope, rates) in sum.slope.iter_mut().zip(slopes) {
        *slope += dot(&before, &rates[c]);
    }
    sum
}

#[inline(always)]
fn pair<const N: usize>(by: &Stiffness<N>, ratio: f64) -> [[Row<N>; 2]; 2] {
    [by[0], [less(&by[1][0], ratio, &by[2][0]), less(&by[1][1], ratio, &by[2][1])]]
}

impl EndLoad<Traced> {
    /// [`Self::bend`] by collocation, starting from `shapes`; `None` if the nodes are too few or edges lie between them.
    pub fn collocated(
        &self,
        rod: &Whisker<'_, Traced>,
        gauge: [Traced; 2],
        shapes: &mut Shapes,
    ) -> Option<Bent<Traced>> {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the CPU has just been found to have both features.
            return unsafe { self.collocated_avx2(rod, gauge, shapes) };
        }
        self.by_nodes::<{ cfg!(target_arch = "aarch64") }>(rod, gauge, shapes)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn collocated_avx2(
        &self,
        rod: &Whisker<'_, Traced>,
        gauge: [Traced; 2],
        shapes: &mut Shapes,
    ) -> Option<Bent<Traced>> {
        self.by_nodes::<true>(rod, gauge, shapes)
    }

    #[inline(always)]
    fn by_nodes<const FMA: bool>(
        &self,
        rod: &Whisker<'_, Traced>,
        gauge: [Traced; 2],
        (few, many): &mut Shapes,
    ) -> Option<Bent<Traced>> {
        let mut bent = self.at_nodes::<FMA, FEW>(&OF_FEW, rod, gauge, few);
        if bent.is_none() {
            bent = self.at_nodes::<FMA, MANY>(&OF_MANY, rod, gauge, many);
        }
        rod.near.set(None);
        bent
    }

    #[inline(always)]
    fn at_nodes<const FMA: bool, const N: usize>(
        &self,
        table: &Table<N>,
        rod: &Whisker<'_, Traced>,
        gauge: [Traced; 2],
        shape: &mut Option<Shape<N>>,
    ) -> Option<Bent<Traced>> {
        let (tau, one) = (rod.taper.tau, Traced::of(1.0));
        let rest = one - tau * self.arc;
        if !(rest.value > 0.0 && self.force.y.value != 0.0) {
            return None;
        }
        let g = rest.sqrt();
        let m = self.arc / (g + 1.0);
        let mut places = [[one; 2]; N];
        for (place, w) in places.iter_mut().zip(&table.points) {
            let y = (g - 1.0) * *w + 1.0;
            let over = one / y;
            let density = rest * m * over * over;
            *place = [density * (y + 1.0) * *w, density * over * 2.0];
        }
        let ratio = self.force.x.value / self.force.y.value;
        let (at, by) = self.settled::<FMA, N>(table, rod, &places, *shape)?;
        *shape = Some(at);

        let mut values = [[0.0; N]; 4];
        let mut slopes = [[[0.0; N]; 4]; LANES];
        for j in 0..N {
            let [sigma, weight] = places[j];
            let part = (true, 0.0, self.arc.value - sigma.value, one);
            let state = [Traced::of(at[0][j]), Traced::of(at[1][j]), Traced::of(at[2][j]), Traced::of(0.0)];
            rod.near.set(Some(SectionStrain { axial: at[3][j], bending: at[4][j] }));
            let rates = self.slope(rod, part, sigma, &state)?.rate;
            for c in 0..4 {
                let rate = rates[c] * weight;
                values[c][j] = rate.value;
                for (lane, slope) in slopes.iter_mut().zip(rate.slope) {
                    lane[c][j] = slope;
                }
            }
        }
        let (both, still) = (pair(&by, ratio), [0.0; N]);
        let pushed = |rates: &[Row<N>; 4]| [rates[0], less(&rates[1], ratio, &rates[2])];
        let mut moved: [usize; LANES] = from_fn(|k| k);
        let moving = |k: &usize| slopes[*k].iter().any(|rate| *rate != still);
        let count = (0..LANES).filter(moving).zip(&mut moved).map(|(k, place)| *place = k).count();
        for lanes in moved[..count].chunks(2) {
            let two = [lanes[0], lanes[lanes.len() - 1]];
            let rates = two.map(|k| pushed(&slopes[k]));
            let apart = follow::<FMA, N, 2>(table, &both, &rates, [&still; 2], 0.0)?;
            for (k, [turned, left]) in lanes.iter().zip(&apart) {
                for (rate, by) in slopes[*k].iter_mut().zip(&by) {
                    add_each::<FMA, N>(rate, &by[0], turned);
                    add_each::<FMA, N>(rate, &by[1], left);
                }
            }
        }
        let mut tails = [0.0_f64; 4];
        for rates in slopes.iter().chain([&values]) {
            for c in 0..4 {
                tails[c] = tails[c].max(table.tail(&rates[c]));
            }
        }
        let (others, along_gauge) = (tails[0].max(tails[1]).max(tails[2]), tails[3] <= TAIL);
        if others > if along_gauge { WHOLE } else { PART } {
            return None;
        }

        let mut ends = [one; 2];
        for (end, s) in ends.iter_mut().zip([gauge[1], gauge[0]]) {
            let s = if s.value < 0.0 { Traced::of(0.0) } else { s };
            *end = self.arc - Real::min(s, self.arc);
        }
        if ends[1].value > 0.0 && ends[1].value < BARELY * self.arc.value {
            return None;
        }
        let w_at = |sigma: Traced| {
            let root = (one - tau * (self.arc - sigma)).sqrt();
            sigma * (g + 1.0) / (self.arc * root * (root + g))
        };
        let mut elongation = Traced::of(0.0);
        if along_gauge {
            let (far, near) = (w_at(ends[0]), w_at(ends[1]));
            elongation = until::<FMA, N>(table, near, (&values, &slopes), 3)
                - until::<FMA, N>(table, far, (&values, &slopes), 3);
        } else {
            // The strain of the skin varies faster along the rod than its shape.
            let (length, mut strains) = (ends[1] - ends[0], [[0.0; N]; 1 + LANES]);
            for j in 0..N {
                let sigma = length * table.points[j] + ends[0];
                let w = w_at(sigma);
                let mut state = [Traced::of(0.0); 4];
                for (c, state) in state.iter_mut().enumerate().take(3) {
                    *state = until::<FMA, N>(table, w, (&values, &slopes), c);
                }
                let [here, _] = table.interpolate::<FMA>(w.value);
                rod.near.set(Some(SectionStrain { axial: dot(&here, &at[3]), bending: dot(&here, &at[4]) }));
                let strain =
                    self.slope(rod, (true, 0.0, self.arc.value - sigma.value, one), sigma, &state)?.rate[3];
                elongation = elongation + strain * length * table.weights[j];
                strains[0][j] = strain.value;
                for (row, slope) in strains[1..].iter_mut().zip(strain.slope) {
                    row[j] = slope;
                }
            }
            if !strains.iter().all(|row| table.tail(row) <= TAIL) {
                return None;
            }
        }
        let mut bent = [elongation; 4];
        for c in 0..3 {
            bent[c] = Traced::of(dot(&table.weights, &values[c]));
            for (slope, rates) in bent[c].slope.iter_mut().zip(&slopes) {
                *slope = dot(&table.weights, &rates[c]);
            }
        }
        let finite =
            bent.iter().all(|x| x.value.is_finite() && x.slope.iter().all(|slope| slope.is_finite()));
        finite.then(|| Bent::from(bent))
    }
}
