//! The whisker on its rig, for calibrate, locate and simulate.

use crate::design::Design;
use crate::error::InputError;
use crate::measure::Data;
use crate::measure::names::Channel;
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::scene::{Drive, Output, Setup, Signal, Space, Spec, Study, Theory, Tuple};

/// A whisker with its gauge and model.
#[derive(Debug, Clone)]
pub struct Rig {
    /// Settings shared by all taps.
    pub setup: Setup,
    /// The whisker; its distance and drive are unused.
    pub design: Design,
    /// False if nothing is known of the whisker; see [`Self::unknown`].
    pub known: bool,
    /// Travel of the drive before contact, in its unit: the largest possible offset of the drive.
    pub before: f64,
    /// Warnings about the spec file.
    pub warnings: Vec<String>,
}

#[allow(non_snake_case)]
impl Rig {
    /// The whisker of `tuple`, whose distance and drive are unused.
    ///
    /// # Errors
    /// Numbers that give no whisker with a gauge.
    pub fn new(mut setup: Setup, tuple: Tuple) -> Result<Self, InputError> {
        setup.directions = [false; 2];
        let design = Design::new(&setup, tuple);
        match design.shared {
            Some(_) => Ok(Self { setup, design, known: true, before: 0.0, warnings: Vec::new() }),
            None => Err(InputError::new("these numbers are no whisker with a gauge on it")
                .key("whisker")
                .allowed("D, d, L_a, l > 0, x_ss ≥ 0, x_ss + l ≤ L_a")),
        }
    }

    /// A rig with an unknown whisker, tapped up to `furthest` mm: a uniform rod with the gauge at its base, of which only ε ∝ 1/a is used.
    ///
    /// # Errors
    /// A distance that is not positive.
    pub fn unknown(setup: Setup, furthest: f64) -> Result<Self, InputError> {
        let L_a = 2.0 * furthest;
        let (D, l) = (0.1 * L_a, 1e-6 * L_a);
        let tuple = Tuple { D, d: D, L_a, x_ss: 0.0, l, a: furthest, drive: 1.0, ..Tuple::default() };
        Ok(Self { known: false, ..Self::new(setup, tuple)? })
    }

    /// [`Self::unknown`] for `data`, with `drive` if they do not say; and a spec of it.
    ///
    /// # Errors
    /// Data without a distance.
    pub fn of_data(data: &Data, drive: Option<Drive>) -> Result<(Self, Spec), InputError> {
        let setup = Setup { drive: drive.unwrap_or(Drive::Angle), ..Setup::default() };
        let rig = Self::unknown(setup.clone(), data.furthest()?)?;
        let study = Study {
            setup,
            space: Space::List([rig.design.tuple].into_iter().collect()),
            output: Output::default(),
        };
        Ok((rig, Spec::of("no whisker", study)))
    }

    /// The single whisker of `spec`; `label` names the spec in messages.
    pub fn of_spec(spec: &Spec, label: &str) -> Result<Self, InputError> {
        spec.one_rig()?;
        let tuple = spec.study.space.whisker().map_err(|several| match several {
            Some((column, n)) => {
                let names = ["whisker.D", "whisker.d", "whisker.L_a", "gauge.x_ss", "gauge.l"];
                let error =
                    InputError::new("a rig has one whisker: one value for each of D, d, L_a, x_ss, l");
                let error = error.at(label, None).key(names[column as usize]);
                error.value(format!("{n} values")).allowed("one number")
            }
            None => {
                let message = "the whisker comes from [whisker] and [gauge], not from a tuple file";
                let error = InputError::new(message).at(label, None).key("tuples.file");
                error.allowed("D, d, L_a, x_ss, l as one number each")
            }
        })?;
        let rig = Self::new(spec.study.setup.clone(), tuple).map_err(|e| e.at(label, None))?;
        Ok(Self { warnings: spec.warnings.clone(), ..rig })
    }

    /// Refuses a sensor of several channels.
    pub fn of_one_signal(&self) -> Result<(), InputError> {
        let Some(channels) = &self.setup.channels else { return Ok(()) };
        let error = InputError::new("this reads one signal of a whisker");
        let error = error.key("sensor").value(format!("{} channels", channels.rows.len()));
        Err(error.allowed("signal = \"strain\", \"moment\" or \"force\" in [sensor] of the spec"))
    }

    /// The rig seen by channel `k`, and the column to read: the whisker with one signal, or an unknown rig if the channel mixes signals.
    pub fn of_channel(&self, k: usize, furthest: f64) -> Result<(Self, Channel), InputError> {
        let Some(channels) = &self.setup.channels else {
            return Ok((self.clone(), Channel::Of(self.setup.signal)));
        };
        let (row, name) = (&channels.rows[k], channels.names[k][0]);
        let signal = match row.map(|x| x != 0.0) {
            [true, false, false, false] => Some(Signal::Moment),
            [false, false, true, false] => Some(Signal::Force),
            [false, false, false, true] => Some(Signal::Strain),
            _ => None,
        };
        let column = match signal {
            Some(signal) if !channels.is_matrix() => Channel::Of(signal),
            _ => Channel::Named(name),
        };
        let Some(signal) = signal else {
            let setup = Setup { drive: self.setup.drive, ..Setup::default() };
            return Ok((Self::unknown(setup, furthest)?, column));
        };
        let mut setup = Setup { channels: None, signal, ..self.setup.clone() };
        setup.gauge.noise_strain = None;
        if signal != Signal::Strain {
            setup.gauge.strain_limit = f64::INFINITY;
        }
        Ok((Self { warnings: self.warnings.clone(), ..Self::new(setup, self.design.tuple)? }, column))
    }

    /// Closed form of a theory for this whisker, with the hub `hub`, mm.
    pub fn curve(&self, theory: Theory, hub: f64) -> StrainCurve {
        let shared = self.shared();
        let shear = match theory {
            Theory::EulerBernoulli | Theory::Exact => 0.0,
            Theory::Timoshenko => shear_length2(&shared.taper, self.setup.model.nu),
        };
        let curve = StrainCurve::new(shared.taper, shared.gauge, hub, self.setup.drive, shear);
        match &shared.body {
            Some(body) => curve.built(body, self.setup.signal),
            None => curve,
        }
    }

    /// Largest |strain| that the gauge allows.
    pub fn strain_limit(&self) -> f64 {
        self.shared().strain_limit(&self.setup.gauge)
    }

    /// Curves of the whisker.
    pub fn shared(&self) -> &crate::design::Shared {
        self.design.shared.as_ref().expect("checked when the rig was made")
    }

    /// Factor of K in tables: 1, or x2 − x1 (mm) for elongation.
    pub fn k_unit(&self) -> f64 {
        self.design.elongation(&self.setup).unwrap_or(1.0)
    }
}
