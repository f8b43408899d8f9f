//! Values that cannot be used, on the command line and in calibration.toml: key, value and what is allowed, in words of this program.

use crate::common::program::{Desk, SPEC};
#[cfg(unix)]
use crate::common::world::calibrated;

#[test]
fn a_value_on_the_command_line_that_is_no_number_is_told_with_what_is_allowed() {
    let desk = Desk::new(SPEC);
    for (flag, value, more, allowed) in [
        ("--threads", "nan", None, "a whole number, 1 … 4096"),
        ("--threads", "4097", None, "a whole number, 1 … 4096"),
        ("--threads", "1.5", None, "a whole number, 1 … 4096"),
        ("--leave-off", "1,a", Some("--explain"), "a number"),
        ("--tolerance", "", None, "a number"),
        ("--tolerance", "1e-5x", None, "a number"),
        ("--model-error", "small", None, "a number"),
        ("--backend", "gpus", None, "auto, gpu, cpu, reference"),
    ] {
        let line: Vec<&str> = ["sweep", "spec.toml", flag, value].into_iter().chain(more).collect();
        let ran = desk.run(&line).exits(2);
        let foreign = ["literal", "invalid digit", "parse float", "is not in"];
        assert!(foreign.iter().all(|word| !ran.stderr.contains(word)), "{flag} {value}: {}", ran.stderr);
        let error = desk.run(&[&line[..], &["--json"]].concat()).exits(2).json()["error"].clone();
        assert!(error["key"].as_str().unwrap().starts_with(flag), "{error}");
        assert!(error["allowed"].as_str().unwrap_or_default().contains(allowed), "{flag} {value}: {error}");
    }
    desk.ok("sweep spec.toml --threads 1 --tolerance 1e-4 --plan");
}

#[cfg(unix)]
#[test]
fn a_calibration_with_a_value_of_another_kind_is_told_by_its_key() {
    let desk = calibrated();
    let text = desk.read("cal/calibration.toml");
    let line_of = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap().to_owned();
    let (noise, drive) = (line_of("noise = "), line_of("drive_recorded = "));
    for (from, to, key, value, allowed) in [
        (noise.as_str(), "noise = \"small\"", "noise", Some("\"small\""), "a number"),
        (&noise, "noise = [1]", "noise", Some("[1]"), "a number"),
        (&drive, "drive_recorded = 1", "drive_recorded", Some("1"), "true or false"),
        (&noise, "", "noise", None, "as `vibrissa calibrate` wrote it"),
        (&noise, &format!("{noise}\nnoises = 1"), "noises", None, "estimator"),
        (&line_of("used = "), "used = -1.5", "data.used", Some("-1.5"), "a whole number"),
    ] {
        desk.write("cal/bad.toml", text.replacen(&format!("{from}\n"), &format!("{to}\n"), 1));
        let ran = desk.run(&["locate", "cal/bad.toml", "--zero", "0", "x.csv", "--json"]).exits(2).json();
        let error = &ran["error"];
        assert_eq!((error["key"].as_str(), error["value"].as_str()), (Some(key), value), "{to}: {error}");
        assert!(error["allowed"].as_str().unwrap_or_default().contains(allowed), "{to}: {error}");
        assert!(error["line"].is_u64() && error["file"] == "cal/bad.toml", "{to}: {error}");
        let words = error["message"].as_str().unwrap();
        assert!(["f64", "field", "bool", "usize"].iter().all(|word| !words.contains(word)), "{words}");
    }
}

#[test]
fn a_key_of_too_many_parts_is_told_with_its_line() {
    let desk =
        Desk::new(&format!("[whisker]\nD = 10\n\na{} = 1\n\n{}", ".a".repeat(100_000), "[tap]\na = 3\n"));
    let error = desk.run(&["sweep", "spec.toml", "--json"]).exits(2).json()["error"].clone();
    assert_eq!(error["line"], 4, "{error}");
    assert!(error["message"].as_str().unwrap().contains("too many parts"), "{error}");
}

#[test]
fn an_adapter_of_a_spec_that_is_not_there_is_told_with_its_line() {
    let text = format!("{SPEC}\n[run]\nadapter = \"nothing of this name\"\n");
    let line = text.lines().position(|l| l.starts_with("adapter")).unwrap() + 1;
    let desk = Desk::new(&text);
    let error = desk.run(&["sweep", "spec.toml", "--json"]).exits(2).json()["error"].clone();
    assert_eq!((error["key"].as_str(), error["line"].as_u64()), (Some("run.adapter"), Some(line as u64)));
    assert_eq!(error["value"], "\"nothing of this name\"", "{error}");
    let typed = desk.run(&["sweep", "spec.toml", "--adapter", "neither", "--json"]).exits(2).json();
    assert_eq!(typed["error"]["key"], "--adapter");
}
