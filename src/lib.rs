//! Vibrissa sweeps and optimises tapered soft whisker sensors.
//!
//! Data goes one way: [`spec`] reads a file into a [`scene`], [`plan`] turns it into sizes and indices, [`evaluate`]
//! sends taps to a [`kernel`] (or to the reference of [`physics`]), [`statistics`] reduces them, [`sink`] writes
//! tables; [`sweep`] drives it all, and [`smooth`] spares it most taps; [`explain`] compares the effects of a model,
//! [`verify`] the backends with the reference, [`mod@bench`] speed with error. [`optimise`] searches designs, [`tap`] the angle of one
//! whisker. [`measure`] reads what a rig recorded,
//! [`calibrate`] judges it, [`locate`] answers new readings, [`simulate`] makes synthetic ones. [`physics`] is pure; wgpu is
//! used only in `kernel::gpu` and `smooth::device`; files are written only in [`sink`].

#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

pub use vibrissa_core::{design, error, estimate, excerpt, layout, physics, reduce, scene, status};
pub use vibrissa_kernel::{self as kernel, smooth};

pub mod api;
pub mod backend;
pub mod bench;
pub mod calibrate;
pub mod evaluate;
pub mod explain;
pub mod locate;
pub mod measure;
pub mod optimise;
pub mod plan;
pub mod simulate;
pub mod sink;
pub mod spec;
pub mod statistics;
pub mod sweep;
pub mod tap;
pub mod verify;
