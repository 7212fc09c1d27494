//! Saving and loading of agents and learners, bit for bit.
//!
//! An agent is a safetensors file: networks as `actor.0.weight`, `target_critic.2.bias` and so
//! on, moments as `actor_optimiser.mean`, and the rest as JSON in the metadata.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    Ddpg, DdpgConfig, Learner, OrnsteinUhlenbeck, ReplayBuffer, ReplayError, Segments, learner::LearnerStreams,
};
use mge_base::atomic::Format;
use mge_base::validation::ValidationError;
use mge_nn::{Mlp, MlpShape, Optimiser, TensorFile, TensorFileError};

const VERSION: u32 = 1;
/// Maximum length of vectors that is accepted from a file.
const MAX_LEN: usize = 1 << 20;
const AGENT_KEY: &str = "agent";
const LEARNER_KEY: &str = "learner";

/// A saved learner: the contents of two files that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedLearner {
    /// Agent, noise, streams and counters, as safetensors. [`Ddpg::load`] reads it as well.
    pub networks: Vec<u8>,
    /// The replay buffer, as [`ReplayBuffer::to_bytes`] writes it.
    pub replay: Vec<u8>,
}

/// Why a saved agent or learner could not be loaded.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum StateError {
    /// The tensors do not form an agent.
    #[error("the saved agent cannot be used: {0}")]
    Tensors(#[from] TensorFileError),
    /// The settings are invalid.
    #[error("the saved agent cannot be used: {0}")]
    Config(#[from] ValidationError),
    /// The replay buffer cannot be read.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The replay buffer belongs to another learner.
    #[error(
        "the saved replay buffer does not belong to the saved agent: a fork can continue from an earlier checkpoint"
    )]
    ReplayMismatch,
}

/// The part of an agent that is not stored as tensors.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AgentState {
    version: u32,
    observation_len: usize,
    action_len: usize,
    config: DdpgConfig,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    holds_policy: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    has_proven_policy: bool,
}

/// The part of a learner that is neither agent nor replay buffer.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LearnerState {
    recorded: u64,
    noise: OrnsteinUhlenbeck,
    streams: LearnerStreams,
    #[serde(default, skip_serializing_if = "Segments::is_unused")]
    segments: Segments,
}

impl Ddpg {
    /// The whole agent as safetensors bytes; equal agents give equal bytes.
    pub fn save(&self) -> Vec<u8> {
        self.to_file().to_bytes()
    }

    /// The agent that [`save`](Self::save) wrote.
    ///
    /// # Errors
    /// If the bytes are damaged or not an agent.
    pub fn load(bytes: &[u8]) -> Result<Self, StateError> {
        Self::from_file(&TensorFile::from_bytes(bytes)?)
    }

    /// Only the policy that acts, as safetensors bytes for other programs: `actor.N.weight` (inputs x
    /// outputs) and `actor.N.bias` of its layers. The metadata entry `mge` contains, as JSON, the number of
    /// layers, the activations of the hidden layers and of the output, and the
    /// [origin](DdpgConfig::action_origin) of actions if there is one.
    pub fn export_actor(&self) -> Vec<u8> {
        let mut file = TensorFile::default();
        self.policy().save(&mut file, "actor");
        let shape = self.actor.shape();
        file.metadata.insert("layers".to_owned(), shape.layers().to_string());
        for (key, activation) in [("hidden", shape.hidden), ("output", shape.output)] {
            file.metadata.insert(key.to_owned(), activation.name().to_owned());
        }
        if let Some(origin) = self.config.action_origin {
            file.metadata.insert("action_origin".to_owned(), origin.to_string());
        }
        file.to_bytes()
    }

