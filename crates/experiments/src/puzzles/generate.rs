//! Generates random layouts, and decides by uniformly random play which of them are puzzles.

use std::cell::Cell;
use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::index::{Index, Puzzle};
use crate::error::{ExperimentError, Result, finished};
use crate::play::play;
use mge_base::atomic::Target;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_base::sync::hold_folder;
use mge_base::text::counted;
use mge_env::{Environment, uniform_action};
use mge_physics::{ToolKind, to_normalised};
use mge_run::RunError;
use mge_task::{self as task, BallSpec, Form, Goal, Placeable, Rules, Task, ToolSpec};
use mge_trainer::batch::{Batch, Job, JobHandle};

/// Maximum number of tools in a scene.
const MAX_TOOLS: usize = 6;
/// A layout is judged early once its number of goals is this many standard deviations away from the limit.
const CERTAINTY: f64 = 3.0;
/// Share of the episodes after which a layout is refused if the ball was always far from the goal when an action began.
const FIRST_LOOK: f64 = 0.1;
/// Distance that is far, normalised: nearly twice that at which the ball touches the goal.
const FAR: f32 = 0.35;

/// Usual half width of the uniform noise on the ball's start, normalised.
pub const START_NOISE: f32 = 0.01;

/// How often uniformly random play must reach the goal of a layout that is accepted as a puzzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// Number of episodes.
    pub episodes: u64,
    /// Minimum number of these that reach the goal. Goals must come at this pace from the beginning.
    pub least: u64,
    /// Maximum number of these that reach the goal.
    pub most: u64,
    /// Number of further random actions that measure the random hit rate of an accepted puzzle.
    pub random_actions: u64,
}

impl Default for Criteria {
    fn default() -> Self {
        Self { episodes: 300_000, least: 3, most: 300, random_actions: 1_000_000 }
    }
}

/// Why a layout is no puzzle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Refusal {
    TooEasy,
    TooHard,
}

impl Criteria {
    /// Plays a layout at random until it is decided; None if it is a puzzle.
    fn refuse(&self, task: &Arc<Task>, seed: u64, stop: &Stop) -> Result<Option<Refusal>, Stopped> {
        let (nearest, mut episodes, mut goals, mut verdict) = (Cell::new(f32::INFINITY), 0, 0, None);
        let act = |env: &Environment, rng: &mut ChaCha8Rng| {
            let ([x, y], goal) = (to_normalised(env.snapshot().ball().position), task.goal.position);
            nearest.set(nearest.get().min((x - goal[0]).hypot(y - goal[1])));
            uniform_action(rng)
        };
        play(task, act, seed, stop, |env| {
            episodes += 1;
            goals += u64::from(env.snapshot().goal_reached);
            verdict = self.judge(episodes, goals, nearest.get());
            verdict.is_none()
        })?;
        Ok(verdict.flatten())
    }

    /// The verdict after some episodes, of which some reached the goal, and in which the ball came this near to the goal;
    /// None as long as it is open.
    fn judge(&self, episodes: u64, goals: u64, nearest: f32) -> Option<Option<Refusal>> {
        let share = episodes as f64 / self.episodes as f64;
        let limit = share * self.most as f64;
        let margin = if episodes < self.episodes { CERTAINTY * (limit.sqrt() + 1.0) } else { 0.0 };
        if goals as f64 > limit + margin {
            return Some(Some(Refusal::TooEasy));
        }
        if goals < self.least * episodes / self.episodes || share >= FIRST_LOOK && nearest > FAR {
            return Some(Some(Refusal::TooHard));
        }
        (goals >= self.least && goals as f64 <= limit - margin).then_some(None)
    }
}

