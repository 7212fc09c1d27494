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

    /// Whether episodes of the run were played on tasks that its configuration no longer has.
    pub fn has_removed_tasks(&self) -> bool {
        self.removed.contains_key(MORE_TASKS)
    }
}

/// Further tasks, played in turn with the task of the run.
const MORE_TASKS: &str = "more_tasks";

/// Removes the settings that this version does not have from a configuration as it was saved. Returns those that had
/// an effect, by path.
pub(super) fn take(config: &mut Value) -> BTreeMap<String, String> {
    let mut removed = BTreeMap::new();
    let mut take = |group: &str, key: &str| {
        let group = if group.is_empty() { Some(&mut *config) } else { config.get_mut(group) };
        group.and_then(Value::as_object_mut).and_then(|group| group.remove(key))
    };
    let further = take("", "further_tasks").is_some();
    // Without effect unless another setting or the method is removed too.
    drop((take("", "tool_candidates"), take("evaluation", "tools"), take("", "model_replay")));
    for (key, without_effect) in [(MORE_TASKS, json!("")), ("observation", json!("objects")), ("tools", Value::Null)] {
        if let Some(value) = take("", key).filter(|value| *value != without_effect) {
            removed.insert(key.to_owned(), json::text(&value));
        }
    }
    if let Some(count) = config.pointer_mut("/guidance/clusters/silhouette").map(Value::take) {
        config["guidance"]["clusters"] = json!({"fixed": count});
        removed.insert("guidance.clusters.silhouette".to_owned(), json::text(&count));
    }
    let past = config.pointer_mut("/fork/tasks").and_then(Value::as_array_mut);
    let past = past.into_iter().flatten().filter_map(Value::as_object_mut);
    let left = past.filter_map(|past| past.remove("further")).count() > 0;
    if further || left {
        removed.entry(MORE_TASKS.to_owned()).or_insert_with(|| "before the fork".to_owned());
    }
    removed
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{TrainerError, Training};

    /// The configuration that a run of an earlier version has saved, with some values replaced.
    fn saved(changes: Value) -> RunConfig {
        let config = RunConfig::usual_for(Arc::new(mge_task::load("task1").unwrap()));
        let mut saved = serde_json::to_value(config).unwrap();
        let usual = json!({"more_tasks": "", "observation": "objects", "tools": null, "tool_candidates": 8});
        for (key, value) in usual.as_object().unwrap().iter().chain(changes.as_object().unwrap()) {
            saved[key] = value.clone();
        }
        saved["evaluation"]["tools"] = Value::Null;
        serde_json::from_value(saved).unwrap()
    }

    #[test]
    fn runs_with_the_usual_values_of_removed_settings_can_be_continued() {
        let config = saved(json!({}));
        assert_eq!(config, RunConfig::usual_for(config.task.clone()));
        assert!(config.check_supported().is_ok() && !config.has_removed_tasks());
    }

    #[test]
    fn runs_with_removed_settings_are_read_but_not_trained() {
        let task = serde_json::to_value(mge_task::load("task2").unwrap()).unwrap();
        let past = json!({"until": 3, "task": task, "further": [task]});
        let fork = json!({"run": "a", "episode": 3, "changes": [], "tasks": [past]});
        for (changes, expected) in [
            (json!({"tools": "train"}), "with `tools` train, which this version does not have"),
            (json!({"observation": "rays", "further_tasks": [task], "more_tasks": "task2"}), "`more_tasks` task2"),
            (json!({"observation": "rays"}), "`observation` rays"),
            (json!({"method": "ddpg-model-replay", "model_replay": {"rollouts": 2}}), "method `ddpg-model-replay`"),
            (json!({"fork": fork}), "`more_tasks` before the fork"),
            (json!({"guidance": {"clusters": {"silhouette": 5}}}), "`guidance.clusters.silhouette` 5"),
        ] {
            let config = saved(changes);
            let again: RunConfig = serde_json::from_str(&serde_json::to_string(&config).unwrap()).unwrap();
            assert_eq!(again, config);
            assert_eq!(config.has_removed_tasks(), expected.contains("more_tasks"));
            let refused = Training::new(config, None).unwrap_err();
            assert!(matches!(refused, TrainerError::Removed(_)));
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
