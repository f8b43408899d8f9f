//! Estimated duration of a run on all CPU threads, s, to the order of magnitude: decides if a device is worth using.

use crate::chart::scope::Scope;
use crate::scene::search::Search;
use crate::scene::{Contact, Geometry, Precision, RunOptions, Setup, Space, Study};

/// CPU seconds of one thread per tap: solved in f32 without friction; read from charts with one drive per design; or with shared drives.
const SOLVED: f64 = 1.5e-6;
const READ: f64 = 6e-8;
const READ_TOGETHER: f64 = 1.5e-9;

/// Cost factors of friction and of f64 for a solved tap.
const FRICTION: f64 = 4.0;
const DOUBLE: f64 = 2.0;

const SEARCHED: f64 = 2e4;

pub fn of_study(study: &Study, options: &RunOptions) -> f64 {
    let Some(layout) = study.space.layout() else {
        let taps = match &study.space {
            Space::List(listed) => listed.len() as f64,
            Space::Grid(_) => 0.0,
        };
        return solved(taps, &study.setup, options);
    };
    let taps = layout.len() as f64;
    if options.precision == Some(Precision::F64) || !Scope::fits(study, &layout) {
        return solved(taps, &study.setup, options);
    }
    let each = if layout.drives().is_some_and(|axis| axis.len() > 1) { READ_TOGETHER } else { READ };
    shared(taps * each, options)
}

pub fn of_search(search: &Search, space: &Space, setup: &Setup, options: &RunOptions) -> f64 {
    let distances = space.layout().map_or(1, |layout| layout.n_distances);
    let samples = search.robust.as_ref().map_or(0, |robust| robust.samples);
    let taps = SEARCHED * (1.0 + samples as f64) * distances as f64;
    solved(taps, setup, options)
}

fn solved(taps: f64, setup: &Setup, options: &RunOptions) -> f64 {
    let friction = matches!(setup.model.contact, Contact::Stick | Contact::Coulomb(f64::MIN_POSITIVE..));
    let mut each = SOLVED;
    if friction {
        each *= FRICTION;
    }
    if options.precision == Some(Precision::F64) {
        each *= DOUBLE;
    }
    // Closed forms are fast on any backend.
    if setup.model.geometry == Geometry::Linear {
        each = 0.0;
    }
    shared(taps * each, options)
}

fn shared(seconds: f64, options: &RunOptions) -> f64 {
    let threads = options.threads.unwrap_or_else(rayon::current_num_threads);
    seconds / threads.max(1) as f64
}
