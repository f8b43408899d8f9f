//! One section of a spec: what the user wrote, and the defaults behind it.

use std::ops::Range;

use toml::de::DeTable;

use super::reader::{Document, Item, Result};
use super::schema;
use crate::error::InputError;

/// One `[section]`: what the user wrote, and the defaults behind it.
#[derive(Debug, Clone)]
pub(super) struct Section<'a> {
    pub document: &'a Document<'a>,
    pub name: &'static str,
    pub span: Option<Range<usize>>,
    pub user: Option<&'a DeTable<'a>>,
    pub defaults: Option<&'a DeTable<'a>>,
}

impl<'a> Section<'a> {
    fn dotted(&self, key: &str) -> String {
        format!("{}.{key}", self.name)
    }

    /// The user's value of `key`.
    pub fn written(&self, key: &str) -> Option<Item<'a>> {
        Some(Item::written(self.document, self.dotted(key), self.user?.get(key)?))
    }

    /// The user's value of `key`, or the default.
    pub fn get(&self, key: &str) -> Result<Item<'a>> {
        if let Some(item) = self.written(key) {
            return Ok(item);
        }
        match self.defaults.and_then(|d| d.get(key)) {
            Some(value) => Ok(Item::default(self.document, self.dotted(key), value)),
            None => Err(self.missing(key)),
        }
    }

    /// What the user wrote under `key`, if anything, read by `read`.
    pub fn optional<T>(&self, key: &str, read: impl FnOnce(&Item<'a>) -> Result<T>) -> Result<Option<T>> {
        self.written(key).as_ref().map(read).transpose()
    }

    fn missing(&self, key: &str) -> InputError {
        let (name, example) = (self.name, schema::example(self.name, key));
        let message = match self.user {
            Some(_) => format!("{key} is missing from [{name}]; add a line such as {key} = {example}"),
            None => {
                format!("[{name}] with {key} is missing; add [{name}] and a line such as {key} = {example}")
            }
        };
        self.document.error(self.span.clone(), message).key(self.dotted(key))
    }
}
