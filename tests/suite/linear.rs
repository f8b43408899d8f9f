//! Closed forms of linear theory against integrals of moment over stiffness; their limits and inverse (model §2).

use std::f64::consts::PI;

use crate::common::quadrature::integral;
use proptest::prelude::*;

use vibrissa::physics::inverse::Inverse;
use vibrissa::physics::linear::{StrainCurve, shear_length2};
use vibrissa::physics::taper::Taper;
use vibrissa::scene::Drive;

/// Young's modulus, MPa; cancels.
const E: f64 = 3.2;
const PANELS: u32 = 300;

#[derive(Debug, Clone, Copy)]
struct Case {
    taper: Taper,
    gauge: [f64; 2],
    length: f64,
    hub: f64,
    drive: Drive,
    nu: Option<f64>,
    a: f64,
}

impl Case {
    fn curve(&self) -> StrainCurve {
        let shear = self.nu.map_or(0.0, |nu| shear_length2(&self.taper, nu));
        StrainCurve::new(self.taper, self.gauge, self.hub, self.drive, shear)
    }

    fn stiffness(&self, x: f64) -> f64 {
        E * PI / 4.0 * self.taper.radius(x).powi(4)
    }

    /// Deflection under 1 N at `a`, by integration: bending, and shear if the case has it; mm.
    fn give(&self) -> f64 {
        let a = self.a;
        let bending = integral(|s| (a - s).powi(2) / self.stiffness(s), 0.0, a, PANELS);
        let shear = self.nu.map_or(0.0, |nu| {
            let (k, g) = (6.0 * (1.0 + nu) / (7.0 + 6.0 * nu), E / (2.0 * (1.0 + nu)));
            integral(|s| 1.0 / (k * g * PI * self.taper.radius(s).powi(2)), 0.0, a, PANELS)
        });
        bending + shear
    }

    /// Displacement of the contact per unit of drive, mm: (a + r₀) θ, or δ itself.
    fn way(&self) -> f64 {
        if self.drive == Drive::Angle { self.a + self.hub } else { 1.0 }
    }

    fn strain(&self) -> f64 {
        let force = self.way() / self.give();
        let [x1, x2] = self.gauge;
        let end = x2.min(self.a);
        let fibre = |s: f64| force * (self.a - s) * self.taper.radius(s) / self.stiffness(s);
        integral(fibre, x1, end, PANELS) / (x2 - x1)
    }
}

/// Very thin to widening whiskers, contacts from the gauge's near end to the tip; half with hub, shear and displacement each, a third on the gauge.
fn cases() -> impl Strategy<Value = Case> {
    let whisker = (4.0..20.0f64, 0.02..1.3f64, 20.0..120.0f64, 0.01..0.5f64, 0.2..6.0f64);
    let tap =
        (0.0..1.0f64, 0..3u8, prop::option::of(0.0..60.0f64), prop::option::of(0.0..0.5f64), any::<bool>());
    (whisker, tap).prop_map(|((wide, slenderness, length, place, grid), (at, zone, hub, nu, displaced))| {
        let taper = Taper::new(wide, wide * slenderness, length);
        let gauge = taper.gauge(place * length, grid);
        let (from, to) = if zone == 0 { (gauge[0], gauge[1]) } else { (gauge[1], length) };
        let a = from + (0.001 + 0.999 * at) * (to - from);
        let drive = if displaced { Drive::Displacement } else { Drive::Angle };
        Case { taper, gauge, length, hub: hub.filter(|_| !displaced).unwrap_or(0.0), drive, nu, a }
    })
}

fn plain(d: f64, a: f64) -> Case {
    let taper = Taper::new(10.0, d, 50.0);
    let gauge = taper.gauge(5.0, 2.0);
    Case { taper, gauge, length: 50.0, hub: 0.0, drive: Drive::Angle, nu: None, a }
}

