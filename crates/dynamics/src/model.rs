//! A trained dynamics model, in memory and as a safetensors file.

use std::borrow::Cow;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::codec::Codec;
use super::config::{ModelConfig, TrainConfig};
use super::error::{DynamicsError, Result};
use super::graph::{GraphBuilder, Graphs};
use super::network::Network;
use super::normaliser::Normaliser;
use super::tool_set::{canonical_tool_set, model_name};
use mge_base::atomic::Format;
use mge_base::bounded;
use mge_base::identity::FileId;
use mge_nn::TensorFile;
use mge_physics::{Ball, BallState, GRAVITY, STEPS_PER_ACTION, Tool, ToolKind};
use mge_task::{GoalShape, Task, ToolSpec};

/// Version of the file format that this program writes and reads.
pub(super) const VERSION: u32 = 1;

/// A dynamics model of one tool set.
#[derive(Debug, Clone)]
pub struct Model {
    pub(super) config: ModelConfig,
    pub(super) tools: Vec<ToolKind>,
    /// How it was made.
    pub provenance: Provenance,
    pub(super) builder: GraphBuilder,
    pub(super) codec: Codec,
    pub(super) normaliser: Normaliser,
    pub(super) network: Network,
    /// The file that it was read from.
    pub(super) file: Option<FileId>,
}

/// Where a model comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// How it was trained.
    pub training: TrainConfig,
    /// Epochs done.
    pub epoch: u32,
    /// SHA-256 of the launches it was trained on.
    pub data_hash: String,
    /// Version of the program that trained it.
    pub crate_version: String,
    /// Kind of the processor that trained it; empty in files of earlier versions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub processor: String,
    /// The command that reproduces it.
    pub command: String,
    /// Final mean losses of training and validation, of normalised outputs; none in files of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub losses: Option<[f32; 2]>,
}

impl Model {
    pub(super) fn assemble(
        config: ModelConfig,
        tools: Vec<ToolKind>,
        provenance: Provenance,
        normaliser: Normaliser,
        network: Network,
    ) -> Self {
        let builder = GraphBuilder::new(config.clone(), tools.clone());
        let codec = Codec::new(&config);
        Self { config, tools, provenance, builder, codec, normaliser, network, file: None }
    }

    /// Structure, inputs and targets.
    pub fn config(&self) -> &ModelConfig {
        &self.config
    }

    /// The tool types that it supports, in canonical order.
    pub fn tools(&self) -> &[ToolKind] {
        &self.tools
    }

    /// The names of its tools, joined by hyphens; `create` if it supports all of CREATE's tools with their
    /// properties.
    pub fn name(&self) -> String {
        model_name(&self.config, &self.tools)
    }

    /// The name and hash of its file; of a model that was not read from a file, those of the file that
    /// [`save`](Self::save) writes, with the names of its tools.
    pub fn id(&self) -> FileId {
        self.file.clone().unwrap_or_else(|| FileId { name: self.name(), ..FileId::new("", &self.to_file().to_bytes()) })
    }

    /// The states of the balls one prediction interval later. `graphs` holds one scene for
    /// each of `balls`, in order, from the model's builder; their features are normalised in place.
    pub(super) fn predict(&self, graphs: &mut Graphs, balls: &[BallState]) -> Vec<BallState> {
        assert_eq!(graphs.scenes, balls.len(), "one ball per scene");
        self.normaliser.normalise(graphs);
        let mut outputs = self.network.predict(graphs);
        self.normaliser.targets.denormalise(&mut outputs);
        let outputs = outputs.chunks_exact(self.codec.outputs());
        balls.iter().zip(outputs).map(|(ball, output)| self.codec.decode(ball, output)).collect()
    }

