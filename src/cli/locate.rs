//! `vibrissa locate CAL.toml [READINGS.csv]`.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};
use vibrissa::combinations;
use vibrissa::command::{self, Asked, Context, array::LocateRequest, of_one_signal};
use vibrissa::error::{Error, InputError};
use vibrissa::locate::stream::{self, Ask, Counts};
use vibrissa::locate::{Answerer, Calibration, SaidZero, Sensor, answers::Answers, locator::opener};
use vibrissa::measure::Names;
use vibrissa::scene::RunOptions;
use vibrissa::sink::{Frame, LabStream, Question, hash};
use vibrissa::text_file::{Limit, TextFile, unread};

use super::interrupt::{self, Patient};
use super::reply::Reply;

type Request = Asked<LocateRequest>;

pub fn run(args: &Request, context: &Context<'_>) -> Result<Reply, Error> {
    if args.array.is_some() {
        return command::array::run(args, context);
    }
    let path = args.calibration.as_deref().expect("clap asks for it");
    let options = args.common.over(&RunOptions::default());
    let text = Calibration::load(path)?;
    let readings = args.readings.as_deref().filter(|p| *p != Path::new("-"));
    let pool = rayon::ThreadPoolBuilder::new();
    let pool = match options.threads {
        Some(n) => pool.num_threads(n),
        None if readings.is_some() => pool,
        // A stream uses one thread: for its few taps, starting others costs more than it saves.
        None => pool.num_threads(1).use_current_thread(),
    };
    pool.build_global().map_err(|e| Error::Run(e.to_string()))?;
    let opened = Opened::new(args, (path, &text), &options)?;
    context.warn_all(&opened.warnings);
    if options.plan == Some(true) {
        let data = match &opened.answers {
            Answers::One(locator) => locator.data.file.clone(),
            Answers::Several(_) => Sensor::parse("", &text, true)?.channels[0].1.data.file.clone(),
        };
        let from = readings.map_or("stdin".to_owned(), |p| p.display().to_string());
        let by = &opened.by;
        let text =
            format!("would locate readings of {from} by {by}, calibrated on {data}; nothing was run\n");
        return Ok(reply(text, &Counts::default(), &opened, context));
    }
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let warn = |text: &str| context.warn(text);
    let zero = SaidZero::of(args.zero.as_ref(), [opened.answers.who().first()])?;
    let (by, interval) = (args.by(), args.interval);
    let asked = Ask { zero, label: None, keep: false, by, interval, ..Ask::of_file("", &columns, &warn) };
    if readings.is_none() && !args.common.json && args.common.out.is_none() {
        return streamed(&opened, &asked, context);
    }
    let label = readings.map(|p| p.display().to_string());
    filed(args, &opened, &Ask { label: label.as_deref(), keep: true, ..asked }, context)
}

struct Opened {
    answers: Answers,
    known: Value,
    checksum: String,
    by: String,
    warnings: Vec<String>,
}

