//! The native part of the Python package `vibrissa`: passes numbers and text to the library; returns columns, JSON text and exceptions.
//! Words, defaults and documentation are in Python, in `vibrissa/`.

#[cfg(feature = "extension")]
mod native;
