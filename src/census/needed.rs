//! Only what the scene needs (`--model-error E`): the effects of a model whose joint change of strain stays within E are left off.
//!
//! The change is |ε − ε_full|/max(|ε_full|, 1e-3 θ f_max), as a tolerance counts it. It is measured in f64 on the CPU over a spread of the
//! scene's own space with its ends ([`ComparedRows`]), beginning with the effect that changes least alone and adding one at a time, so that
//! what is bounded is the change of all of them together. The model that results must keep the bound at taps that did not choose it, and at
//! every row that is kept ([`Needed::keeps`]); where it does not, nothing is left off. Taps near a threshold of a
//! status are solved by the full model ([`Needed::guard`]); an effect without which any other word would change stays, those of the estimate
//! included. So do finite rotation, without which K is 1 and nothing can be ranked, and hub and side, which are geometry.

use std::fmt::Write;
use std::time::Instant;

use serde_json::{Value, json};

use super::effect::{Effect, Setting};
use super::sample::{ComparedRows, Row};
use super::{Taps, relative, tap_json};
use crate::backend::Choice;
use crate::curve::{self, Ask, Reach, both};
use crate::error::Error;
use crate::evaluate::{Evaluator, Guard, doubts};
use crate::scene::{BackendChoice, Contact, Drive, Precision, RunOptions, Setup, Tuple};
use crate::statistics::{Reduction, Told};
use crate::status::Status;

/// Of so many rows one is looked at before all are: most effects are too large at any of them.
const FIRST: usize = 8;

/// So many times the bound from a threshold, a word is that of the full model.
const DOUBT: f64 = 2.0;

/// Taps of kept rows that are compared together.
const TOGETHER: usize = 1 << 12;

/// What a model says of the taps of some rows.
struct Said {
    taps: Taps,
    /// Strain, contact arc, mm, and all words of each tap.
    answers: Vec<(f64, f64, Status)>,
    /// K_sd and total_rms_mm of each row.
    figures: Vec<[Option<f64>; 2]>,
    /// What a tap took, s.
    each: f64,
}

impl Said {
    /// Of `rows` in `setup`, distances told as the setup says.
    fn of(setup: &Setup, choice: &Choice, rows: &[Row]) -> Result<Self, Error> {
        let begun = Instant::now();
        let taps = Taps::of_rows(setup, rows);
        let Taps { designs, tasks, .. } = &taps;
        let mut evaluator = Evaluator::new(setup, choice.open(&setup.model)?);
        let outcomes = evaluator.run(designs, tasks)?;
        let ask = |(design, row): (u32, &Row)| Ask {
            design,
            drive: row.point.drive,
            reach: Reach::of(row.point.direction(), row.reach),
        };
        let asks: Vec<Ask> = (0..).zip(rows).map(ask).collect();
        let (own, _) = curve::solve(setup, &mut evaluator, designs, &asks)?;
        let ask =
            |i: usize| both::Ask::own(setup, tasks[i], &outcomes[i], rows[tasks[i].design as usize].reach);
        let asks: Vec<both::Ask> = (0..tasks.len()).map(ask).collect();
        let (both, _) = both::both(setup, &mut evaluator, designs, &asks)?;
        let (mut answers, mut figures) = (Vec::with_capacity(tasks.len()), Vec::new());
        for (k, row) in rows.iter().enumerate() {
            let from = answers.len();
            let these = &outcomes[from..from + row.distances.len()];
            let at = |i: usize| (row.distances[i], row.point.drive);
            let mut reduced = Reduction::new(setup, &designs[k], row.reach, (these.len(), 1));
            for (i, tap) in these.iter().enumerate() {
                reduced.count((i, 0), at(i), tap);
            }
            reduced.calibrate();
            for (i, tap) in these.iter().enumerate() {
                let told = Told::by(&own, k).towards(row.point.direction()).or_both(both.get(from + i));
                let estimated = reduced.estimate_by((i, 0), at(i), tap, told);
                answers.push((tap.strain, tap.arc, tap.status | estimated.status));
            }
            let row = &reduced.drives[0];
            figures
                .push([row.deviation.sd(), row.figures().total_rms()].map(|x| x.filter(|_| row.complete())));
        }
        let each = begun.elapsed().as_secs_f64() / answers.len().max(1) as f64;
        Ok(Self { taps, answers, figures, each })
    }
}

