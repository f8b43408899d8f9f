//! GPU backend: the WGSL kernels through wgpu, on hardware or on software Vulkan. All of wgpu lives in this folder.

mod adapter;
mod check;
mod clock;
pub mod compute;
mod dispatch;
pub mod drawn;
mod fault;
#[doc(hidden)]
pub mod lie;
pub mod ranking;
mod seal;
pub mod shader;
mod watched;

pub use adapter::{Adapter, SOFTWARE_RANKS, adapters, forked, pick};
pub use check::Passed;
pub use clock::left_behind;
pub use dispatch::Gpu;
pub use fault::{Fault, Log, Told, hear, quietly, tell};
pub use watched::{Verdicts, Watched};
