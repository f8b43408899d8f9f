//! Seals of answers: a check of an answer's bits, its place in the batch and the number of the batch, that the shader writes into the
//! number of sweeps. Twin of `seal` in `shaders/main.wgsl`.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::dispatch::GRAIN;
use crate::Solution;
use vibrissa_core::scene::Precision;

/// Sweeps are below this; seals are multiples of it. Seals and sweeps together are a whole number that f32 holds.
const SWEEPS: f64 = 1024.0;

/// Bits of a seal.
const BITS: u32 = 14;

/// Mixes `word` into `h`.
pub(super) fn mix(h: u32, word: u32) -> u32 {
    let x = (h ^ word).wrapping_mul(0x85eb_ca6b);
    x ^ x >> 15
}

/// WGSL of `mix`.
pub(super) fn mix_bits() -> String {
    let factor = 0x85eb_ca6b_u32;
    format!(
        "fn mix_bits(h: u32, word: u32) -> u32 {{\n    let x = (h ^ word) * {factor}u;\n    return x ^ (x >> 15u);\n}}\n"
    )
}

/// WGSL of `seal`; with the bits of the numbers where they have 32 of them. WGSL has no way to those of f64, whose seals tell place and batch
/// alone. An iteration gone astray that ends in what is no number says so in numbers: what is not finite comes from no kernel.
pub(super) fn wgsl(with_bits: bool, spatial: bool) -> String {
    let finite = match with_bits {
        // A comparison may be compiled as if there were no such numbers.
        true => "(bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u",
        false => "abs(x) < 1e300lf",
    };
    let all = &Solution::<f32>::FIELDS[..Solution::<f32>::words(spatial)];
    let fields: Vec<&str> = all.iter().copied().filter(|f| *f != "sweeps").collect();
    let rest = if spatial { ", ZERO, ZERO" } else { "" };
    let all: Vec<String> = fields.iter().map(|f| format!("is_finite(s.{f})")).collect();
    let mut text = mix_bits();
    text += &format!(
        "fn is_finite(x: real) -> bool {{\n    return {finite};\n}}\n\
         fn seal(s: Solution, place: u32, stamp: u32) -> Solution {{\n    var sealed = s;\n    \
         if !({}) {{\n        sealed = Solution(ZERO, ZERO, ZERO, ZERO, LOST, ZERO, s.sweeps{rest});\n    }}\n    \
         var h = mix_bits(mix_bits(stamp, place), u32(s.sweeps));\n",
        all.join(" && ")
    );
    for field in fields.iter().filter(|_| with_bits) {
        text += &format!("    h = mix_bits(h, bitcast<u32>(sealed.{field}));\n");
    }
    text += &format!(
        "    sealed.sweeps = s.sweeps + real({SWEEPS:?}) * real(h >> {}u);\n    return sealed;\n}}\n",
        32 - BITS
    );
    text
}

/// What a shader has sealed.
pub(super) trait Seal: Sized {
    /// It without its seal, if this is the one of `place` in batch `stamp`, from a kernel with or without `spatial` effects.
    fn unseal(self, place: u32, stamp: u32, spatial: bool) -> Option<Self>;
}

/// Sweeps and seal of a number that holds both; `None` where it does not.
fn apart(number: f64) -> Option<(f64, u32)> {
    let seal = (number / SWEEPS).floor();
    let sweeps = number - SWEEPS * seal;
    let whole = sweeps.fract() == 0.0 && sweeps >= 1.0 && seal < f64::from(1u32 << BITS);
    whole.then_some((sweeps, seal as u32))
}

fn seal(place: u32, stamp: u32, sweeps: f64, words: impl Iterator<Item = u32>) -> u32 {
    words.fold(mix(mix(stamp, place), sweeps as u32), mix) >> (32 - BITS)
}

/// The bits of an answer but for its sweeps.
fn words(s: &Solution<f32>, spatial: bool) -> impl Iterator<Item = u32> {
    let fields = Solution::<f32>::FIELDS.iter().zip(s.values()).take(Solution::<f32>::words(spatial));
    fields.filter(|(name, _)| **name != "sweeps").map(|(_, x)| x.to_bits())
}

