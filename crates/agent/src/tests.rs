//! The agent's guarantees: target update, reproducible runs, exact resuming, clear errors.

mod probe;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    Batch, Ddpg, DdpgConfig, ImitationConfig, Learner, LearnerStreams, ReplayBuffer, ReplayError, SavedLearner,
    StateError, Transition,
};
use mge_nn::{Mlp, OptimiserKind, TensorFile, join_rows};

const OBSERVATION: usize = 5;
const ACTION: usize = 2;

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn small() -> DdpgConfig {
    DdpgConfig { hidden: 16, batch_size: 32, replay_capacity: 100, warmup_steps: 20, ..DdpgConfig::default() }
}

fn learner(config: &DdpgConfig, seed: u64) -> Learner {
    let streams = LearnerStreams { noise: rng(seed + 1), replay: rng(seed + 2) };
    Learner::new(OBSERVATION, ACTION, config, &mut rng(seed), streams).unwrap()
}

/// Runs the learner through the steps `steps` of a synthetic, deterministic environment.
fn live(learner: &mut Learner, steps: std::ops::Range<usize>) {
    for step in steps {
        if step % 10 == 0 {
            learner.start_episode();
        }
        let observation: [f32; OBSERVATION] = std::array::from_fn(|i| ((step * OBSERVATION + i) as f32).sin());
        let action = learner.explore(&observation);
        let next_observation = observation.map(|x| x + action[0]);
        let transition = Transition {
            observation: &observation,
            action: &action,
            reward: action[1] - observation[0],
            next_observation: &next_observation,
            terminated: step % 10 == 9,
        };
        learner.record(transition).unwrap();
        if step % 10 == 6 {
            learner.reach(step / 10 % 2);
        }
        learner.update(learner.ddpg.config().updates_per_step).unwrap();
    }
}

fn any_batch(seed: u64) -> Batch {
    let mut rng = rng(seed);
    let mut numbers = |n: usize| (0..n).map(|_| rng.gen_range(-1.0..1.0)).collect::<Vec<f32>>();
    Batch {
        observations: numbers(8 * OBSERVATION),
        actions: numbers(8 * ACTION),
        rewards: numbers(8),
        next_observations: numbers(8 * OBSERVATION),
        terminated: vec![false; 8],
        ..Batch::default()
    }
}

/// All tensors of the agent by name.
fn tensors(ddpg: &Ddpg) -> Vec<(String, Vec<f32>)> {
    let bytes = ddpg.save();
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let mut tensors: Vec<_> = file.tensors();
    tensors.sort_by(|a, b| a.0.cmp(&b.0));
    let values = |data: &[u8]| data.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    tensors.into_iter().map(|(name, view)| (name, values(view.data()))).collect()
}

#[test]
fn targets_start_equal_and_move_by_tau() {
    let tau = 0.25;
    let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &DdpgConfig { tau, ..small() }, &mut rng(1)).unwrap();
    let before = tensors(&ddpg);
    ddpg.update(&any_batch(2)).unwrap();
    let after = tensors(&ddpg);
    let find = |all: &[(String, Vec<f32>)], name: &str| all.iter().find(|(found, _)| found == name).unwrap().1.clone();
    for network in ["actor", "critic"] {
        for tensor in (0..3).flat_map(|i| [format!("{i}.weight"), format!("{i}.bias")]) {
            let online = format!("{network}.{tensor}");
            let target = format!("target_{online}");
            assert_eq!(find(&before, &online), find(&before, &target));
            assert_ne!(find(&before, &online), find(&after, &online), "{online} did not learn");
            let old = find(&before, &target);
            let new = find(&after, &online);
            for ((old, new), found) in old.iter().zip(&new).zip(find(&after, &target)) {
                let expected = tau * new + (1.0 - tau) * old;
                assert!((found - expected).abs() < 1e-6, "{target}: {found}, not {expected}");
            }
        }
    }
}

