//! Calibrations that could mislead: rounded labels, quantised readings, the wrong whisker, exchanged columns.

use crate::common::measuring::undescribed;
use crate::common::measuring::{REAL, calibrated, data, fresh, locator, prototype, rewritten, rig, table};
use crate::common::random::Random;
use vibrissa::calibrate::{Calibrated, Options, Reason, calibrate};
use vibrissa::estimator::Estimator;
use vibrissa::measure::Row;
use vibrissa::scene::Drive;
use vibrissa::simulate::Settings;
use vibrissa::status::Status;

const NOISE: f64 = 1e-5;
const RANGE: &str = "[tap]\na = { from = 21, to = 48, step = 3 }\ntheta = [1, 2, 3, 4, 6, 8]\n";

fn noisy() -> Settings {
    Settings { repeats: 2, noise: NOISE, zero_every: Some(20), ..Settings::default() }
}

fn spec(d: f64, model: &str) -> String {
    prototype(d, &["noise_strain = 1e-5\n", RANGE, model])
}

fn rows(table: &str, signal: &str, f: impl FnMut(usize, &Row) -> [f64; 3]) -> String {
    rewritten(table, &format!("a_mm,theta_deg,{signal}"), f)
}

fn without_whisker(table: &str) -> Calibrated {
    undescribed(table, Drive::Angle, 60.0)
}

fn told(found: &Calibrated, what: &str) -> bool {
    found.warnings.iter().any(|w| w.contains(what))
}

/// Far taps weaker than the noise: distances over a range of 1 to 10, 3 repeats.
#[test]
fn rows_whose_noise_turns_their_sign_are_used() {
    let mut dice = Random(7);
    let mut turned = 0;
    for set in 0..6 {
        let signal = |a: f64, u: f64| 1e-2 * (u / 6.0) * (10.0 / a).powf(2.4);
        let noise = (0.3 + 0.12 * f64::from(set)) * signal(100.0, 1.0);
        let mut text = String::from("a_mm,theta_deg,strain\n");
        let zeros = if set % 2 == 0 { 12 } else { 0 };
        (0..zeros).for_each(|_| text += &format!(",0,{}\n", noise * dice.normal()));
        for k in 0..96 {
            let (a, u) =
                (10.0 * 10f64.powf(f64::from(k / 12) / 7.0), [1.0, 2.0, 4.0, 6.0][k as usize / 3 % 4]);
            text += &format!("{a},{u},{}\n", signal(a, u) + noise * dice.normal());
        }
        let slipped = text.replacen("\n10,6,", "\n10,6,-", 1);
        for (text, others) in [(&text, 0), (&slipped, 1)] {
            let found = without_whisker(text);
            let other = found.taps.iter().filter(|t| t.reason == Some(Reason::OtherSide)).count();
            let away = found.taps.iter().filter(|t| t.reason.is_some()).count();
            assert_eq!((found.sides.len(), other), (1, others), "set {set}");
            assert!(away <= others + 1, "set {set}: {away}");
            turned += found.taps.iter().filter(|t| t.signal < 0.0 && t.reason.is_none()).count();
        }
    }
    assert!(turned >= 6, "{turned}");
}

#[test]
fn rounding_makes_no_positions_of_repeats() {
    let visits: Vec<String> =
        (0..24).map(|k| format!("{}", 61.0 + f64::from(k / 3) * 3.25 + 0.003 * f64::from(k % 3))).collect();
    let whisker = format!(
        "[whisker]\nD = 6\nd = 3\nL_a = 100\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-5\n[tap]\na = [{}]\ntheta = [1, 2.3, 4, 6]\n{REAL}",
        visits.join(", ")
    );
    let plain = table(&whisker, &Settings { repeats: 1, ..noisy() });
    let off = |k: usize| (k as f64 * 0.618).fract() - 0.5;
    let single = |x: f64| f64::from(x as f32);
    let roughened: [&dyn Fn(usize, f64) -> f64; 5] = [
        &|k, x| if k == 50 { x.next_up() } else { x },
        &|k, x| x + 61.0 * 1e-15 * (9.0 * off(k)).round(),
        &|k, x| x * (1.0 + 2e-12 * off(k)) + 1e-13 * off(k),
        &|k, x| if k % 2 == 0 { single(x) } else { x },
        &|_, x| (x * 1e6).round() / 1e6,
    ];
    let judged = |text: &str| {
        let found = [calibrated(text, &whisker, &[]), without_whisker(text)];
        found.map(|c| {
            let s = &c.sides[0];
            let rms = s.held_out(Estimator::Curve).unwrap().rms(|_| true);
            let counts = (s.table.distances.len(), s.table.drives.len(), c.zeros.len());
            (counts, c.winner.word(), (1e6 * rms.0.unwrap()).round())
        })
    };
    let clean = judged(&rows(&plain, "strain", |_, r| [r.a, r.drive, r.value]));
    assert_eq!((clean[0].0.0, clean[0].0.1), (8, 4));
    for (way, rough) in roughened.iter().enumerate() {
        let text = rows(&plain, "strain", |k, r| [rough(k, r.a), rough(k + 7, r.drive), r.value]);
        assert_eq!(judged(&text), clean, "way {way}");
    }
    // Rounded drives count as calibrated, and as rest near 0.
    let located = locator(&calibrated(&plain, &whisker, &[]), None);
    assert!(located.locate(6.0 * (1.0 + 6e-8), 0.01).status != Status::OUTSIDE_CALIBRATION);
    assert!(located.rests(5.6e-17) && !located.rests(1e-3));
}

