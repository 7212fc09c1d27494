//! How an agent chooses among its [`Options`]: the critic selects the best of the candidates near the
//! proto item (Wolpertinger, algorithm 1).

use std::borrow::Cow;

use super::{Ddpg, Options};
use mge_nn::{Mlp, join_rows};

/// The best candidate of a row, and its value. Without candidates, it is the proto item itself.
struct Best<'a> {
    embedding: &'a [f32],
    value: f32,
}

impl Ddpg {
    /// The items that the agent chooses among; none if its actions are purely continuous.
    pub fn options(&self) -> Option<&Options> {
        self.options.as_ref()
    }

    /// Sets the number of options that the critic evaluates per action, if there are options.
    pub fn set_candidates(&mut self, candidates: usize) {
        if let Some(options) = &mut self.options {
            options.set_candidates(candidates);
        }
    }

    /// Length of the part of an action that is not an item's embedding.
    pub(super) fn free_len(&self) -> usize {
        self.action_len() - self.options.as_ref().map_or(0, Options::embedding_len)
    }

    /// The part of observations that the networks see: without the numbers of the items on offer.
    pub(super) fn seen<'a>(&self, observations: &'a [f32]) -> Cow<'a, [f32]> {
        if self.options.is_none() {
            return Cow::Borrowed(observations);
        }
        let seen = self.actor.shape().inputs();
        let rows = observations.chunks_exact(self.observation_len());
        Cow::Owned(rows.flat_map(|row| &row[..seen]).copied().collect())
    }

    /// Replaces the proto item of every action by the best of its candidates.
    pub(super) fn settle(&self, observations: &[f32], actions: &mut [f32]) {
        let Some(options) = &self.options else { return };
        let offsets = self.offsets(observations, actions);
        let best = self.best(options, &self.critic, observations, &offsets);
        for (action, best) in actions.chunks_exact_mut(self.action_len()).zip(best) {
            let free = action.len() - best.embedding.len();
            action[free..].copy_from_slice(best.embedding);
        }
    }

    /// `Q'(s', a')` for actions of the target actor, after the choice among the items on offer.
    pub(super) fn target_values(&self, observations: &[f32], offsets: &[f32]) -> Vec<f32> {
        let Some(options) = &self.options else {
            let rows = offsets.len() / self.action_len();
            return super::ddpg::predict(&self.target_critic, &join_rows(rows, observations, offsets));
        };
        let best = self.best(options, &self.target_critic, observations, offsets);
        best.into_iter().map(|best| best.value).collect()
    }

    /// The best candidate of every row according to `critic`; `offsets` are actions relative to their origins.
    fn best<'a>(&self, options: &'a Options, critic: &Mlp, observations: &[f32], offsets: &'a [f32]) -> Vec<Best<'a>> {
        let (free, seen) = (self.free_len(), self.actor.shape().inputs());
        let (mut inputs, mut found) = (Vec::new(), Vec::new());
        for (row, offset) in
            observations.chunks_exact(self.observation_len()).zip(offsets.chunks_exact(self.action_len()))
        {
            let (s, offer) = row.split_at(seen);
            let (numbers, proto) = offset.split_at(free);
            let mut near = options.near(offer, proto);
            if near.is_empty() {
                near.push(proto);
            }
            for embedding in &near {
                [s, numbers, embedding].iter().for_each(|part| inputs.extend_from_slice(part));
            }
            found.push(near);
        }
        let mut values = super::ddpg::predict(critic, &inputs).into_iter();
        let best = |near: Vec<&'a [f32]>| {
            let valued = near.into_iter().zip(&mut values).map(|(embedding, value)| Best { embedding, value });
            // For equal values, the nearer one.
            valued.reduce(|best, other| if other.value > best.value { other } else { best })
        };
        found.into_iter().filter_map(best).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{Batch, DdpgConfig, Learner, LearnerStreams, Transition};

    /// Lengths of the seen part of an observation, of the offer, and of the free part of an action.
    const SEEN: usize = 2;
    const OFFERED: usize = 4;
    const FREE: usize = 1;

    fn rng(seed: u64) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(seed)
    }

    /// 21 items on a line from -1 to 1.
    fn line(candidates: usize) -> Options {
        Options::new(1, (-10..=10).map(|place| place as f32 / 10.0).collect(), OFFERED, candidates)
    }

    fn config() -> DdpgConfig {
        DdpgConfig {
            hidden: 32,
            actor_learning_rate: 1e-3,
            critic_learning_rate: 3e-3,
            batch_size: 64,
            output_init_bound: 0.5,
            warmup_steps: 0,
            target_clamp: None,
            ..DdpgConfig::default()
        }
    }

    fn agent(candidates: usize) -> Ddpg {
        Ddpg::with_options(SEEN + OFFERED, FREE + 1, Some(line(candidates)), &config(), &mut rng(1)).unwrap()
    }

    /// Observations with random offers; the last slot of each offer is empty.
    fn observations(rows: usize, seed: u64) -> Vec<f32> {
        let mut rng = rng(seed);
        let row = |_| {
            let seen: [f32; SEEN] = [rng.gen_range(-1.0..1.0), rng.gen_range(-1.0..1.0)];
            let offer: [f32; OFFERED - 1] = std::array::from_fn(|_| rng.gen_range(0..21) as f32);
            [&seen[..], &offer, &[-1.0]].concat()
        };
        (0..rows).flat_map(row).collect()
    }

    #[test]
    fn the_candidate_that_the_critic_values_most_is_taken() {
        let agent = agent(2);
        let mut nearest_was_best = [0, 0];
        for row in observations(40, 2).chunks_exact(SEEN + OFFERED) {
            let proto = agent.propose(row);
            let near = line(2).near(&row[SEEN..], &proto[FREE..]).concat();
            let actions: Vec<f32> = near.iter().flat_map(|item| [proto[0], *item]).collect();
            let values = agent.q_values(row, &actions);
            let best = usize::from(values[1] > values[0]);
            nearest_was_best[best] += 1;
            assert_eq!(agent.act(row), [proto[0], near[best]]);
        }
        assert!(nearest_was_best.iter().all(|times| *times > 0), "{nearest_was_best:?}: the test shows nothing");
    }

    #[test]
    fn each_row_is_settled_independently() {
        let (agent, observations) = (agent(3), observations(8, 3));
        let rows = observations.chunks_exact(SEEN + OFFERED);
        assert_eq!(agent.act(&observations), rows.flat_map(|row| agent.act(row)).collect::<Vec<f32>>());
    }

    #[test]
    fn without_an_offer_the_proto_item_stays() {
        let agent = agent(3);
        let observation = [0.3, -0.3, -1.0, -1.0, 21.0, -1.0];
        assert_eq!(agent.act(&observation), agent.propose(&observation));
    }

    #[test]
    fn the_target_is_the_best_candidate_of_the_target_networks() {
        let mut agent = agent(2);
        let (s, next_s) = (observations(8, 4), observations(8, 5));
        let a: Vec<f32> = (0..8).flat_map(|row| [row as f32 / 8.0, 0.5]).collect();
        let batch = Batch {
            observations: s.clone(),
            actions: a.clone(),
            rewards: vec![0.5; 8],
            next_observations: next_s.clone(),
            terminated: vec![false; 8],
            ..Batch::default()
        };
        // Before the first update the targets are the networks themselves.
        let next_q = agent.q_values(&next_s, &agent.act(&next_s));
        let q = agent.q_values(&s, &a);
        let loss = (0..8).map(|i| (0.5 + config().gamma * next_q[i] - q[i]).powi(2)).sum::<f32>() / 8.0;
        let found = agent.update(&batch).unwrap().critic_loss;
        assert!((found - loss).abs() < 1e-4 * loss, "{found}, expected {loss}");
    }

    #[test]
    fn a_loaded_agent_chooses_and_learns_as_before() {
        let streams = LearnerStreams { noise: rng(6), replay: rng(7) };
        let options = Some(line(3));
        let mut learner = Learner::new(SEEN + OFFERED, FREE + 1, options, &config(), &mut rng(1), streams).unwrap();
        let live = |learner: &mut Learner| {
            let (s, next_s) = (observations(1, 8), observations(1, 9));
            let action = learner.explore(&s);
            let transition = Transition {
                observation: &s,
                action: &action,
                reward: 1.0,
                next_observation: &next_s,
                terminated: false,
            };
            learner.record(transition).unwrap();
            learner.learn().unwrap();
        };
        (0..5).for_each(|_| live(&mut learner));
        let mut again = Learner::load(&learner.save()).unwrap();
        assert_eq!(again.save(), learner.save());
        for learner in [&mut learner, &mut again] {
            (0..5).for_each(|_| live(learner));
        }
        assert_eq!(again.save(), learner.save());
    }

    #[test]
    fn items_never_offered_before_are_chosen_by_their_embedding() {
        // The nearer to 0.5 the better; only every other item is ever on offer.
        let mut agent = agent(3);
        let mut rng = rng(10);
        let mut batch = Batch::default();
        for _ in 0..1500 {
            batch.clear();
            for _ in 0..64 {
                let item = 2 * rng.gen_range(0..11);
                let place = item as f32 / 10.0 - 1.0;
                let observation = [0.0, 0.0, item as f32, -1.0, -1.0, -1.0];
                batch.push(Transition {
                    observation: &observation,
                    action: &[rng.gen_range(-1.0..1.0), place],
                    reward: -(place - 0.5).powi(2),
                    next_observation: &observation,
                    terminated: true,
                });
            }
            agent.update(&batch).unwrap();
        }
        // The items on offer are at -0.9, 0.1, 0.5 and 0.9.
        let action = agent.act(&[0.0, 0.0, 1.0, 11.0, 15.0, 19.0]);
        assert_eq!(action[FREE], 0.5);
        let action = agent.act(&[0.0, 0.0, 1.0, 3.0, 13.0, 5.0]);
        assert!((action[FREE] - 0.3).abs() < 1e-6, "{action:?}");
    }
}
