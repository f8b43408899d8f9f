//! What kernels, devices and charts are made of: charts of a material, which taps of a batch are compared, clocks, texts of shaders, drivers that crash, polynomials.

use std::mem::offset_of;
use std::process::Command;
use std::sync::mpsc::channel;
use std::time::Duration;

use vibrissa::backend::drivers::{How, found_by};
use vibrissa::chart::adaptive::{MOST, newton, point, to_chebyshev};
use vibrissa::chart::between::{Between, nodes};
use vibrissa::kernel::gpu::check::{drawn, key};
use vibrissa::kernel::gpu::clock::{PATIENCE, left_behind, within};
use vibrissa::kernel::gpu::shader::{Variant, validate};
use vibrissa::kernel::rule::{chart_range, rules_of_devices};
use vibrissa::kernel::{Chart, Effects, Job, Rung, Solution, Tap};
use vibrissa::physics::chebyshev::series;
use vibrissa::physics::section::SectionLaw;
use vibrissa::scene::{Material, Precision};
use vibrissa_built::{Effects as BuiltEffects, Shape, device::validated};

fn value(poly: &[Vec<f64>], x: f64, y: f64) -> f64 {
    poly.iter().rev().fold(0.0, |sum, row| sum * x + row.iter().rev().fold(0.0, |s, c| s * y + c))
}

#[test]
fn charts_keep_their_stated_error() {
    let materials =
        [Material::NeoHookean(3.2), Material::MooneyRivlin([0.35, 0.15]), Material::Yeoh([0.5, -0.08, 0.02])];
    for material in materials {
        for (axial, bending, accuracy) in
            [(0.05, [0.2, 0.0], 1e-7), (0.05, [0.2, 0.0], 1e-10), (0.15, [0.5, 0.9], 1e-6)]
        {
            let chart = Chart::new(&material, axial, bending, [accuracy, 10.0 * accuracy]).unwrap();
            let (law, unit) = (SectionLaw::new(&material), std::f64::consts::PI * material.e0());
            let mut worst: f64 = 0.0;
            for i in 0..400 {
                let (u, v) = (f64::from(i % 20) / 19.0, f64::from(i / 20) / 19.0);
                let t = chart.axial * (2.0 * u - 1.0);
                let most = chart.bending[0] + chart.bending[1] * t;
                let b = most * v.max(0.01);
                let s = law.deform(t * unit, 0.25 * b * unit).unwrap();
                let (beta, x) = (2.0 * (b / most).powi(2) - 1.0, t / chart.axial);
                let line = |c: &[f64]| c.iter().rev().fold(0.0, |s, c| s * x + c);
                let e_chart = t + t * t * line(&chart.r) + b * b * value(&chart.p, beta, x);
                let k_chart = b * (1.0 + t * line(&chart.c) + b * b * value(&chart.q, beta, x));
                worst = worst.max(((e_chart - s.axial).abs() + (k_chart - s.bending).abs()) / b.max(t.abs()));
            }
            println!(
                "{material:?} {axial} {accuracy:e}: error {worst:e}, stated {:e}, p {}×{}",
                chart.error,
                chart.p.len(),
                chart.p[0].len()
            );
            assert!(
                worst <= chart.error.max(accuracy) * 2.0,
                "{material:?} {axial}: {worst:e} > {:e}",
                chart.error
            );
        }
    }
}

#[test]
fn a_tap_is_drawn_whatever_stands_beside_it() {
    let taps: Vec<[f64; 2]> =
        (0..100_000).map(|i| [1.0 + f64::from(i % 317), 0.1 + f64::from(i / 317)]).collect();
    let of = |taps: &[[f64; 2]]| {
        let places = drawn(taps.len(), |_| true, |i| key(&taps[i]), |i| taps[i][1]);
        places.into_iter().map(|i| taps[i].map(f64::to_bits)).collect::<Vec<_>>()
    };
    let whole = of(&taps);
    assert!((60..160).contains(&whole.len()), "{}", whole.len());
    for place in [0, taps.len() - 1] {
        assert!(whole.contains(&taps[place].map(f64::to_bits)), "no smallest or largest drive");
    }
    for parts in [2, 3, 7] {
        let cut: Vec<_> = taps.chunks(taps.len().div_ceil(parts)).flat_map(of).collect();
        let missing = whole.iter().filter(|tap| !cut.contains(tap)).count();
        assert_eq!(missing, 0, "in {parts} parts");
    }
    assert_eq!(of(&taps[..20]).len(), 20);
    assert!(of(&[]).is_empty());
}

