//! Compares with general_cases.csv.
use std::collections::HashMap;
use vibrissa_core::physics::body::Body;
use vibrissa_core::scene::built::{Built, Inner, Profile, Root};
use vibrissa_rod::*;

fn table(text: &str) -> Vec<[f64; 2]> {
    text.split(';').map(|p| { let (a, b) = p.split_once(':').unwrap(); [a.parse().unwrap(), b.parse().unwrap()] }).collect()
}

fn main() {
    let n: usize = std::env::args().nth(1).map_or(16, |x| x.parse().unwrap());
    let only = std::env::args().nth(2);
    let mut reader = csv::Reader::from_path("/work/shared/reference/general_cases.csv").unwrap();
    let mut worst: HashMap<String, (usize, f64, f64, f64)> = HashMap::new();
    for (line, row) in reader.deserialize::<HashMap<String, String>>().enumerate() {
        let row = row.unwrap();
        let config = row["config"].clone();
        if only.as_ref().is_some_and(|o| *o != config && *o != line.to_string()) { continue; }
        let num = |k: &str| row[k].parse::<f64>().unwrap_or(0.0);
        if row["strain"].is_empty() || row["material"] != "hooke" { continue; }
        let inner = |k: &str, m: f64| (!row[k].is_empty()).then(|| {
            let d = if row[k].contains(':') { table(&row[k]) } else { vec![[0.0, num(k)], [num("L_a_mm").max(1.0), num(k)]] };
            Inner { modulus: m, diameter: d }
        });
        let profile = if row["profile"].is_empty() { Profile::Power(if row["exponent"].is_empty() { 1.0 } else { num("exponent") }) } else { Profile::Table(table(&row["profile"])) };
        let length = match &profile { Profile::Table(t) => t[t.len() - 1][0], _ => num("L_a_mm") };
        let built = Built { profile, inner: inner("bore", 0.0).or(inner("core", num("E_core_MPa"))),
            curvature: [num("kappa_base_per_mm"), num("kappa_slope_per_mm2")],
            root: Root { k_theta: num("k_theta_Nmm_per_rad"), k_y: num("k_y_N_per_mm"), k_x: num("k_x_N_per_mm") } };
        let body = Body::new(&built, [num("D_mm"), num("d_mm"), length], num("E_MPa"), num("nu"));
        let gauge = body.gauge(num("x_ss_mm"), num("l_mm"));
        let rod = Rod::built(&body, gauge, None);
        let on = |k: &str| row[k].eq_ignore_ascii_case("true");
        let sticks = row["contact_state"] == "stick" || row["contact"] == "stick";
        let effects = Effects { shear: on("shear"), extension: on("extension"), surface: on("surface"), stick: sticks, law: false, far: false,
            curved: !body.is_straight(), inner: body.knots().len() > 0 && built.inner.is_some() || built.inner.is_some(), power: rod.power.is_some() };
        let t = num("tangential_force_N");
        let ratio = if sticks || row["contact"] == "frictionless" { 0.0 } else { num("mu").copysign(t) };
        let tap = Tap { rod: &rod, a: num("a_mm"), hub: if num("delta_mm") != 0.0 { 0.0 } else { num("hub_mm") }, turn: num("theta_deg").to_radians(), lift: num("delta_mm"), ratio, pole: num("pole_radius_mm"), softer: 1.0, least: 0.0 };
        let taps = [tap];
        let mut out = Vec::new();
        unsafe {
            match n {
                6 => f64_6(&fixed(14, None), effects, &taps, 1e-11, 60, &mut out),
                8 => f64_8(&fixed(14, None), effects, &taps, 1e-11, 60, &mut out),
                10 => f64_10(&fixed(14, None), effects, &taps, 1e-11, 60, &mut out),
                24 => f64_24(&fixed(14, None), effects, &taps, 1e-11, 60, &mut out),
                32 => f32_6(&fixed(6, None), effects, &taps, 1e-6, 60, &mut out),
                _ => f64_16(&fixed(14, None), effects, &taps, 1e-11, 60, &mut out),
            }
        }
        let o = out[0];
        let e = |x: f64, k: &str| (x / num(k) - 1.0).abs();
        let force = num("normal_force_N").hypot(t);
        let errors = [e(o[0], "strain"), e(o[4], "contact_arc_mm"), (o[2] - num("normal_force_N")).abs() / force, e(o[5], "base_moment_Nmm"), (o[6] - num("base_fx_N")).abs() / force, (o[7] - num("base_fy_N")).abs() / force];
        let w = errors.iter().fold(0.0f64, |a, b| if b.is_nan() { f64::NAN } else { a.max(*b) });
        if only.is_some() || w > 1e-6 || w.is_nan() { println!("{line} {config} {} sweeps {} errors {errors:?}", row["contact_state"], o[8]); }
        let one = worst.entry(config).or_default();
        one.0 += 1;
        one.1 = if w.is_nan() { 1.0 } else { one.1.max(w) };
        one.2 = one.2.max(o[8]);
        one.3 += o[8];
    }
    let mut all: Vec<_> = worst.into_iter().collect();
    all.sort_by(|a, b| a.0.cmp(&b.0));
    for (c, (k, w, s, m)) in all { println!("{c:14} {k:3} worst {w:.2e} sweeps most {s} mean {:.1}", m / k as f64); }
}
