//! Figures as they lie on paper: words whole, apart and off the curves, ticks, bands, panels to scale.

use vibrissa::figure::drawing::{Anchor, Drawing, Item, Rect, Step};
use vibrissa::figure::font::{Font, length, lines, outline};
use vibrissa::figure::sheet::lay;
use vibrissa::figure::{Along, Axis, Cells, Figure, Mark, Marker, Panel, Path, Scale, Style};

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
    let drawn = |panel: Panel| lay(&Figure::new("f", "F", "", vec![panel]), &Style::default()).items;
    let axes = || Panel::new("", Axis::new("x", ""), Axis::new("y", ""));
    let fills = |z: Vec<f64>| -> Vec<[u8; 3]> {
        let items = drawn(axes().with(Mark::Cells(cells(z)))).into_iter();
        items
            .filter_map(|item| if let Item::Path { fill, clip: Some(_), .. } = item { fill } else { None })
            .collect()
    };
    let colours = |z: Vec<f64>| fills(z).into_iter().collect::<std::collections::HashSet<_>>();
    // Colours of the map and of its scale; values that differ in the last digit share one.
    for third in [3.0, 3000.0] {
        let z = vec![1.0, 2.0, third, 2.0, 2.0 * (1.0 + f64::EPSILON), f64::NAN, 1.0];
        assert_eq!(colours(z).len(), 3);
    }
    assert_eq!(colours(vec![5.0; 4]).len(), 1);
    let many: Vec<f64> = (0..20).map(f64::from).collect();
    assert!(colours(many.clone()).len() > 20);
    // A scale grows lighter throughout; eight lines have eight colours.
    let light = |c: [u8; 3]| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
    assert!(fills(many)[..20].windows(2).all(|w| light(w[0]) < light(w[1])));
    let line = |i: usize| Mark::line(Path::new("", i, [(0.0, 0.0), (1.0, 1.0 + i as f64)]), 0);
    let items = drawn((0..8).fold(axes(), |panel, i| panel.with(line(i)))).into_iter();
    let strokes = items.filter_map(|item| match item {
        Item::Path { stroke, clip: Some(_), .. } => stroke.map(|stroke| stroke.colour),
        _ => None,
    });
    assert_eq!(strokes.collect::<std::collections::HashSet<_>>().len(), 8);
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
        let Some(Item::Path { steps, clip: Some(Rect { x, y, w, h }), .. }) =
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

/// Titles are the texts with letters: each is whole, on the paper, and over no other, whatever the width and the number of panels.
#[test]
fn titles_of_maps_are_whole_and_apart() {
    let of = Axis::log("total error, rms", "mm");
    let cells = Cells { x: vec![1.0, 2.0, 3.0], y: vec![1.0, 2.0], z: vec![1e-5, f64::NAN], of };
    let axes = [Axis::new("gauge place x_ss", "mm"), Axis::new("base diameter D", "mm")];
    let panel = Panel::new("", axes[0].clone(), axes[1].clone()).with(Mark::Cells(cells));
    let styles = [(88.0, 8.0), (60.0, 12.0), (40.0, 8.0), (180.0, 6.0)];
    for ((width, size), n) in styles.into_iter().flat_map(|style| [1, 2, 3, 6].map(|n| (style, n))) {
        let style = Style { width, size, font: Font::built_in() };
        let d = lay(&Figure::new("map", "Map", "", vec![panel.clone(); n]), &style);
        let face = style.font.face();
        let place = |item: &Item| {
            let Item::Text { at: [x, y], text, size, anchor, upwards, .. } = item else { return None };
            let (long, before) = (length(&face, text) * size, anchor.share());
            let along = |at: f64, before: f64| [at - before * long, at + (1.0 - before) * long];
            let across = |at: f64| [at - 0.8 * size, at + 0.25 * size];
            let ends = if *upwards {
                [across(*x), along(*y, 1.0 - before)]
            } else {
                [along(*x, before), across(*y)]
            };
            Some((text.clone(), ends))
        };
        let all: Vec<_> = d.items.iter().filter_map(place).collect();
        let titles: Vec<_> = all.iter().filter(|(t, _)| t.chars().any(char::is_alphabetic)).collect();
        for (i, (text, a)) in titles.iter().enumerate() {
            assert!((0..2).all(|k| a[k][0] >= -0.5 && a[k][1] <= d.size[k] + 0.5), "{text:?} at {a:?}");
            let over = |b: &[[f64; 2]; 2]| (0..2).all(|k| a[k][1] > b[k][0] && a[k][0] < b[k][1]);
            let other = titles[i + 1..].iter().find(|(_, b)| over(b));
            assert!(other.is_none(), "{text:?} and {other:?} at {width} mm, {size} pt, {n} panels");
        }
        let words = all.iter().map(|(t, _)| t.as_str()).collect::<Vec<_>>().join(" ");
        for title in ["gauge place x_ss (mm)", "base diameter D (mm)", "total error, rms (mm)"] {
            assert!(words.matches(title).count() >= n, "{title} in {words}");
        }
    }
    // A value stays with its symbol and unit; an outline ends where its text is anchored.
    let font = Font::built_in();
    let broken = lines(&font.face(), "D = 8 mm, x_ss ≈ 7.5 mm or 1 of 3", 0.1);
    assert_eq!(broken, ["D = 8 mm,", "x_ss ≈ 7.5 mm", "or", "1", "of", "3"]);
    let steps = outline(&font.face(), "HHHH", [100.0, 50.0], 10.0, Anchor::End, false);
    assert!(steps.iter().all(|s| !matches!(s, Step::To(p) | Step::Line(p) if p[0] > 100.0)), "{steps:?}");
}

#[test]
fn ticks_are_round_and_every_axis_has_some() {
    let words =
        |ends, log, n| Scale { ends, log }.ticks(n).0.into_iter().map(|t| t.1).collect::<Vec<_>>().join(" ");
    assert_eq!(words([0.0, 10.4], false, 5), "0 2 4 6 8 10");
    assert_eq!(words([-1.6e-4, 6e-5], false, 5), "−1.5·10⁻⁴ −10⁻⁴ −5·10⁻⁵ 0 5·10⁻⁵");
    assert_eq!(words([0.9, 1.1], false, 5), "0.90 0.95 1.00 1.05 1.10");
    assert_eq!(words([3e-7, 0.2], true, 5), "10⁻⁶ 10⁻⁵ 10⁻⁴ 10⁻³ 10⁻² 10⁻¹");
    assert_eq!([words([0.4, 12.0], true, 5), words([0.4, 6.0], true, 5)], ["1 10", "0.5 1 2 5"]);
    assert_eq!(words([-35.0, 35.0], false, 3), "−20 0 20");
    // Nothing, one value, the largest numbers.
    let far: [&[f64]; 6] =
        [&[], &[0.0], &[1.0, 1.0 + 1e-13], &[f64::MAX], &[5e-324, 1.0], &[-f64::MAX, f64::MAX]];
    for (axis, values) in [Axis::new("x", ""), Axis::log("x", "")].iter().flat_map(|a| far.map(|v| (a, v))) {
        for scale in [Scale::of, Scale::tight].map(|of| of(axis, values.iter().copied())) {
            let ([low, high], (named, small)) = (scale.ends, scale.ticks(5));
            assert!(
                low.is_finite() && high.is_finite() && low < high && (!axis.log || low > 0.0),
                "{scale:?}"
            );
            assert!(
                named.len() < 100 && small.len() < 10_000 && scale.share(0.5 * low + 0.5 * high).is_finite()
            );
        }
    }
}
