//! Data of a figure, its panels and their marks, independent of paper and pixels; the page receives it as JSON.

use serde::Serialize;

use crate::figure::series;

/// Panels under one title.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// File name without ending.
    pub name: String,
    pub title: String,
    /// Description: content, source table, omissions.
    pub caption: String,
    pub panels: Vec<Panel>,
    pub columns: usize,
    /// Drawn instead of panels.
    pub parallel: Option<Parallel>,
}

impl Figure {
    /// A figure with at most three panels in a row.
    pub fn new(name: &str, title: &str, caption: impl Into<String>, panels: Vec<Panel>) -> Self {
        let columns = match panels.len() {
            0 | 1 => 1,
            2 | 4 => 2,
            _ => 3,
        };
        let caption = caption.into();
        Self { name: name.into(), title: title.into(), caption, panels, columns, parallel: None }
    }

    /// True if nothing would be drawn.
    pub fn is_empty(&self) -> bool {
        self.parallel.as_ref().is_none_or(|p| p.values.is_empty())
            && self.panels.iter().all(|p| p.marks.iter().all(Mark::is_empty))
    }
}

/// A pair of axes with marks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// True for equal units in x and y.
    pub to_scale: bool,
    pub marks: Vec<Mark>,
    /// Text in the key about points beyond the y axis; may be empty.
    pub beyond: String,
}

impl Panel {
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, to_scale: false, marks: Vec::new(), beyond: String::new() }
    }

    pub fn map(&self) -> Option<&Cells> {
        self.marks.iter().find_map(|m| if let Mark::Cells(c) = m { Some(c) } else { None })
    }

    /// Adds `mark` unless it is empty.
    pub fn with(mut self, mark: Mark) -> Self {
        if !mark.is_empty() {
            self.marks.push(mark);
        }
        self
    }
}

/// A quantity along an axis.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Axis {
    /// Name and symbol.
    pub label: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    pub log: bool,
    /// Names of the places 0, 1, … for an axis without numbers, or with few values.
    pub words: Vec<String>,
    /// Ends of the axis, if not those of the data.
    pub ends: Option<[f64; 2]>,
}

impl Axis {
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), ..Self::default() }
    }

    pub fn log(label: &str, unit: &str) -> Self {
        Self { log: true, ..Self::new(label, unit) }
    }

    pub fn words(label: &str, words: Vec<String>) -> Self {
        Self { words, ..Self::new(label, "") }
    }

    pub fn text(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} ({})", self.label, self.unit) }
    }
}

/// Parallel coordinates: a line for each row across all axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parallel {
    /// Axes from left to right.
    pub axes: Vec<Axis>,
    /// One row per line, with a value for each axis.
    pub values: Vec<Vec<f64>>,
    /// Index of the axis that gives the colour.
    pub colour: usize,
    pub muted: Vec<bool>,
    /// Reason for grey, in the key.
    pub why: String,
}

vibrissa_core::words! {
    /// The first [`Marker::SERIES`] are those of series, in order.
    #[derive(Hash, Serialize)]
    Marker {
        /// ●
        Circle = "circle",
        /// ■
        Square = "square",
        /// ▲
        Triangle = "triangle",
        /// ◆
        Diamond = "diamond",
        /// ▼
        Down = "down",
        /// ★
        Star = "star",
        /// +
        Plus = "plus",
        /// ⧗
        Hourglass = "hourglass",
        /// ×, for points that do not count
        Cross = "cross",
        /// ○, for the chosen point
        Ring = "ring",
        /// ↑, at the edge for a point beyond the axis
        Arrow = "arrow",
    }
}

impl Marker {
    pub const SERIES: usize = 8;
}

/// Points in the order of a table. NaN is a gap.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Path {
    /// Name in the key; equal names are one entry.
    pub name: String,
    /// Number of its colour in `look.toml`.
    pub colour: usize,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
}

impl Path {
    /// From points (x, y).
    pub fn new(name: impl Into<String>, colour: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (x, y) = points.into_iter().unzip();
        Self { name: name.into(), colour, x, y }
    }

