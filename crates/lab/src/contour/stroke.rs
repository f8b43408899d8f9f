//! A stroke: readings of one sweep, while the contact slides along the object (docs/contour.md §3).
//!
//! Without friction the whisker's state at a reading is that of a tap of a point object: of distance a′ from which it has turned by θ′. A
//! reading alone does not tell both. At a sharp object a′ stands still, along a smooth one it changes slowly, as a polynomial of the motor's
//! angle, and θ′ follows from where the whisker first touched, but for a small creep: the contact moves along the object, never into it.
//! Slope and bend of the signal then give the polynomial and the first touch, so that neither need be known before.

use nalgebra::DMatrix;

use super::curve::Covariance;
use super::point::{Noise, Point, Pose};
use crate::estimator::least::{FREE, Minimum, by_values, slopes};
use crate::locate::{AnsweredRow, Locator};
use crate::{measure::Skin, reduce::median};

/// Fewest readings of a stroke; fewer are taps.
const FEWEST: usize = 4;
/// Highest power of a′ over the motor's angle, where the object is not sharp.
const POWERS: usize = 3;
/// Standard deviation of the coefficient of the j-th power of the angle (rad) that is expected before, over a′: of circles of 5 … 50 mm it is 0.05 … 0.5.
const EXPECTED: f64 = 0.5;
/// Standard deviation of the first touch where nothing is said of it, degrees.
const TOUCH: f64 = 0.5;
/// A reading off its stroke by so many standard deviations is an outlier.
const OFF: f64 = 5.0;
/// Readings are used beyond the calibrated drives by this share of the ends.
const BEYOND: f64 = 0.1;
const SETTLED: f64 = 1e-10;
/// Small changes of the first touch (degrees) and of the coefficients (mm).
const STEPS: [f64; POWERS + 2] = [1e-4, 1e-3, 1e-3, 1e-3, 1e-3];
/// Even number of parts of the integral of the creep.
const PARTS: usize = 8;
/// Noise that is counted at least, relative to the signal: the model is solved no better.
const LEAST: f64 = 1e-6;

/// A stroke that was followed, as run.json has it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Followed {
    /// Its number in the file.
    pub stroke: f64,
    /// Readings that made points.
    pub points: usize,
    /// `sharp` if the contact stayed at one place of the object, else `smooth`; `None` if its readings were taken as taps.
    pub object: Option<&'static str>,
    /// By how much the whisker had turned before drive 0.
    pub touched_before_deg: f64,
    pub sigma_touched_before_deg: f64,
    /// χ² per degree of freedom.
    pub chi2: f64,
}

impl Followed {
    /// The stroke of this number, taken as taps.
    pub fn as_taps(stroke: f64) -> Self {
        let [touched_before_deg, sigma_touched_before_deg, chi2] = [f64::NAN; 3];
        Self { stroke, points: 0, object: None, touched_before_deg, sigma_touched_before_deg, chi2 }
    }
}

struct Stroke<'a> {
    locator: &'a Locator,
    skin: &'a Skin,
    sign: f64,
    /// Of each reading the drive, degrees from where the whisker is said to touch, the signal and its standard deviation.
    readings: Vec<[f64; 3]>,
    span: f64,
    /// Calibrated drives, degrees.
    drives: [f64; 2],
    /// Standard deviation of the first touch, degrees.
    touch: f64,
}

