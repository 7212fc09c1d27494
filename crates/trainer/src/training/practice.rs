//! Practice: rollouts from stage to stage in the real environment, before the first episode.

use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::Training;
use crate::error::{Result, TrainerError};
use crate::parts::Practice;
use crate::prior::rollout_model;
use crate::watch::Phase;
use mge_base::streams::Stream;
use mge_env::Snapshot;
use mge_guidance::{self as guidance, ActionPrior, EndStates, Played};
use mge_run::Practised;

/// Number of rollouts towards a stage after which its clusters are refined.
const ROUND: u32 = 5;

impl Training {
    /// Practises, if configured and not yet done. The clusters are [built](guidance::build_with) stage by stage, where
    /// practice makes the real rollouts: actions from the clusters are rolled out from stage to stage, and the agent
    /// learns from them as from episodes. After every round, the clusters are [refined](crate::Refinement) from the
    /// rewarding actions, if refinement is on. After a stage that is not reached, no further one is practised. Clusters
    /// that the training was given are not built again.
    ///
    /// # Errors
    /// When the model cannot be used, the learner diverges, or a stop is requested.
    pub fn practise(&mut self) -> Result<Option<Practised>> {
        // Practice precedes all other steps of a run.
        let is_due = self.progress.environment_steps == 0;
        let Some(practice) = self.parts.practice.filter(|_| is_due) else { return Ok(None) };
        let (task, stages) = (self.config.task.clone(), self.config.task.stage_count());
        let (stop, phase) = (self.stop.clone(), self.phase.clone());
        let (prior, model) = match self.progress.prior.as_deref() {
            Some(given) => (given.clone(), None),
            None => {
                let model = rollout_model(&self.config.rollout_source(), &self.config, |now| phase.set(now), &stop)?;
                (ActionPrior::uniform(&task, &self.config.guidance, self.config.seed), model)
            }
        };
        let mut rng = Stream::Practice.of(self.config.seed);
        let mut practised = Practised::default();
        let mut is_reached = true;
        let on_stage = |stage| phase.set(Phase::BuildingPrior { stage, stages });
        let play = |prior: &mut ActionPrior, stage: usize, starts: &[Snapshot], _: &mut ChaCha8Rng| {
            if !is_reached {
                return Ok(EndStates::default());
            }
            self.progress.prior = Some(Arc::new(prior.clone()));
            let ends = self.practise_stage(practice, stage, starts, &mut practised, &mut rng)?;
            // Refined by what practice found.
            if let Some(refined) = self.progress.prior.as_deref() {
                prior.clone_from(refined);
            }
            let built = &mut prior.stages[stage];
            // One count for each stage so far.
            built.environment_rollouts = practised.rollouts[stage] as usize;
            built.environment_hits = practised.reached[stage] as usize;
            is_reached = !ends.reached.is_empty();
            Ok::<_, TrainerError>(ends)
        };
        let prior = guidance::build_with(prior, &task, model.as_deref(), &stop, on_stage, play)?;
        if model.is_some() {
            self.progress.charge(prior.environment_actions());
        }
        self.progress.prior = Some(Arc::new(prior));
        self.progress.take_actions(practised.actions);
        self.phase.set(Phase::Training);
        Ok(Some(practised))
    }

    /// Practises a stage from the states `starts`; the first one from the start of the task, with its noise.
    fn practise_stage(
        &mut self,
        practice: Practice,
        stage: usize,
        starts: &[Snapshot],
        practised: &mut Practised,
        rng: &mut ChaCha8Rng,
    ) -> Result<EndStates> {
        let mut ends = EndStates::default();
        // At least one, unless the stage is the first: the stage before was reached.
        let starts: Vec<&Snapshot> = starts.iter().filter(|start| start.stage() == stage).collect();
        let (mut rollouts, mut reached) = (0, 0);
        let stages = self.env.task().stage_count();
        while rollouts < practice.rollouts && reached < practice.enough {
            for _ in 0..ROUND.min(practice.rollouts - rollouts) {
                // Others may already have noted that the training has ended.
                self.stop.check()?;
                match stage {
                    0 => drop(self.env.reset(rng)),
                    _ => self.env.restore(starts[rng.gen_range(0..starts.len())]),
                }
                self.phase.set(Phase::Practising { stage, stages, rollouts, reached });
                rollouts += 1;
                let is_reached = self.practise_rollout(&mut practised.actions, rng)?;
                reached += u32::from(is_reached);
                let end = self.env.snapshot();
                if end.end().is_none() {
                    ends.last.push(end.clone());
                    // It may have reached the following stage at the same time.
                    if is_reached && end.stage() == stage + 1 {
                        ends.reached.push(end.clone());
                    }
                }
            }
            self.refine_now()?;
        }
        practised.rollouts.push(rollouts);
        practised.reached.push(reached);
        Ok(ends)
    }

