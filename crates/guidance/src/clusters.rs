//! K-means clusters of rewarding actions and their statistics (paper, section 4.2).

use linfa::DatasetBase;
use linfa::prelude::*;
use linfa_clustering::KMeans;
use ndarray::{Array1, Array2, Axis};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::config::GuidanceConfig;
use mge_dynamics::{DynamicsError, Result};
use mge_env::Action;

/// Number of clusters of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClusterCount {
    /// Exactly this many; fewer if there are fewer distinct actions.
    pub fixed: usize,
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

/// A number from a normal distribution, clipped to [-1, 1].
pub(super) fn clipped_normal(mean: f32, std: f32, rng: &mut impl Rng) -> f32 {
    let normal: f32 = StandardNormal.sample(rng);
    (mean + std * normal).clamp(-1.0, 1.0)
}

/// Clusters of actions, the largest first; empty if there are no actions.
///
/// # Errors
/// [`DynamicsError::ActionNotFinite`].
pub(super) fn cluster(actions: &[Action], config: &GuidanceConfig, rng: &ChaCha8Rng) -> Result<Vec<Cluster>> {
    let distinct = count_distinct(actions);
    if distinct == 0 {
        return Ok(Vec::new());
    }
    if actions.iter().flatten().any(|value| !value.is_finite()) {
        return Err(DynamicsError::ActionNotFinite);
    }
    let points = Array2::from_shape_fn((actions.len(), 2), |(row, axis)| f64::from(actions[row][axis]));
    let labels = assign(&points, config.clusters.fixed.clamp(1, distinct), rng)?;
    let clusters = 1 + labels.iter().max().copied().unwrap_or(0);
    let mut clusters: Vec<_> =
        (0..clusters).filter_map(|label| describe(&points, &labels, label, config.std_floor)).collect();
    clusters.sort_by(|a, b| b.count.cmp(&a.count).then(a.mean[0].total_cmp(&b.mean[0])));
    Ok(clusters)
}

fn count_distinct(actions: &[Action]) -> usize {
    let mut bits: Vec<[u32; 2]> = actions.iter().map(|action| action.map(f32::to_bits)).collect();
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

/// The cluster of the points with a label. No standard deviation is below the floor: exploration would otherwise repeat
/// a cluster of equal actions for ever.
fn describe(points: &Array2<f64>, labels: &Array1<usize>, label: usize, std_floor: f32) -> Option<Cluster> {
    let rows: Vec<usize> = labels.iter().enumerate().filter(|(_, l)| **l == label).map(|(row, _)| row).collect();
    let members = points.select(Axis(0), &rows);
    let mean: Vec<f32> = members.mean_axis(Axis(0))?.iter().map(|mean| *mean as f32).collect();
    let std: Vec<f32> = members.std_axis(Axis(0), 0.0).iter().map(|std| (*std as f32).max(std_floor)).collect();
    let count = members.nrows();
    let weight = count as f32 / points.nrows() as f32;
    Some(Cluster { mean: [mean[0], mean[1]], std: [std[0], std[1]], weight, count })
}
