//! Only what the scene needs (`--model-error E`): the effects of a model whose joint change of strain stays within E are left off.
//!
//! The change is |ε − ε_full|/max(|ε_full|, 1e-3 θ f_max), as a tolerance counts it. It is measured in f64 on the CPU over at least 2000 taps of the
//! scene's own space and its corners ([`sample::choosing`](super::sample::choosing)), beginning with the effect that changes least alone and adding one
//! at a time, so that what is bounded is the change of all of them together. Every row that is kept must keep the bound too ([`Needed::keeps`]); where
//! one does not, nothing is left off. Taps near a threshold of a status are solved by the full model ([`Needed::guard`]); an effect without which any
//! other word would change stays, those of the estimate included. So do finite rotation, without which K is 1 and nothing can be ranked, and hub and
//! side, which are geometry.

use std::time::Instant;

use serde::Serialize;
use serde_json::{Value, json};

use super::{At, Effect, Row, Setting, Taps, relative};
use crate::backend::Choice;
use crate::curve::{self, Ask, Reach, both};
use crate::error::{Error, InputError};
use crate::estimate::Estimated;
use crate::evaluate::{Evaluator, Guard, Outcome, Referral, doubts};
use crate::scene::{BackendChoice, Contact, Precision, RunOptions, Setup, Spec};
use crate::statistics::Told;
use crate::status::Status;

/// Smallest bound that two solutions in f64 can be judged by.
const LEAST: f64 = 2e-8;

/// Every seventh row is judged before all are: most effects are too large at any of them. A prime number meets every drive of an axis.
const FIRST: usize = 7;

/// So many times the bound from a threshold, a word is that of the full model.
const DOUBT: f64 = 2.0;

/// Taps of kept rows that are compared together.
const TOGETHER: usize = 1 << 12;

/// The bound that was asked for, if the backend of `choice` is accurate enough to judge effects of this size.
/// Errors: a bound by which nothing can be judged; several rigs, whose effects are not one answer.
pub fn bound(asked: Option<f64>, spec: &Spec, choice: &Choice) -> Result<Option<f64>, Error> {
    let Some(bound) = asked else { return Ok(None) };
    let refused = |why: &str| InputError::new(why).key("--model-error").value(bound);
    if let Some(rigs) = &spec.study.setup.rigs {
        let why = "differ from design to design: which effects they need is not one answer";
        return Err(refused(&format!("{} {why}", rigs.names()))
            .allowed("one rig, or no --model-error")
            .into());
    }
    let least = LEAST.max(2.0 * choice.backend.tolerance.unwrap_or(0.0));
    if bound >= least && bound < 1.0 {
        return Ok(Some(bound));
    }
    let tolerance = choice.backend.tolerance.filter(|t| 2.0 * t > LEAST);
    let tolerance = tolerance.map_or(String::new(), |t| format!(": at least twice the tolerance, {t:e}"));
    let error = refused("no effect can be judged by this");
    Err(error.allowed(format!("{least:e} ≤ E < 1{tolerance}")).into())
}

/// Answers of a model to the taps of some rows.
struct Said {
    taps: Taps,
    /// Strain, contact arc, mm, and all words of each tap.
    answers: Vec<(f64, f64, Status)>,
}

impl Said {
    /// Of `rows` in `setup`, distances told as the setup says.
    fn of(setup: &Setup, choice: &Choice, rows: &[Row]) -> Result<Self, Error> {
        let taps = Taps::of_rows(setup, rows);
        let Taps { designs, tasks, .. } = &taps;
        let mut evaluator = Evaluator::new(setup, choice.open(&setup.model)?);
        let outcomes = evaluator.run(designs, tasks)?;
        let reach = |row: &Row| Reach::of(row.point.direction(), row.reach);
        let ask = |(design, row): (u32, &Row)| Ask { design, drive: row.point.drive, reach: reach(row) };
        let asks: Vec<Ask> = (0..).zip(rows).map(ask).collect();
        let (own, _) = curve::solve(setup, (&mut evaluator, Referral::ALL), designs, &asks)?;
        let ask =
            |i: usize| both::Ask::own(setup, tasks[i], &outcomes[i], rows[tasks[i].design as usize].reach);
        let asks: Vec<both::Ask> = (0..tasks.len()).map(ask).collect();
        let (both, _) = both::both(setup, (&mut evaluator, Referral::ALL), designs, &asks)?;
        let mut answers = Vec::with_capacity(tasks.len());
        for (k, row) in rows.iter().enumerate() {
            let from = answers.len();
            let these = &outcomes[from..from + row.distances.len()];
            let told =
                |i: usize| Told::by(&own, k).towards(row.point.direction()).or_both(both.get(from + i));
            let (_, estimates) = row.reduced(setup, &designs[k], these, told, None);
            let answer =
                |(tap, told): (&Outcome, &Estimated)| (tap.strain, tap.arc, tap.status | told.status);
            answers.extend(these.iter().zip(&estimates).map(answer));
        }
        Ok(Self { taps, answers })
    }
}

