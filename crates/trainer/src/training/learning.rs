//! What a training learns from its episodes: updates of the networks, refined clusters.

use std::collections::VecDeque;
use std::sync::Arc;

use super::{Training, TrainingError};
use crate::prior::PriorError;
use mge_agent::{Transition, UpdateMetrics};
use mge_env::{Action, Step};
use mge_guidance::{ActionPrior, Played};

impl Training {
    /// Learns from a step towards a stage, given the observations before and after it. If the step reached the stage,
    /// keeps the rewarding actions of `played`.
    pub(super) fn learn_from(
        &mut self,
        stage: usize,
        [observation, next_observation]: [&[f32]; 2],
        action: Action,
        step: &Step,
        played: &mut Played,
    ) -> Result<Vec<UpdateMetrics>, TrainingError> {
        if step.reached_stage() {
            self.keep_rewarding(stage, played.take_rewarding(self.config.guidance.rewarding));
        }
        let Some(interval) = self.parts.mastered_update_interval else { return Ok(Vec::new()) };
        let (reward, terminated) = (step.reward, step.terminated);
        self.learner.record(Transition { observation, action: &action, reward, next_observation, terminated })?;
        if step.reached_stage() {
            self.learner.reach(stage);
        }
        Ok(if self.skips_update(interval) { Vec::new() } else { self.learner.learn()? })
    }

    /// Whether no update follows the latest transition, because every stage is mastered.
    fn skips_update(&self, interval: u64) -> bool {
        if self.learner.recorded().is_multiple_of(interval) {
            return false;
        }
        let needs = self.needs();
        !needs.is_empty() && needs.iter().all(|need| *need == 0.0)
    }

    fn keep_rewarding(&mut self, stage: usize, actions: Vec<Action>) {
        let Some(refinement) = self.parts.refinement else { return };
        let stages = self.env.task().stage_count();
        self.progress.rewarding.resize(stages, VecDeque::new());
        let kept = &mut self.progress.rewarding[stage];
        kept.extend(actions);
        kept.drain(..kept.len().saturating_sub(refinement.most));
    }

    /// If it is due, rebuilds clusters from the agent's own rewarding actions for stages that have
    /// enough of them. Returns the prior if it changed.
    ///
    /// # Errors
    /// When a rewarding action is not finite.
    pub fn refine(&mut self) -> Result<Option<Arc<ActionPrior>>, TrainingError> {
        let is_due = self.progress.episode > 0 && self.config.is_refined_after(self.progress.episode);
        if is_due { self.refine_now() } else { Ok(None) }
    }

    /// Like [`refine`](Self::refine), whether or not it is due.
    pub(super) fn refine_now(&mut self) -> Result<Option<Arc<ActionPrior>>, TrainingError> {
        let (Some(prior), Some(refinement)) = (&self.progress.prior, self.parts.refinement) else { return Ok(None) };
        let mut refined = ActionPrior::clone(prior);
        for (stage, actions) in self.progress.rewarding.iter_mut().enumerate() {
            if actions.len() >= refinement.least.max(1) {
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
