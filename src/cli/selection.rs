//! `mge selection`: agents that choose among the tools of an action set.

use std::sync::Arc;

use super::arguments::{SelectionEvaluate, SelectionTrain};
use super::output::{self, Outcome};
use super::progress::Progress;
use mge_selection::{Evaluation, Policy, Settings};
use mge_task as task;

pub fn train(arguments: &SelectionTrain) -> Outcome {
    let task = Arc::new(task::load(&arguments.task)?);
    let to = arguments.force.target(&arguments.out);
    output::check_target(&to, &Policy::FORMAT)?;
    let SelectionTrain { episodes, candidates, seed, .. } = *arguments;
    let mut progress = Progress::new(episodes as u64, arguments.quiet);
    let settings = Settings { episodes, candidates, seed };
    let policy =
        mge_selection::train(&task, settings, |played| progress.set(played as u64, episodes as u64, "episodes"))?;
    policy.save(&to)?;
    drop(progress);
    Ok(output::line(arguments.out.display())?)
}

pub fn evaluate(arguments: &SelectionEvaluate) -> Outcome {
    let task = Arc::new(task::load(&arguments.task)?);
    let policy = arguments.policy.as_ref().map(|path| Policy::load(path, &task)).transpose()?;
    let SelectionEvaluate { episodes, candidates, seed, split, .. } = *arguments;
    let mut progress = Progress::new(episodes as u64, arguments.quiet);
    let settings = Settings { episodes, candidates, seed };
    let evaluation = mge_selection::evaluate(&task, split, policy.as_ref(), settings, |played| {
        progress.set(played as u64, episodes as u64, "episodes");
    });
    drop(progress);
    let file = policy.as_ref().and_then(|policy| policy.file.as_ref());
    let Evaluation { episodes, successes, actions } = evaluation;
    let result = serde_json::json!({
        "task": task.name,
        "split": split.name(),
        "policy": file.map_or_else(|| "random".to_owned(), ToString::to_string),
        "seed": seed,
        "episodes": episodes,
        "success": successes as f64 / episodes as f64,
        "mean_actions": actions as f64 / episodes as f64,
    });
    Ok(output::line(result)?)
}