#[test]
fn a_call_that_does_not_return_is_given_up_and_known_to_be_out() {
    assert_eq!(within(PATIENCE, "a sum", || 2 + 2), Ok(4));
    assert_eq!(within(PATIENCE, "nothing", || panic!("lost")), Err::<(), _>("lost".to_owned()));
    let (end, ended) = channel::<()>();
    let late = within(Duration::ZERO, "nothing", move || ended.recv().is_ok()).unwrap_err();
    assert_eq!(late, "nothing did not end within 0 s");
    assert!(left_behind());
    end.send(()).unwrap();
    while left_behind() {
        std::thread::yield_now();
    }
}

/// Every combination of effects on every rung, in both precisions.
fn each_variant(mut f: impl FnMut(&Variant<'_>)) -> usize {
    let mut seen = 0;
    for precision in [Precision::F32, Precision::F64] {
        for rule in rules_of_devices(precision) {
            let (axial, bending) = chart_range(precision, &rule);
            let chart = Chart::new(&Material::NeoHookean(3.2), axial, bending, [1e-6, 1e-5]);
            let effects = (0..128u32).map(|bits| {
                let on = |k: u32| bits >> k & 1 == 1;
                Effects {
                    shear: on(0),
                    extension: on(1),
                    offset: on(2),
                    stick: on(3),
                    rolls: false,
                    law: on(4),
                    far: on(5),
                    spatial: on(6),
                }
            });
            let sensible = effects.filter(|e| !e.stick || (e.extension && e.offset));
            for effects in sensible {
                let chart = chart.as_ref().filter(|_| effects.law);
                let job = Job { effects, rule: &rule, tolerance: 1e-5, chart };
                f(&Variant { job, precision });
                seen += 1;
            }
        }
    }
    seen
}

#[test]
fn every_variant_is_valid_wgsl() {
    let seen = each_variant(|v| {
        validate(&v.name(), &v.wgsl()).unwrap_or_else(|e| panic!("{e}"));
    });
    assert_eq!(seen, 2 * 4 * (32 + 8));
}

#[test]
fn struct_layouts_are_those_of_rust() {
    let rule = rules_of_devices(Precision::F32)[0];
    let spatial = Effects { spatial: true, ..Effects::default() };
    let job = Job { effects: spatial, rule: &rule, tolerance: 1e-5, chart: None };
    let v = Variant { job, precision: Precision::F32 };
    let module = validate("layout", &v.wgsl()).unwrap();
    let offsets = |name: &str| {
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
        let list: Vec<_> = members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize)).collect();
        (list, *span as usize)
    };
    macro_rules! rust {
        ($t:ty: $($f:ident)*) => { (vec![$((stringify!($f).to_owned(), offset_of!($t, $f))),*], size_of::<$t>()) };
    }
    assert_eq!(
        offsets("Tap"),
        rust!(Tap<f32>: taper rest angle hub near far width shear weight radius contact_radius slope pole_x pole_y
            ratio force along arc strain)
    );
    assert_eq!(
        offsets("Solution"),
        rust!(Solution<f32>: force along arc strain error load sweeps base axial)
    );
}

#[test]
fn without_spatial_effects_nothing_is_told_of_them() {
    let mut seen = [0; 2];
    each_variant(|v| {
        let text = v.wgsl();
        let spatial = v.job.effects.spatial;
        assert_eq!(text.contains("spatial") || text.contains("axial: real"), spatial, "{}", v.name());
        assert_eq!(text.matches("return Solution(").count(), 1);
        seen[usize::from(spatial)] += 1;
    });
    assert!(seen[0] == seen[1]);
}

#[test]
fn a_bad_shader_is_pointed_at() {
    let e = validate("broken", "fn f() -> f32 {\n    return nothing;\n}").unwrap_err().to_string();
    assert!(e.contains("broken") && e.contains("nothing") && e.contains(":2"), "{e}");
}

