//! `--zero X`, or of two signals `--zero X,Y`.

use std::str::FromStr;

use serde_json::{Value, json};
use vibrissa::error::InputError;
use vibrissa::locate::Locator;
use vibrissa::measure::text::number;

/// What a sensor shows without contact, as said: of one signal, or of two.
#[derive(Debug, Clone)]
pub struct Zero {
    said: String,
    values: Vec<f64>,
}

impl FromStr for Zero {
    type Err = String;

    fn from_str(said: &str) -> Result<Self, String> {
        let values: Option<Vec<f64>> = said.split(',').map(|x| number(x).filter(|x| x.is_finite())).collect();
        let values = values.filter(|values| values.len() <= 2);
        let values = values.ok_or("a number, or one for each of two signals: X,Y")?;
        Ok(Self { said: said.to_owned(), values })
    }
}

impl Zero {
    /// The zero of each signal of `locators`, as many as there are.
    pub fn of<'l>(
        zero: &Option<Self>,
        locators: impl IntoIterator<Item = &'l Locator>,
    ) -> Result<[Option<f64>; 2], InputError> {
        let Some(Self { said, values }) = zero else { return Ok([None; 2]) };
        let signals = 1 + usize::from(locators.into_iter().any(Locator::is_twofold));
        if values.len() == signals {
            return Ok([0, 1].map(|k| values.get(k).copied()));
        }
        let (message, allowed) = match signals {
            1 => ("the calibration is of one signal", "one number"),
            _ => ("the calibration is of two signals, each with its zero", "two numbers: X,Y"),
        };
        Err(InputError::new(message).key("--zero").value(said).allowed(allowed))
    }

    /// As it stands in a record of what was asked.
    pub fn json(zero: &Option<Self>) -> Value {
        match zero.as_ref().map(|zero| zero.values.as_slice()) {
            None => Value::Null,
            Some([one]) => json!(one),
            Some(several) => json!(several),
        }
    }
}