/// Difference of a model to the full one at some taps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
struct Checked {
    taps: u64,
    /// Largest |ε − ε_full|/max(|ε_full|, 1e-3 θ f_max).
    error: f64,
    /// The tap that has it.
    at: Option<At>,
    /// Taps so near to a threshold that the full model solves them.
    by_full_model: u64,
    /// Taps whose words differ, or of which only one model has a strain.
    statuses_changed: u64,
    /// Of the first of them the full model's words, and those of the other.
    #[serde(skip)]
    words: Option<[Status; 2]>,
}

impl Checked {
    /// True if taps were compared, no word differs and the strain is within `bound`.
    fn holds(&self, bound: f64) -> bool {
        self.taps > 0 && self.statuses_changed == 0 && self.error <= bound
    }

    /// Compares what another model has `found` with what the `full` one says.
    fn add(&mut self, full: &Said, found: &Said, bound: f64) {
        for (i, (&(strain, _, status), &tap)) in full.answers.iter().zip(&found.answers).enumerate() {
            let (other, _, word) = tap;
            self.taps += 1;
            if doubts(&full.taps.setup, full.taps.design(i), tap, DOUBT * bound) {
                self.by_full_model += 1;
                continue;
            }
            if strain.is_nan() != other.is_nan() || status != word {
                self.statuses_changed += 1;
                self.words = self.words.or(Some([status, word]));
            }
            // `max` passes over what is no number.
            let error = relative((other - strain).abs(), strain.abs().max(full.taps.least(i))).max(0.0);
            if self.at.is_none() || error > self.error {
                (self.error, self.at) = (error, Some(At(full.taps.setup.drive, full.taps.tuple(i))));
            }
        }
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
    /// True if it is left off.
    left: bool,
}

/// A model with what the scene does not need left off, and how that was found.
#[derive(Debug)]
pub struct Needed {
    pub full: Setup,
    /// With the model that is needed.
    pub setup: Setup,
    pub bound: f64,
    choice: Choice,
    /// Every effect that could be left off, those left off first and in that order.
    parts: Vec<Part>,
    /// Over the spread; `None` where nothing is left off.
    spread: Option<Checked>,
    /// At the rows kept.
    kept: Option<Checked>,
    /// 1 where rows kept did not keep the bound, and the full model was taken.
    pub fallbacks: u32,
    /// Seconds of choosing, and of checking rows kept.
    pub seconds: [f64; 2],
}

impl Needed {
    /// What the taps of `rows` need of the model of `full` for a strain within `bound`: one effect after the other is left off, the smallest first, while
    /// all of them together keep the bound.
    pub fn new(full: &Setup, rows: &[Row], bound: f64) -> Result<Self, Error> {
        let begun = Instant::now();
        let (backend, precision) = (Some(BackendChoice::Cpu), Some(Precision::F64));
        let choice = Choice::new(&RunOptions { backend, precision, ..RunOptions::default() })?;
        let mut needed = Self {
            full: full.clone(),
            setup: full.clone(),
            bound,
            choice,
            parts: Vec::new(),
            spread: None,
            kept: None,
            fallbacks: 0,
            seconds: [0.0; 2],
        };
        let said = Setting::of(full, std::iter::empty());
        let mut parts = needed.alone(&said, rows)?;
        // Of equal ones the first of the list; those that cannot be left off alone come last.
        parts.sort_by(|a, b| a.size().total_cmp(&b.size()));
        let (mut of_full, mut left) = (None, Vec::new());
        for part in &mut parts {
            let rest = said.without(left.iter().copied().chain([part.effect]));
            if !part.alone.is_none_or(|alone| alone.holds(bound)) || !allowed(&rest.setup) {
                continue;
            }
            let together = needed.against(&mut of_full, &rest.setup, rows)?;
            part.together = Some(together);
            if together.holds(bound) {
                part.left = true;
                left.push(part.effect);
                (needed.spread, needed.setup) = (Some(together), rest.setup);
            }
        }
        // A stable order: what is left off as it was, then the rest.
        parts.sort_by_key(|p| !p.left);
        needed.parts = parts;
        needed.seconds[0] = begun.elapsed().as_secs_f64();
        Ok(needed)
    }

    /// The effects of the full model, and what each changes alone at some of `rows`.
    fn alone(&self, said: &Setting, rows: &[Row]) -> Result<Vec<Part>, Error> {
        let some: Vec<Row> = rows.iter().step_by(FIRST).cloned().collect();
        let mut full = None;
        let part = |effect: Effect| {
            let rest = said.without([effect]);
            let alone =
                allowed(&rest.setup).then(|| self.against(&mut full, &rest.setup, &some)).transpose()?;
            let (spec, instead) = (effect.value(said), effect.value(&rest));
            Ok(Part { effect, spec, instead, alone, together: None, left: false })
        };
        Effect::of_model().filter(|e| e.is_on(said) == Some(true)).map(part).collect()
    }

