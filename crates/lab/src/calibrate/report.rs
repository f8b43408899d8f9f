//! Report of a calibration as JSON and as text.

use serde_json::{Value, json};

use super::coverage::Covered;
use super::side::{KTable, SideResult};
use super::{Calibrated, Reason, learn};
use crate::error::InputError;
use crate::estimator::{Estimator, Parameter, fit::Fit, taps::Cell};
use crate::measure::{Data, Rig};
use crate::scene::{Drive, Signal};
use crate::statistics::{DistanceRow, Figures};

const LISTED: usize = 100;

/// The result object.
pub fn result(found: &Calibrated, rig: &Rig, covered: &Covered) -> Value {
    let Covered { positions, all, runs } = covered;
    let kind = rig.setup.drive;
    let c = &found.calibration;
    let suspect = found.taps.iter().filter_map(|t| Some((t, t.reason.as_ref().filter(|r| r.is_doubt())?)));
    let suspect = suspect.map(|(t, r)| json!({ "line": t.line, "reason": r.word(), "why": r.text(kind) }));
    let suspect: Vec<Value> = suspect.take(LISTED).collect();
    json!({
        "estimator": c.estimator,
        "noise": c.noise,
        "noise_from": c.noise_from,
        "signal": c.signal,
        "drive_recorded": c.drive_recorded,
        "zero": { "from": c.zero.from, "value": c.zero.value,
                  "error": Some(c.zero.unread()).filter(|error| *error > 0.0),
                  "readings": found.zero.count, "drift": if found.zero.count > 0 { json!(found.zero.drift()) } else { Value::Null } },
        "second": c.second,
        "suspects": suspect,
        "sides": found.sides.iter().map(|s| side(s, found, rig)).collect::<Vec<_>>(),
        "grouped": found.groups.each_ref().map(|g| json!({ "values": g.distinct, "groups": g.centres.len(), "centres": g.centres, "width": g.width })),
        "coverage": { "all": all.as_ref().map(|c| json!({ "n": c.n, "within_1": c.within_1, "interval": c.interval, "beyond_3": c.beyond_3 })),
                      "positions": positions,
                      "runs": runs.as_ref().map(|c| json!({ "n": c.n, "rms_mm": c.rms_mm, "within_1": c.within_1, "interval": c.interval, "beyond_3": c.beyond_3 })) },
        "warnings": found.warnings,
    })
}

/// Counts of rows.
pub fn counts(found: &Calibrated, data: &Data) -> Value {
    let mut reasons = std::collections::BTreeMap::<&str, usize>::new();
    let all = found.taps.iter().map(|t| &t.reason).chain(found.zeros.iter().map(|z| &z.reason));
    all.flatten().filter(|r| r.is_doubt()).for_each(|r: &Reason| *reasons.entry(r.word()).or_default() += 1);
    json!({
        "rows": data.rows.len(),
        "taps": found.taps.len(),
        "used": found.sides.iter().map(|s| s.used).sum::<usize>(),
        "zero_readings": found.zeros.len(),
        "suspect": reasons,
        "tilted": found.taps.iter().filter(|t| t.reason == Some(Reason::Tilted)).count(),
        "repeated_lines": found.taps.iter().filter(|t| t.twin.is_some()).count(),
    })
}

