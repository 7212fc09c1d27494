//! What a training learns from its episodes: updates of the networks, refined clusters.

use std::collections::VecDeque;
use std::sync::Arc;

use super::Training;
use crate::error::Result;
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
    ) -> Result<Vec<UpdateMetrics>> {
        if step.reached_stage() {
            self.keep_rewarding(stage, played.take_rewarding(self.config.guidance.rewarding));
        }
        let Some(interval) = self.parts.mastered_update_interval else { return Ok(Vec::new()) };
        let (reward, terminated) = (step.reward, step.terminated);
        self.learner.record(Transition { observation, action: &action, reward, next_observation, terminated })?;
        if step.reached_stage() {
            self.learner.reach(stage);
        }
        Ok(self.learner.update(self.updates(interval))?)
    }

    /// Number of updates after the latest transition. With exploration by need, it is proportional to the greatest need
    /// of a stage, rounded up; while every stage is mastered, one update follows every `interval`th transition.
    fn updates(&self, interval: u64) -> usize {
        let most = self.config.ddpg.updates_per_step;
        match self.needs().into_iter().reduce(f32::max) {
            None => most,
            Some(0.0) => usize::from(self.learner.recorded.is_multiple_of(interval)),
            Some(need) => (need * most as f32).ceil() as usize,
        }
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
    pub fn refine(&mut self) -> Result<Option<Arc<ActionPrior>>> {
        let is_due = self.progress.episode > 0 && self.config.is_refined_after(self.progress.episode);
        if is_due { self.refine_now() } else { Ok(None) }
    }

    /// Like [`refine`](Self::refine), whether or not it is due.
    pub(super) fn refine_now(&mut self) -> Result<Option<Arc<ActionPrior>>> {
        let (Some(prior), Some(refinement)) = (&self.progress.prior, self.parts.refinement) else { return Ok(None) };
        let mut refined = ActionPrior::clone(prior);
        for (stage, actions) in self.progress.rewarding.iter_mut().enumerate() {
            if actions.len() >= refinement.least.max(1) {
                refined = refined.with_actions(stage, actions.make_contiguous(), &self.progress.streams.model)?;
            }
        }
        if refined == **prior {
            return Ok(None);
        }
        self.progress.prior = Some(Arc::new(refined));
        Ok(self.progress.prior.clone())
    }
}
