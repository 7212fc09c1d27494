//! Settings of earlier versions that this version does not have. A run that was trained with them can be read, but
//! neither continued nor played.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::config::RunConfig;
use super::method::Method;
use mge_base::json;

/// The run was trained with a setting of an earlier version.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the run was trained with {0}, which this version does not have: its results can be read, but only the version that \
     trained it can continue, fork or play it"
)]
pub struct RemovedSetting(String);

impl RunConfig {
    /// Checks that this version has every setting with which the run was trained.
    ///
    /// # Errors
    /// Names the first other setting.
    pub fn check_supported(&self) -> Result<(), RemovedSetting> {
        let setting = self.removed.first_key_value().map(|(path, value)| format!("`{path}` {value}"));
        let method = (!Method::ALL.contains(&self.method)).then(|| format!("the method `{}`", self.method));
        setting.or(method).map_or(Ok(()), |what| Err(RemovedSetting(what)))
    }
}

/// Removes the settings that this version does not have from a configuration as it was saved. Returns those that had
/// an effect, by path.
pub(super) fn take(config: &mut Value) -> BTreeMap<String, String> {
    let mut removed = BTreeMap::new();
    if let Some(settings) = config.as_object_mut() {
        // Without effect unless the method is removed too.
        settings.remove("model_replay");
    }
    if let Some(count) = config.pointer_mut("/guidance/clusters/silhouette").map(Value::take) {
        config["guidance"]["clusters"] = json!({"fixed": count});
        removed.insert("guidance.clusters.silhouette".to_owned(), json::text(&count));
    }
    removed
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Training, TrainingError};

    /// The configuration that a run of an earlier version has saved, with some values replaced.
    fn saved(changes: Value) -> RunConfig {
        let config = RunConfig::usual_for(Arc::new(mge_task::load("task1").unwrap()));
        let mut saved = serde_json::to_value(config).unwrap();
        for (key, value) in changes.as_object().unwrap() {
            saved[key] = value.clone();
        }
        serde_json::from_value(saved).unwrap()
    }

    #[test]
    fn runs_with_removed_settings_that_had_no_effect_can_be_continued() {
        let config = saved(json!({"model_replay": {"rollouts": 2}}));
        assert_eq!(config, RunConfig::usual_for(config.task.clone()));
        assert!(config.check_supported().is_ok());
    }

    #[test]
    fn runs_with_removed_settings_are_read_but_not_trained() {
        for (changes, expected) in [
            (
                json!({"method": "ddpg-model-replay", "model_replay": {"rollouts": 2}}),
                "with the method `ddpg-model-replay`, which this version does not have",
            ),
            (json!({"guidance": {"clusters": {"silhouette": 5}}}), "`guidance.clusters.silhouette` 5"),
        ] {
            let config = saved(changes);
            let again: RunConfig = serde_json::from_str(&serde_json::to_string(&config).unwrap()).unwrap();
            assert_eq!(again, config);
            let refused = Training::new(config, None).unwrap_err();
            assert!(matches!(refused, TrainingError::Removed(_)));
            let refused = refused.to_string();
            assert!(refused.contains(expected) && !refused.contains('\n'), "{refused}");
        }
    }

    #[test]
    fn a_wrong_value_is_reported_with_its_path() {
        let config = RunConfig::usual_for(Arc::new(mge_task::load("task1").unwrap()));
        let text = serde_json::to_string(&config).unwrap().replace("\"gamma\":", "\"gama\":");
        let error = serde_json::from_str::<RunConfig>(&text).unwrap_err().to_string();
        assert!(error.starts_with("ddpg.gama: unknown field `gama`"), "{error}");
    }
}
