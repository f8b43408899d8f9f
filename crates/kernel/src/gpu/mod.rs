//! GPU backend: the WGSL kernels through wgpu, on hardware or on software Vulkan. All of wgpu lives in this folder.

mod adapter;
mod dispatch;
mod peak;
pub mod ranking;
pub mod shader;

pub use adapter::{Adapter, adapters, pick};
pub use dispatch::Gpu;
pub use peak::Peaks;
