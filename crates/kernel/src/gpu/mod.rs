//! GPU backend: the WGSL kernels through wgpu, on hardware or on software Vulkan. All of wgpu lives in this folder.

mod adapter;
pub mod check;
pub mod clock;
mod device;
mod dispatch;
mod lie;
mod log;
pub mod ranking;
pub mod shader;

pub use adapter::{Adapter, SOFTWARE_RANKS, adapters, forked, pick};
pub use clock::{hear, left_behind, quietly, tell};
pub use dispatch::Gpu;
pub use log::{Log, Told};
