//! Vibrissa sweeps and optimises tapered soft whisker sensors.
//!
//! Start with [`api`]. Data goes one way: [`spec`] reads a file into a [`scene`], [`plan`] says what will run, [`evaluate`] sends taps to a
//! [`kernel`] (or to the reference in [`physics`]) unless a [`chart`] answers them, [`statistics`] reduces them to rows, [`sink`] takes rows;
//! [`sweep`] runs a plan. [`optimise`] searches designs, [`tap`] the angle of one whisker; [`census`] compares effects and backends. [`measure`]
//! reads what a rig recorded, [`calibrate`] judges it, [`locate`] answers new readings, [`export`] writes them as C, [`simulate`] makes synthetic
//! ones. `command` is what the program and Python run. `docs/architecture.md` says where a thing belongs.

#![cfg_attr(not(test), deny(clippy::print_stderr, clippy::print_stdout))]

#[doc(hidden)]
pub use {
    vibrissa_chart as chart,
    vibrissa_core::{
        combinations, design, digits, error, estimate, excerpt, physics, recommend, reduce, scene, status,
    },
    vibrissa_evaluate::{backend, curve, evaluate, progress, statistics, taps},
    vibrissa_kernel as kernel,
    vibrissa_lab::{calibrate, contour, estimator, export, files, locate, measure, record, simulate},
    vibrissa_spec as spec,
    vibrissa_table::{self as sink, fields, text_file},
};

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
