//! What a device can do at most, for rooflines: fused multiply–adds and copied bytes per second.

use std::fmt::Write;
use std::time::Instant;

use super::dispatch::{Gpu, entry};
use vibrissa_core::error::SolveError;
use vibrissa_core::scene::Precision;

/// Independent chains of one invocation.
const CHAINS: usize = 8;
/// Rounds of the loop of one invocation, and steps of every chain in each.
const ROUNDS: usize = 64;
const UNROLLED: usize = 16;
/// Invocations of one dispatch: enough to fill a large device, some milliseconds on a slow one.
const INVOCATIONS: u32 = 1 << 16;
/// Invocations of one workgroup.
const WORKGROUP: u32 = 64;
/// Bytes that are copied from buffer to buffer, where one may be that large.
const COPY: u64 = 64 << 20;
/// Least time of a measurement, s.
const LEAST: f64 = 0.05;

/// What a device does per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peaks {
    /// Floating-point operations per second of fused multiply–adds, 2 each.
    pub flops: f64,
    /// Bytes per second, read and written, of a copy.
    pub bytes: f64,
}

impl Gpu {
    /// Peaks of this device in its precision: the best of `repeats`.
    ///
    /// # Errors
    /// What the device says.
    pub fn peaks(&self, repeats: usize) -> Result<Peaks, SolveError> {
        let real = self.real();
        let (word, copied) = (real.1 as u64, COPY.min(self.adapter().max_binding) / 16 * 16);
        let numbers = self.buffer(u64::from(INVOCATIONS) * word, wgpu::BufferUsages::STORAGE);
        let pipeline = self.compile("peak", &chains(real.0))?;
        let bind = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("peak"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[entry(0, &numbers)],
        });
        let fused = |encoder: &mut wgpu::CommandEncoder, times: u32| {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind, &[]);
            (0..times).for_each(|_| pass.dispatch_workgroups(INVOCATIONS / WORKGROUP, 1, 1));
        };
        let work = f64::from(INVOCATIONS) * (2 * CHAINS * ROUNDS * UNROLLED) as f64;
        let flops = self.rate(work, repeats, &fused)?;
        let [from, to] = [wgpu::BufferUsages::COPY_SRC, wgpu::BufferUsages::COPY_DST]
            .map(|usage| self.buffer(copied, usage));
        let copy = |encoder: &mut wgpu::CommandEncoder, times: u32| {
            (0..times).for_each(|_| encoder.copy_buffer_to_buffer(&from, 0, &to, 0, copied));
        };
        let bytes = self.rate(2.0 * copied as f64, repeats, &copy)?;
        Ok(Peaks { flops, bytes })
    }

    /// WGSL type of a number and its bytes.
    fn real(&self) -> (&'static str, usize) {
        match self.precision() {
            Precision::F32 => ("f32", 4),
            Precision::F64 => ("f64", 8),
        }
    }

    fn buffer(&self, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("peak"),
            size: bytes,
            usage,
            mapped_at_creation: false,
        })
    }

    /// Largest `work` per second of `repeats` submissions, each of `encode` often enough.
    fn rate(
        &self,
        work: f64,
        repeats: usize,
        encode: &dyn Fn(&mut wgpu::CommandEncoder, u32),
    ) -> Result<f64, SolveError> {
        let timed = |times: u32| -> Result<f64, SolveError> {
            let mut encoder = self.device().create_command_encoder(&Default::default());
            encode(&mut encoder, times);
            let start = Instant::now();
            self.queue().submit([encoder.finish()]);
            self.device().poll(wgpu::PollType::wait_indefinitely()).map_err(SolveError::device)?;
            Ok(start.elapsed().as_secs_f64())
        };
        // The first time may pay for compilation and for pages of memory.
        timed(1)?;
        let mut times = 1;
        while timed(times)? < LEAST {
            times *= 2;
        }
        let mut best = 0.0f64;
        for _ in 0..repeats.max(1) {
            best = best.max(work * f64::from(times) / timed(times)?);
        }
        Ok(best)
    }
}

/// Chains x ← a x + b from a number of the buffer, so that nothing is known in advance.
fn chains(real: &str) -> String {
    let mut text = format!(
        "@group(0) @binding(0) var<storage, read_write> numbers: array<{real}>;\n\
         @compute @workgroup_size({WORKGROUP})\n\
         fn main(@builtin(global_invocation_id) id: vec3<u32>) {{\n    let a = numbers[id.x];\n"
    );
    for k in 0..CHAINS {
        let _ = writeln!(text, "    var x{k} = a + {real}({k});");
    }
    let _ = writeln!(text, "    for (var i = 0u; i < {ROUNDS}u; i++) {{");
    for k in (0..UNROLLED).flat_map(|_| 0..CHAINS) {
        let _ = writeln!(text, "        x{k} = fma(x{k}, a, a);");
    }
    let sum = (0..CHAINS).map(|k| format!("x{k}")).collect::<Vec<_>>().join(" + ");
    text + &format!("    }}\n    numbers[id.x] = {sum};\n}}\n")
}

#[cfg(test)]
mod tests {
    use super::super::shader::validate;
    use super::*;

    #[test]
    fn the_shaders_are_valid() {
        for text in [chains("f32"), chains("f64")] {
            validate("peak", &text).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}