fn side(s: &SideResult, found: &Calibrated, rig: &Rig) -> Value {
    let (kind, noise) = (rig.setup.drive, found.calibration.noise);
    let common = s.common_errors(&Estimator::ALL);
    let one = |e: Estimator| {
        let (rms, answered) = s.rms(e);
        let (common, n) = common.iter().find(|of| of.0 == e).map_or((None, 0), |of| of.1);
        let why = s.record.no_exact.as_ref().filter(|_| e == Estimator::Exact);
        json!({ "calibrated": s.has(e), "why_not": why, "held_out_rms_mm": rms, "answered": answered, "asked": s.used,
                "held_out_rms_common_mm": common, "common": n })
    };
    let estimators: Value = Estimator::ALL.into_iter().map(|e| (e.word(), one(e))).collect();
    let best = if s.table.drives.len() > 1 && rig.known { best(s, kind, noise) } else { Value::Null };
    json!({
        "side": s.name(),
        "sign": s.learnt.sign,
        "used": s.used,
        "estimators": estimators,
        "best": best,
        "drives": if rig.known { drives(&s.table, Some((s, noise)), rig) } else { Vec::new() },
        "distances": if rig.known { distances(&s.table, rig) } else { Vec::new() },
        "with_suspects": s.with_suspects.as_ref().filter(|_| rig.known).map(|t| json!({
            "drives": drives(t, None, rig), "distances": distances(t, rig)
        })),
        "contradictions": s.contradictions,
        "learned": learn::json(&s.learnt, kind),
        "parameters": s.fit.as_ref().map(|f| parameters(f, kind, found.calibration.zero.unread())),
    })
}

struct AtDrive {
    drive: f64,
    row: Figures,
    bias: Option<f64>,
    total: Option<f64>,
    k_noise: f64,
}

fn at_drives(t: &KTable, noise: f64) -> Vec<AtDrive> {
    let at = |(j, drive): (usize, &f64)| {
        let row = t.by_drive[j].figures();
        let cells = || t.cells.iter().filter(|c| c.j == j);
        let m = cells().count() as f64;
        // Effect of the noise of cell means on the spread of K and on the estimates.
        let of_k = |c: &Cell| c.share * (noise * c.linear / (c.signal * c.signal)).powi(2);
        let k_noise = (cells().map(of_k).sum::<f64>() / m).sqrt();
        let left = cells().map(|c| c.share).sum::<f64>() / m;
        let bias = row.error_rms.zip(row.noise_rms).map(|(e, n)| (e * e - n * n * left).max(0.0).sqrt());
        let total = bias.zip(row.noise_rms).map(|(b, n)| b.hypot(n));
        AtDrive { drive: *drive, row, bias, total, k_noise }
    };
    t.drives.centres.iter().enumerate().map(at).collect()
}

fn best(s: &SideResult, kind: Drive, noise: f64) -> Value {
    let all = at_drives(&s.table, noise);
    let least = |f: &dyn Fn(&AtDrive) -> Option<f64>| {
        let known = all.iter().filter_map(|d| Some((d, f(d)?)));
        known.min_by(|x, y| x.1.total_cmp(&y.1)).map(|(d, _)| d)
    };
    let say = |d: Option<&AtDrive>| {
        d.map(|d| {
            let mut v = json!({ "K_sd": d.row.sd, "error_rms_mm": d.row.error_rms, "bias_rms_mm": d.bias,
                                "noise_rms_mm": d.row.noise_rms, "total_rms_mm": d.total });
            v[kind.column()] = d.drive.into();
            v
        })
    };
    let clean = |d: &AtDrive| d.row.sd.map(|k| (k * k - d.k_noise * d.k_noise).max(0.0).sqrt());
    json!({ "by_K_sd": say(least(&clean)), "without_noise": say(least(&|d| d.bias)), "with_noise": say(least(&|d| d.total)) })
}

fn drives(t: &KTable, of: Option<(&SideResult, f64)>, rig: &Rig) -> Vec<Value> {
    let unit = rig.k_unit();
    let noise = of.map_or(0.0, |of| of.1);
    let held: Vec<(&str, Vec<Option<f64>>)> =
        Estimator::ALL.into_iter().filter_map(|e| Some((e.word(), of?.0.rms_by_drive(e)?))).collect();
    let row = |(j, d): (usize, AtDrive)| {
        let row = &d.row;
        let mut v = json!({
            "n": row.n,
            "K_mean": row.mean.map(|m| (1.0 + m) * unit),
            "K_sd": row.sd.map(|k| k * unit),
            "error_rms_mm": row.error_rms,
            "error_max_mm": row.error_max,
            "error_mean_mm": row.error_mean,
            "status": row.status.to_string(),
        });
        v[rig.setup.drive.column()] = d.drive.into();
        if of.is_some() {
            v["noise_rms_mm"] = json!(row.noise_rms);
            v["bias_rms_mm"] = json!(d.bias);
            v["total_rms_mm"] = json!(d.total);
            v["held_out_rms_mm"] = held.iter().map(|(name, rms)| (*name, json!(rms[j]))).collect();
        }
        v
    };
    at_drives(t, noise).into_iter().enumerate().map(row).collect()
}

