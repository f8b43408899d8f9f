//! The shader that ranks: one text for every chart, after constants that say how many numbers there are of each kind.

use std::fmt::Write;

use super::COUNTERS;
use super::tuples::Tuples;
use crate::ranking::{BEYOND, COMBINED, FARTHEST, HEAD, Sheet};
use vibrissa_core::estimate::FAR;
use vibrissa_core::scene::{Drive, Layout, Per, RankBy};

/// Invocations of one workgroup.
pub const WORKGROUP: u32 = 64;

/// Most numbers that an invocation keeps of its taps.
const MOST_KEPT: usize = 2048;

/// Numbers kept of a tap beside the series of its K.
const KEPT: usize = 6;

/// Vectors that a uniform buffer holds on every device: 64 KiB. Its numbers are read once for all invocations.
const MOST_UNIFORM: usize = 1 << 12;

/// Slack of ranges in single precision.
const SLACK: f64 = 1e-6;

/// What every ranking shader says.
const TEXT: [&str; 5] = [
    include_str!("../../../../../shaders/ranking/main.wgsl"),
    include_str!("../../../../../shaders/ranking/theory.wgsl"),
    include_str!("../../../../../shaders/ranking/chart.wgsl"),
    include_str!("../../../../../shaders/ranking/words.wgsl"),
    include_str!("../../../../../shaders/ranking/rows.wgsl"),
];

/// The shader of a sheet and what it reads.
#[derive(Debug, Clone)]
pub struct Shader {
    /// The whole text.
    pub wgsl: String,
    /// Distances, drives, small matrices.
    pub numbers: Vec<[f32; 4]>,
    /// Where series begin, and how many orders each has.
    pub shape: Vec<[u32; 4]>,
    /// Coefficients.
    pub rows: Vec<[f32; 4]>,
    /// Values of the axes of designs that are listed.
    pub axes: Vec<f32>,
    /// Rounds of loops that a design takes at most.
    pub rounds: usize,
    /// Lengths of the factors of a design.
    pub lengths: Vec<u32>,
}

