//! How the taps of a sweep are found.

use super::CHUNK;
use crate::backend::Choice;
use crate::scene::Layout;
use crate::scene::{Geometry, Study};
use crate::smooth::{Scope, drives::DriveAxis};

/// How taps are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Rows are ranked from a chart of the rod; those kept are solved.
    Charted,
    /// Along the drives of a distance some taps are solved and the others read.
    OverDrives,
    /// Every tap is solved by a kernel.
    TapByTap,
    /// Every tap is solved by the reference.
    Reference,
}

impl Way {
    /// The way of taps that no chart ranks.
    pub(super) fn solved(study: &Study, layout: Option<&Layout>, choice: &Choice) -> Self {
        if choice.backend.tolerance.is_none() {
            return Self::Reference;
        }
        let over = |layout: &Layout| {
            study.setup.model.geometry == Geometry::Exact
                && layout.drives().is_some_and(|axis| DriveAxis::pays(axis.len()))
                && layout.block() <= CHUNK
        };
        if layout.is_some_and(over) { Self::OverDrives } else { Self::TapByTap }
    }

    /// What the designs of a sweep share, where a chart can rank them.
    pub(super) fn charted(study: &Study, layout: &Layout, choice: &Choice) -> Option<Scope> {
        Scope::new(study, layout, choice.chart_tolerance()?)
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Charted => "ranked from a chart",
            Self::OverDrives => "solved at some drives, read at the others",
            Self::TapByTap => "solved tap by tap",
            Self::Reference => "solved by the reference",
        }
    }
}
