//! Between a record and its files: plans of taps, terms and names of estimators, curves of objects, parts of an array, blocks of a text.

use std::f64::consts::FRAC_PI_2;
use std::io::Read;

use vibrissa::calibrate::planned::order::{BETWEEN, rows};
use vibrissa::contour::curve::{Arc, Covariance, Sample};
use vibrissa::contour::truth::Pose;
use vibrissa::error::InputError;
use vibrissa::estimator::model::form::Form;
use vibrissa::estimator::{ALL, SideRecord, named};
use vibrissa::locate::Locator;
use vibrissa::scene::Side;
use vibrissa::simulate::object::{Curve, Object};
use vibrissa::sink::shard::Shard;
use vibrissa::text_file::{LINE, Limit, TextFile};
use vibrissa_learned::plan::Tap;

#[test]
fn every_tap_is_there_once_with_zeros_around() {
    let taps: Vec<Tap> =
        (0..2).flat_map(|run| (0..9).flat_map(move |i| [[i, 0, run], [i, 2, run], [i, 2, run]])).collect();
    let rows = rows(&taps, 2, 5);
    let mut found: Vec<Tap> = rows.iter().filter_map(|r| Some([r.distance, r.drive?, r.run])).collect();
    let mut wanted = taps.clone();
    found.sort_unstable();
    wanted.sort_unstable();
    assert_eq!(found, wanted);
    let mut since = 0;
    for pair in rows.windows(2) {
        since = if pair[0].drive.is_none() { 0 } else { since + 1 };
        assert!(since <= BETWEEN && (pair[0].run == pair[1].run || pair[0].drive.is_none()));
    }
    assert!(rows[0].drive.is_none() && rows[rows.len() - 1].drive.is_none());
}

fn sample(at: [f64; 2], sigma: f64) -> Sample {
    Sample { at, covariance: Covariance([sigma * sigma, 0.0, sigma * sigma]), share: 1.0, group: 0 }
}

#[test]
fn a_circle_and_its_uncertainty_are_found() {
    let ring = |n: usize, noise: f64| -> Vec<Sample> {
        let at = |k: usize| {
            let t = 6.0 * k as f64 / n as f64;
            // Deviations that are of no system, and of that size.
            let off = 4.0 + noise * 2f64.sqrt() * (37.0 * (k as f64 + 0.3).powi(2)).sin();
            [1.0 + off * t.cos(), 2.0 + off * t.sin()]
        };
        (0..n).map(|k| sample(at(k), noise.max(1e-3))).collect()
    };
    let start = |s: &[Sample]| Arc::through(&[s[0].at, s[s.len() / 3].at, s[2 * s.len() / 3].at]).unwrap();
    let exact = ring(20, 0.0);
    let arc = start(&exact).fit(&exact, &[1.0; 20]).unwrap();
    let (centre, radius) = arc.circle().unwrap();
    assert!((radius - 4.0).abs() < 1e-9 && (centre[0] - 1.0).hypot(centre[1] - 2.0) < 1e-9);
    let noisy = ring(400, 0.1);
    let arc = start(&noisy).fit(&noisy, &[1.0; 400]).unwrap();
    let (radius, sigma) = (arc.circle().unwrap().1, arc.circle_deviations().unwrap().1);
    assert!((sigma / (0.1 / 20.0) - 1.0).abs() < 0.1, "{sigma}");
    assert!((radius - 4.0).abs() < 4.0 * sigma, "{radius} {sigma}");
    let (place, _) = arc.at(1.0);
    assert!(arc.deviation(place) > 0.8 * sigma && arc.deviation(place) < 3.0 * sigma);
}

#[test]
fn an_ellipse_is_that_of_its_axes() {
    let (sin, cos) = 0.4f64.sin_cos();
    let c = Covariance::default().along([cos, sin], 9.0).along([-sin, cos], 4.0);
    let ([major, minor], axis) = c.ellipse();
    assert!((major - 3.0).abs() < 1e-12 && (minor - 2.0).abs() < 1e-12);
    assert!((axis - 0.4f64.to_degrees()).abs() < 1e-10);
    assert!((c.of([cos, sin]) - 9.0).abs() < 1e-12);
}

