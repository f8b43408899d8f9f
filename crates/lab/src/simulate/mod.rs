//! Synthetic measurements: what a rig would record of a whisker that is exactly the model. They are examples and tests, no
//! evidence about a real sensor; a column says so in every row.

pub mod object;
pub mod strokes;

use serde_json::{Value, json};

use crate::error::{Error, InputError};
use crate::evaluate::{Evaluator, Method, Outcome, Task};
use crate::measure::{Rig, Unit};
use crate::scene::{Drive, Layout, Setup, Signal, Tuple, channels::MOST_CHANNELS, sampler::Sampler};
use crate::sink::{Field, Frame, heading};

pub const SOURCE: &str = "synthetic";

/// Columns of a table beside what a rig records.
pub const BESIDE: [&str; 4] = ["repeat", "source", "fault", "status"];

/// Most rows of one table: random numbers of a row are told by its number.
pub const MOST_ROWS: u64 = u32::MAX as u64;

/// What a rig of `rig` records: the `asked` column, which `key` names, else that of its sensor.
pub fn recorded(rig: &Rig, asked: Option<&str>, key: &str) -> Result<Unit, InputError> {
    let Some(name) = asked else { return Ok(Unit::of_signal(rig.setup.signal)) };
    let unit = Unit::of_column(name).ok_or_else(|| {
        let known = Unit::ALL.map(Unit::column).join(", ");
        InputError::new("there is no such signal").key(key).value(name).allowed(known)
    })?;
    if let Some(other) = unit.signal().filter(|signal| *signal != rig.setup.signal) {
        let error = InputError::new("the sensor of the spec shows another signal").key(key);
        let allowed = format!("signal = \"{}\" in [sensor] of the spec", other.word());
        return Err(error.value(unit.column()).allowed(allowed));
    }
    Ok(unit)
}

/// Rows that are written together, about.
const PIECE: usize = 1 << 13;
const BATCH: usize = 1 << 14;

/// Effects of a rig in addition to the model; all but noise are off by default.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Taps of each distance and drive.
    pub repeats: u64,
    /// Standard deviation of one reading, in strain.
    pub noise: f64,
    pub seed: u64,
    /// Number of taps of a group; a zero reading stands before each group.
    pub zero_every: Option<u64>,
    /// Drift of the zero per row, in strain.
    pub drift: f64,
    /// Share of taps that are wrong: half of them labelled with another distance, half off by 20 … 100 %.
    pub outliers: f64,
    /// |strain| at which the sensor stops.
    pub saturate: Option<f64>,
    /// Share of the last tap's strain that is still there.
    pub hysteresis: f64,
    /// Signal per strain.
    pub factor: f64,
    /// Added to every labelled drive before the whisker is tapped, degrees or mm.
    pub drive_offset: f64,
    /// Added to every labelled distance before the whisker is tapped, mm.
    pub a_offset: f64,
    pub unit: Unit,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            repeats: 1,
            noise: 0.0,
            seed: 1,
            zero_every: None,
            drift: 0.0,
            outliers: 0.0,
            saturate: None,
            hysteresis: 0.0,
            factor: 1.0,
            drive_offset: 0.0,
            a_offset: 0.0,
            unit: Unit::Strain,
        }
    }
}

impl Settings {
    /// As they stand in `run.json`; offsets in the unit of the drive `kind`.
    pub fn described(&self, kind: Drive) -> Value {
        let offset = if kind == Drive::Angle { "theta_offset_deg" } else { "delta_offset_mm" };
        let mut v = json!({
            "repeats": self.repeats, "noise_strain": self.noise, "seed": self.seed, "zero_every": self.zero_every,
            "drift_strain_per_row": self.drift, "outliers": self.outliers, "saturate_strain": self.saturate,
            "hysteresis": self.hysteresis, "factor": self.factor, "a_offset_mm": self.a_offset,
            "signal": self.unit.column(),
        });
        v[offset] = self.drive_offset.into();
        v
    }

