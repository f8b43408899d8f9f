//! The operations that the benchmark counts: each once, and as many as the work at the nodes needs.

use vibrissa_count::{Counted, Counter, Operations, seen};
use vibrissa_kernel::cpu::{Pack, Scalar};
use vibrissa_kernel::{Effects, Job, Rule, Solver, Tap};

#[test]
fn every_operation_is_seen_once() {
    let of = Pack::<Counted, 1, true>::of;
    let seen = seen(|| {
        let x = of(2.0) + of(3.0) - of(1.0) * of(4.0) / of(5.0);
        let y = (-x).abs().sqrt().mul_add(of(1.0), x).max(of(0.0));
        assert!(y.0[0].get().is_finite());
    });
    // abs is a change of sign and a comparison.
    assert_eq!(seen, Operations { add: 4, mul: 1, fma: 1, div: 1, sqrt: 1, compare: 2 });
    assert_eq!(seen.flops(), 9);
}

/// More nodes cost what the formula says: two n × n products and the work at n nodes in every sweep.
#[test]
fn flops_grow_with_the_square_of_the_nodes() {
    let tap = Tap {
        taper: 0.3,
        rest: 0.7,
        angle: 0.1,
        near: 0.8,
        far: 0.75,
        width: 0.05,
        weight: 1.0,
        force: 0.21,
        strain: 0.03,
        shear: 0.01,
        pole_x: 1.0,
        ..Tap::default()
    };
    let flops = |effects: Effects, nodes: usize, sweeps: u32| {
        let rule = Rule { nodes, terms: 9, full: false, sweeps };
        let mut counter = Counter::default();
        // A tolerance that is never met: exactly `sweeps` sweeps.
        let job = Job { effects, rule: &rule, tolerance: 0.0, chart: None };
        let mut out = Vec::new();
        counter.solve(&job, &[tap], &mut out).unwrap();
        assert_eq!(out[0].sweeps, f64::from(sweeps));
        counter.total().flops() as f64
    };
    let sweep = |e, n| flops(e, n, 5) - flops(e, n, 4);
    let (off, shear) = (Effects::default(), Effects { shear: true, ..Effects::default() });
    for n in [6, 10, 16, 24] {
        let (per_sweep, more) = (sweep(off, n), flops(off, n, 9) - flops(off, n, 8));
        assert_eq!(per_sweep, more, "every sweep costs the same");
        println!("{n} nodes: {per_sweep} flops a sweep, {} once", flops(off, n, 4) - 4.0 * per_sweep);
    }
    // Second difference over 6, 10, 16 of one kernel: the coefficient of n², of two products of n² fused operations.
    let (a, b, c) = (sweep(shear, 6), sweep(shear, 10), sweep(shear, 16));
    let square = ((c - b) / 6.0 - (b - a) / 4.0) / 10.0;
    assert!((square - 4.0).abs() < 1e-9, "{square}");
}
