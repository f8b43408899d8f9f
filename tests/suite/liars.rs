//! Devices that fail or lie: an adapter does on purpose what a broken one does, at some dispatches or from one on. Each is found; the tables
//! are those of an honest device, or the rows that the CPU or the reference answered are listed.

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use serde_json::Value;
use vibrissa::backend::Choice;
use vibrissa::census::hard;
use vibrissa::design::{Design, amount};
use vibrissa::kernel::cpu::Cpu;
use vibrissa::kernel::gpu::lie::{Kind, Lie};
use vibrissa::kernel::gpu::{Adapter, Gpu, adapters};
use vibrissa::kernel::tap::{Ask, Frame};
use vibrissa::kernel::{Effects, Job, Rung, Solver, Tap};
use vibrissa::physics::onset::Grip;
use vibrissa::plan::Plan;
use vibrissa::progress::Silent;
use vibrissa::scene::{BackendChoice, Precision, RunOptions, Setup, Tuple};
use vibrissa::spec;
use vibrissa::sweep::{self, Target};

use crate::common::program::{Desk, SPEC};
use crate::common::sweeping::{CPU, GPU, Table};

/// Taps of every kind on two rungs, not so many that a chart pays: designs interleave.
const ROWS: usize = 3000;

fn list() -> String {
    let row = |i: usize| {
        let design = i % 60;
        let (d, place) = (3.0 + 0.1 * design as f64, 3 + design % 4);
        format!("10,{d},50,{place},2,{},{}\n", 12 + i * 7 % 37, 0.5 + (i * 11 % 40) as f64 * 0.5)
    };
    format!("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n{}", (0..ROWS).map(row).collect::<String>())
}

const LISTED: &str = "[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\n[model]\nsurface = true\n";

/// Ranked from the chart of the rod, on the device.
const RANKED: &str = "[whisker]\nD = [8, 10]\nd = { from = 4, to = 9, steps = 10_000 }\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                      [tap]\na = [15, 28, 41, 48]\ntheta = { from = 1, to = 12, steps = 9 }\n[output]\ntop = 30\nby = \"total_rms_mm\"\n";

/// A whisker as built, all of whose numbers are answers.
const BUILT: &str = "[whisker]\nD = 10\nd = [5, 6]\nL_a = 50\nbore = 4\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = [21, 33, 45]\ntheta = [0.001, 1, 4]\n\
                     [model]\nsurface = true\n[output]\nwrench = true\n";

/// A cone whose base wrench is asked.
const WRENCH: &str = "[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\n[model]\nextension = true\n[output]\nwrench = true\n";

fn adapter() -> Adapter {
    static ALL: OnceLock<Vec<Adapter>> = OnceLock::new();
    ALL.get_or_init(adapters).first().expect("an adapter (Debian: apt install mesa-vulkan-drivers)").clone()
}

/// A watched device that lies so; nothing is known of it.
fn liar(kind: Kind, when: Range<u64>) -> Choice {
    liar_in(Precision::F32, kind, when)
}

fn liar_in(precision: Precision, kind: Kind, when: Range<u64>) -> Choice {
    let (backend, precision) = (Some(BackendChoice::Gpu), Some(precision));
    let options = RunOptions { backend, precision, ..RunOptions::default() };
    let adapter = adapter().lying(Arc::new(Lie::new(kind, when)));
    Choice::among(&options, &[adapter]).unwrap().watched_anew()
}

/// Tables of a sweep, and its run.json.
fn swept(text: &str, choice: &Choice) -> (Vec<String>, Value) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("list.csv"), list()).unwrap();
    let spec = spec::parse("spec.toml", text, folder.path()).unwrap();
    let (plan, never) = (Plan::new(&spec.study, choice).unwrap(), AtomicBool::new(false));
    let out = folder.path().join("out");
    sweep::run(&spec, &plan, choice, &Target::new(&out, &never), &mut Silent)
        .unwrap_or_else(|e| panic!("{e}"));
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let tables = ["tuples.csv", "designs.csv", "distances.csv"].map(read).into();
    (tables, serde_json::from_str(&read("run.json")).unwrap())
}

