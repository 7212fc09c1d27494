//! An environment checker modelled on Gymnasium's: it plays a task and checks the contract that agents rely on.

use std::sync::Arc;

use super::action::{Action, EpisodeOver, Placement, Step, uniform_action};
use super::environment::Environment;
use super::episode::Snapshot;
use super::observation::{OBJECT_FEATURES, OBJECT_SLOTS, observation_len};
use mge_base::streams::Stream;
use mge_task::Task;

/// Episodes played for each check.
const EPISODES: u64 = 8;

/// A part of the contract that a task's environment violates.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{contract}: {message}")]
pub struct Violation {
    /// The part that is violated.
    pub contract: Contract,
    /// What happened and when.
    pub message: String,
}

/// The contract of every environment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contract {
    /// Observations have the task's length, are finite, and mark exactly one next stage.
    Observation,
    /// Rewards are finite and within the range that the rules allow.
    Bounds,
    /// An episode ends after at most the maximum number of actions, either terminated or truncated, with a reason;
    /// only then does `step` return an error.
    End,
    /// One seed gives the same episode, bit by bit.
    Determinism,
    /// Different seeds give different starts if the task has start noise. Without noise and random shifts, all starts
    /// are equal.
    Seeding,
    /// A reset, after the end or in the middle of an episode, starts a new episode.
    Reset,
    /// A restored snapshot continues exactly as the original did.
    Snapshot,
    /// Actions are clipped to [-1, 1]; a non-finite action places nothing.
    Clipping,
}

impl std::fmt::Display for Contract {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{self:?}")
    }
}

/// The operations that the checker needs.
trait Subject {
    fn reset(&mut self, seed: u64) -> Vec<f32>;
    fn step(&mut self, action: Action) -> Result<Step, EpisodeOver>;
    fn snapshot(&self) -> Snapshot;
    fn restore(&mut self, snapshot: &Snapshot);
}

impl Subject for Environment {
    fn reset(&mut self, seed: u64) -> Vec<f32> {
        Environment::reset(self, &mut Stream::Episode.of(seed))
    }

    fn step(&mut self, action: Action) -> Result<Step, EpisodeOver> {
        Environment::step(self, action)
    }

    fn snapshot(&self) -> Snapshot {
        Environment::snapshot(self).clone()
    }

    fn restore(&mut self, snapshot: &Snapshot) {
        Environment::restore(self, snapshot);
    }
}

/// Plays the task and reports the first violation of the contract.
///
/// # Errors
/// The first violation.
pub fn check(task: &Arc<Task>) -> Result<(), Violation> {
    check_subject(&mut Environment::new(task.clone()), task)
}

fn check_subject(subject: &mut impl Subject, task: &Task) -> Result<(), Violation> {
    for seed in 0..EPISODES {
        let first = play(subject, task, seed)?;
        expect(Contract::Determinism, play(subject, task, seed)? == first, || {
            format!("two episodes with seed {seed} and the same actions differ")
        })?;
        check_reset_midway(subject, seed, &first)?;
        check_snapshot(subject, seed, &first)?;
    }
    check_seeding(subject, task)?;
    check_clipping(subject)
}

/// An episode as seen by the agent.
#[derive(PartialEq)]
struct Episode {
    start: Vec<f32>,
    steps: Vec<(Action, Step)>,
}

/// Plays one episode of random actions to its end and checks every step.
fn play(subject: &mut impl Subject, task: &Task, seed: u64) -> Result<Episode, Violation> {
    let start = subject.reset(seed);
    check_observation(&start, task, "the reset")?;
    let mut rng = Stream::Episode.of(seed);
    let mut episode = Episode { start, steps: Vec::new() };
    for number in 1..=task.rules.max_actions {
        let when = format!("action {number} of seed {seed}");
        let action = uniform_action(&mut rng);
        let step = subject.step(action);
        let step = step.map_err(|_| violation(Contract::End, format!("{when} is refused before the end")))?;
        check_observation(&step.observation, task, &when)?;
        check_reward(&step, task, &when)?;
        check_flags(&step, &when)?;
        let is_over = step.end.is_some();
        episode.steps.push((action, step));
        if is_over {
            expect(Contract::End, subject.step([0.0; 2]) == Err(EpisodeOver), || {
                format!("a step after {when}, the last, is not refused")
            })?;
            return Ok(episode);
        }
    }
    Err(violation(Contract::End, format!("seed {seed} continues after {} actions", task.rules.max_actions)))
}

