//! `vibrissa locate CAL.toml [READINGS.csv]`.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vibrissa::combinations;
use vibrissa::command::array::ArrayRequest;
use vibrissa::command::{self, Context, of_one_signal};
use vibrissa::error::{Error, InputError};
use vibrissa::locate::answers::Answers;
use vibrissa::locate::object::By;
use vibrissa::locate::stream::{self, Ask};
use vibrissa::locate::{Answerer, Calibration, SaidZero, Sensor, locator::opener};
use vibrissa::measure::{Names, zero};
use vibrissa::scene::RunOptions;
use vibrissa::sink::folder::{Hashing, Question, hash};
use vibrissa::sink::frame::Frame;
use vibrissa::sink::lab::LabStream;
use vibrissa::text_file::{Limit, TextFile, refused, unread};

use super::args::Locate;
use super::interrupt::{self, Patient};
use super::reply::Reply;

/// Readings of which the answer begins with what the report says.
const ANSWERED: u64 = 100_000;

/// Answers a file into `located.csv`, or a stream on stdout.
pub fn run(args: &Locate, context: &Context<'_>) -> Result<Reply, Error> {
    if let Some(array) = &args.array {
        return command::array::run(&of_array(args, array)?, context);
    }
    let path = args.calibration.as_deref().expect("clap asks for it");
    let options = args.common.over(&RunOptions::default());
    let text = Calibration::load(path)?;
    let readings = args.readings.as_deref().filter(|p| *p != Path::new("-"));
    let pool = rayon::ThreadPoolBuilder::new();
    let pool = match options.threads {
        Some(n) => pool.num_threads(n),
        None if readings.is_some() => pool,
        // A stream is answered by one thread; handing its few taps at start to others costs more than it saves.
        None => pool.num_threads(1).use_current_thread(),
    };
    pool.build_global().map_err(|e| Error::Run(e.to_string()))?;
    let opened = Opened::new(args, (path, &text), &options)?;
    context.warn_all(&opened.warnings);
    if options.plan == Some(true) {
        let data = match &opened.answers {
            Answers::One(_, calibration) => calibration.data.file.clone(),
            Answers::Several(_) => Sensor::parse("", &text, true)?.channels[0].1.data.file.clone(),
        };
        let from = readings.map_or("stdin".to_owned(), |p| p.display().to_string());
        let by = &opened.by;
        let text =
            format!("would locate readings of {from} by {by}, calibrated on {data}; nothing was run\n");
        return Ok(reply(text, &stream::Counts::default(), &opened, context));
    }
    // A stream is answered on stdout, unless that is taken by JSON or a folder is asked for.
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let warn = |text: &str| context.warn(text);
    let zero = SaidZero::of(args.zero.as_ref(), [opened.answers.who().first()])?;
    let by = by(args);
    let asked = Ask {
        zero,
        label: None,
        keep: false,
        by,
        interval: args.interval,
        ..Ask::of_file("", &columns, &warn)
    };
    if readings.is_none() && !args.common.json && args.common.out.is_none() {
        return streamed(&opened, &asked, context);
    }
    let label = readings.map(|p| p.display().to_string());
    filed(args, path, &opened, &Ask { label: label.as_deref(), keep: true, ..asked }, context)
}

/// Readings of several whiskers: the first of the two files is the readings where the array names the calibrations.
fn of_array(args: &Locate, array: &Path) -> Result<ArrayRequest, InputError> {
    let misused = |value: String, message: &str| {
        let allowed = "vibrissa locate --array ARRAY.toml READINGS.csv";
        InputError::new(message).key("--array").value(value).allowed(allowed)
    };
    let readings = match (&args.calibration, &args.readings) {
        (Some(readings), None) => readings.clone(),
        (None, _) => return Err(misused("nothing".to_owned(), "the readings are missing")),
        (Some(_), Some(other)) => {
            return Err(misused(other.display().to_string(), "the array names the calibrations"));
        }
    };
    Ok(ArrayRequest {
        array: array.to_owned(),
        readings: Some(readings),
        columns: args.columns.clone(),
        estimator: args.estimator.map(|e| e.name().to_owned()),
        zero: args.zero.clone(),
        same_run: args.same_run,
        same: args.same,
        object: args.object.clone(),
        angle_noise: None,
        base_noise: None,
        common: args.common.clone(),
    })
}

fn by(args: &Locate) -> By<'_> {
    match &args.object {
        Some(column) => By::Column(column),
        None if args.same => By::Same,
        None if args.strokes => By::Strokes(args.free.unwrap_or_default()),
        None => By::Unsaid,
    }
}

struct Opened {
    answers: Answers,
    known: Value,
    checksum: String,
    /// The estimator, or the channels, in words.
    by: String,
    warnings: Vec<String>,
}

