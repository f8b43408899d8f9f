//! `vibrissa locate --array ARRAY.toml READINGS.csv`: readings of several whiskers as points in one frame.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Value, json};

use super::{Common, Content, Context, Reply, estimator, folder, stem};
use crate::contour::array::{Mounted, answer};
use crate::contour::point::Noise;
use crate::error::{Error, InputError};
use crate::files::Array;
use crate::locate::object::By;
use crate::locate::stream::Ask;
use crate::locate::{Calibration, SaidZero};
use crate::measure::Names;
use crate::sink::folder::{Question, hash};

#[derive(Debug, Deserialize)]
pub struct ArrayRequest {
    pub array: PathBuf,
    /// Readings; none, of a result in memory: whether the array can answer any, and what its calibrations are.
    pub readings: Option<PathBuf>,
    pub columns: Option<String>,
    pub estimator: Option<String>,
    pub zero: Option<SaidZero>,
    #[serde(default)]
    pub same_run: bool,
    #[serde(default)]
    pub same: bool,
    pub object: Option<String>,
    /// Standard deviation of the heading, degrees, in place of that in the file.
    pub angle_noise: Option<f64>,
    /// And of each coordinate of the base, mm.
    pub base_noise: Option<f64>,
    #[serde(flatten)]
    pub common: Common,
}

pub fn run(asked: &ArrayRequest, context: &Context<'_>) -> Result<Reply, Error> {
    let options = context.prepared(&asked.common, None)?;
    let described = context.read(&asked.array, "array", Array::parse)?;
    let name = asked.readings.as_deref().unwrap_or(Path::new("")).display().to_string();
    let stem = stem(Path::new(&name), "readings");
    let out = folder(options.out.as_ref(), &stem, "locate");
    let names: Vec<&str> = described.mounts.iter().map(|m| m.name.as_str()).collect();
    if options.plan == Some(true) {
        let by = names.join(", ");
        return Ok(Reply::planned(out, |_| format!("would locate readings of {name} by {by}")));
    }
    let columns = asked.columns.as_deref().map(Names::parse).transpose()?.unwrap_or_default();
    let of_file = &described.noise;
    let noise = Noise::said(
        asked.angle_noise.unwrap_or(of_file.angle),
        asked.base_noise.unwrap_or(of_file.base),
        of_file.touch,
    )?;
    let by = estimator(asked.estimator.as_deref())?;
    let (mut whiskers, mut sums, mut kept) = (Vec::<Mounted>::new(), Vec::new(), Vec::new());
    for mount in &described.mounts {
        let (path, trust) = (&mount.calibration, options.force == Some(true));
        let missing = |e: InputError| InputError { key: e.key.or(Some("whisker.calibration".into())), ..e };
        let parse = |label: &str, text: &str, _: &Path| {
            Ok((Calibration::parse(label, text, trust)?, text.as_bytes().to_vec()))
        };
        let (calibration, bytes) = match path.is_dir() {
            true => (Calibration::read(path, trust)?, Vec::new()),
            false => context.read(path, "calibration", parse).map_err(missing)?,
        };
        let mut mounted = mount.open(&calibration, by, &options)?;
        mounted.locator.same_run = asked.same_run;
        whiskers.push(mounted);
        if asked.readings.is_none() || !context.is_in_memory() {
            context.warn_all(&calibration.rig.warnings);
        }
        sums.push(calibration.checksum);
        kept.push((path.display().to_string(), Content::Bytes(bytes)));
    }
    let zero = SaidZero::of(asked.zero.as_ref(), whiskers.iter().map(|w| &w.locator))?;
    let known = |w: &Mounted| json!({ "name": w.name, "estimator": w.locator.estimator.name() });
    let known: Vec<Value> = whiskers.iter().map(known).collect();
    let Some(readings) = &asked.readings else {
        return Ok(Reply { kept, result: known.into(), ..Reply::default() });
    };
    let by = match &asked.object {
        Some(column) => By::Column(column),
        None if asked.same => By::Same,
        None => By::Unsaid,
    };
    let measured = context.data(readings)?;
    let warn = |text: &str| context.warn(text);
    let ask = Ask { zero, by, ..Ask::of_file(&name, &columns, &warn) };
    let (table, counted) = answer(&whiskers, measured.rows(), &ask, &noise)?;
    let digest = measured.rows().hash()?;
    let of = json!({
        "readings": digest, "array": format!("{described:?}"), "calibrations": sums, "columns": asked.columns, "zero": SaidZero::json(asked.zero.as_ref()),
        "estimator": asked.estimator, "same": asked.same, "object": asked.object, "same_run": asked.same_run,
    });
    let identity = hash(&of.to_string());
    let question = Question::new("locate", &stem, of);
    let mut destination = context.open(&out, question, &["located.csv"], options.force)?;
    destination.table(table)?;
    let counts = counted.described();
    let array = asked.array.display().to_string();
    let of = json!({ "name": stem, "hash": identity });
    let body = json!({
        "array": { "file": array, "whiskers": known }, "readings": { "file": name, "hash": digest }, "warnings": context.told(),
    });
    let words = counted.combinations.told(|n| n.to_string());
    let text = format!("{} readings of {} whiskers located: {words}\n", counted.lines, whiskers.len());
    let result = json!({ "whiskers": names, "warnings": context.told() });
    Reply { text, counts, result, ..Reply::default() }.filed(destination, of, body, context)
}