fn check_observation(observation: &[f32], task: &Task, when: &str) -> Result<(), Violation> {
    let (length, expected) = (observation.len(), observation_len(task));
    expect(Contract::Observation, length == expected, || format!("{when}: length {length}, not {expected}"))?;
    expect(Contract::Observation, observation.iter().all(|value| value.is_finite()), || {
        format!("{when}: a value is not finite")
    })?;
    let stages = &observation[OBJECT_SLOTS * OBJECT_FEATURES..];
    let marked = stages.iter().filter(|stage| **stage == 1.0).count();
    let blank = stages.iter().filter(|stage| **stage == 0.0).count();
    expect(Contract::Observation, marked == 1 && blank + 1 == stages.len(), || {
        format!("{when}: the next stage is not a one-hot: {stages:?}")
    })
}

/// All reward terms can apply in one action, the subgoal reward several times.
fn check_reward(step: &Step, task: &Task, when: &str) -> Result<(), Violation> {
    let rewards = &task.rules.rewards;
    let marker_subgoals = task.marker.as_ref().map_or(0, |marker| marker.subgoals.len());
    let subgoals = (task.subgoals.len() + marker_subgoals) as f32 * rewards.subgoal;
    let cost = rewards.cost_per_tool * task.rules.max_actions as f32;
    let terms = [rewards.step, rewards.blocked, rewards.goal, rewards.goal - cost, subgoals, rewards.target_moved];
    let highest: f32 = terms.iter().map(|term| term.max(0.0)).sum();
    let lowest: f32 = terms.iter().map(|term| term.min(0.0)).sum();
    expect(Contract::Bounds, (lowest..=highest).contains(&step.reward), || {
        format!("{when}: the reward {} is not in [{lowest}, {highest}]", step.reward)
    })
}

fn check_flags(step: &Step, when: &str) -> Result<(), Violation> {
    let flags = (step.terminated, step.truncated, step.end.is_some());
    expect(Contract::End, matches!(flags, (false, false, false) | (true, false, true) | (false, true, true)), || {
        format!("{when}: terminated, truncated and whether there is a reason are {flags:?}")
    })
}

fn check_reset_midway(subject: &mut impl Subject, seed: u64, episode: &Episode) -> Result<(), Violation> {
    subject.reset(seed);
    let half = &episode.steps[..episode.steps.len() / 2];
    let is_same = half.iter().all(|(action, step)| subject.step(*action).as_ref() == Ok(step));
    expect(Contract::Determinism, is_same, || format!("an episode with seed {seed} differs from the one before"))?;
    let is_fresh = subject.reset(seed) == episode.start;
    expect(Contract::Reset, is_fresh, || format!("a reset midway does not give the start of seed {seed}"))
}

fn check_snapshot(subject: &mut impl Subject, seed: u64, episode: &Episode) -> Result<(), Violation> {
    subject.reset(seed);
    let (before, after) = episode.steps.split_at(episode.steps.len() / 2);
    let differs = || format!("an episode with seed {seed} continues differently when restored midway");
    for (action, _) in before {
        subject.step(*action).map_err(|_| violation(Contract::Snapshot, differs()))?;
    }
    let snapshot = subject.snapshot();
    for _ in 0..2 {
        let is_same = after.iter().all(|(action, step)| subject.step(*action).as_ref() == Ok(step));
        expect(Contract::Snapshot, is_same, differs)?;
        subject.restore(&snapshot);
    }
    Ok(())
}

fn check_seeding(subject: &mut impl Subject, task: &Task) -> Result<(), Violation> {
    let first = subject.reset(0);
    let differs = (1..EPISODES).any(|seed| subject.reset(seed) != first);
    let has_noise = task.rules.start_noise > 0.0;
    // Random shifts may affect parts that the observation does not contain.
    let may_differ = has_noise || !task.shifts.is_empty();
    expect(Contract::Seeding, if differs { may_differ } else { !has_noise }, || match has_noise {
        true => format!("{EPISODES} seeds give one start in spite of the noise"),
        false => "seeds give different starts though there is no noise".to_owned(),
    })
}