#[test]
fn the_object_lies_where_the_whisker_turns_to() {
    let pose = Pose { base: [10.0, 20.0, 0.0], heading: FRAC_PI_2, sense: 1.0 };
    let near = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x - u).hypot(y - v) < 1e-12;
    assert!(near(pose.place([30.0, 2.0]), [8.0, 50.0]));
    assert!(near(Pose { sense: -1.0, ..pose }.place([30.0, 2.0]), [12.0, 50.0]));
    assert!(near(pose.nearer(5.0).place([30.0, 2.0]), [8.0, 55.0]));
    assert!(near(pose.turned(FRAC_PI_2).place([30.0, 0.0]), [-20.0, 20.0]));
    assert!(near(Pose { sense: -1.0, ..pose }.turned(FRAC_PI_2).place([30.0, 0.0]), [40.0, 20.0]));
}

#[test]
fn terms_are_counted_without_listing_them() {
    for degree in 0..=5 {
        for drive_degree in 0..=6 {
            let form = Form { degree, drive_degree, log_a: true, log_drive: false };
            assert_eq!(form.terms_in_all(), form.powers().len(), "{form:?}");
        }
    }
    // A number that a fuzzer wrote into a calibration, whose terms took 18 s and 1 GB.
    let form = Form { degree: 145_360_818, drive_degree: 1, log_a: false, log_drive: true };
    assert_eq!(form.terms_in_all(), 290_721_637);
    let most = i64::MAX as usize;
    Form { degree: most, drive_degree: most, log_a: false, log_drive: true }.terms_in_all();
}

#[test]
fn a_section_has_the_name_of_its_estimator() {
    let text = ALL.map(|e| format!("[{}]\n", e.name())).concat();
    let sections: toml::Table = toml::from_str(&text).unwrap();
    assert_eq!(sections.len(), ALL.len(), "names differ");
    let record = SideRecord::new(1, Side::Contact, [20.0, 40.0], vec![4.0]);
    for e in ALL {
        assert!(!e.is_in(&record) && named(e.name()) == Some(e));
        // A section that is known is read, and found to hold nothing.
        let mut table = toml::Table::try_from(&record).unwrap();
        table.insert(e.name().to_owned(), toml::Table::new().into());
        let refused = table.try_into::<SideRecord>().unwrap_err().to_string();
        assert!(refused.contains("missing field"), "{refused}");
    }
}

#[test]
fn threads_share_a_locator() {
    fn shared<T: Send + Sync>() {}
    shared::<Locator>();
}

#[test]
fn a_curve_through_points_of_a_circle_is_nearly_one() {
    let points = |n: usize, turns: f64| {
        (0..n).map(|k| turns * k as f64 / n as f64).map(|t| [7.0 * t.cos(), 7.0 * t.sin()]).collect()
    };
    let tau = std::f64::consts::TAU;
    let closed = Curve::new(points(24, tau), true).unwrap();
    for k in 0..100 {
        let t = closed.length() * f64::from(k) / 100.0;
        let place = closed.at(t);
        let [x, y] = place.at;
        assert!((x.hypot(y) - 7.0).abs() < 1e-3 && (place.bend * 7.0 - 1.0).abs() < 0.03, "{place:?}");
        let tangent = (y.atan2(x) + tau / 4.0 - place.direction).rem_euclid(tau);
        assert!(tangent.min(tau - tangent) < 2e-3);
    }
    // Clockwise points are turned round; an open curve ends without bend.
    assert!(Curve::new(points(24, -tau), true).unwrap().at(1.0).bend > 0.0);
    let open = Curve::new(points(12, 2.0), false).unwrap();
    assert!(open.at(0.0).bend.abs() < 1e-12 && open.at(open.length()).bend.abs() < 1e-12);
    assert!(Curve::new(vec![[0.0; 2]; 5], true).is_none() && Curve::new(points(3, 2.0), false).is_none());
}

#[test]
fn distances_are_from_the_edge() {
    let square = Object::boxed([0.0, 0.0], [4.0, 2.0], 0.0);
    for (p, d) in [([0.0, 3.0], 2.0), ([3.0, 2.0], 2f64.sqrt()), ([0.0, 0.0], 1.0), ([-5.0, 0.0], 3.0)] {
        assert!((square.distance(p) - d).abs() < 1e-9, "{p:?} {}", square.distance(p));
        assert!((square.mirrored().distance([p[0], -p[1]]) - d).abs() < 1e-9);
    }
    let circle = Object::Circle { centre: [1.0, 2.0], radius: 3.0 };
    assert_eq!(circle.distance([1.0, 7.0]), 2.0);
}

