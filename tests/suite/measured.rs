//! What is found in a record before it is calibrated: columns, counts, groups, lag, missing values, units, zeros.

use vibrissa::calibrate::between::{of_laws, zero};
use vibrissa::error::InputError;
use vibrissa::measure::columns::Columns;
use vibrissa::measure::counts::{Count, TURN, turn, unwrapped, wrapped};
use vibrissa::measure::group::{Groups, rounded};
use vibrissa::measure::lag::{Lag, Memory};
use vibrissa::measure::missing::{Placed, labels, signals};
use vibrissa::measure::unit::quarter_bridge_strain;
use vibrissa::measure::zero::Zero;
use vibrissa::measure::{Names, Unit};
use vibrissa::scene::Drive;

fn find(header: &str, said: &str) -> Result<Columns, InputError> {
    let names: Vec<String> = header.split(',').map(str::to_owned).collect();
    Columns::find(&names, &Names::parse(said)?, None)
}

#[test]
fn columns_are_found_by_name_or_as_said() {
    let c = find("a_mm,theta_deg,strain,run", "").unwrap();
    assert_eq!((c.a, c.drive, c.signal), (Some(0), Some((Drive::Angle, 1)), (Unit::Strain, 2)));
    assert_eq!((c.run, c.ignored.len()), (Some(3), 0));
    let c = find("dist,ang,ch1,ch3", "a=dist, theta=ang,reading=ch3,ignore=ch1").unwrap();
    assert_eq!((c.a, c.drive, c.signal), (Some(0), Some((Drive::Angle, 1)), (Unit::Reading, 3)));
    assert_eq!(c.ignored, [] as [&str; 0]);
    // What the user says goes before the column's own name.
    let c = find("a_mm,theta_deg,strain,strain_2", "strain=strain_2").unwrap();
    assert_eq!((c.signal, c.second), ((Unit::Strain, 3), None));
    let c = find("a_mm,tilt_deg,theta_deg,strain,reading_2,strain_2", "").unwrap();
    assert_eq!((c.second, c.tilt), (Some((Unit::Strain, 5)), Some(1)));
    assert_eq!(c.ignored, ["reading_2"]);
}

#[test]
fn what_looks_like_a_drive_is_asked_for() {
    for (name, likely) in [
        ("theta", "theta_deg"),
        ("theta_rad", "theta_deg"),
        ("angle", "theta_deg"),
        ("Angle (deg)", "theta_deg"),
        ("delta", "delta_mm"),
        ("displacement_mm", "delta_mm"),
        ("thetadeg", "theta_deg"),
        ("motor", "theta_deg or delta_mm"),
    ] {
        let e = find(&format!("a_mm,{name},strain"), "").unwrap_err();
        assert!(e.to_string().contains(likely) && e.key.as_deref() == Some(name), "{name}: {e}");
        assert!(find(&format!("a_mm,{name},strain"), &format!("ignore={name}")).is_ok());
        let hint = e.allowed.unwrap();
        assert_eq!(name.contains(' '), hint.contains(&format!("'ignore={name}'")), "{hint}");
    }
    for name in ["run", "t_s", "temperature", "operator", "grade", "comment"] {
        assert!(find(&format!("a_mm,{name},strain"), "").is_ok(), "{name}");
    }
}

#[test]
fn what_is_said_of_columns_is_checked() {
    for (said, word) in [
        ("a", "names no column"),
        ("dist=a_mm", "no such role"),
        ("a=", "missing"),
        ("a=x,a=y", "twice"),
        ("a=nothing", "no column nothing"),
    ] {
        let e = find("a_mm,theta_deg,strain", said).unwrap_err();
        assert!(e.to_string().contains(word) && e.key.as_deref() == Some("--columns"), "{said}: {e}");
    }
}

/// Counts of five distances and five drives, thrice, after as many without contact.
fn rig(count: impl Fn(f64) -> f64) -> Vec<Count> {
    let mut all = Vec::new();
    for run in 0..3 {
        let off = 150.0 * f64::from(run);
        all.push(Count { at: [9.0, 0.0], value: count(off) });
        for (a, drive) in (1..6).flat_map(|a| (1..6).map(move |d| (f64::from(a), f64::from(d)))) {
            all.push(Count {
                at: [a, drive],
                value: count(14_000.0 + 2_500.0 * drive * (1.0 + 0.2 * a) + off),
            });
        }
    }
    all
}

