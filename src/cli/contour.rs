//! `vibrissa contour POSES.csv --calibration CAL.toml`.

use std::fmt::Write;
use std::time::Instant;

use serde_json::{Value, json};
use vibrissa::contour::curve::Curve;
use vibrissa::contour::trace::{Asked, Trace};
use vibrissa::contour::{point::Noise, write};
use vibrissa::error::{Error, InputError};
use vibrissa::figure::{self, Format, Style};
use vibrissa::locate::stream::Ask;
use vibrissa::locate::table::Readings;
use vibrissa::locate::{Calibration, Locator, locator::opener};
use vibrissa::measure::{Data, Names};
use vibrissa::report::of_contour;
use vibrissa::scene::RunOptions;
use vibrissa::simulate::object::Object;
use vibrissa::simulate::strokes::Strokes;
use vibrissa::sink::folder::{Folder, Question, hash, hash_all};
use vibrissa::sink::run_json;

use super::args::{Contour, Zero};
use super::reply::Reply;
use super::say;

/// Places of the outline of a known object.
const OUTLINE: usize = 400;

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
    let asked = asked(args)?;
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
    if let Some(n) = options.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n);
        pool.build_global().map_err(|e| Error::Run(e.to_string()))?;
    }
    let label = args.calibration.display().to_string();
    let locator = Locator::new(&calibration, &label, args.estimator, &opener(&options))?;
    calibration.rig.warnings.iter().for_each(|w| warn(w));
    let file = args.data.display().to_string();
    let zero = Zero::of(&args.zero, [&locator])?;
    let ask = Ask { columns: &columns, zero, label: Some(&file), keep: true, warn: &warn };
    let readings = Readings::of(&locator, &bytes, &ask, &write::ADDED)?;
    let trace = Trace::new(&locator, &readings, &asked)?;
    if !trace.on_surface && args.contact.is_none() && locator.rig.known {
        warn(
            "the model of the calibration has contact on the whisker's centreline, and so are the points: on a real whisker they are off the \
             object by its radius. --contact surface puts them on its side",
        );
    }
    if !trace.points.iter().any(|point| point.is_there()) {
        warn("no row gives a point; the column status of points.csv says why");
    }
    let digest = hash_all(&mut bytes.as_slice()).map_err(|e| Error::Run(e.to_string()))?;
    let settings = json!({
        "data": digest, "calibration": calibration.checksum, "estimator": locator.estimator.name(), "columns": args.columns, "zero": Zero::json(&args.zero),
        "angle_noise_deg": args.angle_noise, "base_noise_mm": args.base_noise, "touch_noise_deg": args.touch_noise,
        "contact": args.contact.map(|s| if s { "surface" } else { "centreline" }), "taps": args.taps,
        "curve": args.curve.map(|k| k.word()), "truth": args.truth.as_ref().map(|p| p.display().to_string()),
    });
    let mut inputs = vec![args.data.clone(), args.calibration.clone()];
    inputs.extend(args.truth.clone());
    let question = Question { inputs, ..Question::new("contour", &stem, settings.clone()) };
    let mut folder = Folder::open(&out, question, &write::FILES, args.common.force)?;
    let (points, curve) = (write::points(&trace, &readings), write::curve(&trace)?);
    let kind = trace.curve.as_ref().map_or("", |c| c.kind.word());
    let figure = of_contour(&points, &curve, kind, &truth.as_ref().map(outline).unwrap_or_default())?;
    let mut files = vec![("points.csv", points), ("curve.csv", curve)];
    let drawn = figure::files(&figure, &Style::default(), &[Format::Svg])?;
    files.extend(drawn.into_iter().map(|(_, bytes)| ("contour.svg", bytes)));
    for (name, bytes) in files {
        let mut file = folder.file(name)?;
        file.write(&bytes)?;
        file.close()?;
    }
    let counts = write::counts(&trace, &readings);
    let mut result = write::described(&trace);
    result["estimator"] = locator.estimator.name().into();
    if let Some(object) = &truth {
        result["truth"] = compared(&trace, &readings, object)?;
    }
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let identity = hash(&format!("{digest}\n{}\n{settings}", calibration.checksum));
    let body = json!({
        "calibration": { "file": label, "checksum": calibration.checksum },
        "data": { "file": file, "hash": digest },
        "settings": settings, "counts": counts, "result": result, "seconds": seconds,
    });
    folder.run_json(&run_json::document("contour", json!({ "name": stem, "hash": identity }), body))?;
    let written = folder.finish()?;
    let mut text = told(&trace, &counts, &result, locator.estimator.name());
    let _ =
        writeln!(text, "wrote {} in {:.2} s", super::listed(&written.files), start.elapsed().as_secs_f64());
    Ok(Reply { text, out: Some(out), files: written.files, counts, seconds, result, ..Reply::default() }
        .removing(&written.removed))
}

