//! A calibration as one C file without dependencies that answers as `locate` does: a table of drive × reading → distance and σ for every estimator.
//! Its error against `locate` is measured between the nodes of the table and written into the file: its comment, its table, and its functions for double
//! and float.

use grid::{FIRST, POINTS, Side, Strip};

use crate::error::{Error, InputError};
use crate::locate::{Calibration, Locator};
use crate::measure::{TaredBy, Unit};
use crate::scene::{Drive, Signal};
use crate::{estimate::WIDENING, estimator::SAME, locate::calibration::BEYOND, status::Status};
pub use grid::Off;

mod grid;

pub const FILE: &str = "locate.c";

const LARGEST: Off = Off { distance: 1e-3, sigma: 0.02, rest: [0.25, 0.5] };

pub struct Export<'a> {
    locator: &'a Locator,
    calibration: &'a Calibration,
    sides: Vec<Side<'a>>,
    /// Largest differences to `locate` at double precision.
    pub off: Off,
}

impl<'a> Export<'a> {
    /// Export of `locator`, which was opened from `calibration`.
    /// Errors: a calibration of two signals; an estimator that is not smooth enough, or has no answer at some drive.
    pub fn new(locator: &'a Locator, calibration: &'a Calibration) -> Result<Self, Error> {
        if locator.is_twofold() {
            let message = "the file answers one signal, and this calibration is of two: distance and tilt take the model itself";
            let error = InputError::new(message).key("--export").value("a calibration with [second]");
            return Err(error.allowed("a calibration of one gauge (no second = true in [gauge])").into());
        }
        let refused = |e: InputError| {
            let message = format!("{} cannot be written as a table: {}", locator.estimator.word(), e.message);
            let error = InputError { message, ..e }.key("--export").value(locator.estimator.word());
            error.allowed("another estimator (--estimator), or the program itself (vibrissa locate)")
        };
        let length = if locator.rig.known { locator.rig.design.tuple.L_a } else { 0.0 };
        let mut export = Self { locator, calibration, sides: Vec::new(), off: Off::default() };
        for of in &locator.sides {
            let (side, off) = Side::new(locator, of, length).map_err(refused)?;
            export.sides.push(side);
            export.off = export.off.or(off);
        }
        match export.off.is_within(LARGEST) {
            true => Ok(export),
            false => Err(refused(InputError::new(format!("it would be off by up to {}", export.off))).into()),
        }
    }
}

const HEAD: &str = include_str!("template/head.c");
const LOCATE: &str = include_str!("template/locate.c");

/// Functions whose names take the suffix of the number type.
const SHARED: [&str; 6] = ["cos", "fabs", "floor", "log", "sqrt", "vibrissa_locate"];

#[derive(Clone, Copy)]
struct Real {
    name: &'static str,
    /// Suffix of <math.h>, of `vibrissa_locate`, and of numbers.
    suffix: &'static str,
    /// Suffix of all other names.
    own: &'static str,
    same: f64,
}

const REALS: [Real; 2] = [
    Real { name: "double", suffix: "", own: "_d", same: SAME },
    Real { name: "float", suffix: "f", own: "_f", same: 1e-7 },
];

impl Real {
    fn number(self, x: f64) -> String {
        match self.suffix {
            _ if x.is_infinite() => if x > 0.0 { "INFINITY" } else { "-INFINITY" }.to_owned(),
            "" => format!("{x:e}"),
            suffix => format!("{:e}{suffix}", x as f32),
        }
    }
}

fn wrapped(parts: impl IntoIterator<Item = String>) -> String {
    let mut lines: Vec<String> = Vec::new();
    for part in parts {
        match lines.last_mut().filter(|line| line.len() + part.len() < 110) {
            Some(line) => *line += &format!(" {part},"),
            None => lines.push(format!("    {part},")),
        }
    }
    lines.join("\n")
}

/// File name, safe in a comment of C.
fn harmless(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-/ ".contains(c) { c } else { '_' }).collect()
}

fn code(status: Status) -> u8 {
    let [limit, outside] = [Status::STRAIN_LIMIT, Status::OUTSIDE_CALIBRATION];
    let bits = [Status::NO_STRAIN, limit, Status::NO_ROOT, Status::AMBIGUOUS, outside, Status::BAD_INPUT];
    (0..).zip(bits).filter(|(_, s)| status.has(*s)).map(|(bit, _)| 1 << bit).sum()
}