    /// Makes a rollout from the environment's current state. Returns whether it reached the stage.
    fn practise_rollout(&mut self, actions: &mut u64, rng: &mut ChaCha8Rng) -> Result<bool> {
        let Some(prior) = self.progress.prior.clone() else { return Ok(false) };
        self.learner.start_episode();
        let stage = self.env.snapshot().stage();
        let mut played = Played::after(self.env.snapshot().placed.len());
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
    use super::*;
    use crate::{Method, PriorSource, Refinement, RunConfig, Watch, build_prior};
    use mge_agent::ImitationConfig;
    use mge_base::stop::Stop;
    use mge_guidance::{EpsilonSchedule, StagePrior};
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
        Training::new(config.clone(), None).unwrap()
    }

    #[test]
    fn every_stage_is_practised_until_it_is_reached_often_enough() {
        let mut training = training(&config());
        let built = build_prior(&config(), |_| (), &Stop::default()).unwrap();
        let practised = training.practise().unwrap().unwrap();
        assert_eq!(practised.rollouts.len(), 3, "two subgoals and the goal: {practised:?}");
        for (rollouts, reached) in practised.rollouts.iter().zip(&practised.reached) {
            assert!(*rollouts <= 60 && (*reached >= 10 || *rollouts == 60), "{practised:?}");
        }
        let most = practised.rollouts.iter().sum::<u32>() * training.config.guidance.horizon as u32;
        assert!(practised.rollouts[0] < 60, "no more rollouts than needed: {practised:?}");
        assert!(practised.reached[0] >= 10 && practised.actions <= u64::from(most), "{practised:?}");
        // Practice is learned from, counted, and refines the clusters.
        assert_eq!(training.transitions(), practised.actions);
        let refined = training.prior().unwrap();
        assert_eq!(refined.stages[0].model_rollouts, built.stages[0].model_rollouts);
        assert_ne!(refined.stages[0].clusters, built.stages[0].clusters);
        // Its states are the start states of the rollouts towards the next stage.
        let counts =
            |stage: &StagePrior| [stage.environment_rollouts, stage.environment_hits].map(|count| count as u32);
        for (stage, counted) in refined.stages.iter().zip(practised.rollouts.iter().zip(&practised.reached)) {
            assert_eq!(counts(stage), [*counted.0, *counted.1]);
            assert!(stage.model_hits > 0);
        }
        assert!(training.practise().unwrap().is_none(), "practice happens only once");
        let (record, _) = training.run_episode().unwrap();
        assert_eq!(record.environment_steps, practised.actions + record.steps);
    }

    #[test]
    fn practice_reports_its_progress() {
        let mut training = training(&config());
        let (watch, stop) = (Watch::default(), Stop::default());
        training.phase = watch.phase.clone();
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
        let mut training = training(&config);
        let practised = training.practise().unwrap().unwrap();
        assert_eq!((practised.rollouts.len(), practised.rollouts[1], practised.reached[1]), (2, 60, 0));
        let [_, missed, goal] = &training.prior().unwrap().stages[..] else { panic!("three stages") };
        assert!(missed.model_rollouts > 0 && goal.model_rollouts > 0 && goal.environment_rollouts == 0);
    }

    #[test]
    fn clusters_that_were_given_are_practised_and_not_built_again() {
        let mut training = training(&config());
        let mut given = ActionPrior::uniform(&config().task, &config().guidance, 7);
        given.stages[0] = build_prior(&config(), |_| (), &Stop::default()).unwrap().stages.remove(0);
        training.set_prior(Arc::new(given));
        training.practise().unwrap().unwrap();
        let prior = training.prior().unwrap();
        assert_eq!((prior.seed, prior.stages[1].model_rollouts), (7, 0));
        assert!(prior.stages[0].environment_rollouts > 0);
    }

    #[test]
    fn nothing_is_practised_without_clusters_or_without_rollouts() {
        let mut config = config();
        config.epsilon = EpsilonSchedule::Constant(0.0);
        assert!(training(&config).practise().unwrap().is_none());
        config = self::config();
        config.practice.rollouts = 0;
        assert!(training(&config).practise().unwrap().is_none());
    }

    #[test]
    fn practice_can_be_stopped() {
        let mut training = training(&config());
        let stop = Stop::default();
        stop.request();
        training.stop_on(&stop);
        assert!(matches!(training.practise(), Err(TrainerError::Stopped(_))));
    }
}
