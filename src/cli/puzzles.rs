//! `mge puzzles`: generates puzzles, and trains methods on them.

use std::path::PathBuf;

use super::arguments::{PuzzlesBench, PuzzlesGenerate};
use super::interrupt::in_batch;
use super::output::{self, Outcome};
use super::runs::definitions;
use super::{studies, sweeps};
use mge_experiments::puzzles::{self, Bench, Criteria, Index, START_NOISE};
use mge_experiments::sweep::{self, Sweep};
use mge_results::ReportFolder;
use mge_stats::Bootstrap;
use mge_trainer::PriorSource;

pub fn generate(arguments: &PuzzlesGenerate) -> Outcome {
    let wanted = Index::new(arguments.seed, arguments.split, START_NOISE);
    let out = arguments.force.target(&arguments.out);
    let criteria = Criteria::default();
    in_batch(&arguments.jobs, |batch| puzzles::generate(&wanted, arguments.count, &criteria, &out, batch))?;
    Ok(output::line(arguments.out.join("index.json").display())?)
}

pub fn bench(arguments: &PuzzlesBench) -> Outcome {
    let bench = Bench {
        puzzles: arguments.puzzles.clone(),
        model: PriorSource::from(arguments.model.clone()).identified(),
        subgoals: arguments.subgoals,
        methods: arguments.methods.clone(),
        episodes: arguments.episodes,
        seeds: arguments.seeds,
        settings: definitions(&arguments.settings, "--set", [])?,
    };
    let folder = arguments.puzzles.display();
    let missing = || format!("{folder} has no index.json: generate puzzles with `mge puzzles generate`");
    let index = Index::load(&arguments.puzzles)?.ok_or_else(missing)?;
    // Invalid settings are found before the search for subgoals, on any task.
    let mut trial = Sweep::parse(bench.sweep(&["task1".into()])?.as_bytes(), "--set")?;
    // The search for subgoals uses the model in any case.
    trial.jobs.iter_mut().for_each(|job| _ = job.set.remove("prior"));
    output::warnings(trial.warnings());
    let out = arguments.force.target(&arguments.out);
    ReportFolder::new(out.clone())?;
    sweep::check_results(&out)?;
    let (file, text) = in_batch(&arguments.jobs, |batch| bench.prepare(&index, &out, batch))?;
    if arguments.prepare {
        return Ok(output::line(file.display())?);
    }
    // Not from the file, which another process may have replaced.
    let sweep = Sweep::parse(text.as_bytes(), &file.display().to_string())?;
    let failures = sweeps::work(&sweep, &arguments.out, &arguments.jobs)?;
    // The failures are reported in the end, those of damaged runs among them.
    if let Ok(path) = sweep::write_results(&out) {
        output::line(path.display())?;
    }
    let runs: Vec<PathBuf> = sweep.jobs.iter().map(|job| job.folder(&out.path)).filter(|run| run.exists()).collect();
    if failures.len() < sweep.jobs.len() {
        studies::report_runs(&runs, &out, &Bootstrap::default(), None, arguments.print.dpi, arguments.jobs.quiet)?;
    }
    Ok(sweep::no_failure(&sweep, &failures)?)
}
