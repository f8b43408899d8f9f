//! `vibrissa taps RAW.csv`.

use std::time::Instant;

use serde_json::json;
use vibrissa::error::Error;
use vibrissa::figure::{self, Format, Style};
use vibrissa::measure::{Data, Names};
use vibrissa::record::output::{self, FILES, Labels};
use vibrissa::record::{Kind, Record, find};
use vibrissa::scene::Drive;
use vibrissa::sink::folder::{Folder, Question, hash};
use vibrissa::sink::run_json;

use super::args::Taps;
use super::reply::Reply;
use super::say;

/// Finds taps in a raw record.
pub fn run(args: &Taps) -> Result<Reply, Error> {
    let start = Instant::now();
    let label = args.raw.display().to_string();
    let stem = super::stem(&args.raw, "taps");
    let out = super::folder(args.common.out.as_ref(), &stem, "taps");
    let columns = args.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let bytes = Data::load(&args.raw)?;
    let text = String::from_utf8_lossy(&bytes);
    let record = Record::parse(&label, &text, &columns)?;
    let samples = record.time.len();
    if args.common.plan {
        return Ok(Reply::planned(out, |_| format!("would look for taps in {samples} samples of {label}")));
    }
    let ignored = || format!("columns that are not used: {}", record.ignored.join(", "));
    say::warnings(args.common.quiet, (!record.ignored.is_empty()).then(ignored));
    let empty = || format!("lines without a signal are left out: {}", record.empty);
    say::warnings(args.common.quiet, (record.empty > 0).then(empty));
    let angles = args.theta.clone().map(|values| (Drive::Angle, values));
    let drive = angles.or_else(|| Some((Drive::Displacement, args.delta.clone()?)));
    let labels = Labels { a: args.a.clone().unwrap_or_default(), drive };
    let (readings, rest) = find(&record, args.take)?;
    labels.check(&record, &readings)?;
    let asked = json!({ "raw": hash(&text), "columns": args.columns, "take": format!("{:?}", args.take), "a": args.a, "theta": args.theta, "delta": args.delta });
    let question = Question { inputs: vec![args.raw.clone()], ..Question::new("taps", &stem, asked) };
    let mut folder = Folder::open(&out, question, &FILES, args.common.force)?;
    let drawn = figure::files(&output::figure(&record, &rest, &readings), &Style::default(), &[Format::Svg])?;
    let tables = [output::taps(&record, &readings, &labels), output::readings(&record, &readings)];
    let tables = tables.into_iter().map(String::into_bytes).chain(drawn.into_iter().map(|(_, bytes)| bytes));
    for (name, bytes) in FILES.iter().zip(tables) {
        folder.put(name, &bytes)?;
    }
    let count = |kind: Kind| readings.iter().filter(|r| r.kind == kind).count();
    let [rests, plateaus, peaks] = [Kind::Rest, Kind::Plateau, Kind::Peak].map(count);
    let (taps, noise) = (plateaus + peaks, rest.noise);
    let counts = json!({ "samples": samples, "rests": rests, "plateaus": plateaus, "peaks": peaks });
    let seconds = json!({ "total": start.elapsed().as_secs_f64() });
    let result = json!({ "noise": noise, "taps": taps });
    let told = json!({ "raw": { "file": label, "hash": hash(&text) }, "counts": counts, "seconds": seconds, "result": result });
    let document = run_json::document("taps", json!({ "name": stem, "hash": hash(&text) }), told);
    let answer = format!(
        "{taps} taps in {samples} samples ({plateaus} stand still, {peaks} are peaks), rests: {rests}; noise of a sample {noise:.3e}. Look at taps.svg before you use them."
    );
    Reply { answer, counts, seconds, result, ..Reply::default() }.filed(folder, &document, (out, start))
}
