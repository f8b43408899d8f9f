//! Searches in this process, and the dense sweeps they are compared with.

use std::path::Path;

use vibrissa::optimise::evaluate::Scorer;
use vibrissa::optimise::score::{Goal, Score};
use vibrissa::optimise::session::Found;
use vibrissa::optimise::session::Variables;
use vibrissa::optimise::{self, Report, Step, Watch};
use vibrissa::progress::NEVER;
use vibrissa::scene::Layout;
use vibrissa::scene::sampler::Sampler;
use vibrissa::scene::{RunOptions, Search, Spec, Tuple};
use vibrissa::spec;

use super::sweeping::{CPU_F64, Place};

pub struct Silent;

impl Watch for Silent {
    fn step(&mut self, _: &Step, _: f64, _: bool, _: Option<u64>) {}
}

pub fn parse(text: &str) -> (Spec, Search) {
    spec::parse_search("search.toml", text, Path::new("")).unwrap_or_else(|e| panic!("{e}"))
}

pub fn search(text: &str, place: Place) -> Report {
    let ((spec, search), choice) = (parse(text), place.choice());
    let asked = (&choice, &RunOptions::default(), None);
    optimise::find(&spec, &search, asked, &NEVER, &mut Silent).unwrap_or_else(|e| panic!("{e}"))
}

/// The best of `designs` Sobol points; random steps of falling length refine the `starts` best in f64. Shares only the scores with a search.
pub fn brute(text: &str, goal: Goal, (designs, starts): (u32, usize), place: Place) -> Found {
    let (spec, search) = parse(text);
    let variables = Variables::new(&spec.study.setup, &layout(&spec), &search);
    let (k, drives) = (variables.list.len(), variables.drives());
    let best_of =
        |scorer: &mut Scorer<'_>, places: &[Vec<f64>], keep: usize| -> Vec<(f64, Vec<f64>, Found)> {
            let points: Vec<_> =
                places.iter().flat_map(|u| (0..drives).map(|j| variables.point(u, j))).collect();
            let scores = scorer.scores(&points).unwrap_or_else(|e| panic!("{e}"));
            let mut all: Vec<_> = scores
                .into_iter()
                .zip(points)
                .enumerate()
                .map(|(i, (score, point))| (goal.order(&score), i / drives, Found { point, score }))
                .collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            all.into_iter().take(keep).map(|(order, i, found)| (order, places[i].clone(), found)).collect()
        };
    let mut dense = Scorer::new(&spec.study.setup, &layout(&spec), &search, place.open(&spec.study.setup));
    let mut best: Vec<(f64, Vec<f64>, Found)> = Vec::new();
    for from in (0..designs).step_by(1 << 14) {
        let to = (from + (1 << 14)).min(designs);
        let places: Vec<Vec<f64>> =
            (from..to).map(|i| (0..k).map(|c| coordinate(0, i, c)).collect()).collect();
        best.extend(best_of(&mut dense, &places, starts));
        best.sort_by(|a, b| a.0.total_cmp(&b.0));
        best.truncate(starts);
    }
    let mut precise =
        Scorer::new(&spec.study.setup, &layout(&spec), &search, CPU_F64.open(&spec.study.setup));
    let mut winner: Option<(f64, Found)> = None;
    for (start, (_, u, _)) in best.into_iter().enumerate() {
        let mut here = best_of(&mut precise, &[u], 1).remove(0);
        let mut length = 2.0 * f64::from(designs).powf(-1.0 / k as f64);
        for round in 0..60u32 {
            let step =
                |i: u32, c: usize| length * (2.0 * coordinate(start as u64 + 2, round * 200 + i, c) - 1.0);
            let places: Vec<Vec<f64>> = (0..200)
                .map(|i| here.1.iter().enumerate().map(|(c, x)| (x + step(i, c)).clamp(0.0, 1.0)).collect())
                .collect();
            let next = best_of(&mut precise, &places, 1).remove(0);
            if next.0 < here.0 {
                here = next;
            } else {
                length *= 0.7;
            }
        }
        if winner.as_ref().is_none_or(|w| here.0 < w.0) {
            winner = Some((here.0, here.2));
        }
    }
    winner.expect("a design").1
}

pub fn dense(text: &str, designs: u32, place: Place, each: &mut dyn FnMut(&[Score])) {
    let (spec, search) = parse(text);
    let variables = Variables::new(&spec.study.setup, &layout(&spec), &search);
    let mut scorer = Scorer::new(&spec.study.setup, &layout(&spec), &search, place.open(&spec.study.setup));
    for from in (0..designs).step_by(1 << 14) {
        let to = (from + (1 << 14)).min(designs);
        each(&scorer.scores(&spread(&variables, from..to)).unwrap_or_else(|e| panic!("{e}")));
    }
}

/// Sobol points in the box of `variables`, at the first drive of a list.
pub fn spread(variables: &Variables, indices: std::ops::Range<u32>) -> Vec<Tuple> {
    let place = |i: u32| (0..variables.list.len()).map(|c| coordinate(0, i, c)).collect::<Vec<_>>();
    indices.map(|i| variables.point(&place(i), 0)).collect()
}

fn coordinate(seed: u64, i: u32, c: usize) -> f64 {
    (f64::from(Sampler::Sobol.coordinate(seed, c as u32, i)) + 0.5) / 4_294_967_296.0
}

pub fn layout(spec: &Spec) -> Layout {
    spec.study.space.layout().expect("a search has axes")
}