impl Opened {
    fn new(args: &Request, (path, text): (&Path, &str), options: &RunOptions) -> Result<Self, Error> {
        let label = path.display().to_string();
        if Sensor::is_text(text) {
            let best = "nothing: each channel is answered by the best of its own";
            let zeros = "rows without contact, which tell the zero of each channel";
            of_one_signal(&[
                ("--zero", args.zero.is_some(), zeros),
                ("--estimator", args.estimator.is_some(), best),
            ])?;
        }
        let estimator = command::estimator(args.estimator.as_deref())?;
        let trusted = (&*label, text, args.common.force);
        let mut answers = Answers::open(trusted, estimator, args.same_run, &opener(options))?;
        let (known, checksum, by, warnings) = match &mut answers {
            Answers::Several(several) => {
                several.locators.iter_mut().for_each(|l| l.same_run = args.same_run);
                let by = format!("the channels {} together", several.names.join(", "));
                (json!({ "file": label, "channels": &several.names }), hash(text), by, Vec::new())
            }
            Answers::One(locator) => {
                let (version, checksum) = (&locator.version, locator.checksum.clone());
                let other = (version != env!("CARGO_PKG_VERSION"))
                    .then(|| format!("{label} was written by version {version} of this program"));
                let warnings = other.into_iter().chain(locator.rig.warnings.iter().cloned()).collect();
                let known = json!({ "file": label, "checksum": checksum });
                (known, checksum, locator.estimator.word().to_owned(), warnings)
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
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => {
                gone = true;
                Err(Error::Run("nobody reads".to_owned()))
            }
            other => other.map_err(|e| Error::io("stdout", e)),
        }
    };
    let answered =
        stream::answer(opened.answers.who(), stdin(), ask, None, interrupt::stop(false), &mut write);
    let counts = match answered {
        Err(_) if gone => Counts::default(),
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

/// The rows of `table` as CSV; the first call includes the header.
fn text(table: &Frame, headed: &mut bool) -> Result<Vec<u8>, Error> {
    if std::mem::replace(headed, true) { table.lines() } else { table.csv() }
}

fn some(label: &str, lines: u64) -> Result<(), InputError> {
    if lines > 0 {
        return Ok(());
    }
    let error = InputError::new("there are no readings in it").at(label, None);
    Err(error.allowed("a line for each reading, perhaps below a line that names the columns"))
}

enum Source {
    File(Vec<u8>),
    Stream(LabStream<'static>),
}

impl Source {
    fn new(readings: Option<&Path>) -> Result<Self, Error> {
        let Some(path) = readings else { return Ok(Self::Stream(stdin())) };
        if path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            let pipe = File::open(path).map_err(|e| unread("readings", &path.display().to_string(), &e))?;
            return Ok(Self::Stream(LabStream::of(Patient(pipe))));
        }
        Ok(Self::File(TextFile::open(path, "readings", Limit::AnyLines)?.bytes()?))
    }

    /// A stream cannot be read again, so its answers are kept after a signal.
    fn answer(self, who: Answerer<'_>, ask: &Ask<'_>, write: stream::Write<'_>) -> Result<Counts, Error> {
        let nothing = |why: &str| Err(Error::Run(format!("interrupted{why}; no result was written")));
        let counts = match self {
            Self::File(bytes) => {
                let zero = Some(ask.zeros(who, LabStream::of(&*bytes))?);
                let counts =
                    stream::answer(who, LabStream::of(&*bytes), ask, zero, interrupt::stop(false), write)?;
                return if counts.stopped { nothing("") } else { Ok(counts) };
            }
            Self::Stream(text) => stream::answer(who, text, ask, None, interrupt::stop(true), write)?,
        };
        if counts.stopped && counts.lines == 0 { nothing(" before the first reading") } else { Ok(counts) }
    }
}

fn filed(args: &Request, opened: &Opened, ask: &Ask<'_>, context: &Context<'_>) -> Result<Reply, Error> {
    let readings = args.readings.as_deref().filter(|p| *p != Path::new("-"));
    let source = Source::new(readings)?;
    let digest = if let Source::File(bytes) = &source { hash(bytes) } else { String::new() };
    let label = ask.label.unwrap_or("stdin").to_owned();
    let identity = hash(&format!("{digest}\n{}\n{}", opened.checksum, opened.by));
    let stem = super::stem(readings.unwrap_or(Path::new("")), "readings");
    let out = super::folder(args.common.out.as_ref(), &stem, "locate");
    // Data from stdin have no identity.
    let data = readings.map(|_| &digest);
    let asked = json!({ "readings": data, "calibration": opened.checksum, "estimator": opened.by, "columns": args.columns, "zero": args.zero, "same_run": args.same_run, "same": args.same, "object": args.object, "strokes": args.strokes, "interval": args.interval, "free": args.free.map(|free| format!("{free:?}")) });
    let from = readings.unwrap_or(Path::new("/dev/stdin"));
    let inputs = args.calibration.iter().cloned().chain([from.to_owned()]).collect();
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
    let taps = counts.lines - counts.zeros;
    let zeros = match counts.zeros {
        0 => String::new(),
        1 => ", beside 1 zero reading".to_owned(),
        n => format!(", beside {n} zero readings"),
    };
    let text = format!("{taps} readings located by {}{zeros}: {}\n", opened.by, words(&counts));
    let kept =
        || format!("interrupted; the answers to {} readings are kept in {}", counts.lines, out.display());
    let broken = counts.stopped.then(kept);
    let reply = Reply { broken, ..reply(text, &counts, opened, context) };
    let of = json!({ "name": stem, "hash": identity });
    Ok(reply.filed(destination, of, body)?.answered_of(counts.lines))
}

fn words(counts: &Counts) -> String {
    let named = counts.combinations.named();
    // Zero readings have the status `no_strain`.
    let zeros = |words: &str| if words == "no_strain" { counts.zeros } else { 0 };
    let of = named.iter().map(|(words, n)| (words.as_str(), n.saturating_sub(zeros(words))));
    combinations::told(of.filter(|(_, n)| *n > 0), |n| n.to_string())
}

fn reply(text: String, counts: &Counts, opened: &Opened, context: &Context<'_>) -> Reply {
    let (counts, seconds) = (counts.described(), context.seconds());
    let result = json!({ "estimator": opened.by, "warnings": context.told() });
    Reply { text, counts, seconds, result, ..Reply::default() }
}
