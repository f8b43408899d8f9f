//! `curve`: a smooth, monotone fit of distance over signal and drive, from the data alone.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::held_out::Side;
use super::polynomial::{Form, Point, Polynomial};
use super::taps::Cell;

/// Range beyond the positions, in shares of the last step: for answers, and for a position left out, which may be the last.
const BEYOND: [f64; 2] = [0.5, 4.0];
/// Up to this many taps, each counts with its own labels; with more, cells count with their means.
const EACH: usize = 1000;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmoothRecord {
    /// RMS error on distances left out.
    pub held_out_rms_mm: Option<f64>,
    /// Error on distances left out beyond the noise, per drive.
    pub bias_mm: Vec<f64>,
    pub fit: Polynomial,
}

impl SmoothRecord {
    pub fn calibrated(side: &Side<'_>, held_out_rms_mm: Option<f64>, bias_mm: Vec<f64>) -> Option<Self> {
        let fit = Polynomial::through(&points(side, None), form(side)?, BEYOND[0])?;
        Some(Self { held_out_rms_mm, bias_mm, fit })
    }
}

/// Form for all positions of `side`; it also serves with positions left out, so that the same form is judged and used.
pub fn form(side: &Side<'_>) -> Option<Form> {
    Polynomial::choose(&points(side, None))
}

pub fn without(side: &Side<'_>, gone: &Range<usize>, form: Option<Form>) -> Option<Polynomial> {
    Polynomial::through(&points(side, Some(gone)), form?, BEYOND[1])
}

fn points(side: &Side<'_>, without: Option<&Range<usize>>) -> Vec<Point> {
    let kept = || side.cells.iter().filter(|c| without.is_none_or(|gone| !gone.contains(&c.i)));
    let point = |position, a, drive, signal, n| Point { a, drive, signal, position, n };
    if kept().map(|c| c.taps.len()).sum::<usize>() > EACH {
        return kept().map(|c| point(c.i, c.a, c.drive, c.signal, c.n())).collect();
    }
    let each = |c| move |k: &usize| (c, &side.taps[*k]);
    let taps = kept().flat_map(|c: &Cell| c.taps.iter().map(each(c.i)));
    taps.map(|(i, t)| point(i, t.a, t.drive, t.signal.abs(), 1.0)).collect()
}
