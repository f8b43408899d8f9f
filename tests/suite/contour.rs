//! Contours: synthetic strokes and taps over a circle, a corner and a curve; arrays; bad input.

use std::sync::LazyLock;

use crate::common::measuring::{REAL, prototype, rig};
use crate::common::program::{Desk, Kept};
use crate::common::sweeping::{Row, rms as rms_of, value};
use crate::common::tap;
use vibrissa::contour::point::Pose;
use vibrissa::physics::driven::Driven;
use vibrissa::physics::rod::RodProblem;
use vibrissa::scene::Model;
use vibrissa::simulate::object::Object;
use vibrissa::simulate::strokes::Stroker;

const NOISE: &str = "noise_strain = 1e-5\n";
const TAPS: &str =
    "[tap]\na = { from = 18, to = 45, step = 3 }\ntheta = [0.5, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]\n";
const SWEEP: &str = "[tap]\na = 30\ntheta = { from = 0.5, to = 10, step = 0.25 }\n";
const CIRCLE: &str =
    "[object]\nshape = \"circle\"\nx = 0\ny = 0\nradius = 10\n[around]\nstarts = 12\ndistance = 36\n";

pub fn desk() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let desk = Desk::new(&prototype(4.0, &[NOISE, TAPS, REAL]));
        desk.ok("simulate spec.toml --repeats 3 --out sim");
        desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out c");
        desk.write("cal.toml", desk.read("c/calibration.toml"));
        desk.write("spec.toml", prototype(4.0, &[NOISE, SWEEP, REAL]));
        desk.write("object.toml", CIRCLE);
        desk.keep()
    });
    MADE.desk()
}

/// rms distance of the points from the object: by strokes, and with each row as a tap by the paper's formula.
fn both(desk: &Desk) -> [serde_json::Value; 2] {
    desk.ok("simulate spec.toml --object object.toml --seed 7 --out st");
    let contour = "contour st/strokes.csv --calibration cal.toml --truth object.toml";
    ["--out strokes", "--taps --estimator paper --out taps"]
        .map(|more| desk.json(format!("{contour} {more}")))
}

fn rms(of: &serde_json::Value) -> f64 {
    of["result"]["truth"]["points_rms_mm"].as_f64().unwrap()
}

#[test]
fn a_circle_is_found_from_strokes() {
    let desk = desk();
    desk.write("object.toml", CIRCLE);
    let [strokes, paper] = both(&desk);
    let curve = &strokes["result"]["curve"];
    assert_eq!(curve["kind"], "circle", "{curve}");
    let number = |key: &str| curve[key].as_f64().unwrap();
    assert!((number("radius_mm") - 10.0).abs() < 4.0 * number("sigma_radius_mm").max(0.01), "{curve}");
    assert!(["x_mm", "y_mm", "sigma_radius_mm"].iter().all(|key| number(key).abs() < 0.1), "{curve}");
    assert!(rms(&strokes) < 0.1 && rms(&paper) > 5.0 * rms(&strokes), "{} {}", rms(&strokes), rms(&paper));
    let table = desk.table("strokes/points.csv");
    let apart =
        |r: &Row| (value(r, "x_mm") - value(r, "true_x_mm")).hypot(value(r, "y_mm") - value(r, "true_y_mm"));
    assert!(rms_of(table.rows.iter().filter(|r| !r["x_mm"].is_empty()).map(apart)) < 0.15);
    assert_eq!(desk.names("strokes"), ["contour.svg", "curve.csv", "points.csv", "run.json"]);
    desk.whole("strokes");
    desk.ok("report strokes --figures svg");
    assert!(desk.names("strokes/report").contains(&"contour.svg".to_owned()));
}

#[test]
fn a_corner_stays_where_it_is() {
    let desk = desk();
    desk.write(
        "object.toml",
        "touch_noise = 0.3\n[object]\nshape = \"box\"\nx = 0\ny = 0\nwidth = 20\nheight = 20\n\
         [around]\nstarts = 8\ndistance = 40\nfrom = 25\nto = 75\n",
    );
    let [strokes, paper] = both(&desk);
    assert!(rms(&strokes) < 0.1 && rms(&paper) > 5.0 * rms(&strokes), "{} {}", rms(&strokes), rms(&paper));
    let curve = &strokes["result"]["curve"];
    assert_eq!(curve["kind"], "point", "{curve}");
    for (place, sigma) in [("x_mm", "sigma_x_mm"), ("y_mm", "sigma_y_mm")] {
        let [place, sigma] = [place, sigma].map(|key| curve[key].as_f64().unwrap());
        assert!((place.abs() - 10.0).abs() < (4.0 * sigma).max(0.02), "{curve}");
    }
    // Nearly every stroke is classified as a point contact; its touch is found to 0.01°.
    let all = strokes["result"]["strokes"].as_array().unwrap();
    let sharp = all.iter().filter(|s| s["object"] == "sharp");
    assert!(sharp.count() + 1 >= all.len(), "{all:?}");
    for stroke in all {
        assert!(stroke["sigma_touched_before_deg"].as_f64().unwrap() < 0.02, "{stroke}");
    }
}

