//! Derivatives of outcomes by the inputs of taps: of the reference's closure ([`crate::physics::rod::Equilibrium`]), or of closed forms.

use std::sync::Arc;

use super::outcome::sign;
use super::{Outcome, Task};
use crate::design::Design;
use crate::physics::body::Body;
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::physics::number::Number;
use crate::physics::real::{Dual, Real};
use crate::physics::rod::{Equilibrium, INPUTS, RodProblem, RodTap, Traced, UNKNOWNS};
use crate::physics::solid::Bonded;
use crate::physics::taper::Taper;
use crate::scene::built::{Profile, Root};
use crate::scene::{
    Built, Clamp, Contact, Drive, Foil, Geometry, Material, Model, Property, Setup, Signal, Theory, Tuple,
};
use crate::status::Status;

/// Outputs with derivatives: strain, strain of linear theory, K − 1, P, T, arc, strain of the second gauge, azimuth (rad) and slide.
pub const OUTPUTS: usize = 9;

const LINEAR: usize = 1;
const DEVIATION: usize = 2;

/// An input of derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// A number of the tap, in the order of [`Tuple::to_array`].
    Tuple(usize),
    /// A property of whisker, rig or object.
    Property(Property),
    /// A modulus of a hyperelastic law, in the order of its key.
    Modulus(usize),
    /// c₀ of a clamp given as a number.
    Clamp,
    /// Length of a foil, mm.
    FoilLength,
    /// Width of a foil, mm.
    FoilWidth,
}

const NAMES: [&str; 9] = ["D", "d", "L_a", "x_ss", "l", "a", "tilt", "lean", ""];

impl Input {
    /// The input of this name in `setup`.
    ///
    /// # Errors
    /// Why the taps of `setup` have no derivative by it.
    pub fn new(setup: &Setup, name: &str) -> Result<Self, String> {
        let drive = if setup.drive == Drive::Angle { "theta" } else { "delta" };
        let input = match name {
            _ if name == drive => Self::Tuple(8),
            "C10" => Self::Modulus(0),
            "C01" | "C20" => Self::Modulus(1),
            "C30" => Self::Modulus(2),
            "clamp" => Self::Clamp,
            "foil.length" => Self::FoilLength,
            "foil.width" => Self::FoilWidth,
            _ => match NAMES.iter().position(|known| *known == name && !name.is_empty()) {
                Some(k) => Self::Tuple(k),
                None => {
                    let named = |p: &&Property| p.name() == name && **p != Property::Noise;
                    let property = Property::ALL.iter().find(named).ok_or("this is no input of a tap")?;
                    Self::Property(*property)
                }
            },
        };
        let tabled = setup.built.as_ref().is_some_and(|built| matches!(built.profile, Profile::Table(_)));
        let fits = match name {
            "C10" => matches!(setup.model.material, Material::MooneyRivlin(_) | Material::Yeoh(_)),
            "C01" => matches!(setup.model.material, Material::MooneyRivlin(_)),
            "C20" | "C30" => matches!(setup.model.material, Material::Yeoh(_)),
            "clamp" => matches!(setup.model.clamp, Clamp::At(_)),
            "tilt" | "lean" => setup.forbids([true; 2]).is_none(),
            "foil.length" | "foil.width" => setup.gauge.foil.is_some(),
            _ => match input {
                Self::Property(Property::Modulus) => {
                    matches!(setup.model.material, Material::Hooke(_) | Material::NeoHookean(_))
                }
                Self::Property(Property::Scale) => tabled,
                Self::Property(Property::Bore | Property::Core | Property::CoreModulus) => {
                    let hollow = input == Self::Property(Property::Bore);
                    let inner = setup.built.as_ref().and_then(|built| built.inner.as_ref());
                    inner.is_some_and(|inner| (inner.modulus == 0.0) == hollow)
                }
                // The direction of sliding is known only with friction.
                Self::Property(p @ Property::Friction) => p.get(setup) > 0.0,
                // Next to the tip of a cone no step that its radius needs resolves v ln v.
                Self::Property(p @ Property::Exponent) => !tabled && p.get(setup) != 1.0,
                // A curved whisker has none of model §8.
                Self::Property(Property::Curvature | Property::CurvatureSlope) => {
                    let model = &setup.model;
                    let rod = !(model.indentation || model.distorting || setup.gauge.foil.is_some());
                    rod && model.clamp == Clamp::Rigid
                }
                // A contact with friction on an edge does not roll: there the pole radius is 0.
                Self::Property(Property::PoleRadius) => {
                    let slips = matches!(setup.model.contact, Contact::Frictionless | Contact::Coulomb(0.0));
                    slips || setup.model.pole_radius > 0.0
                }
                Self::Property(p) => p.get(setup).is_finite(),
                // A profile has fixed diameters and length.
                Self::Tuple(..=2) => !tabled,
                _ => true,
            },
        };
        if fits { Ok(input) } else { Err("the model has no such input".to_owned()) }
    }
}

