//! Counts in run.json: the taps of charts, and the status words of all taps.

use crate::common::program::Desk;
use vibrissa::kernel::gpu::SOFTWARE_RANKS;

fn practical(samples: u32, contact: &str, rest: &str) -> String {
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = {samples} }}");
    format!(
        "[whisker]\nD = {}\nd = {}\nL_a = 50\n[gauge]\nx_ss = {}\nl = 2\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\ntheta = {}\n\
         [model]\nsurface = true\nshear = true\nextension = true\nmaterial = {{ neo-hookean = 3.2 }}\n{contact}\n{rest}",
        axis(8.0, 12.0),
        axis(2.0, 7.0),
        axis(3.0, 15.0),
        axis(0.5, 10.0)
    )
}

fn counts(text: &str) -> serde_json::Value {
    let run = ["sweep", "spec.toml", "--json", "--backend", "cpu"];
    Desk::new(text).run(&run).exits(0).json()["counts"].clone()
}

/// Taps solved for ten charts, and terms per chart, which set the cost of a chart's tap.
#[test]
fn charts_cost_few_taps_and_hold_few_terms() {
    for (contact, most) in [("", [22_000, 16_000]), ("contact = { coulomb = 0.3 }", [120_000, 90_000])] {
        let counts = counts(&practical(20_000, contact, "[output]\ntop = 10\n"));
        let of = |key: &str| counts["chart"][key].as_u64().unwrap();
        assert!(of("solved") <= most[0] && of("coefficients") <= most[1], "{counts}");
        assert!(counts["solved"].as_u64().unwrap() < of("solved") + 40_000, "{counts}");
    }
}

pub fn numbers(list: &str) -> u64 {
    let number = |part: &str| part.chars().filter(char::is_ascii_digit).collect::<String>();
    list.split(", ").map(|part| number(part).parse::<u64>().unwrap_or_else(|_| panic!("{list}"))).sum()
}

#[test]
fn the_words_of_a_summary_add_up_to_its_taps() {
    let axis = |lo: f64, hi: f64| format!("{{ min = {lo}, max = {hi}, samples = 1500 }}");
    let near = |whisker: &str, theta: &str, rest: &str| {
        format!(
            "[whisker]\n{whisker}\nL_a = 50\n[gauge]\nx_ss = 12\nl = 2\n[tap]\na = {{ from = 18, to = 48, steps = 11 }}\ntheta = {theta}\n{rest}"
        )
    };
    let even = "D = { from = 8, to = 12, steps = 30 }\nd = 4";
    let sampled = format!("D = {}\nd = {}", axis(8.0, 12.0), axis(3.0, 7.0));
    let fine = "{ from = 0.5, to = 12, steps = 40 }";
    for (way, text) in [
        ("solved", near("D = 10\nd = 4", "[1, 12]", "")),
        ("ranked", near(even, fine, "[output]\ntop = 5\n")),
        ("ranked by errors", near(even, fine, "[output]\ntop = 5\nby = \"error_rms_mm\"\n")),
        ("ranked samples", near(&sampled, &axis(0.5, 12.0), "[output]\ntop = 5\n")),
    ] {
        for backend in ["cpu", "gpu"] {
            let desk = Desk::new(&text);
            let arguments = ["sweep", "spec.toml", "--backend", backend, "--out", "out"];
            let ran = desk.run_with(&arguments, &[(SOFTWARE_RANKS, "1")]).exits(0);
            let line = ran.stdout.lines().find(|line| line.starts_with("status of ")).unwrap();
            let (taps, words) = line.split_once(" taps: ").unwrap();
            assert_eq!(numbers(words), numbers(taps), "{way} on {backend}: {line}");
            assert!(words.contains("strain_limit+ambiguous"), "{way} on {backend}: {line}");
            let run: serde_json::Value = serde_json::from_str(&desk.read("out/run.json")).unwrap();
            let counts = &run["counts"];
            let sum =
                |key: &str| counts[key].as_object().unwrap().values().filter_map(|n| n.as_u64()).sum::<u64>();
            assert_eq!(sum("combinations"), numbers(taps), "{way} on {backend}: {counts}");
            assert!(sum("status") > numbers(taps), "{way} on {backend}: {counts}");
        }
    }
}
