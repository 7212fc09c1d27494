//! Means over the updates of an episode.

use mge_agent::UpdateMetrics;

/// Means over the updates of an episode.
#[derive(Debug, Default)]
pub(super) struct UpdateMeans {
    updates: u32,
    sum: UpdateMetrics,
}

impl UpdateMeans {
    /// Adds an update.
    pub fn add(&mut self, metrics: &UpdateMetrics) {
        let first = self.updates == 0;
        self.updates += 1;
        self.sum.critic_loss += metrics.critic_loss;
        self.sum.mean_q += metrics.mean_q;
        self.sum.max_q = if first { metrics.max_q } else { self.sum.max_q.max(metrics.max_q) };
        self.sum.actor_loss += metrics.actor_loss;
        self.sum.action_saturation += metrics.action_saturation;
    }

    /// The mean of one metric; none without updates.
    pub fn mean(&self, of: impl Fn(&UpdateMetrics) -> f32) -> Option<f32> {
        (self.updates > 0).then(|| (f64::from(of(&self.sum)) / f64::from(self.updates)) as f32)
    }

    /// The maximum of `max_q`; none without updates.
    pub fn max_q(&self) -> Option<f32> {
        (self.updates > 0).then_some(self.sum.max_q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_maximum_are_taken_over_the_updates() {
        let mut means = UpdateMeans::default();
        assert_eq!((means.mean(|sum| sum.mean_q), means.max_q()), (None, None));
        let update = |critic_loss, max_q| UpdateMetrics {
            critic_loss,
            mean_q: -critic_loss,
            max_q,
            actor_loss: 2.0 * critic_loss,
            action_saturation: 0.5 * critic_loss,
        };
        for (loss, max_q) in [(0.5, -3.0), (1.0, -1.0), (3.0, -2.0)] {
            means.add(&update(loss, max_q));
        }
        let found = [
            means.mean(|sum| sum.critic_loss),
            means.mean(|sum| sum.mean_q),
            means.mean(|sum| sum.actor_loss),
            means.mean(|sum| sum.action_saturation),
        ];
        assert_eq!(found, [1.5, -1.5, 3.0, 0.75].map(Some));
        assert_eq!(means.max_q(), Some(-1.0));
    }
}
