//! Sweeps of awkward sizes: none, one, a workgroup more or less, several batches, designs larger than one. Rows and
//! their order do not depend on how the taps are cut into batches.

use crate::common;

use std::fs::File;
use std::io::{BufRead, BufReader};

use crate::common::cases::{Kind, evaluate, random};
use crate::common::sweeping::{CPU, CPU_F64, GPU, Place, REFERENCE, sweep_into, sweep_with};
use tempfile::TempDir;
use vibrissa::plan::CHUNK;
use vibrissa::scene::{Precision, Tuple};

/// Backends that work in batches.
const BATCHED: [Place; 3] = [CPU, CPU_F64, GPU];

/// Workgroup of the shaders.
const WORKGROUP: usize = vibrissa::kernel::gpu::shader::WORKGROUP as usize;

const INPUTS: [&str; 7] = ["D_mm", "d_mm", "L_a_mm", "x_ss_mm", "l_mm", "a_mm", "theta_deg"];

fn tolerance(place: Place) -> f64 {
    if place.precision == Precision::F32 { 1e-5 } else { 1e-8 }
}

/// Taps of the paper's whiskers, none of them alike.
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
                let strain = |row: &common::sweeping::Row| row["strain"].parse::<f64>().expect("a strain");
                assert!((strain(found) / strain(wanted) - 1.0).abs() < tolerance(place), "{n} on {place:?}");
            }
        }
    }
}

/// Rows of a table without its header, one after the other, over several sweeps.
fn rows<'a>(parts: &'a [TempDir], table: &'a str) -> impl Iterator<Item = String> + 'a {
    parts.iter().flat_map(move |part| {
        let file = File::open(part.path().join(table)).expect("a table");
        BufReader::new(file).lines().skip(1).map(|line| line.expect("a line"))
    })
}

fn swept(text: &str, list: Option<&str>, place: Place) -> TempDir {
    let out = tempfile::tempdir().expect("a folder");
    sweep_into(out.path(), text, list, place).unwrap_or_else(|e| panic!("{e}"));
    out
}

/// Whether two values of `column` agree within the tolerance: of the strain or force, of K, of the whisker's length.
fn close(column: &str, a: &str, b: &str, place: Place) -> bool {
    let scale = |a: f64| match column {
        _ if column.ends_with("_mm") => 50.0,
        "strain" | "strain_linear" | "strain_max" | "normal_force_N" | "force_max_N" => a.abs(),
        _ => 1.0,
    };
    let near = |a: f64, b: f64| (a - b).abs() <= tolerance(place) * scale(a);
    a == b || a.parse().ok().zip(b.parse().ok()).is_some_and(|(a, b)| near(a, b))
}

/// Asserts that `whole` holds the rows of `parts`, in order: the same text where every tap is treated alone, on the GPU; else the
/// same inputs and status, and numbers within the tolerance.
#[track_caller]
fn same_rows(whole: &TempDir, parts: &[TempDir], table: &str, place: Place) {
    let alone = place == GPU;
    let file = File::open(whole.path().join(table)).expect("a table");
    let header = BufReader::new(file).lines().next().expect("a header").expect("a line");
    let columns: Vec<&str> = header.split(',').collect();
    let (whole, mut count) = (std::slice::from_ref(whole), 0);
    let mut left = rows(parts, table);
    for row in rows(whole, table) {
        let part = left.next().unwrap_or_else(|| panic!("{table}: row {count} is one too many"));
        let alike = || {
            let pairs = columns.iter().zip(row.split(',').zip(part.split(',')));
            pairs.clone().count() == columns.len()
                && pairs.into_iter().all(|(c, (a, b))| a == b || !INPUTS.contains(c) && close(c, a, b, place))
        };
        assert!(row == part || !alone && alike(), "{table}, row {count} on {place:?}:\n{row}\n{part}");
        count += 1;
    }
    assert!(count > 0 && left.next().is_none(), "{table}: only {count} rows");
}

/// D, a and theta as TOML; K and the range are given, so that estimates do not depend on what is swept together.
fn spec(d: &str, a: &str, theta: &str) -> String {
    format!(
        "[whisker]\nD = {d}\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n[tap]\na = {a}\ntheta = {theta}\n\
         [estimate]\nK = 1\nrange = [1, 60]\n"
    )
}

fn steps(from: f64, step: f64, n: u64) -> String {
    format!("{{ from = {from}, to = {:.6}, step = {step} }}", from + step * (n - 1) as f64)
}

#[test]
fn several_chunks_are_their_parts() {
    let (a, theta) = (steps(21.0, 3.0, 10), steps(1.0, 1.0, 10));
    let designs = |from: f64, n: u64| spec(&steps(from, 0.001, n), &a, &theta);
    const { assert!(1400 * 100 > CHUNK) };
    for place in BATCHED {
        let whole = swept(&designs(8.0, 1400), None, place);
        let parts =
            [(8.0, 7), (8.007, 993), (9.0, 400)].map(|(from, n)| swept(&designs(from, n), None, place));
        for table in ["tuples.csv", "designs.csv", "distances.csv"] {
            same_rows(&whole, &parts, table, place);
        }
        if place == GPU {
            let inputs = |row: String| row.split(',').take(7).collect::<Vec<_>>().join(",") + "\n";
            let whole = [whole];
            let list = INPUTS.join(",") + "\n" + &rows(&whole, "tuples.csv").map(inputs).collect::<String>();
            let listed = "[tuples]\nfile = \"list.csv\"\n[estimate]\nK = 1\nrange = [1, 60]\n";
            let listed = swept(listed, Some(&list), place);
            for table in ["tuples.csv", "designs.csv", "distances.csv"] {
                same_rows(&listed, &whole, table, place);
            }
        }
    }
}

/// One design of `n` distances and as many angles against the same taps in four specs by distance, then by angle.
fn large_design(n: u64, place: Place) {
    let (a_step, theta_step) = (0.025, 0.008);
    let whole = swept(&spec("10", &steps(20.0, a_step, n), &steps(0.5, theta_step, n)), None, place);
    let quarter = n / 4;
    let part = |k: u64| ((k * quarter) as f64, if k == 3 { n - 3 * quarter } else { quarter });
    let by_distance: Vec<TempDir> = (0..4)
        .map(part)
        .map(|(from, m)| {
            swept(
                &spec("10", &steps(20.0 + from * a_step, a_step, m), &steps(0.5, theta_step, n)),
                None,
                place,
            )
        })
        .collect();
    same_rows(&whole, &by_distance, "tuples.csv", place);
    same_rows(&whole, &by_distance, "distances.csv", place);
    let by_angle: Vec<TempDir> = (0..4)
        .map(part)
        .map(|(from, m)| {
            let text = spec("10", &steps(20.0, a_step, n), &steps(0.5 + from * theta_step, theta_step, m));
            swept(&(text + "[output]\ntuples = false\n"), None, place)
        })
        .collect();
    same_rows(&whole, &by_angle, "designs.csv", place);
}

#[test]
fn a_design_larger_than_a_chunk() {
    const { assert!(CHUNK < 364 * 364) };
    for place in BATCHED {
        large_design(364, place);
    }
}

/// More taps than one dispatch takes, at a length off every boundary.
#[test]
fn several_dispatches_are_their_parts() {
    let setup = Kind::Tap.setup();
    let some = random(Kind::Tap, 997);
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