/// Generates puzzles 0 to `count - 1` of the sequence of `wanted` in `folder`, with their index; existing ones
/// are kept. A puzzle depends only on the sequence and its number, not on `count` or threads.
///
/// # Errors
/// When the folder holds another sequence, or another file is in the place of a puzzle; [`ExperimentError::Interrupted`],
/// after the finished puzzles have been written; when files cannot be read or written.
pub fn generate(
    wanted: &Index,
    count: u64,
    criteria: &Criteria,
    folder: impl Into<Target>,
    batch: &mut Batch<'_>,
) -> Result<Index> {
    let to = folder.into();
    let folder = &to.path;
    std::fs::create_dir_all(folder).map_err(RunError::io("create", folder))?;
    // Another process that generates into this folder would lose its part of the index.
    let held = hold_folder(folder, || !batch.interrupt.is_requested()).map_err(RunError::io("write into", folder))?;
    if held.is_none() {
        return Err(ExperimentError::Interrupted { done: 0, jobs: count as usize });
    }
    let mut index = Index::load(folder)?.unwrap_or_else(|| wanted.clone());
    if !index.is_like(wanted) {
        let refusal = "these puzzles have another seed, split or start noise: choose another folder with --out";
        return Err(ExperimentError::Refused(format!("{}: {refusal}", folder.display())));
    }
    // A puzzle whose file is gone is generated again.
    index.puzzles.retain(|puzzle| puzzle.path(folder).exists());
    let known: Vec<u64> = index.puzzles.iter().map(|puzzle| puzzle.number).collect();
    let missing = (0..count).filter(|number| !known.contains(number));
    let missing: Vec<Search<'_>> = missing.map(|number| Search { number, index: wanted, criteria }).collect();
    let jobs: Vec<_> = missing.into_iter().map(|search| search.job(&to)).collect();
    let (found, ended) = finished(batch.run(&jobs)?)?;
    index.puzzles.extend(found);
    index.puzzles.sort_by_key(|puzzle| puzzle.number);
    index.save(&to)?;
    ended.map(|()| index)
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

    /// Draws layouts until one is accepted, measures how often random play solves it, and writes it into `folder`.
    fn search(&self, folder: &Target, handle: &JobHandle) -> Result<Option<Puzzle>> {
        let Self { number, index, criteria } = *self;
        let mut rng = Stream::Puzzle { split: index.split as u64, number }.of(index.seed);
        let (name, stop) = (self.name(), handle.stop());
        let (mut too_easy, mut too_hard) = (0, 0);
        let task = loop {
            handle.report(format!("{name}, {} tried", counted(too_easy + too_hard, "layout")));
            let task = Arc::new(layout(&name, index.start_noise, &mut rng));
            let seed = rng.r#gen();
            if task.validate().is_err() {
                continue;
            }
            match criteria.refuse(&task, seed, stop)? {
                Some(Refusal::TooEasy) => too_easy += 1,
                Some(Refusal::TooHard) => too_hard += 1,
                None => break task,
            }
        };
        // Other episodes than those by which the puzzle was chosen.
        let (random_episodes, random_goals) = play_actions(&task, criteria.random_actions, rng.r#gen(), stop)?;
        let (tools, placeable) = (task.tool_set(), task.placeable.kind);
        let puzzle = Puzzle { number, name, tools, placeable, too_easy, too_hard, random_episodes, random_goals };
        // A killed process may have written the same already.
        task::save_as(&task, Target { path: puzzle.path(&folder.path), force: folder.force })?;
        Ok(Some(puzzle))
    }
}

/// A random scene of the paper's tools (section 5.1) with the ball in the upper part, a goal, and a tool to place.
fn layout(name: &str, start_noise: f32, rng: &mut ChaCha8Rng) -> Task {
    let kind = |rng: &mut ChaCha8Rng| ToolKind::PAPER[rng.gen_range(0..ToolKind::PAPER.len())];
    let placeable = Placeable { kind: kind(rng), form: Form::default() };
    let count = rng.gen_range(1..=MAX_TOOLS);
    let tools = (0..count)
        .map(|_| ToolSpec { kind: kind(rng), position: place(rng, [-0.9, 0.9], [-0.9, 0.7]), form: Form::default() })
        .collect();
    Task {
        name: name.to_owned(),
        tools,
        ball: BallSpec::at(place(rng, [-0.8, 0.8], [0.4, 0.9])),
        placeable,
        goal: Goal::at(place(rng, [-0.9, 0.9], [-0.9, 0.6])),
        rules: Rules { start_noise, ..Rules::default() },
        ..Task::default()
    }
}

/// A random position in a rectangle, rounded to two decimals.
fn place(rng: &mut ChaCha8Rng, x: [f32; 2], y: [f32; 2]) -> [f32; 2] {
    [x, y].map(|[from, to]| (rng.gen_range(from..=to) * 100.0).round() / 100.0)
}

/// Plays at random until at least `actions` actions are taken; returns the numbers of episodes, and of those
/// that reached the goal.
fn play_actions(task: &Arc<Task>, actions: u64, seed: u64, stop: &Stop) -> Result<(u64, u64), Stopped> {
    let (mut taken, mut episodes, mut goals) = (0, 0, 0);
    play(
        task,
        |_, rng| uniform_action(rng),
        seed,
        stop,
        |env| {
            taken += u64::from(env.snapshot().actions);
            episodes += 1;
            goals += u64::from(env.snapshot().goal_reached);
            taken < actions
        },
    )?;
    Ok((episodes, goals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_is_judged_as_soon_as_its_rate_is_certain() {
        let judge = |episodes, goals, nearest| Criteria::default().judge(episodes, goals, nearest);
        let (near, far) = (0.1, 0.5);
        assert_eq!(judge(1, 1, near), None, "one goal proves nothing");
        assert_eq!(judge(10, 9, near), Some(Some(Refusal::TooEasy)));
        assert_eq!(judge(10_000, 30, near), Some(Some(Refusal::TooEasy)), "three of a thousand");
        assert_eq!(judge(10_000, 15, near), None);
        assert_eq!(judge(20_000, 2, near), None);
        assert_eq!(judge(20_000, 3, near), Some(None), "enough, and far fewer than one of a thousand");
        assert_eq!(judge(99_999, 0, near), None);
        assert_eq!(judge(100_000, 0, near), Some(Some(Refusal::TooHard)));
        assert_eq!((judge(29_999, 0, far), judge(30_000, 0, far)), (None, Some(Some(Refusal::TooHard))));
        assert_eq!((judge(299_999, 299, near), judge(300_000, 300, near)), (None, Some(None)));
        assert_eq!(judge(300_000, 301, near), Some(Some(Refusal::TooEasy)));
        assert_eq!(judge(300_000, 2, near), Some(Some(Refusal::TooHard)));
    }
}
