//! What a training learns from its episodes: updates of the networks, imagined transitions, refined clusters.

use std::collections::VecDeque;
use std::sync::Arc;

use super::{Training, TrainingError};
use crate::imagination::imagine;
use crate::method::Method;
use crate::prior::PriorError;
use mge_agent::{Transition, UpdateMetrics};
use mge_env::{Snapshot, Step};
use mge_guidance::{ActionPrior, InterruptibleModel, Played};

impl Training {
    /// Learns from a step towards a stage, given the observations before and after it. If the step reached the stage,
    /// keeps the rewarding actions of `played`.
    pub(super) fn learn_from(
        &mut self,
        stage: usize,
        [observation, next_observation]: [&[f32]; 2],
        action: &[f32],
        step: &Step,
        played: &mut Played,
    ) -> Result<Vec<UpdateMetrics>, TrainingError> {
        if step.reached_stage() {
            self.keep_rewarding(stage, played.take_rewarding(self.config.guidance.rewarding));
        }
        if !self.config.method.learns() {
            return Ok(Vec::new());
        }
        let (reward, terminated) = (step.reward, step.terminated);
        self.learner.record(Transition { observation, action, reward, next_observation, terminated })?;
        if step.reached_stage() {
            self.learner.reach(stage);
        }
        Ok(if self.skips_update() { Vec::new() } else { self.learner.learn()? })
    }

    /// Whether no update follows the latest transition, because every stage is mastered.
    fn skips_update(&self) -> bool {
        if self.learner.recorded().is_multiple_of(self.config.mastered_update_interval.into()) {
            return false;
        }
        let needs = self.current_needs();
        !needs.is_empty() && needs.iter().all(|need| *need == 0.0)
    }

    /// For [`Method::ModelReplay`], adds transitions imagined by the model from the episode's states to the
    /// replay buffer.
    pub(super) fn imagine(&mut self, states: &[Snapshot], noise_scale: f32) -> Result<(), TrainingError> {
        let (Method::ModelReplay, Some(model)) = (self.config.method, &self.model) else { return Ok(()) };
        let model = InterruptibleModel::new(&**model, &self.stop);
        let rng = &mut self.progress.streams.model;
        let config = &self.config;
        let ddpg = self.learner.ddpg();
        let imagined = imagine(&model, &self.env, states, ddpg, &config.model_replay, noise_scale, rng);
        for imagined in imagined.map_err(PriorError::from)? {
            self.learner.record(Transition {
                observation: &imagined.observation,
                action: &imagined.action,
                reward: imagined.reward,
                next_observation: &imagined.next_observation,
                terminated: imagined.terminated,
            })?;
        }
        Ok(())
    }

    fn keep_rewarding(&mut self, stage: usize, actions: Vec<Vec<f32>>) {
        if self.config.refinement.every == 0 || !self.config.method.uses("refinement") {
            return;
        }
        let stages = self.env.task().stage_count();
        self.progress.rewarding.resize(stages, VecDeque::new());
        let kept = &mut self.progress.rewarding[stage];
        kept.extend(actions);
        kept.drain(..kept.len().saturating_sub(self.config.refinement.most));
    }

    /// If it is due, rebuilds clusters from the agent's own rewarding actions for stages that have
    /// enough of them. Returns the prior if it changed; with several tasks, if that of the first changed.
    ///
    /// # Errors
    /// When a rewarding action is not finite.
    pub fn refine(&mut self) -> Result<Option<Arc<ActionPrior>>, TrainingError> {
        let Some((round, played)) = self.latest_turn() else { return Ok(None) };
        let every = u64::from(self.config.refinement.every);
        if every == 0 || !round.is_multiple_of(every) {
            return Ok(None);
        }
        let changed = self.on_task(played, Self::refine_now)?;
        Ok(changed.filter(|_| played == 0))
    }

    /// Like [`refine`](Self::refine), whether or not it is due.
    pub(super) fn refine_now(&mut self) -> Result<Option<Arc<ActionPrior>>, TrainingError> {
        let Some(prior) = &self.progress.prior else { return Ok(None) };
        let mut refined = ActionPrior::clone(prior);
        for (stage, actions) in self.progress.rewarding.iter_mut().enumerate() {
            if actions.len() >= self.config.refinement.least.max(1) {
                let clustered = refined.with_actions(stage, actions.make_contiguous(), &self.progress.streams.model);
                refined = clustered.map_err(PriorError::from)?;
            }
        }
        if refined == **prior {
            return Ok(None);
        }
        self.progress.prior = Some(Arc::new(refined));
        Ok(self.progress.prior.clone())
    }
}
