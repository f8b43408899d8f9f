//! Answers readings of a calibrated whisker: tap angle in degrees and strain, one line each.
//!
//!     vibrissa calibrate examples/prototype-d10.csv --whisker examples/prototype-d10.toml --out results/rig
//!     printf '4,0.0192\n7,0.0334\n' | cargo run --release --example locate -- results/rig/calibration.toml

use vibrissa::api::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: locate CALIBRATION.toml < readings")?;
    let locator = Locator::open(path)?;
    for line in std::io::stdin().lines() {
        let line = line?;
        let (theta, strain) = line.split_once(',').ok_or("a line is: tap angle, strain")?;
        let found = locator.locate(theta.trim().parse()?, strain.trim().parse()?);
        println!("{:.2} ± {:.2} mm, {}", found.distance, found.sigma, found.status);
    }
    Ok(())
}
