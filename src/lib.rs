//! Vibrissa sweeps and optimises tapered soft whisker sensors.
pub mod error;
pub mod kernel;
pub mod physics;
pub mod reduce;
pub mod scene;
pub mod spec;
pub mod status;
