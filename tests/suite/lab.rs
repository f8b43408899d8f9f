//! Readings as a lab has them: offsets, jitter, other columns and decimal marks, raw counts, whiskers without a description.

use std::sync::LazyLock;

use crate::common::measuring::{
    REAL, TAPS, calibrated, data, fresh, locator, prototype, rewritten, score, table, undescribed,
};
use crate::common::program::{Desk, Kept};
use crate::common::sweeping::{Row, Table, number, rms};
use vibrissa::calibrate::{Options, calibrate};
use vibrissa::locate::estimator::Estimator;
use vibrissa::measure::zero::TaredBy;
use vibrissa::measure::{Names, Rig};
use vibrissa::scene::{Drive, Setup};
use vibrissa::simulate::Settings;
use vibrissa::sink::lab::LabTable;

const NOISE: f64 = 1e-5;
const OFFSET: f64 = 180e-6;

fn noisy(seed: u64) -> Settings {
    Settings { repeats: 3, noise: NOISE, zero_every: Some(20), seed, ..Settings::default() }
}

/// The table with each signal changed by `f` of (row, a, drive, strain).
fn moved(table: &str, mut f: impl FnMut(usize, f64, f64, f64) -> f64) -> String {
    rewritten(table, "a_mm,theta_deg,strain", |k, row| [row.a, row.drive, f(k, row.a, row.drive, row.value)])
}

fn spec() -> String {
    prototype(10.0, &["noise_strain = 1e-5\n", TAPS, REAL])
}

fn desk() -> Desk {
    static MADE: LazyLock<Kept> = LazyLock::new(|| {
        let desk = Desk::new(&spec());
        desk.write("cal.csv", moved(&table(&spec(), &noisy(1)), |_, _, _, s| s + OFFSET));
        desk.ok("calibrate cal.csv --whisker spec.toml --out cal");
        desk.keep()
    });
    MADE.desk()
}

/// rms of distance − a over the rows that have a distance.
fn off(table: &Table) -> f64 {
    let error = |r: &Row| Some(number(r, "distance_mm")? - number(r, "a_mm")?);
    let errors: Vec<f64> = table.rows.iter().filter_map(error).collect();
    assert!(errors.len() > 100);
    rms(errors)
}

#[test]
fn an_offset_of_the_readings_is_taken_off_or_told() {
    let desk = desk();
    let tared = vibrissa::locate::Calibration::read(&desk.path("cal/calibration.toml"), false).unwrap().zero;
    assert!(tared.from == TaredBy::Rows && (tared.value - OFFSET).abs() < 3.0 * NOISE, "{tared:?}");
    let fresh = table(&fresh(&spec(), [22.0, 47.0], 100), &noisy(7));
    let with_zeros = moved(&fresh, |_, _, _, s| s + OFFSET);
    let without: String =
        with_zeros.lines().filter(|l| !l.contains(",0,")).map(|l| format!("{l}\n")).collect();
    desk.write("zeros.csv", &with_zeros);
    desk.write("none.csv", &without);
    let ran = |arguments: &[&str]| {
        let ran = desk.run(&[&["locate", "cal/calibration.toml"], arguments, &["--force"]].concat()).exits(0);
        (desk.table("loc/located.csv"), ran.stderr)
    };
    desk.write("clean.csv", moved(&fresh, |_, _, _, s| s));
    let clean = off(&ran(&["clean.csv", "--out", "loc"]).0);
    let (located, said) = ran(&["zeros.csv", "--out", "loc"]);
    assert!(off(&located) < 1.05 * clean && !said.contains("every distance is wrong"), "{said}");
    let zeros: Vec<_> = located.rows.iter().filter(|r| r["theta_deg"] == "0").collect();
    let none = |r: &&Row| r["status"] == "no_strain" && r["distance_mm"].is_empty();
    assert!(zeros.len() > 10 && zeros.iter().all(none));
    let (located, said) = ran(&["none.csv", "--zero", "180e-6", "--out", "loc"]);
    assert!(off(&located) < 1.05 * clean && !said.contains("every distance is wrong"), "{said}");
    let (located, said) = ran(&["none.csv", "--out", "loc"]);
    assert!(off(&located) > 2.0 * clean && said.contains("every distance is wrong"), "{said}");
    desk.refuses("locate cal/calibration.toml zeros.csv --zero 0 --out l2", &["zero readings of their own"]);
}

