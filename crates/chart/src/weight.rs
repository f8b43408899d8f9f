//! Weights of a gauge's points ([`crate::gauge`]): f is R/EI times the moment m of a unit force there, times factors without the place.

use std::ops::{Add, Div, Mul, Sub};

use super::axis::{AXES, Axis, FIRST_PLACE, Quantity};
use crate::physics::body::Body;
use crate::physics::chebyshev::{coefficients, placed, points};
use crate::scene::Setup;
use crate::scene::built::Profile;

/// Orders to try for factors of the place alone; a smooth function's last ones are below ROUGH, relative to the first.
const ORDERS: usize = 24;
const ROUGH: f64 = 1e-9;

/// (R/EI) m over that of a thin slice of the base under a straight whisker, for whiskers other than cones of one material.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Weight {
    /// L_a/a and n of a diameter that is a power of the distance from the tip.
    power: Option<[f64; 2]>,
    /// Core or bore: radius over a = the first plus the second times x/a; the third is its modulus over that of the skin, less 1.
    inner: Option<[f64; 3]>,
    /// R/EI is in [`Self::along`].
    tabulated: bool,
    /// Series, over the variable of the place, of the factors of the place alone; 1 without any.
    along: Vec<f64>,
}

impl Weight {
    /// Weights over the places of `axes` under contacts at `a` mm. `Some(None)` for a cone; `None` if R/EI or m is not smooth.
    pub fn of(setup: &Setup, a: f64, axes: &[Axis; AXES]) -> Option<Option<Self>> {
        let Some(built) = setup.built.as_deref() else { return Some(None) };
        if built.is_straight() && built.inner.is_none() && built.profile == Profile::Power(1.0) {
            return Some(None);
        }
        let axis = |quantity: Quantity| &axes[quantity as usize];
        let place = axis(Quantity::Place);
        // A gauge that begins at the clamp has its points behind it, as if the whisker continued.
        let near = a * (place.range[0] - FIRST_PLACE).max(0.0);
        let far = a * place.range[1];
        let middle = 0.5 * (near + far);
        // Nothing read from it here depends on a tuple's diameters or length.
        let body = Body::new(built, [1.0, 1.0, f64::MAX], setup.model.material.e0(), setup.model.nu);
        if body.knots().iter().any(|knot| *knot > near && *knot < far) {
            return None;
        }
        let tabulated = matches!(built.profile, Profile::Table(_));
        let power = match built.profile {
            // Charts of such a profile are of one length.
            Profile::Power(n) if n != 1.0 => {
                let length = axis(Quantity::Length);
                Some([length.is_point().then_some(length.range[0])?, n])
            }
            _ => None,
        };
        let inner = built.inner.as_ref().filter(|_| !tabulated).map(|inner| {
            let [begin, end] = [near, far].map(|s| 0.5 * body.inside(s, middle) / a);
            let slope = if far > near { (end - begin) / (far - near) * a } else { 0.0 };
            [begin - slope * near / a, slope, inner.modulus / body.modulus - 1.0]
        });
        let moment = |x: f64| {
            if built.is_straight() {
                return 1.0;
            }
            let arm = body.rest(a) - body.rest(x);
            let (sin, cos) = body.rest_angle(a).sin_cos();
            (arm.x * cos + arm.y * sin) / (a - x)
        };
        let along = |x: f64| {
            let section = body.section(x, middle);
            let share = if tabulated { section.radius / section.bending } else { 1.0 };
            share * moment(x)
        };
        let along = if tabulated || !built.is_straight() { series(place, |s| along(s * a))? } else { vec![] };
        Some(Some(Self { power, inner, tabulated, along }))
    }

    /// At D/a, τa and x/a; `variable` is that of the place; numbers by `of`, powers by `powf`.
    #[inline(always)]
    pub fn at<T>(
        &self,
        [base, taper, s]: [T; 3],
        variable: T,
        of: impl Fn(f64) -> T,
        powf: impl Fn(T, f64) -> T,
    ) -> T
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
    {
        let one = of(1.0);
        let mut weight = one;
        if !self.tabulated {
            let radius = match self.power {
                None => one - taper * s,
                Some([length, n]) => {
                    let narrowing = taper * of(length);
                    one - narrowing + narrowing * powf(one - s * of(1.0 / length), n)
                }
            };
            let mut stiffness = radius * radius * radius * radius;
            if let Some([begin, slope, more]) = self.inner {
                let inside = (of(begin) + of(slope) * s) * of(2.0) / base;
                let square = inside * inside;
                stiffness = stiffness + of(more) * square * square;
            }
            weight = radius / stiffness;
        }
        if let Some((&first, others)) = self.along.split_first() {
            let (mut sum, mut before, mut this) = (of(first), one, variable);
            for &next in others {
                sum = sum + of(next) * this;
                (before, this) = (this, (variable + variable) * this - before);
            }
            weight = weight * sum;
        }
        weight
    }
}

/// Series of a smooth function of x/a over the variable of `place`, relative to its value in the middle.
fn series(place: &Axis, f: impl Fn(f64) -> f64) -> Option<Vec<f64>> {
    let ends = place.ends();
    let at = |x: f64| f(place.map.back(placed(ends, x)));
    let middle = at(0.0);
    if place.is_point() {
        return Some(vec![1.0]);
    }
    let values: Vec<f64> = points(ORDERS).into_iter().map(|x| at(x) / middle).collect();
    let mut all = coefficients(&values);
    let enough = all.iter().rposition(|c| c.abs() > ROUGH).map_or(1, |last| last + 1);
    all.truncate(enough);
    (all.len() < ORDERS && all.iter().all(|c| c.is_finite())).then_some(all)
}
