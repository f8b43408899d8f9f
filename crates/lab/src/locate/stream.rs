//! Readings line by line: one answer for each, at once, in constant memory.

use std::cell::OnceCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::strokes::{self, Group};
use super::{Answerer, By, Locator, Objects, Reading, Spatial, rows::RowReader, tared::TaredRows};
use crate::error::{Error, InputError};
use crate::measure::{Names, Zero};
use crate::sink::heading::{Kind, Only, fact_in, kind};
use crate::sink::{Field, Frame, Heading, LabCell, LabRow, LabStream, LabTable, Values, heading};
use crate::{combinations::Combinations, fields::plain, status::Status};

pub use super::tared::zeros;

/// Readings that are answered together at most.
const TOGETHER: usize = 1 << 12;

/// Time, after it was asked to stop, in which lines that were read before are answered.
const GRACE: Duration = Duration::from_millis(500);

/// The drive of a calibration whose drive was not recorded.
pub(super) const UNRECORDED: f64 = 1.0;
/// Drives that differ by no more than this share are one where the calibration has but one.
const JITTER: f64 = 0.01;

/// Where answers go: the next rows of their table, and whether a reader is waiting for them. At first it is given the columns, at times without a row.
pub type Write<'a> = &'a mut dyn FnMut(&Frame, bool) -> Result<(), Error>;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Counts {
    pub lines: u64,
    /// Zero readings among them.
    pub zeros: u64,
    /// Empty lines among them.
    pub blank: u64,
    pub combinations: Combinations,
    /// True if it was asked to stop, and some of the input may not be answered.
    pub stopped: bool,
}

impl Counts {
    /// As they stand in `run.json`.
    pub fn described(&self) -> Value {
        json!({ "readings": self.lines, "zero_readings": self.zeros, "status": self.combinations.words(), "combinations": self.combinations.named() })
    }
}

#[derive(Clone, Copy)]
pub struct Ask<'a> {
    pub columns: &'a Names,
    /// The zero that the user gave, in the unit of the signal; of each of two signals.
    pub zero: [Option<f64>; 2],
    /// Name of the file, if it is one: its first line must then be a header or a reading.
    pub label: Option<&'a str>,
    /// True if answers keep the fields of their line, its number first, and say which zero was subtracted.
    pub keep: bool,
    pub by: By<'a>,
    /// True if the interval that holds a distance with 95 % is told.
    pub interval: bool,
    /// True for the numbers of the lines that are read; `None` reads all.
    pub only: Option<&'a dyn Fn(usize) -> bool>,
    pub warn: &'a dyn Fn(&str),
}

impl<'a> Ask<'a> {
    /// All lines of a file `label`, which are kept, each reading alone.
    pub fn of_file(label: &'a str, columns: &'a Names, warn: &'a dyn Fn(&str)) -> Self {
        let (label, by) = (Some(label), By::Unsaid);
        Self { columns, zero: [None; 2], label, keep: true, by, interval: false, only: None, warn }
    }

    pub(super) fn label(&self) -> &'a str {
        self.label.unwrap_or("stdin")
    }

    /// Zero readings of a whole file ([`zeros`]), which may not stand beside a zero that was given; those that are none are told.
    pub fn zeros(&self, who: Answerer<'_>, input: LabStream<'_>) -> Result<Vec<Zero>, Error> {
        let (zeros, wrong) = zeros(who, input, self)?;
        if let (Some(x), n @ 1..) = (self.zero[0], zeros[0].count) {
            let error = InputError::new("these readings have zero readings of their own").key("--zero");
            let error = error.value(plain(x)).allowed(format!("nothing: {n} rows say it"));
            return Err(error.at(self.label(), None).into());
        }
        if !wrong.is_empty() {
            let lines: Vec<String> = wrong.iter().take(8).map(usize::to_string).collect();
            let (label, n, lines) = (self.label(), wrong.len(), lines.join(", "));
            (self.warn)(&format!(
                "{label}: {n} zero readings are taps by their size and not used (lines {lines})"
            ));
        }
        Ok(zeros)
    }
}

