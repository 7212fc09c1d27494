//! Replays actions in a task, and episodes recorded in CREATE.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::catalogue::Catalogue;
use super::level::RecordedLevel;
use super::lines::{Lines, LinesError, write_line};
use super::recorded::Recorded;
use super::scene::{Row, row};
use crate::{Action, ActionSet, Choice, EndReason, Environment, Placement, Step, ball_names};
use mge_base::validation::ValidationError;
use mge_task::Task;

/// CREATE's names of [`EndReason::ALL`], which its recordings have.
const IN_CREATE: [&str; EndReason::ALL.len()] = ["goal", "target_out", "marker_out", "motion_stopped", "max_steps"];

/// The outcome of one action, as a line of JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepLine {
    /// The requested normalised position, preceded by the index into the action set, if there is one.
    pub action: Vec<f32>,
    /// Whether the tool was placed.
    pub outcome: Placement,
    /// Reward of this action.
    pub reward: f32,
    /// The task ended the episode.
    pub terminated: bool,
    /// The maximum number of actions ended the episode.
    pub truncated: bool,
    /// All reasons why the episode is over, in CREATE's terms.
    pub done_reasons: Vec<&'static str>,
    /// The goal has been reached in this episode.
    pub goal_hit: bool,
    /// Indices of the subgoals reached so far.
    pub subgoals_hit: Vec<usize>,
    /// Indices of the marker's subgoals reached so far.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub marker_subgoals_hit: Vec<usize>,
    /// Number of tools placed so far.
    pub placed_tools: usize,
    /// The balls' motion after the action, by name.
    pub balls: BTreeMap<String, Row>,
}

/// A recorded episode: the level, the tool and the actions. The recorded results are ignored.
#[derive(Debug, Deserialize)]
struct RecordedEpisode {
    id: String,
    level: String,
    /// The agent's only tool; with an action set, `inventory` has the tools' numbers instead.
    tool: Option<Recorded>,
    inventory: Option<Vec<usize>>,
    steps: Vec<RecordedStep>,
}

#[derive(Debug, Deserialize)]
struct RecordedStep {
    action: Vec<f32>,
}

/// A replayed episode, as a line of JSON.
#[derive(Debug, Serialize)]
struct EpisodeLine {
    id: String,
    steps: Vec<StepLine>,
}

/// Plays actions from the start of a task, without start noise, until the actions or the episode end.
pub fn replay(task: Arc<Task>, actions: impl IntoIterator<Item = Action>) -> impl Iterator<Item = StepLine> {
    replay_in(Environment::new(task), actions.into_iter().map(Choice::from))
}

fn replay_in(
    mut environment: Environment,
    choices: impl IntoIterator<Item = Choice>,
) -> impl Iterator<Item = StepLine> {
    let names = ball_names(environment.task());
    // After the end of the episode `step` returns an error.
    choices.into_iter().map_while(move |choice| {
        let step = environment.step(choice).ok()?;
        let [x, y] = choice.place;
        let action = if environment.action_set().is_some() { vec![choice.tool as f32, x, y] } else { vec![x, y] };
        Some(step_line(&environment, &names, action, &step))
    })
}

fn step_line(environment: &Environment, names: &[String], action: Vec<f32>, step: &Step) -> StepLine {
    let now = environment.snapshot();
    let hits = |reached: &[bool]| {
        let hit = |(index, reached): (usize, &bool)| reached.then_some(index);
        reached.iter().enumerate().filter_map(hit).collect()
    };
    StepLine {
        action,
        outcome: step.placement,
        reward: step.reward,
        terminated: step.terminated,
        truncated: step.truncated,
        done_reasons: now.reasons.iter().map(|reason| IN_CREATE[*reason as usize]).collect(),
        goal_hit: now.goal_reached,
        subgoals_hit: hits(&now.reached),
        marker_subgoals_hit: hits(&now.reached_by_marker),
        placed_tools: now.placed.len(),
        balls: names.iter().cloned().zip((0..).map(|ball| row(now.world.motion(ball)))).collect(),
    }
}

/// Plays actions in a task and writes one line of JSON per action. Returns how many were played, which is fewer if
/// the episode ends early.
///
/// # Errors
/// When the output cannot be written.
pub fn play_actions(task: Arc<Task>, actions: &[Action], mut output: impl Write) -> io::Result<usize> {
    let mut played = 0;
    for line in replay(task, actions.iter().copied()) {
        write_line(&mut output, &line)?;
        played += 1;
    }
    output.flush()?;
    Ok(played)
}

/// Replays recorded episodes in recorded levels, one line of input and one of output per episode. Action sets refer
/// to tools of the catalogue.
///
/// # Errors
/// At the first line that cannot be read or played, with its number.
pub fn play_episodes(
    levels: impl BufRead,
    levels_origin: &str,
    catalogue: &Catalogue,
    episodes: impl BufRead,
    output: impl Write,
) -> Result<(), LinesError> {
    let mut known: Vec<RecordedLevel> = Vec::new();
    Lines::new(levels, levels_origin).each(|level| {
        known.push(level);
        Ok(())
    })?;
    Lines::new(episodes, "stdin").answer(output, |episode: RecordedEpisode| {
        let steps = episode.play(&known, catalogue)?;
        Ok(EpisodeLine { id: episode.id, steps })
    })
}

impl RecordedEpisode {
    fn play(&self, levels: &[RecordedLevel], catalogue: &Catalogue) -> Result<Vec<StepLine>, ValidationError> {
        let set = self.inventory.as_ref().map(|inventory| catalogue.action_set(inventory)).transpose()?;
        let environment = Environment::new(Arc::new(self.task(levels)?)).with_action_set(set);
        let count = environment.action_set().map(ActionSet::len);
        let choice = |(i, step): (usize, &RecordedStep)| {
            let wrong = |message| Err(ValidationError::new(format_args!("steps[{i}].action"), message));
            match (count, &step.action[..]) {
                (None, &[x, y]) => Ok(Choice::from([x, y])),
                (None, _) => wrong("must be two numbers, [x, y]"),
                (Some(count), &[tool, x, y]) if tool >= 0.0 && tool.fract() == 0.0 && (tool as usize) < count => {
                    Ok(Choice { tool: tool as usize, place: [x, y] })
                }
                (Some(_), _) => wrong("must be an index into the inventory and a place, [index, x, y]"),
            }
        };
        let choices: Vec<Choice> = self.steps.iter().enumerate().map(choice).collect::<Result<_, _>>()?;
        Ok(replay_in(environment, choices).collect())
    }

    fn task(&self, levels: &[RecordedLevel]) -> Result<Task, ValidationError> {
        let Some(level) = levels.iter().find(|level| level.name == self.level) else {
            let message = format_args!("`{}` is not among the levels", self.level);
            return Err(ValidationError::new("level", message));
        };
        level.task(self.tool.as_ref()).map_err(|problem| match problem.path.split('.').next() {
            Some("tool" | "placeable") => problem,
            _ => problem.within(format_args!("level `{}`", self.level)),
        })
    }
}
