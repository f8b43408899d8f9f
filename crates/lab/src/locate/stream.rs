//! Readings line by line: one answer for each, at once, in constant memory.

use std::io::Read;
use std::sync::atomic::{AtomicBool, Ordering};

use super::batch::{Answer, Batch};
use super::group::Group;
use super::kept::{Kept, added};
use super::lines::Source;
use super::object::{By, Objects, UnlocatedTap};
use super::pair::Spatial;
use super::reading::Lines;
use super::rows::{Answerer, Reading, RowReader};
use super::tare::{Tare, doubt};
use super::{Located, Locator};
use crate::combinations::Combinations;
use crate::error::{Error, InputError};
use crate::fields::{plain, separator};
use crate::measure::Names;
use crate::measure::missing::is_usual;
use crate::measure::thousands::Thousands;
use crate::measure::zero::Zero;
use crate::sink::values::Field;
use crate::status::Status;

/// Answers that are kept back at most while more input is waiting, bytes.
const BATCH: usize = 1 << 16;
/// Readings that are answered together at most.
const TOGETHER: usize = 1 << 12;

/// A drive that was not recorded.
const UNRECORDED: f64 = 1.0;
/// Drives that differ by no more than this share are one where the calibration has but one.
const JITTER: f64 = 0.01;
/// A zero reading with a value that stands for none, such as -1, is left out where it differs from the other zero readings by this share of a usual tap.
const NO_ZERO: f64 = 0.1;

/// Where answers go: bytes, and whether a reader is waiting for them.
pub type Write<'a> = &'a mut dyn FnMut(&[u8], bool) -> Result<(), Error>;

/// What was answered.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    /// Lines answered.
    pub lines: u64,
    /// Of these, zero readings.
    pub zeros: u64,
    /// Of these, lines without any text.
    pub blank: u64,
    /// Answers per combination of words.
    pub combinations: Combinations,
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
    /// Whether the interval that holds a distance with 95 % is told.
    pub interval: bool,
    /// Tells the user what he should know, at once.
    pub warn: &'a dyn Fn(&str),
}

impl Ask<'_> {
    /// Refuses a zero that was given beside those of the file, of each signal.
    pub fn contradicted(&self, zeros: &[Zero]) -> Result<(), InputError> {
        let zero = &zeros[0];
        let (Some(x), true) = (self.zero[0], zero.count > 0) else { return Ok(()) };
        let error = InputError::new("these readings have zero readings of their own").key("--zero");
        Err(error.value(plain(x)).allowed(format!("nothing: {} rows say it", zero.count)))
    }
}

