//! `mge puzzles`: generates puzzles, and trains methods on them.

use std::path::PathBuf;

use super::arguments::{Puzzles, PuzzlesBench, PuzzlesGenerate, SubgoalOptions};
use super::interrupt::{brief, in_batch};
use super::output::{self, Outcome};
use super::provenance;
use super::runs::definitions;
use super::sweeps;
use mge_experiments::ExperimentError;
use mge_experiments::puzzles::{self, BenchPlan, BenchResults, Criteria, Index, SubgoalSearch};
use mge_experiments::sweep::Sweep;
use mge_run::{RunState, config_hash};
use mge_trainer::PriorSource;

pub fn run(command: &Puzzles) -> Outcome {
    match command {
        Puzzles::Generate(arguments) => generate(arguments),
        Puzzles::Bench(arguments) => bench(arguments),
    }
}

fn generate(arguments: &PuzzlesGenerate) -> Outcome {
    let wanted = Index::new(arguments.seed, arguments.split, arguments.start_noise);
    let criteria = Criteria { random_actions: arguments.random_actions, ..Criteria::default() };
    let out = arguments.force.target(&arguments.out);
    let index = in_batch(
        arguments.threads,
        arguments.quiet,
        |batch, on_progress| puzzles::generate(&wanted, arguments.count, &criteria, &out, batch, on_progress),
        ExperimentError::is_interruption,
    )?;
    output::message(index.selection());
    Ok(output::line(arguments.out.join("index.json").display())?)
}

fn bench(arguments: &PuzzlesBench) -> Outcome {
    let plan = BenchPlan {
        search: search(&arguments.search),
        methods: arguments.methods.clone(),
        episodes: arguments.episodes,
        seeds: arguments.seeds,
        settings: definitions(&arguments.settings, "--set", &[])?,
    };
    let index = index_of(&arguments.search)?;
    // Invalid settings are found before the search for subgoals, on any task.
    let mut trial = Sweep::parse(plan.sweep(&["task1".into()])?.as_bytes(), "--set")?;
    // The search for subgoals uses the model in any case.
    trial.jobs.iter_mut().for_each(|job| _ = job.set.remove("prior"));
    sweeps::warn(&trial);
    let out = arguments.force.target(&arguments.out);
    let (file, text) = in_batch(
        arguments.threads,
        arguments.quiet,
        |batch, on_progress| puzzles::prepare(&plan, &index, &out, batch, on_progress),
        ExperimentError::is_interruption,
    )?;
    if arguments.prepare {
        return Ok(output::line(file.display())?);
    }
    // Not from the file, which another process may have replaced.
    let sweep = Sweep::parse(text.as_bytes(), &file.display().to_string())?;
    let failures = sweeps::work(&sweep, &arguments.out, arguments.threads, arguments.quiet)?;
    let Some((name, reason)) = failures.first() else { return brief(|| report(arguments, index, &sweep)) };
    if failures.len() < sweep.jobs.len() {
        brief(|| report(arguments, index, &sweep))?;
    }
    Err(format!("{} trainings not finished, such as {name}: {reason}", failures.len()).into())
}

fn search(arguments: &SubgoalOptions) -> SubgoalSearch {
    let (puzzles, model) = (arguments.puzzles.clone(), PriorSource::from(arguments.model.clone()).identified());
    SubgoalSearch { puzzles, model, subgoals: arguments.subgoals }
}

fn index_of(arguments: &SubgoalOptions) -> Result<Index, Box<dyn std::error::Error>> {
    let folder = arguments.puzzles.display();
    let missing = || format!("{folder} has no index.json: generate puzzles with `mge puzzles generate`");
    Ok(Index::load(&arguments.puzzles)?.ok_or_else(missing)?)
}

/// Writes the report of the finished trainings.
fn report(arguments: &PuzzlesBench, index: Index, sweep: &Sweep) -> Outcome {
    let out = &arguments.out;
    let folders: Vec<PathBuf> = sweep.jobs.iter().map(|job| job.folder(out)).filter(|folder| folder.exists()).collect();
    let mut runs = mge_results::read_runs(&folders)?;
    runs.retain(|run| run.state == RunState::Finished);
    let hash = config_hash(&runs.iter().map(|run| &run.config).collect::<Vec<_>>())?;
    let rows = runs.into_iter().map(|run| run.trained.row).collect();
    let folder = mge_results::ReportFolder::new(arguments.force.target(out))?;
    BenchResults::new(&provenance::command(), index, rows).write(&folder, &hash, arguments.print.dpi)?;
    Ok(output::line(out.join("report.md").display())?)
}
