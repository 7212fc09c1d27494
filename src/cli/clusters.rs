//! `mge clusters`: the action prior of a task.

use std::sync::Arc;

use super::arguments::Clusters;
use super::output::{self, Outcome};
use super::progress::Progress;
use crate::guidance::ActionPrior;
use crate::paths::check_suffix;
use crate::run::RunError;
use crate::stop::Stop;
use crate::task;
use crate::trainer::{Method, RunConfig, build_prior};

pub fn run(arguments: &Clusters) -> Outcome {
    if let Some(path) = &arguments.out {
        check_suffix(path, "json").map_err(RunError::io("write", path))?;
        let is_prior = |bytes: &[u8]| serde_json::from_slice::<ActionPrior>(bytes).is_ok();
        output::check_target(path, "a file of action clusters", is_prior)?;
    }
    let task = Arc::new(task::load(&arguments.task)?);
    let mut config = RunConfig::default_with(task, Method::DdpgMge, arguments.tools);
    config.prior = arguments.model.clone().unwrap_or(config.prior).identified();
    config.seed = arguments.seed;
    let stages = config.task.stage_count();
    let mut progress = Progress::new(stages as u64, false);
    let on_stage = |stage| progress.set(stage as u64, stages as u64, "stages");
    let prior = build_prior(&config, on_stage, &Stop::default())?;
    drop(progress);
    match &arguments.out {
        Some(path) => {
            crate::atomic::write(path, prior.to_json().as_bytes()).map_err(RunError::io("write", path))?;
        }
        None => output::lines(prior.to_json())?,
    }
    Ok(())
}
