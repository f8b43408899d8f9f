//! Figures on paper: labels off the curves, bands, panels to scale.

use vibrissa::figure::drawing::{Drawing, Item, Step};
use vibrissa::figure::font::{Font, length};
use vibrissa::figure::sheet::lay;
use vibrissa::figure::{Along, Axis, Cells, Figure, Mark, Marker, Panel, Path, Style};

/// Points on the data lines, four per typographic point.
fn on_lines(d: &Drawing) -> Vec<[f64; 2]> {
    let mut all = Vec::new();
    for item in &d.items {
        let Item::Path { steps, stroke: Some(_), clip: Some(_), .. } = item else { continue };
        let mut last = [f64::NAN; 2];
        for step in steps {
            let next = match step {
                Step::To(p) | Step::Line(p) => *p,
                _ => continue,
            };
            let long = (next[0] - last[0]).hypot(next[1] - last[1]);
            if matches!(step, Step::Line(_)) {
                let n = (4.0 * long).ceil();
                all.extend(
                    (0..=n as usize).map(|i| [0, 1].map(|k| last[k] + (next[k] - last[k]) * i as f64 / n)),
                );
            }
            last = next;
        }
    }
    all
}

#[test]
fn words_lie_on_no_curve() {
    let mut written = 0;
    for case in 0..40 {
        let wave =
            |i: usize, x: f64| (x * (0.2 + 0.04 * case as f64) + 2.0 * i as f64).sin() + 0.4 * i as f64;
        let curve = |i: usize| (0..200).map(move |k| f64::from(k) / 20.0).map(move |x| (x, wave(i, x)));
        let x = 0.25 * f64::from(case);
        let mut panel = Panel::new("", Axis::new("x", ""), Axis::new("y", "")).with(Mark::Rule {
            along: Along::Y,
            at: x,
            name: String::new(),
            colour: 7,
            dash: 2,
        });
        for i in 0..3 {
            panel = panel
                .with(Mark::line(Path::new(i.to_string(), i, curve(i)), 0))
                .with(Mark::points(Path::new("", 4, [(x, wave(i, x))]), Marker::Ring))
                .with(Mark::Note { x, y: wave(i, x), text: format!("θ = {x}° of {i}") });
        }
        for (width, size, n) in [(88.0, 8.0, 1), (60.0, 12.0, 1), (88.0, 8.0, 4)] {
            let style = Style { width, size, font: Font::built_in() };
            let d = lay(&Figure::new("f", "F", "", vec![panel.clone(); n]), &style);
            let lines = on_lines(&d);
            assert!(lines.len() > 1000);
            for item in &d.items {
                let Item::Text { at: [x, y], text, size, .. } = item else { continue };
                if text.starts_with('θ') {
                    let long = length(&style.font.face(), text) * size;
                    let under = |p: &&[f64; 2]| {
                        (*x..*x + long).contains(&p[0]) && (y - 0.8 * size..y + 0.2 * size).contains(&p[1])
                    };
                    assert_eq!(lines.iter().find(under), None, "{text} at {x} {y}, {width} mm, case {case}");
                    written += 1;
                }
            }
        }
    }
    // Nearly all of the 40 × 3 × 6 labels have room.
    assert!(written > 600, "{written}");
}

#[test]
fn a_map_of_three_values_has_three_colours() {
    let cells = |z: Vec<f64>| Cells {
        x: (0..=z.len()).map(|i| i as f64).collect(),
        y: vec![0.0, 1.0],
        z,
        of: Axis::new("v", ""),
    };
    let colours = |z: Vec<f64>| {
        let panel = Panel::new("", Axis::new("x", ""), Axis::new("y", "")).with(Mark::Cells(cells(z)));
        let d = lay(&Figure::new("f", "F", "", vec![panel]), &Style::default());
        let fills = d.items.into_iter().filter_map(|item| match item {
            Item::Path { fill, clip: Some(_), .. } => fill,
            _ => None,
        });
        fills.collect::<std::collections::HashSet<_>>()
    };
    // Colours of the map and of its scale; values that differ in the last digit share one.
    for third in [3.0, 3000.0] {
        let z = vec![1.0, 2.0, third, 2.0, 2.0 * (1.0 + f64::EPSILON), f64::NAN, 1.0];
        assert_eq!(colours(z).len(), 3);
    }
    assert_eq!(colours(vec![5.0; 4]).len(), 1);
    assert!(colours((0..20).map(f64::from).collect()).len() > 20);
}

#[test]
fn a_panel_to_scale_holds_all_of_its_data() {
    for (wide, high) in [(10.0, 1.0), (1.0, 10.0), (3.0, 4.0)] {
        let corners = [(0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high)];
        let path = Path::new("box", 0, corners);
        let mut panel = Panel::new("", Axis::new("x", "mm"), Axis::new("y", "mm"))
            .with(Mark::Area { path, outlined: true });
        panel.to_scale = true;
        let d = lay(&Figure::new("f", "F", "", vec![panel]), &Style::default());
        let Some(Item::Path { steps, clip: Some([x, y, w, h]), .. }) =
            d.items.iter().find(|item| matches!(item, Item::Path { fill: Some(_), clip: Some(_), .. }))
        else {
            panic!("an area")
        };
        let at = |step: &Step| match step {
            Step::To(p) | Step::Line(p) => Some(*p),
            _ => None,
        };
        let points: Vec<[f64; 2]> = steps.iter().filter_map(at).collect();
        assert!(points.iter().all(|p| (*x..=x + w).contains(&p[0]) && (*y..=y + h).contains(&p[1])));
        let long = |k: usize, i: usize, j: usize| (points[i][k] - points[j][k]).abs();
        assert!((long(0, 0, 1) / long(1, 1, 2) - wide / high).abs() < 1e-9, "{wide} × {high}");
    }
}
