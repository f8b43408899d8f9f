//! The file in C: everything twice, for double and for float.

use super::pieces::Pieces;
use super::taps::Taps;
use super::text::{self, code, digits, number, short, wrapped};
use super::{Export, Form};
use crate::estimate::WIDENING;
use crate::estimator::learnt::why;
use crate::estimator::model::SAME;
use crate::estimator::model::polynomial::Polynomial;
use crate::locate::opened::BEYOND;
use crate::measure::Unit;
use vibrissa_learned::invert::{FAR, FINE, Inverse, Nothing, POINTS, QUANTILES, WIDE, node_weights};

const HEAD: &str = include_str!("template/head.c");
const TYPES: &str = include_str!("template/types.c");
const PIECES: &str = include_str!("template/pieces.c");
/// How a polynomial is read in double, and in float.
const DIRECT: [&str; 2] = [include_str!("template/direct.c"), include_str!("template/direct_float.c")];
const LEARNED: &str = include_str!("template/learned.c");
const LOCATE: &str = include_str!("template/locate.c");

const PIECE: &str = "typedef struct {
    REAL a, half, scale; /* distance at the middle, mm; half width of ln a; signal per drive there, about */
    int looks; /* steps in which roots are looked for: 1 where the signal rises, or falls, all over */
    int rows, columns, variance_rows, variance_columns, value, variance; /* series, and where they begin */
} piece_F;

typedef struct {
    REAL from, to; /* drives */
    int first, count; /* pieces, the farthest first */
} strip_F;
";
const POLYNOMIAL: &str = "typedef struct {
    REAL middle, half, drive_middle, drive_half, reach[2], sign;
    int degree, drive_degree, log_a, log_drive, coefficients, covariance;
} polynomial_F;
";
const TABLE: &str = "typedef struct {
    REAL from, step, first, last, fades; /* ln a of the table; its calibrated ends, and how the prior fades beyond */
    REAL offset, zero;                   /* what is added to the drive; signal without contact */
    int node_count, nodes, values, variances;
} learned_F;
";

/// Functions that end with the suffix of their number type.
const SHARED: [&str; 7] = ["exp", "fabs", "floor", "log", "sqrt", "vibrissa_locate", "vibrissa_taps"];

/// A number type of C.
#[derive(Clone, Copy)]
pub(super) struct Real {
    name: &'static str,
    /// What its functions of <math.h>, its numbers and the function that answers end with.
    suffix: &'static str,
    /// What all other names end with.
    own: &'static str,
    /// Relative slack of drives.
    pub(super) same: f64,
    /// Width of an interval of −1 … 1 that is not worth halving.
    small: f64,
}

pub(super) const REALS: [Real; 2] = [
    Real { name: "double", suffix: "", own: "_d", same: SAME, small: 4e-16 },
    Real { name: "float", suffix: "f", own: "_f", same: 1e-7, small: 1e-7 },
];

impl Real {
    pub(super) fn is_float(self) -> bool {
        self.name == "float"
    }

    pub(super) fn number(self, x: f64) -> String {
        if x.is_infinite() {
            return if x > 0.0 { "INFINITY".to_owned() } else { "-INFINITY".to_owned() };
        }
        match self.is_float() {
            false => number(x),
            // What is smaller than any float counts as 0.
            true if x.abs() < f64::from(f32::MIN_POSITIVE) => "0e0f".to_owned(),
            true => format!("{:e}f", x as f32),
        }
    }

    /// `code` with the names of this number type.
    pub(super) fn own_names(self, code: &str) -> String {
        let shared =
            |text: String, f: &&str| text.replace(&format!("{f}_F("), &format!("{f}{}(", self.suffix));
        SHARED.iter().fold(code.replace("REAL", self.name), shared).replace("_F", self.own)
    }

    pub(super) fn list(self, all: impl IntoIterator<Item = f64>) -> String {
        wrapped(all.into_iter().map(|x| self.number(x)), "    ")
    }
}

