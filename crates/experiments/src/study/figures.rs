//! The paper's figures from the data of a study.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::report::{Report, Results};
use crate::error::Result;
use crate::sweep::{Policy, Summary};
use mge_base::atomic::Target;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_dynamics::{Launch, Split, TrainConfig, Variety, collect};
use mge_env::Environment;
use mge_figures::{
    ActionSamples, Against, Edge, Figure, HitBars, Instant, Launches, PolicyHits, Provenance, RelativeFrames,
    Statistics, Success, TaskActions, TaskGrid, TaskHits, ToolLaunches,
};
use mge_guidance::ActionPrior;
use mge_physics::{Ball, BallState, PHYSICS_DT, ToolKind, to_normalised, to_units};
use mge_results::figures::{INTERVAL, learning_curves, method_scores};
use mge_run::config_hash;
use mge_stats::{Bootstrap, Estimate};
use mge_task::{Form, Task, ToolSpec};
use mge_trainer::build_prior;

/// Number of launches drawn for each tool in figure 1.
const SHOWN_LAUNCHES: usize = 24;

/// Writes the figures of a study into their folder; `hits` are the means of its counts.
///
/// # Errors
/// When a statistic cannot be computed, a figure cannot be written, or `stop` is requested.
pub(super) fn write_figures(
    results: &Results,
    report: &Report,
    hits: &Summary,
    folder: &Target,
    command: &str,
    dpi: u32,
    stop: &Stop,
) -> Result<()> {
    let (hash, seed) = (config_hash(&report), results.models.first().map_or(0, |(model, _)| model.training.seed));
    let draw = |name: &str, seeds: usize, figure: &dyn Figure| -> Result<()> {
        stop.check()?;
        let seeds: Vec<u64> = (seed..seed + seeds as u64).collect();
        Ok(figure.write_all(folder, name, &Provenance::new(command, &seeds, &hash), dpi)?)
    };
    let bootstrap = &Bootstrap::default();
    let clusters = clusters(results, stop)?;
    let tasks: Vec<Task> = clusters.iter().map(|(task, _)| Task::clone(task)).collect();
    if let Some((model, _)) = results.models.first() {
        draw("figure1", 1, &launches(&model.training, stop)?)?;
        if let Some((task, prior)) = clusters.first() {
            draw("figure2", 1, &relative_frames(task, prior, model.model.cutoff, seed))?;
        }
    }
    draw("figure3", 1, &TaskGrid { tasks })?;
    let sampled = clusters.iter().map(|(task, prior)| TaskActions::sample(task, prior, seed));
    draw("figure4", 1, &ActionSamples { tasks: sampled.collect() })?;
    let bars = hit_bars(hits);
    draw("figure5", bars.statistics.seeds, &bars)?;
    let (fixed, noisy) = (&results.fixed, &results.noisy);
    let trainings = fixed.iter().map(|run| run.row.seed).collect::<BTreeSet<u64>>().len();
    draw("figure6", trainings, &learning_curves(fixed, bootstrap, Success::Training, Against::Episodes, None)?)?;
    draw("figure6-greedy", trainings, &learning_curves(fixed, bootstrap, Success::Greedy, Against::Episodes, None)?)?;
    draw("methods", trainings, &method_scores(&report.learning, bootstrap, None)?)?;
    draw("noisy-starts", trainings, &learning_curves(noisy, bootstrap, Success::Training, Against::Episodes, None)?)?;
    draw(
        "noisy-starts-charged",
        trainings,
        &learning_curves(noisy, bootstrap, Success::Training, Against::Charged, None)?,
    )?;
    draw("noisy-starts-methods", trainings, &method_scores(&report.noisy_starts, bootstrap, None)?)
}

/// The clusters of the first count of guided play on each task.
fn clusters(results: &Results, stop: &Stop) -> Result<Vec<(Arc<Task>, ActionPrior)>> {
    let mut clusters: Vec<(Arc<Task>, ActionPrior)> = Vec::new();
    for (job, _) in results.hits.iter().filter(|(job, _)| job.policy == Policy::Guided) {
        if clusters.iter().all(|(task, _)| *task != job.task) {
            clusters.push((job.task.clone(), build_prior(&job.clusters(), |_| (), stop)?));
        }
    }
    Ok(clusters)
}

/// Figure 1: launches at tools of about the default size.
fn launches(training: &TrainConfig, stop: &Stop) -> Result<Launches, Stopped> {
    let tool = |kind: ToolKind| {
        let TrainConfig { observations, seed, .. } = *training;
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
fn relative_frames(task: &Task, prior: &ActionPrior, cutoff: f32, seed: u64) -> RelativeFrames {
    let mut rng = Stream::Episode.of(seed);
    let mut env = Environment::new(Arc::new(task.clone()));
    env.reset(&mut rng);
    let mut path = Vec::new();
    let mut instants = Vec::new();
    for _ in 0..6 {
        let action = prior.sample(env.snapshot().stage(), &mut rng);
        let start = path.len();
        if env.step_watched(action, |world| path.push(to_normalised(world.ball(0).position))).is_err() {
            break;
        }
        let (world, placed) = (&env.snapshot().world, &env.snapshot().placed);
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
fn hit_bars(means: &Summary) -> HitBars {
    let mut tasks: Vec<TaskHits> = Vec::new();
    for group in &means.groups {
        let task = group.setting("task").unwrap_or_default().to_owned();
        let policy = match group.setting("policy") {
            Some("guided") => "model-guided exploration",
            _ => "random exploration (actor + OU)",
        };
        let goal = group.measures_like("goal").first().copied().unwrap_or(Estimate::exact(f64::NAN));
        let bars = PolicyHits { policy: policy.to_owned(), goal, subgoals: group.measures_like("subgoal_") };
        match tasks.iter_mut().find(|known| known.task == task) {
            Some(known) => known.policies.push(bars),
            None => tasks.push(TaskHits { task, policies: vec![bars] }),
        }
    }
    let episodes = means.groups.first().map_or(0.0, |group| group.measures_like("episodes")[0].value);
    HitBars {
        episodes: episodes as usize,
        statistics: Statistics {
            centre: "Mean".to_owned(),
            interval: INTERVAL.to_owned(),
            seeds: means.groups.iter().map(|group| group.count).max().unwrap_or(0),
            fewest_seeds: None,
        },
        tasks,
    }
}
