//! Values of a TOML document with their places, so that every complaint can point at one.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::check::{Domain, MOST};
use super::schema;
use crate::error::InputError;
use crate::scene::Written;

/// Result of reading.
pub(crate) type Result<T> = std::result::Result<T, InputError>;

/// A text and the name of its file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Document<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl<'a> Document<'a> {
    /// 1-based line of a byte.
    pub fn line(&self, byte: usize) -> usize {
        let before = &self.text.as_bytes()[..byte.min(self.text.len())];
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }

    /// An error at `span`, with the lines around it.
    pub fn error(&self, span: Option<Range<usize>>, message: impl Into<String>) -> InputError {
        let error = InputError::new(message).at(self.file, span.as_ref().map(|s| self.line(s.start)));
        match span {
            Some(span) => error.snippet(self.text, span),
            None => error,
        }
    }

    /// Text of `span` on one line, shortened if long.
    pub fn excerpt(&self, span: Range<usize>) -> String {
        let words: Vec<_> = self.text.get(span).unwrap_or_default().split_whitespace().collect();
        let line = words.join(" ");
        match line.char_indices().nth(60) {
            Some((end, _)) => format!("{}…", &line[..end]),
            None => line,
        }
    }
}

/// `error`, found after a spec was read, at its key in the `text` of the file `label`: of a key within an inline table that may be the table, of
/// one that is not written its section.
pub fn placed(label: &str, text: &str, error: InputError) -> InputError {
    let document = Document { file: label, text };
    let Ok(root) = DeTable::parse(text) else { return error };
    let mut keys = error.key.as_deref().unwrap_or_default().split('.');
    let mut at = keys.next().and_then(|section| root.get_ref().get(section)).map(|v| (v, false));
    for key in keys {
        match at.and_then(|(v, _)| v.get_ref().as_table()?.get(key)) {
            Some(inner) => at = Some((inner, true)),
            None => break,
        }
    }
    let Some((value, is_key)) = at else { return error.at(label, None) };
    let placed = document.error(Some(value.span()), error.message);
    let value = if is_key { Some(document.excerpt(value.span())) } else { error.value };
    InputError { key: error.key, allowed: error.allowed, value, ..placed }
}

/// A value, its dotted key and its place; a defaulted value has no place.
#[derive(Debug, Clone)]
pub(crate) struct Item<'a> {
    document: &'a Document<'a>,
    pub key: String,
    span: Option<Range<usize>>,
    pub value: &'a DeValue<'a>,
}

impl<'a> Item<'a> {
    pub fn written(document: &'a Document<'a>, key: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self { document, key, span: Some(value.span()), value: value.get_ref() }
    }

    /// All of a document, a table.
    pub fn of(document: &'a Document<'a>, value: &'a DeValue<'a>) -> Self {
        Self { document, key: String::new(), span: Some(0..0), value }
    }

    pub fn default(document: &'a Document<'a>, key: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self { document, key, span: None, value: value.get_ref() }
    }

    /// An error at this value.
    pub fn error(&self, message: impl Into<String>) -> InputError {
        let value = match &self.span {
            Some(span) => self.document.excerpt(span.clone()),
            None => schema::toml_text(self.value),
        };
        self.document.error(self.span.clone(), message).key(&self.key).value(value)
    }

    /// Refuses this value: `message` says why, `allowed` what could stand there.
    pub fn refuse<T>(&self, message: impl Into<String>, allowed: impl Into<String>) -> Result<T> {
        Err(self.error(message).allowed(allowed))
    }

    /// Its place; none for a default.
    pub fn at(&self) -> Option<Written> {
        let Document { file, text } = *self.document;
        let span = self.span.clone()?;
        Some(Written {
            file: file.to_owned(),
            text: text.to_owned(),
            line: self.document.line(span.start),
            span,
        })
    }

    /// Places an error whose key is relative to this value.
    pub fn place(&self, relative: InputError) -> InputError {
        let child = relative.key.and_then(|key| self.child(&key));
        let placed = child.as_ref().unwrap_or(self).error(relative.message);
        InputError { allowed: relative.allowed, ..placed }
    }

