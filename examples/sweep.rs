//! A sweep described in code: 40 tip diameters, 10 distances, 20 tap angles of a rubber whisker, the 5 rows of least K_sd.
//!
//!     cargo run --release --example sweep

use vibrissa::api::*;

fn main() -> Result<(), Error> {
    let setup = Setup::default().material(Material::NeoHookean(3.2)).surface().shear().extension();
    let whisker = Whisker::mm(10.0, Axis::steps(2.0, 8.0, 40)?, 50.0)
        .gauge_mm(5.0, 2.0)
        .distance_mm(Axis::steps(21.0, 48.0, 10)?)
        .theta_deg(Axis::steps(0.5, 10.0, 20)?);
    let study = whisker.study(setup, Output { top: Some(5), ..Output::default() })?;
    let swept = sweep("rubber", &study, &RunOptions::default(), "results/example-rubber".as_ref())?;
    for best in &swept.highlights {
        println!("d = {:.2} mm, {:.1}°: K_sd = {:.2e}", best.at.design.d, best.at.design.drive, best.rank);
    }
    println!("{} taps on {}", swept.counts.taps, swept.backend.name);
    Ok(())
}
