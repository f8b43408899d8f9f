//! A calibration of several channels as a program for a robot: tables of what each channel shows, and the search for the most likely tap.
//!
//! A table holds signal/drive as a Chebyshev series over ln a and the drive, and the variance of what is expected on a grid, over the distances
//! and drives that `locate` looks at. The file looks for the tap as `locate` does, with derivatives of the series in place of differences.

mod c;
mod python;

use super::{Language, text};
use crate::error::{Error, InputError};
use crate::locate::likely::{BEYOND, Response};
use crate::locate::opened::Opened;
use crate::locate::{Locator, Sensor, Several, several};
use crate::physics::chebyshev::{coefficients2, placed, points, scaled, series};
use crate::scene::{Side, Signal};

/// Rows over ln a and columns over the drive of the series, tried in this order.
const NODES: [[usize; 2]; 3] = [[16, 8], [28, 12], [48, 16]];
/// Points of the grid of variances, over ln a and the drive.
const GRID: [usize; 2] = [49, 13];
/// Error of a series, relative to the signals of its channel, that is small enough.
const FINE: f64 = 1e-8;
/// Largest error that an export may have, mm, and where a distance is told less well as a share of its σ: what the grid of variances leaves.
const LARGEST: [f64; 2] = [2e-4, 0.01];
/// Digits of the largest coefficient that count.
const DIGITS: f64 = 14.0;
/// Taps that are compared: distances and drives, among the calibrated ones.
const COMPARED: [usize; 2] = [12, 4];

/// One side of a channel.
struct Table<'a> {
    locator: &'a Locator,
    side: &'a Opened,
    /// Ends of ln a.
    ends: [f64; 2],
    /// Calibrated drives, from their origin.
    drives: [f64; 2],
    /// Rows over ln a.
    series: Vec<Vec<f64>>,
    variance: Vec<Vec<f64>>,
}

/// A channel: its sides.
struct Tables<'a>(Vec<Table<'a>>);

impl Tables<'_> {
    fn side(&self, sign: f64) -> Option<&Table<'_>> {
        self.0.iter().find(|t| t.side.sign == sign)
    }
}

impl Response for Tables<'_> {
    fn of(&self) -> &Locator {
        self.0[0].locator
    }

    fn expected(&self, a: f64, u: f64, sign: f64) -> f64 {
        self.side(sign).map_or(f64::NAN, |t| t.expected(a, u - t.locator.drive_origin))
    }

    fn left(&self, a: f64, u: f64, sign: f64) -> f64 {
        self.side(sign).map_or(0.0, |t| t.left(a, u - t.locator.drive_origin))
    }
}

impl<'a> Table<'a> {
    /// Of a side of `locator`, with so many nodes; `None` where it has no number somewhere.
    fn new(locator: &'a Locator, side: &'a Opened, [rows, columns]: [usize; 2]) -> Option<Self> {
        let [first, last] = side.distances;
        let drives = [side.drives[0], side.drives[side.drives.len() - 1]];
        let columns = if drives[1] > drives[0] { columns } else { 1 };
        let slack = BEYOND * (last - first);
        // A whisker may end within what is looked at beyond the calibrated distances.
        (0..4).map(|k| slack / f64::from(1 << (2 * k))).chain([0.0]).find_map(|slack| {
            let ends = [(first - slack).max(1e-3 * first).ln(), (last + slack).ln()];
            let value = |x: &f64, y: &f64| {
                let (a, u) = (placed(ends, *x).exp(), placed(drives, *y));
                locator.expected(a, u + locator.drive_origin, side.sign) / u
            };
            let (xs, ys) = (points(rows), points(columns));
            let values: Vec<Vec<f64>> = xs.iter().map(|x| ys.iter().map(|y| value(x, y)).collect()).collect();
            let ends_too = [-1.0, 1.0].iter().all(|x| ys.iter().all(|y| value(x, y).is_finite()));
            if !ends_too || !values.iter().flatten().all(|v| v.is_finite()) {
                return None;
            }
            let even = |k: usize, n: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
            let variance = |i: usize, j: usize| {
                let (a, u) = (placed(ends, even(i, GRID[0])).exp(), placed(drives, even(j, GRID[1])));
                Response::left(locator, a, u + locator.drive_origin, side.sign)
            };
            let variance = |i: usize| (0..GRID[1]).map(|j| text::digits(variance(i, j), 6)).collect();
            let variance = (0..GRID[0]).map(variance).collect();
            let series = counted(coefficients2(&values));
            Some(Self { locator, side, ends, drives, series, variance })
        })
    }