impl Opened {
    fn new(args: &Locate, (path, text): (&Path, &str), options: &RunOptions) -> Result<Self, Error> {
        let label = path.display().to_string();
        if Sensor::is_text(text) {
            let best = "nothing: each channel is answered by the best of its own";
            let zeros = "rows without contact, which tell the zero of each channel";
            of_one_signal(&[
                ("--zero", args.zero.is_some(), zeros),
                ("--estimator", args.estimator.is_some(), best),
            ])?;
        }
        let trusted = (&*label, text, args.common.force);
        let mut answers = Answers::open(trusted, args.estimator, args.same_run, &opener(options))?;
        let (known, checksum, by, warnings) = match &mut answers {
            Answers::Several(several) => {
                several.locators.iter_mut().for_each(|l| l.same_run = args.same_run);
                let by = format!("the channels {} together", several.names.join(", "));
                (json!({ "file": label, "channels": &several.names }), hash(text), by, Vec::new())
            }
            Answers::One(locator, calibration) => {
                let (version, checksum) = (&calibration.version, calibration.checksum.clone());
                let other = (version != env!("CARGO_PKG_VERSION"))
                    .then(|| format!("{label} was written by version {version} of this program"));
                let warnings = other.into_iter().chain(calibration.rig.warnings.iter().cloned()).collect();
                let known = json!({ "file": label, "checksum": checksum });
                (known, checksum, locator.estimator.name().to_owned(), warnings)
            }
        };
        Ok(Self { answers, known, checksum, by, warnings })
    }
}

fn streamed(opened: &Opened, ask: &Ask<'_>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut stdout = std::io::stdout().lock();
    let mut gone = false;
    let mut headed = false;
    let mut write = |table: &Frame, waiting: bool| {
        let text = text(table, &mut headed)?;
        let mut put = || {
            stdout.write_all(&text)?;
            if waiting { stdout.flush() } else { Ok(()) }
        };
        match put() {
            // Whoever read the answers has left: there is nobody to answer.
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => {
                gone = true;
                Err(Error::Run("nobody reads".to_owned()))
            }
            other => other.map_err(|e| Error::io("stdout", e)),
        }
    };
    let answered = stream::answer(opened.answers.who(), stdin(), ask, None, interrupt::stop(), &mut write);
    let counts = match answered {
        Err(_) if gone => stream::Counts::default(),
        other => other?,
    };
    let broken = counts.stopped.then(|| format!("interrupted; {} readings were answered", counts.lines));
    if !gone && !counts.stopped {
        some("stdin", counts.lines - counts.blank)?;
    }
    Ok(Reply { broken, ..reply(String::new(), &counts, opened, context) })
}

fn stdin() -> LabStream<'static> {
    LabStream::of(Patient(std::io::stdin().lock()))
}

/// The rows of `table` as CSV, after its header unless it is `headed`.
fn text(table: &Frame, headed: &mut bool) -> Result<Vec<u8>, Error> {
    if std::mem::replace(headed, true) { table.lines() } else { table.csv() }
}

/// Refuses `label` where it had no `lines` that are readings.
fn some(label: &str, lines: u64) -> Result<(), InputError> {
    if lines > 0 {
        return Ok(());
    }
    let error = InputError::new("there are no readings in it").at(label, None);
    Err(error.allowed("a line for each reading, perhaps below a line that names the columns"))
}

enum Source {
    /// What can be read again, with its hash.
    File(PathBuf, String),
    /// A pipe, a device or stdin.
    Stream(LabStream<'static>),
}

impl Source {
    fn new(readings: Option<&Path>) -> Result<Self, Error> {
        let Some(path) = readings else { return Ok(Self::Stream(stdin())) };
        let file = open(path)?;
        if !file.metadata().map_err(|e| Error::io(path, e))?.is_file() {
            return Ok(Self::Stream(LabStream::of(Patient(file))));
        }
        let label = path.display().to_string();
        // What is no file of readings is refused before all of it is read.
        let text = TextFile::new(file, &label, "readings", Limit::AnyLines);
        let digest = Hashing::new(text).end();
        let digest = digest.map_err(|e| refused(e).map_or_else(|e| Error::io(path, e), Error::from))?;
        Ok(Self::File(path.to_owned(), digest))
    }

    fn digest(&self) -> &str {
        if let Self::File(_, digest) = self { digest } else { "" }
    }

