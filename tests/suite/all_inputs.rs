//! For every command and each file that it reads: an output of the same name ends with exit code 2 and changes nothing.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::os::unix::fs::symlink;
use std::path::Path;
#[cfg(target_os = "linux")]
use std::process::Stdio;
use std::sync::LazyLock;

use rayon::prelude::*;

use crate::common::measuring::{REAL, prototype};
use crate::common::program::{Desk, names};
#[cfg(target_os = "linux")]
use crate::common::world::{Running, program};

/// A command line with `{name}` for files, the files it reads, and a file it writes.
struct Case {
    line: &'static str,
    reads: &'static str,
    writes: &'static str,
}

impl Case {
    fn command(&self) -> &str {
        self.line.split(' ').next().unwrap_or_default()
    }
}

const fn case(line: &'static str, reads: &'static str, writes: &'static str) -> Case {
    Case { line, reads, writes }
}

fn inputs() -> Vec<(&'static Case, &'static str)> {
    CASES.iter().flat_map(|case| case.reads.split(' ').map(move |input| (case, input))).collect()
}

const CASES: &[Case] = &[
    case("sweep {listed.toml}", "listed.toml list.csv", "tuples.csv"),
    case("sweep {rubber.toml}", "rubber.toml rubber.csv", "designs.csv"),
    case("sweep {shaped.toml}", "shaped.toml profile.csv", "run.json"),
    case("optimise {search.toml}", "search.toml rubber.csv", "best.toml"),
    case("tap {rubber.toml}", "rubber.toml rubber.csv", "tap.csv"),
    case("chart {rubber.toml}", "rubber.toml rubber.csv", "chart.json"),
    case("shape {shaped.toml}", "shaped.toml profile.csv", "shape.csv"),
    case("verify {shaped.toml} --samples 1 --backend cpu", "shaped.toml profile.csv", "verify.csv"),
    case("cluster slurm {listed.toml} --shards 2", "listed.toml list.csv", "submit.sh"),
    case("explore {rubber.toml}", "rubber.toml rubber.csv", "explore.html"),
    case("plan {rig.toml} --error 3 --like {cal.toml}", "rig.toml cal.toml", "plan.csv"),
    case("simulate {shaped.toml}", "shaped.toml profile.csv", "measurements.csv"),
    case("simulate {sweep.toml} --object {object.toml}", "sweep.toml object.toml outline.csv", "strokes.csv"),
    case(
        "calibrate {data.csv} --whisker {shaped.toml}",
        "data.csv shaped.toml profile.csv",
        "calibration.toml",
    ),
    case("locate {cal.toml} {readings.csv}", "cal.toml readings.csv", "located.csv"),
    case("locate --array {array.toml} {of_array.csv}", "array.toml of_array.csv cal.toml", "located.csv"),
    case("next {cal.toml} {readings.csv}", "cal.toml readings.csv", "next.csv"),
    case(
        "contour {poses.csv} --calibration {cal.toml} --truth {object.toml}",
        "poses.csv cal.toml object.toml outline.csv",
        "points.csv",
    ),
    case("taps {raw.csv}", "raw.csv", "taps.csv"),
];

/// Commands without a case above: `report` and `merge` read whole folders and have their own test, the others read no file.
const OTHERS: [&str; 5] = ["report", "merge", "bench", "devices", "man"];

static FILES: LazyLock<BTreeMap<&'static str, String>> = LazyLock::new(files);

