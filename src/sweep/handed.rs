//! Rows of which a tap was answered by the CPU in place of the device that was asked for.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::kernel::gpu::Log;

/// Stretches of rows, counted from 1 within the sweep or the part.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Handed {
    /// What is counted, the first, the last, of how many.
    stretches: Vec<(String, [u64; 3])>,
    #[serde(skip)]
    device: Log,
    /// Taps that the CPU had answered when it was last looked at.
    #[serde(skip)]
    seen: u64,
}

impl Handed {
    /// Continues with these on `device`.
    pub fn on(self, device: Log) -> Self {
        Self { seen: device.get().handed_over_taps, device, ..self }
    }

    /// From the first to the last of so many `what`, all are answered now.
    pub fn note(&mut self, what: &str, [from, to, of]: [u64; 3]) {
        let taps = self.device.get().handed_over_taps;
        if taps > self.seen {
            match self.stretches.last_mut() {
                Some((last, [_, end, _])) if last == what && *end + 1 >= from => *end = to,
                _ => self.stretches.push((what.to_owned(), [from, to, of])),
            }
        }
        self.seen = taps;
    }

    /// `handed_over` of `run.json`; nothing where the device answered all.
    pub fn described(&self) -> Option<Value> {
        let one = |(what, [from, to, of]): &(String, [u64; 3])| json!({ "what": what, "from": from, "to": to, "of": of });
        let list: Vec<Value> = self.stretches.iter().map(one).collect();
        (!list.is_empty()).then(|| list.into())
    }
}
