//! Work that a small input could make endless: it is refused, or done in bounded time and memory.

use std::time::Instant;

use crate::common::program::{Desk, SPEC, large};
use crate::common::world::GUARD;

/// Does `f`, which without its bound would take hours: it only must not hang.
#[track_caller]
fn soon<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = f();
    assert!(start.elapsed() < GUARD, "{what} took {:?}", start.elapsed());
    result
}

#[test]
fn a_plan_of_2_to_the_32_points_comes_at_once() {
    const POINTS: &str = "samples = 4294967296 }";
    let designs = format!("D = {{ min = 8, max = 12, {POINTS}");
    let text = SPEC.replace("D = 10", &designs) + "[output]\ntop = 3\n";
    let planned = soon("designs", || Desk::new(&text).sweep(&["--plan", "--json"]).exits(0).json());
    assert_eq!(planned["counts"]["designs_total"], 2u64 << 32);

    let distances = SPEC.replace("a = [21, 33, 48]", &format!("a = {{ min = 20, max = 48, {POINTS}"));
    for arguments in [&["--plan"][..], &[], &["--explain"]] {
        let refused = soon("distances", || Desk::new(&distances).sweep(arguments).exits(2));
        for part in ["spec.toml:10", "tap.a", "8589934592", "16777216", "samples = N"] {
            assert!(refused.stderr.contains(part), "{part} is not in {}", refused.stderr);
        }
    }
    let steps = SPEC.replace("theta = [1, 4]", "theta = { from = 1, to = 4, steps = 1_000_000_000_000 }");
    soon("drives", || Desk::new(&steps).sweep(&["--plan"]).exits(2));
}

#[test]
#[cfg(target_os = "linux")]
fn auto_takes_the_cpu_where_the_address_space_is_limited() {
    let desk = Desk::new(&large());
    let program = assert_cmd::cargo::cargo_bin("vibrissa");
    for limit in [600_000, 1_000_000, 3_000_000] {
        let script = format!("ulimit -v {limit}; exec {} sweep spec.toml --plan", program.display());
        let ran = std::process::Command::new("sh")
            .args(["-c", &script])
            .current_dir(desk.path("."))
            .output()
            .expect("a shell");
        let said = [&ran.stdout, &ran.stderr].map(|text| String::from_utf8_lossy(text)).concat();
        assert!(ran.status.success(), "{limit}: {said}");
        assert!(said.contains("on cpu with") && said.contains("the address space is limited to"), "{said}");
    }
}

/// A calibration edited by hand to values that no rig has is refused before the reference is asked for all its taps.
#[test]
fn an_absurd_calibration_is_refused_at_once() {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");
    let desk = Desk::new(SPEC);
    let (data, spec) = (format!("{examples}/prototype-d10.csv"), format!("{examples}/prototype-d10.toml"));
    desk.run(&["calibrate", &data, "--whisker", &spec, "--out", "cal", "--quiet"]).exits(0);
    let text = desk.read("cal/calibration.toml");
    desk.write("readings.csv", "theta_deg,strain\n4,0.02\n");
    for (old, new) in [
        ("pole_radius = 0.0", "pole_radius = 1000.0"),
        ("pole_radius = 0.0", "pole_radius = 1e6"),
        ("D = 10.0", "D = 1000.0"),
        ("d = 10.0", "d = 1000.0"),
    ] {
        assert!(text.contains(old));
        desk.write("edited.toml", text.replacen(old, new, 1));
        let arguments = ["locate", "edited.toml", "readings.csv", "--force", "--json"];
        let error = soon(new, || desk.run(&arguments)).exits(2).json()["error"].clone();
        let value = error["value"].as_str().unwrap_or_default();
        assert!(value.contains(new.split(" = ").next().unwrap()), "{error}");
        assert!(!error["allowed"].is_null() && error["file"] == "edited.toml", "{error}");
    }
}
