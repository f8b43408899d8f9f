//! What is drawn in a panel.

use serde::Serialize;

use super::Axis;
use crate::figure::series;

/// Shape of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Marker {
    /// ●
    Circle,
    /// ■
    Square,
    /// ▲
    Triangle,
    /// ◆
    Diamond,
    /// ▼
    Down,
    /// +
    Plus,
    /// ★
    Star,
    /// ⧗
    Hourglass,
    /// ×: what does not count
    Cross,
    /// ○: what is chosen
    Ring,
    /// ↑: a point beyond the end of the axis, at the edge
    Arrow,
}

impl Marker {
    /// All that have corners or strokes, with their names in JSON.
    pub const DRAWN: [(&str, Self); 9] = [
        ("square", Self::Square),
        ("triangle", Self::Triangle),
        ("diamond", Self::Diamond),
        ("down", Self::Down),
        ("plus", Self::Plus),
        ("star", Self::Star),
        ("hourglass", Self::Hourglass),
        ("cross", Self::Cross),
        ("arrow", Self::Arrow),
    ];

    /// Those of series beside each other, in order.
    pub const SERIES: [Self; 8] = [
        Self::Circle,
        Self::Square,
        Self::Triangle,
        Self::Diamond,
        Self::Down,
        Self::Star,
        Self::Plus,
        Self::Hourglass,
    ];

    /// Corners of a filled one of radius 1, y downwards; none of a circle, a ring and what is drawn of strokes.
    pub fn corners(self) -> &'static [[f64; 2]] {
        match self {
            Self::Square => &[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
            Self::Triangle => &[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]],
            Self::Diamond => &[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]],
            Self::Down => &[[0.0, 1.2], [1.1, -0.8], [-1.1, -0.8]],
            // The inner corners of a five-pointed star lie at 0.38 of its radius.
            Self::Star => &[
                [0.0, -1.5],
                [0.34, -0.46],
                [1.43, -0.46],
                [0.54, 0.18],
                [0.88, 1.21],
                [0.0, 0.57],
                [-0.88, 1.21],
                [-0.54, 0.18],
                [-1.43, -0.46],
                [-0.34, -0.46],
            ],
            Self::Hourglass => &[[-1.0, -1.2], [1.0, -1.2], [-1.0, 1.2], [1.0, 1.2]],
            Self::Arrow => {
                &[[0.0, -1.6], [1.3, 0.1], [0.45, 0.1], [0.45, 1.6], [-0.45, 1.6], [-0.45, 0.1], [-1.3, 0.1]]
            }
            Self::Circle | Self::Plus | Self::Cross | Self::Ring => &[],
        }
    }

    /// Strokes of radius 1.
    pub fn strokes(self) -> &'static [[[f64; 2]; 2]] {
        match self {
            Self::Plus => &[[[-1.4, 0.0], [1.4, 0.0]], [[0.0, -1.4], [0.0, 1.4]]],
            Self::Cross => &[[[-1.1, -1.1], [1.1, 1.1]], [[-1.1, 1.1], [1.1, -1.1]]],
            _ => &[],
        }
    }
}

/// Points in the order of a table. NaN is a gap.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Path {
    /// In the key; the same name twice is one entry.
    pub name: String,
    /// Place in [`COLOURS`](crate::figure::COLOURS).
    pub colour: usize,
    /// Across.
    pub x: Vec<f64>,
    /// Up.
    pub y: Vec<f64>,
}

impl Path {
    /// With these points.
    pub fn new(name: impl Into<String>, colour: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (x, y) = points.into_iter().unzip();
        Self { name: name.into(), colour, x, y }
    }

    fn len(&self) -> usize {
        self.x.len().min(self.y.len())
    }

    /// Whether point `i` has a place.
    fn is_point(&self, i: usize) -> bool {
        self.x[i].is_finite() && self.y[i].is_finite()
    }
}

/// A line across a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// At a value of y.
    X,
    /// At a value of x.
    Y,
}

/// Values on a grid of cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cells {
    /// Ends of the cells across, one more than there are.
    pub x: Vec<f64>,
    /// The same up.
    pub y: Vec<f64>,
    /// Row by row from the first y; NaN is empty.
    pub z: Vec<f64>,
    /// What z is.
    pub of: Axis,
}

/// What cells of a map without a value are called in the key.
pub const NO_VALUE: &str = "empty: no value";

