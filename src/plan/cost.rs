//! About how long a sweep takes: which way its taps go, times what a tap cost on each way when it was measured
//! (docs/cost.md and the benchmark in results/, two threads of an AMD EPYC). Good to a factor of about three.

use std::time::{Duration, Instant};

use super::Layout;
use crate::backend::{Backend, Choice};
use crate::design::Design;
use crate::evaluate::{Evaluator, Task};
use crate::scene::{
    BackendChoice, Contact, Geometry, Material, Model, RankBy, RunOptions, Space, Study, Tuple,
};
use crate::smooth::{Scope, drives::DriveAxis};
use crate::sweep::CHUNK;

/// How the taps of a sweep are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Rows are ranked from a chart of the rod; those kept are solved.
    Charted,
    /// Along the drives of a distance some taps are solved and the others read.
    OverDrives,
    /// Every tap is solved by a kernel.
    TapByTap,
    /// Every tap is solved by the reference.
    Reference,
}

impl Way {
    /// The way of `study` on `choice`, as far as that can be told without solving anything.
    pub fn of(study: &Study, choice: &Choice) -> Self {
        if choice.backend.tolerance.is_none() {
            return Self::Reference;
        }
        let Space::Grid(factors) = &study.space else { return Self::TapByTap };
        let layout = Layout::new(factors);
        let over = study.setup.model.geometry == Geometry::Exact
            && layout.drives().is_some_and(|axis| DriveAxis::pays(axis.len()))
            && layout.block() <= CHUNK;
        match () {
            () if choice.chart_tolerance().is_some() && Scope::fits(study, &layout) => Self::Charted,
            () if over => Self::OverDrives,
            () => Self::TapByTap,
        }
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Charted => "ranked from a chart",
            Self::OverDrives => "solved at some drives, read at the others",
            Self::TapByTap => "solved tap by tap",
            Self::Reference => "solved by the reference",
        }
    }
}

/// What a tap costs beside its solution, one thread, s.
const AROUND: f64 = 4e-7;
/// A tap that is read from others, s.
const READ: f64 = 2.8e-7;
/// A tap of a chart: a drive of its design's own; a drive shared with other designs; the same where distances are estimated, s.
const CHARTED: [f64; 3] = [2e-8, 7e-10, 2.3e-9];
/// A frictionless Hooke tap on a kernel in f32 and in f64, s.
const KERNEL: [f64; 2] = [2.2e-7, 4.8e-7];
/// Taps a second on a hardware adapter.
const HARDWARE: f64 = 2e7;
/// Opening a device and compiling its shaders; making a chart, s.
const START: [f64; 2] = [0.3, 0.02];
/// Bytes a second of the tables, on one thread.
const WRITTEN: f64 = 1e8;
/// Longest look at taps that may be left to the reference.
const LOOK: Duration = Duration::from_millis(500);

/// Expected seconds of a sweep of `taps` taps and `bytes` bytes of tables on its [`Way`].
pub fn seconds(study: &Study, choice: &Choice, taps: u64, bytes: f64) -> f64 {
    let (way, backend, n) = (Way::of(study, choice), &choice.backend, taps as f64);
    let threads = backend.threads.max(1) as f64;
    let solved = AROUND + kernel(&study.setup.model, backend) + left(study, choice, taps);
    let work = match (way, &study.space) {
        (Way::Reference, _) => n * reference(&study.setup.model),
        (Way::OverDrives, Space::Grid(factors)) => {
            let drives = Layout::new(factors).n_drives;
            n * (READ + solved * DriveAxis::solved(drives, smooth(&study.setup.model)) as f64 / drives as f64)
        }
        (Way::Charted, Space::Grid(factors)) => {
            let layout = Layout::new(factors);
            let tap = CHARTED[match (layout.drives(), study.output.by) {
                (None, _) => 0,
                (Some(_), RankBy::KSd) => 1,
                (Some(_), _) => 2,
            }];
            let kept = (study.output.top.unwrap_or(0) as u64).saturating_mul(layout.n_distances);
            START[1] + n * tap + kept.min(taps) as f64 * solved
        }
        _ => n * solved,
    };
    let start = if backend.adapter.is_some() { START[0] } else { 0.0 };
    start + (work + bytes / WRITTEN) / threads
}

