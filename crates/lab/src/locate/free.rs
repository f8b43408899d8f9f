//! Quantities that a stroke leaves free: its zero, and friction and tilt of the object.

use super::{Locator, Opened};
use crate::error::{Error, InputError};
use crate::scene::{BackendChoice, Contact, RunOptions, Setup, Side, TERMS, Tuple};
use crate::taps::Taps;
use vibrissa_learned::joint::Nuisance;

/// Values of ln a and of the drive at which the change of a signal is computed.
const GRID: [usize; 2] = [9, 9];

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Free {
    pub zero: bool,
    /// Standard deviation of the coefficient of friction, about that of the whisker's spec.
    pub friction: f64,
    /// Standard deviation of the tilt of the object's edge, degrees.
    pub tilt: f64,
}

impl std::str::FromStr for Free {
    type Err = String;

    /// Of words as `zero,friction=0.1,tilt=5`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut free = Self::default();
        let words = || text.split(',').map(|w| w.split('=').next().unwrap_or_default().trim());
        if let Some(twice) = words().enumerate().find(|(k, w)| words().take(*k).any(|other| other == *w)) {
            return Err(format!("`{}` stands there twice", twice.1));
        }
        for word in text.split(',').map(str::trim) {
            let number = |value: &str, most: f64| match value.trim().parse::<f64>() {
                Ok(x) if x > 0.0 && x <= most => Ok(x),
                _ => Err(format!("`{word}`: a standard deviation > 0 and ≤ {most} is wanted")),
            };
            match word.split_once('=').map(|(key, value)| (key.trim(), value)) {
                None if word == "zero" => free.zero = true,
                Some(("friction", value)) => free.friction = number(value, 1.0)?,
                Some(("tilt", value)) => free.tilt = number(value, 30.0)?,
                _ => {
                    return Err(format!(
                        "`{word}` cannot be free: zero, friction=SD and tilt=SD (degrees) can"
                    ));
                }
            }
        }
        if free == Self::default() { Err("nothing is free".to_owned()) } else { Ok(free) }
    }
}

impl Free {
    /// Changes of the signals of a `side` by friction and tilt.
    pub(crate) fn nuisances(self, locator: &Locator, side: &Opened) -> Result<Vec<Nuisance>, Error> {
        let mut all = Vec::new();
        let setup = &locator.rig.setup;
        let refused = |key: &str, why: &str, allowed: &str| {
            Err(InputError::new(why).key("--free").value(key).allowed(allowed).into())
        };
        if self.friction == 0.0 && self.tilt == 0.0 {
            return Ok(all);
        }
        if !locator.rig.known {
            let why = "what they change is computed from the whisker, which this calibration does not know";
            return refused("friction, tilt", why, "zero, or a calibration with --whisker");
        }
        if self.friction > 0.0 {
            let mut on = TERMS.iter().filter(|term| (term.get)(&setup.model).is_on());
            let (mu, sticks) = match setup.model.contact {
                Contact::Coulomb(mu) => (mu, None),
                Contact::Frictionless => (0.0, None),
                Contact::Stick => (0.0, Some("the contact of the whisker's spec sticks")),
            };
            if let Some(why) = on.find_map(|term| term.frictionless).or(sticks) {
                return refused("friction", why, "zero, tilt=SD");
            }
            let by = |mu: f64| {
                let mut setup = setup.clone();
                (setup.model.contact, setup.model.extension) = (Contact::Coulomb(mu), true);
                signals(locator, side, setup, 0.0)
            };
            let [less, own, more] = [by((mu - self.friction).max(0.0))?, by(mu)?, by(mu + self.friction)?];
            let change = |k: usize| {
                let [less, more] = [less[k], more[k]].map(|x| x / own[k] - 1.0);
                [0.5 * (more + less), 0.5 * (more - less)]
            };
            all.push(nuisance(side, (0..own.len()).map(change).collect()));
        }
        if self.tilt > 0.0 {
            if let Some(why) = setup.forbids([true, false]) {
                return refused("tilt", why, "zero, friction=SD");
            }
            let by = |tilt: f64| signals(locator, side, setup.clone(), tilt);
            let [own, tilted] = [by(0.0)?, by(self.tilt)?];
            // The signal changes with the square of the tilt, whose mean is its value at one standard deviation.
            let change = |k: usize| {
                let change = tilted[k] / own[k] - 1.0;
                [change, std::f64::consts::SQRT_2 * change]
            };
            all.push(nuisance(side, (0..own.len()).map(change).collect()));
        }
        Ok(all)
    }
}

/// Ends of ln a and of the drive.
fn ends(side: &Opened) -> [[f64; 2]; 2] {
    let [first, last] = side.distances;
    [[first.ln(), last.ln()], side.ends()]
}

/// On [`GRID`]: what is not known beside a value that is, and 0 where nothing is.
fn nuisance(side: &Opened, mut changes: Vec<[f64; 2]>) -> Nuisance {
    for row in changes.chunks_mut(GRID[1]) {
        let mut last = [0.0; 2];
        for change in row {
            if change.iter().all(|x| x.is_finite()) { last = *change } else { *change = last }
        }
    }
    Nuisance { ends: ends(side), rows: GRID[0], changes }
}

/// Signals of `setup` on the grid of a side, of an edge of this tilt.
fn signals(locator: &Locator, side: &Opened, mut setup: Setup, tilt: f64) -> Result<Vec<f64>, Error> {
    setup.gauge.side = if side.sign > 0.0 { Side::Contact } else { Side::Far };
    let ends = ends(side);
    let at = |k: usize, i: usize| ends[k][0] + (ends[k][1] - ends[k][0]) * i as f64 / (GRID[k] - 1) as f64;
    let of = |i: usize| {
        let (a, drive) = (at(0, i / GRID[1]).exp(), at(1, i % GRID[1]));
        Tuple { a, drive, tilt, ..locator.rig.design.tuple }
    };
    let options = RunOptions { backend: Some(BackendChoice::Cpu), ..RunOptions::default() };
    let mut all = vec![f64::NAN; GRID[0] * GRID[1]];
    Taps::new(setup, &options)?.strains(of, &mut all)?;
    Ok(all)
}
