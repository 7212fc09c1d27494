//! The three observations that an environment can give: their parts, bounds and numbers.

use super::action_set::ActionSet;
use super::description::{describe, description_bounds, description_parts};
use super::episode::Snapshot;
use super::observation::{ObservationPart, observation_bounds, observation_len, observation_parts, observe};
use super::rays::{RAYS_LEN, observe_rays, rays_bounds};
use mge_task::Task;

/// What an agent observes.
pub(super) enum View<'a> {
    /// The objects, whose number depends on the task, and the next stage.
    Objects,
    /// The scene in this many object slots, the progress, and an action set.
    Scene(&'a ActionSet, usize),
    /// Rays from the ball and from its next target.
    Rays,
}

impl View<'_> {
    /// The parts of an observation, in order.
    pub fn parts(&self, task: &Task) -> Vec<ObservationPart> {
        match self {
            Self::Objects => observation_parts(task),
            Self::Scene(_, slots) => description_parts(task, *slots),
            Self::Rays => vec![ObservationPart { name: "rays", shape: vec![RAYS_LEN] }],
        }
    }

    /// Lower and upper bounds of observations; unbounded values are infinite.
    pub fn bounds(&self, task: &Task) -> [Vec<f32>; 2] {
        match self {
            Self::Objects => observation_bounds(task),
            Self::Scene(_, slots) => description_bounds(task, *slots),
            Self::Rays => rays_bounds(),
        }
    }

    /// The observation of an episode.
    pub fn observation(&self, now: &Snapshot) -> Vec<f32> {
        match self {
            Self::Objects => {
                let mut observation = vec![0.0; observation_len(now.task())];
                self.write(now, &mut observation);
                observation
            }
            Self::Scene(set, slots) => describe(now, set, *slots),
            Self::Rays => observe_rays(now),
        }
    }

    /// Writes the observation of an episode to `row`, which has exactly its length.
    pub fn write(&self, now: &Snapshot, row: &mut [f32]) {
        match self {
            Self::Objects => observe(now, row),
            Self::Scene(..) | Self::Rays => row.copy_from_slice(&self.observation(now)),
        }
    }
}
