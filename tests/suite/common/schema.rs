//! Stores specs with the reader's verdict; `tests/schema` compares them with the JSON Schema.

use std::path::Path;

use vibrissa::error::InputError;
use vibrissa::sink::folder::hash_file;

/// Parts of messages about a single key, which a schema checks too; other messages concern several keys, files or the physics.
const STRUCTURAL: &str = "unknown key|unknown section|unknown word|this must be|this value is out of range|this number is too small|newer format|\
    numbers are needed|list is empty|contradict each other|belongs to samples|is missing here|\
    steps (the number of values) or step|needs steps, not step|exactly one material law|is a section|missing from [whisker]|\
    missing from [gauge]|[whisker] with|[gauge] with|missing from [tuples]|number of samples is out of range|\
    no quantity of a whisker is this large|step must be larger than zero|this number is too large|\
    these bounds are out of range|pairs are needed|this is not a foil|a foil needs|a root needs a spring|\
    there is nothing to search over|says neither evaluations nor seconds|this text is empty|is missing (allowed|\
    at least two signals|stands here twice";

/// Messages that may concern one key or several: skipped. (A noise whose square underflows is too small; the schema accepts any above 0.)
const EITHER: &str = "this is not a range|no standard deviation is larger|one of the springs|0: none";

pub fn keep(text: &str, error: Option<&InputError>) {
    let said = error.map(ToString::to_string).unwrap_or_default();
    let has = |parts: &str| parts.split('|').any(|part| said.contains(part));
    if text.parse::<toml::Table>().is_err() || has(EITHER) {
        return;
    }
    let verdict = if has(STRUCTURAL) { "refused" } else { "accepted" };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("specs").join(verdict);
    let name = format!("{}.toml", hash_file(text.as_bytes()).expect("memory"));
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join(name), text));
    written.expect("a folder for specs");
}
