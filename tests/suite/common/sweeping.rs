//! Sweeps in this process: spec text and backend in, tables out.

use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::pool;
use vibrissa::backend::Choice;
use vibrissa::error::Error;
use vibrissa::evaluate::Method;
use vibrissa::plan::Plan;
use vibrissa::progress::Silent;
use vibrissa::scene::{BackendChoice, Precision, RunOptions, Setup, Tuple};
use vibrissa::spec;
use vibrissa::sweep::{self, Report, Target};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    pub backend: BackendChoice,
    pub precision: Precision,
}

pub const CPU: Place = Place { backend: BackendChoice::Cpu, precision: Precision::F32 };
pub const CPU_F64: Place = Place { backend: BackendChoice::Cpu, precision: Precision::F64 };
pub const GPU: Place = Place { backend: BackendChoice::Gpu, precision: Precision::F32 };
pub const GPU_F64: Place = Place { backend: BackendChoice::Gpu, precision: Precision::F64 };
pub const REFERENCE: Place = Place { backend: BackendChoice::Reference, precision: Precision::F64 };

impl Place {
    /// Fails, rather than skips, where the machine lacks the backend.
    pub fn choice(self) -> Choice {
        let options = RunOptions {
            backend: Some(self.backend),
            precision: Some(self.precision),
            ..RunOptions::default()
        };
        pool::choice(&options).unwrap_or_else(|e| {
            panic!("{self:?} is not here, and tests do not skip it (Debian: apt install mesa-vulkan-drivers): {e}")
        })
    }

    pub fn open(self, setup: &Setup) -> Method {
        pool::open(self, &self.choice(), &setup.model)
    }
}

pub type Row = HashMap<String, String>;

#[derive(Debug, Default, PartialEq)]
pub struct Table {
    pub text: String,
    pub columns: Vec<String>,
    pub rows: Vec<Row>,
}

impl Table {
    pub fn read(path: &Path) -> Self {
        std::fs::read_to_string(path).map_or_else(|_| Self::default(), Self::parse)
    }

    pub fn parse(text: String) -> Self {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let columns = reader.headers().expect("a header").iter().map(str::to_owned).collect();
        let rows = reader.deserialize().collect::<Result<_, _>>().expect("rows as wide as the header");
        Self { text, columns, rows }
    }

    pub fn column(&self, name: &str) -> Vec<&str> {
        self.rows.iter().map(|row| row[name].as_str()).collect()
    }

    pub fn statuses(&self) -> Vec<&str> {
        self.column("status")
    }

    pub fn numbers(&self, column: &str) -> Vec<Option<f64>> {
        self.rows.iter().map(|row| number(row, column)).collect()
    }

    /// `numbers` with NaN for an empty field.
    pub fn values(&self, column: &str) -> Vec<f64> {
        self.numbers(column).into_iter().map(|x| x.unwrap_or(f64::NAN)).collect()
    }
}

/// None if the field is empty.
#[track_caller]
pub fn number(row: &Row, column: &str) -> Option<f64> {
    let field = row.get(column).unwrap_or_else(|| panic!("no column {column}"));
    let value: Option<f64> = (!field.is_empty()).then(|| field.parse().expect("a number"));
    assert!(value.is_none_or(f64::is_finite), "{column} = {field}");
    value
}

#[track_caller]
pub fn value(row: &Row, column: &str) -> f64 {
    number(row, column).unwrap_or_else(|| panic!("{column} of {row:?}"))
}

/// The tap of a row; upright if the row has no direction.
pub fn tap(row: &Row) -> Tuple {
    let drive = if row.contains_key("theta_deg") { "theta_deg" } else { "delta_mm" };
    let names = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "tilt_deg", "lean_deg", drive];
    Tuple::from_array(names.map(|c| if row.contains_key(c) { value(row, c) } else { 0.0 }))
}

pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values.into_iter().fold((0.0, 0), |(sum, n), x| (sum + x * x, n + 1));
    (sum / f64::from(n)).sqrt()
}

pub struct Swept {
    pub report: Report,
    pub tuples: Table,
    pub designs: Table,
    pub distances: Table,
}

pub fn sweep_into(out: &Path, text: &str, list: Option<&str>, place: Place) -> Result<Report, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    if let Some(list) = list {
        std::fs::write(folder.path().join("list.csv"), list).expect("a tuple file");
    }
    let (spec, choice) = (spec::parse("spec.toml", text, folder.path())?, place.choice());
    let (plan, stop) = (Plan::new(&spec.study, &choice)?, AtomicBool::new(false));
    sweep::run(&spec, &plan, &choice, &Target::new(out, &stop), &mut Silent)
}

pub fn sweep_with(text: &str, list: Option<&str>, place: Place) -> Swept {
    let out = tempfile::tempdir().expect("a folder");
    let report = sweep_into(out.path(), text, list, place).unwrap_or_else(|e| panic!("{e}"));
    let read = |name: &str| Table::read(&out.path().join(name));
    Swept {
        report,
        tuples: read("tuples.csv"),
        designs: read("designs.csv"),
        distances: read("distances.csv"),
    }
}

pub fn sweep(text: &str, place: Place) -> Swept {
    sweep_with(text, None, place)
}

/// Seven groups of designs, ranked from charts, some of them solved; `top` rows are kept.
pub fn ranked(top: usize) -> String {
    format!(
        "[whisker]\nD = [8, 10]\nd = {{ from = 2, to = 9, steps = 6_000 }}\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
         [tap]\na = {{ from = 15, to = 48, steps = 8 }}\ntheta = {{ from = 1, to = 12, steps = 9 }}\n\
         [output]\ntop = {top}\nby = \"total_rms_mm\"\n"
    )
}
