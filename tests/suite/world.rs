//! The program's environment: closed and full streams, readers that leave, odd arguments and files.
#![cfg(unix)]

use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;

use crate::common::program::{Desk, SPEC};
use crate::common::world::{calibrated, program, shell, words};
use serde_json::Value;

const TABLES: [&str; 4] = ["designs.csv", "distances.csv", "run.json", "tuples.csv"];

#[test]
fn a_run_goes_on_where_nobody_takes_its_words() {
    for away in ["2>/dev/full", "2>&-", "2>&1 >/dev/null | true"] {
        let desk = Desk::new(&format!("{SPEC}[run]\nbackend = \"cpu\"\n"));
        shell(&desk, &format!("vibrissa sweep spec.toml {away}"));
        assert_eq!(desk.names("results/spec"), TABLES, "{away}");
    }
    let desk = calibrated();
    for line in [
        "calibrate sim/measurements.csv --whisker spec.toml --out again",
        "simulate spec.toml --out made",
        "locate cal/calibration.toml sim/measurements.csv --out loc",
        "sweep spec.toml --backend cpu --explain",
        "devices",
    ] {
        let ran = shell(&desk, &format!("vibrissa {line} 2>/dev/full"));
        assert_eq!(ran.status.code(), Some(0), "{line}");
    }
    for line in ["sweep none.toml", "sweep", "sweep spec.toml --tolerance 7", "locate spec.toml"] {
        let ran = shell(&desk, &format!("vibrissa {line} 2>/dev/full"));
        assert_eq!(ran.status.code(), Some(2), "{line}");
    }
}

#[test]
fn answers_that_do_not_arrive_are_a_failure() {
    let desk = calibrated();
    for line in [
        "sweep spec.toml --backend cpu",
        "sweep spec.toml --backend cpu --json",
        "sweep spec.toml --backend cpu --plan",
        "simulate spec.toml --out made --json",
        "locate cal/calibration.toml sim/measurements.csv --out loc --json",
        "locate cal/calibration.toml",
        "locate cal/calibration.toml --json --out stream",
        "devices",
        "--help",
        "--version",
    ] {
        let ran = shell(&desk, &format!("echo 4,0.02 | vibrissa {line} >/dev/full"));
        let stderr = words(&ran.stderr);
        assert!(ran.status.code() == Some(1) && stderr.contains("stdout: "), "{line}: {stderr}");
    }
}

#[test]
fn a_reader_that_leaves_is_no_failure() {
    let desk = calibrated();
    for line in [
        "sweep spec.toml --plan",
        "sweep spec.toml --backend cpu --json",
        "locate cal/calibration.toml",
        "--help",
    ] {
        let both = format!("(yes 4,0.02 | vibrissa {line}; echo $? >code) 2>words | head -0");
        shell(&desk, &both);
        assert_eq!((desk.read("code").trim(), desk.read("words").contains("stdout")), ("0", false), "{line}");
    }
}

#[test]
fn arguments_may_be_any_bytes() {
    let desk = calibrated();
    let odd = |name: &[u8]| OsString::from(OsStr::from_bytes(name));
    let rename = |from: &str, to: &OsStr| std::fs::rename(desk.path(from), desk.path(".").join(to)).unwrap();
    let (spec, data, out, located) =
        (odd(b"sp\xffec.toml"), odd(b"d\xfea.csv"), odd(b"o\xc3ut"), odd(b"l\xf0"));
    rename("spec.toml", &spec);
    rename("sim/measurements.csv", &data);
    let word = OsString::from;
    let lines: [&[OsString]; 4] = [
        &[word("sweep"), spec.clone(), word("--backend=cpu"), word("--out"), out.clone()],
        &[word("sweep"), spec.clone(), word("--plan")],
        &[word("calibrate"), data.clone(), word("--whisker"), spec.clone()],
        &[word("locate"), word("cal/calibration.toml"), data.clone(), word("--out"), located.clone()],
    ];
    for line in lines {
        let ran = program(&desk, &[line, &[word("--json")]].concat()).output().unwrap();
        assert_eq!(ran.status.code(), Some(0), "{line:?}: {}", words(&ran.stderr));
        assert_eq!(serde_json::from_slice::<Value>(&ran.stdout).unwrap()["ok"], true, "{line:?}");
    }
    assert!(desk.path(".").join(&out).join("run.json").exists() && desk.path(".").join(located).exists());

    for json in [false, true] {
        for line in [
            &[word("sweep"), odd(b"none\xff.toml")][..],
            &[word("sweep"), spec.clone(), word("--adapter"), odd(b"\xff")],
            &[odd(b"\xff")],
        ] {
            let mut line = line.to_vec();
            line.extend(json.then(|| word("--json")));
            let ran = program(&desk, &line).output().unwrap();
            assert_eq!(ran.status.code(), Some(2), "{line:?}: {}", words(&ran.stderr));
            let said = if json { words(&ran.stdout) } else { words(&ran.stderr) };
            assert!(!said.contains("panicked") && said.len() > 20, "{line:?}: {said}");
        }
    }
}

