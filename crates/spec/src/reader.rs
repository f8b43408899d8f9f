//! Values of a TOML document with their places, for errors.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::keys::{Form, Key, LARGEST, Section};
use super::{InputError, sections};
use crate::design::MOST;
use crate::scene::Interval;

pub type Result<T> = std::result::Result<T, InputError>;
/// Place in the text; `None` for a value that was not written.
pub type Span = Option<Range<usize>>;

#[derive(Debug, Clone, Copy)]
pub struct Document<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl<'a> Document<'a> {
    pub fn line(&self, byte: usize) -> usize {
        1 + self.text.bytes().take(byte).filter(|b| *b == b'\n').count()
    }

    pub fn error(&self, span: Span, message: impl Into<String>) -> InputError {
        let error = InputError::new(message).at(self.file, span.as_ref().map(|s| self.line(s.start)));
        if let Some(span) = span { error.snippet(self.text, span) } else { error }
    }

    pub fn excerpt(&self, span: Range<usize>) -> String {
        let words: Vec<_> = self.text.get(span).unwrap_or_default().split_whitespace().collect();
        let line = words.join(" ");
        match line.char_indices().nth(60) {
            Some((end, _)) => format!("{}…", &line[..end]),
            None => line,
        }
    }
}

/// Places `error`, found after a spec was read, at its key in the `text` of the file `label`, or at the inline table or section of that key.
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
    // An error about one of several values keeps that value.
    let is_several = value.get_ref().is_table() || value.get_ref().is_array();
    let own = error.value.filter(|_| is_several || !is_key);
    let value = own.or_else(|| is_key.then(|| document.excerpt(value.span())));
    InputError { key: error.key, allowed: error.allowed, value, ..placed }
}

/// A value of a spec, and its place if it was written.
#[derive(Debug, Clone)]
pub struct Item<'a> {
    document: &'a Document<'a>,
    /// Its dotted key.
    pub key: String,
    span: Span,
    /// The value.
    pub value: &'a DeValue<'a>,
    /// Description of its key.
    pub known: Option<&'static Key>,
}

impl<'a> Item<'a> {
    /// A value that was written.
    pub fn written(document: &'a Document<'a>, key: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self::new(document, key, Some(value.span()), value.get_ref())
    }

    /// A `value` of `key`; `span` is its place if it was written.
    pub fn new(document: &'a Document<'a>, key: String, span: Span, value: &'a DeValue<'a>) -> Self {
        Self { document, key, span, value, known: None }
    }

    /// The item as the value of the key `known`.
    pub fn of(self, known: Option<&'static Key>) -> Self {
        Self { known, ..self }
    }

    /// An error at this value.
    pub fn error(&self, message: impl Into<String>) -> InputError {
        let value = match &self.span {
            Some(span) => self.document.excerpt(span.clone()),
            None => sections::toml_text(self.value),
        };
        self.document.error(self.span.clone(), message).key(&self.key).value(value)
    }

    /// Refuses this value: `message` is the reason, `allowed` the alternative.
    pub fn refuse<T>(&self, message: impl Into<String>, allowed: impl Into<String>) -> Result<T> {
        Err(self.error(message).allowed(allowed))
    }

    /// Places an error whose key is relative to this value.
    pub fn place(&self, relative: InputError) -> InputError {
        let child = relative.key.and_then(|key| self.child(&key));
        let placed = child.as_ref().unwrap_or(self).error(relative.message);
        InputError { allowed: relative.allowed, ..placed }
    }

    /// Allowed values, in words.
    pub fn allowed(&self) -> String {
        self.known.map_or_else(String::new, Key::allowed)
    }

    /// Refuses this value, with the values that its key allows.
    pub fn wrong<T>(&self, message: impl Into<String>) -> Result<T> {
        self.refuse(message, self.allowed())
    }

