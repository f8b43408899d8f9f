//! `vibrissa cluster slurm SPEC --shards N`.

use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde_json::{Value, json};

use super::{Asked, Common, Context, Reply, folder, grouped, listed, rough, whole};
use crate::backend::Choice;
use crate::error::{Error, InputError};
use crate::plan::Plan;
use crate::scene::{BackendChoice, RunOptions};
use crate::sink::{Question, Shard, run_json};
use crate::spec;

const SCRIPTS: [(&str, &str); 3] = [
    ("part.sbatch", include_str!("slurm/part.sbatch")),
    ("merge.sbatch", include_str!("slurm/merge.sbatch")),
    ("submit.sh", include_str!("slurm/submit.sh")),
];
const TRIES: u32 = 20;
/// Slurm's default limit of an array.
const ARRAY: u32 = 1000;

/// Jobs for a cluster.
#[derive(Debug, Flags)]
#[command(after_help = "Example: vibrissa cluster slurm sweeps/million.toml --shards 64")]
pub struct ClusterRequest {
    /// Which batch system
    #[arg(value_parser = ["slurm"])]
    pub system: String,
    /// The spec of the sweep
    pub spec: PathBuf,
    /// Number of parts; each is a task of the array
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000))]
    pub shards: u32,
    /// Most tasks that run at the same time [default: no limit]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=u64::MAX))]
    pub at_a_time: Option<u32>,
}

pub fn run(asked: &Asked<ClusterRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let mut spec = context.read(&asked.spec, "spec", spec::parse)?;
    context.prepared(&asked.common, Some(&mut spec))?;
    if spec.run.model_error.is_some() {
        crate::sweep::whole(Some(Shard { index: 1, of: asked.shards }), &spec.study)?;
    }
    // Nothing is computed here; the scripts leave the machine open.
    let choice = Choice::new(&RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() })?;
    let plan = Plan::new(&spec.study, &choice)?;
    let out = folder(asked.common.out.as_ref(), &spec.name, "cluster");
    if u64::from(asked.shards) > plan.designs {
        let (idle, parts) = (u64::from(asked.shards) - plan.designs, asked.shards);
        context.warn(&format!("{idle} of {parts} parts will have no design"));
    }
    if asked.shards > ARRAY {
        context.warn(&format!("arrays of more than {ARRAY} tasks need a larger MaxArraySize of the cluster"));
    }
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| Error::io(path, e));
    let here = absolute(Path::new("."))?;
    let whole = absolute(&folder(spec.run.out.as_ref(), &spec.name, "sweep"))?;
    let program = std::env::current_exe().map_err(|e| Error::io("vibrissa", e))?;
    let at_a_time = asked.at_a_time.map_or(String::new(), |n| format!("%{n}"));
    let Common { backend, adapter, precision, tolerance, .. } = &asked.common;
    let mut options = format!(" --out {}", quoted(&whole)?);
    let mut option = |flag: &str, value: Option<String>| {
        value.into_iter().for_each(|x| options += &format!(" --{flag} {x}"))
    };
    option("backend", backend.map(|b| b.word().to_owned()));
    option("adapter", adapter.as_deref().map(|a| quoted(Path::new(a))).transpose()?);
    option("precision", precision.map(|p| p.word().to_owned()));
    option("tolerance", tolerance.map(|t| format!("{t:e}")));
    let unsafe_in_names = |c: char| !(c.is_ascii_alphanumeric() || "._-".contains(c));
    let fill = [
        ("@SHARDS@", asked.shards.to_string()),
        ("@AT_A_TIME@", at_a_time),
        ("@NAME@", spec.name.replace(unsafe_in_names, "_")),
        ("@FOLDER@", quoted(&here)?),
        ("@SPEC@", quoted(&absolute(&asked.spec)?)?),
        ("@OUT@", quoted(&whole)?),
        ("@PROGRAM@", quoted(&program)?),
        ("@OPTIONS@", options),
        ("@TRIES@", TRIES.to_string()),
    ];
    let of = json!({ "system": asked.system, "shards": asked.shards, "at_a_time": asked.at_a_time });
    let question =
        Question { inputs: spec.inputs.clone(), ..Question::new("cluster", &spec.name, of.clone()) };
    let [taps, designs, parts] = [plan.taps, plan.designs, asked.shards.into()].map(grouped);
    let each = rough(plan.taps as f64 / f64::from(asked.shards));
    let parts = format!("{taps} taps of {designs} designs in {parts} parts, about {each} taps each");
    if asked.common.plan {
        return Ok(Reply::planned(out, |to| format!("{parts}\njob scripts would go to {to}")));
    }
    let submit = out.join("submit.sh");
    let bash = quoted(&submit)?;
    let names = SCRIPTS.map(|(name, _)| name);
    let mut destination = context.open(&out, question, &names, Some(asked.common.force))?;
    for (name, template) in SCRIPTS {
        destination.put(name, filled(template, &fill).into_bytes())?;
    }
    let body = json!({ "in_force": Value::Null, "cluster": of });
    let result = json!({ "submit": submit.display().to_string(), "merged": whole.display().to_string() });
    let reply = Reply { result, seconds: json!({ "total": 0.0 }), ..Reply::default() };
    let reply = reply.filed(destination, run_json::spec(&spec), body)?;
    let wrote = listed(&reply.files);
    let text = format!(
        "{parts}\nwrote {wrote}\nlook at time, memory and partition in part.sbatch, then: bash {bash}\n"
    );
    Ok(Reply { text, ..reply })
}

/// Replaces each mark in `template` by its value, in one pass: a mark inside a value is kept.
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

/// Quotes a path as one word of a shell.
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
