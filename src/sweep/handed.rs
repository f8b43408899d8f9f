//! Rows of which a tap was answered by the CPU in place of the device that was asked for.

use serde_json::{Value, json};

use crate::kernel::gpu::Log;

/// Stretches of rows, counted from 1 within the sweep or the part.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Handed {
    #[serde(skip)]
    device: Log,
    /// Taps that the CPU had answered when it was last looked at.
    #[serde(skip)]
    seen: u64,
    /// What is counted, how far it is.
    reached: (String, u64),
    /// What is counted, the first, the last, of how many.
    stretches: Vec<(String, [u64; 3])>,
}

impl Handed {
    /// Goes on with these on `device`.
    pub fn on(self, device: Log) -> Self {
        Self { seen: device.get().handed_over_taps, device, ..self }
    }

    /// Everything up to `done` of `of` is answered.
    pub fn note(&mut self, (done, of, what): (u64, u64, &str)) {
        self.look((done, of, what));
        self.reached.1 = done;
    }

    /// The same, and some of the next.
    pub fn note_within(&mut self, (done, of, what): (u64, u64, &str)) {
        self.look((done + 1, of, what));
    }

    fn look(&mut self, (done, of, what): (u64, u64, &str)) {
        if self.reached.0 != what {
            self.reached = (what.to_owned(), 0);
        }
        let taps = self.device.get().handed_over_taps;
        if taps > self.seen {
            let from = self.reached.1 + 1;
            match self.stretches.last_mut() {
                Some((last, [_, to, _])) if last == what && *to + 1 >= from => *to = done,
                _ => self.stretches.push((what.to_owned(), [from, done, of])),
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
