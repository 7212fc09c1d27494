//! Evaluations, including those of model variants, and the shipped models.

use super::*;

/// Maps the value of each predictor.
fn of_each<T, U>(compared: &Compared<T>, value: impl Fn(&T) -> U) -> Compared<U> {
    Compared {
        model: value(&compared.model),
        constant_velocity: value(&compared.constant_velocity),
        rapier: compared.rapier.as_ref().map(value),
    }
}

#[test]
fn evaluations_of_ablated_models_report_every_part() {
    let settings = EvaluationConfig { launches: 20, episodes: 1, horizon: 2, hit_rollouts: 10, seed: 3 };
    let train = TrainConfig { epochs: 1, observations: 8, seed: 1, ..quick() };
    let (tools, never) = ([ToolKind::Square, ToolKind::Floor], Stop::default());
    let (mut epochs, folder) = (0, tempfile::tempdir().unwrap());
    let configs = [
        small(),
        ModelConfig { edge_functions: EdgeFunctions::Shared, ..small() },
        ModelConfig { edges: EdgeActivation::FullyConnected, ..small() },
        ModelConfig { coordinates: Coordinates::Absolute, ..small() },
    ];
    let mut number = 0;
    let results = configs.map(|config| {
        number += 1;
        let path = folder.path().join(number.to_string());
        let on_progress = |progress: &Progress| epochs += progress.epoch;
        let recipe = Recipe { tools: tools.to_vec(), config, training: train.clone() };
        let trained = train_to_file(&path, &recipe, "test", &never, on_progress).unwrap();
        // Its file contains its configuration.
        assert_eq!(Model::load(&path).unwrap().config(), &recipe.config);
        evaluate(&trained.model, &task::shipped(), &settings, &Stop::default(), &mut |_, _, _| ()).unwrap()
    });
    assert_eq!(epochs, 4);
    for result in &results {
        assert_eq!(result.data_hash, results[0].data_hash, "the same launches");
        let scenes: Vec<&str> = result.scenes.iter().map(|scene| scene.task.as_str()).collect();
        assert_eq!(scenes, ["task3", "task4"]);
        assert!(result.scenes.iter().all(|scene| scene.hits.model.rollouts == 10));
        for launch in &result.launches {
            assert_eq!(launch.errors.model.rollout.len(), 8);
            assert!(launch.errors.model.one_step.mean > 0.0);
            assert!(launch.errors.constant_velocity.one_step_contact.count > 0);
            let (rapier, free) = (launch.errors.rapier.as_ref().unwrap(), &launch.errors.constant_velocity);
            assert!(rapier.action_contact.mean < free.action_contact.mean / 2.0, "{rapier:?}\n{free:?}");
        }
    }
    let text = serde_json::to_string(&results).unwrap();
    assert_eq!(serde_json::from_str::<Vec<Evaluation>>(&text).unwrap(), results);
}

#[test]
fn shipped_models_record_their_training_and_support_the_shipped_tasks() {
    for (name, model) in shipped_models() {
        let config = ModelConfig { layers: 5, ..ModelConfig::default() };
        assert_eq!((model.name().as_str(), model.config()), (*name, &config));
        let provenance = &model.provenance;
        let training = TrainConfig {
            observations: 10_000,
            epochs: 400,
            learning_rate: 1e-3,
            bystanders: 0.5,
            ..TrainConfig::default()
        };
        assert_eq!((&provenance.training, provenance.epoch), (&training, 400));
        let tools = model.tools().iter().map(|tool| tool.name()).collect::<Vec<_>>().join(",");
        let settings = "--seed 0 --epochs 400 --layers 5 --learning-rate 0.001 --observations 10000 --bystanders 0.5";
        let command = format!("mge dynamics train --tools {tools} {settings} --out {name}.safetensors");
        assert_eq!(provenance.command, command);
        assert_eq!(provenance.data_hash.len(), 64, "{name}");
        let bytes = file_of(name.as_ref(), None).unwrap();
        assert!(TensorFile::from_bytes(&bytes).unwrap().to_bytes() == *bytes, "{name} has a checksum");
    }
    for task in task::shipped() {
        let model = shipped_for(&task.tool_set()).expect("a model for every shipped task");
        model.check_task(&task).unwrap();
    }
    assert!(shipped("other").is_none() && shipped_for(&ToolKind::PAPER).is_none());
}

#[test]
fn shipped_models_predict_better_than_free_flight() {
    let settings = EvaluationConfig { launches: 60, episodes: 40, horizon: 1, hit_rollouts: 1, seed: 8 };
    for (name, model) in shipped_models() {
        let evaluation = evaluate(model, &task::shipped(), &settings, &Stop::default(), &mut |_, _, _| ()).unwrap();
        for launch in &evaluation.launches {
            let errors = of_each(&launch.errors, |tool| tool.one_step_contact.mean);
            assert!(errors.model < 0.7 * errors.constant_velocity, "{name}: {errors:?}");
        }
        for scene in &evaluation.scenes {
            let errors = of_each(&scene.rollout, |errors| errors[0].mean);
            assert!(errors.model < errors.constant_velocity, "{}: {errors:?}", scene.task);
        }
    }
}
