//! The text of the device's kernel, for every combination of effects.

use vibrissa_built::{Shape, device::validated};
use vibrissa_core::scene::{Material, Precision};
use vibrissa_kernel::Rung;
use vibrissa_rod::Effects;

#[test]
fn the_text_is_valid_whatever_the_effects() {
    let material = Material::NeoHookean(3.2);
    let rungs = Rung::ladder(Precision::F32, &material, 1e-5);
    let chart = rungs[0].chart();
    for bits in 0..512u32 {
        let on = |k: u32| bits >> k & 1 == 1;
        let [shear, extension, surface, stick, law, far, curved, inner, power] =
            std::array::from_fn(|k| on(k as u32));
        let effects = Effects { shear, extension, surface, stick, law, far, ..Effects::default() };
        let shape = Shape { curved, inner, power };
        for (precision, tolerance) in [(Precision::F32, 1e-5), (Precision::F64, 1e-8)] {
            let found = validated((effects, shape), (precision, tolerance), chart.filter(|_| law));
            assert!(found.is_ok(), "{effects:?} {shape:?} {precision:?}: {}", found.expect_err("it is not"));
        }
    }
}
