//! Sums of compliance from one end of a built whisker, or of its gauge, to any place: on panels where the compliance is smooth, from its Chebyshev
//! series, so that no section is needed for them again.

use std::array::from_fn;
use std::sync::OnceLock;

use glam::{DMat2, DVec2};

use super::body::Body;
use super::chebyshev::{matrix, points, scaled};
use super::nodes::{Nodes, each};

/// Points of a panel.
const POINTS: usize = 16;

/// A series has converged if its last two coefficients are at most this share of its largest.
const ROUNDING: f64 = 4e-15;

/// Most halvings of a smooth piece. A panel that still has no series is integrated by Gauss's rule at each call. At the tip of a power law five leave an
/// error of 6e-7 of f for n = 0.5 and d = D/40, less elsewhere.
const HALVINGS: u32 = 12;
const OF_POWER: u32 = 5;

/// Ratio of the radii at its ends from which on the series of a cone's panel would be too short.
const TAPERED: f64 = 1.6;

/// Largest turn of a curved whisker along a panel, rad; beyond it the series would be too short.
const TURNED: f64 = 2.0;

/// The integrands: those of the work, or of the strain of a gauge, which have the factor R; with or without shear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Of {
    /// True for the strain.
    pub strain: bool,
    /// True with shear.
    pub shear: bool,
}

/// Integrals about a place: ∫ 1/EI ds, ∫ q/EI ds and ∫ q qᵀ/EI ds with q from the whisker to that place, for the strain of a gauge times R; and
/// ∫ d dᵀ/kGA ds with d across the section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sums {
    /// 1/(N mm); the integrals that follow have one and two more mm.
    pub whole: f64,
    /// To the first power of q.
    pub first: DVec2,
    /// To the second.
    pub second: DMat2,
    /// The compliance of shear, mm/N.
    pub shear: DMat2,
}

fn outer(p: DVec2, q: DVec2) -> DMat2 {
    DMat2::from_cols(p * q.x, p * q.y)
}

/// 1/EI, q/EI, q qᵀ/EI and d dᵀ/kGA, or their integrals: first what the strain of a straight whisker needs, then the rest that is not 0 there, then
/// what that of a curved one needs, then the rest.
type Parts = [f64; 9];

/// Calls a function of the first K parts.
macro_rules! with_parts {
    ($count:expr, $call:ident($($with:expr),+)) => {
        match $count {
            2 => $call::<2>($($with),+),
            4 => $call::<4>($($with),+),
            5 => $call::<5>($($with),+),
            _ => $call::<9>($($with),+),
        }
    };
}

/// Powers of q in them.
const POWERS: [usize; 9] = [0, 1, 2, 0, 1, 2, 2, 0, 0];

/// Those of 1/EI and of the diagonal of d dᵀ/kGA.
const PLAIN: [usize; 3] = [0, 3, 7];

impl Sums {
    const ZERO: Self = Self { whole: 0.0, first: DVec2::ZERO, second: DMat2::ZERO, shear: DMat2::ZERO };

    fn of([whole, x, xx, shear_yy, y, xy, yy, shear_xx, shear_xy]: Parts) -> Self {
        let second = DMat2::from_cols_array(&[xx, xy, xy, yy]);
        let shear = DMat2::from_cols_array(&[shear_xx, shear_xy, shear_xy, shear_yy]);
        Self { whole, first: DVec2::new(x, y), second, shear }
    }

    /// The sums about a place further on. The terms of a straight panel differ in sign: radii that differ by less than 1.6 keep the loss to two digits.
    fn moved(self, by: DVec2) -> Self {
        let Self { whole, first, second, shear } = self;
        let second = second + outer(by, first) + outer(first, by) + outer(by, by) * whole;
        Self { whole, first: first + by * whole, second, shear }
    }

    fn and(self, other: Self) -> Self {
        let (whole, first) = (self.whole + other.whole, self.first + other.first);
        Self { whole, first, second: self.second + other.second, shear: self.shear + other.shear }
    }
}

impl Of {
    /// The number of parts that are needed, from the first on.
    fn count(self, body: &Body) -> usize {
        match (body.built.is_straight(), self.strain) {
            (true, true) => 2,
            (true, false) => 4,
            (false, true) => 5,
            (false, false) => 9,
        }
    }