#[test]
fn metrics_describe_the_batch() {
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
    // With an origin and great outputs, some of the actor's actions are clipped when they are taken.
    let clipped = DdpgConfig { action_origin: Some(1), output_init_bound: 1.0, ..small() };
    for (config, is_clipped) in [(small(), false), (clipped, true)] {
        let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng(1)).unwrap();
        let batch = any_batch(2);
        let q = ddpg.q_values(&batch.observations, &batch.actions);
        // Before the first update the targets are the networks themselves.
        let [next, now] = [&batch.next_observations, &batch.observations].map(|s| ddpg.act(s));
        assert!([&next, &now].iter().all(|taken| taken.iter().any(|a| a.abs() == 1.0) == is_clipped));
        let next_q = ddpg.q_values(&batch.next_observations, &next);
        let error = |i: usize| (batch.rewards[i] + config.gamma * next_q[i]).clamp(-1.0, 16.0) - q[i];
        let loss = mean(&(0..8).map(|i| error(i).powi(2)).collect::<Vec<_>>());
        let metrics = ddpg.update(&batch).unwrap();
        let is_near = |found: f32, expected: f32| (found - expected).abs() < 1e-5 * expected.abs().max(1.0);
        assert!(is_near(metrics.critic_loss, loss), "{metrics:?}, expected {loss}");
        assert!(is_near(metrics.mean_q, mean(&q)), "{metrics:?}");
        assert!(is_near(metrics.max_q, q.iter().copied().fold(f32::MIN, f32::max)));
        // The actor's loss is computed after the critic's step.
        let value = mean(&ddpg.q_values(&batch.observations, &now));
        assert!(is_near(metrics.actor_loss, -value), "{metrics:?}, expected {}", -value);
        assert_eq!(ddpg.updates(), 1);
    }
}

#[test]
fn the_target_is_computed_with_the_target_networks() {
    // Target networks lag behind, so the online networks would give another loss.
    let rates = DdpgConfig { actor_learning_rate: 0.02, critic_learning_rate: 0.02, ..small() };
    let config = DdpgConfig { tau: 0.001, output_init_bound: 0.5, ..rates };
    let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng(1)).unwrap();
    (0..50).for_each(|seed| _ = ddpg.update(&any_batch(seed)).unwrap());
    let batch = any_batch(99);
    let q = ddpg.q_values(&batch.observations, &batch.actions);
    let of = |network: &Mlp, inputs: &[f32]| {
        let mut outputs = Vec::new();
        network.predict_into(inputs, 8, &mut outputs);
        outputs
    };
    let loss = |actor: &Mlp, critic: &Mlp| {
        let next_a = of(actor, &batch.next_observations);
        let next_q = of(critic, &join_rows(8, &batch.next_observations, &next_a));
        let error = |i: usize| (batch.rewards[i] + config.gamma * next_q[i]).clamp(-1.0, 16.0) - q[i];
        (0..8).map(|i| error(i).powi(2)).sum::<f32>() / 8.0
    };
    let expected = loss(&ddpg.target_actor, &ddpg.target_critic);
    for wrong in [loss(&ddpg.actor, &ddpg.target_critic), loss(&ddpg.target_actor, &ddpg.critic)] {
        assert!((wrong - expected).abs() > 1e-3 * expected, "{wrong} and {expected}: the test shows nothing");
    }
    let found = ddpg.update(&batch).unwrap().critic_loss;
    assert!((found - expected).abs() < 1e-4 * expected, "{found}, expected {expected}");
}

#[test]
fn one_observation_can_be_used_for_many_actions() {
    let ddpg = Ddpg::new(OBSERVATION, ACTION, &small(), &mut rng(1)).unwrap();
    let (observation, actions) = ([0.5; OBSERVATION], [0.1, 0.2, 0.3, 0.4]);
    assert_eq!(ddpg.q_values(&observation, &actions), ddpg.q_values(&[0.5; 2 * OBSERVATION], &actions));
}

#[test]
fn the_networks_see_actions_relative_to_their_origin() {
    let moved = DdpgConfig { action_origin: Some(1), ..small() };
    let mut relative = Ddpg::new(OBSERVATION, ACTION, &moved, &mut rng(1)).unwrap();
    let mut plain = Ddpg::new(OBSERVATION, ACTION, &small(), &mut rng(1)).unwrap();
    let batch = any_batch(2);
    let shift = |sign: f32, actions: &[f32]| -> Vec<f32> {
        let origin = |i: usize| batch.observations[i / ACTION * OBSERVATION + 1 + i % ACTION];
        actions.iter().enumerate().map(|(i, a)| a + sign * origin(i)).collect()
    };
    let offsets = Batch { actions: shift(-1.0, &batch.actions), ..batch.clone() };
    let s = &batch.observations;
    for _ in 0..3 {
        let action: Vec<f32> = shift(1.0, &plain.act(s)).iter().map(|a| a.clamp(-1.0, 1.0)).collect();
        assert_eq!(relative.act(s), action);
        assert_eq!(relative.q_values(s, &batch.actions), plain.q_values(s, &offsets.actions));
        assert_eq!(relative.update(&batch).unwrap(), plain.update(&offsets).unwrap());
    }
}

