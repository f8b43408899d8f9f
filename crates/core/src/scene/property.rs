//! Properties of whisker, rig and object that may differ between designs, in addition to the columns of a tuple.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use super::built::{Built, Inner, Profile};
use super::channels::Signal;
use super::model::Contact;
use super::space::Factor;
use super::{Interval, Material, Setup};
use crate::design::MOST;

/// Number of properties.
pub const PROPERTIES: usize = 17;

/// The properties in row order: name, column, section, key, unit, meaning, and allowed values in words and as an interval.
macro_rules! properties {
    ($($name:ident: [$column:literal, $section:literal, $key:literal, $unit:literal, $what:literal],
       $allowed:literal, $ends:expr, $open:expr;)+) => {
        /// A property, in row order: after l, before a.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Property {
            $(#[doc = $what] $name,)+
        }

        impl Property {
            /// All, in row order.
            pub const ALL: [Self; PROPERTIES] = [$(Self::$name),+];
        }

        /// All, in the order of [`Property::ALL`].
        const DESCRIPTIONS: [Description; PROPERTIES] = [$(Description {
            column: $column,
            section: $section,
            key: $key,
            unit: $unit,
            what: $what,
            allowed: $allowed,
            range: Interval::new($ends, $open),
        }),+];
    };
}

/// Description of a property.
#[derive(Debug)]
pub struct Description {
    /// Column of tables and tuple files.
    pub column: &'static str,
    /// Section of its key.
    pub section: &'static str,
    /// Its key there, `core.diameter` for one in an inline table.
    pub key: &'static str,
    /// Unit; empty if it has none.
    pub unit: &'static str,
    /// Meaning, in a few words.
    pub what: &'static str,
    /// Allowed values, in words.
    pub allowed: &'static str,
    /// Allowed values.
    pub range: Interval,
}

properties! {
    Exponent: ["exponent", "whisker", "exponent", "", "n of D(s) = d + (D − d)(1 − s/L_a)ⁿ"],
        "0.25 … 4 (1: the cone)", [0.25, 4.0], [false; 2];
    Scale: ["scale", "whisker", "scale", "", "factor of the profile's diameters"],
        "0 < scale ≤ 1000", [0.0, 1e3], [true, false];
    Bore: ["bore_mm", "whisker", "bore", "mm", "diameter of the bore"],
        "≥ 0 mm (0: none)", [0.0, MOST], [false; 2];
    Core: ["core_mm", "whisker", "core.diameter", "mm", "diameter of the core"],
        "≥ 0 mm (0: none)", [0.0, MOST], [false; 2];
    CoreModulus: ["E_core_MPa", "whisker", "core.modulus", "MPa", "modulus of the core"],
        "0 < modulus < 10000000 MPa (nitinol 60000, steel 200000)", [0.0, 1e7], [true; 2];
    Curvature: ["kappa_base_per_mm", "whisker", "curvature", "1/mm", "curvature at rest κ_base"],
        "-1 … 1 per mm", [-1.0, 1.0], [false; 2];
    CurvatureSlope: ["kappa_slope_per_mm2", "whisker", "curvature_slope", "1/mm²",
        "its growth along the whisker κ_slope"],
        "-1 … 1 per mm²", [-1.0, 1.0], [false; 2];
    Turn: ["k_theta_Nmm_per_rad", "whisker", "root.k_theta", "N mm/rad",
        "stiffness of the root against turning"],
        "> 0 N mm/rad", [0.0, MOST], [true, false];
    Across: ["k_y_N_per_mm", "whisker", "root.k_y", "N/mm", "stiffness of the root across the whisker"],
        "> 0 N/mm", [0.0, MOST], [true, false];
    Along: ["k_x_N_per_mm", "whisker", "root.k_x", "N/mm", "stiffness of the root along the whisker"],
        "> 0 N/mm", [0.0, MOST], [true, false];
    Hub: ["hub_mm", "whisker", "hub", "mm", "distance of the motor's axis behind the clamp r₀"],
        "≥ 0 mm", [0.0, MOST], [false; 2];
    Modulus: ["E_MPa", "model", "material", "MPa", "E of a hooke material, E₀ of a neo-hookean one"],
        "> 0 MPa", [0.0, MOST], [true, false];
    Nu: ["nu", "model", "nu", "", "Poisson's ratio ν"],
        "0 … 0.5", [0.0, 0.5], [false; 2];
    PoleRadius: ["pole_radius_mm", "model", "pole_radius", "mm", "radius of the object ρ"],
        "≥ 0 mm", [0.0, MOST], [false; 2];
    Friction: ["mu", "model", "contact.coulomb", "", "coefficient of friction μ"],
        "≥ 0", [0.0, MOST], [false; 2];
    Foil: ["foil_N_per_mm", "gauge", "foil.stiffness", "N/mm",
        "stiffness of the foil, modulus times thickness"],
        "0 < stiffness < 50000 N/mm (modulus times thickness: 3000 MPa of 0.033 mm are 100 N/mm)",
        [0.0, 5e4], [true; 2];
    Noise: ["noise", "gauge", "noise_strain", "",
        "standard deviation of one reading: strain, or N mm or N of a moment or a force"],
        "≥ 0 and < 0.5 (strain, one standard deviation; 15 microstrain are 15e-6; 0: none)",
        [0.0, 0.5], [false, true];
}

