//! scratch
use vibrissa::{backend::Choice, design::Design, evaluate::*, reduce::Spread, scene::*, spec};
fn main() {
    let mk = |be, p, tol| RunOptions {
        backend: Some(be),
        precision: Some(p),
        tolerance: Some(tol),
        ..Default::default()
    };
    let mut scene = spec::parse(
        "x.toml",
        "[whisker]\nD=10\nd=4\nL_a=50\n[gauge]\nx_ss=5\nl=2\n[tap]\na=[21,22]\ntheta=1",
        std::path::Path::new(""),
    )
    .unwrap();
    let base = scene.model.clone();
    let full = Model {
        shear: true,
        extension: true,
        surface: true,
        material: Material::NeoHookean(3.2),
        ..base.clone()
    };
    let tim = Model { shear: true, extension: true, ..base.clone() };
    let stick = Model { contact: Contact::Stick, ..full.clone() };
    for (name, m) in [("hooke", base), ("timoshenko", tim), ("neo", full), ("stick", stick)] {
        scene.model = m;
        for (be, p, tol) in
            [(BackendChoice::Cpu, Precision::F32, 1e-6), (BackendChoice::Gpu, Precision::F32, 1e-6)]
        {
            let o64 = mk(BackendChoice::Cpu, Precision::F64, 1e-10);
            let (c32, c64) = (Choice::new(&mk(be, p, tol)).unwrap(), Choice::new(&o64).unwrap());
            let mut e32 = Evaluator::new(&scene, c32.open(&scene.model).unwrap());
            let mut e64 = Evaluator::new(&scene, c64.open(&scene.model).unwrap());
            for d in [2.0, 3.0, 4.0, 7.0, 10.0, 12.0] {
                let mut line = format!("{name} {be:?} d {d}: ");
                for th in [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 5.0, 10.0] {
                    let ds = [Design::new(
                        &scene,
                        Tuple { D: 10.0, d, L_a: 50.0, x_ss: 5.0, l: 2.0, a: 0.0, drive: 0.0 },
                    )];
                    let t: Vec<Task> =
                        (0..10).map(|i| Task { design: 0, a: 21.0 + 3.0 * i as f64, drive: th }).collect();
                    let tl: Vec<Task> = t.iter().map(|t| Task { drive: 1e-6, ..*t }).collect();
                    let (a, b, k0) =
                        (e32.run(&ds, &t).unwrap(), e64.run(&ds, &t).unwrap(), e64.run(&ds, &tl).unwrap());
                    let sd = |o: &[Outcome]| {
                        let mut s = Spread::default();
                        o.iter().for_each(|o| s.push(o.deviation));
                        s.sd().unwrap()
                    };
                    let t2 = 0.02 * f64::to_radians(th).powi(2);
                    let kd = a
                        .iter()
                        .zip(&b)
                        .zip(&k0)
                        .map(|((x, y), z)| {
                            (x.deviation - y.deviation).abs()
                                / if name == "hooke" {
                                    y.deviation.abs().max(t2)
                                } else {
                                    (y.deviation - z.deviation).abs() + t2
                                }
                        })
                        .fold(0.0, f64::max);
                    let es =
                        a.iter().zip(&b).map(|(x, y)| (x.strain / y.strain - 1.0).abs()).fold(0.0, f64::max);
                    line += &format!("{th}: {:.0e} {kd:.0e} {es:.0e} | ", (sd(&a) / sd(&b) - 1.0).abs());
                }
                println!("{line}");
            }
        }
    }
    // speed per configuration
    let n = 1 << 18;
    let mut s = 1u64;
    let mut rnd = || {
        s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (s >> 33) as f64 / (1u64 << 31) as f64
    };
    let mut sc = scene.clone();
    sc.model = Model {
        geometry: Geometry::Exact,
        shear: false,
        extension: false,
        surface: false,
        pole_radius: 0.0,
        nu: 0.5,
        contact: Contact::Frictionless,
        material: Material::Hooke(3.2),
    };
    let b = sc.model.clone();
    let full = Model { shear: true, extension: true, surface: true, ..b.clone() };
    let ds: Vec<Design> = (0..n)
        .map(|_| {
            Design::new(
                &sc,
                Tuple {
                    D: 8.0 + 4.0 * rnd(),
                    d: 2.0 + 5.0 * rnd(),
                    L_a: 50.0,
                    x_ss: 5.0,
                    l: 2.0,
                    a: 0.0,
                    drive: 0.0,
                },
            )
        })
        .collect();
    let ts: Vec<Task> =
        (0..n).map(|i| Task { design: i as u32, a: 20.0 + 28.0 * rnd(), drive: 0.5 + 9.5 * rnd() }).collect();
    for (be, p, tol) in [
        (BackendChoice::Cpu, Precision::F32, 1e-5),
        (BackendChoice::Gpu, Precision::F32, 1e-5),
        (BackendChoice::Cpu, Precision::F64, 1e-8),
        (BackendChoice::Gpu, Precision::F64, 1e-8),
    ] {
        for (name, m) in [
            ("linear", Model { geometry: Geometry::Linear, ..b.clone() }),
            ("hooke", b.clone()),
            ("shear", Model { shear: true, ..b.clone() }),
            ("ext", Model { extension: true, ..b.clone() }),
            ("surface", Model { surface: true, ..b.clone() }),
            ("neo only", Model { material: Material::NeoHookean(3.2), ..b.clone() }),
            ("full hooke", full.clone()),
            ("full neo", Model { material: Material::NeoHookean(3.2), ..full.clone() }),
            ("full stick", Model { contact: Contact::Stick, ..full.clone() }),
            (
                "neo coulomb",
                Model { contact: Contact::Coulomb(0.3), material: Material::NeoHookean(3.2), ..full.clone() },
            ),
        ] {
            sc.model = m.clone();
            let mut ev = Evaluator::new(&sc, Choice::new(&mk(be, p, tol)).unwrap().open(&m).unwrap());
            ev.run(&ds, &ts).unwrap();
            let t0 = std::time::Instant::now();
            let o = ev.run(&ds, &ts).unwrap();
            println!(
                "{be:?} {p:?} {name}: {:.2} M/s sweeps {:.2} bad {}",
                n as f64 / t0.elapsed().as_secs_f64() / 1e6,
                o.iter().map(|o| o.sweeps as f64).sum::<f64>() / n as f64,
                o.iter().filter(|o| o.strain.is_nan()).count()
            );
        }
    }
}
