//! Packs that are vectors against the same operations number by number.

#![cfg(target_arch = "x86_64")]

use vibrissa_kernel::cpu::{Instructions, Pack, Packed, Plain, Scalar, Set, Vectors, WIDEST};

#[derive(Debug, Clone, Copy, PartialEq)]
struct Wide;

// SAFETY: its packs are made in `by_vectors`, which needs the proof.
unsafe impl Set for Wide {
    const HAS: Instructions = Vectors::HAVE;
}

const KINDS: [f64; 11] =
    [0.0, -0.0, 1.0, -1.0, 0.3, 7e-20, -7e-20, 3e19, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];

fn numbers<T: Scalar, const L: usize, S: Set>(first: usize) -> Pack<T, L, S> {
    Pack::new(std::array::from_fn(|i| T::of(KINDS[(first + i) % KINDS.len()])))
}

/// The bits of both are the same; any NaN equals any other.
fn same<T: Scalar, const L: usize, S: Set>(name: &str, found: Pack<T, L, S>, each: impl Fn(usize) -> T) {
    for (i, found) in found.0.into_iter().enumerate() {
        let (found, expected) = (found.get(), each(i).get());
        let equal = found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
        assert!(equal, "{name} {i}: {found} {expected}");
    }
}

#[inline(always)]
fn every_operation<T: Scalar, const L: usize, S: Set>() {
    let of = Pack::<T, L, S>::of;
    let every = 0..KINDS.len();
    for (first, second) in every.clone().flat_map(|k| every.clone().map(move |l| (k, l))) {
        let [a, b, c, d] = [first, second, first + 2 * second + 1, 3 * second + 2].map(numbers::<T, L, S>);
        same("add", a + b, |i| a.0[i] + b.0[i]);
        same("sub", a - b, |i| a.0[i] - b.0[i]);
        same("mul", a * b, |i| a.0[i] * b.0[i]);
        same("div", a / b, |i| a.0[i] / b.0[i]);
        same("neg", -a, |i| T::of(0.0) - a.0[i]);
        same("sqrt", a.sqrt(), |i| a.0[i].sqrt());
        same("max", a.max(b), |i| if a.0[i] > b.0[i] { a.0[i] } else { b.0[i] });
        same("min", a.min(b), |i| if a.0[i] < b.0[i] { a.0[i] } else { b.0[i] });
        same("if_less", a.if_less(b, c, d), |i| if a.0[i] < b.0[i] { c.0[i] } else { d.0[i] });
        same("mul_add", a.mul_add(b, c), |i| {
            if S::HAS == Instructions::Unfused {
                a.0[i] * b.0[i] + c.0[i]
            } else {
                a.0[i].fma(b.0[i], c.0[i])
            }
        });
    }
    // (1 + x)(1 − x) − 1 is −x², and 0 where the product is rounded first.
    let x = 2.0 * T::ROUNDING;
    let fused = of(1.0 + x).mul_add(of(1.0 - x), of(-1.0));
    same("fused", fused, |_| T::of(if S::HAS == Instructions::Unfused { 0.0 } else { -x * x }));
    same("of", of(0.1), |_| T::of(0.1));
    assert!(of(1.0).all_at_most(of(1.0)) && of(-0.0).all_at_most(of(0.0)));
    for (lane, not) in (0..L).flat_map(|lane| [(lane, 1.5), (lane, f64::NAN)]) {
        let (mut one, mut other) = (of(1.0), of(1.0));
        one.0[lane] = T::of(not);
        other.0[lane] = T::of(2.0 - not);
        assert!(!one.all_at_most(of(1.0)) && !of(1.0).all_at_most(other), "{lane} {not}");
    }
}

#[target_feature(enable = "avx2,fma")]
fn by_vectors(_: Vectors) {
    every_operation::<f32, WIDEST, Wide>();
    every_operation::<f32, 16, Wide>();
    every_operation::<f64, 8, Wide>();
}

#[test]
fn vectors_do_what_numbers_do() {
    every_operation::<f64, 8, Plain>();
    every_operation::<f32, 1, Plain>();
    every_operation::<f64, 1, Plain>();
    if let Some(has) = Vectors::found() {
        // SAFETY: the CPU has just been found to have them.
        unsafe { by_vectors(has) };
    }
}
