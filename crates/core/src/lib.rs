//! What a whisker is and what follows from it without any solver: the question ([`scene`]), the closed forms and the reference rod
//! ([`physics`]), what a design's taps share ([`design`]), the paper's estimate ([`estimate`]), words ([`status`]), sums ([`reduce`]).
//! Pure: no files, no threads of its own, no GPU.

pub mod combinations;
pub mod contact;
pub mod design;
pub mod digits;
pub mod error;
pub mod estimate;
pub mod excerpt;
pub mod normal;
pub mod physics;
pub mod recommend;
pub mod reduce;
pub mod scene;
pub mod status;
