//! Rows that once lied: a strain off by more than the tolerance with status `ok`, a material that had not ended, an answer that was
//! not found. The strains are those of the reference and of another code.

use super::*;
use vibrissa::scene::{Drive, RunOptions};

/// A tap that once was answered wrongly.
struct Row {
    /// D, d, L_a, x_ss, l, a, drive.
    tap: [f64; 7],
    hub: f64,
    drive: Drive,
    model: Model,
    /// The strain; NaN where the material ends.
    strain: f64,
}

impl Row {
    fn new(tap: [f64; 7], model: Model, strain: f64) -> Self {
        Self { tap, hub: 0.0, drive: Drive::Angle, model, strain }
    }

    fn setup(&self) -> Setup {
        let mut setup =
            if self.drive == Drive::Displacement { Kind::Passive.setup() } else { Kind::Tap.setup() };
        (setup.hub, setup.model) = (self.hub, self.model);
        setup
    }

    #[allow(non_snake_case)]
    fn tuple(&self) -> Tuple {
        let [D, d, L_a, x_ss, l, a, drive] = self.tap;
        Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() }
    }

    /// Every backend at its default tolerance, and the CPU at `finer` ones, each within its tolerance; the reference to 1e-9.
    #[track_caller]
    fn is_told(&self, finer: &[(Precision, f64)]) {
        let (setup, tuple) = (self.setup(), self.tuple());
        let check = |name: String, outcome: Outcome, bound: f64| {
            if self.strain.is_nan() {
                assert_eq!(outcome.status.to_string(), "material_limit", "{name} {tuple:?}");
                return;
            }
            let error = (outcome.strain - self.strain).abs() / self.strain.abs();
            assert!(error <= bound, "{name} {tuple:?}: {} for {}, {error:.1e}", outcome.strain, self.strain);
            assert!(outcome.status.counts() && outcome.deviation.is_finite(), "{name}: {}", outcome.status);
        };
        for place in ALL {
            let found = outcomes(&setup, place, &[tuple])[0];
            check(format!("{place:?}"), found, if place == REFERENCE { 1e-9 } else { bound(place) });
        }
        for &(precision, tolerance) in finer {
            let options = RunOptions {
                backend: Some(vibrissa::scene::BackendChoice::Cpu),
                precision: Some(precision),
                tolerance: Some(tolerance),
                ..RunOptions::default()
            };
            let method = vibrissa::backend::Choice::new(&options).unwrap().open(&setup.model).unwrap();
            let found = evaluate(&setup, method, &[tuple])[0].0;
            check(format!("{precision:?} at {tolerance:e}"), found, tolerance);
        }
    }
}

const LOOSE: [(Precision, f64); 3] = [(Precision::F32, 3e-6), (Precision::F32, 1e-6), (Precision::F64, 1e-5)];

fn hooke() -> Model {
    common::model(Material::Hooke(3.2))
}

#[test]
fn rows_that_once_lied_are_told() {
    let rubber = common::all_effects(Material::NeoHookean(3.2));
    let told = |tap, model, strain| Row::new(tap, model, strain).is_told(&LOOSE);
    // A fine tip of rubber with every effect.
    told([10.0, 0.6, 50.0, 5.0, 2.0, 48.0, 7.384019810122841], rubber, 0.00249865760667);
    // Large angles behind a hub.
    for (a, theta, strains) in [
        (21.0, 32.40696202531645, [0.3010948361445605, 0.33955078877687905, 0.36297307809985385]),
        (33.0, 21.270506329113925, [0.1163721312545201, 0.14607387005501704, 0.16726936469745227]),
    ] {
        for (d, strain) in [4.0, 7.0, 10.0].into_iter().zip(strains) {
            let row = Row::new([10.0, d, 50.0, 5.0, 2.0, a, theta], hooke(), strain);
            Row { hub: 9.0, ..row }.is_told(&LOOSE);
        }
    }
    // Contacts that leave a short gauge: θ f is tiny there and the strain is not.
    told([2.0, 2.0, 44.0, 31.0, 0.0002, 31.0001, 50.0], hooke(), 0.0065529336341);
    let beyond = Row::new([2.15, 1.4, 400.0, 294.0, 0.075, 294.5, 40.0], hooke(), 0.0);
    let exact = outcomes(&beyond.setup(), REFERENCE, &[beyond.tuple()])[0];
    told(beyond.tap, hooke(), exact.strain);
    // A contact next to the clamp of a thick whisker: the radius is a hundred distances, lengths cancel in the closure.
    let thick = [181.75, 68.31, 493.12, 0.0, 0.905, 0.9067, 9.88e-4];
    told(thick, Model { surface: true, ..hooke() }, 0.001646884898);
}

#[test]
fn a_law_ends_where_its_fibres_do() {
    // The fibres stay within −0.5 … +1; what ends is the chart of the section law.
    let held = |material, shear| {
        let plain = common::model(material);
        Model { shear, extension: true, contact: Contact::Stick, ..plain }
    };
    for (delta, strain) in [(13.09, 0.33783177430), (17.4533, 0.48115791211)] {
        let model = held(Material::MooneyRivlin([0.2, 0.3]), true);
        let row = Row::new([8.0, 8.0, 50.0, 3.0, 2.0, 25.0, delta], model, strain);
        Row { drive: Drive::Displacement, ..row }.is_told(&[]);
    }
    let softening = Model { shear: true, ..common::model(Material::Yeoh([0.5, -0.3, 0.0])) };
    for (theta, strain) in [(39.0, 0.39867154023), (39.5, 0.40470900044), (40.0, 0.41057531551)] {
        Row::new([10.0, 2.0, 50.0, 3.0, 2.0, 16.0, theta], softening, strain).is_told(&[]);
    }
    // A fibre at the base reaches −0.503, between the last node and the clamp.
    let ended = held(Material::NeoHookean(3.2), false);
    Row::new([4.0, 8.0, 50.0, 3.0, 2.0, 10.0, 44.0], ended, f64::NAN).is_told(&[]);
}

#[test]
fn a_pole_and_a_hub_leave_no_row_to_double_precision_alone() {
    let model = Model { pole_radius: 20.0, ..common::all_effects(Material::MooneyRivlin([0.35, 0.15])) };
    let mut setup = setup(model, Side::Contact);
    setup.hub = 12.2;
    let tuples = grid(&[2.0, 4.0, 7.0, 10.0, 12.0], &[21.0, 33.0, 48.0], &[1.0, 10.0, 20.0, 30.0]);
    let solved = |place: Place| -> Vec<bool> {
        outcomes(&setup, place, &tuples).iter().map(|o| o.strain.is_finite()).collect()
    };
    let double = solved(CPU_F64);
    for place in [CPU, GPU] {
        let single = solved(place);
        let lost = double.iter().zip(&single).filter(|(d, s)| **d && !**s).count();
        assert_eq!(lost, 0, "{place:?} leaves {lost} of {} rows", double.iter().filter(|d| **d).count());
    }
}

/// K is strain_linear/strain to the last digit but one, in any precision.
#[test]
fn linear_theory_with_shear_is_one_closed_form() {
    let mut setup = setup(Model { shear: true, ..hooke() }, Side::Contact);
    setup.model.geometry = vibrissa::scene::Geometry::Linear;
    for place in FAST {
        for o in outcomes(&setup, place, &grid(&[4.0, 10.0], &[8.0, 21.0, 48.0], &[0.1, 5.0])) {
            let k = o.strain_linear / o.strain;
            assert!((k - 1.0 - o.deviation).abs() <= 4e-16 * k, "{place:?}: {k} against 1 + {}", o.deviation);
        }
    }
}