fn asked(args: &Contour) -> Result<Asked, InputError> {
    let within = |key: &str, x: f64, unit: &str| match (0.0..1000.0).contains(&x) {
        true => Ok(x),
        false => Err(InputError::new("this is no standard deviation")
            .key(key)
            .value(x)
            .allowed(format!("≥ 0 ({unit})"))),
    };
    let touch = args.touch_noise.map(|x| within("--touch-noise", x, "degrees")).transpose()?;
    Ok(Asked {
        noise: Noise {
            angle: within("--angle-noise", args.angle_noise, "degrees")?,
            base: within("--base-noise", args.base_noise, "mm")?,
            touch,
        },
        surface: args.contact,
        taps: args.taps,
        kind: args.curve,
    })
}

/// The edge of a known object.
fn outline(object: &Object) -> Vec<[f64; 2]> {
    (0..=OUTLINE).map(|k| object.at(object.length() * k as f64 / OUTLINE as f64).at).collect()
}

/// Distances of points from the object; where the data say what was touched (`true_x_mm`, `true_y_mm` by the readings of a stroke,
/// `touch_x_mm`, `touch_y_mm` first), from these places.
fn compared(trace: &Trace, readings: &Readings, object: &Object) -> Result<Value, InputError> {
    let there: Vec<usize> =
        (0..trace.points.len()).filter(|&i| trace.points[i].is_there() && !trace.outliers[i]).collect();
    let rms = |all: Vec<f64>| {
        let known: Vec<f64> = all.into_iter().filter(|x| x.is_finite()).collect();
        (known.iter().map(|x| x * x).sum::<f64>() / known.len() as f64).sqrt()
    };
    let points = rms(there.iter().map(|&i| object.distance(trace.points[i].at)).collect());
    let places = |name: &str| -> Result<Option<[Vec<f64>; 2]>, InputError> {
        let x = readings.numbers(&format!("{name}_x_mm"))?;
        Ok(x.zip(readings.numbers(&format!("{name}_y_mm"))?).map(|(x, y)| [x, y]))
    };
    let (now, first) = (places("true")?, places("touch")?);
    let apart = now.zip(first).map(|(now, first)| {
        let one = |&i: &usize| {
            let [x, y] = if trace.swept[i] { &now } else { &first };
            let at = trace.points[i].at;
            (at[0] - x[i]).hypot(at[1] - y[i])
        };
        rms(there.iter().map(one).collect())
    });
    let curve = trace.curve.as_ref().ok().map(|chosen| {
        let traced = chosen.curve.traced(&trace.samples, OUTLINE / 2);
        rms(traced.iter().map(|(at, ..)| object.distance(*at)).collect())
    });
    Ok(
        json!({ "points_rms_mm": points, "places_rms_mm": apart, "curve_rms_mm": curve, "points": there.len() }),
    )
}

fn told(trace: &Trace, counts: &Value, result: &Value, estimator: &str) -> String {
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