    /// Signal of a tap at `a` by the drive `u` from its origin.
    fn expected(&self, a: f64, u: f64) -> f64 {
        let rows: Vec<f64> = self.series.iter().map(|row| series(row, scaled(self.drives, u)).0).collect();
        u * series(&rows, scaled(self.ends, a.ln())).0
    }

    /// Variance of that, by straight lines between the points of the grid.
    fn left(&self, a: f64, u: f64) -> f64 {
        let place = |x: f64, n: usize| {
            let x = (0.5 * (x + 1.0) * (n - 1) as f64).clamp(0.0, (n - 1) as f64);
            let k = (x as usize).min(n - 2);
            (k, x - k as f64)
        };
        let (i, x) = place(scaled(self.ends, a.ln()), GRID[0]);
        let (j, y) = place(scaled(self.drives, u), GRID[1]);
        let row = |i: usize| (1.0 - y) * self.variance[i][j] + y * self.variance[i][j + 1];
        (1.0 - x) * row(i) + x * row(i + 1)
    }

    /// Largest error of the series between its nodes, relative to the largest signal.
    fn error(&self) -> f64 {
        let looks = [-0.99, -0.7, -0.31, 0.12, 0.44, 0.83, 0.97];
        let (mut worst, mut size) = (0.0f64, 0.0f64);
        for (x, y) in looks.iter().flat_map(|x| looks.map(|y| (*x, y))) {
            let (a, u) = (placed(self.ends, x).exp(), placed(self.drives, y));
            let exact = self.locator.expected(a, u + self.locator.drive_origin, self.side.sign);
            worst = worst.max((self.expected(a, u) - exact).abs());
            size = size.max(exact.abs());
        }
        worst / size
    }

    /// Number of the side of the whisker that it stands for; −1 where that is not known.
    fn gauge(&self) -> i32 {
        match (self.locator.rig.known, self.side.gauge) {
            (false, _) => -1,
            (true, Side::Contact) => 0,
            (true, Side::Far) => 1,
        }
    }

    /// |signal| of the strain limit; infinite where there is none.
    fn limit(&self) -> f64 {
        match self.locator.rig.setup.signal {
            Signal::Strain => text::limit(self.locator, self.side.factor),
            _ => f64::INFINITY,
        }
    }
}

/// A calibration of several channels, ready to be written.
pub struct Export<'a> {
    several: &'a Several,
    sensor: &'a Sensor,
    channels: Vec<Tables<'a>>,
    /// Largest difference of a distance to `locate` among the calibrated ones, mm.
    pub error: f64,
}

impl<'a> Export<'a> {
    /// Of what `several` answers, which was made of `sensor`.
    ///
    /// # Errors
    /// A channel that is not smooth enough, has no numbers within its own calibration, or counts that begin anew.
    pub fn new(several: &'a Several, sensor: &'a Sensor) -> Result<Self, Error> {
        if let Some(k) = several.locators.iter().position(|l| text::wraps(l).is_some()) {
            let error =
                InputError::new("counts of this channel begin anew beyond their range").key("--export");
            return Err(error.value(&several.names[k]).allowed("channels that do not wrap around").into());
        }
        let mut last = None;
        for nodes in NODES {
            let mut channels = Vec::new();
            for (locator, name) in several.locators.iter().zip(&several.names) {
                let tables = locator.sides().iter().map(|side| Table::new(locator, side, nodes));
                let Some(tables) = tables.collect::<Option<Vec<_>>>() else {
                    let why = format!("channel {name} expects no signal of some of its calibrated taps");
                    return Err(refused(why));
                };
                channels.push(Tables(tables));
            }
            let fine = channels.iter().flat_map(|c| &c.0).all(|t| t.error() <= FINE);
            last = Some(channels);
            if fine {
                break;
            }
        }
        let channels = last.unwrap_or_default();
        let [error, over] = compared(several, &channels);
        if over > 1.0 {
            return Err(refused(format!("they would be wrong by up to {error:.1e} mm")));
        }
        Ok(Self { several, sensor, channels, error })
    }