fn unit(locator: &Locator) -> &'static str {
    match locator.unit {
        Unit::Strain => "strain, tension positive",
        Unit::Microstrain => "microstrain, tension positive",
        Unit::Bridge => "mV/V of a quarter bridge, tension positive",
        Unit::Reading => "the reading of the calibration",
        Unit::Moment => "N mm, the moment on the root, counterclockwise",
        Unit::Force => "N, the force on the root, towards the object",
    }
}

fn drive(locator: &Locator) -> &'static str {
    match (locator.drive_recorded, locator.rig.setup.drive) {
        (false, _) => "was not recorded and is ignored",
        (true, Drive::Angle) => "tap angle, degrees",
        (true, Drive::Displacement) => "displacement, mm",
    }
}

/// |recorded value| of a strain or reading of this sign.
fn size(locator: &Locator, sign: f64, strain: f64) -> f64 {
    let value = locator.unit.value(sign * strain, locator.rig.setup.gauge.factor).abs();
    if strain.is_finite() { value } else { f64::INFINITY }
}

/// |signal| of the strain limit on a side with `factor` readings per strain; infinite if unknown.
fn limit(locator: &Locator, sign: f64, factor: f64) -> f64 {
    let limit = locator.rig.strain_limit() * if locator.unit.is_absolute() { 1.0 } else { factor.abs() };
    if locator.rig.setup.signal == Signal::Strain { size(locator, sign, limit) } else { f64::INFINITY }
}