impl Stroke<'_> {
    /// a′ (mm) and its slope (mm/rad) at an angle; the parameters are the offset of the first touch, and coefficients.
    fn distance(&self, p: &[f64], angle: f64) -> (f64, f64) {
        let x = angle / self.span;
        let (mut a, mut slope) = (0.0, 0.0);
        for c in p[1..].iter().rev() {
            slope = slope * x + a;
            a = a * x + c;
        }
        (a, slope / self.span.to_radians())
    }

    /// a′ in mm and θ′ in degrees at an angle.
    fn state(&self, p: &[f64], angle: f64) -> (f64, f64) {
        let turned = angle + p[0];
        let h = turned.to_radians() / PARTS as f64;
        let creep = |k: usize| {
            let share = k as f64 / PARTS as f64;
            let (a, slope) = self.distance(p, share * turned - p[0]);
            slope * self.skin.creep(a, (share * turned).to_radians())
        };
        // Simpson's rule.
        let inner = |k: usize| if k % 2 == 1 { 4.0 } else { 2.0 };
        let sum = creep(0) + creep(PARTS) + (1..PARTS).map(|k| inner(k) * creep(k)).sum::<f64>();
        (self.distance(p, angle).0, turned + (h / 3.0 * sum).to_degrees())
    }

    /// Signal expected at a state; beyond the calibrated drives in proportion.
    fn expected(&self, a: f64, turn: f64) -> Option<f64> {
        let within = turn.clamp(self.drives[0], self.drives[1]);
        let value = self.locator.expected(a, within + self.locator.drive_origin, self.sign) * turn / within;
        value.is_finite().then_some(value)
    }

    fn residuals(&self, p: &[f64]) -> Option<Vec<f64>> {
        let one = |[angle, signal, deviation]: &[f64; 3]| {
            let (a, turn) = self.state(p, *angle);
            Some((signal - self.expected(a, turn)?) / deviation)
        };
        let readings = self.readings.iter().map(one);
        let expected = |j: usize| EXPECTED * p[1] * self.span.to_radians().powi(j as i32);
        let before = (2..p.len()).map(|k| Some(p[k] / expected(k - 1)));
        readings.chain([Some(p[0] / self.touch)]).chain(before).collect()
    }

    /// The fit of a sharp object, unless Schwarz's criterion for two more numbers prefers a smooth one (higher powers are hardly free).
    fn fit(&self, start: f64) -> Option<Minimum> {
        let of = |p: &[f64]| self.residuals(p);
        let minimum =
            |from: &[f64]| by_values(&of, from, &STEPS[..from.len()], &vec![FREE; from.len()], SETTLED);
        let sharp = minimum(&[0.0, start])?;
        let mut from = sharp.at.clone();
        from.resize(POWERS + 2, 0.0);
        let smooth = minimum(&from);
        let room = 2.0 * (self.readings.len() as f64).ln();
        Some(smooth.filter(|smooth| smooth.chi2() + room < sharp.chi2()).unwrap_or(sharp))
    }

    /// Where the whisker at `pose` touches when it has turned by `angle`, mm.
    fn place(&self, p: &[f64], pose: &Pose, angle: f64) -> [f64; 2] {
        let (a, turn) = self.state(p, angle);
        pose.turned((angle - turn).to_radians()).place(self.skin.contact(a, turn.to_radians()))
    }
}

