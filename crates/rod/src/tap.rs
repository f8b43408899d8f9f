//! A tap as the solver takes it, and its answer.

use vibrissa_core::physics::pole::Space;
use vibrissa_core::physics::solid::{HALVED, is_solid};
use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::{Contact, Material, Model, Side};
use vibrissa_kernel::rule::limits::{ASTRAY, EDGE, HOPELESS};

use super::Rod;

/// Effects of the model and of the whiskers, equal for all taps of a pack; an effect that is off costs nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Effects {
    /// Timoshenko shear.
    pub shear: bool,
    /// Stretch of the centreline.
    pub extension: bool,
    /// Contact on the surface.
    pub surface: bool,
    /// The contact stays at its arc length.
    pub stick: bool,
    /// A contact that sticks rolls on its pole.
    pub roll: bool,
    /// A hyperelastic section law, read from a chart.
    pub law: bool,
    /// The gauge is on the far side.
    pub far: bool,
    /// The contact gives way.
    pub soft: bool,
    /// The pole is tilted.
    pub tilt: bool,
    /// The strain of the skin is not that of the rod.
    pub distorting: bool,
    /// The resting whisker is curved.
    pub curved: bool,
    /// The whisker has a core or a bore.
    pub inner: bool,
    /// The diameter is a power of the distance from the tip.
    pub power: bool,
    /// The gauge is long.
    pub long: bool,
    /// Components of the wrench are asked: one may nearly cancel.
    pub wrench: bool,
}

impl Effects {
    /// Those of `model`, with a gauge on `side` and a contact that sticks or slides.
    pub fn of(model: &Model, side: Side, stick: bool) -> Self {
        Self {
            shear: model.shear,
            extension: model.extension,
            surface: model.surface,
            stick,
            roll: stick && model.pole_radius > 0.0,
            law: !matches!(model.material, Material::Hooke(_)),
            far: side == Side::Far,
            soft: is_solid(model) && model.contact == Contact::Frictionless,
            distorting: model.distorting,
            ..Self::default()
        }
    }
}

/// The skin next to the clamp (model §8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin<T = f64> {
    /// The whisker from the face of its clamp on.
    pub taper: Taper<T>,
    /// From there to where the rod begins, mm.
    pub start: T,
    /// Loss on both sides, in (κR)².
    pub halved: f64,
}

impl Skin {
    /// The skin of `model` on the cone `taper`, measured from the face of its clamp, whose rod begins at `start`.
    pub fn new(model: &Model, taper: &Taper, start: f64) -> Self {
        let halved = if matches!(model.material, Material::Hooke(_)) { 0.0 } else { HALVED };
        Self { taper: *taper, start, halved }
    }
}

/// A pole that is not upright (model §6).
#[derive(Debug, Clone, Copy)]
pub struct Tilt<T = f64> {
    /// A point of its axis, mm.
    pub point: Space<T>,
    /// Direction of its axis.
    pub along: Space<T>,
    /// Azimuth φ of a plane in which the pole can be touched, rad: that in which the iteration begins.
    pub azimuth: T,
}

/// One tap; mm, N, rad.
#[derive(Debug, Clone, Copy)]
pub struct Tap<'a, T = f64> {
    /// The whisker.
    pub rod: &'a Rod<T>,
    /// Contact distance a.
    pub a: T,
    /// Hub radius r₀; 0 where the object moves.
    pub hub: T,
    /// θ; 0 where the object moves.
    pub turn: T,
    /// δ; 0 where the base turns.
    pub lift: T,
    /// T/P of a sliding contact.
    pub ratio: T,
    /// Pole radius ρ.
    pub pole: T,
    /// 1/kG over that of model §3.
    pub softer: T,
    /// δ(P) of a contact that gives way: parts in P^⅔ and in P.
    pub soft: [T; 2],
    /// The skin, where sections distort.
    pub skin: Option<Skin<T>>,
    /// The pole, if it is not upright: a and the turn are then those of the planar tap at [`Tilt::azimuth`].
    pub tilt: Option<Tilt<T>>,
    /// Least strain that errors are relative to.
    pub least: T,
}

