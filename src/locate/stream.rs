//! Readings line by line: one answer for each, at once, in constant memory.

use std::collections::BTreeMap;
use std::io::Read;
use std::sync::atomic::{AtomicBool, Ordering};

use super::kept::{Kept, added, field};
use super::lines::Source;
use super::object::{Asked, By, Objects, Together};
use super::pair::{Readings, Spatial};
use super::reading::Lines;
use super::tare::{Tare, doubt};
use super::{Located, Locator};
use crate::error::{Error, InputError};
use crate::measure::Names;
use crate::measure::text::plain;
use crate::measure::zero::Zero;
use crate::status::Status;

/// Answers that are kept back at most while more input is waiting, bytes.
const BATCH: usize = 1 << 16;
/// Readings that are answered together at most.
const TOGETHER: usize = 1 << 12;

/// A drive that was not recorded.
const UNRECORDED: f64 = 1.0;
/// Drives that differ by no more than this share are one where the calibration has but one.
const JITTER: f64 = 0.01;

/// Where answers go: bytes, and whether a reader is waiting for them.
pub type Write<'a> = &'a mut dyn FnMut(&[u8], bool) -> Result<(), Error>;

/// What was answered.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    /// Lines answered.
    pub lines: u64,
    /// Of these, zero readings.
    pub zeros: u64,
    /// Answers per status word, and `ok`.
    pub status: BTreeMap<&'static str, u64>,
    /// Whether it was asked to stop, and some of the input may not be answered.
    pub stopped: bool,
}

/// How readings are answered.
#[derive(Clone, Copy)]
pub struct Ask<'a> {
    /// What the user said of columns.
    pub columns: &'a Names,
    /// The zero that the user gave, in the unit of the signal; of each of two signals.
    pub zero: [Option<f64>; 2],
    /// Name of the file, if it is one: its first line must then be a header or a reading.
    pub label: Option<&'a str>,
    /// Whether answers keep the fields of their line, its number first, and say which zero was subtracted.
    pub keep: bool,
    /// Which readings are of one object.
    pub by: By<'a>,
    /// Tells the user what he should know, at once.
    pub warn: &'a dyn Fn(&str),
}

impl Ask<'_> {
    /// Refuses a zero that was given beside those of the file, of both gauges.
    ///
    /// # Errors
    /// That.
    pub fn contradicted(&self, [zero, _]: &[Zero; 2]) -> Result<(), InputError> {
        let (Some(x), true) = (self.zero[0], zero.count > 0) else { return Ok(()) };
        let error = InputError::new("these readings have zero readings of their own").key("--zero");
        Err(error.value(plain(x)).allowed(format!("nothing: {} rows say it", zero.count)))
    }
}

