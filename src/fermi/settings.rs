//! TOML descriptions with overrides: `--set key=value`.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::{Error, Result};

/// A description and the name by which errors call it.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// File name for errors.
    pub file: &'a str,
    /// TOML.
    pub text: &'a str,
}

impl Source<'static> {
    /// An embedded description by name.
    ///
    /// # Errors
    /// [`Error::Usage`] that lists the names there are.
    pub fn embedded(kind: &str, all: &'static [(&str, &str)], name: &str) -> Result<Source<'static>> {
        let Some(&(file, text)) = all.iter().find(|(known, _)| *known == name) else {
            let known: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
            return Err(Error::usage(format!("unknown {kind} \"{name}\""), format!("known are {}", known.join(", "))));
        };
        Ok(Source { file, text })
    }
}

fn find<'t>(table: &'t mut Table, path: &str) -> Option<&'t mut Value> {
    match path.split_once('.') {
        None => table.get_mut(path),
        Some((head, rest)) => find(table.get_mut(head)?.as_table_mut()?, rest),
    }
}

/// A parsed description with overrides applied, not yet typed.
pub struct Text<'a> {
    file: &'a str,
    table: Table,
}

impl<'a> Text<'a> {
    /// Parses `source` and sets each `key=value` of `overrides`; a key is a path like `l1.kib`.
    ///
    /// # Errors
    /// [`Error::Input`] for text that is no TOML, [`Error::Usage`] for an override of nothing.
    pub fn new(source: &Source<'a>, overrides: &[String]) -> Result<Text<'a>> {
        let parsed = source.text.parse::<Table>();
        let table = parsed.map_err(|e| Error::input(source.file, "description", e.message(), "correct the TOML"))?;
        let mut text = Text { file: source.file, table };
        overrides.iter().try_for_each(|setting| text.set(setting))?;
        Ok(text)
    }

    fn set(&mut self, setting: &str) -> Result<()> {
        let Some((key, value)) = setting.split_once('=') else {
            return Err(Error::usage(format!("--set {setting}"), "write key=value, e.g. sms=8 or l1.kib=48"));
        };
        let (key, value) = (key.trim(), value.trim());
        let keys = self.keys();
        let Some(place) = find(&mut self.table, key) else {
            let what = format!("--set {key}: {} has no such number", self.file);
            return Err(Error::usage(what, format!("keys are {}", keys.join(", "))));
        };
        *place = match (&*place, value.parse::<i64>(), value.parse::<f64>()) {
            (Value::Integer(_), Ok(number), _) => Value::Integer(number),
            (Value::Float(_), _, Ok(number)) => Value::Float(number),
            (Value::String(_), ..) => Value::String(value.to_owned()),
            (Value::Boolean(_), ..) if value == "true" || value == "false" => Value::Boolean(value == "true"),
            (old, ..) => {
                return Err(Error::usage(
                    format!("--set {key}={value}"),
                    format!("give a value of type {}", old.type_str()),
                ));
            }
        };
        Ok(())
    }

    /// Paths of all values.
    fn keys(&self) -> Vec<String> {
        fn collect(table: &Table, prefix: &str, keys: &mut Vec<String>) {
            for (key, value) in table {
                match value {
                    Value::Table(inner) => collect(inner, &format!("{prefix}{key}."), keys),
                    _ => keys.push(format!("{prefix}{key}")),
                }
            }
        }
        let mut keys = Vec::new();
        collect(&self.table, "", &mut keys);
        keys
    }

    /// The typed description.
    ///
    /// # Errors
    /// [`Error::Input`] for unknown, missing and ill-typed keys.
    pub fn read<T: DeserializeOwned>(self) -> Result<T> {
        let file = self.file;
        T::deserialize(Value::Table(self.table)).map_err(|error| {
            Error::input(file, "description", error.message().trim(), "give every key once, with a value of its type")
        })
    }
}
