//! A small study as a whole.

use std::path::Path;

use super::plan::StudyPlan;
use super::report::Report;
use super::{StudyError, reproduce};
use mge_base::stop::Stop;
use mge_dynamics::{EvaluationConfig, ModelConfig, TrainConfig};
use mge_results::{FoundRun, LearningRow, find_runs, read_runs};
use mge_task as task;
use mge_trainer::PriorSource;
use mge_trainer::batch::{Batch, BatchProgress};

fn plan() -> StudyPlan {
    let mut plan = StudyPlan {
        tasks: vec![task::load("task3").unwrap()],
        model: ModelConfig { layers: 1, width: 8, embedding: 4, ..ModelConfig::default() },
        model_training: TrainConfig { observations: 8, validation: 2, epochs: 3, batch: 8, ..TrainConfig::default() },
        model_evaluation: EvaluationConfig { launches: 5, episodes: 1, horizon: 2, hit_rollouts: 5, seed: 1 },
        builds: 1,
        hit_seeds: 2,
        hit_episodes: 4,
        learning_seeds: 2,
        learning_episodes: 6,
        resamples: 20,
        ..StudyPlan::quick(7)
    };
    for arm in &mut plan.arms {
        for (key, value) in [
            ("ddpg.hidden", "8"),
            ("guidance.model_rollouts", "50"),
            ("guidance.environment_rollouts", "10"),
            ("practice.rollouts", "2"),
            ("checkpoints.last_every", "2"),
        ] {
            arm.settings.insert(key.to_owned(), value.to_owned());
        }
    }
    plan
}

fn run(
    threads: usize,
    folder: &Path,
    interrupt: &Stop,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Report, StudyError> {
    reproduce(&plan(), folder, "mge reproduce", 20, &Batch { threads, interrupt }, on_progress)
}

#[test]
fn a_study_is_the_same_on_any_number_of_threads_and_after_an_interruption() {
    let (whole, broken) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let never = Stop::default();
    let mut reports = Vec::new();
    let report = run(1, whole.path(), &never, &mut |now| reports.push((now.done, now.total))).unwrap();
    assert_eq!((report.models.len(), report.hits.len()), (1, 4));
    let charged = |rows: &[LearningRow]| -> Vec<bool> { rows.iter().map(|row| row.charged > 0).collect() };
    let [ddpg, guided] = [false, true];
    assert_eq!(charged(&report.learning), [ddpg, guided, guided].repeat(2));
    // Uniform actions and noise need neither clusters from rollouts nor launches.
    assert_eq!(charged(&report.noisy_starts), [ddpg, guided, guided, false, false, true].repeat(2));
    let runs = read_runs(&find_runs(&[whole.path().to_owned()]).unwrap()).unwrap();
    let (noisy, fixed): (Vec<FoundRun>, Vec<FoundRun>) =
        runs.into_iter().partition(|run| run.config.start_noise == Some(0.01));
    assert_eq!((fixed.len(), noisy.len()), (report.learning.len(), report.noisy_starts.len()));
    assert!(noisy.iter().all(|run| run.config.prior == PriorSource::Learned));
    assert!(fixed.iter().all(|run| matches!(&run.config.prior, PriorSource::ModelFile(_))));
    let (done, total) = *reports.last().unwrap();
    assert!(done == total && reports.iter().all(|report| report.1 == total), "{reports:?}");
    assert!(reports.is_sorted(), "{reports:?}");

    // Interrupted as soon as the first training has ended.
    let interrupt = Stop::default();
    let outcome = run(1, broken.path(), &interrupt, &mut |now| {
        let a_run = std::fs::read_dir(broken.path().join("runs")).unwrap().count() > 0;
        if a_run && now.ended > 0 {
            interrupt.request();
        }
    });
    assert!(matches!(outcome, Err(StudyError::Interrupted)), "{outcome:?}");
    assert_eq!(run(3, broken.path(), &never, &mut |_| {}).unwrap(), report);
    for file in ["report.json", "report.md"] {
        let [a, b] = [&whole, &broken].map(|folder| std::fs::read_to_string(folder.path().join(file)).unwrap());
        assert_eq!(a, b, "{file}");
    }
}
