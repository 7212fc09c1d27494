//! Serialisation of non-finite numbers in JSON, as the strings `NaN`, `inf` and `-inf`.
//!
//! JSON has no such numbers, and serde_json writes `null` for them, which would make a diverged
//! loss indistinguishable from a loss that does not exist yet. Finite numbers are written as the
//! shortest text that reads back as the same number of their type: an f32 of 0.2 is `0.2`.

use std::str::FromStr;

use serde::de::{self, Unexpected};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The file form of a number.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number, \"NaN\", \"inf\" or \"-inf\"")]
enum Written<T> {
    Number(T),
    Word(String),
}

fn read<T: FromStr, E: de::Error>(written: Written<T>) -> Result<T, E> {
    let word = match written {
        Written::Number(value) => return Ok(value),
        Written::Word(word) => word,
    };
    let value = word.parse().ok().filter(|_| ["NaN", "inf", "-inf"].contains(&word.as_str()));
    value.ok_or_else(|| E::invalid_value(Unexpected::Str(&word), &"a number, \"NaN\", \"inf\" or \"-inf\""))
}

/// For `f32` and `f64`: `#[serde(with = "number::required")]`.
pub(super) mod required {
    use super::*;

    pub fn serialize<T: Copy + Serialize + Into<f64>, S: Serializer>(
        value: &T,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let wide: f64 = (*value).into();
        // Display of f64 gives exactly these three strings.
        if wide.is_finite() { value.serialize(serializer) } else { serializer.collect_str(&wide) }
    }

    pub fn deserialize<'de, T, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error>
    where
        T: Deserialize<'de> + FromStr,
    {
        read(Written::deserialize(deserializer)?)
    }
}

/// For `Option<f32>` and `Option<f64>`: `#[serde(with = "number::optional")]`.
pub(super) mod optional {
    use super::*;

    pub fn serialize<T, S: Serializer>(value: &Option<T>, serializer: S) -> Result<S::Ok, S::Error>
    where
        T: Copy + Serialize + Into<f64>,
    {
        match value {
            Some(value) => required::serialize(value, serializer),
            None => serializer.serialize_none(),
        }
    }

    pub fn deserialize<'de, T, D: Deserializer<'de>>(deserializer: D) -> Result<Option<T>, D::Error>
    where
        T: Deserialize<'de> + FromStr,
    {
        Option::deserialize(deserializer)?.map(read).transpose()
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

    #[derive(Serialize, Deserialize)]
    struct Single {
        #[serde(with = "super::required")]
        x: f32,
    }

    #[test]
    fn single_precision_is_written_short_and_round_trips_bit_for_bit() {
        assert_eq!(serde_json::to_string(&Single { x: 0.2 }).unwrap(), r#"{"x":0.2}"#);
        // Every exponent, with digits spread over the mantissas.
        for bits in (0..u32::MAX).step_by(65_537) {
            let x = f32::from_bits(bits);
            let text = serde_json::to_string(&Single { x }).unwrap();
            let back: Single = serde_json::from_str(&text).unwrap();
            assert!(back.x.to_bits() == bits || (x.is_nan() && back.x.is_nan()), "{text}");
        }
    }

    fn through_json(pair: Pair) -> (String, Pair) {
        let text = serde_json::to_string(&pair).unwrap();
        let back = serde_json::from_str(&text).unwrap();
        (text, back)
    }

    #[test]
    fn every_value_round_trips() {
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
        let expected = "invalid value: string \"much\", expected a number, \"NaN\", \"inf\" or \"-inf\"";
        assert!(error.to_string().starts_with(expected), "{error}");
    }
}
