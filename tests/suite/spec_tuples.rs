//! Specs that are accepted, and their tuples; tuple files, accepted and refused.

use crate::common::specs::{GOOD, parse, with};
use std::fs;

use vibrissa::error::InputError;
use vibrissa::scene::{COLUMNS, Contact, Drive, Material, Side, Space, Spec, Tuple};
use vibrissa::spec;

fn tuples(spec: &Spec) -> Vec<[f64; COLUMNS]> {
    let Space::Grid(factors) = &spec.study.space else { panic!("a grid was expected") };
    let mut all = vec![Vec::new()];
    for factor in factors {
        assert_eq!(factor.axes.len(), 1);
        all = all
            .iter()
            .flat_map(|head| factor.axes[0].1.iter().map(|v| [head.as_slice(), &[v]].concat()))
            .collect();
    }
    all.into_iter().map(|values| values.try_into().unwrap()).collect()
}

#[test]
fn a_grid_in_row_order() {
    let spec = parse(GOOD).unwrap();
    let whisker = [10.0, 4.0, 96.0, 6.0, 2.0];
    let expected: Vec<[f64; COLUMNS]> = [30.0, 50.0, 70.0]
        .iter()
        .flat_map(|&a| {
            [2.0, 3.0, 4.0]
                .map(|theta| [whisker.as_slice(), &[a, 0.0, 0.0, theta]].concat().try_into().unwrap())
        })
        .collect();
    assert_eq!(tuples(&spec), expected);
    assert_eq!(spec.name, "whisker");
    assert_eq!(
        (spec.study.setup.drive, spec.study.setup.gauge.side, spec.study.setup.gauge.noise_strain),
        (Drive::Angle, Side::Contact, None)
    );
    assert_eq!(
        (spec.study.setup.model.contact, spec.study.setup.model.material),
        (Contact::Frictionless, Material::Hooke(3.2))
    );
    assert!(spec.warnings.is_empty() && spec.study.output.tuples.is_none());
}

#[test]
fn other_ways_to_write_it() {
    let one_line = "whisker = { D = 10, d = 4, L_a = 96 }\ngauge.x_ss = 6\ngauge.l = 2\ntap = { a = 0x1e, theta = 1_0e-1 }\n";
    assert_eq!(tuples(&parse(one_line).unwrap()), [[10.0, 4.0, 96.0, 6.0, 2.0, 30.0, 0.0, 0.0, 1.0]]);
    parse(&format!("\u{feff}{}", GOOD.replace('\n', "\r\n"))).unwrap();
    parse(&format!("{GOOD}[optimise]\nobjective = \"sd\"\nseed = 3\n")).unwrap();
}

fn listed(rows: &[u8]) -> Result<Spec, InputError> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("taps.csv"), rows).unwrap();
    let path = folder.path().join("listed.toml");
    fs::write(&path, "[tuples]\nfile = \"taps.csv\"\n").unwrap();
    spec::read(&path)
}

const HEADER: &str = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg";

#[test]
fn tuple_files() {
    let first =
        Tuple { D: 10.0, d: 4.0, L_a: 96.0, x_ss: 6.0, l: 2.0, a: 30.0, drive: 2.5, ..Tuple::default() };
    let rows = format!(
        "\u{feff}# taps\r\n{HEADER}\r\n\r\n 10 ,4,96,6,2,30,2.5\r\n# more\r\n10,4,9.6e1,6,2,300,2.5\r\n"
    );
    let spec = listed(rows.as_bytes()).unwrap();
    assert_eq!(spec.study.space, Space::List([first, Tuple { a: 300.0, ..first }].into_iter().collect()));
    assert!(spec.warnings.is_empty());

    let spec = listed(
        b"theta_deg,note,a_mm,l_mm,x_ss_mm,L_a_mm,d_mm,D_mm,who\n\
          2.5,\"one,\ntwo\",30,2,6,96,4,10,me\n",
    )
    .unwrap();
    assert_eq!(spec.study.space, Space::List([first].into_iter().collect()));
    assert_eq!(spec.warnings.len(), 1);
    assert!(spec.warnings[0].ends_with("ignored columns note, who"));
    assert_eq!(listed(HEADER.as_bytes()).unwrap().study.space, Space::List([].into_iter().collect()));
}

#[test]
fn the_tips_diameter_has_either_name_whatever_separates_the_columns() {
    let rows = format!("{HEADER}\n10,4,96,6,2,30,2.5\n");
    let known = listed(rows.as_bytes()).unwrap().study.space;
    for (mark, point) in [(",", "."), (";", ","), ("\t", ".")] {
        let text = rows.replace('.', "p").replace(',', mark).replace('p', point);
        let present = text.replace("d_m", "d_tip_m");
        for text in [text.clone(), present, text.replace("d_mm", "\"d_tip_mm\"")] {
            assert_eq!(listed(text.as_bytes()).unwrap().study.space, known, "{text}");
        }
        let both = listed(text.replace("d_mm", &format!("d_mm{mark}d_tip_mm")).as_bytes());
        assert!(both.unwrap_err().message.contains("both of these columns"), "{text}");
    }
}

#[test]
fn spec_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.whisker.toml");
    assert!(spec::read(&path).unwrap_err().to_string().contains("no such spec file"));
    assert!(spec::read(folder.path()).unwrap_err().to_string().contains("folder"));
    fs::write(&path, b"format = 1\n# \xe9\n").unwrap();
    let error = spec::read(&path).unwrap_err();
    assert!(error.message.contains("UTF-8") && error.line == Some(2));
    fs::write(&path, with("[run]", "[run]\nout = \"results/one\"")).unwrap();
    let spec = spec::read(&path).unwrap();
    assert_eq!(spec.name, "my.whisker");
    assert_eq!(spec.run.out, Some(folder.path().join("results/one")));
}
