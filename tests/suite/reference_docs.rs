//! The reference agrees with the code: keys, defaults, allowed values, columns, status words; and its output.

use std::collections::BTreeSet;
use std::path::Path;

use toml::Value;

use crate::common::keys;
use crate::common::program::{Desk, SPEC};
use vibrissa::census::compare::{FAULTS, QUANTITIES};
use vibrissa::reference::Topic;
use vibrissa::sink::heading::{Fact, Only};
use vibrissa::sink::heading::{HEADINGS, heading};
use vibrissa::spec::keys::{Key, Section, inline, section, sections};
use vibrissa::status::Status;

fn all() -> Vec<(&'static Section, &'static Key)> {
    let all = std::iter::once(section("")).chain(sections()).chain(inline());
    all.flat_map(|s| s.keys.iter().map(move |k| (s, k))).collect()
}

fn dotted(section: &Section, key: &Key) -> String {
    format!("{}.{}", section.name, key.name)
}

fn value(text: &str) -> Value {
    format!("x = {text}").parse::<toml::Table>().unwrap_or_else(|e| panic!("{text}: {e}"))["x"].clone()
}

/// The example of this key names a file that does not exist.
const FILE_KEY: &str = "tuples.file";

#[test]
fn every_example_is_read() {
    let read = |section, key, example: &str| {
        let read = keys::parsed(section, &keys::with(section, key, Some(value(example))));
        assert!(read.is_ok(), "{} = {example}: {}", dotted(section, key), read.unwrap_err());
    };
    for (section, key) in all() {
        if !key.example.is_empty() && dotted(section, key) != FILE_KEY {
            read(section, key, key.example);
        }
    }
    for table in inline() {
        let (outer, inner) = table.name.split_once('.').unwrap_or(("whisker", "D"));
        let key = section(outer).key(inner).unwrap_or_else(|| panic!("no key {}", table.name));
        table.examples.iter().for_each(|example| read(section(outer), key, example));
    }
}

#[test]
fn every_key_says_what_it_is_and_what_is_allowed() {
    for (section, key) in all() {
        assert!(!key.allowed().is_empty(), "{}: nothing is allowed", dotted(section, key));
        assert!(!key.what.is_empty(), "{}", dotted(section, key));
    }
}

/// These tables have their own list of keys; the reader checks other inline tables with the list of the reference.
#[test]
fn tables_with_a_list_of_their_own_have_the_same_keys() {
    let unknown = Key { name: "no_such_key", ..Key::default() };
    for table in ["optimise.variables", "optimise.robust"].map(section) {
        let refused = keys::parsed(table, &keys::with(table, &unknown, Some(1.into()))).unwrap_err();
        let allowed = refused.allowed.unwrap_or_default();
        let own: Vec<&str> = table.names().into_iter().filter(|name| *name != "delta").collect();
        assert_eq!(allowed, own.join(", "), "{}", table.name);
        for key in &table.keys {
            let error = keys::parsed(table, &keys::with(table, key, Some(true.into()))).unwrap_err();
            assert!(!error.message.contains("unknown"), "{error}");
        }
    }
}

#[test]
fn keys_that_are_required_are_those_that_are_missed() {
    let (mut required, mut free) = (0, 0);
    for section in sections() {
        for key in &section.keys {
            let name = dotted(section, key);
            let read = keys::parsed(section, &keys::with(section, key, None));
            if key.if_absent().starts_with("required") || name == FILE_KEY {
                let error = read.expect_err(&name);
                assert!(error.message.contains("missing"), "{name}: {error}");
                required += 1;
            } else {
                // Without `tap.drive`, the spec's displacement is refused.
                assert!(read.is_ok() || name == "tap.drive", "{name}: {}", read.unwrap_err());
                free += 1;
            }
        }
    }
    assert!(required >= 9 && free >= 40, "{required} {free}");
}

fn asked(section: &Section, text: &str) -> String {
    let read = keys::parsed(section, text);
    let (study, search) = read.unwrap_or_else(|e| panic!("{e} in\n{text}"));
    format!("{study:?}{search:?}")
}

#[test]
fn a_default_that_is_written_out_changes_nothing() {
    let mut judged = 0;
    for (section, key) in all() {
        let (name, default) = (dotted(section, key), key.if_absent());
        let Ok(parsed) = format!("x = {}", default.trim_matches('`')).parse::<toml::Table>() else {
            continue;
        };
        // Writing these defaults has an effect; [run] is not part of the study; `tap.drive` would need another key.
        if ["gauge.noise_strain", "output.by", "output.tuples", "tap.drive", "tap.tilt", "tap.lean"]
            .contains(&&*name)
            || name.starts_with("run.")
        {
            continue;
        }
        let [written, left] =
            [Some(parsed["x"].clone()), None].map(|v| asked(section, &keys::with(section, key, v)));
        assert_eq!(written, left, "{name} = {default}");
        judged += 1;
    }
    assert!(judged >= 35, "{judged}");
}

