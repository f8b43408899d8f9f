//! The best tap angle of one whisker, with a gauge noise of 20 µε.
//!
//!     cargo run --release --example best_tap

use vibrissa::api::*;

fn main() -> Result<(), Error> {
    let whisker = Whisker::mm(10.0, 4.0, 50.0).gauge_mm(5.0, 2.0).distance_mm(Axis::step(21.0, 48.0, 3.0)?);
    let study = whisker.study(Setup::default().noise(20e-6), Output::default())?;
    let found = best_tap(&study, [0.5, 10.0], Objective::Distance)?;
    println!("best at {:.2}°: {}", found.optimum.drive, found.why);
    Ok(())
}
