//! `mge clusters`: the action prior of a task.

use std::sync::Arc;

use super::arguments::Clusters;
use super::output::{self, Outcome};
use super::progress::Progress;
use mge_base::stop::Stop;
use mge_guidance::ActionPrior;
use mge_run::RunError;
use mge_task as task;
use mge_trainer::{Method, RunConfig, build_prior};

pub fn run(arguments: &Clusters) -> Outcome {
    let to = arguments.out.as_deref().map(|path| arguments.force.target(path));
    to.iter().try_for_each(|to| output::check_target(to, &ActionPrior::FORMAT))?;
    let task = Arc::new(task::load(&arguments.task)?);
    let mut config = RunConfig::default_for(task, Method::DdpgMge);
    config.prior = arguments.model.clone().unwrap_or(config.prior).identified();
    config.seed = arguments.seed;
    let stages = config.task.stage_count();
    let mut progress = Progress::new(stages as u64, false);
    let on_stage = |stage| progress.set(stage as u64, stages as u64, "stages");
    let prior = build_prior(&config, on_stage, &Stop::default())?;
    drop(progress);
    let text = prior.to_json();
    match to {
        Some(to) => to.write(text.as_bytes(), &ActionPrior::FORMAT).map_err(RunError::io("write", &to.path))?,
        None => output::lines(text)?,
    }
    Ok(())
}
