//! Units of the signal column.

use super::{Data, names::Role};
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
        Role::Signal(self).column().unwrap_or_default()
    }

    /// Name of the second gauge's column.
    pub fn second(self) -> &'static str {
        Role::Second(self).column().unwrap_or("reading_2")
    }

    /// The quantity of the whisker that is measured; `None` for a reading, which may be any.
    pub fn signal(self) -> Option<Signal> {
        match self {
            Self::Strain | Self::Microstrain | Self::Bridge => Some(Signal::Strain),
            Self::Reading => None,
            Self::Moment => Some(Signal::Moment),
            Self::Force => Some(Signal::Force),
        }
    }

    /// The unit of `signal`.
    pub fn of_signal(signal: Signal) -> Self {
        Self::ALL.into_iter().find(|unit| unit.signal() == Some(signal)).unwrap_or(Self::Reading)
    }

    /// The unit of the column `name`, if it is a signal.
    pub fn of_column(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|u| u.column() == name)
    }

    /// True if strain, moment or force is measured in absolute terms.
    pub fn is_absolute(self) -> bool {
        self.signal().is_some()
    }

    /// Column of the signal in all tables of results: strain, moment, force or reading.
    pub fn common(self) -> &'static str {
        self.signal().map_or(Self::Reading, Self::of_signal).column()
    }

    /// Strain of a recorded value, tension positive; other signals unchanged. NaN for an impossible output of the bridge.
    pub fn strain(self, value: f64, gauge_factor: f64) -> f64 {
        match self {
            Self::Strain | Self::Reading | Self::Moment | Self::Force => value,
            Self::Microstrain => value * 1e-6,
            Self::Bridge => quarter_bridge_strain(value, gauge_factor),
        }
    }

    /// Strain above the zero, both converted by [`Self::strain`]: an unbalanced bridge is off by a constant output, not by a constant strain.
    pub fn above(self, strain: f64, zero: f64, gauge_factor: f64) -> f64 {
        match self {
            Self::Bridge if zero != 0.0 => {
                let shown = |x| quarter_bridge_output(x, gauge_factor);
                quarter_bridge_strain(shown(strain) - shown(zero), gauge_factor)
            }
            _ => strain - zero,
        }
    }

    /// Inverse of [`Self::strain`].
    pub fn value(self, strain: f64, gauge_factor: f64) -> f64 {
        match self {
            Self::Strain | Self::Reading | Self::Moment | Self::Force => strain,
            Self::Microstrain => strain * 1e6,
            Self::Bridge => quarter_bridge_output(strain, gauge_factor),
        }
    }
}

/// Strain of the active gauge of a quarter bridge with output `mv_per_v`: ε = 4v/(GF (1 − 2v)), v = mV/V/1000, since
/// v = GF ε/(4 + 2 GF ε). NaN at v ≥ 1/2, which no bridge gives.
pub fn quarter_bridge_strain(mv_per_v: f64, gauge_factor: f64) -> f64 {
    let v = mv_per_v / 1000.0;
    if v < 0.5 { 4.0 * v / (gauge_factor * (1.0 - 2.0 * v)) } else { f64::NAN }
}

/// Output of a quarter bridge at `strain`, mV/V: v = GF ε/(4 + 2 GF ε).
pub fn quarter_bridge_output(strain: f64, gauge_factor: f64) -> f64 {
    let x = gauge_factor * strain;
    1000.0 * x / (4.0 + 2.0 * x)
}

/// Fewest rows with a negative drive.
const ROWS: usize = 3;
/// Largest unexplained share of the variance of signals over |drive|/a² at one drive.
const LEFT: f64 = 0.3;
/// Largest ratio between the slopes of the two sides.
const ALIKE: f64 = 3.0;

/// `data` with |drive|, if negative drives are taps to the other side: at one drive their signals change with distance in the opposite direction.
/// (Before contact they do not change; after a wrong sign they change in the same direction.)
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

/// Slope of the signal over |drive|/a² at fixed drive, and the number of rows, for rows whose drive is `wanted`; `None` without a linear relation.
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
