//! What a comparison keeps and changes: the model, the rig, the direction of the pole.

use std::sync::Arc;

use super::switch::Effect;
use crate::evaluate::Task;
use crate::scene::built::Built;
use crate::scene::{Direction, Foil, Model, Setup, Side};

/// An angle of the pole.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Aim {
    /// Of every tap as the spec says, somewhere not 0.
    Asked,
    /// 0 for every tap.
    #[default]
    Upright,
    /// This for every tap, degrees.
    All(f64),
}

impl Aim {
    /// What it makes of an angle of the spec, degrees.
    pub fn of(self, asked: f64) -> f64 {
        match self {
            Self::Asked => asked,
            Self::Upright => 0.0,
            Self::All(angle) => angle,
        }
    }

    pub(super) fn words(self) -> String {
        match self {
            Self::Asked => "as asked".into(),
            Self::Upright => "0 deg".into(),
            Self::All(angle) => format!("{angle} deg"),
        }
    }
}

/// What strain depends on besides the tuple.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Effects of the rod.
    pub model: Model,
    /// r₀, mm.
    pub hub: f64,
    /// Side of the gauge.
    pub side: Side,
    /// Tilt of the pole.
    pub tilt: Aim,
    /// Lean of the pole.
    pub lean: Aim,
    /// A foil under the grid.
    pub foil: Option<Foil>,
    /// What the whisker is beyond a cone clamped at its base.
    pub built: Option<Arc<Built>>,
    /// Whether the wrench on its root is read: some effects are known of a strain only.
    pub wrench: bool,
}

impl Setting {
    /// As the setup says, of upright poles.
    pub fn of(setup: &Setup) -> Self {
        let (tilt, lean) = (Aim::Upright, Aim::Upright);
        Self {
            model: setup.model,
            hub: setup.hub,
            side: setup.gauge.side,
            tilt,
            lean,
            foil: setup.gauge.foil,
            built: setup.built.clone(),
            wrench: setup.asks_wrench(),
        }
    }

    /// The whisker with something else about it, or the cone, if it is no more then.
    pub(super) fn rebuild(&mut self, change: impl FnOnce(&mut Built)) {
        let mut built = self.built.as_deref().cloned().unwrap_or(Built::CONE);
        change(&mut built);
        self.built = Some(built).filter(|built| *built != Built::CONE).map(Arc::new);
    }

    /// With poles as `tasks` ask for them.
    pub fn asked(self, tasks: &[Task]) -> Self {
        let aim = |angle: fn(&Task) -> f64| match tasks.iter().any(|task| angle(task) != 0.0) {
            true => Aim::Asked,
            false => Aim::Upright,
        };
        Self { tilt: aim(|task| task.direction.tilt), lean: aim(|task| task.direction.lean), ..self }
    }

    /// `task` with the pole of this setting.
    pub fn aimed(&self, task: Task) -> Task {
        let Direction { tilt, lean } = task.direction;
        Task { direction: Direction { tilt: self.tilt.of(tilt), lean: self.lean.of(lean) }, ..task }
    }

    /// The paper's theory: linear, without any effect; rig and gauge stay.
    pub fn linear(&self) -> Self {
        let mut plain = self.clone();
        Effect::all().filter(|e| !e.is_of_rig()).for_each(|e| e.switch(&mut plain, false));
        plain
    }
}
