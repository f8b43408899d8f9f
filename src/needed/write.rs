//! What is said of a model with effects left off: in `run.json` and on the terminal.

use std::fmt::Write;

use serde_json::{Value, json};

use super::{Checked, Needed, Part};
use crate::scene::Drive;

impl Needed {
    /// `model_error` of `run.json`; `solving`: seconds that the run spent on solving and charting taps.
    pub fn summary(&self, solving: f64) -> Value {
        let kind = self.full.drive;
        let checked = |c: &Option<Checked>| c.as_ref().map_or(Value::Null, |c| checked(kind, c));
        let left = |p: &Part| json!({ "effect": p.effect.name(), "key": p.effect.key(), "spec": p.spec, "instead": p.instead, "alone": checked(&p.alone) });
        let kept = |p: &Part| json!({ "effect": p.effect.name(), "key": p.effect.key(), "spec": p.spec, "why": self.why(p, "it"), "alone": checked(&p.alone), "together": checked(&p.together) });
        json!({
            "bound": self.bound,
            "left_off": self.parts.iter().filter(|p| p.left).map(left).collect::<Vec<_>>(),
            "needed": self.parts.iter().filter(|p| !p.left).map(kept).collect::<Vec<_>>(),
            "spread": checked(&self.spread),
            "own_taps": checked(&self.own),
            "rows_kept": checked(&self.kept),
            "fallbacks": self.fallbacks,
            "seconds": {
                "choosing": self.seconds[0],
                "checking": self.seconds[1],
                "tap_full": self.each.map(|e| e[0]),
                "tap": self.each.map(|e| e[1]),
                "saved": self.saved(solving),
            },
        })
    }

    /// Seconds that the full model would have taken longer, about: as many times as long as it takes for a tap of the spread, less what it took
    /// to choose and to check.
    pub fn saved(&self, solving: f64) -> f64 {
        let times = self.each.map_or(1.0, |[full, reduced]| full / reduced);
        solving * (times - 1.0) - self.seconds.iter().sum::<f64>()
    }

    /// Why an effect, which is called `it`, is not left off.
    fn why(&self, part: &Part, it: &str) -> String {
        let told = |c: &Checked, who: &str| match c.status_at {
            Some((_, [full, other])) if c.error <= self.bound => {
                format!("without {who} a status would change from {full} to {other}")
            }
            _ => format!("without {who} strain changes by {:.2e}", c.error),
        };
        match (&part.alone, &part.together) {
            (None, None) => format!("friction needs {it}"),
            (Some(alone), _) if !alone.holds(self.bound) => told(alone, it),
            (_, Some(together)) if !together.holds(self.bound) => {
                told(together, &format!("{it} and those left off"))
            }
            _ if self.fallbacks > 0 => format!("rows of the result did not keep the bound without {it}"),
            _ => format!("taps beside those of the spread did not keep the bound without {it}"),
        }
    }

    /// What was left off and how well that holds, in a few lines.
    pub fn sentence(&self) -> String {
        let left: Vec<&Part> = self.parts.iter().filter(|p| p.left).collect();
        let bound = self.bound;
        if left.is_empty() {
            return match self.nearest() {
                None => format!("--model-error {bound:e}: the model has no effect to leave off\n"),
                Some(p) => {
                    let why = self.why(p, p.effect.name());
                    format!("--model-error {bound:e} leaves off nothing: {why}\n")
                }
            };
        }
        let name = |p: &&Part| format!("{} ({} in place of {})", p.effect.name(), p.instead, p.spec);
        let names = left.iter().map(name).collect::<Vec<_>>().join(", ");
        let mut text = format!("--model-error {bound:e} leaves off {names}\n");
        let at = |c: &Option<Checked>, who: &str| {
            c.as_ref().map(|c| format!("{:.1e} at {} {who}", c.error, c.taps))
        };
        let all = [
            at(&self.spread, "taps over the space"),
            at(&self.own, "others"),
            at(&self.kept, "taps of the rows kept"),
        ];
        let most = all.into_iter().flatten().collect::<Vec<_>>().join(", ");
        let statuses = match self.kept.filter(|c| !c.holds(bound)) {
            None => "no status changes".to_owned(),
            Some(c) => format!("rows kept do not keep the bound, {} statuses change", c.statuses),
        };
        let _ = write!(text, "  strain changes by at most {most}; {statuses}");
        if let Some([full, reduced]) = self.each {
            let _ = write!(text, "; a tap is solved in {:.0} % of the time", 100.0 * reduced / full);
        }
        text.push('\n');
        if let Some(kept) = &self.kept {
            let [sd, total] = kept.figures.map(|x| 100.0 * x);
            let _ = writeln!(
                text,
                "  of the rows kept K_sd changes by up to {sd:.2} %, total_rms_mm by up to {total:.2} %"
            );
        }
        text
    }

    /// The effect that is the nearest to being left off.
    fn nearest(&self) -> Option<&Part> {
        let size = |p: &&Part| p.together.or(p.alone).map_or(f64::INFINITY, |c| c.error);
        self.parts.iter().min_by(|a, b| size(a).total_cmp(&size(b)))
    }
}

/// Of one comparison.
fn checked(kind: Drive, c: &Checked) -> Value {
    let at = |t: &crate::scene::Tuple| {
        let mut at =
            json!({ "D_mm": t.D, "d_mm": t.d, "L_a_mm": t.L_a, "x_ss_mm": t.x_ss, "l_mm": t.l, "a_mm": t.a });
        at[kind.column()] = t.drive.into();
        at
    };
    let mut value = json!({ "taps": c.taps, "error": c.error, "at": c.at.as_ref().map(at), "by_full_model": c.by_full, "statuses_changed": c.statuses, "K_sd_changed": c.figures[0], "total_rms_changed": c.figures[1] });
    if let Some((tap, [full, other])) = &c.status_at {
        value["status_at"] = at(tap);
        value["status"] = json!([full.to_string(), other.to_string()]);
    }
    value
}