impl Property {
    /// Its description.
    pub const fn about(self) -> &'static Description {
        &DESCRIPTIONS[self as usize]
    }

    /// Its name in `[optimise]`: its key, but `E` for the modulus of the material and `mu` for friction.
    pub fn name(self) -> &'static str {
        match self {
            Self::Modulus => "E",
            Self::Friction => "mu",
            _ => self.about().key,
        }
    }

    /// Its value in `setup`; for a bore or a core that at the base.
    pub fn get(self, setup: &Setup) -> f64 {
        let mut built = setup.built.as_deref().cloned().unwrap_or(Built::CONE);
        let bored = built.inner.as_ref().map(|inner| inner.modulus == 0.0);
        match self {
            Self::Scale => return 1.0,
            Self::Bore | Self::Core if bored != Some(self == Self::Bore) => return 0.0,
            Self::CoreModulus if bored == Some(true) => return f64::NAN,
            Self::Modulus => return setup.model.material.e0(),
            Self::Noise => return setup.gauge.noise_strain.unwrap_or(0.0),
            _ => {}
        }
        let mut found = None;
        self.each(&mut setup.clone(), Some(&mut built), |x| _ = found.get_or_insert(*x));
        found.unwrap_or(f64::NAN)
    }

    /// Gives it a value in `setup`.
    pub fn set(self, setup: &mut Setup, value: f64) {
        let mut built = setup.built.as_deref().cloned().unwrap_or(Built::CONE);
        let modulus = built.inner.as_ref().map(|inner| inner.modulus);
        match self {
            Self::Noise => setup.gauge.noise_strain = Some(value),
            Self::Friction => setup.model.contact = Contact::Coulomb(value),
            Self::Exponent => built.profile = Profile::Power(value),
            Self::Bore | Self::Core if value > 0.0 => {
                // A bore has no modulus; that of a new core is set next.
                let of_core = modulus.filter(|modulus| *modulus != 0.0).unwrap_or(f64::NAN);
                let modulus = if self == Self::Bore { 0.0 } else { of_core };
                built.inner = Some(Inner { modulus, diameter: vec![[0.0, value], [MOST, value]] });
            }
            Self::Bore | Self::Core if (modulus == Some(0.0)) == (self == Self::Bore) => built.inner = None,
            Self::Bore | Self::Core => {}
            Self::CoreModulus if modulus == Some(0.0) => {}
            Self::Modulus if setup.model.material.moduli().len() > 1 => {}
            _ => self.each(setup, Some(&mut built), |x| {
                *x = if self == Self::Scale { *x * value } else { value };
            }),
        }
        setup.built = Some(built).filter(|built| *built != Built::CONE).map(Into::into);
    }

    /// Calls `f` with every number of a setup that is this property.
    pub fn each(self, setup: &mut Setup, built: Option<&mut Built>, mut f: impl FnMut(&mut f64)) {
        let Setup { hub, model, gauge, .. } = setup;
        let one = match self {
            Self::Hub => hub,
            Self::Modulus => &mut model.material.moduli()[0],
            Self::Nu => &mut model.nu,
            Self::PoleRadius => &mut model.pole_radius,
            Self::Friction => match &mut model.contact {
                Contact::Coulomb(mu) => mu,
                Contact::Frictionless | Contact::Stick => return,
            },
            Self::Foil => match &mut gauge.foil {
                Some(foil) => &mut foil.stiffness,
                None => return,
            },
            _ => match (self, built) {
                (Self::Exponent, Some(Built { profile: Profile::Power(n), .. })) => n,
                (Self::Scale, Some(Built { profile: Profile::Table(knots), .. }))
                | (Self::Bore | Self::Core, Some(Built { inner: Some(Inner { diameter: knots, .. }), .. })) =>
                {
                    return knots.iter_mut().for_each(|[_, diameter]| f(diameter));
                }
                (Self::CoreModulus, Some(Built { inner: Some(Inner { modulus, .. }), .. })) => modulus,
                (Self::Curvature, Some(built)) => &mut built.curvature[0],
                (Self::CurvatureSlope, Some(built)) => &mut built.curvature[1],
                (Self::Turn, Some(built)) => &mut built.root.k_theta,
                (Self::Across, Some(built)) => &mut built.root.k_y,
                (Self::Along, Some(built)) => &mut built.root.k_x,
                _ => return,
            },
        };
        f(one);
    }
}