impl Seal for Solution<f32> {
    fn unseal(self, place: u32, stamp: u32, spatial: bool) -> Option<Self> {
        let (sweeps, found) = apart(f64::from(self.sweeps))?;
        let right = seal(place, stamp, sweeps, words(&self, spatial)) == found;
        right.then_some(Self { sweeps: sweeps as f32, ..self })
    }
}

impl Seal for Solution {
    fn unseal(self, place: u32, stamp: u32, _: bool) -> Option<Self> {
        let (sweeps, found) = apart(self.sweeps)?;
        (seal(place, stamp, sweeps, std::iter::empty()) == found).then_some(Self { sweeps, ..self })
    }
}

/// Appends the solutions in `bytes` without their seals; how many of them are not sealed as they should be.
pub(super) fn unseal(
    precision: Precision,
    bytes: &[u8],
    (stamp, spatial): (u32, bool),
    out: &mut Vec<Solution>,
) -> usize {
    let words = Solution::<f32>::words(spatial);
    let unwritten = AtomicUsize::new(0);
    let told = |sealed: Option<Solution>| {
        sealed.unwrap_or_else(|| {
            unwritten.fetch_add(1, Ordering::Relaxed);
            Solution::UNWRITTEN
        })
    };
    // A copy of what was mapped need not lie as its numbers do.
    match precision {
        Precision::F32 => {
            let answers = bytes.par_chunks_exact(4 * words).enumerate().with_min_len(GRAIN);
            out.par_extend(answers.map(|(i, answer)| {
                let mut s = Solution::<f32>::default();
                bytemuck::bytes_of_mut(&mut s)[..answer.len()].copy_from_slice(answer);
                told(s.unseal(i as u32, stamp, spatial).map(|s| s.map(f64::from)))
            }));
        }
        Precision::F64 => {
            let answers = bytes.par_chunks_exact(8 * words).enumerate().with_min_len(GRAIN);
            out.par_extend(answers.map(|(i, answer)| {
                let mut s = Solution::<f64>::default();
                bytemuck::bytes_of_mut(&mut s)[..answer.len()].copy_from_slice(answer);
                told(s.unseal(i as u32, stamp, spatial))
            }));
        }
    }
    unwritten.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sealed(s: Solution<f32>, place: u32, stamp: u32, spatial: bool) -> Solution<f32> {
        let seal = seal(place, stamp, f64::from(s.sweeps), words(&s, spatial));
        Solution { sweeps: s.sweeps + 1024.0 * seal as f32, ..s }
    }

    /// A seal of 14 bits passes by chance once in 16 384 times: of 4 096 changes 3 at most, but for one draw in a hundred thousand.
    #[test]
    fn what_is_not_the_sealed_answer_is_found() {
        let mut passed = [0; 4];
        for n in 0..4096u32 {
            let x = f32::from_bits(0x3f00_0000 + 7919 * n);
            let s = Solution {
                force: x,
                along: -x,
                arc: 0.1 * x,
                strain: x,
                error: 1e-6,
                load: 0.0,
                sweeps: 4.0,
                base: 0.2 * x,
                axial: -0.3 * x,
            };
            let spatial = n % 2 == 1;
            let s = if spatial { s } else { Solution { base: 0.0, axial: 0.0, ..s } };
            let (place, stamp) = (n * 31, n + 1);
            let there = sealed(s, place, stamp, spatial);
            assert_eq!(there.unseal(place, stamp, spatial), Some(s));
            let turned = Solution { strain: f32::from_bits(there.strain.to_bits() ^ 1 << (n % 32)), ..there };
            let missed = [
                turned.unseal(place, stamp, spatial),
                there.unseal(place + 1, stamp, spatial),
                there.unseal(place, stamp + 1, spatial),
                Solution { sweeps: there.sweeps + 1.0, ..there }.unseal(place, stamp, spatial),
            ];
            missed.iter().zip(&mut passed).for_each(|(m, n)| *n += u32::from(m.is_some()));
            assert_eq!(Solution::<f32>::default().unseal(place, stamp, spatial), None);
        }
        assert!(passed.iter().all(|n| *n <= 3), "{passed:?}");
    }
}