#[test]
fn readings_in_steps_are_no_end_stop() {
    let whisker = spec(7.0, REAL);
    let [measured, asked] = [&whisker, &fresh(&whisker, [22.0, 47.0], 25)].map(|s| table(s, &noisy()));
    let largest = data(&measured).rows.iter().map(|r| r.value).fold(0.0, f64::max);
    // Converters of 12 to 6 bits, using their full range or part of it, with offset, inverted.
    for (full, step, offset) in [
        (4000.0, 1.0, 0.0),
        (4000.0, 4.0, 17.0),
        (255.0, 1.0, 0.0),
        (60.0, 1.0, 2.0),
        (-450.0, 1.0, 480.0),
        (3.3, 0.05, 0.4),
    ] {
        let shown = |r: &Row| (r.value / largest * full / step).round() * step + offset;
        let text = |t: &str| rows(t, "reading", |_, r| [r.a, r.drive, shown(r)]);
        for found in [calibrated(&text(&measured), &whisker, &[]), without_whisker(&text(&measured))] {
            let suspects: Vec<_> = found.taps.iter().filter_map(|t| t.reason.clone()).collect();
            assert!(suspects.is_empty(), "{full}: {suspects:?}");
            assert!(found.calibration.sides[0].end_stop.is_none() && !told(&found, "end stop"));
            assert!(found.calibration.noise >= 0.28 * step, "{full}: {}", found.calibration.noise);
            let located = locator(&found, None);
            for r in data(&text(&asked)).rows.iter().filter(|r| r.drive > 0.0) {
                let at = located.locate(r.drive, r.value - offset);
                assert!(at.distance.is_finite(), "{full}: {r:?} {at:?}");
            }
        }
    }
}

#[test]
fn an_end_stop_is_found_at_both_ends_and_told() {
    let whisker = spec(7.0, REAL);
    let far = whisker.replace("l = 2", "l = 2\nside = \"far\"");
    let [one, other] = [&whisker, &far].map(|s| table(s, &noisy()));
    let both = format!("{one}{}", other.split_once('\n').unwrap().1);
    let largest = data(&one).rows.iter().map(|r| r.value).fold(0.0, f64::max);
    for (share, step) in [(0.5, 1e-9), (0.7, 1.0 / 2000.0), (0.8, 1.0 / 500.0)] {
        let stop = largest * share;
        let shown = |x: f64| (x.clamp(-stop, stop) / (largest * step)).round() * step;
        let text = rows(&both, "reading", |_, r| [r.a, r.drive, shown(r.value)]);
        let found = calibrated(&text, &whisker, &[]);
        let end = shown(stop);
        for t in &found.taps {
            assert_eq!(t.reason == Some(Reason::Saturated), t.value.abs() == end, "{share}: {t:?}");
        }
        let stops = found.warnings.iter().filter(|w| w.contains("end stop")).count();
        assert_eq!((found.sides.len(), stops), (2, 2), "{:?}", found.warnings);
        let located = locator(&found, None);
        for sign in [1.0, -1.0] {
            assert_eq!(located.locate(8.0, sign * 1.001 * end).status, Status::STRAIN_LIMIT);
            assert!(located.locate(8.0, sign * 0.97 * end).distance.is_finite());
        }
    }
    // An end stop at one end only; a reading beyond the value excludes it.
    let [one_end, beyond] = [0.0, 0.2].map(|more| {
        let mut first = true;
        rows(&one, "strain", |_, r| {
            let over = r.value > 0.6 * largest;
            let value = 0.6 * largest + if over && std::mem::take(&mut first) { more * largest } else { 0.0 };
            [r.a, r.drive, if over { value } else { r.value }]
        })
    });
    assert!(calibrated(&one_end, &whisker, &[]).calibration.sides[0].end_stop.is_some());
    assert!(calibrated(&beyond, &whisker, &[]).calibration.sides[0].end_stop.is_none());
}

