//! Runs the program in a temporary folder.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

use super::sweeping::Table;

pub const SPEC: &str = "[whisker]\nD = 10\nd = [4, 7]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                        [tap]\na = [21, 33, 48]\ntheta = [1, 4]\n";

/// So many taps that `auto` looks for a device; only for plans.
pub fn large() -> String {
    let designs = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 1_000_000_000_000 }");
    designs + "[output]\ntop = 10\nby = \"strain_max\"\n"
}

#[track_caller]
pub fn says(text: &str, parts: &[&str]) {
    let in_one_line = text.replace("\n  │ ", " ");
    for part in parts {
        assert!(text.contains(part) || in_one_line.contains(part), "no `{part}` in {text}");
    }
}

pub struct Desk {
    folder: TempDir,
}

/// The files of a desk from which several tests start; made once.
pub struct Kept(Vec<(String, Vec<u8>)>);

impl Kept {
    pub fn desk(&self) -> Desk {
        let desk = Desk { folder: tempfile::tempdir().expect("a folder") };
        self.0.iter().for_each(|(name, bytes)| desk.write(name, bytes));
        desk
    }
}

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

    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in stdout: {}", self.stdout))
    }

    #[track_caller]
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, code, "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }
}

impl Desk {
    /// A folder with `text` as `spec.toml`.
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

    pub fn keep(self) -> Kept {
        let (mut folders, mut files) = (vec![String::new()], Vec::new());
        while let Some(folder) = folders.pop() {
            for name in self.names(&folder) {
                let (name, path) = (format!("{folder}{name}"), self.path(&folder).join(&name));
                if path.is_dir() {
                    folders.push(name + "/");
                } else {
                    files.push((name, std::fs::read(path).expect("a file")));
                }
            }
        }
        Kept(files)
    }

    /// An empty table if the file is missing.
    pub fn table(&self, name: impl AsRef<Path>) -> Table {
        Table::read(&self.folder.path().join(name))
    }

    pub fn names(&self, folder: &str) -> Vec<String> {
        names(&self.path(folder))
    }

    /// Fails unless `folder` holds all files that its run.json lists; returns the run.json.
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

    pub fn run_with(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Ran {
        let mut command = Command::cargo_bin("vibrissa").expect("the program is built");
        command.current_dir(self.folder.path()).args(arguments).envs(variables.iter().copied());
        let output = command.output().expect("the program starts");
        Ran::of(output)
    }

    pub fn pipe(&self, arguments: &[&str], input: &(impl AsRef<[u8]> + ?Sized)) -> Ran {
        let mut command = Command::cargo_bin("vibrissa").expect("the program is built");
        command.current_dir(self.folder.path()).args(arguments).write_stdin(input.as_ref());
        let output = command.output().expect("the program starts");
        Ran::of(output)
    }

    /// The table that the program writes to stdout for `input`.
    #[track_caller]
    pub fn stream(&self, line: &str, input: &str) -> Table {
        Table::parse(self.pipe(&line.split_whitespace().collect::<Vec<_>>(), input).exits(0).stdout)
    }

    pub fn run(&self, arguments: &[&str]) -> Ran {
        self.run_with(arguments, &[])
    }

    pub fn line(&self, line: impl AsRef<str>) -> Ran {
        self.run(&line.as_ref().split_whitespace().collect::<Vec<_>>())
    }

    #[track_caller]
    pub fn ok(&self, line: impl AsRef<str>) -> Ran {
        self.line(line).exits(0)
    }

    #[track_caller]
    pub fn json(&self, line: impl AsRef<str>) -> Value {
        self.ok(format!("{} --json", line.as_ref())).json()
    }

    /// Runs the words of `line` with --json; returns the error object of the refusal.
    #[track_caller]
    pub fn error(&self, line: impl AsRef<str>) -> Value {
        self.line(format!("{} --json", line.as_ref())).exits(2).json()["error"].clone()
    }

    #[track_caller]
    pub fn refuses(&self, line: impl AsRef<str>, said: &[&str]) {
        says(&self.line(line).exits(2).stderr, said);
    }

    pub fn sweep(&self, arguments: &[&str]) -> Ran {
        self.run(&[&["sweep", "spec.toml", "--backend", "cpu"], arguments].concat())
    }
}

pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
