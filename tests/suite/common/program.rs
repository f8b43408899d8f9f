//! The program itself, in a folder of its own.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

/// A small spec: two designs, three distances, two angles.
pub const SPEC: &str = "[whisker]\nD = 10\nd = [4, 7]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                        [tap]\na = [21, 33, 48]\ntheta = [1, 4]\n";

/// So many taps that `auto` looks for a device; to be planned, not run.
pub fn large() -> String {
    let designs = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 1_000_000_000_000 }");
    designs + "[output]\ntop = 10\nby = \"strain_max\"\n"
}

/// A folder with a spec, in which the program is run.
pub struct Desk {
    folder: TempDir,
}

/// What a run left.
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    fn of(output: std::process::Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        let code = output.status.code().expect("an exit code");
        Self { code, stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// The one object on stdout.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in stdout: {}", self.stdout))
    }

    /// Fails unless the exit code is `code`.
    #[track_caller]
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, code, "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }
}

impl Desk {
    /// With `text` in `spec.toml`.
    pub fn new(text: &str) -> Self {
        let desk = Self { folder: tempfile::tempdir().expect("a folder") };
        desk.write("spec.toml", text);
        desk
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Names of everything in `folder`, hidden or not, sorted.
    pub fn names(&self, folder: &str) -> Vec<String> {
        names(&self.path(folder))
    }

    /// Fails unless `folder` holds a result whose files are all there, as its run.json lists them; the run.json.
    #[track_caller]
    pub fn whole(&self, folder: &str) -> Value {
        let run: Value = serde_json::from_str(&self.read(&format!("{folder}/run.json"))).expect("JSON");
        let files = run["files"].as_array().unwrap_or_else(|| panic!("no list in {run}"));
        assert!(!files.is_empty(), "{run}");
        for file in files {
            let name = file["name"].as_str().expect("a name");
            let bytes = std::fs::read(self.path(folder).join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
            let found = vibrissa::sink::folder::hash_file(bytes.as_slice()).expect("memory");
            assert_eq!((&file["blake3"], &file["bytes"]), (&found.into(), &bytes.len().into()), "{name}");
        }
        run
    }

    /// Runs the program here with `arguments` and environment variables.
    pub fn run_with(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Ran {
        let mut command = Command::cargo_bin("vibrissa").expect("the program is built");
        command.current_dir(self.folder.path()).args(arguments).envs(variables.iter().copied());
        let output = command.output().expect("the program starts");
        Ran::of(output)
    }

    /// Runs the program here with `input` on stdin.
    pub fn pipe(&self, arguments: &[&str], input: &str) -> Ran {
        let mut command = Command::cargo_bin("vibrissa").expect("the program is built");
        command.current_dir(self.folder.path()).args(arguments).write_stdin(input);
        let output = command.output().expect("the program starts");
        Ran::of(output)
    }

    /// Runs the program here.
    pub fn run(&self, arguments: &[&str]) -> Ran {
        self.run_with(arguments, &[])
    }

    /// Sweeps `spec.toml` on the CPU with more `arguments`.
    pub fn sweep(&self, arguments: &[&str]) -> Ran {
        self.run(&[&["sweep", "spec.toml", "--backend", "cpu"], arguments].concat())
    }
}

/// Names of everything in `folder`, hidden or not, sorted; empty if it is not there.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
