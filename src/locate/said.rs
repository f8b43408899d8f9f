//! What a sensor shows without contact, as a user says it: a number, or of two signals one for each.

use std::str::FromStr;

use serde_json::{Value, json};

use super::Locator;
use crate::error::InputError;
use crate::measure::text::{number, plain};

/// One finite number, or two, in the unit of the signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SaidZero {
    said: String,
    values: Vec<f64>,
}

impl SaidZero {
    /// One number, or two; `None` of other numbers, or as many.
    pub fn new(values: Vec<f64>) -> Option<Self> {
        let sound = [1, 2].contains(&values.len()) && values.iter().all(|x| x.is_finite());
        let said = values.iter().map(|x| plain(*x)).collect::<Vec<_>>().join(",");
        sound.then_some(Self { said, values })
    }

    /// The zero of each signal of `locators`, as many as there are.
    ///
    /// # Errors
    /// More or fewer.
    pub fn of<'l>(
        zero: Option<&Self>,
        locators: impl IntoIterator<Item = &'l Locator>,
    ) -> Result<[Option<f64>; 2], InputError> {
        let Some(Self { said, values }) = zero else { return Ok([None; 2]) };
        let signals = 1 + usize::from(locators.into_iter().any(Locator::is_twofold));
        if values.len() == signals {
            return Ok([0, 1].map(|k| values.get(k).copied()));
        }
        let (message, allowed) = match signals {
            1 => ("the calibration is of one signal", "one number, with a decimal point"),
            _ => ("the calibration is of two signals, each with its zero", "two numbers: X,Y"),
        };
        Err(InputError::new(message).key("--zero").value(said).allowed(allowed))
    }

    /// As it stands in a record of what was asked.
    pub fn json(zero: Option<&Self>) -> Value {
        match zero.map(|zero| zero.values.as_slice()) {
            None => Value::Null,
            Some([one]) => json!(one),
            Some(several) => json!(several),
        }
    }
}

impl FromStr for SaidZero {
    type Err = String;

    fn from_str(said: &str) -> Result<Self, String> {
        let values: Option<Vec<f64>> = said.split(',').map(number).collect();
        let zero = values.and_then(Self::new).ok_or("a number, or one for each of two signals: X,Y")?;
        Ok(Self { said: said.to_owned(), ..zero })
    }
}
