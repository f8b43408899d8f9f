//! Rows of a data file as taps and zero readings, tared and grouped, and cells: taps of one distance and one drive.

use crate::measure::{Data, Groups, Rig, Row, Tared, TaredBy, Zero, counts, zero::Rest};
use crate::{fields::plain, physics::driven::Driven, reduce::median, scene::Drive};

#[derive(Debug, Clone, PartialEq)]
pub struct Tap {
    /// Index among the rows of the file.
    pub place: usize,
    pub line: usize,
    /// Contact distance as labelled, mm.
    pub a: f64,
    /// Drive above its origin, degrees or mm; 1 if it was not recorded.
    pub drive: f64,
    /// Means of the groups of its distance and of its drive.
    pub group: [f64; 2],
    pub value: f64,
    /// Signal in the unit of `signal`, with counter overflows undone.
    pub raw: f64,
    /// Subtracted zero, in the unit of `signal`.
    pub zero: f64,
    /// Runs of zero readings in its zero: index, weight, variance in units of a reading's.
    pub zeros: [(usize, f64, f64); 2],
    /// Tared strain or reading; tension positive.
    pub signal: f64,
    pub reason: Option<Reason>,
    /// First line with the same text.
    pub twin: Option<usize>,
}

impl Tap {
    /// Drive as a locator takes it: that of its row, if `data` have drives.
    pub fn recorded(&self, data: &Data) -> f64 {
        if data.drive.is_some() { data.rows[self.place].drive } else { self.drive }
    }

    /// True if it is used and on the side of this sign.
    pub(crate) fn is_of(&self, sign: f64) -> bool {
        self.reason.is_none() && self.signal.signum() == sign
    }

