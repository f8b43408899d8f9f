//! A design, (D, d, L_a, x_ss, l), with everything of the linear theory that its taps share.

use std::sync::Arc;

use crate::contact::Contact;
use crate::physics::{
    body::Body,
    inverse::Inverse,
    linear::{StrainCurve, shear_length2},
    solid::{Bonded, Held},
    taper::Taper,
};
use crate::scene::{
    Built, Convention, Direction, Drive, Gauge, Geometry, Setup, Side, Signal, Theory, Tuple,
};

/// Relative slack of L_a when a sum of decimal numbers is compared with it.
const ROUNDING: f64 = 1e-12;

/// Largest accepted value of any quantity, in its unit: more than a kilometre of whisker or the stiffness of diamond in Pa.
pub const MOST: f64 = 1e12;

/// One whisker with its gauge.
#[derive(Debug, Clone)]
pub struct Design {
    /// D, d, L_a, x_ss, l; distance and drive are not part of the design.
    pub tuple: Tuple,
    /// Curves that its taps share; `None` unless the numbers give a whisker with gauge and foil on it, beyond the clamp.
    pub shared: Option<Shared>,
    /// Rig of this design, if rigs differ between designs.
    pub own: Option<Arc<Setup>>,
}

/// Curves of a valid design.
#[derive(Debug, Clone)]
pub struct Shared {
    /// Cone of D, d and L_a.
    pub taper: Taper,
    /// L_a, mm.
    pub length: f64,
    /// Gauge span [x1, x2], mm.
    pub gauge: [f64; 2],
    /// Curve of linear theory whose peak is f_max; without shear for the exact rod.
    pub model: StrainCurve,
    /// Largest value of `model`.
    pub peak: f64,
    /// The estimator's curve and its inverse.
    pub theory: Inverse,
    /// A foil that stiffens the rod.
    pub foil: Option<Bonded>,
    /// Start of the free rod, mm from the face of its clamp.
    pub start: f64,
    /// Built whisker; `None` for a cone clamped at its base whose strain is read.
    pub body: Option<Arc<Body>>,
    /// Estimator of a sensor with several channels.
    pub contact: Option<Contact>,
}

impl Shared {
    /// `length` and `hub` (motor's axis behind the clamp) in mm; `peak` stands for the model's largest strain where that costs too much.
    pub fn new(
        setup: &Setup,
        (taper, length): (Taper, f64),
        body: Option<Arc<Body>>,
        (gauge, hub): ([f64; 2], f64),
        peak: Option<f64>,
    ) -> Self {
        let (nu, e0) = (setup.model.nu, setup.model.material.e0());
        let curve = |with_shear: bool| {
            let shear = if with_shear { shear_length2(&taper, nu) } else { 0.0 };
            let plain = StrainCurve::new(taper, gauge, hub, setup.drive, shear);
            body.as_ref().map_or(plain.clone(), |body| plain.built(body, setup.signal))
        };
        let of_model = setup.model.geometry == Geometry::Linear && setup.model.shear;
        let of_theory = setup.estimate.theory == Theory::Timoshenko;
        let inverse = Inverse::new(curve(of_model));
        let peak = peak.unwrap_or_else(|| inverse.peak().1);
        let model = inverse.curve().clone();
        let theory = if of_theory == of_model { inverse } else { Inverse::new(curve(of_theory)) };
        let contact = setup.channels.as_ref().map(|channels| {
            let sign = if setup.gauge.side == Side::Far { -1.0 } else { 1.0 };
            Contact::new(Arc::clone(channels), theory.curve(), [gauge[0], length], e0, sign)
        });
        let foil = setup.gauge.foil.map(|foil| Bonded::new(&foil, &taper, gauge, e0));
        let start = Held::new(&setup.model).start(&taper);
        Self { taper, length, gauge, model, peak, theory, foil, start, body, contact }
    }

    /// Largest |reading| of the gauge: the limit of the skin, seen through the foil, or the limit of the foil.
    pub fn strain_limit(&self, gauge: &Gauge) -> f64 {
        let skin = self.foil.map_or(1.0, |foil| foil.transfer) * gauge.strain_limit;
        gauge.foil.and_then(|foil| foil.strain_limit).map_or(skin, |limit| skin.min(limit))
    }

    /// `reading`, scaled so that the limit of the gauge becomes the limit of the bare skin.
    pub fn borne(&self, reading: f64, gauge: &Gauge) -> f64 {
        if self.foil.is_none() { reading } else { reading * gauge.strain_limit / self.strain_limit(gauge) }
    }

    /// The strain curve of the free rod, with places measured from the end of its clamp.
    pub fn rod(&self) -> StrainCurve {
        let StrainCurve { taper, gauge, hub, drive, shear, .. } = self.model;
        match self.start {
            0.0 => self.model.clone(),
            start => StrainCurve::new(taper.from(start), gauge.map(|x| x - start), hub + start, drive, shear),
        }
    }
}

/// True if D, d, L_a, l > 0 and at most [`MOST`], x_ss ≥ 0, x_ss + l ≤ L_a; distance and drive are ignored.
#[inline]
pub fn is_whisker(t: &Tuple) -> bool {
    let positive = [t.D, t.d, t.L_a, t.l].iter().all(|x| *x > 0.0 && *x <= MOST);
    positive && t.x_ss >= 0.0 && t.x_ss + t.l <= t.L_a * (1.0 + ROUNDING)
}

impl Design {
    /// The design of `tuple` in `setup`, or in the rig that the tuple names.
    pub fn new(setup: &Setup, tuple: Tuple) -> Self {
        let Some(rigs) = &setup.rigs else { return Self::of(setup, tuple) };
        rigs.setup(setup, tuple.rig).map_or_else(|| Self::nothing(tuple), |own| Self::with(own, tuple))
    }

