//! A whisker as the solver takes it: pieces along which radii are linear.

use std::array::from_fn;

use vibrissa_core::physics::body::Body;
use vibrissa_core::physics::real::Real;
use vibrissa_core::physics::solid::Bonded;
use vibrissa_core::physics::taper::Taper;

use super::Effects;

/// A piece between two places where the profile, the inner part or the foil changes. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<T = f64> {
    /// Its beginning.
    pub near: T,
    /// Its end; infinite for the last piece.
    pub far: T,
    /// R at its beginning, and R′.
    pub radius: [T; 2],
    /// The same of the core or bore; 0 without.
    pub inner: [T; 2],
    /// Factor of the curvature: below 1 under a foil.
    pub bends: T,
}

/// A whisker with its gauge.
#[derive(Debug, Clone, PartialEq)]
pub struct Rod<T = f64> {
    /// From the base to the tip.
    pub pieces: Vec<Piece<T>>,
    /// R(0), R(L_a), n and L_a, where the diameter is a power of the distance from the tip.
    pub power: Option<[T; 4]>,
    /// κ_base and κ_slope, 1/mm and 1/mm².
    pub curvature: [T; 2],
    /// Compliances of the root, 1/k_theta, 1/k_x and 1/k_y.
    pub root: [T; 3],
    /// E of the skin and of the core, MPa.
    pub moduli: [T; 2],
    /// Poisson's ratio ν.
    pub nu: T,
    /// Ends x1 and x2 of the gauge, mm.
    pub gauge: [T; 2],
}

impl<T: Copy> Rod<T> {
    /// `f` of each number.
    pub fn map<U>(&self, f: impl Fn(T) -> U) -> Rod<U> {
        self.made(|get| f(get(self)))
    }

    /// True if both have the same parts.
    pub fn is_like(&self, o: &Self) -> bool {
        self.pieces.len() == o.pieces.len() && self.power.is_some() == o.power.is_some()
    }

    /// A whisker with the parts of this one. `f` makes each number by a function that reads it from a whisker with these parts.
    pub fn made<U>(&self, f: impl Fn(&dyn Fn(&Self) -> T) -> U) -> Rod<U> {
        let piece = |i: usize| Piece {
            near: f(&|r| r.pieces[i].near),
            far: f(&|r| r.pieces[i].far),
            radius: from_fn(|k| f(&|r| r.pieces[i].radius[k])),
            inner: from_fn(|k| f(&|r| r.pieces[i].inner[k])),
            bends: f(&|r| r.pieces[i].bends),
        };
        Rod {
            pieces: (0..self.pieces.len()).map(piece).collect(),
            power: self.power.map(|power| from_fn(|k| f(&|r| r.power.unwrap_or(power)[k]))),
            curvature: from_fn(|k| f(&|r| r.curvature[k])),
            root: from_fn(|k| f(&|r| r.root[k])),
            moduli: from_fn(|k| f(&|r| r.moduli[k])),
            nu: f(&|r| r.nu),
            gauge: from_fn(|k| f(&|r| r.gauge[k])),
        }
    }
}

impl<T: Real> Rod<T> {
    /// The effects of a model on this whisker.
    pub fn effects(&self, model: Effects) -> Effects {
        let curved = self.curvature != [T::of(0.0); 2];
        let inner = self.pieces.iter().any(|piece| piece.inner != [T::of(0.0); 2]);
        let power = self.power.is_some();
        Effects { curved, inner, power, ..model }
    }

    /// True if the direction of its skin changes along a piece at rest; `surface`: contacts lie on the skin.
    pub fn turns(&self, surface: bool) -> bool {
        self.curvature != [T::of(0.0); 2] || surface && self.power.is_some()
    }
}

impl Rod {
    /// A cone that begins at the end of its clamp, with a gauge.
    pub fn cone(taper: &Taper, [modulus, nu]: [f64; 2], gauge: [f64; 2], foil: Option<&Bonded>) -> Self {
        let edges = foil.map_or(Vec::new(), |foil| foil.span.to_vec());
        let radius = |s: f64| [taper.radius(s), -taper.tan_alpha];
        Self {
            pieces: pieces(edges, foil, |near, _| (radius(near), [0.0; 2])),
            power: None,
            curvature: [0.0; 2],
            root: [0.0; 3],
            moduli: [modulus, 0.0],
            nu,
            gauge,
        }
    }

    /// The whisker `body` with a gauge.
    pub fn built(body: &Body, gauge: [f64; 2], foil: Option<&Bonded>) -> Self {
        let mut edges = body.knots().to_vec();
        edges.extend(foil.iter().flat_map(|foil| foil.span));
        let length = body.length;
        let (root, power) = (body.built.root, body.power());
        let piece = |near: f64, far: f64| {
            let far = far.min(length);
            let within = 0.5 * (near + far);
            let line = |at: &dyn Fn(f64) -> f64| [at(near), (at(far) - at(near)) / (far - near)];
            let radius = match power {
                // Beyond the tip the diameter stays constant.
                Some(_) => line(&|s| body.radius(s, within)),
                None => [body.radius(near, within), body.slope(near, within)],
            };
            (radius, line(&|s| body.inside(s, within) * 0.5))
        };
        Self {
            pieces: pieces(edges, foil, piece),
            power: power.map(|[base, tip, n]| [base, tip, n, length]),
            curvature: body.built.curvature,
            root: [root.k_theta, root.k_x, root.k_y].map(|k| 1.0 / k),
            moduli: [body.modulus, body.core_modulus()],
            nu: body.nu,
            gauge,
        }
    }
}

fn pieces(
    mut edges: Vec<f64>,
    foil: Option<&Bonded>,
    of: impl Fn(f64, f64) -> ([f64; 2], [f64; 2]),
) -> Vec<Piece> {
    edges.retain(|s| *s > 0.0);
    edges.push(0.0);
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    edges.push(f64::INFINITY);
    let piece = |ends: &[f64]| {
        let (near, far) = (ends[0], ends[1]);
        let (radius, inner) = of(near, far);
        let under = foil.filter(|foil| foil.span[0] <= near && near < foil.span[1]);
        Piece { near, far, radius, inner, bends: under.map_or(1.0, |foil| 1.0 - foil.stiffening) }
    };
    edges.windows(2).map(piece).collect()
}
