//! What the signal column holds.

use super::Data;
use crate::scene::Signal;

/// Unit of the recorded signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Strain, dimensionless.
    Strain,
    /// Strain in 1e-6.
    Microstrain,
    /// Output of a quarter bridge over its supply, mV/V.
    Bridge,
    /// Any signal proportional to the bending at one place; the factor is unknown.
    Reading,
    /// M₀ at the base, N mm, counterclockwise (model §7).
    Moment,
    /// F_y at the base, N.
    Force,
}

impl Unit {
    /// All, by column name.
    pub const ALL: [Self; 6] =
        [Self::Strain, Self::Microstrain, Self::Bridge, Self::Reading, Self::Moment, Self::Force];

    /// Name of the column that holds it.
    pub fn column(self) -> &'static str {
        match self {
            Self::Strain => "strain",
            Self::Microstrain => "microstrain",
            Self::Bridge => "bridge_mV_per_V",
            Self::Reading => "reading",
            Self::Moment => "moment_Nmm",
            Self::Force => "force_N",
        }
    }

    /// What of a whisker it tells; none of a reading, which tells any.
    pub fn signal(self) -> Option<Signal> {
        match self {
            Self::Strain | Self::Microstrain | Self::Bridge => Some(Signal::Strain),
            Self::Reading => None,
            Self::Moment => Some(Signal::Moment),
            Self::Force => Some(Signal::Force),
        }
    }

    /// The unit in which `signal` is told.
    pub fn of_signal(signal: Signal) -> Self {
        match signal {
            Signal::Strain => Self::Strain,
            Signal::Moment => Self::Moment,
            Signal::Force => Self::Force,
        }
    }

    /// The column of a second gauge.
    pub fn second(self) -> &'static str {
        match self {
            Self::Strain => "strain_2",
            Self::Microstrain => "microstrain_2",
            Self::Bridge => "bridge_mV_per_V_2",
            Self::Reading | Self::Moment | Self::Force => "reading_2",
        }
    }

    /// The unit of a column, if it is a signal.
    pub fn of_column(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|u| u.column() == name)
    }

    /// Whether the signal says how large the strain, the moment or the force is.
    pub fn is_absolute(self) -> bool {
        self.signal().is_some()
    }

    /// Column in which every table gives the signal: strain, or what else it is.
    pub fn common(self) -> &'static str {
        self.signal().map_or(Self::Reading, Self::of_signal).column()
    }

    /// The same of a second gauge.
    pub fn second_common(self) -> &'static str {
        if self.is_absolute() { "strain_2" } else { "reading_2" }
    }

    /// Strain of a recorded value, tension positive; what is no strain stays as it is. NaN where the bridge cannot give `value`.
    pub fn strain(self, value: f64, gauge_factor: f64) -> f64 {
        match self {
            Self::Strain | Self::Reading | Self::Moment | Self::Force => value,
            Self::Microstrain => value * 1e-6,
            Self::Bridge => quarter_bridge_strain(value, gauge_factor),
        }
    }

    /// Strain above what was shown without contact, both as [`Self::strain`] makes them of recorded values: a bridge that is not in balance
    /// is off by as many mV/V at every strain, by no constant strain.
    pub fn above(self, strain: f64, zero: f64, gauge_factor: f64) -> f64 {
        match self {
            Self::Bridge if zero != 0.0 => {
                let shown = |x| quarter_bridge_output(x, gauge_factor);
                quarter_bridge_strain(shown(strain) - shown(zero), gauge_factor)
            }
            _ => strain - zero,
        }
    }

    /// The value that is recorded at a strain: the inverse of [`Self::strain`].
    pub fn value(self, strain: f64, gauge_factor: f64) -> f64 {
        match self {
            Self::Strain | Self::Reading | Self::Moment | Self::Force => strain,
            Self::Microstrain => strain * 1e6,
            Self::Bridge => quarter_bridge_output(strain, gauge_factor),
        }
    }
}

/// Strain of the one active gauge of a bridge whose output is `mv_per_v`, mV/V: ε = 4v/(GF (1 − 2v)), v = mV/V/1000. The
/// supply sees R(1 + GF ε) beside three R, so that v = GF ε/(4 + 2 GF ε). NaN at v ≥ 1/2, which no bridge gives.
pub fn quarter_bridge_strain(mv_per_v: f64, gauge_factor: f64) -> f64 {
    let v = mv_per_v / 1000.0;
    if v < 0.5 { 4.0 * v / (gauge_factor * (1.0 - 2.0 * v)) } else { f64::NAN }
}

/// Output in mV/V of a quarter bridge at `strain`: v = GF ε/(4 + 2 GF ε).
pub fn quarter_bridge_output(strain: f64, gauge_factor: f64) -> f64 {
    let x = gauge_factor * strain;
    1000.0 * x / (4.0 + 2.0 * x)
}

/// Rows with a drive below 0, at least.
const ROWS: usize = 3;
/// Signals at one drive lie on a line over 1/a² but for this share of their scatter.
const LEFT: f64 = 0.3;
/// Both sides give alike: slopes per drive differ by no more than this factor.
const ALIKE: f64 = 3.0;

/// `data` with drives above 0 alone, where those below 0 are taps to the other side: at one drive their signals change with the distance the other way. (Before contact they do not
/// change, and a slip of the sign changes them the same way.)
pub fn folded(data: &Data) -> Option<Data> {
    let below = slope(data, |drive| drive < 0.0).filter(|(_, rows)| *rows >= ROWS)?.0;
    let above = slope(data, |drive| drive > 0.0)?.0;
    let ratio = -below / above;
    if !(1.0 / ALIKE..ALIKE).contains(&ratio) {
        return None;
    }
    let mut data = data.clone();
    data.rows.iter_mut().for_each(|row| row.drive = row.drive.abs());
    Some(data)
}

/// By how much signals change with |drive|/a² at one drive, of rows whose drive is `wanted`, and of how many rows; `None` where they do not follow it.
fn slope(data: &Data, wanted: impl Fn(f64) -> bool) -> Option<(f64, usize)> {
    let mut drives = std::collections::BTreeMap::<u64, Vec<[f64; 2]>>::new();
    for row in data.rows.iter().filter(|r| wanted(r.drive) && r.a > 0.0 && r.value.is_finite()) {
        drives.entry(row.drive.to_bits()).or_default().push([row.drive.abs() / row.a.powi(2), row.value]);
    }
    let (mut sums, mut rows) = ([0.0; 3], 0);
    for all in drives.values() {
        let mean = |k: usize| all.iter().map(|p| p[k]).sum::<f64>() / all.len() as f64;
        let middle = [mean(0), mean(1)];
        for [x, y] in all {
            let (x, y) = (x - middle[0], y - middle[1]);
            sums = [sums[0] + x * x, sums[1] + x * y, sums[2] + y * y];
            rows += 1;
        }
    }
    let [xx, xy, yy] = sums;
    let left = 1.0 - xy * xy / (xx * yy);
    (left <= LEFT).then(|| (xy / xx, rows))
}
