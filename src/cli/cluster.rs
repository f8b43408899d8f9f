//! `vibrissa cluster slurm SPEC --shards N`.

use std::path::Path;

use serde_json::{Value, json};
use vibrissa::backend::Choice;
use vibrissa::error::{Error, InputError};
use vibrissa::plan::Plan;
use vibrissa::scene::{BackendChoice, Precision, RunOptions};
use vibrissa::sink::folder::{Folder, Question, Written};
use vibrissa::sink::run_json;
use vibrissa::sink::shard::Shard;
use vibrissa::spec;

use super::args::Cluster;
use super::reply::{self, Reply};
use super::say::{grouped, rough};
use super::{listed, say};

/// The scripts, as they are in `src/cli/slurm`.
const SCRIPTS: [(&str, &str); 3] = [
    ("part.sbatch", include_str!("slurm/part.sbatch")),
    ("merge.sbatch", include_str!("slurm/merge.sbatch")),
    ("submit.sh", include_str!("slurm/submit.sh")),
];
/// Times that a part is sent again by itself.
const TRIES: u32 = 20;
/// Slurm's own limit of an array where its administrator has set none.
const ARRAY: u32 = 1000;

/// Writes the scripts, filled in.
pub fn run(args: &Cluster) -> Result<Reply, Error> {
    let spec = spec::read(&args.spec)?;
    let options = args.common.over(&spec.run);
    reply::in_json(options.json == Some(true));
    if spec::model_error(&spec)?.is_some() {
        vibrissa::sweep::whole(Some(Shard { index: 1, of: args.shards }), &spec.study)?;
    }
    // What is computed here is nothing; on which machine, the scripts leave open.
    let choice = Choice::new(&RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() })?;
    let plan = Plan::new(&spec.study, &choice)?;
    let out = super::folder(args.common.out.as_ref(), &spec.name, "cluster");
    if u64::from(args.shards) > plan.designs {
        let (idle, parts) = (u64::from(args.shards) - plan.designs, args.shards);
        say::warning(format_args!("{idle} of {parts} parts will have no design"));
    }
    if args.shards > ARRAY {
        say::warning(format_args!(
            "arrays of more than {ARRAY} tasks need a larger MaxArraySize of the cluster"
        ));
    }
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| Error::io(path, e));
    let here = absolute(Path::new("."))?;
    let whole = absolute(&super::folder(spec.run.out.as_ref(), &spec.name, "sweep"))?;
    let program = std::env::current_exe().map_err(|e| Error::io("vibrissa", e))?;
    let at_a_time = args.at_a_time.map_or(String::new(), |n| format!("%{n}"));
    let fill = [
        ("@SHARDS@", args.shards.to_string()),
        ("@AT_A_TIME@", at_a_time),
        ("@NAME@", plain(&spec.name)),
        ("@FOLDER@", quoted(&here)?),
        ("@SPEC@", quoted(&absolute(&args.spec)?)?),
        ("@OUT@", quoted(&whole)?),
        ("@PROGRAM@", quoted(&program)?),
        ("@OPTIONS@", flags(&args.common, &whole)?),
        ("@TRIES@", TRIES.to_string()),
    ];
    let asked = json!({ "system": args.system, "shards": args.shards, "at_a_time": args.at_a_time });
    let question =
        Question { inputs: spec.inputs.clone(), ..Question::new("cluster", &spec.name, asked.clone()) };
    let names: Vec<&str> = SCRIPTS.iter().map(|(name, _)| *name).collect();
    let mut folder = Folder::open(&out, question, &names, args.common.force)?;
    for (name, template) in SCRIPTS {
        folder.put(name, filled(template, &fill).as_bytes())?;
    }
    let body = json!({ "in_force": Value::Null, "seconds": { "total": 0.0 }, "cluster": asked });
    folder.run_json(&run_json::document("cluster", run_json::spec(&spec), body))?;
    let Written { files, removed, .. } = folder.finish()?;
    let [taps, designs, parts] = [plan.taps, plan.designs, args.shards.into()].map(grouped);
    let (each, wrote) = (rough(plan.taps as f64 / f64::from(args.shards)), listed(&files));
    let submit = out.join("submit.sh");
    let bash = quoted(&submit)?;
    let text = format!(
        "{taps} taps of {designs} designs in {parts} parts, about {each} taps each\nwrote {wrote}\nlook at time, memory and partition in part.sbatch, then: bash {bash}\n"
    );
    let result = json!({ "submit": submit.display().to_string(), "merged": whole.display().to_string() });
    Ok(Reply { text, out: Some(out), files, result, quiet: options.quiet == Some(true), ..Reply::default() }
        .removing(&removed))
}

/// The options of every part as they are typed; where results go is said by `whole`.
fn flags(common: &super::args::Common, whole: &Path) -> Result<String, Error> {
    let mut text = format!(" --out {}", quoted(whole)?);
    let word =
        |flag: &str, value: Option<String>| value.map_or(String::new(), |value| format!(" --{flag} {value}"));
    text += &word("backend", common.backend.and_then(|b| name(&BackendChoice::WORDS, b)));
    text += &word("adapter", common.adapter.as_deref().map(|a| quoted(Path::new(a))).transpose()?);
    text += &word("precision", common.precision.and_then(|p| name(&Precision::WORDS, p)));
    text += &word("tolerance", common.tolerance.map(|t| format!("{t:e}")));
    Ok(text)
}

/// The one of `words` that says `of`.
fn name<T: PartialEq>(words: &[(&str, T, &str)], of: T) -> Option<String> {
    words.iter().find(|(_, choice, _)| *choice == of).map(|(name, ..)| (*name).to_owned())
}

/// `template` with each mark replaced by its value, in one pass: what stands in a value is no mark.
fn filled(template: &str, marks: &[(&str, String)]) -> String {
    let (mut text, mut rest) = (String::new(), template);
    while let Some(at) = rest.find('@') {
        text += &rest[..at];
        rest = &rest[at..];
        let found = marks.iter().find(|(mark, _)| rest.starts_with(mark));
        let (mark, value) = found.map_or(("@", "@"), |(mark, value)| (*mark, value.as_str()));
        text += value;
        rest = &rest[mark.len()..];
    }
    text + rest
}

/// A path as one word of a shell.
fn quoted(path: &Path) -> Result<String, Error> {
    let unusable = || {
        let error = InputError::new("a job script cannot name this path");
        error.value(path.display()).allowed("paths of UTF-8")
    };
    let text = path.to_str().ok_or_else(unusable)?;
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    Ok(if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    })
}

/// A name without what a scheduler's directive does not bear.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' }).collect()
}