#[test]
fn a_curve_is_smooth() {
    let desk = desk();
    let rows: Vec<String> = (0..24)
        .map(|k| f64::from(k) * std::f64::consts::TAU / 24.0)
        .map(|t| (t, 12.0 + 1.5 * (2.0 * t).cos() + 0.7 * (3.0 * t).sin()))
        .map(|(t, r)| format!("{},{}", r * t.cos(), r * t.sin()))
        .collect();
    desk.write("curve.csv", format!("x_mm,y_mm\n{}\n", rows.join("\n")));
    desk.write(
        "object.toml",
        "[object]\nshape = \"curve\"\nfile = \"curve.csv\"\nclosed = true\n[around]\nstarts = 20\ndistance = 38\n",
    );
    let [strokes, paper] = both(&desk);
    assert_eq!(strokes["result"]["curve"]["kind"], "smooth", "{}", strokes["result"]["curve"]);
    assert!(rms(&strokes) < 0.2 && rms(&paper) > 3.0 * rms(&strokes), "{} {}", rms(&strokes), rms(&paper));
    let along = strokes["result"]["truth"]["curve_rms_mm"].as_f64().unwrap();
    assert!(along < 0.4, "{along}");
}

#[test]
fn a_round_object_is_a_pole_of_its_radius() {
    let rig = rig(&prototype(4.0, &[SWEEP, REAL]));
    let radius = 10.0;
    for sense in [1.0, -1.0] {
        let centre = [30.0, sense * 12.0];
        let circle = Object::Circle { centre, radius };
        let stroker = Stroker::new(&rig, &circle, sense);
        let start = Pose { base: [0.0; 3], heading: -sense, sense };
        let angles: Vec<f64> = [1.0f64, 4.0, 10.0].map(f64::to_radians).to_vec();
        let (_, _, contacts) = stroker.stroke(start, &angles).unwrap();
        // The reference with a pole of that radius: bisection for the a whose pole centre lies at the circle's centre.
        let (shared, model) = (rig.shared(), Model { pole_radius: radius, ..rig.setup.model });
        let (s, c) = (shared.taper.sin_alpha(), shared.taper.cos_alpha());
        let centre_of = |a: f64| (a + radius * s).hypot(shared.taper.radius(a) + radius * c);
        let (mut lo, mut hi) = (5.0, 50.0);
        for _ in 0..100 {
            let a = 0.5 * (lo + hi);
            if centre_of(a) < centre[0].hypot(centre[1]) { lo = a } else { hi = a }
        }
        for (angle, contact) in angles.iter().zip(&contacts) {
            let problem = RodProblem {
                side: rig.setup.gauge.side,
                gauge: shared.gauge,
                driven: Driven::Radians(*angle),
                ..tap(&model, 4.0, lo, 1.0)
            };
            let tap = problem.solve().unwrap();
            assert!((tap.strain / contact.strain - 1.0).abs() < 1e-8, "{} {}", tap.strain, contact.strain);
            assert!((tap.contact_arc - contact.arc).abs() < 1e-7, "{} {}", tap.contact_arc, contact.arc);
            assert!(circle.distance(contact.at) < 1e-9);
        }
        assert_eq!(contacts.len(), 3);
    }
}

#[test]
fn a_stroke_that_began_late_says_so() {
    let desk = desk();
    desk.write("object.toml", CIRCLE.replace("[object]", "touch_noise = 0.4\n[object]"));
    let [strokes, _] = both(&desk);
    assert!(rms(&strokes) < 0.15, "{}", rms(&strokes));
    let found = strokes["result"]["strokes"].as_array().unwrap();
    assert!(found.iter().any(|s| s["touched_before_deg"].as_f64().unwrap().abs() > 0.2), "{found:?}");
}