fn distances(t: &KTable, rig: &Rig) -> Vec<Value> {
    let unit = rig.k_unit();
    let row = |(a, DistanceRow { deviation: row, .. }): (&f64, &DistanceRow)| json!({ "a_mm": a, "n": row.n, "K_mean": row.mean().map(|m| (1.0 + m) * unit), "K_sd": row.sd().map(|s| s * unit) });
    t.distances.centres.iter().zip(&t.by_distance).map(row).collect()
}

/// Parameters of a fit; `zero` is the standard error of the zero.
pub(super) fn parameters(f: &Fit, kind: Drive, zero: f64) -> Value {
    let e = &f.exact;
    let errors = f.errors(zero);
    let error = |i: usize| e.covariance[i][i].max(0.0).sqrt();
    let fitted = |(i, p): (usize, &Parameter)| {
        let other = |k: usize| Some(e.covariance[i][k] / (error(i) * error(k))).filter(|c| c.is_finite());
        let others = (0..e.fitted.len()).filter(|k| *k != i);
        let correlations: Value = others.map(|k| (e.fitted[k].name(kind), json!(other(k)))).collect();
        let (value, [lo, hi]) = (e.values[*p as usize], p.domain());
        json!({ "name": p.name(kind), "unit": p.unit(kind), "value": value, "standard_error": errors[i],
                "correlations": correlations, "at_bound": value == lo || value == hi })
    };
    let fitted: Vec<Value> = e.fitted.iter().enumerate().map(fitted).collect();
    let held = |p: &Parameter| json!({ "name": p.name(kind), "unit": p.unit(kind), "held_at": e.values[*p as usize] });
    let held: Vec<Value> = f.undetermined.iter().map(held).collect();
    json!({ "fitted": fitted, "undetermined": held, "chi2_per_freedom": Some(f.chi2).filter(|c| c.is_finite()),
            "misfit": f.misfit, "interpolation_error": e.surface.error })
}

/// Parameters of a fit as text, one per line; `zero` is the standard error of the zero.
pub fn fitted(f: &Fit, kind: Drive, zero: f64) -> Vec<String> {
    let value = |p: &Parameter| f.exact.values[*p as usize];
    let told = f.exact.fitted.iter().zip(f.errors(zero));
    let told =
        told.map(|(p, error)| format!("{:<13} {:.6} ± {error:.1e} {}", p.name(kind), value(p), p.unit(kind)));
    let held = f.undetermined.iter().map(|p| {
        format!("{:<13} not determined by these data, held at {} {}", p.name(kind), value(p), p.unit(kind))
    });
    told.chain(held).collect()
}

