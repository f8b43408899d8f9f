//! Adapters in words.

use serde_json::{Value, json};

use crate::kernel::{cpu::Cpu, gpu::Adapter};

/// Why `auto` takes the CPU on a machine without a hardware adapter: its `software` ones, and what drivers did wrong.
pub(super) fn no_hardware<'a>(software: impl Iterator<Item = &'a str>, faults: &[String]) -> String {
    let software: Vec<&str> = software.collect();
    let mut why: Vec<String> = faults.to_vec();
    match software[..] {
        [] if faults.is_empty() => why.push("no Vulkan, Metal or DirectX 12 adapter".to_owned()),
        [] => {}
        _ => {
            let all = software.join(" or ");
            why.push(format!("no hardware adapter; --backend gpu takes the software adapter {all}"));
        }
    }
    why.join("; ")
}

/// What there is to compute on: `adapters`, and the CPU; what drivers did wrong, in words.
pub fn listed(adapters: &[Adapter], faults: &[String]) -> Value {
    let one = |a: &Adapter| {
        json!({
            "name": a.name, "driver": a.driver, "api": a.api, "software": a.software, "f64": a.f64,
            "max_binding_bytes": a.max_binding, "max_workgroups": a.max_workgroups, "features": a.features,
        })
    };
    let cpu = json!({ "threads": rayon::current_num_threads(), "instructions": Cpu::instructions() });
    json!({ "adapters": adapters.iter().map(one).collect::<Vec<_>>(), "faults": faults, "cpu": cpu })
}

/// Names of `adapters`.
pub(super) fn names(adapters: &[Adapter]) -> String {
    match adapters {
        [] => "nothing: this machine has no adapter".to_owned(),
        some => some.iter().map(|a| a.name.as_str()).collect::<Vec<_>>().join(", "),
    }
}
