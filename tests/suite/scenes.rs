//! What is asked: axes and samples, designs and strokes, channels, words, the places of mistakes.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use vibrissa::combinations::Combinations;
use vibrissa::curve::lost;
use vibrissa::excerpt::{Excerpt, WIDE, harmless};
use vibrissa::physics::linear::StrainCurve;
use vibrissa::physics::pole::{Planar, Pole, Rig};
use vibrissa::physics::taper::Taper;
use vibrissa::scene::axis::Points;
use vibrissa::scene::channels::MOST_CHANNELS;
use vibrissa::scene::sampler::{MAX_DIMENSIONS, MAX_SAMPLES, Sampler, philox, sobol};
use vibrissa::scene::{Axis, Channels, Column, Drive, Factor, Layout, Listed, Model, Signal, Tuple};
use vibrissa::status::Status;
use vibrissa_core::contact::Contact;

fn values(axis: &Axis) -> Vec<f64> {
    axis.iter().collect()
}

#[test]
fn steps_are_the_decimal_numbers_one_expects() {
    let step = Axis::step(0.5, 10.0, 0.1).unwrap();
    assert_eq!(step.len(), 96);
    for (i, x) in step.iter().enumerate() {
        assert_eq!(x, format!("{}.{}", (5 + i) / 10, (5 + i) % 10).parse::<f64>().unwrap());
    }
    assert_eq!(values(&Axis::steps(0.5, 10.0, 96).unwrap()), values(&step));
    assert_eq!(values(&Axis::step(0.0, 0.9, 0.3).unwrap()), [0.0, 0.3, 0.6, 0.9]);
    assert_eq!(values(&Axis::steps(-0.3, 0.3, 3).unwrap()), [-0.3, 0.0, 0.3]);
    assert_eq!(values(&Axis::steps(0.0, 1.0, 4).unwrap()), [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]);
}

#[test]
fn step_stops_at_the_last_value_not_beyond_to() {
    assert_eq!(values(&Axis::step(1.0, 2.0, 0.4).unwrap()), [1.0, 1.4, 1.8]);
    assert_eq!(values(&Axis::step(1.0, 1.0, 0.4).unwrap()), [1.0]);
    assert_eq!(values(&Axis::step(1.0, 1.2, 0.4).unwrap()), [1.0]);
    let third = Axis::step(0.0, 1.0, 1.0 / 3.0).unwrap();
    assert_eq!((third.len(), third.at(3)), (4, 1.0));
}

#[test]
fn logarithmic_steps() {
    let axis = Axis::log_steps(0.1, 10.0, 3).unwrap();
    assert_eq!((axis.at(0), axis.at(2)), (0.1, 10.0));
    assert!((axis.at(1) - 1.0).abs() < 1e-15);
    assert_eq!(Axis::log_steps(0.0, 1.0, 3).unwrap_err().key.as_deref(), Some("from"));
}

#[test]
fn long_axes_cost_nothing() {
    let axis = Axis::steps(0.0, 1.0, 1 << 40).unwrap();
    assert_eq!(axis.at((1 << 40) - 1), 1.0);
    assert!((axis.at(1 << 39) - 0.5).abs() < 1e-11);
    let extreme = Axis::steps(-1e300, 1e300, 1 << 40).unwrap();
    assert!(extreme.at(1 << 39).is_finite());
}

#[test]
fn samples_stay_inside_and_repeat() {
    let points = Points { samples: MAX_SAMPLES, sampler: Sampler::Sobol, seed: 0 };
    let axis = Axis::samples(8.0, 12.0, false, points, 0).unwrap();
    assert_eq!(axis.at(0), 8.0 + 4.0 * 0.5 / 4_294_967_296.0);
    assert!((axis.at(1) - 10.0).abs() < 1e-8);
    assert!(axis.at(MAX_SAMPLES - 1) < 12.0);
    let log = Axis::samples(0.1, 10.0, true, points, 0).unwrap();
    assert!((log.at(1) - 1.0).abs() < 1e-8);
}

