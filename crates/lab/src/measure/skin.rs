//! The contact point of the whisker: on its surface or, if the model says so, on its centreline.

use super::Rig;
use crate::error::InputError;
use crate::physics::linear::shear_length2;
use crate::physics::taper::Taper;

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
