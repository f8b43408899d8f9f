//! Cost of each effect: time per tap relative to the frictionless Hooke kernel on the same backend, as a markdown table.
//!
//! Every configuration solves the same random taps through all rungs. Configurations take turns and the best round counts, so that disturbances
//! affect all. With the argument `poles`: tilted poles and a second gauge, in CPU time of one thread relative to the upright pole of the same round
//! (median).

mod clock;

use std::sync::LazyLock;
use std::time::Instant;

use clock::spent;
use rayon::prelude::*;
use vibrissa::census::{Place, present};
use vibrissa::chart::{ranges::Wanted, reader::Reader};
use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Method, Source, Task};
use vibrissa::kernel::tap::Frame;
use vibrissa::kernel::{self, Effects, Tap};
use vibrissa::physics::driven::Driven;
use vibrissa::scene::Grip;
use vibrissa::scene::sampler::Sampler;
use vibrissa::scene::{BackendChoice, Direction, Precision, RunOptions, Setup, Tuple};
use vibrissa::spec;

/// Taps of a batch; the variable TAPS sets another number (a large GPU needs 10⁶).
static TAPS: LazyLock<u32> = LazyLock::new(|| match std::env::var("TAPS") {
    Ok(taps) => taps.parse().expect("TAPS is a number"),
    Err(_) => 1 << 15,
});

const ROUNDS: usize = 5;

/// Name and `[model]`; the first is the baseline.
const MODELS: [(&str, &str); 11] = [
    ("hooke, every effect off", ""),
    (
        "hooke, each effect written as off",
        "shear = false\nextension = false\nsurface = false\npole_radius = 0.0\ncontact = \"frictionless\"",
    ),
    ("hooke, an effect that is on but of no size", "pole_radius = 1e-9"),
    ("shear", "shear = true"),
    ("extension", "extension = true"),
    ("surface", "surface = true"),
    ("pole of 3 mm", "pole_radius = 3.0"),
    ("neo-hookean", "material = { neo-hookean = 3.2 }"),
    ("mooney-rivlin", "material = { mooney-rivlin = [0.35, 0.15] }"),
    ("yeoh", "material = { yeoh = [0.5, -0.08, 0.02] }"),
    ("neo-hookean, surface, shear, extension", NEO),
];

const NEO: &str = "surface = true\nshear = true\nextension = true\nmaterial = { neo-hookean = 3.2 }";

/// Name, lines for the gauge, tilt and lean in degrees.
const POLES: [(&str, &str, Option<[f64; 2]>); 7] = [
    ("upright, one gauge", "", None),
    ("tilt and lean written as 0", "", Some([0.0; 2])),
    ("tilt 20°", "", Some([20.0, 0.0])),
    ("tilt −35°, lean 10°", "", Some([-35.0, 10.0])),
    ("upright, two gauges", "second = true", None),
    ("tilt 20°, two gauges", "second = true", Some([20.0, 0.0])),
    ("tilt −35°, lean 10°, two gauges", "second = true", Some([-35.0, 10.0])),
];

/// Distances of the taps of [`POLES`], mm; each has a chart.
const DISTANCES: [f64; 3] = [24.0, 33.0, 45.0];

const PAIRED: usize = 15;

fn setup(model: &str) -> Setup {
    rig(model, "", "")
}

fn rig(model: &str, gauge: &str, tap: &str) -> Setup {
    let text = format!(
        "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n{gauge}\n[tap]\na = 33\ntheta = 4\n{tap}\n[model]\n{model}\n"
    );
    spec::parse("effects.toml", &text, std::path::Path::new("")).expect("a valid model").study.setup
}

/// D 8…12, d 2…7, a 20…48 mm, θ 0.5…10°.
fn tuple(index: u32) -> Tuple {
    let unit = |dimension| f64::from(Sampler::Random.coordinate(1, dimension, index)) / 2f64.powi(32);
    let between = |dimension, from: f64, to: f64| from + (to - from) * unit(dimension);
    Tuple {
        D: between(0, 8.0, 12.0),
        d: between(1, 2.0, 7.0),
        L_a: 50.0,
        x_ss: 5.0,
        l: 2.0,
        a: between(2, 20.0, 48.0),
        drive: between(3, 0.5, 10.0),
        ..Tuple::default()
    }
}

