//! Figures: colours, letters, axes, how a sheet is laid out; what reports draw; pages of one file.

use vibrissa::explore::page::script;
use vibrissa::figure::colour::{along, css, of};
use vibrissa::figure::drawing::{Anchor, Drawing, Item, Step};
use vibrissa::figure::font::{Font, length, lines, outline};
use vibrissa::figure::scale::value;
use vibrissa::figure::sheet::lay;
use vibrissa::figure::{
    Axis, Cells, Figure, MAP, MAP_DARK, Mark, Marker, NO_VALUE, Panel, Parallel, Path, Rgb, Scale, Style,
};
use vibrissa::page::{Page, html};
use vibrissa::report::bench::places::{is_software, short};
use vibrissa::report::bench::reached;
use vibrissa::report::bins::{MOST, edges, map};
use vibrissa::report::designs::Limits;
use vibrissa::report::outliers::cut;
use vibrissa::report::quantity::{said, told_apart};
use vibrissa::sink::read;

#[test]
fn the_scale_grows_lighter_throughout() {
    let light = |c: Rgb| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
    let steps: Vec<f64> = (0..=100).map(|i| light(along(f64::from(i) / 100.0))).collect();
    assert!(steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
    let dark: Vec<f64> = MAP_DARK.into_iter().map(light).collect();
    assert!(dark.windows(2).all(|w| w[1] > w[0]), "{dark:?}");
    assert_eq!((along(-1.0), along(2.0)), (MAP[0], MAP[8]));
    assert_eq!(of(9), of(1));
    assert_eq!(css(of(0)), "#0072b2");
}

#[test]
fn every_sign_that_figures_use_is_built_in() {
    let (font, signs) = (Font::built_in(), "θψεσδτρμνβφκαδ°±−×·…–→≤≥∞√⁰¹²³⁴⁵⁶⁷⁸⁹⁻â|ΔĀ");
    let face = font.face();
    let lacking: String =
        signs.chars().chain(' '..='~').filter(|c| *c != 'Ā' && face.glyph_index(*c).is_none()).collect();
    assert_eq!(lacking, "");
}

#[test]
fn a_text_is_broken_where_it_must_be() {
    let font = Font::built_in();
    let face = font.face();
    let text = "error of the distance, rms (mm)";
    assert_eq!(lines(&face, text, 1e3), [text]);
    let narrow = lines(&face, text, 8.0);
    assert!(narrow.len() > 1 && narrow.iter().all(|l| length(&face, l) <= 8.0), "{narrow:?}");
    assert_eq!(narrow.join(" "), text);
    let value = "D = 8 mm, x_ss ≈ 7.5 mm or 1 of 3";
    assert_eq!(lines(&face, value, 0.1), ["D = 8 mm,", "x_ss ≈ 7.5 mm", "or", "1", "of", "3"]);
    assert_eq!(lines(&face, "one word", 0.1), ["one", "word"]);
    assert!(lines(&face, "", 1.0).is_empty());
}

#[test]
fn a_text_is_as_long_as_its_outline() {
    let font = Font::built_in();
    let face = font.face();
    for (anchor, from) in [(Anchor::Start, 0.0), (Anchor::Middle, -0.5), (Anchor::End, -1.0)] {
        let steps = outline(&face, "HHHH", [100.0, 50.0], 10.0, anchor, false);
        let whole = 10.0 * length(&face, "HHHH");
        let xs = steps.iter().filter_map(|s| match s {
            Step::To(p) | Step::Line(p) => Some(p[0]),
            _ => None,
        });
        let (least, most) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        assert!((least - (100.0 + from * whole)).abs() < 1.2 && (most - least) < whole);
    }
}

fn words(scale: Scale, wanted: usize) -> Vec<String> {
    scale.ticks(wanted).0.into_iter().map(|(_, text)| text).collect()
}

#[test]
fn ticks_are_round_and_inside() {
    for (ends, log, expected) in [
        ([0.0, 10.4], false, &["0", "2", "4", "6", "8", "10"][..]),
        ([-1e-4, 2.1e-4], false, &["−10⁻⁴", "0", "10⁻⁴", "2·10⁻⁴"]),
        ([-1.6e-4, 6e-5], false, &["−1.5·10⁻⁴", "−10⁻⁴", "−5·10⁻⁵", "0", "5·10⁻⁵"]),
        ([0.9, 1.1], false, &["0.90", "0.95", "1.00", "1.05", "1.10"]),
        ([3e-7, 0.2], true, &["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹"]),
        ([0.4, 12.0], true, &["1", "10"]),
        ([0.4, 6.0], true, &["0.5", "1", "2", "5"]),
    ] {
        assert_eq!(words(Scale { ends, log }, 5), expected);
    }
    let values = [1.5, 0.00123456, 3.98312e-5, 12345.6].map(value);
    assert_eq!(values, ["1.5", "0.001235", "3.983·10⁻⁵", "12346"]);
    assert_eq!(words(Scale { ends: [-35.0, 35.0], log: false }, 3), ["−20", "0", "20"]);
    for scale in [Scale { ends: [1.0, 1.0 + 1e-13], log: false }, Scale { ends: [5.0, 5.3], log: true }] {
        assert!(scale.ticks(5).0.len() < 100);
    }
}

#[test]
fn the_largest_numbers_have_an_axis() {
    let far = [vec![1.0, 1e300, f64::MAX], vec![f64::MAX], vec![5e-324, 1.0], vec![-f64::MAX, f64::MAX]];
    for axis in [Axis::new("x", ""), Axis::log("x", "")] {
        for values in &far {
            for scale in [Scale::of, Scale::tight].map(|of| of(&axis, values.iter().copied())) {
                let (named, small) = scale.ticks(5);
                assert!(scale.ends.iter().all(|x| x.is_finite()) && scale.ends[0] < scale.ends[1]);
                assert!(named.len() < 100 && small.len() < 10_000, "{scale:?}");
                let middle = if scale.log { 1.0 } else { 0.0 };
                assert!(scale.share(middle).is_finite(), "{scale:?}");
            }
        }
    }
}

#[test]
fn nothing_or_one_value_still_has_an_axis() {
    for axis in [Axis::new("x", ""), Axis::log("x", "")] {
        for values in [vec![], vec![f64::NAN], vec![0.0], vec![3.0], vec![-3.0, -3.0]] {
            let scale = Scale::of(&axis, values.iter().copied());
            assert!(scale.ends[0] < scale.ends[1], "{values:?} {scale:?}");
            assert!(!scale.log || scale.ends[0] > 0.0);
        }
    }
    let log = Scale::of(&Axis::log("x", ""), [1.0, 100.0].into_iter());
    assert!(log.share(0.0).is_nan() && (log.share(10.0) - 0.5).abs() < 1e-12);
}

fn styles() -> [Style; 4] {
    [(88.0, 8.0), (60.0, 12.0), (40.0, 8.0), (180.0, 6.0)].map(|(width, size)| Style {
        width,
        size,
        font: Font::built_in(),
    })
}

/// Left, top, right and lower end of every text.
fn texts(d: &Drawing, style: &Style) -> Vec<(String, [f64; 4])> {
    let face = style.font.face();
    let of = |item: &Item| match item {
        Item::Text { at: [x, y], text, size, anchor, upwards, .. } => {
            let (long, before) = (length(&face, text) * size, anchor.share());
            let ends = [x - before * long, y - 0.8 * size, x + (1.0 - before) * long, y + 0.25 * size];
            let turned = [x - 0.8 * size, y - (1.0 - before) * long, x + 0.25 * size, y + before * long];
            Some((text.clone(), if *upwards { turned } else { ends }))
        }
        Item::Path { .. } => None,
    };
    d.items.iter().filter_map(of).collect()
}

#[track_caller]
fn inside(d: &Drawing, style: &Style) {
    for (text, [x0, y0, x1, y1]) in texts(d, style) {
        let within = x0 >= -0.5 && y0 >= -0.5 && x1 <= d.size[0] + 0.5 && y1 <= d.size[1] + 0.5;
        assert!(within, "{text:?} at {x0:.1} {y0:.1} {x1:.1} {y1:.1} of {:?}, {} mm", d.size, style.width);
    }
}

#[test]
fn titles_of_maps_are_whole_and_apart() {
    let of = Axis::log("total error, rms", "mm");
    let cells = Cells { x: vec![1.0, 2.0, 3.0], y: vec![1.0, 2.0], z: vec![1e-5, f64::NAN], of };
    let axes = [Axis::new("gauge place x_ss", "mm"), Axis::new("base diameter D", "mm")];
    let panel = || Panel::new("", axes[0].clone(), axes[1].clone()).with(Mark::Cells(cells.clone()));
    for style in styles() {
        for n in [1, 2, 3, 6] {
            let figure = Figure::new("map", "Map", "", (0..n).map(|_| panel()).collect());
            let d = lay(&figure, &style);
            inside(&d, &style);
            let all = texts(&d, &style);
            // Titles are the texts with letters: none lies over another.
            let titles: Vec<_> = all.iter().filter(|(t, _)| t.chars().any(char::is_alphabetic)).collect();
            for (i, (text, a)) in titles.iter().enumerate() {
                for (other, b) in &titles[i + 1..] {
                    let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
                    assert!(apart, "{text:?} and {other:?} of {n} panels at {} mm", style.width);
                }
            }
            let words = all.iter().map(|(t, _)| t.as_str()).collect::<Vec<_>>().join(" ");
            for title in ["gauge place x_ss (mm)", "base diameter D (mm)", "total error, rms (mm)"] {
                assert!(words.matches(title).count() >= n, "{title} in {words}");
            }
            assert!(words.contains(NO_VALUE));
        }
    }
}

#[test]
fn parallel_coordinates_have_their_keys() {
    let labels = ["D", "x_ss", "θ", "spread of K, SD", "total error, rms", "largest strain", "largest force"];
    let rows = (1..20).map(|i| labels.iter().enumerate().map(|(k, _)| f64::from(i) + k as f64).collect());
    let mut figure = Figure::new("parallel", "Parallel", "", Vec::new());
    figure.parallel = Some(Parallel {
        axes: labels.iter().map(|l| Axis::new(l, "mm")).collect(),
        values: rows.collect(),
        colour: 3,
        muted: (1..20).map(|i| i % 5 == 0).collect(),
        why: "a limit is broken".to_owned(),
    });
    for style in styles() {
        let d = lay(&figure, &style);
        inside(&d, &style);
        let words = texts(&d, &style).into_iter().map(|(t, _)| t).collect::<Vec<_>>().join(" ");
        assert!(words.contains("a limit is broken") && words.matches("spread of").count() == 2, "{words}");
    }
}

#[test]
fn a_key_is_as_strong_as_what_it_names() {
    let square = |name| Path::new(name, 0, [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]);
    for (mark, strength) in [
        (Mark::Bars { path: square("bars"), among: [0, 1] }, 1.0),
        (Mark::Area { path: square("outlined"), outlined: true }, 0.35),
        (Mark::Area { path: square("plain"), outlined: false }, 0.18),
    ] {
        let panel = Panel::new("", Axis::new("x", ""), Axis::new("y", "")).with(mark);
        let d = lay(&Figure::new("f", "F", "", vec![panel]), &Style::default());
        let fills = d.items.iter().filter_map(|item| match item {
            Item::Path { fill: Some(_), opacity, .. } => Some(*opacity),
            _ => None,
        });
        let fills: Vec<f64> = fills.collect();
        assert!(fills.len() >= 2 && fills.iter().all(|o| *o == strength), "{fills:?}");
    }
}

#[test]
fn data_cannot_end_its_element() {
    let data = serde_json::json!({ "spec": "# </script><script>alert(1)</script> <!--" });
    let text = html(&Page { title: "a < b & c", style: "", data: &data, scripts: &["let x = 1;"] });
    assert_eq!(text.matches("</script>").count(), 2);
    assert!(text.contains("<title>a &lt; b &amp; c</title>"));
    let inside = text.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    assert_eq!(serde_json::from_str::<serde_json::Value>(inside).unwrap(), data);
}

/// What the modules declare, which all share one scope in the page.
#[test]
fn no_name_is_declared_twice() {
    let script = script();
    let words = ["const ", "let ", "function ", "class "];
    let named = |line: &str| words.iter().find_map(|word| line.strip_prefix(word).map(str::to_owned));
    let name =
        |rest: String| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().map(str::to_owned);
    let mut names: Vec<String> = script.lines().filter_map(named).filter_map(name).collect();
    assert!(names.len() > 40, "{names:?}");
    names.sort();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    assert!(!script.contains("</script") && !script.contains("\nexport ") && !script.contains("\nimport "));
}

#[test]
fn a_line_never_turns_back() {
    let points = [(5.0, 1e-3), (4.0, 1e-2), (6.0, 1e-2), (9.0, 1e-6), (8.0, 1e-5), (12.0, 1e-5)];
    let panel =
        reached(Panel::new("", Axis::log("", ""), Axis::log("", "")), "n", (0, Marker::Circle), 0, &points);
    let Mark::Line { path, .. } = &panel.marks[0] else { panic!("a line comes first") };
    assert!(path.x.windows(2).all(|w| w[0] < w[1]) && path.y.windows(2).all(|w| w[0] > w[1]), "{path:?}");
    let Mark::Points { path, .. } = &panel.marks[1] else { panic!("then points") };
    assert_eq!(path.x.len(), points.len());
}

#[test]
fn a_software_adapter_is_called_so() {
    assert!(is_software("llvmpipe (LLVM 15.0.6, 256 bits)") && is_software("Microsoft Basic Render Driver"));
    assert!(!is_software("NVIDIA H200") && !is_software(""));
    assert_eq!(short("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe");
}

#[test]
fn a_cell_holds_the_least_of_its_rows() {
    let n = 10_000;
    let x: Vec<f64> = (0..n).map(|i| f64::from(i % 100)).collect();
    let y: Vec<f64> = (0..n).map(|i| f64::from(i % 3)).collect();
    let v: Vec<f64> = (0..n).map(|i| f64::from((i * 7919) % 10007)).collect();
    let (panel, binned) = map("", [("a_mm", &x), ("D_mm", &y)], |r| v[r], Axis::new("v", ""));
    let Mark::Cells(cells) = &panel.marks[0] else { panic!("a map") };
    assert!(binned);
    assert_eq!((cells.x.len(), &cells.y[..]), (MOST + 1, &[-0.5, 0.5, 1.5, 2.5][..]));
    assert_eq!((panel.x.words.len(), &panel.y.words[..]), (0, &["0", "1", "2"].map(String::from)[..]));
    for (k, z) in cells.z.iter().enumerate() {
        let (i, j) = (k % MOST, k / MOST);
        let inside = |r: &usize| {
            let last = i == MOST - 1;
            x[*r] >= cells.x[i] && (x[*r] < cells.x[i + 1] || last) && y[*r] == j as f64
        };
        let least = (0..n as usize).filter(inside).map(|r| v[r]).fold(f64::INFINITY, f64::min);
        assert_eq!(*z, least, "cell {i}, {j}");
    }
}

#[test]
fn nothing_is_no_cell() {
    let columns: [(&str, &[f64]); 2] = [("a_mm", &[1.0, f64::NAN]), ("D_mm", &[2.0, 2.0])];
    let (panel, _) = map("", columns, |_| f64::NAN, Axis::new("v", ""));
    assert_eq!(panel.marks, []);
    assert_eq!(edges(&[1.0, 2.0, 4.0]), [0.5, 1.5, 3.0, 5.0]);
}

#[test]
fn two_distances_break_no_limit_unless_asked() {
    let text = "strain_max,status\n0.01,ok\n0.02,ambiguous\n0.03,strain_limit\n0.04,strain_limit+ambiguous\n,slipped_off\n0.01,\n";
    let table = read::csv("t.csv", text.as_bytes()).unwrap();
    let kept = |limits: &str| Limits::read(limits).kept(&table);
    assert_eq!(kept(""), [true, true, false, false, false, true]);
    assert_eq!(kept("{ force_N = 1, unambiguous = true }"), [true, false, false, false, false, true]);
    assert_eq!(kept("{ strain = 0.035 }"), [true, true, true, false, false, true]);
}

/// A panel of used taps with bars and one suspect.
fn panel(used: &[f64], error: &[f64], suspect: f64) -> Panel {
    let path = |name: &str, y: &[f64]| Path::new(name, 0, y.iter().map(|y| (1.0, *y)));
    let mut marks =
        [("used", used), ("suspect", &[suspect])].map(|(n, y)| Mark::points(path(n, y), Marker::Circle));
    if let Mark::Points { error: bars, .. } = &mut marks[0] {
        *bars = error.to_vec();
    }
    let panel = Panel::new("", Axis::new("a", "mm"), Axis::new("error", "mm"));
    cut(marks.into_iter().fold(panel, Panel::with), "used")
}

#[test]
fn a_few_points_far_away_do_not_flatten_the_rest() {
    let bulk: Vec<f64> = (0..50).map(|i| (f64::from(i) * 0.7).sin()).collect();
    assert_eq!(panel(&bulk, &[], 1.2).y.ends, None);
    for outliers in [0, 1, 3, 5] {
        let mut all = bulk.clone();
        all.extend((0..outliers).map(|i| 80.0 + f64::from(i)));
        let p = panel(&all, &[], -300.0);
        let [low, high] = p.y.ends.expect("cut");
        assert!(bulk.iter().all(|x| (low..=high).contains(x)) && high < 1.5 && low > -1.5, "{low} {high}");
        let told = match outliers {
            0 => "beyond the axis: 1 tap, at −300 mm".to_owned(),
            n => format!("beyond the axis: {} taps, the farthest at −300 mm", n + 1),
        };
        assert_eq!(p.beyond, told);
    }
    // Nor do a few bars; what is spread evenly has no outliers, and one value alone has no bulk.
    let bars: Vec<f64> = (0..50).map(|i| if i % 10 == 0 { 90.0 } else { 0.2 }).collect();
    let p = panel(&bulk, &bars, 0.0);
    assert!(p.y.ends.is_some_and(|[low, high]| low > -2.0 && high < 2.0), "{:?}", p.y.ends);
    assert_eq!(p.beyond, "beyond the axis: the bars of 5");
    let even: Vec<f64> = (0..100).map(f64::from).collect();
    assert_eq!((panel(&even, &[], 1.0).y.ends, panel(&[0.5; 20], &[], 9.0).y.ends), (None, None));
}

#[test]
fn values_are_said_with_symbol_and_unit() {
    assert_eq!(said("d_tip_mm", 4.0), "d = 4 mm");
    assert_eq!(said("theta_deg", 0.5), "θ = 0.5°");
    assert_eq!(said("tilt_deg", -30.0), "β = −30°");
    assert_eq!(said("x_ss_mm", 5.12345), "x_ss = 5.123 mm");
    assert_eq!(told_apart("D_mm", &[8.0, 10.0, 8.0]), ["D = 8 mm", "D = 10 mm", "D = 8 mm"]);
    assert_eq!(told_apart("D_mm", &[10.0, 10.000_000_000_1]), ["D = 10 mm", "D = 10.0000000001 mm"]);
    assert_eq!(told_apart("theta_deg", &[1.0, 1.0 + f64::EPSILON])[1], "θ = 1.0000000000000002°");
}
