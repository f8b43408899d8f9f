//! What ranks the designs of a sweep from charts: the chart of the ideal rod, which a GPU can read too, or those of any model.

use serde_json::{Value, json};

use super::lanes::{Found, Tables};
use super::scope::Scope;
use crate::error::SolveError;
use crate::plan::Layout;
use crate::reduce::Sweeps;
use crate::scene::{Study, Tuple};
use crate::smooth::{self, Case};

/// A scope with its tables.
#[derive(Debug)]
pub enum Ranker {
    /// Frictionless, Hooke, on the centreline: one chart of the rod.
    Rod(Box<(smooth::Scope, smooth::Tables)>),
    /// Any model: a chart for each distance.
    Model(Box<(Scope, Tables)>),
}

impl Ranker {
    /// What ranks `study` at `tolerance`; `None` where its taps must be solved one by one. A device reads the chart of the rod; in lanes the
    /// charts of single distances are read faster, but there are rods that they do not hold.
    pub fn new(
        study: &Study,
        layout: &Layout,
        tolerance: f64,
        on_device: bool,
    ) -> Result<Option<Self>, SolveError> {
        let rod = || {
            let scope = smooth::Scope::new(study, layout, tolerance)?;
            let tables = smooth::Tables::new(&scope);
            Some(Self::Rod(Box::new((scope, tables))))
        };
        if on_device && let Some(rod) = rod() {
            return Ok(Some(rod));
        }
        let scope = Scope::new(study, layout, tolerance)?;
        let tables = scope.as_ref().and_then(Tables::new);
        Ok(scope.zip(tables).map(|both| Self::Model(Box::new(both))).or_else(rod))
    }

    /// The scope that a device can rank.
    pub fn rod(&self) -> Option<&smooth::Scope> {
        match self {
            Self::Rod(both) => Some(&both.0),
            Self::Model(_) => None,
        }
    }

    /// How the design `t` is dealt with.
    pub fn case(&self, t: &Tuple) -> Case {
        match self {
            Self::Rod(both) => both.0.case(t),
            Self::Model(both) => both.0.case(t),
        }
    }

    /// Rows of the designs `ks`, all easy, that rank below `bound`.
    pub fn rank(&self, ks: &[u64], tuples: &[Tuple], bound: f32, found: &mut Found) {
        match self {
            Self::Rod(both) => both.1.rank(ks, tuples, bound, found),
            Self::Model(both) => both.1.rank(ks, tuples, bound, found),
        }
    }

    /// K − 1 of taps of easy designs, each with the place of its distance, as the rows are made of them.
    pub fn deviations(&self, taps: &[(Tuple, usize)]) -> Vec<f64> {
        match self {
            Self::Rod(both) => both.1.deviations(taps),
            Self::Model(both) => both.1.deviations(taps),
        }
    }

    /// Candidates to bring back.
    pub fn keep(&self) -> usize {
        match self {
            Self::Rod(both) => both.0.rank.keep,
            Self::Model(both) => both.0.rank.keep,
        }
    }

    /// Of the taps solved to make and to check the charts.
    pub fn sweeps(&self) -> Sweeps {
        match self {
            Self::Rod(both) => both.0.chart.sweeps,
            Self::Model(both) => both.0.sweeps(),
        }
    }

    /// What `run.json` says of the charts.
    pub fn summary(&self) -> Value {
        match self {
            Self::Rod(both) => json!(both.0.chart.summary()),
            Self::Model(both) => json!(both.0.summary()),
        }
    }
}
