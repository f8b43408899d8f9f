//! The configurations that are verified without a spec, as specs (`configurations.toml`): each effect alone, the eight of model §5, and others of
//! their kind.

use std::path::Path;
use std::sync::LazyLock;

use toml::{Table, Value};

use crate::scene::{Model, Setup, TERMS};
use crate::spec;

/// r₀ of the configurations with a hub, mm. Their random whiskers are scaled so that it is 0.03 to 3 distances.
pub const HUB: f64 = 10.0;

/// Those of a quick run: the closed forms, the plain rod, rubber with every effect and a contact that sticks, a hub, an object that moves, poles that are not upright.
pub const QUICK: [&str; 7] =
    ["linear", "hooke", "stick", "hooke-hub", "hooke-passive", "hooke-tilted", "cored"];

/// A whisker on a rig, and its model.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    pub name: &'static str,
    /// What its taps share.
    pub setup: Setup,
}

static WRITTEN: LazyLock<Table> =
    LazyLock::new(|| include_str!("configurations.toml").parse().expect("configurations.toml is TOML"));

const PLAIN: &str = "whisker = { D = 10, d = 4, L_a = 50 }\ngauge = { x_ss = 5, l = 2 }\ntap.a = 33";

/// All, in the order of the census: those written, and every effect that a key switches by itself and none of them has alone.
pub fn all() -> Vec<Configuration> {
    let only = |key: &str, m: &Model| TERMS.iter().all(|t| (t.get)(m).is_on() == (t.key == key));
    let written = WRITTEN.keys().map(|name| Configuration { name, setup: setup(name) });
    let mut all: Vec<Configuration> = written.collect();
    for key in TERMS.map(|term| term.key) {
        if !all.iter().any(|c| only(key, &c.setup.model)) {
            let setup = Setup { model: Model::PLAIN.with(key), ..Setup::default() };
            all.push(Configuration { name: key, setup });
        }
    }
    all
}

fn setup(name: &str) -> Setup {
    let mut spec = keys(name);
    let tap = spec["tap"].as_table_mut().expect("a table");
    if !tap.contains_key("delta") {
        tap.insert("theta".into(), 4.into());
    }
    spec::parse(name, &spec.to_string(), Path::new("")).expect("configurations.toml has specs").study.setup
}

/// The keys of the configuration `name`, with those of the one that it is like.
fn keys(name: &str) -> Table {
    let mut own = WRITTEN[name].as_table().expect("a table").clone();
    let mut all = match own.remove("like") {
        Some(like) => keys(like.as_str().expect("a name")),
        None => PLAIN.parse().expect("TOML"),
    };
    add(&mut all, own);
    all
}

fn add(to: &mut Table, more: Table) {
    for (key, value) in more {
        match (to.get_mut(&key), value) {
            // One law of the material replaces another.
            (Some(Value::Table(to)), Value::Table(more)) if key != "material" => add(to, more),
            (_, value) => drop(to.insert(key, value)),
        }
    }
}
