//! One row of synthetic measurements: what is added to the model's answer, and how it is recorded.

use super::{Counts, SOURCE, Settings};
use crate::error::Error;
use crate::evaluate::Outcome;
use crate::measure::Rig;
use crate::scene::Tuple;
use crate::scene::channels::MOST_CHANNELS;
use crate::scene::sampler::Sampler;
use crate::sink::{Field, Frame};

/// Records rows of a table, each after the one before.
pub(super) struct Recorder<'a> {
    settings: &'a Settings,
    rig: &'a Rig,
    /// Columns of the pole's direction that are written.
    shown: [bool; 2],
    pub table: Frame,
    pub counts: Counts,
    write: &'a mut dyn FnMut(&Frame) -> Result<(), Error>,
    pub row: u32,
    since_zero: u64,
    /// Strains of the last tap.
    last: [f64; 2],
}

impl<'a> Recorder<'a> {
    /// Before the first row of `table`, whose pieces `write` takes.
    pub fn new(
        (rig, settings): (&'a Rig, &'a Settings),
        shown: [bool; 2],
        table: Frame,
        write: &'a mut dyn FnMut(&Frame) -> Result<(), Error>,
    ) -> Self {
        let counts = Counts::default();
        Self { settings, rig, shown, table, counts, write, row: 0, since_zero: u64::MAX, last: [0.0; 2] }
    }

    /// Writes the rows so far, if they are more than `rows`.
    pub fn write(&mut self, rows: usize) -> Result<(), Error> {
        if self.table.len() > rows {
            (self.write)(&self.table)?;
            self.table = self.table.like();
        }
        Ok(())
    }

    /// Whether a zero reading stands before the next tap.
    pub fn rests(&mut self) -> bool {
        let rests = self.settings.zero_every.is_some_and(|n| self.since_zero >= n);
        self.since_zero = if rests { 1 } else { self.since_zero.saturating_add(1) };
        rests
    }

    fn uniform(&self, dimension: u32) -> f64 {
        Sampler::Random.uniform(self.settings.seed, dimension, self.row)
    }

    /// Two standard normal numbers of this row, independent of each other, from two dimensions (Box and Muller 1958).
    pub fn normal(&self, dimension: u32) -> [f64; 2] {
        let size = (-2.0 * self.uniform(dimension).ln()).sqrt();
        let turn = std::f64::consts::TAU * self.uniform(dimension + 1);
        [size * turn.cos(), size * turn.sin()]
    }

    /// The recorded values of the strains of both gauges (zero, noise, end stop, factor, unit), and whether a sensor that is there stopped.
    pub fn record(&mut self, strains: [f64; 2]) -> ([f64; 2], bool) {
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

    pub fn zero(&mut self, at: &Tuple) -> Result<(), Error> {
        let (values, _) = self.values([0.0; 2], None);
        self.counts.zeros += 1;
        let row = self.row(at, 0.0, &values).into_iter();
        self.table.row(row.chain([f64::NAN.into(), SOURCE.into(), "".into(), "ok".into()]))
    }

    pub fn tap(&mut self, (at, other): (&Tuple, f64), repeat: u64, tap: &Outcome) -> Result<(), Error> {
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
