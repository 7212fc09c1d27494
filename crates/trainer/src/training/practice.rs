//! Practice: rollouts from stage to stage in the real environment, before the first episode.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::{Training, TrainingError};
use crate::parts::Practice;
use crate::watch::Phase;
use mge_base::streams::Stream;
use mge_env::Snapshot;
use mge_guidance::Played;
use mge_run::Practised;

/// Number of rollouts towards a stage after which its clusters are refined.
const ROUND: u32 = 25;

impl Training {
    /// Practises, if configured and not yet done. As when the prior is [built](mge_guidance::build), actions from
    /// the clusters are rolled out from stage to stage, here in the real environment. The agent learns from them as
    /// from episodes. After every round, the clusters are [refined](crate::Refinement) from the rewarding
    /// actions, if refinement is on. Practice ends at a stage that is not reached.
    ///
    /// # Errors
    /// When the learner diverges, or a stop is requested.
    pub fn practise(&mut self) -> Result<Option<Practised>, TrainingError> {
        // Practice precedes all other steps of a run.
        let is_due = self.progress.environment_steps == 0 && self.progress.prior.is_some();
        let Some(practice) = self.parts.practice.filter(|_| is_due) else { return Ok(None) };
        let mut rng = Stream::Practice.of(self.config.seed);
        let mut practised = Practised::default();
        let mut starts = Vec::new();
        for stage in 0..self.env.task().stage_count() {
            starts = self.practise_stage(practice, stage, &starts, &mut practised, &mut rng)?;
            // Some may have reached the following stage at the same time.
            starts.retain(|state| state.stage() == stage + 1);
            if starts.is_empty() {
                break;
            }
        }
        self.progress.take_actions(practised.actions);
        self.phase.set(Phase::Training);
        Ok(Some(practised))
    }

