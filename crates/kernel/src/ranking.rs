//! Designs ranked from charts: the data for a device ([`Sheet`]), and the results. Charts are made and read above this crate.

use std::ops::Range;

use vibrissa_core::status::Status;

/// Path of a design in ranking.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// From charts.
    Easy,
    /// Tap by tap.
    Hard,
    /// Not a whisker with a gauge.
    Void,
}

/// The words of combination `k`.
pub fn combined(k: usize) -> Status {
    TOLD[k / 4] | WORN.get(k % 4).copied().unwrap_or(WORN[1] | WORN[2])
}

/// Results of an estimate.
pub const TOLD: [Status; 3] = [Status::OK, Status::AMBIGUOUS, Status::NO_ROOT];

/// Words of a tap that do not depend on its estimate; both of the last two may occur together.
pub const WORN: [Status; 3] = [Status::OK, Status::STRAIN_LIMIT, Status::SLIPPED_OFF];

/// Combinations of words: for each of [`TOLD`] those of [`WORN`], then `strain_limit` and `slipped_off` together.
pub const COMBINED: usize = 12;

/// Taps per combination of status words.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Words {
    /// In the order of [`COMBINED`].
    pub taps: [u64; COMBINED],
    /// Taps with `invalid_geometry`.
    pub invalid: u64,
}

impl Words {
    /// Adds `other`.
    pub fn add(&mut self, other: &Self) {
        self.taps.iter_mut().zip(other.taps).for_each(|(n, more)| *n += more);
        self.invalid += other.invalid;
    }

    /// Each combination with its taps.
    pub fn combinations(&self) -> impl Iterator<Item = (Status, u64)> {
        let all = self.taps.into_iter().enumerate().map(|(k, n)| (combined(k), n));
        all.chain([(Status::INVALID_GEOMETRY, self.invalid)])
    }
}

/// Best rows and counts of some designs.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// Rank, design, drive.
    pub rows: Vec<(f32, u64, u32)>,
    /// Complete rows; where designs compete, designs that have one.
    pub complete: u64,
    /// Taps per status word.
    pub words: Words,
    /// Designs that must be solved tap by tap.
    #[serde(skip)]
    pub hard: Vec<u64>,
}

impl Found {
    /// Adds `other`.
    pub fn merge(&mut self, other: Self) {
        self.rows.extend(other.rows);
        self.complete += other.complete;
        self.words.add(&other.words);
        self.hard.extend(other.hard);
    }
}

/// Results of a finished batch of a device.
pub struct Batch {
    /// Its designs.
    pub range: Range<u64>,
    /// Designs with a row below the bound.
    pub best: Vec<u64>,
    /// The counts and hard designs; the rows are not listed.
    pub found: Found,
}

/// The ranking of some designs on the CPU, below a bound.
pub type OnCpu<'a> = dyn Fn(&[u64], f32) -> Found + 'a;

/// Bounds on q beyond which a design is solved tap by tap: of one reading, known exactly, and of many, known by bounds.
pub const BEYOND: [[f64; 2]; 2] = [[-0.9, 9.0], [-0.5, 0.5]];

/// Share of the way to infinity, or to the apex, beyond which an estimate is solved.
pub const FARTHEST: f64 = 1.1e-3;

/// Charts of some distances, with all else that ranking needs, as a device reads them. Lengths in mm, drives in rad or mm.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Constants and functions, in WGSL.
    pub constants: String,
    /// For each distance its numbers, then place and weight of the gauge's points; then drives and small matrices, whose starts are among the constants.
    pub numbers: Vec<f32>,
    /// For each distance and branch, where the strain's and the arc's series begin (two numbers each: here and in `rows`); then, group by group of a
    /// series, how many places, for each how many tapers, for each how many rows.
    pub shape: Vec<u32>,
    /// Coefficients of four orders over the drive, for each order over D/a; then the polynomials over the drive at the points.
    pub rows: Vec<[f32; 4]>,
    /// Numbers that an invocation keeps of its taps.
    pub kept: usize,
    /// Most loop rounds of a design: one per order of its series, and per drive of every tap.
    pub rounds: usize,
    /// rad or mm per unit of a tuple's drive.
    pub unit: f32,
}
