//! The state of a running training for observers: the latest value wins, and the trainer
//! never waits for observers.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use super::trace::Trace;
use mge_agent::Ddpg;
use mge_base::stop::Stop;
use mge_base::sync::lock;
use mge_dynamics::Progress;
use mge_guidance::ActionPrior;

/// What the trainer is doing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Phase {
    /// Not started yet.
    #[default]
    Waiting,
    /// Training the dynamics model: epochs done, and number of epochs.
    TrainingModel { epoch: u32, epochs: u32 },
    /// Building the action prior: current stage, from 0, and number of stages.
    BuildingPrior { stage: usize, stages: usize },
    /// Practising before the first episode: current stage, from 0, number of stages, rollouts towards the stage so far,
    /// and how many of them reached it.
    Practising { stage: usize, stages: usize, rollouts: u32, reached: u32 },
    /// Playing and learning.
    Training,
    /// Paused by a control.
    Paused,
    /// Ended, for whatever reason.
    Ended,
}

impl Phase {
    pub(super) fn of_model(now: &Progress) -> Self {
        Self::TrainingModel { epoch: now.epoch, epochs: now.epochs }
    }

    /// Parts done, their number and their name, while a model is trained or clusters are built.
    pub fn progress(&self) -> Option<(usize, usize, &'static str)> {
        match *self {
            Self::TrainingModel { epoch, epochs } => Some((epoch as usize, epochs as usize, "epochs of the model")),
            Self::BuildingPrior { stage, stages } => Some((stage, stages, "stages of the clusters")),
            _ => None,
        }
    }

    /// A description of the phase if it precedes the first episode.
    pub fn preparation(&self) -> Option<String> {
        match self {
            Self::TrainingModel { epoch, epochs } => Some(format!("dynamics model, epoch {epoch} of {epochs}")),
            Self::BuildingPrior { stage, stages } => Some(format!("clusters, stage {} of {stages}", stage + 1)),
            Self::Practising { stage, stages, rollouts, reached } => {
                let stage = stage + 1;
                Some(format!("practice, stage {stage} of {stages}: {reached} of {rollouts} reached"))
            }
            Self::Waiting | Self::Training | Self::Paused | Self::Ended => None,
        }
    }
}

/// The phase of a training, shared with the thread that plays an episode.
#[derive(Debug, Clone, Default)]
pub(super) struct SharedPhase(Arc<Mutex<Phase>>);

impl SharedPhase {
    pub fn set(&self, phase: Phase) {
        *lock(&self.0) = phase;
    }
}

/// The latest finished episode, with the networks and the prior.
#[derive(Debug, Clone)]
pub struct LiveView {
    /// The episode, step by step.
    pub trace: Arc<Trace>,
    /// Actor and critic after it.
    pub ddpg: Arc<Ddpg>,
    /// The action prior in use.
    pub prior: Option<Arc<ActionPrior>>,
}

/// The latest state of a training. A view is provided only on request.
#[derive(Debug, Default)]
pub struct Watch {
    wanted: AtomicBool,
    episode: AtomicU64,
    view: Mutex<Option<LiveView>>,
    /// The phase, for a training to set.
    pub(crate) phase: SharedPhase,
    prior: Mutex<Option<Arc<ActionPrior>>>,
    /// Requested once a [`Control::Stop`](super::Control::Stop) was sent.
    pub(crate) stop: Stop,
}

impl Watch {
    /// Requests a view; the trainer provides it after the next episode.
    pub fn request(&self) {
        self.wanted.store(true, Ordering::Release);
    }

    /// Takes the requested view, if it is there.
    pub fn take(&self) -> Option<LiveView> {
        lock(&self.view).take()
    }

    /// What the trainer is doing.
    pub fn phase(&self) -> Phase {
        *lock(&self.phase.0)
    }

    /// Number of finished episodes.
    pub fn episode(&self) -> u64 {
        self.episode.load(Ordering::Acquire)
    }

    /// The action prior of the run, once there is one.
    pub fn prior(&self) -> Option<Arc<ActionPrior>> {
        lock(&self.prior).clone()
    }

    pub(super) fn set_episode(&self, episode: u64) {
        self.episode.store(episode, Ordering::Release);
    }

    pub(super) fn set_prior(&self, prior: Option<Arc<ActionPrior>>) {
        *lock(&self.prior) = prior;
    }

    /// Fills the slot if a view was requested; `view` is called only then.
    pub(super) fn offer(&self, view: impl FnOnce() -> LiveView) {
        if self.wanted.swap(false, Ordering::AcqRel) {
            *lock(&self.view) = Some(view());
        }
    }
}
