//! Arguments of `selection`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{Force, count};
use mge_physics::ToolSplit;

#[derive(Debug, Subcommand)]
pub enum Selection {
    /// Train a policy with tools of the split `train`
    Train(SelectionTrain),
    /// Play a policy, or uniformly random actions, and print its success as a line of JSON
    Evaluate(SelectionEvaluate),
}

#[derive(Debug, Args)]
pub struct SelectionTrain {
    /// Level, such as create/Push-random, or any other task
    pub task: String,
    /// Policy file to write
    #[arg(long)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Episodes, half of them demonstrations by a lookahead
    #[arg(long, default_value_t = 200, value_parser = count(5000))]
    pub episodes: usize,
    /// Maximum number of tools and places considered before an action
    #[arg(long, default_value_t = 48, value_parser = count(1000))]
    pub candidates: usize,
    /// Seed of starts, action sets, candidates and weights
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct SelectionEvaluate {
    /// Level or other task, as in the training
    pub task: String,
    /// Policy file; without it, actions are uniformly random
    #[arg(long)]
    pub policy: Option<PathBuf>,
    /// Tools of the action sets: all, train, validation, test
    #[arg(long, default_value = "test")]
    pub split: ToolSplit,
    /// Episodes
    #[arg(long, default_value_t = 200, value_parser = count(1_000_000))]
    pub episodes: usize,
    /// Maximum number of tools and places considered before an action
    #[arg(long, default_value_t = 100, value_parser = count(1000))]
    pub candidates: usize,
    /// Seed of starts, action sets and candidates
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}
