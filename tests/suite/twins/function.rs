//! What is compared of a function.

use std::collections::BTreeSet;

use super::Twin;
use super::formula::Formula;

/// A function of either side.
#[derive(Debug, Clone, Default)]
pub struct Function {
    /// Names of its parameters, in order.
    pub parameters: Vec<String>,
    /// Numbers and named numbers in its text.
    pub constants: BTreeSet<String>,
    /// Calls in which one argument has the name of another's parameter.
    pub crossed: Vec<String>,
    /// Calls of functions, with their arguments, and what names are set to, case by case.
    pub formulas: BTreeSet<String>,
}

impl Function {
    /// Notes that `name` is set to `value`, where `guard` holds. What a value is made of tells more than what it is called.
    pub fn assign(&mut self, name: &str, guard: &str, value: &Formula) {
        let value = value.to_string();
        if value == name || value == "0" || name == "_" || value.starts_with("1 + ") && value[4..] == *name {
            return;
        }
        // A guard of several switches is folded by the one and not by the other.
        let folded = ["", "_", "!_", "true", "false"].contains(&guard) || guard.contains("or(");
        let case = if folded { value.clone() } else { format!("{guard}: {value}") };
        let bare = value.chars().all(|c| c.is_alphanumeric() || "_.[]".contains(c));
        self.formulas.insert(if bare { format!("{name} = {case}") } else { case });
    }

    /// Notes a call of one of `twins`.
    pub fn call(&mut self, call: &Formula, twins: &[Twin]) {
        let call = call.to_string();
        if twins.iter().any(|t| call.split_once('(').is_some_and(|(name, _)| name == t.wgsl)) {
            self.formulas.insert(call);
        }
    }
}

/// Names and numbers of a line; a place in an array is no number.
pub fn tokens(line: &str) -> Vec<String> {
    let bytes: Vec<char> = line.chars().collect();
    let (mut all, mut i) = (Vec::new(), 0);
    while i < bytes.len() {
        let (c, start) = (bytes[i], i);
        let place = i > 0 && bytes[i - 1] == '[' && c.is_ascii_digit();
        if c.is_ascii_digit() {
            let hex = c == '0' && bytes.get(i + 1) == Some(&'x');
            while i < bytes.len() {
                let sign = matches!(bytes[i], '+' | '-') && bytes[i - 1] == 'e' && !hex;
                if !(bytes[i].is_ascii_alphanumeric() || bytes[i] == '.' || sign) {
                    break;
                }
                i += 1;
            }
        } else if c.is_alphabetic() || c == '_' {
            while i < bytes.len() && (bytes[i].is_alphanumeric() || bytes[i] == '_') {
                i += 1;
            }
        } else {
            i += 1;
            continue;
        }
        if !place {
            all.push(bytes[start..i].iter().collect());
        }
    }
    all
}
