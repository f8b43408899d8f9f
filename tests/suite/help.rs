//! `vibrissa help`, completions, manual pages.

use std::path::Path;

use crate::common::program::{Desk, SPEC};
use vibrissa::reference::{Topic, page};
use vibrissa::spec::keys::{INLINE, SECTIONS};
use vibrissa::status::Status;

#[test]
fn help_prints_the_reference() {
    let desk = Desk::new(SPEC);
    let help = |words: &[&str]| desk.run(&[&["help"], words].concat());
    let spec = help(&["spec"]).exits(0).stdout;
    for key in SECTIONS.iter().chain(&INLINE).flat_map(|s| s.keys) {
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
fn help_of_commands_is_theirs_and_other_words_are_refused() {
    let desk = Desk::new(SPEC);
    assert_eq!(desk.run(&["help"]).exits(0).stdout, desk.run(&["--help"]).exits(0).stdout);
    assert_eq!(desk.run(&["help", "sweep"]).exits(0).stdout, desk.run(&["sweep", "--help"]).exits(0).stdout);
    let refused = desk.run(&["help", "colums"]).exits(2);
    assert_eq!(refused.stdout, "");
    for word in ["did you mean columns?", "spec", "statuses", "sweep", "locate"] {
        assert!(refused.stderr.contains(word), "{word}: {}", refused.stderr);
    }
    let refused = desk.run(&["help", "spec", "gage"]).exits(2);
    assert!(refused.stderr.contains("did you mean gauge?"), "{}", refused.stderr);
    for (_, topic, _) in Topic::WORDS {
        assert!(topic.plain(Some("no such part")).is_empty());
    }
}

#[test]
fn completions_and_manual_know_every_command() {
    let desk = Desk::new(SPEC);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = desk.run(&["completions", shell]).exits(0).stdout;
        for word in ["sweep", "calibrate", "--tolerance", "reference"] {
            let word = word.trim_start_matches("--");
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    desk.run(&["completions", "tcsh"]).exits(2);
    let page = desk.run(&["man"]).exits(0).stdout;
    assert!(page.contains(".TH vibrissa 1") && page.contains("calibrate"), "{page}");
    desk.run(&["man", "--out", "pages"]).exits(0);
    let pages = desk.names("pages");
    for name in ["vibrissa.1", "vibrissa-sweep.1", "vibrissa-locate.1"] {
        assert!(pages.contains(&name.to_owned()), "{pages:?}");
    }
}

#[test]
fn examples_of_the_help_name_files_that_are_there() {
    let (desk, root) = (Desk::new(SPEC), Path::new(env!("CARGO_MANIFEST_DIR")));
    let mut examples = 0;
    for command in ["sweep", "optimise", "tap", "calibrate", "locate", "contour", "simulate"] {
        let help = desk.run(&[command, "--help"]).exits(0).stdout;
        let example =
            help.lines().find(|l| l.starts_with("Example: ")).unwrap_or_else(|| panic!("{command}"));
        for file in example.split(' ').filter(|w| w.contains('/')) {
            assert!(root.join(file).is_file(), "{example}");
            examples += 1;
        }
    }
    assert!(examples >= 6, "{examples}");
}
