//! What a census finds wrong, in words.

use std::fmt::Write;

use vibrissa::scene::Tuple;
use vibrissa::verify::write::other_words;
use vibrissa::verify::{FORCE, Line, QUANTITIES};

/// Which bounds are broken, and where: the three worst lines in full.
pub fn broken(lines: &[Line], places: &[String]) -> Option<String> {
    let mut bad: Vec<&Line> = lines.iter().filter(|l| !l.faults().is_empty()).collect();
    if bad.is_empty() {
        return None;
    }
    let excess = |l: &Line| l.errors[0].map_or(0.0, |f| f.worst / l.bound);
    bad.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
    let mut text = format!("{} of {} lines of the census break a bound", bad.len(), lines.len());
    for line in bad.iter().take(3) {
        let _ = write!(text, "\n  {} on {}: ", line.configuration, places[line.place]);
        let parts: Vec<String> = line.faults().iter().map(|word| fault(line, word)).collect();
        text.push_str(&parts.join("; "));
    }
    if bad.len() > 3 {
        let _ = write!(text, "\n  and {} more: see the column verdict of verify.csv", bad.len() - 3);
    }
    Some(text)
}

/// One fault in words.
fn fault(line: &Line, word: &str) -> String {
    let odd = || match line.odd {
        Some((tuple, ..)) => format!(" at {}, {}", place(line, &tuple), other_words(line)),
        None => String::new(),
    };
    match (word, QUANTITIES.iter().position(|q| *q == word)) {
        (_, Some(k)) => {
            let f = line.errors[k].expect("a quantity at fault has figures");
            let at =
                line.at.filter(|_| k == 0).map_or(String::new(), |(t, _)| format!(" at {}", place(line, &t)));
            let bound = line.bound * if k < 2 { 1.0 } else { FORCE };
            format!("{word} error {:.2e} > {bound:.1e}, {} of {} taps{at}", f.worst, f.over, line.compared)
        }
        ("status", _) => format!("other words on {} taps{}", line.differ, odd()),
        ("unsolved", _) => {
            let (given_up, left) = (line.unsolved, line.referred);
            format!("{given_up} of {} taps not_converged, {left} left to the reference{}", line.taps, odd())
        }
        ("unanswered", _) => format!("{} taps solved without an answer of the reference", line.unanswered),
        _ => "nothing was compared".to_owned(),
    }
}

/// `D_mm=10 d_mm=4 …`.
fn place(line: &Line, t: &Tuple) -> String {
    let names = ["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", line.drive.column()];
    let parts: Vec<String> = names.iter().zip(t.to_array()).map(|(n, x)| format!("{n}={x}")).collect();
    parts.join(" ")
}
