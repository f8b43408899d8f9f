//! Designs with different rigs: taps of rigs of one kind are solved together.

use std::sync::Arc;

use super::{Evaluator, Method, Outcome, Outcomes, Referral, Task};
use crate::design::Design;
use crate::scene::built::{Inner, Profile, Root};
use crate::scene::{Material, Setup};

/// The properties of a rig on which a kernel is specialised, or that a batch shares; numbers given per tap or design are left out.
fn kind(setup: &Setup) -> Setup {
    let mut kind = setup.clone();
    kind.hub = 0.0;
    kind.gauge.noise_strain = None;
    kind.gauge.foil.iter_mut().for_each(|foil| foil.stiffness = 1.0);
    kind.model.nu = 0.5;
    kind.model.pole_radius = kind.model.pole_radius.signum() * f64::from(kind.model.pole_radius != 0.0);
    if let Material::Hooke(e) = &mut kind.model.material {
        *e = 1.0;
    }
    let built = kind.built.as_deref().cloned();
    kind.built = built.map(|mut built| {
        built.profile = match built.profile {
            Profile::Power(n) => Profile::Power(if n == 1.0 { n } else { 2.0 }),
            Profile::Table(_) => Profile::Table(Vec::new()),
        };
        let alike = |inner: Inner| Inner { modulus: inner.modulus.signum(), diameter: Vec::new() };
        built.inner = built.inner.map(alike);
        if !built.is_straight() {
            built.curvature = [1.0; 2];
        }
        let given = |k: f64| if k.is_finite() { 1.0 } else { k };
        let Root { k_theta, k_y, k_x } = built.root;
        built.root = Root { k_theta: given(k_theta), k_y: given(k_y), k_x: given(k_x) };
        Arc::new(built)
    });
    kind
}

/// Places of the tasks of each kind of rig, with one such rig; None for designs without a separate rig.
type Kinds = Vec<(Option<Arc<Setup>>, Vec<usize>)>;

/// `None` if no design has a separate rig.
fn kinds(designs: &[Design], tasks: &[Task]) -> Option<Kinds> {
    if designs.iter().all(|design| design.own.is_none()) {
        return None;
    }
    let (mut kinds, mut all): (Vec<Option<Setup>>, Kinds) = Default::default();
    let mut of_design = vec![None; designs.len()];
    for (i, task) in tasks.iter().enumerate() {
        let design = task.design as usize;
        let place = *of_design[design].get_or_insert_with(|| {
            let own = designs[design].own.clone();
            let kind = own.as_deref().map(kind);
            let known = kinds.iter().position(|other| *other == kind);
            known.unwrap_or_else(|| {
                kinds.push(kind);
                all.push((own, Vec::new()));
                kinds.len() - 1
            })
        });
        all[place].1.push(i);
    }
    Some(all)
}

impl Evaluator<'_> {
    /// Outcomes of `tasks`, in their order. The reference answers taps that a kernel leaves open: unsolved ones, contacts that may stick or slide,
    /// and equilibria at which the material may fail or that may not lie on the path from the unloaded whisker.
    pub fn run(&mut self, designs: &[Design], tasks: &[Task]) -> Outcomes {
        self.run_referring(designs, tasks, Referral::ALL)
    }

    /// The same, where the reference answers those of `referral` only.
    pub fn run_referring(&mut self, designs: &[Design], tasks: &[Task], referral: Referral) -> Outcomes {
        let Some(kinds) = kinds(designs, tasks) else {
            let outcomes = self.run_alike(designs, tasks, referral, None)?;
            return self.mend(designs, tasks, outcomes);
        };
        let mut outcomes = vec![Outcome::NOTHING; tasks.len()];
        for (setup, places) in &kinds {
            let these: Vec<Task> = places.iter().map(|&i| tasks[i]).collect();
            let found = match setup {
                Some(setup) => self.with(setup, |one| one.run_alike(designs, &these, referral, None))?,
                None => self.run_alike(designs, &these, referral, None)?,
            };
            places.iter().zip(found).for_each(|(&i, outcome)| outcomes[i] = outcome);
        }
        self.mend(designs, tasks, outcomes)
    }

    fn with<R>(&mut self, setup: &Setup, f: impl FnOnce(&mut Evaluator<'_>) -> R) -> R {
        let law = setup.model.material;
        let mut method = std::mem::replace(&mut self.method, Method::Reference);
        let mut first = None;
        if let Method::Fast { ladder, .. } = &mut method
            && !matches!(law, Material::Hooke(_))
        {
            let known = self.laws.iter().position(|(other, _)| *other == law);
            let place = known.unwrap_or_else(|| {
                self.laws.push((law, ladder.of(&law)));
                self.laws.len() - 1
            });
            first = Some(std::mem::replace(ladder, self.laws[place].1.clone()));
        }
        let mut other = Evaluator::new(setup, method).stopping(self.stop);
        other.referred = self.referred;
        let done = f(&mut other);
        self.referred = other.referred;
        self.sweeps.merge(&other.take_sweeps());
        self.method = other.into_method();
        if let (Method::Fast { ladder, .. }, Some(own)) = (&mut self.method, first) {
            *ladder = own;
        }
        done
    }
}
