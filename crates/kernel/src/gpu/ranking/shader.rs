//! The shader that ranks: one text for every chart, after constants with its sizes.

use std::fmt::Write;

use super::COUNTERS;
use super::tuples::Tuples;
use crate::ranking::{COMBINED, Sheet};
use vibrissa_core::scene::Layout;

pub const WORKGROUP: u32 = 64;

const MOST_KEPT: usize = 2048;

/// Vectors that a uniform buffer holds on every device: 64 KiB. Its numbers are read once for all invocations.
const MOST_UNIFORM: usize = 1 << 12;

const TEXT: [&str; 5] = [
    include_str!("../../../../../shaders/ranking/main.wgsl"),
    include_str!("../../../../../shaders/ranking/theory.wgsl"),
    include_str!("../../../../../shaders/ranking/chart.wgsl"),
    include_str!("../../../../../shaders/ranking/words.wgsl"),
    include_str!("../../../../../shaders/ranking/rows.wgsl"),
];

#[derive(Debug, Clone)]
pub struct Shader {
    pub wgsl: String,
    /// Distances, drives, small matrices.
    pub numbers: Vec<[f32; 4]>,
    /// Starts of series, and their numbers of orders.
    pub shape: Vec<[u32; 4]>,
    pub axes: Vec<f32>,
    pub lengths: Vec<u32>,
}

impl Shader {
    /// `None` where an invocation would have to keep too many numbers.
    pub fn new(sheet: &Sheet, layout: &Layout) -> Option<Self> {
        if sheet.kept > MOST_KEPT {
            return None;
        }
        let mut text = sheet.constants.clone();
        for (name, n) in [("WORKGROUP", WORKGROUP as usize), ("COMBINED", COMBINED), ("COUNTERS", COUNTERS)] {
            let _ = writeln!(text, "const {name} = {n}u;");
        }
        let tuples = Tuples::new(layout, sheet.unit)?;
        let (numbers, shape) = (in_fours(&sheet.numbers), in_fours(&sheet.shape));
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
        Some(Self { wgsl: text + &tuples.wgsl, numbers, shape, axes: tuples.tables, lengths: tuples.lengths })
    }
}

fn in_fours<T: Copy + Default>(numbers: &[T]) -> Vec<[T; 4]> {
    let four = |part: &[T]| std::array::from_fn(|k| part.get(k).copied().unwrap_or_default());
    numbers.chunks(4).map(four).collect()
}