    /// How far `setup` is from the full one at `rows`, which is `full` there once it has been asked.
    fn against(&self, full: &mut Option<Said>, setup: &Setup, rows: &[Row]) -> Result<Checked, Error> {
        let full = match full {
            Some(known) => known,
            none => none.insert(Said::of(&self.full, &self.choice, rows)?),
        };
        let mut checked = Checked::default();
        checked.add(full, &Said::of(setup, &self.choice, rows)?, self.bound);
        Ok(checked)
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
        self.parts.iter_mut().for_each(|part| part.left = false);
        (self.fallbacks, self.kept, self.spread) = (1, None, None);
        self.setup = self.full.clone();
    }

    /// True if the model keeps the bound at `rows`, which are kept; where it does not and that is `binding`, the full model is taken. `go_on` is asked
    /// between parts.
    /// Errors: a kernel that fails; that of `go_on`.
    pub fn keeps(
        &mut self,
        rows: &[Row],
        binding: bool,
        go_on: &dyn Fn() -> Result<(), Error>,
    ) -> Result<bool, Error> {
        self.kept = None;
        if self.left().is_empty() || rows.is_empty() {
            return Ok(true);
        }
        let begun = Instant::now();
        let mut all = Checked::default();
        let longest = rows.iter().map(|r| r.distances.len()).max().unwrap_or(1).max(1);
        for rows in rows.chunks((TOGETHER / longest).max(1)) {
            go_on()?;
            let [full, found] = [&self.full, &self.setup].map(|setup| Said::of(setup, &self.choice, rows));
            all.add(&full?, &found?, self.bound);
        }
        self.kept = Some(all);
        self.seconds[1] += begun.elapsed().as_secs_f64();
        let holds = all.holds(self.bound) || !binding;
        if !holds {
            self.give_up();
        }
        Ok(holds)
    }

    /// `model_error` of `run.json`.
    pub fn summary(&self) -> Value {
        let part = |p: &Part| {
            let (effect, why) = (p.effect, (!p.left).then(|| self.why(p, "it")));
            json!({
                "effect": effect, "key": effect.key(), "spec": p.spec, "instead": p.instead, "why": why,
                "alone": p.alone, "together": p.together,
            })
        };
        let parts = |left: bool| self.parts.iter().filter(|p| p.left == left).map(part).collect::<Vec<_>>();
        json!({
            "bound": self.bound,
            "left_off": parts(true),
            "needed": parts(false),
            "spread": self.spread,
            "rows_kept": self.kept,
            "fallbacks": self.fallbacks,
            "seconds": { "choosing": self.seconds[0], "checking": self.seconds[1] },
        })
    }

    /// Why an effect, which is called `it`, is not left off.
    fn why(&self, part: &Part, it: &str) -> String {
        let broken = |c: &&Checked| !c.holds(self.bound);
        let (alone, together) = (part.alone.as_ref(), part.together.as_ref());
        let (checked, who) = match (alone.filter(broken), together.filter(broken)) {
            (Some(alone), _) => (alone, it.to_owned()),
            (_, Some(together)) => (together, format!("{it} and those left off")),
            _ if alone.or(together).is_none() => return format!("friction needs {it}"),
            _ => return format!("rows of the result did not keep the bound without {it}"),
        };
        match checked.words {
            Some([full, other]) if checked.error <= self.bound => {
                format!("without {who} a status would change from {full} to {other}")
            }
            _ => format!("without {who} strain changes by {:.2e}", checked.error),
        }
    }

    /// The effects left off and the error that this makes, in a few lines.
    pub fn sentence(&self) -> String {
        let bound = self.bound;
        let name = |p: &Part| format!("{} ({} in place of {})", p.effect.name(), p.instead, p.spec);
        let names = self.parts.iter().filter(|p| p.left).map(name).collect::<Vec<_>>().join(", ");
        if names.is_empty() {
            // The effect that is the nearest to being left off.
            let nearest = self.parts.iter().min_by(|a, b| a.size().total_cmp(&b.size()));
            return nearest.map_or_else(
                || format!("--model-error {bound:e}: the model has no effect to leave off\n"),
                |p| format!("--model-error {bound:e} leaves off nothing: {}\n", self.why(p, p.effect.name())),
            );
        }
        let at = |(c, who): (&Option<Checked>, &str)| {
            c.as_ref().map(|c| format!("{:.1e} at {} {who}", c.error, c.taps))
        };
        let all = [(&self.spread, "taps over the space"), (&self.kept, "taps of the rows kept")];
        let most = all.into_iter().filter_map(at).collect::<Vec<_>>().join(", ");
        let statuses = match self.kept.filter(|c| !c.holds(bound)) {
            None => "no status changes".to_owned(),
            Some(c) => format!("rows kept do not keep the bound, {} statuses change", c.statuses_changed),
        };
        format!(
            "--model-error {bound:e} leaves off {names}\n  strain changes by at most {most}; {statuses}\n"
        )
    }
}

impl Part {
    /// Largest change of strain without it.
    fn size(&self) -> f64 {
        self.together.or(self.alone).map_or(f64::INFINITY, |c| c.error)
    }
}

/// True if such a model can be computed: friction needs extension.
fn allowed(setup: &Setup) -> bool {
    setup.model.contact == Contact::Frictionless || setup.model.extension
}
