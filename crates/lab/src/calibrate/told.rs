//! What `learned` says of the rig beside distances: gain, zero, offsets, and of what σ is made.

use serde_json::{Value, json};
use vibrissa_learned::columns::Term;

use crate::estimator::learnt::Learnt;
use crate::scene::Drive;

/// Two numbers whose errors are correlated by more than this are not told apart.
const ALIKE: f64 = 0.95;

/// A number of the rig, its standard error and its unit.
struct Number {
    name: &'static str,
    term: Term,
    value: f64,
    error: f64,
    unit: &'static str,
    /// What would tell it from the gain.
    tells: &'static str,
}

fn numbers(learnt: &Learnt, kind: Drive) -> Vec<Number> {
    let (c, scales) = (&learnt.fit.curve, &learnt.fit.curve.scales);
    let of = |term, scale: f64, more: f64| c.coefficient(term).map(|[x, sd]| [x * scale + more, sd * scale]);
    let mut all = Vec::new();
    let mut add = |name, term, found: Option<[f64; 2]>, unit, tells| {
        all.extend(found.map(|[value, error]| Number { name, term, value, error, unit, tells }));
    };
    let gain = Term::Curve(0, 0);
    let per = "signal over that of the spec";
    if learnt.task.known.is_some() {
        add("gain", gain, of(gain, c.unit / c.base_unit, 0.0), per, "");
        let (name, unit) = match kind {
            Drive::Angle => ("theta_offset", "degrees"),
            Drive::Displacement => ("delta_offset", "mm"),
        };
        let offset = of(Term::OffsetU, scales.sizes[1], learnt.fit.base.offset());
        add(name, Term::OffsetU, offset, unit, "taps at a drive half as large");
        let offset = of(Term::OffsetA, scales.sizes[0], 0.0);
        add("a_offset", Term::OffsetA, offset, "mm", "taps nearer to the base");
    }
    let [zero, error] = c.zero();
    add("zero", Term::Zero, Some([zero, error]), "signal", "zero readings");
    all
}

/// Names of numbers that these data cannot tell from the gain, and what would.
fn alike(learnt: &Learnt, numbers: &[Number]) -> Vec<(&'static str, &'static str)> {
    let c = &learnt.fit.curve;
    let place = |term| c.terms.iter().position(|t| *t == term);
    let Some(gain) = place(Term::Curve(0, 0)).filter(|_| learnt.task.known.is_some()) else {
        return Vec::new();
    };
    let product = |i: usize, k: usize| c.deviations.iter().map(|d| d[i] * d[k]).sum::<f64>();
    let correlated = |n: &&Number| {
        place(n.term)
            .filter(|k| *k != gain)
            .is_some_and(|k| product(gain, k).abs() > ALIKE * (product(gain, gain) * product(k, k)).sqrt())
    };
    numbers.iter().filter(correlated).map(|n| (n.name, n.tells)).collect()
}

/// What σ is made of in the middle of the data, as standard deviations of the signal in shares of it.
fn budget(learnt: &Learnt) -> [(&'static str, f64); 4] {
    let scales = &learnt.fit.curve.scales;
    let (a, u) = (scales.a[0].exp(), scales.u[0].exp() - scales.offset);
    let e = learnt.expected(a, u);
    let share = |variance: f64| (variance / (e.signal * e.signal)).sqrt();
    [
        ("noise", share(e.of_noise)),
        ("calibration", share(e.of_curve)),
        ("position", share(e.of_position)),
        ("run", share(e.of_run)),
    ]
}

/// For JSON.
pub fn json(learnt: &Learnt, kind: Drive) -> Value {
    let numbers = numbers(learnt, kind);
    let each: serde_json::Map<String, Value> = numbers
        .iter()
        .map(|n| (n.name.to_owned(), json!({ "value": n.value, "standard_error": n.error, "unit": n.unit })))
        .collect();
    let budget: serde_json::Map<String, Value> =
        budget(learnt).into_iter().map(|(name, share)| (name.to_owned(), json!(share))).collect();
    let learned: serde_json::Map<String, Value> = learnt
        .fit
        .hypers
        .iter()
        .zip(&learnt.fit.at)
        .map(|(h, x)| (format!("{h:?}").to_lowercase(), json!(x.exp())))
        .collect();
    let alike: Vec<Value> = alike(learnt, &numbers)
        .into_iter()
        .map(|(name, tells)| json!({ "gain_and": name, "tells": tells }))
        .collect();
    json!({
        "numbers": each,
        "not_told_apart": alike,
        "runs": learnt.runs,
        "drift": learnt.task.drift,
        "share_of_signal": budget,
        "learned_numbers": learned,
    })
}

/// For people.
pub fn text(learnt: &Learnt, kind: Drive) -> Vec<String> {
    let numbers = numbers(learnt, kind);
    let mut lines: Vec<String> = numbers
        .iter()
        .filter(|n| n.name != "zero" || !learnt.zero_read)
        .map(|n| format!("learned {:<13} {:.6e} ± {:.1e} {}", n.name, n.value, 2.0 * n.error, n.unit))
        .collect();
    let shares = budget(learnt).into_iter().filter(|(_, share)| *share > 0.0);
    let shares: Vec<String> = shares.map(|(name, share)| format!("{name} {:.2} %", 100.0 * share)).collect();
    lines.push(format!("σ of a reading in the middle, in shares of its signal: {}", shares.join(", ")));
    for (name, tells) in alike(learnt, &numbers) {
        lines.push(format!("these data cannot tell gain and {name} apart: {tells} would"));
    }
    if learnt.runs < 2 {
        lines.push(
            "one run: σ holds for it; a second (column run) would tell how zero and gain change between runs"
                .to_owned(),
        );
    }
    lines
}