#[track_caller]
fn assert_close(value: f64, expected: f64, tolerance: f64) {
    let error = (value / expected - 1.0).abs();
    assert!(error <= tolerance, "{value} is not {expected}: off by {error:.1e}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn strain_force_and_slope_are_integrals_and_derivative(case in cases()) {
        let curve = case.curve();
        prop_assert!((curve.value(case.a) / case.strain() - 1.0).abs() < 1e-9);
        prop_assert!((curve.force(E, case.a) * case.give() / case.way() - 1.0).abs() < 1e-9);
        let [x1, x2] = case.gauge;
        let step = 1e-5 * (case.a - x1).min((case.a - x2).abs()).max(1e-3);
        let difference = (curve.value(case.a + step) - curve.value(case.a - step)) / (2.0 * step);
        let scale = curve.value(case.a) / (case.a - x1);
        prop_assert!((curve.slope(case.a) - difference).abs() < 1e-5 * scale);
    }

    #[test]
    fn every_distance_is_a_root_of_its_own_reading(case in cases()) {
        let inverse = Inverse::new(case.curve());
        let reading = inverse.curve().value(case.a);
        let roots = inverse.roots(reading);
        let Some(roots) = roots else { return Err(TestCaseError::fail("no root")) };
        let found: Vec<f64> = std::iter::once(roots.far).chain(roots.near).collect();
        for &root in &found {
            // Towards the virtual apex the reading vanishes: the root is limited by its last digit.
            let digit = 4.0 * f64::EPSILON * (inverse.curve().slope(root) * root / reading).abs();
            let miss = (inverse.curve().value(root) / reading - 1.0).abs();
            prop_assert!(miss < 1e-11 + digit, "{root} is no root: off by {miss:.1e}");
        }
        prop_assert!(roots.near.is_none_or(|near| near <= roots.far));
        // At the peak, a root is accurate only to the square root of the precision.
        let sharpness = (inverse.curve().slope(case.a) * case.a / reading).abs();
        let tolerance = 1e-11 / sharpness.max(1e-6);
        let held = found.iter().any(|root| (root / case.a - 1.0).abs() < tolerance);
        prop_assert!(held, "{found:?} does not hold {}", case.a);
    }

    #[test]
    fn the_peak_is_the_largest_reading_and_beyond_the_far_root_is_none(case in cases()) {
        let inverse = Inverse::new(case.curve());
        let (place, peak) = inverse.peak();
        prop_assert!(case.curve().value(case.a) <= peak * (1.0 + 1e-12));
        prop_assert_eq!(inverse.roots(peak * (1.0 + 1e-9)), None);
        if place.is_finite() {
            prop_assert!((inverse.curve().value(place) / peak - 1.0).abs() < 1e-12);
            let below = inverse.roots(peak * (1.0 - 1e-6));
            prop_assert!(below.is_some_and(|r| r.far >= place && r.near.is_none_or(|near| near <= place)));
        }
        let reading = inverse.curve().value(case.a);
        let far = inverse.roots(reading).map_or(f64::NAN, |r| r.far);
        let end = if case.taper.tau > 0.0 { 1.0 / case.taper.tau } else { 100.0 * case.length };
        let beyond = |i: i32| inverse.curve().value(far + (end - far) * f64::from(i) / 200.0) - reading;
        prop_assert!((1..=200).all(|i| far >= end || beyond(i) * beyond(1) > 0.0));
    }
}

#[test]
fn cylinders_are_the_limit_of_cones() {
    for nu in [None, Some(0.5)] {
        let with = |d: f64| Case { nu, hub: 3.0, ..plain(d, 33.0) };
        let straight = with(10.0);
        assert_eq!(straight.taper.tau, 0.0);
        for d in [10.0 * (1.0 - 1e-12), 10.0 * (1.0 + 1e-12)] {
            let (near, curve) = (with(d).curve(), straight.curve());
            assert_close(near.value(33.0), curve.value(33.0), 1e-11);
            assert_close(near.slope(33.0), curve.slope(33.0), 1e-11);
            assert_close(near.force(E, 33.0), curve.force(E, 33.0), 1e-11);
            let reading = curve.value(33.0);
            let far = |c| Inverse::new(c).roots(reading).unwrap().far;
            assert_close(far(near), far(curve), 1e-10);
        }
    }
}

#[test]
fn widening_whiskers_have_no_far_root_below_their_limit() {
    let case = plain(12.0, 40.0);
    let inverse = Inverse::new(case.curve());
    let limit = inverse.curve().at_inverse(0.0).0;
    assert!(limit > 0.0);
    let roots = inverse.roots(0.5 * limit).unwrap();
    assert_eq!(roots.near, None);
    assert_close(inverse.curve().value(roots.far), 0.5 * limit, 1e-12);
    assert!(inverse.roots(1.01 * limit).unwrap().near.is_some());
}

#[test]
fn point_gauge_peaks_at_twice_its_place() {
    let taper = Taper::new(10.0, 10.0, 50.0);
    let inverse = Inverse::new(StrainCurve::new(taper, [5.0, 5.0 + 1e-9], 0.0, Drive::Angle, 0.0));
    assert_close(inverse.peak().0, 10.0, 1e-8);
}

#[test]
fn gauges_at_the_clamp_have_roots() {
    for (hub, drive) in [(0.0, Drive::Angle), (8.0, Drive::Angle), (0.0, Drive::Displacement)] {
        let taper = Taper::new(10.0, 4.0, 50.0);
        let curve = StrainCurve::new(taper, taper.gauge(0.0, 2.0), hub, drive, 0.0);
        for a in [3.0, 20.0, 49.0] {
            assert_close(Inverse::new(curve.clone()).roots(curve.value(a)).unwrap().far, a, 1e-10);
        }
    }
}

#[test]
fn contacts_at_the_near_end_strain_nothing() {
    let curve = plain(4.0, 5.0).curve();
    for a in [1.0, 4.999, 5.0] {
        assert_eq!(curve.value(a), 0.0);
    }
    assert!(curve.value(5.001) > 0.0);
}