impl Export<'_> {
    pub fn text(&self) -> String {
        let values = self.sides.iter().flat_map(|side| &side.strips).flat_map(|s| s.values.iter().flatten());
        // Rounded far below the error of the table.
        let value = |[a, sigma]: &[f64; 2]| [format!("{:.6}", a), format!("{:.5e}", sigma)];
        let values = wrapped(values.flatten().flat_map(value));
        let tared = &self.locator.zero;
        let zero = if tared.from == TaredBy::Fitted { tared.value } else { 0.0 };
        let zero = self.locator.unit.value(zero, self.locator.rig.setup.gauge.factor);
        let (l, c, t) = (self.locator, self.calibration, &self.locator.rig.design.tuple);
        let whisker = format!(
            "   whisker      D = {} mm, d = {} mm, L_a = {} mm; gauge x_ss = {} mm, l = {} mm\n",
            t.D, t.d, t.L_a, t.x_ss, t.l
        );
        let domains: Vec<String> = self.sides.iter().map(|side| self.domain(side)).collect();
        let head = HEAD
            .replace("@VERSION", &c.version)
            .replace("@ESTIMATOR", l.estimator.word())
            .replace("@WHISKER", if l.rig.known { &whisker } else { "" })
            .replace("@UNIT", unit(l))
            .replace("@DRIVE", drive(l))
            .replace("@DOMAINS", &domains.join("\n   "))
            .replace("@NOISE", &format!("{:.3e} {}", l.noise, l.unit.common()))
            .replace("@BEYOND", &BEYOND.to_string())
            .replace("@OFF", &self.off.to_string().replace("; ", ";\n                "))
            .replace("@DATA", &format!("{}, SHA-256 {}", harmless(&c.data.file), harmless(&c.data.hash)))
            .replace("@CHECKSUM", &harmless(&c.checksum))
            .replace("@ZERO", &format!("{zero:e}"))
            .replace("@VALUES", &values);
        head + &REALS.map(|real| self.code(real)).concat() + "\n#endif\n"
    }

    fn domain(&self, side: &Side<'_>) -> String {
        let ([lo, hi], drives) = (side.of.distances, &side.of.drives);
        let sign = if side.of.sign > 0.0 { "signal > 0  " } else { "signal < 0  " };
        let unit = if self.locator.rig.setup.drive == Drive::Angle { "degrees" } else { "mm" };
        let origin = self.locator.drive_origin;
        let [first, last] = [drives[0], drives[drives.len() - 1]].map(|u| origin + u);
        let drives = format!(", drives {first} ... {last} {unit}");
        let drives = if self.locator.drive_recorded { drives.as_str() } else { "" };
        let [nearest, farthest] = side.reach;
        format!(
            "{sign} distances {lo} ... {hi} mm{drives}; none is given below {nearest:.2} mm, nor beyond {farthest:.2} mm"
        )
    }

    fn code(&self, real: Real) -> String {
        let n = |x: f64| real.number(x);
        let strips: Vec<_> = self.sides.iter().flat_map(|side| &side.strips).collect();
        let (mut heads, mut values) = (0, 0);
        let strip = |strip: &&Strip| {
            let ([from, to], rows) = (strip.drives.map(n), strip.heads.len());
            let (parts, cells) = (strip.values[0].len(), strip.values[0][0].len() - 1);
            let scale = n(strip.scale());
            let line = format!("    {{{from}, {to}, {scale}, {rows}, {parts}, {cells}, {heads}, {values}}},");
            heads += rows * strip.heads[0].len();
            values += strip.count();
            line
        };
        let rows: Vec<String> = strips.iter().map(strip).collect();
        let sides = [-1.0, 1.0].map(|sign| self.side(sign, real)).join("\n");
        let head = |s: &&Strip| {
            let of = |(i, x): (usize, &f64)| n(if i % 3 == 0 { x - s.scale().ln() } else { *x });
            s.heads.iter().flat_map(|row| row.iter().enumerate().map(of)).collect::<Vec<_>>()
        };
        let numbers = wrapped(strips.iter().flat_map(head));
        let tables =
            [("side_F", "sides", sides), ("strip_F", "strips", rows.join("\n")), ("REAL", "heads", numbers)]
                .map(|(kind, name, rows)| format!("static const {kind} {name}_F[] = {{\n{rows}\n}};\n"));
        let most = |f: fn(&Strip) -> usize| strips.iter().map(|s| f(s)).max().unwrap_or(1).to_string();
        let code = LOCATE
            .replace("@TABLES", &tables.join("\n"))
            .replace("@PREPARE", &self.prepare(real))
            .replace("@NODES", &most(|s| s.heads.len().max(POINTS)))
            .replace("@POINTS", &POINTS.to_string())
            .replace("@HEADS", &most(|s| s.heads[0].len()))
            .replace("@PI", &n(std::f64::consts::PI))
            .replace("@FIRST", &n(FIRST))
            .replace("@SAME", &n(real.same))
            .replace("@BEYOND", &n(BEYOND));
        let shared =
            |text: String, f: &&str| text.replace(&format!("{f}_F("), &format!("{f}{}(", real.suffix));
        SHARED.iter().fold(code.replace("REAL", real.name), shared).replace("_F", real.own)
    }

    /// Row of `sides` for this sign; without strips if the side has no answer.
    fn side(&self, sign: f64, real: Real) -> String {
        let n = |x: f64| real.number(x);
        let Some(k) = self.sides.iter().position(|side| side.of.sign == sign) else {
            return format!("    {{0, 0, 0, 0, 0, {}, 0, 0, 0}},", n(limit(self.locator, sign, f64::NAN)));
        };
        let first: usize = self.sides[..k].iter().map(|side| side.strips.len()).sum();
        let Side { of, strips, without, .. } = &self.sides[k];
        let [nearest, farthest] = of.distances;
        let ends =
            [limit(self.locator, sign, of.factor), size(self.locator, sign, of.end_stop * (1.0 - SAME))];
        let reals = [nearest, farthest, WIDENING * farthest, ends[0], ends[1]].map(n).join(", ");
        format!("    {{{first}, {}, {reals}, {}, {}}},", strips.len(), code(without[0]), code(without[1]))
    }

    /// Lines of C that convert the arguments to the drive and signal of the table.
    fn prepare(&self, real: Real) -> String {
        let (l, n) = (self.locator, |x: f64| real.number(x));
        let lean = if let [one] = &l.sides[..] { one.sign } else { 0.0 };
        let [below, turn] = [crate::measure::counts::below(lean), 65536.0].map(n);
        let mirrored = l.drive_recorded && l.drive_origin == 0.0 && self.sides.len() > 1;
        let (unknown, moved, bridge) = (!l.drive_recorded, l.drive_origin != 0.0, l.unit == Unit::Bridge);
        let lines = [
            (unknown, "drive = 1; /* it was not recorded when the whisker was calibrated */"),
            (mirrored, "drive = fabs_F(drive); /* below 0: to the other side */"),
            (moved, "drive -= @ORIGIN; /* the drive that counts as 0 */"),
            (true, "signal -= zero;"),
            (bridge, "signal = (signal < @MOST) ? signal : NAN; /* no quarter bridge gives more */"),
            (
                l.zero.wraps,
                "signal -= @TURN * floor_F((signal + @BELOW) / @TURN); /* counts of 16 bits begin anew */",
            ),
        ];
        let held = lines.into_iter().filter(|(holds, _)| *holds).map(|(_, line)| format!("    {line}"));
        let code = held.collect::<Vec<_>>().join("\n").replace("@ORIGIN", &n(l.drive_origin));
        code.replace("@MOST", &n(500.0)).replace("@TURN", &turn).replace("@BELOW", &below)
    }
}
