//! Files of settings: a JSON object with the keys of `--set`, which may be grouped, as `{"ddpg": {"gamma": 0.9}}`.

use std::path::Path;

use serde_json::{Map, Value};

use super::defaults;
use super::setting::{SettingError, set_the_same};
use mge_base::bounded;
use mge_base::json::{self, SyntaxError};
use mge_base::paths::expanded;
use mge_base::spelling::did_you_mean;

/// The shipped files, by name.
pub const CONFIGS: [(&str, &str); 3] = [
    ("paper", include_str!("../configs/paper.json")),
    ("paper-literal", include_str!("../configs/paper-literal.json")),
    ("adaptive", ADAPTIVE),
];

/// The settings of adaptive DDPG-MGE.
pub(super) const ADAPTIVE: &str = include_str!("../configs/adaptive.json");

/// Why a file of settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsFileError {
    /// It cannot be read.
    #[error("{name}: {source}: name a file of settings, or one of {}{hint}", CONFIGS.map(|(name, _)| name).join(", "))]
    Io { name: String, source: std::io::Error, hint: String },
    /// It is not a JSON object.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// Two of its settings contradict each other.
    #[error("{origin}: `{first}` and `{second}` set the same: give only one of them")]
    Twice { origin: String, first: String, second: String },
    /// A setting does not exist, or its value has the wrong type; `origin` is the file and the line.
    #[error("{origin}: {source}")]
    Setting { origin: String, source: SettingError },
}

/// The settings in a file, or in the shipped one of this name: their paths and values.
///
/// # Errors
/// When the file cannot be read, is not a JSON object, sets the same twice, or has an unknown setting or a value of the
/// wrong type. Ranges are not checked: they may depend on other settings.
pub fn settings_of(name: &Path) -> Result<Vec<(String, Value)>, SettingsFileError> {
    let origin = name.display().to_string();
    if let Some((_, text)) = CONFIGS.iter().find(|(known, _)| Path::new(known) == name) {
        return parsed(text.as_bytes(), &origin);
    }
    let text = bounded::read(&expanded(name), bounded::TEXT).map_err(|source| {
        let hint = did_you_mean(CONFIGS.map(|(name, _)| name), &origin);
        SettingsFileError::Io { name: origin.clone(), source, hint }
    })?;
    let settings = parsed(&text, &origin)?;
    settings.iter().try_fold(defaults::ADAPTIVE.clone(), |config, (key, value)| {
        config.with_unchecked_setting(key, &json::text(value)).map_err(|source| {
            let line = json::line_of(&text, key).unwrap_or(1);
            SettingsFileError::Setting { origin: format!("{origin}:{line}"), source }
        })
    })?;
    Ok(settings)
}

/// The settings in the text of a file; `origin` names it in errors.
pub(super) fn parsed(text: &[u8], origin: &str) -> Result<Vec<(String, Value)>, SettingsFileError> {
    let entries: Map<String, Value> = json::parse(text, origin)?;
    let mut settings: Vec<(String, Value)> = Vec::new();
    for (key, value) in &entries {
        for (path, value) in json::leaf_values(value) {
            let path = if path.is_empty() { key.clone() } else { format!("{key}.{path}") };
            if let Some((first, _)) = settings.iter().find(|(known, _)| set_the_same(known, &path)) {
                return Err(SettingsFileError::Twice { origin: origin.to_owned(), first: first.clone(), second: path });
            }
            settings.push((path, value.clone()));
        }
    }
    // The method comes first: it determines the defaults of other settings.
    settings.sort_by_key(|(path, _)| path != "method");
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Method, RunConfig};

    #[test]
    fn shipped_files_are_valid_and_that_of_a_method_has_its_defaults() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let of = |name: &str| RunConfig::usual_for(task.clone()).with_settings(&settings_of(Path::new(name)).unwrap());
        for (name, _) in CONFIGS {
            of(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        assert_eq!(of("adaptive").unwrap(), RunConfig::default_for(task.clone(), Method::DdpgMgeAdaptive));
        assert_eq!(of("paper").unwrap(), RunConfig::default_for(task.clone(), Method::DdpgMge));
        assert_eq!(of("paper-literal").unwrap().ddpg.critic_learning_rate, 1e-4);
    }

    #[test]
    fn groups_are_paths_and_nothing_is_set_twice() {
        let paths = |text: &str| parsed(text.as_bytes(), "a.json").map(|all| all.into_iter().map(|(path, _)| path));
        let found: Vec<String> =
            paths(r#"{"ddpg": {"ou": {"sigma": 0.1}, "target_clamp": [-1, 2]}, "method": "ddpg"}"#).unwrap().collect();
        assert_eq!(found, ["method", "ddpg.ou.sigma", "ddpg.target_clamp"]);
        for (text, expected) in [
            (r#"{"ddpg": {"gamma": 0.9}, "ddpg.gamma": 0.8}"#, "`ddpg.gamma` and `ddpg.gamma` set the same"),
            ("[]", "expected a map"),
        ] {
            let error = paths(text).map(|_| ()).unwrap_err().to_string();
            assert!(error.starts_with("a.json") && error.contains(expected), "{error}");
        }
        let error = settings_of(Path::new("papr")).unwrap_err().to_string();
        assert!(error.contains("did you mean `paper`?"), "{error}");
    }
}
