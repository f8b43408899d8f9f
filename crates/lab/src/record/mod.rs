//! Taps out of a raw signal: rest, onset, plateau or peak.
//!
//! The level without contact is followed through the record ([`mod@rest`]); what stands out of it is contact ([`mod@find`]); a contact holds one reading, or
//! one for each drive at which it stands still.

pub mod certain;
pub mod chain;
pub mod contact;
pub mod find;
pub mod raw;
pub mod rest;

pub use find::{Kind, Reading, Take, find};
pub use raw::Record;