/// Zero readings of a whole file, of one gauge and of a second, and the lines of those that are none by their size. Empty where the file has none.
///
/// # Errors
/// As [`answer`].
pub fn zeros(locator: &Locator, input: impl Read, ask: &Ask<'_>) -> Result<([Zero; 2], Vec<usize>), Error> {
    let mut source = Source::new(input, ask);
    let mut lines = Lines::new(locator);
    let (mut readings, mut numbers, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
    let mut seconds: Vec<(usize, f64)> = Vec::new();
    while let Some(line) = source.next(&mut lines)? {
        match line.text.and_then(|t| lines.parse(t)) {
            Some((drive, signal)) if locator.rests(drive) && signal.is_finite() => {
                let last = readings.last().map_or(signal, |(_, zero)| *zero);
                readings.push((line.place, locator.beside(last, signal)));
                numbers.push(line.number);
                let second = line.text.map_or(f64::NAN, |t| lines.second(t));
                seconds.extend(second.is_finite().then_some((line.place, second)));
            }
            Some((_, signal)) if signal.is_finite() => sizes.push(signal),
            _ => {}
        }
    }
    let mut all: Vec<f64> = readings.iter().map(|r| r.1).collect();
    if all.is_empty() {
        return Ok((Default::default(), Vec::new()));
    }
    let middle = crate::reduce::median(&mut all);
    let mut sizes: Vec<f64> = sizes.iter().map(|s| (locator.beside(middle, *s) - middle).abs()).collect();
    let scale = if sizes.is_empty() { f64::INFINITY } else { crate::reduce::median(&mut sizes) };
    let off = Zero::outliers(&readings, scale);
    let wrong = readings.iter().zip(&numbers).filter(|(r, _)| off.contains(&r.0)).map(|(_, n)| *n).collect();
    readings.retain(|r| !off.contains(&r.0));
    seconds.retain(|r| !off.contains(&r.0));
    Ok(([Zero::new(&readings), Zero::new(&seconds)], wrong))
}

/// Answers every line of `input`. A header may come first. When `stop` is set, the input ends after its last whole line. `zero` is
/// that of the file, of both gauges, if it has one; of a stream the zero readings among the lines serve those after them.
///
/// # Errors
/// A header that does not fit the calibration; input or output that fails. A line that is no reading is answered by its status.
pub fn answer(
    locator: &Locator,
    input: impl Read,
    ask: &Ask<'_>,
    zero: Option<[Zero; 2]>,
    stop: &AtomicBool,
    write: Write<'_>,
) -> Result<Counts, Error> {
    let mut source = Source::new(input, ask);
    let mut lines = Lines::new(locator);
    let mut out = Vec::with_capacity(2 * BATCH);
    let mut counts = Counts::default();
    let two = locator.is_twofold();
    if !ask.keep {
        let (drive, signal) = (locator.rig.setup.drive.column(), locator.unit.common());
        let second = if two { format!("{},", locator.unit.second_common()) } else { String::new() };
        let mut answer = added(locator)[1..].to_vec();
        if ask.by != By::Unsaid {
            answer.extend(Objects::columns(ask.by, false));
        }
        out.extend(format!("{drive},{signal},{second}{}\n", answer.join(",")).bytes());
        // Whoever starts a stream may want to see that it is ready.
        write(&out, true)?;
        out.clear();
    }
    source.first(&mut lines)?;
    let [mut tare, mut tare_2] = tares(locator, &lines, ask, zero.unwrap_or_default())?;
    let label = |e: InputError| e.at(ask.label.unwrap_or("stdin"), None);
    let mut objects = Objects::new(locator, &lines, ask).map_err(label)?;
    let together = objects.iter().flat_map(|_| Objects::columns(ask.by, true));
    let columns: Vec<&str> = added(locator).into_iter().chain(together).collect();
    let kept = ask.keep.then(|| Kept::new(locator, &lines, &columns));
    if let Some(kept) = &kept {
        kept.header(&mut out);
    }
    let (mut asked, mut follows) = (false, false);
    let mut one = None;
    let mut batch = Batch::default();
    while let Some(line) = source.next(&mut lines)? {
        if stop.load(Ordering::Relaxed) && !line.whole {
            break;
        }
        let read = line.text.and_then(|t| lines.parse(t));
        let (drive, signal) = read.unwrap_or((f64::NAN, f64::NAN));
        let finite = drive.is_finite() && signal.is_finite();
        // Of a line that is no reading, no field is known to be the second signal.
        let second = line.text.filter(|_| two && read.is_some()).map_or(f64::NAN, |t| lines.second(t));
        let is_zero = finite && locator.rests(drive);
        let (mut zero, mut together) = (None, None);
        let found = if is_zero {
            counts.zeros += 1;
            if let Some(zero) = ask.zero[0].filter(|_| counts.zeros == 1) {
                (ask.warn)(&format!(
                    "the zero readings from line {} on take the place of --zero {}",
                    line.number,
                    plain(zero)
                ));
            }
            if let Some(zero) = tare.see(locator, signal, follows) {
                (ask.warn)(&format!(
                    "line {}: a zero reading of {signal:.4e} is far off the others ({zero:.4e}); it is not used unless the next one is like it",
                    line.number
                ));
            }
            if second.is_finite() {
                let _ = tare_2.see(locator, second, follows);
            }
            Answer::Known(Located::nothing(Status::NO_STRAIN))
        } else if !finite {
            Answer::Known(Located::nothing(Status::BAD_INPUT))
        } else if !locator.drive_recorded && !same(&mut one, drive, locator, ask) {
            Answer::Known(Located::nothing(Status::OUTSIDE_CALIBRATION))
        } else {
            let drive = if locator.drive_recorded { drive } else { UNRECORDED };
            zero = tare.at(line.place);
            if !std::mem::replace(&mut asked, true) {
                doubt(locator, zero.map(|z| z.0)).iter().for_each(|text| (ask.warn)(text));
            }
            let (value, share) = zero.unwrap_or((0.0, 0.0));
            let signal = lines.above(signal, value);
            if two {
                let (value, share_2) = tare_2.at(line.place).unwrap_or((0.0, 0.0));
                let signals = [signal, lines.above(second, value)];
                Answer::Asked(Readings { drive, signals, shares: [share, share_2] })
            } else {
                let located = locator.locate_above(drive, signal, 0.0, share);
                if let Some(objects) = &mut objects {
                    let tap = Asked { line: line.number, drive, signal, share, zero: counts.zeros };
                    let name = objects.name(&lines, line.text);
                    together = objects.tell(&name, tap, &located, ask);
                }
                Answer::Known(located)
            }
        };
        let more = objects.as_ref().map(|objects| {
            let mut more = Vec::new();
            if !ask.keep && matches!(ask.by, By::Column(_)) {
                field(&mut more, &objects.name(&lines, line.text));
            }
            Together::write(together.as_ref(), &mut more);
            more
        });
        follows = is_zero;
        counts.lines += 1;
        match &kept {
            Some(kept) => {
                let zero = zero.map_or(f64::NAN, |z| z.0);
                kept.row(&mut batch.asked, &line, &lines, [drive, signal, zero]);
            }
            None => {
                let shown = if locator.drive_recorded || drive != UNRECORDED { drive } else { f64::NAN };
                number(&mut batch.asked, shown);
                number(&mut batch.asked, signal);
                if two {
                    number(&mut batch.asked, second);
                }
            }
        }
        batch.answers.push((batch.asked.len(), found, more));
        // Whoever sent half a line waits for the answers to those before it.
        let waiting = line.waiting;
        if waiting || batch.asked.len() >= BATCH || batch.answers.len() >= TOGETHER {
            batch.answer(locator, &mut out, &mut counts)?;
            write(&out, waiting)?;
            out.clear();
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    counts.stopped = stop.load(Ordering::Relaxed);
    batch.answer(locator, &mut out, &mut counts)?;
    write(&out, true)?;
    Ok(counts)
}

/// The zeros of the first signal and of the second: those of the file, if it has any, else what the user said or the calibration fitted.
///
/// # Errors
/// A zero that no such signal has.
pub(super) fn tares(
    locator: &Locator,
    lines: &Lines<'_>,
    ask: &Ask<'_>,
    [zero, zero_2]: [Zero; 2],
) -> Result<[Tare; 2], InputError> {
    let said = ask.zero.map(|zero| zero.map(|z| lines.signal(z)));
    if let Some(k) = (0..2).find(|&k| said[k].is_some_and(|z| !z.is_finite())) {
        let error = InputError::new("this is no zero of such a signal").key("--zero");
        let error = error.value(plain(ask.zero[k].unwrap_or(f64::NAN)));
        return Err(error.allowed("a number in the unit of the signal"));
    }
    let first = if zero.count > 0 { Tare::File(zero) } else { Tare::new(locator, said[0]) };
    let second = if zero_2.count > 0 { Tare::File(zero_2) } else { Tare::said(said[1]) };
    Ok([first, second])
}

/// What a line is answered by.
enum Answer {
    Known(Located),
    Asked(Readings),
}

/// Lines that are answered together.
#[derive(Default)]
struct Batch {
    /// What stands before the answers, line after line.
    asked: Vec<u8>,
    /// Of each line where that ends, its answer, and what follows it.
    answers: Vec<(usize, Answer, Option<Vec<u8>>)>,
}

impl Batch {
    /// Writes the lines with their answers into `out`, and forgets them.
    fn answer(&mut self, locator: &Locator, out: &mut Vec<u8>, counts: &mut Counts) -> Result<(), Error> {
        let readings = self.answers.iter().filter_map(|(_, answer, _)| match answer {
            Answer::Asked(readings) => Some(*readings),
            Answer::Known(_) => None,
        });
        let readings: Vec<Readings> = readings.collect();
        let mut located = locator.locate_pairs(&readings)?.into_iter();
        let mut from = 0;
        for (to, answer, more) in self.answers.drain(..) {
            let found = match answer {
                Answer::Known(located) => Some(Spatial { located, ..Spatial::nothing(located.status) }),
                Answer::Asked(_) => located.next(),
            };
            let found = found.unwrap_or(Spatial::nothing(Status::BAD_INPUT));
            note(counts, found.located.status);
            out.extend_from_slice(&self.asked[from..to]);
            let numbers = found.numbers();
            row(out, if locator.is_twofold() { &numbers } else { &numbers[..2] }, found.located.status);
            if let Some(more) = more {
                out.push(b',');
                out.extend(more);
            }
            out.push(b'\n');
            from = to;
        }
        self.asked.clear();
        Ok(())
    }
}

/// Whether a reading is of the one drive of a calibration whose drive was not recorded: that of the first reading is taken as it.
fn same(one: &mut Option<f64>, drive: f64, locator: &Locator, ask: &Ask<'_>) -> bool {
    if one.is_none() && drive != UNRECORDED {
        (ask.warn)(&format!(
            "the drive was not recorded when the whisker was calibrated: {} = {} of the first reading is taken as the same; readings of \
             another one are outside_calibration",
            locator.rig.setup.drive.column(),
            plain(drive)
        ));
    }
    let one = *one.get_or_insert(drive);
    drive > 0.0 && (drive - one).abs() <= JITTER * one
}

fn note(counts: &mut Counts, status: Status) {
    if status == Status::OK {
        *counts.status.entry("ok").or_default() += 1;
    }
    for word in status.words() {
        *counts.status.entry(word).or_default() += 1;
    }
}

/// One answer; what is missing stays empty.
fn row(out: &mut Vec<u8>, numbers: &[f64], status: Status) {
    numbers.iter().for_each(|x| number(out, *x));
    if status == Status::OK {
        out.extend(b"ok");
    } else {
        out.extend(status.to_string().bytes());
    }
}

/// A field, empty where there is no number, and the comma after it.
pub(super) fn number(out: &mut Vec<u8>, x: f64) {
    if x.is_finite() {
        let mut buffer = ryu::Buffer::new();
        let text = buffer.format_finite(x);
        out.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
    }
    out.push(b',');
}
