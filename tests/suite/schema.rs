//! `vibrissa schema`: the committed file, and the reader at the ends of every range; `tests/schema` compares both. `vibrissa new` and `cite`.

use std::path::Path;

use toml::Value;

use crate::common::keys;
use crate::common::program::{Desk, SPEC};
use crate::common::schema::keep;
use vibrissa::reference::schema;
use vibrissa::scene::Interval;
use vibrissa::spec::keys::Form;
use vibrissa::spec::keys::{inline, sections};

const FILE: &str = "sweeps/spec.schema.json";

#[test]
fn the_file_is_what_the_code_says() {
    let written = std::fs::read_to_string(Path::new(crate::common::ROOT).join(FILE)).unwrap_or_default();
    assert!(written == schema::text(), "write it by `cargo run -- schema > {FILE}`");
    assert_eq!(Desk::new(SPEC).ok("schema").stdout, written);
}

/// Values at and next to both ends of a form, and values of another type.
fn probes(form: &Form) -> Vec<Value> {
    let beside = |x: f64| if x == 0.0 { 1e-9 } else { x.abs() * 1e-9 };
    let ends = |range: &Interval| -> Vec<f64> {
        range.ends.iter().flat_map(|x| [*x, x - beside(*x), x + beside(*x)]).collect()
    };
    let numbers = |values: Vec<f64>| values.into_iter().map(Value::Float);
    let wrong =
        [Value::Boolean(true), "no such word".into(), Value::Array(vec![]), toml::Table::new().into()];
    let own: Vec<Value> = match form {
        Form::Flag => vec![false.into()],
        Form::Text
        | Form::Pairs
        | Form::Matrix(..)
        | Form::Table(..)
        | Form::Tables(_)
        | Form::Numbers(_) => {
            vec![1.5.into()]
        }
        Form::Whole(min, max) => {
            let (min, max) = (*min as i64, *max as i64);
            let over = max.checked_add(1);
            [Some(min), Some(min - 1), Some(max), over]
                .into_iter()
                .flatten()
                .map(Value::Integer)
                .chain([Value::Float(2.5)])
                .collect()
        }
        Form::Number(range) => numbers(ends(range)).collect(),
        Form::Axis(range) => {
            let list = |x: f64| Value::Array(vec![x.into()]);
            numbers(ends(range)).chain(ends(range).into_iter().map(list)).collect()
        }
        Form::Ends(range) => {
            let middle = 0.5 * (range.ends[0] + range.ends[1].min(range.ends[0] + 2.0));
            let low = numbers(ends(range)[..3].to_vec());
            low.map(|x| Value::Array(vec![x, middle.into()])).chain([1.5.into()]).collect()
        }
        Form::Several(words) => {
            let list = |n: usize| Value::Array(words.iter().take(n).map(|word| (*word).into()).collect());
            let twice = Value::Array(vec![words[0].into(), words[0].into()]);
            vec![list(1), list(2), list(words.len()), twice]
        }
        Form::Words(words) => words.iter().map(|word| (*word).into()).collect(),
        Form::Any(forms) => forms.iter().flat_map(probes).collect(),
    };
    own.into_iter().chain(wrong).collect()
}

#[test]
fn every_key_is_read_at_its_ends_and_beside_them() {
    let (mut refused, mut accepted) = (0, 0);
    let inline = inline().filter(|s| s.name != "axis");
    for (section, key) in sections().chain(inline).flat_map(|s| s.keys.iter().map(move |k| (s, k))) {
        // `tuples.file` would be opened.
        if section.name == "tuples" {
            continue;
        }
        for value in probes(&key.form) {
            let text = keys::with(section, key, Some(value));
            let read = keys::parsed(section, &text);
            keep(&text, read.as_ref().err());
            *(if read.is_ok() { &mut accepted } else { &mut refused }) += 1;
        }
    }
    assert!(refused > 400 && accepted > 150, "{refused} refused, {accepted} accepted");
}

fn asked(file: &str, gauge: &str, clamp: &str, goal: &str) -> String {
    format!("new {file} --whisker 10,4,80 --gauge {gauge} --clamp {clamp} --distances 25,70 --for {goal}")
}

#[test]
fn a_new_spec_is_valid_and_runs() {
    let desk = Desk::new(SPEC);
    for goal in ["tap", "sweep", "optimise", "calibrate"] {
        let file = format!("{goal}.toml");
        let line = asked(&file, "5,2,15", "glued", goal);
        let said = desk.ok(&line).stdout;
        assert!(said.contains("next: vibrissa "), "{said}");
        let text = desk.read(&file);
        keep(&text, None);
        let told = |l: &str| l.contains("# ") || l.starts_with(['o', 'v', 'b']);
        assert!(text.lines().filter(|l| l.contains(" = ")).all(told), "{text}");
        desk.ok(format!("sweep {file} --plan"));
        desk.refuses(&line, &["--force"]);
    }
    desk.ok("tap tap.toml");
    desk.ok(asked("x.toml", "5,2,0", "rigid", "tap"));
    assert!(desk.read("spec.schema.json") == schema::text());
}

#[test]
fn a_new_spec_has_a_page() {
    let desk = Desk::new(SPEC);
    // A blunt tip and near contacts need a tenth of the taps.
    let blunt = |line: String| line.replace("10,4,80", "10,7,80").replace("25,70", "25,30");
    for (clamp, goal) in
        [("rigid", "sweep"), ("bonded", "tap"), ("glued", "optimise"), ("socket", "calibrate")]
    {
        let line = asked(&format!("{clamp}.toml"), "5,2,15", clamp, goal);
        desk.ok(if clamp == "glued" { line } else { blunt(line) });
        let ran = desk.ok(format!("explore {clamp}.toml --out page.html"));
        let exact = ran.stderr.contains("tells distances by a formula, here euler-bernoulli");
        assert_eq!(exact, goal != "calibrate", "{clamp}: {}", ran.stderr);
    }
}

#[test]
fn a_new_search_moves_the_gauge_too() {
    let desk = Desk::new(SPEC);
    for (gauge, places) in
        [("5,2,15", "x_ss = [2.5, 11.5]"), ("0,2,15", "x_ss = [0, 11.5]"), ("20,2,15", "x_ss = [10, 23]")]
    {
        desk.ok(asked("s.toml", gauge, "rigid", "optimise") + " --force");
        let text = desk.read("s.toml");
        assert!(text.contains(places), "{text}");
        desk.ok("optimise s.toml --plan");
    }
}

#[test]
fn a_result_is_cited_with_its_hash() {
    let desk = Desk::new(SPEC);
    desk.ok("sweep spec.toml --out found");
    let told = desk.ok("cite found").stdout;
    let parts =
        "Vibrissa |`vibrissa sweep` of spec|@software{vibrissa|nguyen2020whisker|BLAKE3 of its run.json: ";
    assert!(parts.split('|').all(|part| told.contains(part)), "{told}");
    std::fs::write(desk.path("found/designs.csv"), "edited").expect("written");
    assert!(desk.ok("cite found --force").stdout.contains("note: "));
}
