//! Readings of two gauges 90° apart round the whisker, over distance and tilt, and their inversion (model §6).
//! With the sign of the first gauge: r₁ = s₁ ε₁, r₂ = s₂ ε(90° + δ), δ the misalignment of the second gauge.

use super::ModelError;
use super::exact::{Extent, Values, scene_with};
use super::surface::continued;
use crate::curve::both::{self, Inverted, Inverter, Reading, TwoReadings};
use crate::design::Design;
use crate::error::SolveError;
use crate::evaluate::{Evaluator, Method, Task};
use crate::measure::Rig;
use crate::scene::{Direction, Setup};

/// Transfer from strains to readings of both gauges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    /// s₁ and s₂, reading per strain.
    pub factors: [f64; 2],
    /// δ, rad.
    pub misalignment: f64,
}

/// Model of a calibrated whisker with two gauges.
#[derive(Debug, Clone)]
pub struct Pair {
    pub setup: Setup,
    designs: [Design; 1],
    /// Offsets added to a labelled distance, mm, and to a labelled drive.
    offsets: [f64; 2],
    /// Lean of the pole, degrees.
    lean: f64,
    reach: [f64; 2],
}

impl Pair {
    /// Model of `rig` with the parameters `values`, over the distances of `at`, for poles that lean by `lean` degrees.
    pub fn new(rig: &Rig, values: &Values, at: Extent, lean: f64) -> Result<Self, ModelError> {
        let mut setup = scene_with(&rig.setup, values);
        setup.gauge.side = at.side;
        setup.gauge.second = true;
        let (reach, tuple) = continued(rig, at.reach)?;
        let design = Design::new(&setup, tuple);
        if design.shared.is_none() {
            return Err(ModelError::TooFar);
        }
        Ok(Self { setup, designs: [design], offsets: [values[2], values[1]], lean, reach })
    }

    pub fn evaluator(&self, method: Method) -> Evaluator<'_> {
        Evaluator::new(&self.setup, method)
    }

    pub fn tap(&self, a: f64, tilt: f64, drive: f64) -> Task {
        let ([a0, drive0], direction) = (self.offsets, Direction { tilt, lean: self.lean });
        Task { design: 0, a: a + a0, direction, drive: drive + drive0 }
    }

    /// Mean strains of taps: of the centreline, of the first gauge, and 90° further, in the sign of the first; `None` without a solution.
    pub fn strains(
        &self,
        evaluator: &mut Evaluator<'_>,
        taps: &[Task],
    ) -> Result<Vec<Option<[f64; 3]>>, SolveError> {
        let outcomes = evaluator.run(&self.designs, taps)?;
        let strains = outcomes.iter().map(|o| both::strains(&self.setup, o));
        Ok(strains.map(|strains| strains.filter(|[axial, ..]| axial.is_finite())).collect())
    }

    /// Taps from two readings each through `transfer`, with labelled distances; `None` if not found.
    pub fn invert(
        &self,
        evaluator: &mut Evaluator<'_>,
        transfer: &Transfer,
        asked: &[TwoReadings],
    ) -> Result<Vec<Option<Inverted>>, SolveError> {
        let reading: Reading<'_> = &|strains| transfer.readings(strains);
        let mut inverter =
            Inverter { setup: &self.setup, evaluator, designs: &self.designs, reading, taps: 0 };
        let mut found = inverter.invert(asked, &|_| self.reach)?;
        found.iter_mut().flatten().for_each(|one| one.task.a -= self.offsets[0]);
        Ok(found)
    }
}

impl Transfer {
    /// r₁ and r₂ for [`Pair::strains`].
    pub fn readings(&self, [axial, first, second]: [f64; 3]) -> [f64; 2] {
        let (sin, cos) = self.misalignment.sin_cos();
        let strain_2 = axial + (second - axial) * cos - (first - axial) * sin;
        [self.factors[0] * first, self.factors[1] * strain_2]
    }

    /// ε₁ and ε₂ for r₁ and r₂, without the strain of the centreline.
    pub fn strains(&self, readings: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.misalignment.sin_cos();
        let first = readings[0] / self.factors[0];
        [first, (readings[1] / self.factors[1] + first * sin) / cos]
    }
}
