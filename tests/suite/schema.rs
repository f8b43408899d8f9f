//! `vibrissa schema`: the committed file, and the schema against the reader at the ends of every range.

use std::path::Path;

use toml::Value;

use crate::common::program::{Desk, SPEC};
use crate::common::schema::{accepts, difference};
use vibrissa::reference::{keys, schema};
use vibrissa::spec::keys::SECTIONS;
use vibrissa::spec::keys::form::{Form, Range};

const FILE: &str = "sweeps/spec.schema.json";

#[test]
fn the_file_is_what_the_code_says() {
    let written = std::fs::read_to_string(Path::new(crate::common::ROOT).join(FILE)).unwrap_or_default();
    assert!(written == schema::text(), "write it by `cargo run -- schema > {FILE}`");
    assert_eq!(Desk::new(SPEC).run(&["schema"]).exits(0).stdout, written);
}

/// Values at both ends of a form and beside them, and of another kind.
fn probes(form: &Form) -> Vec<Value> {
    let beside = |x: f64| if x == 0.0 { 1e-9 } else { x.abs() * 1e-9 };
    let ends = |range: &Range| -> Vec<f64> {
        range.ends.iter().flat_map(|x| [*x, x - beside(*x), x + beside(*x)]).collect()
    };
    let numbers = |values: Vec<f64>| values.into_iter().map(Value::Float);
    let wrong =
        [Value::Boolean(true), "no such word".into(), Value::Array(vec![]), toml::Table::new().into()];
    let own: Vec<Value> = match form {
        Form::Flag => vec![false.into()],
        Form::Text | Form::Pairs | Form::Matrix(..) | Form::Table(..) | Form::Numbers(_) => vec![1.5.into()],
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
fn schema_and_reader_agree_on_every_key() {
    let (mut refused, mut accepted, mut differences) = (0, 0, Vec::new());
    let inline = vibrissa::spec::keys::INLINE.iter().filter(|s| s.name != "axis");
    for (section, key) in SECTIONS.iter().chain(inline).flat_map(|s| s.keys.iter().map(move |k| (s, k))) {
        // Its file is opened.
        if section.name == "tuples" {
            continue;
        }
        for value in probes(&key.form) {
            let text = keys::with(Some(section), key, Some(value));
            let read = keys::parsed(Some(section), &text);
            differences.extend(difference(&text, read.as_ref().err()));
            *(if read.is_ok() { &mut accepted } else { &mut refused }) += 1;
        }
    }
    assert!(differences.is_empty(), "{} differences\n{}", differences.len(), differences.join("\n"));
    assert!(refused > 400 && accepted > 150, "{refused} refused, {accepted} accepted");
}

#[test]
fn shipped_specs_say_where_their_schema_is_and_are_valid() {
    let root = Path::new(crate::common::ROOT);
    let mut specs = 0;
    for (folder, line) in
        [("sweeps", "#:schema ./spec.schema.json"), ("examples", "#:schema ../sweeps/spec.schema.json")]
    {
        for entry in std::fs::read_dir(root.join(folder)).expect(folder) {
            let path = entry.expect("an entry").path();
            if path.extension().is_none_or(|e| e != "toml") {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("a spec");
            assert_eq!(text.lines().next(), Some(line), "{}", path.display());
            assert_eq!(accepts(&text), Some(true), "{}", path.display());
            specs += 1;
        }
    }
    assert!(specs >= 19, "{specs}");
}

#[test]
fn a_new_spec_is_valid_and_runs() {
    let desk = Desk::new(SPEC);
    let answers = ["--whisker", "10,4,80", "--gauge", "5,2,15", "--clamp", "glued", "--distances", "25,70"];
    for goal in ["tap", "sweep", "optimise", "calibrate"] {
        let file = format!("{goal}.toml");
        let line = [&["new", &file][..], &answers, &["--for", goal]].concat();
        let said = desk.run(&line).exits(0).stdout;
        assert!(said.contains("next: vibrissa "), "{said}");
        let text = std::fs::read_to_string(desk.path(&file)).expect("the spec");
        assert_eq!(accepts(&text), Some(true));
        assert!(
            text.lines()
                .filter(|l| l.contains(" = "))
                .all(|l| l.contains("# ") || l.starts_with(['o', 'v', 'b'])),
            "{text}"
        );
        desk.run(&["sweep", &file, "--plan"]).exits(0);
        let refused = desk.run(&line).exits(2);
        assert!(refused.stderr.contains("--force"), "{}", refused.stderr);
    }
    desk.run(&["tap", "tap.toml"]).exits(0);
    let schema = std::fs::read_to_string(desk.path("spec.schema.json")).expect("the schema");
    assert!(schema == schema::text());
}

#[test]
fn a_new_spec_has_a_page() {
    let desk = Desk::new(SPEC);
    let answers = ["--whisker", "10,4,80", "--gauge", "5,2,15", "--distances", "25,70"];
    for (clamp, goal) in
        [("rigid", "sweep"), ("bonded", "tap"), ("glued", "optimise"), ("socket", "calibrate")]
    {
        let file = format!("{clamp}.toml");
        desk.run(&[&["new", &file][..], &answers, &["--clamp", clamp, "--for", goal]].concat()).exits(0);
        let ran = desk.run(&["explore", &file, "--out", "page.html"]).exits(0);
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
        let answers = ["--whisker", "10,4,80", "--gauge", gauge, "--clamp", "rigid", "--distances", "25,70"];
        desk.run(&[&["new", "s.toml", "--force"][..], &answers, &["--for", "optimise"]].concat()).exits(0);
        let text = desk.read("s.toml");
        assert!(text.contains(places), "{text}");
        desk.run(&["optimise", "s.toml", "--plan"]).exits(0);
    }
}

#[test]
fn a_noise_that_was_meant_in_strain_is_refused() {
    let desk = Desk::new(SPEC);
    let new = |gauge: &str| {
        let answers = ["--whisker", "10,4,80", "--gauge", gauge, "--clamp", "rigid", "--distances", "25,70"];
        desk.run(&[&["new", "x.toml", "--json"][..], &answers, &["--for", "tap"]].concat())
    };
    for gauge in ["5,2,15e-6", "5,2,0.000002"] {
        let error = new(gauge).exits(2).json()["error"].clone();
        assert_eq!(error["key"], "--gauge", "{error}");
        assert!(error["allowed"].as_str().unwrap().contains("microstrain"), "{error}");
        assert!(!desk.path("x.toml").exists());
    }
    new("5,2,0").exits(0);
}

#[test]
fn answers_that_are_no_whisker_write_nothing() {
    let desk = Desk::new(SPEC);
    let line = |whisker: &str| {
        let all = [
            "new",
            "x.toml",
            "--whisker",
            whisker,
            "--gauge",
            "5,2,15",
            "--clamp",
            "rigid",
            "--distances",
            "25,70",
            "--for",
            "tap",
        ];
        desk.run(&all).exits(2).stderr
    };
    assert!(line("10,4").contains("3 numbers are needed"));
    assert!(line("10,4,-80").contains("> 0 mm"));
    assert!(line("10,4,60").contains("too short"));
    let missing = desk.run(&["new", "x.toml", "--whisker", "10,4,80"]).exits(2).stderr;
    assert!(missing.contains("--gauge x_ss,l,noise") && !missing.contains("--whisker D"), "{missing}");
    assert!(!desk.path("x.toml").exists());
}

#[test]
fn a_result_is_cited_with_its_hash() {
    let desk = Desk::new(SPEC);
    desk.run(&["sweep", "spec.toml", "--out", "found"]).exits(0);
    let told = desk.run(&["cite", "found"]).exits(0).stdout;
    for part in [
        "Vibrissa ",
        "`vibrissa sweep` of spec",
        "@software{vibrissa",
        "nguyen2020whisker",
        "BLAKE3 of its run.json: ",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    std::fs::write(desk.path("found/designs.csv"), "edited").expect("written");
    assert!(desk.run(&["cite", "found", "--force"]).exits(0).stdout.contains("note: "));
    desk.run(&["cite", "nowhere"]).exits(2);
}
