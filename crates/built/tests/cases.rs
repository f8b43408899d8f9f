//! Temporary.
#![allow(missing_docs)]
use std::collections::HashMap;
use std::sync::Arc;
use vibrissa_built::{Effects, Rod, Tap, solve};
use vibrissa_core::physics::body::Body;
use vibrissa_core::physics::flexure::Flexure;
use vibrissa_core::scene::{Built, Drive, Material, Precision, Signal};
use vibrissa_core::scene::built::{Inner, Profile, Root};
use vibrissa_kernel::{Chart, Rung};

#[test]
fn cases() {
    let text = std::fs::read_to_string("/work/shared/reference/general_cases.csv").unwrap();
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    for precision in [Precision::F64, Precision::F32] {
    let mut worst = [0.0f64; 4];
    let mut shots = 0.0; let mut lost = 0;
    for (n, line) in text.lines().skip(1).enumerate() {
        let row: HashMap<&str, &str> = head.iter().copied().zip(line.split(',')).collect();
        let num = |k: &str| row[k].parse::<f64>().unwrap_or(f64::NAN);
        let table = |k: &str| -> Vec<[f64; 2]> { row[k].split(';').filter(|x| !x.is_empty()).map(|p| { let mut i = p.split(':').map(|x| x.parse::<f64>().unwrap()); [i.next().unwrap(), i.next().unwrap()] }).collect() };
        let (mut d0, mut d1, mut la) = (num("D_mm"), num("d_mm"), num("L_a_mm"));
        let profile = if row["profile"].is_empty() { Profile::Power(if row["exponent"].is_empty() { 1.0 } else { num("exponent") }) } else { let t = table("profile"); d0 = t[0][1]; d1 = t[t.len()-1][1]; la = t[t.len()-1][0]; Profile::Table(t) };
        let inner = if !row["bore"].is_empty() { Some(Inner { modulus: 0.0, diameter: table("bore") }) } else if !row["core"].is_empty() { Some(Inner { modulus: num("E_core_MPa"), diameter: table("core") }) } else { None };
        let built = Built { profile, inner, curvature: [num("kappa_base_per_mm"), num("kappa_slope_per_mm2")], root: Root { k_theta: num("k_theta_Nmm_per_rad"), k_y: num("k_y_N_per_mm"), k_x: num("k_x_N_per_mm") } };
        let e = num("E_MPa");
        let material = match row["material"] { "hooke" => Material::Hooke(e), "neo-hookean" => Material::NeoHookean(e), m => { println!("material {m}"); continue; } };
        let body = Arc::new(Body::new(&built, [d0, d1, la], material.e0(), num("nu")));
        let gauge = body.gauge(num("x_ss_mm"), num("l_mm"));
        let flag = |k: &str| row[k].eq_ignore_ascii_case("true");
        let angle = !row["theta_deg"].is_empty();
        let drive = if angle { Drive::Angle } else { Drive::Displacement };
        let amount = if angle { num("theta_deg").to_radians() } else { num("delta_mm") };
        let a = num("a_mm");
        let hub = if angle { num("hub_mm") } else { 0.0 };
        let flex = Flexure::new(body.clone(), Signal::Force, gauge, (hub, drive), flag("shear"));
        let rod = Rod::new(&body, gauge);
        let stick = row["contact_state"] == "stick";
        let mu = num("mu");
        let t = num("tangential_force_N");
        let ratio = if stick || !(mu > 0.0) { 0.0 } else { mu.copysign(t) };
        let effects = Effects { shear: flag("shear"), extension: flag("extension"), surface: flag("surface"), stick, law: !matches!(material, Material::Hooke(_)), far: false, curved: !body.is_straight(), inner: body.is_composite(), power: body.power().is_some() };
        let tap = Tap { rod: &rod, a, hub, turn: if angle { amount } else { 0.0 }, lift: if angle { 0.0 } else { amount }, ratio, force: flex.force(a) * amount, least: 1e-9, pole: num("pole_radius_mm") };
        let tol = if precision == Precision::F64 { 1e-9 } else { 1e-5 };
        let rungs = Rung::ladder(precision, &material, tol);
        let chart: Option<&Chart> = rungs.last().and_then(|r| r.chart());
        let s = solve(&[tap], effects, (precision, tol), chart)[0];
        shots += s.shots;
        let rel = |x: f64, k: &str| (x / num(k) - 1.0).abs();
        let errs = [rel(s.strain, "strain"), rel(s.wrench[0], "base_moment_Nmm"), rel(s.wrench[2], "base_fy_N"), rel(s.arc, "contact_arc_mm")];
        println!("{n:2} {:12} st {:18} amount {amount:.3} est {:8.1e} shots {:3} load {:.2} strain {:.1e} M0 {:.1e} Fy {:.1e} arc {:.1e}  fx {:.1e}", row["config"], row["status"], s.error, s.shots, s.load, errs[0], errs[1], errs[2], errs[3], rel(s.wrench[1], "base_fx_N"));
        if row["strain"].is_empty() { continue; }
        if s.error <= tol { for k in 0..4 { worst[k] = worst[k].max(errs[k]); } } else { lost += 1; }
    }
    println!("{precision:?} worst {worst:?} lost {lost} shots {shots}");
    }
}
