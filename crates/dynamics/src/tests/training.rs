//! Launches, losses and training.

use super::*;

#[test]
fn launches_are_reproducible_and_include_contacts_and_free_flight() {
    for kind in ToolKind::PAPER {
        let of = |count, split| collect(kind, Variety::Sizes, count, split, 7, &Stop::default()).unwrap();
        let launches = of(200, Split::Training);
        assert_eq!(launches, of(200, Split::Training));
        assert_ne!(data_hash(&launches, false), data_hash(&of(200, Split::Test), false));
        assert_eq!(of(3, Split::Training), launches[..3], "a longer collection starts with a shorter one");
        let hits = launches.iter().filter(|launch| launch::is_deflected(&launch.states)).count();
        assert!((80..190).contains(&hits), "{kind}: {hits} of 200 launches touch the tool");
    }
}

#[test]
fn losses_round_trip_as_text() {
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
        // All rows in one batch, and a learning rate that changes nothing.
        let train = TrainConfig { loss, learning_rate: 1e-30, epochs: 1, mirror: false, batch: 1000, ..quick() };
        let config = ModelConfig { interval: STEPS_PER_ACTION, ..small() };
        let mut training = training(config, TrainConfig { observations: 8, validation: 8, ..train });
        let never = Stop::default();
        let launches: Vec<Launch> = TOOLS
            .iter()
            .flat_map(|&kind| collect(kind, Variety::Sizes, 8, Split::Training, 5, &never).unwrap())
            .collect();
        let mut reported = f64::NAN;
        training.run(&never, |progress| reported = f64::from(progress.loss)).unwrap();
        let model = &training.model;
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
    training.run(&Stop::default(), |_| ()).unwrap();
    assert_eq!(training.diverged, None);
    assert!(training.validation_loss() < 0.7 * before, "{} of {before}", training.validation_loss());
}

#[test]
fn a_stop_ends_a_training() {
    let stop = Stop::default();
    let mut stopped = training(small(), quick());
    let mut epochs = 0;
    let ended = stopped.run(&stop, |now| {
        epochs = now.epoch;
        stop.request();
    });
    assert!(matches!(ended, Err(DynamicsError::Stopped(_))) && epochs == 1);
    let refused = Training::new(&recipe(small(), quick(), &TOOLS), "test", &stop);
    assert!(matches!(refused, Err(DynamicsError::Stopped(_))));
}

#[test]
fn a_path_for_no_file_or_a_file_of_another_kind_is_refused_before_the_training() {
    let folder = tempfile::tempdir().unwrap();
    let train = |path: &std::path::Path| {
        let never = Stop::default();
        let recipe = recipe(small(), quick(), &TOOLS);
        train_to_file(path, &recipe, "test", &never, |_| panic!("it trains")).unwrap_err()
    };
    let file = folder.path().join("file");
    std::fs::write(&file, "{}").unwrap();
    assert!(matches!(train(folder.path()), DynamicsError::Io { .. }));
    assert!(matches!(train(&file.join("model")), DynamicsError::Io { .. }));
    assert!(train(&file).to_string().contains("is not a dynamics model"));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "{}");
}

#[test]
fn a_diverged_training_keeps_the_last_good_state() {
    let train = TrainConfig { optimiser: OptimiserKind::Sgd, learning_rate: 1e20, ..quick() };
    let mut training = training(small(), train);
    training.run(&Stop::default(), |_| ()).unwrap();
    let diverged = training.diverged.clone().unwrap();
    assert!(diverged.starts_with("epoch 1: "), "{diverged}");
    assert!(training.validation_loss().is_finite());
    assert_eq!(training.epoch(), 0);
}

#[test]
fn settings_out_of_range_are_refused() {
    let refused = |config: ModelConfig, train: TrainConfig, tools: &[ToolKind]| {
        Training::new(&recipe(config, train, tools), "test", &Stop::default()).unwrap_err().to_string()
    };
    assert!(refused(ModelConfig { interval: 7, ..small() }, quick(), &TOOLS).contains("interval"));
    assert!(refused(ModelConfig { cutoff: f32::NAN, ..small() }, quick(), &TOOLS).contains("cutoff"));
    assert!(refused(small(), TrainConfig { batch: 0, ..quick() }, &TOOLS).contains("batch"));
    assert!(refused(small(), quick(), &[ToolKind::Box, ToolKind::Box]).contains("box-box"));
    assert!(refused(small(), quick(), &[]).contains("tool set"));
}