impl<T: Copy> Tap<'_, T> {
    /// `f` of each number, for the whisker `rod`.
    pub fn map<'b, U>(&self, rod: &'b Rod<U>, f: impl Fn(T) -> U) -> Tap<'b, U> {
        self.made(rod, |get| f(get(self)))
    }

    /// True if both have a skin, and a tilted pole, or both have none.
    pub fn is_like(&self, o: &Tap<'_, T>) -> bool {
        self.skin.is_some() == o.skin.is_some() && self.tilt.is_some() == o.tilt.is_some()
    }

    /// A tap with the parts of this one, for the whisker `rod`. `f` makes each number by a function that reads it from a tap with these parts.
    pub fn made<'b, U>(&self, rod: &'b Rod<U>, f: impl Fn(&dyn Fn(&Tap<'_, T>) -> T) -> U) -> Tap<'b, U> {
        let skin = |skin: Skin<T>| {
            let of = |t: &Tap<'_, T>| t.skin.unwrap_or(skin);
            let taper = Taper {
                D: f(&|t| of(t).taper.D),
                tau: f(&|t| of(t).taper.tau),
                tan_alpha: f(&|t| of(t).taper.tan_alpha),
            };
            Skin { taper, start: f(&|t| of(t).start), halved: skin.halved }
        };
        let tilt = |tilt: Tilt<T>| {
            let of = |t: &Tap<'_, T>| t.tilt.unwrap_or(tilt);
            let point = std::array::from_fn(|k| f(&|t| of(t).point[k]));
            let along = std::array::from_fn(|k| f(&|t| of(t).along[k]));
            Tilt { point, along, azimuth: f(&|t| of(t).azimuth) }
        };
        Tap {
            rod,
            a: f(&|t| t.a),
            hub: f(&|t| t.hub),
            turn: f(&|t| t.turn),
            lift: f(&|t| t.lift),
            ratio: f(&|t| t.ratio),
            pole: f(&|t| t.pole),
            softer: f(&|t| t.softer),
            soft: std::array::from_fn(|k| f(&|t| t.soft[k])),
            skin: self.skin.map(skin),
            tilt: self.tilt.map(tilt),
            least: f(&|t| t.least),
        }
    }
}

/// The answer to a tap, or to those of a pack; mm, N, N mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution<T = f64> {
    /// Mean strain of the gauge's fibre, in the plane of bending.
    pub strain: T,
    /// Mean strain of the centreline over the gauge.
    pub axial: T,
    /// Turn of the contact against the base, rad.
    pub turned: T,
    /// Normal force P.
    pub normal: T,
    /// Friction T.
    pub tangential: T,
    /// Contact arc c.
    pub arc: T,
    /// Base moment and forces M₀, F_x, F_y.
    pub wrench: [T; 3],
    /// Estimated error relative to the strain, or to the tap's `least` where that is larger.
    pub error: T,
    /// Largest load of a fibre; above 1 it is outside the range of the law.
    pub load: T,
    /// Number of passes over the rod.
    pub sweeps: T,
}

impl<T: Copy> Solution<T> {
    /// `f` of each number.
    pub fn map<U>(&self, f: impl Fn(T) -> U) -> Solution<U> {
        let Self { strain, axial, turned, normal, tangential, arc, wrench, error, load, sweeps } = *self;
        let wrench = wrench.map(&f);
        let [strain, axial, turned, normal, tangential, arc, error, load, sweeps] =
            [strain, axial, turned, normal, tangential, arc, error, load, sweeps].map(f);
        Solution { strain, axial, turned, normal, tangential, arc, wrench, error, load, sweeps }
    }
}

impl Solution {
    /// True if the iteration came near no equilibrium.
    pub fn is_astray(&self) -> bool {
        self.error >= ASTRAY && self.error != HOPELESS && (self.load - 1.0).abs() > EDGE
    }

    /// No equilibrium was found.
    pub const FAILED: Self = Self {
        strain: f64::NAN,
        axial: f64::NAN,
        turned: f64::NAN,
        normal: f64::NAN,
        tangential: f64::NAN,
        arc: f64::NAN,
        wrench: [f64::NAN; 3],
        error: f64::INFINITY,
        load: 0.0,
        sweeps: 0.0,
    };
}