/// An array of `kind`, REAL or a name of the file.
fn array(kind: &str, name: &str, rows: &str) -> String {
    format!("\nstatic const {kind} {name}_F[] = {{\n{rows}\n}};\n")
}

/// The tables of the file, as they grow.
#[derive(Default)]
struct Tables {
    numbers: Vec<f64>,
    pieces: Vec<String>,
    strips: Vec<String>,
    polynomials: Vec<String>,
    learned: Vec<String>,
    /// Variances of what was learned, for both number types.
    variances: Vec<f64>,
    sides: Vec<String>,
    drives: Vec<f64>,
    bias: Vec<f64>,
    /// Most rows of a series, terms of a polynomial, nodes of what was learned.
    most: [usize; 3],
}

impl Tables {
    fn matrix(&mut self, rows: &[Vec<f64>], digits: impl Fn(f64) -> f64) -> usize {
        let at = self.numbers.len();
        self.numbers.extend(rows.iter().flatten().map(|x| digits(*x)));
        self.most[0] = self.most[0].max(rows.len());
        at
    }

    /// Strips of `all`; the first, and their number.
    fn add(&mut self, all: &Pieces, real: Real) -> (usize, usize) {
        let first = self.strips.len();
        for strip in &all.strips {
            let [from, to] = strip.drives.map(|d| real.number(d));
            let row = format!("    {{{from}, {to}, {}, {}}},", self.pieces.len(), strip.pieces.len());
            self.strips.push(row);
            for p in &strip.pieces {
                let value = self.matrix(&p.value, short);
                let variance = self.matrix(&p.variance, |x| x);
                let reals = [(p.a[0] * p.a[1]).sqrt(), p.half(), p.scale].map(|x| real.number(x)).join(", ");
                let of = [p.value.len(), p.value[0].len(), p.variance.len(), p.variance[0].len()];
                let (looks, of) = (p.looks, of.map(|n| n.to_string()).join(", "));
                self.pieces.push(format!("    {{{reals}, {looks}, {of}, {value}, {variance}}},"));
            }
        }
        (first, all.strips.len())
    }

    /// The number of a polynomial. Float reads that of double.
    fn direct(&mut self, p: &Polynomial, real: Real) -> usize {
        if real.is_float() {
            return 0;
        }
        let coefficients = self.numbers.len();
        self.numbers.extend(&p.coefficients);
        let covariance = self.numbers.len();
        self.numbers.extend(p.covariance.iter().flatten());
        self.most[1] = self.most[1].max(p.coefficients.len());
        let ([x, dx], [v, dv]) = (p.scale[0], p.scale[1]);
        let reals = [x.exp(), dx, v, dv].map(|x| real.number(x)).join(", ");
        let [lo, hi] = p.reach.map(|x| real.number(x));
        let f = p.form;
        self.polynomials.push(format!(
            "    {{{reals}, {{{lo}, {hi}}}, {}, {}, {}, {}, {}, {coefficients}, {covariance}}},",
            real.number(p.sign),
            f.degree,
            f.drive_degree,
            u8::from(f.log_a),
            u8::from(f.log_drive)
        ));
        self.polynomials.len() - 1
    }

    /// The number of what was learned.
    fn learned(&mut self, of: &Inverse, zero: f64, real: Real) -> usize {
        let n = of.nodes.len();
        let (nodes, variances) = (self.numbers.len(), self.variances.len());
        self.numbers.extend(&of.nodes);
        self.numbers.extend(node_weights(n));
        let values = self.numbers.len();
        self.numbers.extend(of.table.iter().flatten().map(|x| digits(x[0], 14)));
        self.variances.extend(of.table.iter().flatten().map(|x| digits(x[1] + x[2] + x[3], 5)));
        self.most[2] = self.most[2].max(n);
        let ([from, step], [first, last, fades]) = (of.grid, of.ends);
        let reals = [from, step, first, last, fades, of.offset, zero].map(|x| real.number(x)).join(", ");
        self.learned.push(format!("    {{{reals}, {n}, {nodes}, {values}, {variances}}},"));
        self.learned.len() - 1
    }

