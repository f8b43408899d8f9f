//! Files that the program writes into folders and reads again: states of stopped sweeps, records, manifests, parts.

use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use serde_json::Value;
use vibrissa::backend::Choice;
use vibrissa::plan::Plan;
use vibrissa::progress::Silent;
use vibrissa::scene::{BackendChoice, RunOptions};
use vibrissa::sink::folder::{Folder, Question, sealed};
use vibrissa::sink::shard::Shard;
use vibrissa::spec;
use vibrissa::sweep::{self, Target};

use crate::{desk, told};

/// The packed state of a stopped sweep, read by every route.
pub fn state(data: &[u8]) {
    sweep::readable(data);
}

/// A folder with `data` as one of the hidden files or as the record; the first byte selects.
pub fn folder(data: &[u8]) {
    let Some((first, data)) = data.split_first() else { return };
    desk::clear("out");
    desk::write("out/run.json", RECORD.as_bytes());
    desk::write("out/a.csv", b"old");
    match first % 3 {
        0 => desk::write("out/run.json", data),
        1 => {
            desk::write("out/.vibrissa-unfinished/.finished", data);
            desk::write("out/.vibrissa-unfinished/a.csv", b"new");
            desk::write("out/.vibrissa-unfinished/run.json", RECORD.as_bytes());
        }
        _ => {
            // With a valid checksum, so that the rest is read.
            let whole = [blake3::hash(data).to_hex().as_bytes(), data].concat();
            desk::write("out/.vibrissa-unfinished/.state", &whole);
        }
    }
    let question = Question { identity: Some("identity".into()), ..Question::new("sweep", "spec", Value::Null) };
    told(Folder::open(&desk::path("out"), question, &["a.csv"], first / 3 % 2 == 0));
}

const RECORD: &str = r#"{"format":1,"command":"sweep","name":"spec","seconds":{"total":1.0},"in_force":[],"asked":null,
"files":[{"name":"a.csv","blake3":"0000000000000000000000000000000000000000000000000000000000000000","bytes":3}]}"#;

static PARTS: LazyLock<[Vec<(String, Vec<u8>)>; 2]> = LazyLock::new(|| {
    let row = |i: usize| format!("10,{},50,5,2,{},{}\n", 4 + i % 3, 21 + i % 5, 1 + i % 4);
    let list: String = (0..24).map(row).collect();
    desk::write("parts/list.csv", format!("D_mm,d_mm,L_a_mm,x_ss_mm,l_mm,a_mm,theta_deg\n{list}").as_bytes());
    let text = "[tuples]\nfile = \"list.csv\"\n[gauge]\nnoise_strain = 1e-6\n[model]\ngeometry = \"linear\"\n[output]\ntop = 3\nby = \"K_sd\"\n";
    let spec = spec::parse("spec.toml", text, &desk::path("parts")).expect("a spec");
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let choice = Choice::new(&options).expect("the CPU");
    let (plan, never) = (Plan::new(&spec.study, &choice).expect("a plan"), AtomicBool::new(false));
    [1, 2].map(|index| {
        let shard = Shard { index, of: 2 };
        let out = desk::path("parts").join(shard.folder());
        let target = Target { shard: Some(shard), ..Target::new(&out, &never) };
        sweep::run(&spec, &plan, &choice, &target, &mut Silent).expect("a part");
        let files = std::fs::read_dir(&out).expect("its files").map(|e| e.expect("an entry").path());
        let read = |path: &Path| std::fs::read(path).expect("a file");
        files.map(|p| (p.file_name().expect("a name").to_string_lossy().into_owned(), read(&p))).collect()
    })
});

/// Parts with `data` as list of places, record or table of one part; hashes are valid.
pub fn merge(data: &[u8]) {
    let Some((first, data)) = data.split_first() else { return };
    desk::clear("whole");
    let damaged = ["places.bin", "run.json", "designs.csv"][usize::from(first % 3)];
    for (part, files) in (1..).zip(&*PARTS) {
        let folder = format!("whole/shard-{part}-of-2");
        for (name, bytes) in files {
            desk::write(&format!("{folder}/{name}"), if part == 2 && name == damaged { data } else { bytes });
        }
        if part == 2 && damaged != "run.json" {
            let path = desk::path(&folder).join("run.json");
            let mut run: Value =
                serde_json::from_slice(&std::fs::read(&path).expect("it is there")).expect("JSON");
            for file in run["files"].as_array_mut().expect("a list") {
                if file["name"] == damaged {
                    file["blake3"] = blake3::hash(data).to_hex().to_string().into();
                    file["bytes"] = data.len().into();
                }
            }
            std::fs::write(path, sealed(run)).expect("a file");
        }
    }
    told(vibrissa::merge::run(&[desk::path("whole")], None, first / 3 % 2 == 0));
}
