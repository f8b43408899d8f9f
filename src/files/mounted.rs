//! A whisker of an array, ready to answer.

use super::Mount;
use crate::contour::array::Mounted;
use crate::error::Error;
use crate::estimator::Estimator;
use crate::locate::{Calibration, Locator, locator::opener};
use crate::scene::RunOptions;

impl Mount {
    /// Its whisker by its `calibration`, with the estimator that won if no other is named.
    ///
    /// # Errors
    /// An estimator that the calibration does not hold; a backend that fails.
    pub fn open(
        &self,
        calibration: &Calibration,
        estimator: Option<&'static dyn Estimator>,
        options: &RunOptions,
    ) -> Result<Mounted, Error> {
        let label = self.calibration.display().to_string();
        let locator = Locator::new(calibration, &label, estimator, &opener(options))?;
        Ok(Mounted { name: self.name.clone(), locator, pose: self.pose })
    }
}
