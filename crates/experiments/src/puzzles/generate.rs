//! Generates random layouts, and decides by play which of them are puzzles.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::index::{Index, Puzzle, Split};
use crate::error::{ExperimentError, finished};
use crate::hits::{FixedPolicy, Guided, Uniform, play};
use mge_base::atomic::Target;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_base::sync::hold_folder;
use mge_env::Environment;
use mge_guidance::{self as guidance, GuidanceConfig, TruePhysics, propose_subgoals};
use mge_physics::ToolKind;
use mge_run::RunError;
use mge_task::{
    self as task, BallSpec, Form, Goal, GoalShape, Placeable, Rules, STANDARD_RADIUS, Task, ToolSpec, VERSION,
};
use mge_trainer::batch::{Batch, BatchProgress, Job, JobHandle};

/// The tool sets of the shipped dynamics models, each with the types that the agent may place. Buckets are
/// not placeable, as they would only hold the ball.
const TOOL_SETS: [(&[ToolKind], &[ToolKind]); 3] = [
    (&[ToolKind::Bucket, ToolKind::Box], &[ToolKind::Box]),
    (&[ToolKind::Square, ToolKind::Floor], &[ToolKind::Square, ToolKind::Floor]),
    (&[ToolKind::Box, ToolKind::Wall, ToolKind::Floor], &[ToolKind::Box, ToolKind::Wall, ToolKind::Floor]),
];
/// Maximum number of tools in a scene.
const MAX_TOOLS: usize = 4;
/// Maximum number of subgoals for guided play.
const SUBGOALS: usize = 2;
/// Number of episodes of the first, cheap check of a layout.
const FIRST_LOOK: u32 = 100;

/// Usual half width of the uniform noise on the ball's start, normalised.
pub const START_NOISE: f32 = 0.01;

/// The criteria by which a layout is accepted as a puzzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// Number of episodes of random and of guided play.
    pub episodes: u32,
    /// Maximum number of these in which random play reaches the goal.
    pub most_random: u32,
    /// Minimum number of these in which play guided by the true physics reaches the goal.
    pub least_guided: u32,
    /// Number of random actions that measure the random hit rate of an accepted puzzle.
    pub random_actions: u64,
}

impl Default for Criteria {
    fn default() -> Self {
        Self { episodes: 1000, most_random: 1, least_guided: 30, random_actions: 1_000_000 }
    }
}

/// Generates puzzles 0 to `count - 1` of the sequence of `wanted` in `folder`, with their index; existing ones
/// are kept. A puzzle depends only on the sequence and its number, not on `count` or threads.
///
/// # Errors
/// [`ExperimentError::OtherPuzzles`] when the folder holds another sequence; [`ExperimentError::NotThePuzzle`], before the work,
/// when another file is in the place of a puzzle; [`ExperimentError::Interrupted`], after the finished puzzles have been
/// written; when files cannot be read or written.
pub fn generate(
    wanted: &Index,
    count: u64,
    criteria: &Criteria,
    folder: impl Into<Target>,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Index, ExperimentError> {
    let to = folder.into();
    let folder = &to.path;
    std::fs::create_dir_all(folder).map_err(RunError::io("create", folder))?;
    // Another process that generates into this folder would lose its part of the index.
    let held = hold_folder(folder, || {
        on_progress(&BatchProgress { message: "waiting for another process", ..BatchProgress::default() });
        !batch.interrupt.is_requested()
    })
    .map_err(RunError::io("write into", folder))?;
    if held.is_none() {
        return Err(ExperimentError::Interrupted { done: 0, jobs: count as usize });
    }
    let mut index = Index::load(folder)?.unwrap_or_else(|| wanted.clone());
    if !index.is_like(wanted) {
        return Err(ExperimentError::OtherPuzzles(folder.clone()));
    }
    // A puzzle whose file is gone is generated again.
    index.puzzles.retain(|puzzle| puzzle.path(folder).exists());
    let known: Vec<u64> = index.puzzles.iter().map(|puzzle| puzzle.number).collect();
    let missing = (0..count).filter(|number| !known.contains(number));
    let missing: Vec<Search<'_>> = missing.map(|number| Search { number, index: wanted, criteria }).collect();
    let names = index.puzzles.iter().map(|puzzle| puzzle.name.clone()).chain(missing.iter().map(Search::name));
    names.map(|name| existing(&folder.join(format!("{name}.json")), &name)).try_for_each(|found| found.map(drop))?;
    let jobs: Vec<_> = missing.into_iter().map(|search| search.job(&to)).collect();
    let (found, interrupted) = finished(batch.run(&jobs, on_progress)?)?;
    index.puzzles.extend(found);
    index.puzzles.sort_by_key(|puzzle| puzzle.number);
    index.save(&to)?;
    match interrupted {
        0 => Ok(index),
        _ => Err(ExperimentError::Interrupted { done: jobs.len() - interrupted, jobs: jobs.len() }),
    }
}

/// The task in the file of a puzzle; none if there is no such file.
///
/// # Errors
/// [`ExperimentError::NotThePuzzle`] when it is not a task of this name.
fn existing(path: &std::path::Path, name: &str) -> Result<Option<Task>, ExperimentError> {
    if path.symlink_metadata().is_err() {
        return Ok(None);
    }
    let task = task::load(&path.display().to_string()).ok().filter(|task| task.name == name);
    task.map(Some).ok_or_else(|| ExperimentError::NotThePuzzle(path.to_owned()))
}

/// The first training puzzle of a seed, with [`START_NOISE`], as `mge puzzles generate --split train` writes it.
///
/// # Errors
/// When guidance fails, or `stop` is requested.
pub fn random_puzzle(seed: u64, stop: &Stop) -> Result<Task, ExperimentError> {
    let index = Index::new(seed, Split::Train, START_NOISE);
    let search = Search { number: 0, index: &index, criteria: &Criteria::default() };
    Ok(Arc::unwrap_or_clone(search.find(&mut search.rng(), stop)?.0))
}

/// The search for one puzzle: draws layouts until one is accepted.
struct Search<'a> {
    number: u64,
    index: &'a Index,
    criteria: &'a Criteria,
}

