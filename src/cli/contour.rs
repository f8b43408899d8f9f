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
    let quiet = args.common.quiet;
    let warn = |text: &str| {
        if !quiet {
            say::warning(text)
        }
    };
    let noise = Noise::said(args.angle_noise, args.base_noise, args.touch_noise)?;
    let asked = TraceOptions { noise, surface: args.contact, taps: args.taps, kind: args.curve };
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let bytes = Data::load(&args.data)?;
    let calibration = Calibration::read(&args.calibration, args.common.force)?;
    let truth = args.truth.as_deref().map(Strokes::read).transpose()?.map(|s| s.object);
    let stem = args.data.file_stem().map_or_else(|| "points".into(), |s| s.to_string_lossy().into_owned());
    let out = super::folder(args.common.out.as_ref(), &stem, "contour");
    if options.plan == Some(true) {
        let text = format!(
            "would trace the points of {} to {}; nothing was run\n",
            args.data.display(),
            out.display()
        );
        return Ok(Reply { text, out: Some(out), ..Reply::default() });
    }
    super::sweep::threads(&options)?;
    let label = |path: &Path| path.display().to_string();
    let known = args.truth.as_deref().map(label);
    let question = traced::Question {
        calibration: (&calibration, &label(&args.calibration)),
        estimator: args.estimator,
        data: (&bytes, &label(&args.data)),
        columns: (&columns, args.columns.as_deref()),
        zero: args.zero.as_ref(),
        asked,
        truth: truth.as_ref().map(|object| object as &dyn Edge).zip(known.as_deref()),
    };
    let traced = Traced::new(&question, &options, &warn, &NEVER)?;
    let mut inputs = vec![args.data.clone(), args.calibration.clone()];
    inputs.extend(args.truth.clone());
    let question = Question { inputs, ..Question::new("contour", &stem, traced.settings.clone()) };
    let mut folder = Folder::open(&out, question, &write::FILES, args.common.force)?;
    let figure = of_contour(&traced.points, &traced.curve, traced.kind(), &traced.outline)?;
    let drawn = figure::files(&figure, &Style::default(), &[Format::Svg])?;
    let drawn = drawn.iter().map(|(_, bytes)| ("contour.svg", bytes));
    for (name, bytes) in
        [("points.csv", &traced.points), ("curve.csv", &traced.curve)].into_iter().chain(drawn)
    {
        folder.put(name, bytes)?;
    }
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    folder.run_json(&traced.document(&stem, &seconds))?;
    let written = folder.finish()?;
    let Traced { counts, result, .. } = &traced;
    let text = summary(&traced.trace, counts, result, traced.estimator);
    let reply = Reply { text, counts: counts.clone(), seconds, result: result.clone(), ..Reply::default() };
    Ok(reply.written(out, written, start).answered())
}

fn summary(trace: &Trace, counts: &Value, result: &Value, estimator: &str) -> String {
    let mut text = String::new();
    let strokes = match trace.strokes.len() {
        0 => String::new(),
        n => format!(
            ", {n} strokes, {} of them as taps",
            trace.strokes.iter().filter(|s| s.sharp.is_none()).count()
        ),
    };
    let _ = writeln!(
        text,
        "{} points of {} rows by {estimator}{strokes}; {} outliers",
        counts["points"], counts["rows"], counts["outliers"]
    );
    match &trace.curve {
        Err(why) => {
            let _ = writeln!(text, "no curve: {why}");
        }
        Ok(chosen) => {
            for j in &chosen.judged {
                let _ = writeln!(
                    text,
                    "  {:7} {:9.4} mm rms of points left out, {} outliers, loss {:+.3} ± {:.3} to the best{}",
                    j.kind.word(),
                    j.left_out_rms,
                    j.outliers,
                    j.more[0],
                    j.more[1],
                    if j.kind == chosen.kind { "  <- drawn" } else { "" }
                );
            }
            if let Curve::Point(spot) = &chosen.curve {
                let [xx, _, yy] = spot.covariance.0;
                let _ = writeln!(
                    text,
                    "  at ({:.4} ± {:.4}, {:.4} ± {:.4}) mm",
                    spot.at[0],
                    xx.sqrt(),
                    spot.at[1],
                    yy.sqrt()
                );
            }
            if let Curve::Arc(arc) = &chosen.curve
                && let (Some((c, r)), Some((dc, dr))) = (arc.circle(), arc.circle_deviations())
            {
                let _ = writeln!(
                    text,
                    "  centre ({:.3} ± {:.3}, {:.3} ± {:.3}) mm, radius {r:.3} ± {dr:.3} mm",
                    c[0], dc[0], c[1], dc[1]
                );
            }
            if chosen.scale > 1.5 {
                let _ = writeln!(
                    text,
                    "  points are {:.1} times farther off than their standard deviations say; those of the curve are as much larger",
                    chosen.scale
                );
            }
        }
    }
    if let Some(truth) = result.get("truth") {
        let mm = |key: &str| truth[key].as_f64().map_or("–".to_owned(), |x| format!("{x:.4} mm"));
        let _ = writeln!(
            text,
            "  from the object itself: points {} rms, curve {} rms; from the places that were touched: points {} rms",
            mm("points_rms_mm"),
            mm("curve_rms_mm"),
            mm("places_rms_mm")
        );
    }
    text
}
