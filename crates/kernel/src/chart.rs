//! The section law of a hyperelastic material as polynomials: (n, m) → (e₀, κR), so that no kernel solves it per node.
//!
//! With t = n/(πE₀) and b = 4m/(πE₀), the strains a Hookean section would have, and β = b²/(b₀ + b₁t)² ∈ [0, 1]:
//!
//! - e₀ = t + t² r(t) + b² p(β, t),
//! - κR = b (1 + χ), χ = t c(t) + b² q(β, t).
//!
//! The factors t², t and b² are exact, so that both corrections keep their relative precision as the load vanishes. The polynomials interpolate the
//! exact law at Chebyshev points; coefficients below the required accuracy are cut.

use vibrissa_core::physics::chebyshev::{coefficients, points, twice};
use vibrissa_core::physics::section::{SectionLaw, SectionStrain};
use vibrissa_core::scene::Material;

const POINTS: [usize; 2] = [18, 14];

/// Polynomials of one law over one range of loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart<T = f64> {
    /// 1/axial, the inverse of the largest |t|.
    pub scale: T,
    /// b₀, b₁: largest b at t.
    pub bending: [T; 2],
    /// r(t/axial), ascending powers.
    pub r: Vec<T>,
    /// c(t/axial), ascending powers.
    pub c: Vec<T>,
    /// p(2β − 1, t/axial): rows of ascending powers of 2β − 1, each of ascending powers of t/axial.
    pub p: Vec<Vec<T>>,
    /// q, as p.
    pub q: Vec<Vec<T>>,
    /// Bound on the strain error, relative to the strain: the part cut off, and the last coefficients.
    pub error: f64,
    /// True if it covers the whole requested range.
    pub whole: bool,
    /// True if, wherever the bending strain is the chart's largest, some fibre has left the range of the law.
    pub covers: bool,
}

impl Chart {
    /// The chart of `material` for |t| ≤ `axial`, b ≤ b₀ + b₁ t, cut at `accuracy` relative to the strain. The range is shortened where the material
    /// fails, or where the polynomials err by more than `allowed` close to its end. `None` for Hooke's law.
    pub fn new(
        material: &Material,
        axial: f64,
        bending: [f64; 2],
        [accuracy, allowed]: [f64; 2],
    ) -> Option<Self> {
        let law = SectionLaw::new(material);
        if law.is_linear() {
            return None;
        }
        let unit = std::f64::consts::PI * material.e0();
        let scaled = |t: f64, b: f64| {
            let strain = law.deform(t * unit, 0.25 * b * unit)?;
            Some((strain.axial, strain.bending))
        };
        let shorter = (0..24).filter_map(|k| {
            let share = 0.85f64.powi(k);
            let chart = Self::fit(scaled, axial * share, bending.map(|b| b * share), accuracy)?;
            Some(Self { whole: k == 0, ..chart })
        });
        let mut best: Option<Self> = None;
        for chart in shorter {
            let error = chart.error;
            if best.as_ref().is_none_or(|best| error < best.error) {
                best = Some(chart);
            }
            if error <= allowed {
                break;
            }
        }
        best
    }