    /// Rows of a table with each of `taps` (distances × strokes) so often, zero readings included; refuses more than `most`.
    pub fn rows(&self, taps: u64, most: u64) -> Result<u64, InputError> {
        let rows_of = |repeats: u64| {
            let taps = u128::from(taps) * u128::from(repeats);
            // One before the first tap, and one after the last.
            taps + self.zero_every.map_or(0, |every| taps.div_ceil(u128::from(every)) + 1)
        };
        let (rows, most) = (rows_of(self.repeats), u128::from(most));
        if rows <= most {
            return Ok(rows as u64);
        }
        // So many taps t that t + ⌈t/every⌉ + 1 rows have room.
        let room = self.zero_every.map(u128::from).map_or(most, |n| most.saturating_sub(1) * n / (n + 1));
        let allowed = match room / u128::from(taps).max(1) {
            0 => format!("fewer distances and drives: one repeat of them is {} rows", rows_of(1)),
            fit => format!("1 … {fit}"),
        };
        let message = format!("these would be {rows} rows; there is room for {most} in one table");
        Err(InputError::new(message).key("--repeats").value(self.repeats).allowed(allowed))
    }

    pub fn check(&self) -> Result<(), InputError> {
        let Self { noise, drift, outliers, hysteresis, factor, drive_offset, a_offset, .. } = *self;
        let (negative, share) = ("this must be a number that is not negative", "this is a share");
        let (finite, saturate) = ("this must be a finite number", self.saturate.unwrap_or(1.0));
        let (deaf, limit) = ("a sensor without response measures nothing", "this is not a strain limit");
        let sound = |x: f64| x >= 0.0 && x.is_finite();
        let large = noise >= 0.5 && self.unit.signal() == Some(Signal::Strain);
        let strains = "≥ 0 and < 0.5 (strain, one standard deviation; 15 microstrain are 15e-6)";
        let checks = [
            (sound(noise), "--noise", noise, negative, Some("≥ 0")),
            (sound(hysteresis), "--hysteresis", hysteresis, negative, Some("≥ 0")),
            (sound(outliers), "--outliers", outliers, negative, Some("≥ 0")),
            (!large, "--noise", noise, "this is more noise than strain", Some(strains)),
            (outliers <= 1.0, "--outliers", outliers, share, Some("0 … 1")),
            (hysteresis < 1.0, "--hysteresis", hysteresis, share, Some("0 … 1")),
            (drift.is_finite(), "--drift", drift, finite, None),
            (factor.is_finite(), "--factor", factor, finite, None),
            (drive_offset.is_finite(), "--drive-offset", drive_offset, finite, None),
            (a_offset.is_finite(), "--a-offset", a_offset, finite, None),
            (factor != 0.0, "--factor", factor, deaf, Some("a number other than 0")),
            (saturate > 0.0 && saturate.is_finite(), "--saturate", saturate, limit, Some("> 0")),
        ];
        let Some((_, key, x, message, allowed)) = checks.into_iter().find(|check| !check.0) else {
            return Ok(());
        };
        let error = InputError::new(message).key(key).value(x);
        Err(allowed.into_iter().fold(error, InputError::allowed))
    }
}

/// As they stand in `run.json`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    pub taps: u64,
    #[serde(rename = "zero_readings")]
    pub zeros: u64,
    /// Taps that the model has no answer to: their signal is empty.
    pub unsolved: u64,
    /// Taps with a deliberate fault.
    pub faults: u64,
}