/// Zero readings of a whole file, those of each signal, and the lines of those that are none by their size. Empty where the file has none.
///
/// # Errors
/// As [`answer`]; numbers of which nothing says whether they are more than a thousand.
pub fn zeros<'a>(
    who: impl Into<Answerer<'a>>,
    input: impl Read,
    ask: &Ask<'_>,
) -> Result<(Vec<Zero>, Vec<usize>), Error> {
    let who = who.into();
    let mut source = Source::new(input, ask);
    let mut rows = RowReader::new(who);
    let (mut readings, mut numbers, mut sizes) = (vec![Vec::new(); who.signals()], Vec::new(), Vec::new());
    let mut thousands = Thousands::default();
    while let Some(line) = source.next(&mut rows)? {
        let text = line.text.unwrap_or_default();
        thousands.see(line.number, &rows.fields(text), separator(text));
        let Some((drive, signals)) = line.text.and_then(|t| rows.parse(t)) else { continue };
        if !rows.rests(drive, &signals) {
            sizes.extend(Some(signals[0]).filter(|x| x.is_finite()));
            continue;
        }
        numbers.push((line.place, line.number));
        for (k, signal) in signals.into_iter().enumerate().filter(|(_, x)| x.is_finite()) {
            let last = readings[k].last().map_or(signal, |(_, zero)| *zero);
            readings[k].push((line.place, who.locator(k).beside(last, signal)));
        }
    }
    let here = |e: InputError| InputError { file: Some(ask.label.unwrap_or("stdin").to_owned()), ..e };
    thousands.check(&rows.names(), ask.columns).map_err(here)?;
    let mut all: Vec<f64> = readings[0].iter().map(|r| r.1).collect();
    if all.is_empty() {
        return Ok((vec![Zero::default(); who.signals()], Vec::new()));
    }
    // What stands for no value, or is exactly 0, is no zero where others are there.
    let is_none = |x: f64| x == 0.0 || is_usual(x);
    let mut judged: Vec<f64> = all.iter().copied().filter(|x| !is_none(*x)).collect();
    let middle = crate::reduce::median(if judged.is_empty() { &mut all } else { &mut judged });
    let locator = who.first();
    let mut sizes: Vec<f64> = sizes.iter().map(|s| (locator.beside(middle, *s) - middle).abs()).collect();
    let scale = if sizes.is_empty() { f64::INFINITY } else { crate::reduce::median(&mut sizes) };
    let mut off = Zero::outliers(&readings[0], scale);
    let missing =
        |r: &&(usize, f64)| !judged.is_empty() && is_none(r.1) && (r.1 - middle).abs() > NO_ZERO * scale;
    off.extend(readings[0].iter().filter(missing).map(|r| r.0));
    let wrong = numbers.iter().filter(|(place, _)| off.contains(place)).map(|(_, n)| *n).collect();
    readings.iter_mut().for_each(|all| all.retain(|r| !off.contains(&r.0)));
    Ok((readings.iter().map(|all| Zero::new(all)).collect(), wrong))
}

