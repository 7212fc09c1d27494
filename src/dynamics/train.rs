//! Training of a dynamics model (paper, section 5.2 and table 1).
//!
//! An epoch uses one row of every observation in random order, so the number of updates is the
//! paper's: epochs × observations of the tool set / batch. Launches, initial weights and every
//! epoch's draws have separate random streams, so a training resumed after any epoch gives
//! bit-identical results.

use dfdx::losses::{huber_loss, mse_loss};
use dfdx::prelude::*;
use rand::seq::SliceRandom;

use super::bystander::Bystanders;
use super::codec::Codec;
use super::config::{Loss, ModelConfig, TrainConfig};
use super::error::{DynamicsError, Result};
use super::graph::GraphBuilder;
use super::launch::{Launch, Split, collect, data_hash};
use super::model::{Model, Provenance};
use super::network::Network;
use super::normaliser::Normaliser;
use super::samples::Samples;
use super::tool_set::canonical_tool_set;
use super::variety::Variety;
use crate::nn::{NnError, Optimiser, TensorFile, matrix};
use crate::physics::ToolKind;
use crate::streams::Stream;

/// A training in progress: the model, the optimiser and the data.
#[derive(Debug)]
pub struct Training {
    model: Model,
    optimiser: Optimiser,
    samples: Samples,
    validation: Samples,
    device: Cpu,
}

/// Progress of a training.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Epochs done.
    pub epoch: u32,
    /// Total number of epochs.
    pub epochs: u32,
    /// Mean loss of the latest epoch, of normalised outputs.
    pub loss: f32,
}

/// Why [`Training::run`] returned.
#[derive(Debug, Clone, PartialEq)]
pub enum TrainingOutcome {
    /// All epochs are done.
    Done,
    /// The callback asked to stop; the training can be resumed.
    Stopped,
    /// The loss or a gradient was not finite. The model is that of the previous epoch.
    Diverged {
        /// The epoch that failed, counted from 1.
        epoch: u32,
        /// The error.
        reason: String,
    },
}

impl Training {
    /// A new training: collects the launches at `tools` and draws initial weights.
    /// `command` is recorded in the model, so that it can be reproduced.
    ///
    /// # Errors
    /// When a setting is out of range or the tool set is not usable.
    pub fn new(config: ModelConfig, training: TrainConfig, tools: &[ToolKind], command: &str) -> Result<Self> {
        config.validate()?;
        training.validate()?;
        let tools = canonical_tool_set(tools)?;
        let mut data = Data::collect(&config, &training, &tools)?;
        let builder = GraphBuilder::new(config.clone(), tools.clone());
        let layout = builder.layout();
        let normaliser = Normaliser::of(&data.samples.graphs, layout.edge, &data.samples.targets);
        data.normalise(&normaliser);
        let outputs = Codec::new(&config).outputs();
        let network = Network::new(&config, layout, outputs, &mut Stream::ModelWeights.of(training.seed))?;
        let optimiser = Optimiser::new(training.optimiser, &network.networks());
        let provenance = Provenance {
            training,
            epoch: 0,
            data_hash: data.hash,
            crate_version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
        };
        let model = Model::assemble(config, tools, provenance, normaliser, network);
        Ok(Self { model, optimiser, samples: data.samples, validation: data.validation, device: Cpu::default() })
    }

    /// The current model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Epochs done.
    pub fn epoch(&self) -> u32 {
        self.model.provenance.epoch
    }

    /// Trains until all epochs are done, `on_progress` returns false, or the loss diverges.
    /// `on_progress` is called after every epoch.
    pub fn run(&mut self, mut on_progress: impl FnMut(&Self, &Progress) -> bool) -> TrainingOutcome {
        let epochs = self.model.provenance.training.epochs;
        while self.epoch() < epochs {
            let good = (self.model.network.clone(), self.optimiser.clone());
            // On a thread of the rayon pool, work is divided with less overhead than from outside.
            let loss = match rayon::scope(|_| self.train_epoch()) {
                Ok(loss) => loss,
                Err(reason) => {
                    (self.model.network, self.optimiser) = good;
                    return TrainingOutcome::Diverged { epoch: self.epoch() + 1, reason: reason.to_string() };
                }
            };
            self.model.provenance.epoch += 1;
            let epoch = self.epoch();
            if !on_progress(self, &Progress { epoch, epochs, loss }) && epoch < epochs {
                return TrainingOutcome::Stopped;
            }
        }
        TrainingOutcome::Done
    }

