//! The explore page: the chart in it, and refused specs. pages/explore/test.mjs tests it in a browser.

use serde_json::Value;

use crate::common::program::{Desk, SPEC};

const REAL: &str = "material = { neo-hookean = 3.2 }\nsurface = true\nshear = true\nextension = true\n";

const START: &str = "<script type=\"application/json\" id=\"chart\">";

fn parts(page: &str) -> (&str, Value, &str) {
    let (before, rest) = page.split_once(START).expect("a chart");
    let (chart, after) = rest.split_once("</script>").expect("its end");
    (before, serde_json::from_str(chart).expect("JSON"), after)
}

fn baked(text: &str) -> Value {
    let desk = Desk::new(text);
    desk.json("explore spec.toml")
}

#[test]
fn a_page_is_one_file_that_asks_for_nothing() {
    let desk = Desk::new(SPEC);
    let said = desk.ok("explore spec.toml --out pages/one.html").stdout;
    assert!(said.contains("strain right to") && said.contains("pages/one.html"), "{said}");
    let page = desk.read("pages/one.html");
    assert_eq!(desk.names("pages"), ["one.html"]);
    assert!(page.len() < 400_000, "{}", page.len());
    for word in ["http:", "https:", "src=", "import(", "fetch(", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }
    let (_, chart, _) = parts(&page);
    assert_eq!(chart["vibrissa_explore"], 1);
    assert_eq!(chart["domain"]["d"], serde_json::json!([4.0, 7.0]));
    assert_eq!(chart["start"]["noise"], 1e-6);
    desk.ok("explore spec.toml --out again.html --quiet");
    assert_eq!(page, desk.read("again.html"), "the same bytes in every run");
}

#[test]
fn charts_of_many_models_hold_their_tolerance() {
    let model = |lines: &str| SPEC.to_owned() + "[model]\n" + lines;
    let delta = SPEC.replace("theta = [1, 4]", "drive = \"displacement\"\ndelta = [0.5, 4]");
    let rubbed = |lines: &str| {
        model(&format!("surface = true\nextension = true\ncontact = {{ coulomb = 0.3 }}\n{lines}"))
    };
    let yeoh = "material = { yeoh = [0.5, -0.08, 0.02] }\n";
    // The surface friction can make the strain cross zero next to the contact: this must not leave a hole in the chart.
    let whole = [
        rubbed(""),
        rubbed("shear = true\nmaterial = { neo-hookean = 3.2 }\n")
            .replace("[4, 7]", "[5, 10]")
            .replace("[1, 4]", "[0.5, 6]"),
        rubbed(yeoh).replace("[4, 7]", "[6, 7]"),
    ];
    let specs = [
        SPEC.to_owned(),
        SPEC.replace("D = 10", "D = [8, 12]\nhub = 12"),
        SPEC.replace("l = 2", "l = 2\nside = \"far\"") + "[estimate]\ntheory = \"timoshenko\"\n",
        model(REAL),
        model(&REAL.replace("surface = true\n", "")).replace("l = 2", "l = 2\nside = \"far\""),
        model("surface = true\npole_radius = 3\n"),
        delta.clone(),
        delta + "[model]\n" + REAL,
        model(&format!("{yeoh}extension = true\nsurface = true\n")),
        model("contact = { coulomb = 0 }\nextension = true\n"),
        model("contact = { coulomb = 0.3 }\nextension = true\n"),
    ];
    for (text, share) in specs.iter().map(|text| (text, 3)).chain(whole.iter().map(|text| (text, 8))) {
        let said = baked(text);
        assert!(said["result"]["strain_error"].as_f64().unwrap() < 1e-5, "{said}\n{text}");
        let [taps, outside] = ["taps_checked", "taps_outside"].map(|n| said["counts"][n].as_u64().unwrap());
        assert!(taps > 300 && share * outside < taps, "{said}\n{text}");
    }
    // The spread of K keeps its digits at small drives, for which K → 1.
    assert!(baked(SPEC)["result"]["deviation_error"].as_f64().unwrap() < 5e-4);
}

#[test]
fn no_file_but_an_older_page_is_replaced() {
    let desk = Desk::new(SPEC);
    desk.write("notes.html", "mine");
    std::fs::create_dir(desk.path("folder")).unwrap();
    for (out, word) in [("notes.html", "no page"), ("folder", "folder"), ("spec.toml", "input")] {
        let said = desk.run(&["explore", "spec.toml", "--out", out]).exits(2).stderr;
        assert!(said.contains(word) && said.contains("--out"), "{said}");
    }
    desk.refuses("explore spec.toml --out spec.toml --force", &[]);
    assert!(desk.read("notes.html") == "mine" && desk.read("spec.toml") == SPEC);
    desk.ok("explore spec.toml --out notes.html --force");
    desk.ok("explore spec.toml --out notes.html");
    let planned = desk.ok("explore spec.toml --plan").stdout;
    assert!(planned.contains("nothing was run") && !desk.path("explore.html").exists(), "{planned}");
    assert_eq!(desk.names("."), ["folder", "notes.html", "spec.toml"]);
}