#[test]
fn an_offset_that_nobody_read_is_found_where_the_data_tell_it() {
    let settings = Settings { zero_every: None, ..noisy(1) };
    let fresh = table(&fresh(&spec(), [22.0, 47.0], 200), &Settings { zero_every: None, ..noisy(7) });
    for (offset, drive_offset) in [(OFFSET, 0.0), (-4.0 * OFFSET, 0.1), (0.0, 0.2)] {
        let text = moved(&table(&spec(), &Settings { drive_offset, ..settings }), |_, _, _, s| s + offset);
        let found = calibrated(&text, &spec(), &[]);
        let tared = found.calibration.zero.clone();
        let [value, error] =
            if tared.from == TaredBy::Fitted { [tared.value, tared.error] } else { [0.0, 2e-6] };
        assert!((value - offset).abs() < 5.0 * error && error < 3e-5, "{offset}: {tared:?}");
        assert_eq!(found.warnings.iter().any(|w| w.contains("constant offset")), offset != 0.0);
        if drive_offset == 0.0 {
            let located = locator(&found, None);
            let shifted = moved(&fresh, |_, _, _, s| s + offset - value);
            let score = score(&located, &shifted, NOISE);
            assert!(score.rms < 1.3 * score.limit, "{offset}: {score:?}");
        }
    }
    // One drive at two distances is not enough: said by the calibration and for readings.
    let bare = prototype(10.0, &["noise_strain = 1e-5\n", "[tap]\na = [30, 40]\ntheta = 4\n", REAL]);
    let desk = Desk::new(&bare);
    desk.write("d.csv", table(&bare, &settings));
    let ran = desk.ok("calibrate d.csv --whisker spec.toml --out cal");
    assert!(ran.stderr.contains("cannot tell a constant offset"), "{}", ran.stderr);
    let ran = desk.pipe(&["locate", "cal/calibration.toml"], "4,0.02\n").exits(0);
    assert!(ran.stderr.contains("could not tell a constant offset"), "{}", ran.stderr);
}

#[test]
fn a_stream_holds_the_last_zero() {
    let desk = desk();
    let at = |input: &str, more: &str| desk.stream(&format!("locate cal/calibration.toml {more}"), input);
    let plain = at("4,0.02\n4,0.03\n", "--zero 0").numbers("distance_mm");
    let tared = at("0,0.00018\n4,0.02018\n0,0.00118\n4,0.03118\n", "");
    assert_eq!(tared.statuses(), ["no_strain", "ok", "no_strain", "ok"]);
    let tared = tared.numbers("distance_mm");
    for (p, t) in [(0, 1), (1, 3)] {
        assert!((plain[p].unwrap() - tared[t].unwrap()).abs() < 1e-6, "{plain:?} {tared:?}");
    }
    let comma = at("theta_deg;microstrain\n4;20180,0\n", "--zero 180").numbers("distance_mm");
    assert!((comma[0].unwrap() - plain[0].unwrap()).abs() < 1e-6, "{comma:?}");
}

#[test]
fn columns_may_have_any_name_and_a_drive_is_not_guessed() {
    let desk = desk();
    desk.write("r.csv", "id;dist;ang;ch3;note\n1;30,0;4,0;0,02;\"a;b\"\n2;31,5;4,0;0,0195;x,y\n");
    let columns = "theta=ang,strain=ch3";
    desk.ok(format!("locate cal/calibration.toml r.csv --columns {columns} --zero 0 --out l"));
    let located = desk.table("l/located.csv");
    let own = ["line", "id", "dist", "ang", "ch3", "note", "theta_deg", "strain", "zero"];
    assert_eq!(located.columns[..9], own, "{:?}", located.columns);
    let row = &located.rows[0];
    let told = ["line", "ang", "ch3", "note", "strain"].map(|column| row[column].as_str());
    assert_eq!(told, ["2", "4.0", "0.02", "a;b", "0.02"]);
    assert!(row["distance_mm"].parse::<f64>().is_ok() && located.rows[1]["note"] == "x,y");
}