/// How far a model is from the full one at some taps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Checked {
    /// Taps compared.
    pub taps: u64,
    /// Largest |ε − ε_full|/max(|ε_full|, 1e-3 θ f_max).
    pub error: f64,
    /// The tap that has it.
    pub at: Option<Tuple>,
    /// Taps so near to a threshold that the full model solves them.
    pub by_full: u64,
    /// Taps whose words differ, or of which only one model has a strain.
    pub statuses: u64,
    /// The first of them, the full model's words, and those of the other.
    pub status_at: Option<(Tuple, [Status; 2])>,
    /// Largest changes of K_sd and of total_rms_mm of a row, of themselves.
    pub figures: [f64; 2],
}

impl Checked {
    /// Whether taps were compared, no word differs and the strain is within `bound`.
    pub fn holds(&self, bound: f64) -> bool {
        self.taps > 0 && self.statuses == 0 && self.error <= bound
    }

    /// Compares what another model has `found` at `rows` with what the full one says.
    fn of(rows: &[Row], full: &Said, found: &Said, bound: f64) -> Self {
        let mut all = Self::default();
        // 0 where nothing is apart, or unknown.
        let off = |apart: f64, size: f64| if apart > 0.0 { relative(apart, size) } else { 0.0 };
        for (i, tap) in rows.iter().flat_map(Row::taps).enumerate() {
            all.taps += 1;
            let ((strain, _, status), (other, _, word)) = (full.answers[i], found.answers[i]);
            if doubts(&full.taps.setup, full.taps.design(i), found.answers[i], DOUBT * bound) {
                all.by_full += 1;
                continue;
            }
            if strain.is_nan() != other.is_nan() || status != word {
                all.statuses += 1;
                all.status_at = all.status_at.or(Some((tap, [status, word])));
            }
            let error = off((other - strain).abs(), strain.abs().max(full.taps.least(i)));
            if all.at.is_none() || error > all.error {
                (all.error, all.at) = (error, Some(tap));
            }
        }
        for (full, found) in full.figures.iter().zip(&found.figures) {
            for (k, largest) in all.figures.iter_mut().enumerate() {
                if let (Some(x), Some(y)) = (full[k], found[k]) {
                    *largest = largest.max(off((y - x).abs(), x.abs()));
                }
            }
        }
        all
    }

    /// Takes over other taps.
    fn merge(&mut self, other: &Self) {
        self.taps += other.taps;
        self.statuses += other.statuses;
        self.by_full += other.by_full;
        self.figures = std::array::from_fn(|k| self.figures[k].max(other.figures[k]));
        self.status_at = self.status_at.or(other.status_at);
        if other.at.is_some() && (self.at.is_none() || other.error > self.error) {
            (self.error, self.at) = (other.error, other.at);
        }
    }

    fn json(&self, kind: Drive) -> Value {
        let mut value = json!({
            "taps": self.taps, "error": self.error, "at": self.at.as_ref().map(|t| tap_json(kind, t)), "by_full_model": self.by_full,
            "statuses_changed": self.statuses, "K_sd_changed": self.figures[0], "total_rms_changed": self.figures[1],
        });
        if let Some((tap, words)) = &self.status_at {
            value["status_at"] = tap_json(kind, tap);
            value["status"] = json!(words.map(|word| word.to_string()));
        }
        value
    }
}

/// An effect of the full model, and what became of it.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    effect: Effect,
    /// Its value in the full model, as the spec writes it, and where it is left off.
    spec: String,
    instead: String,
    /// What leaving it off alone changes, at one of eight rows of the spread; `None` where it cannot be left off alone.
    alone: Option<Checked>,
    /// What leaving it off beside those before it changes, over the whole spread; `None` where that was not looked at.
    together: Option<Checked>,
    /// Whether it is left off.
    left: bool,
}

/// A model with what the scene does not need left off, and how that was found.
#[derive(Debug)]
pub struct Needed {
    full: Setup,
    setup: Setup,
    bound: f64,
    choice: Choice,
    /// Every effect that could be left off, those left off first and in that order.
    parts: Vec<Part>,
    /// Over the spread; `None` where nothing is left off.
    spread: Option<Checked>,
    /// At taps that did not choose the model.
    own: Option<Checked>,
    /// At the rows kept.
    kept: Option<Checked>,
    /// 1 where rows kept did not keep the bound, and the full model was taken.
    pub fallbacks: u32,
    /// Seconds of choosing, and of checking rows kept.
    pub seconds: [f64; 2],
    /// Seconds of a tap of the spread by the full model and by this one.
    each: Option<[f64; 2]>,
}