/// The taps of a configuration.
fn framed(setup: &Setup) -> (Effects, Vec<Tap<f64>>) {
    let tap = |index: u32| {
        let t = tuple(index);
        let shared = Design::new(setup, t).shared?;
        Frame::new(setup, &shared, (t.a, Driven::of_users(setup.drive, t.drive)), Grip::Slide(0.0))
            .map(|frame| *frame.tap())
    };
    (
        Effects::new(&setup.model, setup.gauge.side, false),
        (0..*TAPS).into_par_iter().filter_map(tap).collect(),
    )
}

struct Ready {
    method: Method,
    taps: (Effects, Vec<Tap<f64>>),
    best: f64,
    sweeps: f64,
    lost: usize,
}

impl Ready {
    fn run(&mut self) {
        let Method::Fast { solver, ladder, tolerance } = &mut self.method else {
            unreachable!("no reference here")
        };
        let (mut out, (effects, taps)) = (Vec::new(), &self.taps);
        let start = Instant::now();
        kernel::solve(solver.as_mut(), *effects, &ladder.rungs, *tolerance, taps, &mut out)
            .expect("the backend answers");
        self.best = self.best.min(start.elapsed().as_secs_f64());
        self.sweeps = out.iter().map(|s| s.sweeps).sum::<f64>() / f64::from(*TAPS);
        self.lost = out.iter().filter(|s| !s.within(*tolerance)).count();
    }
}

fn measured(place: &Place, scenes: &[Setup]) -> Vec<Ready> {
    let ready = |setup: &Setup| {
        let method = place.choice.open(&setup.model).expect("the backend opens");
        Ready { method, taps: framed(setup), best: f64::INFINITY, sweeps: 0.0, lost: 0 }
    };
    let mut all: Vec<Ready> = scenes.iter().map(ready).collect();
    // The first round includes compilation.
    all.iter_mut().for_each(Ready::run);
    all.iter_mut().for_each(|r| r.best = f64::INFINITY);
    for _ in 0..ROUNDS {
        all.iter_mut().for_each(Ready::run);
    }
    all
}

struct Pole {
    setup: Setup,
    designs: Vec<Design>,
    tasks: Vec<Task>,
    reader: Option<Reader>,
}

impl Pole {
    fn new(model: &str, (gauge, direction): (&str, Option<[f64; 2]>)) -> Self {
        let said = direction.map(|[tilt, lean]| format!("tilt = {tilt}\nlean = {lean}")).unwrap_or_default();
        let setup = rig(model, gauge, &said);
        let [tilt, lean] = direction.unwrap_or([0.0; 2]);
        let direction = Direction { tilt, lean };
        let at = |index: u32| Tuple { a: DISTANCES[index as usize % 3], ..tuple(index).towards(direction) };
        let tuples: Vec<Tuple> = (0..*TAPS).map(at).collect();
        let wanted = Wanted {
            D: [8.0, 12.0],
            d: [2.0, 7.0],
            L_a: [50.0; 2],
            x_ss: [5.0; 2],
            l: [2.0; 2],
            drive: [0.5, 10.0],
        };
        let reader = Reader::new(&setup, (&DISTANCES, &[direction]), &wanted, 1e-5).expect("taps are solved");
        Self {
            designs: tuples.iter().map(|t| Design::new(&setup, *t)).collect(),
            tasks: (0..).zip(&tuples).map(|(i, t)| Task::of(i, t)).collect(),
            setup,
            reader,
        }
    }

    /// CPU seconds to solve and to read all taps; NaN without a chart.
    fn run(&self, place: &Place) -> [f64; 2] {
        let method = place.choice.open(&self.setup.model).expect("the backend opens");
        let mut evaluator = Evaluator::new(&self.setup, method);
        // A run before, to allocate memory.
        drop(evaluator.run(&self.designs, &self.tasks));
        let solved = spent(|| drop(evaluator.run(&self.designs, &self.tasks).expect("the backend answers")));
        let read = |reader: &Reader| spent(|| drop(reader.read(&self.setup, &self.designs, &self.tasks)));
        [solved, self.reader.as_ref().map_or(f64::NAN, read)]
    }
}