/// Files by name; `{name}` in a text stands for the path of that file.
fn files() -> BTreeMap<&'static str, String> {
    let taps = "[tap]\na = { from = 21, to = 45, step = 6 }\ntheta = [1, 4, 8]\n";
    let rig = prototype(4.0, &["noise_strain = 1e-5\n", taps, REAL]);
    let rubber = rig.replace(REAL, "[model]\nmaterial = { curve = \"{rubber.csv}\" }\n");
    let shaped = rig.replace("D = 10\nd = 4\nL_a = 50\n", "profile = \"{profile.csv}\"\n").replace(REAL, "");
    let search = rubber.replace("theta = [1, 4, 8]\n", "")
        + "[optimise]\nobjective = \"sd\"\nbudget = { evaluations = 20 }\nvariables = { theta = [1, 5] }\n";
    let stress = (1..20).map(|i| format!("{},{}\n", f64::from(i) * 0.02, f64::from(i) * 0.06));
    let around = (0..24).map(|i| f64::from(i) * 15.0_f64.to_radians());
    let outline = around.map(|turn| format!("{},{}\n", 10.0 * turn.cos(), 10.0 * turn.sin()));
    let held = |i: i32| if i % 200 < 140 { 0.0 } else { 60.0 };
    let raw = (0..1000).map(|i| format!("{},{}\n", f64::from(i) * 0.01, held(i) + f64::from(i % 7) * 0.01));
    let readings = "theta_deg,strain\n4,0.02\n8,0.04\n";
    let desk = Desk::new(&rig);
    desk.ok("simulate spec.toml --repeats 2 --out sim");
    desk.ok("calibrate sim/measurements.csv --whisker spec.toml --out cal");
    BTreeMap::from([
        ("rig.toml", rig.clone()),
        ("listed.toml", "[tuples]\nfile = \"{list.csv}\"\n".to_owned()),
        ("list.csv", "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n10,4,50,5,2,33,1\n".to_owned()),
        ("rubber.toml", rubber),
        ("rubber.csv", format!("strain,stress_MPa\n{}", stress.collect::<String>())),
        ("shaped.toml", shaped),
        ("profile.csv", "s_mm,D_mm\n0,10\n25,7.5\n50,4\n".to_owned()),
        ("search.toml", search),
        ("sweep.toml", rig.replace(taps, "[tap]\na = 30\ntheta = { from = 0.5, to = 8, step = 0.5 }\n")),
        (
            "object.toml",
            "[object]\nshape = \"curve\"\nfile = \"{outline.csv}\"\nclosed = true\n[around]\nstarts = 6\ndistance = 36\n"
                .to_owned(),
        ),
        ("outline.csv", format!("x_mm,y_mm\n{}", outline.collect::<String>())),
        ("data.csv", desk.read("sim/measurements.csv")),
        ("cal.toml", desk.read("cal/calibration.toml")),
        ("readings.csv", readings.to_owned()),
        ("of_array.csv", "whisker,theta_deg,strain\nleft,4,0.02\nleft,8,0.04\n".to_owned()),
        (
            "array.toml",
            "[[whisker]]\nname = \"left\"\ncalibration = \"{cal.toml}\"\nx = 0\ny = 40\nheading = 0\n".to_owned(),
        ),
        (
            "poses.csv",
            "base_x_mm,base_y_mm,heading_deg,theta_deg,strain\n0,40,0,4,0.02\n0,42,0,4,0.021\n0,44,0,4,0.022\n".to_owned(),
        ),
        ("raw.csv", format!("t_s,reading\n{}", raw.collect::<String>())),
    ])
}

/// `text` with each `{file}` replaced by its path on `desk`; `moved` is at `to`.
fn braces(desk: &Desk, text: &str, files: &BTreeMap<&str, String>, [moved, to]: [&str; 2]) -> String {
    let path = |name: &str| desk.path(if name == moved { to } else { name }).display().to_string();
    files.keys().fold(text.to_owned(), |text, name| text.replace(&format!("{{{name}}}"), &path(name)))
}

fn held(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let read = |name: String| (name.clone(), std::fs::read(folder.join(&name)).unwrap_or_default());
    names(folder).into_iter().map(read).collect()
}