#[test]
fn white_noise_has_the_covariance_undone() {
    let covariance = vec![4.0, 1.0, 1.0, 9.0];
    let channels = Channels::of(&[Signal::Moment, Signal::Force], Some(covariance.clone())).unwrap();
    // W C Wᵀ = 1, column by column.
    let column = |k: usize| {
        let mut unit = [0.0; MOST_CHANNELS];
        unit[k] = 1.0;
        channels.white(&unit, &unit)
    };
    let w = [column(0), column(1)];
    let normal = [0.3, -1.2, 0.0, 0.0, 0.0, 0.0];
    let back = channels.white(&channels.noise(&normal), &normal);
    assert!((0..2).all(|k| (back[k] - normal[k]).abs() < 1e-14));
    for i in 0..2 {
        for j in 0..2 {
            let sum: f64 = (0..4).map(|m| w[m / 2][i] * covariance[m] * w[m % 2][j]).sum();
            assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-14);
        }
    }
    assert!(Channels::of(&[Signal::Moment, Signal::Force], Some(vec![1.0, 2.0, 2.0, 1.0])).is_none());
    assert!(Channels::of(&[Signal::Moment, Signal::Force], Some(vec![1.0, 1.0, 1.0, 1.0])).is_none());
}

/// An axis of its own.
fn alone(column: Column, values: &[f64]) -> Factor {
    Factor { axes: vec![(column, Axis::List(values.to_vec()))], len: values.len() as u64, properties: vec![] }
}

fn sampled(min: f64, max: f64, dimension: u32) -> Axis {
    let points = Points { samples: 5, sampler: Sampler::Sobol, seed: 0 };
    Axis::samples(min, max, false, points, dimension).unwrap()
}

#[test]
fn a_direction_sampled_with_the_drive_is_a_stroke() {
    let zipped = vec![(Column::Tilt, sampled(-20.0, 20.0, 0)), (Column::Drive, sampled(1.0, 2.0, 1))];
    let l = Layout::new(&[
        alone(Column::BaseDiameter, &[8.0, 10.0]),
        alone(Column::Distance, &[20.0, 30.0]),
        Factor { axes: zipped, len: 5, properties: vec![] },
        alone(Column::Lean, &[0.0, 5.0, 10.0]),
    ]);
    assert_eq!((l.n_designs, l.n_drives, l.n_directions, l.drives().is_some()), (2, 15, 15, false));
    let (first, second, fourth) = (l.tuple(0), l.tuple(1), l.tuple(3));
    assert_eq!((first.tilt, first.drive, first.lean), (second.tilt, second.drive, 0.0));
    assert_eq!((second.lean, fourth.lean), (5.0, 0.0));
    assert_ne!((fourth.tilt, fourth.drive), (first.tilt, first.drive));
}

#[test]
fn groups_are_numbered_in_order_of_first_appearance() {
    let row = |d: f64, a: f64, drive: f64| Tuple { D: 10.0, d, L_a: 50.0, a, drive, ..Tuple::default() };
    let rows = [row(7.0, 20.0, 1.0), row(4.0, 20.0, 1.0), row(7.0, 30.0, 1.0), row(7.0, 20.0, 2.0)];
    let listed: Listed = rows.into_iter().chain([Tuple { x_ss: -0.0, ..rows[1] }]).collect();
    assert!(listed.iter().take(4).eq(rows));
    let groups = listed.groups();
    assert_eq!(groups.designs, [0, 1, 0, 0, 1]);
    assert_eq!(groups.strokes, [0, 1, 0, 2, 1]);
    assert_eq!(groups.distances, [0, 1, 2, 0, 1]);
    assert_eq!((groups.counts, groups.reach.as_slice()), ([2, 3, 3], &[[20.0, 30.0], [20.0, 20.0]][..]));
}

#[test]
fn a_direction_belongs_to_strokes_and_distances_not_to_designs() {
    let row = |tilt: f64, a: f64, drive: f64| Tuple { D: 10.0, d: 4.0, a, tilt, drive, ..Tuple::default() };
    let rows = [row(0.0, 20.0, 1.0), row(-0.0, 30.0, 1.0), row(5.0, 20.0, 1.0), row(5.0, 20.0, 2.0)];
    let listed: Listed = rows.into_iter().collect();
    let groups = listed.groups();
    assert_eq!((&groups.designs, &groups.strokes), (&vec![0; 4], &vec![0, 0, 1, 2]));
    assert_eq!((&groups.distances, groups.counts), (&vec![0, 1, 2, 2], [1, 3, 3]));
}

