//! `vibrissa new`: writes a first spec from five answers, and its schema.

use std::io::{BufRead, IsTerminal, Write as _};
use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde_json::json;
use vibrissa::command::words;
use vibrissa::error::{Error, InputError};
use vibrissa::reference::schema;
use vibrissa::spec::{self, keys};

use super::reply::Reply;

const SCHEMA: &str = "spec.schema.json";
/// Smallest accepted noise of a reading, microstrain. Gauge amplifiers have at least 0.1; a smaller number was meant as strain.
const LEAST_NOISE: f64 = 0.01;

const WHISKER_ASKED: &str = "Base diameter, tip diameter and length of the whisker, mm, as 10,4,80";
const GAUGE_ASKED: &str = "Start of the gauge's grid from the clamp and its length, mm, and the noise of one reading, microstrain, as 5,2,15";
const DISTANCES_ASKED: &str = "Nearest and farthest distance of objects from the clamp, mm, as 25,70";

const GOALS: [(&str, &str, &str); 4] = [
    ("tap", "tap", "the best tap angle of this whisker"),
    ("optimise", "optimise", "the best whisker and gauge near this one"),
    ("sweep", "sweep", "tables of every distance and tap angle"),
    ("calibrate", "calibrate", "a distance from measured strains"),
];
const CLAMPS: [(&str, &str, &str); 4] = [
    ("rigid", "rigid", "as the theory has it: nothing gives way"),
    ("bonded", "bonded", "its face is bonded to a plate"),
    ("glued", "glued", "glued into a socket"),
    ("socket", "socket", "pushed into a smooth socket"),
];

/// Write a first spec: five questions, or their answers as flags. Every line of it is commented.
#[derive(Debug, Flags)]
#[command(
    after_help = "Example: vibrissa new mine.toml --whisker 10,4,80 --gauge 5,2,15 --clamp glued --distances 25,70 --for tap"
)]
pub struct New {
    /// The spec to write; its schema is written beside it, for editors
    #[arg(default_value = "whisker.toml")]
    pub spec: PathBuf,
    /// Base diameter, tip diameter and length, mm
    #[arg(long, value_name = "D,d,L_a")]
    pub whisker: Option<String>,
    /// Start of the gauge's grid from the clamp and its length, mm; standard deviation of one reading, microstrain
    #[arg(long, value_name = "x_ss,l,noise")]
    pub gauge: Option<String>,
    /// How the base is held
    #[arg(long, value_name = "NAME", value_parser = words(CLAMPS))]
    pub clamp: Option<&'static str>,
    /// Nearest and farthest distance of objects from the clamp, mm
    #[arg(long, value_name = "NEAR,FAR")]
    pub distances: Option<String>,
    /// What the spec is for
    #[arg(long = "for", value_name = "GOAL", value_parser = words(GOALS))]
    pub goal: Option<&'static str>,
    /// Replace a spec that is there
    #[arg(long)]
    pub force: bool,
    /// One JSON object on stdout and nothing else
    #[arg(long)]
    pub json: bool,
}

/// Whisker, gauge, clamp, distances and goal.
type Answers = ([f64; 3], [f64; 3], &'static str, [f64; 2], &'static str);

pub fn run(args: &New) -> Result<Reply, Error> {
    let refused = |message: &str, allowed: &str| {
        InputError::new(message).key("SPEC").value(args.spec.display()).allowed(allowed)
    };
    if args.spec.exists() && !args.force {
        return Err(refused("this file is there already", "another name, or --force").into());
    }
    let folder = args.spec.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if args.spec.file_name().is_none() || !folder.is_dir() {
        return Err(refused("the folder of this file does not exist", "a file such as whisker.toml").into());
    }
    let answers = answers(args)?;
    let (_, [_, _, noise], _, _, goal) = answers;
    if noise > 0.0 && noise < LEAST_NOISE {
        let error = InputError::new("no gauge is so quiet: the noise is in microstrain, not in strain");
        let strain = format!(
            "0, or ≥ {LEAST_NOISE} microstrain; a strain of {noise:e} is {} microstrain",
            noise * 1e6
        );
        return Err(error.key("--gauge").value(noise).allowed(strain).into());
    }
    let text = text(&answers);
    let label = args.spec.display().to_string();
    let read = spec::parse(&label, &text, folder)?;
    let write = |path: &Path, text: &str| std::fs::write(path, text).map_err(|e| Error::io(path, e));
    write(&args.spec, &text)?;
    let beside = args.spec.with_file_name(SCHEMA);
    write(&beside, &schema::text())?;
    let next = match goal {
        "calibrate" => format!("vibrissa calibrate DATA.csv --whisker {label}"),
        goal => format!("vibrissa {goal} {label}"),
    };
    let warnings: String = read.warnings.iter().map(|w| format!("warning: {w}\n")).collect();
    let text = format!("{warnings}wrote {label} and {}\nnext: {next}\n", beside.display());
    let (files, result) =
        (vec![args.spec.clone(), beside], json!({ "next": next, "warnings": read.warnings }));
    Ok(Reply { text, files, result, ..Reply::default() })
}

