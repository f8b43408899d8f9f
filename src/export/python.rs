//! The file in Python.

use super::pieces::{Piece, Pieces};
use super::text::{self, code, digits, number, short, wrapped};
use super::{Export, Form, Side};
use crate::estimate::WIDENING;
use crate::estimator::learnt::why;
use crate::estimator::model::SAME;
use crate::estimator::model::polynomial::Polynomial;
use crate::locate::opened::BEYOND;
use crate::measure::Unit;
use vibrissa_learned::invert::{FAR, FINE, Inverse, Nothing, QUANTILES, WIDE};

const WHOLE: &str = include_str!("template/locate.py");
const PIECES: &str = include_str!("template/pieces.py");
const LEARNED: &str = include_str!("template/learned.py");
const DIRECT: &str = include_str!("template/direct.py");

/// A list of numbers.
pub(super) fn list(all: &[f64]) -> String {
    format!("[{}]", all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "))
}

/// A list of lists, broken where lines end.
pub(super) fn rows(all: &[Vec<f64>]) -> String {
    let one = |row: &Vec<f64>| list(row);
    format!("[\n{}\n            ]", wrapped(all.iter().map(one), "                "))
}

/// A number, or that there is no end.
pub(super) fn infinite(x: f64) -> String {
    if x.is_finite() { number(x) } else { "inf".to_owned() }
}

fn word(b: bool) -> &'static str {
    if b { "True" } else { "False" }
}

fn piece(p: &Piece) -> String {
    let value: Vec<Vec<f64>> = p.value.iter().map(|r| r.iter().map(|x| short(*x)).collect()).collect();
    let reals = [(p.a[0] * p.a[1]).sqrt(), p.half(), p.scale].map(number).join(", ");
    format!("            ({reals}, {}, {}, {}),", p.looks, rows(&value), rows(&p.variance))
}

fn strips(all: &Pieces) -> String {
    let one = |s: &super::pieces::Strip| {
        let pieces = s.pieces.iter().map(piece).collect::<Vec<_>>().join("\n");
        let [from, to] = s.drives.map(number);
        format!("        ({from}, {to}, [\n{pieces}\n        ]),")
    };
    all.strips.iter().map(one).collect::<Vec<_>>().join("\n")
}

fn polynomial(p: &Polynomial) -> String {
    let (f, [[x, dx], [v, dv]]) = (p.form, p.scale);
    let entries = [
        ("middle", number(x.exp())),
        ("half", number(dx)),
        ("drive_middle", number(v)),
        ("drive_half", number(dv)),
        ("reach", list(&p.reach)),
        ("sign", number(p.sign)),
        ("degree", f.degree.to_string()),
        ("drive_degree", f.drive_degree.to_string()),
        ("log_a", word(f.log_a).to_owned()),
        ("log_drive", word(f.log_drive).to_owned()),
        ("coefficients", list(&p.coefficients)),
        ("covariance", rows(&p.covariance)),
    ];
    entries.map(|(key, value)| format!("        \"{key}\": {value},")).join("\n")
}

fn learned_table(of: &Inverse, zero: f64) -> String {
    let table = |f: &dyn Fn(&[f64; 4]) -> f64| {
        rows(&of.table.iter().map(|row| row.iter().map(f).collect()).collect::<Vec<_>>())
    };
    let ([from, step], [first, last, fades]) = (of.grid, of.ends);
    let numbers = [from, step, first, last, fades, of.offset, zero].map(number).join(", ");
    format!(
        "        \"if_weak\": {},\n        \"if_strong\": {},\n        # First ln a and its step, calibrated ends, how the prior fades beyond them, offset of \
         the drive, zero; ln u of the nodes, of each signal/u and its variance.\n        \"learned\": (\n            {numbers},\n            {},\n            {},\n            {},\n        ),",
        code(why(Nothing::Weak)),
        code(why(Nothing::Strong)),
        list(&of.nodes),
        table(&|x| digits(x[0], 14)),
        table(&|x| digits(x[1] + x[2] + x[3], 5)),
    )
}