/// `scipy.stats.qmc.Sobol(24, scramble=False, bits=32)`, whose point n is our point n ^ (n >> 1).
#[test]
fn sobol_agrees_with_scipy() {
    let last_of = |n: u32| -> Vec<u32> { (0..24).map(|j| sobol(j, n ^ (n >> 1))).collect() };
    assert_eq!(
        last_of(100),
        [
            1778384896, 1107296256, 3321888768, 3120562176, 3791650816, 3187671040, 100663296, 2046820352,
            2717908992, 2986344448, 1979711488, 2919235584, 2046820352, 3657433088, 1375731712, 2113929216,
            2919235584, 3187671040, 3590324224, 1442840576, 3254779904, 1711276032, 33554432, 2113929216
        ]
    );
    assert_eq!(
        last_of(2047),
        [
            2097152, 2694840320, 3999268864, 1507852288, 2707423232, 2824863744, 505413632, 136314880,
            3927965696, 1914699776, 2141192192, 3802136576, 2510290944, 4242538496, 2099249152, 2912944128,
            2325741568, 3537895424, 471859200, 157286400, 1537212416, 463470592, 404750336, 2996830208
        ]
    );
    assert!(last_of(0).iter().all(|&x| x == 0));
    assert!(last_of(1).iter().all(|&x| x == 1 << 31));
}

/// Each of the first 2^k points lies in a stratum of its own, in every dimension and for every seed.
#[test]
fn scramble_keeps_strata() {
    for seed in [0, 1, 2, 0x1234_5678_9abc_def0] {
        for dimension in 0..MAX_DIMENSIONS {
            let mut seen = [false; 256];
            for i in 0..256 {
                let stratum = (Sampler::Sobol.coordinate(seed, dimension, i) >> 24) as usize;
                assert!(!std::mem::replace(&mut seen[stratum], true), "seed {seed}, dimension {dimension}");
            }
        }
    }
}

#[test]
fn seeds_differ() {
    let first = |seed| Sampler::Sobol.coordinate(seed, 0, 0);
    assert_ne!(first(1), first(2));
    assert_ne!(first(1), first(1 << 32));
    assert_ne!(Sampler::Sobol.coordinate(1, 0, 0), Sampler::Sobol.coordinate(1, 1, 0));
}

