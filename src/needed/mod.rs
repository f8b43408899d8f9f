//! Only what the scene needs (`--model-error E`): the effects of a model whose joint change of strain stays within E are left off.
//!
//! The change is |ε − ε_full|/max(|ε_full|, 1e-3 θ f_max), as a tolerance counts it. It is measured in f64 on the CPU over a spread of the
//! scene's own space with its ends (`rows`), beginning with the effect that changes least alone and adding one at a time, so that
//! what is bounded is the change of all of them together. The model that results must keep the bound at taps that did not choose it, and at
//! every row that is kept ([`Needed::keeps`]); where it does not, nothing is left off. Taps near a threshold of a
//! status are solved by the full model ([`Needed::guard`]); an effect without which any other word would change stays, those of the estimate
//! included. So do finite rotation, without which K is 1 and nothing can be ranked, and hub and side, which are geometry.

mod compare;
mod rows;
mod write;

use std::time::Instant;

pub use compare::Checked;
pub use rows::{ComparedRows, Row};

use crate::backend::Choice;
use crate::error::Error;
use crate::evaluate::Guard;
use crate::explain::{Effect, Setting, without};
use crate::scene::{BackendChoice, Contact, Precision, RunOptions, Setup};
use compare::Said;

/// Of so many rows one is looked at before all are: most effects are too large at any of them.
const FIRST: usize = 8;

/// So many times the bound from a threshold, a word is that of the full model.
const DOUBT: f64 = 2.0;

/// Taps of kept rows that are compared together.
const TOGETHER: usize = 1 << 12;

/// Smallest bound that two solutions in f64 can be judged by.
pub const LEAST: f64 = 2e-8;

/// An effect of the full model, and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Which.
    pub effect: Effect,
    /// Its value in the full model, as the spec writes it.
    pub spec: String,
    /// Its value where it is left off.
    pub instead: String,
    /// What leaving it off alone changes, at one of eight rows of the spread; `None` where it cannot be left off alone.
    pub alone: Option<Checked>,
    /// What leaving it off beside those before it changes, over the whole spread; `None` where that was not looked at.
    pub together: Option<Checked>,
    /// Whether it is left off.
    pub left: bool,
}

/// A model with what the scene does not need left off, and how that was found.
#[derive(Debug)]
pub struct Needed {
    full: Setup,
    setup: Setup,
    bound: f64,
    choice: Choice,
    rows: ComparedRows,
    /// Every effect that could be left off, those left off first and in that order.
    pub parts: Vec<Part>,
    /// Over the spread; `None` where nothing is left off.
    pub spread: Option<Checked>,
    /// At taps that did not choose the model.
    pub own: Option<Checked>,
    /// At the rows kept.
    pub kept: Option<Checked>,
    /// 1 where rows kept did not keep the bound, and the full model was taken.
    pub fallbacks: u32,
    /// Seconds of choosing, and of checking rows kept.
    pub seconds: [f64; 2],
    /// Seconds of a tap of the spread by the full model and by this one.
    pub each: Option<[f64; 2]>,
}

impl Needed {
    /// What the taps of `rows` need of the model of `full` for a strain within `bound`.
    ///
    /// # Errors
    /// A kernel that fails.
    pub fn new(full: &Setup, rows: ComparedRows, bound: f64) -> Result<Self, Error> {
        let begun = Instant::now();
        let options = RunOptions {
            backend: Some(BackendChoice::Cpu),
            precision: Some(Precision::F64),
            ..RunOptions::default()
        };
        let mut needed = Self {
            full: full.clone(),
            setup: full.clone(),
            bound,
            choice: Choice::new(&options)?,
            rows,
            parts: Vec::new(),
            spread: None,
            own: None,
            kept: None,
            fallbacks: 0,
            seconds: [0.0; 2],
            each: None,
        };
        needed.choose()?;
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
    ///
    /// # Errors
    /// A kernel that does not open.
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
            all.merge(&self.check(&self.setup, rows)?);
        }
        self.kept = Some(all);
        self.seconds[1] += begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// How far the model of `setup` is from the full one at `rows`.
    fn check(&self, setup: &Setup, rows: &[Row]) -> Result<Checked, Error> {
        let expected = Said::of(&self.full, &self.choice, rows)?;
        let found = Said::of(setup, &self.choice, rows)?;
        Ok(Checked::of(&self.full, rows, &expected, &found, self.bound))
    }

