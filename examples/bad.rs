//! scratch
use vibrissa::{backend::Choice, design::Design, evaluate::*, scene::*, spec};
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
    let b = scene.model.clone();
    scene.model = Model { shear: true, extension: true, surface: true, contact: Contact::Stick, ..b.clone() };
    let mut ef = Evaluator::new(
        &scene,
        Choice::new(&mk(BackendChoice::Cpu, Precision::F64, 1e-8)).unwrap().open(&scene.model).unwrap(),
    );
    let mut er = Evaluator::new(
        &scene,
        Choice::new(&mk(BackendChoice::Reference, Precision::F64, 1e-8)).unwrap().open(&scene.model).unwrap(),
    );
    let mut s = 1u64;
    let mut rnd = || {
        s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (s >> 33) as f64 / (1u64 << 31) as f64
    };
    let n = 3000;
    let ds: Vec<Design> = (0..n)
        .map(|_| {
            Design::new(
                &scene,
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
    let (o, r) = (ef.run(&ds, &ts).unwrap(), er.run(&ds, &ts).unwrap());
    let mut k = 0;
    for i in 0..n {
        if o[i].strain.is_nan() || r[i].strain.is_nan() || (o[i].strain / r[i].strain - 1.0).abs() > 1e-7 {
            k += 1;
            if k < 25 {
                println!(
                    "D {:.2} d {:.2} a {:.2} th {:.2}: fast {} {:.5} sweeps {} ref {} {:.5} P {:.4} T {:.4}",
                    ds[i].tuple.D,
                    ds[i].tuple.d,
                    ts[i].a,
                    ts[i].drive,
                    o[i].status,
                    o[i].strain,
                    o[i].sweeps,
                    r[i].status,
                    r[i].strain,
                    r[i].normal_force,
                    r[i].tangential_force
                );
            }
        }
    }
    println!("{k} of {n}");
}
