//! What a device can do at most, for rooflines: fused multiply–adds and copied bytes per second.

use std::fmt::Write;
use std::time::Instant;

use super::dispatch::{Gpu, entry};
use crate::scene::Precision;

/// Independent chains of one invocation.
const CHAINS: usize = 8;
/// Rounds of one invocation between loads and stores.
const ROUNDS: usize = 1024;
/// Invocations of one dispatch: enough to fill a large device, some milliseconds on a slow one.
const INVOCATIONS: u32 = 1 << 16;
/// Invocations of one workgroup.
const WORKGROUP: u32 = 64;
/// Bytes of the buffers that are copied, where a binding may be that large.
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
    pub fn peaks(&self, repeats: usize) -> Result<Peaks, String> {
        let real = self.real();
        let (word, copied) = (real.1 as u64, COPY.min(self.adapter().max_binding) / 16 * 16);
        let numbers = self.storage(u64::from(INVOCATIONS) * word);
        let work = f64::from(INVOCATIONS) * (2 * CHAINS * ROUNDS) as f64;
        let flops = self.rate(&chains(real.0), &[&numbers], INVOCATIONS / WORKGROUP, work, repeats)?;
        let (from, to) = (self.storage(copied), self.storage(copied));
        // As many invocations as one dimension of workgroups allows, each with as many vectors as that leaves.
        let vectors = copied / 16;
        let groups = (vectors as u32).div_ceil(WORKGROUP).min(self.adapter().max_workgroups);
        let text = copy(groups * WORKGROUP);
        let bytes = self.rate(&text, &[&from, &to], groups, 2.0 * copied as f64, repeats)?;
        Ok(Peaks { flops, bytes })
    }

    /// WGSL type of a number and its bytes.
    fn real(&self) -> (&'static str, usize) {
        match self.precision() {
            Precision::F32 => ("f32", 4),
            Precision::F64 => ("f64", 8),
        }
    }

    fn storage(&self, bytes: u64) -> wgpu::Buffer {
        self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("peak"),
            size: bytes,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        })
    }

    /// Largest `work` per second of `repeats` runs of enough dispatches of `wgsl` in a row.
    fn rate(
        &self,
        wgsl: &str,
        buffers: &[&wgpu::Buffer],
        groups: u32,
        work: f64,
        repeats: usize,
    ) -> Result<f64, String> {
        let pipeline = self.compile("peak", wgsl)?;
        let entries: Vec<_> = (0..).zip(buffers).map(|(i, b)| entry(i, b)).collect();
        let bind = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("peak"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let timed = |dispatches: u32| -> Result<f64, String> {
            let start = Instant::now();
            let mut encoder = self.device().create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &bind, &[]);
                (0..dispatches).for_each(|_| pass.dispatch_workgroups(groups, 1, 1));
            }
            self.queue().submit([encoder.finish()]);
            self.device().poll(wgpu::PollType::wait_indefinitely()).map_err(|e| e.to_string())?;
            Ok(start.elapsed().as_secs_f64())
        };
        // The first dispatch of a pipeline may pay for its compilation.
        timed(1)?;
        let mut dispatches = 1;
        while timed(dispatches)? < LEAST {
            dispatches *= 2;
        }
        let mut best = 0.0f64;
        for _ in 0..repeats.max(1) {
            best = best.max(work * f64::from(dispatches) / timed(dispatches)?);
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
    for k in 0..CHAINS {
        let _ = writeln!(text, "        x{k} = fma(x{k}, a, a);");
    }
    let sum = (0..CHAINS).map(|k| format!("x{k}")).collect::<Vec<_>>().join(" + ");
    text + &format!("    }}\n    numbers[id.x] = {sum};\n}}\n")
}

/// Copies vectors of 16 bytes, `stride` invocations at a time.
fn copy(stride: u32) -> String {
    format!(
        "@group(0) @binding(0) var<storage, read> read_from: array<vec4<u32>>;\n\
         @group(0) @binding(1) var<storage, read_write> write_to: array<vec4<u32>>;\n\
         @compute @workgroup_size({WORKGROUP})\n\
         fn main(@builtin(global_invocation_id) id: vec3<u32>) {{\n    \
             for (var i = id.x; i < arrayLength(&write_to); i += {stride}u) {{\n        \
                 write_to[i] = read_from[i];\n    }}\n}}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::super::shader::validate;
    use super::*;

    #[test]
    fn the_shaders_are_valid() {
        for text in [chains("f32"), chains("f64"), copy(64)] {
            validate("peak", &text).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}
