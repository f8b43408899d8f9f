//! Reductions: mean, spread, rms, extremes. One pass, no cancelling sums of squares.

/// Count, mean and sum of squared distances from the mean (Welford 1962).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spread {
    /// Values seen.
    pub n: u64,
    mean: f64,
    squares: f64,
}

impl Spread {
    /// `n` values with this mean and this sum of squared distances from it.
    pub fn of(n: u64, mean: f64, squares: f64) -> Self {
        Self { n, mean, squares }
    }

    /// Takes one value.
    pub fn push(&mut self, x: f64) {
        self.n += 1;
        let from_old = x - self.mean;
        self.mean += from_old / self.n as f64;
        self.squares += from_old * (x - self.mean);
    }

    /// Mean; `None` without values.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then_some(self.mean)
    }

    /// Sample standard deviation (n − 1); `None` below two values.
    pub fn sd(&self) -> Option<f64> {
        (self.n > 1).then(|| (self.squares / (self.n - 1) as f64).sqrt())
    }
}

/// The larger of `x` and the largest value seen so far, if any.
pub fn larger(seen: Option<f64>, x: f64) -> Option<f64> {
    Some(seen.map_or(x, |most| most.max(x)))
}

/// Root mean square, mean and largest absolute value of errors, in their own unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    n: u64,
    sum: f64,
    squares: f64,
    largest: f64,
}

impl Errors {
    /// `n` errors with this sum, sum of squares and largest absolute value.
    pub fn of(n: u64, [sum, squares, largest]: [f64; 3]) -> Self {
        Self { n, sum, squares, largest }
    }

    /// Takes one error.
    pub fn push(&mut self, e: f64) {
        self.n += 1;
        self.sum += e;
        self.squares += e * e;
        self.largest = self.largest.max(e.abs());
    }

    /// √(Σe²/n); `None` without errors.
    pub fn rms(&self) -> Option<f64> {
        (self.n > 0).then(|| (self.squares / self.n as f64).sqrt())
    }

    /// Σe/n; `None` without errors.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / self.n as f64)
    }

    /// max |e|; `None` without errors.
    pub fn largest(&self) -> Option<f64> {
        (self.n > 0).then_some(self.largest)
    }
}

/// Kernel sweeps spent on taps.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Sweeps {
    /// Taps solved by a kernel.
    pub taps: u64,
    spent: f64,
    most: f64,
}

impl Sweeps {
    /// Takes one tap that took `sweeps`.
    pub fn push(&mut self, sweeps: f64) {
        self.taps += 1;
        self.spent += sweeps;
        self.most = self.most.max(sweeps);
    }

    /// Adds the taps of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.taps += other.taps;
        self.spent += other.spent;
        self.most = self.most.max(other.most);
    }

    /// Mean sweeps of a tap; 0 without taps.
    pub fn mean(&self) -> f64 {
        self.spent / self.taps.max(1) as f64
    }

    /// Sweeps of the tap that took the most.
    pub fn most(&self) -> f64 {
        self.most
    }
}

/// Smallest and largest of `values`; infinite if empty.
pub fn range(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
}

/// `values`, ascending.
pub fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.into_iter().collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Distinct `values`, ascending.
pub fn distinct(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut all = sorted(values);
    all.dedup();
    all
}

/// Index of a percentile among `n` ≥ 1 sorted values (nearest rank): the smallest value that is not below `percent` % of them.
pub fn percentile(n: usize, percent: usize) -> usize {
    (n * percent).div_ceil(100).max(1) - 1
}

/// Median; sorts `values`. NaN without values.
pub fn median(values: &mut [f64]) -> f64 {
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    let (low, mid, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    let mid = *mid;
    if n % 2 == 1 { mid } else { 0.5 * (mid + low.iter().copied().fold(f64::NEG_INFINITY, f64::max)) }
}
