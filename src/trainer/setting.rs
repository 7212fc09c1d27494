//! One setting of a run by its JSON path, as `set` commands and sweeps name it.

use serde_json::Value;

use super::config::{RunConfig, RunConfigError};

/// A setting that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    /// There is no such setting.
    #[error("there is no setting `{key}`{}", hint.as_ref().map(|hint| format!(": did you mean `{hint}`?")).unwrap_or_default())]
    Unknown { key: String, hint: Option<String> },
    /// The value is of the wrong kind.
    #[error("`{key}` cannot be `{value}`: {message}")]
    Value { key: String, value: String, message: String },
    /// The value is out of range.
    #[error(transparent)]
    Range(#[from] RunConfigError),
}

impl RunConfig {
    /// The configuration with one setting changed. The key is a JSON path such as
    /// `ddpg.gamma`; the value is JSON, or a text without quotes.
    ///
    /// # Errors
    /// When there is no such setting, or it cannot have that value.
    pub fn with_setting(&self, key: &str, value: &str) -> Result<Self, SettingError> {
        // Plain data always serialises.
        let mut config = serde_json::to_value(self).expect("a configuration is plain data");
        let unknown = || SettingError::Unknown { key: key.to_owned(), hint: nearest(&config_keys(self), key) };
        if key == "task" || key.starts_with("task.") {
            return Err(unknown());
        }
        let mut place = &mut config;
        for part in key.split('.') {
            place = place.get_mut(part).ok_or_else(unknown)?;
        }
        *place = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
        let changed: Self = serde_json::from_value(config).map_err(|error| SettingError::Value {
            key: key.to_owned(),
            value: value.to_owned(),
            message: error.to_string(),
        })?;
        changed.validate()?;
        Ok(changed)
    }
}

/// The paths of all settings but the task's.
pub fn config_keys(config: &RunConfig) -> Vec<String> {
    fn walk(value: &Value, path: &str, keys: &mut Vec<String>) {
        let Value::Object(entries) = value else { return keys.push(path.to_owned()) };
        for (name, value) in entries.iter().filter(|(name, _)| !path.is_empty() || *name != "task") {
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            walk(value, &path, keys);
        }
    }
    let mut keys = Vec::new();
    // Plain data always serialises.
    walk(&serde_json::to_value(config).expect("a configuration is plain data"), "", &mut keys);
    keys
}

fn nearest(known: &[String], typed: &str) -> Option<String> {
    let closeness = |key: &String| strsim::jaro_winkler(key, typed);
    known.iter().max_by(|a, b| closeness(a).total_cmp(&closeness(b))).filter(|key| closeness(key) > 0.75).cloned()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    fn config() -> RunConfig {
        RunConfig::new(Arc::new(crate::task::load("task1").unwrap()))
    }

    #[test]
    fn settings_are_made_by_path() {
        let changed = config().with_setting("ddpg.gamma", "0.9").unwrap();
        assert_eq!(changed.ddpg.gamma, 0.9);
        let changed = config().with_setting("epsilon", "exp:0.8:0.1:0.99").unwrap();
        assert_eq!(changed.epsilon.to_string(), "exp:0.8:0.1:0.99");
        let changed = config().with_setting("granularity", "step").unwrap();
        assert_eq!(changed.granularity, super::super::Granularity::Step);
    }

    #[test]
    fn mistakes_are_explained() {
        for (key, value, expected) in [
            ("ddpg.gama", "0.9", "did you mean `ddpg.gamma`?"),
            ("task.name", "x", "there is no setting"),
            ("episodes", "many", "cannot be `many`"),
            ("ddpg.gamma", "2", "gamma"),
        ] {
            let error = config().with_setting(key, value).unwrap_err().to_string();
            assert!(error.contains(expected), "{key}: {error}");
        }
    }
}