/// Fails unless the reference has the columns of a table, in their order.
#[track_caller]
fn described(command: &str, file: &str, header: &[&str]) {
    let table = HEADINGS.iter().find(|t| t.command == command && t.file == file);
    let table = table.unwrap_or_else(|| panic!("the reference does not know {file} of {command}"));
    let is = |told: &str, name: &str| told.split('|').any(|n| n == name);
    let asked = |c: &&&Fact| c.only == Only::Always || header.iter().any(|name| is(&c.name, name));
    let told: Vec<&str> = table.columns.iter().filter(asked).map(|c| c.name.as_str()).collect();
    let missing: Vec<_> = header.iter().filter(|name| !told.iter().any(|t| is(t, name))).collect();
    let gone: Vec<_> = told.iter().filter(|t| !header.iter().any(|name| is(t, name))).collect();
    assert!(
        missing.is_empty(),
        "columns of {file} ({command}) that the reference does not have: {missing:?}"
    );
    assert!(gone.is_empty(), "columns of the reference that {file} ({command}) does not have: {gone:?}");
    let same = header.len() == told.len() && told.iter().zip(header).all(|(t, name)| is(t, name));
    assert!(same, "the reference has the columns of {file} ({command}) in another order: {told:?}");
    assert!(table.columns.iter().all(|c| !c.meaning.is_empty()), "a column of {file} has no meaning");
}

/// Fails unless the reference describes every table in `folder`.
#[track_caller]
fn described_all(desk: &Desk, command: &str, folder: &str) {
    let files: Vec<String> = desk.names(folder).into_iter().filter(|n| n.ends_with(".csv")).collect();
    assert!(!files.is_empty(), "{folder} has no table");
    for file in files {
        let text = desk.read(&format!("{folder}/{file}"));
        described(command, &file, &text.lines().next().unwrap_or_default().split(',').collect::<Vec<_>>());
    }
}

#[track_caller]
fn made(desk: &Desk, line: &str, out: &str) {
    desk.ok(format!("{line} --out {out} --force"));
    described_all(desk, line.split(' ').next().unwrap_or_default(), out);
}

#[test]
fn every_column_of_sweeps_and_searches_is_described() {
    let moved = SPEC.replace("theta = [1, 4]", "drive = \"displacement\"\ndelta = [0.5, 2]");
    for text in [SPEC.to_owned(), moved + "[estimate]\nconvention = \"elongation\"\n"] {
        let desk = Desk::new(&text);
        desk.write("one.toml", text.replace("[4, 7]", "4"));
        for line in ["sweep spec.toml --backend cpu", "tap one.toml --backend cpu", "shape one.toml"] {
            made(&desk, line, "out");
        }
    }
    let search =
        "[optimise]\nobjective = \"pareto\"\nvariables = { d = [2, 10] }\nbudget = { evaluations = 300 }\n";
    let desk = Desk::new(&format!("{}{search}", SPEC.replace("d = [4, 7]\n", "")));
    made(&desk, "optimise spec.toml --backend cpu", "found");
    assert!(desk.names("found").contains(&"pareto.csv".to_owned()));
}

#[test]
fn every_column_from_measurement_to_distance_is_described() {
    let rig = SPEC.replace("[4, 7]", "4").replace("[21, 33, 48]", "[21, 25, 29, 33, 40, 48]");
    let desk = Desk::new(&rig.replace("[1, 4]", "[1, 2, 4]"));
    let pose = "x = 0\ny = 0\nheading = 0\n";
    desk.write(
        "array.toml",
        format!("[[whisker]]\nname = \"one\"\ncalibration = \"cal/calibration.toml\"\n{pose}"),
    );
    let circle = "[object]\nshape = \"circle\"\nx = 0\ny = 0\nradius = 10\n";
    desk.write("object.toml", format!("{circle}[around]\nstarts = 1\ndistance = 36\n"));
    for signal in ["strain", "microstrain", "bridge_mV_per_V", "reading"] {
        let column = if signal == "reading" { signal } else { "strain" };
        desk.write("readings.csv", format!("theta_deg,{column}\n2,0.01\n"));
        desk.write("array.csv", format!("whisker,theta_deg,{column}\none,2,0.01\n"));
        desk.write(
            "poses.csv",
            format!("base_x_mm,base_y_mm,heading_deg,theta_deg,{column}\n0,0,90,2,0.01\n"),
        );
        made(&desk, &format!("simulate spec.toml --repeats 3 --signal {signal}"), "sim");
        made(&desk, "calibrate sim/measurements.csv --whisker spec.toml", "cal");
        made(&desk, "locate cal/calibration.toml readings.csv --interval", "read");
        made(&desk, "contour poses.csv --calibration cal/calibration.toml", "traced");
        desk.ok("locate --array array.toml array.csv --out array --force");
        described_all(&desk, "locate --array", "array");
        made(&desk, &format!("simulate spec.toml --object object.toml --signal {signal}"), "strokes");
    }
}

