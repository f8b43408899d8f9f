//! Records the git commit of the build; a source tree without git builds too.

use std::process::Command;

fn main() {
    let watched = ["build.rs", "../../.git/HEAD", "../../.git/logs/HEAD"].into_iter();
    for path in watched.filter(|path| std::path::Path::new(path).exists()) {
        println!("cargo:rerun-if-changed={path}");
    }
    let head = Command::new("git").args(["rev-parse", "HEAD"]).output().ok().filter(|o| o.status.success());
    if let Some(commit) = head.and_then(|o| String::from_utf8(o.stdout).ok()) {
        println!("cargo:rustc-env=VIBRISSA_COMMIT={}", commit.trim());
    }
}
