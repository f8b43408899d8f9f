//! Synthetic rigs: a spec, simulated data, a calibration, fresh taps.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use vibrissa::calibrate::{Calibrated, Options, calibrate};
use vibrissa::locate::{Estimator, Locator, Parameter, locator::opener};
use vibrissa::measure::{Data, Rig, Row};
use vibrissa::scene::{Drive, RunOptions, Setup, Spec};
use vibrissa::simulate::{Settings, empty, simulate};
use vibrissa::sink::frame::Frame;
use vibrissa::spec;

pub const REAL: &str =
    "[model]\nshear = true\nsurface = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n";
pub const TAPS: &str =
    "[tap]\na = { from = 21, to = 48, step = 3 }\ntheta = [0.5, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]\n";

pub fn prototype(d: f64, more: &[&str]) -> String {
    format!("[whisker]\nD = 10\nd = {d}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n{}", more.concat())
}

fn parsed(text: &str) -> Spec {
    spec::parse("rig.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"))
}

pub fn rig(text: &str) -> Rig {
    Rig::of_spec(&parsed(text), "rig.toml").unwrap_or_else(|e| panic!("{e}"))
}

pub fn table(text: &str, settings: &Settings) -> String {
    let (rig, spec) = (rig(text), parsed(text));
    let layout = spec.study.space.layout().expect("a rig has axes");
    let directions = spec.study.setup.directions;
    let method = opener(&RunOptions::default())(&rig.setup.model).unwrap();
    let mut all = empty(&rig, directions, settings.unit);
    let mut write = |some: &Frame| all.extend(some, 0..some.len());
    simulate(&rig, (&layout, directions), settings, method, &mut write).unwrap();
    String::from_utf8(all.csv().unwrap()).unwrap()
}

pub fn data(table: &str) -> Data {
    Data::parse("data.csv", table.as_bytes()).unwrap_or_else(|e| panic!("{e}"))
}

pub fn calibrated(table: &str, whisker: &str, fit: &[Parameter]) -> Calibrated {
    let options = Options { fit: fit.to_vec(), ..Options::default() };
    calibrate(&data(table), &rig(whisker), &options).unwrap_or_else(|e| panic!("{e}"))
}

/// Calibrates without a spec; `far` is the largest distance, mm.
pub fn undescribed(table: &str, drive: Drive, far: f64) -> Calibrated {
    let rig = Rig::unknown(Setup { drive, ..Setup::default() }, far).unwrap();
    calibrate(&data(table), &rig, &Options::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// `calibrated`, cached for all tests.
pub fn once(table: &str, whisker: &str) -> Arc<Calibrated> {
    static MADE: Mutex<BTreeMap<String, Arc<OnceLock<Arc<Calibrated>>>>> = Mutex::new(BTreeMap::new());
    let key = format!("{table}{whisker}");
    let one = MADE.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default().clone();
    one.get_or_init(|| Arc::new(calibrated(table, whisker, &[]))).clone()
}

pub fn locator(c: &Calibrated, asked: Option<Estimator>) -> Locator {
    Locator::new(&c.calibration, "calibration.toml", asked, &opener(&RunOptions::default())).unwrap()
}

#[derive(Debug)]
pub struct Score {
    pub taps: usize,
    pub rms: f64,
    pub coverage: f64,
    /// rms of σ_ε/|dε/da|: the error that noise alone causes.
    pub limit: f64,
    pub unanswered: usize,
}

pub fn score(locator: &Locator, table: &str, noise: f64) -> Score {
    let (mut squares, mut inside, mut limit, mut n, mut unanswered) = (0.0, 0, 0.0, 0, 0);
    for row in data(table).rows {
        let at = locator.locate(row.drive, row.value);
        if !at.distance.is_finite() {
            unanswered += 1;
            continue;
        }
        let error = at.distance - row.a;
        let sign = row.value.signum();
        let slope = (locator.expected(row.a + 0.01, row.drive, sign)
            - locator.expected(row.a - 0.01, row.drive, sign))
            / 0.02;
        (squares, limit, n) = (squares + error * error, limit + (noise / slope).powi(2), n + 1);
        inside += usize::from(error.abs() <= at.sigma);
    }
    let mean = |x: f64| (x / n as f64).sqrt();
    Score { taps: n, rms: mean(squares), coverage: inside as f64 / n as f64, limit: mean(limit), unanswered }
}

pub fn fresh(text: &str, [min, max]: [f64; 2], samples: u32) -> String {
    let axis =
        format!("a = {{ min = {min}, max = {max}, samples = {samples}, sampler = \"random\", seed = 5 }}");
    let line = |l: &str| if l.starts_with("a = ") { axis.clone() } else { l.to_owned() };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Rows of a table, mapped by `f`, under the header `head`; NaN gives an empty field.
pub fn rewritten<const N: usize>(
    table: &str,
    head: &str,
    mut f: impl FnMut(usize, &Row) -> [f64; N],
) -> String {
    let field = |x: f64| if x.is_nan() { String::new() } else { x.to_string() };
    let rows = data(table).rows;
    let lines = rows.iter().enumerate().map(|(k, row)| f(k, row).map(field).join(",") + "\n");
    format!("{head}\n{}", lines.collect::<String>())
}
