//! The paper's figures from the data of a study.

use std::sync::Arc;

use super::hits::{FixedPolicy, Guided};
use super::plan::StudyPlan;
use super::report::Report;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_dynamics::{
    Compared, Errors, Evaluation, HitPredictions, Launch, Model, OneTool, Split, TrainConfig, Variety, collect,
};
use mge_env::Environment;
use mge_figures::{
    Edge, HitBars, Instant, Launches, ModelError, PolicyHits, Predictor, RelativeFrames, Statistics, TaskHits,
    ToolLaunches,
};
use mge_guidance::ActionPrior;
use mge_physics::{Ball, BallState, PHYSICS_DT, ToolKind, to_normalised, to_units};
use mge_results::figures::INTERVAL;
use mge_stats::{Bootstrap, Estimate, StatsError};
use mge_task::{Form, Task, ToolSpec};

/// Number of launches drawn for each tool in figure 1.
const SHOWN_LAUNCHES: usize = 24;

/// Figure 1: launches at tools of about the default size.
pub(super) fn launches(plan: &StudyPlan, stop: &Stop) -> Result<Launches, Stopped> {
    let tool = |kind: ToolKind| {
        let TrainConfig { observations, seed, .. } = plan.model_training;
        let launches = collect(kind, Variety::Sizes, observations, Split::Training, seed, stop)?;
        // Trajectories are drawn relative to their tool, so that one tool represents all.
        let shown: Vec<&Launch> = nearest_in_size(&launches, kind.default_size());
        let trajectory = |launch: &&Launch| {
            let [x, y] = launch.tool.centre();
            let at_centre =
                |state: &BallState| to_normalised([state.position[0] - x + 42.0, state.position[1] - y + 42.0]);
            launch.states.iter().map(at_centre).collect()
        };
        let form = Form { size: shown.first().map(|launch| launch.tool.size), ..Form::default() };
        Ok(ToolLaunches {
            tool: ToolSpec { kind, position: [0.0, 0.0], form },
            ball_radius: Ball::default().radius,
            trajectories: shown.iter().map(trajectory).collect(),
            observations: launches.len(),
        })
    };
    Ok(Launches { tools: ToolKind::PAPER.into_iter().map(tool).collect::<Result<_, _>>()? })
}

/// The launches whose tools are closest in size to `size`.
fn nearest_in_size(launches: &[Launch], size: f64) -> Vec<&Launch> {
    let mut sorted: Vec<&Launch> = launches.iter().collect();
    sorted.sort_by(|a, b| (a.tool.size - size).abs().total_cmp(&(b.tool.size - size).abs()));
    sorted.truncate(SHOWN_LAUNCHES);
    sorted
}

/// Figure 2: an episode of guided play at three instants: the last one with the maximum number of
/// active edges, the one halfway to it, and the one halfway from it to the end.
pub(super) fn relative_frames(task: &Task, prior: &ActionPrior, cutoff: f32, seed: u64) -> RelativeFrames {
    let mut rng = Stream::Episode.of(seed);
    let mut env = Environment::new(Arc::new(task.clone()));
    env.reset(&mut rng);
    let mut policy = Guided(prior);
    let mut path = Vec::new();
    let mut instants = Vec::new();
    for _ in 0..6 {
        let action = policy.act(&env, &mut rng);
        let start = path.len();
        if env.step_watched(action, |world| path.push(to_normalised(world.ball(0).position))).is_err() {
            break;
        }
        let (world, placed) = (env.snapshot().world(), env.snapshot().placed());
        for (step, ball) in path.iter().enumerate().skip(start) {
            let edges = world.tools().map(|tool| Edge {
                object: to_normalised(tool.centre()),
                active: tool.surface(to_units(*ball)).0 <= cutoff,
            });
            let time = (step + 1) as f32 * PHYSICS_DT;
            let (trail, edges) = (path[..step].to_vec(), edges.collect());
            instants.push(Instant { time, ball: *ball, trail, placed: placed.to_vec(), edges });
        }
    }
    let active = |n: &usize| instants[*n].edges.iter().filter(|edge| edge.active).count();
    let chosen = (0..instants.len()).max_by_key(active).map(|most| [most / 2, most, (most + instants.len() - 1) / 2]);
    let instants = chosen.into_iter().flatten().map(|n| instants[n].clone()).collect();
    RelativeFrames { task: task.clone(), cutoff, instants }
}

/// Figure 5: hit counts with intervals over seeds.
pub(super) fn hits(report: &Report, plan: &StudyPlan, bootstrap: &Bootstrap) -> Result<HitBars, StatsError> {
    let tasks = plan.tasks.iter().map(|task| {
        let policies = ["guided", "random"].into_iter().map(|policy| {
            let (goal, subgoals) = report.mean_hits(task, policy, bootstrap)?;
            let label = if policy == "guided" { "model-guided exploration" } else { "random exploration (actor + OU)" };
            Ok(PolicyHits { policy: label.to_owned(), goal, subgoals })
        });
        Ok(TaskHits { task: task.name.clone(), policies: policies.collect::<Result<_, StatsError>>()? })
    });
    Ok(HitBars {
        episodes: plan.hit_episodes as usize,
        statistics: Statistics {
            centre: "Mean".to_owned(),
            interval: INTERVAL.to_owned(),
            seeds: plan.hit_seeds as usize,
            fewest_seeds: None,
        },
        tasks: tasks.collect::<Result<_, StatsError>>()?,
    })
}

/// Errors of a model and its baselines on fresh launches.
pub fn model_error_figure(evaluation: &Evaluation, model: &Model) -> ModelError {
    type Of = fn(&Compared<OneTool>) -> &OneTool;
    let predictors: [(&str, Of); 3] = [
        ("graph network", |compared| &compared.model),
        ("constant velocity", |compared| &compared.constant_velocity),
        ("nearest sample", |compared| &compared.nearest_sample),
    ];
    let exact = |errors: &Errors| Estimate::exact(errors.mean);
    let shares =
        |hits: HitPredictions| [hits.precision, hits.recall].map(|share| Estimate::exact(share.unwrap_or(f64::NAN)));
    let predictors = predictors.map(|(label, of)| Predictor {
        label: label.to_owned(),
        one_step: evaluation.launches.iter().map(|tool| exact(&of(&tool.errors).one_step)).collect(),
        rollout: evaluation.launches.iter().map(|tool| of(&tool.errors).rollout.iter().map(exact).collect()).collect(),
        hits: evaluation.launches.iter().map(|tool| shares(of(&tool.errors).hits)).collect(),
    });
    ModelError {
        tools: evaluation.launches.iter().map(|tool| tool.tool.to_string()).collect(),
        step_seconds: f64::from(model.config().interval as f32 * PHYSICS_DT),
        statistics: Statistics {
            centre: format!("Mean of {} launches", evaluation.config.launches),
            seeds: 1,
            ..Statistics::default()
        },
        predictors: predictors.into(),
    }
}