#[test]
fn a_held_policy_stays_while_the_networks_learn() {
    let config = DdpgConfig { tau: 0.5, output_init_bound: 0.5, ..small() };
    let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng(1)).unwrap();
    let s = any_batch(1).observations;
    ddpg.hold_policy();
    let held = ddpg.act(&s);
    (0..20).for_each(|seed| _ = ddpg.update(&any_batch(seed)).unwrap());
    let mut loaded = Ddpg::load(&ddpg.save()).unwrap();
    assert!(loaded.holds_policy());
    assert_eq!((ddpg.act(&s), loaded.act(&s)), (held.clone(), held.clone()));
    loaded.release_policy();
    let learned = loaded.act(&s);
    assert_ne!(learned, held);
    ddpg.mark_policy_proven();
    ddpg.hold_policy();
    assert_ne!(ddpg.act(&s), held);
    let mut returned = Ddpg::load(&ddpg.save()).unwrap();
    returned.return_to_proven_policy();
    assert_eq!(returned.act(&s), held);
    returned.hold_policy();
    assert_eq!(returned.act(&s), held, "the target actor has returned too");
    returned.release_policy();
    assert_eq!(returned.act(&s), held, "and the actor");
    assert!(ddpg.export_actor() != loaded.export_actor(), "the held policy is exported");
}

#[test]
fn an_origin_outside_the_observation_is_refused() {
    for (origin, fits) in [(OBSERVATION - ACTION, true), (OBSERVATION - ACTION + 1, false)] {
        let config = DdpgConfig { action_origin: Some(origin), ..small() };
        let agent = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng(1));
        assert_eq!(agent.is_ok(), fits);
        assert!(agent.is_ok_and(|agent| Ddpg::load(&agent.save()).is_ok()) || !fits);
    }
}

#[test]
fn updates_start_after_the_warm_up() {
    let config = DdpgConfig { updates_per_step: 3, ..small() };
    let mut learner = learner(&config, 1);
    assert!(learner.update(learner.ddpg.config().updates_per_step).unwrap().is_empty());
    live(&mut learner, 0..19);
    assert_eq!((learner.recorded, learner.ddpg.updates()), (19, 0));
    live(&mut learner, 19..30);
    assert_eq!((learner.recorded, learner.ddpg.updates()), (30, 33));
    assert_eq!(learner.update(learner.ddpg.config().updates_per_step).unwrap().len(), 3);
}

#[test]
fn equal_seeds_give_equal_bytes() {
    let run = |seed| {
        let mut learner = learner(&small(), seed);
        live(&mut learner, 0..150);
        learner.save()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn threads_change_nothing() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            // Full width: small products are not distributed over threads.
            let config = DdpgConfig { hidden: 64, batch_size: 256, ..small() };
            let mut learner = learner(&config, 1);
            live(&mut learner, 0..60);
            learner.save()
        })
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn a_loaded_learner_continues_bit_for_bit() {
    for optimiser in [OptimiserKind::Adam, OptimiserKind::Sgd, OptimiserKind::RmsProp] {
        let imitation = ImitationConfig { share: 0.25, weight: 1.0 };
        let config = DdpgConfig { optimiser, imitation, ..small() };
        let mut whole = learner(&config, 1);
        live(&mut whole, 0..240);
        // Stopped within an episode, after the ring has wrapped around.
        let mut first = learner(&config, 1);
        first.noise.scale = 1.0;
        live(&mut first, 0..125);
        let mut second = Learner::load(&first.save()).unwrap();
        assert_eq!(second.save(), first.save());
        live(&mut second, 125..240);
        assert!(second.save() == whole.save(), "{optimiser:?} diverged from the uninterrupted run");
    }
}

#[test]
fn an_agent_is_loaded_from_its_own_bytes_and_from_a_checkpoint() {
    let mut learner = learner(&small(), 1);
    live(&mut learner, 0..50);
    let checkpoint = learner.save();
    for bytes in [learner.ddpg.save(), checkpoint.networks] {
        let ddpg = Ddpg::load(&bytes).unwrap();
        assert_eq!(ddpg.save(), learner.ddpg.save());
        assert_eq!(ddpg.act(&[0.1; OBSERVATION]), learner.ddpg.act(&[0.1; OBSERVATION]));
    }
}

