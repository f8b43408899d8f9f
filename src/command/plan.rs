//! `vibrissa plan SPEC.toml --error MM`: the taps of a calibration.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::PathBuf;

use clap::Args as Flags;
use indexmap::IndexMap;
use serde::Deserialize;
use serde_json::{Value, json};

use super::reply::framed;
use super::{Asked, Context, Reply, folder, number, whole};
use crate::calibrate::planned::{self, Apart, PlanGoal, Planned};
use crate::digits::short;
use crate::error::{Error, InputError};
use crate::figure::{Axis, Figure, Mark, Marker, Panel, Path as Drawn};
use crate::locate::locator::opener;
use crate::measure::{Rig, Unit};
use crate::scene::Drive;
use crate::sink::{Field, Frame, Question, drive_unit};
use crate::spec;

const FILES: [&str; 3] = ["plan.csv", "plan_errors.csv", "plan.svg"];

/// The taps of a calibration.
#[derive(Debug, Flags, Deserialize)]
#[command(after_help = "Example: vibrissa plan examples/prototype-d10.toml --error 0.25 --out plan")]
pub struct PlanRequest {
    /// Spec of the whisker; its [tap] says how far the rig may go: distances between the least and the largest, and these drives
    pub spec: PathBuf,
    /// Root mean square error of a distance that is wanted, mm: of one tap, in another run, over the distances and drives of the spec
    #[arg(long, value_name = "MM", value_parser = number)]
    pub error: f64,
    /// Noise, and how positions and runs differ, as this calibration of the same rig learned them
    #[arg(long, value_name = "CAL")]
    pub like: Option<PathBuf>,
    /// Most positions [default: as many as help]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(2..=25))]
    pub positions: Option<usize>,
    /// Runs: the rig is set up anew for each
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole::<usize>(1..=8))]
    pub runs: usize,
    /// How well a position is set, mm, one standard deviation
    #[arg(long, value_name = "MM", default_value_t = 0.05, value_parser = number, conflicts_with = "like")]
    pub place: f64,
    /// By how much the gain differs between runs, as a share, one standard deviation; as --like says where that has several runs
    #[arg(long, value_name = "SHARE", default_value_t = 0.003, value_parser = number)]
    pub gain: f64,
    /// Noise that goes with the signal, as a share of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.001, value_parser = number, conflicts_with = "like")]
    pub relative: f64,
    /// Of the order of the taps
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

pub fn run(asked: &Asked<PlanRequest>, context: &Context<'_>) -> Result<Reply, Error> {
    let label = asked.spec.display().to_string();
    let &PlanRequest { error, positions, runs, place, gain, relative, seed, .. } = &**asked;
    for (key, x) in [("--error", error), ("--place", place), ("--gain", gain), ("--relative", relative)] {
        let positive = key == "--error";
        if !(x.is_finite() && x >= 0.0 && (x > 0.0 || !positive)) {
            let allowed = if positive { "> 0 (mm)" } else { "≥ 0" };
            return Err(InputError::new("this is no such size").key(key).value(x).allowed(allowed).into());
        }
    }
    let goal = PlanGoal { error, positions, runs, place, gain, relative, seed };
    let mut spec = context.read(&asked.spec, "spec", spec::parse)?;
    let rig = Rig::of_spec(&spec, &label)?;
    rig.of_one_signal().map_err(|e| e.at(&label, None))?;
    let options = context.prepared(&asked.common, Some(&mut spec))?;
    let of_calibration = |path: &PathBuf| -> Result<_, Error> {
        let calibration = context.calibration(path, options.force == Some(true))?;
        let like = planned::like(&calibration, &rig, gain, &path.display().to_string())?;
        Ok((like, calibration.checksum))
    };
    let like = asked.like.as_ref().map(of_calibration).transpose()?;
    let out = folder(options.out.as_ref(), &spec.name, "plan");
    context.warn_all(&spec.warnings);
    if options.plan == Some(true) {
        return Ok(Reply::planned(out, |to| format!("{}: would plan a calibration in {to}", spec.name)));
    }
    let checksum = like.as_ref().map(|l| l.1.clone());
    let of = json!({ "error": error, "positions": positions, "runs": runs, "place": place, "gain": gain, "relative": relative, "seed": seed, "like": checksum });
    let question = Question::of_scene("plan", &spec, of);
    let mut destination = context.open(&out, question, &FILES, options.force)?;
    let space = &spec.study.space;
    let found = planned::plan(&rig, space, &goal, like.map(|l| l.0), &opener(&options))?;
    let drive = rig.setup.drive;
    let unit = Unit::of_signal(rig.setup.signal);
    destination.table(table(&found, drive, unit)?)?;
    destination.table(errors(&found)?)?;
    destination.draw("plan.svg", || Ok(drawn(&found, drive, error)))?;
    let counts = json!({ "taps": found.taps.len(), "rows": found.rows.len() });
    let (result, answer, text) = (result(&found, drive), answer(&found, error), summary(&found, drive));
    let body = json!({ "result": result });
    let reply = Reply { answer, text, counts, result, ..Reply::default() };
    reply.filed_of(&spec, destination, body)
}