/// Times relative to the first of [`POLES`], for solving and for reading: median over rounds.
fn poles(place: &Place, model: &str) -> Vec<[f64; 2]> {
    let all: Vec<Pole> =
        POLES.iter().map(|(_, gauge, direction)| Pole::new(model, (gauge, *direction))).collect();
    let round = |_| all.iter().map(|pole| pole.run(place)).collect::<Vec<_>>();
    let rounds: Vec<Vec<[f64; 2]>> = (0..=PAIRED).map(round).skip(1).collect();
    let ratio = |i: usize, k: usize| {
        let mut ratios: Vec<f64> = rounds.iter().map(|times| times[i][k] / times[0][k]).collect();
        ratios.sort_by(f64::total_cmp);
        ratios[PAIRED / 2]
    };
    (0..all.len()).map(|i| [ratio(i, 0), ratio(i, 1)]).collect()
}

fn told_of_poles() {
    let options = RunOptions {
        backend: Some(BackendChoice::Cpu),
        precision: Some(Precision::F32),
        ..RunOptions::default()
    };
    let models = [
        ("hooke", ""),
        ("surface, pole of 3 mm", "surface = true\npole_radius = 3.0"),
        ("neo-hookean, surface, shear, extension", NEO),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    // The backend is opened in the thread that uses it.
    let columns = pool.install(|| {
        let place = present(&options, None).expect("the CPU").remove(0);
        models.map(|(_, model)| poles(&place, model))
    });
    let names = models.map(|(name, _)| format!("{name}: solved | read"));
    println!("| pole, cpu f32 | {} |", names.join(" | "));
    println!("|---|{}", "---|".repeat(2 * models.len()));
    for (i, (name, ..)) in POLES.iter().enumerate() {
        let shown = |x: f64| if x.is_finite() { format!("{x:.2}") } else { "–".to_owned() };
        let cells: Vec<String> = columns.iter().flat_map(|c| c[i].map(shown)).collect();
        println!("| {name} | {} |", cells.join(" | "));
    }
}

fn main() {
    // `cargo test` also runs bench targets: skip it.
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    if std::env::args().any(|a| a == "poles") {
        told_of_poles();
        return;
    }
    let scenes: Vec<Setup> = MODELS.iter().map(|(_, model)| setup(model)).collect();
    let places: Vec<Place> = present(&RunOptions::default(), None)
        .expect("backends")
        .into_iter()
        .filter(|p| p.label() != "gpu f64")
        .collect();
    let columns: Vec<Vec<Ready>> = places.iter().map(|p| measured(p, &scenes)).collect();
    let label = |p: &Place| match &p.backend().adapter {
        Some(name) => format!("{} ({name})", p.label()),
        None => p.label(),
    };
    let labels: Vec<String> = places.iter().map(label).collect();
    println!("| model | {} | sweeps, {} |", labels.join(" | "), labels.join(" / "));
    println!("|---|{}", "---|".repeat(places.len() + 1));
    for (i, (name, _)) in MODELS.iter().enumerate() {
        let ratios: Vec<String> = columns.iter().map(|c| format!("{:.2}", c[i].best / c[0].best)).collect();
        let sweeps: Vec<String> = columns.iter().map(|c| format!("{:.1}", c[i].sweeps)).collect();
        println!("| {name} | {} | {} |", ratios.join(" | "), sweeps.join(" / "));
    }
    let rate = |c: &Vec<Ready>| format!("{:.1}", f64::from(*TAPS) / c[0].best / 1e6);
    println!("\nfirst line, million taps/s: {}", columns.iter().map(rate).collect::<Vec<_>>().join(", "));
    let lost: Vec<usize> = columns.iter().map(|c| c.iter().map(|r| r.lost).sum()).collect();
    println!("taps not converged, of {} solved: {lost:?}\n", MODELS.len() as u32 * *TAPS);
}