/// Columns that are added after the user's own, of two gauges or of one, with the interval where it is asked for.
fn added(who: Answerer<'_>, interval: bool) -> Vec<&'static str> {
    let wanted = |name: &&str| match fact_in("located", name).map(|fact| fact.only) {
        _ if name.ends_with("_95_mm") => interval,
        Some(Only::Second) => who.is_twofold(),
        _ => true,
    };
    heading("located").names_from("zero").into_iter().filter(wanted).collect()
}

/// A line of a file as it is kept: its number, the user's columns, drive and signal unless the file names them so, zero, answer.
pub(super) struct Kept {
    pub empty: Frame,
    own: Vec<Kind>,
    /// True if drive and signal are added.
    more: [bool; 2],
}

impl Kept {
    /// For these rows, those of `frame` where they are in memory, in a `table` with the columns `added`, of which the zero is the first. Of a text the user's
    /// own columns are words, as they are.
    pub fn new(rows: &RowReader<'_>, frame: Option<&Frame>, table: &Heading, added: &[&'static str]) -> Self {
        let own = &rows.header.names;
        let common = [rows.drive().column(), rows.who.first().unit.common()];
        let taken = |n: &String| n == "line" || added.contains(&n.as_str());
        let mut names = own.clone();
        for k in (0..own.len()).filter(|k| taken(&own[*k])) {
            let mut name = format!("given_{}", own[k]);
            while names.contains(&name) {
                name.insert_str(0, "given_");
            }
            names[k] = name;
        }
        let missing = common.map(|c| !own.iter().any(|n| n == c));
        // Each of several channels has its own column.
        let more = [missing[0], missing[1] && !rows.who.finds_drives()];
        let kind = |k: usize| match frame.map(|frame| &frame.columns[k]) {
            Some(Values::Numbers(_) | Values::Counts(_)) => Kind::Number,
            _ => Kind::Word,
        };
        let own: Vec<Kind> = (0..names.len()).map(kind).collect();
        let mut empty = Frame::of(&table.file, ["line"]);
        names.into_iter().zip(&own).for_each(|(name, kind)| empty.add(name, Values::new(*kind)));
        let common = common.into_iter().zip(more).filter(|(_, more)| *more).map(|(name, _)| name);
        add(&mut empty, &common.chain(added.iter().copied()).collect::<Vec<_>>());
        Self { empty, own, more }
    }

    /// A row of it up to the zero: number and fields of the line, then these.
    pub fn fields(&self, line: usize, cells: &[LabCell<'_>], [drive, signal, zero]: [f64; 3]) -> Vec<Field> {
        let own = self.own.iter().enumerate();
        let own = own.map(|(k, kind)| cells.get(k).unwrap_or(&LabCell::EMPTY).field(*kind));
        let more =
            [drive, signal].into_iter().zip(self.more).filter(|(_, more)| *more).map(|(x, _)| x.into());
        std::iter::once(line.into()).chain(own).chain(more).chain([zero.into()]).collect()
    }
}

/// Answers every line of `input`; `stop` ends it after the last whole line. Without the `zero` of each signal, zero readings serve the lines after them.
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
    Objects::can(who, ask.by).map_err(|e| e.at(ask.label(), None))?;
    let mut counts = Counts::default();
    let mut table = Frame::of("located.csv", [locator.rig.setup.drive.column()]);
    if !ask.keep {
        (0..who.signals()).for_each(|k| table.add(who.column(k).to_owned(), Values::new(Kind::Number)));
        add(&mut table, &added(who, ask.interval)[1..]);
        if ask.by != By::Unsaid {
            add(&mut table, &Group::columns(ask, who.is_twofold(), &[]));
        }
        // A reader of a stream may wait for its header.
        write(&table, true)?;
    }
    let mut tared = TaredRows::new(who, input, ask, zero)?;
    if let Some(lag) = locator.lag.filter(|_| tared.rows.header.time.is_none()) {
        (ask.warn)(&format!(
            "the readings of the calibration lag ({:.2} % of a change with a time constant of {:.2} s), and these have no column t_s: they are \
             taken as settled",
            100.0 * lag.gain,
            lag.tau_s
        ));
    }
    let names = tared.rows.header.names.clone();
    let mut group = Group::new(who, &names, ask)?;
    let kept = ask.keep.then(|| {
        let together = group.iter().flat_map(|group| group.columns.iter().copied());
        let columns: Vec<&str> = added(who, ask.interval).into_iter().chain(together).collect();
        Kept::new(&tared.rows, of_frame, heading("located"), &columns)
    });
    kept.iter().for_each(|kept| table = kept.empty.like());
    let (mut one, untimed, mut stopped) = (None, OnceCell::new(), None);
    let mut batch: Vec<PendingLine> = Vec::new();
    while let Some(mut row) = tared.next()? {
        let line = &row.line;
        if stop.load(Ordering::Relaxed) && !line.whole {
            break;
        }
        if row.untimed {
            untimed.get_or_init(|| {
                (ask.warn)(&format!(
                    "line {}: this time is missing, or before that of a line above: such readings are taken as settled, and their σ does not know \
                     of the lag",
                    line.number
                ))
            });
        }
        if row.tap.is_ok()
            && !locator.drive_recorded
            && !who.finds_drives()
            && !same(&mut one, row.drive, locator, ask)
        {
            (row.tap, row.zero) = (Err(Status::OUTSIDE_CALIBRATION), f64::NAN);
        }
        counts.lines += 1;
        counts.zeros += u64::from(row.rests);
        counts.blank += u64::from(line.row.is_some_and(LabRow::is_blank));
        if row.rests {
            group.iter_mut().for_each(Group::rest);
        }
        let asked = match &kept {
            Some(kept) => kept.fields(line.number, &row.cells, [row.drive, row.recorded[0], row.zero]),
            None => {
                let known = locator.drive_recorded || row.drive != UNRECORDED;
                let drive = if known { row.drive } else { f64::NAN };
                std::iter::once(drive).chain(row.recorded).map(Field::Number).collect()
            }
        };
        let answer = match row.tap.as_ref() {
            Err(why) => Some(Spatial::nothing(*why)),
            // Groups need each answer at once; with one signal that costs no more.
            Ok(tap) if group.is_some() || who.is_alone() => who.answer(std::slice::from_ref(tap))?.pop(),
            Ok(_) => None,
        };
        let told = row.tap.as_ref().ok().zip(answer.as_ref());
        let more = group.as_mut().map_or_else(Vec::new, |group| group.tell(&row.cells, told, ask));
        batch.push((asked, answer.ok_or_else(|| row.tap.unwrap_or_default()), more));
        // A sender of half a line waits for the answers to the lines before it.
        let waiting = line.waiting;
        if waiting || batch.len() >= TOGETHER {
            put(&mut batch, (who, ask.interval), &mut table, &mut counts)?;
            write(&table, waiting)?;
            table = table.like();
        }
        // After the stop, answers lines already read for a limited time.
        if stop.load(Ordering::Relaxed) && stopped.get_or_insert_with(Instant::now).elapsed() > GRACE {
            break;
        }
    }
    counts.stopped = stop.load(Ordering::Relaxed);
    put(&mut batch, (who, ask.interval), &mut table, &mut counts)?;
    write(&table, true)?;
    Ok(counts)
}

