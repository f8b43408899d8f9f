//! What is read of a lab's columns, number by number: values that stand for none, counts that begin anew, jitter, wild zeros, drives by their names.

use vibrissa::measure::columns::Columns;
use vibrissa::measure::counts::{Count, turn, unwrapped};
use vibrissa::measure::group::{Groups, rounded};
use vibrissa::measure::zero::Zero;
use vibrissa::measure::{Names, Row, Unit, missing};

/// Values that stand for none, of signals at rest and of `taps` in cells of their own.
fn none(rests: &[f64], taps: &[f64]) -> Vec<f64> {
    let row = |a, drive, value| Row { line: 1, a, drive, value, late: 0.0, run: 0, t: 0.0, text: 0 };
    let taps = taps.iter().zip(20_u32..).map(|(x, a)| row(a.into(), 3.0, *x));
    let mut rows: Vec<Row> = rests.iter().map(|x| row(25.0, 0.0, *x)).chain(taps).collect();
    let mut found: Vec<f64> = missing::take(&mut rows, ["a", "u", "y"]).iter().map(|m| m.value).collect();
    found.dedup();
    found
}

#[test]
fn values_that_stand_for_none_are_told_from_readings() {
    let strain = [0.0159, 0.0318, 0.0477, 0.0139, 0.0279, 0.0419];
    let rests = [-2.5e-6, 1.1e-5, 0.0];
    for x in [-9999.0, 9999.0, -999.0, -1.0, 99999.0, 9.9e37, -3.4e38] {
        assert_eq!(none(&rests, &[&strain[..], &[x]].concat()), [x], "{x}");
        assert_eq!(none(&rests, &[&strain[..], &[x, x]].concat()), [x], "{x} twice");
    }
    assert_eq!(none(&[412.0, 411.0], &[1367.0, 2322.0, 3277.0, 1250.0, -1.0]), [-1.0]);
    assert_eq!(none(&rests, &[&strain[..], &[-77.0, -77.0]].concat()), [-77.0]);
    assert_eq!(none(&rests[..2], &[&strain[..], &[0.0; 4]].concat()), [0.0]);
    let micro: Vec<f64> = strain.iter().map(|x| 1e6 * x + 0.25).chain([9999.0, 9999.0]).collect();
    assert_eq!(none(&[2.56], &micro), [9999.0]);
    // The other side, an end stop, a row in another unit. 0 is what a weak tap shows, and a sensor at rest.
    for (rests, taps) in [
        (&[0.0, 1.0][..], &[-1.0, -2.0, 3.0, 4.0, -3.0][..]),
        (&[0.1, 0.2], &[1.1, 2.3, 3.9, 5.0, 5.0, 5.0]),
        (&[0.0, 1e-5], &[0.012, 0.014, 0.016, 16_123.0]),
        (&[-1e-5, 1e-5], &[0.012, 0.014, 1e-4, 0.0, 0.0]),
        (&[0.0, 1e-5], &[0.012, 0.014, 0.016, 0.0, 0.0]),
        (&[998.0, 999.0, 1000.0], &[1367.0, 2322.0, 3277.0, 1250.0]),
    ] {
        assert!(none(rests, taps).is_empty(), "{taps:?}");
    }
}

/// Counts of five distances and five drives, thrice, after as many without contact: as `value` makes them of place and signal.
fn rig(value: impl Fn(usize, f64) -> f64) -> Vec<Count> {
    let rest = |run: usize| ([9.0, 0.0], 150.0 * run as f64);
    let at = |k: usize| [k / 5 + 1, k % 5 + 1].map(|n| n as f64);
    let tap = move |run, k| (at(k), rest(run).1 + 14_000.0 + 2_500.0 * at(k)[1] * (1.0 + 0.2 * at(k)[0]));
    let all = (0..3).flat_map(|run| (0..26).map(move |k| if k == 0 { rest(run) } else { tap(run, k - 1) }));
    all.enumerate().map(|(k, (at, x))| Count { at, value: value(k, x) }).collect()
}

