//! Training of a dynamics model (paper, section 5.2 and table 1).
//!
//! An epoch uses one row of every observation in random order, so the number of updates is the
//! paper's: epochs × observations of the tool set / batch. Launches, initial weights and every
//! epoch's draws have separate random streams.

use dfdx::losses::{huber_loss, mse_loss};
use dfdx::prelude::*;
use rand::seq::SliceRandom;

use super::bystander::Bystanders;
use super::codec::Codec;
use super::config::Loss;
use super::error::{DynamicsError, Result};
use super::graph::GraphBuilder;
use super::launch::{Launch, Split, collect, data_hash};
use super::model::{Model, Provenance};
use super::network::Network;
use super::normaliser::Normaliser;
use super::recipe::Recipe;
use super::samples::Samples;
use super::variety::Variety;
use mge_base::atomic::{self, Target};
use mge_base::identity::version;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_nn::{NnError, Optimiser, matrix, processor};

/// A training in progress: the model, the optimiser and the data.
#[derive(Debug)]
pub struct Training {
    /// The model after the epochs done so far.
    pub model: Model,
    /// The epoch in which the training diverged and the reason; the model is then that of the epoch before.
    pub diverged: Option<String>,
    optimiser: Optimiser,
    device: Cpu,
    samples: Samples,
    validation: Samples,
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

/// Trains a model into a file. `on_progress` is called after every epoch. The other arguments are those of
/// [`Training::new`].
///
/// # Errors
/// As [`Training::new`] and [`Training::run`]; when the file is of another kind or cannot be written.
pub fn train_to_file(
    to: impl Into<Target>,
    recipe: &Recipe,
    command: &str,
    stop: &Stop,
    on_progress: impl FnMut(&Progress),
) -> Result<Training> {
    // Refused before anything is made.
    let (recipe, to) = (recipe.checked()?, to.into());
    let checked = to.check(&Model::FORMAT).and_then(|()| atomic::create_parent(&to.path));
    checked.map_err(|source| DynamicsError::Io { origin: to.path.display().to_string(), source })?;
    let mut training = Training::new(&recipe, command, stop)?;
    training.run(stop, on_progress)?;
    training.model.save(&to.path)?;
    Ok(training)
}

impl Training {
    /// A new training: collects the launches at `tools` and draws initial weights.
    /// `command` is recorded in the model, so that it can be reproduced.
    ///
    /// # Errors
    /// When a setting is out of range, the tool set is not usable, or `stop` is requested.
    pub fn new(recipe: &Recipe, command: &str, stop: &Stop) -> Result<Self> {
        let recipe = recipe.checked()?;
        let Recipe { tools, config, training } = recipe.clone();
        let builder = GraphBuilder::new(config.clone(), tools.clone());
        let layout = builder.layout();
        let (mut samples, mut validation, data_hash) = collect_samples(&recipe, &builder, stop)?;
        let normaliser = Normaliser::of(&samples.graphs, layout.edge, &samples.targets);
        for samples in [&mut samples, &mut validation] {
            normaliser.normalise(&mut samples.graphs);
            normaliser.targets.normalise(&mut samples.targets);
        }
        let outputs = Codec::new(&config).outputs();
        let network = Network::new(&config, layout, outputs, &mut Stream::ModelWeights.of(training.seed))?;
        let optimiser = Optimiser::new(training.optimiser, &network.networks());
        let provenance = Provenance {
            training,
            epoch: 0,
            data_hash,
            crate_version: version().to_owned(),
            processor: processor(),
            command: command.to_owned(),
            losses: None,
        };
        let model = Model::assemble(config, tools, provenance, normaliser, network);
        Ok(Self { model, diverged: None, optimiser, device: Cpu::default(), samples, validation })
    }

    /// Epochs done.
    pub fn epoch(&self) -> u32 {
        self.model.provenance.epoch
    }

    /// Trains until all epochs are done or the loss diverges. `on_progress` is called after every epoch.
    ///
    /// # Errors
    /// When `stop` is requested.
    pub fn run(&mut self, stop: &Stop, mut on_progress: impl FnMut(&Progress)) -> Result<()> {
        let epochs = self.model.provenance.training.epochs;
        let mut latest = None;
        while self.diverged.is_none() && self.epoch() < epochs {
            let good = (self.model.clone(), self.optimiser.clone());
            // On a thread of the rayon pool, work is divided with less overhead than from outside.
            match rayon::scope(|_| self.train_epoch(stop)) {
                Err(DynamicsError::Stopped(stopped)) => return Err(stopped.into()),
                Ok(loss) => {
                    latest = Some(loss);
                    on_progress(&Progress { epoch: self.epoch(), epochs, loss });
                }
                Err(reason) => {
                    (self.model, self.optimiser) = good;
                    self.diverged = Some(format!("epoch {}: {reason}", self.epoch() + 1));
                }
            }
        }
        let losses = latest.map(|loss| [loss, self.validation_loss()]);
        self.model.provenance.losses = losses.filter(|losses| losses.iter().all(|loss| loss.is_finite()));
        Ok(())
    }

    /// Mean loss on the validation launches.
    pub fn validation_loss(&self) -> f32 {
        let outputs = self.model.network.predict(&self.validation.graphs);
        let loss = self.model.provenance.training.loss;
        let errors = outputs.iter().zip(&self.validation.targets).map(|(output, target)| f64::from(output - target));
        let sum: f64 = errors.map(|error| loss.of(error)).sum();
        (sum / outputs.len().max(1) as f64) as f32
    }

    /// One pass over the observations, unless `stop` is requested. Returns the mean loss.
    fn train_epoch(&mut self, stop: &Stop) -> Result<f32> {
        let (config, samples) = (&self.model.provenance.training, &self.samples);
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
            let rate = self.model.provenance.training.rate(self.optimiser.steps as f64 / updates);
            self.optimiser.update(&mut self.model.network.networks_mut(), &mut loss.backward(), rate)?;
        }
        self.model.provenance.epoch += 1;
        Ok((sum / order.len() as f64) as f32)
    }
}

/// The rows of the launches of a training, those of its validation, and the hash of the former.
fn collect_samples(recipe: &Recipe, builder: &GraphBuilder, stop: &Stop) -> Result<(Samples, Samples, String)> {
    let Recipe { tools, config, training } = recipe;
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
        tools: tools.clone(),
        variety,
        rng: Stream::Bystanders.of(training.seed),
    };
    let hash = data_hash(stop.until(&launches), config.properties);
    let samples = Samples::new(config, builder, stop.until(&launches), training.mirror, bystanders())?;
    let validation = Samples::new(config, builder, stop.until(&validation), false, bystanders())?;
    stop.check()?;
    Ok((samples, validation, hash))
}
