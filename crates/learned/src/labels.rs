//! Checks of labels: how far apart positions are, and positions in the wrong order (beyond its peak, the signal falls with the distance).

use crate::hyper::{Hyper, Prior};
use crate::rows::Cell;
use vibrissa_core::reduce::{range, sorted};

/// Positions within this share of the range of ln a count as one.
pub const TOGETHER: f64 = 0.01;
/// A rise counts beyond this many standard deviations of the difference, and beyond the share [`LEAST`] of the signal.
const CERTAIN: f64 = 4.0;
const LEAST: f64 = 0.01;
const REPEATS: f64 = 4.0;

/// Spread in ln of the prior if labels contradict each other; the median is the size of the contradiction.
const WRONG: f64 = 0.5;
/// Error of a position as a share of the gaps, two standard deviations of the prior.
const SET: f64 = 0.2;
/// The same in ln a for close positions: by hand, 30 mm is set to 0.3 mm.
const BY_HAND: f64 = 0.01;
const NARROW: f64 = 0.8;

/// Prior of the position; `wrong` is the size of a contradiction of labels (see `contradicted`). It is limited, because a free curve is as
/// likely as wrong labels: of four positions 9 mm apart, errors of 6 mm were as likely as none, and every σ was 8 mm.
pub fn prior(cells: &[Cell], known: bool, wrong: Option<f64>) -> Prior {
    let usual = Prior::new(Hyper::Position.prior(known));
    if let Some(apart) = wrong {
        return Prior::new([apart.ln(), WRONG]);
    }
    let all = sorted(cells.iter().filter(|c| c.row.touches()).map(|c| c.row.a.ln()));
    let range = all.last().zip(all.first()).map_or(0.0, |(last, first)| last - first);
    let apart = all.windows(2).filter(|w| w[1] - w[0] > TOGETHER * range).count();
    let set = (SET * range / apart.max(1) as f64).max(BY_HAND);
    Prior { above: (0.5 * (set.ln() - usual.median)).clamp(NARROW, usual.above), ..usual }
}

/// Positions of one drive, in order and beyond the strongest signal, after which the signal rises, and by how many standard deviations.
pub fn rises<P>(all: &[P], signal: impl Fn(&P) -> f64, sd: impl Fn(&P, &P) -> f64) -> Vec<(usize, f64)> {
    let strongest = (0..all.len()).max_by(|i, k| signal(&all[*i]).total_cmp(&signal(&all[*k])));
    let rise = |k: usize| {
        let (p, q) = (&all[k], &all[k + 1]);
        let (rise, sd) = (signal(q) - signal(p), sd(p, q));
        (rise > LEAST * signal(p).abs() && rise > CERTAIN * sd).then_some((k, rise / sd))
    };
    (strongest.unwrap_or(0)..all.len().saturating_sub(1)).filter_map(rise).collect()
}

/// Largest difference in ln a of two positions in the wrong order.
pub fn contradicted(cells: &[Cell]) -> Option<f64> {
    let mut taps: Vec<&Cell> = cells.iter().filter(|c| c.row.touches()).collect();
    taps.sort_by(|c, d| c.row.u.total_cmp(&d.row.u).then(c.row.a.total_cmp(&d.row.a)));
    let [nearest, farthest] = range(taps.iter().map(|c| c.row.a.ln()));
    let (mut squares, mut freedom) = (0.0, 0.0);
    let mut positions: Vec<Vec<[f64; 3]>> = Vec::new();
    for drive in taps.chunk_by(|c, d| c.row.u == d.row.u) {
        let near = |c: &&Cell, d: &&Cell| (d.row.a / c.row.a).ln() <= TOGETHER * (farthest - nearest);
        let of_position = |cells: &[&Cell]| {
            let n: f64 = cells.iter().map(|c| c.n).sum();
            let mean = |of: &dyn Fn(&Cell) -> f64| cells.iter().map(|c| c.n * of(c)).sum::<f64>() / n;
            let (x, y) = (mean(&|c| c.row.a.ln()), mean(&|c| c.row.y));
            squares += cells.iter().map(|c| c.squares + c.n * (c.row.y - y).powi(2)).sum::<f64>();
            freedom += n - 1.0;
            [x, y, n]
        };
        positions.push(drive.chunk_by(near).map(of_position).collect());
    }
    if freedom < REPEATS {
        return None;
    }
    let variance = squares / freedom;
    let of_drive = |all: &Vec<[f64; 3]>| {
        let found = rises(all, |p| p[1], |p, q| (variance * (1.0 / p[2] + 1.0 / q[2])).sqrt());
        found.into_iter().map(|(k, _)| all[k + 1][0] - all[k][0]).reduce(f64::max)
    };
    positions.iter().filter_map(of_drive).reduce(f64::max)
}
