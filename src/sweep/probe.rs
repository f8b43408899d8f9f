//! Estimates the duration of a sweep by timing a few of its taps on its backend.

use std::time::Instant;

use super::{Run, charted};
use crate::backend::Choice;
use crate::census;
use crate::chart::{lanes::Found, ranker::Rankers};
use crate::curve::both::TAPS;
use crate::error::Error;
use crate::kernel::ranking::Case;
use crate::plan::{CHUNK, Plan};
use crate::progress::{NEVER, Silent};
use crate::scene::{Layout, Space, Study, Tuple};

/// A sample that takes this long is large enough, s.
const ENOUGH: f64 = 0.03;
const LOOK: f64 = 0.5;
/// Bytes per second of tables, hashed and written.
const WRITTEN: f64 = 4e8;
/// Cost of the exact model's curve, in taps.
const CURVE: f64 = 16.0;

/// Estimated seconds of a sweep of `study` by `plan` on `choice`, with the plan's time.
pub fn seconds(study: &Study, plan: &Plan, choice: &Choice) -> Result<f64, Error> {
    let start = Instant::now();
    let method = choice.open(&study.setup.model)?;
    let opened = start.elapsed().as_secs_f64();
    let mut silent = Silent;
    let mut run = Run::new((study, plan), method, (&NEVER, &mut silent));
    let more = CURVE * plan.curves as f64 + (TAPS as u64 * plan.both) as f64;
    let curves = 1.0 + more / plan.taps.max(1) as f64;
    let work = match (&study.space, &plan.rankers) {
        (Space::Grid(factors), Some(rankers)) => ranked(&mut run, &Layout::new(factors), rankers)?,
        (space, _) => {
            let (n, tuple) = space.tuples();
            listed(&mut run, n, &tuple)? * curves
        }
    };
    Ok(choice.seconds + plan.seconds + opened + work + plan.bytes / WRITTEN)
}

/// Seconds of `all` items, from some of them, at most `most` at a time.
fn paced(all: u64, most: u64, mut serve: impl FnMut(u64) -> Result<(), Error>) -> Result<f64, Error> {
    let mut timed = |n: u64| -> Result<f64, Error> {
        let start = Instant::now();
        serve(n)?;
        Ok(start.elapsed().as_secs_f64())
    };
    if most == 0 {
        return Ok(0.0);
    }
    // The first one compiles shaders and makes charts; later differences exclude the latency of a device.
    let first = timed(1)?;
    let (mut each, mut spent, mut n, mut before) = (first, 0.0, 1, (0, 0.0));
    let largest = most.min(CHUNK);
    while before.0 < largest && most > 1 && spent < LOOK {
        let mut seconds = timed(n)?;
        spent += seconds;
        // A busy machine may pause a few taps for longer than they take: what seems slow is timed again.
        if seconds - before.1 > ENOUGH {
            seconds = seconds.min(timed(n)?);
        }
        let more: f64 = seconds - before.1;
        each = if more > 0.0 { more / (n - before.0) as f64 } else { seconds / n as f64 };
        if 4.0 * seconds > LOOK || before.0 > 0 && more > ENOUGH {
            break;
        }
        before = (n, seconds);
        n = (4 * n).min(largest);
    }
    Ok(first + each * all.saturating_sub(1) as f64)
}

/// Spreads samples over `n` items without a period (golden ratio).
fn place(i: u64, n: u64) -> u64 {
    (((i as f64 + 1.0) * 0.618_033_988_749_894_9).fract() * n as f64) as u64
}

fn listed(run: &mut Run<'_>, n: u64, tuple: &dyn Fn(u64) -> Tuple) -> Result<f64, Error> {
    paced(n, n, |some| {
        let tuples: Vec<Tuple> = (0..some).map(|i| tuple(place(i, n))).collect();
        let taps = census::Taps::of(&run.study.setup, &tuples);
        run.evaluate(&taps.designs, &taps.tasks).map(drop)
    })
}

fn ranked(run: &mut Run<'_>, layout: &Layout, ranker: &Rankers) -> Result<f64, Error> {
    let sample: Vec<u64> = (0..layout.n_designs.min(4096)).map(|i| place(i, layout.n_designs)).collect();
    let hard = sample.iter().filter(|k| ranker.case(&layout.design(**k)) == Case::Hard).count();
    let share = hard as f64 / sample.len().max(1) as f64;
    let mut limit = f32::INFINITY;
    let start = Instant::now();
    let easy = match ranker.on_device(&mut run.evaluator, layout)? {
        Some(mut device) => {
            let (opened, most) = (start.elapsed().as_secs_f64(), layout.n_designs.min(device.most()));
            let ranked = |n: u64| {
                device.start(0..n, 0.0);
                Ok(device.finish().transpose().map(drop)?)
            };
            opened + paced(layout.n_designs, most, ranked)?
        }
        None => paced(layout.n_designs, layout.n_designs, |n| {
            let ks: Vec<u64> = (0..n).map(|i| place(i, layout.n_designs)).collect();
            let mut found: Found = ranker.rank(layout, &ks, limit);
            limit = limit.min(charted::bound(&mut found, ranker.keep()));
            Ok(())
        })?,
    };
    let kept = (ranker.keep() as u64).saturating_mul(layout.n_distances).min(layout.len());
    let beside = kept as f64 + share * layout.len() as f64;
    let tuple = |i: u64| layout.tuple(place(i, layout.len()));
    Ok(easy + listed(run, beside.ceil() as u64, &tuple)?)
}
