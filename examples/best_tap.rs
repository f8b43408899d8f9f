//! The tap angle at which one whisker tells distance best, with a gauge that scatters by 20 µε.
//!
//!     cargo run --release --example best_tap

use vibrissa::api::*;

fn main() -> Result<(), Error> {
    let setup = Setup::default().noise(20e-6);
    let distances = Axis::step(21.0, 48.0, 3.0)?;
    let axes = [10.0.into(), 4.0.into(), 50.0.into(), 5.0.into(), 2.0.into(), distances, 4.0.into()];
    let space = Space::grid(axes).expect("few enough to count");
    let found =
        best_tap(&Study { setup, space, output: Output::default() }, [0.5, 10.0], Objective::Distance)?;
    println!("best at {:.2}°: {}", found.optimum.drive, found.why);
    Ok(())
}
