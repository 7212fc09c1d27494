//! Training of a dynamics model (paper, section 5.2 and table 1).
//!
//! An epoch uses one row of every observation in random order, so the number of updates is the
//! paper's: epochs × observations of the tool set / batch. Launches, initial weights and every
//! epoch's draws have separate random streams, so a training resumed after any epoch gives
//! bit-identical results.

use std::sync::Arc;

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
use mge_base::identity::version;
use mge_base::stop::{Pieces, Stop, Stopped};
use mge_base::streams::Stream;
use mge_nn::{NnError, Optimiser, TensorFile, matrix, processor};
use mge_physics::ToolKind;

/// A training in progress: the model, the optimiser and the data.
#[derive(Debug)]
pub struct Training {
    learner: Learner,
    samples: Arc<Samples>,
    validation: Samples,
}

/// What an epoch changes.
#[derive(Debug, Clone)]
struct Learner {
    model: Model,
    optimiser: Optimiser,
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
    /// A stop was requested, or the callback asked for it; the training can be resumed.
    Stopped,
    /// The loss or a gradient was not finite. The model is that of the previous epoch.
    Diverged {
        /// The epoch that failed, counted from 1.
        epoch: u32,
        /// What was not finite, for people.
        reason: String,
    },
}

impl Training {
    /// A new training: collects the launches at `tools` and draws initial weights.
    /// `command` is recorded in the model, so that it can be reproduced.
    ///
    /// # Errors
    /// When a setting is out of range, the tool set is not usable, or `stop` is requested.
    pub fn new(
        config: ModelConfig,
        training: TrainConfig,
        tools: &[ToolKind],
        command: &str,
        stop: &Stop,
    ) -> Result<Self> {
        config.validate()?;
        training.validate()?;
        let tools = canonical_tool_set(tools)?;
        let mut data = Data::collect(&config, &training, &tools, stop)?;
        let builder = GraphBuilder::new(config.clone(), tools.clone());
        let layout = builder.layout();
        let normaliser = Normaliser::of(&data.samples.graphs, layout.edge, &data.samples.targets, stop)?;
        data.normalise(&normaliser, stop)?;
        let outputs = Codec::new(&config).outputs();
        let network = Network::new(&config, layout, outputs, &mut Stream::ModelWeights.of(training.seed))?;
        let optimiser = Optimiser::new(training.optimiser, &network.networks());
        let provenance = Provenance {
            training,
            epoch: 0,
            data_hash: std::mem::take(&mut data.hash),
            crate_version: version().to_owned(),
            processor: processor(),
            command: command.to_owned(),
        };
        let model = Model::assemble(config, tools, provenance, normaliser, network);
        Ok(data.into_training(model, optimiser))
    }

    /// The model after the epochs done so far.
    pub fn model(&self) -> &Model {
        &self.learner.model
    }

    /// Epochs done.
    pub fn epoch(&self) -> u32 {
        self.model().provenance.epoch
    }

    /// Trains until all epochs are done, `stop` is requested, `on_progress` returns false, or the loss diverges.
    /// `on_progress` is called after every epoch. An epoch that is stopped leaves no trace.
    pub fn run(&mut self, stop: &Stop, mut on_progress: impl FnMut(&Self, &Progress) -> bool) -> TrainingOutcome {
        let epochs = self.model().provenance.training.epochs;
        let mut pieces = Pieces::default();
        while self.epoch() < epochs {
            if stop.is_requested() {
                return TrainingOutcome::Stopped;
            }
            let (good, samples) = (self.learner.clone(), self.samples.clone());
            // On a thread of the rayon pool, work is divided with less overhead than from outside.
            let trained = pieces.run(&mut self.learner, stop, move |learner, stop| {
                match rayon::scope(|_| learner.train_epoch(&samples, stop)) {
                    Err(DynamicsError::Stopped) => None,
                    trained => Some(trained),
                }
            });
            let loss = match trained {
                None => return TrainingOutcome::Stopped,
                Some(Ok(loss)) => loss,
                Some(Err(reason)) => {
                    self.learner = good;
                    return TrainingOutcome::Diverged { epoch: self.epoch() + 1, reason: reason.to_string() };
                }
            };
            let epoch = self.epoch();
            if !on_progress(self, &Progress { epoch, epochs, loss }) && epoch < epochs {
                return TrainingOutcome::Stopped;
            }
        }
        TrainingOutcome::Done
    }

    /// Mean loss on the validation launches.
    pub fn validation_loss(&self) -> f32 {
        let outputs = self.model().network.predict(&self.validation.graphs);
        let loss = self.model().provenance.training.loss;
        let errors = outputs.iter().zip(&self.validation.targets).map(|(output, target)| f64::from(output - target));
        let sum: f64 = errors.map(|error| loss.of(error)).sum();
        (sum / outputs.len().max(1) as f64) as f32
    }

    /// The model and the optimiser's state: everything needed to resume.
    pub fn checkpoint(&self) -> TensorFile {
        let mut file = self.model().to_file();
        self.learner.optimiser.save(&mut file, OPTIMISER);
        file
    }