/// A line: what stands before its answer, the answer or the tap that is still to be answered, and what follows it.
type PendingLine = (Vec<Field>, Result<Spatial, Reading>, Vec<Field>);

/// Adds the `lines` with their answers to `table`, and forgets them.
fn put(
    lines: &mut Vec<PendingLine>,
    (who, interval): (Answerer<'_>, bool),
    table: &mut Frame,
    counts: &mut Counts,
) -> Result<(), Error> {
    let taps: Vec<Reading> =
        lines.iter_mut().filter_map(|line| line.1.as_mut().err().map(std::mem::take)).collect();
    let mut located = who.answer(&taps)?.into_iter();
    for (asked, answer, more) in lines.drain(..) {
        let found = answer.ok().or_else(|| located.next()).unwrap_or(Spatial::nothing(Status::BAD_INPUT));
        counts.combinations.note(found.located.status, 1);
        let numbers = found.numbers();
        let (first, of_two) = numbers.split_at(2);
        let ends = found.located.interval.iter().filter(|_| interval);
        let of_two = of_two.iter().filter(|_| who.is_twofold());
        let numbers = first.iter().chain(ends).chain(of_two).map(|x| Field::Number(*x));
        let status = Field::Status(found.located.status);
        table.row(asked.into_iter().chain(numbers).chain([status]).chain(more))?;
    }
    Ok(())
}

/// Adds these columns to `answers`. The name of an object or a stroke is a word.
pub fn add(answers: &mut Frame, names: &[&'static str]) {
    for name in names {
        let is_name = [super::object::NAME, strokes::NAME].contains(name);
        answers.add(*name, Values::new(if is_name { Kind::Word } else { kind(name) }));
    }
}

/// True if a reading is of the one drive of a calibration whose drive was not recorded: that of the first reading is taken as it.
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
