//! The action clusters, computed on a thread of their own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;

use crate::guidance::{ActionPrior, GuidanceConfig};
use crate::task::Task;
use crate::trainer::{PriorError, PriorSource, RunConfig, build_prior};

/// What clusters depend on; if it changes, they are out of date.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PriorKey {
    task: Arc<Task>,
    source: PriorSource,
    guidance: GuidanceConfig,
    seed: u64,
}

impl PriorKey {
    pub fn of(config: &RunConfig) -> Self {
        Self {
            task: config.task.clone(),
            source: config.rollout_source(),
            guidance: config.guidance.clone(),
            seed: config.seed,
        }
    }
}

/// A build under way. Dropping it cancels the build before its next stage.
#[derive(Debug)]
pub(super) struct PriorJob {
    pub key: PriorKey,
    pub stages: usize,
    stage: Arc<AtomicUsize>,
    cancelled: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Option<ActionPrior>, PriorError>>>,
}

impl PriorJob {
    pub fn spawn(config: &RunConfig) -> std::io::Result<Self> {
        let stage = Arc::new(AtomicUsize::new(0));
        let cancelled = Arc::new(AtomicBool::new(false));
        let (seen, stop, config) = (stage.clone(), cancelled.clone(), config.clone());
        let key = PriorKey::of(&config);
        let stages = config.task.stage_count();
        let work = move || {
            build_prior(&config, |stage| {
                seen.store(stage, Ordering::Relaxed);
                !stop.load(Ordering::Relaxed)
            })
        };
        let thread = std::thread::Builder::new().name("mge-clusters".to_owned()).spawn(work)?;
        Ok(Self { key, stages, stage, cancelled, thread: Some(thread) })
    }

    /// The stage being worked on, from 0.
    pub fn stage(&self) -> usize {
        self.stage.load(Ordering::Relaxed)
    }

    /// The result, once it is there.
    pub fn outcome(&mut self) -> Option<Result<ActionPrior, String>> {
        if self.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return None;
        }
        let thread = self.thread.take()?;
        Some(match thread.join() {
            Ok(Ok(Some(prior))) => Ok(prior),
            Ok(Ok(None)) => Err("the computation was cancelled".to_owned()),
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("the computation of the clusters panicked".to_owned()),
        })
    }
}

impl Drop for PriorJob {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trainer::Method;

    #[test]
    fn clusters_of_a_method_with_other_rollouts_are_out_of_date() {
        let config = RunConfig::new(Arc::new(crate::task::load("task1").unwrap()));
        let key = |method| PriorKey::of(&RunConfig { method, ..config.clone() });
        assert_eq!(key(Method::Ddpg), key(Method::DdpgMge));
        assert_ne!(key(Method::DdpgUniform), key(Method::DdpgMge));
        assert_ne!(key(Method::DdpgMgeTrue), key(Method::DdpgMge));
    }
}
