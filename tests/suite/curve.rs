//! A material measured as a stress–strain curve: read, fitted, refused, reported.

use std::path::Path;

use crate::common::program::Desk;
use serde_json::Value;
use vibrissa::error::InputError;
use vibrissa::scene::{Material, Spec};
use vibrissa::spec;

const RUBBER: &str = "# rubber, third loading\nstrain,stress_MPa\n\
    0,0\n0.1,0.3\n0.2,0.5\n0.4,0.85\n0.6,1.2\n# cut\n0.8,1.5\n1.0,1.95\n";

const SPEC: &str = r#"
whisker = { D = 10, d = 4, L_a = 50 }
gauge = { x_ss = 5, l = 2 }
tap = { a = [30, 40], theta = [2, 4] }
[model]
material = { curve = "rubber.csv" }
"#;

fn desk(curve: &[u8], spec: &str) -> Desk {
    let desk = Desk::new(spec);
    desk.write("rubber.csv", curve);
    desk
}

fn read(curve: &[u8]) -> Result<Spec, InputError> {
    spec::read(&desk(curve, SPEC).path("spec.toml"))
}

#[test]
fn a_curve_becomes_a_yeoh_law() {
    let spec = read(RUBBER.as_bytes()).unwrap();
    let fit = spec.material_fit.unwrap();
    assert_eq!(spec.study.setup.model.material, Material::Yeoh(fit.coefficients));
    // By least squares in numpy.
    for (found, c) in fit.coefficients.into_iter().zip([0.50303049, -0.02479072, 0.01273667]) {
        assert!((found - c).abs() < 1e-7, "{found} for {c}");
    }
    assert_eq!((fit.points, fit.range), (7, [0.0, 1.0]));
    assert!((fit.rms - 0.016242426495647715 * (6.0f64 / 7.0).sqrt()).abs() < 1e-12);
    assert!(fit.file.ends_with("rubber.csv") && spec.warnings.is_empty());
    assert!(fit.covers(1.0) && !fit.covers(1.1));

    let plain = SPEC.replace("curve = \"rubber.csv\"", "hooke = 3.2");
    assert!(spec::parse("plain.toml", &plain, Path::new("")).unwrap().material_fit.is_none());
}

#[test]
fn any_order_extra_columns_and_compression() {
    let spec = read(
        b"\xef\xbb\xbfstress_MPa,note,strain,t_s\r\n0.3,\"a,\nb\",0.1,1\r\n1.95,,1.0,2\r\n0.85,,0.4,3\r\n\
          -1.4,,-0.3,4\r\n0.85,again,0.4,5\r\n1.5,,0.8,x\r\n-0.34,,-0.1,\r\n",
    )
    .unwrap();
    let fit = spec.material_fit.unwrap();
    assert_eq!((fit.points, fit.range), (6, [-0.3, 1.0]));
    assert!(fit.covers(0.3) && !fit.covers(0.31));
    assert_eq!(spec.warnings.len(), 1);
    assert!(spec.warnings[0].ends_with("rubber.csv: ignored columns note, t_s"), "{:?}", spec.warnings);
}

#[test]
fn semicolons_and_decimal_commas_are_read_as_in_data() {
    let fit = |text: &str| read(text.as_bytes()).unwrap_or_else(|e| panic!("{e}")).material_fit.unwrap();
    let plain = fit(RUBBER);
    for text in [
        RUBBER.replace(',', ";").replace('.', ","),
        RUBBER.replace(',', ";"),
        RUBBER.replace(',', "\t").replace('.', ","),
        RUBBER.replace(',', " ; ").replace('.', ",").replace('\n', "\r\n"),
    ] {
        let found = fit(&text);
        assert_eq!((found.coefficients, found.points), (plain.coefficients, plain.points), "{text}");
    }
}

fn coefficients(fit: &Value) -> Vec<f64> {
    fit["coefficients_MPa"].as_array().unwrap().iter().map(|c| c.as_f64().unwrap()).collect()
}

#[test]
fn the_fit_is_reported() {
    let desk = desk(RUBBER.as_bytes(), SPEC);
    let known = spec::read(&desk.path("spec.toml")).unwrap().material_fit.unwrap().coefficients;
    let text = desk.sweep(&["--plan"]).exits(0).stdout;
    let law = format!("rubber.csv: yeoh = [{}, {}, {}] MPa", known[0], known[1], known[2]);
    assert!(text.contains(&law), "{text}");
    let plan = desk.sweep(&["--plan", "--json"]).exits(0).json();
    assert_eq!(coefficients(&plan["result"]["material_fit"]), known);

    let ran = desk.sweep(&["--out", "out"]).exits(0);
    assert!(!ran.stderr.contains("warning"), "{}", ran.stderr);
    let fit = desk.whole("out")["material_fit"].clone();
    assert_eq!(coefficients(&fit), known);
    assert_eq!((fit["points"].as_u64(), fit["within_data_range"].as_bool()), (Some(7), Some(true)));
    assert_eq!(fit["range"].to_string(), "[0.0,1.0]");
    let largest = fit["largest_gauge_strain"].as_f64().unwrap();
    let strains = desk.table("out/tuples.csv").numbers("strain").into_iter().flatten().map(f64::abs);
    assert!((largest / strains.fold(0.0, f64::max) - 1.0).abs() < 1e-6 && largest > 0.01);
}

#[test]
fn strain_beyond_the_data_is_told() {
    let rows = (1..=6).map(|i| {
        let l = 1.0 + f64::from(i) / 600.0;
        format!("{},{}\n", l - 1.0, l - 1.0 / (l * l))
    });
    let small = format!("strain,stress_MPa\n{}", rows.collect::<String>());
    let desk = desk(small.as_bytes(), SPEC);
    let said = desk.sweep(&["--out", "out"]).exits(0).stderr;
    let parts = ["warning: the largest gauge strain", "rubber.csv, 0.00166"];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    assert_eq!(desk.whole("out")["material_fit"]["within_data_range"], false);
    assert_eq!(desk.sweep(&["--out", "out", "--quiet"]).stderr, "");
}
