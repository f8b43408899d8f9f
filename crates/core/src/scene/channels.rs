//! Several channels of a sensor at the root: linear combinations of the wrench on the base and of the strain, each with its noise (model §7).

use nalgebra::DMatrix;

/// Largest number of channels.
pub const MOST_CHANNELS: usize = 6;

/// A number per channel; those beyond the last channel are unused.
pub type PerChannel = [f64; MOST_CHANNELS];

/// Sources of channels: M₀ (N mm), F_x, F_y (N), and the strain under the gauge.
pub const SOURCES: usize = 4;

/// Channels of a sensor, and the covariance of their noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Channels {
    /// Columns of each channel in tuples.csv: its reading and its K.
    pub names: Vec<[&'static str; 2]>,
    /// A row per channel: factors of M₀, F_x, F_y and the strain.
    pub rows: Vec<[f64; SOURCES]>,
    /// Covariance of the noise of one reading, row by row, if it is known.
    pub covariance: Option<Vec<f64>>,
    /// Its Cholesky factor, row by row.
    factor: Vec<f64>,
}

const OF_SIGNALS: [[&str; 2]; 3] =
    [["signal_strain", "K_strain"], ["signal_moment", "K_moment"], ["signal_force", "K_force"]];

const NUMBERED: [[&str; 2]; MOST_CHANNELS] = [
    ["channel_1", "K_1"],
    ["channel_2", "K_2"],
    ["channel_3", "K_3"],
    ["channel_4", "K_4"],
    ["channel_5", "K_5"],
    ["channel_6", "K_6"],
];

/// The column `name`, if it is that of a channel of a matrix.
pub fn numbered(name: &str) -> Option<&'static str> {
    NUMBERED.iter().map(|[column, _]| *column).find(|column| *column == name)
}

impl Channels {
    /// One channel for each of `signals`.
    pub fn of(signals: &[Signal], covariance: Option<Vec<f64>>) -> Option<Self> {
        let source = |signal: &Signal| match signal {
            Signal::Moment => 0,
            Signal::Force => 2,
            Signal::Strain => 3,
        };
        let row = |signal| std::array::from_fn(|k| f64::from(u8::from(source(signal) == k)));
        let names = signals.iter().map(|signal| OF_SIGNALS[*signal as usize]).collect();
        Self::new(names, signals.iter().map(row).collect(), covariance)
    }

    /// The channels of a matrix.
    pub fn matrix(rows: Vec<[f64; SOURCES]>, covariance: Option<Vec<f64>>) -> Option<Self> {
        Self::new(NUMBERED[..rows.len()].to_vec(), rows, covariance)
    }

    /// `None` if `covariance` is not positive definite.
    fn new(
        names: Vec<[&'static str; 2]>,
        rows: Vec<[f64; SOURCES]>,
        covariance: Option<Vec<f64>>,
    ) -> Option<Self> {
        let factor = covariance.as_ref().map_or(Some(Vec::new()), |all| cholesky(all, rows.len()))?;
        Some(Self { names, rows, covariance, factor })
    }

    /// Columns of each in a table of measured taps.
    pub fn measured(&self) -> Vec<&'static str> {
        let name = |[column, _]: &[&'static str; 2]| match *column {
            "signal_strain" => "strain",
            "signal_moment" => "moment_Nmm",
            "signal_force" => "force_N",
            other => other,
        };
        self.names.iter().map(name).collect()
    }

    /// True for channels of a matrix, whose units are the user's.
    pub fn is_matrix(&self) -> bool {
        self.names[0] == NUMBERED[0]
    }

    /// Noise of one reading of each channel from independent standard normal numbers.
    pub fn noise(&self, normal: &PerChannel) -> PerChannel {
        let n = self.rows.len();
        let one = |(k, row): (usize, &[f64])| row[..=k].iter().zip(normal).map(|(f, x)| f * x).sum();
        let mut all = [0.0; MOST_CHANNELS];
        all.iter_mut().zip(self.factor.chunks(n.max(1)).enumerate()).for_each(|(x, row)| *x = one(row));
        all
    }

    /// True if a channel reads the strain.
    pub fn read_strain(&self) -> bool {
        self.rows.iter().any(|row| row[3] != 0.0)
    }

    /// Readings of the wrench [M₀, F_x, F_y] and the strain; 0 beyond the last channel.
    pub fn read(&self, [moment, along, across]: [f64; 3], strain: f64) -> PerChannel {
        let mut all = [0.0; MOST_CHANNELS];
        for (reading, row) in all.iter_mut().zip(&self.rows) {
            // A quantity that a channel does not read may be NaN.
            let of = |share: f64, value: f64| if share == 0.0 { 0.0 } else { share * value };
            *reading = of(row[0], moment) + of(row[1], along) + of(row[2], across) + of(row[3], strain);
        }
        all
    }

    /// `readings` in units of white noise; without noise each relative to its size in `like`.
    pub fn white(&self, readings: &PerChannel, like: &PerChannel) -> PerChannel {
        let n = self.rows.len();
        let mut all = [0.0; MOST_CHANNELS];
        for k in 0..n {
            all[k] = match self.covariance {
                Some(_) => {
                    let known: f64 = (0..k).map(|m| self.factor[k * n + m] * all[m]).sum();
                    (readings[k] - known) / self.factor[k * n + k]
                }
                None => readings[k] / like[k].abs().max(f64::MIN_POSITIVE),
            };
        }
        all
    }
}

/// The lower factor of a positive definite matrix, row by row.
fn cholesky(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let factor = DMatrix::from_row_slice(n, n, matrix).cholesky()?.unpack();
    // Rounding of a singular matrix stays below this.
    let sound = (0..n).all(|i| factor[(i, i)].powi(2) > 1e-12 * matrix[i * n + i]);
    sound.then(|| factor.transpose().as_slice().to_vec())
}

words! {
    /// The quantity that a sensor reads.
    #[derive(Default)]
    Signal {
        /// Mean strain under a gauge.
        #[default]
        Strain = "strain",
        /// M₀, the moment at the base, N·mm.
        Moment = "moment",
        /// F_y, the force across the whisker at the base, N.
        Force = "force",
    }
}

impl Signal {
    /// Its unit; empty for strain.
    pub fn unit(self) -> &'static str {
        ["", "N mm", "N"][self as usize]
    }

    /// The value of this signal in [M₀, F_x, F_y]; `None` for strain.
    pub fn of(self, [moment, _, across]: [f64; 3]) -> Option<f64> {
        match self {
            Self::Strain => None,
            Self::Moment => Some(moment),
            Self::Force => Some(across),
        }
    }
}
