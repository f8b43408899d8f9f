//! Tmp.
#![allow(dead_code)]
#[path = "suite/built.rs"]
mod built;
#[path = "suite/common/mod.rs"]
mod common;
#[path = "suite/gradient.rs"]
mod gradient;
