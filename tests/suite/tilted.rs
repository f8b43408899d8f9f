//! Tilted poles and a second gauge, from spec to tables and search, by the closed forms of model §6: ε₁ = θ f cos²β, ε₂ = θ f cos β sin β.

use crate::common::program::Desk;
use crate::common::searching;
use crate::common::sweeping::{CPU, CPU_F64, Place, Table, sweep, sweep_with};

use vibrissa::design::Design;
use vibrissa::optimise::evaluate::Scorer;
use vibrissa::optimise::score::{Limit, Score, deviations};
use vibrissa::scene::{Column, Tuple};
use vibrissa::spec;

const WHISKER: &str = "[whisker]\nD = 10\nd = 4\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n";
const TAP: &str = "[tap]\na = [21, 33, 48]\ntilt = [-20, 0, 30]\nlean = 10\ntheta = [1, 4]\n";
const LINEAR: &str = "[model]\ngeometry = \"linear\"\n";

fn linear(more: &str) -> String {
    format!("{WHISKER}{more}{TAP}{LINEAR}")
}

#[track_caller]
fn close(found: &[f64], wanted: &[f64], within: f64) {
    assert_eq!(found.len(), wanted.len());
    for (f, w) in found.iter().zip(wanted) {
        assert!((f - w).abs() <= within * w.abs().max(1e-12), "{f} for {w}");
    }
}

/// Values of the same (distance, θ) at the upright pole.
fn upright(values: &[f64]) -> Vec<f64> {
    (0..values.len()).map(|t| values[t / 6 * 6 + 2 + t % 2]).collect()
}

#[test]
fn directions_stand_between_distance_and_drive() {
    let swept = sweep(&linear("second = true\n"), CPU);
    let before = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,a_mm,tilt_deg,lean_deg,theta_deg,strain,strain_linear,K,K_deviation,distance_mm,error_mm,\
                  sigma_mm,normal_force_N,tangential_force_N,contact_arc_mm,contact_state,strain_2,bending_azimuth_deg,slide_mm,status";
    assert_eq!(swept.tuples.columns.join(","), before);
    let designs = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,tilt_deg,lean_deg,theta_deg,n";
    assert_eq!(swept.designs.columns[..9].join(","), designs);
    let distances = "D_mm,d_tip_mm,L_a_mm,x_ss_mm,l_mm,a_mm,tilt_deg,lean_deg,n,K_mean,K_sd,status";
    assert_eq!(swept.distances.columns.join(","), distances);
    let nested: Vec<[f64; 3]> = [21.0, 33.0, 48.0]
        .iter()
        .flat_map(|a| [-20.0, 0.0, 30.0].map(|b| [1.0, 4.0].map(|theta| [*a, b, theta])).concat())
        .collect();
    let read = ["a_mm", "tilt_deg", "theta_deg"].map(|c| swept.tuples.values(c));
    assert_eq!((0..18).map(|t| [0, 1, 2].map(|k| read[k][t])).collect::<Vec<_>>(), nested);
    assert_eq!(swept.designs.values("tilt_deg"), [-20.0, -20.0, 0.0, 0.0, 30.0, 30.0]);
    assert_eq!(swept.designs.values("n"), [3.0; 6]);
    assert_eq!(swept.distances.values("tilt_deg"), [[-20.0, 0.0, 30.0]; 3].concat());
    assert_eq!(swept.distances.values("n"), [2.0; 9]);
    assert_eq!(swept.distances.values("lean_deg"), [10.0; 9]);
}

