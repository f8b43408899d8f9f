//! Extreme rows of every configuration: none may be over its tolerance without a word.
//!
//! The long run, 100 000 rows on the CPU kernels and on the GPU's:
//!
//! ```text
//! cargo test --release --test suite -- --ignored --nocapture census
//! ```

use super::*;
use vibrissa::census::Taps;
use vibrissa::census::configuration::{Configuration, HUB, all as configured};
use vibrissa::evaluate::{Evaluator, Method};
use vibrissa::scene::Drive;
use vibrissa::scene::sampler::Sampler;

#[allow(non_snake_case)]
/// d/D 0.02…1.5, drives of 1e-4…60°, gauges from 1e-4 mm, contacts from next to the clamp to the tip, a half of them next to the gauge.
fn extreme(c: &Configuration, n: u32, seed: u64) -> Vec<Tuple> {
    let point = |index: u32| {
        let unit = |dimension| f64::from(Sampler::Random.coordinate(seed, dimension, index)) / 2f64.powi(32);
        let log = |dimension, from: f64, to: f64| from * (to / from).powf(unit(dimension));
        let even = index.is_multiple_of(2);
        let wide = log(7, 1.0, 200.0);
        let tip = wide * if even { 0.02 + 1.48 * unit(6) } else { log(6, 0.02, 1.5) };
        let length = wide * log(0, 2.0, 50.0);
        let place = match index {
            _ if index.is_multiple_of(16) => 0.0,
            _ if even => 0.95 * unit(1) * length,
            _ => log(1, 1e-3, 0.95) * length,
        };
        let grid = log(2, 1e-4, 0.5 * length).min(length - place);
        let a = match index % 5 {
            0 | 1 => place + grid * log(3, 1e-2, 1e2),
            2 => place + log(3, 1e-4, 0.1) * length,
            _ => place + unit(3) * (length - place),
        };
        let a = a.clamp(1e-3 * length, length);
        let angle = log(4, 1e-4, 60.0);
        let scale = if c.hub { HUB / (log(5, 0.03, 3.0) * a) } else { 1.0 };
        let [D, d, L_a, x_ss, l, a] = [wide, tip, length, place, grid, a].map(|x| scale * x);
        let drive = if c.drive == Drive::Displacement { a * angle.to_radians() } else { angle };
        Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() }
    };
    (0..n).map(point).collect()
}

/// Rows over the tolerance, of how many compared, unsolved and referred, on each of `places`.
fn count(places: &[Place], rows: impl Fn(&Configuration) -> u32, seed: u64) -> Vec<String> {
    let mut over = Vec::new();
    let mut totals = vec![[0_usize; 4]; places.len()];
    for c in &configured() {
        let setup = c.setup();
        let tuples = extreme(c, rows(c), seed);
        let taps = Taps::of(&setup, &tuples);
        let exact = taps.answers(Method::Reference).expect("it answers");
        for (place, total) in places.iter().zip(&mut totals) {
            let mut evaluator = Evaluator::new(&setup, place.open(&setup));
            let found =
                evaluator.run_beside(&taps.designs, &taps.tasks, &exact).expect("the backend answers");
            for (i, (e, f)) in exact.iter().zip(&found).enumerate() {
                total[3] += usize::from(f.referred);
                if !(e.strain.is_finite() && f.strain.is_finite()) {
                    total[2] += usize::from(e.strain.is_finite());
                    continue;
                }
                total[1] += 1;
                let error =
                    (f.strain - e.strain).abs() / e.strain.abs().max(taps.least(i)).max(f64::MIN_POSITIVE);
                if error.is_nan() || error > bound(*place) {
                    total[0] += 1;
                    over.push(format!(
                        "{} {place:?}: {} instead of {}, {error:.1e}, {}: {:?}",
                        c.name, f.strain, e.strain, f.status, tuples[i]
                    ));
                }
            }
        }
    }
    for (place, [wrong, compared, unsolved, referred]) in places.iter().zip(totals) {
        println!(
            "{place:?}: {wrong} of {compared} over the tolerance, {unsolved} unsolved, {referred} referred"
        );
        assert!(compared > 0);
    }
    over
}

/// Configurations whose taps the reference takes long to answer.
fn slow(c: &Configuration) -> bool {
    !matches!(c.model.contact, Contact::Frictionless | Contact::Coulomb(0.0))
}

#[test]
fn few_extreme_rows_are_all_within_their_tolerance() {
    // Shaders take their time to compile: those of the GPU have the long run, and `verify`.
    let over = count(&[CPU, CPU_F64], |c| if slow(c) { 4 } else { 30 }, 1);
    assert!(over.is_empty(), "{}", over.join("\n"));
}

#[test]
#[ignore = "half an hour: 100 000 rows"]
fn census_of_extreme_rows_none_over_its_tolerance() {
    let over = count(&[CPU, CPU_F64, GPU], |c| if slow(c) { 700 } else { 3900 }, 2);
    assert!(over.is_empty(), "{} rows\n{}", over.len(), over.join("\n"));
}
