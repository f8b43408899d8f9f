//! Rigs: the combinations of properties that tuples have, by their numbers.

use std::collections::HashMap;
use std::fmt::{Debug, Formatter};
use std::sync::{Mutex, PoisonError};

use super::channels::Signal;
use super::property::Property;
use super::space::Factor;
use super::{Material, Setup};

/// The combinations of properties that tuples have: rig `i` of a grid is the i-th of their crossed axes, last fastest; other rigs are listed.
pub struct Rigs {
    /// What varies, in row order.
    pub properties: Vec<Property>,
    values: Values,
}

enum Values {
    /// The factors that hold properties.
    Crossed(Vec<Factor>),
    /// The values of one rig after those of another.
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

impl Debug for Rigs {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} {:?}", self.properties, self.factors())
    }
}

impl Rigs {
    /// The rigs of a grid; `None` where no property varies.
    pub fn crossed(factors: &[Factor]) -> Option<Self> {
        let factors: Vec<Factor> = factors.iter().filter(|f| !f.properties.is_empty()).cloned().collect();
        let mut properties: Vec<Property> =
            factors.iter().flat_map(|f| &f.properties).map(|(property, _)| *property).collect();
        properties.sort_unstable();
        (!properties.is_empty()).then_some(Self { properties, values: Values::Crossed(factors) })
    }

    /// Rigs that are numbered as they come; none yet.
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
            Values::Crossed(_) => self.properties.iter().map(|p| self.value(rig, *p)).collect(),
            Values::Listed(list) => {
                let (n, at) = (self.properties.len(), rig as usize);
                let list = list.lock().unwrap_or_else(PoisonError::into_inner);
                list.values[at * n..(at + 1) * n].to_vec()
            }
        }
    }

    /// Value of `property` in rig `i`; NaN of one that does not vary.
    pub fn value(&self, rig: u64, property: Property) -> f64 {
        match &self.values {
            Values::Crossed(factors) => {
                let mut rest = rig;
                for factor in factors.iter().rev() {
                    let at = rest % factor.len;
                    rest /= factor.len;
                    if let Some((_, axis)) = factor.properties.iter().find(|(p, _)| *p == property) {
                        return axis.at(at);
                    }
                }
                f64::NAN
            }
            Values::Listed(_) => {
                let place = self.properties.iter().position(|p| *p == property);
                place.map_or(f64::NAN, |place| self.values(rig)[place])
            }
        }
    }

    /// Rig `i` of `base`; `None` where a value is none that the property may have.
    pub fn setup(&self, base: &Setup, rig: u64) -> Option<Setup> {
        let mut setup = Setup { rigs: None, ..base.clone() };
        for (property, value) in self.properties.iter().zip(self.values(rig)) {
            // The noise of a moment or a force has no upper end.
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

    /// The factors that hold properties; none of listed rigs.
    fn factors(&self) -> &[Factor] {
        match &self.values {
            Values::Crossed(factors) => factors,
            Values::Listed(_) => &[],
        }
    }

    /// How many there are.
    pub fn len(&self) -> u64 {
        match &self.values {
            Values::Crossed(factors) => factors.iter().map(|f| f.len).product(),
            Values::Listed(list) => list.lock().unwrap_or_else(PoisonError::into_inner).known.len() as u64,
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
