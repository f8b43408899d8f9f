//! Strains alone, of many upright taps of whiskers of their own.

use super::outcome::strain;
use super::{Evaluator, Method};
use crate::error::SolveError;
use crate::kernel::{self, Effects, frames::Framed};
use crate::scene::Contact;

impl Evaluator<'_> {
    /// Strains of `framed`, to the bits of [`Self::run`], and the places of those left out: taps that are not framed, and those of which the kernel
    /// alone cannot tell.
    pub fn strains(&mut self, framed: &Framed, out: &mut [f64]) -> Result<Vec<usize>, SolveError> {
        self.go_on()?;
        let Method::Fast { solver, rungs, tolerance } = &mut self.method else {
            return Ok((0..out.len()).collect());
        };
        let Framed { columns: [_, _, _, x1, _, a, _], taps, whole } = framed;
        let (those, mut open): (Vec<usize>, Vec<usize>) = (0..out.len()).partition(|&i| whole[i]);
        let taps = match open.as_slice() {
            [] => taps,
            _ => {
                self.taps.clear();
                self.taps.extend(those.iter().map(|&i| taps[i]));
                &self.taps
            }
        };
        let model = &self.setup.model;
        let effects = Effects::new(model, self.setup.gauge.side, model.contact == Contact::Stick);
        kernel::solve(solver.as_mut(), effects, rungs, *tolerance, taps, &mut self.solutions)?;
        for ((&i, tap), solution) in those.iter().zip(taps).zip(&self.solutions) {
            if solution.is_told(*tolerance) && !solution.ended() {
                out[i] = strain(self.setup, (x1[i], a[i]), tap, solution);
            } else {
                open.push(i);
            }
        }
        Ok(open)
    }
}
