//! Data that make no sense, from random numbers to one wrong row: a calibration or an error, never a panic.

use crate::common::measuring::{TAPS, prototype, rig};
use proptest::prelude::*;
use vibrissa::calibrate::{Options, calibrate, output};
use vibrissa::error::Error;
use vibrissa::locate::{Locator, locator::opener};
use vibrissa::measure::Data;

/// Closed form: fast at any angle.
const LINEAR: &str = "[model]\ngeometry = \"linear\"\n";

/// Calibrates, locates a few readings and writes the calibration; every error must have a message.
fn survives(table: &str, more: &[&str]) -> Result<(), TestCaseError> {
    let told = |e: String| match e.is_empty() {
        true => Err(TestCaseError::fail("an error without words")),
        false => Ok(()),
    };
    let data = match Data::parse("data.csv", table.as_bytes()) {
        Ok(data) => data,
        Err(e) => return told(e.to_string()),
    };
    let options = Options { drive: data.drive.is_none().then_some(4.0), ..Options::default() };
    let found = match calibrate(&data, &rig(&prototype(7.0, &[&[TAPS], more].concat())), &options) {
        Ok(found) => found,
        Err(e) => return told(e.to_string()),
    };
    let open = opener(&options.run);
    let locator = match Locator::new(&found.calibration, "calibration.toml", None, &open) {
        Ok(locator) => locator,
        Err(e) => return told(e.to_string()),
    };
    for (drive, signal) in [(4.0, 0.02), (80.0, 1.0), (0.0, 0.0), (1e300, -1e300), (5e-324, f64::MAX)] {
        let _ = locator.locate(drive, signal);
    }
    match output::tables(&found, &data, &locator) {
        Ok(_) | Err(Error::Input(_) | Error::Run(_) | Error::Solve(_)) => Ok(()),
        Err(e @ Error::Io { .. }) => Err(TestCaseError::fail(e.to_string())),
    }
}

fn table(header: &str, rows: &[Vec<f64>]) -> String {
    let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
    format!("{header}\n{}", rows.iter().map(line).collect::<String>())
}

fn sound() -> Vec<Vec<f64>> {
    let row = |a: f64, d: f64| vec![a, d, 0.16 * d.to_radians() / (a / 21.0)];
    [21.0, 27.0, 33.0, 39.0, 45.0].iter().flat_map(|a| [1.0, 4.0, 8.0].map(|d| row(*a, d))).collect()
}

/// 21.8 written as 21,80: an angle of 80 degrees. The exact rod has no answer there: said of the row, after bounded work.
#[test]
fn an_angle_that_no_rod_has_is_survived() {
    survives(&(table("a_mm,theta_deg,strain", &sound()) + "21,80,0.03\n"), &[]).unwrap();
    for text in ["a_mm,reading\n27,0.02\n33,0.015\n21,80\n", "a_mm,theta_deg\n27,4\n21,80\n"] {
        survives(text, &[LINEAR]).unwrap();
    }
}

#[test]
fn extremes_are_survived() {
    let with = |row: [f64; 3], n: usize| {
        let mut rows = sound();
        rows.extend(vec![row.to_vec(); n]);
        table("a_mm,theta_deg,reading", &rows)
    };
    for row in [
        [2180.0, 4.0, 0.02],
        [21.0, 89.999, 0.02],
        [21.0, 4.0, 1e300],
        [21.0, 4.0, -f64::MAX],
        [21.0, 4.0, 5e-324],
        [21.0, 1e-300, 0.02],
        [5.0000001, 4.0, 0.02],
        [49.999999, 80.0, -0.02],
        [21.000000000000004, 4.000000000000001, 0.04],
    ] {
        for n in [1, 3] {
            survives(&with(row, n), &[LINEAR]).unwrap();
        }
    }
    let constant: Vec<Vec<f64>> = sound().into_iter().map(|r| vec![r[0], r[1], 0.01]).collect();
    for header in ["a_mm,theta_deg,strain", "a_mm,theta_deg,reading", "theta_deg,a_mm,reading"] {
        survives(&table(header, &constant), &[LINEAR]).unwrap();
    }
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => 0.0..60.0,
        2 => -0.1..0.1,
        1 => any::<f64>(),
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, 21.0, 80.0, 1e300, -1e300, 5e-324, f64::NAN, f64::INFINITY]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, max_shrink_iters: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_numbers_are_survived(
        rows in prop::collection::vec(prop::collection::vec(any_number(), 3), 1..24),
        unit in prop::sample::select(vec!["strain", "microstrain", "bridge_mV_per_V", "reading"]),
    ) {
        survives(&table(&format!("a_mm,theta_deg,{unit}"), &rows), &[LINEAR])?;
    }

    #[test]
    fn wrong_fields_are_survived(wrong in prop::collection::vec((0usize..15, 0usize..3, any_number()), 1..6)) {
        let mut rows = sound();
        for (row, column, value) in wrong {
            rows[row][column] = value;
        }
        survives(&table("a_mm,theta_deg,reading", &rows), &[LINEAR])?;
    }
}