    /// The format of [`export_actor`](Self::export_actor).
    pub const ACTOR_FORMAT: Format<'static> = Format {
        name: "an exported actor",
        is: &|found| TensorFile::from_bytes(found).is_ok_and(|file| file.metadata.contains_key("layers")),
    };

    fn to_file(&self) -> TensorFile {
        let mut file = TensorFile::default();
        self.actor.save(&mut file, "actor");
        self.critic.save(&mut file, "critic");
        self.target_actor.save(&mut file, "target_actor");
        self.target_critic.save(&mut file, "target_critic");
        if let Some(held) = &self.held {
            held.save(&mut file, "held_actor");
        }
        if let Some(proven) = &self.proven {
            proven.save(&mut file, "proven_actor");
        }
        self.actor_optimiser.save(&mut file, "actor_optimiser");
        self.critic_optimiser.save(&mut file, "critic_optimiser");
        let state = AgentState {
            version: VERSION,
            observation_len: self.observation_len(),
            action_len: self.action_len(),
            config: self.config.clone(),
            holds_policy: self.holds_policy(),
            has_proven_policy: self.proven.is_some(),
        };
        write_metadata(&mut file, AGENT_KEY, &state);
        file
    }

    fn from_file(file: &TensorFile) -> Result<Self, StateError> {
        let AgentState { version, observation_len, action_len, config, holds_policy, has_proven_policy } =
            file.json(AGENT_KEY)?;
        if version != VERSION {
            return Err(TensorFileError(format!("it has format {version}, but this program reads {VERSION}")).into());
        }
        if ![observation_len, action_len].iter().all(|len| (1..=MAX_LEN).contains(len)) {
            return Err(TensorFileError(format!("vectors of {observation_len} and {action_len} numbers")).into());
        }
        let [actor, critic] = Self::shapes(observation_len, action_len, &config)?;
        let network = |shape: &MlpShape, name| Mlp::load(shape.clone(), file, name);
        Ok(Self {
            actor: network(&actor, "actor")?,
            critic: network(&critic, "critic")?,
            target_actor: network(&actor, "target_actor")?,
            target_critic: network(&critic, "target_critic")?,
            held: holds_policy.then(|| network(&actor, "held_actor")).transpose()?,
            proven: has_proven_policy.then(|| network(&actor, "proven_actor")).transpose()?,
            actor_optimiser: load_optimiser(file, "actor_optimiser", &config)?,
            critic_optimiser: load_optimiser(file, "critic_optimiser", &config)?,
            device: Default::default(),
            config,
        })
    }
}

impl Learner {
    /// The whole learner; equal learners give equal bytes.
    pub fn save(&self) -> SavedLearner {
        let mut file = self.ddpg.to_file();
        let state = LearnerState {
            recorded: self.recorded,
            noise: self.noise.clone(),
            streams: self.streams.clone(),
            segments: self.segments.clone(),
        };
        write_metadata(&mut file, LEARNER_KEY, &state);
        SavedLearner { networks: file.to_bytes(), replay: self.replay.to_bytes() }
    }

    /// The learner that [`save`](Self::save) wrote. It continues as the saved one would have.
    ///
    /// # Errors
    /// If a part is damaged or the two do not belong together.
    pub fn load(saved: &SavedLearner) -> Result<Self, StateError> {
        let file = TensorFile::from_bytes(&saved.networks)?;
        let ddpg = Ddpg::from_file(&file)?;
        let replay = ReplayBuffer::from_bytes(&saved.replay)?;
        let LearnerState { recorded, noise, streams, segments } = file.json(LEARNER_KEY)?;
        if replay.observation_len != ddpg.observation_len()
            || replay.action_len != ddpg.action_len()
            || replay.capacity != ddpg.config.replay_capacity
            || replay.len() as u64 != recorded.min(replay.capacity as u64)
            || noise.state.len() != ddpg.action_len()
            || !segments.is_possible(recorded)
        {
            return Err(StateError::ReplayMismatch);
        }
        Ok(Self { ddpg, replay, noise, streams, recorded, segments, batch: Default::default() })
    }
}

fn write_metadata(file: &mut TensorFile, key: &str, state: &impl Serialize) {
    let text = serde_json::to_string(state).expect("plain numbers and text are JSON");
    file.metadata.insert(key.to_owned(), text);
}

/// The optimiser saved under `name`; an error if its kind is not that of `config`.
fn load_optimiser(file: &TensorFile, name: &'static str, config: &DdpgConfig) -> Result<Optimiser, StateError> {
    let optimiser = Optimiser::load(file, name)?;
    if optimiser.kind != config.optimiser {
        return Err(TensorFileError(format!("the kind of {name} differs from that in the config")).into());
    }
    Ok(optimiser)
}