/// Known answers published with Random123 (`kat_vectors`).
#[test]
fn philox_known_answers() {
    assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
    assert_eq!(philox([u32::MAX; 4], [u32::MAX; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
    assert_eq!(
        philox([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
        [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
    );
}

#[test]
fn words_join_in_the_order_of_the_list() {
    assert_eq!(Status::OK.to_string(), "ok");
    let both = Status::AMBIGUOUS | Status::SLIPPED_OFF;
    assert_eq!(both.to_string(), "slipped_off+ambiguous");
    assert_eq!((Status::of_words("slipped_off+ambiguous"), Status::of_words("ok")), (both, Status::OK));
    assert!((Status::STRAIN_LIMIT | Status::NO_ROOT | Status::AMBIGUOUS).counts());
    for (s, _) in Status::ALL.into_iter().take(6) {
        assert!(!(s | Status::AMBIGUOUS).counts());
    }
}

#[test]
fn a_tap_counts_once_whatever_its_words() {
    let mut all = Combinations::default();
    let both = Status::STRAIN_LIMIT | Status::AMBIGUOUS;
    for (status, taps) in
        [(Status::OK, 3), (both, 2), (Status::STRAIN_LIMIT, 1), (both, 1), (Status::NO_ROOT, 0)]
    {
        all.note(status, taps);
    }
    assert_eq!(all.told(|n| n.to_string()), "3 ok, 1 strain_limit, 3 strain_limit+ambiguous");
    assert_eq!(Combinations::of(&all.named()), Some(all.clone()));
    all.retain(Status::AMBIGUOUS | Status::NO_ROOT);
    assert_eq!(all.told(|n| n.to_string()), "3 ambiguous");
    assert_eq!(Combinations::of(&BTreeMap::from([("no_word".to_owned(), 1)])), None);
}

fn shown(text: &str, span: Range<usize>) -> (String, String, usize) {
    let e = Excerpt::new(text, span);
    (e.text.clone(), e.text[e.span.clone()].to_owned(), e.above)
}

#[test]
fn neighbours_and_the_mistake_are_shown() {
    let text = "[whisker]\r\nD = 10\r\nd\t= -4\r\nL_a = 50\r\n";
    let at = text.find("-4").unwrap();
    assert_eq!(shown(text, at..at + 2), ("D = 10\nd = -4\nL_a = 50".into(), "-4".into(), 1));
    assert_eq!(shown("é = x", 5..6), ("é = x".into(), "x".into(), 0));
    assert_eq!(shown("", 0..0), (String::new(), String::new(), 0));
    assert_eq!(shown("a\n", 2..2), ("a\n".into(), String::new(), 0));
}

#[test]
fn a_mistake_far_to_the_right_is_shown_with_what_is_near() {
    let text = format!("a = 1\n{}bad{}\nb = 2", "x".repeat(200_000), "y".repeat(200_000));
    let (text, marked, _) = shown(&text, 200_006..200_009);
    assert!(text.len() < 300 && marked == "bad", "{text}");
    let (whole, marked, _) = shown(&"z".repeat(100_000), 0..100_000);
    assert!(whole.len() < 200 && marked.len() == WIDE, "{whole}");
}

proptest! {
    #[test]
    fn every_place_of_every_text_can_be_shown(text in any::<String>(), a in 0usize..400, b in 0usize..400) {
        let e = Excerpt::new(&text, a.min(b)..a.max(b));
        prop_assert!(e.text.get(e.span.clone()).is_some());
        prop_assert!(e.text.chars().all(|c| c == '\n' || harmless(c) == c));
    }
}

fn cone() -> StrainCurve {
    let taper = Taper::new(10.0, 4.0, 50.0);
    StrainCurve::new(taper, taper.gauge(5.0, 2.0), 0.0, Drive::Angle, 0.0)
}

#[test]
fn a_force_that_pulls_has_no_distance() {
    let channels = Channels::of(&[Signal::Moment, Signal::Force], None).unwrap();
    let curve = cone();
    let contact = Contact::new(Arc::new(channels), &curve, [5.0, 50.0], 3.2, 1.0);
    for readings in [[3.0, 0.1], [-3.0, 0.1], [-30.0, -0.1], [-0.001, -0.1]] {
        let readings = [readings[0], readings[1], 0.0, 0.0, 0.0, 0.0];
        let told = contact.estimate(&curve, &[1.0; MOST_CHANNELS], &readings, 0.3, |_| true);
        assert!(told.status.has(Status::NO_ROOT) && told.distance.is_nan(), "{readings:?} {told:?}");
    }
}

fn pole(tilt: f64, lean: f64, drive: Drive, amount: f64) -> Pole {
    let model = Model { surface: true, pole_radius: 3.0, ..Model::PLAIN };
    let rig = Rig { taper: Taper::new(10.0, 4.0, 50.0), hub: 4.0, drive, model: &model };
    Pole::new(&rig, [tilt, lean], 33.0, amount)
}

#[test]
fn an_upright_pole_is_the_planar_tap() {
    let one = pole(0.0, 0.0, Drive::Angle, 0.1);
    let Planar { distance, angle, slide } = one.planar(0.0).unwrap();
    assert_eq!((distance, slide), (33.0, 0.0));
    assert!((angle - 0.1).abs() < 1e-15);
    assert_eq!(one.azimuth(0.3), Some(0.0));
}

#[test]
fn the_plane_meets_the_pole_where_it_says() {
    for drive in [Drive::Angle, Drive::Displacement] {
        let amount = if drive == Drive::Angle { 0.1 } else { 3.3 };
        let one = pole(0.4, 0.2, drive, amount);
        let Planar { distance, angle, .. } = one.planar(0.42).unwrap();
        // Turned back, the planar pole is where the whisker touches it at that distance.
        let taper = Taper::new(10.0, 4.0, 50.0);
        let hub = if drive == Drive::Angle { 4.0 } else { 0.0 };
        let (sin, cos) = (taper.sin_alpha(), taper.cos_alpha());
        let touched = DVec2::new(distance + hub + 3.0 * sin, taper.radius(distance) + 3.0 * cos);
        let (s, c) = 0.42f64.sin_cos();
        let slide = one.planar(0.42).unwrap().slide;
        let seen = DVec3::from(one.point) + slide * DVec3::from(one.along);
        assert!(seen.dot(DVec3::new(0.0, -s, c)).abs() < 1e-13);
        let turned = DVec2::from_angle(-angle).rotate(touched);
        assert!((turned - DVec2::new(seen.x, seen.dot(DVec3::new(0.0, c, s)))).length() < 1e-12);
    }
}

#[test]
fn a_push_at_the_azimuth_is_square_to_the_pole() {
    let one = pole(-0.7, 0.3, Drive::Angle, 0.15);
    let (sin, cos) = one.azimuth(0.25).unwrap().sin_cos();
    let push = DVec3::new(0.25f64.sin(), 0.25f64.cos() * cos, 0.25f64.cos() * sin);
    assert!(push.dot(one.along.into()).abs() < 1e-15);
}

#[test]
fn a_half_is_lost_with_the_next_node_beyond_its_middle() {
    let none = f64::NAN;
    assert_eq!(lost(&[none, none, none, 1.0, 1.0, 1.0]), [false, false]);
    assert_eq!(lost(&[none, none, none, none, 1.0, 1.0]), [true, false]);
    assert_eq!(lost(&[1.0, 1.0, none, none, none, none]), [false, true]);
}
