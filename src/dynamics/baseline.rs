//! Two predictors that learn nothing, next to which a model's errors are reported.

use super::codec::Codec;
use super::config::{ModelConfig, Targets};
use super::error::Result;
use super::graph::{Edges, GraphBuilder};
use super::launch::{Launch, Split, collect};
use super::model::Model;
use super::normaliser::Columns;
use super::predictor::Predictor;
use crate::physics::{BallState, GRAVITY, PHYSICS_DT, STEPS_PER_ACTION, Tool};

/// Free flight: constant horizontal velocity, gravity, no tool has any effect.
#[derive(Debug, Clone, Copy)]
pub struct ConstantVelocity {
    /// Physics steps from one prediction to the next.
    pub interval: u32,
}

impl Predictor for ConstantVelocity {
    fn interval(&self) -> u32 {
        self.interval
    }

    fn advance(&self, balls: &[BallState], _: &[&[Tool]]) -> Result<Vec<BallState>> {
        let steps = self.interval as f32;
        let seconds = steps * PHYSICS_DT;
        // Positions move before gravity acts, so a step sees the gravity of those before it.
        let fall = PHYSICS_DT * PHYSICS_DT * steps * (steps - 1.0) / 2.0;
        let fly = |ball: &BallState| BallState {
            position: std::array::from_fn(|axis| {
                ball.position[axis] + ball.velocity[axis] * seconds + GRAVITY[axis] * fall
            }),
            velocity: std::array::from_fn(|axis| ball.velocity[axis] + GRAVITY[axis] * seconds),
            ..*ball
        };
        Ok(balls.iter().map(fly).collect())
    }
}

/// The change that followed the most similar stored sample: the nearest in normalised
/// edge features among those of the same tool type, for the nearest active tool; free
/// flight if no tool is near.
#[derive(Debug, Clone)]
pub struct NearestSample {
    builder: GraphBuilder,
    codec: Codec,
    free: ConstantVelocity,
    tables: Vec<Table>,
}

/// Launches of each tool among which the nearest sample is looked for: of more it would take minutes.
const STORED: usize = 1000;

/// Stored samples of one edge function.
#[derive(Debug, Clone)]
struct Table {
    columns: Columns,
    inputs: Vec<f32>,
    targets: Vec<f32>,
}

impl NearestSample {
    /// Stores launches that `model` was trained on, the first [`STORED`] of each tool, one sample for each
    /// prediction interval, with the model's own features, distinct and near.
    ///
    /// # Errors
    /// When the model's settings make no graphs.
    pub fn of(model: &Model) -> Result<Self> {
        let config = ModelConfig {
            targets: Targets::Residual,
            spin: true,
            edge_functions: Default::default(),
            edges: Default::default(),
            coordinates: Default::default(),
            ..model.config.clone()
        };
        let builder = GraphBuilder::new(config.clone(), model.tools.clone());
        let codec = Codec::new(&config);
        let training = &model.provenance.training;
        let columns = builder.layout().edge;
        let table = |(function, &kind)| {
            let launches = collect(kind, training.observations.min(STORED), Split::Training, training.seed);
            let (edges, targets) = stored(&builder, &codec, config.interval as usize, &launches, function)?;
            let statistics = Columns::of(&edges.inputs, columns);
            let mut inputs = edges.inputs;
            statistics.normalise(&mut inputs);
            Ok(Table { columns: statistics, inputs, targets })
        };
        let tables = model.tools.iter().enumerate().map(table).collect::<Result<_>>()?;
        Ok(Self { builder, codec, free: ConstantVelocity { interval: config.interval }, tables })
    }
}

/// The active samples of launches at one tool type, with their targets.
fn stored(
    builder: &GraphBuilder,
    codec: &Codec,
    interval: usize,
    launches: &[Launch],
    function: usize,
) -> Result<(Edges, Vec<f32>)> {
    let (mut graphs, mut targets) = (builder.empty(), Vec::new());
    for launch in launches {
        for start in (0..STEPS_PER_ACTION as usize).step_by(interval) {
            let before = graphs.edges[function].receivers.len();
            builder.push(&mut graphs, &launch.states[start], [&launch.tool])?;
            if graphs.edges[function].receivers.len() > before {
                codec.encode(&launch.states[start], &launch.states[start + interval], &mut targets);
            }
        }
    }
    Ok((graphs.edges.swap_remove(function), targets))
}

impl Predictor for NearestSample {
    fn interval(&self) -> u32 {
        self.free.interval
    }

    fn advance(&self, balls: &[BallState], tools: &[&[Tool]]) -> Result<Vec<BallState>> {
        let mut next = self.free.advance(balls, tools)?;
        for ((next, ball), tools) in next.iter_mut().zip(balls).zip(tools) {
            let distance = |tool: &&Tool| tool.surface(ball.position).0;
            let Some(tool) = tools.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else { continue };
            let mut graphs = self.builder.empty();
            self.builder.push(&mut graphs, ball, [tool])?;
            let found = graphs.edges.iter_mut().zip(&self.tables).find(|(edges, _)| !edges.receivers.is_empty());
            if let Some((edges, table)) = found {
                table.columns.normalise(&mut edges.inputs);
                if let Some(target) = table.nearest(&edges.inputs, self.codec.outputs()) {
                    *next = self.codec.decode(ball, target);
                }
            }
        }
        Ok(next)
    }
}

impl Table {
    fn nearest(&self, wanted: &[f32], outputs: usize) -> Option<&[f32]> {
        let distance = |row: &[f32]| row.iter().zip(wanted).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
        let rows = self.inputs.chunks_exact(wanted.len()).map(distance).enumerate();
        let (row, _) = rows.min_by(|a, b| a.1.total_cmp(&b.1))?;
        self.targets.get(row * outputs..(row + 1) * outputs)
    }
}
