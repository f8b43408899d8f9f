//! What a figure shows: numbers of a table, and how they are to be seen. Nothing here knows paper or pixels; the page gets it as JSON.

mod mark;

use serde::Serialize;

pub use mark::{Along, Cells, Mark, Marker, NO_VALUE, Path};

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
    /// What lies beyond the ends of the axis up, in the key; empty where nothing does.
    pub beyond: String,
}

impl Panel {
    /// Without marks.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, to_scale: false, marks: Vec::new(), beyond: String::new() }
    }

    /// Its map, if it is one.
    pub fn map(&self) -> Option<&Cells> {
        self.marks.iter().find_map(|m| if let Mark::Cells(c) = m { Some(c) } else { None })
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
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Axis {
    /// Name and symbol.
    pub label: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// By decades.
    pub log: bool,
    /// Names of the places 0, 1, … where it is no quantity, or has few values.
    pub words: Vec<String>,
    /// Ends, where the data do not give them.
    pub ends: Option<[f64; 2]>,
}

impl Axis {
    /// Linear.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), ..Self::default() }
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

/// Parallel coordinates: a line for each row across all axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parallel {
    /// Side by side.
    pub axes: Vec<Axis>,
    /// A row each, one value for each axis.
    pub values: Vec<Vec<f64>>,
    /// Axis that gives the colour.
    pub colour: usize,
    /// Rows that are drawn in grey.
    pub muted: Vec<bool>,
    /// Why they are, in the key.
    pub why: String,
}
