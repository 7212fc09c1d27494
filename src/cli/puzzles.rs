//! `mge puzzles`: generates puzzles and trains methods on them.

use std::path::Path;

use super::arguments::{Puzzles, PuzzlesBench, PuzzlesGenerate};
use super::progress::in_batch;
use super::runs::split_definition;
use super::{Outcome, output, sweeps};
use crate::batch::default_threads;
use crate::evidence;
use crate::puzzles::{self, BenchPlan, BenchResults, Criteria, Index, PuzzleError};
use crate::sweep::Sweep;

pub fn run(command: &Puzzles) -> Outcome {
    match command {
        Puzzles::Generate(arguments) => generate(arguments),
        Puzzles::Bench(arguments) => bench(arguments),
    }
}

fn generate(arguments: &PuzzlesGenerate) -> Outcome {
    let wanted = Index::new(arguments.seed, arguments.split, arguments.start_noise);
    let criteria = Criteria { random_actions: arguments.random_actions, ..Criteria::default() };
    in_batch(
        arguments.threads,
        arguments.quiet,
        |batch, on_progress| puzzles::generate(&wanted, arguments.count, &criteria, &arguments.out, batch, on_progress),
        PuzzleError::is_interruption,
    )?;
    Ok(output::line(arguments.out.join("index.json").display())?)
}

fn bench(arguments: &PuzzlesBench) -> Outcome {
    let definitions = arguments.settings.iter().map(|setting| split_definition(setting, "--set"));
    let plan = BenchPlan {
        puzzles: arguments.puzzles.clone(),
        model: arguments.model.clone().into(),
        subgoals: arguments.subgoals,
        methods: arguments.methods.clone(),
        episodes: arguments.episodes,
        seeds: arguments.seeds,
        settings: definitions.collect::<Result<_, _>>()?,
    };
    let folder = &arguments.puzzles;
    let index = Index::load(folder)?
        .ok_or_else(|| format!("{}: has no index.json: make puzzles with `mge puzzles generate`", folder.display()))?;
    let file = in_batch(
        arguments.threads,
        arguments.quiet,
        |batch, on_progress| puzzles::prepare(&plan, &index, &arguments.out, batch, on_progress),
        PuzzleError::is_interruption,
    )?;
    if arguments.prepare {
        return Ok(output::line(file.display())?);
    }
    let threads = arguments.threads.unwrap_or_else(default_threads);
    let failures = sweeps::work(&Sweep::load(&file)?, &arguments.out, threads, arguments.quiet)?;
    report(arguments, index, &arguments.out)?;
    match failures.first() {
        None => Ok(()),
        Some((name, reason)) => Err(format!("{} trainings failed, such as {name}: {reason}", failures.len()).into()),
    }
}

fn report(arguments: &PuzzlesBench, index: Index, out: &Path) -> Outcome {
    let runs = evidence::read_runs(&evidence::find_runs(&[out.to_owned()])?)?;
    let words = ["mge", "puzzles", "bench"].map(str::to_owned).into_iter();
    let methods = arguments.methods.iter().flat_map(|method| ["--method".to_owned(), method.name().to_owned()]);
    let options = [
        ("--seeds", arguments.seeds.to_string()),
        ("--episodes", arguments.episodes.to_string()),
        ("--model", arguments.model.clone()),
        ("--subgoals", arguments.subgoals.to_string()),
        ("--out", out.display().to_string()),
    ];
    let settings = arguments.settings.iter().flat_map(|setting| ["--set".to_owned(), setting.clone()]);
    let command = shell_words::join(
        words
            .chain([arguments.puzzles.display().to_string()])
            .chain(methods)
            .chain(options.into_iter().flat_map(|(name, value)| [name.to_owned(), value]))
            .chain(settings),
    );
    BenchResults::new(&command, index, runs.into_iter().map(|run| run.trained.row).collect()).write(out)?;
    Ok(output::line(out.join("report.md").display())?)
}
