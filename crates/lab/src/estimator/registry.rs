//! All estimators, and the record of a side that holds a section of each.

use serde::{Deserialize, Serialize};

use super::curve::SmoothRecord;
use super::exact::ExactRecord;
use super::learned::LearnedRecord;
use super::paper::FactorRecord;
use super::{Estimator, Fault, ascending, curve, exact, known, learned, paper, positive};
use crate::scene::Side;

/// Makes of each line an entry of [`ALL`] and a section of [`SideRecord`], in the order of the lines. A section has the name of
/// its estimator.
macro_rules! registry {
    ($($(#[$what:meta])* $section:ident: $record:ty = $estimator:expr;)*) => {
        /// All, simplest first: of equals the first is taken.
        pub const ALL: [&dyn Estimator; [$(stringify!($section)),*].len()] = [$(&$estimator),*];

        /// Calibration of one side of the whisker.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct SideRecord {
            /// Sign of its readings: 1 or −1.
            pub sign: i8,
            /// Side of the gauge that this sign means: contact or far.
            pub gauge_side: String,
            /// Smallest and largest calibrated distance.
            pub distances_mm: [f64; 2],
            /// Calibrated drives, ascending: of each that was reached with jitter the mean.
            pub drives: Vec<f64>,
            /// Smallest and largest drive among the taps, where that is not the first and the last of these.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub drive_ends: Option<[f64; 2]>,
            /// |signal| at which the sensor stands still, where the data show one.
            pub end_stop: Option<f64>,
            /// Why `exact` is not there, where the whisker and its drives are known.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub no_exact: Option<String>,
            $($(#[$what])* #[serde(skip_serializing_if = "Option::is_none")] pub $section: Option<$record>,)*
        }

        impl SideRecord {
            /// Of a side of which no estimator is calibrated yet; distances in mm, `drives` ascending.
            pub fn new(sign: i8, gauge: Side, distances_mm: [f64; 2], drives: Vec<f64>) -> Self {
                let gauge_side = if gauge == Side::Far { "far" } else { "contact" }.to_owned();
                Self { sign, gauge_side, distances_mm, drives, drive_ends: None, end_stop: None, no_exact: None, $($section: None),* }
            }
        }
    };
}

registry! {
    /// f and K̄ per drive.
    paper: FactorRecord = paper::PAPER;
    /// The model.
    exact: ExactRecord = exact::EXACT;
    /// A smooth curve through the data.
    curve: SmoothRecord = curve::CURVE;
    /// Curve, rig and runs.
    learned: LearnedRecord = learned::LEARNED;
}

impl SideRecord {
    /// Side of the gauge that was calibrated.
    pub fn gauge(&self) -> Side {
        if self.gauge_side == "far" { Side::Far } else { Side::Contact }
    }

    /// The other one.
    pub fn other_gauge(&self) -> Side {
        if self.gauge() == Side::Far { Side::Contact } else { Side::Far }
    }

    /// Smallest and largest calibrated drive.
    pub fn ends(&self) -> [f64; 2] {
        let [first, last] = [self.drives[0], self.drives[self.drives.len() - 1]];
        self.drive_ends.map_or([first, last], |[lo, hi]| [lo.min(first), hi.max(last)])
    }

    /// Refuses values that contradict each other.
    ///
    /// # Errors
    /// The key at fault, and what is wrong with it.
    pub fn check(&self) -> Result<(), (&'static str, Fault)> {
        let fault = |key, message, allowed| Err((key, Fault { message, allowed }));
        let [lo, hi] = self.distances_mm;
        if self.drives.is_empty() || !positive(&self.drives) || !ascending(&self.drives) {
            return fault("drives", "these are no drives", "ascending, > 0");
        }
        if self.drive_ends.is_some_and(|ends| !positive(&ends)) {
            return fault("drive_ends", "these are no drives", "> 0");
        }
        if !positive(&[lo, hi]) || lo >= hi {
            return fault("distances_mm", "this is no range of distances", "0 < smallest < largest, mm");
        }
        if self.sign.abs() != 1 || !["contact", "far"].contains(&self.gauge_side.as_str()) {
            return fault("sign", "this is no side", "1 or -1, with contact or far");
        }
        for e in ALL {
            e.check(self).map_err(|f| (e.name(), f))?;
        }
        let wrong = |bias: &[f64]| bias.len() != self.drives.len() || !known(bias);
        if ALL.into_iter().filter_map(|e| e.bias_mm(self)).any(wrong) {
            return fault("bias_mm", "one bias ≥ 0 is needed for each drive", "as many as drives, mm");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_has_the_name_of_its_estimator() {
        let text = ALL.map(|e| format!("[{}]\n", e.name())).concat();
        let sections: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(sections.len(), ALL.len(), "names differ");
        let record = SideRecord::new(1, Side::Contact, [20.0, 40.0], vec![4.0]);
        for e in ALL {
            assert!(!e.is_in(&record) && super::super::named(e.name()) == Some(e));
            // A section that is known is read, and found to hold nothing.
            let mut table = toml::Table::try_from(&record).unwrap();
            table.insert(e.name().to_owned(), toml::Table::new().into());
            let refused = table.try_into::<SideRecord>().unwrap_err().to_string();
            assert!(refused.contains("missing field"), "{refused}");
        }
    }
}
