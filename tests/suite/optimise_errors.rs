//! What `[optimise]` refuses, and how it says so.

use crate::common::program::Desk;
use serde_json::Value;

const OBJECTIVE: &str = "objective = \"distance\"";
const VARIABLES: &str = "variables = { d = [2, 10], theta = [0.5, 10] }";

fn spec(gauge: &str, optimise: &[&str]) -> String {
    format!(
        "[whisker]\nD = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n{gauge}\n[tap]\na = {{ from = 21, to = 48, step = 3 }}\n[optimise]\n{}\n",
        optimise.join("\n")
    )
}

/// The error of a refused spec; nothing is left behind.
#[track_caller]
fn refused(text: &str) -> Value {
    let desk = Desk::new(text);
    let ran = desk.run(&["optimise", "spec.toml", "--json", "--backend", "cpu", "--out", "found"]);
    let json = ran.exits(2).json();
    assert_eq!(json["ok"], false);
    assert!(!desk.path("found").exists(), "{:?}", desk.names("found"));
    json["error"].clone()
}

/// Checks key, value and line, and that file and allowed values are told.
#[track_caller]
fn at(error: &Value, key: &str, value: &str, line: u64) {
    assert_eq!(
        (error["key"].as_str(), error["value"].as_str(), error["line"].as_u64()),
        (Some(key), Some(value), Some(line)),
        "{error}"
    );
    assert_eq!(error["file"], "spec.toml");
    assert!(error["allowed"].as_str().is_some_and(|a| !a.is_empty()), "{error}");
}

const NOISE: &str = "noise_strain = 20e-6";

#[test]
fn bounds() {
    let with = |variables: &str| refused(&spec(NOISE, &[OBJECTIVE, variables]));
    at(&with("variables = { d = [10, 2], theta = [0.5, 10] }"), "optimise.variables.d", "[10, 2]", 12);
    at(&with("variables = { d = [5, 5], theta = [0.5, 10] }"), "optimise.variables.d", "[5, 5]", 12);
    at(&with("variables = { d = [-1, 5], theta = [0.5, 10] }"), "optimise.variables.d", "[-1, 5]", 12);
    at(&with("variables = { d = [1, 5], theta = [0.5, 90] }"), "optimise.variables.theta", "[0.5, 90]", 12);
    at(&with("variables = { d = [1], theta = [0.5, 9] }"), "optimise.variables.d", "[1]", 12);
    let typo = with("variables = { d = [2, 10], thetta = [0.5, 10] }");
    at(&typo, "optimise.variables.thetta", "[0.5, 10]", 12);
    assert!(typo["message"].as_str().unwrap().contains("did you mean theta"));
    at(
        &with("variables = { d = [2, 10], theta = [0.5, 10], a = [20, 30] }"),
        "optimise.variables.a",
        "[20, 30]",
        12,
    );
    at(&with("variables = { d = [2, 10], delta = [0.5, 10] }"), "optimise.variables.delta", "[0.5, 10]", 12);
    at(&with("variables = {}"), "optimise.variables", "{}", 12);
}

#[test]
fn objectives_and_budgets() {
    for word in ["distance", "weighted", "pareto"] {
        let objective = format!("objective = \"{word}\"");
        at(&refused(&spec("", &[&objective, VARIABLES])), "optimise.objective", &format!("\"{word}\""), 11);
    }
    let unknown = refused(&spec(NOISE, &["objective = \"distanse\"", VARIABLES]));
    at(&unknown, "optimise.objective", "\"distanse\"", 11);
    for word in ["sd", "weighted", "pareto"] {
        let lines = [
            &format!("objective = \"{word}\""),
            VARIABLES,
            "robust = { D = 0.05, calibrated = \"nominal\" }",
        ];
        at(&refused(&spec(NOISE, &lines)), "optimise.robust.calibrated", "\"nominal\"", 13);
    }
    let more = |line: &str| refused(&spec(NOISE, &[OBJECTIVE, VARIABLES, line]));
    at(&more("budget = { evaluations = 0 }"), "optimise.budget.evaluations", "0", 13);
    at(&more("budget = { seconds = 0 }"), "optimise.budget.seconds", "0", 13);
    at(&more("budget = {}"), "optimise.budget", "{}", 13);
    at(&more("weights = { sd = 0, distance = 0 }"), "optimise.weights", "{ sd = 0, distance = 0 }", 13);
    at(&more("limits = { strian = 0.05 }"), "optimise.limits.strian", "0.05", 13);
    at(&more("limits = { force_N = 0 }"), "optimise.limits.force_N", "0", 13);
    at(&more("robust = { D = -0.05 }"), "optimise.robust.D", "-0.05", 13);
    at(&more("robust = { D = 0.05, samples = 1 }"), "optimise.robust.samples", "1", 13);
    at(&more("robust = { samples = 64 }"), "optimise.robust", "{ samples = 64 }", 13);
    at(&more("verbose = true"), "optimise.verbose", "true", 13);
    let missing = refused(&spec(NOISE, &[VARIABLES]));
    assert_eq!((missing["key"].as_str(), missing["line"].as_u64()), (Some("optimise.objective"), Some(10)));
    let missing = refused(&spec(NOISE, &[OBJECTIVE]));
    assert_eq!(missing["key"], "optimise.variables");
    let missing = refused(&spec(NOISE, &[OBJECTIVE, "variables = { d = [2, 10] }"]));
    assert_eq!(missing["key"], "tap.theta");
    let lists = refused(&spec(NOISE, &[OBJECTIVE, VARIABLES]).replace("x_ss = 5", "x_ss = [5, 6]"));
    at(&lists, "gauge.x_ss", "[5, 6]", 5);
    let start = refused(&spec(NOISE, &[OBJECTIVE, VARIABLES]).replace("L_a = 50", "L_a = 50\nd = [4, 7]"));
    at(&start, "whisker.d", "[4, 7]", 4);
    let one =
        refused(&spec(NOISE, &[OBJECTIVE, VARIABLES]).replace("{ from = 21, to = 48, step = 3 }", "30"));
    at(&one, "tap.a", "30", 9);
}

