//! `mge dynamics`: train and evaluate dynamics models.

use super::arguments::{DynamicsEvaluate, DynamicsTrain};
use super::output::{self, Outcome};
use super::progress::Progress;
use super::runs::definitions;
use super::session::{RUNS, perform};
use mge_base::stop::Stop;
use mge_dynamics::{self as dynamics, EvaluationConfig};
use mge_task as task;
use mge_workbench::{FIRST_TASK, Session, command};

pub fn train(arguments: &DynamicsTrain) -> Outcome {
    let mut session = Session::on_task(FIRST_TASK, RUNS.into())?;
    session.apply(command::Seed(arguments.seed))?;
    let to = arguments.force.target(&arguments.out);
    let (tools, settings) = (arguments.tools.clone(), settings(arguments)?);
    let train = command::ModelTrain { tools, to, epochs: arguments.epochs, settings };
    perform(&mut session, train, "epochs", arguments.quiet)?;
    Ok(output::line(arguments.out.display())?)
}

/// The settings of the options but for seed and epochs, by their names in a sweep file.
fn settings(arguments: &DynamicsTrain) -> Result<Vec<(String, String)>, String> {
    let DynamicsTrain { layers, learning_rate, observations, bystanders, seed, epochs, .. } = arguments;
    let options = [
        ("layers", "--layers", layers.map(|value| value.to_string())),
        ("learning_rate", "--learning-rate", learning_rate.map(|value| value.to_string())),
        ("observations", "--observations", observations.map(|value| value.to_string())),
        ("bystanders", "--bystanders", bystanders.map(|value| value.to_string())),
        ("seed", "--seed", Some(seed.to_string())),
        ("epochs", "--epochs", epochs.map(|value| value.to_string())),
    ];
    let mut settings = definitions(&arguments.settings, "--set", options)?;
    // These two are arguments of the command of the session.
    settings.retain(|(key, _)| key != "seed" && (key != "epochs" || epochs.is_none()));
    Ok(settings)
}

pub fn evaluate(arguments: &DynamicsEvaluate) -> Outcome {
    let model = dynamics::named(&arguments.model, None)?;
    let DynamicsEvaluate { launches, rollouts: hit_rollouts, seed, .. } = *arguments;
    let config = EvaluationConfig { launches, hit_rollouts, seed, ..EvaluationConfig::default() };
    let mut progress = Progress::new(1, arguments.quiet);
    let evaluation =
        dynamics::evaluate(&model, &task::shipped(), &config, &Stop::default(), &mut |done, total, part| {
            progress.set(done as u64, total as u64, part);
        })?;
    drop(progress);
    output::json(&evaluation)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use clap::Parser;

    use super::*;
    use crate::cli::arguments::{Arguments, Command, Dynamics};
    use mge_dynamics::Model;

    fn arguments(line: &str) -> DynamicsTrain {
        match Arguments::try_parse_from(shell_words::split(line).unwrap()).unwrap().command {
            Some(Command::Dynamics(Dynamics::Train(train))) => train,
            other => panic!("{line}: {other:?}"),
        }
    }

    fn tiny(out: &Path, more: &str) -> DynamicsTrain {
        let options = "--layers 1 --observations 2 --epochs 3 --set batch=4 --quiet --out";
        arguments(&format!("mge dynamics train --tools floor,square{more} {options} {}", out.display()))
    }

    #[test]
    fn the_command_in_a_model_reproduces_it() {
        let folder = tempfile::tempdir().unwrap();
        let first = folder.path().join("a.safetensors");
        train(&tiny(&first, " --seed 4 --set loss=huber:0.25 --set edges=fully_connected")).unwrap();
        let model = Model::load(&first).unwrap();
        let command = model.provenance.command.clone();
        let again = DynamicsTrain { out: folder.path().join("b/a.safetensors"), ..arguments(&command) };
        train(&again).unwrap();
        assert!(std::fs::read(&first).unwrap() == std::fs::read(&again.out).unwrap(), "{command}");
        let twice = tiny(&first, " --set layers=2");
        assert!(train(&twice).unwrap_err().to_string().contains("--layers and --set layers=2 set the same"));
        let wrong = train(&tiny(&first, " --set optimiser=lion")).unwrap_err().to_string();
        assert!(wrong.contains("rmsprop"), "{wrong}");
    }

    #[test]
    fn a_diverged_training_keeps_the_last_good_model_and_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let diverging = " --set optimiser=sgd --set loss=squared --learning-rate 1e30";
        let given = tiny(&folder.path().join("a.safetensors"), diverging);
        let error = train(&given).unwrap_err().to_string();
        assert!(error.contains("epoch ") && error.contains("the epoch before"), "{error}");
        assert!(Model::load(&given.out).unwrap().provenance.epoch < 3);
    }
}
