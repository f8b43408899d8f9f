//! `vibrissa contour POSES.csv --calibration CAL.toml`: points on an object, and the curve through them.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args as Flags;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Asked, Context, Reply, estimator, folder, meant, named, number, stem};
use crate::contour::curve::{Arc, Curve, Kind};
use crate::contour::point::Noise;
use crate::contour::trace::{self, OUTLINE, Trace, TraceOptions};
use crate::error::{Error, InputError};
use crate::estimator::Estimator;
use crate::locate::{Locator, SaidZero, locator::opener, stream::Ask, tared::Readings};
use crate::measure::{Names, rig::PLACES};
use crate::report::of_contour;
use crate::simulate::strokes::Strokes;
use crate::sink::{Frame, Question, hash, heading};

/// The contour of an object.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa contour poses.csv --calibration calibration.toml --out traced")]
pub struct ContourRequest {
    /// CSV with base_x_mm, base_y_mm (the motor's axis) and heading_deg (the undeflected whisker at first touch, counterclockwise from +x);
    /// where needed sense (1: turns counterclockwise, the default; -1), contact_deg (motor's angle at first touch, added to the
    /// heading), stroke (its number, in the rows of one sweep), base_z_mm; then as for locate: theta_deg (since first touch) or
    /// delta_mm, and strain, microstrain, bridge_mV_per_V or reading; rows with theta (delta) = 0 are zero readings
    pub data: PathBuf,
    /// calibration.toml of the whisker, as calibrate wrote it (--force takes one that was edited by hand)
    #[arg(long, value_name = "CAL")]
    pub calibration: PathBuf,
    /// Distances by this instead of the estimator that won on distances left out
    #[arg(long, value_parser = named(Estimator::WORDS), value_name = "NAME")]
    pub estimator: Option<String>,
    /// Standard deviation of the heading at first touch, degrees: moves a point across the whisker
    #[arg(long, value_name = "DEG", default_value_t = 0.1, value_parser = number)]
    pub angle_noise: f64,
    /// Standard deviation of each coordinate of the base, mm
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = number)]
    pub base_noise: f64,
    /// Standard deviation of the motor's angle at which a touch is noticed, degrees; a stroke finds its touch itself, and takes this as
    /// what is known before [default: 0 for a tap, 0.5 for a stroke]
    #[arg(long, value_name = "DEG", value_parser = number)]
    pub touch_noise: Option<f64>,
    /// Which place of the whisker touches [default: as the calibration's model has it]
    #[arg(long, value_parser = named(PLACES), value_name = "PLACE")]
    pub contact: Option<String>,
    /// Take each row as a tap, whatever its stroke
    #[arg(long)]
    pub taps: bool,
    /// Draw this curve [default: the one that tells best where points lie that were left out, the simplest of equals]
    #[arg(long, value_parser = named(Kind::WORDS), value_name = "KIND")]
    pub curve: Option<String>,
    /// The object as it was simulated (simulate --object): tells how far from it the points are, and draws it
    #[arg(long, value_name = "OBJECT")]
    pub truth: Option<PathBuf>,
    /// What the sensor shows without contact, in the unit of the signal, where no row with theta (delta) = 0 says it (where neither does,
    /// and the signal of the calibration was tared, there is a warning); X,Y of two signals
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub zero: Option<SaidZero>,
    /// Columns of readings under other names: theta=ang_deg,reading=ch3 (theta, delta, strain, microstrain, bridge, reading, ignore)
    #[arg(long, value_name = "ROLE=NAME,…")]
    pub columns: Option<String>,
}