/// Drives and distances with jitter; raw counts, inverted, above a large offset; the drive has its own zero: contact begins at −6 mm.
fn raw(counts: impl Fn(f64) -> f64) -> String {
    let spec = "[whisker]\nD = 3\nd = 1\nL_a = 180\n[gauge]\nx_ss = 5\nl = 2\n[tap]\ndrive = \"displacement\"\n\
                a = [117, 121.5, 126, 130.5, 135, 139.5, 144]\ndelta = [8, 10, 12, 14, 16]\n";
    let measured = table(spec, &Settings { repeats: 3, noise: 3e-6, ..Settings::default() });
    let mut out = String::from("a_mm,delta_mm,reading\n");
    for (k, row) in data(&measured).rows.iter().enumerate() {
        let jitter = 0.02 * (k % 7) as f64;
        if k % 35 == 0 {
            out += &format!("144.04,-7.85,{}\n", counts(0.0));
        }
        out += &format!("{},{},{}\n", row.a + 0.5 * jitter, row.drive - 6.0 + jitter, counts(row.value));
    }
    out
}

#[test]
fn raw_counts_with_jitter_and_a_zero_of_their_own_are_calibrated_without_a_whisker() {
    let plain = undescribed(&raw(|s| (50_000.0 - 1.2e7 * s).round()), Drive::Displacement, 144.2);
    let side = &plain.sides[0];
    assert_eq!((side.table.distances.len(), side.table.drives.len(), plain.zeros.len()), (7, 5, 3));
    assert_eq!(plain.calibration.zero.from, TaredBy::Plateau);
    assert!(plain.winner == Estimator::Learned);
    let held = side.held_out(Estimator::Curve).unwrap().rms(|_| true);
    assert!(held.0.unwrap() < 0.6 && held.1 == side.used, "{held:?}");
}

#[test]
fn counts_that_begin_anew_are_joined_and_answered() {
    let counts = |s: f64| (12_000.0 - 5e6 * s).round();
    let lowest = data(&raw(counts)).rows.iter().map(|r| r.value).fold(f64::INFINITY, f64::min);
    assert!((-20_000.0..-1_000.0).contains(&lowest), "{lowest}");
    let with = |text: &str| undescribed(text, Drive::Displacement, 144.2);
    let plain = with(&raw(counts));
    let turned = with(&raw(|s| counts(s).rem_euclid(65_536.0)));
    assert!(turned.calibration.zero.wraps);
    assert!(turned.warnings.iter().any(|w| w.contains("16 bits")));
    let tap = data(&raw(counts)).rows.into_iter().find(|r| r.drive > 9.0 && r.value < 0.0).unwrap();
    let at = |c, value| locator(c, Some(Estimator::Curve)).locate_above(tap.drive, value, 12_000.0, 0.0);
    let (p, t, anew) = (at(&plain, tap.value), at(&turned, tap.value), at(&turned, tap.value + 65_536.0));
    let same = [&t, &anew].iter().all(|q| (p.distance - q.distance).abs() < 1e-6);
    assert!(same, "{p:?} {t:?} {anew:?}");
}

#[test]
fn what_a_user_says_of_groups_holds() {
    let text = raw(|s| (50_000.0 - 1.2e7 * s).round());
    let rig = Rig::unknown(Setup { drive: Drive::Displacement, ..Setup::default() }, 144.2).unwrap();
    let with = |group| calibrate(&data(&text), &rig, &Options { group, ..Options::default() }).unwrap();
    assert_eq!(with([None, Some(0.5)]).sides[0].table.drives.len(), 5);
    assert!(with([Some(0.0), None]).sides[0].table.distances.len() > 40);
    let wide = Options { group: [Some(5.0), None], ..Options::default() };
    assert!(calibrate(&data(&text), &rig, &wide).unwrap_err().to_string().contains("one distance"));
    assert!(with([None; 2]).warnings.iter().any(|w| w.contains("taken as 7")));
}