fn values(all: &[f64]) -> Vec<Count> {
    all.iter().map(|value| Count { at: [1.0, 1.0], value: *value }).collect()
}

#[test]
fn counts_that_begin_anew_are_told() {
    let signal: Vec<f64> = (0..40).map(|k| 50_000.0 + 900.0 * f64::from(k)).collect();
    let counted = |x: f64| x.rem_euclid(TURN);
    let at = turn(&values(&signal.iter().map(|x| counted(*x)).collect::<Vec<_>>()));
    for x in &signal {
        assert_eq!(unwrapped(counted(*x), at), *x);
    }
    assert_eq!(wrapped(300.0 - 65000.0, 0.0), 836.0);
    assert_eq!([wrapped(-12.0, 0.0), wrapped(-12.0, 1.0), wrapped(12.0, -1.0)], [-12.0, -12.0, 12.0]);
    assert_eq!([wrapped(58_000.0, 1.0), wrapped(7_536.0, -1.0)], [58_000.0, -58_000.0]);
    // Two sides of a sensor, a range that is filled, numbers that are no counts.
    assert_eq!(turn(&values(&[10_000.0, 25_000.0, 41_000.0, 55_000.0])), None);
    assert_eq!(turn(&rig(|x| 1.5 * x)), None);
    assert_eq!(turn(&values(&[1.0, 90_000.0])), None);
    assert_eq!(turn(&values(&[f64::NAN])), None);
}

#[test]
fn jumps_that_joining_makes_smooth_are_told() {
    for offset in (0..65_536).step_by(1_500) {
        let plain = rig(|x| 1.4 * x + f64::from(offset));
        let counted: Vec<Count> =
            plain.iter().map(|c| Count { value: c.value.rem_euclid(TURN), ..*c }).collect();
        let at = turn(&counted);
        let back: Vec<f64> = counted.iter().map(|c| unwrapped(c.value, at)).collect();
        let whole = back[0] - plain[0].value;
        assert!(back.iter().zip(&plain).all(|(b, c)| (b - c.value - whole).abs() < 1e-6), "{offset}");
    }
}

#[test]
fn taps_of_both_sides_about_the_end_of_the_range_are_joined() {
    for rest in [660.0, 65_400.0] {
        let plain: Vec<Count> = rig(|x| x - 14_000.0)
            .iter()
            .enumerate()
            .map(|(k, c)| Count {
                value: rest + if k / 26 % 2 == 0 { c.value } else { -c.value } * 0.4,
                ..*c
            })
            .collect();
        let counted: Vec<Count> =
            plain.iter().map(|c| Count { value: c.value.rem_euclid(TURN), ..*c }).collect();
        let at = turn(&counted);
        let back: Vec<f64> = counted.iter().map(|c| unwrapped(c.value, at)).collect();
        let whole = back[0] - plain[0].value;
        assert!(at.is_some() && back.iter().zip(&plain).all(|(b, c)| (b - c.value - whole).abs() < 1e-6));
    }
}

#[test]
fn counts_that_do_not_begin_anew_stay() {
    // A dropout, a stuck sensor, a row with a wrong label, few drives far apart, both sides.
    let smooth = rig(|x| 1.5 * x + 4_000.0);
    for (place, value) in [(12, 0.0), (12, 500.0), (25, 65_000.0), (40, 3_000.0), (0, 60_000.0)] {
        let mut spoilt = smooth.clone();
        spoilt[place].value = value;
        assert_eq!(turn(&spoilt), None, "{place} {value}");
    }
    let ends =
        |a: f64| [[a, 1.0], [a, 2.0]].map(|at| Count { at, value: 62_000.0 * (at[1] - 1.0) + 90.0 * a });
    assert_eq!(turn(&(1..20).flat_map(|a| ends(f64::from(a))).collect::<Vec<_>>()), None);
    // A signal that fills the range, far from the zero.
    let wide = |[a, drive]: [f64; 2]| 1e6 * (drive + 9.1) * (1.0 / a - 1.0 / 185.0);
    let taps =
        [117.0, 126.0, 135.0, 144.0].into_iter().flat_map(|a| [2.0, 4.0, 6.0, 8.0, 10.5].map(|d| [a, d]));
    let taps = taps.map(|at| Count { at, value: wide(at) });
    let rests = [0.0, 200.0].map(|value| Count { at: [144.0, 0.0], value });
    assert_eq!(turn(&rests.into_iter().chain(taps).collect::<Vec<_>>()), None);
    let sides = rig(|x| x)
        .iter()
        .enumerate()
        .map(|(k, c)| Count { value: 32_768.0 + if k % 2 == 0 { c.value } else { -c.value } * 0.6, ..*c })
        .collect::<Vec<_>>();
    assert_eq!(turn(&sides), None);
}