#[test]
fn a_mistake_is_shown_wherever_it_stands() {
    let long = |n: usize| {
        format!("[whisker]\nD = [{}, -1, {}]\n", vec!["10"; n].join(", "), vec!["11"; n].join(", "))
    };
    let cases = [
        (long(20_000), 2, "-1"),
        (format!("[whisker]\nD ={}-10\n", " ".repeat(70_000)), 2, "-10"),
        (format!("[whisker]\nD = \"{}\"\n", "x".repeat(200_000)), 2, "xxx"),
        (format!("[whisker]\n{} = 1\n", "k".repeat(100_000)), 2, "kkk"),
        (format!("[whisker]\nD = 10 {}\n", "毛".repeat(70_000)), 2, "毛毛"),
        (format!("{}D = -1\n", "[whisker]\r\n"), 2, "-1"),
        (format!("\u{feff}# {}\n[whisker]\nD\t= -1\n", "#".repeat(100_000)), 3, "-1"),
        (format!("[whisker]\nD = {}1{}\n", "[".repeat(70_000), "]".repeat(70_000)), 2, "[[["),
        ("[whisker]\nD = \"\u{1b}[31m\u{7}\"\n".to_owned(), 2, "D = "),
        ("[whisker]\nD = \"\0\"\n".to_owned(), 2, "a NUL byte stands in this line"),
        (format!("[whisker]\nD = 10\n\na{} = 1\n", ".a".repeat(100_000)), 4, "too many parts"),
    ];
    for (text, line, shown) in cases {
        let head = text.chars().take(40).collect::<String>();
        let desk = Desk::new(&text);
        let ran = desk.line("sweep spec.toml").exits(2);
        assert!(ran.stderr.contains(shown) && ran.stderr.len() < 4000, "{head:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(&format!("spec.toml:{line}")), "{head:?}: {}", ran.stderr);
        assert!(!ran.stderr.contains(|c: char| c.is_control() && c != '\n'), "{head:?}: {:?}", ran.stderr);
        let json = desk.line("sweep spec.toml --json").exits(2).json();
        assert_eq!(json["error"]["line"], line, "{head:?}");
    }
}

#[test]
fn measurements_of_any_kind_are_refused_with_their_line() {
    let desk = Desk::new("[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\n");
    for (text, line) in [
        (format!("a_mm,theta_deg,strain\n21,4,0.03\n30,4,{}\n", "x".repeat(100_000)), 3),
        (format!("a_mm,theta_deg,strain\n21,4,0.03{}\n", ",".repeat(100_000)), 2),
        ("a_mm,theta_deg,strain\n21,4,\u{1b}[2J\n".to_owned(), 2),
        ("a_mm,theta_deg,strain\n21,80,4,0.03\n".to_owned(), 2),
        ("a_mm,theta_deg,strain\n21,80\n".to_owned(), 2),
        ("a_mm,theta_deg,strain\n\"21,80\",4,0.03\n".to_owned(), 2),
        ("\0\0\0\n".to_owned(), 1),
    ] {
        desk.write("d.csv", &text);
        let said = desk.line("calibrate d.csv --whisker spec.toml").exits(2).stderr;
        let head = text.chars().take(40).collect::<String>();
        assert!(said.contains(&format!("d.csv:{line}")) && said.len() < 2000, "{head:?}: {said}");
        assert!(!said.contains(|c: char| c.is_control() && c != '\n'), "{head:?}: {said:?}");
    }
}
