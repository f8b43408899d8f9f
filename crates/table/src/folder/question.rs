//! What a result answers: which command, on which file, with which values.

use std::path::PathBuf;

use serde_json::{Map, Value, json};

use super::hash::hash_numbers;
use crate::run_json;
use crate::scene::{Space, Spec, Study, Tuple};

/// Options that change nothing in a result.
const FREE: [&str; 6] = ["run.out", "run.force", "run.plan", "run.quiet", "run.json", "run.threads"];

/// What a result answers. Command and name are its identity; the values in force may change.
#[derive(Debug, Clone)]
pub struct Question {
    /// The command.
    pub command: &'static str,
    /// Name of the spec or data file, without folder and ending.
    pub name: String,
    /// Values in force, as in `run.json`; null where there is no spec.
    pub in_force: Value,
    /// What else the result depends on: options of the command, data by their hash; null is never the same.
    pub asked: Value,
    /// Files that are read.
    pub inputs: Vec<PathBuf>,
    /// Everything of which the bytes are a function, hashed; a stopped run of the same is gone on with. None of commands that begin anew.
    pub identity: Option<String>,
}

impl Question {
    /// A command without a spec.
    pub fn new(command: &'static str, name: impl Into<String>, asked: Value) -> Self {
        let (name, in_force) = (name.into(), Value::Null);
        Self { command, name, in_force, asked, inputs: Vec::new(), identity: None }
    }

    /// A command on a spec.
    pub fn of_scene(command: &'static str, spec: &Spec, asked: Value) -> Self {
        let mut asked = match asked {
            Value::Object(asked) => asked,
            _ => Map::new(),
        };
        if let Some(digest) = digest(&spec.study) {
            asked.insert("tuples".into(), digest.into());
        }
        if let Some(fit) = &spec.material_fit {
            asked.insert("curve".into(), format!("{:?}", fit.coefficients).into());
        }
        Self {
            in_force: run_json::in_force(spec),
            inputs: spec.inputs.clone(),
            ..Self::new(command, &spec.name, Value::Object(asked))
        }
    }

    /// The values in force on which a result depends, with their keys.
    pub fn lasting(&self) -> Value {
        let entries = self.in_force.as_array().into_iter().flatten();
        let lasting = |e: &&Value| e["key"].as_str().is_some_and(|key| !FREE.contains(&key));
        entries.filter(lasting).map(|e| json!({ "key": e["key"], "value": e["value"] })).collect()
    }

    /// Keys whose values differ from those of an older `run.json`.
    pub(super) fn changed(&self, older: &Value) -> Vec<String> {
        // As it reads from a file.
        let now: Value =
            serde_json::from_str(&json!({ "in_force": self.in_force, "asked": self.asked }).to_string())
                .expect("what was written can be read");
        let (now, then) = (values(&now), values(older));
        let differ = |key: &&String| now.get(*key) != then.get(*key) || now[*key].is_null();
        let gone = then.keys().filter(|key| !now.contains_key(*key));
        now.keys().filter(differ).chain(gone).cloned().collect()
    }
}

/// The hash of listed tuples, and of their rigs where these differ.
fn digest(study: &Study) -> Option<String> {
    let Space::List(listed) = &study.space else { return None };
    let rigs = study.setup.rigs.as_deref();
    let of_rows = listed.iter().filter(|_| rigs.is_some()).map(|t| t.rig as f64);
    let values = rigs.into_iter().flat_map(|rigs| (0..rigs.len()).flat_map(|rig| rigs.values(rig)));
    Some(hash_numbers(listed.iter().flat_map(Tuple::to_array).chain(of_rows).chain(values)))
}

/// The values of a `run.json` by their key.
fn values(run: &Value) -> Map<String, Value> {
    let entries = run["in_force"].as_array().into_iter().flatten();
    let entry = |e: &Value| Some((e["key"].as_str()?.to_owned(), e["value"].clone()));
    let written = entries.filter_map(entry).filter(|(key, _)| !FREE.contains(&key.as_str()));
    written.chain(run["asked"].as_object().cloned().unwrap_or_default()).collect()
}