#[test]
fn two_gauges_tell_distances_at_any_tilt() {
    for side in ["", "side = \"far\"\n"] {
        let swept = sweep(&linear(&format!("second = true\n{side}")), CPU_F64);
        let tuples = &swept.tuples;
        let tilt: Vec<f64> = tuples.values("tilt_deg").iter().map(|b| b.to_radians()).collect();
        let by = |column: &str, f: &dyn Fn(f64) -> f64| {
            let at_zero = upright(&tuples.values(column));
            at_zero.iter().zip(&tilt).map(|(x, b)| x * f(*b)).collect::<Vec<_>>()
        };
        close(&tuples.values("strain"), &by("strain", &|b| b.cos().powi(2)), 1e-14);
        close(&tuples.values("strain_2"), &by("strain", &|b| b.cos() * b.sin()), 1e-14);
        close(&tuples.values("strain_linear"), &by("strain", &|_| 1.0), 1e-15);
        close(&tuples.values("normal_force_N"), &by("normal_force_N", &f64::cos), 1e-14);
        close(&tuples.values("sigma_mm"), &by("sigma_mm", &|b| b.cos().powi(-2)), 1e-9);
        close(&tuples.values("distance_mm"), &tuples.values("a_mm"), 1e-11);
        close(&tuples.values("bending_azimuth_deg"), &tuples.values("tilt_deg"), 1e-14);
        let slides: Vec<f64> = std::iter::zip(tuples.values("a_mm"), tuples.values("theta_deg"))
            .zip(&tilt)
            .map(|((a, theta), b)| -theta.to_radians() * a * b.sin() / 10f64.to_radians().cos())
            .collect();
        close(&tuples.values("slide_mm"), &slides, 1e-14);
        assert!(tuples.values("K_deviation").iter().all(|k| k.abs() < 1e-14));
        let designs = &swept.designs;
        assert!(designs.values("error_rms_mm").iter().all(|e| *e < 1e-9));
        let largest = designs.values("strain_max");
        for (row, b) in designs.values("tilt_deg").iter().enumerate() {
            let wanted = largest[2 + row % 2] * b.to_radians().cos();
            assert!((largest[row] / wanted - 1.0).abs() < 1e-14, "{row}");
        }
    }
}

#[test]
fn one_gauge_takes_a_tilt_for_less_strain() {
    let swept = sweep(&linear(""), CPU_F64);
    assert!(!swept.tuples.columns.iter().any(|c| c == "strain_2" || c == "slide_mm"));
    let tilt = swept.tuples.values("tilt_deg");
    let wanted: Vec<f64> = tilt.iter().map(|b| b.to_radians().cos().powi(-2)).collect();
    close(&swept.tuples.values("K"), &wanted, 1e-14);
    // Calibrated at its own tilt, a row has no error. Uncalibrated, and by the model of upright poles, it has the same error.
    assert!(swept.designs.values("error_rms_mm").iter().all(|e| *e < 1e-9));
    let errors = |estimate: &str| {
        let swept = sweep(&format!("{}[estimate]\n{estimate}", linear("")), CPU_F64);
        swept.tuples.values("error_mm")
    };
    let (plain, model) = (errors("K = 1\n"), errors("theory = \"exact\"\n"));
    // At 48 mm the model finds the reading of a tilted edge beyond the tip, so only the first 12 are compared.
    for ((plain, model), tilt) in plain.iter().zip(&model).zip(&tilt).take(12) {
        assert!((plain - model).abs() < 1e-7, "{plain} {model}");
        assert!(if *tilt == 0.0 { plain.abs() < 1e-9 } else { *plain > 0.5 }, "{plain} at {tilt}");
    }
}