/// The combinations of properties that tuples have: rig `i` of a grid is the i-th of their crossed axes, last fastest; other rigs are listed.
pub struct Rigs {
    /// The properties that vary, in row order.
    pub properties: Vec<Property>,
    values: Values,
}

enum Values {
    Crossed(Vec<Factor>),
    Listed(Mutex<List>),
}

#[derive(Default)]
struct List {
    values: Vec<f64>,
    known: HashMap<Vec<u64>, u64>,
}

impl PartialEq for Rigs {
    fn eq(&self, other: &Self) -> bool {
        self.properties == other.properties && self.factors() == other.factors()
    }
}

/// The identity of a sweep is a hash of this text: it holds the properties and the factors, not the order in which listed rigs were added.
impl std::fmt::Debug for Rigs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} {:?}", self.properties, self.factors())
    }
}

impl Rigs {
    /// Names of the properties that differ, separated by commas.
    pub fn names(&self) -> String {
        self.properties.iter().map(|property| property.name()).collect::<Vec<_>>().join(", ")
    }

    /// The rigs of a grid; `None` if no property varies.
    pub fn crossed(factors: &[Factor]) -> Option<Self> {
        let factors: Vec<Factor> = factors.iter().filter(|f| !f.properties.is_empty()).cloned().collect();
        let mut properties: Vec<Property> =
            factors.iter().flat_map(|f| &f.properties).map(|(property, _)| *property).collect();
        properties.sort_unstable();
        (!properties.is_empty()).then_some(Self { properties, values: Values::Crossed(factors) })
    }

    /// Rigs that [`Self::number`] adds one by one.
    pub fn listed(properties: Vec<Property>) -> Self {
        Self { properties, values: Values::Listed(Mutex::default()) }
    }

    /// The number of the listed rig with these values.
    pub fn number(&self, values: &[f64]) -> u64 {
        let Values::Listed(list) = &self.values else { return 0 };
        let mut list = list.lock().unwrap_or_else(PoisonError::into_inner);
        let List { values: all, known } = &mut *list;
        let next = known.len() as u64;
        let bits = values.iter().map(|x| (x + 0.0).to_bits()).collect();
        let number = *known.entry(bits).or_insert(next);
        if number == next {
            all.extend(values);
        }
        number
    }

    /// Values of rig `i`, in the order of `properties`.
    pub fn values(&self, rig: u64) -> Vec<f64> {
        match &self.values {
            Values::Crossed(factors) => {
                let (mut rest, mut all) = (rig, Vec::new());
                for factor in factors.iter().rev() {
                    all.extend(factor.properties.iter().map(|(p, axis)| (*p, axis.at(rest % factor.len))));
                    rest /= factor.len;
                }
                all.sort_unstable_by_key(|(property, _)| *property);
                all.into_iter().map(|(_, value)| value).collect()
            }
            Values::Listed(list) => {
                let (n, at) = (self.properties.len(), rig as usize);
                let list = list.lock().unwrap_or_else(PoisonError::into_inner);
                list.values[at * n..(at + 1) * n].to_vec()
            }
        }
    }

    /// Value of `property` in rig `i`; NaN if it does not vary.
    pub fn value(&self, rig: u64, property: Property) -> f64 {
        let place = self.properties.iter().position(|p| *p == property);
        place.map_or(f64::NAN, |place| self.values(rig)[place])
    }

    /// Rig `i` of `base`; `None` if a value is not allowed or values exclude each other.
    pub fn setup(&self, base: &Setup, rig: u64) -> Option<Setup> {
        let mut setup = Setup { rigs: None, ..base.clone() };
        for (property, value) in self.properties.iter().zip(self.values(rig)) {
            // The noise of a moment or a force has no upper limit.
            let other = *property == Property::Noise && setup.signal != Signal::Strain && value >= 0.0;
            if !(other || property.about().range.holds(value)) {
                return None;
            }
            property.set(&mut setup, value);
        }
        let doubled = [Property::Bore, Property::Core].iter().all(|p| self.value(rig, *p) > 0.0);
        let solid = matches!(setup.model.material, Material::Hooke(_))
            || setup.built.as_ref().is_none_or(|built| !built.is_hollow_or_cored());
        let sinks = setup.model.indentation && setup.model.pole_radius == 0.0;
        Some(setup).filter(|_| !doubled && !sinks && solid)
    }

    fn factors(&self) -> &[Factor] {
        match &self.values {
            Values::Crossed(factors) => factors,
            Values::Listed(_) => &[],
        }
    }

    /// Number of rigs.
    pub fn count(&self) -> u64 {
        match &self.values {
            Values::Crossed(factors) => factors.iter().map(|f| f.len).product(),
            Values::Listed(list) => list.lock().unwrap_or_else(PoisonError::into_inner).known.len() as u64,
        }
    }
}