/// Simulates taps of `rig`: for every distance of `layout`, for every repeat, all its strokes in turn, with the columns of the pole's direction that are
/// `shown`. `write` takes rows of the table.
pub fn simulate(
    rig: &Rig,
    (layout, shown): (&Layout, [bool; 2]),
    settings: &Settings,
    method: Method,
    write: &mut dyn FnMut(&Frame) -> Result<(), Error>,
) -> Result<Counts, Error> {
    let mut evaluator = Evaluator::new(&rig.setup, method);
    let designs = [rig.design.clone()];
    let strokes: Vec<Tuple> = (0..layout.n_drives).map(|j| layout.stroke(&layout.design(0), j)).collect();
    let mut recorder = Recorder::new((rig, settings), shown, empty(rig, shown, settings.unit), write);
    let per = (BATCH as u64 / layout.n_drives.max(1)).max(1);
    let mut from = 0;
    while from < layout.n_distances {
        let to = (from + per).min(layout.n_distances);
        let labels: Vec<f64> = (from..to).map(|i| layout.distance(i)).collect();
        let task = |a: f64, t: &Tuple| {
            let drive = t.drive + settings.drive_offset;
            Task { a: a + settings.a_offset, drive, ..Task::of(0, t) }
        };
        let tasks: Vec<Task> = labels.iter().flat_map(|a| strokes.iter().map(|t| task(*a, t))).collect();
        let outcomes = evaluator.run(&designs, &tasks)?;
        for (k, a) in labels.iter().enumerate() {
            let here = &outcomes[k * strokes.len()..][..strokes.len()];
            let other = layout.distance((from + k as u64 + 1) % layout.n_distances);
            for repeat in 1..=settings.repeats {
                for (stroke, tap) in strokes.iter().zip(here) {
                    let stroke = Tuple { a: *a, ..*stroke };
                    recorder.tap((&stroke, other), repeat, tap)?;
                }
                recorder.write(PIECE)?;
            }
        }
        from = to;
    }
    if settings.zero_every.is_some() {
        let last = Tuple { a: layout.distance(layout.n_distances - 1), ..strokes[strokes.len() - 1] };
        recorder.zero(&last)?;
    }
    recorder.write(0)?;
    Ok(recorder.counts)
}

pub fn empty(rig: &Rig, shown: [bool; 2], unit: Unit) -> Frame {
    let (table, setup) = (heading("measurements"), Setup { directions: shown, ..rig.setup.clone() });
    let names = table.names_as(&[setup.drive.column(), unit.column(), unit.second()]);
    let there = names.into_iter().zip(&table.columns).filter(|(name, fact)| fact.only.holds(name, &setup));
    let names = there.flat_map(|(name, _)| match &setup.channels {
        Some(channels) if name == unit.column() => channels.measured(),
        _ => vec![name],
    });
    table.of(&names.collect::<Vec<_>>())
}

/// Records rows of a table, each after the one before.
struct Recorder<'a> {
    settings: &'a Settings,
    rig: &'a Rig,
    /// Columns of the pole's direction that are written.
    shown: [bool; 2],
    table: Frame,
    counts: Counts,
    write: &'a mut dyn FnMut(&Frame) -> Result<(), Error>,
    row: u32,
    since_zero: u64,
    /// Strains of the last tap.
    last: [f64; 2],
}

impl<'a> Recorder<'a> {
    /// Before the first row of `table`, whose pieces `write` takes.
    fn new(
        (rig, settings): (&'a Rig, &'a Settings),
        shown: [bool; 2],
        table: Frame,
        write: &'a mut dyn FnMut(&Frame) -> Result<(), Error>,
    ) -> Self {
        let counts = Counts::default();
        Self { settings, rig, shown, table, counts, write, row: 0, since_zero: u64::MAX, last: [0.0; 2] }
    }

    /// Writes the rows so far, if they are more than `rows`.
    fn write(&mut self, rows: usize) -> Result<(), Error> {
        if self.table.len() > rows {
            (self.write)(&self.table)?;
            self.table = self.table.like();
        }
        Ok(())
    }

    /// True if a zero reading stands before the next tap.
    fn rests(&mut self) -> bool {
        let rests = self.settings.zero_every.is_some_and(|n| self.since_zero >= n);
        self.since_zero = if rests { 1 } else { self.since_zero.saturating_add(1) };
        rests
    }

    fn uniform(&self, dimension: u32) -> f64 {
        Sampler::Random.uniform(self.settings.seed, dimension, self.row)
    }

    /// Two standard normal numbers of this row, independent of each other, from two dimensions (Box and Muller 1958).
    fn normal(&self, dimension: u32) -> [f64; 2] {
        let size = (-2.0 * self.uniform(dimension).ln()).sqrt();
        let turn = std::f64::consts::TAU * self.uniform(dimension + 1);
        [size * turn.cos(), size * turn.sin()]
    }

