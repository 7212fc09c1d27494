//! Arguments of `tasks` and `puzzles`.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};

use super::{Force, Format, Jobs, Print, count};
use mge_experiments::puzzles::Split;
use mge_physics::MAX_OBJECTS;
use mge_trainer::{Method, PriorSource};

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Tasks {
    #[command(subcommand)]
    pub command: Option<TasksCommand>,
    #[command(flatten)]
    pub format: Format,
}

#[derive(Debug, Subcommand)]
pub enum TasksCommand {
    /// Validate task files
    Check {
        /// Task files, or names of shipped tasks
        #[arg(required = true)]
        files: Vec<String>,
    },
    /// Propose subgoals for a task, and print the task with them instead of its own
    Propose {
        /// Name of a shipped task, or a task file
        task: String,
        /// Maximum number of subgoals to propose
        #[arg(long, default_value_t = 2, value_parser = count(MAX_OBJECTS as u64))]
        subgoals: usize,
        /// Model that predicts the rollouts: trained, learned, rapier, true, or a model file
        #[arg(long, default_value = "trained")]
        model: PriorSource,
        /// Seed of the rollouts
        #[arg(long, default_value_t = 0)]
        seed: u64,
        /// Write to this file instead of stdout
        #[arg(long)]
        out: Option<PathBuf>,
        #[command(flatten)]
        force: Force,
    },
}

#[derive(Debug, Subcommand)]
pub enum Puzzles {
    /// Generate puzzles that uniformly random play solves, but rarely
    Generate(PuzzlesGenerate),
    /// Propose subgoals for generated puzzles, train methods on them and report; resumes
    Bench(PuzzlesBench),
}

#[derive(Debug, Args)]
pub struct PuzzlesGenerate {
    /// Total number of puzzles; those already in the folder are kept
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub count: u64,
    /// Seed of the layouts
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Purpose of the puzzles; splits have different puzzles for the same seed
    #[arg(long, default_value = "test", value_parser = split())]
    pub split: Split,
    /// Folder for the task files and index.json
    #[arg(long, default_value = "puzzles")]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    #[command(flatten)]
    pub jobs: Jobs,
}

#[derive(Debug, Args)]
pub struct PuzzlesBench {
    /// Folder of generated puzzles
    pub puzzles: PathBuf,
    /// Model that predicts the rollouts for subgoals and clusters: trained, learned, rapier, true, uniform, or a model file
    #[arg(long, default_value = "trained")]
    pub model: String,
    /// Maximum number of subgoals to propose for a puzzle
    #[arg(long, default_value_t = 2, value_parser = count(MAX_OBJECTS as u64))]
    pub subgoals: usize,
    /// A method to train; may be repeated
    #[arg(long = "method", default_values_t = [Method::USUAL])]
    pub methods: Vec<Method>,
    /// Number of seeds of each method on each puzzle, counted from 0
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Episodes of a training
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub episodes: u32,
    /// Any other setting of the trainings by its JSON path, such as refinement.every=50
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Folder for tasks, sweep.json, runs and the report
    #[arg(long, default_value = "bench")]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Train nothing: write the tasks and sweep.json for `mge sweep --plan` or `--slurm`
    #[arg(long)]
    pub prepare: bool,
    #[command(flatten)]
    pub print: Print,
    #[command(flatten)]
    pub jobs: Jobs,
}

/// Reads a split, and lists them all in the help.
fn split() -> impl TypedValueParser<Value = Split> {
    PossibleValuesParser::new(Split::ALL.map(Split::name)).try_map(|name| name.parse())
}