#[test]
fn counts_that_begin_anew_are_joined_and_no_others() {
    let joined = |plain: &[Count]| {
        let counted: Vec<Count> =
            plain.iter().map(|c| Count { value: c.value.rem_euclid(65_536.0), ..*c }).collect();
        let at = turn(&counted);
        let off = |k: usize| unwrapped(counted[k].value, at) - plain[k].value;
        assert!((0..plain.len()).all(|k| (off(k) - off(0)).abs() < 1e-6), "{:?}", plain[0]);
    };
    // Wherever the range ends; taps of both sides about its end.
    (0..22).for_each(|k| joined(&rig(|_, x| 1.4 * x + 3_000.0 * f64::from(k))));
    for rest in [660.0, 65_400.0] {
        let side = |k: usize| if (k / 26).is_multiple_of(2) { 0.4 } else { -0.4 };
        joined(&rig(|k, x| rest + (x - 14_000.0) * side(k)));
    }
    // A dropout, a stuck sensor, a row with a wrong label, both sides about the middle, a signal that fills the range far from the zero.
    let one = |(place, value)| rig(move |k, x| if k == place { value } else { 1.5 * x + 4_000.0 });
    let mut all = [(12, 0.0), (12, 500.0), (25, 65_000.0), (40, 3_000.0), (0, 60_000.0)].map(one).to_vec();
    all.push(rig(|k, x| 32_768.0 + if k % 2 == 0 { x } else { -x } * 0.6));
    let wide = |a: f64, u: f64| Count { at: [a, u], value: 1e6 * (u + 9.1) * (1.0 / a - 1.0 / 185.0) };
    let taps =
        [117.0, 126.0, 135.0, 144.0].into_iter().flat_map(|a| [2.0, 4.0, 6.0, 8.0, 10.5].map(|u| wide(a, u)));
    all.push(taps.chain([0.0, 200.0].map(|value| Count { at: [144.0, 0.0], value })).collect());
    for (k, counts) in all.iter().enumerate() {
        assert_eq!(turn(counts), None, "{k}");
    }
}

#[test]
fn jitter_is_told_from_steps_and_rounding_from_both() {
    let centres = |values: &[f64]| -> Vec<f64> {
        Groups::of(values.iter().copied(), None, false)
            .centres
            .iter()
            .map(|x| (x * 1e3).round() / 1e3)
            .collect()
    };
    assert_eq!(centres(&[2.15, 2.17, 2.19, 4.15, 4.17, 6.15]), [2.17, 4.16, 6.15]);
    // Rounding within jitter within steps, and jitter of which two values happen to be close.
    let finer = [60.0, 60.004, 60.004000000000005, 65.0, 65.0000001, 65.003, 70.001, 75.0];
    assert_eq!(centres(&finer), [60.003, 65.001, 70.001, 75.0]);
    for plan in
        [&[0.5, 1.0, 2.0, 5.0, 10.0][..], &[0.5, 1.0, 1.5, 2.0, 2.5, 60.0], &[190.9, 196.2, 201.8, 276.1]]
    {
        assert_eq!(centres(plan), plan);
    }
    let rough = [70.75999999999999, 70.76, f64::from(70.76_f32), 0.1 + 0.2 - 0.3, -1e-7, 10.0, 10.00001];
    assert_eq!(rounded(&rough), [70.76, 70.76, 70.76, 0.0, 0.0, 10.0, 10.00001]);
}

#[test]
fn a_straight_drift_is_removed_exactly_and_wild_zeros_are_named() {
    let drift = |place: usize| 1e-3 + 2e-6 * place as f64;
    let mut readings = [0, 1, 2, 20, 55, 56, 99].map(|p| (p, drift(p)));
    let zero = Zero::new(&readings);
    assert!((3..99).all(|place| (zero.at(place) - drift(place)).abs() < 1e-15) && zero.at(100) == drift(99));
    assert!(Zero::outliers(&readings, 1e-2).is_empty());
    readings[4].1 += 5e-3;
    assert_eq!(Zero::outliers(&readings, 1e-2), [55]);
    let few = [(0, 1930.15), (7, 1930.18), (14, 0.0)];
    assert_eq!(Zero::outliers(&few, 1850.0), [14]);
    assert!(Zero::outliers(&[(0, 1.0), (7, 1.4), (14, 2.0)], 2.0).is_empty());
}

#[test]
fn what_looks_like_a_drive_is_asked_for_and_what_the_user_says_goes_first() {
    let find = |header: &str, said: &str| {
        let names: Vec<String> = header.split(',').map(str::to_owned).collect();
        Columns::find(&names, &Names::parse(said)?, None)
    };
    for (name, likely) in [
        ("Angle (deg)", "theta_deg"),
        ("displacement_mm", "delta_mm"),
        ("thetadeg", "theta_deg"),
        ("motor", "theta_deg or delta_mm"),
    ] {
        let e = find(&format!("a_mm,{name},strain"), "").unwrap_err();
        assert!(e.to_string().contains(likely) && e.key.as_deref() == Some(name), "{name}: {e}");
        assert!(find(&format!("a_mm,{name},strain"), &format!("ignore={name}")).is_ok());
        assert_eq!(name.contains(' '), e.allowed.unwrap().contains(&format!("'ignore={name}'")));
    }
    assert!(find("a_mm,run,t_s,temperature,operator,grade,comment,strain", "").is_ok());
    let c = find("a_mm,theta_deg,strain,strain_2", "strain=strain_2").unwrap();
    assert_eq!((c.signal, c.second), ((Unit::Strain, 3), None));
    let c = find("a_mm,tilt_deg,theta_deg,strain,reading_2,strain_2", "").unwrap();
    assert_eq!(
        (c.second, c.tilt, c.ignored),
        (Some((Unit::Strain, 5)), Some(1), vec!["reading_2".to_owned()])
    );
}