fn without(text: &str, names: &[&str]) -> String {
    let header: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let keep = |line: &str| -> String {
        let kept = line.split(',').zip(&header).filter(|(_, name)| !names.contains(name));
        kept.map(|(value, _)| value).collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().map(keep).collect()
}

#[test]
fn naming_an_upright_pole_changes_no_other_byte() {
    let model = "[model]\nmaterial = { neo-hookean = 3.2 }\nsurface = true\nshear = true\nextension = true\n";
    let spec = |tap: &str| format!("{WHISKER}[tap]\na = [21, 33, 48]\ntheta = [1, 4]\n{tap}{model}");
    let desk = Desk::new(&spec(""));
    desk.sweep(&["--out", "plain"]).exits(0);
    desk.write("spec.toml", spec("tilt = 0\nlean = 0.0\n"));
    desk.sweep(&["--out", "named"]).exits(0);
    for table in ["tuples.csv", "designs.csv", "distances.csv"] {
        let named = desk.read(&format!("named/{table}"));
        assert!(named.contains(",tilt_deg,lean_deg,"));
        let plain = desk.read(&format!("plain/{table}"));
        assert_eq!(without(&named, &["tilt_deg", "lean_deg"]), plain, "{table}");
    }
}

/// A missing column is not shown and means 0°; a pole beyond 90° is invalid.
#[test]
fn a_tuple_file_may_lack_directions() {
    let listed =
        format!("[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\nsecond = true\n{LINEAR}");
    let text =
        "D_mm,theta_deg,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,tilt_deg\n10,1,4,50,5,2,21,100\n10,1,4,50,5,2,21,20\n";
    let swept = sweep_with(&listed, Some(text), CPU);
    assert!(!swept.tuples.columns.iter().any(|c| c == "lean_deg"));
    assert_eq!(swept.tuples.statuses(), ["invalid_geometry", "ok"]);
}

#[test]
fn sampled_directions_belong_to_their_samples() {
    let axis = |min: f64, max: f64| format!("{{ min = {min}, max = {max}, samples = 4, seed = 3 }}");
    let text = |d: &str, tilt: &str, theta: &str| {
        format!("{WHISKER}[tap]\na = [21, 33, 48]\ntilt = {tilt}\ntheta = {theta}\n{LINEAR}")
            .replace("d = 4", &format!("d = {d}"))
    };
    let pairs = |table: &Table| {
        std::iter::zip(table.values("tilt_deg"), table.values("theta_deg")).collect::<Vec<_>>()
    };
    let strokes = sweep(&text("[4, 7]", &axis(-30.0, 30.0), &axis(1.0, 4.0)), CPU);
    let rows = pairs(&strokes.designs);
    assert_eq!((rows.len(), strokes.tuples.rows.len(), strokes.distances.rows.len()), (8, 24, 24));
    assert_eq!(rows[..4], rows[4..]);
    assert_eq!(pairs(&strokes.tuples)[..4], rows[..4]);
    assert!(strokes.distances.values("n").iter().all(|n| *n == 1.0));
    // Zipped with a whisker, a direction belongs to the design: one point set, dimensions in row order.
    let whiskers = sweep(&text(&axis(4.0, 7.0), &axis(-30.0, 30.0), "[1, 4]"), CPU);
    assert_eq!((whiskers.designs.rows.len(), whiskers.distances.rows.len()), (8, 12));
    let tilts = whiskers.designs.values("tilt_deg");
    assert!((0..4).all(|k| tilts[2 * k] == tilts[2 * k + 1]));
}

const SEARCH: &str = "[whisker]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 0\n[tap]\na = [21, 33, 48]\n[model]\ngeometry = \"linear\"\n\
                      [optimise]\nobjective = \"distance\"\nvariables = { D = [8, 12], d = [2, 10], theta = [0.5, 10] }\n";

fn scored(text: &str, place: Place) -> Score {
    let (spec, search) = searching::parse(text);
    let (setup, layout) = (&spec.study.setup, searching::layout(&spec));
    let mut scorer = Scorer::new(setup, &layout, &search, place.open(setup));
    let point = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, drive: 2.0, ..Tuple::default() };
    scorer.scores(&[point]).expect("closed forms")[0]
}

fn total(text: &str, place: Place) -> f64 {
    scored(text, place).figures[1]
}

