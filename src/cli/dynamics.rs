//! `mge dynamics`: train and evaluate dynamics models.

use std::path::Path;

use super::arguments::{Dynamics, DynamicsEvaluate, DynamicsTrain};
use super::interrupt::{Interrupt, brief};
use super::output::{self, Outcome};
use super::progress::Progress;
use mge_base::stop::Stop;
use mge_dynamics::{
    self as dynamics, DynamicsError, EvaluationConfig, ModelConfig, TrainConfig, TrainingOutcome, Variant,
    train_to_file,
};
use mge_experiments::study::model_error_figure;
use mge_figures::{Figure, PICTURE, Provenance};
use mge_task as task;

pub fn run(command: Dynamics) -> Outcome {
    match command {
        Dynamics::Train(arguments) => train(&arguments),
        Dynamics::Evaluate(arguments) => brief(|| run_evaluation(&arguments)),
    }
}

fn train(arguments: &DynamicsTrain) -> Outcome {
    let interrupt = Interrupt::listen()?;
    let (config, settings) = settings(arguments)?;
    let command = command_line(arguments);
    let mut progress = Progress::new(1, arguments.quiet);
    let on_progress = |now: &dynamics::Progress| {
        progress.set(u64::from(now.epoch), u64::from(now.epochs), &format!("loss {:.5}", now.loss));
    };
    let (to, stop) = (arguments.force.target(&arguments.out), interrupt.stop());
    let trained = train_to_file(to, config, settings, arguments.tools.kinds(), &command, stop, on_progress);
    let trained = match trained {
        Err(DynamicsError::Stopped) => {
            return Err(interrupt.ended("stopped: the same command continues".to_owned()).into());
        }
        trained => trained?,
    };
    drop(progress);
    if matches!(trained.ended, TrainingOutcome::Stopped) {
        let epoch = trained.training.epoch();
        return Err(interrupt.ended(format!("stopped after epoch {epoch}: the same command continues")).into());
    }
    if let Some(reason) = trained.finish() {
        return Err(reason.into());
    }
    Ok(output::line(arguments.out.display())?)
}

fn settings(arguments: &DynamicsTrain) -> Result<(ModelConfig, TrainConfig), Box<dyn std::error::Error>> {
    let (config, training) = match arguments.literal {
        true => (ModelConfig::literal(), TrainConfig::literal()),
        false => Default::default(),
    };
    let mut config = arguments.tools.apply(arguments.ablate.unwrap_or(Variant::Full).apply(config));
    let mut training = TrainConfig { seed: arguments.seed, ..training };
    config.layers = arguments.layers.unwrap_or(config.layers);
    training.epochs = arguments.epochs.unwrap_or(training.epochs);
    training.learning_rate = arguments.learning_rate.unwrap_or(training.learning_rate);
    training.batch = arguments.batch.unwrap_or(training.batch);
    training.observations = arguments.observations.unwrap_or(training.observations);
    training.bystanders = arguments.bystanders.unwrap_or(training.bystanders);
    training.loss = arguments.loss.unwrap_or(training.loss);
    if let Some(name) = &arguments.optimiser {
        training.optimiser = serde_json::from_value(name.as_str().into())
            .map_err(|_| format!("--optimiser {name}: use adam, sgd or rmsprop"))?;
    }
    Ok((config, training))
}

/// The command that reproduces the model, for its provenance.
fn command_line(arguments: &DynamicsTrain) -> String {
    let mut command = format!("mge dynamics train --tools {} --seed {}", arguments.tools, arguments.seed);
    let options = [
        ("epochs", arguments.epochs.map(|value| value.to_string())),
        ("layers", arguments.layers.map(|value| value.to_string())),
        ("learning-rate", arguments.learning_rate.map(|value| value.to_string())),
        ("batch", arguments.batch.map(|value| value.to_string())),
        ("optimiser", arguments.optimiser.clone()),
        ("observations", arguments.observations.map(|value| value.to_string())),
        ("bystanders", arguments.bystanders.map(|value| value.to_string())),
        ("loss", arguments.loss.map(|value| value.to_string())),
        ("ablate", arguments.ablate.map(|value| value.to_string())),
    ];
    for (name, value) in options {
        if let Some(value) = value {
            command += &format!(" --{name} {value}");
        }
    }
    command + if arguments.literal { " --literal" } else { "" } + " --out " + &file_name(&arguments.out)
}

/// The last part of a path, quoted for a shell.
fn file_name(path: &Path) -> String {
    shell_words::quote(&path.file_name().unwrap_or(path.as_os_str()).to_string_lossy()).into_owned()
}

