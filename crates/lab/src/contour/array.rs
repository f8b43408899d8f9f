//! Several whiskers: points of all in one frame.

use std::collections::{BTreeMap, HashMap};

use super::point::{Noise, Point, Pose};
use crate::error::{Error, InputError, nearest};
use crate::locate::object::{SHIFT, shift_column};
use crate::locate::stream::{Counts, add};
use crate::locate::{Answerer, Ask, Locator, Objects, Readings, strokes::Group};
use crate::measure::{Names, Skin, columns::missing, header::Sheet};
use crate::sink::{Field, Frame, LabCell, LabTable, heading};

pub const WHISKER: &str = "whisker";

pub struct Mounted {
    pub name: String,
    pub locator: Locator,
    /// The motor's axis, the direction of the whisker at first touch when the motor is at 0, and the sense in which it turns.
    pub pose: Pose,
}

/// Answers readings whose column [`WHISKER`] names one of `whiskers`; taps of one object by one whisker together where `ask` says so.
pub fn answer(
    whiskers: &[Mounted],
    input: LabTable<'_>,
    ask: &Ask<'_>,
    noise: &Noise,
) -> Result<(Frame, Counts), Error> {
    let label = ask.label.unwrap_or("stdin");
    let owners = owners(whiskers, label, input, ask.columns)?;
    let twofold = whiskers.iter().any(|w| w.locator.is_twofold());
    let mut table: Option<Frame> = None;
    // By line, so that rows of all whiskers keep the order of the file.
    let mut rows = BTreeMap::new();
    let mut counts = Counts::default();
    for (w, whisker) in whiskers.iter().enumerate() {
        let own = |line: usize| owners.get(&line) == Some(&w);
        if !owners.values().any(|owner| *owner == w) {
            continue;
        }
        // Zeros are those of this whisker.
        let ask = &Ask { only: Some(&own), ..*ask };
        let who = Answerer::from(&whisker.locator);
        Objects::can(who, ask.by).map_err(|e| e.at(&whisker.name, None))?;
        let mut readings = Readings::of(&whisker.locator, input, ask, heading("array"))?;
        let mut group = Group::new(who, &readings.names, ask)?;
        if let Some(group) = &mut group {
            // These columns follow the status.
            group.columns = Group::columns(ask, twofold, &readings.names);
            add(&mut readings.empty, &group.columns);
        }
        if table.as_ref().is_some_and(|table| table.names != readings.empty.names) {
            let error =
                InputError::new("whiskers of one array are driven and read in one way").at(label, Some(1));
            let error = error.key(WHISKER).value(&whisker.name);
            return Err(error.allowed("calibrations of one drive and one signal").into());
        }
        table.get_or_insert(readings.empty.clone());
        let contact = readings.numbers("contact_deg")?;
        Skin::is_known(&whisker.locator.rig)?;
        let skin = Skin::new(&whisker.locator.rig, None);
        shift_column(&readings.names)?;
        let shifts = readings.numbers(SHIFT)?;
        for (i, row) in readings.rows.iter().enumerate() {
            let turned = contact.as_ref().map_or(0.0, |c| c[i]).to_radians();
            let pose = Pose { heading: whisker.pose.heading + turned, ..whisker.pose };
            let pose = pose.nearer(shifts.as_ref().map_or(0.0, |s| s[i]));
            let point = Point::of_tap(&whisker.locator, &skin, &pose, row, noise);
            counts.zeros += u64::from(row.rests);
            counts.combinations.note(point.status, 1);
            let mut out = row.kept.clone();
            let ([x, y, z], [xx, _, yy], [a, sigma]) =
                (point.coordinates(), point.covariance.0, point.distance);
            let sigma_z = if point.is_there() { noise.base } else { f64::NAN };
            out.extend([a, sigma, x, y, z, xx.sqrt(), yy.sqrt(), sigma_z].map(Field::from));
            out.push(point.status.into());
            if let Some(group) = &mut group {
                out.extend(group.tell(&row.fields, row.tap.as_ref().map(|tap| (tap, &row.answer)), ask));
            }
            rows.insert(row.line, out);
        }
    }
    let mut table =
        table.ok_or_else(|| InputError::new("this file has a header but no rows").at(label, None))?;
    counts.lines = rows.len() as u64;
    rows.into_values().try_for_each(|row| table.row(row))?;
    Ok((table, counts))
}

fn owners(
    whiskers: &[Mounted],
    label: &str,
    input: LabTable<'_>,
    said: &Names,
) -> Result<HashMap<usize, usize>, InputError> {
    let text = if let LabTable::Text(bytes) = input { String::from_utf8_lossy(bytes) } else { "".into() };
    let input = if let LabTable::Frame(f) = input { LabTable::Frame(f) } else { LabTable::Text(&*text) };
    let here = |e: InputError| InputError { file: Some(label.to_owned()), ..e };
    let mut sheet = Sheet::new(input, said, "whisker, then the columns of readings").map_err(here)?;
    let place = sheet.names.iter().position(|n| n == WHISKER).ok_or_else(|| {
        let error = missing(WHISKER, &sheet.names).at(label, Some(sheet.line));
        error.allowed("whisker, then the columns of readings; contact_deg where it is needed")
    })?;
    let known: Vec<&str> = whiskers.iter().map(|w| w.name.as_str()).collect();
    let mut all = HashMap::new();
    while let Some((line, _, cells)) = sheet.next(said).map_err(here)? {
        let name = cells.get(place).map(LabCell::text).unwrap_or_default();
        let owner = known.iter().position(|n| *n == name).ok_or_else(|| {
            let close = nearest(&name, &known).map(|n| format!("; is {n} meant?"));
            let message = format!("the array has no such whisker{}", close.unwrap_or_default());
            let error = InputError::new(message).at(label, Some(line)).key(WHISKER);
            error.value(&name).allowed(known.join(", "))
        })?;
        all.insert(line, owner);
    }
    Ok(all)
}
