//! The journal of a search: the same search begins anew without asking, another one asks.

use crate::common::program::{Desk, Ran};

const SEARCH: &str = "[whisker]\nD = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n\
                      [tap]\na = [21, 33, 48]\n[optimise]\nobjective = \"distance\"\n\
                      variables = { d = [2, 10], theta = [0.5, 10] }\nbudget = { evaluations = 200 }\n";

/// Searches `spec.toml` into `out`.
fn search(desk: &Desk, more: &[&str]) -> Ran {
    desk.run(&[&["optimise", "spec.toml", "--backend", "cpu", "--out", "out"], more].concat())
}

/// Fails unless the search is refused with each of `parts`, and the folder is as it was.
#[track_caller]
fn refused(desk: &Desk, parts: &[&str]) {
    let bytes = || std::fs::read(desk.path("out/.vibrissa-evaluations")).unwrap();
    let before = (bytes(), desk.names("out"));
    let ran = search(desk, &[]).exits(2);
    parts.iter().for_each(|part| assert!(ran.stderr.contains(part), "`{part}`: {}", ran.stderr));
    assert!(ran.stderr.contains("nothing was changed"), "{}", ran.stderr);
    assert_eq!((bytes(), desk.names("out")), before);
}

#[test]
fn a_search_that_ended_by_its_budget_is_repeated_or_goes_on() {
    let desk = Desk::new(SEARCH);
    let first = search(&desk, &["--json"]).exits(0).json();
    assert_eq!(first["result"]["ended_by"], "evaluations");
    // The same values again: nothing is lost that is not found again.
    desk.write("spec.toml", format!("# A comment is no value.\n{SEARCH}"));
    let again = search(&desk, &["--json"]).exits(0).json();
    assert_eq!(again["result"]["best"], first["result"]["best"]);
    // With more evaluations it goes on, or begins anew.
    desk.write("spec.toml", SEARCH.replace("200", "400"));
    let more = search(&desk, &["--resume", "--json"]).exits(0).json();
    assert!(more["counts"]["evaluations_resumed"].as_u64().unwrap() > 100, "{more}");
    assert_eq!(more["counts"]["evaluations"], 400);
    let anew = search(&desk, &["--json"]).exits(0).json();
    assert_eq!(anew["result"]["best"], more["result"]["best"]);
}

#[test]
fn other_values_ask_before_they_discard_a_search() {
    let desk = Desk::new(SEARCH);
    search(&desk, &["--quiet"]).exits(0);
    desk.write("spec.toml", SEARCH.replace("20e-6", "30e-6"));
    refused(&desk, &["other values", "--force"]);
    let ran = search(&desk, &["--resume"]).exits(2);
    assert!(ran.stderr.contains("another one"), "{}", ran.stderr);
    let ran = search(&desk, &["--force"]).exits(0);
    assert!(ran.stderr.contains("--force discarded an unfinished search of"), "{}", ran.stderr);
    desk.whole("out");
}

#[test]
fn after_a_kill_the_same_command_searches_anew() {
    let desk = Desk::new(SEARCH);
    let first = search(&desk, &["--json"]).exits(0).json();
    // As a killed one leaves it: a journal and no result.
    let killed = || {
        for name in desk.names("out").iter().filter(|name| !name.starts_with('.')) {
            std::fs::remove_file(desk.path("out").join(name)).unwrap();
        }
        assert!(desk.path("out/.vibrissa-evaluations").exists());
    };
    killed();
    let ran = search(&desk, &["--json"]).exits(0);
    assert!(ran.stderr.contains("the new search discarded an unfinished search of"), "{}", ran.stderr);
    let anew = ran.json();
    assert_eq!(anew["result"]["best"], first["result"]["best"]);
    assert_eq!(anew["counts"]["evaluations_resumed"], 0);
    killed();
    let ran = search(&desk, &["--resume", "--json"]).exits(0).json();
    assert!(ran["counts"]["evaluations_resumed"].as_u64().unwrap() > 100, "{ran}");
}

#[test]
fn a_converged_search_leaves_nothing_to_ask_about() {
    let desk = Desk::new(&SEARCH.replace("budget = { evaluations = 200 }\n", ""));
    let first = search(&desk, &["--json"]).exits(0).json();
    assert_eq!(first["result"]["ended_by"], "converged");
    assert!(!desk.path("out/.vibrissa-evaluations").exists());
    desk.write("spec.toml", SEARCH);
    search(&desk, &[]).exits(0);
}
