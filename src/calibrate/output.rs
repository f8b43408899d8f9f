//! The files of a calibration: calibration.toml, K_table.csv, designs.csv, distances.csv, rows.csv, run.json, and what is exported.

use super::side::KTable;
use super::{Calibrated, Reason};
use crate::error::Error;
use crate::estimator::PAPER;
use crate::locate::Locator;
use crate::measure::Data;
use crate::scene::{Direction, Setup, Side};
use crate::sink::csv::Text;
use crate::sink::table::{AtDistance, AtDrive, Field, Table, fields};
use crate::status::Status;

/// Names of the files that there may be beside run.json.
pub const FILES: [&str; 6] =
    ["calibration.toml", "K_table.csv", "designs.csv", "distances.csv", "rows.csv", crate::export::FILE];

/// The tables by the names of their files; `locator` answers with the estimator that won.
///
/// # Errors
/// None of a whole calibration.
pub fn tables(
    found: &Calibrated,
    data: &Data,
    locator: &Locator,
) -> Result<[(&'static str, Vec<u8>); 4], Error> {
    Ok([
        ("K_table.csv", k_table(found, data, &locator.rig.setup)?),
        ("designs.csv", designs(found, locator)?),
        ("distances.csv", distances(found, locator)?),
        ("rows.csv", rows(found, data, locator)?),
    ])
}

/// Name of a side.
pub fn side_name(side: Side) -> &'static str {
    if side == Side::Far { "far" } else { "contact" }
}

fn k_table(found: &Calibrated, data: &Data, setup: &Setup) -> Result<Vec<u8>, Error> {
    let mut text = Text::default();
    let signal = data.unit.common();
    let (sd, linear) = (format!("{signal}_sd"), "strain_linear");
    let drive = setup.drive.column();
    text.header(&[
        "a_mm",
        drive,
        "n",
        signal,
        &sd,
        linear,
        "K",
        "K_deviation",
        "distance_mm",
        "error_mm",
        "sigma_mm",
        "side",
        "status",
    ])?;
    let mut row = Vec::new();
    for side in &found.sides {
        let t = &side.table;
        for (c, e) in t.cells.iter().zip(&t.estimates) {
            let sd = if c.n() > 1.0 { (c.squares / (c.n() - 1.0)).sqrt() } else { f64::NAN };
            // Without a whisker there is no f, and no K.
            let linear = if found.calibration.rig.known { c.linear } else { f64::NAN };
            let k = linear / c.signal;
            row.extend([c.a, c.drive].map(Field::Number));
            row.push(Field::Count(c.taps.len() as u64));
            let deviation = (linear - c.signal) / c.signal;
            let of_k = |x: f64| if k.is_finite() { x } else { f64::NAN };
            let numbers = [
                side.sign * c.signal,
                sd,
                side.sign * linear,
                k,
                deviation,
                of_k(e.distance),
                of_k(e.distance - c.a),
                of_k(e.sigma),
            ];
            row.extend(numbers.map(Field::Number));
            row.extend([
                Field::Word(side_name(side.gauge)),
                Field::Status(if k.is_finite() { e.status } else { Status::OK }),
            ]);
            text.row(&mut row)?;
        }
    }
    Ok(text.into_bytes())
}

fn designs(found: &Calibrated, locator: &Locator) -> Result<Vec<u8>, Error> {
    let rig = &locator.rig;
    let mut text = Text::default();
    let mut columns = Table::Designs.columns(&rig.setup);
    columns.pop();
    columns.extend(["held_out_rms_mm", "side", "status"]);
    text.header(&columns)?;
    let mut row = Vec::new();
    // Without a whisker there is no f, and no K.
    for side in found.sides.iter().filter(|_| rig.known) {
        let held = side.held_out(PAPER);
        let held =
            held.map_or(vec![None; side.drives.len()], |h| h.rms_by_drive(&side.cells, side.drives.len()));
        for (j, drive) in side.drives.centres.iter().enumerate() {
            let (design, unit) = (&rig.design.tuple, rig.k_unit());
            fields(
                &AtDrive::COLUMNS,
                &rig.setup,
                &AtDrive {
                    design,
                    direction: Direction::UPRIGHT,
                    drive: *drive,
                    row: side.table.by_drive[j].figures(),
                    unit,
                },
                &mut row,
            );
            let status = row.pop();
            row.push(held[j].into());
            row.push(Field::Word(side_name(side.gauge)));
            row.extend(status);
            text.row(&mut row)?;
        }
    }
    Ok(text.into_bytes())
}

