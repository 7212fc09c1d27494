//! The whole room: gradients, invariances, training, files, rollouts.

use dfdx::losses::mse_loss;
use dfdx::prelude::{AsArray, Backward, Cpu};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::env::{Action, Environment};
use crate::nn::{Optimiser, OptimiserKind, TensorFile, matrix};
use crate::physics::{BallState, STEPS_PER_ACTION, Tool, ToolKind, to_normalised};
use crate::task;

const TOOLS: [ToolKind; 2] = [ToolKind::Box, ToolKind::Floor];

fn small() -> ModelConfig {
    ModelConfig { layers: 3, width: 16, embedding: 6, ..ModelConfig::default() }
}

fn quick() -> TrainConfig {
    TrainConfig {
        observations: 24,
        validation: 4,
        epochs: 6,
        batch: 16,
        learning_rate: 3e-3,
        seed: 5,
        ..TrainConfig::default()
    }
}

fn training(config: ModelConfig, train: TrainConfig) -> Training {
    Training::new(config, train, &TOOLS, "test").unwrap()
}

fn ball() -> BallState {
    BallState { velocity: [1.5, -6.0], angular_velocity: 0.4, ..BallState::at_rest([40.0, 48.5]) }
}

fn tools() -> Vec<Tool> {
    vec![
        Tool::new(ToolKind::Box, [42.0, 40.0]),
        Tool::new(ToolKind::Floor, [38.0, 44.0]),
        Tool::new(ToolKind::Box, [34.0, 45.0]),
    ]
}

fn predict(model: &Model, ball: BallState, tools: &[Tool]) -> BallState {
    model.advance(&[ball], &[tools]).unwrap()[0]
}

fn assert_close(a: &BallState, b: &BallState, tolerance: f32) {
    for axis in 0..2 {
        assert!((a.position[axis] - b.position[axis]).abs() <= tolerance, "{a:?} {b:?}");
        assert!((a.velocity[axis] - b.velocity[axis]).abs() <= tolerance, "{a:?} {b:?}");
    }
    assert!((a.angular_velocity - b.angular_velocity).abs() <= tolerance, "{a:?} {b:?}");
}

#[test]
fn gradients_of_the_whole_network_agree_with_finite_differences() {
    let config = ModelConfig { layers: 3, width: 8, embedding: 5, ..ModelConfig::default() };
    let builder = GraphBuilder::new(config.clone(), TOOLS.to_vec());
    let (layout, outputs) = (builder.layout(), Codec::new(&config).outputs());
    let mut graphs = builder.empty();
    builder.push(&mut graphs, &ball(), &tools()).unwrap();
    builder.push(&mut graphs, &BallState { velocity: [-3.0, 2.0], ..ball() }, &tools()[..2]).unwrap();
    builder.push(&mut graphs, &BallState::at_rest([80.0, 80.0]), &tools()).unwrap();
    assert!(graphs.edges.iter().all(|edges| edges.receivers.len() >= 2), "both edge functions are used");
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let targets: Vec<f32> = (0..3 * outputs).map(|_| rng.gen_range(-1.0..1.0)).collect();
    let device = Cpu::default();
    let target = || matrix(&device, targets.clone(), 3, outputs);
    let mut network = Network::new(&config, layout, outputs, &mut rng).unwrap();
    let saved = |network: &Network| {
        let mut file = TensorFile::default();
        network.save(&mut file);
        file
    };
    let before = saved(&network);
    // One step of plain gradient descent with rate 1 moves every weight by its gradient.
    let mut optimiser = Optimiser::new(OptimiserKind::Sgd, &network.networks());
    let loss = mse_loss(network.forward(&graphs, &device), target());
    optimiser.update(&mut network.networks_mut(), &mut loss.backward(), 1.0).unwrap();
    let after = saved(&network);
    let loss_with = |file: &TensorFile| -> f64 {
        let network = Network::load(&config, layout, outputs, file).unwrap();
        let predicted = network.predict(&graphs);
        let squares = predicted.iter().zip(&targets).map(|(p, t)| f64::from(p - t).powi(2));
        squares.sum::<f64>() / targets.len() as f64
    };
    let parameters =
        ["edge.0", "edge.1", "node", "decoder"].into_iter().zip(network.networks()).flat_map(|(name, mlp)| {
            mlp.shape().sizes.windows(2).enumerate().flat_map(move |(layer, sizes)| {
                let weight = (format!("{name}.{layer}.weight"), sizes.to_vec());
                [weight, (format!("{name}.{layer}.bias"), vec![sizes[1]])]
            })
        });
    for (name, shape) in parameters {
        let (old, new) = (before.get(&name, &shape).unwrap(), after.get(&name, &shape).unwrap());
        for _ in 0..6 {
            let index = rng.gen_range(0..old.len());
            let gradient = f64::from(old[index] - new[index]);
            let shifted = |by: f32| {
                let mut file = before.clone();
                let mut values = old.to_vec();
                values[index] += by;
                file.insert(name.clone(), shape.clone(), values);
                loss_with(&file)
            };
            let step = 4e-3;
            let numeric = (shifted(step) - shifted(-step)) / f64::from(2.0 * step);
            assert!((gradient - numeric).abs() < 2e-4 + 2e-3 * numeric.abs(), "{name}[{index}]: {gradient} {numeric}");
        }
    }
    let value: f32 = mse_loss(network.forward(&graphs, &device), target()).array();
    assert!((f64::from(value) - loss_with(&after)).abs() < 1e-6, "tape and prediction agree");
}