fn table(plan: &Planned, drive: Drive, unit: Unit) -> Result<Frame, Error> {
    let rows = plan.rows.iter().map(|row| {
        let u = row.drive.map_or(0.0, |j| plan.drives[j]);
        let a = rounded(plan.distances[row.distance]);
        [Field::from(row.run + 1), a.into(), u.into(), f64::NAN.into()]
    });
    framed("plan", &[drive.column(), unit.column()], rows)
}

/// Removes the rounding error of a sum: a multiple of 1e-6.
pub(super) fn rounded(a: f64) -> f64 {
    (a * 1e6).round() / 1e6
}

/// Expected errors after each number of taps: planned, and on even grids.
fn errors(plan: &Planned) -> Result<Frame, Error> {
    let of = |name: &'static str, all: &[(usize, f64)]| {
        all.iter().map(|(n, sigma)| [name.into(), Field::from(*n), (*sigma).into()]).collect::<Vec<_>>()
    };
    framed("plan_errors", &[], [of("planned", &plan.path), of("even", &plan.even)].concat())
}

fn result(plan: &Planned, drive: Drive) -> Value {
    let s = &plan.rig;
    let [noise, relative, position, visit, gain, zero] =
        [s.floor, s.relative, s.position, s.visit, s.gain, s.zero].map(f64::sqrt);
    let of_apart = |a: &Apart| {
        let tap =
            a.tap.map(|([at, u], error)| json!({ "a_mm": at, drive.column(): u, "standard_error": error }));
        json!({ "name": a.name, "other": a.other, "correlation": a.correlation, "standard_error": a.error.0, "unit": a.error.1, "tap": tap })
    };
    let positions: Vec<Value> =
        plan.used(0).into_iter().map(|(a, n)| json!({ "a_mm": rounded(a), "taps": n })).collect();
    let drives: Vec<Value> =
        plan.used(1).into_iter().map(|(u, n)| json!({ drive.column(): u, "taps": n })).collect();
    json!({
        "taps": plan.taps.len(),
        "sigma_mm": plan.sigma,
        "least_sigma_mm": plan.floor,
        "positions": positions,
        "drives": drives,
        "even_taps": plan.even_as_good(),
        "even_sigma_mm": plan.even_of_its_size(),
        "rig": { "noise": noise, "relative": relative, "position": position, "visit": visit, "gain": gain, "zero": zero },
        "not_told_apart": plan.apart.iter().map(of_apart).collect::<Vec<_>>(),
    })
}

fn answer(plan: &Planned, error: f64) -> String {
    let even = match (plan.even_as_good(), plan.even_of_its_size()) {
        (Some(n), _) => format!("An even grid needs {n} taps for that"),
        (None, Some(sigma)) => {
            let sigma = short(sigma);
            format!("No even grid of these drives reaches that; one of the same size leaves {sigma} mm")
        }
        (None, None) => "No even grid of these drives reaches that".to_owned(),
    };
    let runs = match plan.rows.iter().map(|r| r.run + 1).max().unwrap_or(1) {
        1 => "1 run".to_owned(),
        n => format!("{n} runs"),
    };
    let (taps, positions) = (plan.taps.len(), plan.used(0).len());
    let [sigma, error, floor] = [plan.sigma, error, plan.floor].map(short);
    format!(
        "{taps} taps at {positions} positions in {runs} leave an error of {sigma} mm ({error} mm asked for). {even}. {floor} mm are noise, position and run of the reading \
         itself, which no calibration takes away."
    )
}

