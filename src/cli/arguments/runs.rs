//! Arguments of the commands on runs.

use std::path::PathBuf;

use clap::Args;

use super::{Force, Format, Print, first_seed};
use mge_guidance::EpsilonSchedule;
use mge_run::CheckpointName;
use mge_trainer::{Method, PriorSource};

#[derive(Debug, Args)]
pub struct Train {
    /// Name of a shipped task, or a task file
    pub task: String,
    /// Method: ddpg, ddpg-mge, ddpg-uniform, ddpg-mge-true, planning,
    /// ddpg-mge-adaptive, ddpg-uniform-adaptive, ddpg-adaptive or open-loop [default: ddpg-mge-adaptive]
    #[arg(long)]
    pub method: Option<Method>,
    /// Episodes to train [default: 2000]
    #[arg(long)]
    pub episodes: Option<u32>,
    /// End once 80 % of the last 100 episodes reached the goal (`stop.success`)
    #[arg(long)]
    pub until_solved: bool,
    /// Master seed [default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// Epsilon threshold: 0.1, linear:0.8:0.05:2000, exp:0.8:0.05:0.999, step:0.8:0.5:500,
    /// points:0=0.8,1000=0.3,3000=0, need:0.25:0.25:10 [default: that of the method, such as need:0.25:0.25:10 of
    /// ddpg-mge-adaptive and linear:0.5:0:1000 of ddpg-mge]
    #[arg(long)]
    pub epsilon: Option<EpsilonSchedule>,
    /// Model that predicts the rollouts: trained, learned, rapier, true, uniform, or a model file [default: trained]
    #[arg(long)]
    pub model: Option<PriorSource>,
    /// JSON file of settings, with the keys of --set, or one of paper, paper-literal, adaptive; other options take
    /// precedence
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Any other setting by its JSON path, such as ddpg.gamma=0.95
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// The run's folder [default: a new one in ./runs or $MGE_RUNS]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Resume {
    /// The runs' folders; as many runs as there are cores are trained at the same time
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
    /// New number of episodes, for runs that have fewer, or that ended early by `stop.success`
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub episodes: Option<u32>,
}

#[derive(Debug, Args)]
pub struct Fork {
    /// Folder of the run to fork
    pub run: PathBuf,
    /// Number of its episodes that the new run shares
    #[arg(long, value_name = "EPISODE")]
    pub at: u32,
    /// A setting to change after that episode, such as epsilon=0.1, ddpg.gamma=0.95 or episodes=4000
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Another task with the same number of subgoals: the name of a shipped task, or a file
    #[arg(long)]
    pub task: Option<String>,
    /// The new run's folder [default: a new one beside that of the source]
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct Runs {
    /// Runs, or folders of runs such as those of sweeps
    #[arg(env = "MGE_RUNS", default_value = "runs", value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    #[command(flatten)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct Show {
    /// The run's folder
    pub run: PathBuf,
    #[command(flatten)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct Compare {
    /// Folder of the first run
    pub first: PathBuf,
    /// Folder of the second run
    pub second: PathBuf,
    #[command(flatten)]
    pub format: Format,
}

#[derive(Debug, Args)]
pub struct Delete {
    /// The runs' folders
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// Bring deleted runs back to these folders instead
    #[arg(long)]
    pub restore: bool,
}

#[derive(Debug, Args)]
pub struct Rename {
    /// The run's folder, which keeps its place
    pub run: PathBuf,
    /// The name; an empty one is that of the folder
    pub name: String,
}

#[derive(Debug, Args)]
pub struct Evaluate {
    /// The run's folder
    pub run: PathBuf,
    /// Episodes to play
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub episodes: u32,
    /// Seed of the start noise
    #[arg(long, default_value_t = 0, value_parser = first_seed())]
    pub seed: u64,
    /// Checkpoint of the agent: last, best or the number of its episode
    #[arg(long, value_name = "NAME", default_value_t = CheckpointName::Last)]
    pub checkpoint: CheckpointName,
    /// Task to play on, with as many subgoals, and its own start noise: a name or a file [default: that of the run,
    /// with the start noise of the run]
    #[arg(long)]
    pub task: Option<String>,
    /// Also print the actor's observation before each action
    #[arg(long)]
    pub observations: bool,
}

#[derive(Debug, Args)]
pub struct Export {
    /// The run's folder
    pub run: PathBuf,
    /// Safetensors file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Checkpoint of the actor: last, best or the number of its episode
    #[arg(long, value_name = "NAME", default_value_t = CheckpointName::Last)]
    pub checkpoint: CheckpointName,
    #[command(flatten)]
    pub force: Force,
}

#[derive(Debug, Args)]
pub struct Figures {
    /// The runs' folders
    #[arg(required = true)]
    pub runs: Vec<PathBuf>,
    /// Folder for the figures [default: figures/ in that of the first run]
    #[arg(long)]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub force: Force,
    /// SVG instead of PNG
    #[arg(long, conflicts_with = "dpi")]
    pub svg: bool,
    /// Option of the learning curves, as in the script command `figure`: runs (a run or a folder of runs), curve,
    /// name, reference, success (training or greedy), against (episodes, actions or charged), width (single or
    /// double), font (points), x and y (FROM:TO), bands (on or off), height (points), smooth (points)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub options: Vec<String>,
    #[command(flatten)]
    pub print: Print,
}
