//! Where a benchmark ran.

use indexmap::IndexSet;

use crate::sink::frame::Frame;

/// Backends of a table in order of appearance, by what they are called; software adapters are called so.
pub struct Places(pub Vec<(String, [String; 3])>);

impl Places {
    /// Those of `table`.
    pub fn of(table: &Frame) -> Self {
        let keys: IndexSet<[String; 3]> = (0..table.len()).map(|r| Self::key(table, r)).collect();
        let named = |key: [String; 3]| {
            let [backend, precision, adapter] = &key;
            let name = match (backend.as_str(), is_software(adapter)) {
                ("gpu", true) => format!("software GPU {precision} ({})", short(adapter)),
                ("gpu", false) => format!("GPU {precision} ({adapter})"),
                ("cpu", _) => format!("CPU {precision}"),
                _ => format!("{backend} {precision}"),
            };
            (name, key)
        };
        Self(keys.into_iter().map(named).collect())
    }

    /// Backend, precision and adapter of a row.
    pub fn key(table: &Frame, r: usize) -> [String; 3] {
        ["backend", "precision", "adapter"].map(|c| table.word(c, r))
    }

    /// Rows of a place that `keep` keeps.
    pub fn rows(&self, table: &Frame, place: usize, keep: impl Fn(usize) -> bool) -> Vec<usize> {
        table.rows(|r| Self::key(table, r) == self.0[place].1 && keep(r))
    }
}

/// Whether `adapter` is a CPU in the clothes of a GPU.
fn is_software(adapter: &str) -> bool {
    let name = adapter.to_lowercase();
    ["llvmpipe", "lavapipe", "swiftshader", "basic render", "software"].iter().any(|word| name.contains(word))
}

/// An adapter's name without what stands in brackets.
fn short(adapter: &str) -> &str {
    adapter.split(" (").next().unwrap_or(adapter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_software_adapter_is_called_so() {
        assert!(
            is_software("llvmpipe (LLVM 15.0.6, 256 bits)") && is_software("Microsoft Basic Render Driver")
        );
        assert!(!is_software("NVIDIA H200") && !is_software(""));
        assert_eq!(short("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe");
    }
}
