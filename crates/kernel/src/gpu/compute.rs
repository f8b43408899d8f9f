//! Any kernel that maps taps to answers: its own layout of taps, a table that they share, answers of some numbers each.
//!
//! The last number of an answer is its seal, of its bits, its place and its batch, as in `super::seal`.

use std::fmt::Write;
use std::sync::Arc;

use super::dispatch::{Gpu, buffer, lost, submit, wait};
use super::fault::{Fault, quietly};
use super::lie::{Kind, Lie};
use super::seal::{mix, mix_bits};
use super::shader::WORKGROUP;
use vibrissa_core::scene::Precision;

/// A kernel and what it is given. Bindings: 0 uniform `vec4<u32>` (count, number of the batch), 1 taps, 2 what they share, 3 answers.
#[derive(Debug, Clone, Copy)]
pub struct Program<'a> {
    /// Name in messages.
    pub name: &'a str,
    /// Its text; the entry point is `main`.
    pub wgsl: &'a str,
    /// All numbers of the taps, one tap behind the other.
    pub taps: &'a [f64],
    /// What the taps share.
    pub shared: &'a [f64],
    /// Taps.
    pub count: usize,
    /// Numbers of an answer, its seal among them.
    pub words: usize,
}

/// Bits of a seal: a whole number that f32 holds.
const BITS: u32 = 22;

/// WGSL of `seal(answer, place, stamp)` for a structure `Solution` of `fields`, the last of which takes the seal. WGSL has no way to the bits of f64,
/// whose seals tell place and batch alone.
pub fn seal(precision: Precision, fields: &[&str]) -> String {
    let mut text = mix_bits();
    text += "fn seal(answer: Solution, place: u32, stamp: u32) -> Solution {\n    var sealed = answer;\n    var h = mix_bits(stamp, place);\n";
    let (last, others) = fields.split_last().unwrap_or((&"seal", &[]));
    for field in others.iter().filter(|_| precision == Precision::F32) {
        let _ = writeln!(text, "    h = mix_bits(h, bitcast<u32>(answer.{field}));");
    }
    let _ = write!(text, "    sealed.{last} = real(h >> {}u);\n    return sealed;\n}}\n", 32 - BITS);
    text
}

impl Gpu {
    /// The answers of `program` without their seals, one behind the other.
    ///
    /// # Errors
    /// A device that fails; answers that were not written or were changed.
    pub(super) fn compute(&mut self, program: &Program<'_>) -> Result<Vec<f64>, Fault> {
        quietly(|| self.computed(program)).map_err(Fault::Lost)?
    }

    fn computed(&mut self, program: &Program<'_>) -> Result<Vec<f64>, Fault> {
        let Program { name, wgsl, taps, shared, count, words } = *program;
        let told = self.adapter().lie.as_ref().and_then(|lie| lie.next());
        let pipeline = match self.pipelines.get(wgsl) {
            Some(pipeline) => pipeline.clone(),
            None => {
                let pipeline = self.compile(name, wgsl)?;
                self.heard()?;
                self.pipelines.insert(Arc::from(wgsl), pipeline.clone());
                pipeline
            }
        };
        self.stamp = self.stamp.wrapping_add(1);
        let (device, queue) = self.handles();
        let word = self.word();
        let bytes = |numbers: &[f64]| -> Vec<u8> {
            match word {
                8 => numbers.iter().flat_map(|x| x.to_le_bytes()).collect(),
                _ => numbers.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect(),
            }
        };
        use wgpu::BufferUsages as U;
        let buffer = |size: usize, usage| buffer(&device, name, size.max(16) as u64, usage);
        let uploaded = |data: &[u8], usage| {
            let of = buffer(data.len(), usage | U::COPY_DST);
            queue.write_buffer(&of, 0, data);
            of
        };
        let spoiled: Vec<f64>;
        let taps = if told == Some(Kind::Wrong) {
            spoiled = taps.iter().map(|x| 1.01 * x).collect();
            &spoiled
        } else {
            taps
        };
        let size = count * words * word;
        let (head, taps, shared) = (
            uploaded(bytemuck::bytes_of(&[count as u32, self.stamp, 0, 0]), U::UNIFORM),
            uploaded(&bytes(taps), U::STORAGE),
            uploaded(&bytes(shared), U::STORAGE),
        );
        let answers = buffer(size, U::STORAGE | U::COPY_SRC);
        let readback = buffer(size, U::MAP_READ | U::COPY_DST);
        self.heard()?;
        let at = submit(
            (&device, &queue),
            (name, &pipeline),
            &[&head, &taps, &shared, &answers],
            count as u32,
            (&answers, &readback, size as u64),
            told,
        );
        wait(&device, (&readback, size as u64), at, told == Some(Kind::Hang), &self.mishap())?;
        let mut view = readback.get_mapped_range(0..size as u64).map_err(lost)?.to_vec();
        readback.unmap();
        if let Some(lie) = &self.adapter().lie {
            lie.spoil(told, &mut view, WORKGROUP as usize * words * word, word);
        }
        let mut numbers = self.unsealed(&view, (count, words, word))?;
        if let Some(Kind::Off(_)) = told {
            numbers.iter_mut().enumerate().for_each(|(i, x)| *x = Lie::off(told, i % (words - 1), *x));
        }
        Ok(numbers)
    }

    fn unsealed(&self, bytes: &[u8], (count, words, word): (usize, usize, usize)) -> Result<Vec<f64>, Fault> {
        let mut numbers = Vec::with_capacity(count * (words - 1));
        let mut damaged = 0;
        for (place, answer) in (0u32..).zip(bytes.chunks_exact(words * word)) {
            let begun = mix(self.stamp, place);
            let mut h = begun;
            let mut last = 0.0;
            for (k, part) in answer.chunks_exact(word).enumerate() {
                let x = match word {
                    8 => f64::from_le_bytes(std::array::from_fn(|i| part[i])),
                    _ => {
                        let x = f32::from_le_bytes(std::array::from_fn(|i| part[i]));
                        if k + 1 < words {
                            h = mix(h, x.to_bits());
                        }
                        f64::from(x)
                    }
                };
                if k + 1 < words {
                    numbers.push(x);
                }
                last = x;
            }
            damaged += usize::from(last != f64::from(h >> (32 - BITS)));
        }
        if damaged > 0 { Err(Fault::Damaged(damaged, count)) } else { Ok(numbers) }
    }
}
