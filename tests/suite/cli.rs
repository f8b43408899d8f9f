//! The command line: stdout, stderr and exit codes, and which backend runs.

use crate::common::program::{Desk, SPEC, large, says};
use serde_json::{Value, json};

/// Environment in which no Vulkan driver is found.
const NO_DRIVER: [(&str, &str); 2] =
    [("VK_DRIVER_FILES", "/nonexistent.json"), ("VK_ICD_FILENAMES", "/nonexistent.json")];

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn of(value: &Value, names: &str) -> Value {
    names.split(' ').map(|name| value[name].clone()).collect()
}

#[test]
fn sweep_writes_four_files_and_says_so() {
    let desk = Desk::new(SPEC);
    let ran = desk.sweep(&[]).exits(0);
    let files = ["designs.csv", "distances.csv", "run.json", "tuples.csv"];
    assert_eq!(desk.names("results/spec"), files);
    for file in files {
        assert!(ran.stdout.contains(&format!("results/spec/{file}")), "{}", ran.stdout);
    }
    assert!(
        ran.stdout.contains("best 4 of 4 complete rows by total_rms_mm:") && ran.stdout.contains("12 ok")
    );
    assert!(ran.stderr.contains("spec: 12 taps of 2 designs, exact rod, on cpu"), "{}", ran.stderr);
    for file in &files {
        let text = desk.read(&format!("results/spec/{file}"));
        assert!(text.ends_with('\n') && !text.contains('\r') && !text.contains("NaN"), "{file}");
    }
}

#[test]
fn run_json_describes_a_quiet_run() {
    let desk = Desk::new(SPEC);
    let ran = desk.sweep(&["--quiet"]).exits(0);
    assert_eq!(ran.stdout + &ran.stderr, "");
    let run: Value = serde_json::from_str(&desk.read("results/spec/run.json")).unwrap();
    assert_eq!(run["format"], 1);
    assert_eq!(run["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(run["spec"]["text"], SPEC);
    assert_eq!(run["spec"]["hash"].as_str().unwrap().len(), 64);
    assert_eq!(run["backend"]["name"], "cpu");
    assert_eq!((&run["backend"]["precision"], &run["backend"]["tolerance"]), (&"f32".into(), &1e-5.into()));
    assert_eq!(run["counts"]["status"]["ok"], 12);
    assert_eq!((&run["counts"]["solved"], &run["counts"]["interpolated"]), (&12.into(), &0.into()));
    assert!(run["taps_per_second"].as_f64().unwrap() > 0.0);
    assert!(run.get("commit").is_some());
    let in_force = run["in_force"].as_array().unwrap();
    let value = |key: &str| in_force.iter().find(|v| v["key"] == key).unwrap();
    assert_eq!(
        (&value("whisker.hub")["default"], &value("gauge.noise_strain")["default"]),
        (&true.into(), &false.into())
    );
}

#[test]
fn json_is_one_object_and_nothing_else() {
    let desk = Desk::new(SPEC);
    let object = desk.sweep(&["--json"]).exits(0).json();
    let wanted = "format command version ok out files counts seconds backend result";
    assert_eq!(keys(&object).join(" "), wanted);
    assert_eq!(of(&object, "ok command"), json!([true, "sweep"]));
    assert_eq!(object["files"].as_array().unwrap().len(), 4);
    assert_eq!(of(&object["counts"], "tuples designs"), json!([12, 4]));
    assert_eq!(object["result"]["best"][0]["theta_deg"], 1.0);

    let from_spec = Desk::new(&format!("{SPEC}[run]\njson = true\nbackend = \"cpu\"\n"));
    assert_eq!(from_spec.ok("sweep spec.toml").json()["ok"], true);
}

#[test]
fn json_tells_errors_in_fields() {
    let desk = Desk::new(&SPEC.replace("D = 10", "D = -10"));
    let object = desk.sweep(&["--json"]).exits(2).json();
    assert_eq!(object["ok"], false);
    let error = &object["error"];
    let told = json!(["spec.toml", 2, "whisker.D", "-10", "> 0 mm"]);
    assert_eq!(of(error, "file line key value allowed"), told);
}

#[test]
fn plan_counts_the_designs_of_a_tuple_file() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    let header = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg";
    desk.write("list.csv", format!("{header}\n10,4,50,5,2,21,1\n10,4,50,5,2,33,1\n10,4,50,5,2,48,1\n"));
    let planned = desk.sweep(&["--plan", "--json"]).exits(0).json();
    let swept = desk.sweep(&["--json"]).exits(0).json();
    assert_eq!(planned["counts"]["designs_total"], 1);
    for table in ["tuples", "designs", "distances"] {
        assert_eq!(planned["counts"][table], swept["counts"][table], "{table}");
    }
}

#[test]
fn a_huge_table_is_not_written_by_default() {
    let huge = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 100_000_000 }");
    let ran = Desk::new(&huge).sweep(&["--plan"]).exits(2);
    assert!(ran.stderr.contains("output.tuples") && ran.stderr.contains("tuples = true"), "{}", ran.stderr);
    let asked = format!("{huge}[output]\ntuples = true\n");
    assert!(Desk::new(&asked).sweep(&["--plan"]).exits(0).stdout.contains("1 200 000 000 taps"));
}

