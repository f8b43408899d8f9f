//! Specs that are refused, with file, line, key and reason: the table tests/data/refused.txt.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::common::ROOT;
use crate::common::schema;
use crate::common::searching::Silent;
use crate::common::specs::{parse, with};
use crate::common::sweeping::CPU;
use vibrissa::error::{Error, InputError};
use vibrissa::optimise;
use vibrissa::plan::Plan;
use vibrissa::scene::{Contact, Material, RunOptions};
use vibrissa::spec;

/// The error of a spec or search, up to the start of its run.
fn refusal(text: &str, folder: &Path) -> Result<(), InputError> {
    let never = AtomicBool::new(false);
    let run = || -> Result<(), Error> {
        if !text.contains("[optimise]") {
            let spec = spec::parse("spec.toml", text, folder)?;
            Plan::new(&spec.study, &CPU.choice())?;
            return Ok(());
        }
        let (spec, search) = spec::parse_search("spec.toml", text, folder)?;
        let asked = (&CPU.choice(), &RunOptions::default(), None);
        optimise::find(&spec, &search, asked, &never, &mut Silent).map(drop)
    };
    match run() {
        Err(Error::Input(e)) if e.file.is_none() => Err(spec::placed("spec.toml", text, e)),
        Err(Error::Input(error)) => Err(error),
        other => {
            other.unwrap_or_else(|e| panic!("{e}: {text}"));
            Ok(())
        }
    }
}

pub fn changed(text: &str, change: &str) -> (String, usize) {
    let lines = |text: &str| text.replace(" / ", "\n");
    if let Some((old, new)) = change.split_once("=>") {
        let (old, new) = (lines(old.trim_end()), lines(new.trim_start()));
        let at = text.find(&old).unwrap_or_else(|| panic!("no {old} in {text}"));
        return (text.replacen(&old, &new, 1), 1 + text[..at].matches('\n').count());
    }
    let (section, new) = change.split_once(": ").unwrap_or_else(|| panic!("no change: {change}"));
    let head = format!("[{section}]\n");
    let text = if text.contains(&head) { text.to_owned() } else { format!("{text}{head}") };
    let at = text.find(&head).expect("it is there") + head.len();
    (format!("{}{}\n{}", &text[..at], lines(new), &text[at..]), 1 + text[..at].matches('\n').count())
}

#[test]
fn every_refused_spec_says_where_and_why() {
    let table = std::fs::read_to_string(format!("{ROOT}/tests/data/refused.txt")).expect("the table");
    let folder = tempfile::tempdir().expect("a folder");
    let head = "D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg";
    for (name, text) in [
        ("hollow.csv", "s_mm,D_mm,bore_mm\n0,10,3\n50,4,2\n".to_owned()),
        ("tilted.csv", format!("{head},tilt_deg\n10,4,50,5,2,33,4,0\n10,4,50,5,2,33,4,10\n")),
        (
            "rubber.csv",
            "strain,stress_MPa\n0.1,0.3\n0.2,0.5\n0.4,0.85\n0.6,1.2\n0.8,1.5\n1.0,1.95\n".to_owned(),
        ),
        ("bores.csv", format!("{head},bore_mm\n10,4,50,5,2,33,4,0\n10,4,50,5,2,33,4,2\n")),
    ] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let (mut faults, mut cases) = (Vec::new(), 0);
    for part in table.split("\n== ").skip(1) {
        let (base, rows) = part.split_once("--\n").expect("a spec and its changes");
        let (name, base) = base.split_once('\n').expect("a name");
        for row in rows.lines().filter(|row| !row.is_empty() && !row.starts_with('#')) {
            let mut fields = row.split(" | ");
            let (changes, key) = (fields.next().expect("changes"), fields.next().expect("a key").trim());
            let (mut text, mut line) = (base.to_owned(), None);
            for change in changes.split(" ; ") {
                let (next, at) = changed(&text, change);
                (text, line) = (next, line.or(Some(at)));
            }
            let found = refusal(&text, folder.path());
            if name == "whole" {
                schema::keep(&text, found.as_ref().err());
            }
            let (mut words, mut told) = (Vec::new(), Vec::new());
            for field in fields {
                match field.strip_prefix('@') {
                    Some(other) => line = other.parse().ok(),
                    None => words.push(field),
                }
            }
            cases += 1;
            match &found {
                Ok(()) if key == "-" => continue,
                Ok(()) => told.push("accepted".to_owned()),
                Err(error) => {
                    let said = error.to_string();
                    if (error.line, error.key.as_deref()) != (line, Some(key).filter(|k| !k.is_empty())) {
                        told.push(format!("line {line:?}: {said}"));
                    }
                    let missing = words.iter().filter(|word| !said.contains(**word));
                    told.extend(missing.map(|word| format!("`{word}` is not in: {said}")));
                    let place = error.file.as_deref() == Some("spec.toml") && error.snippet.is_some();
                    let allowed = error.allowed.is_some() || error.value.is_none() || name != "search";
                    if !place || !allowed || folder.path().join("out").exists() {
                        told.push(format!(
                            "without place or what is allowed, or something is left: {error:?}"
                        ));
                    }
                }
            }
            faults.extend(told.into_iter().map(|told| format!("{name}: {row}\n    {told}")));
        }
    }
    assert!(faults.is_empty() && cases > 250, "{} of {cases}\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn a_spec_without_anything_and_a_limit_that_cannot_be_met() {
    let error = parse("").unwrap_err();
    assert_eq!((error.line, error.key.as_deref()), (None, Some("whisker.D")));
    assert!(error.message.contains("[whisker] with D is missing"));
    // The least strain in the message is exact: this limit is accepted, 1 % less is refused.
    let folder = tempfile::tempdir().expect("a folder");
    let with = |limit: f64| {
        let text = format!(
            "[whisker]\nD = 10\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 20e-6\n[tap]\na = {{ from = 21, to = 48, step = 3 }}\n[optimise]\nobjective = \"distance\"\n\
             variables = {{ d = [2, 10], theta = [0.5, 10] }}\nlimits = {{ strain = {limit} }}\n"
        );
        refusal(&text, folder.path())
    };
    let error = with(0.001).unwrap_err();
    assert_eq!((error.line, error.key.as_deref()), (Some(13), Some("optimise.limits.strain")), "{error}");
    let allowed = error.allowed.expect("a limit");
    let least: f64 = allowed.split_whitespace().nth(1).and_then(|word| word.parse().ok()).expect("a number");
    assert!(with(0.99 * least).is_err() && with(least).is_ok(), "{allowed}");
}

#[test]
fn effects_are_read_as_they_are_written() {
    let model =
        |keys: &str| parse(&with("[model]", &format!("[model]\n{keys}"))).expect(keys).study.setup.model;
    assert_eq!(model("extension = true\ncontact = \"stick\"").contact, Contact::Stick);
    let rubbed = model("extension = true\npole_radius = 2\ncontact = { coulomb = 0.3 }");
    assert_eq!((rubbed.contact, rubbed.pole_radius, rubbed.surface), (Contact::Coulomb(0.3), 2.0, false));
    for (law, material) in [
        ("neo-hookean = 3.2", Material::NeoHookean(3.2)),
        ("mooney-rivlin = [0.35, 0.15]", Material::MooneyRivlin([0.35, 0.15])),
        ("yeoh = [0.5, -0.08, 0.02]", Material::Yeoh([0.5, -0.08, 0.02])),
    ] {
        assert_eq!(model(&format!("material = {{ {law} }}")).material, material);
    }
}
