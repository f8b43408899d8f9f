//! The configurations that are verified without a spec, as specs (`configurations.toml`): each effect alone, the eight of model §5, and others of
//! their kind; and the taps to verify, hard ones, and random ones over wide ranges.

use std::path::Path;
use std::sync::LazyLock;

use toml::{Table, Value};

use super::Taps;
use crate::design::Design;
use crate::evaluate::Method;
use crate::scene::{Contact, Drive, Geometry, Model, Sampler, Setup, TERMS, Tuple};
use crate::spec;

/// r₀ of the configurations with a hub, mm. Their random whiskers are scaled so that it is 0.03 to 3 distances.
pub const HUB: f64 = 10.0;

/// Those of a quick run: the closed forms, the plain rod, rubber with every effect and a contact that sticks, a hub, an object that moves, poles that are not upright.
pub const QUICK: [&str; 7] =
    ["linear", "hooke", "stick", "hooke-hub", "hooke-passive", "hooke-tilted", "cored"];

/// A whisker on a rig, and its model.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    pub name: &'static str,
    /// The rig that its taps share.
    pub setup: Setup,
}

static WRITTEN: LazyLock<Table> =
    LazyLock::new(|| include_str!("configurations.toml").parse().expect("configurations.toml is TOML"));

const PLAIN: &str = "whisker = { D = 10, d = 4, L_a = 50 }\ngauge = { x_ss = 5, l = 2 }\ntap.a = 33";

/// All, in the order of the census: those written, and every effect that a key switches by itself and none of them has alone.
pub fn all() -> Vec<Configuration> {
    let only = |key: &str, m: &Model| TERMS.iter().all(|t| (t.get)(m).is_on() == (t.key == key));
    let written = WRITTEN.keys().map(|name| Configuration { name, setup: setup(name) });
    let mut all: Vec<Configuration> = written.collect();
    for key in TERMS.map(|term| term.key) {
        if !all.iter().any(|c| only(key, &c.setup.model)) {
            let setup = Setup { model: Model::PLAIN.with(key), ..Setup::default() };
            all.push(Configuration { name: key, setup });
        }
    }
    all
}

fn setup(name: &str) -> Setup {
    let mut spec = keys(name);
    let tap = spec["tap"].as_table_mut().expect("a table");
    if !tap.contains_key("delta") {
        tap.insert("theta".into(), 4.into());
    }
    spec::parse(name, &spec.to_string(), Path::new("")).expect("configurations.toml has specs").study.setup
}

/// The keys of the configuration `name`, with those of the one that it is like.
fn keys(name: &str) -> Table {
    let mut own = WRITTEN[name].as_table().expect("a table").clone();
    let mut all = match own.remove("like") {
        Some(like) => keys(like.as_str().expect("a name")),
        None => PLAIN.parse().expect("TOML"),
    };
    add(&mut all, own);
    all
}

fn add(to: &mut Table, more: Table) {
    for (key, value) in more {
        match (to.get_mut(&key), value) {
            // One law of the material replaces another.
            (Some(Value::Table(to)), Value::Table(more)) if key != "material" => add(to, more),
            (_, value) => drop(to.insert(key, value)),
        }
    }
}

/// Base diameter of random whiskers before scaling, mm.
const WIDE: f64 = 10.0;

/// Coordinate `dimension` of random point `index` of `seed`, in [0, 1).
fn unit(seed: u64, dimension: u32, index: u32) -> f64 {
    f64::from(Sampler::Random.coordinate(seed, dimension, index)) / 2f64.powi(32)
}

/// `n` whiskers and taps over wide ranges: d/D from 0.05 to 1.3, gauges from the clamp on, contacts from the gauge's
/// near end to the tip (a third of them next to the gauge) but not nearer to the clamp than D/4, where nothing is a beam,
/// angles from 0.01° to 20° (displacements a times as much).
/// With `hub` the lengths are scaled so that [`HUB`] is 0.03 to 3 distances.
pub fn random(drive: Drive, hub: bool, n: u32, seed: u64) -> Vec<Tuple> {
    let point = |index: u32| {
        let unit = |dimension| unit(seed, dimension, index);
        let log = |dimension, from: f64, to: f64| from * (to / from).powf(unit(dimension));
        let length = log(0, 2.0, 20.0) * WIDE;
        let place = if index.is_multiple_of(16) { 0.0 } else { log(1, 0.005, 0.7) * length };
        let grid = log(2, 0.001, 0.2) * length;
        let near = if index.is_multiple_of(3) {
            log(3, 1e-3, 0.3) * (2.0 * grid)
        } else {
            unit(3) * (length - place)
        };
        let a = (place + near).clamp(0.25 * WIDE, length);
        let angle = log(4, 0.01, 20.0);
        let scale = if hub { HUB / (log(5, 0.03, 3.0) * a) } else { 1.0 };
        let tip = WIDE * (0.05 + 1.25 * unit(6));
        let lengths = [WIDE, tip, length, place, grid.min(length - place), a].map(|x| scale * x);
        #[allow(non_snake_case)]
        let [D, d, L_a, x_ss, l, a] = lengths;
        let drive = if drive == Drive::Displacement { a * angle.to_radians() } else { angle };
        Tuple { D, d, L_a, x_ss, l, a, drive, ..Tuple::default() }
    };
    (0..n).map(point).collect()
}