    fn text(&self, real: Real) -> String {
        let mut out = String::new();
        if !real.is_float() && !self.variances.is_empty() {
            let list = REALS[1].list(self.variances.iter().copied());
            out += &format!("static const float learned_variances[] = {{\n{list}\n}};\n\n");
        }
        if !self.learned.is_empty() {
            out += TABLE;
        }
        if !self.pieces.is_empty() {
            out += PIECE;
        }
        if !self.polynomials.is_empty() {
            out += POLYNOMIAL;
        }
        let rows = [
            ("piece_F", "pieces", &self.pieces),
            ("strip_F", "strips", &self.strips),
            ("polynomial_F", "polynomials", &self.polynomials),
            ("learned_F", "learneds", &self.learned),
            ("side_F", "sides", &self.sides),
        ];
        for (kind, name, rows) in rows.into_iter().filter(|r| !r.2.is_empty()) {
            out += &array(kind, name, &rows.join("\n"));
        }
        let numbers = [("drives", &self.drives), ("bias", &self.bias), ("numbers", &self.numbers)];
        for (name, all) in numbers.into_iter().filter(|n| !n.1.is_empty()) {
            out += &array("REAL", name, &real.list(all.iter().copied()));
        }
        out.trim_end().to_owned()
    }
}

impl Export<'_> {
    /// The file in C.
    pub(super) fn c(&self) -> String {
        let float = "; float: 2e-5 mm, more next to the peak of the signal";
        let mut out = HEAD
            .replace("@COMMENT", &text::c_comment(&self.comment(float)))
            .replace("@ZERO", &number(text::zero(self.locator)))
            .replace("@TOGETHER", &self.taps.as_ref().map_or(String::new(), Taps::c_head))
            .replace("@DRIVE", text::drive(self.locator))
            .replace("@UNIT", text::unit(self.locator));
        for real in REALS {
            out += &self.c_for(real);
        }
        out + "\n#endif\n"
    }

    fn c_for(&self, real: Real) -> String {
        let mut tables = Tables::default();
        for side in &self.sides {
            tables.side(self, side, real);
        }
        let [pieces, direct, learned] = self.kinds();
        let other = if learned { "by_posterior_F" } else { "direct_F" };
        let find = match (pieces, direct || learned) {
            (true, true) => format!("(side->count > 0 ? by_pieces_F : {other})(side, drive, size, &found)"),
            (true, false) => "by_pieces_F(side, drive, size, &found)".to_owned(),
            _ => format!("{other}(side, drive, size, &found)"),
        };
        let types = TYPES.replace("@TABLES", &tables.text(real));
        let strain = self.c_strain(real);
        let together = self.taps.as_ref().map_or(String::new(), |taps| taps.c(real));
        let code = [
            types.as_str(),
            if pieces { PIECES } else { "" },
            if direct { DIRECT[usize::from(real.is_float())] } else { "" },
            if learned { LEARNED } else { "" },
            strain.as_str(),
            LOCATE,
            together.as_str(),
        ];
        let code = code
            .concat()
            .replace("@PREPARE", &self.c_prepare(real))
            .replace("@FIND", &find)
            .replace("@NODES", &tables.most[2].to_string())
            .replace("@POINTS", &POINTS.to_string())
            .replace("@FINE", &FINE.to_string())
            .replace("@WIDE", &real.number(WIDE))
            .replace("@FAR", &real.number(FAR))
            .replace("@LOW", &real.number(QUANTILES[0]))
            .replace("@HALF", &real.number(QUANTILES[1]))
            .replace("@HIGH", &real.number(QUANTILES[2]))
            .replace("@TINY", &real.number(1e3 * real.small))
            .replace("@SIDES", &self.sides.len().to_string())
            .replace("@ROWS", &tables.most[0].to_string())
            .replace("@TERMS", &tables.most[1].to_string())
            .replace("@SMALL", &real.number(real.small))
            .replace("@SAME", &real.number(real.same))
            .replace("@BEYOND", &real.number(BEYOND))
            .replace("@NOISE", &real.number(self.locator.spread()))
            .replace("@LIMIT", &real.number(text::limit(self.locator, f64::NAN)));
        real.own_names(&code)
    }

    /// What makes a strain of a recorded value, where that is not linear.
    fn c_strain(&self, real: Real) -> String {
        if self.locator.unit != Unit::Bridge {
            return String::new();
        }
        let factor = real.number(self.locator.rig.setup.gauge.factor);
        format!(
            "\n/* Strain from the output of a quarter bridge, mV/V. */\nstatic REAL strain_F(REAL value)\n{{\n    \
             REAL v = value / 1000;\n    \
             return v < {} ? 4 * v / ({factor} * (1 - 2 * v)) : NAN;\n}}\n",
            real.number(0.5)
        )
    }

    fn c_prepare(&self, real: Real) -> String {
        let mut lines = Vec::new();
        if !self.locator.drive_recorded {
            lines.push("    drive = 1; /* it was not recorded when the whisker was calibrated */".to_owned());
        }
        if self.locator.drive_recorded && self.locator.drive_origin == 0.0 && self.sides.len() > 1 {
            lines.push("    drive = fabs_F(drive); /* below 0: to the other side */".to_owned());
        }
        if self.locator.drive_origin != 0.0 {
            let origin = real.number(self.locator.drive_origin);
            lines.push(format!("    drive -= {origin}; /* the drive that counts as 0 */"));
        }
        lines.push(match self.locator.unit {
            Unit::Strain | Unit::Reading | Unit::Moment | Unit::Force => "    signal -= zero;".to_owned(),
            Unit::Microstrain => format!("    signal = (signal - zero) * {};", real.number(1e-6)),
            Unit::Bridge => "    signal = strain_F(signal - zero);".to_owned(),
        });
        if let Some(below) = text::wraps(self.locator) {
            let [below, turn] = [below, 65536.0].map(|x| real.number(x));
            lines.push(format!(
                "    signal -= {turn} * floor_F((signal + {below}) / {turn}); /* counts of 16 bits begin anew */"
            ));
        }
        lines.join("\n")
    }
}

