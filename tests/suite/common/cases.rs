//! Taps with known answers: the cases of another code, and random ones that the reference solver answers.

use std::collections::{BTreeMap, HashMap};

use vibrissa::census::Taps;
use vibrissa::evaluate::{Method, Outcome};
use vibrissa::scene::sampler::Sampler;
use vibrissa::scene::{Drive, Setup, Tuple};

/// Hub of every setup with one, mm: strains depend on ratios of lengths only, so a case is scaled to it.
const HUB: f64 = 10.0;

/// A kind of setup.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Tap angle about the clamp.
    Tap,
    /// Tap angle about an axis behind the clamp.
    Hub,
    /// The object moves.
    Passive,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Tap, Self::Hub, Self::Passive];

    pub fn drive(self) -> Drive {
        if self == Self::Passive { Drive::Displacement } else { Drive::Angle }
    }

    /// An exact, frictionless Hooke setup of this kind; its tuples are given apart.
    pub fn setup(self) -> Setup {
        let hub = if self == Self::Hub { HUB } else { 0.0 };
        Setup { hub, drive: self.drive(), ..Setup::default() }
    }
}

/// A tap and its answer.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Line of its file, or number of the random tap.
    pub line: usize,
    pub tuple: Tuple,
    pub strain: f64,
    pub force: f64,
    pub arc: f64,
}

/// Rows of a file of tests/data by column.
pub fn rows(file: &str) -> Vec<HashMap<String, String>> {
    let path = format!("{}/tests/data/{file}.csv", crate::common::ROOT);
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).expect("the cases are there");
    reader.deserialize().collect::<Result<_, _>>().expect("the cases are well formed")
}

/// All rows of the file of `kind`, by configuration.
pub fn known(kind: Kind) -> BTreeMap<String, Vec<Known>> {
    let name = match kind {
        Kind::Tap => "tap_cases",
        Kind::Hub => "hub_cases",
        Kind::Passive => "passive_cases",
    };
    let mut found = BTreeMap::<_, Vec<_>>::new();
    for (i, row) in rows(name).into_iter().enumerate() {
        let get = |column: &str| row[column].parse::<f64>().expect("a number");
        let scale = if kind == Kind::Hub { HUB / get("hub_mm") } else { 1.0 };
        let length = |column| scale * get(column);
        let [wide, tip, long, x_ss, l, a] = ["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm"].map(length);
        let drive = get(if kind == Kind::Passive { "delta_mm" } else { "theta_deg" });
        let tuple = Tuple::from_array([wide, tip, long, x_ss, l, a, 0.0, 0.0, drive]);
        let answer = Known {
            line: i + 2,
            tuple,
            strain: get("strain"),
            force: scale * scale * get("normal_force_N"),
            arc: length("contact_arc_mm"),
        };
        found.entry(row["config"].clone()).or_default().push(answer);
    }
    found
}

/// `n` whiskers and taps over wide ranges: d/D from 0.05 to 1.3, gauges from the clamp on, contacts from the gauge's
/// near end to the tip (a third of them next to the gauge), angles from 0.01° to 20°, hubs of 0.03 to 3 distances.
pub fn random(kind: Kind, n: u32) -> Vec<Tuple> {
    let point = |index: u32| {
        let unit = |dimension| f64::from(Sampler::Random.coordinate(7, dimension, index)) / 2f64.powi(32);
        let log = |dimension, from: f64, to: f64| from * (to / from).powf(unit(dimension));
        let wide = 10.0;
        let length = log(0, 2.0, 20.0) * wide;
        let place = if index.is_multiple_of(16) { 0.0 } else { log(1, 0.005, 0.7) * length };
        let grid = log(2, 0.001, 0.2) * length;
        let near = if index.is_multiple_of(3) {
            log(3, 1e-3, 0.3) * (2.0 * grid)
        } else {
            unit(3) * (length - place)
        };
        let a = (place + near).clamp(1e-3 * length, length);
        let angle = log(4, 0.01, 20.0);
        let scale = if kind == Kind::Hub { HUB / (log(5, 0.03, 3.0) * a) } else { 1.0 };
        let drive = if kind == Kind::Passive { a * angle.to_radians() } else { angle };
        let slenderness = 0.05 + 1.25 * unit(6);
        let lengths =
            [wide, wide * slenderness, length, place, grid.min(length - place), a].map(|x| scale * x);
        let [wide, tip, length, place, grid, a] = lengths;
        Tuple { D: wide, d: tip, L_a: length, x_ss: place, l: grid, a, drive, ..Tuple::default() }
    };
    (0..n).map(point).collect()
}

/// Outcomes of `tuples` on a backend, and the strain to which the tolerance of each refers at least, 1e-3 θ f_max.
pub fn evaluate(setup: &Setup, method: Method, tuples: &[Tuple]) -> Vec<(Outcome, f64)> {
    let taps = Taps::of(setup, tuples);
    let outcomes = taps.answers(method).expect("the backend answers");
    outcomes.into_iter().enumerate().map(|(i, outcome)| (outcome, taps.least(i))).collect()
}
