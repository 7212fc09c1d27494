//! Launches, losses, training and resuming.

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
        training.run(&never, |_, progress| {
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
    assert_eq!(training.run(&Stop::default(), |_, _| true), TrainingOutcome::Done);
    assert!(training.validation_loss() < 0.7 * before, "{} of {before}", training.validation_loss());
}

#[test]
fn a_resumed_training_is_bit_identical() {
    let mut whole = training(small(), quick());
    assert_eq!(whole.run(&Stop::default(), |_, _| true), TrainingOutcome::Done);
    let mut first = training(small(), quick());
    assert_eq!(first.run(&Stop::default(), |_, progress| progress.epoch < 2), TrainingOutcome::Stopped);
    let bytes = first.checkpoint().to_bytes();
    let mut second =
        Training::resume(&TensorFile::from_bytes(&bytes).unwrap(), "checkpoint", &Stop::default()).unwrap();
    assert_eq!(second.epoch(), 2);
    assert_eq!(second.run(&Stop::default(), |_, _| true), TrainingOutcome::Done);
    assert_eq!(whole.checkpoint().to_bytes(), second.checkpoint().to_bytes());
}

#[test]
fn a_stop_in_an_epoch_or_among_the_launches_leaves_no_trace() {
    let stop = Stop::default();
    let mut whole = training(small(), quick());
    let mut stopped = whole_until(2);
    let before = stopped.checkpoint().to_bytes();
    stop.request();
    assert_eq!(stopped.run(&stop, |_, _| true), TrainingOutcome::Stopped);
    assert_eq!(stopped.checkpoint().to_bytes(), before);
    let [a, b] = [&mut whole, &mut stopped].map(|training| {
        assert_eq!(training.run(&Stop::default(), |_, _| true), TrainingOutcome::Done);
        training.checkpoint().to_bytes()
    });
    assert!(a == b);
    let refused = Training::new(small(), quick(), &TOOLS, "test", &stop);
    assert!(matches!(refused, Err(DynamicsError::Stopped)));
}

/// A training that was ended after some epochs.
fn whole_until(epochs: u32) -> Training {
    let mut training = training(small(), quick());
    assert_eq!(training.run(&Stop::default(), |_, now| now.epoch < epochs), TrainingOutcome::Stopped);
    training
}

#[test]
fn a_diverged_training_keeps_the_last_good_state() {
    let train = TrainConfig { optimiser: OptimiserKind::Sgd, learning_rate: 1e20, ..quick() };
    let mut training = training(small(), train);
    let ended = training.run(&Stop::default(), |_, _| true);
    assert!(matches!(ended, TrainingOutcome::Diverged { epoch: 1, .. }), "{ended:?}");
    assert!(training.validation_loss().is_finite());
    assert_eq!(training.epoch(), 0);
}

#[test]
fn settings_out_of_range_are_refused() {
    let refused = |config: ModelConfig, train: TrainConfig, tools: &[ToolKind]| {
        Training::new(config, train, tools, "test", &Stop::default()).unwrap_err().to_string()
    };
    assert!(refused(ModelConfig { interval: 7, ..small() }, quick(), &TOOLS).contains("interval"));
    assert!(refused(ModelConfig { cutoff: f32::NAN, ..small() }, quick(), &TOOLS).contains("cutoff"));
    assert!(refused(small(), TrainConfig { batch: 0, ..quick() }, &TOOLS).contains("batch"));
    assert!(refused(small(), quick(), &[ToolKind::Box, ToolKind::Box]).contains("box-box"));
    assert!(refused(small(), quick(), &[]).contains("tool set"));
}
