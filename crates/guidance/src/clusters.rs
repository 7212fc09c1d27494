//! K-means clusters of rewarding actions and their statistics (paper, section 4.2).

use linfa::DatasetBase;
use linfa::prelude::*;
use linfa_clustering::KMeans;
use ndarray::{Array1, Array2, Axis};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use mge_dynamics::{DynamicsError, Result};
use mge_env::{Action, TOOL_FEATURES};

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
    /// Standard deviation of each number, not below the floor.
    pub std: Vec<f32>,
}

impl ToolCluster {
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

/// Clusters of points, the largest first, each with its tools if the points have any; empty if there are no points.
/// Points have equal lengths: they begin with x and y, and the embedding of a tool may follow.
///
/// # Errors
/// [`DynamicsError::ActionNotFinite`].
pub(super) fn cluster<P: AsRef<[f32]>>(
    points: &[P],
    count: ClusterCount,
    std_floor: f32,
    rng: &ChaCha8Rng,
) -> Result<Vec<(Cluster, Option<ToolCluster>)>> {
    let distinct = count_distinct(points);
    if distinct == 0 {
        return Ok(Vec::new());
    }
    if points.iter().flat_map(AsRef::as_ref).any(|value| !value.is_finite()) {
        return Err(DynamicsError::ActionNotFinite);
    }
    let columns = points[0].as_ref().len();
    let points = Array2::from_shape_fn((points.len(), columns), |(row, axis)| f64::from(points[row].as_ref()[axis]));
    let labels = match count {
        ClusterCount::Fixed(k) => assign(&points, k.clamp(1, distinct), rng)?,
        ClusterCount::Silhouette(most) => best_silhouette(&points, most.min(distinct.saturating_sub(1)), rng)?,
    };
    let clusters = 1 + labels.iter().max().copied().unwrap_or(0);
    let mut clusters: Vec<_> = (0..clusters).filter_map(|label| describe(&points, &labels, label, std_floor)).collect();
    clusters.sort_by(|(a, _), (b, _)| b.count.cmp(&a.count).then(a.mean[0].total_cmp(&b.mean[0])));
    Ok(clusters)
}

fn count_distinct<P: AsRef<[f32]>>(points: &[P]) -> usize {
    let bits = |point: &P| point.as_ref().iter().map(|value| value.to_bits()).collect();
    let mut bits: Vec<Vec<u32>> = points.iter().map(bits).collect();
    bits.sort_unstable();
    bits.dedup();
    bits.len()
}

fn assign(points: &Array2<f64>, clusters: usize, rng: &ChaCha8Rng) -> Result<Array1<usize>> {
    let dataset = DatasetBase::from(points.clone());
    let fitted =
        KMeans::params_with_rng(clusters, rng.clone()).n_runs(10).max_n_iterations(300).tolerance(1e-6).fit(&dataset);
    // The settings are valid, and reaching the limit of iterations is no error: what is left, that the distances of the
    // points from their centres have no finite sum, does not occur for finite points.
    let model = fitted.map_err(|_| DynamicsError::ActionNotFinite)?;
    Ok(model.predict(points))
}

fn best_silhouette(points: &Array2<f64>, most: usize, rng: &ChaCha8Rng) -> Result<Array1<usize>> {
    let score = |labels: &Array1<usize>| {
        DatasetBase::new(points.clone(), labels.clone()).silhouette_score().unwrap_or(f64::NEG_INFINITY)
    };
    let mut best = (f64::NEG_INFINITY, Array1::zeros(points.nrows()));
    for k in 2..=most {
        let labels = assign(points, k, rng)?;
        let score = score(&labels);
        // The larger number of equal ones.
        if score.total_cmp(&best.0).is_ge() {
            best = (score, labels);
        }
    }
    Ok(best.1)
}

/// The cluster of the points with a label, and its tools if the points have any. No standard deviation is below the
/// floor: exploration would otherwise repeat a cluster of equal actions or tools for ever.
fn describe(
    points: &Array2<f64>,
    labels: &Array1<usize>,
    label: usize,
    std_floor: f32,
) -> Option<(Cluster, Option<ToolCluster>)> {
    let rows: Vec<usize> = labels.iter().enumerate().filter(|(_, l)| **l == label).map(|(row, _)| row).collect();
    let members = points.select(Axis(0), &rows);
    let mean: Vec<f32> = members.mean_axis(Axis(0))?.iter().map(|mean| *mean as f32).collect();
    let std: Vec<f32> = members.std_axis(Axis(0), 0.0).iter().map(|std| (*std as f32).max(std_floor)).collect();
    let count = members.nrows();
    let weight = count as f32 / points.nrows() as f32;
    let cluster = Cluster { mean: [mean[0], mean[1]], std: [std[0], std[1]], weight, count };
    let tools = (mean.len() > 2).then(|| ToolCluster { mean: mean[2..].to_vec(), std: std[2..].to_vec() });
    Some((cluster, tools))
}