/// The tables of an honest device that nobody watches, and of the CPU.
fn honest(text: &'static str) -> &'static [Vec<String>; 2] {
    static BOTH: [OnceLock<[Vec<String>; 2]>; 4] = [const { OnceLock::new() }; 4];
    let at = [LISTED, RANKED, BUILT, WRENCH].iter().position(|t| *t == text).expect("a text of this file");
    BOTH[at].get_or_init(|| [GPU, CPU].map(|place| swept(text, &place.choice()).0))
}

/// Every number of `found` is that of `wanted` to the tolerance.
fn close(found: &str, wanted: &str) {
    for (found, wanted) in found.lines().zip(wanted.lines()) {
        for (x, y) in found.split(',').zip(wanted.split(',')) {
            let same = match (x.parse::<f64>(), y.parse::<f64>()) {
                // K − 1 and what follows from it are small beside the strain that the tolerance bounds.
                (Ok(x), Ok(y)) => (x - y).abs() <= 1e-3 * y.abs() + 2e-5,
                _ => x == y,
            };
            assert!(same, "{found}\n{wanted}");
        }
    }
}

fn device(run: &Value) -> &Value {
    &run["backend"]["device"]
}

/// Taps of `key` of the device's record.
fn count(run: &Value, key: &str) -> u64 {
    device(run)[key].as_u64().unwrap_or_else(|| panic!("{run}"))
}

#[test]
fn an_honest_device_is_checked_and_left_alone() {
    for text in [LISTED, RANKED, BUILT, WRENCH] {
        let (tables, run) = swept(text, &liar(Kind::Flip(1), 0..0));
        assert!(tables == honest(text)[0], "other bytes where a device is watched");
        assert!(
            (text == BUILT || count(&run, "self_checked_kernels") >= 1) && run["handed_over"].is_null(),
            "{run}"
        );
        let worst = device(&run)["self_check_worst"].as_f64().unwrap();
        assert!((text == BUILT || worst > 0.0) && worst < 1.0, "{worst}");
        assert_eq!([&device(&run)["words"], &run["warnings"]], [&Value::Array(Vec::new()); 2]);
        assert!(text == RANKED || count(&run, "compared_taps") >= 32, "{run}");
        let worst = device(&run)["compared_worst"].as_f64().unwrap();
        assert!(worst < 1.0, "{worst}");
    }
}

/// One dispatch of the first batch goes wrong in every way: it is done again, and nothing is to be seen of it but in run.json.
#[test]
fn what_goes_wrong_once_is_done_again() {
    for kind in [Kind::Flip(64), Kind::Stale, Kind::Skip, Kind::Lose, Kind::Panic, Kind::Hang] {
        let (tables, run) = swept(LISTED, &liar(kind, 1..2));
        assert!(tables == honest(LISTED)[0], "{kind:?}: other bytes");
        assert_eq!((count(&run, "reopened"), count(&run, "handed_over_taps")), (1, 0), "{kind:?}: {run}");
        assert!(run["handed_over"].is_null());
        let words = device(&run)["words"][0].as_str().unwrap();
        assert!(words.contains("a batch of 3000 taps was tried once more"), "{kind:?}: {words}");
    }
}

/// From the first batch on nothing comes back as it should: every tap is handed over to the CPU, whose tables they are.
#[test]
fn what_goes_wrong_for_good_is_handed_over() {
    for kind in [Kind::Flip(7), Kind::Stale, Kind::Skip, Kind::Lose, Kind::Panic, Kind::Hang] {
        let (tables, run) = swept(LISTED, &liar(kind, 1..u64::MAX));
        assert!(tables == honest(LISTED)[1], "{kind:?}: not the CPU's bytes");
        assert!(count(&run, "handed_over_taps") >= ROWS as u64, "{kind:?}: {run}");
        let (list, last) = (&run["handed_over"], ROWS as u64);
        assert_eq!(
            (list[0]["from"].as_u64(), list[0]["to"].as_u64()),
            (Some(1), Some(last)),
            "{kind:?}: {list}"
        );
        let words = device(&run)["words"].to_string();
        assert!(words.contains("was handed over to the CPU"), "{kind:?}: {words}");
    }
}

/// Strain, forces, wrench or arc alone is wrong: it is found beside the CPU's, nothing of the device is given out, and `warnings` says so. Of cones from the first
/// batch on, whose kernels have passed their self-check by then.
#[test]
fn an_answer_that_is_wrong_in_one_number_is_not_given_out() {
    let cases: [(&'static str, &[usize], u64); 3] =
        [(BUILT, &[0, 1, 2, 3, 4, 5, 6], 0), (LISTED, &[0, 2, 3], 1), (WRENCH, &[3, 7], 1)];
    for (text, places, from) in cases {
        for &place in places {
            let (tables, run) = swept(text, &liar(Kind::Off(place), from..u64::MAX));
            assert!(tables == honest(text)[1], "number {place} of {text}: not the CPU's bytes");
            let warnings = run["warnings"].to_string();
            assert!(warnings.contains("answers") && warnings.contains("are wrong"), "{place}: {run}");
            assert!(count(&run, "handed_over_taps") > 0 && !run["handed_over"].is_null(), "{place}: {run}");
        }
    }
}

/// Few answers that never come, or are no numbers, are those of the reference.
#[test]
fn a_few_missing_answers_are_left_to_the_reference() {
    // Bits turn in the batch and in the batch once more; what is no number, where the seal does not know its bits, is not tried again.
    for (kind, times, least, precision) in
        [(Kind::Flip(70), 2, 200, Precision::F32), (Kind::NotANumber(100), 1, 30, Precision::F64)]
    {
        let (tables, run) = swept(LISTED, &liar_in(precision, kind, 1..1 + times));
        tables.iter().zip(&honest(LISTED)[0]).for_each(|(found, wanted)| close(found, wanted));
        let n = count(&run, "recomputed_taps");
        assert!(n >= least && count(&run, "handed_over_taps") == 0, "{kind:?}: {run}");
        assert_eq!(run["handed_over"][0]["to"].as_u64(), Some(ROWS as u64), "{run}");
    }
}

#[test]
fn a_device_without_memory_gets_smaller_batches() {
    let (tables, run) = swept(LISTED, &liar(Kind::Room(1600), 1..u64::MAX));
    assert!(tables == honest(LISTED)[0], "other bytes");
    assert!(count(&run, "smaller_batches") == 1 && run["handed_over"].is_null(), "{run}");
    // Not even the least batch fits.
    let (tables, run) = swept(LISTED, &liar(Kind::Room(300), 1..u64::MAX));
    assert!(tables == honest(LISTED)[1] || count(&run, "handed_over_taps") > 0, "{run}");
    assert!(device(&run)["words"].to_string().contains("out of memory"), "{run}");
}

/// A ranking that goes wrong, once or for good; kept rows are solved tap by tap in any case.
#[test]
fn a_ranking_that_goes_wrong_is_done_again_or_by_the_cpu() {
    // Dispatches 0 to 15 check the ranking.
    for kind in [Kind::Flip(3), Kind::Stale, Kind::Skip, Kind::Lose, Kind::Hang] {
        let (tables, run) = swept(RANKED, &liar(kind, 17..18));
        assert!(tables == honest(RANKED)[0], "{kind:?}: other bytes");
        assert!(count(&run, "reopened") >= 1, "{kind:?}: {run}");
        assert!(device(&run)["words"].to_string().contains("while it ranked"), "{kind:?}: {run}");
    }
    let (tables, run) = swept(RANKED, &liar(Kind::Lose, 17..u64::MAX));
    assert!(tables == honest(RANKED)[1], "not the CPU's bytes");
    assert_eq!(run["handed_over"][0]["what"], "kept rows", "{run}");
}

/// A device that ranks wrongly from the start is not let rank.
#[test]
fn a_ranking_that_fails_its_check_is_left_to_the_cpu() {
    for kind in [Kind::Flip(2), Kind::Stale, Kind::Skip, Kind::Wrong] {
        let (tables, run) = swept(RANKED, &liar(kind, 0..1));
        assert!(tables == honest(RANKED)[0], "{kind:?}: other bytes");
        assert!(device(&run)["words"].to_string().contains("the CPU ranks"), "{kind:?}: {run}");
    }
}

/// A kernel that does not compile in time: the CPU has its work from there on, and the device is not asked again.
#[test]
fn a_kernel_that_does_not_compile_in_time_is_left_to_the_cpu() {
    for (text, when) in [(LISTED, 0..u64::MAX), (RANKED, 0..u64::MAX), (RANKED, 1..u64::MAX)] {
        let (tables, run) = swept(text, &liar(Kind::Slow, when));
        assert!(tables == honest(text)[1], "not the CPU's bytes");
        assert!(count(&run, "handed_over_taps") > 0 && count(&run, "reopened") == 0, "{run}");
        assert_eq!(device(&run)["words"].as_array().map(Vec::len), Some(1), "{run}");
        let words = device(&run)["words"][0].as_str().unwrap();
        assert!(
            words.contains("compiling a kernel did not end within")
                && words.contains("the CPU ranks and solves"),
            "{words}"
        );
        assert_eq!(run["handed_over"][0]["from"], 1, "{run}");
    }
    // Where the first kernel is checked before the run, the run takes place too.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("list.csv"), list()).unwrap();
    let setup = spec::parse("spec.toml", LISTED, folder.path()).unwrap().study.setup;
    liar(Kind::Slow, 0..u64::MAX).check(&setup).unwrap();
}

/// Known answers are wrong or missing: refused, with figures; `auto` says why it takes the CPU.
#[test]
fn a_liar_is_refused_at_the_start() {
    let models = [
        LISTED.to_owned(),
        LISTED.replace("surface = true", "extension = true\ncontact = { coulomb = 0.3 }"),
    ];
    for (text, kind) in models.iter().flat_map(|text| {
        [
            Kind::Flip(5),
            Kind::Stale,
            Kind::Skip,
            Kind::Wrong,
            Kind::NotANumber(9),
            Kind::Lose,
            Kind::Panic,
            Kind::Hang,
        ]
        .map(|kind| (text, kind))
    }) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("list.csv"), list()).unwrap();
        let setup = spec::parse("spec.toml", text, folder.path()).unwrap().study.setup;
        let e = liar(kind, 0..u64::MAX).check(&setup).unwrap_err();
        let words = e.to_string();
        let figures = words.chars().any(|c| c.is_ascii_digit()) || kind == Kind::Lose;
        assert!(e.exit_code() == 2 && words.contains("is refused") && figures, "{kind:?}: {words}");
    }
}

/// The verdict lies in the user's cache, is used again, and no state of the cache is an error.
#[test]
fn verdicts_are_kept_in_the_cache() {
    let desk = Desk::new(SPEC);
    let cache = desk.path("cache");
    let sweep = |variables: &[(&str, &str)]| {
        let cache = cache.to_str().unwrap();
        let all: Vec<(&str, &str)> = [("XDG_CACHE_HOME", cache)].iter().chain(variables).copied().collect();
        desk.run_with(&["sweep", "spec.toml", "--backend", "gpu", "--force", "--quiet"], &all).exits(0);
        let run = desk.whole("results/spec");
        (
            run["backend"]["device"]["self_checked_kernels"].as_u64(),
            run["backend"]["device"]["self_checked_before"].as_u64(),
        )
    };
    let n = sweep(&[]).0;
    assert!(n >= Some(1));
    let folder = cache.join("vibrissa").join("devices");
    let files = || -> Vec<std::path::PathBuf> {
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect()
    };
    let [file] = &files()[..] else { panic!("{:?}", files()) };
    let kept = std::fs::read(file).unwrap();
    assert_eq!(sweep(&[]), (n, n), "known");
    assert_eq!(sweep(&[("VIBRISSA_SELF_CHECK", "fresh")]), (n, Some(0)), "asked to check again");
    assert_eq!(sweep(&[("VIBRISSA_SELF_CHECK", "off")]), (None, None), "asked not to");
    for damaged in [&b""[..], b"{", b"\xff\xfe", &kept[..kept.len() / 2], b"{\"of\":[],\"passed\":{}}"] {
        std::fs::write(file, damaged).unwrap();
        assert_eq!(sweep(&[]), (n, Some(0)), "checked again");
        assert!(std::fs::read(file).unwrap() == kept || sweep(&[]) == (n, n), "mended");
    }
    std::fs::remove_dir_all(&cache).unwrap();
    std::fs::write(&cache, "a file in the place of the folder").unwrap();
    assert_eq!(sweep(&[]), (n, Some(0)), "no cache");
    assert_eq!(sweep(&[("XDG_CACHE_HOME", "relative"), ("HOME", "/dev/null")]), (n, Some(0)));
    assert!(Table::read(&desk.path("results/spec/tuples.csv")).rows.len() == 12);
}

/// What makes an answer that is not finite one to be found: no shader gives one, not even of a tap bent by 60°, of which the same kernel on the CPU
/// does. Numbers of sweeps leave room for the seal.
#[test]
fn honest_answers_are_finite() {
    let setup = Setup::default();
    let tuples = [hard::random(setup.drive, false, 400, 9), hard::hard(&setup)].concat();
    let frame = |t: &Tuple| {
        let shared = Design::new(&setup, *t).shared?;
        let (curve, peak, amount) = (&shared.model, shared.peak, amount(setup.drive, t.drive));
        let (side, grip) = (setup.gauge.side, Grip::Slide(0.0));
        Frame::new(&Ask { model: &setup.model, side, curve, peak, a: t.a, amount, grip, start: 0.0 })
            .map(|f| *f.tap())
    };
    let asked: Vec<Tap<f64>> = tuples.iter().filter_map(frame).collect();
    let mut astray = 0;
    for precision in [Precision::F32, Precision::F64] {
        let mut gpu = Gpu::new(adapter(), precision).unwrap();
        let rungs = Rung::ladder(precision, &setup.model.material, 1e-5);
        for rung in rungs.iter().filter(|rung| !rung.spare && !rung.rule.full) {
            let job = Job { effects: Effects::default(), rule: &rung.rule, tolerance: 1e-5, chart: None };
            let (mut found, mut twin) = (Vec::new(), Vec::new());
            gpu.solve(&job, &asked, &mut found).unwrap();
            Cpu::new(precision).solve(&job, &asked, &mut twin).unwrap();
            for (s, twin) in found.iter().zip(&twin) {
                assert!(s.values().iter().all(|x| x.is_finite()), "{precision:?} {:?}: {s:?}", rung.rule);
                assert!((1.0..1024.0).contains(&twin.sweeps) && twin.sweeps.fract() == 0.0, "{twin:?}");
                let lost = !twin.values().iter().all(|x| x.is_finite());
                assert!(!lost || s.error > 1e6, "{precision:?} {:?}: {s:?} and {twin:?}", rung.rule);
                astray += usize::from(lost);
            }
        }
    }
    assert!(astray > 0, "no tap here goes astray");
}
