//! `vibrissa optimise`: files, answer, stop conditions.

use crate::common;

use std::sync::atomic::AtomicBool;

use crate::common::program::Desk;
use crate::common::searching::{parse, search};
use crate::common::sweeping::{CPU, GPU, number};
use vibrissa::optimise::session::Ended;
use vibrissa::optimise::{self, Step, Watch};
use vibrissa::scene::search::Quantity;
use vibrissa::scene::{Column, RunOptions};

const SPEC: &str = "[whisker]\nD = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n\
                    [tap]\na = { from = 21, to = 48, step = 3 }\n\
                    [optimise]\nobjective = \"distance\"\nvariables = { d = [2, 10], theta = [0.5, 10] }\nlimits = { strain = 0.02 }\n";

/// Steps as text, so that two missing figures compare equal.
fn told(history: &[Step]) -> String {
    format!("{history:?}")
}

/// A cone by angle and by displacement, and a whisker with a core on an elastic root.
#[test]
fn best_toml_runs_in_sweep_and_gives_the_same_figures() {
    let moved = SPEC
        .replace("[tap]\n", "[tap]\ndrive = \"displacement\"\n")
        .replace("theta = [0.5, 10]", "delta = [0.1, 5]");
    let built = "[whisker]\nD = 10\nd = 4\nL_a = 50\ncore = { diameter = 0.5, modulus = 60000 }\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-5\n[tap]\na = [20, 30, 40]\ntheta = 4\n\
                 [optimise]\nobjective = \"distance\"\nvariables = { d = [3, 6], core = { diameter = [0.2, 1] }, k_theta = [200, 2000], E = [2, 4] }\n\
                 robust = { k_theta = 20, nu = 0.01, samples = 4 }\nbudget = { evaluations = 120 }\nlimits = { strain = 1 }\n";
    // The JSON reader may round the last digit differently.
    let close = |a: f64, b: f64| (a - b).abs() <= f64::EPSILON * b.abs();
    for (text, precision, columns) in [
        (
            SPEC,
            "",
            "D_mm d_tip_mm theta_deg K_mean K_sd error_rms_mm noise_rms_mm total_rms_mm strain_max force_max_N",
        ),
        (&moved, "", "d_tip_mm delta_mm total_rms_mm"),
        (built, " --precision f64", "core_mm k_theta_Nmm_per_rad E_MPa K_sd force_max_N"),
    ] {
        let desk = Desk::new(text);
        let json = desk.json(format!("optimise spec.toml --backend cpu{precision} --out found"));
        assert_eq!((json["command"].as_str(), json["ok"].as_bool()), (Some("optimise"), Some(true)));
        assert_eq!(desk.names("found"), ["best.toml", "history.csv", "run.json", "sensitivity.csv"]);
        desk.ok(format!("sweep found/best.toml{precision} --out again --quiet"));
        let row = &desk.table("again/designs.csv").rows[0];
        let best = &json["result"]["best"];
        for column in columns.split(' ') {
            let found = best[column].as_f64().unwrap_or_else(|| panic!("{column}: {best}"));
            let swept = row.get(column).map_or(found, |x| x.parse().unwrap());
            assert!(
                close(swept, found) || text == built && column == "total_rms_mm",
                "{column}: {swept:e} {found:e}"
            );
        }
        let history = desk.table("found/history.csv");
        let last = history.rows.last().unwrap();
        assert_eq!(number(last, "evaluations"), json["counts"]["evaluations"].as_f64());
        if text != built {
            assert_eq!(json["result"]["value"], best["total_rms_mm"]);
            let [told, written] =
                [json["result"]["value"].as_f64(), number(last, "total_rms_mm")].map(Option::unwrap);
            assert!(close(told, written), "{told:e} {written:e}");
        } else {
            assert!(
                history.columns.iter().any(|name| name == "k_theta_Nmm_per_rad"),
                "{:?}",
                history.columns
            );
        }
        if text == SPEC {
            assert_eq!(json["result"]["binding_limits"][0], "strain");
            let strain = best["strain_max"].as_f64().unwrap();
            assert!(strain <= 0.02 && strain > 0.02 * (1.0 - 1e-6), "{strain}");
        }
    }
}

