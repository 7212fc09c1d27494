//! Initial weights, drawn from the caller's generator.

use rand::{Rng, distributions::Uniform};
use rand_distr::StandardNormal;

/// Distribution of initial weights. Biases start at 0 unless noted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InitScheme {
    /// Random orthonormal rows or columns (Saxe et al., 2014): preserves the scale of signals
    /// through deep stacks.
    Orthogonal,
    /// Weights and biases uniform in ±1 / sqrt(fan_in), as in PyTorch's `Linear` and in DDPG
    /// (Lillicrap et al., 2016).
    FanIn,
}

/// How a network is initialised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Init {
    /// Distribution of every layer.
    pub scheme: InitScheme,
    /// If given, weights and biases of the last layer are uniform in ± this bound instead
    /// (DDPG: 3e-3, so that the first outputs are near 0).
    pub last_bound: Option<f32>,
}

impl From<InitScheme> for Init {
    fn from(scheme: InitScheme) -> Self {
        Self { scheme, last_bound: None }
    }
}

impl Init {
    /// Weight (`inputs` × `outputs`, row-major) and then bias (`outputs`) of one layer.
    pub(super) fn layer<R: Rng + ?Sized>(&self, inputs: usize, outputs: usize, is_last: bool, rng: &mut R) -> Vec<f32> {
        let weights = inputs * outputs;
        if let (true, Some(bound)) = (is_last, self.last_bound) {
            return uniform(weights + outputs, bound, rng);
        }
        let mut parameters = match self.scheme {
            InitScheme::Orthogonal => orthogonal(inputs, outputs, rng),
            InitScheme::FanIn => uniform(weights + outputs, 1.0 / (inputs as f32).sqrt(), rng),
        };
        parameters.resize(weights + outputs, 0.0);
        parameters
    }
}

fn uniform<R: Rng + ?Sized>(n: usize, bound: f32, rng: &mut R) -> Vec<f32> {
    let distribution = Uniform::new_inclusive(-bound.abs(), bound.abs());
    (0..n).map(|_| rng.sample(distribution)).collect()
}

/// Orthonormal rows (or columns, whichever are fewer) by Gram-Schmidt on normal vectors.
fn orthogonal<R: Rng + ?Sized>(rows: usize, columns: usize, rng: &mut R) -> Vec<f32> {
    let (count, length) = (rows.min(columns), rows.max(columns));
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(count);
    while basis.len() < count {
        let mut v: Vec<f64> = (0..length).map(|_| rng.sample(StandardNormal)).collect();
        // Two passes: after one, rounding errors leave the vectors not quite orthogonal.
        for _ in 0..2 {
            for b in &basis {
                let dot: f64 = v.iter().zip(b).map(|(x, y)| x * y).sum();
                v.iter_mut().zip(b).for_each(|(x, y)| *x -= dot * y);
            }
        }
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A vector almost inside the span of the others is drawn again.
        if norm > 1e-6 {
            v.iter_mut().for_each(|x| *x /= norm);
            basis.push(v);
        }
    }
    let mut weight = Vec::with_capacity(rows * columns);
    for r in 0..rows {
        for c in 0..columns {
            let (i, j) = if rows <= columns { (r, c) } else { (c, r) };
            weight.push(basis[i][j] as f32);
        }
    }
    weight
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn orthogonal_has_orthonormal_short_side() {
        for (rows, columns) in [(5, 9), (9, 5), (6, 6)] {
            let w = orthogonal(rows, columns, &mut ChaCha8Rng::seed_from_u64(1));
            let at = |i: usize, j: usize| {
                if rows <= columns { w[i * columns + j] } else { w[j * columns + i] }
            };
            let (count, length) = (rows.min(columns), rows.max(columns));
            for a in 0..count {
                for b in 0..count {
                    let dot: f32 = (0..length).map(|j| at(a, j) * at(b, j)).sum();
                    let expected = if a == b { 1.0 } else { 0.0 };
                    assert!((dot - expected).abs() < 1e-5, "rows {a} {b}: {dot}");
                }
            }
        }
    }

    #[test]
    fn bounds_are_kept_and_reached() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut largest = |init: Init, is_last| {
            let parameters = init.layer(100, 50, is_last, &mut rng);
            assert_eq!(parameters.len(), 101 * 50);
            let largest = |values: &[f32]| values.iter().fold(0.0f32, |most, value| most.max(value.abs()));
            [largest(&parameters[..5000]), largest(&parameters[5000..])]
        };
        let near = |found: f32, bound: f32| assert!(found <= bound && found > 0.9 * bound, "{found} of {bound}");
        let [weight, bias] = largest(InitScheme::FanIn.into(), true);
        near(weight, 0.1);
        near(bias, 0.1);
        let [weight, bias] = largest(Init { scheme: InitScheme::FanIn, last_bound: Some(3e-3) }, true);
        near(weight, 3e-3);
        near(bias, 3e-3);
        let [weight, bias] = largest(Init { scheme: InitScheme::FanIn, last_bound: Some(3e-3) }, false);
        near(weight, 0.1);
        near(bias, 0.1);
    }
}