    /// The model for a task's scenes. With [`properties`](ModelConfig::properties) the ball's radius may differ
    /// from that of the launches: surfaces are then moved by the difference, which is exact for flat ones.
    ///
    /// # Errors
    /// As [`check_task`](Self::check_task).
    pub fn for_task(&self, task: &Task) -> Result<Cow<'_, Self>> {
        self.check_task(task)?;
        if task.ball.radius == self.builder.radius {
            return Ok(Cow::Borrowed(self));
        }
        let mut model = self.clone();
        (model.builder.radius, model.codec.radius) = (task.ball.radius, task.ball.radius);
        Ok(Cow::Owned(model))
    }

    /// Checks that the model can predict a task's scenes.
    ///
    /// # Errors
    /// [`DynamicsError::UnseenEdge`] for a tool type it was never trained on,
    /// [`DynamicsError::OtherMovers`] for a second ball or a moving box,
    /// [`DynamicsError::OtherPhysics`] for rules, a ball, or tool forms or materials that differ from
    /// those of the launches.
    pub fn check_task(&self, task: &Task) -> Result<()> {
        check_task(task, &self.config, &self.tools)
    }

    /// The model as a tensor file: weights, statistics and metadata.
    pub fn to_file(&self) -> TensorFile {
        let mut file = TensorFile::default();
        self.network.save(&mut file);
        self.normaliser.save(&mut file);
        let json = |value: serde_json::Value| value.to_string();
        let entries = [
            ("format", FORMAT.to_owned()),
            ("version", VERSION.to_string()),
            ("config", json(serde_json::json!(self.config))),
            ("tools", json(serde_json::json!(self.tools))),
            ("provenance", json(serde_json::json!(self.provenance))),
        ];
        file.metadata.extend(entries.map(|(key, value)| (key.to_owned(), value)));
        file
    }

    /// The model in a tensor file; `origin` names it in errors.
    ///
    /// # Errors
    /// When the file is of another kind or version, or a part is missing or invalid.
    pub fn from_file(file: &TensorFile, origin: &str) -> Result<Self> {
        let wrong = |source| DynamicsError::File { origin: origin.to_owned(), source };
        let content = |reason: &str| DynamicsError::Content { origin: origin.to_owned(), reason: reason.to_owned() };
        if file.metadata.get("format").map(String::as_str) != Some(FORMAT) {
            return Err(content("the file holds tensors, but not those of a dynamics model"));
        }
        let found = file.metadata.get("version").cloned().unwrap_or_default();
        if found != VERSION.to_string() {
            return Err(content(&format!(
                "the model file has format version {found}, this program reads version {VERSION}: train it again"
            )));
        }
        let config: ModelConfig = file.json("config").map_err(wrong)?;
        config.validate().map_err(|error| content(&error.to_string()))?;
        let tools: Vec<ToolKind> = file.json("tools").map_err(wrong)?;
        let provenance: Provenance = file.json("provenance").map_err(wrong)?;
        provenance.training.validate().map_err(|error| content(&error.to_string()))?;
        if canonical_tool_set(&tools).map_err(|error| content(&error.to_string()))? != tools {
            return Err(content("its tool set is not in canonical order"));
        }
        let layout = GraphBuilder::new(config.clone(), tools.clone()).layout();
        let outputs = Codec::new(&config).outputs();
        let network = Network::load(&config, layout, outputs, file).map_err(wrong)?;
        let normaliser =
            Normaliser::load(file, (layout.functions, layout.edge, layout.node, outputs)).map_err(wrong)?;
        Ok(Self::assemble(config, tools, provenance, normaliser, network))
    }

    /// The format of files of models, of any version.
    pub const FORMAT: Format<'static> = Format {
        name: "a dynamics model",
        is: &|found| TensorFile::from_bytes(found).is_ok_and(|file| file.metadata.contains_key("provenance")),
    };

    /// Reads a model from the bytes of a file; `origin` names it in errors.
    ///
    /// # Errors
    /// When the bytes are truncated, not a model, of another version, or invalid.
    pub fn from_bytes(bytes: &[u8], origin: &str) -> Result<Self> {
        let file = TensorFile::from_bytes(bytes)
            .map_err(|source| DynamicsError::File { origin: origin.to_owned(), source })?;
        let mut model = Self::from_file(&file, origin)?;
        model.file = Some(FileId::new(origin, bytes));
        Ok(model)
    }

    /// Reads a model file.
    ///
    /// # Errors
    /// As [`from_bytes`](Self::from_bytes), and when the file cannot be read.
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_bytes(&read_model(path)?, &path.display().to_string())
    }

    /// Writes the model file atomically.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        mge_base::atomic::write(path, &self.to_file().to_bytes())
            .map_err(|source| DynamicsError::Io { origin: path.display().to_string(), source })
    }
}

/// Checks that a model with this configuration, trained on launches at `known` tools, can predict a task's scenes.
///
/// # Errors
/// As [`Model::check_task`].
pub(super) fn check_task(task: &Task, config: &ModelConfig, known: &[ToolKind]) -> Result<()> {
    if let Some(sender) = task.tool_set().into_iter().find(|kind| !known.contains(kind)) {
        return Err(DynamicsError::UnseenEdge { sender, known: model_name(config, known) });
    }
    let movers = [
        (task.marker.is_some(), "a marker ball"),
        (task.goal.shape == GoalShape::Ball, "the goal"),
        (!task.balls.is_empty(), "another ball"),
        (!task.boxes.is_empty(), "a box"),
    ];
    if let Some((_, what)) = movers.into_iter().find(|(moves, _)| *moves) {
        return Err(DynamicsError::OtherMovers { task: task.name.clone(), what });
    }
    let other = |what| Err(DynamicsError::OtherPhysics { task: task.name.clone(), what });
    if task.rules.gravity != GRAVITY {
        return other("gravity");
    }
    if task.rules.steps_per_action != STEPS_PER_ACTION {
        return other("the length of an action");
    }
    let ball = task.ball.material();
    let radius = if config.properties && RADII.contains(&ball.radius) { ball.radius } else { Ball::default().radius };
    if ball != (Ball { radius, ..Ball::default() }) {
        return other("the ball");
    }
    if config.properties || is_plain(task) { Ok(()) } else { other("angle, thickness or material of a tool") }
}

/// Whether the tools of a task differ from CREATE's default form and material at most in size.
pub(super) fn is_plain(task: &Task) -> bool {
    let is_plain = |tool: Tool| tool == Tool::new(tool.kind, tool.position).with_size(tool.size);
    task.tools.iter().map(ToolSpec::tool).chain([task.placeable.tool([0.0; 2])]).all(is_plain)
}

/// The bytes of a model file.
pub fn read_model(path: &Path) -> Result<Vec<u8>> {
    let read = bounded::regular(path).and_then(|()| bounded::read(path, bounded::MODEL));
    read.map_err(|source| DynamicsError::Io { origin: path.display().to_string(), source })
}

/// Ball radii that a model with properties supports, in units.
const RADII: std::ops::RangeInclusive<f32> = 2.0..=6.0;

const FORMAT: &str = "mge dynamics model";
