//! A small study as a whole.

use std::path::Path;

use super::{Report, Study, moved, reproduce};
use crate::error::{ExperimentError, Result};
use crate::sweep::Sweep;
use mge_base::stop::Stop;
use mge_results::{FoundRun, LearningRow, find_runs, read_runs};
use mge_trainer::PriorSource;
use mge_trainer::batch::{Batch, BatchProgress};

/// The quick study on one task, with fewer seeds and tiny networks.
fn study() -> Study {
    let Study { models, hits, trainings } = Study::quick();
    let small = |text: String, settings: &str| {
        let text = text.replace(TASKS, r#""task3""#).replace("\"kind\"", &format!("{settings}, \"kind\""));
        let text = text.replace("\"config\"", &format!("{settings}, \"config\""));
        text.replace("\"method\"", &format!("{settings}, \"method\""))
    };
    let model = r#""layers": 1, "width": 8, "embedding": 4, "observations": 8, "validation": 2, "batch": 8,
        "evaluation.launches": 5, "evaluation.episodes": 1, "evaluation.horizon": 2, "evaluation.hit_rollouts": 5"#;
    let models = models.replace("\"epochs\": 3000", "\"epochs\": 3");
    let agent = r#""ddpg.hidden": 8, "guidance.model_rollouts": 50, "guidance.most_model_rollouts": 50,
        "guidance.environment_rollouts": 10, "model.launches": 5, "model.epochs": 3, "practice.rollouts": 2,
        "planner.rollouts": 4, "planner.horizon": 2, "planner.iterations": 1, "planner.elites": 2, "checkpoints.last_every": 2"#;
    // One of three searches for clusters, and random play.
    let mut hits: Vec<serde_json::Value> = serde_json::from_str(&hits).unwrap();
    hits.drain(1..3);
    for job in &mut hits {
        (job["task"], job["episodes"]) = ("task3".into(), 4.into());
    }
    let trainings = trainings.replace("\"episodes\": 1000,", "\"episodes\": 6,");
    let trainings = trainings.replace("\"episodes\": 400,", "\"episodes\": 6,");
    let trainings = trainings.replace("\"episodes\": 20,", "\"episodes\": 2,");
    Study {
        models: small(
            models.replace(r#"["box,wall,floor", "bucket,box", "square,floor"]"#, r#""square,floor""#),
            model,
        ),
        hits: serde_json::to_string(&hits).unwrap(),
        trainings: small(trainings, agent),
    }
}

const TASKS: &str = r#"["task1", "task2", "task3", "task4", "task5", "task6"]"#;

fn run(
    threads: usize,
    folder: &Path,
    interrupt: &Stop,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Report> {
    reproduce(&study(), 7, folder, "mge reproduce", 20, &mut Batch { threads, interrupt, on_progress })
}

#[test]
fn the_files_of_studies_are_sweeps_with_seeds_from_the_first() {
    for (study, hits, trainings) in [(Study::full(), 120, 660), (Study::quick(), 36, 114)] {
        // Without the models, which the study makes first.
        let shipped = |file: &str| file.replace("study/models/runs/{tools}-seed0/model.safetensors", "learned");
        let of = |file: &str| moved(&shipped(file), Path::new("/"), 30).unwrap();
        let [models, hits_of, trainings_of] = [&study.models, &study.hits, &study.trainings].map(|file| of(file));
        assert_eq!([&models, &hits_of, &trainings_of].map(|sweep| sweep.jobs.len()), [3, hits, trainings]);
        assert_eq!(models.jobs[1].name, "bucket-box-seed30");
        assert_eq!(hits_of.jobs[0].name, "task1-guided-seed30");
        assert_eq!(trainings_of.jobs[0].name, "task1-ddpg-seed30");
    }
    let folder = tempfile::tempdir().unwrap();
    let error = moved(&Study::full().hits, folder.path(), 30).unwrap_err().to_string();
    assert!(error.contains("models/runs/bucket-box-seed30/model.safetensors"), "{error}");
    let questions = include_str!("../../sweeps/questions.json");
    let shipped = with_shipped_models(questions);
    assert_eq!(Sweep::parse(shipped.as_bytes(), "questions.json").unwrap().jobs.len(), 60 * 5);
}

/// A sweep file with the shipped models in place of those of a study.
fn with_shipped_models(text: &str) -> String {
    let replaced = text.split('"').map(|part| if part.starts_with("study/") { "learned" } else { part });
    replaced.collect::<Vec<_>>().join("\"")
}

#[test]
fn a_study_is_the_same_on_any_number_of_threads_and_after_an_interruption() {
    let (whole, broken) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let never = Stop::default();
    let mut reports = Vec::new();
    let report = run(1, whole.path(), &never, &mut |now| reports.push(now.message.to_owned())).unwrap();
    assert_eq!((report.models.len(), report.hits.len()), (1, 4));
    let charged =
        |rows: &[LearningRow]| -> Vec<bool> { rows.iter().map(|row| row.charged_outside > Some(0)).collect() };
    let [ddpg, guided] = [false, true];
    assert_eq!(charged(&report.learning), [[ddpg; 2].as_slice(), &[guided; 4]].concat());
    // Uniform actions and noise need neither clusters from rollouts nor launches.
    let expected = [[ddpg; 2].as_slice(), &[guided; 6], &[ddpg; 2], &[guided; 3]].concat();
    assert_eq!(charged(&report.noisy_starts), expected);
    let runs = read_runs(&find_runs(&[whole.path().to_owned()]).unwrap()).unwrap();
    let (noisy, fixed): (Vec<FoundRun>, Vec<FoundRun>) =
        runs.into_iter().partition(|run| run.config.start_noise == Some(0.01));
    assert_eq!((fixed.len(), noisy.len()), (report.learning.len(), report.noisy_starts.len()));
    assert!(noisy.iter().all(|run| run.config.prior == PriorSource::default()));
    let guided = fixed.iter().filter(|run| run.config.is_guided());
    assert!(guided.clone().count() == 4 && guided.clone().all(|run| run.config.prior.name() == "square-floor-seed7"));
    let parts = ["part 1 of 3, models", "part 2 of 3, hits", "part 3 of 3, trainings"];
    assert!(parts.iter().all(|part| reports.iter().any(|message| message.starts_with(part))), "{reports:?}");

    // Interrupted as soon as the first training has ended.
    let interrupt = Stop::default();
    let outcome = run(1, broken.path(), &interrupt, &mut |now| {
        let a_run = broken.path().join("runs").exists();
        if a_run && now.ended > 0 {
            interrupt.request();
        }
    });
    assert!(matches!(outcome, Err(ExperimentError::Interrupted { .. })), "{outcome:?}");
    assert_eq!(run(3, broken.path(), &never, &mut |_| {}).unwrap(), report);
    for file in ["report.json", "report.md"] {
        let [a, b] = [&whole, &broken].map(|folder| std::fs::read_to_string(folder.path().join(file)).unwrap());
        assert_eq!(a, b, "{file}");
    }
}
