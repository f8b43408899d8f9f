//! The file in C: everything twice, for double and for float.

use super::{Export, GRID, Table};
use crate::estimate::WIDENING;
use crate::export::c::{REALS, Real};
use crate::export::text;
use crate::locate::likely::{RIDGE, STARTS};
use crate::locate::opened::BEYOND;
use crate::locate::several::{CONTRADICTORY, EQUAL};
use crate::measure::Unit;

const HEAD: &str = include_str!("../template/together_head.c");
const WHOLE: &str = include_str!("../template/together.c");

impl Export<'_> {
    pub(super) fn c(&self) -> String {
        let float = "; float: 1e-3 mm, 1e-2 mm where the drive is not known";
        let names: Vec<String> = self.several.names.iter().map(|n| text::harmless(n)).collect();
        let mut out = HEAD
            .replace("@COMMENT", &text::c_comment(&self.comment(float)))
            .replace("@NAMES", &names.join(", "))
            .replace("@CHANNELS", &self.channels.len().to_string())
            .replace("@DRIVE", text::drive(&self.several.locators[0]));
        for real in REALS {
            out += &self.c_for(real);
        }
        out + "\n#endif\n"
    }

    fn c_for(&self, real: Real) -> String {
        let n = |x: f64| real.number(x);
        let (mut numbers, mut sides, mut channels) = (Vec::new(), Vec::new(), Vec::new());
        for tables in &self.channels {
            let first = sides.len();
            for t in &tables.0 {
                let value = numbers.len();
                numbers.extend(t.series.iter().flatten().copied());
                sides.push(side(t, [value, numbers.len()], real));
                numbers.extend(t.variance.iter().flatten().copied());
            }
            let locator = tables.0[0].locator;
            let (per, bridge) = unit(locator);
            let numbers = [locator.drive_origin, text::zero(locator), per, bridge].map(n).join(", ");
            channels.push(format!("    {{{first}, {}, {numbers}}},", tables.0.len()));
        }
        let covariance = self.sensor.covariance.iter().flatten().copied();
        let tables = [
            format!("static const side_F sides_F[] = {{\n{}\n}};", sides.join("\n")),
            format!("static const channel_F channels_F[] = {{\n{}\n}};", channels.join("\n")),
            format!("static const REAL covariance_F[] = {{\n{}\n}};", real.list(covariance)),
            format!("static const REAL numbers_F[] = {{\n{}\n}};", real.list(numbers)),
        ];
        let series = &self.channels[0].0[0].series;
        let prepare = match self.several.locators[0].drive_recorded {
            true => self.several.locators[0].only_drive().map_or(String::new(), |only| {
                format!(
                    "    drive = isfinite(drive) ? drive : {}; /* the only one that was calibrated */\n",
                    n(only)
                )
            }),
            false => "    drive = 1; /* it was not recorded when the whisker was calibrated */\n".to_owned(),
        };
        let float = real.is_float();
        let code = WHOLE
            .replace("@TABLES", &tables.join("\n\n"))
            .replace("@PREPARE\n", &prepare)
            .replace("@CHANNELS", &self.channels.len().to_string())
            .replace("@ROWS", &series.len().to_string())
            .replace("@COLUMNS", &series[0].len().to_string())
            .replace("@GRID_A", &GRID[0].to_string())
            .replace("@GRID_U", &GRID[1].to_string())
            .replace("@STARTS_A", &STARTS[0].to_string())
            .replace("@STARTS_U", &STARTS[1].to_string())
            .replace("@RIDGE", &n(if float { 1e-6 } else { RIDGE }))
            .replace("@TINY", &n(if float { 1e-6 } else { 1e-13 }))
            .replace("@SETTLED", &n(if float { 1e-6 } else { 1e-12 }))
            .replace("@CONTRADICTORY", &n(CONTRADICTORY))
            .replace("@EQUAL", &n(EQUAL))
            .replace("@BEYOND", &n(BEYOND))
            .replace("@SAME", &n(real.same));
        real.own_names(&code)
    }
}

/// What makes the unit of the calibration of a recorded signal: a factor; the factor of a quarter bridge, or 0.
pub(super) fn unit(locator: &crate::locate::Locator) -> (f64, f64) {
    match locator.unit {
        Unit::Microstrain => (1e-6, 0.0),
        Unit::Bridge => (1.0, locator.rig.setup.gauge.factor),
        _ => (1.0, 0.0),
    }
}

/// The row of a side, whose tables begin there.
fn side(t: &Table<'_>, [value, variance]: [usize; 2], real: Real) -> String {
    let of = t.side;
    let n = |x: f64| real.number(x);
    let [nearest, farthest] = of.distances;
    let interest = [of.interest[0] * (1.0 - WIDENING), of.interest[1] * (1.0 + WIDENING)];
    let [ends, drives, interest] = [t.ends, t.drives, interest].map(|pair| pair.map(n).join(", "));
    let reach = [nearest, farthest, WIDENING * farthest].map(n).join(", ");
    let (sign, gauge, limit) = (of.sign, t.gauge(), n(t.limit()));
    format!(
        "    {{{sign}, {gauge}, {value}, {variance}, {{{ends}}}, {{{drives}}}, {reach}, {{{interest}}}, {limit}}},"
    )
}