    /// One pass over the observations. Returns the mean loss.
    fn train_epoch(&mut self) -> Result<f32, NnError> {
        let config = &self.model.provenance.training;
        let mut rng = Stream::ModelEpoch(self.epoch()).of(config.seed);
        let mut order: Vec<usize> = (0..self.samples.observations()).collect();
        order.shuffle(&mut rng);
        let (batch, share, loss_kind) = (config.batch, config.contact_share, config.loss);
        let outputs = self.model.codec.outputs();
        let updates = (order.len().div_ceil(batch) * config.epochs as usize) as f64;
        let mut graphs = self.model.builder.empty();
        let mut sum = 0.0;
        for chosen in order.chunks(batch) {
            graphs.clear();
            let mut targets = Vec::with_capacity(chosen.len() * outputs);
            for &observation in chosen {
                let row = self.samples.draw(observation, share, &mut rng);
                graphs.push_from(&self.samples.graphs, row);
                targets.extend_from_slice(&self.samples.targets[row * outputs..(row + 1) * outputs]);
            }
            let targets = matrix(&self.device, targets, chosen.len(), outputs);
            let predicted = self.model.network.forward(&graphs, &self.device);
            let loss = match loss_kind {
                Loss::Squared => mse_loss(predicted, targets),
                Loss::Huber(width) => huber_loss(predicted, targets, width),
            };
            let value = loss.array();
            if !value.is_finite() {
                return Err(NnError::NotFinite { norm: f64::from(value) });
            }
            sum += f64::from(value) * chosen.len() as f64;
            let rate = self.model.provenance.training.rate(self.optimiser.steps() as f64 / updates);
            self.optimiser.update(&mut self.model.network.networks_mut(), &mut loss.backward(), rate)?;
        }
        Ok((sum / order.len() as f64) as f32)
    }

    /// Mean loss on the validation launches.
    pub fn validation_loss(&self) -> f32 {
        let outputs = self.model.network.predict(&self.validation.graphs);
        let loss = self.model.provenance.training.loss;
        let errors = outputs.iter().zip(&self.validation.targets).map(|(output, target)| f64::from(output - target));
        let sum: f64 = errors.map(|error| loss.of(error)).sum();
        (sum / outputs.len().max(1) as f64) as f32
    }

    /// The model and the optimiser's state: everything needed to resume.
    pub fn checkpoint(&self) -> TensorFile {
        let mut file = self.model.to_file();
        self.optimiser.save(&mut file, OPTIMISER);
        file
    }

    /// Resumes from a checkpoint; `origin` names it in errors. The launches are collected
    /// again from the seed and must be identical.
    ///
    /// # Errors
    /// When the file is not a valid checkpoint or the launches differ.
    pub fn resume(file: &TensorFile, origin: &str) -> Result<Self> {
        let model = Model::from_file(file, origin)?;
        let wrong = |source| DynamicsError::File { origin: origin.to_owned(), source };
        let optimiser = Optimiser::load(file, OPTIMISER).map_err(wrong)?;
        let provenance = &model.provenance;
        let mut data = Data::collect(&model.config, &provenance.training, &model.tools)?;
        if data.hash != provenance.data_hash {
            return Err(DynamicsError::Content {
                origin: origin.to_owned(),
                reason: "its launches cannot be collected again by this version: start a new training".to_owned(),
            });
        }
        data.normalise(&model.normaliser);
        Ok(Self { model, optimiser, samples: data.samples, validation: data.validation, device: Cpu::default() })
    }
}

const OPTIMISER: &str = "optimiser";

struct Data {
    samples: Samples,
    validation: Samples,
    hash: String,
}

impl Data {
    fn collect(config: &ModelConfig, training: &TrainConfig, tools: &[ToolKind]) -> Result<Self> {
        let builder = GraphBuilder::new(config.clone(), tools.to_vec());
        let variety = Variety::of(config);
        let of = |split, count| -> Vec<Launch> {
            tools.iter().flat_map(|&kind| collect(kind, variety, count, split, training.seed)).collect()
        };
        let launches = of(Split::Training, training.observations);
        let validation = of(Split::Validation, training.validation);
        let bystanders = || Bystanders {
            share: training.bystanders,
            cutoff: config.cutoff,
            tools: tools.to_vec(),
            variety,
            rng: Stream::Bystanders.of(training.seed),
        };
        Ok(Self {
            hash: data_hash(&launches, config.properties),
            samples: Samples::new(config, &builder, &launches, training.mirror, bystanders())?,
            validation: Samples::new(config, &builder, &validation, false, bystanders())?,
        })
    }

    fn normalise(&mut self, normaliser: &Normaliser) {
        for samples in [&mut self.samples, &mut self.validation] {
            normaliser.normalise(&mut samples.graphs);
            normaliser.targets.normalise(&mut samples.targets);
        }
    }
}
