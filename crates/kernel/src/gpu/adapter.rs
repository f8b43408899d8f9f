//! The adapters of this machine, and the choice of one.

use std::sync::atomic::{AtomicU32, Ordering};

use super::lie::Lie;
use vibrissa_core::error::SolveError;

/// An adapter and its properties.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Adapter {
    #[serde(skip)]
    inner: wgpu::Adapter,
    /// Name, as the driver gives it.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan, Metal, Dx12.
    pub api: String,
    /// Runs on the CPU (lavapipe, WARP).
    pub software: bool,
    /// Shaders may use f64.
    pub f64: bool,
    /// Largest storage buffer binding, bytes.
    #[serde(rename = "max_binding_bytes")]
    pub max_binding: u64,
    /// Largest number of workgroups in one dimension.
    pub max_workgroups: u32,
    /// Features of interest that are present.
    pub features: Vec<&'static str>,
    /// Faults to simulate, in tests.
    #[serde(skip)]
    pub(super) lie: Lie,
}

impl Adapter {
    fn new(inner: wgpu::Adapter) -> Self {
        let info = inner.get_info();
        let (limits, has) = (inner.limits(), inner.features());
        let named = [
            (wgpu::Features::SHADER_F64, "shader-f64"),
            (wgpu::Features::TIMESTAMP_QUERY, "timestamps"),
            (wgpu::Features::SUBGROUP, "subgroups"),
            (wgpu::Features::SHADER_INT64, "shader-int64"),
        ];
        Self {
            name: info.name.clone(),
            driver: [info.driver, info.driver_info].join(" ").trim().to_owned(),
            api: format!("{:?}", info.backend),
            software: info.device_type == wgpu::DeviceType::Cpu,
            f64: has.contains(wgpu::Features::SHADER_F64),
            max_binding: limits.max_storage_buffer_binding_size,
            max_workgroups: limits.max_compute_workgroups_per_dimension,
            features: named.iter().filter(|(f, _)| has.contains(*f)).map(|(_, n)| *n).collect(),
            lie: Lie::new(),
            inner,
        }
    }

    /// True if it ranks designs. A software device does not: CPU lanes read charts many times faster (`docs/cost.md`). Tests set [`SOFTWARE_RANKS`].
    pub fn ranks(&self) -> bool {
        !self.software || std::env::var_os(SOFTWARE_RANKS).is_some()
    }

    /// Opens the device with the adapter's buffer limits, and f64 on request.
    pub(super) fn open(&self, f64: bool) -> Result<(wgpu::Device, wgpu::Queue), SolveError> {
        let required_features = if f64 { wgpu::Features::SHADER_F64 } else { wgpu::Features::empty() };
        let request = self.inner.request_device(&wgpu::DeviceDescriptor {
            label: Some("vibrissa"),
            required_features,
            required_limits: self.inner.limits(),
            ..Default::default()
        });
        pollster::block_on(request).map_err(|e| SolveError::Device(format!("adapter {}: {e}", self.name)))
    }
}

/// Environment variable by which a software device ranks designs too.
pub const SOFTWARE_RANKS: &str = "VIBRISSA_SOFTWARE_RANKS";

/// Process that has asked drivers for their adapters; 0 before.
static ASKED_BY: AtomicU32 = AtomicU32::new(0);

/// Why drivers cannot be used: this process was forked from one that had used them, and lacks their threads. `None` if they can.
pub fn forked() -> Option<&'static str> {
    let by = ASKED_BY.load(Ordering::Relaxed);
    let why =
        "this process was forked from one that had asked the GPU's driver; one that is spawned can use it";
    (by != 0 && by != std::process::id()).then_some(why)
}

/// All adapters that can compute, hardware first; empty without a driver, or if [forked].
pub fn adapters() -> Vec<Adapter> {
    if forked().is_some() {
        return Vec::new();
    }
    ASKED_BY.store(std::process::id(), Ordering::Relaxed);
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    descriptor.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(descriptor);
    let mut found: Vec<_> =
        pollster::block_on(instance.enumerate_adapters(backends)).into_iter().map(Adapter::new).collect();
    found.sort_by_key(|a| a.software);
    found
}

/// The first adapter whose name contains `name` (any case); the first of all without a name.
pub fn pick(adapters: &[Adapter], name: Option<&str>) -> Option<Adapter> {
    let wanted = name.unwrap_or_default().to_lowercase();
    adapters.iter().find(|a| a.name.to_lowercase().contains(&wanted)).cloned()
}
