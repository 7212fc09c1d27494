//! Values of a sweep's settings that are not written one by one: ranges and samples.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Number, Value};

use super::file::MAX_COMBINATIONS;
use mge_base::json;
use mge_base::streams::Stream;
use mge_base::validation::ValidationError;
use rand::Rng;

/// The values with ranges such as `0..9`, both ends included, as their whole numbers, and whether there is any range.
pub(super) fn expanded(key: &str, values: Vec<Value>) -> Result<(Vec<Value>, bool), ValidationError> {
    let (mut all, mut has_range) = (Vec::new(), false);
    for value in values {
        let ends = value.as_str().and_then(|text| text.split_once(".."));
        match ends.and_then(|(first, last)| Some((first.parse::<i64>().ok()?, last.parse::<i64>().ok()?))) {
            Some((first, last)) if (0..MAX_COMBINATIONS as i64).contains(&last.saturating_sub(first)) => {
                all.extend((first..=last).map(Value::from));
                has_range = true;
            }
            Some(_) => {
                let message = format!("a range has a first and a last value, and at most {MAX_COMBINATIONS} of them");
                return Err(ValidationError::new(key, message));
            }
            None => all.push(value),
        }
    }
    Ok((all, has_range))
}

/// How many samples are drawn for the settings that have a [`Distribution`].
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Samples {
    count: usize,
    #[serde(default)]
    seed: u64,
}

/// The distribution of the samples of a setting, between two bounds; of whole numbers if both bounds are whole.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Distribution {
    Uniform([Number; 2]),
    LogUniform([Number; 2]),
}

impl Samples {
    /// The samples of each distribution. More of them begin with the same ones.
    pub fn draw(&self, drawn: &[Distribution]) -> Result<Vec<Vec<Value>>, ValidationError> {
        if !(1..=MAX_COMBINATIONS).contains(&self.count) {
            return Err(ValidationError::new("samples", format!("`count` must be from 1 to {MAX_COMBINATIONS}")));
        }
        let mut rng = Stream::SweepSamples.of(self.seed);
        let mut columns = vec![Vec::new(); drawn.len()];
        for _ in 0..self.count {
            columns.iter_mut().zip(drawn).for_each(|(column, of)| column.push(of.sample(rng.r#gen())));
        }
        Ok(columns)
    }
}

impl Distribution {
    /// The same, if its bounds are in order.
    pub fn checked(self, key: &str) -> Result<Self, ValidationError> {
        let (_, [low, high], is_log) = self.bounds();
        match low < high && (low > 0.0 || !is_log) {
            true => Ok(self),
            false => Err(ValidationError::new(key, "must have two bounds in order, of `log_uniform` positive ones")),
        }
    }

    /// Whether it is of whole numbers, its bounds, and whether it is logarithmic.
    fn bounds(&self) -> (bool, [f64; 2], bool) {
        let (Self::Uniform(bounds) | Self::LogUniform(bounds)) = self;
        let values = bounds.each_ref().map(|bound| bound.as_f64().unwrap_or(f64::NAN));
        (bounds.iter().all(|bound| !bound.is_f64()), values, matches!(self, Self::LogUniform(_)))
    }

    /// The sample at a share of the distribution, from 0 to 1.
    fn sample(&self, share: f64) -> Value {
        let (is_whole, [low, high], is_log) = self.bounds();
        let margin = if is_whole { 0.5 } else { 0.0 };
        let (from, to) = (low - margin, high + margin);
        let value = if is_log { from * (to / from).powf(share) } else { from + share * (to - from) };
        match is_whole {
            true => Value::from(value.round().clamp(low, high) as i64),
            // Few digits make short names of runs, and are the same on all machines.
            false => format!("{value:.3e}").parse::<f64>().unwrap_or(value).clamp(low, high).into(),
        }
    }
}

/// A value of a file as what the entry should be.
pub(super) fn of_kind<T: DeserializeOwned>(key: &str, value: Value) -> Result<T, ValidationError> {
    serde_json::from_value(value).map_err(|error| ValidationError::new(key, json::message(&error)))
}
