//! A policy: a network that scores candidates, in memory and as a safetensors file.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::decision::Decision;
use super::error::SelectionError;
use mge_base::atomic::{Format, Target};
use mge_base::bounded;
use mge_base::identity::{FileId, version};
use mge_env::Environment;
use mge_nn::{Activation, Mlp, MlpShape, TensorFile};
use mge_physics::ToolSplit;
use mge_task::Task;

/// Version of the file format that this program writes and reads.
const VERSION: &str = "1";
const FORMAT: &str = "mge selection policy";
/// Name of the network in the file.
const NETWORK: &str = "policy";
/// Weight of the second output, the improvement, beside the first, the chance of success.
const IMPROVEMENT: f32 = 0.5;

/// How a policy is trained, or evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Number of episodes.
    pub episodes: usize,
    /// Most candidates that are considered before an action.
    pub candidates: usize,
    /// Seed of starts, action sets, candidates and weights.
    pub seed: u64,
}

/// A policy for one task.
#[derive(Debug, Clone)]
pub struct Policy {
    pub(super) network: Mlp,
    /// The name of its task.
    pub task: String,
    /// How it was trained.
    pub settings: Settings,
    /// The name and hash of the file that it was read from.
    pub file: Option<FileId>,
}

impl Policy {
    pub(super) fn new(network: Mlp, task: &Task, settings: Settings) -> Self {
        Self { network, task: task.name.clone(), settings, file: None }
    }

    /// Shape of the network: two outputs, whose logistic functions are the chance of success and the improvement.
    pub(super) fn shape(task: &Arc<Task>) -> MlpShape {
        // Without an action set there is one candidate, for which nothing is drawn.
        let mut unused = rand::rngs::mock::StepRng::new(0, 0);
        let width = Decision::new(&Environment::new(task.clone()).with_tools(ToolSplit::Train), 1, &mut unused).width();
        MlpShape { sizes: vec![width, 128, 64, 2], hidden: Activation::Relu, output: Activation::Identity }
    }

    /// The index of the best candidate by its features.
    pub(super) fn best(&self, rows: &[f32]) -> usize {
        let mut outputs = Vec::new();
        self.network.predict_into(rows, rows.len() / self.network.shape().inputs(), &mut outputs);
        let chance = |logit: f32| 1.0 / (1.0 + (-logit).exp());
        let scores = outputs.chunks_exact(2).map(|output| chance(output[0]) + IMPROVEMENT * chance(output[1]));
        scores.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(number, _)| number)
    }

    /// The format of files of policies, of any version.
    pub const FORMAT: Format<'static> = Format {
        name: "a policy",
        is: &|found| TensorFile::from_bytes(found).is_ok_and(|file| entry(&file, "format") == FORMAT),
    };

    /// The bytes of its file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut file = TensorFile::default();
        self.network.save(&mut file, NETWORK);
        let settings = serde_json::json!(self.settings).to_string();
        let entries = [
            ("format", FORMAT),
            ("version", VERSION),
            ("mge_version", version()),
            ("task", &self.task),
            ("tools", ToolSplit::Train.name()),
            ("settings", &settings),
        ];
        file.metadata.extend(entries.map(|(key, value)| (key.to_owned(), value.to_owned())));
        file.to_bytes()
    }

    /// Writes its file.
    ///
    /// # Errors
    /// When it cannot be written, or would replace a file of another format.
    pub fn save(&self, to: &Target) -> Result<(), SelectionError> {
        let origin = || to.path.display().to_string();
        to.write(&self.to_bytes(), &Self::FORMAT).map_err(|source| SelectionError::Io { origin: origin(), source })
    }

    /// Reads the policy for a task from its file.
    ///
    /// # Errors
    /// When the file cannot be read, is damaged, not a policy, of another version, or of another task.
    pub fn load(path: &Path, task: &Arc<Task>) -> Result<Self, SelectionError> {
        let origin = path.display().to_string();
        let read = bounded::regular(path).and_then(|()| bounded::read(path, bounded::MODEL));
        let bytes = read.map_err(|source| SelectionError::Io { origin: origin.clone(), source })?;
        let wrong = |source| SelectionError::File { origin: origin.clone(), source };
        let file = TensorFile::from_bytes(&bytes).map_err(wrong)?;
        let expected = [("format", FORMAT), ("version", VERSION), ("task", &task.name)];
        if let Some((key, wanted)) = expected.into_iter().find(|(key, wanted)| entry(&file, key) != *wanted) {
            let (found, wanted) = (entry(&file, key).to_owned(), wanted.to_owned());
            return Err(SelectionError::Other { origin, key, found, wanted });
        }
        let settings = file.json("settings").map_err(wrong)?;
        let network = Mlp::load(Self::shape(task), &file, NETWORK).map_err(wrong)?;
        Ok(Self { file: Some(FileId::new(path, &bytes)), ..Self::new(network, task, settings) })
    }
}

/// An entry of the metadata; empty if there is none.
fn entry<'a>(file: &'a TensorFile, key: &str) -> &'a str {
    file.metadata.get(key).map_or("", String::as_str)
}
