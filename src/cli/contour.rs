//! `vibrissa contour POSES.csv --calibration CAL.toml`.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};
use vibrissa::contour::curve::Curve;
use vibrissa::contour::point::Noise;
use vibrissa::contour::trace::{Trace, TraceOptions};
use vibrissa::contour::traced::{self, Traced};
use vibrissa::contour::{truth::Edge, write};
use vibrissa::error::Error;
use vibrissa::figure::{self, Format, Style};
use vibrissa::locate::Calibration;
use vibrissa::measure::{Data, Names};
use vibrissa::progress::NEVER;
use vibrissa::report::of_contour;
use vibrissa::scene::RunOptions;
use vibrissa::simulate::strokes::Strokes;
use vibrissa::sink::folder::{Folder, Question};

use super::args::Contour;
use super::reply::Reply;
use super::say;

/// Traces an object into `points.csv`, `curve.csv` and `contour.svg`.
pub fn run(args: &Contour) -> Result<Reply, Error> {
    let start = Instant::now();
    let options = args.common.over(&RunOptions::default());
    let told = say::Told::new(args.common.quiet);
    let warn = |text: &str| told.warn(text);
    let noise = Noise::said(args.angle_noise, args.base_noise, args.touch_noise)?;
    let asked = TraceOptions { noise, surface: args.contact, taps: args.taps, kind: args.curve };
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let bytes = Data::load(&args.data)?;
    let calibration = Calibration::read(&args.calibration, args.common.force)?;
    let truth = args.truth.as_deref().map(Strokes::read).transpose()?;
    let stem = super::stem(&args.data, "points");
    let out = super::folder(args.common.out.as_ref(), &stem, "contour");
    if options.plan == Some(true) {
        let data = args.data.display();
        return Ok(Reply::planned(out, |to| format!("would trace the points of {data} to {to}")));
    }
    super::interrupt::threads(&options)?;
    let label = |path: &Path| path.display().to_string();
    let known = args.truth.as_deref().map(label);
    let question = traced::Question {
        calibration: (&calibration, &label(&args.calibration)),
        estimator: args.estimator,
        data: (&bytes, &label(&args.data)),
        columns: (&columns, args.columns.as_deref()),
        zero: args.zero.as_ref(),
        asked,
        truth: truth.as_ref().map(|strokes| &strokes.object as &dyn Edge).zip(known.as_deref()),
    };
    let traced = Traced::new(&question, &options, &warn, &NEVER)?;
    let mut inputs = vec![args.data.clone(), args.calibration.clone()];
    inputs.extend(truth.iter().flat_map(|strokes| strokes.files.iter().cloned()));
    let question = Question { inputs, ..Question::new("contour", &stem, traced.settings.clone()) };
    let mut folder = Folder::open(&out, question, &write::FILES, args.common.force)?;
    let figure = of_contour(&traced.points, &traced.curve, traced.kind(), &traced.outline)?;
    let drawn = figure::files(&figure, &Style::default(), &[Format::Svg])?;
    folder.put("points.csv", &traced.points)?;
    folder.put("curve.csv", &traced.curve)?;
    drawn.iter().try_for_each(|(_, bytes)| folder.put("contour.svg", bytes))?;
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let mut document = traced.document(&stem, &seconds);
    document["warnings"] = told.texts().into();
    let Traced { counts, result, .. } = &traced;
    let text = summary(&traced.trace, counts, result, traced.estimator);
    let mut result = result.clone();
    result["warnings"] = told.texts().into();
    let reply = Reply { text, counts: counts.clone(), seconds, result, ..Reply::default() };
    Ok(reply.filed(folder, &document, (out, start))?.answered())
}

fn summary(trace: &Trace, counts: &Value, result: &Value, estimator: &str) -> String {
    let mut text = String::new();
    let as_taps = trace.strokes.iter().filter(|s| s.sharp.is_none()).count();
    let strokes = match trace.strokes.len() {
        0 => String::new(),
        n => format!(", {n} strokes, {as_taps} of them as taps"),
    };
    let [points, rows, outliers] = ["points", "rows", "outliers"].map(|key| &counts[key]);
    let _ = writeln!(text, "{points} points of {rows} rows by {estimator}{strokes}; {outliers} outliers");
    match &trace.curve {
        Err(why) => {
            let _ = writeln!(text, "no curve: {why}");
        }
        Ok(chosen) => {
            for j in &chosen.judged {
                let (kind, rms, outliers, [more, or]) = (j.kind.word(), j.left_out_rms, j.outliers, j.more);
                let drawn = if j.kind == chosen.kind { "  <- drawn" } else { "" };
                let _ = writeln!(
                    text,
                    "  {kind:7} {rms:9.4} mm rms of points left out, {outliers} outliers, loss {more:+.3} ± {or:.3} to the best{drawn}"
                );
            }
            if let Curve::Point(spot) = &chosen.curve {
                let ([x, y], [xx, _, yy]) = (spot.at, spot.covariance.0.map(f64::sqrt));
                let _ = writeln!(text, "  at ({x:.4} ± {xx:.4}, {y:.4} ± {yy:.4}) mm");
            }
            if let Curve::Arc(arc) = &chosen.curve
                && let (Some(([x, y], r)), Some(([dx, dy], dr))) = (arc.circle(), arc.circle_deviations())
            {
                let _ = writeln!(
                    text,
                    "  centre ({x:.3} ± {dx:.3}, {y:.3} ± {dy:.3}) mm, radius {r:.3} ± {dr:.3} mm"
                );
            }
            let scale = chosen.scale;
            if scale > 1.5 {
                let _ = writeln!(
                    text,
                    "  points are {scale:.1} times farther off than their standard deviations say; those of the curve are as much larger"
                );
            }
        }
    }
    if let Some(truth) = result.get("truth") {
        let mm = |key: &str| truth[key].as_f64().map_or("–".to_owned(), |x| format!("{x:.4} mm"));
        let [points, curve, places] = ["points_rms_mm", "curve_rms_mm", "places_rms_mm"].map(mm);
        let _ = writeln!(
            text,
            "  from the object itself: points {points} rms, curve {curve} rms; from the places that were touched: points {places} rms"
        );
    }
    text
}
