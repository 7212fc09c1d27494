//! What observers see of a running training: the latest state wins, and the trainer
//! never waits for them.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::trace::Trace;
use crate::agent::Ddpg;
use crate::guidance::ActionPrior;
use crate::stop::Stop;

/// What the trainer is doing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Phase {
    /// Not begun yet.
    #[default]
    Waiting,
    /// Building the action prior: stages done and stages in all.
    BuildingPrior { stage: usize, stages: usize },
    /// Practising before the first episode: the stage, from 0, stages in all, rollouts towards it so far and those
    /// of them that reached it.
    Practising { stage: usize, stages: usize, rollouts: u32, reached: u32 },
    /// Playing and learning.
    Training,
    /// Waiting for a person.
    Paused,
    /// Done, for whatever reason.
    Ended,
}

impl Phase {
    /// What is done before the first episode, in words, if that is what it is doing.
    pub fn preparation(&self) -> Option<String> {
        match self {
            Self::BuildingPrior { stage, stages } => Some(format!("clusters, stage {} of {stages}", stage + 1)),
            Self::Practising { stage, stages, rollouts, reached } => {
                let stage = stage + 1;
                Some(format!("practice, stage {stage} of {stages}: {reached} of {rollouts} reached"))
            }
            Self::Waiting | Self::Training | Self::Paused | Self::Ended => None,
        }
    }
}

/// Where the phase of a training is to be seen, also from the thread that plays its first episode.
#[derive(Debug, Clone, Default)]
pub(super) struct PhaseSign(Arc<Mutex<Phase>>);

impl PhaseSign {
    pub fn set(&self, phase: Phase) {
        *lock(&self.0) = phase;
    }
}

/// The latest finished episode, with the networks and the prior behind it.
#[derive(Debug, Clone)]
pub struct LiveView {
    /// The episode, step by step.
    pub trace: Arc<Trace>,
    /// Actor and critic after it.
    pub ddpg: Arc<Ddpg>,
    /// The action prior in use.
    pub prior: Option<Arc<ActionPrior>>,
}

/// A slot for the latest view, filled only when one was requested.
#[derive(Debug, Default)]
pub struct Watch {
    wanted: AtomicBool,
    episode: AtomicU64,
    view: Mutex<Option<LiveView>>,
    phase: PhaseSign,
    prior: Mutex<Option<Arc<ActionPrior>>>,
    stop: Stop,
}

impl Watch {
    /// Asks for a view; the trainer fills it after the next episode.
    pub fn request(&self) {
        self.wanted.store(true, Ordering::Relaxed);
    }

    /// Takes the view that was asked for, if it is there.
    pub fn take(&self) -> Option<LiveView> {
        lock(&self.view).take()
    }

    /// Says that a [`Control::Stop`](super::Control::Stop) was sent, so that what takes long is abandoned for it.
    pub(crate) fn note_stop(&self) {
        self.stop.request();
    }

    /// Set once a stop was sent.
    pub(super) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// What the trainer is doing.
    pub fn phase(&self) -> Phase {
        lock(&self.phase.0).clone()
    }

    /// Where a training shows what it is doing.
    pub(super) fn phase_sign(&self) -> &PhaseSign {
        &self.phase
    }

    /// Episodes finished.
    pub fn episode(&self) -> u64 {
        self.episode.load(Ordering::Relaxed)
    }

    /// The action prior of the run, once there is one.
    pub fn prior(&self) -> Option<Arc<ActionPrior>> {
        lock(&self.prior).clone()
    }

    pub(super) fn set_phase(&self, phase: Phase) {
        self.phase.set(phase);
    }

    pub(super) fn set_episode(&self, episode: u64) {
        self.episode.store(episode, Ordering::Relaxed);
    }

    pub(super) fn set_prior(&self, prior: Option<Arc<ActionPrior>>) {
        *lock(&self.prior) = prior;
    }

    /// Fills the slot if a view was requested; `view` is called only then.
    pub(super) fn offer(&self, view: impl FnOnce() -> LiveView) {
        if self.wanted.swap(false, Ordering::Relaxed) {
            *lock(&self.view) = Some(view());
        }
    }
}

/// The values are replaced whole, so a panic elsewhere leaves them whole.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