#[test]
fn gpu_without_an_adapter_is_exit_2_and_auto_takes_the_cpu() {
    let desk = Desk::new(SPEC);
    let ran = desk.run_with(&["sweep", "spec.toml", "--backend", "gpu"], &NO_DRIVER).exits(2);
    assert!(ran.stderr.contains("no Vulkan") && ran.stderr.contains("mesa-vulkan-drivers"), "{}", ran.stderr);
    assert_eq!(desk.names("."), ["spec.toml"]);
    desk.write("large.toml", large());
    let ran = desk.run_with(&["sweep", "large.toml", "--plan"], &NO_DRIVER).exits(0);
    assert!(ran.stdout.contains("on cpu") && ran.stdout.contains("no Vulkan"), "{}", ran.stdout);
    let ran = desk.run_with(&["sweep", "spec.toml"], &NO_DRIVER).exits(0);
    says(&ran.stderr, &["on cpu", "too short a run to look for a GPU"]);
    let listed = desk.run_with(&["devices"], &NO_DRIVER).exits(0);
    assert!(listed.stdout.contains("--backend auto takes: CPU kernels"), "{}", listed.stdout);
}

#[test]
fn gpu_sweeps_where_there_is_an_adapter() {
    let desk = Desk::new(SPEC);
    let object = desk.json("sweep spec.toml --backend gpu");
    assert_eq!(object["backend"]["name"], "gpu");
    assert!(object["backend"]["adapter"].is_string() && object["backend"]["driver"].is_string());
    let devices = desk.json("devices");
    assert_eq!(devices["result"]["adapters"][0]["name"], object["backend"]["adapter"]);
    // `auto` uses hardware only, and names the software adapter that it skips.
    let (adapter, auto) = (&devices["result"]["adapters"][0], &devices["backend"]);
    let reason = auto["reason"].as_str().unwrap();
    let left = reason.contains(adapter["name"].as_str().unwrap()) && reason.contains("--backend gpu");
    match adapter["software"].as_bool().unwrap() {
        true => assert!(auto["name"] == "cpu" && left, "{auto}"),
        false => assert_eq!(auto["name"], "gpu"),
    }
    let asked = desk.json("devices --backend gpu");
    assert_eq!(of(&asked["backend"], "name adapter"), json!(["gpu", adapter["name"]]));
    let name = adapter["name"].as_str().unwrap();
    let named = desk.run(&["sweep", "spec.toml", "--adapter", name, "--force", "--json"]).exits(0).json();
    assert_eq!(named["backend"]["name"], "gpu");
}

/// `[run]` values in force: one list, the same in `--plan` and run.json. The command line wins, defaults are told, what `auto` takes is no choice of the user, and the
/// reference ignores precision and tolerance.
#[test]
fn values_in_force() {
    let desk = Desk::new(&format!("{SPEC}[run]\nbackend = \"reference\"\ntolerance = 1e-4\n"));
    let entry = |list: &Value, key: &str| {
        let found: Vec<&Value> = list.as_array().unwrap().iter().filter(|e| e["key"] == key).collect();
        assert!(found.len() < 2, "{key} stands twice in {list}");
        found.first().map(|e| (e["value"].as_str().unwrap().to_owned(), e["default"].as_bool().unwrap()))
    };
    let told = |list: &Value, wanted: &[(&str, &str, bool)]| {
        for (key, value, default) in wanted {
            let wanted = (!value.is_empty()).then(|| ((*value).to_owned(), *default));
            assert_eq!(entry(list, key), wanted, "{key}");
        }
    };
    let text = desk.ok("sweep spec.toml --plan").stdout;
    says(&text, &["12 taps of 2 designs", "12 rows", "4 rows", "6 rows", "hub = 0.0    (default)"]);
    let plan = desk.json("sweep spec.toml --plan --backend cpu --threads 2 --force");
    told(
        &plan["result"]["in_force"],
        &[
            ("run.backend", "\"cpu\"", false),
            ("run.threads", "2", false),
            ("run.tolerance", "0.0001", false),
            ("run.precision", "\"f32\"", true),
            ("run.out", "\"results/spec\"", true),
            ("run.force", "true", false),
            ("run.plan", "true", false),
            ("run.quiet", "false", true),
            ("run.adapter", "", true),
            ("whisker.D", "10", false),
        ],
    );
    let auto = desk.json("sweep spec.toml --plan --backend auto");
    let (taken, adapter) = (auto["backend"]["name"].to_string(), auto["backend"]["adapter"].as_str());
    let adapter = adapter.map_or(String::new(), |a| format!("{a:?}"));
    told(&auto["result"]["in_force"], &[("run.backend", &taken, true), ("run.adapter", &adapter, true)]);
    assert_eq!(desk.names("."), ["spec.toml"]);
    desk.ok("sweep spec.toml --precision f32 --out there");
    let run = desk.whole("there");
    told(
        &run["in_force"],
        &[
            ("run.backend", "\"reference\"", false),
            ("run.precision", "\"f64\"", true),
            ("run.tolerance", "", true),
            ("run.out", "\"there\"", false),
            ("run.force", "false", true),
        ],
    );
    assert_eq!(run["material_fit"], Value::Null);
    let double = Desk::new(SPEC).sweep(&["--json", "--precision", "f64"]).exits(0).json();
    assert_eq!(of(&double["backend"], "precision tolerance"), json!(["f64", 1e-8]));
    assert_eq!(run["backend"]["tolerance"], Value::Null);
}
