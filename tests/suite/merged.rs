//! Parts whose run.json does not say what a part's run.json says: `merge` names file, key, value and what is allowed, and writes nothing.

use serde_json::{Value, json};

use crate::common::program::{Desk, SPEC};

#[test]
fn a_part_that_states_nonsense_is_refused_by_key() {
    let desk = Desk::new(SPEC);
    for part in ["1/2", "2/2"] {
        desk.sweep(&["--out", "out", "--shard", part]).exits(0);
    }
    let honest = desk.whole("out/shard-2-of-2");
    let hash = "0".repeat(64);
    for (at, value, key, allowed) in [
        ("/files", json!([]), "files", "the files of this part: tuples.csv"),
        ("/files", json!(5), "files", "a list of"),
        ("/files/0/name", json!("../x"), "files[0].name", "in its folder"),
        ("/files/0/name", json!("run.json"), "files[0].name", "in its folder"),
        ("/files/0/name", honest["files"][1]["name"].clone(), "files[1].name", "each file once"),
        ("/files/0/blake3", json!("abc"), "files[0].blake3", "64 hexadecimal digits"),
        ("/files/0/blake3", json!(hash), "merge", "as it was written"),
        ("/counts/taps", json!(-1), "counts.taps", "a whole number"),
        ("/counts/taps", json!("many"), "counts.taps", "a whole number"),
        ("/counts/solved", json!(u64::MAX), "counts.solved", "a whole number"),
        ("/counts/referred", Value::Null, "counts.referred", "a whole number"),
        ("/counts/status", json!({ "ok": 1.5 }), "counts.status.ok", "a whole number"),
        ("/counts", json!(7), "counts.taps", "a whole number"),
        ("/seconds/total", json!("long"), "seconds.total", "a number ≥ 0"),
        ("/shard/distances_each", json!("all"), "shard.distances_each", "a whole number"),
        ("/material_fit", json!(true), "material_fit", "an object"),
    ] {
        let mut run = honest.clone();
        *run.pointer_mut(at).unwrap() = value;
        desk.write("out/shard-2-of-2/run.json", run.to_string());
        let ran = desk.run(&["merge", "out", "--out", "joined", "--json"]).exits(2);
        let error = ran.json()["error"].clone();
        let told = |field: &str| error[field].as_str().unwrap_or_default().to_owned();
        assert_eq!(told("key"), key, "{at}: {error}");
        assert!(told("allowed").contains(allowed) && error["value"].is_string(), "{at}: {error}");
        assert!(key == "merge" || told("file").ends_with("shard-2-of-2/run.json"), "{at}: {error}");
        assert!(!desk.path("joined").exists(), "{at}");
    }
    desk.write("out/shard-2-of-2/run.json", honest.to_string());
    desk.ok("merge out --out joined");
}
