//! Readings line by line: one answer for each, at once, in constant memory.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

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
use crate::fields::plain;
use crate::measure::Names;
use crate::measure::missing::is_usual;
use crate::measure::thousands::Thousands;
use crate::measure::zero::Zero;
use crate::sink::fact::{Kind, fact_in, kind};
use crate::sink::frame::Frame;
use crate::sink::heading::heading;
use crate::sink::lab::{LabRow, LabStream, LabTable};
use crate::sink::values::{Field, Values};
use crate::status::Status;

/// Readings that are answered together at most.
const TOGETHER: usize = 1 << 12;

/// Time, after it was asked to stop, in which lines that were read before are answered.
const GRACE: Duration = Duration::from_millis(500);

/// A drive that was not recorded.
const UNRECORDED: f64 = 1.0;
/// Drives that differ by no more than this share are one where the calibration has but one.
const JITTER: f64 = 0.01;
/// A zero reading with a value that stands for none, such as -1, is left out where it differs from the other zero readings by this share of a usual tap.
const NO_ZERO: f64 = 0.1;

/// Where answers go: the next rows of their table, and whether a reader is waiting for them. At first it is given the columns, at times without a row.
pub type Write<'a> = &'a mut dyn FnMut(&Frame, bool) -> Result<(), Error>;

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
    /// Which lines are read, by their numbers; all where nothing is said. Others are passed over.
    pub only: Option<&'a dyn Fn(usize) -> bool>,
    /// Tells the user what he should know, at once.
    pub warn: &'a dyn Fn(&str),
}

impl<'a> Ask<'a> {
    /// All lines of a file `label`, which are kept, each reading alone.
    pub fn of_file(label: &'a str, columns: &'a Names, warn: &'a dyn Fn(&str)) -> Self {
        let label = Some(label);
        let by = By::Unsaid;
        Self { columns, zero: [None; 2], label, keep: true, by, interval: false, only: None, warn }
    }

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
pub fn zeros(
    who: Answerer<'_>,
    input: LabStream<'_>,
    ask: &Ask<'_>,
) -> Result<(Vec<Zero>, Vec<usize>), Error> {
    let mut source = Source::new(input, ask);
    let mut rows = RowReader::new(who);
    let (mut readings, mut numbers, mut sizes) = (vec![Vec::new(); who.signals()], Vec::new(), Vec::new());
    let mut thousands = Thousands::default();
    while let Some(line) = source.next(&mut rows)? {
        let Some(row) = line.row else { continue };
        let cells = rows.cells(row);
        let read = rows.parse(row, &cells);
        thousands.see(line.number, &rows.named(cells), row.separator());
        let Some((drive, signals)) = read else { continue };
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
pub fn answer(
    who: Answerer<'_>,
    input: LabStream<'_>,
    ask: &Ask<'_>,
    zero: Option<Vec<Zero>>,
    stop: &AtomicBool,
    write: Write<'_>,
) -> Result<Counts, Error> {
    let locator = who.first();
    let of_frame = if let LabTable::Frame(frame) = input { Some(frame) } else { None };
    let mut source = Source::new(input, ask);
    let label = |e: InputError| e.at(ask.label.unwrap_or("stdin"), None);
    Objects::can(who, ask.by).map_err(label)?;
    let mut rows = RowReader::new(who);
    let mut counts = Counts::default();
    let mut table = Frame::of("located.csv", [locator.rig.setup.drive.column()]);
    if !ask.keep {
        (0..who.signals()).for_each(|k| table.add(who.column(k).to_owned(), Values::new(Kind::Number)));
        add(&mut table, "located", &added(who, ask.interval)[1..]);
        if ask.by != By::Unsaid {
            add(&mut table, "located", &Group::columns((ask.by, ask.interval), who, None));
        }
        // Whoever starts a stream may want to see that it is ready.
        write(&table, true)?;
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
    let kept = ask.keep.then(|| {
        let together = group.iter().flat_map(|_| Group::columns((ask.by, ask.interval), who, Some(&rows)));
        let columns: Vec<&str> = added(who, ask.interval).into_iter().chain(together).collect();
        let kept = Kept::new(&rows, of_frame, &columns);
        table = kept.frame(heading("located"));
        kept
    });
    let (mut asked, mut follows, mut untimed) = (false, false, false);
    // A file was looked through before.
    let (mut thousands, mut unclear) = ((!of_file).then(Thousands::default), false);
    let (mut one, mut stopped) = (None, None);
    let mut batch = Batch::default();
    while let Some(line) = source.next(&mut rows)? {
        if stop.load(Ordering::Relaxed) && !line.whole {
            break;
        }
        // Of a line that is no reading, no field is known to be a signal.
        let cells = line.row.map_or_else(Vec::new, |row| rows.cells(row));
        let mut read = line.row.and_then(|row| rows.parse(row, &cells));
        let cells = rows.named(cells);
        if let Some((seen, row)) = thousands.as_mut().zip(line.row) {
            let grouped = seen.see(line.number, &cells, row.separator());
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
                    together = Some(group.tell((&rows, &cells), tap, &located, ask));
                }
                Answer::Known(located)
            } else if let Some(group) = group.as_mut().filter(|_| who.is_twofold()) {
                let alone = locator.pairs(&[tap.pair()])?.pop();
                let alone = alone.unwrap_or((Spatial::nothing(Status::BAD_INPUT), None));
                together = Some(group.tell_pair((&rows, &cells), (line.number, counts.zeros), &alone, ask));
                Answer::Contact(Box::new(alone.0))
            } else {
                Answer::UnlocatedTap(tap)
            }
        };
        let nothing = |group: &Group<'_>| group.nothing((&rows, &cells), ask);
        let more = group.as_ref().map(|group| together.unwrap_or_else(|| nothing(group)));
        follows = is_zero;
        counts.lines += 1;
        counts.blank += u64::from(line.row.is_some_and(LabRow::is_blank));
        let shown = if locator.drive_recorded || drive != UNRECORDED { drive } else { f64::NAN };
        let asked = match &kept {
            Some(kept) => {
                let zero = zero.map_or(f64::NAN, |z| z.0);
                kept.fields(line.number, &cells, [drive, signals[0], zero])
            }
            None => std::iter::once(shown).chain(signals).map(Field::Number).collect(),
        };
        // Whoever sent half a line waits for the answers to those before it.
        let waiting = line.waiting;
        batch.lines.push((asked, found, more.unwrap_or_default()));
        if waiting || batch.lines.len() >= TOGETHER {
            batch.answer(who, ask.interval, &mut table, &mut counts)?;
            write(&table, waiting)?;
            table = table.like();
        }
        // Lines that were read before it was asked to stop are answered, as many as there is time for.
        if stop.load(Ordering::Relaxed) && stopped.get_or_insert_with(Instant::now).elapsed() > GRACE {
            break;
        }
    }
    counts.stopped = stop.load(Ordering::Relaxed);
    batch.answer(who, ask.interval, &mut table, &mut counts)?;
    write(&table, true)?;
    Ok(counts)
}

/// Adds these columns to `answers`, a table of the heading `table`. The name of an object or a stroke is a word.
pub(super) fn add(answers: &mut Frame, table: &str, names: &[&'static str]) {
    for name in names {
        let is_name = [super::object::NAME, super::strokes::NAME].contains(name);
        let of = |heading| fact_in(heading, name).map(|fact| fact.kind);
        let known = [table, "together", "along"].into_iter().find_map(of).unwrap_or_else(|| kind(name));
        answers.add(*name, Values::new(if is_name { Kind::Word } else { known }));
    }
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