#[test]
fn the_actor_is_exported_with_a_description_of_its_layers() {
    let learner = learner(&small(), 1);
    let file = TensorFile::from_bytes(&learner.ddpg.export_actor()).unwrap();
    let mut expected = TensorFile::default();
    learner.ddpg.actor.save(&mut expected, "actor");
    for (key, value) in [("layers", "3"), ("hidden", "relu"), ("output", "tanh")] {
        expected.metadata.insert(key.to_owned(), value.to_owned());
    }
    assert_eq!(file.to_bytes(), expected.to_bytes());
}

#[test]
fn damaged_checkpoints_are_refused() {
    let mut one = learner(&small(), 1);
    live(&mut one, 0..30);
    let good = one.save();
    let cut = SavedLearner { networks: good.networks[..100].to_vec(), ..good.clone() };
    assert!(matches!(Learner::load(&cut), Err(StateError::Tensors(_))));
    let cut = SavedLearner { replay: good.replay[..100].to_vec(), ..good.clone() };
    assert!(matches!(Learner::load(&cut), Err(StateError::Replay(ReplayError::Damaged(_)))));
    let other = SavedLearner { replay: learner(&small(), 1).save().replay, ..good.clone() };
    assert_eq!(Learner::load(&other).unwrap_err(), StateError::ReplayMismatch);
    for (observation_len, action_len, capacity, count) in [
        (OBSERVATION + 1, ACTION, 100, 30),
        (OBSERVATION, ACTION + 1, 100, 30),
        (OBSERVATION, ACTION, 101, 30),
        (OBSERVATION, ACTION, 100, 29),
    ] {
        let mut replay = ReplayBuffer::new(observation_len, action_len, capacity);
        let (observation, action) = (vec![0.5; observation_len], vec![0.5; action_len]);
        for _ in 0..count {
            let next_observation = &observation;
            let transition = Transition {
                observation: &observation,
                action: &action,
                reward: 0.0,
                next_observation,
                terminated: false,
            };
            replay.push(transition).unwrap();
        }
        let other = SavedLearner { replay: replay.to_bytes(), ..good.clone() };
        assert_eq!(Learner::load(&other).unwrap_err(), StateError::ReplayMismatch, "{replay:?}");
    }
    let no_learner = SavedLearner { networks: one.ddpg.save(), ..good };
    assert!(matches!(Learner::load(&no_learner), Err(StateError::Tensors(_))));
}

