//! The whisker on its rig, for calibrate, locate and simulate, and its contact point: on its surface or, if the model says so, on its centreline.

use crate::measure::{Data, names::Channel};
use crate::physics::linear::{StrainCurve, shear_length2};
use crate::scene::{Drive, Output, Setup, Signal, Space, Spec, Study, Theory, Tuple};
use crate::{design::Design, error::InputError, physics::taper::Taper};

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
    /// Errors: Numbers that give no whisker with a gauge.
    pub fn new(mut setup: Setup, tuple: Tuple) -> Result<Self, InputError> {
        setup.directions = [false; 2];
        let design = Design::new(&setup, tuple);
        if design.shared.is_none() {
            let error = InputError::new("these numbers are no whisker with a gauge on it").key("whisker");
            return Err(error.allowed("D, d, L_a, l > 0, x_ss ≥ 0, x_ss + l ≤ L_a"));
        }
        Ok(Self { setup, design, known: true, before: 0.0, warnings: Vec::new() })
    }

    /// A rig with an unknown whisker, tapped up to `furthest` mm: a uniform rod with the gauge at its base, of which only ε ∝ 1/a is used.
    /// Errors: a distance that is not positive.
    pub fn unknown(setup: Setup, furthest: f64) -> Result<Self, InputError> {
        let L_a = 2.0 * furthest;
        let (D, l) = (0.1 * L_a, 1e-6 * L_a);
        let tuple = Tuple { D, d: D, L_a, x_ss: 0.0, l, a: furthest, drive: 1.0, ..Tuple::default() };
        Ok(Self { known: false, ..Self::new(setup, tuple)? })
    }

    /// [`Self::unknown`] for `data`, with `drive` if they do not say; and a spec of it.
    /// Errors: Data without a distance.
    pub fn of_data(data: &Data, drive: Option<Drive>) -> Result<(Self, Spec), InputError> {
        let setup = Setup { drive: drive.unwrap_or(Drive::Angle), ..Setup::default() };
        let rig = Self::unknown(setup.clone(), data.furthest()?)?;
        let space = Space::List([rig.design.tuple].into_iter().collect());
        let study = Study { setup, space, output: Output::default() };
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

/// Contact point: word, whether it is on the surface, and a description.
pub const PLACES: [(&str, bool, &str); 2] =
    [("surface", true, "its side"), ("centreline", false, "its axis")];

/// Quantities of a calibrated whisker that determine the contact point. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin {
    taper: Taper,
    /// r₀, distance of the motor's axis behind the clamp.
    hub: f64,
    /// True for contact on the surface.
    pub surface: bool,
    /// ρ of the pole that the calibration's model taps.
    pole: f64,
    /// S of shear, mm².
    shear: f64,
}

impl Skin {
    /// Describes a calibrated whisker; `surface` overrides the model's contact point.
    pub fn new(rig: &Rig, surface: Option<bool>) -> Self {
        let (t, model) = (rig.design.tuple, &rig.setup.model);
        let taper = if rig.known { rig.shared().taper } else { Taper::new(t.D, t.D, t.L_a) };
        Self {
            taper,
            hub: rig.setup.hub,
            surface: rig.known && surface.unwrap_or(model.surface),
            pole: model.pole_radius,
            shear: if model.shear { shear_length2(&taper, model.nu) } else { 0.0 },
        }
    }

    /// Refuses a whisker other than a cone clamped at its base: its contact point is not known.
    pub fn is_known(rig: &Rig) -> Result<(), InputError> {
        if rig.setup.built.is_none() {
            return Ok(());
        }
        let error =
            InputError::new("the places that a whisker touches are known of a cone clamped at its base");
        Err(error.key("whisker").value("more than a cone").allowed("D, d, L_a and hub only"))
    }

    /// Height of the contact at `a`, and sin and cos of its slope.
    fn touched(&self, a: f64) -> [f64; 3] {
        self.taper.touched(a, self.surface)
    }

    /// The point at distance a that touches first, in the frame of first touch, mm.
    pub fn place(&self, a: f64) -> [f64; 2] {
        [a + self.hub, self.touched(a)[0]]
    }

    /// d place/da.
    pub fn slope(&self) -> [f64; 2] {
        [1.0, if self.surface { -self.taper.tan_alpha } else { 0.0 }]
    }

    /// The distance whose point of first touch is `r` mm from the motor's axis, or NaN.
    pub fn distance(&self, r: f64) -> f64 {
        let [at, slope] = [self.place(0.0), self.slope()];
        // |at + a slope| = r.
        let (s2, b, c) = (slope[0].hypot(slope[1]).powi(2), at[0] + at[1] * slope[1], at[0].hypot(at[1]));
        let d = b * b - s2 * (c * c - r * r);
        (d.sqrt() - b) / s2
    }

    /// Direction of the contact's section, rad, relative to first touch, after a turn by `turn`: linear theory's slope at the contact is
    /// (3 − 2τa)/(2(1 − τa)) of the chord's, of which bending makes 1/(1 + S/a²).
    fn direction(&self, a: f64, turn: f64) -> f64 {
        let v = self.taper.tau * a;
        let chord = (a + self.hub) / a / (1.0 + self.shear / (a * a));
        turn * (1.0 - chord * (3.0 - 2.0 * v) / (2.0 * (1.0 - v)))
    }

    /// Contact normal n at `turn`, towards the object, in the frame of first touch.
    fn normal(&self, a: f64, turn: f64) -> [f64; 2] {
        let (sin, cos) = self.direction(a, turn).sin_cos();
        let [_, s, c] = self.touched(a);
        [s * cos - c * sin, s * sin + c * cos]
    }

    /// The contact point after a turn by `turn` rad since first touch at a: the pole's centre stays, the contact moves around it.
    pub fn contact(&self, a: f64, turn: f64) -> [f64; 2] {
        let ([x, y], n, [_, s, c]) = (self.place(a), self.normal(a, turn), self.touched(a));
        [x + self.pole * (s - n[0]), y + self.pole * (c - n[1])]
    }

    /// d(turn)/dθ − 1 per d(a)/dθ, 1/mm, for a contact that moves along an object as along a pole at changing a: n·d(pole's centre) = 0.
    pub fn creep(&self, a: f64, turn: f64) -> f64 {
        let ([x, y], n, [_, s, c]) = (self.place(a), self.normal(a, turn), self.touched(a));
        let centre = [x + self.pole * s, y + self.pole * c];
        let slope = self.slope();
        (n[0] * slope[0] + n[1] * slope[1]) / (n[1] * centre[0] - n[0] * centre[1])
    }
}
