//! The corners of the whisker's, the gauge's and the tap's domain.

use super::*;

/// Configurations whose fine tips have answers, and whose gauges are touched at 4° too.
const STIFF: [&str; 4] = ["hooke", "surface", "timoshenko", "pole-far"];

/// Taps that are hard of one dimension each; of the tiny taps first, `tiny` of them, all of which have an answer.
fn corners(name: &str) -> (Vec<Tuple>, usize) {
    let stiff = STIFF.contains(&name);
    let mut all = grid(&[2.0, 4.0, 10.0, 12.0], &[8.0, 21.0, 48.0], &[0.001]);
    let tiny = all.len();
    let nearly = [10.0, 10.0 * (1.0 - 1e-7), 10.0 * (1.0 + 1e-7), 12.0];
    all.extend(grid(&nearly, &[9.0, 20.0, 33.0, 48.0], &[0.01, 1.0, 10.0]));
    all.extend(grid(&[4.0, 10.0], &[10.0, 20.0, 40.0], &[60.0]));
    // About the peak of the strain curve.
    let about = [8.0, 9.0, 9.9, 10.0, 10.5, 11.0, 11.9, 12.0, 12.1, 13.0];
    all.extend(grid(&[4.0, 7.0, 10.0], &about, &[0.01, 1.0, 10.0]));
    // Inside the gauge, just before and just after it: it ends at 5 + 2 cos α.
    for (d, end) in [(10.0, 7.0), (4.0, 5.0 + 2.0 * (6.0_f64 / 100.0).atan().cos())] {
        let places =
            [4.9, 5.0 - 1e-6, 5.0, 5.001, 5.1, 6.0, end - 0.01, end - 1e-6, end, end + 1e-6, end + 0.01, 7.5];
        all.extend(grid(&[d], &places, if stiff { &[0.01, 0.5, 4.0] } else { &[0.01, 0.5] }));
    }
    let short = grid(&[4.0, 10.0], &[3.0, 12.0, 30.0, 48.0], &[0.1, 5.0]);
    let gauges = [(5.0, 0.01), (0.0, 2.0), (0.0, 0.01), (0.0, 50.0)];
    all.extend(gauges.iter().flat_map(|&(x_ss, l)| short.iter().map(move |t| Tuple { x_ss, l, ..*t })));
    if stiff {
        all.extend(grid(&[0.2], &[48.5], &[0.001, 0.01, 0.1, 0.5, 1.0]));
    }
    (all, tiny)
}

#[test]
fn every_corner_is_solved_as_by_the_reference() {
    for name in CONFIGURATIONS {
        let (tuples, tiny) = corners(name);
        let exact = configuration_agrees(name, &tuples);
        let told = |these: &[Outcome]| these.iter().filter(|o| o.strain.is_finite()).count();
        assert_eq!(told(&exact[..tiny]), tiny, "{name}: a tiny tap has no answer");
        assert!(told(&exact[tiny..tiny + 48]) >= 44, "{name}: hardly any answer for cylinders");
        if name == "hooke" {
            assert!(told(&exact[tiny + 48..tiny + 54]) >= 3, "no answer at 60°");
        }
        if STIFF.contains(&name) {
            assert!(told(&exact[exact.len() - 5..]) >= 2, "{name}: no answer for fine tips");
        }
    }
}