fn centres(values: &[f64], width: Option<f64>) -> Vec<f64> {
    let groups = Groups::of(values.iter().copied(), width, false);
    groups.centres.iter().map(|x| (x * 1e3).round() / 1e3).collect()
}

#[test]
fn jitter_is_told_from_steps() {
    assert_eq!(centres(&[2.15, 2.17, 2.19, 4.15, 4.17, 6.15], None), [2.17, 4.16, 6.15]);
    assert_eq!(centres(&[144.105, 144.115, 139.6, 139.61, 135.1], None), [135.1, 139.605, 144.11]);
    // Steps of a plan are no jitter, however they grow.
    for plan in [
        vec![20.0, 25.0, 30.0, 35.0],
        vec![0.5, 1.0, 2.0, 5.0, 10.0],
        vec![0.5, 1.0, 1.5, 2.0, 2.5, 60.0],
        vec![20.0, 22.5, 26.0, 31.0, 38.0],
        vec![40.0, 41.0],
        vec![190.9, 196.2, 201.8, 276.1],
        vec![7.0],
    ] {
        assert_eq!(centres(&plan, None), plan);
    }
    assert_eq!(centres(&[2.15, 2.17, 4.15], Some(0.0)), [2.15, 2.17, 4.15]);
    assert_eq!(centres(&[2.0, 2.5, 4.0], Some(0.5)), [2.25, 4.0]);
    let one = Groups::of([4.0, 4.02, 4.1].into_iter(), None, true);
    assert!(one.joined() && one.centres.len() == 1 && one.centre(4.02) == one.centres[0]);
    assert_eq!(Groups::of([40.0, 41.0, 42.0].into_iter(), None, false).centres.len(), 3);
    // Rounding within jitter within steps, and jitter of which two values happen to be close.
    let finer = [60.0, 60.004, 60.004000000000005, 65.0, 65.0000001, 65.003, 70.001, 75.0];
    assert_eq!(centres(&finer, None), [60.003, 65.001, 70.001, 75.0]);
}

#[test]
fn what_is_equal_but_for_rounding_becomes_one() {
    let single = f64::from(70.76_f32);
    let rough = [70.75999999999999, f64::NAN, 70.76, single, 0.1 + 0.2 - 0.3, -1e-7, 10.0, 10.00001];
    let plain = rounded(&rough);
    assert!(plain[1].is_nan());
    assert_eq!([&plain[..1], &plain[2..]].concat(), [70.76, 70.76, 70.76, 0.0, 0.0, 10.0, 10.00001]);
    assert_eq!(rounded(&[f64::INFINITY, 3.0]), [f64::INFINITY, 3.0]);
    let slip: Vec<f64> = (0..20).map(|k| 60.0 + f64::from(k) * 0.01).chain([6.1e9]).collect();
    assert_eq!(rounded(&slip), slip);
    assert!(rounded(&[]).is_empty());
}

#[test]
fn a_reading_that_lags_settles_to_what_it_will_be() {
    let lag = Lag { gain: 0.2, sigma_gain: 0.0, tau_s: 3.0, sigma_tau_s: 0.0 };
    let levels = [0.0, 5.0, 5.0, -2.0, 7.0, 0.0, 0.0];
    let (mut x, mut memory) = (0.0, Memory::default());
    for (k, s) in levels.into_iter().enumerate() {
        let stays = (-2.0f64 / 3.0).exp();
        x = s + stays * (x - s);
        let (settled, _) = memory.settled(&lag, 2.0 * k as f64, 0, s - lag.gain * (s - x));
        assert!((settled - s).abs() < 1e-12, "{settled} {s}");
    }
    // A clock that starts anew, another run, a reading that is missing.
    assert_eq!(memory.settled(&lag, 0.0, 0, 4.0), (4.0, 0.0));
    assert_eq!(memory.settled(&lag, 1.0, 1, 3.0), (3.0, 0.0));
    assert!(memory.settled(&lag, 2.0, 1, f64::NAN).0.is_nan());
    assert_eq!(memory.settled(&lag, 2.0, 1, 3.0).0, 3.0);
}

