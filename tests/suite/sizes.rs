//! Sweeps of awkward sizes: none, one, a workgroup more or less, several batches, designs larger than one. Batches change neither rows nor order.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};

use crate::common::cases::{Kind, evaluate};
use crate::common::specs;
use crate::common::sweeping::{
    CPU, CPU_F64, GPU, Place, REFERENCE, Row, Table, number, sweep_into, sweep_with,
};
use vibrissa::census::cases::random;
use vibrissa::plan::CHUNK;
use vibrissa::scene::{Precision, Tuple};

const BATCHED: [Place; 3] = [CPU, CPU_F64, GPU];

const WORKGROUP: usize = vibrissa::kernel::gpu::shader::WORKGROUP as usize;

const INPUTS: [&str; 7] = ["D_mm", "d_tip_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "theta_deg"];

fn tolerance(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 1e-8 }
}

fn taps(n: usize) -> String {
    let tip = |i: usize| [4, 7, 10][i % 3];
    let row = |i: usize| format!("10,{},50,5,2,{},{}\n", tip(i), 21 + i % 28, 1.0 + 0.1 * i as f64);
    INPUTS.join(",") + "\n" + &(0..n).map(row).collect::<String>()
}

#[test]
fn a_workgroup_more_or_less() {
    const LISTED: &str = "[tuples]\nfile = \"list.csv\"\n";
    for n in [0, 1, WORKGROUP - 1, WORKGROUP, WORKGROUP + 1] {
        let list = taps(n);
        let wanted = sweep_with(LISTED, Some(&list), REFERENCE);
        assert_eq!(wanted.tuples.rows.len(), n);
        for place in BATCHED {
            let found = sweep_with(LISTED, Some(&list), place);
            assert_eq!(found.report.counts.taps, n as u64);
            assert_eq!(found.tuples.columns, wanted.tuples.columns);
            assert_eq!(found.tuples.rows.len(), n);
            assert_eq!(found.designs.rows.len(), wanted.designs.rows.len());
            assert_eq!(found.distances.rows.len(), wanted.distances.rows.len());
            for (found, wanted) in found.tuples.rows.iter().zip(&wanted.tuples.rows) {
                for column in INPUTS.iter().chain(&["status", "strain_linear"]) {
                    assert_eq!(found[*column], wanted[*column], "{column} of {n} on {place:?}");
                }
                let strain = |row: &Row| row["strain"].parse::<f64>().expect("a strain");
                assert!((strain(found) / strain(wanted) - 1.0).abs() < tolerance(place), "{n} on {place:?}");
            }
        }
    }
}

/// Designs in several chunks, and one larger than a chunk: rows in grid order, equal to taps solved alone; statistics are those of the rows.
#[test]
fn rows_of_large_sweeps_are_those_of_taps_asked_alone() {
    let spec = |d: &str, a: &str, theta: &str| {
        format!(
            "[whisker]\nD = {d}\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}\n"
        )
    };
    const { assert!(1400 * 100 > CHUNK && CHUNK < 364 * 364) };
    let (a, theta) = ("{ from = 21, to = 48, step = 3 }", "{ from = 1, to = 10, step = 1 }");
    let several = spec("{ from = 8, to = 10, steps = 1400 }", a, theta);
    let large = spec("10", "{ from = 20, to = 30, steps = 364 }", "{ from = 0.5, to = 4, steps = 364 }");
    for (text, taps) in [(several, 10), (large, 364)] {
        let study = specs::parse(&text).expect("a spec").study;
        let layout = study.space.layout().expect("axes");
        let some: Vec<u64> = (0..layout.len()).step_by(997).collect();
        let tuples: Vec<Tuple> = some.iter().map(|i| layout.tuple(*i)).collect();
        for place in BATCHED {
            let out = tempfile::tempdir().expect("a folder");
            sweep_into(out.path(), &text, None, place).unwrap_or_else(|e| panic!("{e}"));
            let file = BufReader::new(File::open(out.path().join("tuples.csv")).expect("a table"));
            let mut alone =
                some.iter().zip(evaluate(&study.setup, place.open(&study.setup), &tuples)).peekable();
            let mut designs: BTreeMap<(String, String), (u64, f64)> = BTreeMap::new();
            for (i, line) in (0..).zip(file.lines().skip(1)) {
                let line = line.expect("a line");
                let fields: Vec<&str> = line.split(',').collect();
                let number = |k: usize| fields[k].parse::<f64>().expect("a number");
                let t = layout.tuple(i);
                assert_eq!([0, 5, 6].map(number), [t.D, t.a, t.drive], "row {i} on {place:?}");
                if let Some((_, (one, least))) = alone.next_if(|(at, _)| **at == i) {
                    let error = (number(7) - one.strain).abs() / one.strain.abs().max(least);
                    assert!(
                        error <= if place == GPU { 0.0 } else { tolerance(place) },
                        "row {i} on {place:?}: {error:e}"
                    );
                }
                let design = designs.entry((fields[0].into(), fields[6].into())).or_default();
                *design = (design.0 + 1, design.1.max(number(7).abs()));
            }
            assert!(alone.next().is_none(), "{place:?}: not all rows are there");
            let table = Table::read(&out.path().join("designs.csv"));
            assert_eq!(table.rows.len(), designs.len());
            for row in &table.rows {
                let known = designs[&(row["D_mm"].clone(), row["theta_deg"].clone())];
                assert_eq!(
                    (row["n"].parse(), number(row, "strain_max")),
                    (Ok(taps), Some(known.1)),
                    "{row:?}"
                );
                assert_eq!(known.0, taps);
            }
        }
    }
}

/// More taps than one dispatch holds, at a length off every boundary.
#[test]
fn several_dispatches_are_their_parts() {
    let setup = Kind::Tap.setup();
    let some = random(setup.drive, false, 997, 7);
    let many: Vec<Tuple> = some.iter().copied().cycle().take((1 << 18) + 77).collect();
    let (alone, together) =
        (evaluate(&setup, GPU.open(&setup), &some), evaluate(&setup, GPU.open(&setup), &many));
    for (i, (found, _)) in together.iter().enumerate() {
        let (wanted, _) = &alone[i % some.len()];
        let bits = |o: &vibrissa::evaluate::Outcome| {
            [o.strain, o.deviation, o.normal_force, o.arc].map(f64::to_bits)
        };
        assert_eq!((bits(found), found.status), (bits(wanted), wanted.status), "tap {i}");
    }
}