    /// Variance of its zero in units of a reading's.
    pub fn zero_share(&self) -> f64 {
        self.zeros.iter().map(|(_, weight, share)| weight * weight * share).sum()
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct ZeroReading {
    pub place: usize,
    pub signal: f64,
    pub reason: Option<Reason>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Sorted {
    pub taps: Vec<Tap>,
    pub zeros: Vec<ZeroReading>,
    pub zero: Zero,
    pub tared: Tared,
    pub groups: [Groups; 2],
    /// Largest movement of the drive below its zero without contact, in its unit; else 0.
    pub before: f64,
    /// Drive that counts as 0.
    pub origin: f64,
}

/// Sorts rows into taps and zero readings and marks unusable ones. `drive` serves rows without one; `group` are the widths of equal labels.
pub fn taps(data: &Data, rig: &Rig, drive: Option<f64>, group: [Option<f64>; 2]) -> Sorted {
    let factor = rig.setup.gauge.factor;
    let levels = |labels: Vec<[f64; 2]>| {
        [0, 1].map(|axis| Groups::of(labels.iter().map(|l| l[axis]), group[axis], axis == 1))
    };
    let groups = levels(data.rows.iter().map(|r| [r.a, r.drive]).collect());
    let count =
        |r: &Row| counts::Count { at: [groups[0].centre(r.a), groups[1].centre(r.drive)], value: r.value };
    let counts: Vec<counts::Count> = data.rows.iter().map(count).collect();
    let turn = if data.unit.is_absolute() { None } else { counts::turn(&counts) };
    let signal = |r: &Row| data.unit.strain(counts::unwrapped(r.value, turn) - r.late, factor);
    let signals: Vec<f64> = data.rows.iter().map(signal).collect();
    let Rest { rest, from, until, origin, step } = Rest::of(data, &signals, &groups[0]);
    let mut zeros = Vec::new();
    let mut taps = Vec::new();
    let mut first_lines = std::collections::HashMap::with_capacity(data.rows.len());
    for (place, row) in data.rows.iter().enumerate() {
        let signal = signals[place];
        if rest[place] {
            let reason = (!signal.is_finite()).then(|| nothing(data, place));
            zeros.push(ZeroReading { place, signal, reason });
            continue;
        }
        // Unmeasured rows of a plan are not repeats.
        let first = signal.is_finite().then(|| *first_lines.entry(row.text).or_insert(row.line));
        let twin = first.filter(|line| *line != row.line);
        let drive = if data.drive.is_some() { row.drive - origin } else { drive.unwrap_or(1.0) };
        let Row { line, a, value, .. } = *row;
        let (group, raw, zeros, reason) = ([a, drive], signal, [(0, 0.0, 0.0); 2], None);
        taps.push(Tap { place, line, a, drive, group, value, raw, zero: 0.0, zeros, signal, reason, twin });
    }
    let usable = |z: &&ZeroReading| z.reason.is_none();
    let mut readings: Vec<(usize, f64)> = zeros.iter().filter(usable).map(|z| (z.place, z.signal)).collect();
    let mut sizes: Vec<f64> = taps.iter().map(|t| t.signal.abs()).filter(|s| s.is_finite()).collect();
    for place in Zero::outliers(&readings, median(&mut sizes)) {
        zeros.iter_mut().filter(|z| z.place == place).for_each(|z| z.reason = Some(Reason::ZeroOutlier));
        readings.retain(|r| r.0 != place);
    }
    let zero = Zero::new(&readings);
    let groups = levels(taps.iter().map(|t| [t.a, t.drive]).collect());
    for tap in &mut taps {
        tap.group = [groups[0].centre(tap.a), groups[1].centre(tap.drive)];
        tap.zero = zero.at(tap.place);
        tap.signal = data.unit.above(tap.signal, tap.zero, factor);
        tap.zeros = zero.weights(tap.place);
        tap.reason = unusable(tap, data, rig).or_else(|| tilted(data, rig, tap.place));
    }
    let mut spread = crate::reduce::Spread::default();
    readings.iter().for_each(|r| spread.push(r.1));
    let error = spread.sd().map_or(0.0, |sd| sd / (readings.len() as f64).sqrt());
    let from = if readings.is_empty() { TaredBy::None } else { from };
    let tared = Tared { from, value: spread.mean().unwrap_or(0.0), error, until, wraps: turn.is_some() };
    let lowest = data.rows.iter().enumerate().filter(|(i, _)| rest[*i]).map(|(_, r)| -r.drive);
    let before = if origin == 0.0 { lowest.fold(0.0, f64::max) } else { step };
    Sorted { taps, zeros, zero, tared, groups, before, origin }
}

/// Reason why a row does not serve the first gauge alone.
fn tilted(data: &Data, rig: &Rig, place: usize) -> Option<Reason> {
    data.beside.tilt.as_ref().filter(|_| rig.setup.gauge.second)?;
    match data.beside.values[place][1] {
        tilt if !tilt.is_finite() => Some(Reason::NotANumber),
        0.0 => None,
        _ => Some(Reason::Tilted),
    }
}

fn nothing(data: &Data, place: usize) -> Reason {
    let missing = data.missing.iter().find(|m| m.place == place);
    missing.map_or(Reason::NotANumber, |m| Reason::Missing(m.value))
}

fn unusable(tap: &Tap, data: &Data, rig: &Rig) -> Option<Reason> {
    if !(tap.a.is_finite() && tap.drive.is_finite() && tap.signal.is_finite()) {
        return Some(nothing(data, tap.place));
    }
    if !rig.design.admits(&rig.setup, tap.a, tap.drive) {
        return Some(Reason::OutsideDomain);
    }
    if tap.a <= rig.shared().gauge[0] {
        return Some(Reason::NoStrain);
    }
    (tap.signal == 0.0).then_some(Reason::ZeroSignal)
}

/// Reason for which a row is not used, with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    NotANumber,
    /// The value means "missing": a usual code, or one value at several places far from all others.
    Missing(f64),
    /// The labels are outside the whisker or the domain of the drive.
    OutsideDomain,
    /// The contact is at or inside the gauge's near end.
    NoStrain,
    /// The signal is exactly 0 despite contact.
    ZeroSignal,
    /// The sign is that of the other side, which has too few taps to be calibrated.
    OtherSide,
    Saturated,
    /// The signal is off by this number of decades: another unit.
    Unit(i32),
    /// The signal fits another distance, mm.
    LooksLikeDistance(f64),
    LooksLikeDrive(f64),
    /// Off the smooth surface through the other cells by this share.
    Off(f64),
    ZeroOutlier,
    /// The pole is tilted: such a row serves the second gauge only.
    Tilted,
}

impl Reason {
    pub fn word(&self) -> &'static str {
        match self {
            Self::NotANumber => "not_a_number",
            Self::Missing(_) => "missing_value",
            Self::OutsideDomain => "outside_domain",
            Self::NoStrain => "no_strain",
            Self::ZeroSignal => "zero_signal",
            Self::OtherSide => "opposite_sign",
            Self::Saturated => "saturated",
            Self::Unit(_) => "wrong_unit",
            Self::LooksLikeDistance(_) | Self::LooksLikeDrive(_) => "mislabelled",
            Self::Off(_) => "outlier",
            Self::ZeroOutlier => "zero_outlier",
            Self::Tilted => "tilted",
        }
    }

    /// True if the row is suspect; false if it is valid but not used here.
    pub fn is_doubt(&self) -> bool {
        *self != Self::Tilted
    }

    pub fn text(&self, kind: Drive) -> String {
        let percent = |x: f64| format!("{:+.2} %", 100.0 * x);
        let more = match self {
            Self::Unit(decades) => format!("about 1e{decades} of what is expected"),
            Self::LooksLikeDistance(a) => format!("reads as a_mm = {a}"),
            Self::LooksLikeDrive(d) => format!("reads as {} = {d}", kind.column()),
            Self::Off(x) => format!("{} off the surface through the other rows", percent(*x)),
            Self::OutsideDomain => "a or the drive is outside the whisker or below zero".to_owned(),
            Self::Missing(x) => format!("{} stands for no value", plain(*x)),
            Self::Tilted => "for the second gauge only".to_owned(),
            _ => return self.word().to_owned(),
        };
        format!("{}: {more}", self.word())
    }
}

/// Taps of one distance and one drive on one side.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    pub i: usize,
    pub j: usize,
    pub taps: Vec<usize>,
    pub a: f64,
    pub drive: f64,
    pub signal: f64,
    /// Mean θ f in the theory of the spec.
    pub linear: f64,
    /// Sum of squares about the mean, corrected for distance and drive within the level.
    pub squares: f64,
    /// Expected sum of squares for a reading's variance of 1.
    pub freedom: f64,
    /// Variance of the mean in units of a reading's: 1/n plus the zeros' part.
    pub share: f64,
    /// Runs of zero readings below its mean: index, weight, variance in units of a reading's.
    pub zeros: Vec<(usize, f64, f64)>,
}