    fn fit(
        law: impl Fn(f64, f64) -> Option<(f64, f64)>,
        axial: f64,
        bending: [f64; 2],
        accuracy: f64,
    ) -> Option<Self> {
        let [rows, columns] = POINTS;
        let (betas, ts) = (points(rows), points(columns));
        let (mut r, mut c, mut covers) = (Vec::new(), Vec::new(), true);
        let (mut p, mut q) = (vec![vec![0.0; columns]; rows], vec![vec![0.0; columns]; rows]);
        for (j, &x) in ts.iter().enumerate() {
            let t = axial * x;
            let (straight, _) = law(t, 0.0)?;
            // q divides by b², which amplifies an error of χ at b = 0: four small b leave one of eighth order.
            let mut chi = 0.0;
            for (times, weight) in [(1.0, 4096.0), (2.0, -1344.0), (4.0, 84.0), (8.0, -1.0)] {
                let b = times * (0.03 * bending[0]).min(4e-3);
                chi += weight / 2835.0 * (law(t, b)?.1 / b - 1.0);
            }
            r.push(if t == 0.0 { 0.0 } else { (straight - t) / (t * t) });
            c.push(if t == 0.0 { 0.0 } else { chi / t });
            for (i, &y) in betas.iter().enumerate() {
                let b = (bending[0] + bending[1] * t) * (0.5 * (1.0 + y)).sqrt();
                let (e, k) = law(t, b)?;
                p[i][j] = (e - straight) / (b * b);
                q[i][j] = (k / b - 1.0 - chi) / (b * b);
            }
            let (axial, bending) = law(t, bending[0] + bending[1] * t)?;
            covers &= !SectionStrain { axial, bending }.is_in_range();
        }
        let most = bending[0] + bending[1].abs() * axial;
        let (p, cut_p) = trimmed(twice(coefficients, &p), accuracy / most);
        let (q, cut_q) = trimmed(twice(coefficients, &q), accuracy / (most * most));
        let (r, cut_r) = trimmed1(coefficients(&r), accuracy / axial);
        let (c, cut_c) = trimmed1(coefficients(&c), accuracy / axial);
        let error = cut_p * most + cut_q * most * most + (cut_r + cut_c) * axial;
        Some(Self {
            scale: 1.0 / axial,
            bending,
            r: monomials(&r),
            c: monomials(&c),
            p: staircase(twice(monomials, &p)),
            q: staircase(twice(monomials, &q)),
            error,
            whole: true,
            covers,
        })
    }
}

/// Cuts the tail that sums to less than `accuracy`; also returns the sum cut, at least the last coefficient.
fn trimmed1(mut c: Vec<f64>, accuracy: f64) -> (Vec<f64>, f64) {
    let mut cut = c.last().copied().unwrap_or_default().abs();
    while c.len() > 1 && cut + c[c.len() - 1].abs() <= accuracy {
        cut += c.pop().unwrap_or_default().abs();
    }
    (c, cut)
}

/// Sets coefficients to 0, smallest first, among those at the ends of rows that are longer than the next, while the sum cut is at most `accuracy`; also
/// returns that sum. It begins with the last row and column, for what was never computed.
fn trimmed(mut c: Vec<Vec<f64>>, accuracy: f64) -> (Vec<Vec<f64>>, f64) {
    let size = |row: &[f64]| row.iter().map(|x| x.abs()).sum::<f64>();
    let mut lengths: Vec<usize> = c.iter().map(Vec::len).collect();
    let mut cut = size(&c[c.len() - 1]) + c.iter().map(|row| row[row.len() - 1].abs()).sum::<f64>();
    loop {
        let free = |&i: &usize| lengths[i] > lengths.get(i + 1).copied().unwrap_or(0);
        let last = |&i: &usize| c[i][lengths[i] - 1].abs();
        let Some(i) = (0..c.len()).filter(free).min_by(|i, k| last(i).total_cmp(&last(k))) else { break };
        if cut + last(&i) > accuracy {
            break;
        }
        cut += last(&i);
        lengths[i] -= 1;
        c[i][lengths[i]] = 0.0;
    }
    (c, cut)
}

/// The rows of a table without the zeros at their ends; at least one number stays.
fn staircase(c: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let end = |row: &Vec<f64>| row.iter().rposition(|x| *x != 0.0).map_or(0, |k| k + 1);
    let rows = c.iter().rposition(|row| end(row) > 0).unwrap_or(0);
    c[..=rows].iter().map(|row| row[..end(row).max(1)].to_vec()).collect()
}

fn monomials(c: &[f64]) -> Vec<f64> {
    let n = c.len();
    let (mut before, mut now) = (vec![0.0; n], vec![0.0; n]);
    before[0] = 1.0;
    if n > 1 {
        now[1] = 1.0;
    }
    let mut sum: Vec<f64> = before.iter().map(|x| x * c[0]).collect();
    for c in &c[1..] {
        sum.iter_mut().zip(&now).for_each(|(s, x)| *s += c * x);
        let next = (0..n).map(|i| 2.0 * if i > 0 { now[i - 1] } else { 0.0 } - before[i]).collect();
        before = std::mem::replace(&mut now, next);
    }
    sum
}
