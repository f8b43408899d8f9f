//! The job scripts, run by bash as Slurm runs them, with stand-ins for Slurm's commands. `tests/slurm` uses a real Slurm.
#![cfg(target_os = "linux")]

use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output, Stdio};

use libc::{SIGKILL, SIGTERM, SIGUSR1};

use crate::common::program::{Desk, SPEC};
use crate::common::world::{Running, hearing, program, send, until, words};

/// Stand-ins that record their calls.
const SCONTROL: &str = "#!/bin/sh\necho \"$*\" >>\"$CALLS\"\n";
const SBATCH: &str = "#!/bin/sh\nprintf '%s: %s\\n' \"$PWD\" \"$*\" >>\"$CALLS\"\necho 17\n";

fn bash(desk: &Desk) -> Command {
    for (command, text) in [("bin/scontrol", SCONTROL), ("bin/sbatch", SBATCH)] {
        desk.write(command, text);
        std::fs::set_permissions(desk.path(command), PermissionsExt::from_mode(0o755)).unwrap();
    }
    let path = format!("{}:{}", desk.path("bin").display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("bash");
    command.current_dir(desk.path("bin")).env("PATH", path).env("CALLS", desk.path("calls"));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    hearing(&mut command);
    command
}

fn job(desk: &Desk, at: &str, name: &str, task: u32) -> Command {
    let mut command = bash(desk);
    command.arg(desk.path(at).join(name));
    command.env("SLURM_ARRAY_JOB_ID", "17").env("SLURM_ARRAY_TASK_ID", task.to_string());
    command
}

fn calls(desk: &Desk) -> String {
    std::fs::read_to_string(desk.path("calls")).unwrap_or_default()
}

#[track_caller]
fn succeeds(ran: &Output) {
    assert!(ran.status.success(), "{}{}", words(&ran.stdout), words(&ran.stderr));
}

#[test]
fn a_merge_that_is_not_sent_is_told_with_the_parts_that_were() {
    let desk = Desk::new(SPEC);
    desk.ok("cluster slurm spec.toml --shards 2 --out jobs");
    let mut submit = job(&desk, "jobs", "submit.sh", 1);
    let once = SBATCH.replace("printf", "case $* in *merge.sbatch) exit 1 ;; esac\nprintf");
    desk.write("bin/sbatch", once);
    let ran = submit.output().unwrap();
    let said = words(&ran.stderr);
    assert_eq!(ran.status.code(), Some(1), "{said}");
    for part in ["the parts were sent (job 17)", "sbatch --dependency=afterok:17 merge.sbatch", "scancel 17"]
    {
        assert!(said.contains(part), "{part}: {said}");
    }
}

/// Odd and malicious path names: none is expanded or run.
#[test]
fn job_scripts_name_odd_paths_as_they_are() {
    let text = format!("{SPEC}[run]\nbackend = \"cpu\"\n");
    for (folder, spec) in [
        ("p @SPEC@ q", "a;touch PWNED;b.toml"),
        ("50 % of $HOME's \"best\"", "$(touch PWNED).toml"),
        ("@OUT@@PROGRAM@", "@OPTIONS@ & touch PWNED &.toml"),
        ("a\n#SBATCH --output=PWNED\ntouch PWNED\n", "line\nbreak.toml"),
        ("back\\slash\\", "`touch PWNED`'%a.toml"),
        ("-n *", "~ # {a,b}.toml"),
    ] {
        let desk = Desk::new(SPEC);
        desk.write(&format!("{folder}/{spec}"), &text);
        let arguments = ["cluster", "slurm", &format!("./{spec}"), "--shards", "2", "--at-a-time", "1"];
        let there = desk.path(folder);
        let ran = program(&desk, &arguments).current_dir(&there).output().unwrap();
        succeeds(&ran);
        let name = spec.trim_end_matches(".toml");
        let scripts = format!("{folder}/results/{name}-cluster");
        for script in ["part.sbatch", "merge.sbatch", "submit.sh"] {
            let text = desk.read(&format!("{scripts}/{script}"));
            for line in text.lines().take_while(|line| line.starts_with('#')) {
                assert!(
                    !line.contains(" PWNED") && !line.contains("=PWNED") && !line.contains("@S"),
                    "{line}"
                );
            }
        }
        for task in [1, 2] {
            succeeds(&job(&desk, &scripts, "part.sbatch", task).output().unwrap());
        }
        succeeds(&job(&desk, &scripts, "merge.sbatch", 0).output().unwrap());
        desk.whole(&format!("{folder}/results/{name}"));
        succeeds(&job(&desk, &scripts, "submit.sh", 0).output().unwrap());
        let (sent, from) = (calls(&desk), desk.path(&scripts).canonicalize().unwrap());
        assert!(sent.contains(&format!("{}: --parsable part.sbatch\n", from.display())), "{sent}");
        assert!(sent.contains("--dependency=afterok:17 merge.sbatch"), "{sent}");
        // The command to type is printed quoted for a shell.
        let told = words(&ran.stdout);
        let typed = &told[told.find("then: ").expect("what to do") + 6..];
        succeeds(&bash(&desk).current_dir(&there).args(["-c", typed]).output().unwrap());
        let all = Command::new("find").arg(desk.path(".")).args(["-name", "PWNED"]).output().unwrap();
        assert_eq!(words(&all.stdout), "", "{folder}");
    }
}

/// A sweep that does not end by itself; its parts keep their state at once.
fn long() -> Desk {
    let large = SPEC.replace("d = [4, 7]", "d = { from = 4, to = 7, steps = 40_000_000_000 }");
    let desk = Desk::new(&format!(
        "{large}[output]\ntuples = false\ndistances = false\n[run]\nprecision = \"f64\"\n"
    ));
    let arguments = ["cluster", "slurm", "spec.toml", "--shards", "2", "--backend", "cpu", "--out", "jobs"];
    desk.run(&arguments).exits(0);
    let part = desk.read("jobs/part.sbatch");
    assert!(part.contains("--keep-every 30") && part.contains("\n#SBATCH --signal=B:USR1@120\n"));
    desk.write("jobs/part.sbatch", part.replace("--keep-every 30", "--keep-every 0"));
    desk
}

/// Starts part 1, with this count of earlier restarts, and waits until it has kept its state.
fn under_way(desk: &Desk, restarts: &str) -> Running {
    let _ = std::fs::remove_file(desk.path("calls"));
    let mut command = job(desk, "jobs", "part.sbatch", 1);
    let kept = desk.path("results/spec/shard-1-of-2/.vibrissa-unfinished/.state");
    let state = || std::fs::read(&kept).ok();
    let before = state();
    let script = Running::new(command.env("SLURM_RESTART_COUNT", restarts));
    until(|| sweep_of(&script).is_some() && state().is_some() && state() != before, "nothing is complete");
    script
}

fn sweep_of(script: &Running) -> Option<i32> {
    let id = script.id();
    let children = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children")).ok()?;
    children.split_whitespace().next()?.parse().ok()
}

fn kill(process: i32, signal: i32) {
    // SAFETY: only sends a signal, to a child of a child that was not yet waited for.
    assert_eq!(unsafe { libc::kill(process, signal) }, 0);
}

/// `scancel` sends SIGTERM to script and sweep, in either order.
#[test]
fn scancel_ends_a_part_for_good() {
    let desk = long();
    for order in
        [&["script"][..], &["script", "sweep"], &["sweep", "script"], &["sweep", "its end", "script"]]
    {
        let script = under_way(&desk, "0");
        let sweep = sweep_of(&script).unwrap();
        for whom in order {
            match *whom {
                "script" => send(&script, SIGTERM),
                "sweep" => kill(sweep, SIGTERM),
                // After the sweep's end, the script still waits a moment for its own signal.
                _ => until(|| sweep_of(&script) != Some(sweep), "the sweep goes on"),
            }
        }
        let left = script.wait_with_output().unwrap();
        assert_eq!(left.status.code(), Some(143), "{order:?}: {}", words(&left.stderr));
        assert!(!calls(&desk).contains("requeue"), "{order:?}: {}", calls(&desk));
        assert!(desk.path("results/spec/shard-1-of-2/.vibrissa-unfinished/.state").exists());
    }
}

#[test]
fn a_part_whose_time_is_over_or_that_dies_is_sent_again() {
    let desk = long();
    // At most 20 times.
    for (restarts, signal, again) in
        [("0", SIGUSR1, 1), ("19", SIGKILL, 1), ("20", SIGKILL, 0), ("20", SIGUSR1, 0)]
    {
        let script = under_way(&desk, restarts);
        match signal {
            SIGKILL => kill(sweep_of(&script).unwrap(), signal),
            _ => send(&script, signal),
        }
        let left = script.wait_with_output().unwrap();
        assert_ne!(left.status.code(), Some(0), "{}", words(&left.stderr));
        assert_eq!(calls(&desk).matches("requeue 17_1").count(), again, "{signal}: {}", calls(&desk));
    }
    let _ = std::fs::remove_file(desk.path("calls"));
    desk.write("spec.toml", "nonsense");
    let left = job(&desk, "jobs", "part.sbatch", 1).output().unwrap();
    assert_eq!((left.status.code(), calls(&desk).as_str()), (Some(2), ""));
}