/// Tries one input of one case; returns the faults.
fn walked(case: &Case, files: &BTreeMap<&str, String>, input: &str) -> Vec<String> {
    let desk = Desk::new("");
    let inside = format!("trap/{}", case.writes);
    let lay = |moved: &str| {
        for (name, text) in files {
            let to = if *name == moved { inside.as_str() } else { *name };
            desk.write(to, braces(&desk, text, files, [moved, &inside]));
        }
        case.line.split(' ').map(|word| braces(&desk, word, files, [moved, &inside])).collect::<Vec<String>>()
    };
    let mut wrong = Vec::new();
    let mut ask = |line: &[String], out: &str, force: bool, by_name: bool| {
        let out = if case.command() == "explore" { format!("{out}/{}", case.writes) } else { out.to_owned() };
        let before = held(&desk.path("trap"));
        let mut line: Vec<&str> = line.iter().map(String::as_str).collect();
        line.extend(["--out", &out]);
        line.extend(force.then_some("--force"));
        let ran = desk.run(&line);
        let named =
            ["is read by this command", "this is an input"].iter().any(|why| ran.stderr.contains(why));
        let refused = ran.code == 2 && (named || !by_name);
        if !refused || held(&desk.path("trap")) != before {
            wrong.push(format!("{line:?} for {input}: {} {}", ran.code, ran.stderr));
        }
    };
    let line = lay(input);
    ask(&line, "trap", true, true);
    // One function resolves links and `..` for all result folders, another for pages: one command of each kind is enough.
    if !["sweep {listed.toml}", "explore {rubber.toml}"].contains(&case.line) {
        return wrong;
    }
    symlink("trap", desk.path("link")).unwrap();
    ask(&line, "trap", false, true);
    ask(&line, "trap/../trap", true, true);
    ask(&line, "link", true, true);
    // The input elsewhere, and a hard link or a symlink to it in the folder: refused as any file that no result lists.
    std::fs::remove_file(desk.path(&inside)).unwrap();
    let line = lay("");
    std::fs::hard_link(desk.path(input), desk.path(&inside)).unwrap();
    ask(&line, "trap", true, false);
    std::fs::remove_file(desk.path(&inside)).unwrap();
    symlink(desk.path(input), desk.path(&inside)).unwrap();
    ask(&line, "link/.", true, false);
    wrong
}