    /// Resumes from a checkpoint; `origin` names it in errors. The launches are collected
    /// again from the seed and must be identical.
    ///
    /// # Errors
    /// When the file is not a valid checkpoint, the launches differ, or `stop` is requested.
    pub fn resume(file: &TensorFile, origin: &str, stop: &Stop) -> Result<Self> {
        let model = Model::from_file(file, origin)?;
        let wrong = |source| DynamicsError::File { origin: origin.to_owned(), source };
        let optimiser = Optimiser::load(file, OPTIMISER).map_err(wrong)?;
        let provenance = &model.provenance;
        let mut data = Data::collect(&model.config, &provenance.training, &model.tools, stop)?;
        if data.hash != provenance.data_hash {
            return Err(DynamicsError::Content {
                origin: origin.to_owned(),
                reason: "its launches cannot be collected again by this version: start a new training".to_owned(),
            });
        }
        data.normalise(&model.normaliser, stop)?;
        Ok(data.into_training(model, optimiser))
    }
}

impl Learner {
    /// One pass over the observations, unless `stop` is requested. Returns the mean loss.
    fn train_epoch(&mut self, samples: &Samples, stop: &Stop) -> Result<f32> {
        let config = &self.model.provenance.training;
        let mut rng = Stream::ModelEpoch(self.model.provenance.epoch).of(config.seed);
        let mut order: Vec<usize> = (0..samples.observations()).collect();
        order.shuffle(&mut rng);
        let (batch, share, loss_kind) = (config.batch, config.contact_share, config.loss);
        let outputs = self.model.codec.outputs();
        let updates = (order.len().div_ceil(batch) * config.epochs as usize) as f64;
        let mut graphs = self.model.builder.empty();
        let mut sum = 0.0;
        for chosen in order.chunks(batch) {
            stop.check()?;
            graphs.clear();
            let mut targets = Vec::with_capacity(chosen.len() * outputs);
            for &observation in chosen {
                let row = samples.draw(observation, share, &mut rng);
                graphs.push_from(&samples.graphs, row);
                targets.extend_from_slice(&samples.targets[row * outputs..(row + 1) * outputs]);
            }
            let targets = matrix(&self.device, targets, chosen.len(), outputs);
            let predicted = self.model.network.forward(&graphs, &self.device);
            let loss = match loss_kind {
                Loss::Squared => mse_loss(predicted, targets),
                Loss::Huber(width) => huber_loss(predicted, targets, width),
            };
            let value = loss.array();
            if !value.is_finite() {
                return Err(NnError::NotFinite { norm: f64::from(value) }.into());
            }
            sum += f64::from(value) * chosen.len() as f64;
            let rate = self.model.provenance.training.rate(self.optimiser.steps() as f64 / updates);
            self.optimiser.update(&mut self.model.network.networks_mut(), &mut loss.backward(), rate)?;
        }
        self.model.provenance.epoch += 1;
        Ok((sum / order.len() as f64) as f32)
    }
}

const OPTIMISER: &str = "optimiser";
/// Pieces of the samples between which a stop request is noticed.
const PIECES: usize = 1000;

struct Data {
    samples: Samples,
    validation: Samples,
    hash: String,
}

impl Data {
    fn collect(config: &ModelConfig, training: &TrainConfig, tools: &[ToolKind], stop: &Stop) -> Result<Self> {
        let builder = GraphBuilder::new(config.clone(), tools.to_vec());
        let variety = Variety::of(config);
        let of = |split, count| -> Result<Vec<Launch>, Stopped> {
            let each = tools.iter().map(|&kind| collect(kind, variety, count, split, training.seed, stop));
            Ok(each.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
        };
        let launches = of(Split::Training, training.observations)?;
        let validation = of(Split::Validation, training.validation)?;
        let bystanders = || Bystanders {
            share: training.bystanders,
            cutoff: config.cutoff,
            tools: tools.to_vec(),
            variety,
            rng: Stream::Bystanders.of(training.seed),
        };
        let data = Self {
            hash: data_hash(stop.until(&launches), config.properties),
            samples: Samples::new(config, &builder, stop.until(&launches), training.mirror, bystanders())?,
            validation: Samples::new(config, &builder, stop.until(&validation), false, bystanders())?,
        };
        stop.check()?;
        Ok(data)
    }

    fn normalise(&mut self, normaliser: &Normaliser, stop: &Stop) -> Result<(), Stopped> {
        for samples in [&mut self.samples, &mut self.validation] {
            let targets = (&normaliser.targets, &mut samples.targets);
            for (columns, values) in normaliser.parts(&mut samples.graphs).chain([targets]) {
                let piece = values.len().div_ceil(PIECES).next_multiple_of(columns.width());
                stop.until(values.chunks_mut(piece.max(1))).for_each(|piece| columns.normalise(piece));
            }
        }
        stop.check()
    }

    fn into_training(self, model: Model, optimiser: Optimiser) -> Training {
        let learner = Learner { model, optimiser, device: Cpu::default() };
        Training { learner, samples: Arc::new(self.samples), validation: self.validation }
    }
}
