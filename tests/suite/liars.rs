//! Devices that fail or give wrong answers (`VIBRISSA_LIE`). Each is detected, the CPU takes over, and run.json lists the rows that it answered.

use std::fmt::Write;

use serde_json::Value;
use vibrissa::kernel::gpu::SOFTWARE_RANKS;

use crate::common::program::Desk;

/// Tuple files whose designs interleave, on two rungs, too few for a chart.
const ROWS: usize = 3000;

const LISTED: &str = "[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\n[model]\nsurface = true\n";

const RANKED: &str = "[whisker]\nD = [8, 10]\nd = { from = 4, to = 9, steps = 10_000 }\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                      [tap]\na = [15, 28, 41, 48]\ntheta = { from = 1, to = 12, steps = 9 }\n[output]\ntop = 30\nby = \"total_rms_mm\"\n";

fn swept(text: &str, backend: &str, lie: &str) -> (Vec<String>, Value) {
    let desk = Desk::new(text);
    let mut list = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n".to_owned();
    for i in 0..ROWS {
        let (d, place) = (3.0 + 0.1 * (i % 60) as f64, 3 + i % 4);
        let (a, theta) = (12 + i * 7 % 37, 0.5 + (i * 11 % 40) as f64 * 0.5);
        let _ = writeln!(list, "10,{d},50,{place},2,{a},{theta}");
    }
    desk.write("list.csv", list);
    let line = ["sweep", "spec.toml", "--backend", backend, "--out", "out", "--quiet"];
    desk.run_with(&line, &[("VIBRISSA_LIE", lie), (SOFTWARE_RANKS, "1")]).exits(0);
    let tables = ["tuples.csv", "designs.csv", "distances.csv"].map(|name| {
        let path = desk.path("out").join(name);
        std::fs::read_to_string(path).unwrap_or_default()
    });
    (tables.into(), desk.whole("out"))
}

fn warned(run: &Value) -> &str {
    run["warnings"][0].as_str().unwrap_or_else(|| panic!("{run}"))
}

#[test]
fn an_honest_device_is_compared_and_left_alone() {
    for text in [LISTED, RANKED] {
        let run = swept(text, "gpu", "").1;
        assert!(run["handed_over"].is_null() && run["warnings"] == Value::Array(Vec::new()), "{run}");
        let device = &run["backend"]["device"];
        assert!(text == RANKED || device["compared_taps"].as_u64() >= Some(18), "{run}");
        assert!(device["compared_worst"].as_f64() < Some(1.0) && device["handed_over_taps"] == 0, "{run}");
        assert!(text != RANKED || run["counts"]["chart"]["ranked_by"] == "device", "{run}");
    }
}

/// Fails from the first batch: the CPU solves every tap. A "call" is a compilation, or the wait for a dispatch.
#[test]
fn what_fails_is_handed_over() {
    let late = "did not end within 0 s";
    let unwritten = "id.x < batch.x => id.x < batch.x && id.x % 128u < 64u";
    let wanted = swept(LISTED, "cpu", "").0;
    for (lie, words) in [
        ("hang 0", late),
        ("hang 1", late),
        ("lose 1", "failed"),
        ("panic 1", "the driver panicked"),
        (unwritten, "were not written"),
    ] {
        let (tables, run) = swept(LISTED, "gpu", lie);
        assert!(tables == wanted, "{lie}: not the CPU's bytes");
        let list = &run["handed_over"][0];
        assert_eq!((list["from"].as_u64(), list["to"].as_u64()), (Some(1), Some(60)), "{lie}: {run}");
        let said = warned(&run);
        assert!(said.contains(words) && said.contains("the CPU solves from here on"), "{lie}: {said}");
        assert_eq!(run["warnings"].as_array().map(Vec::len), Some(1), "{run}");
    }
    // Earlier answers of the device are kept.
    let run = swept(LISTED, "gpu", "lose 3").1;
    let taps = run["backend"]["device"]["handed_over_taps"].as_u64().unwrap();
    assert!(taps > 0 && taps < ROWS as u64 && !run["handed_over"].is_null(), "{run}");
}

/// One wrong number in strain, force or arc: no answer of the device is used.
#[test]
fn an_answer_that_is_wrong_in_one_number_is_not_given_out() {
    let line = "return Solution(state.force, state.along, state.arc, strain,";
    let wanted = swept(LISTED, "cpu", "").0;
    for number in ["state.force", "state.arc", "strain"] {
        let wrong = line.replacen(number, &format!("1.01 * ({number}) + 0.01"), 1);
        let (tables, run) = swept(LISTED, "gpu", &format!("{line} => {wrong}"));
        assert!(tables == wanted, "{number}: not the CPU's bytes");
        assert!(warned(&run).contains("answers differ from those of the CPU"), "{number}: {run}");
        assert!(!run["handed_over"].is_null(), "{number}: {run}");
    }
}

/// A device that ranks wrongly or fails while ranking: the CPU ranks. Kept rows are always solved tap by tap.
#[test]
fn a_ranking_that_goes_wrong_is_left_to_the_cpu() {
    let wanted = swept(RANKED, "cpu", "").0;
    for lie in [
        "hang 0",
        "hang 2",
        // After the comparison, during the ranking.
        "lose 60",
        "row.rank < job.bound => row.rank < 1.5 * job.bound",
        "taps[told] += clean - begin => taps[told] += 2u * (clean - begin)",
        "id.x >= job.count => id.x >= job.count / 2u",
        "tally[0], 1u)] = i + 1u => tally[0], 2u)] = i + 1u",
    ] {
        let (tables, run) = swept(RANKED, "gpu", lie);
        assert!(tables == wanted, "{lie}: not the CPU's bytes");
        assert!(warned(&run).contains("the CPU solves from here on"), "{lie}: {run}");
        assert_eq!(run["counts"]["chart"]["ranked_by"], "lanes", "{lie}: {run}");
        assert_eq!(run["handed_over"][0]["what"], "kept rows", "{lie}: {run}");
    }
}