    /// Practises the next stage from the states `starts`, or from the start of the task if there are none. Returns the
    /// states in which it was reached, without those of ended episodes.
    fn practise_stage(
        &mut self,
        practice: Practice,
        stage: usize,
        starts: &[Snapshot],
        practised: &mut Practised,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<Snapshot>, TrainingError> {
        let mut states = Vec::new();
        let (mut rollouts, mut reached) = (0, 0);
        let stages = self.env.task().stage_count();
        while rollouts < practice.rollouts && reached < practice.enough {
            for _ in 0..ROUND.min(practice.rollouts - rollouts) {
                // Others may already have noted that the training has ended.
                self.stop.check()?;
                match starts.len() {
                    0 => drop(self.env.reset(rng)),
                    count => self.env.restore(&starts[rng.gen_range(0..count)]),
                }
                self.phase.set(Phase::Practising { stage, stages, rollouts, reached });
                rollouts += 1;
                if self.practise_rollout(&mut practised.actions, rng)? {
                    reached += 1;
                    if self.env.snapshot().end().is_none() {
                        states.push(self.env.snapshot().clone());
                    }
                }
            }
            self.refine_now()?;
        }
        practised.rollouts.push(rollouts);
        practised.reached.push(reached);
        Ok(states)
    }

    /// Makes a rollout from the environment's current state. Returns whether it reached the stage.
    fn practise_rollout(&mut self, actions: &mut u64, rng: &mut ChaCha8Rng) -> Result<bool, TrainingError> {
        let Some(prior) = self.progress.prior.clone() else { return Ok(false) };
        self.learner.start_episode();
        let stage = self.env.snapshot().stage();
        let mut played = Played::after(self.env.snapshot().placed().len());
        let mut observation = self.env.observation();
        for _ in 0..prior.horizon(stage) {
            self.stop.check()?;
            let action = prior.sample(self.env.snapshot().stage(), rng);
            let Ok(step) = self.env.step(action) else { break };
            *actions += 1;
            played.note(action, &step);
            self.learn_from(stage, [&observation, &step.observation], action, &step, &mut played)?;
            if step.reached_stage() || step.end.is_some() {
                return Ok(step.reached_stage());
            }
            observation = step.observation;
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Method, PriorSource, Refinement, RunConfig, Watch, build_prior};
    use mge_agent::ImitationConfig;
    use mge_base::stop::Stop;
    use mge_guidance::EpsilonSchedule;
    use mge_task::load;

    fn config() -> RunConfig {
        let mut config = RunConfig::new(Arc::new(load("task2").unwrap()));
        config.method = Method::DdpgMge;
        config.prior = PriorSource::TruePhysics;
        config.epsilon = EpsilonSchedule::Constant(0.5);
        config.ddpg.hidden = 8;
        config.ddpg.imitation = ImitationConfig { share: 0.5, ..config.ddpg.imitation };
        config.refinement = Refinement { every: 50, least: 4, most: 100 };
        config.practice = Practice { rollouts: 60, enough: 10 };
        config
    }

    fn training(config: &RunConfig) -> Training {
        let prior = Some(Arc::new(build_prior(config, |_| (), &Stop::default()).unwrap()));
        Training::new(config.clone(), prior).unwrap()
    }

    #[test]
    fn every_stage_is_practised_until_it_is_reached_often_enough() {
        let mut training = training(&config());
        let built = training.prior().cloned().unwrap();
        let practised = training.practise().unwrap().unwrap();
        assert_eq!(practised.rollouts.len(), 3, "two subgoals and the goal: {practised:?}");
        for (rollouts, reached) in practised.rollouts.iter().zip(&practised.reached) {
            assert!(*rollouts <= 60 && (*reached >= 10 || *rollouts == 60), "{practised:?}");
        }
        let most = practised.rollouts.iter().sum::<u32>() * training.config().guidance.horizon as u32;
        assert!(practised.rollouts[0] < 60, "no more rollouts than needed: {practised:?}");
        assert!(practised.reached[0] >= 10 && practised.actions <= u64::from(most), "{practised:?}");
        // Practice is learned from, counted, and refines the clusters.
        assert_eq!(training.transitions(), practised.actions);
        let refined = training.prior().unwrap();
        assert_ne!(refined.stages[0].clusters, built.stages[0].clusters);
        assert!(training.practise().unwrap().is_none(), "practice happens only once");
        let (record, _) = training.run_episode().unwrap();
        assert_eq!(record.environment_steps, practised.actions + record.steps);
    }

    #[test]
    fn practice_reports_its_progress() {
        let mut training = training(&config());
        let (watch, stop) = (Watch::default(), Stop::default());
        training.share_phase(watch.shared_phase());
        training.stop_on(&stop);
        assert_eq!(watch.phase(), Phase::Waiting);
        let work = std::thread::spawn(move || training.practise().unwrap());
        let mut seen = Vec::new();
        while !work.is_finished() {
            if let Phase::Practising { stage, stages, rollouts, reached } = watch.phase() {
                assert!(stage < stages && stages == 3 && reached <= rollouts && rollouts < 60);
                seen.push((stage, rollouts));
            }
            std::thread::yield_now();
        }
        assert!(seen.len() > 1 && seen.is_sorted(), "{seen:?}");
        assert_eq!(watch.phase(), Phase::Training, "it is over");
        assert!(work.join().unwrap().is_some());
    }

    #[test]
    fn the_agent_learns_while_it_practises() {
        let mut training = training(&config());
        let observation = vec![0.1; training.ddpg().observation_len()];
        let before = training.ddpg().act(&observation);
        training.practise().unwrap();
        assert_ne!(training.ddpg().act(&observation), before);
    }

    #[test]
    fn stages_after_one_that_is_not_reached_are_not_practised() {
        let mut config = config();
        let mut task = (*config.task).clone();
        // A position that no ball reaches.
        task.subgoals[1].position = [0.99, 0.99];
        task.subgoals[1].radius = 0.1;
        config.task = Arc::new(task);
        let practised = training(&config).practise().unwrap().unwrap();
        assert_eq!((practised.rollouts.len(), practised.rollouts[1], practised.reached[1]), (2, 60, 0));
    }

    #[test]
    fn nothing_is_practised_without_clusters_or_without_rollouts() {
        let mut without = Training::new(config(), None).unwrap();
        assert!(without.practise().unwrap().is_none());
        let mut config = config();
        config.practice.rollouts = 0;
        assert!(training(&config).practise().unwrap().is_none());
    }

    #[test]
    fn practice_can_be_stopped() {
        let mut training = training(&config());
        let stop = Stop::default();
        stop.request();
        training.stop_on(&stop);
        assert!(matches!(training.practise(), Err(TrainingError::Stopped)));
    }
}
