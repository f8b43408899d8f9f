//! Effects of the model as switches: what each is in a setup, and the two settings whose strains are compared.

use std::sync::Arc;

use serde::{Serialize, Serializer};

use super::cases::HUB;
use crate::evaluate::Task;
use crate::scene::built::{Built, Profile, Root};
use crate::scene::{
    Amount, Contact, Direction, Drive, Foil, Geometry, Material, Model, Setup, Side, TERMS, Term,
};

/// Coefficient of friction where the spec has none.
const FRICTION: f64 = 0.3;

/// Tilt or lean where the spec's poles have none, degrees.
const ANGLE: f64 = 20.0;

/// Foil where the spec has none: a gauge of a lab.
pub const FOIL: Foil = Foil { stiffness: 100.0, length: 6.3, width: 2.8, strain_limit: None };

/// Keys of effects that others ask for.
const EXTENSION: &str = "extension";
const SURFACE: &str = "surface";

/// The settings that a comparison changes: the setup and the direction of the pole.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub setup: Setup,
    /// Tilt of every pole, degrees; none where it is that of each tap, somewhere not 0.
    tilt: Option<f64>,
    /// Lean of every pole, as its tilt.
    lean: Option<f64>,
}

impl Setting {
    /// As the setup says, with poles as `directions` ask for them.
    pub fn of(setup: &Setup, directions: impl Iterator<Item = Direction> + Clone) -> Self {
        let aim = |angle: fn(Direction) -> f64| directions.clone().all(|d| angle(d) == 0.0).then_some(0.0);
        Self { setup: setup.clone(), tilt: aim(|d| d.tilt), lean: aim(|d| d.lean) }
    }

    /// What the whisker is beyond its diameters and its length.
    fn built(&self) -> Built {
        self.setup.built.as_deref().cloned().unwrap_or(Built::CONE)
    }

    /// The whisker with something else about it, or the cone, if it is no more then.
    fn rebuild(&mut self, change: impl FnOnce(&mut Built)) {
        let mut built = self.built();
        change(&mut built);
        self.setup.built = Some(built).filter(|built| *built != Built::CONE).map(Arc::new);
    }

    /// `task` with the pole of this setting.
    pub fn aimed(&self, task: Task) -> Task {
        let Direction { tilt, lean } = task.direction;
        let direction = Direction { tilt: self.tilt.unwrap_or(tilt), lean: self.lean.unwrap_or(lean) };
        Task { direction, ..task }
    }

    /// Without `effects`.
    pub fn without(&self, effects: impl IntoIterator<Item = Effect>) -> Self {
        let mut rest = self.clone();
        effects.into_iter().for_each(|e| e.switch(&mut rest, false));
        rest
    }
}