#[test]
fn a_whisker_that_is_another_one_is_told() {
    let measured = table(&spec(4.0, REAL), &noisy());
    let plain =
        |factor: f64, off: f64| rows(&measured, "strain", |_, r| [r.a + off, r.drive, factor * r.value]);
    let question = "Is this the whisker that was measured?";
    let right = calibrated(&plain(1.0, 0.0), &spec(4.0, REAL), &[]);
    assert!(!told(&right, question) && right.winner == Estimator::Learned, "{:?}", right.warnings);
    let with = |from: &str, to: &str| spec(4.0, REAL).replace(from, to);
    let wrong = [
        (with("D = 10", "D = 8"), 1.0, 0.0),
        (with("D = 10", "D = 11"), 1.0, 0.0),
        (with("d = 4", "d = 5"), 1.0, 0.0),
        (with("L_a = 50", "L_a = 60"), 1.0, 0.0),
        (with("x_ss = 5", "x_ss = 8"), 1.0, 0.0),
        (with("L_a = 50", "L_a = 70"), 1.0, 20.0),
        (with("L_a = 50", "L_a = 52"), 1.0, 2.0),
        // A wrong gauge factor: distances do not change.
        (spec(4.0, REAL), 2.21 / 2.0, 0.0),
    ];
    for (spec, factor, off) in wrong {
        let found = calibrated(&plain(factor, off), &spec, &[]);
        let said: Vec<_> = found.warnings.iter().filter(|w| w.contains(question)).collect();
        assert!(said.len() == 1 && said[0].contains("D, d, L_a"), "{spec} {:?}", found.warnings);
    }
    // A `reading` has an arbitrary factor.
    let counts = rows(&measured, "reading", |_, r| [r.a, r.drive, 4.7e4 * r.value]);
    assert!(!told(&calibrated(&counts, &spec(4.0, REAL), &[]), question));
}

#[test]
fn rows_that_only_the_model_misses_are_used() {
    let taps = "[tap]\na = { from = 25, to = 70, step = 5 }\ntheta = [1, 2, 3, 4, 5, 6, 7, 8]\n";
    let whisker = |contact: &str| {
        format!(
            "[whisker]\nD = 6\nd = 3\nL_a = 80\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-5\n{taps}{REAL}{contact}"
        )
    };
    for (mu, repeats) in [(0.3, 1), (0.3, 3), (0.6, 1), (0.6, 2), (0.6, 3)] {
        let truth = whisker(&format!("contact = {{ coulomb = {mu} }}\n"));
        let measured = table(&truth, &Settings { repeats, ..noisy() });
        let suspects = |text: &str| -> Vec<(usize, Reason)> {
            let found = calibrated(text, &whisker(""), &[]);
            found.taps.iter().filter_map(|t| Some((t.line, t.reason.clone()?))).collect()
        };
        assert_eq!(suspects(&measured), [], "friction {mu}, {repeats} repeats");
        let wrong =
            rows(&measured, "strain", |k, r| [r.a, r.drive, if k == 40 { 1.05 * r.value } else { r.value }]);
        let lines: Vec<usize> = suspects(&wrong).into_iter().map(|s| s.0).collect();
        assert_eq!(lines, [42], "friction {mu}, {repeats} repeats");
    }
}

#[test]
fn no_estimator_that_answers_nothing_is_the_default() {
    // Without zero readings the swapped drives contain more taps that no rod can have.
    let swap = |a: &str, theta: &str, zero_every| {
        let spec =
            prototype(4.0, &["noise_strain = 1e-5\n", &format!("[tap]\na = {a}\ntheta = {theta}\n"), REAL]);
        let swapped = |_, r: &Row| [r.drive, if r.drive == 0.0 { 0.0 } else { r.a }, r.value];
        (rows(&table(&spec, &Settings { zero_every, ..noisy() }), "strain", swapped), spec)
    };
    for (a, theta, zero_every) in [
        ("[21, 30, 39, 48]", "[2, 4, 6, 8]", Some(20)),
        ("[30, 40]", "[3, 6, 7]", None),
        ("[25, 30, 35, 40]", "[6, 8]", None),
    ] {
        let (swapped, spec) = swap(a, theta, zero_every);
        let why = calibrate(&data(&swapped), &rig(&spec), &Options::default()).unwrap_err().to_string();
        assert!(why.contains("a_mm and theta_deg swapped") && why.contains("curve answers nothing"), "{why}");
    }
    // With more drives, a strange calibration would be possible.
    let (swapped, spec) = swap("[21, 30, 39, 48]", "[1, 2, 4, 6, 7, 8, 9]", Some(20));
    let why = calibrate(&data(&swapped), &rig(&spec), &Options::default()).unwrap_err().to_string();
    assert!(why.contains("grows with the distance") && why.contains("a_mm and theta_deg exchanged"), "{why}");
    let two = prototype(4.0, &["noise_strain = 1e-5\n[tap]\na = [30, 40]\ntheta = [2, 4, 8]\n", REAL]);
    let found = calibrated(&table(&two, &noisy()), &two, &[]);
    assert!(found.winner == Estimator::Learned);
    assert!(
        Estimator::ALL.iter().any(|e| found.sides[0].held_out(*e).is_none_or(|h| h.rms(|_| true).1 == 0))
    );
}
