//! Inverts readings by a scan of the reference at steps of 0.05 mm; shares nothing with the estimators.

use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Method, Task};
use vibrissa::scene::{Setup, Tuple};

const STEP: f64 = 0.05;

/// |ε| over the distance for one whisker and drive; NaN without an equilibrium.
pub struct Scan {
    from: f64,
    strains: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    pub a: f64,
    pub slope: f64,
    pub ambiguous: bool,
}

impl Scan {
    /// Scans by the reference from the gauge's near end, or from `from` mm, to the tip.
    pub fn new(setup: &Setup, whisker: Tuple, from: f64) -> Self {
        let design = [Design::new(setup, whisker)];
        let x1 = design[0].shared.as_ref().expect("a whisker").gauge[0];
        let n = ((whisker.L_a - from.max(x1 + STEP)) / STEP).floor();
        let from = whisker.L_a - n * STEP;
        let task = |i: u32| Task {
            design: 0,
            a: from + STEP * f64::from(i),
            drive: whisker.drive,
            ..Task::default()
        };
        let tasks: Vec<Task> = (0..=n as u32).map(task).collect();
        let taps = Evaluator::new(setup, Method::Reference).run(&design, &tasks).expect("the reference");
        Self { from, strains: taps.iter().map(|t| t.strain.abs()).collect() }
    }

    /// Value and slope at `a` of the Lagrange polynomial through the five nearest points.
    pub fn at(&self, a: f64) -> (f64, f64) {
        let place = ((a - self.from) / STEP).round() as isize;
        let first = (place - 2).clamp(0, self.strains.len() as isize - 5) as usize;
        let x = (a - self.from) / STEP - first as f64;
        let (mut value, mut slope) = (0.0, 0.0);
        for k in 0..5 {
            let others: Vec<f64> = (0..5).filter(|j| *j != k).map(|j| j as f64).collect();
            let below: f64 = others.iter().map(|j| k as f64 - j).product();
            let product = |left: Option<f64>| -> f64 {
                others.iter().filter(|j| Some(**j) != left).map(|j| x - j).product()
            };
            value += self.strains[first + k] * product(None) / below;
            slope += self.strains[first + k] * others.iter().map(|j| product(Some(*j))).sum::<f64>() / below;
        }
        (value, slope / STEP)
    }

    /// d|ε|/da at `a` from five points around it.
    pub fn slope(setup: &Setup, whisker: Tuple, a: f64) -> f64 {
        let design = [Design::new(setup, whisker)];
        let task = |i: u32| Task {
            design: 0,
            a: a + STEP * (f64::from(i) - 2.0),
            drive: whisker.drive,
            ..Task::default()
        };
        let tasks: Vec<Task> = (0..5).map(task).collect();
        let taps = Evaluator::new(setup, Method::Reference).run(&design, &tasks).expect("the reference");
        Self { from: tasks[0].a, strains: taps.iter().map(|t| t.strain.abs()).collect() }.at(a).1
    }

    pub fn peak_at(&self) -> f64 {
        self.from + STEP * self.peak() as f64
    }

    fn peak(&self) -> usize {
        let known = |i: &usize| !self.strains[*i].is_nan();
        (0..self.strains.len())
            .filter(known)
            .max_by(|i, j| self.strains[*i].total_cmp(&self.strains[*j]))
            .expect("a look")
    }

    /// The largest distance with this strain among the cells `looks`.
    fn root(&self, looks: std::ops::Range<usize>, strain: f64) -> Option<f64> {
        let over = |i: usize| self.strains[i] > strain;
        let known = |i: usize| !self.strains[i].is_nan() && !self.strains[i + 1].is_nan();
        let cell = looks.rev().find(|&i| known(i) && over(i) != over(i + 1))?;
        let [mut lo, mut hi] = [cell, cell + 1].map(|i| self.from + STEP * i as f64);
        for _ in 0..60 {
            let mid = 0.5 * (lo + hi);
            if (self.at(mid).0 > strain) == over(cell) { lo = mid } else { hi = mid }
        }
        Some(lo)
    }

    /// The distance that a tap at `a` is taken for; `range` is the range of interest, mm.
    pub fn own(&self, a: f64, range: [f64; 2]) -> Taken {
        let (strain, slope) = self.at(a);
        let inside = |b: f64| b >= range[0] * (1.0 - 1e-6) && b <= range[1] * (1.0 + 1e-6);
        if slope < 0.0 {
            let second = self.root(0..self.peak(), strain);
            return Taken { a, slope, ambiguous: second.is_some_and(inside) };
        }
        match self.root(self.peak()..self.strains.len() - 1, strain) {
            Some(far) => Taken { a: far, slope: self.at(far).1, ambiguous: inside(a) },
            None => Taken { a, slope, ambiguous: true },
        }
    }

    /// The distance that the reading `strain` of another whisker is taken for.
    pub fn other(&self, strain: f64) -> Option<f64> {
        let peak = self.peak();
        let far = self.root(peak..self.strains.len() - 1, strain);
        far.or_else(|| self.root(0..peak, strain))
    }
}