/// Problems that cannot be met say which limit, and by how much.
#[test]
fn infeasible_limits() {
    let with = |limits: &str| refused(&spec(NOISE, &[OBJECTIVE, VARIABLES, limits]));
    let strain = with("limits = { strain = 0.001 }");
    at(&strain, "optimise.limits.strain", "0.001", 13);
    let allowed = strain["allowed"].as_str().unwrap();
    let least: f64 = allowed.split_whitespace().nth(1).unwrap().parse().unwrap();
    // What it says is true: a little more is enough, a little less is not.
    let desk = Desk::new(&spec(NOISE, &[OBJECTIVE, VARIABLES, &format!("limits = {{ strain = {least} }}")]));
    desk.run(&["optimise", "spec.toml", "--backend", "cpu", "--quiet"]).exits(0);
    with(&format!("limits = {{ strain = {} }}", 0.99 * least));
    at(&with("limits = { force_N = 1e-4 }"), "optimise.limits.force_N", "1e-4", 13);
    let both = with("limits = { force_N = 1e-4, strain = 1e-3 }");
    assert!(both["message"].as_str().unwrap().contains("also"), "{both}");
    let gauge = refused(&spec("noise_strain = 2e-5\nstrain_limit = 1e-4", &[OBJECTIVE, VARIABLES]));
    at(&gauge, "gauge.strain_limit", "1e-4", 8);
    let tip = refused(&spec(
        NOISE,
        &[OBJECTIVE, "variables = { d = [12, 14], theta = [1, 5] }", "limits = { tip_not_wider = true }"],
    ));
    at(&tip, "optimise.limits.tip_not_wider", "true", 13);
    let peak = refused(
        &spec(NOISE, &[OBJECTIVE, VARIABLES, "limits = { unambiguous = true }"])
            .replace("from = 21, to = 48, step = 3", "from = 7.5, to = 9, step = 0.5"),
    );
    at(&peak, "optimise.limits.unambiguous", "true", 13);
}

#[test]
fn a_plan_of_a_search_writes_nothing() {
    let desk = Desk::new(&spec(NOISE, &[OBJECTIVE, VARIABLES]));
    let plan = desk.run(&["optimise", "spec.toml", "--plan", "--json", "--backend", "cpu"]).exits(0).json();
    assert_eq!(plan["files"].as_array().map(Vec::len), Some(0));
    assert!(!desk.path("results").exists());
}

/// What friction does at a tilted edge no model says, whether the tilt is a key of the tap or of a tolerance (model §6).
#[test]
fn a_robust_tilt_needs_a_contact_that_has_a_model_there() {
    let robust = "robust = { tilt = 5, samples = 8 }";
    for model in ["contact = { coulomb = 0.3 }", "contact = \"stick\"\nsurface = true"] {
        let text = spec("noise_strain = 10e-6", &[OBJECTIVE, VARIABLES, robust])
            + "[model]\nextension = true\n"
            + model;
        let error = refused(&text);
        assert_eq!(error["key"], "optimise.robust", "{error}");
        assert!(error["allowed"].as_str().is_some_and(|a| a.contains("frictionless")), "{error}");
    }
}