impl Shader {
    /// Of `sheet` over the designs of `layout`; `None` where an invocation would have to keep too much.
    pub fn new(sheet: &Sheet, layout: &Layout) -> Option<Self> {
        let kept = sheet.points + KEPT;
        if kept * sheet.distances > MOST_KEPT {
            return None;
        }
        let mut numbers = sheet.heads.clone();
        let mut place = |part: &mut dyn Iterator<Item = f32>| {
            let at = numbers.len();
            numbers.extend(part);
            at
        };
        let drives_at = place(&mut sheet.drives.iter().copied());
        let choice = place(&mut sheet.choice.iter().copied());
        let back = place(&mut sheet.back.iter().copied());
        let powers = place(&mut sheet.powers.iter().copied());
        let drives = sheet.drives.len().max(1);
        let counts = [
            ("WORKGROUP", WORKGROUP as usize),
            ("DISTANCES", sheet.distances),
            ("DRIVES", drives),
            ("ROW_DRIVES", if sheet.own { 1 } else { drives }),
            ("DRIVE_BITS", (drives as u32).ilog2() as usize + 1),
            ("POINTS", sheet.points),
            ("PAIRS", sheet.points * (sheet.points + 1) / 2),
            ("GROUPS", sheet.groups),
            ("ORDERS", 4 * sheet.groups),
            ("PLACES", sheet.places),
            ("GAUGE", sheet.gauge),
            ("BRANCHES", sheet.branches),
            ("POWER", sheet.power as usize),
            ("HEAD", HEAD.len()),
            ("DISTANCE", HEAD.len() + 2 * sheet.gauge),
            ("KEPT", kept),
            ("KEPT_ALL", kept * sheet.distances),
            ("DRIVES_AT", drives_at),
            ("CHOICE", choice),
            ("BACK", back),
            ("POWERS", powers),
            ("AT_POINTS", sheet.at_points),
            ("BY", by(sheet.by)),
            ("COMBINED", COMBINED),
            ("COUNTERS", COUNTERS),
        ];
        let switches = [
            ("OWN", sheet.own),
            ("FOURTH", sheet.fourth),
            ("APART", sheet.own && !sheet.drives.is_empty()),
            ("PLAIN", sheet.theory.plain),
            ("DISPLACED", sheet.theory.displaced),
            ("ESTIMATES", sheet.by != RankBy::KSd),
            ("PER_DESIGN", sheet.per == Per::Design),
            ("ELONGATION", sheet.elongation),
            ("FIXED_GIVEN", sheet.fixed.is_some()),
        ];
        let within = &sheet.within;
        let [least, most] = BEYOND[usize::from(!sheet.own)];
        let reals = [
            ("REACH", within.reach),
            ("D_LO", below(within.D[0])),
            ("D_HI", above(within.D[1])),
            ("TAU_LO", below(within.tau[0])),
            ("TAU_HI", above(within.tau[1])),
            ("X_LO", below(within.x[0])),
            ("X_HI", above(within.x[1])),
            ("DRIVE_LO", below(within.drive[0])),
            ("DRIVE_HI", above(within.drive[1])),
            ("WIDTH", above(within.width)),
            ("HUB", sheet.theory.hub.into()),
            ("SHEAR", sheet.theory.shear.into()),
            ("STRAIN_LIMIT", sheet.strain_limit.into()),
            ("NOISE", sheet.noise.into()),
            ("FIXED", sheet.fixed.unwrap_or(0.0).into()),
            ("MOST_DEVIATION", sheet.largest.into()),
            ("FARTHEST", FARTHEST),
            ("FAR", FAR),
            ("BEYOND_LO", least),
            ("BEYOND_HI", most),
            ("COMMON_SCALE", sheet.common[0].into()),
            ("COMMON_SHIFT", sheet.common[1].into()),
        ];
        let mut text = String::new();
        let heads = HEAD.into_iter().zip(0..);
        for (name, n) in counts.into_iter().chain(heads) {
            let _ = writeln!(text, "const {name} = {n}u;");
        }
        for (name, on) in switches {
            let _ = writeln!(text, "const {name} = {on};");
        }
        for (name, x) in reals {
            // A number beyond single precision is as good as the largest.
            let x = (x as f32).clamp(-f32::MAX, f32::MAX);
            let _ = writeln!(text, "const {name}: f32 = {x:?}f;");
        }
        let unit = if sheet.kind == Drive::Angle { 1f32.to_radians() } else { 1.0 };
        let tuples = Tuples::new(layout, unit)?;
        let (numbers, shape) = (in_fours(&numbers), in_fours(&sheet.shape));
        for (binding, name, of, count) in [
            (1, "numbers", "f32", numbers.len()),
            (2, "shape", "u32", shape.len()),
            (3, "rows", "f32", sheet.rows.len()),
        ] {
            let space = if count <= MOST_UNIFORM { "uniform" } else { "storage, read" };
            let _ = writeln!(
                text,
                "@group(0) @binding({binding}) var<{space}> {name}: array<vec4<{of}>, {count}>;"
            );
        }
        text += &TEXT.concat();
        Some(Self {
            wgsl: text + &tuples.wgsl,
            numbers,
            shape,
            rows: sheet.rows.clone(),
            axes: tuples.tables,
            rounds: rounds(sheet),
            lengths: tuples.lengths,
        })
    }
}

/// Rounds of loops of a design: every order of its series is one, and so is every drive of every tap.
fn rounds(sheet: &Sheet) -> usize {
    let drives = sheet.drives.len().max(1);
    let points = sheet.points * (sheet.points + 8);
    let tap = points + sheet.gauge * sheet.places + 2 * sheet.places + 64;
    let read = sheet.shape.len() + sheet.at_points + sheet.distances * tap;
    let ranked = drives * (sheet.points * (sheet.points + 1) + sheet.distances * (sheet.points + 8));
    if sheet.own { drives * (read + sheet.distances * 16) } else { read + ranked }
}

/// Numbers as vectors, the last of them filled up.
fn in_fours<T: Copy + Default>(numbers: &[T]) -> Vec<[T; 4]> {
    let four = |part: &[T]| std::array::from_fn(|k| part.get(k).copied().unwrap_or_default());
    numbers.chunks(4).map(four).collect()
}

/// A lower end with its slack.
fn below(x: f64) -> f64 {
    x - SLACK * x.abs()
}

/// An upper end with its slack.
fn above(x: f64) -> f64 {
    x + SLACK * x.abs()
}

/// What the shader calls a column.
fn by(by: RankBy) -> usize {
    match by {
        RankBy::ErrorMax => 1,
        RankBy::NoiseRms => 2,
        RankBy::TotalRms => 3,
        _ => 0,
    }
}