/// To first order â − a = −β² f/f′; its mean over a normal distribution cut at 3σ contains 0.97334 σ².
#[test]
fn a_robust_tilt_is_never_calibrated_away() {
    let robust = |more: &str| format!("{SEARCH}robust = {{ tilt = 2, samples = 1024{more} }}\n");
    let spec = spec::parse("t.toml", &linear(""), "".as_ref()).expect("a spec");
    let whisker = Tuple { D: 10.0, d: 4.0, L_a: 50.0, x_ss: 5.0, l: 2.0, ..Tuple::default() };
    let design = Design::new(&spec.study.setup, whisker);
    let curve = design.shared.as_ref().expect("a whisker").theory.curve();
    let squares = [21.0, 33.0, 48.0].map(|a| (curve.value(a) / curve.slope(a)).powi(2));
    let wanted = 0.97334 * 2f64.to_radians().powi(2) * (squares.iter().sum::<f64>() / 3.0).sqrt();
    let each = total(&robust(""), CPU);
    assert!((each / wanted - 1.0).abs() < 0.01, "{each} {wanted}");
    let nominal = total(&robust(", calibrated = \"nominal\""), CPU);
    assert!((nominal / each - 1.0).abs() < 1e-9, "{nominal} {each}");
    let model = total(&format!("{}[estimate]\ntheory = \"exact\"\n", robust("")), CPU);
    assert!((model / each - 1.0).abs() < 1e-6, "{model} {each}");
    // The worst tenth of 25 samples, 2.5 of them; the limit that nine of ten keep.
    let tilts = |n| {
        let all = deviations(searching::parse(&robust("")).1.seed, n);
        let mut all: Vec<f64> = all.iter().map(|z| z[Column::Tilt as usize].abs()).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        all
    };
    let of = |n: u32, more: &str| robust(more).replace("1024", &n.to_string());
    let z: Vec<f64> = tilts(25).iter().map(|z| z * z).collect();
    let wanted = (z[0] + z[1] + 0.5 * z[2]) / 2.5 / (z.iter().sum::<f64>() / 25.0);
    let found = total(&of(25, ", measure = \"cvar90\""), CPU) / total(&of(25, ""), CPU);
    assert!((found / wanted - 1.0).abs() < 0.02, "{found} {wanted}");
    let score = scored(&of(10, "").replace("robust", "limits = { strain = 0.01 }\nrobust"), CPU);
    let [strain, kept] = [Limit::Strain, Limit::Samples].map(|limit| score.limit(limit) + 1.0);
    assert!(
        (kept / strain - (2.0 * tilts(10)[8]).to_radians().cos().powi(2)).abs() < 1e-12,
        "{kept} {strain} {:?}",
        tilts(10)
    );
    // A second gauge knows the tilt; a lean costs nothing as θ → 0.
    let second = |text: &str| text.replace("noise_strain = 0", "noise_strain = 0\nsecond = true");
    assert!(total(&second(&robust("")), CPU) < 1e-9);
    assert!(total(&robust("").replace("tilt = 2", "lean = 2"), CPU) < 1e-9);
    assert!(total(SEARCH, CPU) < 1e-9);
}

#[test]
fn searches_and_taps_go_through_with_directions() {
    let text = format!("{SEARCH}budget = {{ evaluations = 300 }}\nrobust = {{ tilt = 5, samples = 8 }}\n")
        .replace("noise_strain = 0", "noise_strain = 1e-6");
    let desk = Desk::new(&text);
    desk.ok("optimise spec.toml --backend cpu --out found");
    desk.ok("sweep found/best.toml --backend cpu --out swept");
    let two = text.replace("theta = [0.5, 10]", "l = [1, 3]").replace("l = 2\n", "second = true\n");
    let two = two.replace("a = [21", "tilt = 10\ntheta = [1, 2]\na = [21");
    desk.write("two.toml", two.replace("robust", "# robust"));
    desk.ok("optimise two.toml --backend cpu --out two");
    let best = desk.read("two/best.toml");
    assert!(best.contains("tilt = 10") && best.contains("second = true"), "{best}");
    desk.ok("sweep two/best.toml --backend cpu --out swept-two");
    assert_eq!(desk.table("swept-two/designs.csv").columns[5..7], ["tilt_deg", "theta_deg"]);
    let tap = linear("second = true\n").replace("[-20, 0, 30]", "20").replace("theta = [1, 4]\n", "");
    desk.write("tap.toml", &tap);
    desk.ok("tap tap.toml --backend cpu --out tapped");
    desk.write("tap.toml", tap.replace("tilt = 20", "tilt = [0, 20]"));
    desk.refuses("tap tap.toml --backend cpu --out tapped", &["tap.tilt"]);
}
