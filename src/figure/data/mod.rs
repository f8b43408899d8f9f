//! Data of a figure, independent of paper and pixels; the page receives it as JSON.

mod mark;

use serde::Serialize;

pub use mark::{Along, Cells, Mark, Marker, NO_VALUE, Path};

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

    pub fn over(mut self, ends: [f64; 2]) -> Self {
        self.ends = Some(ends);
        self
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
