//! Ablation of the structural assumptions of the dynamics models (paper, section 4.1): each is
//! switched off in turn, over several seeds and the tool sets of the tasks.

use serde::{Deserialize, Serialize};

use super::error::StudyError;
use super::folder::Folder;
use mge_base::atomic::Target;
use mge_base::markdown;
use mge_dynamics::{
    Evaluation, EvaluationConfig, ModelConfig, OneTool, SceneErrors, TrainConfig, TrainingOutcome, Variant, evaluate,
    tool_set_name, train_to_file,
};
use mge_figures::{Figure, MethodScore, MethodScores, Provenance, ScorePanel, Statistics};
use mge_physics::ToolKind;
use mge_results::figures::INTERVAL;
use mge_run::config_hash;
use mge_stats::{Bootstrap, Estimate, StatsError};
use mge_task::Task;
use mge_trainer::batch::{self, Batch, BatchProgress, Job};

/// The parameters of an ablation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AblationPlan {
    /// The model with all assumptions.
    pub model: ModelConfig,
    /// Its training, with the first of the consecutive seeds.
    pub training: TrainConfig,
    /// Number of seeds of every variant.
    pub seeds: u64,
    /// Tool sets, one model each.
    pub tool_sets: Vec<Vec<ToolKind>>,
    /// Tasks whose scenes are predicted.
    pub tasks: Vec<Task>,
    /// The evaluation of every model.
    pub evaluation: EvaluationConfig,
    /// Parameters of the intervals.
    pub bootstrap: Bootstrap,
}

/// One trained and evaluated variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ablated {
    /// Which assumption is off.
    pub variant: Variant,
    /// Seed of the launches, the initial weights and the batches: variants with the same seed learn
    /// from the same launches.
    pub seed: u64,
    /// Why the training ended early, if it did; the model is then the last good one.
    pub failure: Option<String>,
    /// Its errors on unseen data.
    pub evaluation: Evaluation,
}

/// A quantity measured for every model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Error of one prediction on held-out launches.
    OneStep,
    /// The same, for steps in which the ball was deflected.
    OneStepContact,
    /// Error after one action, on held-out launches that were deflected.
    ActionContact,
    /// Error after one action in unseen scenes.
    SceneOne,
    /// Error after the evaluation's horizon in unseen scenes.
    SceneLast,
    /// Fraction of the predicted hits of the next stage that were real.
    Precision,
    /// Fraction of the real hits of the next stage that were predicted.
    Recall,
}

impl Measure {
    /// All measures, in the order of the table.
    pub const ALL: [Measure; 7] = [
        Self::OneStep,
        Self::OneStepContact,
        Self::ActionContact,
        Self::SceneOne,
        Self::SceneLast,
        Self::Precision,
        Self::Recall,
    ];

    /// Its row of the table of measures.
    fn info(self) -> MeasureInfo {
        let (label, digits, of): (_, _, fn(&Evaluation) -> Option<f64>) = match self {
            Self::OneStep => ("launches: one step", 4, |all| launches(all, |tool| tool.one_step.mean)),
            Self::OneStepContact => {
                ("one step with contact", 4, |all| launches(all, |tool| tool.one_step_contact.mean))
            }
            Self::ActionContact => ("one action with contact", 4, |all| launches(all, |tool| tool.action_contact.mean)),
            Self::SceneOne => {
                ("scenes: one action", 3, |all| scenes(all, |scene| Some(scene.rollout.model.first()?.mean)))
            }
            Self::SceneLast => ("last action", 3, |all| scenes(all, |scene| Some(scene.rollout.model.last()?.mean))),
            Self::Precision => ("hits: precision", 2, |all| scenes(all, |scene| scene.hits.model.precision)),
            Self::Recall => ("recall", 2, |all| scenes(all, |scene| scene.hits.model.recall)),
        };
        MeasureInfo { label, digits, of }
    }
}

/// The properties of a measure.
struct MeasureInfo {
    /// Name in the table.
    label: &'static str,
    /// Number of decimals shown.
    digits: usize,
    /// The measure of one model: a mean over its tools or over its tasks. None if it is undefined,
    /// such as the precision of a model that never predicts a hit.
    of: fn(&Evaluation) -> Option<f64>,
}

fn launches(evaluation: &Evaluation, of: fn(&OneTool) -> f64) -> Option<f64> {
    mean(evaluation.launches.iter().map(|tool| of(&tool.errors.model)))
}

