//! Taps with known answers: the cases of another code.

use std::collections::{BTreeMap, HashMap};

use vibrissa::census::Taps;
use vibrissa::evaluate::{Method, Outcome};
use vibrissa::scene::{Drive, Setup, Tuple};

/// Hub of every setup with one, mm. Strain depends on ratios of lengths only, so each case is scaled to this hub.
const HUB: f64 = 10.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Tap,
    /// Tap angle about an axis behind the clamp.
    Hub,
    Passive,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Tap, Self::Hub, Self::Passive];

    pub fn drive(self) -> Drive {
        if self == Self::Passive { Drive::Displacement } else { Drive::Angle }
    }

    /// An exact, frictionless Hooke setup of this kind, without tuples.
    pub fn setup(self) -> Setup {
        let hub = if self == Self::Hub { HUB } else { 0.0 };
        Setup { hub, drive: self.drive(), ..Setup::default() }
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Known {
    pub line: usize,
    pub tuple: Tuple,
    pub strain: f64,
    pub force: f64,
    pub arc: f64,
    /// Tangential force, and sticking, where the file has them.
    pub rubbed: Option<f64>,
    pub sticks: Option<bool>,
}

pub fn rows(file: &str) -> Vec<HashMap<String, String>> {
    let path = format!("{}/tests/data/{file}.csv", crate::common::ROOT);
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).from_path(path).expect("the cases are there");
    reader.deserialize().collect::<Result<_, _>>().expect("the cases are well formed")
}

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
            rubbed: row
                .get("tangential_force_N")
                .map(|x| scale * scale * x.parse::<f64>().expect("a number")),
            sticks: row.get("contact_state").map(|word| word == "stick"),
        };
        found.entry(row["config"].clone()).or_default().push(answer);
    }
    found
}

/// Outcomes of `tuples`, and 1e-3 θ f_max, the least strain that the tolerance refers to.
pub fn evaluate(setup: &Setup, method: Method, tuples: &[Tuple]) -> Vec<(Outcome, f64)> {
    let taps = Taps::of(setup, tuples);
    let outcomes = taps.answers(method).expect("the backend answers");
    outcomes.into_iter().enumerate().map(|(i, outcome)| (outcome, taps.least(i))).collect()
}