    /// The design of `tuple` with the rig `own`.
    pub fn with(own: Setup, tuple: Tuple) -> Self {
        let design = Self::of(&own, tuple);
        Self { own: Some(Arc::new(own)), ..design }
    }

    /// A design whose numbers give no whisker.
    pub fn nothing(tuple: Tuple) -> Self {
        Self { tuple, shared: None, own: None }
    }

    /// r₀(a)·x, mm: place of the arc `a` of the resting whisker along its base tangent (model §7).
    pub fn abscissa(&self, a: f64) -> f64 {
        let of = |shared: &Shared| shared.body.as_ref().map_or(a, |body| body.rest(a).x);
        self.shared.as_ref().map_or(f64::NAN, of)
    }

    /// The rig of this design, or the common `setup`.
    pub fn setup<'a>(&'a self, setup: &'a Setup) -> &'a Setup {
        self.own.as_deref().unwrap_or(setup)
    }

    /// The design of `tuple` in `setup`; the rig of the tuple is ignored.
    pub fn of(setup: &Setup, tuple: Tuple) -> Self {
        let Tuple { D, L_a, x_ss, .. } = tuple;
        let held = Held::new(&setup.model).c0 * D <= x_ss;
        let whole = is_whisker(&tuple);
        let (body, gauge) = parts(setup, &tuple, whole);
        // A grid may be too short to have two ends.
        let grid = gauge[0] < gauge[1];
        let sound = body.as_ref().is_none_or(|body| body.burst().is_none());
        let carried = |shared: &Shared| {
            let whole = |span: [f64; 2]| span[0] >= -ROUNDING * L_a && span[1] <= L_a * (1.0 + ROUNDING);
            shared.foil.is_none_or(|foil| whole(foil.span))
        };
        let shared = (whole && grid && held && sound)
            .then(|| Shared::new(setup, (taper(&tuple), L_a), body, (gauge, setup.hub), None))
            .filter(carried);
        Self { tuple, shared, own: None }
    }

    /// The design of `tuple`, with its setup if that is `moved`, for numbers next to those of this one: beyond the ends of the domain, too.
    pub fn beside(&self, setup: &Setup, tuple: Tuple, moved: Option<Setup>) -> Self {
        let own = moved.map(Arc::new).or_else(|| self.own.clone());
        let setup = own.as_deref().unwrap_or(setup);
        let (body, gauge) = parts(setup, &tuple, true);
        let whisker = (taper(&tuple), tuple.L_a);
        let curves = |known: &Shared| Shared::new(setup, whisker, body, (gauge, setup.hub), Some(known.peak));
        Self { tuple, shared: self.shared.as_ref().map(curves), own }
    }

    /// Factor of K in tables with the elongation convention, mm: x2 − x1, NaN without a whisker; `None` if K has no unit.
    pub fn elongation(&self, setup: &Setup) -> Option<f64> {
        let length = |s: &Shared| s.gauge[1] - s.gauge[0];
        (setup.estimate.convention == Convention::Elongation)
            .then(|| self.shared.as_ref().map_or(f64::NAN, length))
    }

    /// True if a tap at `a` mm with `drive` (degrees or mm) lies in the domain.
    pub fn admits(&self, setup: &Setup, a: f64, drive: f64) -> bool {
        let setup = self.setup(setup);
        let touched = |shared: &Shared| {
            let StrainCurve { hub, drive, .. } = shared.model;
            let hub = (drive == Drive::Angle).then_some(hub);
            a > shared.start.max(0.0)
                && shared
                    .body
                    .as_ref()
                    .is_none_or(|body| body.refuses(a, setup.model.pole_radius, hub).is_none())
        };
        self.shared.as_ref().is_some_and(touched) && is_tap(setup.drive, &Tuple { a, drive, ..self.tuple })
    }
}

fn taper(t: &Tuple) -> Taper {
    Taper::new(t.D, t.d, t.L_a)
}

/// The built whisker of `t`, if it is one or its wrench is asked, and the span of its gauge; `whole`: its numbers give a whisker.
fn parts(setup: &Setup, t: &Tuple, whole: bool) -> (Option<Arc<Body>>, [f64; 2]) {
    let cone = || (setup.signal != Signal::Strain).then_some(&Built::CONE);
    let made = |built: &Built| Body::new(built, [t.D, t.d, t.L_a], setup.model.material.e0(), setup.model.nu);
    let body = setup.built.as_deref().or_else(cone).map(|built| Arc::new(made(built)));
    let gauge = match &body {
        Some(body) if whole => body.gauge(t.x_ss, t.l),
        _ => taper(t).gauge(t.x_ss, t.l),
    };
    (body, gauge)
}

/// True if the drive of `t` lies in its domain and the contact on the whisker; the clamp is ignored.
#[inline]
pub fn is_tap(kind: Drive, t: &Tuple) -> bool {
    let driven = match kind {
        Drive::Angle => t.drive > 0.0 && t.drive < 90.0,
        Drive::Displacement => t.drive > 0.0 && t.drive <= MOST,
    };
    driven && t.a <= t.L_a * (1.0 + ROUNDING)
}

/// Tilt β and lean γ in rad.
#[inline]
pub fn radians(direction: Direction) -> [f64; 2] {
    [direction.tilt, direction.lean].map(f64::to_radians)
}

/// cos β and cos² β of a tilt β: in linear theory the force is cos β times that at an upright pole, the gauge reads cos² β of the strain (model §6).
#[inline]
pub fn tilted(direction: Direction) -> [f64; 2] {
    let cos = radians(direction)[0].cos();
    [cos, cos * cos]
}