#[test]
fn one_drive_that_nobody_recorded_is_calibrated_without_a_whisker() {
    let one = "[tap]\na = { from = 21, to = 48, step = 3 }\ntheta = 4\n";
    let spec = prototype(10.0, &["noise_strain = 1e-5\n", one, REAL]);
    let blind = |t: &str| rewritten(t, "a_mm,reading", |_, r| [r.a, 4.7e5 * r.value]);
    let settings = Settings { zero_every: None, ..noisy(3) };
    let desk = Desk::new("");
    desk.write("d.csv", blind(&table(&spec, &settings)));
    desk.ok("calibrate d.csv --out cal");
    let ask = |input: &str| desk.stream("locate cal/calibration.toml", input).numbers("distance_mm");
    let (plain, driven) = (ask("reading\n9400\n"), "delta_mm,reading\n0,500\n2,9900\n2.01,9900\n5,9900\n");
    let ran = desk.pipe(&["locate", "cal/calibration.toml"], driven).exits(0);
    assert!(ran.stderr.contains("was not recorded"), "{}", ran.stderr);
    let answers = Table::parse(ran.stdout);
    let ends = [answers.statuses()[0], answers.statuses()[3]];
    assert_eq!(ends, ["no_strain", "outside_calibration"], "{}", answers.text);
    assert_eq!([answers.numbers("distance_mm")[1], answers.numbers("distance_mm")[2]], [plain[0], plain[0]]);
    let fresh = table(&fresh(&spec, [22.0, 47.0], 300), &settings);
    desk.write("r.csv", blind(&fresh));
    desk.ok("locate cal/calibration.toml r.csv --out loc");
    let located = desk.table("loc/located.csv");
    let error = off(&located);
    assert!(error < 0.1, "{error}");
    desk.refuses("calibrate d.csv --fit hub --out c2", &["--whisker"]);
    desk.refuses("locate cal/calibration.toml r.csv --estimator exact", &["curve"]);
}

#[test]
fn a_signal_by_another_name_is_guessed_and_any_end_of_line_read() {
    let read = |text: &str| {
        vibrissa::measure::Data::parse_named(
            "d.csv",
            LabTable::Text(text.as_bytes()),
            &Names::parse("a=a_mm").unwrap(),
        )
    };
    for (name, meant) in [("strain [µε]", "microstrain"), ("Dehnung", "strain"), ("mV/V", "bridge")] {
        let e = read(&format!("a_mm,theta_deg,{name}\n30,2,100\n")).unwrap_err();
        assert_eq!(e.key.as_deref(), Some(name));
        assert!(e.allowed.as_ref().unwrap().contains(&format!("{meant}={name}")), "{e}");
    }
    let rows =
        |end: &str| read(&["a_mm,theta_deg,strain", "30,2,1e-3", "40,2,5e-4", ""].join(end)).unwrap().rows;
    assert_eq!(rows("\n").len(), 2);
    assert_eq!(read("# lab 3\na_mm,theta_deg,strain\r30,2,1e-3\r40,2,5e-4\n").unwrap().rows.len(), 2);
    for end in ["\r\n", "\r"] {
        let same = rows(end).iter().zip(rows("\n")).all(|(p, q)| (p.line, p.value) == (q.line, q.value));
        assert!(same && rows(end).len() == 2);
    }
}

/// Typical faults: an offset, a drift, jittering drives, microstrain, semicolons, decimal commas, two wrong labels.
fn spoilt(table: &str, wrong: &[usize]) -> String {
    let comma = |x: f64| x.to_string().replace('.', ",");
    let mut out = String::from("nr;dist;ang;ch1;remark\n");
    let rows = data(table).rows;
    let far = rows.iter().map(|r| r.a).filter(|a| a.is_finite()).fold(0.0, f64::max);
    for (k, row) in rows.iter().enumerate() {
        let signal = 1e6 * (row.value + OFFSET + 3e-8 * k as f64);
        let a = if wrong.contains(&k) { if row.a < 30.0 { far } else { 21.0 } } else { row.a };
        let a = if a.is_finite() { comma(a) } else { String::new() };
        out += &format!("{k};{a};{};{};\"x; y\"\n", comma(row.drive), comma(signal));
    }
    out
}

