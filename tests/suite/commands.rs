//! Commands that are refused, each soon, with the reason and without output files: the table tests/data/refused_commands.txt.

use std::sync::LazyLock;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::Value;

use crate::common::program::{Desk, Kept, Ran, SPEC};
use crate::common::{ROOT, world};

fn desk(name: &str) -> Desk {
    static SMALL: LazyLock<Kept> = LazyLock::new(|| Desk::new(SPEC).keep());
    match name {
        "spec" => SMALL.desk(),
        "calibrated" => world::calibrated(),
        "contour" => crate::contour::desk(),
        "objects" => crate::objects::desk(),
        "swept" => crate::report::swept(),
        other => panic!("no desk {other}"),
    }
}

/// `/` in the table stands for a line break.
fn lines(text: &str) -> String {
    text.replace(" / ", "\n").replace("/ ", "\n")
}

/// True if `ran`, the same command with --json, gives in fields what stderr `said`; commands without --json pass.
fn in_fields(ran: &Ran, said: &str) -> bool {
    let Ok(object) = serde_json::from_str::<Value>(&ran.stdout) else { return false };
    let error = &object["error"];
    if error["key"] == "--json" {
        return true;
    }
    let keys = error
        .as_object()
        .is_some_and(|of| of.keys().eq(["file", "line", "key", "value", "allowed", "message"]));
    let shown = |field: &str| error[field].as_str().is_none_or(|text| said.contains(text));
    ran.code == 2
        && object["ok"] == false
        && keys
        && shown("key")
        && shown("file")
        && error["message"].is_string()
}

/// Carries out the row's steps and its command; returns the fault.
fn fault(name: &str, row: &str) -> Option<String> {
    let desk = desk(name);
    let (steps, words) = row.split_once(" | ").unwrap_or((row.trim_end_matches(" |"), ""));
    let (before, line) = steps.rsplit_once(" ; ").unwrap_or(("", steps));
    let mut input = None;
    for step in before.split(" ; ").filter(|step| !step.is_empty()) {
        let (file, text) = step.split_once(": ").unwrap_or_else(|| panic!("no text: {step}"));
        match file.split_once(" < ") {
            Some((to, from)) => {
                let (old, new) = text.split_once(" => ").unwrap_or_else(|| panic!("no change: {step}"));
                let (old, new, whole) = (lines(old), lines(new), desk.read(from));
                assert!(whole.contains(&old), "no `{old}` in {from}: {row}");
                desk.write(to, whole.replacen(&old, &new, 1));
            }
            None => {
                let text = if text.is_empty() { String::new() } else { lines(text) + "\n" };
                match file {
                    "stdin" => input = Some(text),
                    _ => desk.write(file, text),
                }
            }
        }
    }
    let there = desk.names(".");
    let words_of_line: Vec<&str> = line.split_whitespace().map(|word| word.trim_matches('\'')).collect();
    let begun = Instant::now();
    let ran = match &input {
        Some(input) => desk.pipe(&words_of_line, input),
        None => desk.run(&words_of_line),
    };
    let said = &ran.stderr;
    let in_one_line = said.replace("\n  │ ", " ");
    let missing =
        words.split(" | ").find(|word| !said.contains(word.trim()) && !in_one_line.contains(word.trim()));
    // Words of the libraries that parse numbers and files must not reach the user.
    let foreign = ["literal", "invalid digit", "parse float", "usize", "panicked"];
    let foreign = foreign.iter().find(|word| said.contains(**word));
    let told = input.is_some() || in_fields(&desk.run(&[&words_of_line[..], &["--json"]].concat()), said);
    let fine = ran.code == 2 && missing.is_none() && foreign.is_none() && !said.is_empty();
    let soon = begun.elapsed().as_secs() < 100;
    // A stream may have answered lines before the error.
    let silent = (input.is_some() || ran.stdout.lines().count() < 2) && desk.names(".") == there;
    (!told || !fine || !silent || !soon).then(|| {
        let (code, files, stdout) = (ran.code, desk.names("."), ran.stdout);
        format!(
            "{name}: {row}\n    exit {code}, {missing:?} missing, {foreign:?}, told in JSON {told}, {files:?}: {said}{stdout}"
        )
    })
}

#[test]
fn every_refused_command_says_why_and_leaves_nothing() {
    let table =
        std::fs::read_to_string(format!("{ROOT}/tests/data/refused_commands.txt")).expect("the table");
    let (mut name, mut first, mut rows) = ("", String::new(), Vec::new());
    for line in table.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Some(head) = line.strip_prefix("== ") {
            (name, first) = (head.split(':').next().expect("a name"), String::new());
        } else if let Some(step) = line.strip_prefix('>') {
            first = if step.is_empty() { String::new() } else { format!("{} ; ", step.trim_start()) };
        } else {
            rows.push((name, format!("{first}{line}")));
        }
    }
    let faults: Vec<String> = rows.par_iter().filter_map(|(name, row)| fault(name, row)).collect();
    assert!(
        faults.is_empty() && rows.len() > 180,
        "{} of {}\n{}",
        faults.len(),
        rows.len(),
        faults.join("\n")
    );
}
