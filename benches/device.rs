//! Wall times of the parts of a run on the device of `--backend gpu`: `cargo bench --bench device`. Ranked whiskers: charts, shader
//! with its check, full batches, single and overlapped. Kernels of solved taps: compilation, and a full batch, compared with the CPU.

use std::sync::{Arc, Mutex};
use std::time::Instant;

use vibrissa::backend::Choice;
use vibrissa::census::bench::taps;
use vibrissa::census::cases;
use vibrissa::chart::ranker::{Ranker, Rankers};
use vibrissa::error::SolveError;
use vibrissa::evaluate::{Evaluator, Method};
use vibrissa::kernel::gpu::Gpu;
use vibrissa::kernel::gpu::ranking::DeviceRanker;
use vibrissa::kernel::{Job, Solution, Solver, Tap};
use vibrissa::scene::{BackendChoice, Precision, RunOptions};
use vibrissa::spec;

const BATCHES: u64 = 8;

/// Taps of a batch; the best round counts.
const TAPS: usize = 1 << 18;
const ROUNDS: usize = 3;

const PRACTICAL: &str =
    "[model]\nsurface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }\n";

/// Seconds that a solver has spent; clones share them.
#[derive(Clone, Default)]
struct Account(Arc<Mutex<f64>>);

impl Account {
    /// Since the last call.
    fn take(&self) -> f64 {
        std::mem::take(&mut *self.0.lock().expect("no thread failed"))
    }
}

/// A solver whose time is taken.
struct Probe(Box<dyn Solver>, Account);

impl Solver for Probe {
    fn solve(
        &mut self,
        job: &Job<'_>,
        taps: &[Tap<f64>],
        out: &mut Vec<Solution<f64>>,
    ) -> Result<(), SolveError> {
        let (solved, spent) = seconds(|| self.0.solve(job, taps, out));
        *self.1.0.lock().expect("no thread failed") += spent;
        solved
    }

    fn device(&mut self) -> Option<&mut Gpu> {
        self.0.device()
    }

    fn batch_limit(&self) -> usize {
        self.0.batch_limit()
    }

    fn has_full_newton(&self) -> bool {
        self.0.has_full_newton()
    }
}

fn seconds<T>(f: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = f();
    (value, start.elapsed().as_secs_f64())
}

fn options(backend: BackendChoice, precision: Precision) -> RunOptions {
    RunOptions { backend: Some(backend), precision: Some(precision), ..RunOptions::default() }
}

/// A ranked sweep; each design has its own drive, or all share `drives` drives.
fn ranked(name: &str, model: &str, drives: u32, by: &str) {
    let n: u64 = 40_000_000;
    let theta = match drives {
        0 => format!("{{ min = 0.5, max = 10, samples = {n} }}"),
        _ => format!("{{ from = 0.5, to = 10, steps = {drives} }}"),
    };
    let text = format!(
        "[whisker]\nD = {{ min = 8, max = 12, samples = {n} }}\nd = {{ min = 2, max = 7, samples = {n} }}\nL_a = 50\n[gauge]\nx_ss = {{ min = 3, max = 15, samples = {n} }}\nl = 2\nnoise_strain = 2e-5\n[tap]\na = {{ from = 21, to = 48, steps = 10 }}\ntheta = {theta}\n{model}[output]\ntuples = false\ndistances = false\ntop = 100\nby = \"{by}\"\n"
    );
    let study = spec::parse("device.toml", &text, std::path::Path::new("")).expect("a valid spec").study;
    let layout = study.space.layout().expect("a grid");
    let (charts, charting) = seconds(|| Ranker::new(&study, &layout, 1e-5).expect("taps are solved"));
    let charts = Rankers(vec![charts]);
    let choice = Choice::new(&options(BackendChoice::Gpu, Precision::F32)).expect("a device");
    let method = choice.open(&study.setup.model).expect("the device opens");
    let mut evaluator = Evaluator::new(&study.setup, method);
    let (device, compiling) = seconds(|| charts.on_device(&mut evaluator, &layout).expect("it ranks"));
    let mut device = device.expect("it serves devices");
    let most = device.most();
    let run = |device: &mut DeviceRanker, overlapped: bool| {
        let mut done = 0;
        for k in 0..BATCHES {
            device.start(k * most..(k + 1) * most, 0.0);
            if !(overlapped && k == 0) {
                done += u64::from(device.finish().expect("a batch").is_ok());
            }
        }
        while let Some(batch) = device.finish() {
            done += u64::from(batch.is_ok());
        }
        assert_eq!(done, BATCHES, "batches that came back");
    };
    let alone = seconds(|| run(&mut device, false)).1;
    let both = seconds(|| run(&mut device, true)).1;
    let rate = (BATCHES * most * layout.block()) as f64 / both / 1e9;
    println!(
        "{name}: charts {charting:.3}, shader {compiling:.3}, {BATCHES} batches of {most} designs {alone:.4}, overlapped {both:.4}: {rate:.2} G taps/s"
    );
}

fn solved(name: &str, precision: Precision) {
    let c = cases::all().into_iter().find(|c| c.name == name).expect("a configuration");
    let many = taps(&c, TAPS);
    let few = taps(&c, 64);
    let tolerance = if precision == Precision::F32 { 1e-5 } else { 1e-8 };
    let mut line = format!("{name} {precision:?}:");
    for backend in [BackendChoice::Gpu, BackendChoice::Cpu] {
        let choice = Choice::new(&options(backend, precision)).expect("a backend");
        let account = Account::default();
        let probe = Probe(choice.solver().expect("it opens"), account.clone());
        let method = Method::fast(Box::new(probe), precision, &many.setup.model.material, tolerance);
        let mut evaluator = Evaluator::new(&many.setup, method);
        let first = seconds(|| evaluator.run(&few.designs, &few.tasks).expect("it answers")).1;
        account.take();
        let (mut all, mut kernel) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            let (_, whole) = seconds(|| evaluator.run(&many.designs, &many.tasks).expect("it answers"));
            all = all.min(whole);
            kernel = kernel.min(account.take());
        }
        let rate = |s: f64| many.tasks.len() as f64 / s / 1e6;
        line += &format!(
            " {backend:?} first {first:.2} s, {:.1} M taps/s, solver {:.1};",
            rate(all),
            rate(kernel)
        );
    }
    println!("{line}");
}

fn main() {
    // `cargo test` also runs bench targets: skip it.
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    let (choice, opening) =
        seconds(|| Choice::new(&options(BackendChoice::Gpu, Precision::F32)).expect("a device"));
    println!("{}: found in {opening:.3} s", choice.backend.adapter.as_deref().unwrap_or("no device"));
    ranked("ideal", "", 0, "K_sd");
    ranked("practical", PRACTICAL, 0, "K_sd");
    ranked("practical, 100 drives", PRACTICAL, 100, "K_sd");
    ranked("practical, 100 drives, by total", PRACTICAL, 100, "total_rms_mm");
    for precision in [Precision::F32, Precision::F64] {
        for name in ["hooke", "neo", "mooney-coulomb"] {
            solved(name, precision);
        }
    }
}