pub fn run(asked: &Asked<ContourRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    let noise = Noise::said(asked.angle_noise, asked.base_noise, asked.touch_noise)?;
    let surface = meant(("word", "--contact"), asked.contact.as_deref(), &PLACES)?;
    let kind = meant(("word", "--curve"), asked.curve.as_deref(), &Kind::WORDS)?;
    let traced = TraceOptions { noise, surface, taps: asked.taps, kind };
    let estimator = estimator(asked.estimator.as_deref())?;
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let measured = context.data(&asked.data)?;
    let calibration = context.calibration(&asked.calibration, options.force == Some(true))?;
    let truth = asked.truth.as_deref().map(|path| context.read(path, "object", Strokes::parse)).transpose();
    let truth = truth.map_err(|e| InputError { key: e.key.or(Some("--truth".into())), ..e })?;
    let stem = stem(&asked.data, "points");
    let out = folder(options.out.as_ref(), &stem, "contour");
    if options.plan == Some(true) {
        let data = asked.data.display();
        return Ok(Reply::planned(out, |to| format!("would trace the points of {data} to {to}")));
    }
    let label = |path: &Path| path.display().to_string();
    let (calibrated, file) = (label(&asked.calibration), label(&asked.data));
    let locator = Locator::new(&calibration, &calibrated, estimator, &opener(&options))?;
    context.warn_all(&calibration.rig.warnings);
    let warn = |text: &str| context.warn(text);
    let zero = SaidZero::of(asked.zero.as_ref(), [&locator])?;
    let ask = Ask { zero, ..Ask::of_file(&file, &columns, &warn) };
    let readings = Readings::of(&locator, measured.rows(), &ask, heading("points"))?;
    let trace = Trace::new(&locator, &readings, &traced, context.host.stop(false))?;
    if !trace.on_surface && asked.contact.is_none() && locator.rig.known {
        warn(
            "the model of the calibration has contact on the whisker's centreline, and so are the points: on a real whisker they are off the \
             object by its radius. --contact surface puts them on its side",
        );
    }
    if !trace.points.iter().any(|point| point.is_there()) {
        warn("no row gives a point; the column status of points.csv says why");
    }
    let (digest, checksum, by) = (measured.rows().hash()?, &calibration.checksum, locator.estimator.word());
    let settings = json!({
        "data": digest, "calibration": checksum, "estimator": by, "columns": asked.columns, "zero": asked.zero,
        "angle_noise_deg": noise.angle, "base_noise_mm": noise.base, "touch_noise_deg": noise.touch,
        "contact": asked.contact, "taps": asked.taps, "curve": asked.curve, "truth": asked.truth.as_deref().map(label),
    });
    let (mut result, counts) = (trace::described(&trace), trace::counts(&trace, &readings));
    result["estimator"] = by.into();
    let object = truth.as_ref().map(|strokes| &strokes.object);
    if let Some(object) = object {
        result["truth"] = trace::compared(&trace, &readings, object)?;
    }
    let mut question = Question::new("contour", &stem, settings.clone());
    question.inputs.extend(truth.iter().flat_map(|strokes| strokes.files.iter().cloned()));
    let (points, curve) = (trace::points(&trace, &readings)?, trace::curve(&trace)?);
    let mut destination = context.open(&out, question, &trace::FILES, options.force)?;
    destination.table(points.clone())?;
    destination.table(curve.clone())?;
    let outline = object.map_or_else(Vec::new, |object| object.along(OUTLINE));
    if object.is_some() {
        let mut frame = Frame::of("outline", ["x_mm", "y_mm"]);
        outline.iter().try_for_each(|place| frame.row(place.map(Into::into)))?;
        destination.keep(frame);
    }
    let kind = trace.curve.as_ref().map_or("", |chosen| chosen.kind.word());
    destination.draw("contour.svg", || Ok(of_contour(&points, &curve, kind, &outline)?))?;
    let identity = hash(&format!("{digest}\n{checksum}\n{settings}"));
    let body = json!({
        "calibration": { "file": calibrated, "checksum": checksum }, "data": { "file": file, "hash": digest },
        "settings": settings, "result": result, "warnings": context.told(),
    });
    let of = json!({ "name": stem, "hash": identity });
    let text = summary(&trace, &counts, &result, by);
    result["warnings"] = context.told().into();
    let reply = Reply { text, counts, result, ..Reply::default() };
    Ok(reply.filed(destination, of, body)?.answered())
}

fn summary(trace: &Trace, counts: &Value, result: &Value, estimator: &str) -> String {
    let mut text = String::new();
    let as_taps = trace.strokes.iter().filter(|s| s.object.is_none()).count();
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
                let (kind, rms, outliers) = (j.kind.word(), j.left_out_rms_mm, j.outliers);
                let (more, or) = (j.loss_more_than_best, j.loss_more_se);
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
                && let (Some([x, y, r]), Some([dx, dy, dr])) = (arc.circle(), arc.deviations_of(Arc::circle))
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