#[test]
fn no_command_replaces_what_it_reads() {
    let files = &*FILES;
    let wrong: Vec<String> =
        inputs().par_iter().flat_map(|(case, input)| walked(case, files, input)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Most memory (bytes) a command may take for a wrong file: the program, and twice 16 MiB of text.
#[cfg(target_os = "linux")]
const MEMORY: u64 = 250 << 20;

#[cfg(target_os = "linux")]
fn measured(desk: &Desk, line: &[String]) -> (Option<i32>, u64, String) {
    let told = std::fs::File::create(desk.path("stderr")).unwrap();
    let mut command = program(desk, line);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(told);
    let mut child = Running::new(&mut command);
    let place = format!("/proc/{}", child.id());
    let mut most = 0;
    let status = loop {
        let status = std::fs::read_to_string(format!("{place}/status")).unwrap_or_default();
        let begun = std::fs::read_link(format!("{place}/exe")).is_ok_and(|exe| exe.ends_with("vibrissa"));
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
        most = most.max(peak.filter(|_| begun).and_then(|kb| kb.parse().ok()).unwrap_or(0));
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    };
    (status.code(), most << 10, desk.read("stderr"))
}

#[test]
#[cfg(target_os = "linux")]
fn a_wrong_file_is_refused_before_it_fills_the_memory() {
    let files = &*FILES;
    let tried = |(case, input): &(&Case, &str)| {
        let mut wrong = Vec::new();
        for what in ["zeros", "one line", "no text"] {
            // One function reads text for all commands. `locate` answers table lines that are not UTF-8 line by line.
            let first = case.command() == "sweep" && (what != "no text" || input.ends_with(".toml"));
            if what != "zeros" && !first {
                continue;
            }
            let desk = Desk::new("");
            for (name, text) in files {
                desk.write(name, braces(&desk, text, files, ["", ""]));
            }
            match what {
                // A sparse file: nothing is on the disk.
                "zeros" => std::fs::File::create(desk.path(input)).unwrap().set_len(5 << 30).unwrap(),
                "one line" => desk.write(input, vec![b'7'; 20 << 20]),
                _ => desk.write(input, [&b"# \xff\n"[..], files[*input].as_bytes()].concat()),
            }
            let mut line: Vec<String> =
                case.line.split(' ').map(|word| braces(&desk, word, files, ["", ""])).collect();
            line.extend(["--out".to_owned(), "out".to_owned()]);
            let (code, memory, told) = measured(&desk, &line);
            let named = told.contains(&desk.path(input).display().to_string()) || told.contains(input);
            if code != Some(2) || !named || memory > MEMORY || desk.path("out").exists() {
                wrong.push(format!("{line:?}, {input} is {what}: {code:?}, {} MiB, {told}", memory >> 20));
            }
        }
        wrong
    };
    let wrong: Vec<String> = inputs().par_iter().flat_map(tried).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_command_that_writes_is_walked() {
    let desk = Desk::new("");
    let mut writing = 0;
    for command in
        crate::help::commands(&desk).iter().map(String::as_str).filter(|command| *command != "help")
    {
        if desk.ok(format!("{command} --help")).stdout.contains("--out") {
            writing += 1;
            let walked = CASES.iter().any(|case| case.command() == command) || OTHERS.contains(&command);
            assert!(walked, "{command} writes, and no test puts its inputs in its way");
        }
    }
    assert!(writing > 15, "{writing}");
}

fn tree(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for (name, bytes) in held(folder) {
        let path = folder.join(&name);
        match path.is_dir() && !path.is_symlink() {
            true => {
                all.extend(tree(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)))
            }
            false => all.push((name, bytes)),
        }
    }
    all
}

#[test]
fn a_report_and_a_merge_keep_the_folders_that_they_read() {
    let files = &*FILES;
    let desk = Desk::new(&files["rig.toml"]);
    desk.write("data.csv", &files["data.csv"]);
    desk.ok("calibrate data.csv --whisker spec.toml --out cal");
    desk.sweep(&["--out", "swept"]).exits(0);
    desk.ok("calibrate data.csv --whisker spec.toml --out again");
    std::fs::copy(desk.path("data.csv"), desk.path("again/rows.csv")).unwrap();
    for part in ["1/2", "2/2"] {
        desk.sweep(&["--shard", part, "--out", "parts"]).exits(0);
    }
    let search = files["search.toml"].replace("curve = \"{rubber.csv}\"", "hooke = 3.2");
    desk.write("search.toml", search);
    desk.ok("optimise search.toml --out best");
    let [one, two] = ["1", "2"].map(|k| format!("parts/shard-{k}-of-2"));
    let font = concat!(env!("CARGO_MANIFEST_DIR"), "/../../src/figure/font/DejaVuSans.ttf");
    std::fs::create_dir(desk.path("drawn")).unwrap();
    std::fs::copy(font, desk.path("drawn/report.html")).unwrap();
    for folder in ["cal", "swept", &one] {
        symlink(desk.path(folder), desk.path(&format!("link-{}", folder.replace('/', "-")))).unwrap();
    }
    let one_link = format!("link-{}", one.replace('/', "-"));
    let before = tree(&desk.path("."));
    for (line, out) in [
        ("report cal".to_owned(), "cal"),
        ("report cal".to_owned(), "cal/../cal"),
        ("report cal".to_owned(), "link-cal"),
        ("report link-cal".to_owned(), "cal"),
        ("report swept".to_owned(), "swept"),
        ("report swept --font drawn/report.html".to_owned(), "drawn"),
        (format!("merge {one} {two}"), &one),
        (format!("merge {one} {two}"), &one_link),
        ("merge parts".to_owned(), &two),
        ("sweep best/best.toml".to_owned(), "best"),
        ("calibrate again/rows.csv --whisker spec.toml".to_owned(), "again"),
        ("locate again/calibration.toml data.csv".to_owned(), "again"),
    ] {
        for force in ["", "--force"] {
            desk.refuses(format!("{line} --out {out} {force}"), &["is read by this command"]);
            assert!(tree(&desk.path(".")) == before, "{line} {out} changed a file");
        }
    }
    // A copy outside the result is not replaced, nor a file that the command neither reads as its table nor writes.
    std::fs::copy(desk.path("best/best.toml"), desk.path("best.toml")).unwrap();
    desk.ok("sweep best.toml --out . --force");
    assert_eq!(desk.read("best.toml"), desk.read("best/best.toml"));
    desk.write("desk/measurements.csv", &files["data.csv"]);
    desk.write("desk/best.toml", &files["rig.toml"]);
    desk.ok("calibrate desk/measurements.csv --whisker desk/best.toml --out desk --force");
    assert_eq!(desk.read("desk/best.toml"), files["rig.toml"]);
    assert_eq!(desk.read("desk/measurements.csv"), files["data.csv"]);
}
