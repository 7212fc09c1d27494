//! Mean and scale of every feature and target, computed from the data and stored in the model.

use super::graph::Graphs;
use mge_nn::{TensorFile, TensorFileError};

/// Mean and scale of each column of a matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnStatistics {
    mean: Vec<f32>,
    scale: Vec<f32>,
}

/// The normalisation of a model's inputs and targets.
#[derive(Debug, Clone, PartialEq)]
pub struct Normaliser {
    /// Statistics of the inputs of each edge function.
    pub edges: Vec<ColumnStatistics>,
    /// Statistics of the node features.
    pub nodes: ColumnStatistics,
    /// Statistics of the targets.
    pub targets: ColumnStatistics,
}

impl ColumnStatistics {
    /// Statistics of `columns` columns. Constant columns get scale 1.
    pub fn of(values: &[f32], columns: usize) -> Self {
        let rows = (values.len() / columns).max(1) as f64;
        let mut mean = vec![0.0f64; columns];
        for row in values.chunks_exact(columns) {
            mean.iter_mut().zip(row).for_each(|(mean, value)| *mean += f64::from(*value) / rows);
        }
        let mut variance = vec![0.0f64; columns];
        for row in values.chunks_exact(columns) {
            for ((variance, mean), value) in variance.iter_mut().zip(&mean).zip(row) {
                *variance += (f64::from(*value) - mean).powi(2) / rows;
            }
        }
        let scale = |variance: &f64| if *variance > 1e-12 { variance.sqrt() as f32 } else { 1.0 };
        Self { mean: mean.iter().map(|mean| *mean as f32).collect(), scale: variance.iter().map(scale).collect() }
    }

    /// Subtracts the mean and divides by the scale.
    pub fn normalise(&self, values: &mut [f32]) {
        for row in values.chunks_exact_mut(self.mean.len()) {
            for ((value, mean), scale) in row.iter_mut().zip(&self.mean).zip(&self.scale) {
                *value = (*value - mean) / scale;
            }
        }
    }

    /// The inverse of [`normalise`](Self::normalise).
    pub fn denormalise(&self, values: &mut [f32]) {
        for row in values.chunks_exact_mut(self.mean.len()) {
            for ((value, mean), scale) in row.iter_mut().zip(&self.mean).zip(&self.scale) {
                *value = *value * scale + mean;
            }
        }
    }

    fn save(&self, file: &mut TensorFile, prefix: &str) {
        for (name, values) in [("mean", &self.mean), ("scale", &self.scale)] {
            file.insert(format!("{prefix}.{name}"), vec![values.len()], values.clone());
        }
    }

    fn load(file: &TensorFile, prefix: &str, columns: usize) -> Result<Self, TensorFileError> {
        let part = |name| Ok(file.get(&format!("{prefix}.{name}"), &[columns])?.to_vec());
        Ok(Self { mean: part("mean")?, scale: part("scale")? })
    }
}

impl Normaliser {
    /// Statistics of graphs and their targets.
    pub fn of(graphs: &Graphs, edge_columns: usize, targets: &[f32]) -> Self {
        let rows = graphs.scenes.max(1);
        Self {
            edges: graphs.edges.iter().map(|edges| ColumnStatistics::of(&edges.inputs, edge_columns)).collect(),
            nodes: ColumnStatistics::of(&graphs.nodes, graphs.nodes.len() / rows),
            targets: ColumnStatistics::of(targets, targets.len() / rows),
        }
    }

    /// Normalises the features of graphs in place.
    pub fn normalise(&self, graphs: &mut Graphs) {
        self.nodes.normalise(&mut graphs.nodes);
        for (columns, edges) in self.edges.iter().zip(&mut graphs.edges) {
            columns.normalise(&mut edges.inputs);
        }
    }

    /// Adds the statistics to `file`.
    pub fn save(&self, file: &mut TensorFile) {
        for (index, edge) in self.edges.iter().enumerate() {
            edge.save(file, &format!("normaliser.edge.{index}"));
        }
        self.nodes.save(file, "normaliser.node");
        self.targets.save(file, "normaliser.target");
    }

    /// The statistics that [`save`](Self::save) stored.
    ///
    /// # Errors
    /// When a part is missing or has another shape.
    pub fn load(
        file: &TensorFile,
        (functions, edge, node, target): (usize, usize, usize, usize),
    ) -> Result<Self, TensorFileError> {
        Ok(Self {
            edges: (0..functions)
                .map(|index| ColumnStatistics::load(file, &format!("normaliser.edge.{index}"), edge))
                .collect::<Result<_, _>>()?,
            nodes: ColumnStatistics::load(file, "normaliser.node", node)?,
            targets: ColumnStatistics::load(file, "normaliser.target", target)?,
        })
    }
}
