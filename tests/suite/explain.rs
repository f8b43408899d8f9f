//! `sweep --explain`: effects of known size, the switches of a model, the output.

use std::path::Path;

use crate::common::program::{Desk, Ran, says};
use serde_json::Value;
use vibrissa::backend::Choice;
use vibrissa::census::effect::Effect;
use vibrissa::census::explain::{Change, Explanation, explain};
use vibrissa::scene::{
    BackendChoice, Contact, Geometry, Material, Model, Precision, RunOptions, Study, TERMS,
};
use vibrissa::spec;

fn study(a: &str, theta: &str) -> Study {
    let text = format!(
        "[whisker]\nD = 10\nd = [4, 10]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}\n"
    );
    spec::parse("t.toml", &text, Path::new("")).expect("valid spec").study
}

fn explained(study: &Study) -> Explanation {
    let options = RunOptions {
        backend: Some(BackendChoice::Cpu),
        precision: Some(Precision::F64),
        ..RunOptions::default()
    };
    let choice = Choice::new(&options).expect("the CPU is there");
    explain(study, &choice).expect("it runs")
}

fn term(key: &str) -> Effect {
    Effect::of_key(key).expect("an effect of its own key")
}

fn change(found: &Explanation, effect: Effect) -> Change {
    let one = found.effects.iter().find(|e| e.effect == effect).expect("every effect is told");
    one.change.unwrap_or_else(|| panic!("{}: {:?}", effect.name(), one.not_compared))
}

#[test]
fn known_effects_have_their_size() {
    let found = explained(&study("[21, 48]", "0.5"));
    assert_eq!((found.taps, found.total), (4, 4));
    // Linear theory: f_T/f − 1 = −S/(a² + S), S = 3 D² (7 + 6ν)/48 = 62.5 mm² at D = 10 and ν = 0.5.
    let shear = change(&found, term("shear"));
    assert!((shear.largest + 100.0 * 62.5 / (441.0 + 62.5)).abs() < 0.05, "{shear:?}");
    assert_eq!((shear.at.1.a, shear.taps, shear.unmatched), (21.0, 4, 0));
    assert!(shear.left.expect("two distances") > 5.0);
    // O(θ²): model §5 has 7e-5 at 1°.
    let rotation = change(&found, Effect::Rotation);
    assert!(rotation.largest.abs() > 1e-4 && rotation.largest.abs() < 0.02, "{rotation:?}");
    // (a + r₀)/a.
    let hub = change(&found, Effect::Hub);
    assert!((hub.largest - 1000.0 / 21.0).abs() < 0.1, "{hub:?}");
    // A tap this small sticks instead of sliding.
    let (friction, stick) = (change(&found, Effect::Coulomb), change(&found, Effect::Stick));
    assert!(stick.largest > 0.1 && (friction.largest - stick.largest).abs() < 1e-5, "{friction:?} {stick:?}");
    assert!(found.all_effects.is_none());
}

#[test]
fn an_effect_that_is_on_is_switched_off() {
    let mut study = study("[21, 48]", "[0.5, 10]");
    study.setup.model.shear = true;
    study.setup.model.extension = true;
    study.setup.model.surface = true;
    study.setup.model.material = Material::NeoHookean(3.2);
    let found = explained(&study);
    let shear = change(&found, term("shear"));
    assert!(shear.largest > 12.0, "leaving it off adds strain: {shear:?}");
    assert!(change(&found, Effect::Side).largest.abs() > 0.5, "the sides of a soft whisker differ");
    assert!(found.all_effects.is_some_and(|c| c.largest.abs() > 10.0));
}

#[test]
fn switches_keep_to_the_rules_of_the_model() {
    let mut s = study("30", "2");
    s.setup.model.extension = true;
    s.setup.model.contact = Contact::Coulomb(0.3);
    let found = explained(&s);
    let told = |found: &Explanation, effect: Effect| {
        found.effects.iter().find(|e| e.effect == effect).expect("told").clone()
    };
    assert_eq!(told(&found, term("extension")).not_compared.as_deref(), Some("friction needs extension"));
    assert_eq!(
        told(&found, term("indentation")).not_compared.as_deref(),
        Some("friction needs indentation = false")
    );
    assert!(told(&found, term("pole_radius")).not_compared.is_none());
    assert_eq!(told(&found, Effect::Coulomb).instead.as_deref(), Some("frictionless"));
    assert_eq!(told(&found, Effect::Stick).instead.as_deref(), Some("stick"));

    let mut s = study("30", "2");
    s.setup.model.geometry = Geometry::Linear;
    let found = explained(&s);
    let friction = told(&found, Effect::Coulomb);
    let both = friction.both_with;
    assert_eq!(both.iter().map(|b| b.effect.name()).collect::<Vec<_>>(), ["finite rotation", "extension"]);
    assert_eq!(told(&found, Effect::Rotation).instead.as_deref(), Some("exact"));
    for e in found.effects.iter().filter(|e| e.not_compared.is_none()) {
        assert!(e.change.is_some(), "{}", e.effect.name());
    }
}

