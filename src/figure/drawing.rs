//! A drawing ready to be written: paths and texts in points (1/72 inch), y downwards.

use super::scale::Rgb;

/// Points of a millimetre.
pub const MM: f64 = 72.0 / 25.4;

/// Items, later ones on top.
#[derive(Debug, Clone, Default)]
pub struct Drawing {
    /// Width and height, pt.
    pub size: [f64; 2],
    pub items: Vec<Item>,
}

#[derive(Debug, Clone)]
pub enum Item {
    /// Lines and areas.
    Path {
        steps: Vec<Step>,
        /// Colour of the inside.
        fill: Option<Rgb>,
        /// Colour, width and dashes of the line.
        stroke: Option<Stroke>,
        /// From 0 to 1.
        opacity: f64,
        clip: Option<Rect>,
    },
    /// A line of text, black.
    Text {
        /// Position of the anchor on the baseline.
        at: [f64; 2],
        text: String,
        /// Size, pt.
        size: f64,
        /// Part of the text at `at`.
        anchor: Anchor,
        /// True if the text reads upwards.
        upwards: bool,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub colour: Rgb,
    /// Width, pt.
    pub width: f64,
    /// Lengths drawn and left out, pt; 0 for a solid line.
    pub dash: [f64; 2],
}

impl Stroke {
    pub fn solid(colour: Rgb, width: f64) -> Self {
        Self { colour, width, dash: [0.0; 2] }
    }

    /// `dash` 0: solid, 1: dashed, 2: dotted.
    pub fn of(colour: Rgb, width: f64, dash: u8) -> Self {
        let dash = [[0.0; 2], [4.0, 2.5], [1.2, 1.8]][usize::from(dash.min(2))];
        Self { colour, width, dash: dash.map(|long| long * width) }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    To([f64; 2]),
    Line([f64; 2]),
    /// Cubic curve: two control points and the end.
    Curve([[f64; 2]; 3]),
    Close,
}

vibrissa_core::words! {
    Anchor {
        Start = "start",
        Middle = "middle",
        End = "end",
    }
}

impl Anchor {
    /// Share of the text before the anchor.
    pub fn share(self) -> f64 {
        0.5 * f64::from(self as u8)
    }
}

/// Left and upper end, width and height, pt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub x: f64,
    pub y: f64,
    pub w: f64,
    pub h: f64,
}

impl Rect {
    pub fn steps(self) -> Vec<Step> {
        let Self { x, y, w, h } = self;
        closed(&[[x, y], [x + w, y], [x + w, y + h], [x, y + h]])
    }
}

pub fn closed(points: &[[f64; 2]]) -> Vec<Step> {
    let mut steps = open(points);
    steps.push(Step::Close);
    steps
}

/// A path through `points`, interrupted at NaN.
pub fn open(points: &[[f64; 2]]) -> Vec<Step> {
    let mut steps = Vec::with_capacity(points.len());
    let mut begun = false;
    for p in points {
        let usable = p.iter().all(|x| x.is_finite());
        if usable {
            steps.push(if begun { Step::Line(*p) } else { Step::To(*p) });
        }
        begun = usable;
    }
    steps
}

/// A circle of radius `r` about `c`.
pub fn circle([x, y]: [f64; 2], r: f64) -> Vec<Step> {
    // Four cubics, off by 2.7e-4 of the radius.
    let k = 0.552_284_75 * r;
    vec![
        Step::To([x + r, y]),
        Step::Curve([[x + r, y + k], [x + k, y + r], [x, y + r]]),
        Step::Curve([[x - k, y + r], [x - r, y + k], [x - r, y]]),
        Step::Curve([[x - r, y - k], [x - k, y - r], [x, y - r]]),
        Step::Curve([[x + k, y - r], [x + r, y - k], [x + r, y]]),
        Step::Close,
    ]
}

impl Drawing {
    pub fn fill(&mut self, steps: Vec<Step>, fill: Rgb, opacity: f64, clip: Option<Rect>) {
        self.path(steps, Some(fill), None, opacity, clip);
    }

    pub fn stroke(&mut self, steps: Vec<Step>, stroke: Stroke, clip: Option<Rect>) {
        self.path(steps, None, Some(stroke), 1.0, clip);
    }

    pub fn path(
        &mut self,
        steps: Vec<Step>,
        fill: Option<Rgb>,
        stroke: Option<Stroke>,
        opacity: f64,
        clip: Option<Rect>,
    ) {
        if !steps.is_empty() {
            self.items.push(Item::Path { steps, fill, stroke, opacity, clip });
        }
    }

    pub fn text(&mut self, at: [f64; 2], text: impl Into<String>, size: f64, anchor: Anchor, upwards: bool) {
        let text = text.into();
        if !text.is_empty() {
            self.items.push(Item::Text { at, text, size, anchor, upwards });
        }
    }
}
