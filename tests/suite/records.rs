//! run.json of every command says whose result it is and lists its files with their hashes.

use crate::common::program::{Desk, SPEC, names};

const RIG: &str = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                   [tap]\na = { from = 21, to = 48, step = 3 }\n";

#[test]
fn every_command_lists_what_it_wrote() {
    let desk = Desk::new(SPEC);
    desk.write("rig.toml", format!("{RIG}theta = [1, 2, 4]\n"));
    desk.write("whisker.toml", RIG);
    let search = "[optimise]\nobjective = \"pareto\"\nbudget = { evaluations = 200 }\nvariables = { theta = [1, 5] }\n";
    desk.write("search.toml", format!("{RIG}{search}"));
    let data = "results/rig-simulate/measurements.csv";
    let calibration = "results/measurements-calibrate/calibration.toml";
    for (arguments, folder) in [
        (&["sweep", "spec.toml", "--backend", "cpu"][..], "spec"),
        (&["simulate", "rig.toml", "--repeats", "2"], "rig-simulate"),
        (&["calibrate", data, "--whisker", "whisker.toml"], "measurements-calibrate"),
        (&["locate", calibration, data], "measurements-locate"),
        (&["tap", "whisker.toml"], "whisker-tap"),
        (&["optimise", "search.toml", "--backend", "cpu"], "search-optimise"),
        (&["verify", "spec.toml", "--backend", "cpu", "--samples", "2"], "spec-verify"),
    ] {
        let ran = desk.run(&[arguments, &["--json"]].concat()).exits(0).json();
        let folder = format!("results/{folder}");
        assert_eq!(ran["out"], folder.as_str());
        let run = desk.whole(&folder);
        let name = folder.trim_start_matches("results/").trim_end_matches(&format!("-{}", arguments[0]));
        assert_eq!((&run["command"], &run["name"]), (&arguments[0].into(), &name.into()));
        let listed = run["files"].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap());
        let mut listed: Vec<&str> = listed.chain(["run.json"]).collect();
        listed.sort_unstable();
        let there = names(&desk.path(&folder));
        assert_eq!(there, listed);
        // The same question replaces it.
        desk.run(arguments).exits(0);
        desk.whole(&folder);
    }
}