fn run_evaluation(arguments: &DynamicsEvaluate) -> Outcome {
    let figure = arguments.figure.as_deref().map(|path| arguments.force.target(path));
    figure.iter().try_for_each(|to| output::check_target(to, &PICTURE))?;
    let model = dynamics::named(&arguments.model, None)?;
    let DynamicsEvaluate { launches, rollouts: hit_rollouts, seed, .. } = *arguments;
    let config = EvaluationConfig { launches, hit_rollouts, seed, ..EvaluationConfig::default() };
    let mut progress = Progress::new(1, arguments.quiet);
    let evaluation =
        dynamics::evaluate(&model, &task::shipped(), &config, &Stop::default(), &mut |done, total, part| {
            progress.set(done as u64, total as u64, part);
        })?;
    drop(progress);
    if let Some(to) = &figure {
        let DynamicsEvaluate { model: name, seed, launches, print, .. } = arguments;
        let name = shell_words::quote(name);
        let (options, file) = (print.option(), file_name(&to.path));
        let command =
            format!("mge dynamics evaluate {name} --seed {seed} --launches {launches}{options} --figure {file}");
        let provenance = Provenance::new(command, &[arguments.seed], &model.provenance().data_hash);
        model_error_figure(&evaluation, &model).write(to, &provenance, arguments.print.dpi)?;
    }
    Ok(output::line(serde_json::to_string_pretty(&evaluation)?)?)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::arguments::{Arguments, Command};
    use mge_dynamics::{Loss, Model, Training, checkpoint_of};

    fn arguments(line: &str) -> DynamicsTrain {
        match Arguments::try_parse_from(line.split(' ')).unwrap().command {
            Some(Command::Dynamics { command: Dynamics::Train(train) }) => train,
            other => panic!("{line}: {other:?}"),
        }
    }

    fn tiny(out: &Path) -> DynamicsTrain {
        let options = "--layers 1 --observations 2 --epochs 3 --batch 4 --quiet --out";
        arguments(&format!("mge dynamics train --tools floor,square {options} {}", out.display()))
    }

    #[test]
    fn the_command_in_a_model_reproduces_it() {
        let options = [
            "--epochs 7 --layers 3 --learning-rate 0.001 --batch 9 --optimiser rmsprop --observations 5 --bystanders 0.5",
            "--loss huber:0.25 --ablate absolute",
            "--literal",
        ];
        for options in options {
            let line = format!("mge dynamics train --tools square,floor --seed 4 {options} --out a.safetensors");
            let given = arguments(&line);
            let command = command_line(&given);
            assert_eq!(settings(&arguments(&command)).unwrap(), settings(&given).unwrap(), "{command}");
            assert_ne!(settings(&given).unwrap(), <(ModelConfig, TrainConfig)>::default());
            assert_eq!(command, line);
        }
        let (config, training) = settings(&arguments("mge dynamics train --tools box --literal --out a")).unwrap();
        assert_eq!((config, training), (ModelConfig::literal(), TrainConfig::literal()));
        let wrong = arguments("mge dynamics train --tools box --optimiser lion --out a");
        assert!(settings(&wrong).unwrap_err().to_string().contains("rmsprop"));
    }

    #[test]
    fn an_interrupted_training_continues_to_the_same_model() {
        let folder = tempfile::tempdir().unwrap();
        let [whole, resumed] = ["whole", "resumed"].map(|name| folder.path().join(name).join("a.safetensors"));
        for path in [&whole, &resumed] {
            std::fs::create_dir(path.parent().unwrap()).unwrap();
        }
        train(&tiny(&whole)).unwrap();
        let given = tiny(&resumed);
        let (config, training) = settings(&given).unwrap();
        let mut first =
            Training::new(config, training, given.tools.kinds(), &command_line(&given), &Stop::default()).unwrap();
        assert_eq!(first.run(&Stop::default(), |_, now| now.epoch < 2), TrainingOutcome::Stopped);
        let checkpoint = checkpoint_of(&resumed);
        std::fs::write(&checkpoint, first.checkpoint().to_bytes()).unwrap();

        // The checkpoint of a training with other settings is refused.
        let refused = |change: &dyn Fn(&mut DynamicsTrain)| {
            let mut other = tiny(&resumed);
            change(&mut other);
            train(&other).unwrap_err().to_string()
        };
        for error in [
            refused(&|other| other.tools = "floor".parse().unwrap()),
            refused(&|other| other.seed = 1),
            refused(&|other| other.ablate = Some(Variant::SharedEdges)),
        ] {
            assert!(error.contains("a.safetensors.checkpoint") && error.contains("other settings"), "{error}");
        }
        let bytes = std::fs::read(&checkpoint).unwrap();
        std::fs::write(&checkpoint, &bytes[..bytes.len() / 2]).unwrap();
        assert!(refused(&|_| {}).contains("a.safetensors.checkpoint"));

        std::fs::write(&checkpoint, &bytes).unwrap();
        train(&given).unwrap();
        assert!(!checkpoint.exists());
        assert!(std::fs::read(&whole).unwrap() == std::fs::read(&resumed).unwrap());
    }

    #[test]
    fn a_model_may_be_called_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let given = tiny(&folder.path().join("m.checkpoint"));
        train(&given).unwrap();
        assert_eq!(Model::load(&given.out).unwrap().provenance().epoch, 3);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_diverged_training_keeps_the_last_good_model_and_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let mut given = tiny(&folder.path().join("a.safetensors"));
        (given.optimiser, given.learning_rate, given.loss) = (Some("sgd".to_owned()), Some(1e30), Some(Loss::Squared));
        let error = train(&given).unwrap_err().to_string();
        assert!(error.starts_with("epoch ") && error.contains("the epoch before"), "{error}");
        assert!(Model::load(&given.out).unwrap().provenance().epoch < 3);
    }
}
