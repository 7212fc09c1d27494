//! Settings of a run by JSON path, as used by `set` commands and sweeps.

use serde_json::Value;

use super::config::{RunConfig, settings};
use super::method::Method;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::validation::ValidationError;

/// Why a setting cannot be changed.
#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    /// There is no such setting.
    #[error("there is no setting `{key}`{hint}")]
    Unknown { key: String, hint: String },
    /// The value has the wrong type.
    #[error("`{key}` cannot be `{value}`: {message}")]
    Value { key: String, value: String, message: String },
    /// The value is out of range.
    #[error(transparent)]
    Range(#[from] ValidationError),
}

impl RunConfig {
    /// The configuration with one setting changed. The key is a JSON path such as
    /// `ddpg.gamma`; the value is JSON, or a string without quotes.
    ///
    /// # Errors
    /// When there is no such setting, or it cannot have that value.
    pub fn with_setting(&self, key: &str, value: &str) -> Result<Self, SettingError> {
        let changed = self.with_unchecked_setting(key, value)?;
        changed.validate()?;
        Ok(changed)
    }

    /// The configuration with several settings, in their order, which may be valid only together.
    ///
    /// # Errors
    /// When there is no such setting, or they cannot have these values.
    pub fn with_settings(&self, settings: &[(String, Value)]) -> Result<Self, SettingError> {
        let changed = settings
            .iter()
            .try_fold(self.clone(), |config, (key, value)| config.with_unchecked_setting(key, &json::text(value)))?;
        changed.validate()?;
        Ok(changed)
    }

    /// [`RunConfig::with_setting`] without validation, for several settings that are valid only
    /// together.
    ///
    /// # Errors
    /// When there is no such setting, or it cannot have that value.
    pub fn with_unchecked_setting(&self, key: &str, value: &str) -> Result<Self, SettingError> {
        let wrong = |message| SettingError::Value { key: key.to_owned(), value: value.to_owned(), message };
        if key == "method" {
            return Ok(self.with_method(value.trim_matches('"').parse().map_err(wrong)?));
        }
        let mut config = json::to_value(self);
        let place = if is_fixed(key) { None } else { json::at_mut(&mut config, key) };
        let Some(place) = place else {
            let keys = config_keys(self);
            let hint = did_you_mean(keys.iter().map(String::as_str), key);
            return Err(SettingError::Unknown { key: key.to_owned(), hint });
        };
        match serde_json::from_str(value) {
            // A string setting such as the schedule `0.1` may look like a number.
            // What there is not has the word that users read.
            _ if value == "none" && !place.is_string() => *place = Value::Null,
            Ok(parsed) if !place.is_string() || matches!(parsed, Value::String(_)) => put(place, parsed),
            _ => *place = Value::String(value.to_owned()),
        }
        // The inherent function, which does not check ranges.
        let mut config =
            RunConfig::deserialize(config).map_err(|error| wrong(in_plain_words(key, error.to_string())))?;
        config.task = self.task.clone();
        // Where a model is, is not part of its text.
        config.prior = if key == "prior" { config.prior.identified() } else { self.prior.clone() };
        Ok(config)
    }
}

/// What a setting may be, in place of the name of a type.
fn in_plain_words(key: &str, message: String) -> String {
    let expected = message.rsplit_once("expected ").map_or("", |(_, expected)| expected);
    match expected {
        "f64" | "f32" | "u32" | "u64" | "usize" | "an array of length 2" => {
            let setting = settings().find(|(path, _)| path == key);
            setting.map_or_else(|| "it is a number".to_owned(), |(_, setting)| format!("it is {}", setting.range))
        }
        "a boolean" => "it is true or false".to_owned(),
        "struct TaskModelConfig" => {
            "it is a group of settings, such as model.launches; `prior` chooses the model".to_owned()
        }
        group if group.starts_with("struct ") => format!("it is a group of settings, such as {key}.KEY"),
        _ => message.replace("unknown variant", "unknown value"),
    }
}

/// Sets a value. Of a group such as `ddpg`, what the value leaves out stays as it is (it would be that of no method).
fn put(place: &mut Value, value: Value) {
    match (place, value) {
        (Value::Object(old), Value::Object(new)) if new.keys().all(|key| old.contains_key(key)) => {
            for (key, value) in new {
                put(&mut old[&key], value);
            }
        }
        (place, value) => *place = value,
    }
}

