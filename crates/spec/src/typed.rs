//! Structs of [`scene`](crate::scene) from sections and inline tables, by serde: a field is the key of its name. An `Option` is `None` where the key is
//! not written; any other field has the key's default.

use serde::de::value::SeqDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor,
};

use super::keys::Form;
use super::properties::first;
use super::{Item, Result, Section};
use crate::error::InputError;

/// An error that passes through serde.
#[derive(Debug)]
struct Failed(InputError);

impl std::fmt::Display for Failed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Failed {}

impl Error for Failed {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self(InputError::new(message.to_string()))
    }
}

impl<'a> Section<'a> {
    /// The struct of this section's keys.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T> {
        let get = |key: &str| match self.known.key(key) {
            Some(known) if known.default.is_none() && !known.absent.is_empty() => Ok(self.written(key)),
            _ => self.get(key).map(Some),
        };
        T::deserialize(Table { get, is_known: Ok(()) }).map_err(|Failed(e)| e)
    }
}

impl<'a> Item<'a> {
    /// The struct of this inline table's keys.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T> {
        let get = |key: &str| Ok(self.child(key));
        T::deserialize(Table { get, is_known: self.only_known() }).map_err(|Failed(e)| e)
    }
}

/// The keys of a table, by `get`.
struct Table<F> {
    get: F,
    is_known: Result<()>,
}

macro_rules! only {
    ($self:ident, $visitor:ident, $($method:ident($($ignored:ident: $type:ty),*) $body:expr;)+) => {
        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> std::result::Result<V::Value, Failed> {
            Err(Failed::custom("no key holds a value of this type"))
        }
        $(fn $method<V: Visitor<'de>>($self, $($ignored: $type,)* $visitor: V) -> std::result::Result<V::Value, Failed> {
            $body
        })+
    };
}

impl<'de, 'a, F: Fn(&str) -> Result<Option<Item<'a>>>> Deserializer<'de> for Table<F> {
    type Error = Failed;

    only! { self, visitor,
        deserialize_struct(_name: &'static str, fields: &'static [&'static str]) {
            self.is_known.map_err(Failed)?;
            visitor.visit_map(Fields { names: fields.iter(), get: self.get, value: None })
        };
    }
    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct seq tuple tuple_struct map enum
        identifier ignored_any
    }
}

struct Fields<'a, F> {
    names: std::slice::Iter<'static, &'static str>,
    get: F,
    value: Option<Item<'a>>,
}

impl<'de, 'a, F: Fn(&str) -> Result<Option<Item<'a>>>> MapAccess<'de> for Fields<'a, F> {
    type Error = Failed;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> std::result::Result<Option<K::Value>, Failed> {
        for name in self.names.by_ref() {
            self.value = (self.get)(name).map_err(Failed)?;
            if self.value.is_some() {
                return seed.deserialize((*name).into_deserializer()).map(Some);
            }
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> std::result::Result<V::Value, Failed> {
        seed.deserialize(Value(self.value.take().expect("its key comes first")))
    }
}

/// The value of a key.
struct Value<'a>(Item<'a>);

impl<'de> Deserializer<'de> for Value<'_> {
    type Error = Failed;

    only! { self, visitor,
        deserialize_bool() visitor.visit_bool(self.0.flag().map_err(Failed)?);
        deserialize_u32() self.deserialize_u64(visitor);
        deserialize_u64() visitor.visit_u64(self.0.whole().map_err(Failed)?);
        deserialize_f64() {
            let axis = matches!(self.0.known.map(|known| &known.form), Some(Form::Axis(_)));
            visitor.visit_f64(if axis { first(&self.0) } else { self.0.ranged() }.map_err(Failed)?)
        };
        deserialize_string() visitor.visit_str(self.0.text().map_err(Failed)?);
        deserialize_option() if self.0.is_written() { visitor.visit_some(self) } else { visitor.visit_none() };
        deserialize_tuple(_length: usize) {
            let ends: [f64; 2] = self.0.numbers().map_err(Failed)?;
            let holds = self.0.interval().is_none_or(|interval| ends.iter().all(|end| interval.holds(*end)));
            if !holds || ends[0] >= ends[1] {
                return self.0.wrong("this is not a range").map_err(Failed);
            }
            visitor.visit_seq(SeqDeserializer::new(ends.into_iter()))
        };
        deserialize_enum(_name: &'static str, words: &'static [&'static str]) {
            let words: Vec<(&str, &str)> = words.iter().map(|word| (*word, *word)).collect();
            visitor.visit_enum(self.0.word(&words).map_err(Failed)?.into_deserializer())
        };
    }
    serde::forward_to_deserialize_any! {
        i8 i16 i32 i64 u8 u16 f32 char str bytes byte_buf unit unit_struct newtype_struct seq tuple_struct map struct identifier ignored_any
    }
}
