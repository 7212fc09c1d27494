//! Episodes shown at human speed.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use educe::Educe;

use mge_env::{Environment, Placement};
use mge_physics::{PHYSICS_DT, Tool};
use mge_task::Task;
use mge_trainer::{Source, Trace, TracedStep};

/// An episode to be shown.
#[derive(Debug, Clone)]
pub struct Episode {
    /// The task it was played on.
    pub task: Arc<Task>,
    /// The actions and their results.
    pub trace: Arc<Trace>,
    /// Who acts in it.
    pub origin: Origin,
}

/// Who acts in an episode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// Nobody.
    Untouched,
    /// A person.
    Hand,
    /// The agent of the run in this folder.
    Run(PathBuf),
}

/// The state of an episode at one physics step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlaybackFrame {
    /// The ball, normalised.
    pub ball: [f32; 2],
    /// Its latest positions, oldest first, normalised.
    pub trail: Vec<[f32; 2]>,
    /// Tools placed so far and what chose their positions.
    pub placed: Vec<(Tool, Source)>,
    /// The tool blocked in the current action, at its intended position.
    pub blocked: Option<Tool>,
    /// Subgoals reached so far.
    pub reached: Vec<usize>,
    /// The goal has been reached.
    pub goal: bool,
    /// Sum of the rewards up to and including the current action.
    pub reward: f32,
    /// The current action, counted from 1; 0 before the first.
    pub action: usize,
}

/// Length of the ball's trail in physics steps.
const TRAIL: usize = 60;

impl Episode {
    /// The episode in which no tool is placed.
    pub fn untouched(task: &Arc<Task>) -> Self {
        let mut env = Environment::new(task.clone());
        let mut trace = Trace::default();
        // NaN is not a position, so the action places nothing.
        while trace.step(&mut env, [f32::NAN; 2], Source::Policy).is_ok() {}
        Self { task: task.clone(), trace: Arc::new(trace), origin: Origin::Untouched }
    }

    /// What it is, given the name of its run.
    pub fn title(&self, run: &str) -> String {
        match (&self.origin, self.trace.episode) {
            (Origin::Untouched, _) => "no tool placed".to_owned(),
            (Origin::Hand, _) => "played by hand".to_owned(),
            (Origin::Run(_), 0) => format!("the greedy policy of {run}"),
            (Origin::Run(_), episode) => format!("episode {episode} of {run}"),
        }
    }

    /// Whether it belongs to the run in a folder.
    pub fn is_of(&self, run: &Path) -> bool {
        matches!(&self.origin, Origin::Run(path) if path == run)
    }

    /// Number of physics steps of the episode.
    pub fn steps(&self) -> usize {
        self.trace.steps.iter().map(|step| step.path.len()).sum()
    }

    /// The state after `step` physics steps.
    pub fn at(&self, step: usize) -> PlaybackFrame {
        let mut left = step.min(self.steps());
        let start = self.task.ball.position;
        let shift = self.trace.start.shift;
        let mut path = vec![[start[0] + shift[0], start[1] + shift[1]]];
        let mut frame = PlaybackFrame::default();
        for (index, traced) in self.trace.steps.iter().enumerate() {
            if left == 0 {
                break;
            }
            let shown = left.min(traced.path.len());
            path.extend(&traced.path[..shown]);
            left -= shown;
            frame.action = index + 1;
            frame.reward += traced.reward;
            frame.add(traced, self.task.placeable.tool(traced.action), shown == traced.path.len());
        }
        frame.ball = path[path.len() - 1];
        frame.trail = path.split_off(path.len().saturating_sub(TRAIL));
        frame
    }
}

