//! How a training chooses its actions: by the clusters, the actor with noise, the actor alone, a planner or a record.

use rand::Rng;

use super::Training;
use super::evaluation::action_of;
use crate::composition::Actor;
use crate::error::Result;
use crate::exploration::Explorer;
use crate::hold::{Failure, Hold};
use mge_env::Action;
use mge_guidance::{self as guidance, EpsilonSchedule};
use mge_run::Source;

impl Training {
    /// The need for exploration of each stage, the goal last; empty if the schedule does not depend on need.
    pub fn needs(&self) -> Vec<f32> {
        self.progress.attempts.needs(self.schedule(), self.env.task().stage_count())
    }

    /// The epsilon schedule in effect. A schedule that a user has changed in a run that has clusters applies even if
    /// the run began without guidance.
    fn schedule(&self) -> &EpsilonSchedule {
        if self.parts.follows_epsilon || self.has_changed_schedule() {
            &self.progress.epsilon
        } else {
            &EpsilonSchedule::Constant(0.0)
        }
    }

    fn has_changed_schedule(&self) -> bool {
        self.progress.prior.is_some() && self.progress.epsilon != self.config.epsilon
    }

    /// The probability with which the next episode's actions are drawn from the clusters.
    pub(super) fn threshold(&self) -> f32 {
        match (&self.parts.actor, &self.progress.first_success) {
            (Actor::FirstSuccess, None) => 1.0,
            (Actor::FirstSuccess, Some(_)) => 0.0,
            _ if self.parts.has_clusters || self.has_changed_schedule() => {
                self.schedule().threshold(self.progress.episode as u32)
            }
            _ => 0.0,
        }
    }

    /// Draws what chooses the actions of the next stage. Always consumes a random number, so that the
    /// stream does not depend on the schedule.
    pub(super) fn draw(&mut self, threshold: f32) -> Explorer {
        let draw: f32 = self.progress.streams.guidance.r#gen();
        match self.parts.actor {
            Actor::FirstSuccess => Explorer::Clusters,
            _ => self.progress.attempts.explorer(self.schedule(), threshold, self.env.snapshot().stage(), draw),
        }
    }

    /// Chooses the action number `step` of an episode.
    pub(super) fn choose(&mut self, observation: &[f32], explorer: Explorer, step: usize) -> Result<(Action, Source)> {
        let recorded = self.progress.first_success.iter().find_map(|actions| actions.get(step).or(actions.last()));
        if let Some(action) = recorded {
            return Ok((*action, Source::Recorded));
        }
        let (now, streams) = (self.env.snapshot(), &mut self.progress.streams);
        Ok(match (&self.parts.actor, &self.progress.prior) {
            (Actor::Planner(model), _) => {
                let (action, taken) =
                    guidance::plan(&**model, now, &self.config.planner, &self.stop, &mut streams.model)?;
                self.progress.charge(taken);
                (action, Source::Planner)
            }
            (_, Some(prior)) if explorer == Explorer::Clusters => {
                (prior.sample(now.stage(), &mut streams.guidance), Source::Clusters)
            }
            _ if explorer == Explorer::Greedy => (action_of(&self.learner.ddpg.act(observation)), Source::Policy),
            _ => (action_of(&self.learner.explore(observation)), Source::Policy),
        })
    }

    /// Holds a policy only with exploration by need, where greedy attempts measure its success.
    pub(super) fn hold_or_release(&mut self) {
        let is_held = self.learner.ddpg.holds_policy();
        let by_need = matches!(self.schedule(), EpsilonSchedule::Need { .. });
        match by_need && self.parts.hold_tolerance.is_some() {
            true if !is_held => {
                self.progress.hold = Hold::default();
                self.learner.ddpg.hold_policy();
            }
            false if is_held => self.learner.ddpg.release_policy(),
            _ => {}
        }
    }

    /// Records a greedy attempt at a stage, and lets another policy act if the held one has failed too often.
    pub(super) fn note_attempt(&mut self, stage: usize, reached: bool) {
        let EpsilonSchedule::Need { attempts, .. } = *self.schedule() else { return };
        let progress = &mut self.progress;
        progress.attempts.note(stage, reached, attempts);
        let Some(tolerance) = self.parts.hold_tolerance else { return };
        // A policy is judged by the whole way to the goal: early stages are easy and would hide that a late one fails.
        if reached && stage + 1 < self.env.task().stage_count() {
            return;
        }
        let Some(failure) = progress.hold.note(reached, attempts, tolerance) else { return };
        let ddpg = &mut self.learner.ddpg;
        match failure {
            Failure::Proven => {
                ddpg.mark_policy_proven();
                ddpg.hold_policy();
            }
            Failure::Worse => ddpg.return_to_proven_policy(),
            Failure::Unproven => ddpg.hold_policy(),
        }
    }
}