fn scenes(evaluation: &Evaluation, of: fn(&SceneErrors) -> Option<f64>) -> Option<f64> {
    mean(evaluation.scenes.iter().filter_map(of))
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// A measure of a variant over the seeds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What is measured.
    pub measure: Measure,
    /// Mean over the seeds with its interval; None if it is undefined for all of them.
    pub estimate: Option<Estimate>,
}

/// A variant's results on one tool set or on all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VariantSummary {
    /// Name of the tool set; `all` for the mean over tool sets.
    pub tools: String,
    /// Which assumption is off.
    pub variant: Variant,
    /// Number of trainings that diverged.
    pub failures: usize,
    /// Every measure.
    pub measures: Vec<Summary>,
}

/// The whole ablation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AblationReport {
    /// Format version.
    pub version: u32,
    /// Epochs of every training.
    pub epochs: u32,
    /// Seeds of every variant.
    pub seeds: u64,
    /// Results over the seeds.
    pub summaries: Vec<VariantSummary>,
    /// Every model's evaluation, by tool set, variant and seed.
    pub models: Vec<Ablated>,
}

/// Runs the ablation of `plan` in `folder`, or the missing parts of it. Writes every model and its
/// evaluation, `ablation.json`, `ablation.md` and two figures (at `dpi` dots per inch) with their
/// CSV. `command` reproduces it.
///
/// # Errors
/// The first failure; completed parts are kept, and the next call continues.
pub fn ablation(
    plan: &AblationPlan,
    folder: impl Into<Target>,
    command: &str,
    dpi: u32,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<AblationReport, StudyError> {
    let folder = folder.into();
    let folder = Folder(&folder);
    folder.claim(plan, &["models"], "ablation.md")?;
    let mut jobs = Vec::new();
    for tools in &plan.tool_sets {
        for seed in plan.training.seed..plan.training.seed + plan.seeds {
            jobs.extend(Variant::ALL.map(|variant| model_job(plan, folder, command, tools, variant, seed)));
        }
    }
    let outcomes = batch.run(&jobs, on_progress)?;
    let models = batch::all(outcomes)?;
    let report = AblationReport {
        version: 1,
        epochs: plan.training.epochs,
        seeds: plan.seeds,
        summaries: summarise(plan, &models)?,
        models,
    };
    folder.write_json("ablation.json", &report)?;
    folder.write_report("ablation.md", &report.to_markdown(command))?;
    let seeds: Vec<u64> = (plan.training.seed..plan.training.seed + plan.seeds).collect();
    let provenance = Provenance::new(command.to_owned(), &seeds, config_hash(plan)?);
    let horizon = plan.evaluation.horizon;
    for (name, measure, label) in [
        (
            "ablation-launches",
            Measure::OneStepContact,
            "one-step error with contact, held-out launches (normalised)".to_owned(),
        ),
        ("ablation-scenes", Measure::SceneLast, format!("error after {horizon} actions, unseen scenes (normalised)")),
    ] {
        report.figure(measure, &label).write_all(folder.0, name, &provenance, dpi)?;
    }
    Ok(report)
}

/// The job that trains and evaluates one model.
fn model_job<'a>(
    plan: &'a AblationPlan,
    folder: Folder<'a>,
    command: &'a str,
    tools: &'a [ToolKind],
    variant: Variant,
    seed: u64,
) -> Job<'a, Ablated, StudyError> {
    let (name, count) = (format!("{}-{variant}-{seed}", tool_set_name(tools)), tools.len() as u64);
    Job::new(name.clone(), count * u64::from(plan.training.epochs), move |handle| {
        let file = format!("models/{name}.json");
        if let Some(ablated) = folder.read(&file)? {
            return Ok(Some(ablated));
        }
        let path = folder.path(&format!("models/{name}.safetensors"));
        let (config, training) = (variant.apply(plan.model.clone()), TrainConfig { seed, ..plan.training.clone() });
        let trained = train_to_file(&path, config, training, tools, command, handle.stop(), |now| {
            handle.set_done(count * u64::from(now.epoch));
            handle.report(format!("{name}, epoch {}, loss {:.4}", now.epoch, now.loss));
        })?;
        if trained.ended == TrainingOutcome::Stopped {
            return Ok(None);
        }
        let failure = trained.divergence();
        if failure.is_some() {
            trained.model().save(&path)?;
        }
        let evaluation = evaluate(trained.model(), &plan.tasks, &plan.evaluation, handle.stop(), &mut |now| {
            handle.report(format!("{name}, evaluation {} of {}", now.done + 1, now.total));
        })?;
        let ablated = Ablated { variant, seed, failure, evaluation };
        folder.write_json(&file, &ablated)?;
        trained.remove_checkpoint();
        Ok(Some(ablated))
    })
}