    /// The file in `language`.
    pub fn text(&self, language: Language) -> String {
        match language {
            Language::C => self.c(),
            Language::Python => self.python(),
        }
    }

    /// What the file is, line by line.
    fn comment(&self, precision: &str) -> String {
        let locators = &self.several.locators;
        let mut lines = vec![
            "Distance of a contact from several signals of a whisker: one calibration, one file, no dependency."
                .to_owned(),
            format!("Written by vibrissa {}.", env!("CARGO_PKG_VERSION")),
            String::new(),
        ];
        lines.extend(locators.iter().find_map(text::whisker));
        for (l, name) in locators.iter().zip(&self.several.names) {
            let (name, unit, by) = (text::harmless(name), text::unit(l), l.estimator.name());
            lines.push(format!("channel      {name}: {unit}, by {by}"));
        }
        lines.push(format!("drive        {}", text::drive(&locators[0])));
        for t in self.channels.iter().flat_map(|c| &c.0) {
            let ([lo, hi], [from, to]) = (t.side.distances, t.drives.map(|d| d + t.locator.drive_origin));
            let sign = if t.side.sign > 0.0 { '>' } else { '<' };
            lines.push(format!(
                "side         signal {sign} 0: distances {lo} ... {hi} mm, drives {from} ... {to}"
            ));
        }
        let error = self.error;
        lines.push(format!(
            "error        up to {error:.1e} mm to `vibrissa locate` among the calibrated distances{precision}"
        ));
        let data = &self.sensor.channels[0].1.data;
        let [file, hash] = [&data.file, &data.hash].map(|name| text::harmless(name));
        lines.push(format!("data         {file}, SHA-256 {hash}"));
        text::trimmed(&lines)
    }
}

/// Coefficients to as many digits as count beside the largest.
fn counted(mut c: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let largest = c.iter().flatten().fold(0.0, |l: f64, x| l.max(x.abs()));
    for x in c.iter_mut().flatten() {
        let behind = (largest / x.abs()).log10();
        *x = if behind < DIGITS { text::digits(*x, (DIGITS - behind).ceil() as usize) } else { 0.0 };
    }
    c
}

/// Largest difference of a distance by `channels` to that by `several`, with and without their drive; and
/// the largest over what it may be.
fn compared(several: &Several, channels: &[Tables<'_>]) -> [f64; 2] {
    let heard: Vec<&dyn Response> = channels.iter().map(|c| c as &dyn Response).collect();
    let first = &channels[0].0[0];
    let shares = vec![0.0; heard.len()];
    let even = |[lo, hi]: [f64; 2], k: usize, n: usize| lo + (hi - lo) * (k as f64 + 0.5) / n as f64;
    let mut worst = [0.0f64; 2];
    for (i, j) in (0..COMPARED[0]).flat_map(|i| (0..COMPARED[1]).map(move |j| (i, j))) {
        let a = even(first.side.distances, i, COMPARED[0]);
        let u = even(first.drives, j, COMPARED[1]) + first.locator.drive_origin;
        let signal = |l: &Locator| l.sides().iter().map(|s| l.expected(a, u, s.sign)).find(|x| x.is_finite());
        // Signals as they are read, one standard deviation to either side.
        let read = |(k, l): (usize, &Locator)| {
            let off =
                several.covariance[(k, k)].sqrt() * if (i + j + k).is_multiple_of(2) { 1.0 } else { -1.0 };
            signal(l).map_or(f64::NAN, |x| x + off)
        };
        let signals: Vec<f64> = several.locators.iter().enumerate().map(read).collect();
        for drive in [u, f64::NAN] {
            let own = several::together((&heard, &several.covariance), drive, &signals, &shares);
            let theirs = several.locate(drive, &signals, &shares);
            let off = (own.distance - theirs.distance).abs();
            // Where the channels tell next to nothing of a distance, another one is as good.
            let [first, last] = first.side.distances;
            let told = own.sigma.max(theirs.sigma) < last - first;
            if off.is_finite() && told {
                let allowed = LARGEST[0].max(LARGEST[1] * theirs.sigma);
                worst = [worst[0].max(off), worst[1].max(off / allowed)];
            }
        }
    }
    worst
}

fn refused(why: String) -> Error {
    let error = InputError::new(format!("these channels cannot be written as tables: {why}")).key("--export");
    error.value("several channels").allowed("channels whose calibrations are smooth").into()
}
