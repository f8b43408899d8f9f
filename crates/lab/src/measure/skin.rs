//! Which place of the whisker touches: on its surface or, where the model has it there, on its centreline.

use super::Rig;
use crate::error::InputError;
use crate::physics::linear::shear_length2;
use crate::physics::taper::Taper;

/// Which place of a whisker touches: words, whether it is on the surface, and what to say of them.
pub const PLACES: [(&str, bool, &str); 2] =
    [("surface", true, "its side"), ("centreline", false, "its axis")];

/// What of a calibrated whisker a contact's place depends on. Lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin {
    taper: Taper,
    /// r₀ of the motor's axis behind the clamp.
    hub: f64,
    /// Contact on the surface.
    surface: bool,
    /// ρ of the pole that the calibration's model taps.
    pole: f64,
    /// S of shear, mm².
    shear: f64,
}

impl Skin {
    /// Of the whisker of a calibration, with contact on the `surface`, on the centreline, or as its model says.
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

    /// Refuses a whisker that is no cone clamped at its base: where it touches is not known here.
    pub fn is_known(rig: &Rig) -> Result<(), InputError> {
        if rig.setup.built.is_none() {
            return Ok(());
        }
        let error =
            InputError::new("the places that a whisker touches are known of a cone clamped at its base");
        Err(error.key("whisker").value("more than a cone").allowed("D, d, L_a and hub only"))
    }

    /// Whether contact is on the surface.
    pub fn on_surface(&self) -> bool {
        self.surface
    }

    /// Radius at a, mm: how far the surface is from the centreline.
    pub fn radius(&self, a: f64) -> f64 {
        self.taper.radius(a)
    }

    fn alpha(&self) -> (f64, f64) {
        if self.surface { (self.taper.sin_alpha(), self.taper.cos_alpha()) } else { (0.0, 1.0) }
    }

    /// The place that touches first at distance a, in the frame of first touch.
    pub fn place(&self, a: f64) -> [f64; 2] {
        [a + self.hub, if self.surface { self.taper.radius(a) } else { 0.0 }]
    }

    /// d place/da.
    pub fn slope(&self) -> [f64; 2] {
        [1.0, if self.surface { -self.taper.tan_alpha } else { 0.0 }]
    }

    /// The distance whose place of first touch is `r` from the motor's axis; NaN where there is none.
    pub fn distance(&self, r: f64) -> f64 {
        let [at, slope] = [self.place(0.0), self.slope()];
        // |at + a slope| = r.
        let (s2, b, c) = (slope[0].hypot(slope[1]).powi(2), at[0] + at[1] * slope[1], at[0].hypot(at[1]));
        let d = b * b - s2 * (c * c - r * r);
        (d.sqrt() - b) / s2
    }

    /// Direction of the contact's section, rad, against that of the whisker at first touch, when it has turned by `turn` since: with linear
    /// theory's slope at the contact, (3 − 2τa)/(2(1 − τa)) of the chord's, whose share by bending is 1/(1 + S/a²).
    fn direction(&self, a: f64, turn: f64) -> f64 {
        let v = self.taper.tau * a;
        let chord = (a + self.hub) / a / (1.0 + self.shear / (a * a));
        turn * (1.0 - chord * (3.0 - 2.0 * v) / (2.0 * (1.0 - v)))
    }

    /// Direction n of the contact normal at `turn`, towards the object, in the frame of first touch.
    fn normal(&self, a: f64, turn: f64) -> [f64; 2] {
        let (sin, cos) = self.direction(a, turn).sin_cos();
        let (s, c) = self.alpha();
        [s * cos - c * sin, s * sin + c * cos]
    }

    /// Where whisker and pole touch when the whisker has turned by `turn` (rad) since first touch at a: the pole's centre is where it
    /// was, the contact goes round it.
    pub fn contact(&self, a: f64, turn: f64) -> [f64; 2] {
        let ([x, y], n, (s, c)) = (self.place(a), self.normal(a, turn), self.alpha());
        [x + self.pole * (s - n[0]), y + self.pole * (c - n[1])]
    }

    /// d(turn)/dθ − 1 per d(a)/dθ (1/mm), where an object is touched as if a pole were at the changing distance a: the contact moves
    /// along the object, never into it, so that n·d(pole's centre) = 0.
    pub fn creep(&self, a: f64, turn: f64) -> f64 {
        let ([x, y], n, (s, c)) = (self.place(a), self.normal(a, turn), self.alpha());
        let centre = [x + self.pole * s, y + self.pole * c];
        let slope = self.slope();
        (n[0] * slope[0] + n[1] * slope[1]) / (n[1] * centre[0] - n[0] * centre[1])
    }
}
