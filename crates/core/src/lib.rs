//! Whiskers without a kernel: the question, closed forms and the reference rod, designs, estimates, status words. Pure: no files, no GPU.

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
