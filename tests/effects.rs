//! Every configuration of model §5 on every fast backend: the cases of another code, hubs and passive drives included. A
//! backend that the machine lacks fails.

mod common;

use std::collections::{BTreeMap, HashMap};

use common::cases::evaluate;
use common::sweeping::{CPU, CPU_F64, GPU, GPU_F64, Place};
use common::{cases::Kind, configuration};
use vibrissa::scene::{Precision, Tuple};

/// Lengths of a case are scaled so that its hub is that of the scene, mm.
const HUB: f64 = 10.0;

/// Bound on the strain at the default tolerance.
fn bound(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 2e-8 }
}

/// Rows of the file of `kind` by configuration: line, tuple, strain.
fn cases(kind: Kind) -> BTreeMap<String, Vec<(usize, Tuple, f64)>> {
    let name = match kind {
        Kind::Tap => "tap_cases.csv",
        Kind::Hub => "hub_cases.csv",
        Kind::Passive => "passive_cases.csv",
    };
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let mut reader = csv::Reader::from_path(path).expect("the cases are there");
    let mut found = BTreeMap::<_, Vec<_>>::new();
    for (i, row) in reader.deserialize::<HashMap<String, String>>().enumerate() {
        let row = row.expect("well formed");
        let get = |column: &str| row[column].parse::<f64>().expect("a number");
        let scale = if kind == Kind::Hub { HUB / get("hub_mm") } else { 1.0 };
        let length = |column: &str| scale * get(column);
        let tuple = Tuple {
            D: length("D_mm"),
            d: length("d_mm"),
            L_a: length("L_a_mm"),
            x_ss: length("x_ss_mm"),
            l: length("l_mm"),
            a: length("a_mm"),
            drive: get(if kind == Kind::Passive { "delta_mm" } else { "theta_deg" }),
        };
        found.entry(row["config"].clone()).or_default().push((i + 2, tuple, get("strain")));
    }
    found
}

/// Largest mean number of sweeps of a configuration over the cases: a slower solver is noticed.
const MOST_SWEEPS: [(&str, f64); 8] = [
    ("hooke", 8.0),
    ("surface", 7.0),
    ("timoshenko", 7.0),
    ("neo", 15.0),
    ("mooney-coulomb", 10.0),
    ("stick", 18.0),
    ("pole-far", 8.0),
    ("yeoh", 11.0),
];

fn agrees(place: Place) {
    let mut faults = Vec::new();
    for kind in Kind::ALL {
        for (name, rows) in cases(kind) {
            let (model, side) = configuration(&name);
            let mut scene = kind.scene();
            (scene.model, scene.gauge.side) = (model, side);
            let tuples: Vec<Tuple> = rows.iter().map(|(_, tuple, _)| *tuple).collect();
            let solved = evaluate(&scene, place.open(&scene), &tuples);
            let sweeps = solved.iter().map(|(o, _)| f64::from(o.sweeps)).sum::<f64>() / rows.len() as f64;
            let worst = rows
                .iter()
                .zip(&solved)
                .map(|((line, _, strain), (o, _))| ((o.strain / strain - 1.0).abs(), *line))
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .expect("a case");
            println!(
                "{place:?} {kind:?} {name}: worst {:.1e} on line {}, sweeps {sweeps:.1}",
                worst.0, worst.1
            );
            if worst.0.is_nan() || worst.0 > bound(place) {
                faults.push(format!("{kind:?} {name}: {worst:?}"));
            }
            let most = MOST_SWEEPS.iter().find(|(n, _)| *n == name).expect("every configuration has one").1;
            if sweeps > most {
                faults.push(format!("{kind:?} {name}: {sweeps:.1} sweeps a tap, at most {most}"));
            }
        }
    }
    assert!(faults.is_empty(), "{place:?}:\n{}", faults.join("\n"));
}

#[test]
fn cpu_f32_agrees() {
    agrees(CPU);
}

#[test]
fn cpu_f64_agrees() {
    agrees(CPU_F64);
}

#[test]
fn gpu_f32_agrees() {
    agrees(GPU);
}

#[test]
fn gpu_f64_agrees() {
    agrees(GPU_F64);
}