    /// The integrands at `s`, on the piece that holds `within`, with q over `scale`.
    fn parts(self, body: &Body, s: f64, within: f64, q: DVec2) -> Parts {
        let section = body.section(s, within);
        let share = if self.strain { section.radius } else { 1.0 } / section.bending;
        let across = match () {
            () if !self.shear => DVec2::ZERO,
            () if body.built.is_straight() => DVec2::Y,
            () => DVec2::from_angle(body.rest_angle(s)).perp(),
        };
        let (slack, scaled) = (across / section.shear, q * share);
        let [xx, xy, yy] = [q.x * scaled.x, q.x * scaled.y, q.y * scaled.y];
        let shears = [slack.x * across.x, slack.x * across.y];
        [share, scaled.x, xx, slack.y * across.y, scaled.y, xy, yy, shears[0], shears[1]]
    }

    /// The sums between two places of one piece about the rest place `about`.
    fn between(self, body: &Body, [from, to]: [f64; 2], about: DVec2) -> Sums {
        let (within, mut sums) = (0.5 * (from + to), [0.0; 9]);
        each(from, to, |s, weight| {
            let parts = self.parts(body, s, within, about - body.rest(s));
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += weight * part);
        });
        Sums::of(sums)
    }
}

/// A part of a smooth piece.
#[derive(Debug, Clone, PartialEq)]
struct Panel {
    span: [f64; 2],
    /// The rest place of its near end, and the sums up to there about it.
    near: DVec2,
    before: Sums,
    /// Series of the sums from its near end on over the length h to their place, to the power of each; `None` where the compliance is not smooth.
    series: Option<Box<[f64]>>,
}

/// The points in [−1, 1], and for each power n of v the matrix from the values of some g at the points (rows) to the series of ∫ vⁿ g dv (columns), with
/// v from 0 at −1 to 1 at the place of the series.
struct Rule {
    points: [f64; POINTS],
    means: [[[f64; POINTS]; POINTS]; 3],
}

impl Rule {
    fn get() -> &'static Self {
        static RULE: OnceLock<Rule> = OnceLock::new();
        RULE.get_or_init(|| {
            let (points, matrix, gauss) = (points(POINTS), matrix(POINTS), Nodes::of(POINTS));
            // From values to the mean at a point, of each power.
            let mean = |power: i32, end: f64, j: usize| -> f64 {
                let nodes = gauss.points.iter().zip(&gauss.weights);
                let value =
                    |x: f64| -> f64 { (0..POINTS).map(|k| matrix[k][j] * (k as f64 * x.acos()).cos()).sum() };
                nodes.map(|(v, w)| w * v.powi(power) * value(v * (end + 1.0) - 1.0)).sum()
            };
            let means = from_fn(|power| {
                let at: [[f64; POINTS]; POINTS] = from_fn(|i| from_fn(|j| mean(power as i32, points[i], j)));
                from_fn(|j| from_fn(|k| (0..POINTS).map(|i| matrix[k][i] * at[i][j]).sum()))
            });
            Self { points: from_fn(|i| points[i]), means }
        })
    }
}

impl Panel {
    fn new(body: &Body, of: Of, span: [f64; 2], near: DVec2, before: Sums) -> Self {
        let (rule, [from, to]) = (Rule::get(), span);
        let within = 0.5 * (from + to);
        let at: [Parts; POINTS] = from_fn(|i| {
            let h = 0.5 * (to - from) * (rule.points[i] + 1.0);
            let s = from + h;
            of.parts(body, s, within, (near - body.rest(s)) / h)
        });
        Self { span, near, before, series: with_parts!(of.count(body), series(rule, &at)) }
    }

    /// The sums up to `to` about its rest place `about`.
    fn to(&self, body: &Body, of: Of, to: f64, about: DVec2) -> Sums {
        let [from, _] = self.span;
        let Some(series) = &self.series else {
            return self.before.moved(about - self.near).and(of.between(body, [from, to], about));
        };
        let (x, h) = (scaled(self.span, to), to - from);
        let means = with_parts!(of.count(body), value(series, x));
        let scales = [h, h * h, h * h * h];
        let sums = Sums::of(from_fn(|i| scales[POWERS[i]] * means[i]));
        self.before.and(sums).moved(about - self.near)
    }
}

