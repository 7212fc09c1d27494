//! Evaluation of a model on unseen data: fresh launches and complete task scenes, compared with free flight and
//! with rapier's own solver.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::baseline::ConstantVelocity;
use super::error::Result;
use super::launch::{Launch, Split, collect, is_deflected};
use super::model::Model;
use super::predictor::{Errors, Predictor, distance};
use super::rapier::Rapier;
use super::rollout::rollouts;
use super::true_scenes::{TrueScenes, random_states, reaches_next_stage};
use super::variety::Variety;
use mge_base::identity::FileId;
use mge_base::stop::Stop;
use mge_base::validation::{Setting, check_settings};
use mge_env::{Action, Snapshot, uniform_action};
use mge_physics::{Ball, BallState, GRAVITY, STEPS_PER_ACTION, Tool, ToolKind};
use mge_task::Task;

/// Settings of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EvaluationConfig {
    /// Fresh launches for each tool type.
    pub launches: usize,
    /// Random episodes of each task; scene rollouts start from their states.
    pub episodes: usize,
    /// Actions of a scene rollout.
    pub horizon: usize,
    /// Rollouts of each task in which predicted and real hits of the next stage are compared.
    pub hit_rollouts: usize,
    /// Seed of launches, episodes and actions.
    pub seed: u64,
}

impl Default for EvaluationConfig {
    fn default() -> Self {
        Self { launches: 300, episodes: 50, horizon: 4, hit_rollouts: 2000, seed: 1 }
    }
}

/// The numeric settings of [`EvaluationConfig`].
const EVALUATION_SETTINGS: [Setting; 4] = [
    Setting::count("launches", 1, 1_000_000, "fresh launches for each tool type"),
    Setting::count("episodes", 1, 100_000, "random episodes of each task"),
    Setting::count("horizon", 1, 1000, "actions of a scene rollout"),
    Setting::count("hit_rollouts", 1, 1_000_000, "rollouts of each task"),
];

impl EvaluationConfig {
    /// Checks that all settings are in range.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<()> {
        Ok(check_settings(self, &EVALUATION_SETTINGS)?)
    }
}

/// The evaluation of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// The model's name.
    pub model: String,
    /// SHA-256 of the model's file; empty in older evaluations.
    #[serde(default)]
    pub model_sha256: String,
    /// The model's data hash.
    pub data_hash: String,
    /// How it was evaluated.
    pub config: EvaluationConfig,
    /// Errors on fresh launches, by tool type.
    pub launches: Vec<LaunchErrors>,
    /// Errors on complete scenes, by task.
    pub scenes: Vec<SceneErrors>,
}

/// One value for the model and each predictor that it is compared with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compared<T> {
    /// The learned model that is evaluated.
    pub model: T,
    /// Constant velocity with gravity.
    pub constant_velocity: T,
    /// rapier's own solver; none in older evaluations, which did not include it.
    #[serde(default = "Option::default", skip_serializing_if = "Option::is_none")]
    pub rapier: Option<T>,
}

/// Errors on fresh launches at one tool type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaunchErrors {
    /// The only tool of the launches.
    pub tool: ToolKind,
    /// Errors of each predictor.
    pub errors: Compared<OneTool>,
}

/// Errors on single-tool scenes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OneTool {
    /// After one prediction interval.
    pub one_step: Errors,
    /// The same, only for intervals in which the ball was deflected.
    pub one_step_contact: Errors,
    /// After each prediction of a rollout over one action.
    pub rollout: Vec<Errors>,
    /// After the whole action, only for launches in which the ball was deflected.
    pub action_contact: Errors,
}

/// Errors on scenes of one task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneErrors {
    /// The name of the task.
    pub task: String,
    /// After 1, 2, ... actions.
    pub rollout: Compared<Vec<Errors>>,
    /// Predicted against real hits of the next stage.
    pub hits: Compared<HitPredictions>,
}

/// Predicted against real hits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct HitPredictions {
    /// Rollouts compared.
    pub rollouts: usize,
    /// Predicted and real.
    pub true_positives: usize,
    /// Predicted, but not real.
    pub false_positives: usize,
    /// Real, but not predicted.
    pub false_negatives: usize,
    /// Real among the predicted; none if none was predicted.
    pub precision: Option<f64>,
    /// Predicted among the real; none if there was none.
    pub recall: Option<f64>,
}