    /// [`Self::wrong`] if `is_wrong`.
    pub fn wrong_if(&self, is_wrong: bool, message: impl Into<String>) -> Result<()> {
        if is_wrong { self.wrong(message) } else { Ok(()) }
    }

    /// [`Self::refuse`] if it is `wrong`.
    pub fn refuse_if(&self, wrong: bool, why: impl Into<String>, allowed: impl Into<String>) -> Result<()> {
        if wrong { self.refuse(why, allowed) } else { Ok(()) }
    }

    fn wrong_type<T>(&self, wanted: &str) -> Result<T> {
        let found = match self.value {
            DeValue::String(_) => "a text in quotes",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.wrong(format!("this must be {wanted}, not {found}"))
    }

    /// A finite number up to [`MOST`]; integers count.
    pub fn number(&self) -> Result<f64> {
        let parsed = match self.value {
            DeValue::Float(x) => x.as_str().parse().ok(),
            DeValue::Integer(x) => i128::from_str_radix(x.as_str(), x.radix()).ok().map(|n| n as f64),
            DeValue::String(_) => return self.wrong_type("a number, without unit and quotes"),
            _ => return self.wrong_type("a number"),
        };
        let Some(x) = parsed.filter(|x| f64::is_finite(*x)) else {
            return self.wrong("this must be a finite number");
        };
        let allowed = || format!("{}; at most {MOST:e}", self.allowed());
        if x.abs() <= MOST { Ok(x) } else { self.refuse("no quantity of a whisker is this large", allowed()) }
    }

    /// A number that its key allows.
    pub fn ranged(&self) -> Result<f64> {
        let value = self.number()?;
        let outside = self.interval().is_some_and(|interval| !interval.holds(value));
        self.wrong_if(outside, "this value is out of range").map(|()| value)
    }

    /// The numbers that its key allows, if it takes numbers.
    pub fn interval(&self) -> Option<Interval> {
        self.known.and_then(|known| known.form.interval())
    }

    /// A whole number that its key allows.
    pub fn whole(&self) -> Result<u64> {
        let exact = match self.value {
            DeValue::Integer(x) => i128::from_str_radix(x.as_str(), x.radix()).unwrap_or(i128::MAX),
            DeValue::Float(x) => match x.as_str().parse::<f64>() {
                Ok(x) if x.fract() == 0.0 => x as i128,
                Ok(x) if !x.is_finite() => return self.wrong("this must be a finite number"),
                _ => return self.wrong("this must be a whole number"),
            },
            _ => return self.number().map(|_| 0),
        };
        let Some(Form::Whole(low, high)) = self.known.map(|known| &known.form) else {
            return self.wrong("no whole number is asked for");
        };
        match exact {
            n if n < i128::from(*low) => self.wrong("this number is too small"),
            n if n > i128::from(*high) && *high == LARGEST => {
                self.refuse("this number is too large", format!("{low} … 2^63 − 1"))
            }
            n if n > i128::from(*high) => self.wrong("this number is too large"),
            n => Ok(n as u64),
        }
    }

    /// true or false.
    pub fn flag(&self) -> Result<bool> {
        match self.value {
            DeValue::Boolean(flag) => Ok(*flag),
            _ => self.wrong_type("true or false, without quotes"),
        }
    }

    /// A text that is not empty.
    pub fn text(&self) -> Result<&'a str> {
        match self.value {
            DeValue::String(text) if text.trim().is_empty() => Err(self.error("this text is empty")),
            DeValue::String(text) => Ok(text),
            _ => self.wrong_type("a text in quotes"),
        }
    }

    /// One of several words.
    pub fn word<T: Copy>(&self, words: &[(&str, T)]) -> Result<T> {
        let DeValue::String(text) = self.value else { return self.wrong_type("one of the words") };
        let names: Vec<_> = words.iter().map(|(name, _)| *name).collect();
        match words.iter().find(|(name, _)| name == text) {
            Some((_, meaning)) => Ok(*meaning),
            None => self.wrong(format!("unknown word{}", sections::hint(text, &names))),
        }
    }

