//! The reference rod against the cases of another code (model §5).

use std::collections::{BTreeMap, HashMap};

use crate::common::cases::rows;
use crate::common::{configuration, tap};
use vibrissa::physics::rod::{RodProblem, RodTap};
use vibrissa::physics::taper::Taper;
use vibrissa::scene::model::Drive;

/// Largest relative error allowed in strain, force and arc.
const TOLERANCE: f64 = 1e-9;

type Row = HashMap<String, String>;

fn number(row: &Row, column: &str) -> Option<f64> {
    row.get(column).map(|value| value.parse().expect("a number"))
}

fn solve(row: &Row) -> RodTap {
    let get = |column| number(row, column).expect("a column");
    let (model, side) = configuration(&row["config"]);
    let taper = Taper::new(get("D_mm"), get("d_mm"), get("L_a_mm"));
    let (drive, amount) = match number(row, "delta_mm") {
        Some(delta) => (Drive::Displacement, delta),
        None => (Drive::Angle, get("theta_deg").to_radians()),
    };
    let (gauge, distance) = (taper.gauge(get("x_ss_mm"), get("l_mm")), get("a_mm"));
    let hub = number(row, "hub_mm").unwrap_or(0.0);
    RodProblem { taper, gauge, side, distance, hub, drive, amount, ..tap(&model, 4.0, distance, 1.0) }
        .solve()
        .unwrap_or_else(|error| panic!("{row:?}: {error}"))
}

/// Compares every row of `file` and prints, per configuration and quantity, the worst and the median error.
fn compare(file: &str) {
    let mut census = BTreeMap::<(String, &str), Vec<(f64, usize)>>::new();
    for (index, row) in rows(file).iter().enumerate() {
        let found = solve(row);
        for (quantity, value) in [
            ("strain", found.strain),
            ("normal_force_N", found.normal_force),
            ("tangential_force_N", found.tangential_force),
            ("contact_arc_mm", found.contact_arc),
        ] {
            let Some(expected) = number(row, quantity) else { continue };
            let error = if expected == 0.0 { value.abs() } else { (value / expected - 1.0).abs() };
            census.entry((row["config"].clone(), quantity)).or_default().push((error, index + 2));
        }
        if let Some(state) = row.get("contact_state") {
            assert_eq!(found.sticking, state == "stick", "{row:?}");
        }
    }
    for ((config, quantity), errors) in &mut census {
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (median, (worst, line)) = (errors[errors.len() / 2].0, errors[errors.len() - 1]);
        println!("{file} {config:15} {quantity:19} worst {worst:.1e} (line {line}) median {median:.1e}");
    }
    for (key, errors) in &census {
        assert!(errors.iter().all(|(error, _)| *error <= TOLERANCE), "{file} {key:?}");
    }
}

#[test]
fn taps_agree_with_another_code() {
    for file in ["tap_cases", "hub_cases", "passive_cases"] {
        compare(file);
    }
}