/// Evaluates a model on fresh launches at its tools, and on scenes of those `tasks` that it supports. `on_progress` is
/// called before every part, a tool type or a task with one of the predictors, with the number of parts done, that of
/// all parts, and the name of the part.
///
/// # Errors
/// When a setting is out of range, the model cannot predict a scene of such a task, or `stop` is requested.
pub fn evaluate(
    model: &Model,
    tasks: &[Task],
    config: &EvaluationConfig,
    stop: &Stop,
    on_progress: &mut dyn FnMut(usize, usize, &str),
) -> Result<Evaluation> {
    config.validate()?;
    let variety = Variety::of(model.config());
    let known: Vec<&Task> = tasks.iter().filter(|task| model.check_task(task).is_ok()).collect();
    let total = PREDICTORS * (model.tools().len() + 2 * known.len());
    let interval = model.config().interval;
    let (constant_velocity, rapier) =
        (&ConstantVelocity { interval }, &Rapier::every(interval, GRAVITY, Ball::default()));
    let predictors = Compared::<&dyn Predictor> { model, constant_velocity, rapier: Some(rapier) };
    let mut parts = Parts { config, predictors, done: 0, total, stop, on_progress };
    let launches = model.tools().iter().map(|&tool| parts.launch_errors(tool, variety)).collect::<Result<_>>()?;
    let of_scenes = known.into_iter().map(|task| parts.scene_errors(&Arc::new(task.clone())));
    let scenes = of_scenes.collect::<Result<_>>()?;
    let FileId { name, sha256 } = model.id();
    Ok(Evaluation {
        model: name,
        model_sha256: sha256,
        data_hash: model.provenance.data_hash.clone(),
        config: config.clone(),
        launches,
        scenes,
    })
}

/// Number of predictors that are compared.
const PREDICTORS: usize = 3;

/// The parts of an evaluation: reports each before it begins.
struct Parts<'a> {
    config: &'a EvaluationConfig,
    predictors: Compared<&'a dyn Predictor>,
    done: usize,
    total: usize,
    stop: &'a Stop,
    on_progress: &'a mut dyn FnMut(usize, usize, &str),
}

impl Parts<'_> {
    /// The value of each predictor, which is a part with this name.
    fn compared<T>(&mut self, name: &str, value: impl Fn(&dyn Predictor) -> Result<T>) -> Result<Compared<T>> {
        let mut next = |predictor: &dyn Predictor| {
            (self.on_progress)(self.done, self.total, name);
            self.done += 1;
            value(predictor)
        };
        Ok(Compared {
            model: next(self.predictors.model)?,
            constant_velocity: next(self.predictors.constant_velocity)?,
            rapier: self.predictors.rapier.map(next).transpose()?,
        })
    }

    fn launch_errors(&mut self, tool: ToolKind, variety: Variety) -> Result<LaunchErrors> {
        let (config, stop) = (self.config, self.stop);
        let launches = collect(tool, variety, config.launches, Split::Test, config.seed, stop)?;
        let errors = self.compared(tool.name(), |predictor| one_tool(predictor, &launches, stop))?;
        Ok(LaunchErrors { tool, errors })
    }

    fn scene_errors(&mut self, task: &Arc<Task>) -> Result<SceneErrors> {
        let (config, stop) = (self.config, self.stop);
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
        let starts = random_states(task, config.episodes, &mut rng, stop)?;
        let actions = |rng: &mut ChaCha8Rng, horizon| (0..horizon).map(|_| uniform_action(rng)).collect();
        let sequences: Vec<Vec<Action>> = starts.iter().map(|_| actions(&mut rng, config.horizon)).collect();
        let truth = TrueScenes::play(task, &starts, &sequences, stop)?;
        let (hit_starts, hit_sequences): (Vec<&Snapshot>, Vec<Vec<Action>>) = (0..config.hit_rollouts)
            .map(|_| (&starts[rng.gen_range(0..starts.len())], actions(&mut rng, HIT_HORIZON)))
            .unzip();
        let played = stop.until(hit_starts.iter().zip(&hit_sequences));
        let real: Vec<bool> = played.map(|(start, actions)| reaches_next_stage(task, start, actions)).collect();
        stop.check()?;
        let rollout = self.compared(&task.name, |predictor| truth.errors(predictor, config.horizon, stop))?;
        let hits = self.compared(&task.name, |predictor| {
            let predicted = rollouts(predictor, &hit_starts, &hit_sequences, stop)?;
            Ok(HitPredictions::count(predicted.iter().map(|rollout| rollout.hit).zip(real.iter().copied())))
        })?;
        Ok(SceneErrors { task: task.name.clone(), rollout, hits })
    }
}