fn summarise(plan: &AblationPlan, models: &[Ablated]) -> Result<Vec<VariantSummary>, StatsError> {
    let names: Vec<String> = plan.tool_sets.iter().map(|tools| tool_set_name(tools)).collect();
    let mut groups: Vec<(String, Vec<&str>)> = names.iter().map(|name| (name.clone(), vec![name.as_str()])).collect();
    if names.len() > 1 {
        groups.push(("all".to_owned(), names.iter().map(String::as_str).collect()));
    }
    let mut summaries = Vec::new();
    for (tools, sets) in groups {
        for variant in Variant::ALL {
            let own: Vec<&Ablated> = models
                .iter()
                .filter(|model| model.variant == variant && sets.contains(&model.evaluation.model.as_str()))
                .collect();
            let measures = Measure::ALL.map(|measure| {
                // One value per seed: the mean over the tool sets.
                let seeds = plan.training.seed..plan.training.seed + plan.seeds;
                let values: Vec<f64> = seeds
                    .filter_map(|seed| {
                        mean(
                            own.iter()
                                .filter(|model| model.seed == seed)
                                .filter_map(|model| (measure.info().of)(&model.evaluation)),
                        )
                    })
                    .collect();
                let estimate = (!values.is_empty()).then(|| plan.bootstrap.mean(&values)).transpose()?;
                Ok(Summary { measure, estimate })
            });
            summaries.push(VariantSummary {
                tools: tools.clone(),
                variant,
                failures: own.iter().filter(|model| model.failure.is_some()).count(),
                measures: measures.into_iter().collect::<Result<_, StatsError>>()?,
            });
        }
    }
    Ok(summaries)
}

impl AblationReport {
    /// The results as a Markdown table.
    pub fn to_markdown(&self, command: &str) -> String {
        let mut text = format!(
            "{}: {} epochs, {} seeds. Mean over the seeds with its 95 % bootstrap interval; errors in normalised units (the screen is 2 wide), of launches and of whole scenes that no model was trained on.\n\n",
            markdown::made_by(command, env!("CARGO_PKG_VERSION")),
            self.epochs,
            self.seeds
        );
        text +=
            &markdown::header(["tools", "model"].into_iter().chain(Measure::ALL.map(|measure| measure.info().label)));
        for row in &self.summaries {
            let cells = row.measures.iter().map(|summary| match summary.estimate {
                Some(Estimate { value, lower, upper }) => {
                    let digits = summary.measure.info().digits;
                    format!("{value:.digits$} [{lower:.digits$}, {upper:.digits$}]")
                }
                None => "none".to_owned(),
            });
            let failures = if row.failures > 0 { format!(" ({} diverged)", row.failures) } else { String::new() };
            let model = format!("{}{failures}", row.variant.label());
            text += &markdown::row([row.tools.clone(), model].into_iter().chain(cells));
        }
        text
    }

