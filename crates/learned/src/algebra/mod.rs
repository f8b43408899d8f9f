//! Linear algebra that more than this crate needs, compiled here once: a generic matrix is compiled where it is used, as that is.

pub mod least;