fn answers(args: &New) -> Result<Answers, Error> {
    let missing = [
        ("--whisker D,d,L_a", args.whisker.is_none()),
        ("--gauge x_ss,l,noise", args.gauge.is_none()),
        ("--clamp NAME", args.clamp.is_none()),
        ("--distances NEAR,FAR", args.distances.is_none()),
        ("--for GOAL", args.goal.is_none()),
    ];
    let asked: Vec<&str> = missing.iter().filter(|(_, missing)| *missing).map(|(flag, _)| *flag).collect();
    if !asked.is_empty() && (args.json || !std::io::stdin().is_terminal()) {
        let message = "the answers are missing, and there is no terminal for the questions";
        return Err(InputError::new(message).key("new").allowed(asked.join(" ")).into());
    }
    Ok((
        numbers("--whisker", &args.whisker, WHISKER_ASKED)?,
        numbers("--gauge", &args.gauge, GAUGE_ASKED)?,
        args.clamp.map_or_else(|| choose("How is the base held?", CLAMPS), Ok)?,
        numbers("--distances", &args.distances, DISTANCES_ASKED)?,
        args.goal.map_or_else(|| choose("What do you want to know?", GOALS), Ok)?,
    ))
}

/// Reads an answer to `question`; repeats it until `read` accepts.
fn asked<T>(question: &str, read: impl Fn(&str) -> Result<T, InputError>) -> Result<T, Error> {
    let failed = |e| Error::io("the terminal", e);
    loop {
        let mut out = std::io::stderr().lock();
        write!(out, "{question}: ").and_then(|()| out.flush()).map_err(failed)?;
        let mut line = String::new();
        if std::io::stdin().lock().read_line(&mut line).map_err(failed)? == 0 {
            return Err(Error::Run("the questions were not answered; nothing was written".to_owned()));
        }
        match read(line.trim()) {
            Ok(value) => return Ok(value),
            Err(e) => super::reply::line(format_args!("{e}")),
        }
    }
}

fn numbers<const N: usize>(flag: &str, said: &Option<String>, question: &str) -> Result<[f64; N], Error> {
    let read = |text: &str| {
        let parts = text.split([',', ' ', ';']).filter(|part| !part.is_empty());
        let values: Option<Vec<f64>> =
            parts.map(|part| part.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        values.and_then(|v| v.try_into().ok()).ok_or_else(|| {
            let message = format!("{N} numbers are needed");
            InputError::new(message).key(flag).value(text).allowed(question)
        })
    };
    match said {
        Some(text) => Ok(read(text)?),
        None => asked(question, read),
    }
}

fn choose(what: &str, all: [(&'static str, &'static str, &'static str); 4]) -> Result<&'static str, Error> {
    let lines: String = all.iter().map(|(word, _, help)| format!("\n  {word:10} {help}")).collect();
    asked(&format!("{what}{lines}\n"), |text| {
        let words = all.map(|(word, ..)| word);
        let none = InputError::new("this is none of the words").key("answer").value(text);
        words.into_iter().find(|word| *word == text).ok_or_else(|| none.allowed(words.join(", ")))
    })
}

fn commented(toml: &str) -> String {
    let (mut section, mut text) = ("", String::new());
    for line in toml.lines() {
        section = line.strip_prefix('[').map_or(section, |name| name.trim_end_matches(']'));
        let key = line.split_once(" = ").and_then(|(key, _)| keys::section(section).key(key));
        text += &match key.map(|key| (key.what, key.unit)) {
            None => format!("{line}\n"),
            Some((what, "")) => format!("{line:44} # {what}\n"),
            Some((what, unit)) => format!("{line:44} # {what}, {unit}\n"),
        };
    }
    text
}

fn text(answers: &Answers) -> String {
    let ([base, tip, length], [place, grid, noise], clamp, [near, far], goal) = answers;
    let angles = if *goal == "optimise" { "4" } else { "{ from = 0.5, to = 10, step = 0.5 }" };
    let head = format!(
        "#:schema ./{SCHEMA}\n# Lengths in mm, angles in degrees, moduli in MPa, strain without unit. `vibrissa help spec` explains every key.\n"
    );
    let spec = format!(
        "\n[whisker]\nD = {base}\nd = {tip}\nL_a = {length}\nhub = 0\n\
         \n[gauge]\nx_ss = {place}\nl = {grid}\nnoise_strain = {noise}e-6\n\
         \n[tap]\na = {{ from = {near}, to = {far}, steps = 10 }}\ntheta = {angles}\n\
         \n# A soft whisker; remove a line to switch its effect off. `vibrissa sweep SPEC --explain` says what each is worth.\n\
         [model]\nshear = true\nextension = true\nsurface = true\nclamp = {clamp:?}\nmaterial = {{ neo-hookean = 3.2 }}\n"
    );
    let mut text = head + &commented(&spec);
    if *goal != "calibrate" {
        text += &commented(
            "\n# How a distance is computed: by the model itself, as a calibrated whisker does it; \"euler-bernoulli\" is the paper's formula.\n\
             [estimate]\ntheory = \"exact\"\n",
        );
    }
    if *goal == "sweep" {
        text += "\n# The best rows first: bias and noise of the distance together.\n[output]\nby = \"total_rms_mm\"\n";
    }
    if *goal == "optimise" {
        let between = |key: &str, ends: [f64; 2]| {
            let [low, high] = ends.map(|x| (x * 1e3).round() / 1e3);
            format!("{key} = [{low}, {high}]")
        };
        let near_to = |key: &str, value: f64| between(key, [0.7 * value, 1.3 * value]);
        // The gauge may move towards the clamp, and outwards halfway to the nearest object, where it still reads every tap.
        let room = near - grid;
        let places = [0.5 * place, (0.5 * room).max(1.5 * place).min(room).max(*place)];
        let (base, tip, place) = (near_to("D", *base), near_to("d", *tip), between("x_ss", places));
        text += &format!(
            "\n# What `vibrissa optimise` may change, each between two bounds; what is not listed stays as it is above.\n[optimise]\n\
             objective = \"distance\"            # the error of the distance, total_rms_mm\n\
             variables = {{ {base}, {tip}, {place}, theta = [0.5, 10] }}\n"
        );
    }
    text
}