#[test]
fn the_same_seed_finds_the_same_on_every_backend_again() {
    for place in [CPU, GPU] {
        let (a, b) = (search(SPEC, place), search(SPEC, place));
        assert_eq!(a.best.point, b.best.point);
        assert_eq!((a.value, a.evaluations, told(&a.history)), (b.value, b.evaluations, told(&b.history)));
        let other = search(&format!("{SPEC}seed = 2\n"), place);
        assert_ne!(told(&a.history), told(&other.history));
        assert!((a.value / other.value - 1.0).abs() < 1e-6);
    }
}

#[test]
fn noise_moves_the_best_angle_from_its_bound_inside() {
    let quiet = SPEC.replace("20e-6", "0");
    let report = search(&quiet.replace("strain = 0.02", "strain = 0.05"), CPU);
    assert_eq!(report.best.point.drive, 0.5);
    assert!(report.at_bounds.contains(&(Quantity::Column(Column::Drive), "min")), "{:?}", report.at_bounds);
    let noisy = search(&SPEC.replace("20e-6", "5e-6").replace("strain = 0.02", "strain = 0.05"), CPU);
    assert!(noisy.best.point.drive > 1.0 && noisy.best.point.drive < 9.0, "{:?}", noisy.best.point);
    assert!(noisy.binding.is_empty(), "{:?}", noisy.binding);
}

/// Stops the search after this many evaluations, as Ctrl-C does.
struct Interrupt<'a>(&'a AtomicBool, u64);

impl Watch for Interrupt<'_> {
    fn step(&mut self, step: &Step, _: f64, _: bool, _: Option<u64>) {
        self.0.store(step.evaluations >= self.1, std::sync::atomic::Ordering::Relaxed);
    }
}

#[test]
fn a_stopped_search_tells_its_best_and_is_made_anew() {
    let whole = search(SPEC, CPU);
    let (spec, wanted) = parse(SPEC);
    let (stop, choice) = (AtomicBool::new(false), CPU.choice());
    let run = |watch: &mut dyn Watch| {
        optimise::find(&spec, &wanted, (&choice, &RunOptions::default(), None), &stop, watch).unwrap()
    };
    let part = run(&mut Interrupt(&stop, 1000));
    assert_eq!(part.ended, Ended::Interrupted);
    assert!(part.evaluations >= 1000 && part.evaluations < whole.evaluations);
    assert_eq!(told(&part.history), told(&whole.history[..part.history.len()]));
    stop.store(false, std::sync::atomic::Ordering::Relaxed);
    let again = run(&mut Interrupt(&stop, u64::MAX));
    assert_eq!(
        (again.best.point, again.value, again.evaluations, again.ended),
        (whole.best.point, whole.value, whole.evaluations, Ended::Converged)
    );
}

#[test]
fn budgets_are_kept() {
    for evaluations in [1, 7, 24, 100, 1500] {
        let spec = SPEC.replace("strain = 0.02", "strain = 0.5");
        let report = search(&format!("{spec}budget = {{ evaluations = {evaluations} }}\n"), CPU);
        assert_eq!((report.evaluations, report.ended), (evaluations, Ended::Evaluations));
    }
    let slow = format!("{SPEC}budget = {{ seconds = 0.01 }}\nrobust = {{ D = 0.05, samples = 256 }}\n");
    assert_eq!(search(&slow, CPU).ended, Ended::Seconds);
}

#[test]
fn a_list_of_angles_gives_the_best_of_them() {
    let listed = |theta: &str| {
        let text = SPEC
            .replace("step = 3 }\n", &format!("step = 3 }}\ntheta = {theta}\n"))
            .replace(", theta = [0.5, 10]", ", x_ss = [3, 10]");
        search(&text.replace("strain = 0.02", "strain = 0.05"), CPU)
    };
    let each: Vec<_> = ["1", "2.5", "4"].map(listed).into_iter().collect();
    let best = each.iter().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap();
    let all = listed("[1, 2.5, 4]");
    assert_eq!(all.best.point.drive, best.best.point.drive);
    assert!((all.value / best.value - 1.0).abs() < 1e-6);
}

