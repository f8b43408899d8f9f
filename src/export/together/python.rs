//! The file in Python.

use super::{Export, Table, Tables};
use crate::estimate::WIDENING;
use crate::export::python::{infinite, list, rows};
use crate::export::text::{self, number};
use crate::locate::likely::{RIDGE, STARTS};
use crate::locate::opened::BEYOND;
use crate::locate::several::{CONTRADICTORY, EQUAL};

const WHOLE: &str = include_str!("../template/together.py");

impl Export<'_> {
    pub(super) fn python(&self) -> String {
        let channel = |tables: &Tables<'_>| {
            let l = tables.0[0].locator;
            let (per, bridge) = super::c::unit(l);
            let [origin, zero, per, bridge] = [l.drive_origin, text::zero(l), per, bridge].map(number);
            let sides: Vec<String> = tables.0.iter().map(side).collect();
            format!(
                "    {{\n        \"origin\": {origin}, \"zero\": {zero}, \"per\": {per}, \"bridge\": {bridge},\n        \"sides\": [\n{}\n        ],\n    }},",
                sides.join("\n")
            )
        };
        let channels: Vec<String> = self.channels.iter().map(channel).collect();
        let names: Vec<String> =
            self.several.names.iter().map(|n| format!("{:?}", text::harmless(n))).collect();
        let covariance: Vec<String> = self.sensor.covariance.iter().map(|row| list(row)).collect();
        let prepare = match self.several.locators[0].drive_recorded {
            true => self.several.locators[0].only_drive().map_or(String::new(), |only| {
                format!("    drive = {} if drive is None or drive != drive else drive  # the only one that was calibrated\n", number(only))
            }),
            false => "    drive = 1.0  # it was not recorded when the whisker was calibrated\n".to_owned(),
        };
        WHOLE
            .replace("@COMMENT", &self.comment(""))
            .replace("@NAMES", &names.join(", "))
            .replace("@COVARIANCE", &covariance.join(", "))
            .replace("@TABLES", &channels.join("\n"))
            .replace("@PREPARE\n", &prepare)
            .replace("@DRIVE", text::drive(&self.several.locators[0]))
            .replace("@RIDGE", &number(RIDGE))
            .replace("@STARTS_A", &STARTS[0].to_string())
            .replace("@STARTS_U", &STARTS[1].to_string())
            .replace("@CONTRADICTORY", &number(CONTRADICTORY))
            .replace("@EQUAL", &number(EQUAL))
            .replace("@BEYOND", &number(BEYOND))
    }
}

fn side(t: &Table<'_>) -> String {
    let of = t.side;
    let interest = [of.interest[0] * (1.0 - WIDENING), of.interest[1] * (1.0 + WIDENING)];
    format!(
        "            {{\n            \"sign\": {}, \"gauge\": {}, \"ln_a\": {}, \"drives\": {},\n            \"distances\": {}, \"rounding\": {}, \"interest\": {}, \"limit\": {},\n            \
         \"series\": {},\n            \"variance\": {},\n            }},",
        of.sign,
        t.gauge(),
        list(&t.ends),
        list(&t.drives),
        list(&of.distances),
        number(WIDENING * of.distances[1]),
        list(&interest),
        infinite(t.limit()),
        rows(&t.series),
        rows(&t.variance),
    )
}
