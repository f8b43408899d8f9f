//! Readings line by line: one answer for each, at once, in constant memory.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::sync::atomic::{AtomicBool, Ordering};

use super::{Located, Locator};
use crate::error::{Error, InputError};
use crate::measure::{Unit, file};
use crate::scene::Drive;
use crate::status::Status;

/// Longest line that can be a reading, bytes.
const LONGEST: usize = 4096;
/// Answers that are kept back at most while more input is waiting, bytes.
const BATCH: usize = 1 << 16;

/// Where answers go: bytes, and whether a reader is waiting for them.
pub type Write<'a> = &'a mut dyn FnMut(&[u8], bool) -> Result<(), Error>;

/// What was answered.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    /// Lines answered.
    pub lines: u64,
    /// Answers per status word, and `ok`.
    pub status: BTreeMap<&'static str, u64>,
    /// Whether it was asked to stop, and some of the input may not be answered.
    pub stopped: bool,
}

/// Which field is what.
#[derive(Debug, Clone, PartialEq)]
struct Columns {
    drive: Option<usize>,
    signal: (Unit, usize),
    fields: usize,
}

/// Answers every line of `input`. A header may come first; `label` is given where the input is a file, whose first line must then
/// be a header or a reading. When `stop` is set, the input ends after its last whole line.
///
/// # Errors
/// A header that does not fit the calibration; input or output that fails. A line that is no reading is answered by its status.
pub fn answer(
    locator: &Locator,
    input: impl Read,
    label: Option<&str>,
    stop: &AtomicBool,
    write: Write<'_>,
) -> Result<Counts, Error> {
    let mut reader = BufReader::with_capacity(1 << 16, input);
    let mut line = Vec::with_capacity(256);
    let mut out = Vec::with_capacity(2 * BATCH);
    let mut counts = Counts::default();
    let mut columns = None;
    let mut first = true;
    header(locator, &mut out);
    // Whoever starts a stream may want to see that it is ready.
    write(&out, true)?;
    out.clear();
    let failed = |e| Error::io(label.unwrap_or("stdin"), e);
    while let Some(length) = read_line(&mut reader, &mut line).map_err(failed)? {
        if stop.load(Ordering::Relaxed) && !line.ends_with(b"\n") {
            break;
        }
        let text = (length <= LONGEST).then(|| std::str::from_utf8(&line).ok()).flatten();
        let text = text.map(|t| t.trim_end_matches(['\n', '\r']));
        if std::mem::take(&mut first)
            && let Some(text) = text.map(|t| t.trim_start_matches('\u{feff}'))
            && is_header(text, label.is_some())
        {
            columns = Some(find(locator, text).map_err(|e| e.at(label.unwrap_or("stdin"), Some(1)))?);
            continue;
        }
        let (drive, signal, located) =
            match text.and_then(|t| parse(locator, columns.as_ref(), t.trim_start_matches('\u{feff}'))) {
                Some((drive, signal)) if drive.is_finite() && signal.is_finite() => {
                    let asked = if locator.drive_recorded { drive } else { 1.0 };
                    let located = match !locator.drive_recorded && drive != 1.0 {
                        true => Located::nothing(Status::OUTSIDE_CALIBRATION),
                        false => locator.locate(asked, signal),
                    };
                    (drive, signal, located)
                }
                Some((drive, signal)) => (drive, signal, Located::nothing(Status::BAD_INPUT)),
                None => (f64::NAN, f64::NAN, Located::nothing(Status::BAD_INPUT)),
            };
        counts.lines += 1;
        note(&mut counts, located.status);
        let shown = if locator.drive_recorded { drive } else { f64::NAN };
        row(&mut out, [shown, signal, located.distance, located.sigma], located.status);
        // Whoever sent half a line waits for the answers to those before it.
        let waiting = !reader.buffer().contains(&b'\n');
        if waiting || out.len() >= BATCH {
            write(&out, waiting)?;
            out.clear();
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    counts.stopped = stop.load(Ordering::Relaxed);
    write(&out, true)?;
    Ok(counts)
}

fn note(counts: &mut Counts, status: Status) {
    if status == Status::OK {
        *counts.status.entry("ok").or_default() += 1;
    }
    for word in status.words() {
        *counts.status.entry(word).or_default() += 1;
    }
}

/// Reads a line into `line`, of which at most [`LONGEST`] bytes are kept; its length, `None` at the end.
fn read_line(reader: &mut BufReader<impl Read>, line: &mut Vec<u8>) -> std::io::Result<Option<usize>> {
    line.clear();
    let mut length = 0;
    loop {
        let buffer = match reader.fill_buf() {
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            other => other?,
        };
        if buffer.is_empty() {
            return Ok((length > 0).then_some(length));
        }
        let (part, ended) = match buffer.iter().position(|b| *b == b'\n') {
            Some(end) => (&buffer[..=end], true),
            None => (buffer, false),
        };
        let room = LONGEST.saturating_sub(line.len()).min(part.len());
        line.extend_from_slice(&part[..room]);
        let n = part.len();
        length += n;
        reader.consume(n);
        if ended {
            return Ok(Some(length));
        }
    }
}

fn header(locator: &Locator, out: &mut Vec<u8>) {
    let (drive, signal) = (locator.rig.setup.drive.column(), locator.unit.common());
    out.extend(format!("{drive},{signal},distance_mm,sigma_mm,status\n").bytes());
}

/// Whether a first line names columns: at least one that is known, or in a file anything that is no number.
fn is_header(text: &str, file: bool) -> bool {
    let known = |f: &str| {
        Unit::of_column(f).is_some() || [Drive::Angle, Drive::Displacement].iter().any(|d| d.column() == f)
    };
    file::fields(text).iter().any(|f| known(f) || (file && file::number(f).is_none()))
}

fn find(locator: &Locator, text: &str) -> Result<Columns, InputError> {
    let names = file::fields(text);
    let kind = locator.rig.setup.drive;
    let other = if kind == Drive::Angle { Drive::Displacement } else { Drive::Angle };
    let places = |name: &str| (0..names.len()).filter(|&i| names[i] == name).collect::<Vec<_>>();
    let once = |name: &str| match places(name).as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(*one)),
        _ => Err(InputError::new("this column appears twice").key(name).allowed("each column once")),
    };
    if let (Some(_), None) = (once(other.column())?, once(kind.column())?) {
        let error = InputError::new("these readings are driven another way than the calibration");
        return Err(error.key(other.column()).allowed(kind.column()));
    }
    let drive = once(kind.column())?;
    if drive.is_none() && locator.only_drive().is_none() {
        let error = InputError::new(format!("column {} is missing", kind.column()));
        let value = names.join(",");
        return Err(error.key(kind.column()).value(value).allowed("a column with the drive of each tap"));
    }
    let allowed = match locator.unit.is_strain() {
        true => "exactly one of strain, microstrain, bridge_mV_per_V",
        false => "reading, in the unit of the calibration",
    };
    let mut signals = Vec::new();
    for unit in Unit::ALL {
        signals.extend(once(unit.column())?.map(|place| (unit, place)));
    }
    match signals.as_slice() {
        [] => {
            let error = InputError::new(format!("column {} is missing", locator.unit.common()));
            Err(error.key(locator.unit.common()).value(names.join(",")).allowed(allowed))
        }
        [(unit, place)] if unit.is_strain() == locator.unit.is_strain() => {
            Ok(Columns { drive, signal: (*unit, *place), fields: names.len() })
        }
        [(unit, _)] => {
            let error = InputError::new("the calibration was made with another kind of signal");
            Err(error.key(unit.column()).allowed(allowed))
        }
        several => {
            let names: Vec<&str> = several.iter().map(|(u, _)| u.column()).collect();
            let error =
                InputError::new("there are several signal columns, and they may contradict each other");
            Err(error.key(names[0]).value(names.join(", ")).allowed(allowed))
        }
    }
}

