//! Models: gradients, invariances, rejected scenes and tasks, files.

use super::*;

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
fn predictions_do_not_depend_on_edge_order_or_scene_position() {
    let training = training(small(), quick());
    let model = &training.model;
    let expected = predict(model, ball(), &tools());
    let mut turned = tools();
    turned.rotate_left(1);
    assert_close(&predict(model, ball(), &turned), &expected, 1e-4);
    assert!(predict(model, ball(), &tools()[1..]) != expected, "the tools have an effect");

    let shift = [-13.0, 7.0];
    let moved = |position: [f32; 2]| [position[0] + shift[0], position[1] + shift[1]];
    let tools: Vec<Tool> = tools().iter().map(|tool| tool.at(moved(tool.centre()).map(f64::from))).collect();
    let mut there = predict(model, BallState { position: moved(ball().position), ..ball() }, &tools);
    there.position = [there.position[0] - shift[0], there.position[1] - shift[1]];
    assert_close(&there, &expected, 1e-3);
}

#[test]
fn objects_beyond_the_cutoff_have_no_effect() {
    let training = training(small(), quick());
    let model = &training.model;
    let near = predict(model, ball(), &tools());
    let mut with_far = tools();
    with_far.push(Tool::new(ToolKind::Box, [70.0, 48.0]));
    assert_eq!(predict(model, ball(), &with_far), near);
    let connected = ModelConfig { edges: EdgeActivation::FullyConnected, ..small() };
    let training = self::training(connected, quick());
    assert!(predict(&training.model, ball(), &with_far) != predict(&training.model, ball(), &tools()));
}

#[test]
fn the_prediction_for_a_scene_does_not_depend_on_the_batch() {
    let training = training(small(), quick());
    let model = &training.model;
    let tools = tools();
    let far = BallState::at_rest([10.0, 80.0]);
    let batch = model.advance(&[far, ball(), ball()], &[&tools, &tools, &tools[..1]]).unwrap();
    assert_eq!(
        batch,
        [predict(model, far, &tools), predict(model, ball(), &tools), predict(model, ball(), &tools[..1])]
    );
}

#[test]
fn predictions_follow_the_order_of_the_scenes() {
    let training = training(small(), quick());
    let model = &training.model;
    let balls = [ball(), BallState { velocity: [3.0, 1.0], ..ball() }, BallState::at_rest([36.0, 52.0])];
    let tools = tools();
    let scenes = [&tools[..], &tools[..2], &tools[1..]];
    let predicted = model.advance(&balls, &scenes).unwrap();
    assert!(predicted[0] != predicted[1] && predicted[1] != predicted[2]);
    let turned = model.advance(&[balls[2], balls[0], balls[1]], &[scenes[2], scenes[0], scenes[1]]).unwrap();
    assert_eq!(turned, [predicted[2], predicted[0], predicted[1]]);
}

#[test]
fn an_unseen_edge_type_is_refused() {
    let training = training(small(), quick());
    let far_wall = [Tool::new(ToolKind::Wall, [80.0, 5.0])];
    let error = training.model.advance(&[ball()], &[&far_wall]).unwrap_err();
    assert!(error.to_string().contains("wall-to-ball") && error.to_string().contains("box, floor"), "{error}");
    let task = task::load("task1").unwrap();
    assert!(matches!(training.model.check_task(&task), Err(DynamicsError::UnseenEdge { .. })));
    let broken = BallState { velocity: [f32::NAN, 0.0], ..ball() };
    assert!(matches!(training.model.advance(&[broken], &[&[]]), Err(DynamicsError::NotFinite)));
}

#[test]
fn a_task_with_other_physics_is_refused() {
    let tools = vec![ToolKind::Bucket, ToolKind::Box];
    let recipe = Recipe { tools, config: small(), training: TrainConfig { observations: 2, ..quick() } };
    let training = Training::new(&recipe, "test", &Stop::default()).unwrap();
    let task = task::load("task1").unwrap();
    assert!(training.model.check_task(&task).is_ok());
    let refused = |change: &dyn Fn(&mut task::Task), expected: &str| {
        let mut other = task.clone();
        change(&mut other);
        let error = training.model.check_task(&other).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    refused(&|task| task.ball.radius = 3.0, "task `task1`: the ball differs");
    refused(&|task| task.balls.push(task.ball), "never trained on ball-to-ball edges, and another ball moves here");
    refused(&|task| task.tools[0].form.angle = Some(0.5), "angle, thickness or material of a tool");
    refused(&|task| task.placeable.form.elasticity = Some(0.1), "angle, thickness or material of a tool");
    let mut larger = task.clone();
    larger.tools[0].form.size = Some(7.0);
    assert!(training.model.check_task(&larger).is_ok());
}

#[test]
fn decoding_inverts_encoding() {
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
fn a_literal_model_recovers_the_velocity_of_free_fall() {
    let codec = Codec::new(&ModelConfig::literal());
    let (before, mut target) = (BallState { velocity: [2.0, -1.0], ..BallState::at_rest([30.0, 60.0]) }, Vec::new());
    let free = ConstantVelocity { interval: STEPS_PER_ACTION };
    let after = free.advance(&[before], &[&[]]).unwrap()[0];
    codec.encode(&before, &after, &mut target);
    let velocity = codec.decode(&before, &target).velocity;
    // Discrete and continuous fall differ by half a physics step of gravity.
    assert!((velocity[0] - after.velocity[0]).abs() < 1e-3 && (velocity[1] - after.velocity[1]).abs() < 0.07);
}

#[test]
fn model_files_round_trip_and_bad_ones_are_refused() {
    let training = training(small(), quick());
    let model = &training.model;
    let bytes = model.to_file().to_bytes();
    let read = Model::from_bytes(&bytes, "a.safetensors").unwrap();
    assert_eq!(predict(&read, ball(), &tools()), predict(model, ball(), &tools()));
    assert_eq!(read.to_file().to_bytes(), bytes);
    assert_eq!((&read.provenance, read.name().as_str()), (&model.provenance, "box-floor"));

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
    let missing = Model::load(std::path::Path::new("no/such.safetensors")).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.safetensors: "), "{missing}");
}
