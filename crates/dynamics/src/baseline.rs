//! Two baseline predictors without learning, with which a model's errors are compared.

use super::codec::Codec;
use super::config::{ModelConfig, Targets};
use super::error::Result;
use super::graph::{Edges, GraphBuilder};
use super::launch::{Launch, Split, collect};
use super::model::Model;
use super::normaliser::ColumnStatistics;
use super::predictor::Predictor;
use super::variety::Variety;
use mge_base::stop::Stop;
use mge_physics::{BallState, GRAVITY, PHYSICS_DT, STEPS_PER_ACTION, Tool};

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
        // Positions move before gravity acts, so a step only includes the gravity of earlier steps.
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

/// The state change of the most similar stored sample: the nearest one in normalised edge
/// features with the same tool type as the nearest tool; free flight if no edge is active.
#[derive(Debug, Clone)]
pub struct NearestSample {
    builder: GraphBuilder,
    codec: Codec,
    free: ConstantVelocity,
    tables: Vec<Table>,
}

/// Launches per tool that are searched for the nearest sample; searching more would take minutes.
const STORED: usize = 1000;

/// Stored samples of one edge function.
#[derive(Debug, Clone)]
struct Table {
    columns: ColumnStatistics,
    /// The columns that vary; `inputs` consists of these only.
    used: Vec<usize>,
    inputs: Vec<f32>,
    targets: Vec<f32>,
}

impl NearestSample {
    /// Stores the first [`STORED`] training launches of each of the model's tools, one sample per
    /// prediction interval. Features follow the model's settings, but with distinct edge functions,
    /// dynamic edges and relative coordinates.
    ///
    /// # Errors
    /// When no graph can be built with the model's settings, or `stop` is requested.
    pub fn of(model: &Model, stop: &Stop) -> Result<Self> {
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
        let (columns, variety) = (builder.layout().edge, Variety::of(&config));
        let table = |(function, &kind)| {
            let count = training.observations.min(STORED);
            let launches = collect(kind, variety, count, Split::Training, training.seed, stop)?;
            let (edges, targets) = stored(&builder, &codec, config.interval as usize, &launches, function)?;
            Ok(Table::new(edges, targets, columns, stop))
        };
        let tables = model.tools.iter().enumerate().map(table).collect::<Result<_>>()?;
        Ok(Self { builder, codec, free: ConstantVelocity { interval: config.interval }, tables })
    }
}

/// The samples with an active edge from launches at one tool type, with their targets.
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
    /// Samples with these inputs and targets. Columns that do not vary, such as the one-hot types, do
    /// not affect which sample is nearest and are left out.
    fn new(edges: Edges, targets: Vec<f32>, columns: usize, stop: &Stop) -> Self {
        let statistics = ColumnStatistics::of(&edges.inputs, columns, stop);
        let first = edges.inputs.get(..columns).unwrap_or_default();
        let varies = |column: &usize| edges.inputs.chunks_exact(columns).any(|row| row[*column] != first[*column]);
        let used: Vec<usize> = (0..columns).filter(varies).collect();
        let mut inputs = edges.inputs;
        statistics.normalise(&mut inputs);
        let inputs = inputs.chunks_exact(columns).flat_map(|row| used.iter().map(|column| row[*column])).collect();
        Self { columns: statistics, used, inputs, targets }
    }

    /// The target of the sample nearest to normalised inputs.
    fn nearest(&self, inputs: &[f32], outputs: usize) -> Option<&[f32]> {
        if self.used.is_empty() {
            // All samples are alike, or there are none.
            return self.targets.get(..outputs);
        }
        let wanted: Vec<f32> = self.used.iter().map(|column| inputs[*column]).collect();
        let mut least = f32::INFINITY;
        let mut found = None;
        for (row, sample) in self.inputs.chunks_exact(wanted.len()).enumerate() {
            let mut distance = 0.0;
            for (sample, wanted) in sample.chunks(NUMBERS).zip(wanted.chunks(NUMBERS)) {
                sample.iter().zip(wanted).for_each(|(a, b)| distance += (a - b) * (a - b));
                if distance > least {
                    break;
                }
            }
            if distance < least {
                (least, found) = (distance, Some(row));
            }
        }
        found.and_then(|row| self.targets.get(row * outputs..(row + 1) * outputs))
    }
}

/// Numbers that are compared between two checks whether a sample is farther than the nearest so far.
const NUMBERS: usize = 4;
