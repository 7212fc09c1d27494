//! Numbers that survive JSON when they are not finite: `NaN`, `inf` and `-inf` as words.
//!
//! JSON has no such numbers, and serde_json writes `null` for them, which would make a diverged
//! loss the same as a loss that does not exist yet.

use std::fmt;

use serde::de::{self, Deserializer, Visitor};
use serde::ser::Serializer;

struct Number;

impl Visitor<'_> for Number {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, \"NaN\", \"inf\" or \"-inf\"")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<f64, E> {
        Ok(value)
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<f64, E> {
        Ok(value as f64)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<f64, E> {
        Ok(value as f64)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<f64, E> {
        match text {
            "NaN" => Ok(f64::NAN),
            "inf" => Ok(f64::INFINITY),
            "-inf" => Ok(f64::NEG_INFINITY),
            _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
        }
    }
}

fn write<S: Serializer>(value: f64, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() {
        serializer.serialize_f64(value)
    } else {
        // Display of f64 gives exactly the three words above.
        serializer.collect_str(&value)
    }
}

/// For `f64`: `#[serde(with = "number::required")]`.
pub(super) mod required {
    use super::*;

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        write(*value, serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        deserializer.deserialize_any(Number)
    }
}

/// For `Option<f64>`: `#[serde(with = "number::optional")]`.
pub(super) mod optional {
    use super::*;

    pub fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => write(*value, serializer),
            None => serializer.serialize_none(),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
        struct Maybe;
        impl<'de> Visitor<'de> for Maybe {
            type Value = Option<f64>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("nothing, a number, \"NaN\", \"inf\" or \"-inf\"")
            }

            fn visit_none<E: de::Error>(self) -> Result<Self::Value, E> {
                Ok(None)
            }

            fn visit_unit<E: de::Error>(self) -> Result<Self::Value, E> {
                Ok(None)
            }

            fn visit_some<D: Deserializer<'de>>(self, inner: D) -> Result<Self::Value, D::Error> {
                inner.deserialize_any(Number).map(Some)
            }
        }
        deserializer.deserialize_option(Maybe)
    }
}

#[cfg(test)]
mod tests {
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize, Debug)]
    struct Pair {
        #[serde(with = "super::required")]
        a: f64,
        #[serde(with = "super::optional")]
        b: Option<f64>,
    }

    fn through_json(pair: Pair) -> (String, Pair) {
        let text = serde_json::to_string(&pair).unwrap();
        let back = serde_json::from_str(&text).unwrap();
        (text, back)
    }

    #[test]
    fn every_value_survives() {
        let (text, back) = through_json(Pair { a: f64::NAN, b: Some(f64::NEG_INFINITY) });
        assert_eq!(text, r#"{"a":"NaN","b":"-inf"}"#);
        assert!(back.a.is_nan());
        assert_eq!(back.b, Some(f64::NEG_INFINITY));

        let (text, back) = through_json(Pair { a: 0.1 + 0.2, b: None });
        assert_eq!(text, r#"{"a":0.30000000000000004,"b":null}"#);
        assert_eq!((back.a, back.b), (0.1 + 0.2, None));
    }

    #[test]
    fn whole_numbers_are_read_and_other_words_refused() {
        let pair: Pair = serde_json::from_str(r#"{"a":1,"b":-2}"#).unwrap();
        assert_eq!((pair.a, pair.b), (1.0, Some(-2.0)));
        let error = serde_json::from_str::<Pair>(r#"{"a":"much","b":1}"#).unwrap_err();
        assert!(error.to_string().contains("much"), "{error}");
    }
}
