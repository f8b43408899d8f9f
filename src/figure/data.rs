//! What a figure shows: numbers of a table, and how they are to be seen. Nothing here knows paper or pixels; the page gets it as JSON.

use serde::Serialize;

/// Panels under one title.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Of its files, without ending.
    pub name: String,
    /// In a few words.
    pub title: String,
    /// What is seen, of which table, and what was left out.
    pub caption: String,
    /// Row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
    /// In the place of panels.
    pub parallel: Option<Parallel>,
}

impl Figure {
    /// Panels, at most three in a row.
    pub fn new(name: &str, title: &str, caption: impl Into<String>, panels: Vec<Panel>) -> Self {
        let columns = match panels.len() {
            0 | 1 => 1,
            2 | 4 => 2,
            _ => 3,
        };
        let caption = caption.into();
        Self { name: name.into(), title: title.into(), caption, panels, columns, parallel: None }
    }

    /// Whether there is nothing to see.
    pub fn is_empty(&self) -> bool {
        self.parallel.as_ref().is_none_or(|p| p.values.is_empty())
            && self.panels.iter().all(|p| p.marks.iter().all(Mark::is_empty))
    }
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Over it; empty where the figure's says all.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Up.
    pub y: Axis,
    /// A length is as long in x as in y.
    pub to_scale: bool,
    /// In the order in which they are drawn.
    pub marks: Vec<Mark>,
}

impl Panel {
    /// Without marks.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, to_scale: false, marks: Vec::new() }
    }

    /// With one more mark, if it shows anything.
    pub fn with(mut self, mark: Mark) -> Self {
        if !mark.is_empty() {
            self.marks.push(mark);
        }
        self
    }
}

/// A quantity along an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// Name and symbol.
    pub label: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// By decades.
    pub log: bool,
    /// Names of the places 0, 1, … where it is no quantity.
    pub words: Vec<String>,
    /// Ends, where the data do not give them.
    pub ends: Option<[f64; 2]>,
}

impl Axis {
    /// Linear.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), log: false, words: Vec::new(), ends: None }
    }

    /// Of decades.
    pub fn log(label: &str, unit: &str) -> Self {
        Self { log: true, ..Self::new(label, unit) }
    }

    /// Of words.
    pub fn words(label: &str, words: Vec<String>) -> Self {
        Self { words, ..Self::new(label, "") }
    }

    /// From here to there.
    pub fn over(mut self, ends: [f64; 2]) -> Self {
        self.ends = Some(ends);
        self
    }

    /// Label and unit as they stand at the axis.
    pub fn text(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} ({})", self.label, self.unit) }
    }
}

/// Shape of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
    /// ×
    Cross,
    /// ○, ringed
    Ring,
}

/// Points in the order of a table. NaN is a gap.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Path {
    /// In the key; the same name twice is one entry.
    pub name: String,
    /// Place in [`COLOURS`](super::COLOURS).
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
    /// Words in the panel, beside a point.
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

    /// Joined points, each marked.
    pub fn dotted(path: Path, marker: Marker) -> Self {
        Self::Line { path, dash: 0, marker: Some(marker) }
    }

    /// Points.
    pub fn points(path: Path, marker: Marker) -> Self {
        Self::Points { path, marker, error: Vec::new(), rows: Vec::new(), notes: Vec::new() }
    }

    /// Whether it shows nothing.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Line { path, .. } | Self::Points { path, .. } | Self::Bars { path, .. } => {
                !path.x.iter().zip(&path.y).any(|(x, y)| x.is_finite() && y.is_finite())
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

/// Parallel coordinates: a line for each row across all axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parallel {
    /// Side by side.
    pub axes: Vec<Axis>,
    /// A row each, one value for each axis.
    pub values: Vec<Vec<f64>>,
    /// Axis that gives the colour.
    pub colour: usize,
    /// Rows that break a limit.
    pub muted: Vec<bool>,
}
