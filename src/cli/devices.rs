//! `vibrissa devices`.

use std::fmt::Write;

use serde_json::json;
use vibrissa::backend::{self, Choice, listed};
use vibrissa::error::Error;
use vibrissa::kernel::cpu::Cpu;
use vibrissa::scene::{BackendChoice, RunOptions};

use super::args::Common;
use super::reply::Reply;

/// Lists adapters, faults of drivers, and the choice of `auto` or of another `--backend`.
pub fn run(common: &Common) -> Result<Reply, Error> {
    let (adapters, faults) = backend::look();
    let options = common.over(&RunOptions::default());
    let choice = Choice::new(&options)?;
    let mut text = String::new();
    for a in &adapters {
        let kind = if a.software { "software" } else { "hardware" };
        let _ = writeln!(text, "{}  ({kind}, {})", a.name, a.api);
        let _ = writeln!(text, "    driver        {}", a.driver);
        let (size, groups) = (a.max_binding >> 20, a.max_workgroups);
        let _ = writeln!(text, "    largest binding {size} MiB, {groups} workgroups a dimension");
        let _ = writeln!(text, "    features      {}", a.features.join(", "));
    }
    text.extend(faults.iter().map(|why| format!("{why}\n")));
    if adapters.is_empty() && faults.is_empty() {
        text += "no Vulkan, Metal or DirectX 12 adapter (Debian: apt install mesa-vulkan-drivers)\n";
    }
    let (threads, instructions) = (rayon::current_num_threads(), Cpu::instructions());
    let _ = writeln!(text, "CPU kernels  ({threads} threads, {instructions})");
    let b = &choice.backend;
    let name = b.adapter.as_deref().unwrap_or(match b.name {
        "reference" => "the reference",
        _ => "CPU kernels",
    });
    let asked = options.backend.unwrap_or(BackendChoice::Auto);
    let word =
        BackendChoice::WORDS.iter().find(|(_, choice, _)| *choice == asked).map_or("auto", |(word, ..)| word);
    let _ = writeln!(text, "--backend {word} takes: {name} ({})", b.reason);

    Ok(Reply {
        text,
        counts: json!({ "adapters": adapters.len() }),
        backend: json!(b),
        result: listed(&adapters, &faults),
        ..Reply::default()
    })
}
