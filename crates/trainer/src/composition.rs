//! What a training is composed of, decided once from its method and settings.

use std::sync::Arc;

use super::config::RunConfig;
use super::error::Result;
use super::method::Method;
use super::parts::{Practice, Refinement};
use super::prior::required_model;
use mge_base::stop::Stop;
use mge_guidance::RolloutModel;

/// The parts in which methods differ.
#[derive(Debug, Clone)]
pub(super) struct Composition {
    /// What acts.
    pub actor: Actor,
    /// Whether exploratory actions are drawn from clusters.
    pub has_clusters: bool,
    /// Whether the epsilon schedule of the configuration applies.
    pub follows_epsilon: bool,
    /// Share of failed greedy attempts above which a held policy is replaced; none if no policy is held.
    pub hold_tolerance: Option<f32>,
    /// Steps for each update while no stage needs exploration; none if nothing is learned.
    pub mastered_update_interval: Option<u64>,
    /// Refinement of clusters, if they are refined.
    pub refinement: Option<Refinement>,
    /// Practice before the first episode, if there is any.
    pub practice: Option<Practice>,
    /// Episodes between evaluations of the policy, if there are any.
    pub evaluation_interval: Option<u64>,
}

/// What acts where exploration does not.
#[derive(Debug, Clone)]
pub(super) enum Actor {
    /// The policy that is learned.
    Policy,
    /// A planner, through a model.
    Planner(Arc<dyn RolloutModel>),
    /// The clusters until an episode succeeds, then the actions of that episode.
    FirstSuccess,
}

impl Composition {
    /// The parts of a run with this configuration.
    ///
    /// # Errors
    /// When the model of a planner cannot be used.
    pub fn of(config: &RunConfig) -> Result<Self> {
        let RunConfig { method, refinement, practice, evaluation, .. } = config;
        let actor = match method {
            Method::Planning => Actor::Planner(required_model(config, &Stop::default())?),
            Method::OpenLoop => Actor::FirstSuccess,
            _ => Actor::Policy,
        };
        let learns = method.learns();
        Ok(Self {
            actor,
            has_clusters: method.has_clusters(),
            follows_epsilon: method.follows_epsilon(),
            hold_tolerance: config.hold_tolerance,
            mastered_update_interval: learns.then_some(config.mastered_update_interval.into()),
            refinement: Some(*refinement).filter(|refinement| refinement.every > 0 && method.has_clusters() && learns),
            practice: Some(*practice).filter(|_| config.practises()),
            evaluation_interval: Some(u64::from(evaluation.every)).filter(|every| *every > 0 && learns),
        })
    }
}
