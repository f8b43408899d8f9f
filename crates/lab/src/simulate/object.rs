//! What a whisker strokes: a circle, corners joined by straight faces, a curve through points. Lengths in mm.
//!
//! Edges are followed with the object on the left, so that a whisker that turns counterclockwise touches them in their own direction.

use nalgebra::{DMatrix, DVector};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub at: [f64; 2],
    /// Direction of the edge, rad.
    pub direction: f64,
    /// d direction/d parameter, rad.
    pub bend: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Object {
    /// All within a radius; the parameter is the angle about the centre.
    Circle {
        centre: [f64; 2],
        radius: f64,
    },
    /// Straight faces between corners, convex.
    Corners(Vec<[f64; 2]>),
    Curve(Curve),
}

/// A cubic spline through points, over the length of the chords between them.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    points: Vec<[f64; 2]>,
    closed: bool,
    knots: Vec<f64>,
    /// Second derivatives at the knots.
    bends: [Vec<f64>; 2],
}

impl Curve {
    /// Through `points`; natural at the ends unless `closed`. `None` of fewer than four, of repeated neighbours, of NaN.
    pub fn new(mut points: Vec<[f64; 2]>, closed: bool) -> Option<Self> {
        if closed && points.len() > 1 && points[0] == points[points.len() - 1] {
            points.pop();
        }
        if points.len() < 4 || !points.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let next = points.iter().cycle().skip(1);
        let twice_area: f64 = points.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum();
        // Closed curves are followed counterclockwise.
        if closed && twice_area < 0.0 {
            points.reverse();
        }
        if closed {
            points.push(points[0]);
        }
        let mut knots = vec![0.0];
        for w in points.windows(2) {
            let length = (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
            if length <= 0.0 {
                return None;
            }
            knots.push(knots[knots.len() - 1] + length);
        }
        let bends = [0, 1].map(|k| bends(&knots, &points.iter().map(|p| p[k]).collect::<Vec<_>>(), closed));
        let [Some(x), Some(y)] = bends else { return None };
        Some(Self { points, closed, knots, bends: [x, y] })
    }

    pub fn length(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    fn at(&self, t: f64) -> Place {
        let t = if self.closed { t.rem_euclid(self.length()) } else { t.clamp(0.0, self.length()) };
        let k = self.knots.partition_point(|x| *x <= t).clamp(1, self.knots.len() - 1) - 1;
        let h = self.knots[k + 1] - self.knots[k];
        let (v, u) = ((t - self.knots[k]) / h, (self.knots[k + 1] - t) / h);
        let of = |i: usize| {
            let ([p, q], [m, n]) =
                ([self.points[k][i], self.points[k + 1][i]], [self.bends[i][k], self.bends[i][k + 1]]);
            let value = u * p + v * q + ((u * u * u - u) * m + (v * v * v - v) * n) * h * h / 6.0;
            let slope = (q - p) / h + ((3.0 * v * v - 1.0) * n - (3.0 * u * u - 1.0) * m) * h / 6.0;
            [value, slope, u * m + v * n]
        };
        let [[x, dx, ddx], [y, dy, ddy]] = [of(0), of(1)];
        Place { at: [x, y], direction: dy.atan2(dx), bend: (dx * ddy - dy * ddx) / (dx * dx + dy * dy) }
    }
}

/// Second derivatives of a cubic spline at its knots: natural, or periodic.
fn bends(knots: &[f64], values: &[f64], closed: bool) -> Option<Vec<f64>> {
    let n = knots.len();
    let h = |k: usize| knots[k + 1] - knots[k];
    let rise = |k: usize| (values[k + 1] - values[k]) / h(k);
    let (mut m, mut b) = (DMatrix::identity(n, n), DVector::zeros(n));
    for k in 1..n - 1 {
        for (j, x) in [(k - 1, h(k - 1)), (k, 2.0 * (h(k - 1) + h(k))), (k + 1, h(k))] {
            m[(k, j)] = x;
        }
        b[k] = 6.0 * (rise(k) - rise(k - 1));
    }
    if closed {
        // The same bend at both ends, and the same slope.
        m[(0, n - 1)] = -1.0;
        m.row_mut(n - 1).fill(0.0);
        for (j, x) in [(0, 2.0 * h(0)), (1, h(0)), (n - 2, h(n - 2)), (n - 1, 2.0 * h(n - 2))] {
            m[(n - 1, j)] += x;
        }
        b[n - 1] = 6.0 * (rise(0) - rise(n - 2));
    }
    Some(m.lu().solve(&b)?.iter().copied().collect())
}

impl Object {
    /// A box of these sides about a centre, turned by `turn` rad.
    pub fn boxed([x, y]: [f64; 2], [width, height]: [f64; 2], turn: f64) -> Self {
        let (sin, cos) = turn.sin_cos();
        let corner = |(u, v): (f64, f64)| {
            let (u, v) = (0.5 * width * u, 0.5 * height * v);
            [x + cos * u - sin * v, y + sin * u + cos * v]
        };
        Self::Corners([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec())
    }

    /// As it is seen in a mirror on the x axis.
    pub fn mirrored(&self) -> Self {
        let flip = |[x, y]: [f64; 2]| [x, -y];
        let back = |points: &[[f64; 2]]| points.iter().rev().map(|p| flip(*p)).collect::<Vec<_>>();
        match self {
            Self::Circle { centre, radius } => Self::Circle { centre: flip(*centre), radius: *radius },
            Self::Corners(points) => Self::Corners(back(points)),
            Self::Curve(c) => {
                Self::Curve(Curve::new(back(&c.points), c.closed).expect("its mirror image is a curve"))
            }
        }
    }

    /// The place at parameter `t` of a smooth edge; of corners, what lies on the faces, by their number and the share of the way.
    pub fn at(&self, t: f64) -> Place {
        match self {
            Self::Circle { centre: [x, y], radius } => Place {
                at: [x + radius * t.cos(), y + radius * t.sin()],
                direction: t + std::f64::consts::FRAC_PI_2,
                bend: 1.0,
            },
            Self::Corners(points) => {
                let n = points.len();
                let k = (t.rem_euclid(n as f64) as usize).min(n - 1);
                let (p, q, share) = (points[k], points[(k + 1) % n], t.rem_euclid(n as f64) - k as f64);
                let [dx, dy] = [q[0] - p[0], q[1] - p[1]];
                Place { at: [p[0] + share * dx, p[1] + share * dy], direction: dy.atan2(dx), bend: 0.0 }
            }
            Self::Curve(curve) => curve.at(t),
        }
    }

    pub fn length(&self) -> f64 {
        match self {
            Self::Circle { .. } => std::f64::consts::TAU,
            Self::Corners(points) => points.len() as f64,
            Self::Curve(curve) => curve.length(),
        }
    }

    pub fn is_closed(&self) -> bool {
        !matches!(self, Self::Curve(c) if !c.closed)
    }

    pub fn centre(&self) -> [f64; 2] {
        let mean = |p: &[[f64; 2]]| [0, 1].map(|k| p.iter().map(|p| p[k]).sum::<f64>() / p.len() as f64);
        match self {
            Self::Circle { centre, .. } => *centre,
            Self::Corners(points) => mean(points),
            Self::Curve(c) => mean(&c.points[..c.points.len() - usize::from(c.closed)]),
        }
    }

    /// Distance of a point from the edge, mm.
    pub fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        if let Self::Circle { centre, radius } = self {
            return ((x - centre[0]).hypot(y - centre[1]) - radius).abs();
        }
        let parts = match self {
            Self::Corners(points) => points.len(),
            _ => 2000,
        };
        let to = |share: f64| self.at(share * self.length()).at;
        let segment = |k: usize| {
            let (p, q) = (to(k as f64 / parts as f64), to((k as f64 + 1.0 - 1e-12) / parts as f64));
            let (d, w) = ([q[0] - p[0], q[1] - p[1]], [x - p[0], y - p[1]]);
            let s = ((d[0] * w[0] + d[1] * w[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
            (w[0] - s * d[0]).hypot(w[1] - s * d[1])
        };
        (0..parts).map(segment).fold(f64::INFINITY, f64::min)
    }

    /// Places along the edge in `steps` even steps, from its beginning to its end.
    pub fn along(&self, steps: usize) -> Vec<[f64; 2]> {
        (0..=steps).map(|k| self.at(self.length() * k as f64 / steps as f64).at).collect()
    }
}
