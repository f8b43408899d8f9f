//! Vibrissa sweeps and optimises tapered soft whisker sensors.
//!
//! Start with [`api`]. Data goes one way: [`spec`] reads a file into a [`scene`] (what was asked), [`plan`] says what will run and how,
//! [`evaluate`] sends taps to a [`kernel`] (or to the reference of [`physics`]), [`statistics`] reduces them to rows, [`sink`] takes
//! rows; [`sweep`] does what the plan says, and [`chart`]
//! spares it most taps. [`census`] compares the effects of a model, the backends with the reference, speed with error. `reference` says what keys, columns and words mean. [`optimise`] searches designs, [`tap`] the angle of one whisker.
//! `command` is what the program and the Python package run: a request, and its reply.
//! [`measure`] reads what a rig recorded ([`files`]: its spec and its calibration, as TOML), [`calibrate`] judges it, [`locate`] answers new
//! readings, [`export`] writes what answers them as C, [`simulate`] makes synthetic ones.
//! What is pure stands in the crate `vibrissa-core`, the kernels in `vibrissa-kernel`, where wgpu is used in `kernel::gpu` only, [`evaluate`],
//! [`curve`] and [`statistics`] in `vibrissa-evaluate`, charts in `vibrissa-chart`, what a lab measured in `vibrissa-lab`.
//! `docs/architecture.md` says where a thing belongs.

#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

#[doc(hidden)]
pub use vibrissa_chart as chart;
#[doc(hidden)]
pub use vibrissa_core::{
    combinations, design, digits, error, estimate, excerpt, physics, recommend, reduce, scene, status,
};
#[doc(hidden)]
pub use vibrissa_evaluate::{backend, curve, evaluate, progress, statistics, taps};
#[doc(hidden)]
pub use vibrissa_kernel as kernel;
#[doc(hidden)]
pub use vibrissa_lab::{calibrate, contour, estimator, export, files, locate, measure, record, simulate};
#[doc(hidden)]
pub use vibrissa_spec as spec;
#[doc(hidden)]
pub use vibrissa_table::{self as sink, fields, text_file};

pub mod api;
#[doc(hidden)]
pub mod census;
#[doc(hidden)]
#[cfg(feature = "commands")]
pub mod command;
#[doc(hidden)]
pub mod explore;
#[doc(hidden)]
#[cfg(feature = "commands")]
pub mod figure;
#[doc(hidden)]
pub mod merge;
#[doc(hidden)]
pub mod optimise;
#[doc(hidden)]
#[cfg(feature = "commands")]
pub mod page;
#[doc(hidden)]
pub mod plan;
#[doc(hidden)]
pub mod reference;
#[doc(hidden)]
#[cfg(feature = "commands")]
pub mod report;
#[doc(hidden)]
pub mod shape;
#[doc(hidden)]
pub mod sweep;
#[doc(hidden)]
pub mod tap;
