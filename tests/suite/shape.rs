//! Shapes of bent whiskers: they end at the reference's contact and pole, and their strain is the gauge's.

use vibrissa::design::Design;
use vibrissa::evaluate::{Evaluator, Method, Outcome, Task};
use vibrissa::scene::{Drive, Model, Setup, Side, Tuple};
use vibrissa::shape::{Shape, shape};

use crate::common::program::{Desk, SPEC};
use crate::common::{CONFIGURATIONS, configuration, tap};

fn setup(model: Model, side: Side, hub: f64, drive: Drive) -> Setup {
    let mut setup = Setup { model, hub, drive, ..Setup::default() };
    setup.gauge.side = side;
    setup
}

/// Mean by Simpson's rule.
fn mean(nodes: &[(f64, f64)]) -> f64 {
    let n = nodes.len() - 1;
    assert_eq!(n % 2, 0);
    let weight = |i: usize| if i == 0 || i == n { 1.0 } else { [2.0, 4.0][i % 2] };
    nodes.iter().enumerate().map(|(i, (_, e))| weight(i) * e).sum::<f64>() / (3 * n) as f64
}

#[test]
fn a_row_has_the_shape_of_its_own_hub() {
    let desk = Desk::new("[tuples]\nfile = \"list.csv\"\n");
    desk.write(
        "list.csv",
        "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,hub_mm\n10,4,50,5,2,33,4,0\n10,4,50,5,2,33,4,4\n",
    );
    desk.ok("shape spec.toml --out own");
    desk.write("spec.toml", SPEC.replace("[4, 7]", "4").replace("[gauge]", "hub = 4\n[gauge]"));
    desk.ok("shape spec.toml --out all");
    let own = desk.read("own/contacts.csv");
    let (_, row) = own.lines().last().and_then(|line| line.split_once(',')).expect("a row");
    assert!(desk.read("all/contacts.csv").contains(row), "{row}");
}

struct Bent {
    design: Design,
    outcome: Outcome,
    shape: Option<Shape>,
}

fn bent(setup: &Setup, [d, a, drive]: [f64; 3], method: Method, nodes: usize) -> Bent {
    let tuple = Tuple { D: 10.0, d, L_a: 50.0, x_ss: 5.0, l: 2.0, a, drive, ..Tuple::default() };
    let (designs, task) = ([Design::new(setup, tuple)], Task { design: 0, a, drive, ..Task::default() });
    let outcome = Evaluator::new(setup, method).run(&designs, &[task]).unwrap()[0];
    let shape = shape(setup, &designs[0], &task, &outcome, nodes);
    let [design] = designs;
    Bent { design, outcome, shape }
}

#[test]
fn the_pole_is_where_it_was_put() {
    let mut compared = 0;
    for name in CONFIGURATIONS {
        let (model, side) = configuration(name);
        for (hub, drive, amount) in
            [(0.0, Drive::Angle, 8.0), (7.0, Drive::Angle, 4.0), (7.0, Drive::Displacement, 4.0)]
        {
            let setup = setup(model, side, hub, drive);
            for (d, a) in [(4.0, 21.0), (4.0, 36.0), (10.0, 30.0), (12.0, 44.0)] {
                let Bent { design, outcome, shape } = bent(&setup, [d, a, amount], Method::Reference, 101);
                let Some(bent) = shape else {
                    assert!(!outcome.arc.is_finite(), "{name} {d} {a}: {outcome:?} has no shape");
                    continue;
                };
                let taper = design.shared.as_ref().unwrap().taper;
                let [sin, cos, high] = match model.surface {
                    true => [taper.sin_alpha(), taper.cos_alpha(), taper.radius(a)],
                    false => [0.0, 1.0, 0.0],
                };
                let lift = if drive == Drive::Displacement { amount } else { 0.0 };
                let rho = model.pole_radius;
                let (x, y) = (hub + a + rho * sin, high + rho * cos - lift);
                let off = (bent.pole.x - x).hypot(bent.pole.y - y);
                assert!(off < 1e-7, "{name}, hub {hub}, {drive:?}, d {d}, a {a}: the pole is {off:e} mm off");
                let (first, tip) = (bent.nodes[0], bent.nodes[bent.nodes.len() - 1]);
                let turn = if drive == Drive::Angle { amount.to_radians() } else { 0.0 };
                let clamp = (first.at.x - hub * turn.cos()).hypot(first.at.y - hub * turn.sin());
                assert!(clamp < 1e-12 && (first.direction - turn).abs() < 1e-12 && first.s == 0.0, "{name}");
                assert!(tip.s >= outcome.arc - 1e-12 && tip.strain.abs() < 1e-12);
                compared += 1;
            }
        }
    }
    assert!(compared > 80, "{compared} shapes");
}

/// The mean strain over the gauge equals that of the reference, which integrates by another method.
#[test]
fn strain_along_the_whisker_is_the_gauges() {
    for name in CONFIGURATIONS {
        let (model, _) = configuration(name);
        let setup = setup(model, Side::Contact, 0.0, Drive::Angle);
        let bent = bent(&setup, [4.0, 33.0, 6.0], Method::Reference, 4001);
        let nodes = bent.shape.unwrap().nodes;
        let tap = tap(&model, 4.0, 33.0, 6.0).solve().unwrap();
        assert!((nodes[0].psi - tap.base_angle).abs() < 1e-9, "{name}: {} {}", nodes[0].psi, tap.base_angle);
        // A cubic through the nearest nodes, at the ends of 64 equal parts of the gauge.
        let at = |s: f64| {
            let i = nodes.partition_point(|n| n.s < s).clamp(2, nodes.len() - 3);
            let near = &nodes[i - 2..i + 2];
            let weight = |j: usize, k: usize| (s - near[k].s) / (near[j].s - near[k].s);
            let term = |j: usize| (0..4).filter(|k| *k != j).fold(near[j].strain, |p, k| p * weight(j, k));
            (0..4).map(term).sum::<f64>()
        };
        let [x1, x2] = bent.design.shared.unwrap().gauge;
        let strains: Vec<(f64, f64)> =
            (0..=64).map(|i| x1 + (x2 - x1) * f64::from(i) / 64.0).map(|s| (s, at(s))).collect();
        let found = mean(&strains);
        assert!((found / tap.strain - 1.0).abs() < 1e-8, "{name}: {found} {}", tap.strain);
    }
}

#[test]
fn the_command_writes_a_block_for_each_tap() {
    let desk = Desk::new(SPEC);
    desk.ok("shape spec.toml --out s --nodes 11");
    let run = desk.whole("s");
    assert_eq!((run["command"].as_str(), run["counts"]["taps"].as_u64()), (Some("shape"), Some(12)));
    let text = desk.read("s/shape.csv");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some(
            "tap,D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg,s_mm,x_mm,y_mm,psi_deg,direction_deg,strain"
        )
    );
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|f| f.parse().unwrap()).collect()).collect();
    for tap in 0..12 {
        let block: Vec<&Vec<f64>> = rows.iter().filter(|r| r[0] == f64::from(tap)).collect();
        // Eleven from clamp to contact, and up to two from there to the tip.
        assert!((11..=13).contains(&block.len()) && block.windows(2).all(|w| w[1][8] >= w[0][8]), "{tap}");
        assert_eq!(block[0][8..11], [0.0; 3]);
    }
    assert_eq!(desk.read("s/contacts.csv").lines().count(), 13);
}