#[test]
fn parts_leave_nothing_out_and_are_even() {
    for n in [0, 1, 2, 7, 64, 1000, u64::MAX / 3] {
        for of in [1, 2, 3, 7, 64, 1000] {
            let parts: Vec<_> = (1..=of).map(|index| Shard { index, of }.designs(n)).collect();
            assert_eq!((parts[0].start, parts[of as usize - 1].end), (0, n));
            assert!(parts.windows(2).all(|w| w[0].end == w[1].start));
            let sizes = parts.iter().map(|p| p.end - p.start);
            assert!(sizes.clone().max().unwrap() - sizes.min().unwrap() <= 1, "{n} over {of}");
        }
    }
}

#[test]
fn names_are_read_as_they_are_written() {
    let shard = Shard { index: 3, of: 12 };
    assert_eq!((shard.to_string().parse(), Shard::of_folder(&shard.folder())), (Ok(shard), Some(shard)));
    for text in ["0/3", "4/3", "1/0", "1", "1/2/3", "a/b", "-1/3", "1/1000001", "+1/2 "] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
    for name in ["shard-01-of-2", "shard-3-of-2", "shard-1-of-2-old", "shards"] {
        assert_eq!(Shard::of_folder(name), None, "{name}");
    }
}

#[test]
fn tasks_of_an_array_are_parts() {
    // Number, count, smallest and largest number, and step.
    for (all, said) in [
        ("0 4 0 3 1", "1/4"),
        ("4 4 1 4", "4/4"),
        ("6 3 2 6 2", "3/3"),
        // Tasks 3 and 5 alone, as one would send failed ones again.
        ("5 2 3 5 1", "even steps"),
        ("4 2 3 5 2", "even steps"),
        ("- - - - -", "SLURM_ARRAY_TASK_ID is not set"),
        ("x 1 0 0 1", "SLURM_ARRAY_TASK_ID = x is no number"),
        ("3 4 - 4 1", "SLURM_ARRAY_TASK_MIN"),
        ("3 4 1 - 1", "SLURM_ARRAY_TASK_MAX"),
        ("7 1 7 7 1", "task 7 of 1"),
        ("1 1 1 1 1", "one task alone"),
        ("3 4 1 4 0", "not an array"),
        ("0 0 0 0 0", "not an array"),
    ] {
        let of = |name: &str| {
            let at = ["ID", "COUNT", "MIN", "MAX", "STEP"].iter().position(|n| name.ends_with(n))?;
            all.split(' ').nth(at).filter(|text| *text != "-").map(str::to_owned)
        };
        let found = Shard::of_slurm(of).map_or_else(|why| why, |shard| shard.to_string());
        assert!(found.contains(said), "{all}: {found}");
    }
}

/// Gives `bytes` in pieces of `step`.
struct Slow<'a>(&'a [u8], usize);

impl Read for Slow<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.1.min(buffer.len());
        (&mut self.0).take(n as u64).read(buffer)
    }
}

fn read(bytes: &[u8], step: usize, limit: Limit) -> Result<String, InputError> {
    TextFile::new(Slow(bytes, step), "a.csv", "data", limit).text()
}

#[test]
fn text_is_the_same_in_blocks_of_any_size() {
    let text = "\u{feff}µ,°\r\n1,𝜃\n".repeat(3);
    for step in 1..40 {
        let found = read(text.as_bytes(), step, Limit::Whole).unwrap();
        assert_eq!(found, text.strip_prefix('\u{feff}').unwrap(), "{step}");
    }
}

#[test]
fn what_is_no_text_is_refused_at_its_line() {
    for (bytes, line) in
        [(&b"a\nb\0"[..], 2), (b"a\n\n\xff", 3), (b"a\xc2", 1), (b"\xc2a\n", 1), (b"a\n\xf0\x9f\nb", 2)]
    {
        for step in [1, 2, 3, 100] {
            let error = read(bytes, step, Limit::Lines).unwrap_err();
            assert_eq!((error.line, error.file.as_deref()), (Some(line), Some("a.csv")), "{bytes:?}");
        }
    }
}

#[test]
fn the_longest_line_is_read_and_a_longer_one_refused() {
    for step in [1000, 65_536, 1 << 22] {
        let long = |n: usize| format!("a\n{}\nb\n", "x".repeat(n)).into_bytes();
        assert!(read(&long(LINE), step, Limit::Lines).is_ok());
        let error = read(&long(LINE + 1), step, Limit::Lines).unwrap_err();
        assert_eq!(error.line, Some(2), "{error}");
        assert!(read(&long(LINE + 1), step, Limit::Whole).is_ok());
    }
}