impl<'a> Search<'a> {
    /// The job that writes the puzzle into `folder`.
    fn job(self, folder: &'a Target) -> Job<'a, Puzzle, ExperimentError> {
        Job::new(self.name(), 1, move |handle| self.search(folder, handle))
    }

    fn name(&self) -> String {
        format!("{}-{}-{:04}", self.index.split.name(), self.index.seed, self.number)
    }

    fn rng(&self) -> ChaCha8Rng {
        Stream::Puzzle { split: self.index.split as u64, number: self.number }.of(self.index.seed)
    }

    fn search(&self, folder: &Target, handle: &JobHandle) -> Result<Option<Puzzle>, ExperimentError> {
        handle.report(self.name());
        let mut rng = self.rng();
        let (task, mut puzzle) = self.find(&mut rng, handle.stop())?;
        // Other episodes than those by which the puzzle was chosen, which have few goals for that reason.
        (puzzle.random_episodes, puzzle.random_goals) =
            play_actions(&task, self.criteria.random_actions, rng.r#gen(), handle.stop())?;
        let to = Target { path: puzzle.path(&folder.path), force: folder.force };
        // A killed process may have written it already.
        if existing(&to.path, &puzzle.name)?.is_some_and(|known| known != *task) {
            return Err(ExperimentError::NotThePuzzle(to.path));
        }
        task::save(&task, to)?;
        Ok(Some(puzzle))
    }

    /// Draws layouts until one is accepted; returns it with its row of the index, which lacks the random hit rate.
    fn find(&self, rng: &mut ChaCha8Rng, stop: &Stop) -> Result<(Arc<Task>, Puzzle), ExperimentError> {
        loop {
            stop.check()?;
            let layout = layout(&self.name(), self.index.start_noise, rng);
            let seed = rng.r#gen();
            if layout.validate().is_err() {
                continue;
            }
            let task = Arc::new(layout);
            if let Some(puzzle) = self.judge(&task, seed, stop)? {
                return Ok((task, puzzle));
            }
        }
    }

    /// Judges a layout: returns the puzzle without its random hit rate, or None if it is too easy or too hard.
    fn judge(&self, task: &Arc<Task>, seed: u64, stop: &Stop) -> Result<Option<Puzzle>, ExperimentError> {
        let Criteria { episodes, most_random, least_guided, .. } = *self.criteria;
        let is_easy = |episodes| Ok::<_, Stopped>(successes(task, &mut Uniform, episodes, seed, stop)?.0 > most_random);
        let first = FIRST_LOOK.min(episodes);
        if is_easy(first)? {
            return Ok(None);
        }
        let config = GuidanceConfig::default();
        let subgoals = propose_subgoals(task, &TruePhysics, SUBGOALS, &config, seed, stop)?;
        let staged = Arc::new(Task { subgoals, ..Task::clone(task) });
        let prior = guidance::build(&staged, &TruePhysics, &config, seed, stop, |_| ())?;
        let guided = |episodes| successes(&staged, &mut Guided(&prior), episodes, seed, stop);
        // Far fewer successes than expected in the first check mean too few in total.
        let expected = least_guided as f32 * first as f32 / episodes as f32;
        if (guided(first)?.0 as f32) < expected / 3.0 {
            return Ok(None);
        }
        let (guided_goals, fewest) = guided(episodes)?;
        let Some(actions_needed) = fewest.filter(|_| guided_goals >= least_guided) else { return Ok(None) };
        if is_easy(episodes)? {
            return Ok(None);
        }
        Ok(Some(Puzzle {
            number: self.number,
            name: task.name.clone(),
            tools: task.tool_set(),
            placeable: task.placeable.kind,
            subgoals: staged.subgoals.len(),
            actions_needed,
            guided_episodes: episodes,
            guided_goals,
            random_episodes: 0,
            random_goals: 0,
        }))
    }
}

/// A random scene with the ball in the upper part, a goal, and a tool to place.
fn layout(name: &str, start_noise: f32, rng: &mut ChaCha8Rng) -> Task {
    // None of the lists is empty.
    let (set, placeable) = TOOL_SETS[rng.gen_range(0..TOOL_SETS.len())];
    let placeable = Placeable { kind: placeable[rng.gen_range(0..placeable.len())], form: Form::default() };
    let count = rng.gen_range(1..=MAX_TOOLS);
    let tools = (0..count)
        .map(|_| ToolSpec {
            kind: set[rng.gen_range(0..set.len())],
            position: place(rng, [-0.9, 0.9], [-0.9, 0.7]),
            form: Form::default(),
        })
        .collect();
    Task {
        version: VERSION,
        name: name.to_owned(),
        description: String::new(),
        tools,
        ball: BallSpec::at(place(rng, [-0.8, 0.8], [0.4, 0.9])),
        marker: None,
        balls: Vec::new(),
        boxes: Vec::new(),
        placeable,
        subgoals: Vec::new(),
        goal: Goal {
            position: place(rng, [-0.9, 0.9], [-0.9, 0.6]),
            radius: STANDARD_RADIUS,
            shape: GoalShape::default(),
        },
        rules: Rules { start_noise, ..Rules::default() },
        order: Vec::new(),
        shifts: Vec::new(),
    }
}

/// A random position in a rectangle, rounded to two decimals.
fn place(rng: &mut ChaCha8Rng, x: [f32; 2], y: [f32; 2]) -> [f32; 2] {
    [x, y].map(|[from, to]| (rng.gen_range(from..=to) * 100.0).round() / 100.0)
}

/// The number of episodes that reached the goal, and the minimum number of actions of one that did.
fn successes(
    task: &Arc<Task>,
    policy: &mut impl FixedPolicy,
    episodes: u32,
    seed: u64,
    stop: &Stop,
) -> Result<(u32, Option<u32>), Stopped> {
    let (mut played, mut goals, mut fewest) = (0, 0, None);
    play(task, policy, seed, stop, |env| {
        played += 1;
        if env.snapshot().goal_reached() {
            goals += 1;
            let actions = env.snapshot().actions();
            fewest = Some(fewest.map_or(actions, |least: u32| least.min(actions)));
        }
        played < episodes
    })?;
    Ok((goals, fewest))
}

/// Plays at random until at least `actions` actions are taken; returns the numbers of episodes, and of those
/// that reached the goal.
fn play_actions(task: &Arc<Task>, actions: u64, seed: u64, stop: &Stop) -> Result<(u64, u64), Stopped> {
    let (mut taken, mut episodes, mut goals) = (0, 0, 0);
    play(task, &mut Uniform, seed, stop, |env: &Environment| {
        taken += u64::from(env.snapshot().actions());
        episodes += 1;
        goals += u64::from(env.snapshot().goal_reached());
        taken < actions
    })?;
    Ok((episodes, goals))
}
