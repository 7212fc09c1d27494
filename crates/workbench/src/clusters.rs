//! The session's action clusters.

use std::sync::{Arc, Mutex};

use super::command::{Clusters, Command};
use super::job::Reporter;
use super::{Session, SessionError, write_file};
use mge_base::atomic::Target;
use mge_base::sync::lock;
use mge_dynamics::TaskModelConfig;
use mge_guidance::{ActionPrior, GuidanceConfig};
use mge_task::Task;
use mge_trainer::{Phase, PriorSource, RunConfig, build_prior};

/// Whether the clusters match the current task and settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorState {
    /// There are none.
    Absent,
    /// They are being computed: what is done now.
    Building(Phase),
    /// They match the current task and settings.
    Fresh,
    /// The task or the settings have changed since they were computed.
    Stale,
}

/// The clusters of a session and the state of their computation.
#[derive(Debug, Default)]
pub(super) struct ClusterStore {
    /// The latest clusters and their inputs.
    latest: Option<(RolloutInputs, Arc<ActionPrior>)>,
    /// The inputs of the clusters being computed to replace them, and what is done now.
    building: Option<(RolloutInputs, Arc<Mutex<Phase>>)>,
    /// The inputs of the last failed computation, which would fail again.
    failed: Option<RolloutInputs>,
}

/// The inputs of clusters and proposals; when these change, the results are out of date.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RolloutInputs {
    task: Arc<Task>,
    source: PriorSource,
    model: TaskModelConfig,
    guidance: GuidanceConfig,
    seed: u64,
}

impl RolloutInputs {
    /// Those of a configuration, with this task and source of rollouts.
    pub fn of(config: &RunConfig, task: Arc<Task>, source: PriorSource) -> Self {
        Self { task, source, model: config.model, guidance: config.guidance.clone(), seed: config.seed }
    }
}

/// The inputs of clusters.
fn inputs(config: &RunConfig) -> RolloutInputs {
    RolloutInputs::of(config, config.task.clone(), config.rollout_source())
}

fn is_for_the_session(command: &Command) -> bool {
    matches!(command, Command::Clusters(Clusters(None)))
}

impl Session {
    /// Starts computing the clusters for the current task and settings.
    pub(super) fn compute_clusters(&mut self, command: &Clusters) -> Result<String, SessionError> {
        self.setup.config.validate()?;
        // Jobs that write clusters to a file are not cancelled.
        self.cancel_jobs(is_for_the_session);
        let (config, to) = (self.setup.config.clone(), command.0.clone());
        let key = inputs(&config);
        let phase = Arc::default();
        self.clusters.building = Some((key.clone(), Arc::clone(&phase)));
        let work = move |reporter: &Reporter| {
            let on_phase = |now: Phase| {
                *lock(&phase) = now;
                if let Some((done, total, _)) = now.progress() {
                    reporter.progress(done, total);
                }
            };
            let prior = build_prior(&config, on_phase, &reporter.stop)?;
            let saved = to.map(|to| save(&prior, &to)).transpose();
            Ok((prior, saved))
        };
        self.start_job(command.clone(), work, move |session, result| {
            let wanted = session.clusters.building.take_if(|(building, _)| *building == key).is_some();
            if wanted && result.is_err() {
                session.clusters.failed = Some(key.clone());
            }
            let (prior, saved) = result?;
            if wanted {
                session.clusters.latest = Some((key, Arc::new(prior)));
            }
            Ok(saved?.unwrap_or_else(|| "the action clusters are ready".to_owned()))
        });
        Ok("computing the action clusters".to_owned())
    }

    /// Discards the clusters.
    pub(super) fn forget_clusters(&mut self) {
        self.cancel_jobs(is_for_the_session);
        self.clusters = ClusterStore::default();
    }

    /// The action clusters, fresh or stale.
    pub fn prior(&self) -> Option<&Arc<ActionPrior>> {
        self.clusters.latest.as_ref().map(|(_, prior)| prior)
    }

    /// Whether the clusters match the current task and settings.
    pub fn prior_state(&self) -> PriorState {
        let ClusterStore { latest, building, .. } = &self.clusters;
        match (building, latest) {
            (Some((_, phase)), _) => PriorState::Building(*lock(phase)),
            (None, None) => PriorState::Absent,
            (None, Some((key, _))) if *key == inputs(&self.setup.config) => PriorState::Fresh,
            (None, Some(_)) => PriorState::Stale,
        }
    }

    /// Whether the newest clusters, finished or being computed, no longer match the task and
    /// settings, and computing them for these has not already failed.
    pub fn clusters_are_outdated(&self) -> bool {
        let key = inputs(&self.setup.config);
        let ClusterStore { latest, building, failed } = &self.clusters;
        let building = building.as_ref().map(|(key, _)| key);
        let newest = building.or(latest.as_ref().map(|(key, _)| key));
        newest.is_some_and(|newest| *newest != key) && failed.as_ref() != Some(&key)
    }
}

fn save(prior: &ActionPrior, to: &Target) -> Result<String, String> {
    write_file(to, prior.to_json().as_bytes(), &ActionPrior::FORMAT).map_err(|error| error.to_string())?;
    Ok(format!("saved the action clusters to {}", to.path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_trainer::Method;

    #[test]
    fn clusters_are_outdated_by_a_method_with_other_rollouts() {
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let key = |method| inputs(&RunConfig { method, ..config.clone() });
        assert_eq!(key(Method::Ddpg), key(Method::DdpgMge));
        assert_ne!(key(Method::DdpgUniform), key(Method::DdpgMge));
        assert_ne!(key(Method::DdpgMgeTrue), key(Method::DdpgMge));
    }
}