/// Signals of taps in cells of their own after those at rest.
fn column(rests: &[f64], taps: &[f64]) -> Vec<Placed> {
    let rests = rests.iter().map(|x| (*x, [0; 2]));
    rests.chain(taps.iter().enumerate().map(|(k, x)| (*x, [1 + k as u64; 2]))).collect()
}

#[test]
fn values_that_stand_for_none_are_told() {
    let strain = [0.0159, 0.0318, 0.0477, 0.0139, 0.0279, 0.0419];
    let counts = [1367.0, 2322.0, 3277.0, 1250.0, 2088.0, 2926.0];
    let rests = [-2.5e-6, 1.1e-5, 0.0];
    for none in [-9999.0, 9999.0, -999.0, -1.0, 99999.0, 9.9e37, 1e38, -3.4e38] {
        for n in 1..3 {
            let taps = [&strain[..], &vec![none; n]].concat();
            assert_eq!(signals(&column(&rests, &taps)), [none], "{none} {n}");
        }
    }
    for none in [-9999.0, -999.0, -1.0, 9999.0] {
        assert_eq!(signals(&column(&[412.0, 411.0], &[&counts[..], &[none]].concat())), [none], "{none}");
    }
    let both = signals(&column(&rests, &[&strain[..], &[-9999.0, 9999.0, -9999.0]].concat()));
    assert_eq!(both.len(), 2, "{both:?}");
    // Another number than usual, twice; in the range of others that have decimals.
    assert_eq!(signals(&column(&rests, &[&strain[..], &[-77.0, -77.0]].concat())), [-77.0]);
    assert_eq!(signals(&column(&rests[..2], &[&strain[..], &[0.0; 4]].concat())), [0.0]);
    let micro: Vec<f64> = strain.iter().map(|x| 1e6 * x + 0.25).chain([9999.0, 9999.0]).collect();
    assert_eq!(signals(&column(&[2.56], &micro)), [9999.0]);
}

#[test]
fn readings_are_no_missing_values() {
    let none = [0.0_f64; 0];
    // Counts about zero, rests that are equal, the other side, an end stop, a row in another unit.
    for (rests, taps) in [
        (&[-1.0, 0.0, 1.0, -1.0][..], &[1367.0, 2322.0, 3277.0, 1250.0][..]),
        (&[0.0; 5], &[100.0, 110.0, 120.0, 115.0]),
        (&[0.0, 1.0], &[-1.0, -2.0, 3.0, 4.0, -3.0]),
        (&[0.1, 0.2], &[1.1, 2.3, 3.9, 5.0, 5.0, 5.0]),
        (&[0.0, 1e-5], &[0.012, 0.014, 0.016, 16_123.0]),
        // 0 is what a weak tap shows, and what a sensor shows at rest.
        (&[-1e-5, 1e-5], &[0.012, 0.014, 1e-4, 0.0, 0.0]),
        (&[0.0, 1e-5], &[0.012, 0.014, 0.016, 0.0, 0.0]),
        (&[998.0, 999.0, 1000.0], &[1367.0, 2322.0, 3277.0, 1250.0]),
    ] {
        assert_eq!(signals(&column(rests, taps)), none, "{taps:?}");
    }
    assert_eq!(labels(&[25.0, 25.0, 30.0, 35.0, -9999.0, -1.0]), [-9999.0, -1.0]);
    assert_eq!(labels(&[2.0, 4.0, 6.0, -6.0, -4.0, -1.0]), none);
}

#[test]
fn the_bridge_is_not_linear() {
    // R = 120 Ω, GF 2.21, 5 %: R' = 133.26 Ω; v = R'/(R + R') − 1/2.
    let v = 133.26 / 253.26 - 0.5;
    assert!((quarter_bridge_strain(1000.0 * v, 2.21) - 0.05).abs() < 1e-15);
    for strain in [-0.05, -1e-6, 0.0, 1e-5, 0.2] {
        for unit in [Unit::Strain, Unit::Microstrain, Unit::Bridge] {
            let back = unit.strain(unit.value(strain, 2.21), 2.21);
            assert!((back - strain).abs() <= 1e-15, "{unit:?} {strain} {back}");
        }
    }
    assert!(quarter_bridge_strain(500.0, 2.21).is_nan());
    let [tap, rest] = [13.0, 0.35].map(|v| quarter_bridge_strain(v, 2.21));
    let above = Unit::Bridge.above(tap, rest, 2.21);
    assert!((above - quarter_bridge_strain(12.65, 2.21)).abs() < 1e-15);
    assert!((above - (tap - rest)).abs() > 1e-5);
}