/// Whether two settings contradict each other: one is the other or a part of it.
pub fn set_the_same(one: &str, other: &str) -> bool {
    let within = |inner: &str, outer: &str| {
        inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    within(one, other) || within(other, one)
}

/// The settings, by path, in which a configuration differs from the default one of its task and method. The method,
/// if it is not the default, comes first. Values are in the form that [`RunConfig::with_setting`] accepts.
pub fn non_default_settings(config: &RunConfig) -> Vec<(String, String)> {
    let usual = RunConfig::default_for(config.task.clone(), config.method);
    let [ours, usual] = [config, &usual].map(json::to_value);
    let usual = json::leaf_values(&usual);
    let differs = |(path, value): &(String, &Value)| !is_fixed(path) && !usual.contains(&(path.clone(), *value));
    let others = json::leaf_values(&ours).into_iter().filter(differs).map(|(path, value)| {
        let text = if path == "prior" { config.prior.place() } else { json::text(value) };
        (path, text)
    });
    let method = (config.method != Method::default()).then(|| ("method".to_owned(), config.method.to_string()));
    method.into_iter().chain(others).collect()
}

/// The paths of all settings.
pub fn config_keys(config: &RunConfig) -> Vec<String> {
    json::leaf_values(&json::to_value(config))
        .into_iter()
        .map(|(path, _)| path)
        .filter(|path| !is_fixed(path))
        .collect()
}

/// Whether a part of a configuration is not a setting: the task, and what earlier versions had.
fn is_fixed(key: &str) -> bool {
    ["task", "removed"].contains(&key.split('.').next().unwrap_or(key))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn config() -> RunConfig {
        RunConfig::new(Arc::new(mge_task::load("task1").unwrap()))
    }

    #[test]
    fn settings_are_changed_by_path() {
        let changed = config().with_setting("ddpg.gamma", "0.9").unwrap();
        assert_eq!(changed.ddpg.gamma, 0.9);
        let changed = config().with_setting("epsilon", "exp:0.8:0.1:0.99").unwrap();
        assert_eq!(changed.epsilon.to_string(), "exp:0.8:0.1:0.99");
        assert_eq!(config().with_setting("epsilon", "0.25").unwrap().epsilon.to_string(), "0.25");
        let stop = |value: &str| config().with_setting("stop.success", value).map(|config| config.stop.success);
        assert_eq!(["0.5", "none", "null"].map(|value| stop(value).unwrap()), [Some(0.5), None, None]);
        let changed = config().with_setting("granularity", "step").unwrap();
        assert_eq!(changed.granularity, super::super::Granularity::Step);
    }

    #[test]
    fn non_default_settings_reproduce_the_configuration() {
        let changes = [("ddpg.gamma", "0.9"), ("method", "ddpg"), ("epsilon", "0.25"), ("seed", "3")];
        let set = |config: RunConfig, (key, value): (&str, &str)| config.with_setting(key, value).unwrap();
        let changed = changes.into_iter().fold(config(), set);
        let changes_found = non_default_settings(&changed);
        assert_eq!(changes_found.len(), changes.len(), "{changes_found:?}");
        assert!(changes_found.contains(&("ddpg.gamma".to_owned(), "0.9".to_owned())));
        let again = changes_found.iter().map(|(key, value)| (key.as_str(), value.as_str())).fold(config(), set);
        assert_eq!(again, changed);
    }

    #[test]
    fn errors_explain_the_mistake() {
        for (key, value, expected) in [
            ("ddpg.gama", "0.9", "did you mean `ddpg.gamma`?"),
            ("task.name", "x", "there is no setting"),
            ("episodes", "many", "cannot be `many`: it is a whole number from 1 to 10000000"),
            ("episodes", "1e99", "it is a whole number from 1 to 10000000"),
            ("ddpg.gamma", "2", "gamma"),
            ("episodes", "none", "cannot be `none`: it is a whole number from 1"),
        ] {
            let error = config().with_setting(key, value).unwrap_err().to_string();
            assert!(error.contains(expected), "{key}: {error}");
        }
    }
}