#[test]
fn a_driver_that_crashes_or_hangs_is_told_in_words_and_leaves_the_others() {
    const A: &str = r#"echo '["A","",false]'"#;
    const B: &str = r#"echo '["B","",true]'; echo done"#;
    for (script, seconds, fault, others) in [
        ("kill -SEGV $$".to_owned(), 300.0, "crashed (signal: 11 (SIGSEGV)", &[][..]),
        ("exec sleep 600".to_owned(), 0.4, "did not answer within 0.4 s when it was asked", &[]),
        (format!("[ $1 = 0 ] && {A} && kill -ABRT $$; {B}"), 300.0, "the driver of A crashed", &["B"]),
    ] {
        let how = move || {
            let mut command = Command::new("sh");
            command.args(["-c", &script, "sh"]);
            Some(command)
        };
        let (there, faults) = found_by(&(Box::new(how) as How), Duration::from_secs_f64(seconds)).unwrap();
        assert_eq!(there.iter().map(|a| a.0.as_str()).collect::<Vec<_>>(), others);
        assert!(faults.len() == 1 && faults[0].contains(fault), "{faults:?}");
    }
}

#[test]
fn the_text_is_valid_whatever_the_effects() {
    let material = Material::NeoHookean(3.2);
    let rungs = Rung::ladder(Precision::F32, &material, 1e-5);
    let chart = rungs[0].chart();
    for bits in 0..512u32 {
        let on = |k: u32| bits >> k & 1 == 1;
        let [shear, extension, surface, stick, law, far, curved, inner, power] =
            std::array::from_fn(|k| on(k as u32));
        let effects = BuiltEffects { shear, extension, surface, stick, law, far };
        let shape = Shape { curved, inner, power };
        for (precision, tolerance) in [(Precision::F32, 1e-5), (Precision::F64, 1e-8)] {
            let found = validated((effects, shape), (precision, tolerance), chart.filter(|_| law));
            assert!(found.is_ok(), "{effects:?} {shape:?} {precision:?}: {}", found.expect_err("it is not"));
        }
    }
}

#[test]
fn mean_and_squares_over_the_distances_are_forms_of_the_values_at_the_charts() {
    let nodes = nodes([21.0, 48.0], 13);
    let distances: Vec<f64> = (0..200).map(|i| 21.0 + 27.0 * (f64::from(i) / 199.0).powi(2)).collect();
    let between = Between::new(&nodes, &distances, 0.0);
    let f = |a: f64| 1.0 / (1.0 - a / 70.0);
    let values: Vec<f64> = distances.iter().map(|a| f(*a)).collect();
    let mean = values.iter().sum::<f64>() / 200.0;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let known: Vec<f64> = nodes.iter().map(|a| f(*a)).collect();
    let found: f64 = between.mean.iter().zip(&known).map(|(w, v)| w * v).sum();
    assert!((found - mean).abs() < 1e-9 * mean, "{found} {mean}");
    let form: f64 = between
        .squares
        .iter()
        .map(|row| row.iter().zip(&known).map(|(f, v)| f * (v - found)).sum::<f64>().powi(2))
        .sum();
    assert!((form - spread).abs() < 1e-8 * spread, "{form} {spread}");
}

#[test]
fn a_smooth_function_is_rebuilt_and_its_surplus_bounds_what_is_left() {
    let f = |x: f64| 1.0 / (2.5 - x);
    let mut line: Vec<f64> = (0..16).map(|k| f(point(k))).collect();
    for k in 1..line.len() {
        let before: f64 = (0..k).map(|j| line[j] * newton(&[j as u8], &[k as u8])).sum();
        line[k] -= before;
    }
    let last = line[15].abs();
    to_chebyshev(&mut line);
    for i in 0..=100 {
        let x = 0.02 * f64::from(i) - 1.0;
        assert!((series(&line, x).0 - f(x)).abs() < 4.0 * last, "{x}");
    }
}

#[test]
fn newtons_polynomials_stay_below_one() {
    for j in 0..MOST {
        for i in 0..=1000 {
            let x = 0.002 * f64::from(i) - 1.0;
            let value: f64 = (0..j).map(|i| (x - point(i)) / (point(j) - point(i))).product();
            assert!(value.abs() < 1.001, "{j} {x} {value}");
        }
    }
}
