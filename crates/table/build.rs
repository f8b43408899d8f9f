//! Records the git commit of the build; a source tree without git builds too.

use std::process::Command;

fn main() {
    for path in
        ["../../.git/HEAD", "../../.git/logs/HEAD"].into_iter().filter(|p| std::path::Path::new(p).exists())
    {
        println!("cargo:rerun-if-changed={path}");
    }
    println!("cargo:rerun-if-changed=build.rs");
    let head = Command::new("git").args(["rev-parse", "HEAD"]).output();
    if let Some(commit) =
        head.ok().filter(|o| o.status.success()).and_then(|o| String::from_utf8(o.stdout).ok())
    {
        println!("cargo:rustc-env=VIBRISSA_COMMIT={}", commit.trim());
    }
}