struct Lifted {
    /// In the order of [`Tuple::to_array`]; angles in rad.
    tap: [Traced; 9],
    hub: Traced,
    model: Model<Traced>,
    built: Option<Built<Traced>>,
    foil: Option<Foil<Traced>>,
}

impl Lifted {
    fn new(setup: &Setup, tuple: &Tuple, inputs: &[Input]) -> Self {
        let of = Traced::of;
        let mut tap = tuple.to_array().map(of);
        // Derivatives by angles are per degree.
        let angles = [true, true, setup.drive == Drive::Angle];
        for (x, _) in tap[6..].iter_mut().zip(angles).filter(|(_, angle)| *angle) {
            *x = of(x.value.to_radians());
        }
        // Derivatives by a built property of a cone: the cone as a built whisker.
        let asked = inputs.iter().any(|input| match input {
            Input::Property(p) => {
                matches!(p, Property::Exponent | Property::Curvature | Property::CurvatureSlope)
            }
            _ => false,
        });
        let built = setup.built.as_deref().or(asked.then_some(&Built::CONE));
        let foil = setup.gauge.foil.map(|foil| Foil {
            stiffness: of(foil.stiffness),
            length: of(foil.length),
            width: of(foil.width),
            strain_limit: foil.strain_limit,
        });
        let (hub, model) = (of(setup.hub), setup.model.map(of));
        let mut one = Self { tap, hub, model, built: built.map(|built| built.map(of)), foil };
        for (k, input) in inputs.iter().enumerate() {
            one.seed(*input, k, angles);
        }
        one
    }

    fn seed(&mut self, input: Input, k: usize, angles: [bool; 3]) {
        let by = |x: &mut Traced, unit: f64| x.slope[UNKNOWNS + k] = unit;
        match input {
            Input::Tuple(i) => {
                let angle = i >= 6 && angles[i - 6];
                by(&mut self.tap[i], if angle { 1_f64.to_radians() } else { 1.0 });
            }
            Input::Modulus(i) => by(&mut self.model.material.moduli()[i], 1.0),
            Input::Clamp => {
                if let Clamp::At(c0) = &mut self.model.clamp {
                    by(c0, 1.0);
                }
            }
            Input::FoilLength => self.foil.iter_mut().for_each(|foil| by(&mut foil.length, 1.0)),
            Input::FoilWidth => self.foil.iter_mut().for_each(|foil| by(&mut foil.width, 1.0)),
            Input::Property(property) => {
                let parts = (&mut self.hub, &mut self.model, self.foil.as_mut());
                let scaled = property == Property::Scale;
                property.each(parts, self.built.as_mut(), |x| by(x, if scaled { x.value } else { 1.0 }));
            }
        }
    }
}

/// Writes to `slopes` the derivatives of `numbers` of [`OUTPUTS`] by `inputs`, number by number, for the tap `task` of `design` with `outcome`; per
/// mm, degree, or unit of the key. NaN where the number has no value. At a kink (a contact about to slide or to leave the gauge) they are those of
/// the tap's side.
pub fn gradient(
    setup: &Setup,
    (design, task, outcome): (&Design, &Task, &Outcome),
    inputs: &[Input],
    numbers: &[usize],
    slopes: &mut [f64],
) {
    let setup = design.setup(setup);
    for (at, some) in inputs.chunks(INPUTS).enumerate() {
        let found = traced(setup, design, (task, outcome), some, numbers);
        for (row, number) in slopes.chunks_mut(inputs.len()).zip(numbers) {
            let row = row[at * INPUTS..].iter_mut().take(some.len());
            let slope = |i: usize| found.as_ref().map_or(f64::NAN, |found| found[*number].slope[i]);
            row.enumerate().for_each(|(i, x)| *x = slope(i));
        }
    }
}

type Sloped = Dual<INPUTS>;