#[test]
fn order_of_edges_and_place_of_the_scene_do_not_matter() {
    let training = training(small(), quick());
    let model = training.model();
    let expected = predict(model, ball(), &tools());
    let mut turned = tools();
    turned.rotate_left(1);
    assert_close(&predict(model, ball(), &turned), &expected, 1e-4);
    assert!(predict(model, ball(), &tools()[1..]) != expected, "the tools have an effect");

    let shift = [-13.0, 7.0];
    let moved = |position: [f32; 2]| [position[0] + shift[0], position[1] + shift[1]];
    let tools: Vec<Tool> = tools().iter().map(|tool| tool.at(moved(tool.position))).collect();
    let mut there = predict(model, BallState { position: moved(ball().position), ..ball() }, &tools);
    there.position = [there.position[0] - shift[0], there.position[1] - shift[1]];
    assert_close(&there, &expected, 1e-3);
}

#[test]
fn objects_beyond_the_cutoff_have_no_effect() {
    let training = training(small(), quick());
    let model = training.model();
    let near = predict(model, ball(), &tools());
    let mut with_far = tools();
    with_far.push(Tool::new(ToolKind::Box, [70.0, 48.0]));
    assert_eq!(predict(model, ball(), &with_far), near);
    let connected = Variant::FullyConnected.apply(small());
    let training = self::training(connected, quick());
    assert!(predict(training.model(), ball(), &with_far) != predict(training.model(), ball(), &tools()));
}

#[test]
fn a_scene_is_predicted_alike_alone_and_in_a_batch() {
    let training = training(small(), quick());
    let model = training.model();
    let tools = tools();
    let far = BallState::at_rest([10.0, 80.0]);
    let batch = model.advance(&[far, ball(), ball()], &[&tools, &tools, &tools[..1]]).unwrap();
    assert_eq!(
        batch,
        [predict(model, far, &tools), predict(model, ball(), &tools), predict(model, ball(), &tools[..1])]
    );
}

#[test]
fn an_edge_type_never_seen_is_refused() {
    let training = training(small(), quick());
    let far_wall = [Tool::new(ToolKind::Wall, [80.0, 5.0])];
    let error = training.model().advance(&[ball()], &[&far_wall]).unwrap_err();
    assert!(error.to_string().contains("wall-to-ball") && error.to_string().contains("box-floor"), "{error}");
    let task = task::load("task1").unwrap();
    assert!(matches!(training.model().check_task(&task), Err(DynamicsError::UnseenEdge { .. })));
    let broken = BallState { velocity: [f32::NAN, 0.0], ..ball() };
    assert!(matches!(training.model().advance(&[broken], &[&[]]), Err(DynamicsError::NotFinite)));
}

