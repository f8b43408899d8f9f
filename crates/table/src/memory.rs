//! Memory that is available for tables.

use std::fs::read_to_string;

/// Bytes that the process can still allocate: the lesser of `MemAvailable` (Linux) and `memory.max` less `anon` (cgroup v2). `None` if unknown.
pub fn available() -> Option<u64> {
    let system = read_to_string("/proc/meminfo").ok().and_then(|text| field(&text, "MemAvailable:"));
    let of_container = |name: &str| read_to_string(format!("/sys/fs/cgroup/{name}")).ok();
    let most = of_container("memory.max").and_then(|text| text.trim().parse::<u64>().ok());
    let taken = of_container("memory.stat").and_then(|text| field(&text, "anon "));
    let container = most.map(|most| most.saturating_sub(taken.unwrap_or(0)));
    system.map(|kilobytes| kilobytes.saturating_mul(1024)).into_iter().chain(container).min()
}

fn field(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}
