//! An opened device: compiling, dispatching, reading back.

use std::fmt::Display;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::adapter::Adapter;
use super::clock::{PATIENCE, within};
use super::lie::Fault;
use super::shader::{WORKGROUP, validate};
use vibrissa_core::error::SolveError;

#[derive(Debug, Clone)]
pub(super) struct Device {
    pub adapter: Adapter,
    handle: wgpu::Device,
    queue: wgpu::Queue,
    /// The first error that the driver reported by callback, not yet returned.
    said: Arc<Mutex<Option<String>>>,
}

impl Device {
    /// Opens `adapter` with its buffer limits, and f64 on request. Fails with the driver, or where shaders have no f64.
    pub fn open(adapter: Adapter, f64: bool) -> Result<Self, SolveError> {
        let (handle, queue) = adapter.open(f64)?;
        let said = Arc::<Mutex<Option<String>>>::default();
        let heard = Arc::clone(&said);
        let hear = move |words| {
            heard.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(words);
        };
        let lost = hear.clone();
        handle.set_device_lost_callback(move |_, words| lost(words));
        handle.on_uncaptured_error(Arc::new(move |e: wgpu::Error| hear(e.to_string())));
        Ok(Self { adapter, handle, queue, said })
    }

    fn call<T: Send + 'static>(
        &self,
        what: &str,
        call: impl FnOnce(&wgpu::Device) -> Result<T, String> + Send + 'static,
    ) -> Result<T, SolveError> {
        let fault = self.adapter.lie.next();
        if fault == Some(Fault::Lose) {
            self.handle.destroy();
        }
        let patience = if fault == Some(Fault::Hang) { Duration::ZERO } else { PATIENCE };
        let handle = self.handle.clone();
        let done = within(patience, what, move || {
            assert!(fault != Some(Fault::Panic), "the driver panicked");
            if fault == Some(Fault::Hang) {
                std::thread::sleep(Duration::from_millis(50));
            }
            call(&handle)
        });
        // The driver's report is closer to the cause than the call's error.
        self.heard()?;
        done.and_then(|done| done).map_err(SolveError::Device)
    }

    pub fn heard(&self) -> Result<(), SolveError> {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner).take();
        said.map_or(Ok(()), |words| Err(failed(words)))
    }

    /// Compiles `wgsl`, whose entry point is `main`; without checks at run time if it is `bounded`. Fails on
    /// invalid text, or if the driver refuses or is too slow.
    pub fn compile(
        &self,
        name: &str,
        wgsl: &str,
        bounded: bool,
    ) -> Result<wgpu::ComputePipeline, SolveError> {
        let wgsl = self.adapter.lie.text(wgsl);
        validate(name, &wgsl)?;
        let label = name.to_owned();
        self.call(&format!("compiling kernel {name}"), move |device| pipeline(device, &label, &wgsl, bounded))
    }

    /// A buffer of `size` bytes, at least 16.
    pub fn buffer(&self, size: usize, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let (label, size) = (Some("vibrissa"), size.max(16) as u64);
        self.handle.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
    }

    pub fn write(&self, buffer: &wgpu::Buffer, bytes: &[u8]) {
        self.queue.write_buffer(buffer, 0, bytes);
    }

    /// Submits `pipeline` over `buffers`, bound in their order, with `count` invocations. First poisons `outputs` with zeros, which no kernel writes
    /// everywhere; last copies the first `bytes` of `from` to `to`.
    pub fn submit(
        &self,
        pipeline: &wgpu::ComputePipeline,
        buffers: &[&wgpu::Buffer],
        count: u32,
        outputs: &[&wgpu::Buffer],
        copy: (&wgpu::Buffer, &wgpu::Buffer, usize),
    ) -> wgpu::SubmissionIndex {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let bind = self.handle.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vibrissa"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = self.handle.create_command_encoder(&Default::default());
        outputs.iter().for_each(|output| encoder.clear_buffer(output, 0, None));
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &bind, &[]);
            pass.dispatch_workgroups(count.div_ceil(WORKGROUP), 1, 1);
        }
        self.copied(encoder, copy)
    }

    fn copied(
        &self,
        mut encoder: wgpu::CommandEncoder,
        (from, to, bytes): (&wgpu::Buffer, &wgpu::Buffer, usize),
    ) -> wgpu::SubmissionIndex {
        encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes as u64);
        self.queue.submit([encoder.finish()])
    }

    pub fn fetch<T>(
        &self,
        copy: (&wgpu::Buffer, &wgpu::Buffer, usize),
        of: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, SolveError> {
        let at = self.copied(self.handle.create_command_encoder(&Default::default()), copy);
        self.read(copy.1, copy.2, at, of)
    }

    /// Waits for the submission `at`; returns `of` the first `bytes` of `readback`. Fails if the device fails or is too slow.
    pub fn read<T>(
        &self,
        readback: &wgpu::Buffer,
        bytes: usize,
        at: wgpu::SubmissionIndex,
        of: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, SolveError> {
        let (send, receive) = std::sync::mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, 0..bytes as u64, move |r| {
            let _ = send.send(r);
        });
        // Longer than the clock, so that the waiting thread ends too.
        let wait = wgpu::PollType::Wait { submission_index: Some(at), timeout: Some(2 * PATIENCE) };
        self.call("a dispatch", move |device| device.poll(wait).map(drop).map_err(|e| e.to_string()))?;
        receive.try_recv().map_err(failed)?.map_err(failed)?;
        let view = readback.get_mapped_range(0..bytes as u64).map_err(failed)?;
        let value = of(&view);
        drop(view);
        readback.unmap();
        Ok(value)
    }
}

fn failed(why: impl Display) -> SolveError {
    SolveError::Device(format!("the device failed: {why}"))
}

fn pipeline(
    device: &wgpu::Device,
    name: &str,
    wgsl: &str,
    bounded: bool,
) -> Result<wgpu::ComputePipeline, String> {
    // Scopes belong to a thread: it begins and ends on this one.
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let source =
        wgpu::ShaderModuleDescriptor { label: Some(name), source: wgpu::ShaderSource::Wgsl(wgsl.into()) };
    let checks =
        if bounded { wgpu::ShaderRuntimeChecks::unchecked() } else { wgpu::ShaderRuntimeChecks::checked() };
    // SAFETY: the text is ours and validated; without checks its loops and indices are bounded.
    let module = unsafe { device.create_shader_module_trusted(source, checks) };
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    pollster::block_on(scope.pop()).map_or(Ok(pipeline), |e| Err(format!("shader {name}: {e}")))
}