fn distances(found: &Calibrated, locator: &Locator) -> Result<Vec<u8>, Error> {
    let rig = &locator.rig;
    let mut text = Text::default();
    let mut columns = Table::Distances.columns(&rig.setup);
    columns.pop();
    columns.extend(["side", "status"]);
    text.header(&columns)?;
    let mut row = Vec::new();
    for side in found.sides.iter().filter(|_| rig.known) {
        let KTable { by_distance, .. } = &side.table;
        for (i, a) in side.distances.centres.iter().enumerate() {
            let (design, unit) = (&rig.design.tuple, rig.k_unit());
            let at = AtDistance { design, a: *a, direction: Direction::UPRIGHT, row: &by_distance[i], unit };
            fields(&AtDistance::COLUMNS, &rig.setup, &at, &mut row);
            let status = row.pop();
            row.push(Field::Word(side_name(side.gauge)));
            row.extend(status);
            text.row(&mut row)?;
        }
    }
    Ok(text.into_bytes())
}

fn rows(found: &Calibrated, data: &Data, locator: &Locator) -> Result<Vec<u8>, Error> {
    let kind = locator.rig.setup.drive;
    let signal = data.unit.common();
    let recorded = format!("recorded_{}", data.unit.column());
    let mut text = Text::default();
    text.header(&[
        "line",
        "a_mm",
        kind.column(),
        &recorded,
        "zero",
        signal,
        "expected",
        "residual",
        "distance_mm",
        "sigma_mm",
        "error_mm",
        "held_out_error_mm",
        "status",
        "use",
        "reason",
    ])?;
    let held: Vec<_> = found.sides.iter().filter_map(|s| s.held_out(found.winner)).collect();
    let held_out = |k: usize| held.iter().map(|h| h.taps[k]).find(|e| e.is_finite()).unwrap_or(f64::NAN);
    let mut zeros = found.zeros.iter().peekable();
    let mut row = Vec::new();
    let zero_row = |text: &mut Text, z: &crate::estimator::taps::ZeroReading| {
        let r = &data.rows[z.place];
        let mut row = vec![Field::Count(r.line as u64)];
        let zero = found.zero.at(z.place);
        let signal = data.unit.above(z.signal, zero, locator.rig.setup.gauge.factor);
        row.extend([r.a, r.drive, r.value, zero, signal].map(Field::Number));
        row.extend([f64::NAN; 6].map(Field::Number));
        let (word, why) = match &z.reason {
            Some(reason) => ("suspect", reason.text(kind)),
            None => ("used", "zero_reading".to_owned()),
        };
        text.row_with(&mut row, &["", word, &why])
    };
    for (k, tap) in found.taps.iter().enumerate() {
        while let Some(z) = zeros.next_if(|z| z.place < tap.place) {
            zero_row(&mut text, z)?;
        }
        let recorded = tap.recorded(data);
        let expected = locator.expected(tap.a, recorded, tap.signal.signum());
        let at = locator.locate_above(recorded, tap.signal, 0.0, tap.zero_share());
        row.push(Field::Count(tap.line as u64));
        let drive =
            if data.drive.is_some() || found.calibration.drive_recorded { recorded } else { f64::NAN };
        let numbers = [
            tap.a,
            drive,
            tap.value,
            tap.zero,
            tap.signal,
            expected,
            tap.signal - expected,
            at.distance,
            at.sigma,
            at.distance - tap.a,
            held_out(k),
        ];
        row.extend(numbers.map(Field::Number));
        let twin = tap.twin.map(|line| format!("equal to line {line}")).unwrap_or_default();
        let (word, why) = match &tap.reason {
            Some(reason) => (if reason.is_doubt() { "suspect" } else { "second" }, reason.text(kind)),
            None => ("used", twin),
        };
        let unreadable = matches!(tap.reason, Some(Reason::NotANumber));
        let status = if unreadable { "bad_input".to_owned() } else { at.status.to_string() };
        text.row_with(&mut row, &[&status, word, &why])?;
    }
    for z in zeros {
        zero_row(&mut text, z)?;
    }
    Ok(text.into_bytes())
}
