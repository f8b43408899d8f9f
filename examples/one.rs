//! scratch
use vibrissa::{backend::Choice, design::Design, evaluate::*, scene::*, spec};
fn main() {
    let a: Vec<f64> = std::env::args().skip(1).map(|x| x.parse().unwrap()).collect();
    let mut scene = spec::parse(
        "x.toml",
        "[whisker]\nD=10\nd=4\nL_a=50\n[gauge]\nx_ss=5\nl=2\n[tap]\na=[21,22]\ntheta=1",
        std::path::Path::new(""),
    )
    .unwrap();
    scene.model = Model {
        geometry: Geometry::Exact,
        shear: true,
        extension: true,
        surface: true,
        pole_radius: 0.0,
        nu: 0.5,
        contact: Contact::Frictionless,
        material: Material::NeoHookean(3.2),
    };
    scene.hub = a[7];
    let t = Tuple { D: a[0], d: a[1], L_a: a[2], x_ss: a[3], l: a[4], a: a[5], drive: a[6] };
    for be in [BackendChoice::Reference, BackendChoice::Cpu] {
        let opt = RunOptions { backend: Some(be), precision: Some(Precision::F64), ..Default::default() };
        let ch = Choice::new(&opt).unwrap();
        let mut ev = Evaluator::new(&scene, ch.open(&scene.model).unwrap());
        println!(
            "{:?}",
            ev.run(&[Design::new(&scene, t)], &[Task { design: 0, a: t.a, drive: t.drive }]).unwrap()[0]
        );
    }
}
