//! The corners of the whisker's, the gauge's and the tap's domain.

use super::*;

#[test]
fn cylinders_and_whiskers_that_widen() {
    let tips = [10.0, 10.0 * (1.0 - 1e-7), 10.0 * (1.0 + 1e-7), 12.0];
    let tuples = grid(&tips, &[9.0, 20.0, 33.0, 48.0], &[0.01, 1.0, 10.0]);
    for name in CONFIGURATIONS {
        let exact = configuration_agrees(name, &tuples);
        assert!(exact.iter().filter(|o| o.strain.is_finite()).count() >= 44, "{name}: hardly any answer");
    }
}

#[test]
fn fine_tips_touched_next_to_their_end() {
    let tuples = grid(&[0.2], &[48.5], &[0.001, 0.01, 0.1, 0.5, 1.0]);
    for name in ["hooke", "surface", "timoshenko", "pole-far"] {
        let exact = configuration_agrees(name, &tuples);
        assert!(exact.iter().filter(|o| o.strain.is_finite()).count() >= 2, "{name}: hardly any answer");
    }
}

#[test]
fn tiny_and_huge_angles() {
    let tiny = grid(&[2.0, 4.0, 10.0, 12.0], &[8.0, 21.0, 48.0], &[0.001]);
    let huge = grid(&[4.0, 10.0], &[10.0, 20.0, 40.0], &[60.0]);
    for name in CONFIGURATIONS {
        let exact = configuration_agrees(name, &tiny);
        assert!(exact.iter().all(|o| o.strain.is_finite()), "{name}: a tiny tap has no answer");
        configuration_agrees(name, &huge);
    }
    let exact = configuration_agrees("hooke", &huge);
    assert!(exact.iter().filter(|o| o.strain.is_finite()).count() >= 3);
}

#[test]
fn contacts_inside_just_before_and_just_after_the_gauge() {
    // The gauge ends at 5 + 2 cos α.
    for (d, end) in [(10.0, 7.0), (4.0, 5.0 + 2.0 * (6.0_f64 / 100.0).atan().cos())] {
        let places =
            [4.9, 5.0 - 1e-6, 5.0, 5.001, 5.1, 6.0, end - 0.01, end - 1e-6, end, end + 1e-6, end + 0.01, 7.5];
        let tuples = grid(&[d], &places, &[0.01, 0.5, 4.0]);
        for name in ["hooke", "surface", "timoshenko", "pole-far"] {
            configuration_agrees(name, &tuples);
        }
        let small = grid(&[d], &places, &[0.01, 0.5]);
        for name in ["neo", "mooney-coulomb", "stick", "yeoh"] {
            configuration_agrees(name, &small);
        }
    }
}

#[test]
fn short_gauges_and_gauges_at_the_clamp() {
    let base = grid(&[4.0, 10.0], &[3.0, 12.0, 30.0, 48.0], &[0.1, 5.0]);
    let all = |x_ss: f64, l: f64| base.iter().map(move |t| Tuple { x_ss, l, ..*t });
    let tuples: Vec<Tuple> =
        all(5.0, 0.01).chain(all(0.0, 2.0)).chain(all(0.0, 0.01)).chain(all(0.0, 50.0)).collect();
    for name in CONFIGURATIONS {
        configuration_agrees(name, &tuples);
    }
}

#[test]
fn contacts_about_the_peak_of_the_strain_curve() {
    let tuples = grid(
        &[4.0, 7.0, 10.0],
        &[8.0, 9.0, 9.9, 10.0, 10.5, 11.0, 11.9, 12.0, 12.1, 13.0],
        &[0.01, 1.0, 10.0],
    );
    for name in CONFIGURATIONS {
        configuration_agrees(name, &tuples);
    }
}
