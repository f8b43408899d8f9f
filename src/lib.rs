//! Vibrissa sweeps and optimises tapered soft whisker sensors.
//!
//! Start with [`api`]. Data goes one way: [`spec`] reads a file into a [`scene`] (what was asked), [`plan`] says what will run and how,
//! [`evaluate`] sends taps to a [`kernel`] (or to the reference of [`physics`]), [`statistics`] reduces them to rows, [`sink`] takes
//! rows; [`sweep`] does what the plan says, and [`chart`]
//! spares it most taps. [`explain`] compares the effects of a model, [`verify`]
//! the backends with the reference, `bench` speed with error. `reference` says what keys, columns and words mean. [`optimise`] searches designs, [`tap`] the angle of one whisker.
//! [`measure`] reads what a rig recorded (`files`: its spec and its calibration, as TOML), [`calibrate`] judges it, [`locate`] answers new readings, [`export`] writes what answers them as C or Python, [`simulate`] makes synthetic ones.
//! What is pure stands in the crate `vibrissa-core`, the kernels in `vibrissa-kernel`, where wgpu is used in `kernel::gpu` only, [`evaluate`],
//! [`curve`] and [`statistics`] in `vibrissa-evaluate`, charts in `vibrissa-chart`.
//! `docs/architecture.md` says where a thing belongs.

#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

pub use vibrissa_chart as chart;
pub use vibrissa_core::{design, error, estimate, excerpt, physics, reduce, scene, status};
pub use vibrissa_evaluate::{curve, evaluate, progress, statistics};
pub use vibrissa_kernel as kernel;

pub mod api;
pub mod backend;
#[cfg(feature = "bench")]
pub mod bench;
pub mod calibrate;
pub mod contour;
pub mod estimator;
pub mod explain;
#[cfg(feature = "files")]
pub mod explore;
pub mod export;
#[cfg(feature = "report")]
pub mod figure;
#[cfg(feature = "files")]
pub mod files;
pub mod locate;
pub mod measure;
pub mod merge;
pub mod needed;
pub mod optimise;
#[cfg(feature = "report")]
pub mod page;
pub mod plan;
pub mod record;
#[cfg(feature = "files")]
pub mod reference;
#[cfg(feature = "report")]
pub mod report;
pub mod shape;
pub mod simulate;
pub mod sink;
#[cfg(feature = "files")]
pub mod spec;
pub mod sweep;
pub mod tap;
pub mod taps;
pub mod verify;