    /// One of the words that its key allows.
    pub fn own_word(&self) -> Result<&'static str> {
        let words = self.known.map_or(&[][..], |known| known.form.known_words());
        self.word(&words.iter().map(|word| (*word, *word)).collect::<Vec<_>>())
    }

    /// The elements of a list, under the list's own key.
    pub fn elements(&self) -> Option<impl ExactSizeIterator<Item = Item<'a>> + use<'a>> {
        let (document, key, known) = (self.document, self.key.clone(), self.known);
        let placed = self.span.is_some();
        let list = self.value.as_array()?;
        Some(list.iter().map(move |value| Item {
            document,
            key: key.clone(),
            span: placed.then(|| value.span()),
            value: value.get_ref(),
            known,
        }))
    }

    /// The elements of a list such as `[[start]]`, tables with known keys.
    pub fn tables(&self) -> Result<Vec<Item<'a>>> {
        let Some(elements) = self.elements() else { return self.wrong_type("a list of tables") };
        elements.map(|one| one.only_known().map(|()| one)).collect()
    }

    /// Exactly `N` numbers in a list.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let Some(elements) = self.elements() else { return self.wrong_type("a list of numbers") };
        let values = elements.map(|e| e.number()).collect::<Result<Vec<_>>>()?;
        values
            .try_into()
            .or_else(|values: Vec<f64>| self.wrong(format!("{N} numbers are needed, not {}", values.len())))
    }

    fn as_table(&self) -> Result<&'a DeTable<'a>> {
        self.value.as_table().map_or_else(|| self.wrong_type("a table { key = value, … }"), Ok)
    }

    fn dotted(&self, key: &str) -> String {
        if self.key.is_empty() { key.to_owned() } else { format!("{}.{key}", self.key) }
    }

    /// The value of a table's key.
    pub fn child(&self, key: &str) -> Option<Item<'a>> {
        let value = self.value.as_table()?.get(key)?;
        let span = self.span.is_some().then(|| value.span());
        let known = self.table().and_then(|table| table.key(key));
        Some(Item { document: self.document, key: self.dotted(key), span, value: value.get_ref(), known })
    }

    /// Keys of the table that its key takes.
    pub fn table(&self) -> Option<&'static Section> {
        self.known.and_then(|known| known.form.table())
    }

    /// The value of a key that a table must have.
    pub fn need(&self, key: &str) -> Result<Item<'a>> {
        self.child(key).ok_or_else(|| self.error(format!("{key} is missing here")))
    }

    /// [`Self::need`], with the error at the missing key.
    pub fn needs(&self, key: &str) -> Result<Item<'a>> {
        self.as_table()?;
        self.child(key).ok_or_else(|| {
            let span = self.span.clone().filter(|_| !self.key.is_empty());
            let error = self.document.error(span, format!("{key} is missing"));
            error.key(self.dotted(key)).allowed(self.allowed())
        })
    }

    /// The value of `key` by `read`, or `usual` if it is missing.
    pub fn or<T>(&self, key: &str, usual: T, read: impl FnOnce(&Item<'a>) -> Result<T>) -> Result<T> {
        self.child(key).as_ref().map_or(Ok(usual), read)
    }

    /// Refuses other values than tables, and keys that the table does not have.
    pub fn only_known(&self) -> Result<()> {
        self.only(&self.table().map_or_else(Vec::new, Section::names))
    }

    /// Refuses other values than tables, and other keys than these.
    pub fn only(&self, known: &[&str]) -> Result<()> {
        for (key, value) in self.as_table()? {
            let name: &str = key.get_ref();
            if !known.contains(&name) {
                let message = format!("unknown key{}", sections::hint(name, known));
                let error = self.document.error(Some(key.span()), message).key(self.dotted(name));
                return Err(error.value(self.document.excerpt(value.span())).allowed(self.allowed()));
            }
        }
        Ok(())
    }
}