#[test]
fn points_without_a_curve_are_still_points() {
    let desk = desk();
    let head = "base_x_mm,base_y_mm,heading_deg,theta_deg,strain,x_mm\n";
    let trace = |rows: &str| {
        desk.write("d.csv", format!("{head}{rows}"));
        let ran = desk.ok("contour d.csv --calibration cal.toml --out out --json");
        (ran.json(), desk.table("out/points.csv"))
    };
    // One pose; missing values stay missing; an input column named as an output is kept.
    let (json, table) = trace("1,2,90,4,0.02,7\n1,2,90,4,NaN,7\n1,NaN,90,4,0.02,7\n1,2,90,0,0,7\n");
    assert_eq!(json["counts"]["points"], 1);
    assert!(json["result"]["curve"]["why"].as_str().unwrap().contains("three points"));
    assert_eq!(table.statuses(), ["ok", "bad_input", "bad_input", "no_strain"]);
    assert_eq!(table.rows[0]["given_x_mm"], "7");
    // A row without a sense gets no point; without the column, whiskers turn counterclockwise.
    desk.write("d.csv", "base_x_mm,base_y_mm,heading_deg,sense,theta_deg,strain\n1,2,90,1,4,0.02\n1,2,90,,4,0.02\n1,2,90,NaN,4,0.02\n");
    desk.ok("contour d.csv --calibration cal.toml --out out --force");
    let turned = desk.table("out/points.csv");
    assert_eq!(turned.statuses(), ["ok", "bad_input", "bad_input"]);
    assert_eq!(turned.rows[1]["x_mm"], "");
    // For a whisker along +y, left is −x.
    let n = |key: &str| table.rows[0][key].parse::<f64>().unwrap();
    assert!((n("y_mm") - 2.0 - n("distance_mm")).abs() < 1e-9 && n("x_mm") < -0.9, "{:?}", table.rows[0]);
    // With an exact heading, points still have a width.
    let fine: Vec<String> = (0..12).map(|k| format!("{k},2,90,4,0.02,7\n")).collect();
    desk.write("line.csv", format!("{head}{}", fine.concat()));
    let certain = desk.json("contour line.csv --calibration cal.toml --angle-noise 0 --out line");
    assert_eq!(certain["result"]["curve"]["kind"], "line");
    let (json, _) = trace(&"1,2,90,4,0.02,7\n".repeat(6));
    assert_eq!(json["result"]["curve"]["kind"], "point");
    assert_eq!(desk.read("out/curve.csv").lines().count(), 2);
    let line = desk.json("contour d.csv --calibration cal.toml --curve line --out out");
    assert!(line["result"]["curve"]["why"].as_str().unwrap().contains("one place"));
    assert_eq!(desk.read("out/curve.csv").lines().count(), 1);
}

#[test]
fn an_outlier_is_named() {
    let desk = desk();
    desk.write("object.toml", CIRCLE);
    desk.ok("simulate spec.toml --object object.toml --seed 7 --out st");
    // One tap of each stroke; the base of one of them is recorded wrongly.
    let text = desk.read("st/strokes.csv");
    let mut rows: Vec<String> =
        text.lines().filter(|l| l.contains(",4,") || l.starts_with("stroke")).map(str::to_owned).collect();
    let mut wrong: Vec<&str> = rows[3].split(',').collect();
    wrong[1] = "0";
    rows[3] = wrong.join(",");
    desk.write("d.csv", rows.join("\n"));
    let json = desk.json("contour d.csv --calibration cal.toml --taps --out out");
    assert_eq!(json["result"]["curve"]["kind"], "circle");
    assert_eq!(json["counts"]["outliers"], 1);
    let table = desk.table("out/points.csv");
    assert_eq!(table.rows[2]["status"], "outlier");
    assert!(table.rows[2]["off_sigma"].parse::<f64>().unwrap().abs() > 4.0);
}

#[test]
fn an_array_answers_in_one_frame() {
    let desk = desk();
    let array = "[[whisker]]\nname = \"left\"\ncalibration = \"cal.toml\"\nx = 0\ny = 40\nz = 12\nheading = 0\nsense = -1\n\
                 [[whisker]]\nname = \"right\"\ncalibration = \"cal.toml\"\nx = 0\ny = -40\nheading = 0\n";
    desk.write("array.toml", array);
    desk.write(
        "r.csv",
        "whisker,theta_deg,strain,contact_deg\nleft,0,0.001,0\nright,0,0.002,0\nleft,4,0.021,0\nright,4,0.022,0\nright,4,0.022,90\n",
    );
    desk.ok("locate --array array.toml r.csv --out out");
    let table = desk.table("out/located.csv");
    let n = |k: usize, key: &str| table.rows[k][key].parse::<f64>().unwrap();
    assert_eq!(table.column("line"), ["2", "3", "4", "5", "6"]);
    // Each whisker has its own zero. The same tap gives the mirrored point, and the point turned by 90°.
    assert_eq!([n(2, "zero"), n(3, "zero")], [0.001, 0.002]);
    let near = |x: f64, y: f64| (x - y).abs() < 1e-9;
    assert!(near(n(2, "x_mm"), n(3, "x_mm")) && near(n(2, "y_mm") - 40.0, -(n(3, "y_mm") + 40.0)));
    assert!(near(n(4, "y_mm") + 40.0, n(3, "x_mm")) && near(n(4, "x_mm"), -(n(3, "y_mm") + 40.0)));
    assert_eq!([n(2, "z_mm"), n(3, "z_mm")], [12.0, 0.0]);
    assert!(n(3, "sigma_x_mm") > 0.0 && n(3, "sigma_y_mm") > 0.01);
    // With the base 6 mm nearer, the point is 6 mm farther.
    let point = [n(3, "x_mm"), n(3, "y_mm")];
    desk.write("moved.csv", "whisker,theta_deg,strain,shift_mm\nright,0,0.002,0\nright,4,0.022,6\n");
    desk.ok("locate --array array.toml moved.csv --out moved");
    let moved = &desk.table("moved/located.csv").rows[1];
    let at = ["x_mm", "y_mm"].map(|key| moved[key].parse::<f64>().unwrap());
    assert!(near(at[0], point[0] + 6.0) && near(at[1], point[1]), "{moved:?} {point:?}");
    desk.whole("out");
}