/// The series of the first K parts, from all parts at the points: rows of K numbers. `None` if it has not converged.
fn series<const K: usize>(rule: &Rule, at: &[Parts; POINTS]) -> Option<Box<[f64]>> {
    let mut rows = [[0.0; K]; POINTS];
    for part in 0..K {
        let mut column = [0.0; POINTS];
        for (weights, parts) in rule.means[POWERS[part]].iter().zip(at) {
            column.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * parts[part]);
        }
        rows.iter_mut().zip(column).for_each(|(row, sum)| row[part] = sum);
    }
    let largest = |rows: &[[f64; K]], part: usize| rows.iter().map(|row| row[part].abs()).fold(0.0, f64::max);
    let smooth = |part: usize| largest(&rows[POINTS - 2..], part) <= ROUNDING * largest(&rows, part);
    PLAIN.into_iter().filter(|part| *part < K).all(smooth).then(|| rows.as_flattened().into())
}

/// The first K parts of a series at x (Clenshaw 1955), the others 0: even and odd terms apart, which are series in T₂(x) and wait less for each other.
fn value<const K: usize>(series: &[f64], x: f64) -> Parts {
    let (rows, _) = series.as_chunks::<K>();
    let twice = 4.0 * x * x - 2.0;
    let (mut last, mut sum) = ([[0.0; K]; 2], [[0.0; K]; 2]);
    for [even, odd] in rows.as_chunks::<2>().0.iter().rev() {
        for (row, (last, sum)) in [even, odd].into_iter().zip(last.iter_mut().zip(&mut sum)) {
            let next: [f64; K] = from_fn(|i| (row[i] - last[i]) + twice * sum[i]);
            (*last, *sum) = (*sum, next);
        }
    }
    // T₀ = 1, T₂ = twice/2, and T₁ = x, T₃ = x (twice − 1).
    let mut all = [0.0; 9];
    for i in 0..K {
        all[i] = sum[0][i] - 0.5 * twice * last[0][i] + x * (sum[1][i] - last[1][i]);
    }
    all
}

/// Sums from one end of a span of a whisker on.
#[derive(Debug, Clone, PartialEq)]
pub struct Cumulative {
    of: Of,
    panels: Vec<Panel>,
    /// The far end, its rest place, and the sums up to there about it.
    end: f64,
    far: DVec2,
    all: Sums,
}

impl Cumulative {
    /// Over a span of the whisker, mm; nothing for one of no length.
    pub fn new(body: &Body, of: Of, [from, to]: [f64; 2]) -> Self {
        let (far, all) = (body.rest(from), Sums::ZERO);
        let mut sums = Self { of, panels: Vec::new(), end: from, far, all };
        let inside = body.knots().iter().copied().filter(|knot| *knot > from && *knot < to);
        for end in inside.chain([to]) {
            sums.add(body, end, if body.power().is_some() { OF_POWER } else { HALVINGS });
        }
        sums
    }

    /// Adds a smooth piece from the end on.
    fn add(&mut self, body: &Body, to: f64, halvings: u32) {
        let from = self.end;
        if from >= to {
            return;
        }
        let middle = 0.5 * (from + to);
        let ratio = body.radius(from, middle) / body.radius(to, middle);
        // The slope of a power law has no limit at the tip.
        let rough = ratio.max(1.0 / ratio) > TAPERED
            || body.power().is_some() && to >= body.length
            || (body.rest_angle(to) - body.rest_angle(from)).abs() > TURNED;
        let panel = || Panel::new(body, self.of, [from, to], self.far, self.all);
        let found = if halvings > 0 && rough { None } else { Some(panel()) };
        match found.filter(|panel| panel.series.is_some() || halvings == 0) {
            Some(panel) => {
                (self.end, self.far) = (to, body.rest(to));
                self.all = panel.to(body, self.of, to, self.far);
                self.panels.push(panel);
            }
            None => {
                self.add(body, middle, halvings - 1);
                self.add(body, to, halvings - 1);
            }
        }
    }

    /// The sums up to `to`, or to the end of the span, about a place.
    pub fn to(&self, body: &Body, to: f64, about: DVec2) -> Sums {
        if to >= self.end {
            return self.all.moved(about - self.far);
        }
        let after = self.panels.partition_point(|panel| panel.span[0] < to);
        after.checked_sub(1).map_or(Sums::ZERO, |place| self.panels[place].to(body, self.of, to, about))
    }
}