    /// The recorded values of the strains of both gauges (zero, noise, end stop, factor, unit), and whether a sensor that is there stopped.
    fn record(&mut self, strains: [f64; 2]) -> ([f64; 2], bool) {
        let (s, second) = (self.settings, self.rig.setup.gauge.second);
        let noise = if s.noise > 0.0 { self.normal(0).map(|z| s.noise * z) } else { [0.0; 2] };
        let stop = s.saturate.unwrap_or(f64::INFINITY);
        let drift = s.drift * f64::from(self.row);
        self.row = self.row.wrapping_add(1);
        let read = [0, 1].map(|k| strains[k] + drift + noise[k]);
        let value = |x: f64| s.unit.value(s.factor * x.clamp(-stop, stop), self.rig.setup.gauge.factor);
        (read.map(value), read[0].abs() > stop || second && read[1].abs() > stop)
    }

    /// Where a row is, how far it is driven, and what is recorded.
    fn row(&self, at: &Tuple, drive: f64, values: &[f64]) -> Vec<Field> {
        let mut row = vec![Field::Number(at.a)];
        let angles = self.shown.into_iter().zip([at.tilt, at.lean]);
        row.extend(angles.filter_map(|(shown, angle)| shown.then_some(Field::Number(angle))));
        row.push(Field::Number(drive));
        row.extend(values.iter().map(|x| Field::Number(*x)));
        row
    }

    /// The recorded values of a tap whose strains of both gauges these are, or without contact, and whether a sensor stopped.
    fn values(&mut self, strains: [f64; 2], tap: Option<(&Outcome, f64)>) -> (Vec<f64>, bool) {
        let Some(channels) = &self.rig.setup.channels else {
            let (values, stopped) = self.record(strains);
            return (values[..1 + usize::from(self.rig.setup.gauge.second)].to_vec(), stopped);
        };
        let read = tap.map_or([0.0; MOST_CHANNELS], |(tap, spike)| {
            channels.read(self.rig.setup.felt(tap.wrench), tap.strain).map(|x| spike * x)
        });
        // The first five dimensions are those of one signal and of its faults.
        let noise = channels.noise(&std::array::from_fn(|k| self.normal(5 + 2 * k as u32)[0]));
        self.row = self.row.wrapping_add(1);
        let value = |k: usize| self.settings.factor * (read[k] + noise[k]);
        ((0..channels.rows.len()).map(value).collect(), false)
    }

    fn zero(&mut self, at: &Tuple) -> Result<(), Error> {
        let (values, _) = self.values([0.0; 2], None);
        self.counts.zeros += 1;
        let row = self.row(at, 0.0, &values).into_iter();
        self.table.row(row.chain([f64::NAN.into(), SOURCE.into(), "".into(), "ok".into()]))
    }

    fn tap(&mut self, (at, other): (&Tuple, f64), repeat: u64, tap: &Outcome) -> Result<(), Error> {
        if self.rests() {
            self.zero(at)?;
        }
        let memory = self.last.map(|strain| self.settings.hysteresis * strain);
        let wrong = self.settings.outliers > 0.0 && self.uniform(2) < self.settings.outliers;
        let mislabelled = wrong && self.uniform(3) < 0.5 && other != at.a;
        let spike = if wrong && !mislabelled { 1.2 + 0.8 * self.uniform(4) } else { 1.0 };
        let strains = [tap.strain, tap.strain_2];
        let shown = [0, 1].map(|k| spike * (strains[k] + memory[k]));
        let (values, stopped) = self.values(shown, Some((tap, spike)));
        if values.iter().all(|x| x.is_finite()) {
            self.last = strains.map(|strain| if strain.is_nan() { 0.0 } else { strain });
        } else {
            self.counts.unsolved += 1;
        }
        let label = Tuple { a: if mislabelled { other } else { at.a }, ..*at };
        let fault = match (stopped, mislabelled, wrong) {
            (true, ..) => "saturated",
            (_, true, _) => "mislabelled",
            (.., true) => "spike",
            _ => "",
        };
        self.counts.faults += u64::from(!fault.is_empty());
        self.counts.taps += 1;
        let row = self.row(&label, at.drive, &values).into_iter();
        self.table.row(row.chain([repeat.into(), SOURCE.into(), fault.into(), tap.status.into()]))
    }
}
