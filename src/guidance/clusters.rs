//! K-means clusters of rewarding actions and their statistics (paper, section 4.2).

use linfa::DatasetBase;
use linfa::prelude::*;
use linfa_clustering::KMeans;
use ndarray::{Array1, Array2, Axis};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::env::{Action, TOOL_FEATURES};

/// Number of clusters of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClusterCount {
    /// Exactly this many (fewer if there are fewer distinct actions).
    Fixed(usize),
    /// The number between 2 and this value with the largest mean silhouette.
    Silhouette(usize),
}

/// Mean and standard deviation of a cluster of rewarding actions: the normal
/// distribution from which exploration samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cluster {
    /// Mean of x and y, normalised.
    pub mean: [f32; 2],
    /// Standard deviation of x and y, not below the floor.
    pub std: [f32; 2],
    /// Share of the stage's actions that belong to it.
    pub weight: f32,
    /// Number of actions that belong to it.
    pub count: usize,
}

impl Cluster {
    /// An action from the cluster's normal distribution, clipped to [-1, 1].
    pub fn sample(&self, rng: &mut impl Rng) -> Action {
        std::array::from_fn(|axis| clipped_normal(self.mean[axis], self.std[axis], rng))
    }
}

/// The tools of a cluster of rewarding actions: the normal distribution of their embeddings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToolCluster {
    /// Mean of each number.
    pub mean: Vec<f32>,
    /// Standard deviation of each number.
    pub std: Vec<f32>,
}

impl ToolCluster {
    /// The tools of the actions with indices `members`, at least one. Actions are positions and embeddings; `None` if
    /// they have no embeddings.
    pub(super) fn of<P: AsRef<[f32]>>(actions: &[P], members: &[usize]) -> Option<Self> {
        let tool = |member: &usize| actions[*member].as_ref().get(2..).filter(|tool| !tool.is_empty());
        let tools = members.iter().map(tool).collect::<Option<Vec<&[f32]>>>()?;
        let mean_of = |column: usize, of: &dyn Fn(f32) -> f32| {
            tools.iter().map(|tool| of(tool[column])).sum::<f32>() / tools.len() as f32
        };
        let mean: Vec<f32> = (0..tools.first()?.len()).map(|column| mean_of(column, &|value| value)).collect();
        let variance = |(column, mean): (usize, &f32)| mean_of(column, &|value| (value - mean).powi(2));
        let std = mean.iter().enumerate().map(variance).map(f32::sqrt).collect();
        Some(Self { mean, std })
    }

    /// Whether all values are possible for tools.
    pub(super) fn is_possible(&self) -> bool {
        let within = |low: f32, values: &[f32]| values.iter().all(|value| (low..=1.0).contains(value));
        let lengths = [self.mean.len(), self.std.len()];
        lengths == [TOOL_FEATURES; 2] && within(-1.0, &self.mean) && within(0.0, &self.std)
    }
}

/// A number from a normal distribution, clipped to [-1, 1].
pub(super) fn clipped_normal(mean: f32, std: f32, rng: &mut impl Rng) -> f32 {
    let normal: f32 = StandardNormal.sample(rng);
    (mean + std * normal).clamp(-1.0, 1.0)
}

/// Clusters of `actions`, the largest first; empty if there are no actions.
pub(super) fn cluster(actions: &[Action], count: ClusterCount, std_floor: f32, rng: &ChaCha8Rng) -> Vec<Cluster> {
    let clusters = cluster_points(actions, count, std_floor, rng);
    clusters.into_iter().map(|(cluster, _)| cluster).collect()
}

/// Clusters of points, the largest first, each with the indices of its points. Points begin with x
/// and y and have equal lengths.
pub(super) fn cluster_points<P: AsRef<[f32]>>(
    points: &[P],
    count: ClusterCount,
    std_floor: f32,
    rng: &ChaCha8Rng,
) -> Vec<(Cluster, Vec<usize>)> {
    let distinct = count_distinct(points);
    if distinct == 0 {
        return Vec::new();
    }
    let columns = points[0].as_ref().len();
    let points = Array2::from_shape_fn((points.len(), columns), |(row, axis)| f64::from(points[row].as_ref()[axis]));
    let labels = match count {
        ClusterCount::Fixed(k) => assign(&points, k.clamp(1, distinct), rng),
        ClusterCount::Silhouette(most) => best_silhouette(&points, most.min(distinct.saturating_sub(1)), rng),
    };
    let clusters = 1 + labels.iter().max().copied().unwrap_or(0);
    let mut clusters: Vec<(Cluster, Vec<usize>)> =
        (0..clusters).filter_map(|label| describe(&points, &labels, label, std_floor)).collect();
    clusters.sort_by(|(a, _), (b, _)| b.count.cmp(&a.count).then(a.mean[0].total_cmp(&b.mean[0])));
    clusters
}

fn count_distinct<P: AsRef<[f32]>>(points: &[P]) -> usize {
    let bits = |point: &P| point.as_ref().iter().map(|value| value.to_bits()).collect();
    let mut bits: Vec<Vec<u32>> = points.iter().map(bits).collect();
    bits.sort_unstable();
    bits.dedup();
    bits.len()
}

fn assign(points: &Array2<f64>, clusters: usize, rng: &ChaCha8Rng) -> Array1<usize> {
    let dataset = DatasetBase::from(points.clone());
    let fitted =
        KMeans::params_with_rng(clusters, rng.clone()).n_runs(10).max_n_iterations(300).tolerance(1e-6).fit(&dataset);
    match fitted {
        Ok(model) => model.predict(points),
        // Points are finite, and at least as many are distinct as there are clusters, so the only
        // possible error is a failure to converge: fall back to a single cluster.
        Err(_) => Array1::zeros(points.nrows()),
    }
}

fn best_silhouette(points: &Array2<f64>, most: usize, rng: &ChaCha8Rng) -> Array1<usize> {
    let score = |labels: &Array1<usize>| {
        DatasetBase::new(points.clone(), labels.clone()).silhouette_score().unwrap_or(f64::NEG_INFINITY)
    };
    (2..=most)
        .map(|k| assign(points, k, rng))
        .map(|labels| (score(&labels), labels))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(|| Array1::zeros(points.nrows()), |(_, labels)| labels)
}

fn describe(
    points: &Array2<f64>,
    labels: &Array1<usize>,
    label: usize,
    std_floor: f32,
) -> Option<(Cluster, Vec<usize>)> {
    let rows: Vec<usize> = labels.iter().enumerate().filter(|(_, l)| **l == label).map(|(row, _)| row).collect();
    let members = points.select(Axis(0), &rows);
    let mean = members.mean_axis(Axis(0))?;
    let std = members.std_axis(Axis(0), 0.0);
    let count = members.nrows();
    let cluster = Cluster {
        mean: [mean[0] as f32, mean[1] as f32],
        std: [std[0], std[1]].map(|s| (s as f32).max(std_floor)),
        weight: count as f32 / points.nrows() as f32,
        count,
    };
    Some((cluster, rows))
}