#[test]
fn every_column_of_verify_and_bench_is_described() {
    described("verify", "verify.csv", &heading("verify").names_as(&[]));
    described("bench", "work_precision.csv", &heading("work_precision").names_as(&[]));
}

/// Quoted words behind `=>` or in a pair, in the body of the function `name`.
fn words_of(source: &str, name: &str) -> BTreeSet<String> {
    let body = source.split(&format!("fn {name}(")).nth(1).unwrap_or_else(|| panic!("no fn {name}"));
    let body = body.split("\n    }\n").next().unwrap_or_default();
    body.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn every_word_is_described() {
    let parts = Topic::Statuses.parts();
    let told = |k: usize| parts[k].entries.iter().map(|e| e.name.clone()).collect::<BTreeSet<_>>();
    let reasons = words_of(include_str!("../../crates/lab/src/estimator/taps.rs"), "word");
    assert_eq!(reasons, told(1), "reasons");
    let verdicts = [&FAULTS[..], &QUANTITIES[..]].concat().into_iter().map(str::to_owned).collect();
    assert_eq!(told(2), verdicts, "verdicts in src/reference/words.toml");

    let statuses = &parts[0];
    let names: Vec<&str> = statuses.entries.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, Status::ALL.map(|(_, word)| word), "statuses");
    for e in &statuses.entries {
        assert!(!e.meaning.is_empty(), "src/reference/words.toml does not say what {} means", e.name);
    }
}

#[test]
fn the_map_of_the_folders_names_every_module() {
    let root = Path::new(crate::common::ROOT);
    let map = std::fs::read_to_string(root.join("docs/architecture.md")).expect("docs/architecture.md");
    let mut folders = vec!["shaders".to_owned()];
    for parent in ["src", "crates"] {
        for entry in std::fs::read_dir(root.join(parent)).expect("sources") {
            let name = entry.expect("an entry").file_name().to_string_lossy().into_owned();
            if !["lib.rs", "main.rs"].contains(&&*name) {
                folders.push(format!("{parent}/{name}"));
            }
        }
    }
    let missing: Vec<_> = folders.iter().filter(|f| !map.contains(&format!("`{f}`"))).collect();
    assert!(missing.is_empty(), "docs/architecture.md does not name {missing:?}");
}

#[test]
fn the_table_of_formulas_names_files_that_are_there() {
    let root = Path::new(crate::common::ROOT);
    let map = std::fs::read_to_string(root.join("docs/architecture.md")).expect("docs/architecture.md");
    let table = map.split("## Where formulas stand").nth(1).and_then(|rest| rest.split("\n## ").next());
    let places = table.expect("the table").split('`').skip(1).step_by(2);
    let files: Vec<&str> = places.filter(|p| p.ends_with(".rs") || p.ends_with(".wgsl")).collect();
    assert!(files.len() > 15, "{files:?}");
    for file in files {
        let there = |base: &str| root.join(base).join(file).exists();
        assert!(there("") || there("crates/core/src/physics"), "{file}");
    }
}

#[test]
fn the_readme_is_a_first_page() {
    let root = Path::new(crate::common::ROOT);
    let readme = std::fs::read_to_string(root.join("README.md")).expect("README.md");
    assert!(readme.lines().count() <= 130, "{} lines", readme.lines().count());
    assert_eq!(readme.matches("![").count(), 1, "one picture");
    for command in ["cargo run --release -- sweep sweeps/prototypes.toml", "tests/run", "--backend gpu"] {
        assert!(readme.contains(command), "{command}");
    }
    let mut pages: Vec<_> =
        std::fs::read_dir(root.join("docs")).expect("docs").map(|e| e.expect("an entry").path()).collect();
    pages.retain(|p| p.extension().is_some_and(|e| e == "md"));
    pages.push(root.join("README.md"));
    for page in pages {
        let text = std::fs::read_to_string(&page).expect("a page");
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            let is_made = file.starts_with("made/") || ["reference.md", "explore.html"].contains(&file);
            if !link.contains("://") && !file.is_empty() && file.is_ascii() && !is_made {
                let target = page.parent().expect("a folder").join(file);
                assert!(target.exists(), "{}: {link}", page.display());
            }
        }
    }
}