    /// What is there of a stream will not come again: it is kept when a signal ends it.
    fn answer(
        self,
        who: Answerer<'_>,
        ask: &Ask<'_>,
        write: stream::Write<'_>,
    ) -> Result<stream::Counts, Error> {
        let nothing = |why: &str| Err(Error::Run(format!("interrupted{why}; no result was written")));
        let counts = match self {
            Self::File(path, digest) => {
                let zero = read_zeros(who, (&path, &digest), ask)?;
                let mut input = Hashing::new(Patient(open(&path)?));
                let text = LabStream::of(&mut input);
                let counts = stream::answer(who, text, ask, Some(zero), interrupt::stop(), write)?;
                let kept = unchanged(&path, input, &digest);
                return if counts.stopped { nothing("") } else { kept.map(|()| counts) };
            }
            Self::Stream(text) => stream::answer(who, text, ask, None, interrupt::stop_and_keep(), write)?,
        };
        if counts.stopped && counts.lines == 0 { nothing(" before the first reading") } else { Ok(counts) }
    }
}

/// Fails where what was read of the file at `path` is not what has this hash, unless a signal ended the reading.
fn unchanged(path: &Path, input: Hashing<Patient<File>>, digest: &str) -> Result<(), Error> {
    let found = input.end().map_err(|e| Error::io(path, e))?;
    if found == digest || interrupt::asked() {
        return Ok(());
    }
    let why = "these readings were changed while they were read; no result was written";
    Err(Error::Run(format!("{}: {why}", path.display())))
}

/// The zero of the file at `path`, from its own zero readings.
fn read_zeros(
    who: Answerer<'_>,
    (path, digest): (&Path, &str),
    ask: &Ask<'_>,
) -> Result<Vec<zero::Zero>, Error> {
    let mut input = Hashing::new(Patient(open(path)?));
    let (zero, wrong) = stream::zeros(who, LabStream::of(&mut input), ask)?;
    unchanged(path, input, digest)?;
    ask.contradicted(&zero)?;
    if !wrong.is_empty() {
        let first: Vec<String> = wrong.iter().take(8).map(usize::to_string).collect();
        let (label, n, lines) = (ask.label.unwrap_or("stdin"), wrong.len(), first.join(", "));
        let taps = "zero readings are taps by their size and not used";
        (ask.warn)(&format!("{label}: {n} {taps} (lines {lines})"));
    }
    Ok(zero)
}

fn filed(
    args: &Locate,
    path: &Path,
    opened: &Opened,
    ask: &Ask<'_>,
    context: &Context<'_>,
) -> Result<Reply, Error> {
    let readings = args.readings.as_deref().filter(|p| *p != Path::new("-"));
    let source = Source::new(readings)?;
    let (label, digest) = (ask.label.unwrap_or("stdin").to_owned(), source.digest().to_owned());
    let identity = hash(&format!("{digest}\n{}\n{}", opened.checksum, opened.by));
    let stem = super::stem(readings.unwrap_or(Path::new("")), "readings");
    let out = super::folder(args.common.out.as_ref(), &stem, "locate");
    // What stdin brought is not known again.
    let data = readings.map(|_| &digest);
    let asked = json!({ "readings": data, "calibration": opened.checksum, "estimator": opened.by, "columns": args.columns, "zero": SaidZero::json(args.zero.as_ref()), "same_run": args.same_run, "same": args.same, "object": args.object, "strokes": args.strokes, "interval": args.interval, "free": args.free.map(|free| format!("{free:?}")) });
    let from = readings.unwrap_or(Path::new("/dev/stdin"));
    let inputs = vec![path.to_owned(), from.to_owned()];
    let question = Question { inputs, ..Question::new("locate", &stem, asked) };
    let mut destination = context.open(&out, question, &["located.csv"], Some(args.common.force))?;
    let counts = destination.stream("located.csv", |write| {
        let mut headed = false;
        let counts =
            source.answer(opened.answers.who(), ask, &mut |table, _| write(&text(table, &mut headed)?))?;
        some(&label, counts.lines - counts.blank)?;
        Ok(counts)
    })?;
    let body = json!({
        "calibration": opened.known, "readings": { "file": label, "hash": digest }, "estimator": opened.by,
        "warnings": context.told(), "interrupted": counts.stopped,
    });
    let (taps, zeros) = (counts.lines - counts.zeros, zeros(&counts));
    let text = format!("{taps} readings located by {}{zeros}: {}\n", opened.by, words(&counts));
    let kept =
        || format!("interrupted; the answers to {} readings are kept in {}", counts.lines, out.display());
    let broken = counts.stopped.then(kept);
    let reply = Reply { broken, ..reply(text, &counts, opened, context) };
    let reply = reply.filed(destination, json!({ "name": stem, "hash": identity }), body, context)?;
    // A long table is not read again for a sentence.
    Ok(if counts.lines <= ANSWERED { reply.answered() } else { reply })
}

fn open(path: &Path) -> Result<File, Error> {
    let label = path.display().to_string();
    if path.is_dir() {
        return Err(InputError::new("this is a folder; a file of readings is needed").at(label, None).into());
    }
    File::open(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => {
            InputError::new("there is no such file of readings").at(label, None).into()
        }
        _ => unread("readings", &label, &e).into(),
    })
}

fn zeros(counts: &stream::Counts) -> String {
    match counts.zeros {
        0 => String::new(),
        1 => ", beside 1 zero reading".to_owned(),
        n => format!(", beside {n} zero readings"),
    }
}

/// The words of the readings that are no zero readings, and how many have each.
fn words(counts: &stream::Counts) -> String {
    let named = counts.combinations.named();
    // Zero readings have the word of a signal that is zero.
    let zeros = |words: &str| if words == "no_strain" { counts.zeros } else { 0 };
    let of = named.iter().map(|(words, n)| (words.as_str(), n.saturating_sub(zeros(words))));
    combinations::told(of.filter(|(_, n)| *n > 0), |n| n.to_string())
}

fn reply(text: String, counts: &stream::Counts, opened: &Opened, context: &Context<'_>) -> Reply {
    Reply {
        text,
        counts: counts.described(),
        seconds: context.seconds(),
        result: json!({ "estimator": opened.by, "warnings": context.told() }),
        ..Reply::default()
    }
}
