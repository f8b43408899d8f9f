//! Numbers of the rig from `learned`: gain, zero, offsets, and the parts of σ.

use serde::Serialize;
use serde_json::{Value, json};
use vibrissa_learned::columns::Term;

use crate::estimator::learnt::Learnt;
use crate::estimator::model::exact::Parameter;
use crate::scene::Drive;

const ALIKE: f64 = 0.95;

#[derive(Serialize)]
struct Number {
    #[serde(skip)]
    name: &'static str,
    value: f64,
    standard_error: f64,
    unit: &'static str,
    /// Tap that would separate it from the gain, if these data cannot.
    #[serde(skip)]
    alike: Option<&'static str>,
}

fn numbers(learnt: &Learnt, kind: Drive) -> Vec<Number> {
    let (c, scales) = (&learnt.fit.curve, &learnt.fit.curve.scales);
    let place = |term| c.terms.iter().position(|t| *t == term);
    let product = |i: usize, k: usize| c.deviations.iter().map(|d| d[i] * d[k]).sum::<f64>();
    let known = learnt.task.known.is_some();
    let gain = place(Term::Curve(0, 0)).filter(|_| known);
    let correlated = |gain: usize, k: usize| {
        k != gain && product(gain, k).abs() > ALIKE * (product(gain, gain) * product(k, k)).sqrt()
    };
    let mut all = Vec::new();
    let mut add = |name, term, found: Option<[f64; 2]>, unit, tells| {
        let alike = gain.zip(place(term)).is_some_and(|(gain, k)| correlated(gain, k)).then_some(tells);
        let number = |[value, standard_error]: [f64; 2]| Number { name, value, standard_error, unit, alike };
        all.extend(found.map(number));
    };
    if known {
        let of =
            |term, scale: f64, more: f64| c.coefficient(term).map(|[x, sd]| [x * scale + more, sd * scale]);
        let gain = Term::Curve(0, 0);
        add("gain", gain, of(gain, c.unit / c.base_unit, 0.0), "signal over that of the spec", "");
        let offset = Parameter::DriveOffset;
        let found = of(Term::OffsetU, scales.sizes[1], learnt.fit.base.offset());
        add(offset.name(kind), Term::OffsetU, found, offset.unit(kind), "taps at a drive half as large");
        let found = of(Term::OffsetA, scales.sizes[0], 0.0);
        add("a_offset", Term::OffsetA, found, "mm", "taps nearer to the base");
    }
    add("zero", Term::Zero, Some(c.zero()), "signal", "zero readings");
    all
}

/// Parts of σ in the middle of the data, as relative standard deviations of the signal.
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

pub fn json(learnt: &Learnt, kind: Drive) -> Value {
    let numbers = numbers(learnt, kind);
    let each: serde_json::Map<String, Value> =
        numbers.iter().map(|n| (n.name.to_owned(), json!(n))).collect();
    let budget: serde_json::Map<String, Value> =
        budget(learnt).into_iter().map(|(name, share)| (name.to_owned(), json!(share))).collect();
    let learned: serde_json::Map<String, Value> = learnt
        .fit
        .hypers
        .iter()
        .zip(&learnt.fit.at)
        .map(|(h, x)| (format!("{h:?}").to_lowercase(), json!(x.exp())))
        .collect();
    let alike = |n: &Number| Some(json!({ "gain_and": n.name, "tells": n.alike? }));
    let alike: Vec<Value> = numbers.iter().filter_map(alike).collect();
    json!({
        "numbers": each,
        "not_told_apart": alike,
        "runs": learnt.runs,
        "drift": learnt.task.drift,
        "share_of_signal": budget,
        "learned_numbers": learned,
    })
}

pub fn text(learnt: &Learnt, kind: Drive) -> Vec<String> {
    let numbers = numbers(learnt, kind);
    let mut lines: Vec<String> = numbers
        .iter()
        .filter(|n| n.name != "zero" || !learnt.zero_read)
        .map(|n| {
            format!("learned {:<13} {:.6e} ± {:.1e} {}", n.name, n.value, 2.0 * n.standard_error, n.unit)
        })
        .collect();
    let shares = budget(learnt).into_iter().filter(|(_, share)| *share > 0.0);
    let shares: Vec<String> = shares.map(|(name, share)| format!("{name} {:.2} %", 100.0 * share)).collect();
    lines.push(format!("σ of a reading in the middle, in shares of its signal: {}", shares.join(", ")));
    for (name, tells) in numbers.iter().filter_map(|n| Some((n.name, n.alike?))) {
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