impl Evaluation {
    /// The model's mean error of one prediction on fresh launches, averaged over tool types, and its mean
    /// errors after 1, 2, ... actions in unseen scenes, averaged over tasks.
    pub fn mean_errors(&self) -> (f64, Vec<f64>) {
        let average = |values: &mut dyn Iterator<Item = f64>| {
            let values: Vec<f64> = values.collect();
            values.iter().sum::<f64>() / values.len().max(1) as f64
        };
        let horizon = self.scenes.iter().map(|scene| scene.rollout.model.len()).min().unwrap_or(0);
        let after = |n: usize| average(&mut self.scenes.iter().map(|scene| scene.rollout.model[n].mean));
        let one_step = average(&mut self.launches.iter().map(|tool| tool.errors.model.one_step.mean));
        (one_step, (0..horizon).map(after).collect())
    }
}

/// Actions of a rollout that compares hits: the horizon of guidance.
const HIT_HORIZON: usize = 8;

fn one_tool(predictor: &dyn Predictor, launches: &[Launch], stop: &Stop) -> Result<OneTool> {
    let interval = predictor.interval() as usize;
    let tools: Vec<&[Tool]> = launches.iter().map(|launch| std::slice::from_ref(&launch.tool)).collect();
    let mut balls: Vec<BallState> = launches.iter().map(|launch| launch.states[0]).collect();
    let (mut rollout, mut one_step, mut one_step_contact) = (Vec::new(), Vec::new(), Vec::new());
    for start in (0..STEPS_PER_ACTION as usize).step_by(interval) {
        let (before, after) = (states(launches, start), states(launches, start + interval));
        let predicted = predictor.advance_until(stop, &before, &tools)?;
        for ((launch, predicted), after) in launches.iter().zip(&predicted).zip(&after) {
            let error = distance(predicted, after);
            one_step.push(error);
            if is_deflected(&launch.states[start..=start + interval]) {
                one_step_contact.push(error);
            }
        }
        balls = predictor.advance_until(stop, &balls, &tools)?;
        rollout.push(Errors::between(balls.iter().zip(&after)));
    }
    let last = STEPS_PER_ACTION as usize;
    let deflected = (0..launches.len()).filter(|&index| is_deflected(&launches[index].states));
    let action_contact = deflected.map(|index| distance(&balls[index], &launches[index].states[last]));
    Ok(OneTool {
        one_step: Errors::of(one_step),
        one_step_contact: Errors::of(one_step_contact),
        rollout,
        action_contact: Errors::of(action_contact.collect()),
    })
}

fn states(launches: &[Launch], step: usize) -> Vec<BallState> {
    launches.iter().map(|launch| launch.states[step]).collect()
}

impl HitPredictions {
    fn count(pairs: impl Iterator<Item = (bool, bool)>) -> Self {
        let mut hits = Self::default();
        for (predicted, real) in pairs {
            hits.rollouts += 1;
            hits.true_positives += usize::from(predicted && real);
            hits.false_positives += usize::from(predicted && !real);
            hits.false_negatives += usize::from(!predicted && real);
        }
        let share = |others: usize| {
            let all = hits.true_positives + others;
            (all > 0).then(|| hits.true_positives as f64 / all as f64)
        };
        Self { precision: share(hits.false_positives), recall: share(hits.false_negatives), ..hits }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DynamicsError, shipped};
    use mge_task as task;

    #[test]
    fn an_evaluation_reports_every_part_and_can_be_stopped() {
        let model = shipped("bucket-box").unwrap();
        let config = EvaluationConfig { launches: 4, episodes: 1, horizon: 1, hit_rollouts: 2, seed: 5 };
        let tasks = [task::load("task1").unwrap(), task::load("task3").unwrap()];
        let mut reports = Vec::new();
        let stop = Stop::default();
        let whole = evaluate(&model, &tasks, &config, &stop, &mut |done, total, _| reports.push((done, total)));
        // Two tools and two parts of one supported task, three predictors each.
        assert_eq!(reports, (0..12).map(|done| (done, 12)).collect::<Vec<_>>());
        assert_eq!(whole.unwrap(), evaluate(&model, &tasks, &config, &stop, &mut |_, _, _| ()).unwrap());
        let mut parts = 0;
        let stopped = evaluate(&model, &tasks, &config, &stop, &mut |_, _, _| {
            parts += 1;
            if parts == 3 {
                stop.request();
            }
        });
        assert!(matches!(stopped, Err(DynamicsError::Stopped(_))) && parts == 3, "{parts}");
    }
}