/// Drive and signal of a line, NaN where a field is missing or no number; `None` for a line of another shape.
fn parse(locator: &Locator, columns: Option<&Columns>, text: &str) -> Option<(f64, f64)> {
    let only = locator.only_drive();
    // A header that is there says which field is what; else the drive comes first, and may be left out where it is known.
    let number = |f: &str| file::number(f.trim()).unwrap_or(f64::NAN);
    if text.contains('"') {
        // Fields that hold a comma hold no number.
        let plain: Vec<String> = file::fields(text).iter().map(|f| f.replace([',', '"'], " ")).collect();
        return parse(locator, columns, &plain.join(","));
    }
    let count = 1 + text.bytes().filter(|b| *b == b',').count();
    let mut fields = text.split(',');
    match columns {
        None => match (count, only) {
            (2, _) => {
                let drive = fields.next().unwrap_or_default().trim();
                let drive = match (drive.is_empty(), only) {
                    (true, Some(only)) => only,
                    _ => number(drive),
                };
                Some((drive, number(fields.next()?)))
            }
            (1, Some(only)) if !text.trim().is_empty() => Some((only, number(fields.next()?))),
            _ => None,
        },
        Some(c) if c.fields == count => {
            let at = |place: usize| text.split(',').nth(place).map_or(f64::NAN, number);
            let drive = match c.drive {
                Some(place) => match text.split(',').nth(place).map(str::trim) {
                    Some("") => only.unwrap_or(f64::NAN),
                    _ => at(place),
                },
                None => only?,
            };
            Some((drive, signal(locator, c.signal.0, at(c.signal.1))))
        }
        Some(_) => None,
    }
}

fn signal(locator: &Locator, unit: Unit, value: f64) -> f64 {
    unit.strain(value, locator.rig.setup.gauge.factor)
}

/// One answer; what is missing stays empty.
fn row(out: &mut Vec<u8>, numbers: [f64; 4], status: Status) {
    let mut buffer = ryu::Buffer::new();
    for x in numbers {
        if x.is_finite() {
            let text = buffer.format_finite(x);
            out.extend(text.strip_suffix(".0").unwrap_or(text).bytes());
        }
        out.push(b',');
    }
    if status == Status::OK {
        out.extend(b"ok");
    } else {
        out.extend(status.to_string().bytes());
    }
    out.push(b'\n');
}
