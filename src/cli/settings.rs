//! Settings of trainings: those of a file, and `mge config`.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Map, json};

use super::output::{self, Outcome};
use mge_base::json;
use mge_task as task;
use mge_trainer::{Method, RunConfig, config_keys, set_the_same, settings_of};

/// Prints every effective setting of a method or of a file of settings, with where it comes from.
pub fn print(name: &Path) -> Outcome {
    let task = Arc::new(task::load("task1")?);
    let method = name.to_str().and_then(|name| name.parse::<Method>().ok());
    let methods = || Method::ALL.map(Method::name).join(", ");
    let of_file = || {
        settings_of(name).map_err(|error| format!("neither a method ({}) nor a file of settings: {error}", methods()))
    };
    let settings = if method.is_some() { Vec::new() } else { of_file()? };
    let config = method
        .map_or_else(|| RunConfig::usual_for(task.clone()), |method| RunConfig::default_for(task.clone(), method));
    let config = config.with_settings(&settings).map_err(|error| format!("{}: {error}", name.display()))?;
    let [values, usual] = [&config, &RunConfig::new(task)].map(json::to_value);
    let (values, usual) = (json::leaf_values(&values), json::leaf_values(&usual));
    let keys = config_keys(&config);
    let mut printed = Map::new();
    for (path, value) in values.into_iter().filter(|(path, _)| keys.contains(path)) {
        let source = match settings.iter().any(|(key, _)| set_the_same(key, &path)) {
            true => "file",
            false if usual.contains(&(path.clone(), value)) => "default",
            false => "method",
        };
        printed.insert(path, json!({ "value": value, "source": source }));
    }
    output::json(&printed)
}