#[test]
fn a_straight_drift_is_removed_exactly() {
    let drift = |place: usize| 1e-3 + 2e-6 * place as f64;
    let readings: Vec<_> = [0, 1, 2, 20, 55, 56, 99].map(|p| (p, drift(p))).to_vec();
    let zero = Zero::new(&readings);
    for place in 3..99 {
        assert!((zero.at(place) - drift(place)).abs() < 1e-15);
    }
    assert_eq!(zero.at(100), drift(99));
    assert_eq!(Zero::new(&[]).at(7), 0.0);
    assert_eq!(Zero::new(&[(4, 2.0)]).at(0), 2.0);
    assert!((zero.drift() - (drift(99) - drift(1))).abs() < 1e-15);
    assert_eq!(Zero::outliers(&readings, 1e-2), [] as [usize; 0]);
    let mut wrong = readings;
    wrong[4].1 += 5e-3;
    assert_eq!(Zero::outliers(&wrong, 1e-2), [55]);
    let few = [(0, 1930.15), (7, 1930.18), (14, 0.0), (21, 1930.14)];
    assert_eq!(Zero::outliers(&few, 1850.0), [14]);
    assert_eq!(Zero::outliers(&few[..3], 1850.0), [14]);
    assert_eq!(Zero::outliers(&[(0, 1.0), (7, 1.4), (14, 2.0)], 2.0), [] as [usize; 0]);
    assert_eq!(Zero::outliers(&few[1..3], 1850.0), [] as [usize; 0]);
}

/// The zero that taps of signals g and −ratio g above `zero` tell, with noise of `share` of g, two of them wrong; of one side where `ratio` is
/// negative.
fn told(at: f64, ratio: f64, share: f64) -> Option<[f64; 2]> {
    let mut random = 1_u64;
    let mut noise = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as f64 / f64::from(1 << 30) - 1.0
    };
    let taps = (0..48).map(|k| {
        let (a, drive) = (20.0 + 3.0 * f64::from(k % 8), 1.0 + f64::from(k / 8 % 3));
        let g = 300.0 * drive / (a * a) * (1.0 + share * noise());
        let wrong = if k < 2 { 0.4 } else { 0.0 };
        let side = if k < 24 { g } else { -ratio * g * (1.0 + 0.01 * g) };
        ((0, [a, drive]), at + wrong + side)
    });
    zero(taps)
}

#[test]
fn both_sides_tell_their_zero_wherever_it_is() {
    for (at, ratio) in [(0.0, 1.0), (0.3, 0.8), (-7.0, 1.3), (50.0, 0.4)] {
        let [found, error] = told(at, ratio, 3e-3).unwrap();
        assert!((found - at).abs() < 4.0 * error && error < 0.01, "{found} ± {error} for {at}");
    }
}

#[test]
fn sides_of_other_places_tell_it_by_their_laws() {
    let taps = |at: f64, both: bool| -> Vec<[f64; 3]> {
        let of = |k: i32| {
            let side = if both && k % 3 == 0 { -0.7 } else { 1.0 };
            let (a, u) = (20.0 + 3.1 * f64::from(k % 7) + 0.3 * side, 1.0 + f64::from(k % 4) + 0.2 * side);
            [a, u, at + side * 40.0 * u * a.powf(-1.4) * (1.0 + 0.02 * u) * (1.0 + 1e-3 * f64::from(k).sin())]
        };
        (0..42).map(of).collect()
    };
    for at in [0.0, 0.4, -3.0] {
        let [found, error] = of_laws(&taps(at, true)).unwrap();
        assert!((found - at).abs() < 3.0 * error && error < 0.1, "{found} ± {error} for {at}");
        assert_eq!(of_laws(&taps(at, false)), None);
    }
    // Two labels are exchanged.
    let exchanged = |k: i32| [65.0, 75.0, 95.0, 85.0][k as usize / 5];
    let one_drive: Vec<[f64; 3]> =
        (0..20).map(|k| [exchanged(k), 1.0, 9.0 - f64::from(k / 5) + 0.01 * f64::from(k).sin()]).collect();
    assert_eq!(of_laws(&one_drive), None);
}

#[test]
fn repeats_of_one_side_tell_none() {
    for share in [0.0, 3e-3, 0.1] {
        assert_eq!(told(0.3, -1.0, share), None);
    }
}
