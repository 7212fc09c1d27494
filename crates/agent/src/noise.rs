//! Ornstein-Uhlenbeck exploration noise (paper, equation 2 and table 2).

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::config::OuConfig;

/// A mean-reverting random process, independent for each component:
/// `x += theta * (mu - x) + scale * sigma * N(0, 1)`.
///
/// The time step is 1, as in the usual DDPG implementations. With `scale` 1 its stationary
/// standard deviation is `sigma / sqrt(1 - (1 - theta)^2)` (0.38 with the paper's values) and its
/// correlation over k steps `(1 - theta)^k`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrnsteinUhlenbeck {
    parameters: OuConfig,
    /// The factor of sigma.
    pub scale: f32,
    pub(super) state: Vec<f32>,
}

impl OrnsteinUhlenbeck {
    /// A process at its mean for actions of `action_len` components.
    pub fn new(action_len: usize, parameters: OuConfig) -> Self {
        Self { parameters, scale: 1.0, state: vec![parameters.mu; action_len] }
    }

    /// Resets the process to its mean at the start of an episode. The scale is unchanged.
    pub fn reset(&mut self) {
        self.state.fill(self.parameters.mu);
    }

    /// Makes a step and returns the new value.
    pub fn step(&mut self, rng: &mut ChaCha8Rng) -> &[f32] {
        let OuConfig { theta, mu, sigma } = self.parameters;
        for x in &mut self.state {
            *x += theta * (mu - *x) + self.scale * sigma * rng.sample::<f32, _>(StandardNormal);
        }
        &self.state
    }

    /// Makes a step and turns `action` into the exploratory action, `clip(action + x, -1, 1)`
    /// (paper, equation 2).
    pub fn perturb(&mut self, action: &mut [f32], rng: &mut ChaCha8Rng) {
        for (a, x) in action.iter_mut().zip(self.step(rng)) {
            *a = (*a + x).clamp(-1.0, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// Mean, standard deviation and lag-one correlation of a long path.
    fn moments(parameters: OuConfig, scale: f32) -> (f32, f32, f32) {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut noise = OrnsteinUhlenbeck::new(1, parameters);
        noise.scale = scale;
        let path: Vec<f64> = (0..200_000).map(|_| f64::from(noise.step(&mut rng)[0])).skip(1000).collect();
        let n = path.len() as f64;
        let mean = path.iter().sum::<f64>() / n;
        let variance = path.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let lagged = path.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / n;
        (mean as f32, variance.sqrt() as f32, (lagged / variance) as f32)
    }

    fn assert_near(found: f32, expected: f32, tolerance: f32) {
        assert!((found - expected).abs() < tolerance, "{found}, expected {expected}");
    }

    #[test]
    fn a_long_path_has_the_stated_moments() {
        for parameters in [
            OuConfig::default(),
            OuConfig { theta: 0.1, mu: 0.2, sigma: 0.4 },
            OuConfig { theta: 1.0, mu: -0.1, sigma: 0.1 },
        ] {
            let OuConfig { theta, mu, sigma } = parameters;
            let (mean, deviation, correlation) = moments(parameters, 1.0);
            let stationary = sigma / (1.0 - (1.0 - theta).powi(2)).sqrt();
            assert_near(mean, mu, 0.03);
            assert_near(deviation, stationary, 0.03 * stationary);
            assert_near(correlation, 1.0 - theta, 0.01);
        }
    }

    #[test]
    fn the_scale_multiplies_the_deviation() {
        let full = moments(OuConfig::default(), 1.0).1;
        assert_near(moments(OuConfig::default(), 0.25).1, 0.25 * full, 1e-3);
        assert_eq!(moments(OuConfig::default(), 0.0).1, 0.0);
    }

    #[test]
    fn an_episode_starts_at_the_mean() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut noise = OrnsteinUhlenbeck::new(2, OuConfig { mu: 0.1, ..OuConfig::default() });
        noise.scale = 0.5;
        noise.step(&mut rng);
        assert_ne!(noise.state, [0.1, 0.1]);
        noise.reset();
        assert_eq!((&noise.state[..], noise.scale), (&[0.1, 0.1][..], 0.5));
    }

    #[test]
    fn exploratory_actions_stay_in_bounds_and_components_differ() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut noise = OrnsteinUhlenbeck::new(2, OuConfig { sigma: 2.0, ..OuConfig::default() });
        for _ in 0..100 {
            let mut action = [0.9, -0.9];
            noise.perturb(&mut action, &mut rng);
            assert!(action.iter().all(|a| (-1.0..=1.0).contains(a)), "{action:?}");
            assert_ne!(noise.state[0], noise.state[1]);
        }
    }

    #[test]
    fn a_process_round_trips_through_json() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut noise = OrnsteinUhlenbeck::new(2, OuConfig::default());
        noise.scale = 0.3;
        for _ in 0..1000 {
            noise.step(&mut rng);
            let json = serde_json::to_string(&noise).unwrap();
            assert_eq!(serde_json::from_str::<OrnsteinUhlenbeck>(&json).unwrap(), noise);
        }
    }
}
