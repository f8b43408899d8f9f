//! An effect of the rod for specs, comparisons and files; see [`TERMS`](super::TERMS).

use super::Model;

/// The value of a [`Term`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Amount {
    /// On or off.
    Flag(bool),
    /// 0 is off.
    Number(f64),
    /// One of a few; "rigid" is off.
    Word(&'static str),
}

const OFF: &str = "rigid";

impl Amount {
    /// True if the effect is on.
    pub fn is_on(self) -> bool {
        match self {
            Self::Flag(on) => on,
            Self::Number(x) => x != 0.0,
            Self::Word(word) => word != OFF,
        }
    }

    /// The value without the effect.
    pub const fn off(self) -> Self {
        match self {
            Self::Flag(_) => Self::Flag(false),
            Self::Number(_) => Self::Number(0.0),
            Self::Word(_) => Self::Word(OFF),
        }
    }
}

/// An effect of the rod that one key of `[model]` switches: a flag, or a number of which 0 is off.
#[derive(Debug)]
pub struct Term {
    /// Its key.
    pub key: &'static str,
    /// Its name for people.
    pub name: &'static str,
    /// The value to compare with if the spec has none.
    pub trial: Amount,
    /// True if linear theory has it.
    pub linear: bool,
    /// The reason why it needs a frictionless contact, if it does.
    pub frictionless: Option<&'static str>,
    /// The reason why it needs an upright edge and one gauge, if it does.
    pub upright: Option<&'static str>,
    /// The key of another effect that must be on, and the reason.
    pub needs: Option<(&'static str, &'static str)>,
    /// Its value in a model.
    pub get: fn(&Model) -> Amount,
    /// Sets its value in a model.
    pub set: fn(&mut Model, Amount),
}

impl Term {
    /// The value that switches it off, as TOML.
    pub const fn off(&self) -> &'static str {
        match self.trial {
            Amount::Flag(_) => "false",
            Amount::Number(_) => "0",
            Amount::Word(_) => "\"rigid\"",
        }
    }
}

pub(super) const fn flag(
    [key, name]: [&'static str; 2],
    get: fn(&Model) -> Amount,
    set: fn(&mut Model, Amount),
) -> Term {
    let trial = Amount::Flag(true);
    Term { key, name, trial, linear: false, frictionless: None, upright: None, needs: None, get, set }
}
