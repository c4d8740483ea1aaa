//! Refuses indices and enumeration values of 2^32 and more, which `gltf::json` would truncate: index
//! 4294967296 would silently become 0.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};

/// Keys whose integers `gltf::json` reads as `value as u32`. `attributes` stands for the keys in it.
const KEYS: [&str; 24] = [
    "attributes",
    "buffer",
    "bufferView",
    "camera",
    "children",
    "componentType",
    "index",
    "indices",
    "joints",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "nodes",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
    "target",
    "wrapS",
    "wrapT",
];

/// Visits a whole JSON document; recursion is as deep as the document, which is bounded beforehand.
#[derive(Clone, Copy)]
pub(super) struct WideIndexCheck {
    /// Is this the value of one of [`KEYS`], or of a list in one?
    narrow: bool,
    /// Are the values in this object those of `attributes`?
    in_attributes: bool,
}

impl WideIndexCheck {
    pub fn new() -> Self {
        WideIndexCheck { narrow: false, in_attributes: false }
    }
}

impl<'de> DeserializeSeed<'de> for WideIndexCheck {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for WideIndexCheck {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        if self.narrow && u32::try_from(value).is_err() {
            return Err(E::custom(format!("{value} is beyond the largest index, {}", u32::MAX)));
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<String>()? {
            if key == "extras" {
                map.next_value::<IgnoredAny>()?;
                continue;
            }
            let narrow = self.in_attributes || KEYS.contains(&key.as_str());
            map.next_value_seed(WideIndexCheck { narrow, in_attributes: key == "attributes" })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(WideIndexCheck { in_attributes: false, ..self })?.is_some() {}
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}
