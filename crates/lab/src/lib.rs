//! What a lab measured: readings of a rig ([`measure`]) and taps of its records ([`record`]), judged by estimators ([`estimator`], [`calibrate`]), answered
//! as distances ([`locate`]) and as curves of objects ([`contour`]); synthetic ones ([`simulate`]).

use vibrissa_core::{combinations, design, digits, error, estimate, physics, reduce, scene, status};
use vibrissa_evaluate::{backend, curve, evaluate, statistics, taps};
use vibrissa_spec as spec;
use vibrissa_table::{self as sink, fields, text_file};

pub mod calibrate;
#[doc(hidden)]
pub mod contour;
#[doc(hidden)]
pub mod estimator;
#[doc(hidden)]
pub mod export;
pub mod files;
#[doc(hidden)]
pub mod locate;
pub mod measure;
#[doc(hidden)]
pub mod record;
#[doc(hidden)]
pub mod simulate;