#[test]
fn a_task_with_other_physics_is_refused() {
    let tools = [ToolKind::Bucket, ToolKind::Box];
    let training = Training::new(small(), TrainConfig { observations: 2, ..quick() }, &tools, "test").unwrap();
    let task = task::load("task1").unwrap();
    assert!(training.model().check_task(&task).is_ok());
    let refused = |change: &dyn Fn(&mut task::Task), expected: &str| {
        let mut other = task.clone();
        change(&mut other);
        let error = training.model().check_task(&other).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    refused(&|task| task.ball.radius = 3.0, "task `task1`: the ball differs");
    refused(&|task| task.balls.push(task.ball), "never trained on ball-to-ball edges");
    refused(&|task| task.tools[0].form.angle = Some(0.5), "angle, thickness or material of a tool");
    refused(&|task| task.placeable.form.elasticity = Some(0.1), "angle, thickness or material of a tool");
    let mut larger = task.clone();
    larger.tools[0].form.size = Some(7.0);
    assert!(training.model().check_task(&larger).is_ok());
}

#[test]
fn decoding_undoes_encoding() {
    let after = BallState { velocity: [-3.0, 4.5], angular_velocity: -1.0, ..BallState::at_rest([41.0, 49.0]) };
    for spin in [false, true] {
        let codec = Codec::new(&ModelConfig { spin, ..ModelConfig::default() });
        let mut target = Vec::new();
        codec.encode(&ball(), &after, &mut target);
        assert_eq!(target.len(), codec.outputs());
        let wanted = BallState { angular_velocity: if spin { -1.0 } else { ball().angular_velocity }, ..after };
        assert_close(&codec.decode(&ball(), &target), &wanted, 1e-4);
    }
    for coordinates in [Coordinates::Relative, Coordinates::Absolute] {
        let codec = Codec::new(&ModelConfig { coordinates, ..ModelConfig::literal() });
        let mut target = Vec::new();
        codec.encode(&ball(), &after, &mut target);
        let decoded = codec.decode(&ball(), &target);
        assert_close(
            &BallState { velocity: after.velocity, ..decoded },
            &BallState { angular_velocity: 0.4, ..after },
            1e-4,
        );
    }
}

#[test]
fn a_literal_model_knows_the_speed_of_free_fall() {
    let codec = Codec::new(&ModelConfig::literal());
    let (before, mut target) = (BallState { velocity: [2.0, -1.0], ..BallState::at_rest([30.0, 60.0]) }, Vec::new());
    let free = ConstantVelocity { interval: STEPS_PER_ACTION };
    let after = free.advance(&[before], &[&[]]).unwrap()[0];
    codec.encode(&before, &after, &mut target);
    let velocity = codec.decode(&before, &target).velocity;
    // Half a physics step of gravity is the difference of the discrete to the smooth fall.
    assert!((velocity[0] - after.velocity[0]).abs() < 1e-3 && (velocity[1] - after.velocity[1]).abs() < 0.07);
}

#[test]
fn losses_are_written_as_they_are_read() {
    for (text, errors) in [("squared", [0.0025, 4.0]), ("huber:0.1", [0.00125, 0.195])] {
        let loss: Loss = text.parse().unwrap();
        assert_eq!(loss.to_string(), text);
        assert_eq!(serde_json::from_str::<Loss>(&format!("\"{text}\"")).unwrap(), loss);
        for (error, expected) in [(-0.05, errors[0]), (2.0, errors[1])] {
            assert!((loss.of(error) - expected).abs() < 1e-6, "{text} of {error}: {}", loss.of(error));
        }
    }
    for text in ["huber", "huber:0", "huber:NaN", "absolute", "squared:1"] {
        assert!(text.parse::<Loss>().unwrap_err().to_string().contains("huber:WIDTH"), "{text}");
    }
}

#[test]
fn training_reports_the_loss_it_minimises() {
    for loss in [Loss::Squared, Loss::Huber(0.3)] {
        // Every row of the data in one batch, and a rate that moves nothing.
        let train = TrainConfig { loss, learning_rate: 1e-30, epochs: 1, mirror: false, batch: 1000, ..quick() };
        let config = ModelConfig { interval: STEPS_PER_ACTION, ..small() };
        let mut training = training(config, TrainConfig { observations: 8, validation: 8, ..train });
        let launches: Vec<Launch> = TOOLS.iter().flat_map(|&kind| collect(kind, 8, Split::Training, 5)).collect();
        let mut reported = f64::NAN;
        training.run(|_, progress| {
            reported = f64::from(progress.loss);
            true
        });
        let model = training.model();
        let (mut sum, mut count) = (0.0, 0.0);
        for launch in &launches {
            let (before, after) = (launch.states[0], launch.states[STEPS_PER_ACTION as usize]);
            let predicted = predict(model, before, &[launch.tool]);
            let encode = |after: &BallState| {
                let mut target = Vec::new();
                model.codec.encode(&before, after, &mut target);
                model.normaliser.targets.normalise(&mut target);
                target
            };
            for (output, target) in encode(&predicted).iter().zip(encode(&after)) {
                sum += loss.of(f64::from(output - target));
                count += 1.0;
            }
        }
        assert!((reported / (sum / count) - 1.0).abs() < 1e-3, "{loss}: {reported} {}", sum / count);
    }
}

#[test]
fn training_lowers_the_error() {
    let mut training = training(small(), TrainConfig { observations: 200, validation: 20, epochs: 60, ..quick() });
    let before = training.validation_loss();
    let mut reported = Vec::new();
    let ended = training.run(|_, progress| {
        reported.extend(progress.validation);
        true
    });
    assert_eq!(ended, Ended::Done);
    assert_eq!(reported.last(), Some(&training.validation_loss()));
    assert!(training.validation_loss() < 0.7 * before, "{} of {before}", training.validation_loss());
}

#[test]
fn a_resumed_training_gives_the_same_bits() {
    let mut whole = training(small(), quick());
    assert_eq!(whole.run(|_, _| true), Ended::Done);
    let mut first = training(small(), quick());
    assert_eq!(first.run(|_, progress| progress.epoch < 2), Ended::Stopped);
    let bytes = first.checkpoint().to_bytes();
    let mut second = Training::resume(&TensorFile::from_bytes(&bytes).unwrap(), "checkpoint").unwrap();
    assert_eq!(second.epoch(), 2);
    assert_eq!(second.run(|_, _| true), Ended::Done);
    assert_eq!(whole.checkpoint().to_bytes(), second.checkpoint().to_bytes());
}

#[test]
fn a_diverged_training_keeps_the_last_good_state() {
    let train = TrainConfig { optimiser: OptimiserKind::Sgd, learning_rate: 1e20, ..quick() };
    let mut training = training(small(), train);
    let ended = training.run(|_, _| true);
    assert!(matches!(ended, Ended::Diverged { epoch: 1, .. }), "{ended:?}");
    assert!(training.validation_loss().is_finite());
    assert_eq!(training.epoch(), 0);
}

#[test]
fn model_files_are_read_back_and_bad_ones_refused() {
    let training = training(small(), quick());
    let model = training.model();
    let bytes = model.to_file().to_bytes();
    let read = Model::from_bytes(&bytes, "a.safetensors").unwrap();
    assert_eq!(predict(&read, ball(), &tools()), predict(model, ball(), &tools()));
    assert_eq!(read.to_file().to_bytes(), bytes);
    assert_eq!((read.provenance(), read.name().as_str()), (model.provenance(), "box-floor"));

    let refused = |bytes: &[u8]| Model::from_bytes(bytes, "a.safetensors").unwrap_err().to_string();
    for error in [refused(&bytes[..bytes.len() - 9]), refused(&bytes[..20]), refused(b"no model"), refused(b"")] {
        assert!(error.starts_with("a.safetensors: "), "{error}");
    }
    let changed = |key: &str, value: &str| {
        let mut file = model.to_file();
        file.metadata.insert(key.to_owned(), value.to_owned());
        refused(&file.to_bytes())
    };
    assert!(changed("version", "99").contains("version 99"), "{}", changed("version", "99"));
    assert!(changed("format", "other").contains("not those of a dynamics model"));
    assert!(changed("tools", "[\"floor\",\"box\"]").contains("canonical order"));
    assert!(changed("tools", "[\"bucket\",\"box\",\"floor\"]").contains("edge.2"), "a third edge function is missing");
    assert!(changed("config", "{\"layers\": 4}").contains("another network"));
    let error = Training::resume(&model.to_file(), "a.safetensors").unwrap_err().to_string();
    assert!(error.contains("optimiser"), "a model without moments is no checkpoint: {error}");
    let missing = Model::load(std::path::Path::new("no/such.safetensors")).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.safetensors: "), "{missing}");
}

#[test]
fn settings_out_of_range_are_refused() {
    let refused = |config: ModelConfig, train: TrainConfig, tools: &[ToolKind]| {
        Training::new(config, train, tools, "test").unwrap_err().to_string()
    };
    assert!(refused(ModelConfig { interval: 7, ..small() }, quick(), &TOOLS).contains("interval"));
    assert!(refused(ModelConfig { cutoff: f32::NAN, ..small() }, quick(), &TOOLS).contains("cutoff"));
    assert!(refused(small(), TrainConfig { batch: 0, ..quick() }, &TOOLS).contains("batch"));
    assert!(refused(small(), quick(), &[ToolKind::Box, ToolKind::Box]).contains("box-box"));
    assert!(refused(small(), quick(), &[]).contains("tool set"));
}

#[test]
fn launches_repeat_and_show_contacts_and_free_flight() {
    for kind in ToolKind::ALL {
        let launches = collect(kind, 200, Split::Training, 7);
        assert_eq!(launches, collect(kind, 200, Split::Training, 7));
        assert_ne!(data_hash(&launches), data_hash(&collect(kind, 200, Split::Test, 7)));
        assert_eq!(
            collect(kind, 3, Split::Training, 7),
            launches[..3],
            "a longer collection starts with a shorter one"
        );
        let hits = launches.iter().filter(|launch| launch::is_deflected(&launch.states)).count();
        assert!((80..190).contains(&hits), "{kind}: {hits} of 200 launches touch the tool");
    }
}

#[test]
fn rollouts_follow_free_flight_and_stop_at_the_stage() {
    let task = std::sync::Arc::new(task::load("task1").unwrap());
    let env = Environment::new(task.clone());
    let free = ConstantVelocity { interval: 5 };
    // Far from the ball on its first two actions.
    let actions: Vec<Action> = vec![[-0.9, -0.9], [-0.9, -0.8]];
    let found = rollouts(&free, &task, &[env.snapshot()], std::slice::from_ref(&actions)).unwrap().remove(0);
    assert_eq!((found.placed.as_slice(), found.touched.as_slice()), ([true, false].as_slice(), [false; 2].as_slice()));
    let mut real = env.clone();
    for (index, action) in actions.iter().enumerate() {
        real.step(*action).unwrap();
        let [x, y] = to_normalised(real.snapshot().ball().position);
        let [px, py] = found.path[8 * (index + 1)];
        assert!((x - px).abs() < 1e-3 && (y - py).abs() < 1e-3);
    }
    assert!(!found.hit && found.path.len() == 17);

    let mut below = (*task).clone();
    below.subgoals[0].position = [below.ball.position[0], 0.2];
    let below = std::sync::Arc::new(below);
    let start = Environment::new(below.clone());
    let found = rollouts(&free, &below, &[start.snapshot()], &[vec![[-0.9, -0.9]; 8]]).unwrap().remove(0);
    assert!(found.hit && found.placed.len() < 8, "{found:?}");
    assert_eq!(found.placed.len(), found.path.len().saturating_sub(2) / 8 + 1, "it ends with the action that hits");
}

#[test]
fn evaluation_and_ablation_report_every_part() {
    let settings = EvaluationConfig { launches: 20, episodes: 1, horizon: 2, hit_rollouts: 10, seed: 3 };
    let train = TrainConfig { epochs: 1, observations: 8, ..quick() };
    let tools = [ToolKind::Square, ToolKind::Floor];
    let ablation = Ablation {
        model: &small(),
        training: &train,
        tools: &tools,
        tasks: &task::shipped(),
        evaluation: &settings,
        command: "test",
    };
    let (mut epochs, folder) = (0, tempfile::tempdir().unwrap());
    let results = Variant::ALL.map(|variant| {
        let path = folder.path().join(variant.name());
        let on_progress = |progress: &Progress| {
            epochs += progress.epoch;
            true
        };
        let (_, result) = ablation.run(variant, 1, &path, on_progress).unwrap().unwrap();
        // A variant is a model like any other: its file says what it is.
        let read = Model::load(&path).unwrap();
        assert_eq!(read.config(), &variant.apply(small()));
        assert_eq!(variant.to_string().parse(), Ok(variant));
        result
    });
    assert_eq!(epochs, 4);
    for result in &results {
        assert_eq!(result.evaluation.data_hash, results[0].evaluation.data_hash, "the same launches");
        let scenes: Vec<&str> = result.evaluation.scenes.iter().map(|scene| scene.task.as_str()).collect();
        assert_eq!(scenes, ["task3", "task4"]);
        assert!(result.evaluation.scenes.iter().all(|scene| scene.hits.model.rollouts == 10));
        for launch in &result.evaluation.launches {
            assert_eq!(launch.errors.model.rollout.len(), 8);
            assert!(launch.errors.model.one_step.mean > 0.0);
            assert!(launch.errors.nearest_sample.one_step_contact.count > 0);
            let hits = launch.errors.map_ref(|tool| tool.hits);
            assert_eq!(hits.model.rollouts, launch.errors.model.action_contact.count);
            let real = |hits: Hits| hits.true_positives + hits.false_negatives;
            assert!(real(hits.model) > 0 && real(hits.model) == real(hits.constant_velocity), "{hits:?}");
        }
    }
    let text = serde_json::to_string(&results).unwrap();
    assert_eq!(serde_json::from_str::<Vec<Ablated>>(&text).unwrap(), results);
    assert!("none".parse::<Variant>().unwrap_err().contains("shared-edges"));
}

#[test]
fn shipped_models_are_those_of_the_paper_and_know_the_shipped_tasks() {
    for name in shipped_names() {
        let model = shipped(name).unwrap().unwrap();
        assert_eq!((model.name().as_str(), model.config()), (name, &ModelConfig::default()));
        let provenance = model.provenance();
        assert_eq!((&provenance.training, provenance.epoch), (&TrainConfig::default(), 5000));
        let tools = model.tools().iter().map(|tool| tool.name()).collect::<Vec<_>>().join(",");
        let command = format!("mge dynamics train --tools {tools} --seed 0 --out {name}.safetensors");
        assert_eq!(provenance.command, command);
        let launches = model.tools().iter().flat_map(|&kind| collect(kind, 1000, Split::Training, 0));
        assert_eq!(
            provenance.data_hash,
            data_hash(&launches.collect::<Vec<_>>()),
            "{name} learned from other launches"
        );
    }
    for task in task::shipped() {
        let model = shipped_for(&task.tool_set()).unwrap().expect("a model for every shipped task");
        model.check_task(&task).unwrap();
    }
    assert!(shipped("other").unwrap().is_none() && shipped_for(&ToolKind::ALL).unwrap().is_none());
}

#[test]
fn shipped_models_predict_better_than_the_baselines() {
    let settings = EvaluationConfig { launches: 60, episodes: 40, horizon: 1, hit_rollouts: 1, seed: 8 };
    for name in shipped_names() {
        let evaluation = evaluate(&shipped(name).unwrap().unwrap(), &task::shipped(), &settings).unwrap();
        for launch in &evaluation.launches {
            let errors = launch.errors.map_ref(|tool| tool.one_step_contact.mean);
            assert!(errors.model < 0.7 * errors.constant_velocity, "{name}: {errors:?}");
            // A captured ball rests: the nearest sample knows that to the last digit.
            let share = if launch.tool == ToolKind::Bucket { 1.2 } else { 0.7 };
            assert!(errors.model < share * errors.nearest_sample, "{name}, {}: {errors:?}", launch.tool);
            let score = launch.errors.map_ref(|tool| {
                let Hits { true_positives, false_positives, false_negatives, .. } = tool.hits;
                2 * true_positives * 100 / (2 * true_positives + false_positives + false_negatives)
            });
            assert!(score.model > 80 && score.model > score.constant_velocity, "{name}: F1 {score:?} %");
        }
        for scene in &evaluation.scenes {
            let errors = scene.rollout.map_ref(|errors| errors[0].mean);
            assert!(errors.model < errors.constant_velocity, "{}: {errors:?}", scene.task);
        }
    }
}
