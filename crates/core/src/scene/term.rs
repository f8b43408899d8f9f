//! What an effect of the rod is to a spec, a comparison and a file: see [`TERMS`](super::TERMS).

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

/// The word that is off.
const OFF: &str = "rigid";

impl Amount {
    /// Whether the effect is there.
    pub fn is_on(self) -> bool {
        match self {
            Self::Flag(on) => on,
            Self::Number(x) => x != 0.0,
            Self::Word(word) => word != OFF,
        }
    }

    /// Without the effect.
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
    /// The value with which it is compared where the spec has none.
    pub trial: Amount,
    /// Whether the linear theory has it.
    pub linear: bool,
    /// Why it asks for a frictionless contact, if it does.
    pub frictionless: Option<&'static str>,
    /// Why it asks for an upright edge and one gauge, if it does.
    pub upright: Option<&'static str>,
    /// Another that must be on beside it, and why.
    pub needs: Option<(&'static str, &'static str)>,
    /// Its value in a model.
    pub get: fn(&Model) -> Amount,
    /// Gives it a value.
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

/// One that is on or off.
pub(super) const fn flag(
    [key, name]: [&'static str; 2],
    get: fn(&Model) -> Amount,
    set: fn(&mut Model, Amount),
) -> Term {
    Term {
        key,
        name,
        trial: Amount::Flag(true),
        linear: false,
        frictionless: None,
        upright: None,
        needs: None,
        get,
        set,
    }
}