#[test]
fn wrong_metadata_is_refused_with_the_reason() {
    let good = learner(&small(), 1).save();
    let changed = |change: &dyn Fn(&str) -> String| {
        let mut file = TensorFile::from_bytes(&good.networks).unwrap();
        let text = change(&file.metadata["agent"]);
        file.metadata.insert("agent".to_owned(), text);
        Ddpg::load(&file.to_bytes()).unwrap_err().to_string()
    };
    for (from, to, message) in [
        (r#""version":1"#, r#""version":2"#, "has format 2, but this program reads 1"),
        (r#""tau":0.005"#, r#""tau":7"#, "tau: is 7, but must be a number from 1e-6 to 1"),
        (r#""tau""#, r#""tao""#, "unknown field `tao`"),
        (r#""optimiser":"adam""#, r#""optimiser":"sgd""#, "the kind of actor_optimiser differs"),
        (r#""hidden":16"#, r#""hidden":17"#, "has shape"),
        (r#""observation_len":5"#, r#""observation_len":0"#, "vectors of 0 and 2 numbers"),
        (r#""action_len":2"#, r#""action_len":18446744073709551615"#, "vectors of 5 and 18446744073709551615 numbers"),
    ] {
        let found = changed(&|text| {
            assert!(text.contains(from), "{text}");
            text.replace(from, to)
        });
        assert!(found.contains(message), "{found}");
    }
}

#[test]
fn divergence_is_an_error_and_changes_nothing() {
    let config = DdpgConfig { target_clamp: None, ..small() };
    let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng(1)).unwrap();
    let before = ddpg.save();
    let mut batch = any_batch(2);
    batch.rewards[3] = 1e30;
    assert_eq!(
        ddpg.update(&batch).unwrap_err().to_string(),
        "the critic loss is inf at update 1: learning has diverged; lower the learning rates or \
         set `target_clamp`"
    );
    assert_eq!(ddpg.save(), before);
}

/// The actor's loss on a batch as a function of the actor only: the last rows are imitated where
/// `better`, and `scale` divides the values.
fn actor_loss(ddpg: &Ddpg, batch: &Batch, weight: f32, scale: f32, better: &[bool]) -> f64 {
    let mu = ddpg.act(&batch.observations);
    let q = ddpg.q_values(&batch.observations, &mu);
    let value: f64 = q.iter().map(|&q| f64::from(q)).sum::<f64>() / 8.0 / f64::from(scale);
    let first = 8 - better.len();
    let distance = |row: usize| -> f64 {
        let columns = row * ACTION..(row + 1) * ACTION;
        columns.map(|i| f64::from(mu[i] - batch.actions[i]).powi(2)).sum()
    };
    let rows = better.iter().enumerate().filter(|(_, better)| **better);
    let imitation: f64 = rows.map(|(row, _)| distance(first + row)).sum::<f64>() / better.len() as f64;
    f64::from(weight) * imitation - value
}

/// The agent with one number of one tensor changed by `by`.
fn changed(ddpg: &Ddpg, tensor: &str, shape: &[usize], index: usize, by: f32) -> Ddpg {
    let mut file = TensorFile::from_bytes(&ddpg.save()).unwrap();
    let mut values = file.get(tensor, shape).unwrap().to_vec();
    values[index] += by;
    file.insert(tensor.to_owned(), shape.to_vec(), values);
    Ddpg::load(&file.to_bytes()).unwrap()
}

#[test]
fn the_actor_descends_the_gradient_of_value_and_imitation() {
    let weight = 0.7;
    let imitation = ImitationConfig { share: 0.5, weight };
    // SGD with rate 1 for the actor and almost none for the critic: the change is minus the gradient.
    let rates = DdpgConfig { optimiser: OptimiserKind::Sgd, critic_learning_rate: 1e-12, ..small() };
    let config = DdpgConfig { imitation, output_init_bound: 0.5, actor_learning_rate: 1.0, ..rates };
    let ddpg = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng(1)).unwrap();
    let batch = Batch { imitated: 5, ..any_batch(2) };
    let mu = ddpg.act(&batch.observations);
    let q = ddpg.q_values(&batch.observations, &mu);
    let scale = q.iter().map(|q| q.abs()).sum::<f32>() / 8.0;
    let taken = ddpg.q_values(&batch.observations, &batch.actions);
    let better: Vec<bool> = (3..8).map(|row| taken[row] > q[row]).collect();
    assert!(better.contains(&true) && better.contains(&false), "the filter does nothing here: {better:?}");
    let mut updated = ddpg.clone();
    let found = updated.update(&batch).unwrap().actor_loss;
    assert!((f64::from(found) - actor_loss(&ddpg, &batch, weight, scale, &better)).abs() < 1e-4);
    let (before, after) = (tensors(&ddpg), tensors(&updated));
    let value =
        |all: &[(String, Vec<f32>)], name: &str, i: usize| all.iter().find(|(found, _)| found == name).unwrap().1[i];
    let step = 1e-2;
    for (tensor, shape, index) in
        [("actor.2.weight", &[16, 2][..], 0), ("actor.2.weight", &[16, 2], 9), ("actor.2.bias", &[2], 1)]
    {
        let loss = |by: f32| actor_loss(&changed(&ddpg, tensor, shape, index, by), &batch, weight, scale, &better);
        let slope = (loss(step) - loss(-step)) / f64::from(2.0 * step);
        let taken = f64::from(value(&before, tensor, index) - value(&after, tensor, index));
        assert!(slope.abs() > 1e-3 && (slope - taken).abs() < 0.03 * slope.abs(), "{tensor}: {slope} and {taken}");
    }
}

#[test]
fn a_share_of_the_minibatch_is_from_segments() {
    let imitation = ImitationConfig { share: 0.25, weight: 1.0 };
    let mut learner = learner(&DdpgConfig { imitation, ..small() }, 1);
    live(&mut learner, 0..3);
    learner.sample(32);
    assert_eq!((learner.batch.len(), learner.batch.imitated), (32, 0));
    // Transitions 3 and 4 reach stage 1, 5 reaches stage 0.
    learner.start_episode();
    live(&mut learner, 3..5);
    learner.reach(1);
    live(&mut learner, 5..6);
    learner.reach(0);
    learner.sample(32);
    let Batch { rewards, imitated, .. } = &learner.batch;
    assert_eq!((rewards.len(), *imitated), (32, 8));
    let of_segments: Vec<f32> = (0..3).map(|age| learner.replay.latest(age).unwrap().reward).collect();
    let found = |reward: &f32| of_segments.contains(reward);
    assert!(rewards[24..].iter().all(found) && !rewards[..24].iter().all(found));
    // Overwritten transitions are not drawn.
    live(&mut learner, 6..230);
    learner.sample(32);
    assert_eq!(learner.batch.imitated, 8);
}