/// Points of a stroke that first touched at `pose`, and `followed` with what they tell; `None` of too few readings, both signs, or uncalibrated drives.
pub fn swept(
    (locator, skin): (&Locator, &Skin),
    pose: &Pose,
    readings: &[&AnsweredRow],
    noise: &Noise,
    followed: Followed,
) -> Option<(Vec<Point>, Followed)> {
    let angle = |r: &AnsweredRow| r.drive - locator.drive_origin;
    let sum: f64 = readings.iter().map(|r| r.signal).filter(|s| s.is_finite()).sum();
    let sign = sum.signum();
    let drives = locator.side_of(sign)?.ends();
    let [first, last] = [drives[0] * (1.0 - BEYOND), drives[1] * (1.0 + BEYOND)];
    let fits = |r: &AnsweredRow| {
        r.signal * sign > 0.0 && (first..=last).contains(&angle(r)) && r.answer.located.distance.is_finite()
    };
    let mut used: Vec<usize> = (0..readings.len()).filter(|&i| fits(readings[i])).collect();
    let mut outliers = vec![false; readings.len()];
    let scale = readings.iter().map(|r| r.signal.abs()).filter(|s| s.is_finite()).fold(0.0, f64::max);
    let (stroke, found) = loop {
        if used.len() < FEWEST {
            return None;
        }
        let of = |&i: &usize| {
            let r = readings[i];
            [angle(r), r.signal, (locator.noise * (1.0 + r.share).sqrt()).hypot(LEAST * scale)]
        };
        let told: Vec<[f64; 3]> = used.iter().map(of).collect();
        let span = told.iter().map(|[angle, ..]| *angle).fold(0.0, f64::max);
        let touch = noise.touch.filter(|t| *t > 0.0).unwrap_or(TOUCH);
        let stroke = Stroke { locator, skin, sign, readings: told, span, drives, touch };
        let start =
            median(&mut used.iter().map(|&i| readings[i].answer.located.distance).collect::<Vec<_>>());
        let found = stroke.fit(start)?;
        let off = &found.residuals[..used.len()];
        let spread = 1.4826 * median(&mut off.iter().map(|r| r.abs()).collect::<Vec<_>>());
        let wrong: Vec<usize> =
            (0..used.len()).filter(|&k| off[k].abs() > OFF * spread.max(1.0)).map(|k| used[k]).collect();
        if wrong.is_empty() || outliers.iter().any(|o| *o) {
            break (stroke, found);
        }
        wrong.iter().for_each(|&i| outliers[i] = true);
        used.retain(|i| !outliers[*i]);
    };
    let n = used.len();
    let sharp = found.at.len() == 2;
    // Prior residuals count as data.
    let free = (found.residuals.len() - found.at.len()) as f64;
    let chi2 = found.chi2() / free;
    let covariance = &found.covariance * chi2.max(1.0);
    let point = |i: usize| -> Option<Point> {
        let reading = readings[i];
        let angle = reading.drive - stroke.locator.drive_origin;
        if !angle.is_finite() {
            return None;
        }
        let (a, turn) = stroke.state(&found.at, angle);
        // Place and distance.
        let told = |p: &[f64]| {
            let [x, y] = stroke.place(p, pose, angle);
            Some(vec![x, y, stroke.distance(p, angle).0])
        };
        let j = slopes(&told, &found.at, &STEPS[..found.at.len()], &vec![FREE; found.at.len()])?;
        let of_fit: DMatrix<f64> = &j * &covariance * j.transpose();
        let at = stroke.place(&found.at, pose, angle);
        // Errors of the calibration move the whole stroke along the whisker.
        let slope = (stroke.expected(a + 0.01, turn)? - stroke.expected(a - 0.01, turn)?) / 0.02;
        let of_reading = stroke.locator.noise.powi(2) * (1.0 + reading.share) / (slope * slope);
        let located = &reading.answer.located;
        let common = (located.sigma.powi(2) - of_reading).max(0.0);
        let heading = pose.turned((angle - turn).to_radians());
        let across = [-(at[1] - pose.base[1]), at[0] - pose.base[0]];
        let covariance = Covariance([of_fit[(0, 0)], of_fit[(0, 1)], of_fit[(1, 1)]])
            .plus(noise.base * noise.base)
            .along(heading.direction(stroke.skin.slope()), common)
            .along(across, noise.angle.to_radians().powi(2));
        let (distance, height) = ([a, (of_fit[(2, 2)] + common).sqrt()], pose.base[2]);
        let (share, nothing) = (if sharp { 1.0 } else { 2.0 } / n as f64, Point::nothing(located.status));
        Some(Point { at, covariance, share, distance, height, swept: true, ..nothing })
    };
    let all = (0..readings.len()).map(|i| {
        let used = used.contains(&i).then(|| point(i)).flatten();
        let nothing = Point::nothing(readings[i].answer.located.status);
        Point { outlier: outliers[i], ..used.unwrap_or(nothing) }
    });
    let (object, sigma) = (if sharp { "sharp" } else { "smooth" }, covariance[(0, 0)].sqrt());
    let touch = Followed { touched_before_deg: found.at[0], sigma_touched_before_deg: sigma, ..followed };
    Some((all.collect(), Followed { object: Some(object), chi2, ..touch }))
}
