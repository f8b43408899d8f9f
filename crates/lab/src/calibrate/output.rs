//! Files of a calibration: calibration.toml, K_table.csv, designs.csv, distances.csv, rows.csv, run.json, and the export.

use super::{Calibrated, Reason};
use crate::estimator::taps::{Tap, ZeroReading};
use crate::locate::{Located, Locator};
use crate::scene::{Direction, Setup, Tuple};
use crate::sink::{AtDistance, AtDrive, Field, Frame, heading};
use crate::{error::Error, estimator::Estimator, measure::Data, status::Status};

/// Names of the possible files, without run.json.
pub const FILES: [&str; 6] =
    ["calibration.toml", "K_table.csv", "designs.csv", "distances.csv", "rows.csv", crate::export::FILE];

/// Tables of a calibration; `locator` answers with the chosen estimator.
pub fn tables(found: &Calibrated, data: &Data, locator: &Locator) -> Result<[Frame; 4], Error> {
    let (k, rows) = (k_table(found, data, &locator.rig.setup)?, rows(found, data, locator)?);
    Ok([k, designs(found, locator)?, distances(found, locator)?, rows])
}

fn k_table(found: &Calibrated, data: &Data, setup: &Setup) -> Result<Frame, Error> {
    let signal = data.unit.common();
    let mut table = heading("K_table").frame(&[setup.drive.column(), signal, &format!("{signal}_sd")]);
    for side in &found.sides {
        let t = &side.table;
        for (c, e) in t.cells.iter().zip(&t.estimates) {
            let sd = if c.n() > 1.0 { (c.squares / (c.n() - 1.0)).sqrt() } else { f64::NAN };
            // Without a whisker, f and K are undefined.
            let linear = if found.calibration.rig.known { c.linear } else { f64::NAN };
            let k = linear / c.signal;
            let mut row = vec![c.a.into(), c.drive.into(), Field::Count(c.taps.len() as u64)];
            let deviation = (linear - c.signal) / c.signal;
            let [signal, linear] = [c.signal, linear].map(|x| side.learnt.sign * x);
            let found =
                [e.distance, e.distance - c.a, e.sigma].map(|x| if k.is_finite() { x } else { f64::NAN });
            row.extend([signal, sd, linear, k, deviation].into_iter().chain(found).map(Field::Number));
            let status = if k.is_finite() { e.status } else { Status::OK };
            table.row(row.into_iter().chain([side.name().into(), status.into()]))?;
        }
    }
    Ok(table)
}

fn beside<const N: usize>(fields: impl Iterator<Item = Field>, more: [Field; N]) -> Vec<Field> {
    let mut row: Vec<Field> = fields.collect();
    let status = row.len() - 1;
    row.splice(status..status, more);
    row
}

fn designs(found: &Calibrated, locator: &Locator) -> Result<Frame, Error> {
    let rig = &locator.rig;
    let (columns, mut table) =
        (AtDrive::chosen(&rig.setup), heading("calibrated_designs").frame_for(&rig.setup));
    // Without a whisker, f and K are undefined.
    for side in found.sides.iter().filter(|_| rig.known) {
        let drives = &side.table.drives.centres;
        let held = side.rms_by_drive(Estimator::Paper).unwrap_or(vec![None; drives.len()]);
        for (j, drive) in drives.iter().enumerate() {
            let design = Tuple { drive: *drive, ..rig.design.tuple.towards(Direction::UPRIGHT) };
            let row = AtDrive { design, row: side.table.by_drive[j].figures(), unit: rig.k_unit() };
            table.row(beside(columns.fields(&row), [held[j].into(), side.name().into()]))?;
        }
    }
    Ok(table)
}

fn distances(found: &Calibrated, locator: &Locator) -> Result<Frame, Error> {
    let rig = &locator.rig;
    let columns = AtDistance::chosen(&rig.setup);
    let mut table = heading("calibrated_distances").frame_for(&rig.setup);
    for side in found.sides.iter().filter(|_| rig.known) {
        for (a, row) in side.table.distances.centres.iter().zip(&side.table.by_distance) {
            let design = Tuple { a: *a, ..rig.design.tuple.towards(Direction::UPRIGHT) };
            let at = AtDistance { design, row, unit: rig.k_unit() };
            table.row(beside(columns.fields(&at), [side.name().into()]))?;
        }
    }
    Ok(table)
}

fn rows(found: &Calibrated, data: &Data, locator: &Locator) -> Result<Frame, Error> {
    let kind = locator.rig.setup.drive;
    let recorded = format!("recorded_{}", data.unit.column());
    let mut table = heading("rows").frame(&[kind.column(), &recorded, data.unit.common()]);
    let held: Vec<_> = found.sides.iter().filter_map(|s| s.held_out(found.winner)).collect();
    let held_out = |k: usize| held.iter().map(|h| h.taps[k][0]).find(|e| e.is_finite()).unwrap_or(f64::NAN);
    let mut zeros = found.zeros.iter().peekable();
    let zero_row = |table: &mut Frame, z: &ZeroReading| {
        let r = &data.rows[z.place];
        let mut row = vec![Field::Count(r.line as u64)];
        let zero = found.zero.at(z.place);
        let signal = data.unit.above(z.signal, zero, locator.rig.setup.gauge.factor);
        row.extend([r.a, r.drive, r.value, zero, signal].map(Field::Number));
        row.extend([f64::NAN; 6].map(Field::Number));
        let used = ("used", "zero_reading".to_owned());
        let (word, why) = z.reason.as_ref().map_or(used, |reason| ("suspect", reason.text(kind)));
        table.row(row.into_iter().chain(["".into(), word.into(), why.into()]))
    };
    for (k, tap) in found.taps.iter().enumerate() {
        while let Some(z) = zeros.next_if(|z| z.place < tap.place) {
            zero_row(&mut table, z)?;
        }
        let recorded = tap.recorded(data);
        let expected = locator.expected(tap.a, recorded, tap.signal.signum());
        let at = locator.locate_above(recorded, tap.signal, 0.0, tap.zero_share());
        let known = data.drive.is_some() || found.calibration.drive_recorded;
        let drive = if known { recorded } else { f64::NAN };
        let (Tap { a, value, zero, signal, .. }, Located { distance, sigma, .. }) = (tap, at);
        let numbers = [*a, drive, *value, *zero, *signal, expected, signal - expected];
        let numbers =
            numbers.into_iter().chain([distance, sigma, distance - a, held_out(k)]).map(Field::Number);
        let twin = tap.twin.map(|line| format!("equal to line {line}")).unwrap_or_default();
        let (word, why) = match &tap.reason {
            Some(reason) => (if reason.is_doubt() { "suspect" } else { "second" }, reason.text(kind)),
            None => ("used", twin),
        };
        let unreadable = matches!(tap.reason, Some(Reason::NotANumber));
        let status = if unreadable { "bad_input".to_owned() } else { at.status.to_string() };
        let row = std::iter::once(tap.line.into()).chain(numbers);
        table.row(row.chain([status.into(), word.into(), why.into()]))?;
    }
    zeros.try_for_each(|z| zero_row(&mut table, z))?;
    Ok(table)
}