impl Cell {
    pub fn n(&self) -> f64 {
        self.taps.len() as f64
    }
}

/// Levels of distance and drive, and cells by distance, then drive, of the `wanted` taps.
pub fn grouped(taps: &[Tap], rig: &Rig, wanted: impl Fn(&Tap) -> bool) -> ([Groups; 2], Vec<Cell>) {
    let levels = |axis: usize| Groups::levels(taps.iter().filter(|t| wanted(t)).map(|t| t.group[axis]));
    let [distances, drives] = [0, 1].map(levels);
    let mut grid: Vec<Vec<usize>> = vec![Vec::new(); distances.len() * drives.len()];
    for (k, tap) in taps.iter().enumerate().filter(|(_, t)| wanted(t)) {
        grid[distances.place(tap.group[0]) * drives.len() + drives.place(tap.group[1])].push(k);
    }
    let curve = rig.shared().theory.curve();
    let linear = |t: &Tap| Driven::of_users(rig.setup.drive, t.drive).size() * curve.value(t.a);
    let cell = |(place, taps_here): (usize, Vec<usize>)| {
        if taps_here.is_empty() {
            return None;
        }
        let n = taps_here.len() as f64;
        let mean = |f: &dyn Fn(&Tap) -> f64| taps_here.iter().map(|&k| f(&taps[k])).sum::<f64>() / n;
        // Relative to the first value, so that the mean of equal values is exact.
        let about = |f: &dyn Fn(&Tap) -> f64| {
            let first = f(&taps[taps_here[0]]);
            first + mean(&|t| f(t) - first)
        };
        let (a, drive) = (about(&|t| t.a), about(&|t| t.drive));
        let (signal, theory) = (about(&|t| t.signal.abs()), about(&linear));
        let ratio = signal / theory;
        let squares = n * mean(&|t| (t.signal.abs() - ratio * linear(t)).powi(2));
        let (i, j, squares) =
            (place / drives.len(), place % drives.len(), if n > 1.0 { squares } else { 0.0 });
        let (zeros, [of_mean, about_mean]) = zero_noise(taps_here.iter().map(|&k| &taps[k]));
        let (freedom, share, taps, linear) = (n - 1.0 + about_mean, 1.0 / n + of_mean, taps_here, theory);
        Some(Cell { i, j, taps, a, drive, signal, linear, squares, freedom, share, zeros })
    };
    let cells = grid.into_iter().enumerate().filter_map(cell).collect();
    ([distances, drives], cells)
}

/// Noise of the zero readings in a cell: runs with weights; variance of the mean and sum of squares about it, in units of a reading's variance.
fn zero_noise<'a>(taps: impl Iterator<Item = &'a Tap>) -> (Vec<(usize, f64, f64)>, [f64; 2]) {
    let mut runs = std::collections::BTreeMap::<usize, (f64, f64, f64)>::new();
    let mut n = 0.0;
    for tap in taps {
        n += 1.0;
        for (run, weight, share) in tap.zeros {
            if weight != 0.0 {
                let sum = runs.entry(run).or_insert((0.0, 0.0, share));
                *sum = (sum.0 + weight, sum.1 + weight * weight, share);
            }
        }
    }
    let add = |[mean, about]: [f64; 2], (sum, squares, share): &(f64, f64, f64)| {
        [mean + share * (sum / n).powi(2), about + share * (squares - sum * sum / n).max(0.0)]
    };
    let noise = runs.values().fold([0.0; 2], add);
    (runs.into_iter().map(|(run, (sum, _, share))| (run, sum / n, share)).collect(), noise)
}