/// Summary as text.
pub fn text(found: &Calibrated, data: &Data, rig: &Rig, covered: &Covered) -> String {
    let mut lines = Vec::new();
    let kind = rig.setup.drive;
    let (symbol, degree) = crate::sink::table::drive_unit(kind);
    let unit = match data.unit.signal() {
        Some(Signal::Strain) => format!("{:.3} µε", 1e6 * found.calibration.noise),
        Some(other) => format!("{:.4e} {}", found.calibration.noise, other.unit()),
        None => format!("{:.4e}", found.calibration.noise),
    };
    let used: usize = found.sides.iter().map(|s| s.used).sum();
    let (taps, zeros, from) = (found.taps.len(), found.zeros.len(), &found.calibration.noise_from);
    lines.push(format!(
        "{used} of {taps} taps used, {zeros} zero readings; noise of one reading {unit} from {from}"
    ));
    if let Some(second) = &found.calibration.second {
        let error = |sigma: f64, digits: usize| match sigma > 0.0 {
            true => format!(" ± {sigma:.digits$}"),
            false => " (that of the first)".to_owned(),
        };
        let (rows, factor, angle) = (second.rows, second.factor, second.misalignment_deg);
        let (of_factor, of_angle) = (error(second.sigma_factor, 5), error(second.sigma_misalignment_deg, 3));
        lines.push(format!(
            "second gauge, from {rows} rows: factor {factor:.5}{of_factor}, {angle:.3}{of_angle}° further than 90°"
        ));
    }
    for s in &found.sides {
        let [first, last] = s.record.distances_mm.map(short);
        let ends = s.table.drives.ends().map(short);
        let drives = match (found.calibration.drive_recorded, s.table.drives.len()) {
            (false, _) => "one drive that nobody recorded".to_owned(),
            (true, 1) => format!("{symbol} = {}{degree}", ends[0]),
            (true, n) => format!("{n} {symbol} values {} … {}{degree}", ends[0], ends[1]),
        };
        let n = s.table.distances.len();
        lines.push(format!("{} side: {n} distances {first} … {last} mm, {drives}", s.name()));
        let common = s.common_errors(&Estimator::ALL);
        let n = common.first().map_or(0, |of| of.1.1);
        lines.push(format!(
            "  rms error on distances left out: of the taps answered, of the {n} that all estimators answer"
        ));
        for e in Estimator::ALL.into_iter().filter(|e| s.has(*e)) {
            let Some((held, (_, (common, _)))) = s.held_out(e).zip(common.iter().find(|of| of.0 == e)) else {
                lines.push(format!("  {:<13} cannot answer a distance left out", e.word()));
                continue;
            };
            let mm = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.4} mm"));
            let (all, answered) = held.rms(|_| true);
            let mark = if e == found.winner { "  <- default" } else { "" };
            let (word, all, common) = (e.word(), mm(all), mm(*common));
            lines.push(format!("  {word:<13} {all:>10} of {answered:<7} {common:>10}{mark}"));
        }
        let why_not = s.record.no_exact.iter();
        lines.extend(why_not.map(|why| format!("  {:<13} not calibrated: {why}", Estimator::Exact.word())));
        let fits = s.fit.iter().flat_map(|f| fitted(f, kind, found.calibration.zero.unread()));
        lines.extend(learn::text(&s.learnt, kind).into_iter().chain(fits).map(|line| format!("  {line}")));
        if s.table.drives.len() > 1 && rig.known {
            let b = best(s, kind, found.calibration.noise);
            let drive = |at: &Value| at[kind.column()].as_f64().map_or("?".to_owned(), |x| x.to_string());
            let (at, without) = (&b["with_noise"], drive(&b["without_noise"]));
            let rms = at["total_rms_mm"].as_f64().map_or("?".to_owned(), |x| format!("{x:.4}"));
            let with = format!("{}{degree} ({rms} mm rms)", drive(at));
            lines.push(format!(
                "  best {symbol} of the paper's procedure: {without} without noise, {with} with it"
            ));
        }
    }
    for (what, c) in [("distances", &covered.all), ("runs", &covered.runs)] {
        let Some(c) = c else { continue };
        let [within, low, high] = [c.within_1, c.interval[0], c.interval[1]].map(|x| (100.0 * x).round());
        let (n, beyond) = (c.n, 100.0 * c.beyond_3);
        lines.push(format!(
            "σ against errors on {what} left out: {within} % of {n} within 1 σ ({low} … {high} % at 95 %), {beyond:.1} % beyond 3 σ"
        ));
    }
    lines.join("\n") + "\n"
}

fn short(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// Parameters by their user-visible names.
pub fn named_parameters(names: &[String], kind: Drive) -> Result<Vec<Parameter>, InputError> {
    let one = |name: &String| {
        Parameter::named(name, kind).ok_or_else(|| {
            let known = Parameter::ALL.iter().map(|p| p.name(kind)).collect::<Vec<_>>().join(", ");
            InputError::new("there is no such parameter").key("--fit").value(name).allowed(known)
        })
    };
    names.iter().map(one).collect()
}
