//! `vibrissa help`, completions, manual pages.

use std::path::Path;

use crate::common::program::{Desk, SPEC};
use vibrissa::reference::{Topic, page};
use vibrissa::spec::keys::{inline, sections};
use vibrissa::status::Status;

#[test]
fn help_prints_the_reference() {
    let desk = Desk::new(SPEC);
    let help = |words: &[&str]| desk.run(&[&["help"], words].concat());
    let spec = help(&["spec"]).exits(0).stdout;
    for key in sections().chain(inline()).flat_map(|s| &s.keys) {
        assert!(spec.contains(&format!("\n  {}", key.name)), "{}", key.name);
    }
    let columns = help(&["columns"]).exits(0).stdout;
    assert!(columns.contains("located.csv (locate)") && columns.contains("\n  K_deviation"));
    let statuses = help(&["statuses"]).exits(0).stdout;
    assert!(Status::ALL.iter().all(|(_, word)| statuses.contains(&format!("\n  {word}"))));
    for text in [&spec, &columns, &statuses] {
        assert_eq!(text.lines().find(|l| l.chars().count() > 100), None);
        assert!(!text.contains('`') && !text.contains("|--"));
    }
    let gauge = help(&["spec", "gauge"]).exits(0).stdout;
    assert!(gauge.starts_with("[gauge]\n") && !gauge.contains("[tap]"), "{gauge}");
    assert!(help(&["columns", "tap.csv"]).exits(0).stdout.starts_with("tap.csv (tap)\n"));
    assert_eq!(help(&["reference"]).exits(0).stdout, page());
}

#[test]
fn help_of_commands_is_theirs() {
    let desk = Desk::new(SPEC);
    assert_eq!(desk.ok("help").stdout, desk.ok("--help").stdout);
    assert_eq!(desk.ok("help sweep").stdout, desk.ok("sweep --help").stdout);
    for (_, topic, _) in Topic::WORDS {
        assert!(topic.plain(Some("no such part")).is_empty());
    }
}

#[test]
fn completions_and_manual_know_every_command() {
    let desk = Desk::new(SPEC);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = desk.ok(format!("completions {shell}")).stdout;
        for word in ["sweep", "calibrate", "--tolerance", "reference"] {
            let word = word.trim_start_matches("--");
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let page = desk.ok("man").stdout;
    assert!(page.contains(".TH vibrissa 1") && page.contains("calibrate"), "{page}");
    desk.ok("man --out pages");
    let pages = desk.names("pages");
    for name in ["vibrissa.1", "vibrissa-sweep.1", "vibrissa-locate.1"] {
        assert!(pages.contains(&name.to_owned()), "{pages:?}");
    }
}

pub fn commands(desk: &Desk) -> Vec<String> {
    let help = desk.ok("--help").stdout;
    let listed =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let named = listed.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    named.filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

/// Files that the examples of the help need: the calibration of the previous example, readings, a record, poses, parts.
fn prepared() -> Desk {
    let desk = Desk::new("");
    let root = Path::new(crate::common::ROOT);
    for folder in ["sweeps", "examples"] {
        std::os::unix::fs::symlink(root.join(folder), desk.path(folder)).expect("a link");
    }
    desk.ok("calibrate examples/prototype-d10.csv --whisker examples/prototype-d10.toml --out cal");
    std::fs::copy(desk.path("cal/calibration.toml"), desk.path("calibration.toml")).expect("a copy");
    for file in ["readings.csv", "taps.csv"] {
        desk.write(file, "theta_deg,strain\n0,0\n4,0.02\n8,0.04\n");
    }
    let contact = |k: usize| if k % 200 >= 140 { 0.02 } else { 0.0 };
    let sample = |k: usize| format!("{},{}\n", 0.01 * k as f64, contact(k) + 1e-6 * ((7919 * k) % 13) as f64);
    desk.write("raw.csv", "Zeit,Kanal\n".to_owned() + &(0..600).map(sample).collect::<String>());
    let pose = |k: usize| format!("{k},2,90,4,0.02\n");
    let head = "base_x_mm,base_y_mm,heading_deg,theta_deg,strain\n".to_owned();
    desk.write("poses.csv", head + &(0..8).map(pose).collect::<String>());
    desk.write("million.toml", SPEC);
    for part in ["1/2", "2/2"] {
        desk.ok(format!("sweep million.toml --shard {part} --out results/million"));
    }
    desk
}

#[test]
fn every_example_of_the_help_runs() {
    let desk = prepared();
    let program = assert_cmd::cargo::cargo_bin("vibrissa");
    let place = program.parent().expect("a folder").to_string_lossy().into_owned();
    let path = std::env::var("PATH").unwrap_or_default();
    let mut ran = 0;
    for command in commands(&desk) {
        let help = desk.ok(format!("{command} --help")).stdout;
        let Some((_, example)) = help.split_once("Example: ") else { continue };
        let example =
            example.split("\n\n").next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &example]).current_dir(desk.path(".")).env("PATH", format!("{place}:{path}"));
        let left = shell.output().expect("a shell");
        let (said, failed) = (String::from_utf8_lossy(&left.stderr), !left.status.success());
        assert!(!failed && example.starts_with("vibrissa "), "{command}: `{example}`: {said}");
        ran += 1;
    }
    assert!(ran >= 18, "{ran}");
}