#[test]
fn tolerances_ask_for_more_margin() {
    let base = search(SPEC, CPU);
    let within = |evaluations: u32, more: &str| {
        let robust = format!("robust = {{ D = 0.05, x_ss = 0.3, theta = 0.05, samples = 32, {more} }}");
        search(&format!("{SPEC}budget = {{ evaluations = {evaluations} }}\n{robust}\n"), CPU)
    };
    let robust = |more: &str| within(4000, more);
    let mean = robust("measure = \"mean\"");
    let worst = robust("measure = \"cvar90\"");
    let nominal = robust("calibrated = \"nominal\"");
    // A limit that nine of ten whiskers keep leaves the nominal one a margin.
    assert!(mean.best.row.figures().strain_max.unwrap() < 0.0199);
    assert!(
        base.value < mean.value && mean.value < worst.value && worst.value < nominal.value,
        "{} {} {} {}",
        base.value,
        mean.value,
        worst.value,
        nominal.value
    );
    let [one, again] = [0; 2].map(|_| within(600, "measure = \"mean\"").value);
    assert_eq!(one, again);
}

#[test]
fn sensitivities_agree_with_differences_of_sweeps() {
    let report = search(SPEC, CPU);
    let p = report.best.point;
    let figures = |d: f64| {
        let text = format!(
            "[whisker]\nD = {:?}\nd = {d:?}\nL_a = {:?}\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n[tap]\na = {{ from = 21, to = 48, step = 3 }}\ntheta = {:?}\n",
            p.D, p.L_a, p.drive
        );
        let row = common::sweeping::sweep(&text, common::sweeping::CPU_F64).designs.rows.remove(0);
        [number(&row, "K_sd").unwrap(), number(&row, "total_rms_mm").unwrap()]
    };
    let (up, down) = (figures(p.d * 1.002), figures(p.d * 0.998));
    let (_, local) =
        report.sensitivity.local.iter().find(|(c, _)| *c == Quantity::Column(Column::TipDiameter)).unwrap();
    for i in 0..2 {
        let want = (up[i] / down[i]).ln() / (1.002f64 / 0.998).ln();
        assert!((local[i].unwrap() - want).abs() < 1e-3 * want.abs().max(1.0), "{local:?} {want}");
    }
}

/// The limits also hold by the reference, which is more accurate than the kernel that searched.
#[test]
fn an_optimum_at_a_limit_keeps_it_also_by_the_reference() {
    for (d, seed) in
        [("[2, 10]", 1), ("[3, 9]", 2), ("[4, 6]", 3), ("[2, 4]", 4), ("[6, 10]", 5), ("[2.5, 7]", 6)]
    {
        let text = SPEC
            .replace("d = [2, 10]", &format!("d = {d}"))
            .replace("[optimise]", &format!("[optimise]\nseed = {seed}\nbudget = {{ evaluations = 6000 }}"));
        let report = search(&text, CPU);
        let (spec, _) = parse(&text);
        let design = [vibrissa::design::Design::new(&spec.study.setup, report.best.point)];
        let layout = spec.study.space.layout().unwrap();
        let task = |i| {
            vibrissa::evaluate::Task::of(
                0,
                &vibrissa::scene::Tuple { a: layout.distance(i), ..report.best.point },
            )
        };
        let tasks: Vec<_> = (0..layout.n_distances).map(task).collect();
        let mut reference =
            vibrissa::evaluate::Evaluator::new(&spec.study.setup, vibrissa::evaluate::Method::Reference);
        let strain =
            reference.run(&design, &tasks).unwrap().iter().map(|o| o.strain.abs()).fold(0.0, f64::max);
        assert!(strain <= 0.02 && strain > 0.02 * (1.0 - 1e-7), "d {d}: {strain:e}");
    }
}