/// Something drawn in a panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Mark {
    /// Points joined.
    Line {
        /// Where.
        #[serde(flatten)]
        path: Path,
        /// 0: solid, 1: dashed, 2: dotted.
        dash: u8,
        /// Points on it.
        marker: Option<Marker>,
    },
    /// Points alone.
    Points {
        /// Where.
        #[serde(flatten)]
        path: Path,
        /// Of all.
        marker: Marker,
        /// Half length of a bar in y; empty where there are none.
        error: Vec<f64>,
        /// Rows of the page's table that they are; empty where they are none.
        rows: Vec<usize>,
        /// What to say of each beside its numbers; empty where there is nothing.
        notes: Vec<String>,
    },
    /// Bars from 0 along x, at the places of words up.
    Bars {
        /// Length and place.
        #[serde(flatten)]
        path: Path,
        /// Of how many series at a place this is which.
        among: [usize; 2],
    },
    /// Closed and filled.
    Area {
        /// Its edge.
        #[serde(flatten)]
        path: Path,
        /// Its edge is drawn.
        outlined: bool,
    },
    /// Map of values.
    Cells(Cells),
    /// Line across the panel.
    Rule {
        /// Direction.
        along: Along,
        /// Where.
        at: f64,
        /// In the key.
        name: String,
        /// Place in the colours.
        colour: usize,
        /// As of a line.
        dash: u8,
    },
    /// Words in the panel, as near to a point as they have room.
    Note {
        /// Point.
        x: f64,
        /// Point.
        y: f64,
        /// Words.
        text: String,
    },
}

impl Mark {
    /// Joined points.
    pub fn line(path: Path, dash: u8) -> Self {
        Self::Line { path, dash, marker: None }
    }

    /// Joined points, marked; where they are many, only some of them.
    pub fn dotted(path: Path, marker: Marker) -> Self {
        Self::Line { path, dash: 0, marker: Some(marker) }
    }

    /// Those of the `i`-th of some series beside each other.
    pub fn series(i: usize, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (colour, marker) = series(i);
        Self::dotted(Path::new(name, colour, points), marker)
    }

    /// A dotted line at y = 0.
    pub fn zero() -> Self {
        Self::Rule { along: Along::X, at: 0.0, name: String::new(), colour: 4, dash: 2 }
    }

    /// Points.
    pub fn points(path: Path, marker: Marker) -> Self {
        Self::Points { path, marker, error: Vec::new(), rows: Vec::new(), notes: Vec::new() }
    }

    /// Whether it shows nothing.
    pub fn is_empty(&self) -> bool {
        match self {
            // One point alone is no line.
            Self::Line { path, marker: None, .. } => {
                !(1..path.len()).any(|i| path.is_point(i - 1) && path.is_point(i))
            }
            Self::Line { path, .. } | Self::Points { path, .. } | Self::Bars { path, .. } => {
                !(0..path.len()).any(|i| path.is_point(i))
            }
            Self::Area { path, .. } => path.x.len() < 3,
            Self::Cells(c) => !c.z.iter().any(|z| z.is_finite()),
            Self::Rule { at, .. } => !at.is_finite(),
            Self::Note { text, .. } => text.is_empty(),
        }
    }

    /// Points that the axes must hold. Rules and notes ask for nothing.
    pub fn reach(&self) -> Vec<(f64, f64)> {
        let pairs = |x: &[f64], y: &[f64]| x.iter().copied().zip(y.iter().copied()).collect::<Vec<_>>();
        match self {
            Self::Points { path, error, .. } if !error.is_empty() => {
                let ends = pairs(&path.x, &path.y).into_iter().zip(error);
                ends.flat_map(
                    |((x, y), e)| if e.is_finite() { [(x, y - e), (x, y + e)] } else { [(x, y); 2] },
                )
                .collect()
            }
            Self::Line { path, .. } | Self::Points { path, .. } | Self::Area { path, .. } => {
                pairs(&path.x, &path.y)
            }
            Self::Bars { path, .. } => {
                let mut ends = pairs(&path.x, &path.y);
                ends.extend(path.y.iter().map(|y| (0.0, *y)));
                ends
            }
            Self::Cells(c) => pairs(&[c.x[0], c.x[c.x.len() - 1]], &[c.y[0], c.y[c.y.len() - 1]]),
            Self::Rule { .. } | Self::Note { .. } => Vec::new(),
        }
    }
}