/// Gives the poles of `tuples` tilts within ±60° and leans within ±30°: of the first six these are tiny, a tilt or a lean alone, or both large.
pub fn tilt(tuples: &mut [Tuple], seed: u64) {
    let hard = [[1e-6, 0.0], [0.0, 1e-6], [45.0, 0.0], [0.0, -20.0], [70.0, 10.0], [-60.0, 30.0]];
    for (index, tuple) in (0..).zip(tuples) {
        let at = |dimension, most: f64| most * (2.0 * unit(seed, dimension, index) - 1.0);
        let random = || [at(7, 60.0), at(8, 30.0)];
        [tuple.tilt, tuple.lean] = hard.get(index as usize).copied().unwrap_or_else(random);
    }
}

/// The hard cases of `study`: whiskers of every taper, contacts on and next to the gauge, at and below the peak of the
/// strain curve, near and past the tip, tiny and huge drives, tiny gauges, tiny and huge whiskers, and the drive at which a
/// contact begins to slide.
pub fn hard(setup: &Setup) -> Vec<Tuple> {
    let base =
        Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, a: 33.0, drive: 4.0, ..Tuple::default() };
    let wide = [10.0, 10.0 * (1.0 - 1e-7), 10.0 * (1.0 + 1e-7), 12.0];
    let mut taps = wide.map(|d| Tuple { d, ..base }).to_vec();
    taps.push(Tuple { d: 0.2, a: 0.97 * base.L_a, drive: 1.0, ..base });
    taps.push(Tuple { d: 2.0, a: 45.0, drive: 10.0, ..base });
    let drives = [(4.0, 0.001), (10.0, 0.001), (4.0, 60.0), (10.0, 60.0), (7.0, 30.0)];
    taps.extend(drives.map(|(d, drive)| Tuple { d, drive, ..base }));
    taps.extend(near_gauge(setup, base));
    taps.extend([Tuple { l: 0.01, ..base }, Tuple { x_ss: 0.0, ..base }]);
    taps.push(Tuple { x_ss: 0.0, l: 0.01, a: 0.5, drive: 0.5, ..base });
    for drive in [0.5, 10.0] {
        taps.extend([0.999, 1.0].map(|share| Tuple { a: share * base.L_a, drive, ..base }));
    }
    // Where the setup has lengths of its own, a scaled whisker is another one: a curved one would be rolled up a thousand times.
    let with_length = setup.model.pole_radius > 0.0
        || setup.hub > 0.0 && setup.drive == Drive::Angle
        || setup.built.is_some()
        || setup.gauge.foil.is_some();
    if !with_length {
        taps.extend([1e-3, 1e3].map(|k| scaled(base, k)));
    }
    if setup.drive == Drive::Displacement {
        taps.iter_mut().for_each(|t| t.drive = t.a * t.drive.min(45.0).to_radians());
    }
    taps.extend(sliding_edge(setup, Tuple { drive: 0.0, ..base }));
    taps
}

/// Contacts before, just before, just after and on the gauge, and around the peak of the strain curve.
fn near_gauge(setup: &Setup, base: Tuple) -> Vec<Tuple> {
    let Some(shared) = Design::new(setup, base).shared else { return Vec::new() };
    let ([x1, x2], peak) = (shared.gauge, shared.theory.peak().0);
    let [before, beyond] = [1.0 - 1e-6, 1.0 + 1e-6];
    let gauge = [0.5 * x1, x1 * before, x1, x1 * beyond, 0.5 * (x1 + x2), x2 * before, x2 * beyond];
    let places = [&gauge[..], &[0.9 * peak, peak]].concat();
    let at = |drive: f64| places.iter().map(move |&a| Tuple { a, drive, ..base });
    at(0.5).chain(at(4.0)).filter(|t| t.a < t.L_a).collect()
}

fn scaled(t: Tuple, k: f64) -> Tuple {
    Tuple { D: k * t.D, d: k * t.d, L_a: k * t.L_a, x_ss: k * t.x_ss, l: k * t.l, a: k * t.a, ..t }
}

/// Taps just before and just after the drive at which |T| = μP in the sticking contact; none where it never is.
fn sliding_edge(setup: &Setup, base: Tuple) -> Vec<Tuple> {
    let Contact::Coulomb(mu) = setup.model.contact else { return Vec::new() };
    let model = Model { contact: Contact::Stick, geometry: Geometry::Exact, ..setup.model };
    let stuck = Setup { model, ..setup.clone() };
    let mut found = Vec::new();
    for (d, a) in [(4.0, 33.0), (10.0, 20.0)] {
        let tap = Tuple { d, a, ..base };
        let full = if setup.drive == Drive::Displacement { a * 30f64.to_radians() } else { 30.0 };
        let reserve = |drive: f64| {
            let answer = Taps::of(&stuck, &[Tuple { drive, ..tap }]).answers(Method::Reference);
            answer.map_or(f64::NAN, |o| o[0].tangential_force.abs() - mu * o[0].normal_force)
        };
        let steps: Vec<f64> = (0..7).rev().map(|k| full * 0.5f64.powi(k)).collect();
        let reserves: Vec<f64> = steps.iter().map(|x| reserve(*x)).collect();
        let crossing = (1..steps.len()).find(|k| reserves[k - 1] < 0.0 && reserves[*k] > 0.0);
        let Some(k) = crossing else { continue };
        let (mut low, mut high) = (steps[k - 1], steps[k]);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            *(if reserve(middle) > 0.0 { &mut high } else { &mut low }) = middle;
        }
        found.extend([0.99, 1.0 - 1e-6, 1.0 + 1e-6, 1.01].map(|k| Tuple { drive: low * k, ..tap }));
    }
    found
}
