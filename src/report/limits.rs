//! What a design must keep to count.

use super::source::Source;
use super::table::Table;

/// Limits of a result.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Limits {
    /// Rows with two distances for one reading do not count.
    unambiguous: bool,
    /// Largest strain, where a search has one of its own.
    strain: Option<f64>,
}

impl Limits {
    /// Those that the spec of `source` names.
    pub fn of(source: &Source) -> Self {
        source.in_force("optimise.limits").map_or(Self::default(), Self::read)
    }

    /// As a spec writes them: `{ strain = 0.02, unambiguous = true }`.
    fn read(text: &str) -> Self {
        let pairs = text.trim_matches(['{', '}', ' ']).split(',').filter_map(|p| p.split_once('='));
        let mut limits = Self::default();
        for (key, value) in pairs.map(|(k, v)| (k.trim(), v.trim())) {
            match key {
                "unambiguous" => limits.unambiguous = value == "true",
                "strain" => limits.strain = value.parse().ok(),
                _ => {}
            }
        }
        limits
    }

    /// Which rows of `table` keep them. A reading with a second distance breaks nothing, unless that is asked for.
    pub fn kept(&self, table: &Table) -> Vec<bool> {
        (0..table.len).map(|r| self.keeps(table, r)).collect()
    }

    fn keeps(&self, table: &Table, row: usize) -> bool {
        table.word("status", row).split('+').all(|word| match (word, self.strain) {
            ("ok" | "", _) => true,
            ("ambiguous", _) => !self.unambiguous,
            ("strain_limit", Some(limit)) if table.has("strain_max") => {
                table.number("strain_max", row) <= limit
            }
            _ => false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_distances_break_no_limit_unless_asked() {
        let text = "strain_max,status\n0.01,ok\n0.02,ambiguous\n0.03,strain_limit\n0.04,strain_limit+ambiguous\n,slipped_off\n0.01,\n";
        let table = Table::parse("t.csv", text.as_bytes()).unwrap();
        let kept = |limits: &str| Limits::read(limits).kept(&table);
        assert_eq!(kept(""), [true, true, false, false, false, true]);
        assert_eq!(kept("{ force_N = 1, unambiguous = true }"), [true, false, false, false, false, true]);
        assert_eq!(kept("{ strain = 0.035 }"), [true, true, true, false, false, true]);
    }
}