impl Export<'_> {
    /// The file in Python.
    pub(super) fn python(&self) -> String {
        let [pieces, direct, learned] = self.kinds();
        let other = if learned { "by_posterior" } else { "direct" };
        let find = match (pieces, direct || learned) {
            (true, true) => format!("(by_pieces if \"strips\" in side else {other})(side, drive, size)"),
            (true, false) => "by_pieces(side, drive, size)".to_owned(),
            _ => format!("{other}(side, drive, size)"),
        };
        let of = |used: bool, text: &'static str| if used { text } else { "" };
        let finders = [of(pieces, PIECES), of(direct, DIRECT), of(learned, LEARNED)].concat();
        let finders = finders
            .replace("@FINE", &FINE.to_string())
            .replace("@WIDE", &number(WIDE))
            .replace("@FAR", &number(FAR))
            .replace("@QUANTILES", &list(&QUANTILES));
        let prepare = match (self.locator.drive_recorded, self.locator.drive_origin) {
            (true, 0.0) if self.sides.len() > 1 => {
                "    drive = abs(drive)  # below 0: to the other side".to_owned()
            }
            (true, 0.0) => String::new(),
            (true, origin) => format!("    drive -= {}  # the drive that counts as 0", number(origin)),
            (false, _) => "    drive = 1.0  # it was not recorded when the whisker was calibrated".to_owned(),
        };
        let [strain, above] = self.arithmetic();
        let mut learned_sides = 0..;
        let sides: Vec<String> = self.sides.iter().map(|s| self.side(s, &mut learned_sides)).collect();
        let limit = infinite(text::limit(self.locator, f64::NAN));
        WHOLE
            .replace("@COMMENT", &self.comment(""))
            .replace("@TABLES", &format!("SIDES = [\n{}\n]", sides.join("\n")))
            .replace("@FINDERS", &finders)
            .replace("@TOGETHER\n", &self.taps.as_ref().map_or(String::new(), |taps| taps.python()))
            .replace("@FINE", &FINE.to_string())
            .replace("@MORE", if learned { ", pi, sin" } else { "" })
            .replace("@PREPARE\n", &if prepare.is_empty() { String::new() } else { format!("{prepare}\n") })
            .replace("@FIND", &find)
            .replace("@STRAIN", &strain)
            .replace("@ABOVE", &above)
            .replace("@ZERO", &number(text::zero(self.locator)))
            .replace("@DRIVE", text::drive(self.locator))
            .replace("@UNIT", text::unit(self.locator))
            .replace("@LIMIT", &limit)
            .replace("@NOISE", &number(self.locator.spread()))
            .replace("@BEYOND", &number(BEYOND))
    }

    /// Strain of `value`, and what `signal` is above `zero`.
    fn arithmetic(&self) -> [String; 2] {
        let strain = match self.locator.unit {
            Unit::Strain | Unit::Reading | Unit::Moment | Unit::Force => "value".to_owned(),
            Unit::Microstrain => "value * 1e-6".to_owned(),
            Unit::Bridge => {
                let factor = number(self.locator.rig.setup.gauge.factor);
                format!("0.004 * value / ({factor} * (1.0 - 0.002 * value)) if value < 500.0 else inf - inf")
            }
        };
        let above = match text::wraps(self.locator) {
            Some(below) => format!("(strain(signal - zero) + {below:?}) % 65536.0 - {below:?}"),
            None => "strain(signal - zero)".to_owned(),
        };
        [strain, above]
    }

    fn side(&self, side: &Side<'_>, learned: &mut impl Iterator<Item = usize>) -> String {
        let of = side.of;
        let interest = [of.interest[0] * (1.0 - WIDENING), of.interest[1] * (1.0 + WIDENING)];
        let form = match &side.form {
            Form::Direct(p) => format!("        \"polynomial\": {{\n{}\n        }},", polynomial(p)),
            Form::Learned { inverse, zero } => {
                let k = learned.next().unwrap_or_default();
                let together = self.taps.as_ref().map_or(String::new(), |taps| taps.python_table(k));
                together + &learned_table(inverse, *zero)
            }
            Form::Inverted { pieces, cut, alone, without: [weak, strong] } => format!(
                "        \"cut\": {},\n        \"alone\": {},\n        \"if_weak\": {},\n        \"if_strong\": {},\n        \
                 # From drive, to drive, and from the farthest on: middle distance, half width of ln a, signal per drive, steps, ln of it, its variance.\n        \
                 \"strips\": [\n{}\n        ],",
                word(*cut),
                infinite(*alone),
                code(*weak),
                code(*strong),
                strips(pieces)
            ),
        };
        format!(
            "    {{\n        \"sign\": {},\n        \"distances\": {},\n        \"interest\": {},\n        \"rounding\": {},\n        \
             \"limit\": {},\n        \"end_stop\": {},\n        \"drives\": {},\n        \"bias\": {},\n{form}\n    }},",
            of.sign,
            list(&of.distances),
            list(&interest),
            number(WIDENING * of.distances[1]),
            infinite(text::limit(self.locator, of.factor)),
            infinite(of.end_stop * (1.0 - SAME)),
            list(&of.drives),
            list(&of.bias),
        )
    }
}
