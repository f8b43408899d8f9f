//! Verdicts of self-checks, kept in the user's cache directory: a kernel that has passed on an adapter with this driver and this version of
//! the program is not checked again. A cache that cannot be read or written is no error; the check then takes its milliseconds.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::kernel::gpu::{Adapter, Passed, Verdicts};

/// Environment variable that says how devices are checked: `off`, `fresh` (whatever the cache says), or nothing.
pub const VARIABLE: &str = "VIBRISSA_SELF_CHECK";

/// Largest file that is read, bytes, and most kernels that are kept of an adapter.
const MOST: (u64, usize) = (1 << 20, 512);

/// What is kept of one adapter.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Kept {
    /// Adapter, interface, driver, version and commit of the program.
    of: Vec<String>,
    /// By the BLAKE3 of the kernel's text: taps compared, and the largest error relative to the tolerance.
    passed: BTreeMap<String, (usize, f64)>,
}

/// Verdicts of one adapter.
#[derive(Debug)]
pub struct Cache {
    wanted: bool,
    /// Where they lie; nowhere without a cache directory.
    path: Option<PathBuf>,
    kept: Mutex<Kept>,
}

/// The user's cache directory.
fn directory() -> Option<PathBuf> {
    let of = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let home = of("HOME");
    of("XDG_CACHE_HOME").or_else(|| of("LOCALAPPDATA").filter(|_| cfg!(windows))).or_else(|| {
        home.map(|home| home.join(if cfg!(target_os = "macos") { "Library/Caches" } else { ".cache" }))
    })
}

/// What the file says, if it is whole and of this adapter.
fn read(path: &Path, of: &[String]) -> Option<Kept> {
    let mut text = String::new();
    if !fs::metadata(path).ok()?.is_file() {
        return None;
    }
    fs::File::open(path).ok()?.take(MOST.0).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok().filter(|kept: &Kept| kept.of == of)
}

impl Cache {
    /// Verdicts of `adapter`, as the environment asks for them.
    pub fn of(adapter: &Adapter) -> Self {
        let asked = std::env::var(VARIABLE).unwrap_or_default();
        Self::at(directory().map(|cache| cache.join("vibrissa").join("devices")), adapter, &asked)
    }

    /// Verdicts of `adapter` in `folder`, if anywhere; `asked` is what [`VARIABLE`] says.
    pub fn at(folder: Option<PathBuf>, adapter: &Adapter, asked: &str) -> Self {
        let commit = crate::sink::COMMIT.unwrap_or_default();
        let of = [&adapter.name, &adapter.api, &adapter.driver, env!("CARGO_PKG_VERSION"), commit];
        let of: Vec<String> = of.iter().map(|s| (*s).to_owned()).collect();
        let name = blake3::hash(of.join("\n").as_bytes()).to_hex();
        let path = folder.map(|folder| folder.join(format!("{}.json", &name[..32])));
        let found = path.as_ref().filter(|_| asked != "fresh").and_then(|path| read(path, &of));
        let kept = found.unwrap_or(Kept { of, passed: BTreeMap::new() });
        Self { wanted: asked != "off", path, kept: Mutex::new(kept) }
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes what is known, and what others have written in the meantime.
    fn write(&self, path: &Path, kept: &mut Kept) -> std::io::Result<()> {
        let folder = path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        if let Some(others) = read(path, &kept.of) {
            others.passed.into_iter().for_each(|(text, figures)| {
                kept.passed.entry(text).or_insert(figures);
            });
        }
        while kept.passed.len() > MOST.1 {
            kept.passed.pop_first();
        }
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        file.write_all(&serde_json::to_vec_pretty(kept)?)?;
        file.persist(path)?;
        Ok(())
    }
}

fn name(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

impl Verdicts for Cache {
    fn wanted(&self) -> bool {
        self.wanted
    }

    fn known(&self, text: &str) -> bool {
        self.kept().passed.contains_key(&name(text))
    }

    fn keep(&self, text: &str, passed: &Passed) {
        let mut kept = self.kept();
        kept.passed.insert(name(text), (passed.taps, passed.worst));
        if let Some(path) = &self.path {
            // Without a cache the next run checks again.
            let _ = self.write(path, &mut kept);
        }
    }
}
