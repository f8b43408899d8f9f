//! `sweeps/practical.toml`: every backend gives the same K. A machine without an adapter fails.

use std::path::Path;

use vibrissa::backend::Choice;
use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Outcome, Task};
use vibrissa::plan::Layout;
use vibrissa::scene::{BackendChoice, RunOptions, Space, Study};
use vibrissa::spec;

/// All taps of `study` on a backend.
fn taps(study: &Study, backend: BackendChoice) -> Vec<Outcome> {
    let options = RunOptions { backend: Some(backend), ..RunOptions::default() };
    let choice = Choice::new(&options).unwrap();
    let mut evaluator = Evaluator::new(&study.setup, choice.open(&study.setup.model).unwrap());
    let Space::Grid(factors) = &study.space else { panic!("a grid was expected") };
    let layout = Layout::new(factors);
    let designs: Vec<Design> =
        (0..layout.n_designs).map(|k| Design::new(&study.setup, layout.design(k))).collect();
    let tasks: Vec<Task> = (0..layout.len())
        .map(|t| {
            let (k, tap) = (t / layout.block(), t % layout.block());
            let (i, j) = (tap / layout.n_drives, tap % layout.n_drives);
            let drive = layout.drive(&designs[k as usize].tuple, j);
            Task { design: k as u32, a: layout.distance(i), drive, ..Task::default() }
        })
        .collect();
    evaluator.run(&designs, &tasks).unwrap()
}

#[test]
fn backends_agree_on_the_practical_whiskers() {
    let path = Path::new(crate::common::ROOT).join("sweeps/practical.toml");
    let study = spec::read(&path).unwrap().study;
    let reference = taps(&study, BackendChoice::Reference);
    assert_eq!(reference.len(), 330);
    for backend in [BackendChoice::Cpu, BackendChoice::Gpu] {
        for (fast, exact) in taps(&study, backend).iter().zip(&reference) {
            assert_eq!(fast.status, exact.status, "{backend:?}");
            assert!(exact.status.counts(), "{exact:?}");
            let k = |tap: &Outcome| (tap.strain_linear / tap.strain).abs();
            assert!((k(fast) / k(exact) - 1.0).abs() < 1e-4, "{backend:?}: {fast:?} for {exact:?}");
        }
    }
}