#[derive(Debug, Clone, Copy)]
pub enum Effect {
    /// The exact rod instead of the linear theory.
    Rotation,
    /// One of the rod that a key switches by itself.
    Term(&'static Term),
    /// Distance between the motor's axis and the clamp.
    Hub,
    Coulomb,
    /// A contact that does not slide.
    Stick,
    Rubber,
    /// Tilt of the pole round the whisker's axis.
    Tilt,
    /// Lean of the pole along the whisker.
    Lean,
    /// A foil that is stiffer than the skin.
    Foil,
    /// Springs between motor and whisker.
    Root,
    Curvature,
    Inner,
    Profile,
    /// The gauge on the other side: neither on nor off.
    Side,
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Effect {
    /// All, in the order in which they are reported.
    pub fn all() -> impl Iterator<Item = Self> {
        use Effect::{Coulomb, Curvature, Foil, Hub, Inner, Lean, Profile, Root, Rubber, Side, Stick, Tilt};
        let shape = [Foil, Root, Curvature, Inner, Profile, Hub];
        let rest = shape.into_iter().chain([Coulomb, Stick, Rubber, Tilt, Lean, Side]);
        [Self::Rotation].into_iter().chain(TERMS.iter().map(Self::Term)).chain(rest)
    }

    /// Those that a model may do without, in the same order.
    pub fn of_model() -> impl Iterator<Item = Self> {
        TERMS.iter().map(Self::Term).chain([Self::Coulomb, Self::Stick, Self::Rubber])
    }

    /// That of the key `[model] key`, if a key switches one by itself.
    pub fn of_key(key: &str) -> Option<Self> {
        TERMS.iter().find(|term| term.key == key).map(Self::Term)
    }

    /// True if it is of the rig, not of the model: nobody can leave it off.
    pub fn is_of_rig(self) -> bool {
        matches!(self, Self::Hub | Self::Tilt | Self::Lean | Self::Foil) || self.is_of_shape()
    }

    /// True if it is what the whisker is beyond a cone clamped at its base.
    fn is_of_shape(self) -> bool {
        matches!(self, Self::Root | Self::Curvature | Self::Inner | Self::Profile)
    }

    /// True if there is something to tell of it in `s`: nobody can say which shape a cone could have.
    pub(super) fn is_told(self, s: &Setting) -> bool {
        !self.is_of_shape() || self.is_on(s) == Some(true)
    }

    /// Its name for people, and its key of the spec.
    fn about(self) -> (&'static str, &'static str) {
        match self {
            Self::Rotation => ("finite rotation", "model.geometry"),
            Self::Term(term) => (term.name, term.key),
            Self::Hub => ("hub", "whisker.hub"),
            Self::Foil => ("foil", "gauge.foil"),
            Self::Root => ("root", "whisker.root"),
            Self::Curvature => ("rest curvature", "whisker.curvature"),
            Self::Inner => ("bore or core", "whisker.bore"),
            Self::Profile => ("profile", "whisker.profile"),
            Self::Coulomb => ("friction", "model.contact"),
            Self::Stick => ("stick", "model.contact"),
            Self::Rubber => ("rubber nonlinearity", "model.material"),
            Self::Tilt => ("tilt", "tap.tilt"),
            Self::Lean => ("lean", "tap.lean"),
            Self::Side => ("other side", "gauge.side"),
        }
    }

    pub fn name(self) -> &'static str {
        self.about().0
    }

    pub fn key(self) -> String {
        let (_, key) = self.about();
        if matches!(self, Self::Term(_)) { format!("model.{key}") } else { key.to_owned() }
    }

    /// True if the setting has it; `None` for the side, which is no effect.
    pub fn is_on(self, s: &Setting) -> Option<bool> {
        Some(match self {
            Self::Rotation => s.setup.model.geometry == Geometry::Exact,
            Self::Term(term) => (term.get)(&s.setup.model).is_on(),
            Self::Hub => s.setup.hub > 0.0,
            Self::Foil => s.setup.gauge.foil.is_some(),
            Self::Root => s.built().root != Root::RIGID,
            Self::Curvature => !s.built().is_straight(),
            Self::Inner => s.built().inner.is_some(),
            Self::Profile => s.built().profile != Profile::Power(1.0),
            Self::Coulomb => matches!(s.setup.model.contact, Contact::Coulomb(_)),
            Self::Stick => s.setup.model.contact == Contact::Stick,
            Self::Rubber => !hooke(&s.setup.model),
            Self::Tilt => s.tilt != Some(0.0),
            Self::Lean => s.lean != Some(0.0),
            Self::Side => return None,
        })
    }

    /// Switches it on at the stated value, or off; the side changes only with `on`.
    pub(super) fn switch(self, s: &mut Setting, on: bool) {
        let e0 = s.setup.model.material.e0();
        let m = &mut s.setup.model;
        match self {
            Self::Rotation => m.geometry = if on { Geometry::Exact } else { Geometry::Linear },
            Self::Term(term) => {
                (term.set)(m, if on { term.trial } else { term.trial.off() });
                // What needs it goes with it.
                let needs = |other: &&Term| other.needs.is_some_and(|(key, _)| key == term.key);
                let others = TERMS.iter().filter(needs).filter(|_| !on);
                others.for_each(|other| (other.set)(m, other.trial.off()));
            }
            Self::Foil => s.setup.gauge.foil = on.then_some(FOIL),
            // Only off: [`Self::is_told`].
            Self::Root => s.rebuild(|b| b.root = Root::RIGID),
            Self::Curvature => s.rebuild(|b| b.curvature = [0.0; 2]),
            Self::Inner => s.rebuild(|b| b.inner = None),
            Self::Profile => s.rebuild(|b| b.profile = Profile::Power(1.0)),
            Self::Hub => s.setup.hub = if on { HUB } else { 0.0 },
            Self::Coulomb if on => m.contact = Contact::Coulomb(FRICTION),
            Self::Stick if on => m.contact = Contact::Stick,
            Self::Coulomb | Self::Stick => m.contact = Contact::Frictionless,
            Self::Rubber => m.material = if on { Material::NeoHookean(e0) } else { Material::Hooke(e0) },
            Self::Tilt => s.tilt = Some(if on { ANGLE } else { 0.0 }),
            Self::Lean => s.lean = Some(if on { ANGLE } else { 0.0 }),
            Self::Side if on => {
                s.setup.gauge.side = if s.setup.gauge.side == Side::Far { Side::Contact } else { Side::Far }
            }
            Self::Side => {}
        }
    }

    /// Its value in `s`, as the spec writes it.
    pub fn value(self, s: &Setting) -> String {
        let m = &s.setup.model;
        match self {
            Self::Rotation => m.geometry.word().into(),
            Self::Term(term) => match (term.get)(m) {
                Amount::Flag(on) => on.to_string(),
                Amount::Number(x) if term.key == "pole_radius" => format!("{x} mm"),
                Amount::Number(x) => x.to_string(),
                Amount::Word(word) => word.into(),
            },
            Self::Foil => s.setup.gauge.foil.map_or("none".into(), |foil| format!("{} N/mm", foil.stiffness)),
            Self::Root => if self.is_on(s) == Some(true) { "springs" } else { "rigid" }.into(),
            Self::Curvature => format!("{} 1/mm", s.built().curvature[0]),
            Self::Inner => match &s.built().inner {
                Some(inner) => if inner.modulus > 0.0 { "core" } else { "bore" }.into(),
                None => "solid".into(),
            },
            Self::Profile => match &s.built().profile {
                Profile::Power(1.0) => "cone".into(),
                Profile::Power(n) => format!("exponent {n}"),
                Profile::Table(knots) => format!("{} knots", knots.len()),
            },
            Self::Hub => format!("{} mm", s.setup.hub),
            Self::Coulomb | Self::Stick => match m.contact {
                Contact::Frictionless => "frictionless".into(),
                Contact::Stick => "stick".into(),
                Contact::Coulomb(mu) => format!("coulomb {mu}"),
            },
            Self::Rubber => match m.material {
                Material::Hooke(_) => "hooke",
                Material::NeoHookean(_) => "neo-hookean",
                Material::MooneyRivlin(_) => "mooney-rivlin",
                Material::Yeoh(_) => "yeoh",
            }
            .into(),
            Self::Tilt | Self::Lean => {
                let angle = if self == Self::Tilt { s.tilt } else { s.lean };
                angle.map_or("as asked".into(), |angle| format!("{angle} deg"))
            }
            Self::Side => s.setup.gauge.side.word().into(),
        }
    }

    /// Why it cannot be switched in `s`, if so.
    pub(super) fn obstacle(self, s: &Setting) -> Option<String> {
        let (setup, m) = (&s.setup, &s.setup.model);
        let rubs = m.contact != Contact::Frictionless;
        let solid = |term: &Term| ["clamp", "indentation", "section"].contains(&term.key);
        let off = |term: &Term| format!("{} = {}", term.key, term.off());
        let cone = setup.built.is_none() && !setup.asks_wrench();
        let why = match self {
            Self::Foil if !cone => "computed for a cone clamped at its base",
            Self::Term(term) if !cone && solid(term) => "computed for a cone clamped at its base",
            Self::Tilt | Self::Lean if setup.asks_wrench() => "a moment or a force needs an upright pole",
            Self::Tilt | Self::Lean => return setup.forbids([true; 2]).map(str::to_owned),
            Self::Term(term) if term.frictionless.is_some() && rubs => {
                return Some(format!("friction needs {}", off(term)));
            }
            Self::Term(term) if term.key == EXTENSION && m.extension && rubs => "friction needs extension",
            Self::Term(term) if (term.get)(m).is_on() => {
                let needs = |other: &&Term| {
                    (other.get)(m).is_on() && other.needs.is_some_and(|(key, _)| key == term.key)
                };
                return TERMS.iter().find(needs).map(|other| format!("{} needs it", other.key));
            }
            Self::Foil if rubs => "friction needs a gauge without a foil",
            Self::Rubber if setup.built.as_ref().is_some_and(|built| built.is_hollow_or_cored()) => {
                "a bore or a core needs hooke"
            }
            Self::Coulomb | Self::Stick if setup.gauge.foil.is_some() => "needs a gauge without a foil",
            Self::Coulomb | Self::Stick => {
                let on = |term: &&Term| term.frictionless.is_some() && (term.get)(m).is_on();
                return TERMS.iter().find(on).map(|term| format!("needs {}", off(term)));
            }
            Self::Hub if setup.drive == Drive::Displacement => "the base does not turn",
            Self::Side if hooke(m) && !m.extension => "the sides are equal: hooke without extension",
            _ => return None,
        };
        Some(why.into())
    }

    /// What both settings of its comparison must have other than the spec, so that only it differs.
    pub(super) fn needs(self, s: &Setting) -> Vec<(Self, bool)> {
        let upright = [(Self::Tilt, false), (Self::Lean, false)];
        let mut all = match (self, self.is_on(s)) {
            (Self::Rotation, Some(true)) => {
                let linear = |e: &Self| matches!(e, Self::Term(term) if term.linear);
                let exact = Self::of_model().filter(|e| !linear(e));
                exact.chain([Self::Foil]).map(|e| (e, false)).collect()
            }
            (Self::Coulomb | Self::Stick, _) => {
                let stretch = Self::of_key(EXTENSION).map(|e| (e, true));
                [(Self::Rotation, true)].into_iter().chain(stretch).chain(upright).collect()
            }
            (Self::Term(term), _) if !term.linear => {
                let other = term.needs.and_then(|(key, _)| Self::of_key(key));
                let upright = upright.into_iter().filter(|_| term.upright.is_some());
                [(Self::Rotation, true)].into_iter().chain(other.map(|e| (e, true))).chain(upright).collect()
            }
            (Self::Foil, _) => [(Self::Rotation, true)].into_iter().chain(upright).collect(),
            (Self::Rubber, _) => vec![(Self::Rotation, true)],
            _ => vec![],
        };
        let rolls = |term: &Term| [SURFACE, "pole_radius"].contains(&term.key);
        if s.setup.model.contact == Contact::Stick && matches!(self, Self::Term(term) if rolls(term)) {
            all.extend(upright);
        }
        all.into_iter().filter(|(e, on)| e.is_on(s) != Some(*on)).collect()
    }
}

fn hooke(model: &Model) -> bool {
    matches!(model.material, Material::Hooke(_))
}