impl Needed {
    /// What the taps of `rows` need of the model of `full` for a strain within `bound`.
    pub fn new(full: &Setup, rows: ComparedRows, bound: f64) -> Result<Self, Error> {
        let begun = Instant::now();
        let (backend, precision) = (Some(BackendChoice::Cpu), Some(Precision::F64));
        let mut needed = Self {
            full: full.clone(),
            setup: full.clone(),
            bound,
            choice: Choice::new(&RunOptions { backend, precision, ..RunOptions::default() })?,
            parts: Vec::new(),
            spread: None,
            own: None,
            kept: None,
            fallbacks: 0,
            seconds: [0.0; 2],
            each: None,
        };
        needed.gather(&rows.spread)?;
        if !needed.left().is_empty() && !rows.own.is_empty() {
            let own = needed.check(&rows.own)?;
            needed.own = Some(own);
            if !own.holds(bound) {
                needed.take_full();
            }
        }
        needed.seconds[0] = begun.elapsed().as_secs_f64();
        Ok(needed)
    }

    /// With the full model.
    pub fn full(&self) -> &Setup {
        &self.full
    }

    /// With the model that is needed.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// E.
    pub fn bound(&self) -> f64 {
        self.bound
    }

    /// The model of `full`, the full one, for the taps near a threshold: to twice the bound.
    pub fn guard<'a>(&self, full: &'a Setup) -> Result<Guard<'a>, Error> {
        Ok(Guard::new(full, self.choice.open(&full.model)?, DOUBT * self.bound))
    }

    /// The effects left off.
    pub fn left(&self) -> Vec<Effect> {
        self.parts.iter().filter(|p| p.left).map(|p| p.effect).collect()
    }

    /// Leaves off nothing from here on.
    pub fn give_up(&mut self) {
        (self.fallbacks, self.kept) = (1, None);
        self.take_full();
    }

    /// Whether the model keeps the bound at `rows`, which are kept; where it does not, the full model is taken. `go_on` is asked between parts.
    ///
    /// # Errors
    /// A kernel that fails; that of `go_on`.
    pub fn keeps(&mut self, rows: &[Row], go_on: &dyn Fn() -> Result<(), Error>) -> Result<bool, Error> {
        self.measure(rows, go_on)?;
        let holds = self.kept.is_none_or(|kept| kept.holds(self.bound));
        if !holds {
            self.give_up();
        }
        Ok(holds)
    }

    /// How well the model holds at `rows`, which are kept. `go_on` is asked between parts.
    ///
    /// # Errors
    /// A kernel that fails; that of `go_on`.
    pub fn measure(&mut self, rows: &[Row], go_on: &dyn Fn() -> Result<(), Error>) -> Result<(), Error> {
        self.kept = None;
        if self.left().is_empty() || rows.is_empty() {
            return Ok(());
        }
        let begun = Instant::now();
        let mut all = Checked::default();
        let longest = rows.iter().map(|r| r.distances.len()).max().unwrap_or(1).max(1);
        for rows in rows.chunks((TOGETHER / longest).max(1)) {
            go_on()?;
            all.merge(&self.check(rows)?);
        }
        self.kept = Some(all);
        self.seconds[1] += begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// How far the model is from the full one at `rows`.
    fn check(&self, rows: &[Row]) -> Result<Checked, Error> {
        Ok(self.against(&mut None, &self.setup, rows)?.0)
    }

    fn take_full(&mut self) {
        self.parts.iter_mut().for_each(|part| part.left = false);
        (self.spread, self.each, self.setup) = (None, None, self.full.clone());
    }

    /// Leaves off one effect after the other, the smallest first, while all of them together keep the bound over the spread.
    fn gather(&mut self, spread: &[Row]) -> Result<(), Error> {
        let said = Setting::of(&self.full, std::iter::empty());
        let mut parts = self.alone(&said, spread)?;
        // Of equal ones the first of the list; those that cannot be left off alone come last.
        let size = |p: &Part| p.alone.map_or(f64::INFINITY, |c| c.error);
        parts.sort_by(|a, b| size(a).total_cmp(&size(b)));
        let (mut full, mut left) = (None, Vec::new());
        for part in &mut parts {
            let rest = said.without(left.iter().copied().chain([part.effect]));
            if !part.alone.is_none_or(|alone| alone.holds(self.bound)) || !allowed(&rest.setup) {
                continue;
            }
            let (together, each) = self.against(&mut full, &rest.setup, spread)?;
            part.together = Some(together);
            if together.holds(self.bound) {
                part.left = true;
                left.push(part.effect);
                (self.spread, self.each, self.setup) = (Some(together), Some(each), rest.setup);
            }
        }
        // A stable order: what is left off as it was, then the rest.
        parts.sort_by_key(|p| !p.left);
        self.parts = parts;
        Ok(())
    }

    /// How far `setup` is from the full one at `rows`, which is `full` there once it has been asked, and seconds of a tap of both.
    fn against(
        &self,
        full: &mut Option<Said>,
        setup: &Setup,
        rows: &[Row],
    ) -> Result<(Checked, [f64; 2]), Error> {
        let full = match full {
            Some(known) => known,
            none => none.insert(Said::of(&self.full, &self.choice, rows)?),
        };
        let found = Said::of(setup, &self.choice, rows)?;
        Ok((Checked::of(rows, full, &found, self.bound), [full.each, found.each]))
    }

    /// The effects of the full model, and what each changes alone at some rows of the spread.
    fn alone(&self, said: &Setting, spread: &[Row]) -> Result<Vec<Part>, Error> {
        let some: Vec<Row> = spread.iter().step_by(FIRST).cloned().collect();
        let mut full = None;
        let part = |effect: Effect| {
            let rest = said.without([effect]);
            let alone = match allowed(&rest.setup) {
                false => None,
                true => Some(self.against(&mut full, &rest.setup, &some)?.0),
            };
            let (spec, instead) = (effect.value(said), effect.value(&rest));
            Ok(Part { effect, spec, instead, alone, together: None, left: false })
        };
        Effect::of_model().filter(|e| e.is_on(said) == Some(true)).map(part).collect()
    }

    /// `model_error` of `run.json`; `solving`: seconds that the run spent on solving and charting taps.
    pub fn summary(&self, solving: f64) -> Value {
        let checked = |c: &Option<Checked>| c.as_ref().map_or(Value::Null, |c| c.json(self.full.drive));
        let part = |p: &Part| {
            let mut one = json!({ "effect": p.effect.name(), "key": p.effect.key(), "spec": p.spec });
            match p.left {
                true => one["instead"] = json!(p.instead),
                false => one["why"] = json!(self.why(p, "it")),
            }
            one["alone"] = checked(&p.alone);
            if !p.left {
                one["together"] = checked(&p.together);
            }
            one
        };
        let parts = |left: bool| self.parts.iter().filter(|p| p.left == left).map(part).collect::<Vec<_>>();
        // The full model would have taken as many times as long as it takes for a tap of the spread.
        let times = self.each.map_or(1.0, |[full, reduced]| full / reduced);
        json!({
            "bound": self.bound,
            "left_off": parts(true),
            "needed": parts(false),
            "spread": checked(&self.spread),
            "own_taps": checked(&self.own),
            "rows_kept": checked(&self.kept),
            "fallbacks": self.fallbacks,
            "seconds": {
                "choosing": self.seconds[0],
                "checking": self.seconds[1],
                "tap_full": self.each.map(|e| e[0]),
                "tap": self.each.map(|e| e[1]),
                "saved": solving * (times - 1.0) - self.seconds.iter().sum::<f64>(),
            },
        })
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
        let bound = self.bound;
        let name = |p: &Part| format!("{} ({} in place of {})", p.effect.name(), p.instead, p.spec);
        let names = self.parts.iter().filter(|p| p.left).map(name).collect::<Vec<_>>().join(", ");
        if names.is_empty() {
            // The effect that is the nearest to being left off.
            let size = |p: &&Part| p.together.or(p.alone).map_or(f64::INFINITY, |c| c.error);
            return match self.parts.iter().min_by(|a, b| size(a).total_cmp(&size(b))) {
                None => format!("--model-error {bound:e}: the model has no effect to leave off\n"),
                Some(p) => {
                    format!("--model-error {bound:e} leaves off nothing: {}\n", self.why(p, p.effect.name()))
                }
            };
        }
        let mut text = format!("--model-error {bound:e} leaves off {names}\n");
        let all = [
            (&self.spread, "taps over the space"),
            (&self.own, "others"),
            (&self.kept, "taps of the rows kept"),
        ];
        let at = |(c, who): (&Option<Checked>, &str)| {
            c.as_ref().map(|c| format!("{:.1e} at {} {who}", c.error, c.taps))
        };
        let most = all.into_iter().filter_map(at).collect::<Vec<_>>().join(", ");
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
}

/// Whether such a model can be computed: friction needs extension.
fn allowed(setup: &Setup) -> bool {
    setup.model.contact == Contact::Frictionless || setup.model.extension
}