/// Answers every line of `input`. A header may come first. When `stop` is set, the input ends after its last whole line. `zero` is
/// that of the file, of each signal, if it has one; of a stream the zero readings among the lines serve those after them.
///
/// # Errors
/// A header that does not fit the calibration; input or output that fails. A line that is no reading is answered by its status.
pub fn answer<'a>(
    who: impl Into<Answerer<'a>>,
    input: impl Read,
    ask: &Ask<'_>,
    zero: Option<Vec<Zero>>,
    stop: &AtomicBool,
    write: Write<'_>,
) -> Result<Counts, Error> {
    let who = who.into();
    let locator = who.first();
    let mut source = Source::new(input, ask);
    let label = |e: InputError| e.at(ask.label.unwrap_or("stdin"), None);
    Objects::can(who, ask.by).map_err(label)?;
    let mut rows = RowReader::new(who);
    let mut out = Vec::with_capacity(2 * BATCH);
    let mut counts = Counts::default();
    if !ask.keep {
        let mut names = vec![locator.rig.setup.drive.column()];
        names.extend((0..who.signals()).map(|k| who.column(k)));
        names.extend(&added(who, ask.interval)[1..]);
        if ask.by != By::Unsaid {
            names.extend(Group::columns((ask.by, ask.interval), who, None));
        }
        out.extend(format!("{}\n", names.join(",")).bytes());
        // Whoever starts a stream may want to see that it is ready.
        write(&out, true)?;
        out.clear();
    }
    source.first(&mut rows)?;
    let of_file = zero.is_some();
    let mut tares = tares(who, rows.lines(), ask, zero.unwrap_or_default())?;
    if let Some(lag) = locator.lag.filter(|_| !rows.lines().is_timed()) {
        (ask.warn)(&format!(
            "the readings of the calibration lag ({:.2} % of a change with a time constant of {:.2} s), and these have no column t_s: they are \
             taken as settled",
            100.0 * lag.gain,
            lag.tau_s
        ));
    }
    let mut group = Group::new(&rows, ask)?;
    let together = group.iter().flat_map(|_| Group::columns((ask.by, ask.interval), who, Some(&rows)));
    let columns: Vec<&str> = added(who, ask.interval).into_iter().chain(together).collect();
    let kept = ask.keep.then(|| Kept::new(&rows, &columns));
    if let Some(kept) = &kept {
        kept.header(&mut out);
    }
    let (mut asked, mut follows, mut untimed) = (false, false, false);
    // A file was looked through before.
    let (mut thousands, mut unclear) = ((!of_file).then(Thousands::default), false);
    let mut one = None;
    let mut batch = Batch::default();
    while let Some(line) = source.next(&mut rows)? {
        if stop.load(Ordering::Relaxed) && !line.whole {
            break;
        }
        // Of a line that is no reading, no field is known to be a signal.
        let mut read = line.text.and_then(|t| rows.parse(t));
        if let Some((seen, text)) = thousands.as_mut().zip(line.text) {
            let grouped = seen.see(line.number, &rows.fields(text), separator(text));
            if grouped && let Err(why) = seen.check(&rows.names(), ask.columns) {
                read = None;
                if !std::mem::replace(&mut unclear, true) {
                    (ask.warn)(&format!("line {}: {why}: such lines are bad_input", line.number));
                }
            }
        }
        let (drive, signals) = read.unwrap_or_else(|| (f64::NAN, vec![f64::NAN; who.signals()]));
        if rows.lines().is_untimed() && !std::mem::replace(&mut untimed, true) {
            (ask.warn)(&format!(
                "line {}: this time is missing, or before that of a line above: such readings are taken as settled, and their σ does not know \
                 of the lag",
                line.number
            ));
        }
        let is_zero = rows.rests(drive, &signals);
        let (mut zero, mut together) = (None, None);
        let found = if is_zero {
            counts.zeros += 1;
            group.iter_mut().for_each(Group::rest);
            if let Some(zero) = ask.zero[0].filter(|_| counts.zeros == 1) {
                (ask.warn)(&format!(
                    "the zero readings from line {} on take the place of --zero {}",
                    line.number,
                    plain(zero)
                ));
            }
            for (k, signal) in signals.iter().enumerate().filter(|(_, x)| x.is_finite()) {
                let aside = tares[k].see(who.locator(k), *signal, follows);
                if let Some(zero) = aside.filter(|_| k == 0 || who.finds_drives()) {
                    (ask.warn)(&format!(
                        "line {}: a zero reading of {signal:.4e} is far off the others ({zero:.4e}); it is not used unless the next one is like it",
                        line.number
                    ));
                }
            }
            Answer::Known(Located::nothing(Status::NO_STRAIN))
        } else if let Some(why) = rows.lacks(drive, &signals) {
            Answer::Known(Located::nothing(why))
        } else if !locator.drive_recorded && !who.finds_drives() && !same(&mut one, drive, locator, ask) {
            Answer::Known(Located::nothing(Status::OUTSIDE_CALIBRATION))
        } else {
            let drive = if locator.drive_recorded { drive } else { UNRECORDED };
            let zeros: Vec<Option<(f64, f64)>> = tares.iter().map(|tare| tare.at(line.place)).collect();
            if !std::mem::replace(&mut asked, true) {
                let known = if who.is_twofold() { 1 } else { zeros.len() };
                let free = matches!(ask.by, By::Strokes(free) if free.zero);
                let doubts =
                    (0..known).filter(|_| !free).filter_map(|k| doubt(who.locator(k), zeros[k].map(|z| z.0)));
                for text in doubts {
                    match who.finds_drives() {
                        true => (ask.warn)(&text.replace(", or --zero", "")),
                        false => (ask.warn)(&text),
                    }
                }
            }
            zero = zeros[0];
            let values = zeros.iter().map(|z| z.unwrap_or((0.0, 0.0)));
            let (values, shares): (Vec<f64>, Vec<f64>) = values.unzip();
            let above = (0..values.len()).map(|k| rows.above(k, signals[k], values[k])).collect();
            let tap = Reading { drive, signals: above, shares };
            if who.is_alone() {
                let located = locator.locate_above(drive, tap.signals[0], 0.0, tap.shares[0]);
                if let Some(group) = &mut group {
                    let (signal, share) = (tap.signals[0], tap.shares[0]);
                    let zeros = counts.zeros;
                    let tap =
                        UnlocatedTap { line: line.number, drive, signal, share, zero: zeros, shift: 0.0 };
                    together = Some(group.tell((&rows, line.text), tap, &located, ask));
                }
                Answer::Known(located)
            } else if let Some(group) = group.as_mut().filter(|_| who.is_twofold()) {
                let alone = locator.pairs(&[tap.pair()])?.pop();
                let alone = alone.unwrap_or((Spatial::nothing(Status::BAD_INPUT), None));
                together =
                    Some(group.tell_pair((&rows, line.text), (line.number, counts.zeros), &alone, ask));
                Answer::Contact(Box::new(alone.0))
            } else {
                Answer::UnlocatedTap(tap)
            }
        };
        let nothing = |group: &Group<'_>| group.nothing((&rows, line.text), ask);
        let more = group.as_ref().map(|group| together.unwrap_or_else(|| nothing(group)));
        follows = is_zero;
        counts.lines += 1;
        counts.blank += u64::from(line.text.is_some_and(|text| text.trim().is_empty()));
        match &kept {
            Some(kept) => {
                let zero = zero.map_or(f64::NAN, |z| z.0);
                kept.row(&mut batch.asked, &line, &rows, [drive, signals[0], zero]);
            }
            None => {
                let shown = if locator.drive_recorded || drive != UNRECORDED { drive } else { f64::NAN };
                number(&mut batch.asked, shown);
                signals.iter().for_each(|signal| number(&mut batch.asked, *signal));
            }
        }
        batch.answers.push((batch.asked.len(), found, more));
        // Whoever sent half a line waits for the answers to those before it.
        let waiting = line.waiting;
        if waiting || batch.asked.len() >= BATCH || batch.answers.len() >= TOGETHER {
            batch.answer(who, ask.interval, &mut out, &mut counts)?;
            write(&out, waiting)?;
            out.clear();
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    counts.stopped = stop.load(Ordering::Relaxed);
    batch.answer(who, ask.interval, &mut out, &mut counts)?;
    write(&out, true)?;
    Ok(counts)
}

/// The zero of each signal: that of the file, if it has any, else what the user said or the calibration fitted.
///
/// # Errors
/// A zero that no such signal has.
pub(super) fn tares(
    who: Answerer<'_>,
    lines: &Lines<'_>,
    ask: &Ask<'_>,
    zeros: Vec<Zero>,
) -> Result<Vec<Tare>, InputError> {
    let said = ask.zero.map(|zero| zero.map(|z| lines.signal(z)));
    if let Some(k) = (0..2).find(|&k| said[k].is_some_and(|z| !z.is_finite())) {
        let error = InputError::new("this is no zero of such a signal").key("--zero");
        let error = error.value(plain(ask.zero[k].unwrap_or(f64::NAN)));
        return Err(error.allowed("a number in the unit of the signal"));
    }
    let mut zeros = zeros.into_iter();
    let tare = |k: usize| match zeros.next().filter(|zero| zero.count > 0) {
        Some(zero) => Tare::File(zero),
        None if k > 0 && who.is_twofold() => Tare::said(said[k]),
        None => Tare::new(who.locator(k), said[k.min(1)].filter(|_| !who.finds_drives())),
    };
    Ok((0..who.signals()).map(tare).collect())
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

/// A field, empty where there is no number, and the comma after it.
pub(super) fn number(out: &mut Vec<u8>, x: f64) {
    if x.is_finite() {
        let mut buffer = ryu::Buffer::new();
        let text = buffer.format_finite(x);
        out.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
    }
    out.push(b',');
}

/// Numbers and words with a comma between them.
pub(super) fn written(out: &mut Vec<u8>, fields: Vec<Field>) {
    for field in fields {
        match field {
            Field::Number(x) => number(out, x),
            Field::Count(n) => number(out, n as f64),
            Field::Word(word) => super::kept::field(out, &word),
            Field::Status(status) => super::kept::field(out, &status.to_string()),
        }
    }
    out.pop();
}