    /// A figure of one measure of all variants, over the last summary group: the mean over all tool sets.
    pub fn figure(&self, measure: Measure, label: &str) -> MethodScores {
        let last = self.summaries.len().saturating_sub(Variant::ALL.len());
        let variants = self.summaries[last..].iter().map(|row| {
            let estimate = row.measures.iter().find(|summary| summary.measure == measure).and_then(|s| s.estimate);
            MethodScore {
                label: row.variant.label().to_owned(),
                estimate: estimate.unwrap_or(Estimate::exact(f64::NAN)),
                runs: Vec::new(),
            }
        });
        MethodScores {
            measure: label.to_owned(),
            statistics: Statistics {
                centre: "Mean".to_owned(),
                interval: INTERVAL.to_owned(),
                seeds: self.seeds as usize,
                fewest_seeds: None,
            },
            reference: None,
            panels: vec![ScorePanel { task: String::new(), methods: variants.collect() }],
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use mge_base::stop::Stop;
    use mge_figures::DEFAULT_DPI;
    use mge_task as task;

    fn plan() -> AblationPlan {
        AblationPlan {
            model: ModelConfig { layers: 2, width: 8, embedding: 4, ..ModelConfig::default() },
            training: TrainConfig { observations: 8, validation: 2, epochs: 2, batch: 8, ..TrainConfig::default() },
            seeds: 2,
            tool_sets: vec![vec![ToolKind::Bucket, ToolKind::Box], vec![ToolKind::Square, ToolKind::Floor]],
            tasks: task::shipped(),
            evaluation: EvaluationConfig { launches: 10, episodes: 1, horizon: 2, hit_rollouts: 10, seed: 3 },
            bootstrap: Bootstrap { resamples: 50, ..Bootstrap::default() },
        }
    }

    fn run_with(
        threads: usize,
        plan: &AblationPlan,
        folder: &Path,
        on_progress: &mut dyn FnMut(&BatchProgress<'_>),
    ) -> Result<AblationReport, StudyError> {
        let interrupt = Stop::default();
        ablation(plan, folder, "test", DEFAULT_DPI, &Batch { threads, interrupt: &interrupt }, on_progress)
    }

    #[test]
    fn an_ablation_continues_where_it_was_stopped() {
        let (folder, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let mut last = (0, 0);
        let report = run_with(2, &plan(), folder.path(), &mut |now| last = (now.done, now.total)).unwrap();
        assert_eq!(last, (2 * 2 * 4 * 2 * 2, 2 * 2 * 4 * 2 * 2));
        assert_eq!((report.models.len(), report.summaries.len()), (16, 12));
        let text = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        let whole = text("ablation.json");
        let model = "models/square-floor-absolute-1";
        let weights = text(&format!("{model}.safetensors"));
        for name in [format!("{model}.json"), format!("{model}.safetensors"), "ablation.json".to_owned()] {
            std::fs::remove_file(folder.path().join(name)).unwrap();
        }
        // One thread or two, interrupted or not: the same bytes.
        assert_eq!(run_with(1, &plan(), folder.path(), &mut |_| {}).unwrap(), report);
        assert!(text("ablation.json") == whole && text(&format!("{model}.safetensors")) == weights);
        for name in ["ablation-launches.png", "ablation-launches.csv", "ablation-scenes.png", "ablation.md"] {
            assert!(!text(name).is_empty(), "{name}");
        }
        let table = String::from_utf8(text("ablation.md")).unwrap();
        assert!(table.contains("| all | shared edge function | ") && table.contains("2 epochs, 2 seeds"), "{table}");

        let longer = AblationPlan { seeds: 3, ..plan() };
        let error = run_with(1, &longer, folder.path(), &mut |_| {}).unwrap_err();
        assert!(matches!(error, StudyError::OtherStudy { .. }), "{error}");
        std::fs::write(folder.path().join("plan.json"), "{").unwrap();
        let error = run_with(1, &longer, folder.path(), &mut |_| {}).unwrap_err();
        assert!(matches!(&error, StudyError::Plan { path } if path.ends_with("plan.json")), "{error}");
        let broken = AblationPlan { training: TrainConfig { batch: 0, ..plan().training }, ..plan() };
        let error = run_with(2, &broken, other.path(), &mut |_| {}).unwrap_err();
        assert!(error.to_string().contains("batch"), "{error}");
    }

    #[test]
    fn measures_are_means_over_tools_tasks_and_tool_sets() {
        let folder = tempfile::tempdir().unwrap();
        let report = run_with(2, &plan(), folder.path(), &mut |_| {}).unwrap();
        let of = |tools: &str, measure: Measure| {
            let row = report.summaries.iter().find(|row| row.tools == tools && row.variant == Variant::Full).unwrap();
            row.measures.iter().find(|summary| summary.measure == measure).unwrap().estimate.unwrap()
        };
        for measure in [Measure::OneStep, Measure::SceneLast] {
            let [one, two, all] = ["bucket-box", "square-floor", "all"].map(|tools| of(tools, measure).value);
            assert!((all - (one + two) / 2.0).abs() < 1e-12, "{one} {two} {all}");
        }
        let full = report.models.iter().filter(|model| model.variant == Variant::Full);
        let boxes = full.filter(|model| model.evaluation.model == "bucket-box");
        let errors = boxes.flat_map(|model| model.evaluation.launches.iter().map(|l| l.errors.model.one_step.mean));
        assert!((of("bucket-box", Measure::OneStep).value - mean(errors).unwrap()).abs() < 1e-12);
        let figure = report.figure(Measure::SceneLast, "scenes");
        assert_eq!(figure.panels[0].methods.len(), 4);
        assert_eq!(figure.panels[0].methods[0].estimate.value, of("all", Measure::SceneLast).value);
    }
}