#[allow(non_snake_case)]
fn traced(
    setup: &Setup,
    design: &Design,
    (task, outcome): (&Task, &Outcome),
    inputs: &[Input],
    numbers: &[usize],
) -> Option<[Sloped; OUTPUTS]> {
    let nan = Sloped::of(f64::NAN) * f64::NAN;
    let solved = !(outcome.normal_force.is_nan() || outcome.arc.is_nan());
    design.shared.as_ref()?;
    let tuple = Tuple {
        a: task.a,
        tilt: task.direction.tilt,
        lean: task.direction.lean,
        drive: task.drive,
        ..design.tuple
    };
    let lifted = Lifted::new(setup, &tuple, inputs);
    let [D, d, L_a, x_ss, l, a, tilt, lean, amount] = lifted.tap;
    let (model, hub) = (&lifted.model, lifted.hub);
    let taper = Taper::new(D, d, L_a);
    let (e, wrench) = (model.material.e0(), setup.asks_wrench() && lifted.built.is_none());
    let built = lifted.built.or(wrench.then(|| Built::CONE.map(Traced::of)));
    let body = built.map(|built| Arc::new(Body::new(&built, [D, d, L_a], e, model.nu)));
    let gauge = match &body {
        Some(body) => body.gauge(x_ss, l),
        None => taper.gauge(x_ss, l),
    };
    let slack = |shear: bool| if shear { shear_length2(&taper, model.nu) } else { Traced::of(0.0) };
    let curve = |shear: bool| {
        let plain = StrainCurve::new(taper, gauge, hub, setup.drive, slack(shear));
        match &body {
            Some(body) => plain.built(body, setup.signal),
            None => plain,
        }
    };
    let input = |x: Traced| Sloped { value: x.value, slope: std::array::from_fn(|k| x.slope[UNKNOWNS + k]) };
    let timoshenko = setup.estimate.theory == Theory::Timoshenko;
    // Linear theory of a built whisker takes as long as its rod.
    let asked = numbers.iter().any(|number| [LINEAR, DEVIATION].contains(number));
    let linear = if asked { input(amount * curve(timoshenko).value(a)) } else { nan };
    let side = sign(setup);
    if !solved {
        return Some([nan, linear * side, nan, nan, nan, nan, nan, nan, nan]);
    }
    let no_strain = outcome.status.has(Status::NO_STRAIN);
    let spatial = !outcome.azimuth.is_nan();
    let zero = Sloped::of(0.0);
    let [strain, strain_2, normal, tangential, arc, azimuth, slide] = match setup.model.geometry {
        Geometry::Linear => {
            let curve = curve(setup.model.shear);
            let (strain, normal) = (input(amount * curve.value(a)), input(amount * curve.force(e, a)));
            let arc = input(a);
            if spatial {
                let (tilt, lean) = (input(tilt), input(lean));
                let (sin, cos) = tilt.sin_cos();
                let reach = if setup.drive == Drive::Angle { input(a + hub) } else { Sloped::of(1.0) };
                let slide = input(amount) * reach * -sin / lean.sin_cos().1;
                [strain * cos * cos, strain * cos * sin, normal * cos, zero, arc, tilt, slide]
            } else {
                [strain, strain, normal, zero, arc, nan, nan]
            }
        }
        Geometry::Exact => {
            let by_direction = inputs.iter().any(|input| matches!(input, Input::Tuple(6 | 7)));
            let at = Equilibrium {
                force: [outcome.normal_force, outcome.tangential_force],
                arc: outcome.arc,
                sticking: outcome.sticking,
                azimuth: (by_direction || !task.direction.is_upright()).then_some(if spatial {
                    outcome.azimuth
                } else {
                    0.0
                }),
                second: setup.gauge.second,
                deviation: numbers.contains(&DEVIATION),
            };
            let bonded = |foil: Foil<Traced>| Bonded::new(&foil, &taper, gauge, e);
            let problem = RodProblem {
                taper,
                gauge,
                side: setup.gauge.side,
                distance: a,
                hub,
                drive: setup.drive,
                amount,
                foil: lifted.foil.map(bonded),
                body: body.as_deref().filter(|_| !wrench),
                model,
            };
            let shown = problem.trace([tilt, lean], &at).ok()?;
            let of = |x: [f64; 1 + INPUTS]| Sloped { value: x[0], slope: std::array::from_fn(|k| x[1 + k]) };
            // Readings are signed as on the contact side.
            let wrench = shown.tap.wrench.map(of);
            let wrench = match &body {
                Some(body) if setup.fixed => {
                    let Root { k_theta, k_y, k_x } = body.built.root;
                    let root = Root { k_theta: input(k_theta), k_y: input(k_y), k_x: input(k_x) };
                    root.about_rest(wrench)
                }
                _ => wrench,
            };
            let read = match setup.signal {
                Signal::Strain => of(shown.tap.strain),
                Signal::Moment => wrench[0],
                Signal::Force => wrench[2],
            };
            let (azimuth, slide) = if spatial { (of(shown.azimuth), of(shown.slide)) } else { (nan, nan) };
            let RodTap { normal_force, tangential_force, contact_arc, .. } = shown.tap;
            let [normal, tangential, arc] = [normal_force, tangential_force, contact_arc].map(of);
            [read * side, of(shown.strain_2) * side, normal, tangential, arc, azimuth, slide]
        }
    };
    let second = setup.gauge.second;
    let deviation = match second {
        _ if no_strain => nan,
        // Linear theories differ by shear only.
        _ if setup.model.geometry == Geometry::Linear && body.is_none() => {
            let softer = |shear: bool| input(slack(shear) / (a * a) + 1.0);
            softer(setup.model.shear) / softer(timoshenko) - 1.0
        }
        false => linear / strain - 1.0,
        true => linear * strain / (strain * strain + strain_2 * strain_2) - 1.0,
    };
    let shown = |x: Sloped| if no_strain { zero } else { x * side };
    let strain_2 = if second { shown(strain_2) } else { nan };
    Some([shown(strain), linear * side, deviation, normal, tangential, arc, strain_2, azimuth, slide])
}
