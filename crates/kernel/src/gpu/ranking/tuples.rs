//! Tuples on the device: `whisker(i)`, the i-th design of a batch, from axis tables and sampled points.

use std::fmt::Write;

use vibrissa_core::scene::axis::Points;
use vibrissa_core::scene::sampler::{DIRECTIONS, Sampler};
use vibrissa_core::scene::{Axis, COLUMNS, Layout};

const MOST_NUMBERS: u64 = 1 << 22;

#[derive(Debug, Clone)]
pub struct Tuples {
    pub wgsl: String,
    pub tables: Vec<f32>,
    /// Lengths of the factors of a design, last fastest.
    pub lengths: Vec<u32>,
}

impl Tuples {
    /// Drives are multiplied by `unit`. `None` for axes too long for the device.
    pub fn new(layout: &Layout, unit: f32) -> Option<Self> {
        let factors = layout.factors();
        let lengths: Option<Vec<u32>> =
            factors.iter().map(|f| u32::try_from(f.len).ok().filter(|n| *n <= 1 << 31)).collect();
        let lengths = lengths.filter(|l| l.len() <= 8)?;
        let mut tables = Vec::new();
        let (mut helpers, mut body) =
            (String::new(), "fn whisker(i: u32) -> Whisker {\n    var rest = i;\n".to_owned());
        for (f, n) in lengths.iter().enumerate().rev() {
            let _ = writeln!(body, "    let v{f} = job.first[{}][{}] + rest;", f / 4, f % 4);
            let _ = writeln!(body, "    let g{f} = v{f} % {n}u;\n    rest = v{f} / {n}u;");
        }
        let mut values = vec!["0.0".to_owned(); COLUMNS];
        for (f, factor) in factors.iter().enumerate() {
            for (column, axis) in &factor.axes {
                values[*column as usize] = match axis {
                    Axis::Value(x) => format!("{:?}f", *x as f32),
                    Axis::Samples { min, max, log, points, dimension } => {
                        let x = sample(&mut helpers, points, *dimension, &format!("g{f}"));
                        let (lo, hi) = (*min as f32, *max as f32);
                        if *log {
                            format!("{lo:?}f * exp2({x} * {:?}f)", (max / min).log2() as f32)
                        } else {
                            format!("fma({x}, {:?}f, {lo:?}f)", hi - lo)
                        }
                    }
                    listed => {
                        if tables.len() as u64 + listed.len() > MOST_NUMBERS {
                            return None;
                        }
                        let at = tables.len();
                        tables.extend(listed.iter().map(|x| x as f32));
                        format!("axes[{at}u + g{f}]")
                    }
                };
            }
        }
        let [big, small, length, place, grid, .., drive] = &values[..] else { return None };
        let _ = writeln!(
            body,
            "    return Whisker({big}, {small}, {length}, {place}, {grid}, {unit:?}f * ({drive}));\n}}"
        );
        Some(Self {
            wgsl: include_str!("../../../../../shaders/sampler.wgsl").to_owned() + &helpers + &body,
            tables,
            lengths,
        })
    }
}

/// An expression for the coordinate as a fraction; functions it needs go to `helpers`.
fn sample(helpers: &mut String, points: &Points, dimension: u32, index: &str) -> String {
    let seed = points.seed;
    let coordinate = match points.sampler {
        Sampler::Random => {
            let lane = ["x", "y", "z", "w"][(dimension % 4) as usize];
            format!(
                "philox(vec4<u32>({index}, {}u, 0u, 0u), vec2<u32>({}u, {}u)).{lane}",
                dimension / 4,
                seed as u32,
                (seed >> 32) as u32
            )
        }
        Sampler::Sobol => {
            // Only the bits that an index can have.
            let bits = 64 - (points.samples - 1).leading_zeros();
            let _ = writeln!(helpers, "fn sobol{dimension}(i: u32) -> u32 {{\n    var x = 0u;");
            for (bit, direction) in DIRECTIONS[dimension as usize].iter().enumerate().take(bits as usize) {
                let _ = writeln!(helpers, "    x ^= (0u - ((i >> {bit}u) & 1u)) & {direction}u;");
            }
            let _ = writeln!(helpers, "    return x;\n}}");
            match Sampler::scramble(seed, dimension) {
                None => format!("sobol{dimension}({index})"),
                Some(key) => format!("owen(sobol{dimension}({index}), {key}u)"),
            }
        }
    };
    format!("fraction({coordinate})")
}