fn check_clipping(subject: &mut impl Subject) -> Result<(), Violation> {
    for (outside, clipped) in [([5.0, -7.0], [1.0, -1.0]), ([-1.5, 0.3], [-1.0, 0.3])] {
        subject.reset(0);
        let wide = subject.step(outside);
        subject.reset(0);
        expect(Contract::Clipping, wide == subject.step(clipped), || {
            format!("the action {outside:?} is not taken for {clipped:?}")
        })?;
    }
    for action in [[f32::NAN, 0.0], [0.0, f32::INFINITY]] {
        subject.reset(0);
        let placement = subject.step(action).map(|step| step.placement);
        expect(Contract::Clipping, placement == Ok(Placement::Invalid), || {
            format!("the action {action:?} is not refused as invalid")
        })?;
    }
    Ok(())
}

fn expect(contract: Contract, holds: bool, message: impl FnOnce() -> String) -> Result<(), Violation> {
    if holds { Ok(()) } else { Err(violation(contract, message())) }
}

fn violation(contract: Contract, message: String) -> Violation {
    Violation { contract, message }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_task::shipped;

    #[test]
    fn a_level_with_random_shifts_meets_the_contract() {
        for name in ["create/Push-random", "create/Obstacle-random"] {
            let task = mge_task::load(name).unwrap();
            check(&Arc::new(task)).unwrap_or_else(|violation| panic!("{name}: {violation}"));
        }
    }

    #[test]
    fn every_shipped_task_meets_the_contract() {
        for mut task in shipped() {
            check(&Arc::new(task.clone())).unwrap_or_else(|violation| panic!("{}: {violation}", task.name));
            task.rules.start_noise = 0.05;
            check(&Arc::new(task.clone())).unwrap_or_else(|violation| panic!("{}: {violation}", task.name));
        }
    }

    /// An environment with one fault.
    struct Faulty<F> {
        inner: Environment,
        actions: u32,
        resets: u32,
        fault: F,
    }

    impl<F: Fn(u32, u32, &mut Step)> Subject for Faulty<F> {
        fn reset(&mut self, seed: u64) -> Vec<f32> {
            self.actions = 0;
            self.resets += 1;
            Subject::reset(&mut self.inner, seed)
        }

        fn step(&mut self, action: Action) -> Result<Step, EpisodeOver> {
            self.actions += 1;
            let mut step = self.inner.step(action)?;
            (self.fault)(self.resets, self.actions, &mut step);
            Ok(step)
        }

        fn snapshot(&self) -> Snapshot {
            Subject::snapshot(&self.inner)
        }

        fn restore(&mut self, snapshot: &Snapshot) {
            Subject::restore(&mut self.inner, snapshot);
        }
    }

    #[test]
    fn faults_are_found() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let broken = |fault: fn(u32, u32, &mut Step)| {
            let mut subject = Faulty { inner: Environment::new(task.clone()), actions: 0, resets: 0, fault };
            check_subject(&mut subject, &task).map_err(|violation| violation.contract)
        };
        assert_eq!(broken(|_, _, _| {}), Ok(()));
        assert_eq!(broken(|_, _, step| _ = step.observation.pop()), Err(Contract::Observation));
        assert_eq!(broken(|_, _, step| step.observation[0] = f32::NAN), Err(Contract::Observation));
        assert_eq!(broken(|_, _, step| step.reward = 1e6), Err(Contract::Bounds));
        assert_eq!(broken(|_, _, step| step.end = None), Err(Contract::End));
        assert_eq!(broken(|_, _, step| step.truncated = step.end.is_some()), Err(Contract::End));
        assert_eq!(broken(|resets, _, step| step.reward += 1e-3 * resets as f32), Err(Contract::Determinism));
        // The action counter is not part of the snapshot.
        assert_eq!(broken(|_, actions, step| step.reward -= 1e-4 * actions as f32), Err(Contract::Snapshot));
        assert_eq!(broken(|_, _, step| step.placement = Placement::Overlap), Err(Contract::Clipping));
    }
}
