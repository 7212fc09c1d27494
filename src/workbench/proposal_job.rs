//! Subgoals looked for on a thread of their own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;

use crate::guidance::{GuidanceConfig, propose_subgoals};
use crate::task::{Region, Task};
use crate::trainer::{PriorSource, RunConfig, rollout_model};

/// What proposals depend on; the subgoals that the task has are not looked at.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ProposalKey {
    task: Task,
    source: PriorSource,
    guidance: GuidanceConfig,
    seed: u64,
}

impl ProposalKey {
    pub fn of(config: &RunConfig) -> Self {
        Self {
            // A task that is saved has another name, but is no other scene.
            task: Task { subgoals: Vec::new(), name: String::new(), ..Task::clone(&config.task) },
            source: config.prior.clone(),
            guidance: config.guidance.clone(),
            seed: config.seed,
        }
    }
}

/// A search under way. Dropping it ends the search before its next subgoal.
#[derive(Debug)]
pub(super) struct ProposalJob {
    pub key: ProposalKey,
    /// Subgoals looked for.
    pub count: usize,
    found: Arc<AtomicUsize>,
    shown: usize,
    cancelled: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Vec<Region>, String>>>,
}

impl ProposalJob {
    pub fn spawn(config: &RunConfig, count: usize) -> std::io::Result<Self> {
        let key = ProposalKey::of(config);
        let (found, cancelled) = (Arc::<AtomicUsize>::default(), Arc::<AtomicBool>::default());
        let (seen, stop, config) = (found.clone(), cancelled.clone(), config.clone());
        let work = move || {
            let model = rollout_model(&config.prior, &config.task).map_err(|error| error.to_string())?;
            let (model, _) =
                model.ok_or("`uniform` predicts nothing: choose another model, such as learned or true")?;
            let proposed = propose_subgoals(&config.task, &*model, count, &config.guidance, config.seed, |found| {
                seen.store(found, Ordering::Relaxed);
                !stop.load(Ordering::Relaxed)
            });
            proposed.map_err(|error| error.to_string())
        };
        let thread = std::thread::Builder::new().name("mge-proposals".to_owned()).spawn(work)?;
        Ok(Self { key, count, found, shown: 0, cancelled, thread: Some(thread) })
    }

    /// Subgoals found so far.
    pub fn found(&self) -> usize {
        self.found.load(Ordering::Relaxed)
    }

    /// Whether more were found than at the last call.
    pub fn is_news(&mut self) -> bool {
        let found = self.found();
        std::mem::replace(&mut self.shown, found) != found
    }

    /// The proposals, once they are there.
    pub fn outcome(&mut self) -> Option<Result<Vec<Region>, String>> {
        if self.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return None;
        }
        let outcome = self.thread.take()?.join();
        Some(outcome.unwrap_or_else(|_| Err("the search for subgoals panicked".to_owned())))
    }
}

impl Drop for ProposalJob {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}
