//! Arguments of `dynamics` and `clusters`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{Force, count};
use mge_dynamics::ToolSet;
use mge_trainer::PriorSource;

#[derive(Debug, Subcommand)]
pub enum Dynamics {
    /// Collect launches and train one model: one to two minutes with the default settings
    Train(DynamicsTrain),
    /// Measure the errors of a model on fresh launches and unseen scenes, as JSON
    Evaluate(DynamicsEvaluate),
}

#[derive(Debug, Args)]
pub struct DynamicsTrain {
    /// The tool set, such as box,bucket; or `create` for all of CREATE's tools with their properties
    #[arg(long)]
    pub tools: ToolSet,
    /// Model file to write
    #[arg(long)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Seed of launches, weights and batches
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Passes over the observations (paper: 5000, chosen from 1000, 2500, 5000, 10000) [default: 5000]
    #[arg(long)]
    pub epochs: Option<u32>,
    /// Linear layers of each function (paper: 17, chosen from 5, 8, 12, 17) [default: 17]
    #[arg(long)]
    pub layers: Option<usize>,
    /// Learning rate (paper: 1e-4, chosen from 1e-3, 1e-4, 1e-5) [default: 1e-4]
    #[arg(long)]
    pub learning_rate: Option<f32>,
    /// One-step observations of each tool [default: 1000]
    #[arg(long)]
    pub observations: Option<usize>,
    /// Share of samples in which a second tool is near the ball without touching it [default: 0]
    #[arg(long)]
    pub bystanders: Option<f32>,
    /// Any other setting by its name in a sweep file, such as batch=64, edges=fully_connected, loss=huber:0.5, or
    /// literal=true to follow the paper literally
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct DynamicsEvaluate {
    /// Model file, or the name of a shipped model
    pub model: String,
    /// Seed of the fresh launches
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Fresh launches of each tool
    #[arg(long, default_value_t = 300, value_parser = count(1_000_000))]
    pub launches: usize,
    /// Rollouts of each task for comparing predicted with real hits
    #[arg(long, default_value_t = 2000, value_parser = count(1_000_000))]
    pub rollouts: usize,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Clusters {
    /// Name of a shipped task, or a task file
    pub task: String,
    /// Model that predicts the rollouts: trained, learned, rapier, true, uniform, or a model file [default: trained]
    #[arg(long)]
    pub model: Option<PriorSource>,
    /// Seed of rollouts and clusters
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Write to this file instead of stdout
    #[arg(long)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub force: Force,
}
