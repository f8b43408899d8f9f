//! The program itself, in a folder of its own.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

use super::sweeping::Table;

/// A small spec: two designs, three distances, two angles.
pub const SPEC: &str = "[whisker]\nD = 10\nd = [4, 7]\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 1e-6\n\
                        [tap]\na = [21, 33, 48]\ntheta = [1, 4]\n";

/// So many taps that `auto` looks for a device; to be planned, not run.
pub fn large() -> String {
    let designs = SPEC.replace("D = 10", "D = { from = 8, to = 12, steps = 1_000_000_000_000 }");
    designs + "[output]\ntop = 10\nby = \"strain_max\"\n"
}

/// Fails unless `text` holds all of `parts`.
#[track_caller]
pub fn says(text: &str, parts: &[&str]) {
    let in_one_line = text.replace("\n  │ ", " ");
    for part in parts {
        assert!(text.contains(part) || in_one_line.contains(part), "no `{part}` in {text}");
    }
}

/// A folder with a spec, in which the program is run.
pub struct Desk {
    folder: TempDir,
}

/// Every file of a desk that several tests begin with, made once.
pub struct Kept(Vec<(String, Vec<u8>)>);

impl Kept {
    /// A desk with these files.
    pub fn desk(&self) -> Desk {
        let desk = Desk { folder: tempfile::tempdir().expect("a folder") };
        self.0.iter().for_each(|(name, bytes)| desk.write(name, bytes));
        desk
    }
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

    /// The files of this desk, for other desks.
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

    /// The table `name`; empty if it is not there.
    pub fn table(&self, name: impl AsRef<Path>) -> Table {
        Table::read(&self.folder.path().join(name))
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
    pub fn pipe(&self, arguments: &[&str], input: &(impl AsRef<[u8]> + ?Sized)) -> Ran {
        let mut command = Command::cargo_bin("vibrissa").expect("the program is built");
        command.current_dir(self.folder.path()).args(arguments).write_stdin(input.as_ref());
        let output = command.output().expect("the program starts");
        Ran::of(output)
    }

    /// What the program with the words of `line` answers to the lines of `input`.
    #[track_caller]
    pub fn stream(&self, line: &str, input: &str) -> Table {
        Table::parse(self.pipe(&line.split_whitespace().collect::<Vec<_>>(), input).exits(0).stdout)
    }

    /// Runs the program here.
    pub fn run(&self, arguments: &[&str]) -> Ran {
        self.run_with(arguments, &[])
    }

    /// Runs the program here with the words of `line`.
    pub fn line(&self, line: impl AsRef<str>) -> Ran {
        self.run(&line.as_ref().split_whitespace().collect::<Vec<_>>())
    }

    /// Runs the program here with the words of `line`, which succeeds.
    #[track_caller]
    pub fn ok(&self, line: impl AsRef<str>) -> Ran {
        self.line(line).exits(0)
    }

    /// The object that the program with the words of `line` answers.
    #[track_caller]
    pub fn json(&self, line: impl AsRef<str>) -> Value {
        self.ok(format!("{} --json", line.as_ref())).json()
    }

    /// The error that the program with the words of `line` is refused for.
    #[track_caller]
    pub fn error(&self, line: impl AsRef<str>) -> Value {
        self.line(format!("{} --json", line.as_ref())).exits(2).json()["error"].clone()
    }

    /// Runs the program here with the words of `line`, which it refuses with all of `said`.
    #[track_caller]
    pub fn refuses(&self, line: impl AsRef<str>, said: &[&str]) {
        says(&self.line(line).exits(2).stderr, said);
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
