//! Measures `vibrissa locate` on a stream: time to the first answer, latency of single lines, readings per second.
//!
//!     cargo bench --bench stream_latency -- target/release/vibrissa results/prototype-d10/calibration.toml

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// Number of single questions, and of readings in the long stream.
const QUESTIONS: usize = 20_000;
const READINGS: usize = 1_000_000;

fn start(program: &str, calibration: &str) -> std::io::Result<(Child, ChildStdin, ChildStdout)> {
    let mut command = Command::new(program);
    command.args(["locate", calibration]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn()?;
    let (input, output) = (child.stdin.take(), child.stdout.take());
    Ok((child, input.expect("a pipe"), output.expect("a pipe")))
}

/// Alternating tap angles, so that answers cannot be cached.
fn line(i: usize) -> String {
    let theta = [1.0, 2.5, 4.0, 7.3][i % 4];
    format!("{theta},{}\n", theta * (0.0048 + 1e-6 * (i % 997) as f64))
}

fn quantile(sorted: &[Duration], share: f64) -> f64 {
    1e6 * sorted[((sorted.len() - 1) as f64 * share) as usize].as_secs_f64()
}

fn main() -> std::io::Result<()> {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().filter(|argument| argument != "--bench").collect();
    let [_, program, calibration] = arguments.as_slice() else {
        eprintln!("usage: stream_latency PROGRAM CALIBRATION");
        return Ok(());
    };
    let mut text = String::new();
    let mut firsts = Vec::new();
    for _ in 0..20 {
        let begin = Instant::now();
        let (mut child, mut input, output) = start(program, calibration)?;
        input.write_all(line(0).as_bytes())?;
        let mut output = BufReader::new(output);
        output.read_line(&mut text)?;
        output.read_line(&mut text)?;
        firsts.push(begin.elapsed());
        drop(input);
        child.wait()?;
    }
    firsts.sort();
    let [median, worst] = [0.5, 1.0].map(|share| quantile(&firsts, share) / 1e3);
    println!("first answer after start: median {median:.1} ms, worst {worst:.1} ms");

    let (mut child, mut input, output) = start(program, calibration)?;
    let mut output = BufReader::new(output);
    output.read_line(&mut text)?;
    let mut each = Vec::with_capacity(QUESTIONS);
    for i in 0..QUESTIONS {
        let question = line(i);
        let begin = Instant::now();
        input.write_all(question.as_bytes())?;
        text.clear();
        output.read_line(&mut text)?;
        each.push(begin.elapsed());
    }
    drop(input);
    child.wait()?;
    each.sort();
    let [median, late] = [0.5, 0.99].map(|share| quantile(&each, share));
    println!("one line, there and back: median {median:.1} µs, p99 {late:.1} µs");

    let all: String = (0..READINGS).map(line).collect();
    let (mut child, mut input, mut output) = start(program, calibration)?;
    let begin = Instant::now();
    let feed = std::thread::spawn(move || input.write_all(all.as_bytes()));
    let mut bytes = Vec::new();
    output.read_to_end(&mut bytes)?;
    let seconds = begin.elapsed().as_secs_f64();
    let _ = feed.join();
    child.wait()?;
    let answers = bytes.iter().filter(|b| **b == b'\n').count() - 1;
    println!("{answers} readings in {seconds:.2} s: {:.0} readings/s on one core", answers as f64 / seconds);
    Ok(())
}
