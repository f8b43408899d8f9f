//! A figure of one or more panels with logarithmic axes, as SVG and as PNG.
//!
//! Coordinates are given to the plotting crate as decades, log₁₀ of the values: its own logarithmic axes have no ticks below 1e-10,
//! where the errors of f64 lie.

use std::sync::Arc;

use kuva::backend::{png::PngBackend, svg::SvgBackend};
use kuva::plot::scatter::MarkerShape;
use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::figure::Figure;
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;

use crate::error::Error;

/// Colours that are told apart by most people (Okabe and Ito 2008), dark on white.
pub const COLOURS: [&str; 8] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#E69F00", "#7F7F7F"];

/// Shape of a series' points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// ●
    Circle,
    /// ■
    Square,
    /// ▲
    Triangle,
    /// ◆
    Diamond,
    /// No points, only the line.
    None,
}

/// Points that belong together.
#[derive(Debug, Clone)]
pub struct Series {
    /// In the legend; none repeats another series.
    pub name: Option<String>,
    /// As in CSS.
    pub colour: &'static str,
    /// Of the points.
    pub marker: Marker,
    /// Joined by a line.
    pub line: bool,
    /// The line is dashed.
    pub dashed: bool,
    /// Values; those that have no logarithm are left out.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Over it.
    pub title: String,
    /// Quantity and unit along x.
    pub x: &'static str,
    /// Quantity and unit along y.
    pub y: &'static str,
    /// What it shows.
    pub series: Vec<Series>,
}

/// Panels in rows, with one legend for all.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Over all.
    pub title: String,
    /// Panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
    /// Pixels of a panel: width, height.
    pub size: (f64, f64),
    /// All panels have the same axes.
    pub shared: bool,
}

/// SVG and PNG of `sheet`; none where there is nothing to show.
///
/// # Errors
/// A picture that cannot be made.
pub fn render(sheet: &Sheet) -> Result<Option<(String, Vec<u8>)>, Error> {
    let panels: Vec<Panel> = sheet.panels.iter().map(in_decades).collect();
    if panels.iter().all(|p| p.series.iter().all(|s| s.points.is_empty())) {
        return Ok(None);
    }
    let whole = extent(panels.iter().flat_map(|p| &p.series));
    let mut layouts = Vec::new();
    let mut plots = Vec::new();
    for panel in &panels {
        let [x, y] = if sheet.shared { whole } else { extent(panel.series.iter()) };
        layouts.push(
            Layout::new(x, y)
                .with_title(panel.title.clone())
                .with_title_size(15)
                .with_label_size(14)
                .with_tick_size(12)
                .with_x_label(panel.x)
                .with_y_label(panel.y)
                .with_x_axis_min(x.0)
                .with_x_axis_max(x.1)
                .with_y_axis_min(y.0)
                .with_y_axis_max(y.1)
                .with_x_tick_step(step(x))
                .with_y_tick_step(step(y))
                .with_tick_format(TickFormat::Custom(Arc::new(decade))),
        );
        plots.push(panel.series.iter().flat_map(plots_of).collect());
    }
    let rows = panels.len().div_ceil(sheet.columns);
    let scene = Figure::new(rows, sheet.columns)
        .with_title(sheet.title.clone())
        .with_title_size(17)
        .with_plots(plots)
        .with_layouts(layouts)
        .with_cell_size(sheet.size.0, sheet.size.1)
        .with_shared_legend()
        .render();
    let png = PngBackend::new().with_scale(1.5).render_scene(&scene).map_err(Error::Run)?;
    Ok(Some((SvgBackend::new().render_scene(&scene), png)))
}

/// The panel with log₁₀ of all values.
fn in_decades(panel: &Panel) -> Panel {
    let mut panel = panel.clone();
    for s in &mut panel.series {
        s.points = s.points.iter().map(|(x, y)| (x.log10(), y.log10())).collect();
        s.points.retain(|(x, y)| x.is_finite() && y.is_finite());
    }
    panel
}

/// Whole decades that hold all points, in x and in y.
fn extent<'a>(series: impl Iterator<Item = &'a Series>) -> [(f64, f64); 2] {
    let mut found = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    for (x, y) in series.flat_map(|s| &s.points) {
        for ((least, most), v) in found.iter_mut().zip([x, y]) {
            (*least, *most) = (least.min(*v), most.max(*v));
        }
    }
    found.map(|(least, most)| match least <= most {
        true => ((least - 0.05).floor(), (most + 0.05).ceil()),
        false => (0.0, 1.0),
    })
}

/// Decades from tick to tick: at most eight ticks.
fn step((from, to): (f64, f64)) -> f64 {
    ((to - from) / 8.0).ceil().max(1.0)
}

/// 10ⁿ.
fn decade(n: f64) -> String {
    let n = n.round() as i64;
    let digits = n.to_string();
    let raised = digits.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    });
    match n {
        0 => "1".into(),
        1 => "10".into(),
        _ => format!("10{}", raised.collect::<String>()),
    }
}

fn plots_of(s: &Series) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    let mut name = s.name.clone();
    if s.line {
        let line =
            LinePlot::new().with_data(s.points.iter().copied()).with_color(s.colour).with_stroke_width(1.6);
        let line = if s.dashed { line.with_dashed() } else { line };
        // The legend shows the points where there are some.
        plots.push(match (s.marker, name.take_if(|_| s.marker == Marker::None)) {
            (Marker::None, Some(name)) => line.with_legend(name).into(),
            _ => line.into(),
        });
    }
    let shape = match s.marker {
        Marker::Circle => MarkerShape::Circle,
        Marker::Square => MarkerShape::Square,
        Marker::Triangle => MarkerShape::Triangle,
        Marker::Diamond => MarkerShape::Diamond,
        Marker::None => return plots,
    };
    let dots = ScatterPlot::new()
        .with_data(s.points.iter().copied())
        .with_color(s.colour)
        .with_size(4.5)
        .with_marker(shape);
    plots.push(match name {
        Some(name) => dots.with_legend(name).into(),
        None => dots.into(),
    });
    plots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_powers_of_ten() {
        let labels: Vec<_> = [-12.0, -1.0, 0.0, 1.0, 2.0, 30.0].into_iter().map(decade).collect();
        assert_eq!(labels, ["10⁻¹²", "10⁻¹", "1", "10", "10²", "10³⁰"]);
    }

    #[test]
    fn a_figure_without_points_is_none() {
        let series = Series {
            name: None,
            colour: COLOURS[0],
            marker: Marker::Circle,
            line: true,
            dashed: false,
            points: vec![(0.0, 1.0), (f64::NAN, 2.0)],
        };
        let panel = Panel { title: "t".into(), x: "x", y: "y", series: vec![series] };
        let sheet =
            Sheet { title: "T".into(), panels: vec![panel], columns: 1, size: (300.0, 200.0), shared: true };
        assert!(render(&sheet).unwrap().is_none());
    }
}