impl PlaybackFrame {
    /// Adds the placement of an action, and its subgoals and goal once it is `over`.
    fn add(&mut self, step: &TracedStep, tool: Tool, over: bool) {
        if step.placement == Placement::Placed {
            self.placed.push((tool, step.source));
        }
        // An action without a position or a tool is a wait, not a blocked tool.
        self.blocked = Some(tool).filter(|_| matches!(step.placement, Placement::Overlap | Placement::Collision));
        if over {
            self.reached.extend(&step.subgoals);
            self.goal |= step.goal;
        }
    }
}

/// The playback position of an episode.
#[derive(Debug, Clone, Educe)]
#[educe(Default)]
pub struct Player {
    /// Not paused.
    #[educe(Default = true)]
    pub playing: bool,
    /// Held at the start, whether it is playing or not.
    held: bool,
    /// How often the same episode has ended since the last input of the user.
    rounds: u32,
    /// Speed as a multiple of real time.
    #[educe(Default = 4.0)]
    pub speed: f32,
    step: f32,
}

/// Pause at the end of an episode before it is shown again, in seconds.
const END_PAUSE: f32 = 1.0;
/// How often an episode is repeated without input. Then playback stops at its end to save processor time.
const MAX_REPEATS: u32 = 10;
const SPEEDS: [f32; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

impl Player {
    /// The physics step to show.
    pub fn step(&self) -> usize {
        self.step as usize
    }

    /// Back to the start.
    pub fn restart(&mut self) {
        (self.step, self.rounds) = (0.0, 0);
    }

    /// Repeats the episode, unless it was repeated `MAX_REPEATS` times without input.
    pub fn repeat(&mut self) {
        self.rounds = self.rounds.saturating_add(1);
        if !self.is_resting() {
            self.step = 0.0;
        }
    }

    /// Whether playback has stopped until the next input.
    pub fn is_resting(&self) -> bool {
        self.rounds >= MAX_REPEATS
    }

    /// Notes an input of the user.
    pub fn wake(&mut self) {
        self.rounds = 0;
    }

    /// Goes to a physics step without starting or stopping playback.
    pub fn seek(&mut self, step: usize) {
        self.step = step as f32;
    }

    /// Holds the episode at its start, such as while the task is edited, or releases it.
    pub fn hold(&mut self, held: bool) {
        if held != self.held {
            self.restart();
        }
        self.held = held;
    }

    /// Whether playback advances.
    pub fn is_moving(&self) -> bool {
        self.playing && !self.held && !self.is_resting()
    }

    /// Stops or continues playback.
    pub fn toggle(&mut self) {
        self.playing = !self.is_moving();
        (self.held, self.rounds) = (false, 0);
    }

    /// Plays from a physics step.
    pub fn play_from(&mut self, step: usize) {
        (self.step, self.playing, self.held, self.rounds) = (step as f32, true, false, 0);
    }

    /// Lets time pass. True once the episode and the pause after it are over.
    pub fn advance(&mut self, elapsed: Duration, steps: usize) -> bool {
        if self.is_moving() {
            self.step += elapsed.as_secs_f32() * self.speed / PHYSICS_DT;
        }
        self.is_moving() && self.step > steps as f32 + END_PAUSE * self.speed / PHYSICS_DT
    }

    /// Stops `by` physics steps ahead, or back if negative.
    pub fn nudge(&mut self, by: i32, steps: usize) {
        (self.playing, self.held) = (false, false);
        self.step = (self.step.floor() + by as f32).clamp(0.0, steps as f32);
    }

    /// The next faster or slower speed.
    pub fn change_speed(&mut self, faster: bool) {
        let mut speeds = SPEEDS.into_iter();
        let next = if faster { speeds.find(|it| *it > self.speed) } else { speeds.rfind(|it| *it < self.speed) };
        self.speed = next.unwrap_or(self.speed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn untouched() -> Episode {
        Episode::untouched(&Arc::new(mge_task::load("task1").unwrap()))
    }

    #[test]
    fn an_untouched_ball_falls_straight_down() {
        let episode = untouched();
        assert!(episode.steps() >= 200);
        let frame = episode.at(100);
        assert_eq!(frame.ball[0], episode.task.ball.position[0]);
        assert!(frame.ball[1] < episode.task.ball.position[1] && frame.placed.is_empty());
        assert_eq!((frame.action, frame.blocked), (100 / 40 + 1, None));
    }

    #[test]
    fn tools_appear_with_their_action_and_subgoals_at_its_end() {
        let mut episode = untouched();
        let steps = &mut Arc::make_mut(&mut episode.trace).steps;
        (steps[1].action, steps[1].placement, steps[1].subgoals) = ([0.5, 0.5], Placement::Placed, vec![0]);
        (steps[2].action, steps[2].placement) = ([0.5, 0.5], Placement::Overlap);
        assert!(episode.at(40).placed.is_empty());
        let tool = episode.task.placeable.tool([0.5, 0.5]);
        assert_eq!(episode.at(41).placed, [(tool, Source::Policy)]);
        assert!(episode.at(79).reached.is_empty());
        assert_eq!(episode.at(80).reached, [0]);
        assert_eq!(episode.at(81).blocked, Some(tool));
        assert_eq!(episode.at(1_000_000), episode.at(episode.steps()));
    }

    #[test]
    fn the_player_follows_speed_and_stops_for_single_steps() {
        let mut player = Player::default();
        assert!(!player.advance(Duration::from_secs(1), 1000));
        assert!((119..=120).contains(&player.step()));
        player.play_from(120);
        player.nudge(1, 1000);
        assert_eq!((player.step(), player.playing), (121, false));
        assert!(!player.advance(Duration::from_secs(9), 1000));
        assert_eq!(player.step(), 121);
        player.playing = true;
        assert!(player.advance(Duration::from_secs(20), 1000), "the end is reported");
        for _ in 0..20 {
            player.change_speed(true);
        }
        assert_eq!(player.speed, 16.0);
    }

    #[test]
    fn an_episode_is_not_repeated_for_ever_without_input() {
        let mut player = Player::default();
        let mut repeated = 0;
        while player.advance(Duration::from_secs(20), 1000) {
            player.repeat();
            repeated += 1;
        }
        assert_eq!(repeated, MAX_REPEATS);
        assert!(player.step() > 1000 && !player.is_moving(), "it stays at its end");
        player.wake();
        assert!(player.is_moving() && player.advance(Duration::ZERO, 1000), "it is repeated at once");
        (0..MAX_REPEATS).for_each(|_| player.repeat());
        player.toggle();
        assert!(player.is_moving(), "the play key continues it");
    }

    #[test]
    fn a_frame_has_everything_up_to_its_step_and_a_short_trail() {
        let mut episode = untouched();
        let trace = Arc::make_mut(&mut episode.trace);
        trace.start.shift = [0.1, 0.0];
        (trace.steps[1].reward, trace.steps[1].goal, trace.steps[2].reward) = (0.5, true, 0.25);
        let total = trace.total_reward();
        assert_eq!(episode.at(0).ball[0], episode.task.ball.position[0] + 0.1);
        let frame = episode.at(episode.steps());
        assert_eq!((frame.reward, frame.goal, frame.trail.len()), (total, true, TRAIL));
    }

    #[test]
    fn single_steps_stay_within_the_episode_and_playback_rests_at_its_end() {
        let mut player = Player::default();
        player.nudge(-5, 1000);
        assert_eq!(player.step(), 0);
        player.nudge(5000, 1000);
        assert_eq!(player.step(), 1000);
        player.play_from(1000);
        assert!(!player.advance(Duration::from_millis(100), 1000), "it rests there");
        assert!(player.advance(Duration::from_secs(1), 1000), "for a second");
        player.hold(true);
        player.play_from(7);
        assert!(player.is_moving() && player.step() == 7);
        player.hold(true);
        player.nudge(1, 1000);
        player.hold(false);
        assert_eq!(player.step(), 1, "releasing it keeps the position of a single step");
    }
}
