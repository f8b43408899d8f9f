//! Texts that users write: specs, tables of tuples, curves, measurements, calibrations.

use std::path::Path;
use std::sync::LazyLock;

use vibrissa::calibrate::{Options, calibrate};
use vibrissa::locate::calibration::Calibration;
use vibrissa::locate::locator::opener;
use vibrissa::locate::{Locator, stream};
use vibrissa::measure::{Data, Names, Rig};
use vibrissa::scene::{Drive, RunOptions, Space};
use vibrissa::sink::lab::LabTable;
use vibrissa::spec;

use crate::{desk, told};

/// Tuples of a space: first, last and some between.
fn look(space: &Space) {
    if let Some(layout) = space.layout() {
        let n = layout.len();
        for i in [0, n / 3, n / 2, n.saturating_sub(1)] {
            if i < n {
                layout.tuple(i);
            }
        }
    }
}

pub fn spec(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let base = Path::new("/nowhere");
    if let Some(spec) = told(spec::parse("spec.toml", text, base)) {
        look(&spec.study.space);
    }
    told(spec::parse_search("spec.toml", text, base));
    told(spec::parse_tap("spec.toml", text, base, true));
}

pub fn tuples(data: &[u8]) {
    let Some((first, data)) = data.split_first() else { return };
    desk::write("list.csv", data);
    let tap = if first % 2 == 0 { "" } else { "[tap]\ndrive = \"displacement\"\n" };
    let text = format!("[tuples]\nfile = \"list.csv\"\n{tap}");
    if let Some(spec) = told(spec::parse("spec.toml", &text, desk::folder())) {
        look(&spec.study.space);
    }
}

pub fn curve(data: &[u8]) {
    desk::write("curve.csv", data);
    const SPEC: &str = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 30\ntheta = 4\n\
                        [model]\nmaterial = { curve = \"curve.csv\" }\n";
    told(spec::parse("spec.toml", SPEC, desk::folder()));
}

/// The whisker of the measurements, with closed forms, which are fast.
static RIG: LazyLock<Rig> = LazyLock::new(|| {
    const SPEC: &str = "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 33, 48]\ntheta = [1, 8]\n\
                        [model]\ngeometry = \"linear\"\n";
    desk::write("rig.toml", SPEC.as_bytes());
    Rig::read(&desk::path("rig.toml"), Some(Drive::Angle)).expect("a rig")
});

/// A calibration from a table of valid numbers.
static CALIBRATION: LazyLock<Calibration> = LazyLock::new(|| {
    let row = |a: f64, d: f64| {
        format!("{a},{d},{}\n", 0.16 * d.to_radians() / (a / 21.0) * (1.0 + 0.001 * (a * d).sin()))
    };
    let rows: String =
        [21.0, 27.0, 33.0, 39.0, 45.0].iter().flat_map(|a| [1.0, 4.0, 8.0].map(|d| row(*a, d))).collect();
    let data = Data::parse("data.csv", format!("a_mm,theta_deg,strain\n{rows}").as_bytes()).expect("data");
    calibrate(&data, &RIG, &Options::default()).expect("a calibration").calibration
});

/// A table of measurements, as input of `calibrate` and, line by line, of `locate`.
pub fn measurements(data: &[u8]) {
    static LOCATOR: LazyLock<Locator> = LazyLock::new(|| {
        Locator::new(&CALIBRATION, "calibration.toml", None, &opener(&RunOptions::default()))
            .expect("it opens")
    });
    told(Data::parse("data.csv", data));
    let names = Names::default();
    for label in [None, Some("data.csv")] {
        let ask = stream::Ask { label, keep: label.is_some(), ..stream::Ask::of_file("", &names, &|_| {}) };
        told(stream::zeros((&*LOCATOR).into(), LabTable::Text(data).into(), &ask));
    }
}

/// With a valid checksum.
pub fn calibration(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Some(read) = told(Calibration::parse("calibration.toml", text, true)) {
        let again = read.sealed().to_text();
        told(Calibration::parse("calibration.toml", &again, false));
    }
}

pub fn record(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let Some(record) = told(vibrissa::record::Record::parse("raw.csv", LabTable::Text(text.as_bytes()), &Default::default())) else { return };
    if let Some((readings, _)) = told(vibrissa::record::find(&record, vibrissa::record::Take::Auto)) {
        assert!(!readings.is_empty(), "neither rests nor taps, and no error");
    }
}