impl Tables {
    fn side(&mut self, export: &Export<'_>, side: &super::Side<'_>, real: Real) {
        let ((first, count), alone, [cut, weak, strong]) = match &side.form {
            Form::Direct(p) => ((self.direct(p, real), 0), 0.0, [0; 3]),
            Form::Learned { inverse, zero } => (
                (self.learned(inverse, *zero, real), 0),
                0.0,
                [0, code(why(Nothing::Weak)), code(why(Nothing::Strong))],
            ),
            Form::Inverted { pieces, cut, alone, without } => {
                let [weak, strong] = without.map(code);
                (self.add(pieces, real), *alone, [u8::from(*cut), weak, strong])
            }
        };
        let of = side.of;
        let [nearest, farthest] = of.distances;
        let [lo, hi] = [of.interest[0] * (1.0 - WIDENING), of.interest[1] * (1.0 + WIDENING)];
        let end_stop = of.end_stop * (1.0 - SAME);
        let n = |x: f64| real.number(x);
        let (sign, begin, drives) = (of.sign, self.drives.len(), of.drives.len());
        let reach = [nearest, farthest, WIDENING * farthest].map(n).join(", ");
        let [interest, ends] =
            [[lo, hi], [text::limit(export.locator, of.factor), end_stop]].map(|pair| pair.map(n).join(", "));
        self.sides.push(format!(
            "    {{{sign}, {first}, {count}, {begin}, {drives}, {reach}, {{{interest}}}, {ends}, {}, {cut}, {weak}, {strong}}},",
            n(alone)
        ));
        self.drives.extend(&of.drives);
        self.bias.extend(&of.bias);
    }
}
