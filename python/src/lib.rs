//! The native part of the Python package `vibrissa`: what it is asked in numbers and text goes to the library, what that tells
//! comes back as columns, JSON text and exceptions. Words, defaults and documentation are Python's, in `vibrissa/`.

#[cfg(feature = "extension")]
mod native;
