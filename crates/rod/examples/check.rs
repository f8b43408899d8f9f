//! Random taps of every kind beside the reference.
use std::sync::Arc;
use vibrissa_core::physics::body::Body;
use vibrissa_core::physics::rod::RodProblem;
use vibrissa_core::physics::taper::Taper;
use vibrissa_core::scene::built::{Built, Inner, Profile, Root};
use vibrissa_core::scene::*;
use vibrissa_kernel::Chart;
use vibrissa_rod::*;

struct Random(u64);
impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn of(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.next()
    }
    fn yes(&mut self, p: f64) -> bool {
        self.next() < p
    }
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let only = args.get(1).cloned().unwrap_or_default();
    let count: usize = args.get(2).map_or(60, |x| x.parse().unwrap());
    let steep: f64 = args.get(3).map_or(10.0, |x| x.parse().unwrap());
    let kinds = [
        "hooke",
        "practical",
        "timoshenko",
        "neo",
        "mooney",
        "yeoh",
        "pole-far",
        "stick",
        "stick-neo",
        "coulomb",
        "passive",
        "sharp",
        "next",
        "profile",
        "power",
        "curved",
        "root",
        "bore",
        "core",
        "all",
    ];
    for kind in kinds {
        if !only.is_empty() && only != kind {
            continue;
        }
        let mut r = Random(7 + kind.len() as u64 * 1000 + kind.bytes().map(u64::from).sum::<u64>());
        let (mut solved, mut good, mut wrong, mut lost, mut sweeps) = (0, 0, 0, 0, 0.0);
        let mut errors = Vec::new();
        for k in 0..count {
            let d0 = r.of(6.0, 14.0);
            let ratio = if kind == "sharp" { r.of(0.02, 0.2) } else { r.of(0.2, 1.2) };
            let (big, small, length) = (d0, d0 * ratio, 50.0);
            let on = |r: &mut Random, names: &[&str]| names.contains(&kind) || kind == "all" && r.yes(0.4);
            let mut model = Model {
                geometry: Geometry::Exact,
                material: Material::Hooke(3.2),
                nu: 0.5,
                shear: false,
                extension: false,
                surface: false,
                pole_radius: 0.0,
                contact: Contact::Frictionless,
                indentation: false,
                distorting: false,
                clamp: Clamp::Rigid,
            };
            model.shear = on(
                &mut r,
                &[
                    "practical",
                    "timoshenko",
                    "neo",
                    "mooney",
                    "yeoh",
                    "stick-neo",
                    "bore",
                    "core",
                    "coulomb",
                    "pole-far",
                ],
            );
            model.extension = on(
                &mut r,
                &[
                    "practical",
                    "timoshenko",
                    "neo",
                    "mooney",
                    "yeoh",
                    "stick",
                    "stick-neo",
                    "bore",
                    "core",
                    "coulomb",
                ],
            );
            model.surface =
                on(&mut r, &["practical", "neo", "mooney", "yeoh", "stick-neo", "coulomb", "pole-far"]);
            if on(&mut r, &["practical", "pole-far"]) {
                model.pole_radius = 3.0;
            }
            match kind {
                "neo" | "stick-neo" | "pole-far" => model.material = Material::NeoHookean(3.2),
                "mooney" => model.material = Material::MooneyRivlin([0.35, 0.15]),
                "yeoh" => model.material = Material::Yeoh([0.5, -0.08, 0.02]),
                _ => {}
            }
            let side = if kind == "pole-far" { Side::Far } else { Side::Contact };
            let stick = kind.starts_with("stick");
            if stick {
                model.contact = Contact::Stick;
            }
            let mu = if kind == "coulomb" { r.of(0.05, 0.5) } else { 0.0 };
            if mu > 0.0 {
                model.contact = Contact::Coulomb(mu);
            }
            let mut built = Built::CONE;
            if on(&mut r, &["profile"]) && !model.surface {
                let knots = 2 + r.of(0.0, 4.0) as usize;
                let mut t: Vec<[f64; 2]> = (0..=knots)
                    .map(|i| {
                        [
                            length
                                * (i as f64 + if i == 0 || i == knots { 0.0 } else { 0.4 * r.of(-1.0, 1.0) })
                                / knots as f64,
                            d0 * (1.0 - (1.0 - ratio) * i as f64 / knots as f64) * r.of(0.9, 1.1),
                        ]
                    })
                    .collect();
                t[0][0] = 0.0;
                t[knots][0] = length;
                built.profile = Profile::Table(t);
            } else if on(&mut r, &["power"]) {
                built.profile = Profile::Power(r.of(0.4, 3.0));
            }
            if on(&mut r, &["bore"]) {
                built.inner = Some(Inner {
                    modulus: 0.0,
                    diameter: vec![[0.0, 0.15 * d0], [r.of(10.0, 50.0), 0.05 * d0]],
                });
            } else if on(&mut r, &["core"]) {
                built.inner =
                    Some(Inner { modulus: 60000.0, diameter: vec![[0.0, 0.5], [r.of(10.0, 50.0), 0.5]] });
            }
            if on(&mut r, &["curved"]) {
                built.curvature = [r.of(-0.015, 0.015), r.of(-2e-4, 2e-4)];
            }
            if on(&mut r, &["root"]) {
                built.root =
                    Root { k_theta: r.of(300.0, 3000.0), k_y: r.of(5.0, 50.0), k_x: r.of(5.0, 50.0) };
            }
            if let Some(i) = &built.inner {
                if i.diameter.iter().any(|k| k[1] >= 0.9 * small) {
                    continue;
                }
            }
            let is_built = built != Built::CONE;
            let a = if kind == "next" {
                7.0 + r.of(-1.9, 0.5)
            } else if kind == "sharp" {
                r.of(20.0, 49.5)
            } else {
                r.of(18.0, 48.0)
            };
            let passive = on(&mut r, &["passive"]);
            let amount =
                if passive { a * r.of(0.01, steep).to_radians() } else { r.of(0.1, steep).to_radians() };
            let hub = if passive {
                0.0
            } else if r.yes(0.3) {
                10.0
            } else {
                0.0
            };
            let body = Arc::new(Body::new(&built, [big, small, length], 3.2, 0.5));
            let taper = Taper::new(big, small, length);
            let gauge = if is_built { body.gauge(5.0, 2.0) } else { taper.gauge(5.0, 2.0) };
            if body.refuses(a, model.pole_radius, Some(hub)).is_some() {
                continue;
            }
            let drive = if passive { Drive::Displacement } else { Drive::Angle };
            let problem = RodProblem {
                taper,
                gauge,
                side,
                distance: a,
                hub,
                drive,
                amount,
                foil: None,
                body: is_built.then_some(&*body),
                model: &model,
            };
            let Ok(tap) = problem.solve() else { continue };
            solved += 1;
            let rod = if is_built {
                Rod::built(&body, gauge, None)
            } else {
                Rod::cone(&taper, [3.2, 0.5], gauge, None)
            };
            let law = !matches!(model.material, Material::Hooke(_));
            let effects = Effects {
                shear: model.shear,
                extension: model.extension,
                surface: model.surface,
                stick: tap.sticking && model.contact != Contact::Frictionless,
                law,
                far: side == Side::Far,
                ..Effects::default()
            };
            let chart = if law { Chart::new(&model.material, 0.15, [0.9, 0.0], [1e-11, 1e-9]) } else { None };
            let e0 = model.material.e0();
            let rod = Rod { moduli: [e0, rod.moduli[1]], ..rod };
            let t = Tap {
                rod: &rod,
                a,
                hub,
                turn: if passive { 0.0 } else { amount },
                lift: if passive { amount } else { 0.0 },
                ratio: if mu > 0.0 && !tap.sticking { mu.copysign(tap.tangential_force) } else { 0.0 },
                pole: model.pole_radius,
                softer: 1.0,
                soft: [0.0; 2],
                skin: None,
                least: 1e-3 * tap.strain.abs(),
            };
            let goal: f64 = args.get(4).map_or(1e-8, |x| x.parse().unwrap());
            let f = solve(&[t], effects, goal, chart.as_ref())[0];
            let o = [
                f.strain,
                f.error,
                f.normal,
                f.tangential,
                f.arc,
                f.wrench[0],
                f.wrench[1],
                f.wrench[2],
                f.sweeps,
            ];
            let force = tap.normal_force.hypot(tap.tangential_force);
            let e = [
                (o[0] / tap.strain - 1.0).abs(),
                (o[4] - tap.contact_arc).abs() / a,
                (o[2] - tap.normal_force).abs() / force,
                (o[3] - tap.tangential_force).abs() / force,
                (o[5] - tap.wrench[0]).abs() / (force * a),
                (o[6] - tap.wrench[1]).abs() / force,
                (o[7] - tap.wrench[2]).abs() / force,
            ];
            let w = e.iter().fold(0.0f64, |m, x| if x.is_nan() { f64::INFINITY } else { m.max(*x) });
            sweeps += o[8];
            let converged = o[1] <= goal;
            let limit = goal.max(1e-8);
            if !converged {
                lost += 1
            } else if e[0] <= limit && w <= 10.0 * limit {
                good += 1
            } else {
                wrong += 1
            }
            if (!converged || e[0] > limit || w > 10.0 * limit) && args.len() > 5 {
                println!(
                    "  {kind} {k}: error {:.1e} D {big:.2} d {small:.2} a {a:.2} amount {amount:.3} hub {hub} sweeps {} strain {:.4e} {:?}",
                    o[1],
                    o[8],
                    tap.strain,
                    e.map(|x| (x * 1e12).round() / 1e12)
                );
            }
            errors.push(w);
        }
        errors.sort_by(f64::total_cmp);
        let at =
            |p: f64| if errors.is_empty() { 0.0 } else { errors[((errors.len() - 1) as f64 * p) as usize] };
        println!(
            "{kind:12} reference {solved:4} good {good:4} wrong {wrong:3} lost {lost:3} sweeps {:.1} median {:.1e} p90 {:.1e} p99 {:.1e}",
            sweeps / f64::from(solved.max(1)),
            at(0.5),
            at(0.9),
            at(0.99)
        );
    }
}