    /// Leaves off what the spread allows, if the own taps bear it out; else nothing.
    fn choose(&mut self) -> Result<(), Error> {
        self.gather()?;
        if self.left().is_empty() || self.rows.own.is_empty() {
            return Ok(());
        }
        let own = self.check(&self.setup, &self.rows.own)?;
        self.own = Some(own);
        if !own.holds(self.bound) {
            self.take_full();
        }
        Ok(())
    }

    fn take_full(&mut self) {
        self.parts.iter_mut().for_each(|part| part.left = false);
        (self.spread, self.each, self.setup) = (None, None, self.full.clone());
    }

    /// Leaves off one effect after the other, the smallest first, while all of them together keep the bound over the spread.
    fn gather(&mut self) -> Result<(), Error> {
        let said = Setting::of(&self.full);
        let mut parts = self.alone(&said)?;
        // Of equal ones the first of the list; those that cannot be left off alone come last.
        let size = |p: &Part| p.alone.map_or(f64::INFINITY, |c| c.error);
        parts.sort_by(|a, b| size(a).total_cmp(&size(b)));
        let (spread, bound) = (self.rows.spread.as_slice(), self.bound);
        let (mut expected, mut left) = (None, Vec::new());
        (self.spread, self.each, self.setup) = (None, None, self.full.clone());
        for part in &mut parts {
            let set = [left.as_slice(), &[part.effect]].concat();
            let rest = without(&said, &set);
            let small = part.alone.is_none_or(|alone| alone.holds(bound));
            if !small || !allowed(&rest) {
                continue;
            }
            let (together, each) = self.against(&mut expected, &rest, spread)?;
            part.together = Some(together);
            if together.holds(bound) {
                (part.left, left) = (true, set);
                (self.spread, self.each) = (Some(together), Some(each));
                self.setup = Setup { model: rest.model, ..self.full.clone() };
            }
        }
        // A stable order: what is left off as it was, then the rest.
        parts.sort_by_key(|p| !p.left);
        self.parts = parts;
        Ok(())
    }

    /// How far the model of `rest` is from the full one at `rows`, which is `expected` there once it has been asked, and seconds of a tap of both.
    fn against(
        &self,
        expected: &mut Option<Said>,
        rest: &Setting,
        rows: &[Row],
    ) -> Result<(Checked, [f64; 2]), Error> {
        let expected = match expected {
            Some(known) => known,
            none => none.insert(Said::of(&self.full, &self.choice, rows)?),
        };
        let setup = Setup { model: rest.model, ..self.full.clone() };
        let found = Said::of(&setup, &self.choice, rows)?;
        let checked = Checked::of(&self.full, rows, expected, &found, self.bound);
        Ok((checked, [expected.each(), found.each()]))
    }

    /// The effects of the full model, and what each changes alone at some rows of the spread.
    fn alone(&self, said: &Setting) -> Result<Vec<Part>, Error> {
        let some: Vec<Row> = self.rows.spread.iter().step_by(FIRST).cloned().collect();
        let mut expected = None;
        let mut parts = Vec::new();
        for effect in Effect::of_model().filter(|e| e.is_on(said) == Some(true)) {
            let rest = without(said, &[effect]);
            let alone = match allowed(&rest) {
                false => None,
                true => Some(self.against(&mut expected, &rest, &some)?.0),
            };
            let (spec, instead) = (effect.value(said), effect.value(&rest));
            parts.push(Part { effect, spec, instead, alone, together: None, left: false });
        }
        Ok(parts)
    }
}

/// Whether such a model can be computed: friction needs extension.
fn allowed(setting: &Setting) -> bool {
    setting.model.contact == Contact::Frictionless || setting.model.extension
}