/// Taps a second to expect of mixed work, to the order of magnitude.
pub fn rate(backend: &Backend) -> f64 {
    let each = match (backend.name, backend.precision) {
        ("reference", _) => 1e4,
        ("gpu", _) if !backend.software => return HARDWARE,
        (_, "f32") => 2e6,
        _ => 1e6,
    };
    each * backend.threads as f64
}

/// Whether solutions are smooth over the drive: not where a contact begins to slide.
fn smooth(model: &Model) -> bool {
    !matches!(model.contact, Contact::Coulomb(f64::MIN_POSITIVE..))
}

/// A tap on a kernel, one thread, s.
fn kernel(model: &Model, backend: &Backend) -> f64 {
    let single = backend.precision == "f32";
    let law = match model.material {
        Material::Hooke(_) => 1.0,
        Material::NeoHookean(_) | Material::MooneyRivlin(_) => 1.9,
        Material::Yeoh(_) => 2.2,
    };
    let offset = if model.surface || model.pole_radius > 0.0 { 2.4 } else { 1.0 };
    let stretch = if model.shear || model.extension { 1.5 } else { 1.0 };
    let effects = match (model.geometry, model.contact) {
        (Geometry::Linear, _) => 0.3,
        (_, Contact::Stick | Contact::Coulomb(f64::MIN_POSITIVE..)) if single => 55.0,
        (_, Contact::Stick | Contact::Coulomb(f64::MIN_POSITIVE..)) => 85.0,
        _ => law * f64::max(offset, stretch),
    };
    match &backend.adapter {
        Some(_) if !backend.software => effects.sqrt() * backend.threads.max(1) as f64 / HARDWARE,
        _ => effects * KERNEL[usize::from(!single)],
    }
}

/// A tap on the reference, one thread, s.
fn reference(model: &Model) -> f64 {
    match (model.geometry, model.contact, &model.material) {
        (Geometry::Linear, ..) => AROUND,
        (_, Contact::Coulomb(f64::MIN_POSITIVE..), _) => 4e-3,
        (_, Contact::Stick, _) => 2.5e-3,
        (_, _, Material::Hooke(_)) => 7e-5,
        _ => 2e-3,
    }
}

/// What the reference costs per tap of a kernel, for those that are left to it: looked at on some taps, because it can be
/// thousands of times the kernel's time or nothing.
fn left(study: &Study, choice: &Choice, taps: u64) -> f64 {
    let model = &study.setup.model;
    let referred = model.contact != Contact::Frictionless || !matches!(model.material, Material::Hooke(_));
    if !referred || model.geometry == Geometry::Linear || taps == 0 || choice.backend.tolerance.is_none() {
        return 0.0;
    }
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let Ok(method) = Choice::among(&options, &[]).and_then(|cpu| cpu.open(model)) else { return 0.0 };
    let mut evaluator = Evaluator::new(&study.setup, method);
    let (start, mut looked, mut spent) = (Instant::now(), 0u32, 0.0);
    for tuple in spread(study) {
        let design = [Design::new(&study.setup, tuple)];
        let task = [Task { design: 0, a: tuple.a, drive: tuple.drive }];
        let begun = Instant::now();
        let found = evaluator.run(&design, &task);
        looked += 1;
        if found.is_ok_and(|o| o[0].referred) {
            spent += begun.elapsed().as_secs_f64();
        }
        if start.elapsed() > LOOK {
            break;
        }
    }
    spent / f64::from(looked.max(1))
}

/// Some taps of `study`, without a period.
fn spread(study: &Study) -> Vec<Tuple> {
    const SOME: u64 = 256;
    let place = |i: u64, n: u64| ((i as f64 * 0.618_033_988_749_894_9).fract() * n as f64) as u64;
    match &study.space {
        Space::Grid(factors) => {
            let layout = Layout::new(factors);
            (1..=SOME.min(layout.len())).map(|i| layout.tuple(place(i, layout.len()))).collect()
        }
        Space::List(tuples) => {
            let n = tuples.len() as u64;
            (1..=SOME.min(n)).map(|i| tuples[place(i, n) as usize]).collect()
        }
        Space::File(file) => {
            let rows = file.rows().map(|mut rows| (0..SOME).map_while(|_| rows.next().ok()).collect());
            rows.unwrap_or_default()
        }
    }
}