    /// Whether each place has a point.
    fn points(&self) -> impl Iterator<Item = bool> {
        self.x.iter().zip(&self.y).map(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// A line across a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// At a fixed y.
    X,
    /// At a fixed x.
    Y,
}

/// Values on a grid of cells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cells {
    /// Edges of the cells across.
    pub x: Vec<f64>,
    /// Edges of the cells up.
    pub y: Vec<f64>,
    /// Values row by row from the first y; NaN is empty.
    pub z: Vec<f64>,
    /// Quantity of z.
    pub of: Axis,
}

/// Name of empty cells in the key.
pub const NO_VALUE: &str = "empty: no value";

#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Mark {
    Line {
        #[serde(flatten)]
        path: Path,
        /// 0: solid, 1: dashed, 2: dotted.
        dash: u8,
        /// Marker on points of the line.
        marker: Option<Marker>,
    },
    /// Points alone.
    Points {
        #[serde(flatten)]
        path: Path,
        marker: Marker,
        /// Half length of a bar in y; empty for no bars.
        error: Vec<f64>,
        /// Rows of the page's table; empty for none.
        rows: Vec<usize>,
        notes: Vec<String>,
    },
    /// Horizontal bars from 0, at the positions of words up.
    Bars {
        /// Lengths and positions.
        #[serde(flatten)]
        path: Path,
        /// Index of the series, and number of series at a position.
        among: [usize; 2],
    },
    /// A closed, filled area.
    Area {
        #[serde(flatten)]
        path: Path,
        outlined: bool,
    },
    Cells(Cells),
    Rule {
        along: Along,
        at: f64,
        /// Name in the key.
        name: String,
        colour: usize,
        /// 0: solid, 1: dashed, 2: dotted.
        dash: u8,
    },
    /// Text near a point, where there is room.
    Note {
        x: f64,
        y: f64,
        text: String,
    },
}

impl Mark {
    /// A line without markers.
    pub fn line(path: Path, dash: u8) -> Self {
        Self::Line { path, dash, marker: None }
    }

    /// A line with markers; with many points, only some are marked.
    pub fn dotted(path: Path, marker: Marker) -> Self {
        Self::Line { path, dash: 0, marker: Some(marker) }
    }

    /// A marked line with the look of series `i`.
    pub fn series(i: usize, name: impl Into<String>, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (colour, marker) = series(i);
        Self::dotted(Path::new(name, colour, points), marker)
    }

    /// A line across the panel.
    pub fn rule(along: Along, at: f64, name: &str, (colour, dash): (usize, u8)) -> Self {
        Self::Rule { along, at, name: name.to_owned(), colour, dash }
    }

    /// A dotted line at y = 0.
    pub fn zero() -> Self {
        Self::rule(Along::X, 0.0, "", (4, 2))
    }

    /// Points without bars, rows and notes.
    pub fn points(path: Path, marker: Marker) -> Self {
        Self::barred(path, marker, Vec::new())
    }

    /// Points with bars of half length `error`, without rows and notes.
    pub fn barred(path: Path, marker: Marker, error: Vec<f64>) -> Self {
        Self::Points { path, marker, error, rows: Vec::new(), notes: Vec::new() }
    }

    /// True if nothing would be drawn.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Line { path, marker: None, .. } => {
                !path.points().zip(path.points().skip(1)).any(|(a, b)| a && b)
            }
            Self::Line { path, .. } | Self::Points { path, .. } | Self::Bars { path, .. } => {
                !path.points().any(|there| there)
            }
            Self::Area { path, .. } => path.x.len() < 3,
            Self::Cells(c) => !c.z.iter().any(|z| z.is_finite()),
            Self::Rule { at, .. } => !at.is_finite(),
            Self::Note { text, .. } => text.is_empty(),
        }
    }

    /// Points that must fit the axes; none for rules and notes.
    pub fn reach(&self) -> Vec<(f64, f64)> {
        let pairs = |x: &[f64], y: &[f64]| x.iter().copied().zip(y.iter().copied()).collect::<Vec<_>>();
        match self {
            Self::Points { path, error, .. } if !error.is_empty() => {
                let half = error.iter().map(|e| if e.is_finite() { *e } else { 0.0 });
                let points = path.x.iter().zip(&path.y).zip(half);
                points.flat_map(|((x, y), e)| [(*x, y - e), (*x, y + e)]).collect()
            }
            Self::Line { path, .. } | Self::Points { path, .. } | Self::Area { path, .. } => {
                pairs(&path.x, &path.y)
            }
            Self::Bars { path, .. } => {
                pairs(&path.x, &path.y).into_iter().chain(path.y.iter().map(|y| (0.0, *y))).collect()
            }
            Self::Cells(c) => pairs(&[c.x[0], c.x[c.x.len() - 1]], &[c.y[0], c.y[c.y.len() - 1]]),
            Self::Rule { .. } | Self::Note { .. } => Vec::new(),
        }
    }
}