/// Runs `sweep --explain` with more flags; it writes nothing.
fn command(text: &str, flags: &str) -> Ran {
    let desk = Desk::new(text);
    let ran = desk.line(format!("sweep spec.toml {flags}"));
    assert_eq!(desk.names("."), ["spec.toml"]);
    ran
}

const SPEC: &str =
    "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 30]\ntheta = 2\n";

#[test]
fn json_has_numbers_and_names() {
    let reply = command(SPEC, "--explain --json").exits(0).json();
    assert_eq!(
        (&reply["ok"], &reply["out"], &reply["backend"]["precision"]),
        (&Value::Bool(true), &Value::Null, &Value::from("f64"))
    );
    let effects = reply["result"]["effects"].as_array().expect("effects");
    assert_eq!(effects.len(), Effect::all().count() - SHAPE.len());
    for e in effects {
        let compared = e["not_compared"].is_null();
        assert_eq!(e["change"]["largest_percent"].is_number(), compared, "{e}");
        assert_eq!(e["change"]["at"]["theta_deg"].is_number(), compared, "{e}");
        assert!(e["effect"].is_string() && e["key"].is_string());
    }
}

/// Effects listed only for a whisker that has them.
const SHAPE: [&str; 4] = ["root", "rest curvature", "bore or core", "profile"];

#[test]
fn what_a_whisker_is_beyond_a_cone_is_switched_too() {
    let more = "root = { k_theta = 1000 }\nbore = 5\ncurvature = 0.003\nexponent = 1.5\n";
    let text = SPEC.replace("[gauge]", &format!("{more}[gauge]"));
    let reply = command(&text, "--explain --json").json();
    let effects = reply["result"]["effects"].as_array().expect("effects");
    for name in SHAPE {
        let found = effects.iter().find(|e| e["effect"] == name).unwrap_or_else(|| panic!("{name}: {reply}"));
        let change = found["change"]["largest_percent"].as_f64().unwrap_or_else(|| panic!("{found}"));
        assert!(change.abs() > 0.05 && change.abs() < 60.0, "{found}");
    }
    // A hollow whisker is solved against tilted poles; one with a root is not.
    let tilt = |text: &str| {
        let reply = command(text, "--explain --json").json();
        let effects = reply["result"]["effects"].as_array().expect("effects").clone();
        effects.into_iter().find(|e| e["effect"] == "tilt").expect("tilt")["not_compared"].clone()
    };
    assert!(tilt(&SPEC.replace("[gauge]", "bore = 2\n[gauge]")).is_null());
    assert!(tilt(&text).as_str().is_some_and(|why| why.contains("twists") || why.contains("root")));
}

#[test]
fn the_table_names_every_effect() {
    let text = command(SPEC, "--explain").stdout;
    for effect in Effect::all() {
        let told = text.contains(&format!("\n{}  ", effect.name()));
        assert_eq!(told, !SHAPE.contains(&effect.name()), "{}: {text}", effect.name());
    }
    assert!(text.contains("`--plan --model-error E` says") && !text.contains("NaN"), "{text}");
    // `--explain` overrides `plan = true` of the spec.
    says(&command(&format!("{SPEC}[run]\nplan = true\n"), "--explain").stdout, &["finite rotation"]);
}

/// An effect is described once, in `TERMS`: reading, explanation, switching off and verification follow from it.
#[test]
fn an_effect_described_once_is_read_explained_left_off_and_verified() {
    let model = spec::keys::section("model");
    let keys = model.names();
    let example = |key| model.key(key).expect("a key").example;
    let verified = vibrissa::census::cases::all();
    for term in &TERMS {
        assert!(keys.contains(&term.key), "{}", term.key);
        let rest = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = 30\ntheta = 5\n";
        let other = term.needs.map(|(key, _)| TERMS.iter().find(|t| t.key == key).expect("an effect"));
        let needed = other.map_or(String::new(), |t| format!("{} = {}\n", t.key, example(t.key)));
        let text = format!("{rest}[model]\n{} = {}\n{needed}", term.key, example(term.key));
        let spec = spec::parse("t.toml", &text, Path::new("")).expect("a spec");
        assert!((term.get)(&spec.study.setup.model).is_on(), "{text}");
        assert!(!(term.get)(&Model::PLAIN).is_on(), "{}", term.key);
        let here = Effect::of_key(term.key).expect("an effect");
        assert!(Effect::all().any(|e| e == here) && Effect::of_model().any(|e| e == here));
        let there = |t: &str| t == term.key || other.is_some_and(|other| other.key == t);
        let alone = |m: &Model| TERMS.iter().all(|t| (t.get)(m).is_on() == there(t.key));
        assert!(verified.iter().any(|c| alone(&c.setup.model)), "{} is not verified alone", term.key);
    }
}