/// Drives up to 0.005° off their target, recorded as reached.
fn jittering(seed: u64, a: &str) -> String {
    let mut out = String::from("a_mm,theta_deg,strain\n");
    for (k, jitter) in [-0.005, 0.0, 0.005].into_iter().enumerate() {
        let drives =
            [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0].map(|d: f64| (d + jitter).to_string()).join(", ");
        let tap = format!("[tap]\na = {a}\ntheta = [{drives}]\n");
        let spec = prototype(10.0, &["noise_strain = 1e-5\n", &tap, REAL]);
        let settings =
            Settings { noise: NOISE, zero_every: Some(15), seed: seed + k as u64, ..Settings::default() };
        let text = moved(&table(&spec, &settings), |_, _, _, s| s);
        out += text.split_once('\n').unwrap().1;
    }
    out
}

#[test]
fn a_round_trip_through_a_real_lab_is_as_good_as_through_a_clean_one() {
    let desk = Desk::new(&spec());
    let (measured, asked) = (
        jittering(1, "{ from = 21, to = 48, step = 3 }"),
        jittering(11, "{ min = 22, max = 47, samples = 70, sampler = \"random\", seed = 5 }"),
    );
    desk.write("clean.csv", &measured);
    desk.write("clean_readings.csv", &asked);
    desk.write("lab.csv", spoilt(&measured, &[40, 171]));
    desk.write("lab_readings.csv", spoilt(&asked, &[]));
    desk.ok("calibrate clean.csv --whisker spec.toml --out cal");
    desk.ok("locate cal/calibration.toml clean_readings.csv --out loc");
    let columns = "a=dist,theta=ang,microstrain=ch1";
    let found =
        desk.ok(format!("calibrate lab.csv --whisker spec.toml --columns {columns} --out lab --json"));
    let result = found.json()["result"].clone();
    let suspects: Vec<_> =
        result["suspects"].as_array().unwrap().iter().map(|s| s["line"].as_u64().unwrap()).collect();
    assert_eq!(suspects, [42, 173], "{result}");
    let columns = "theta=ang,microstrain=ch1";
    desk.ok(format!("locate lab/calibration.toml lab_readings.csv --columns {columns} --out there"));
    let error = |folder: &str, column: &str| {
        let table = desk.table(format!("{folder}/located.csv"));
        let off = |r: &Row| Some([number(r, "distance_mm")? - number(r, column)?, number(r, "sigma_mm")?]);
        let all: Vec<[f64; 2]> = table.rows.iter().filter_map(off).collect();
        assert!(all.len() > 1500, "{folder}: {}", all.len());
        let n = all.len() as f64;
        let share = |k: f64| all.iter().filter(|[e, s]| e.abs() <= k * s).count() as f64 / n;
        (rms(all.iter().map(|[e, _]| *e)), share(1.0), 1.0 - share(3.0))
    };
    let (clean, lab) = (error("loc", "a_mm"), error("there", "dist"));
    assert!(lab.0 < 1.3 * clean.0, "{lab:?} {clean:?}");
    for (_, within, beyond) in [clean, lab] {
        assert!((0.60..0.76).contains(&within) && beyond <= 0.015, "{lab:?} {clean:?}");
    }
}

#[test]
fn signals_that_grow_with_the_distance_are_told() {
    let told = |text: &str| {
        let found = calibrated(text, &spec(), &[]);
        found.warnings.iter().any(|w| w.contains("signals grow with the distance"))
    };
    let sound = table(&spec(), &noisy(4));
    assert!(!told(&sound));
    let from_tip = |line: &str| match line.split_once(',') {
        Some((a, rest)) if a.parse::<f64>().is_ok() => format!("{},{rest}", 60.0 - a.parse::<f64>().unwrap()),
        _ => line.to_owned(),
    };
    assert!(told(&sound.lines().map(from_tip).collect::<Vec<_>>().join("\n")));
}

#[test]
fn a_whole_position_with_a_wrong_label_is_told_and_kept() {
    let text = moved(&table(&spec(), &noisy(4)), |_, _, _, s| s).replace("\n30,", "\n34,");
    let found = calibrated(&text, &spec(), &[]);
    let told = |w: &String| w.contains("33 and 34 mm are in the wrong order");
    assert!(found.warnings.iter().any(told), "{:?}", found.warnings);
    assert!(found.sides[0].table.distances.centres.contains(&34.0));
    assert!(found.taps.iter().all(|t| t.reason.is_none()));
}