fn summary(plan: &Planned, drive: Drive) -> String {
    let (symbol, unit) = drive_unit(drive);
    let mut text = String::new();
    let list = |all: Vec<(f64, usize)>| {
        let each: Vec<String> = all.into_iter().map(|(x, n)| format!("{} ({n})", rounded(x))).collect();
        each.join(", ")
    };
    let _ = writeln!(text, "positions, mm (taps at each): {}", list(plan.used(0)));
    let named = if unit.trim() == "mm" { "mm" } else { "degrees" };
    let _ = writeln!(text, "{symbol}, {named} (taps by each): {}", list(plan.used(1)));
    let beyond_plan =
        plan.path.iter().filter_map(|(n, sigma)| Some((n.checked_sub(plan.taps.len())?, sigma)));
    let doubling = beyond_plan.filter(|(more, _)| more.is_power_of_two());
    let more: Vec<String> = doubling.map(|(n, sigma)| format!("{n} more {} mm", short(*sigma))).collect();
    let _ = writeln!(text, "what further taps would bring: {}", more.join(", "));
    let [[a0, a1], [u0, u1]] = plan.ends;
    let beyond = |a: f64, u: f64| !((a0..=a1).contains(&a) && (u0..=u1).contains(&u));
    let [no, all] = plan.forbidden;
    if no > 0 {
        let [[a0, a1], [u0, u1]] = plan.reached.map(|ends| ends.map(rounded));
        let _ = writeln!(
            text,
            "{no} of {all} distances and drives of the spec are left out (next to the gauge, beyond the whisker, or above strain_limit): the \
             plan is for {a0} … {a1} mm and {symbol} = {u0} … {u1}{unit}"
        );
    }
    if plan.rows.iter().all(|r| r.run == 0) {
        text += "one run: how zero and gain differ in the next one will not be known, and σ of locate does not hold there\n";
    }
    for a in &plan.apart {
        let error = format!("{} {}", short(a.error.0), a.error.1);
        let what = match a.other {
            Some(other) => format!("cannot tell {other} and {} apart", a.name),
            None => format!("do not determine {}", a.name),
        };
        let _ = write!(text, "these taps {what} (error of {}: {})", a.name, error.trim());
        let Some(([at, u], after)) = a.tap else {
            text += "; no tap of this rig would: measure one of them by itself\n";
            continue;
        };
        let (off, after) = (if beyond(at, u) { " (beyond the spec)" } else { "" }, short(after));
        let _ = writeln!(
            text,
            ": as many at a = {at:.1} mm, {symbol} = {u:.2}{unit}{off} would bring it to {after}"
        );
    }
    text
}

fn drawn(plan: &Planned, drive: Drive, error: f64) -> Figure {
    let (symbol, unit) = drive_unit(drive);
    let points = |name: &str, colour, values: Vec<(f64, f64)>| {
        Mark::points(Drawn::new(name, colour, values), Marker::Circle)
    };
    let mut cells: IndexMap<[usize; 2], usize> = IndexMap::new();
    plan.taps.iter().for_each(|[i, j, _]| *cells.entry([*i, *j]).or_default() += 1);
    let mut where_ =
        Panel::new("where to tap, and how often", Axis::new("a", "mm"), Axis::new(symbol, unit.trim()));
    let times: BTreeSet<usize> = cells.values().copied().collect();
    for (colour, n) in times.into_iter().enumerate() {
        let of = cells.iter().filter(|(_, times)| **times == n);
        let values = of.map(|([i, j], _)| (plan.distances[*i], plan.drives[*j])).collect();
        where_ = where_.with(points(&format!("{n} ×"), colour % 6, values));
    }
    let line = |name: &str, colour, all: &[(usize, f64)]| {
        Mark::line(Drawn::new(name, colour, all.iter().map(|(n, s)| (*n as f64, *s))), 0)
    };
    let most = plan.path.last().map_or(1, |p| p.0).max(2 * plan.taps.len());
    let top = 6.0 * plan.sigma;
    let low = |all: &[(usize, f64)], most| -> Vec<(usize, f64)> {
        all.iter().copied().filter(|(n, sigma)| *n <= most && *sigma <= top).collect()
    };
    let (even, path) = (low(&plan.even, most), low(&plan.path, usize::MAX));
    let ends = [path.first().map_or(1, |p| p.0), most].map(|n| n as f64);
    let flat = |name: &str, colour, y: f64| Mark::line(Drawn::new(name, colour, ends.map(|x| (x, y))), 1);
    let what = Panel::new("what taps bring", Axis::new("taps", ""), Axis::log("expected error", "mm"))
        .with(line("planned", 0, &path))
        .with(line("even grid", 1, &even))
        .with(flat("asked for", 2, error))
        .with(flat("of the reading itself", 3, plan.floor))
        .with(points("this plan", 0, vec![(plan.taps.len() as f64, plan.sigma)]));
    let caption = "Taps of the planned calibration, and the root mean square error of a distance that is expected after so many taps (plan_errors.csv).";
    Figure::new("plan", "The planned calibration", caption, vec![where_, what])
}