    fn wrong_type(&self, wanted: &str, allowed: &str) -> InputError {
        let found = match self.value {
            DeValue::String(_) => "a text in quotes",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.error(format!("this must be {wanted}, not {found}")).allowed(allowed)
    }

    /// A finite number; whole numbers count.
    pub fn number(&self, allowed: &str) -> Result<f64> {
        let parsed = match self.value {
            DeValue::Float(x) => x.as_str().parse().ok(),
            DeValue::Integer(x) => i128::from_str_radix(x.as_str(), x.radix()).ok().map(|n| n as f64),
            DeValue::String(_) => return Err(self.wrong_type("a number, without unit and quotes", allowed)),
            _ => return Err(self.wrong_type("a number", allowed)),
        };
        match parsed {
            Some(x) if f64::is_finite(x) => Ok(x),
            _ => self.refuse("this must be a finite number", allowed),
        }
    }

    /// A number that some rig could have.
    pub fn sensible(&self, allowed: &str) -> Result<f64> {
        let value = self.number(allowed)?;
        if value.abs() <= MOST {
            return Ok(value);
        }
        self.refuse("no quantity of a whisker is this large", format!("{allowed}; at most {MOST:e}"))
    }

    /// A number inside `domain`.
    pub fn within(&self, domain: &Domain) -> Result<f64> {
        let value = self.sensible(domain.allowed)?;
        if (domain.holds)(value) {
            return Ok(value);
        }
        self.refuse("this value is out of range", domain.allowed)
    }

    /// A whole number from `min` to 2⁶³ − 1.
    pub fn whole(&self, min: u64) -> Result<u64> {
        let allowed = format!("a whole number ≥ {min}");
        let value = self.number(&allowed)?;
        if value.fract() != 0.0 {
            return self.refuse("this must be a whole number", allowed);
        }
        let exact = match self.value {
            DeValue::Integer(x) => i128::from_str_radix(x.as_str(), x.radix()).unwrap_or(i128::MAX),
            _ => value as i128,
        };
        if exact > i128::from(i64::MAX) {
            return self.refuse("this number is too large", format!("{min} … 2^63 − 1"));
        }
        match u64::try_from(exact) {
            Ok(n) if n >= min => Ok(n),
            _ => self.refuse("this number is too small", allowed),
        }
    }

    /// true or false.
    pub fn flag(&self) -> Result<bool> {
        match self.value {
            DeValue::Boolean(flag) => Ok(*flag),
            _ => Err(self.wrong_type("true or false, without quotes", "true or false")),
        }
    }

    /// A text that is not empty.
    pub fn text(&self) -> Result<&'a str> {
        match self.value {
            DeValue::String(text) if text.trim().is_empty() => Err(self.error("this text is empty")),
            DeValue::String(text) => Ok(text),
            _ => Err(self.wrong_type("a text in quotes", "\"…\"")),
        }
    }

    /// One of several words.
    pub fn word<T: Copy>(&self, words: &[(&str, T)]) -> Result<T> {
        let names: Vec<_> = words.iter().map(|(name, _)| *name).collect();
        let allowed = names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
        let DeValue::String(text) = self.value else {
            return Err(self.wrong_type("one of the words", &allowed));
        };
        match words.iter().find(|(name, _)| name == text) {
            Some((_, meaning)) => Ok(*meaning),
            None => self.refuse(format!("unknown word{}", schema::hint(text, &names)), allowed),
        }
    }

    /// The elements of a list, under the list's own key.
    pub fn elements(&self) -> Option<impl ExactSizeIterator<Item = Item<'a>> + use<'a>> {
        let (document, key, placed) = (self.document, self.key.clone(), self.span.is_some());
        let list = self.value.as_array()?;
        Some(list.iter().map(move |value| Item {
            document,
            key: key.clone(),
            span: placed.then(|| value.span()),
            value: value.get_ref(),
        }))
    }

    /// The elements of a list such as `[[start]]`; `what` says what they are.
    pub fn tables(&self, what: &str) -> Result<impl ExactSizeIterator<Item = Item<'a>> + use<'a>> {
        self.elements().ok_or_else(|| self.wrong_type("a list of tables", what))
    }

    /// Exactly `N` numbers in a list.
    pub fn numbers<const N: usize>(&self, allowed: &str) -> Result<[f64; N]> {
        let elements = self.elements().ok_or_else(|| self.wrong_type("a list of numbers", allowed))?;
        let values = elements.map(|e| e.sensible(allowed)).collect::<Result<Vec<_>>>()?;
        let count = values.len();
        values
            .try_into()
            .map_err(|_| self.error(format!("{N} numbers are needed, not {count}")).allowed(allowed))
    }

    fn dotted(&self, key: &str) -> String {
        if self.key.is_empty() { key.to_owned() } else { format!("{}.{key}", self.key) }
    }

    /// The value of a table's key.
    pub fn child(&self, key: &str) -> Option<Item<'a>> {
        let value = self.value.as_table()?.get(key)?;
        let span = self.span.is_some().then(|| value.span());
        Some(Item { document: self.document, key: self.dotted(key), span, value: value.get_ref() })
    }

    /// The value of a key that a table must have.
    pub fn need(&self, key: &str) -> Result<Item<'a>> {
        self.child(key).ok_or_else(|| self.error(format!("{key} is missing here")))
    }

    /// As [`Self::need`]; `what` says what the table is.
    pub fn needs(&self, key: &str, what: &str) -> Result<Item<'a>> {
        self.child(key).ok_or_else(|| {
            let span = self.span.clone().filter(|_| !self.key.is_empty());
            let error = self.document.error(span, format!("{key} is missing"));
            error.key(self.dotted(key)).allowed(what)
        })
    }

    /// What `read` makes of a key's value, or `usual` where it is not there.
    pub fn or<T>(&self, key: &str, usual: T, read: impl FnOnce(&Item<'a>) -> Result<T>) -> Result<T> {
        self.child(key).as_ref().map_or(Ok(usual), read)
    }

    /// Refuses keys other than `known` in a table; `what` says what the table is.
    pub fn only(&self, known: &[&str], what: &str) -> Result<()> {
        let Some(table) = self.value.as_table() else {
            return Err(self.wrong_type("a table { key = value, … }", what));
        };
        for (key, value) in table {
            let name: &str = key.get_ref();
            if !known.contains(&name) {
                let message = format!("unknown key{}", schema::hint(name, known));
                let error = self.document.error(Some(key.span()), message).key(self.dotted(name));
                return Err(error.value(self.document.excerpt(value.span())).allowed(what));
            }
        }
        Ok(())
    }
}
