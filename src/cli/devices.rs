//! `vibrissa devices`.

use std::fmt::Write;

use serde_json::{Value, json};
use vibrissa::backend::{Choice, listed};
use vibrissa::error::Error;
use vibrissa::kernel::{cpu::Cpu, gpu};
use vibrissa::scene::{RunOptions, Setup};

use super::args::Common;
use super::reply::Reply;

/// Lists what there is and what `auto` takes.
pub fn run(common: &Common) -> Result<Reply, Error> {
    let adapters = gpu::adapters();
    let options = RunOptions { backend: None, ..common.over(&RunOptions::default()) };
    let choice = Choice::for_taps(&options, &Setup::default())?;
    let mut text = String::new();
    for a in &adapters {
        let kind = if a.software { "software" } else { "hardware" };
        let _ = writeln!(text, "{}  ({kind}, {})", a.name, a.api);
        let _ = writeln!(text, "    driver        {}", a.driver);
        let _ = writeln!(
            text,
            "    largest binding {} MiB, {} workgroups a dimension",
            a.max_binding >> 20,
            a.max_workgroups
        );
        let _ = writeln!(text, "    features      {}", a.features.join(", "));
    }
    if adapters.is_empty() {
        let _ = writeln!(
            text,
            "no Vulkan, Metal or DirectX 12 adapter (Debian: apt install mesa-vulkan-drivers)"
        );
    }
    let _ =
        writeln!(text, "CPU kernels  ({} threads, {})", rayon::current_num_threads(), Cpu::instructions());
    let b = &choice.backend;
    let name = b.adapter.as_deref().unwrap_or("CPU kernels");
    let _ = writeln!(text, "--backend auto takes: {name} ({})", b.reason);

    let device = b.device.get();
    if device.self_checked_kernels > 0 {
        let when = if device.self_checked_before > 0 { "in an earlier run" } else { "now" };
        let _ = writeln!(text, "self-check passed {when} (docs/devices.md)");
    }

    Ok(Reply {
        text,
        out: None,
        files: Vec::new(),
        counts: json!({ "adapters": adapters.len() }),
        seconds: Value::Null,
        backend: json!(b),
        result: listed(&adapters),
        ..Reply::default()
    })
}
