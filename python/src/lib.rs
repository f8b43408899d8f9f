//! The native part of the Python package `vibrissa`: what it is asked in numbers and text goes to the library, what that tells
//! comes back as columns, JSON text and exceptions. Words, defaults and documentation are Python's, in `vibrissa/`.

#[cfg(feature = "extension")]
mod answers;
#[cfg(feature = "extension")]
mod array;
#[cfg(feature = "extension")]
mod column;
#[cfg(feature = "extension")]
mod contour;
#[cfg(feature = "extension")]
mod error;
#[cfg(feature = "extension")]
mod fork;
#[cfg(feature = "extension")]
mod held;
#[cfg(feature = "extension")]
mod job;
#[cfg(feature = "extension")]
mod lab;
#[cfg(feature = "extension")]
mod locate;
#[cfg(feature = "extension")]
mod machine;
#[cfg(feature = "extension")]
mod module;
#[cfg(feature = "extension")]
mod page;
#[cfg(feature = "extension")]
mod search;
#[cfg(feature = "extension")]
mod several;
#[cfg(feature = "extension")]
mod shape;
#[cfg(feature = "extension")]
mod spec;
#[cfg(feature = "extension")]
mod sweep;
#[cfg(feature = "extension")]
mod table;
#[cfg(feature = "extension")]
mod taps;
#[cfg(feature = "extension")]
mod words;
